// Rows of spaces, and a judge of RESULTs, for the trainer's end of protocol 2. R numbers are rules of spec/protocol2.md.
'use strict'
const { Refused, align, readJson, isName, isWhole } = require('./protocol2')

const SIZES = { BOOL: 1, U8: 1, I8: 1, U16: 2, I16: 2, U32: 4, I32: 4, F32: 4, U64: 8, I64: 8, F64: 8 }
const bits = (size, signed) => (signed ? [-(2 ** (8 * size - 1)), 2 ** (8 * size - 1) - 1] : [0, 2 ** (8 * size) - 1])
const ENDS = { BOOL: [0, 1], F32: [-3.4028234663852886e38, 3.4028234663852886e38], ...Object.fromEntries(Object.entries(SIZES).filter(([name]) => /^[UI]/.test(name)).map(([name, size]) => [name, bits(size, name[0] === 'I')])) }
const product = numbers => numbers.reduce((all, n) => all * n, 1)
const broken = (rule, what) => new Refused(rule, `a RESULT breaks ${rule}: ${what}`)

/// What the table of spaces asks of one, beside what its row shows (R9).
function checkSpace({ type, spaces, n, start, nvec, shape, low, high, dtype }) {
  const all = (bound, otherwise) => (Array.isArray(bound) ? bound : Array(product(shape)).fill(bound)).map(one => one ?? otherwise)
  const within = one => { const [least, most] = ENDS[dtype] ?? [one, one], value = Math.min(Math.max(one, least), most); return dtype === 'F32' ? Math.fround(value) : value }
  const isBound = one => dtype === 'F32' || dtype === 'F64' || isWhole(one)
  const fits = {
    dict: () => spaces.length > 0 && spaces.every(({ name }, i) => isName(name) && (i === 0 || Buffer.compare(Buffer.from(spaces[i - 1].name), Buffer.from(name)) < 0)),
    tuple: () => spaces.length > 0 && spaces.every(({ name }, i) => name === String(i)),
    discrete: () => isWhole(n) && n >= 1 && isWhole(start ?? 0) && Math.abs(start ?? 0) < 2 ** 30 && (start ?? 0) + n <= 2 ** 31,
    multi_discrete: () => nvec.length > 0 && nvec.every(one => isWhole(one) && one >= 1 && one <= 2 ** 31) && product(shape ?? [nvec.length]) === nvec.length,
    multi_binary: () => isWhole(n) && n >= 1 && product(shape ?? [n]) === n,
    box: () => {
      const lows = all(low, -Infinity), highs = all(high, Infinity), count = product(shape)
      return lows.length === count && highs.length === count && lows.every((one, i) => within(one) <= within(highs[i])) && [...lows, ...highs].every(isBound)
    }
  }[type]
  if (!fits?.()) throw new Refused('MALFORMED', `a space of type ${type} that its table does not allow`)
}

/// The leaves of a space, where they lie in a row, and how many mask bytes each choice has.
function layout(space) {
  const leaves = []
  let bytes = 0, widest = 1
  const append = (space, path) => {
    checkSpace(space)
    if (space.type === 'dict' || space.type === 'tuple') return space.spaces.forEach(({ name, space }) => append(space, [...path, name]))
    const leaf = {
      discrete: () => ({ dtype: 'I32', count: 1, low: space.start ?? 0, choices: [space.n] }),
      multi_discrete: () => ({ dtype: 'I32', count: space.nvec.length, low: 0, choices: space.nvec }),
      multi_binary: () => ({ dtype: 'U8', count: space.n, low: 0, choices: Array(space.n).fill(2) }),
      box: () => ({ dtype: space.dtype, count: product(space.shape), choices: [] })
    }[space.type]?.()
    if (!leaf || !SIZES[leaf.dtype] || !(leaf.count >= 1)) throw new Refused('MALFORMED', `a space of type ${space.type}`)
    const size = SIZES[leaf.dtype]
    leaf.offset = Math.ceil(bytes / size) * size
    bytes = leaf.offset + size * leaf.count
    widest = Math.max(widest, size)
    leaves.push({ ...leaf, space, path: path.join('/') })
  }
  append(space, [])
  if (new Set(leaves.map(({ path }) => path)).size < leaves.length) throw new Refused('MALFORMED', 'two leaves of one path')
  bytes = Math.ceil(bytes / widest) * widest
  const choices = leaves.flatMap(leaf => leaf.choices)
  return { leaves, bytes, choices, maskBytes: choices.reduce((sum, n) => sum + n, 0) }
}

/// What SPEC says of a row must be what its space makes (R33).
function checkRow(said, { leaves, bytes }) {
  const fits = said && said.bytes === bytes && said.leaves?.length === leaves.length &&
    leaves.every((leaf, i) => ['path', 'dtype', 'count', 'offset'].every(key => said.leaves[i][key] === leaf[key]))
  if (!fits) throw new Refused('MALFORMED', `a row is ${JSON.stringify(said)}`)
}

/// Element `i` of a leaf.
function element(leaf, row, i) {
  const at = leaf.offset + i * SIZES[leaf.dtype]
  return { I32: () => row.readInt32LE(at), U8: () => row[at], F32: () => row.readFloatLE(at), F64: () => row.readDoubleLE(at) }[leaf.dtype]?.() ?? 0
}

const isObject = value => { if (!value || typeof value !== 'object' || Array.isArray(value)) throw new Error('no object'); return value }

/// Remembers what a session's RESULTs have said (same_step; all environments are stepped), and judges the next one.
class Judge {
  constructor(environments, behaviours) {
    let at = 8
    this.behaviours = behaviours.map(said => {
      const slots = environments * said.agents.length, seen = layout(said.observation), done = layout(said.action)
      const masked = said.masks_actions === true && done.maskBytes > 0
      checkRow(said.observation_row, seen)
      checkRow(said.action_row, done)
      if (said.mask_bytes !== undefined && said.mask_bytes !== (masked ? done.maskBytes : 0)) throw new Refused('MALFORMED', `mask_bytes ${said.mask_bytes}`)
      const rows = at, rewards = align(rows + slots * seen.bytes), states = rewards + 8 * slots, masks = align(states + slots)
      at = align(masks + (masked ? slots * done.maskBytes : 0))
      return { slots, seen, done, masked, rows, rewards, states, masks, end: at, was: Buffer.alloc(slots) }
    })
    this.size = at
  }

  /// Whether somebody takes part.
  judge(payload, stepped) {
    if (payload.length < this.size) throw broken('R60', `${payload.length} bytes, at least ${this.size}`)
    const parts = payload.readUInt32LE(0)
    let end = this.size, finals = 0
    const places = this.behaviours.map(({ slots, states, seen }) => {
      const place = end, count = payload.subarray(states, states + slots).filter(state => state & 4).length
      finals += count
      end = this.padded(payload, place + count * seen.bytes)
      return place
    })
    if (parts > 3 || (finals > 0) !== ((parts & 1) === 1)) throw broken('R61', `parts ${parts} with ${finals} final rows`)
    const infos = end
    if (parts & 2) {
      if (payload.length < end + 4) throw broken('R60', 'no infos')
      end = this.padded(payload, end + 4 + payload.readUInt32LE(end))
    }
    if (payload.length !== end) throw broken('R60', `${payload.length} bytes, expected ${end}`)
    if (parts & 2) this.infos(payload.subarray(infos + 4, infos + 4 + payload.readUInt32LE(infos)), payload)
    this.behaviours.forEach((behaviour, b) => {
      const { slots, seen, done, masked, rows, rewards, states, masks } = behaviour
      this.padded(payload, rows + slots * seen.bytes)
      this.padded(payload, states + slots)
      this.padded(payload, masks + (masked ? slots * done.maskBytes : 0))
      for (let slot = 0, final = places[b]; slot < slots; slot++) {
        const state = payload[states + slot], reward = payload.readDoubleLE(rewards + 8 * slot)
        this.state(state, stepped && (behaviour.was[slot] & 16) !== 0, reward, slot)
        if (state & 16 && masked) this.mask(done.choices, payload.subarray(masks + slot * done.maskBytes), slot)
        if (state & 19) this.row(seen, payload.subarray(rows + slot * seen.bytes), slot)
        if (state & 4) { this.row(seen, payload.subarray(final), slot); final += seen.bytes }
      }
      payload.copy(behaviour.was, 0, states, states + slots)
    })
    return this.behaviours.some(({ was }) => was.some(state => state & 16))
  }

  /// The end of the block that is full at `from`; what lies between is 0.
  padded(payload, from) {
    for (let at = from; at < Math.min(align(from), payload.length); at++) if (payload[at]) throw broken('R62', `byte ${at} is ${payload[at]}`)
    return align(from)
  }

  state(state, played, reward, slot) {
    const ends = state & 3, has = bit => (state & bit) !== 0
    if (state > 31) throw broken('R63', `slot ${slot} has state ${state}`)
    if (has(8) && !has(16)) throw broken('R64', `slot ${slot} has state ${state}`)
    if (!played && (reward !== 0 || state & 7)) throw broken('R65', `slot ${slot} took no part and has reward ${reward}, state ${state}`)
    if (!Number.isFinite(reward)) throw broken('R75', `slot ${slot} has reward ${reward}`)
    if (!played && has(16) && !has(8)) throw broken('R66', `slot ${slot} begins with state ${state}`)
    if (played && !ends && state !== 16) throw broken('R67', `slot ${slot} goes on with state ${state}`)
    if (played && ends && ((!has(4) && state !== 2) || has(8) !== has(16))) throw broken('R68', `slot ${slot} ends with state ${state}`)
  }
  mask(choices, mask, slot) {
    let at = 0
    for (const count of choices) {
      const legal = mask.subarray(at, at += count)
      if (legal.some(byte => byte > 1)) throw broken('R71', `slot ${slot}`)
      if (!legal.includes(1)) throw broken('R72', `slot ${slot} has no legal action`)
    }
  }
  row(seen, row, slot) {
    for (const leaf of seen.leaves) {
      for (let i = 0; i < leaf.count; i++) {
        const value = element(leaf, row, i), n = leaf.choices[i]
        if (!Number.isFinite(value)) throw broken('R75', `${leaf.path} of slot ${slot} is ${value}`)
        if (n !== undefined && (value < leaf.low || value >= leaf.low + n)) throw broken('R73', `${leaf.path} of slot ${slot} is ${value}`)
      }
    }
  }
  infos(bytes, payload) {
    const states = Buffer.concat(this.behaviours.map(({ slots, states }) => payload.subarray(states, states + slots)))
    try {
      const said = readJson(bytes)
      const part = name => name in said ? said[name] : {}
      for (const [columns, may] of [[part('infos'), () => true], [part('final_infos'), slot => states[slot] & 4]])
        for (const { slots: of, values } of Object.values(isObject(columns)))
          if (of.length !== values.length || new Set(of).size < of.length || !of.every(slot => slot in states && isWhole(slot) && may(slot))) throw new Error('a column')
    } catch (error) { throw broken('R74', error.message) }
  }
}

module.exports = { Judge, element }
