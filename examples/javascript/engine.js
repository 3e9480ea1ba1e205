// An engine of protocol 2 in JavaScript (node 20, no packages), after spec/protocol2_engine.md: one trainer at a time, several worlds.
// Each world is a road with an actor and a coin; a step to the left or to the right that leaves the road is not legal.
//   node examples/javascript/engine.js [port] [worlds]        then        consac train tcp://127.0.0.1:5005 --steps 30000
'use strict'
const net = require('net')
const { TYPES, FIRST_LIMIT, LAST_LIMIT, CONNECTION, Refused, FrameReader, align, frame, readJson, member, isText, isWhole, isTexts, checkNames } = require('./protocol2')
const { HELLO, WELCOME, CONFIGURE, SPEC, RESET, STEP, RESULT, ERROR, BYE, PING, PONG, RENDER } = TYPES

// ---- The game

const ROAD = 10, LIMIT = 50  // places, steps

class Road {
  constructor(seed) { this.seed(seed); this.begin() }
  seed(seed) { this.state = (Number(seed & 0xFFFFFFFFn) ^ 0x9E3779B9) >>> 0 }
  random(below) {  // xorshift
    let x = this.state || 1
    x ^= x << 13; x ^= x >>> 17; x ^= x << 5
    this.state = x >>> 0
    return this.state % below
  }
  begin() {
    this.actor = this.random(ROAD)
    this.coin = (this.actor + 1 + this.random(ROAD - 1)) % ROAD
    this.steps = 0
  }
  /// 0 left, 1 right.
  step(action) {
    this.actor = Math.min(Math.max(this.actor + (action === 1 ? 1 : -1), 0), ROAD - 1)
    this.steps += 1
    const terminated = this.actor === this.coin
    return { reward: terminated ? 1 : -0.05, terminated, truncated: !terminated && this.steps === LIMIT }
  }
  write(at) { at.writeFloatLE(this.actor / ROAD, 0); at.writeFloatLE(this.coin / ROAD, 4) }
  mask() { return [this.actor > 0 ? 1 : 0, this.actor < ROAD - 1 ? 1 : 0] }
}

const ROW = 8, MASK = 2, ACTION = 4  // bytes of a row of observations, of masks, of actions

function spec(worlds) {
  const place = { type: 'box', shape: [1], dtype: 'F32', low: 0, high: 1 }
  return {
    id: 'road-with-masks-v0', environments: worlds, max_episode_steps: LIMIT, autoreset: 'same_step', deterministic: true,
    behaviours: [{
      name: 'default', agents: ['agent'],
      observation: { type: 'dict', spaces: [{ name: 'actor', space: place }, { name: 'coin', space: place }] },
      action: { type: 'discrete', n: 2 }, masks_actions: true, mask_bytes: MASK,
      observation_row: { bytes: ROW, leaves: [{ path: 'actor', dtype: 'F32', count: 1, offset: 0 }, { path: 'coin', dtype: 'F32', count: 1, offset: 4 }] },
      action_row: { bytes: ACTION, leaves: [{ path: '', dtype: 'I32', count: 1, offset: 0 }] }
    }]
  }
}

// ---- The protocol

/// Path of the first difference of `found` from what was expected (R32); null for none.
function difference(expected, found, path) {
  const lists = Array.isArray(expected) && Array.isArray(found)
  if (lists ? expected.length !== found.length : !(expected && found && typeof expected === 'object' && typeof found === 'object'))
    return expected === found ? null : path
  if (Array.isArray(expected) !== Array.isArray(found)) return path
  for (const key of Object.keys(expected)) {
    const below = difference(expected[key], found[key], `${path}/${key}`)
    if (below) return below
  }
  return null
}

let sessions = 0  // begun so far

/// One connection of one trainer: its session ends with it.
class Session {
  constructor(socket, worlds) {
    Object.assign(this, { socket, worlds, reader: new FrameReader(), number: 0, last: 0, answer: null, phase: 'hello' })
    this.offer = spec(worlds)
    this.rows = 8
    this.rewards = align(this.rows + worlds * ROW)
    this.states = this.rewards + worlds * 8
    this.masks = align(this.states + worlds)
    this.size = align(this.masks + worlds * MASK)
    this.head = align(8 + worlds)  // of RESET and STEP
    this.result = Buffer.alloc(this.size)
    socket.setNoDelay(true)
    socket.on('data', data => this.take(data))
    socket.on('error', () => {})
  }

  send(type, request, payload) {
    const bytes = frame(type, request, this.number, payload)
    this.socket.write(bytes)
    return bytes
  }
  refuse(error, request) {
    const severity = CONNECTION.has(error.code) || this.phase === 'hello' ? 'connection' : 'request'
    const said = { code: error.code, severity, message: error.message.slice(0, 300).toWellFormed(), ...error.more }  // all of it within 4096 bytes (R17)
    const bytes = this.send(ERROR, request, Buffer.from(JSON.stringify(said)))
    if (severity === 'connection') { this.phase = 'over'; this.socket.end() }
    return bytes
  }

  take(data) {
    if (this.phase !== 'over') this.reader.feed(data)
    while (this.phase !== 'over') {
      let arrived
      try {
        if (!(arrived = this.reader.next())) return
        this.handle(arrived)
      } catch (error) {
        if (!(error instanceof Refused)) throw error
        this.refuse(error, error.request ?? arrived?.request ?? 0)
      }
    }
  }

  handle({ type, request, session, payload }) {
    if (type === PONG || type & 0x8000) return
    if (type === BYE) { this.phase = 'over'; return this.socket.end() }
    if (this.phase === 'hello') return this.hello(type, payload)
    if (type === PING) {
      if (payload.length > 64) throw new Refused('MALFORMED', 'a PING of more than 64 bytes')
      return this.send(PONG, 0, payload)
    }
    if (type === HELLO || (session !== 0 && session !== this.number) || (request !== this.last && request !== this.last + 1))
      return this.refuse(new Refused('BAD_STATE', `type ${type}, request ${request} of session ${session}`), request)
    if (request === this.last && this.answer) return this.socket.write(this.answer)
    if (request !== this.last + 1) return this.refuse(new Refused('BAD_STATE', 'requests are numbered from 1'), request)
    this.last = request
    try {
      this.answer = this.send(...this.carryOut(type, request, payload))
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.answer = this.refuse(error, request)
    }
  }

  hello(type, payload) {
    if (type !== HELLO) throw new Refused('BAD_STATE', 'HELLO comes first')
    const said = readJson(payload)
    const range = member(said, 'protocol', value => Array.isArray(value) && value.length === 2 && value.every(isWhole))
    if (!range) throw new Refused('MALFORMED', 'HELLO without protocol')
    if (range[0] > 2 || range[1] < 2) throw new Refused('UNSUPPORTED_VERSION', 'this engine speaks 2', { protocol: [2, 2] })
    member(said, 'capabilities', isTexts)
    member(said, 'token', isText)
    member(said, 'client', isText)
    if (member(said, 'resume', isText, '') !== '') throw new Refused('AUTH_FAILED', 'sessions end with their connection')
    const limit = this.reader.limit = Math.min(Math.max(member(said, 'max_frame', isWhole, LAST_LIMIT), FIRST_LIMIT), LAST_LIMIT)
    this.number = ++sessions
    this.phase = 'configure'
    this.send(WELCOME, 0, Buffer.from(JSON.stringify({ protocol: 2, session: this.number, capabilities: [], max_frame: limit, server: 'engine.js' })))
  }

  carryOut(type, request, payload) {
    const wants = { [CONFIGURE]: ['configure', 'reset'], [RESET]: ['reset', 'step'], [STEP]: ['step'] }[type]
    if (type === RENDER) throw new Refused('UNSUPPORTED', 'this engine draws nothing')
    if (!wants) throw new Refused('UNKNOWN_MESSAGE', `type ${type}`)
    if (!wants.includes(this.phase)) throw new Refused('BAD_STATE', `type ${type} does not belong here`)
    if (type === CONFIGURE) return [SPEC, request, this.configure(readJson(payload))]
    if (type === RESET) this.reset(payload)
    else this.step(payload)
    return [RESULT, request, this.answerBytes]
  }
  configure(said) {
    const autoreset = member(said, 'autoreset', isText, 'same_step'), transport = member(said, 'transport', isText, 'tcp')
    const expected = member(said, 'expect', Array.isArray)
    checkNames(expected)
    if (autoreset !== 'same_step' || transport !== 'tcp') throw new Refused('UNSUPPORTED', 'same_step and tcp only')
    const path = expected ? difference(expected, this.offer.behaviours, 'behaviours') : null
    if (path) throw new Refused('SPEC_MISMATCH', `${path} is another; the engine offers ${JSON.stringify(this.offer.behaviours)}`, { path: path.slice(0, 300).toWellFormed() })
    const text = Buffer.from(JSON.stringify(this.offer)), largest = Math.max(text.length, align(this.size + this.worlds * ROW))  // STEP is shorter
    if (largest > this.reader.limit) throw new Refused('UNSUPPORTED', `${largest} bytes do not fit into max_frame`)
    this.phase = 'reset'
    return text
  }

  /// The words of RESET and STEP (R42), and their byte for each world (R43).
  words(payload, flags) {
    if (payload.length < 8) throw new Refused('WRONG_SIZE', `${payload.length} bytes`)
    if (payload.readUInt32LE(0) & ~flags || payload.readUInt32LE(4)) throw new Refused('MALFORMED', 'unknown flags are 0')
  }
  chosen(payload) {
    const chosen = payload.subarray(8, 8 + this.worlds)
    const env = chosen.findIndex(byte => byte > 1)
    if (env >= 0) throw new Refused('OUT_OF_RANGE', `${chosen[env]} for environment ${env}`, { env })
    return chosen
  }
  reset(payload) {
    this.words(payload, 3)
    const flags = payload.readUInt32LE(0), seeded = flags & 1, seeds = this.head, text = seeds + (seeded ? 8 * this.worlds : 0) + 4
    const length = flags & 2 && payload.length >= text ? payload.readUInt32LE(text - 4) : 0
    if (payload.length !== (flags & 2 ? align(text + length) : text - 4)) throw new Refused('WRONG_SIZE', `RESET of ${payload.length} bytes`)
    const chosen = this.chosen(payload)
    for (let env = 0; seeded && env < this.worlds; env++)
      if (chosen[env] && payload.readBigInt64LE(seeds + 8 * env) < 0n) throw new Refused('OUT_OF_RANGE', 'a negative seed', { env })
    if (flags & 2) readJson(payload.subarray(text, text + length))
    if (this.phase === 'reset' && chosen.includes(0)) throw new Refused('BAD_STATE', 'the first RESET is of every environment')
    if (this.phase === 'reset') this.roads = Array.from({ length: this.worlds }, (_, env) => new Road(BigInt(1000 * this.number + env)))
    this.phase = 'step'
    for (let env = 0; env < this.worlds; env++) {
      this.tell(env, 0, this.result[this.states + env] & 24)
      if (!chosen[env]) continue
      if (seeded) this.roads[env].seed(payload.readBigInt64LE(seeds + 8 * env))
      this.roads[env].begin()
      this.tell(env, 0, 24)
    }
    this.finish([])
  }
  step(payload) {
    this.words(payload, 0)
    if (payload.length !== align(this.head + this.worlds * ACTION)) throw new Refused('WRONG_SIZE', `STEP of ${payload.length} bytes`)
    const chosen = this.chosen(payload)
    const action = env => payload.readInt32LE(this.head + ACTION * env)
    for (let env = 0; env < this.worlds; env++)
      if (chosen[env] && action(env) !== 0 && action(env) !== 1) throw new Refused('OUT_OF_RANGE', `action ${action(env)}; 0 or 1`, { env })
    const finals = []
    for (let env = 0; env < this.worlds; env++) {
      this.tell(env, 0, this.result[this.states + env] & 24)
      if (!chosen[env]) continue
      const road = this.roads[env], { reward, terminated, truncated } = road.step(action(env))
      if (terminated || truncated) {
        const final = Buffer.alloc(ROW)
        road.write(final)
        finals.push(final)
        road.begin()
      }
      this.tell(env, reward, terminated ? 29 : truncated ? 30 : 16)
    }
    this.finish(finals)
  }
  tell(env, reward, state) {
    this.roads[env].write(this.result.subarray(this.rows + ROW * env))
    this.result.writeDoubleLE(reward, this.rewards + 8 * env)
    this.result[this.states + env] = state
    this.roads[env].mask().forEach((legal, choice) => { this.result[this.masks + MASK * env + choice] = legal })
  }
  finish(finals) {
    this.result.writeUInt32LE(finals.length > 0 ? 1 : 0, 0)
    const bytes = Buffer.concat([this.result, ...finals])
    this.answerBytes = Buffer.concat([bytes, Buffer.alloc(align(bytes.length) - bytes.length)])
  }
}

const port = Number(process.argv[2] ?? 5005), worlds = Number(process.argv[3] ?? 8)
const server = net.createServer({ allowHalfOpen: true }, socket => {
  socket.on('end', () => socket.end())
  return new Session(socket, worlds)
})
server.listen(port, '127.0.0.1', () => console.log(`listening on tcp://127.0.0.1:${server.address().port}`))
