// A trainer's end of protocol 2 in JavaScript (node 20, no packages): any engine, actions drawn from what is legal; where an engine has one
// behaviour with one discrete action it learns by a table (Q-learning), enough for engine.js beside it.
//   node examples/javascript/trainer.js [port] [steps] [deadline]     0 steps: until the engine ends the session, and then anew;
//                                                                     an answer may take so many seconds (60)
'use strict'
const net = require('net')
const { TYPES, LAST_LIMIT, Refused, FrameReader, align, frame, readJson, member, isText, isWhole, isTexts, isName } = require('./protocol2')
const { Judge, element } = require('./result')
const { HELLO, WELCOME, CONFIGURE, SPEC, RESET, STEP, RESULT, ERROR, GOAWAY, BYE, PING, PONG, PAUSED, RESUMED } = TYPES
const DEADLINE = 1000 * Number(process.argv[4] ?? 60), NAMES = Object.fromEntries(Object.entries(TYPES).map(([name, type]) => [type, name]))  // ms

/// Learns what a discrete action is worth from each row of observations, byte by byte.
class Table {
  constructor() { this.worth = new Map() }
  of(row, n) {
    const key = row.toString('latin1')
    if (!this.worth.has(key)) this.worth.set(key, new Float64Array(n))
    return this.worth.get(key)
  }
  choose(row, n, legal) {
    const worth = this.of(row, n)
    return Math.random() < 0.1 ? legal[Math.floor(Math.random() * legal.length)] : legal.reduce((best, i) => (worth[i] > worth[best] ? i : best))
  }
  learn(row, n, action, reward, next) {
    const worth = this.of(row, n)
    worth[action] += 0.3 * (reward + 0.95 * (next ? Math.max(...this.of(next, n)) : 0) - worth[action])
  }
}

/// One session, from HELLO to BYE.
class Trainer {
  constructor(port, steps) {
    Object.assign(this, { steps, reader: new FrameReader(), session: 0, request: 0, awaited: WELCOME, table: new Table(), returns: [] })
    this.over = new Promise(resolve => { this.end = resolve })
    this.socket = net.connect(port, '127.0.0.1', () => {
      this.send(HELLO, 0, { protocol: [2, 2], client: 'trainer.js', max_frame: LAST_LIMIT })
      this.wait()
    })
    this.socket.setNoDelay(true)
    this.socket.on('data', data => this.take(data))
    this.socket.on('error', error => this.leave(error.message, error.code === 'ECONNREFUSED'))
    this.socket.on('close', () => this.leave('the engine closed the connection'))
  }
  /// Ends the session, with BYE where it is not over already (R85).
  leave(why, nobody = false) {
    clearTimeout(this.timer)
    if (this.met && !this.left && !this.socket.destroyed) this.send(BYE, 0, Buffer.alloc(0))
    this.left = true
    this.socket.destroySoon()
    this.end({ why, nobody })
  }
  /// So long an answer may take, while the engine is not paused (R83).
  wait() {
    clearTimeout(this.timer)
    if (!this.paused) this.timer = setTimeout(() => this.leave('the engine is silent'), DEADLINE)
  }
  send(type, request, payload) {
    this.socket.write(frame(type, request, this.session, Buffer.isBuffer(payload) ? payload : Buffer.from(JSON.stringify(payload))))
  }
  ask(type, payload, awaited) {
    this.awaited = awaited
    this.send(type, ++this.request, payload)
    this.wait()
  }

  take(data) {
    this.reader.feed(data)
    try {
      for (let arrived; !this.left && (arrived = this.reader.next());) this.handle(arrived)
    } catch (error) {
      if (!(error instanceof Refused)) throw error
      this.leave(error.message)
    }
  }
  handle({ type, request, payload }) {
    this.met = this.met || type === WELCOME  // from here on the engine hears BYE, whatever WELCOME holds
    if (type === PING && payload.length > 64) return this.leave('a PING of more than 64 bytes')
    if (type === PING) return this.send(PONG, 0, payload)
    if (type === PONG || type & 0x8000) return
    if (type === PAUSED || type === RESUMED) {
      this.paused = type === PAUSED
      this.deserted = undefined
      return this.wait()
    }
    if (type === ERROR || type === GOAWAY) {
      const said = type === ERROR ? readJson(payload) : {}
      if (type === ERROR && !['code', 'severity', 'message'].every(name => isText(said[name]))) throw new Refused('MALFORMED', 'an ERROR without what it must have')
      for (const [name, fits] of [['env', isWhole], ['path', isText]]) member(said, name, fits)
      if (said.code === 'UNSUPPORTED' && said.severity === 'request' && request === this.request && this.seeded) return this.reset(false)  // R47
      this.left = type === GOAWAY || said.severity === 'connection'
      return this.leave(`${NAMES[type]}: ${payload}`)
    }
    if (type !== this.awaited || request !== this.request) return this.leave(`type ${type}, number ${request}; expected ${NAMES[this.awaited]}, ${this.request}`)
    if (type === WELCOME) return this.welcome(readJson(payload))
    if (type === SPEC) return this.spec(readJson(payload))
    this.result(payload)
  }

  welcome(said) {
    if (member(said, 'protocol', isWhole) !== 2) throw new Refused('UNSUPPORTED_VERSION', 'WELCOME of another version')
    const session = member(said, 'session', isWhole)
    if (!(session >= 1 && session < 2 ** 32)) throw new Refused('MALFORMED', 'WELCOME without session')
    this.session = session
    if (member(said, 'capabilities', isTexts, []).length > 0) throw new Refused('MALFORMED', 'a capability that HELLO has not named')
    if (member(said, 'resumed', value => typeof value === 'boolean')) throw new Refused('MALFORMED', 'a session that nobody resumed')
    member(said, 'heartbeat_s', value => typeof value === 'number' && value > 0)
    for (const name of ['server', 'resume']) member(said, name, isText)
    member(said, 'last_request', isWhole)
    this.reader.limit = Math.min(Math.max(member(said, 'max_frame', isWhole, LAST_LIMIT), 4096), LAST_LIMIT)
    this.ask(CONFIGURE, { autoreset: 'same_step' }, SPEC)
  }
  spec(said) {
    if (member(said, 'autoreset', isText, 'same_step') !== 'same_step') throw new Refused('MALFORMED', 'another autoreset')
    this.environments = member(said, 'environments', isWhole, 0)
    const behaviours = member(said, 'behaviours', Array.isArray, [])
    if (this.environments < 1 || behaviours.length === 0) throw new Refused('MALFORMED', 'SPEC offers nothing')
    for (const name of ['id', 'model_name']) if (member(said, name, isText, '') !== '') member(said, name, isName)
    for (const name of ['max_episode_steps', 'training_length']) member(said, name, value => isWhole(value) && value >= 0)
    member(said, 'deterministic', value => typeof value === 'boolean')
    member(said, 'hash', isText)
    const sizes = ['bytes', 'request_offset', 'request_bytes', 'result_offset', 'result_bytes', 'spin_us']
    member(said, 'shm', value => isText(value?.path) && sizes.every(name => isWhole(value[name])))  // of no use here (section 12)
    const names = behaviours.map(({ name }) => String(name).replace(/[A-Z]/g, letter => letter.toLowerCase()))  // as files, all are small
    if (new Set(names).size < names.length) throw new Refused('MALFORMED', 'behaviours that differ in capitals alone')
    for (const behaviour of behaviours) {
      const agents = member(behaviour, 'agents', isTexts, [])
      if (!isName(behaviour.name) || !agents.length || !agents.every(isName) || new Set(agents).size < agents.length) throw new Refused('MALFORMED', 'a behaviour')
      member(behaviour, 'masks_actions', value => typeof value === 'boolean')
    }
    this.judge = new Judge(this.environments, behaviours)
    const [{ done }] = this.judge.behaviours
    this.learns = behaviours.length === 1 && done.leaves.length === 1 && done.leaves[0].space.type === 'discrete'
    this.slots = this.judge.behaviours.reduce((sum, { slots }) => sum + slots, 0)
    this.reset(true)
  }

  reset(seeded) {
    this.seeded = seeded
    const seeds = align(8 + this.environments)
    const payload = Buffer.alloc(seeds + (seeded ? 8 * this.environments : 0))
    payload.writeUInt32LE(seeded ? 1 : 0, 0)
    payload.fill(1, 8, 8 + this.environments)
    for (let env = 0; env < this.environments && seeded; env++) payload.writeBigInt64LE(BigInt(env), seeds + 8 * env)
    this.ask(RESET, payload, RESULT)
  }

  result(payload) {
    this.seeded = false
    const anyone = this.judge.judge(payload, this.actions !== undefined)
    this.deserted = anyone ? undefined : this.deserted ?? Date.now()
    if (Date.now() - this.deserted > DEADLINE) return this.leave('nobody takes part: state 16 is set for no slot (R77)')
    this.count = (this.count ?? -this.slots) + this.slots  // RESET steps nothing
    if (this.learns) this.learn(payload)
    if (this.steps && this.count >= this.steps) {
      return this.leave('done')
    }
    this.step(payload)
  }
  step(payload) {
    const blocks = this.judge.behaviours.map(({ slots, done, seen, masked, rows, masks }) => {
      const block = Buffer.alloc(align(slots * done.bytes))
      for (let slot = 0; slot < slots; slot++) {
        const mask = masked ? payload.subarray(masks + slot * done.maskBytes, masks + (slot + 1) * done.maskBytes) : null
        const row = block.subarray(slot * done.bytes, (slot + 1) * done.bytes)
        let at = 0  // in the mask
        for (const leaf of done.leaves) {
          for (let i = 0; i < leaf.count; i++) {
            const n = leaf.choices[i]
            if (n === undefined) { this.draw(leaf, row, i); continue }
            const legal = [...Array(n).keys()].filter(choice => !mask || mask[at + choice]), seenRow = payload.subarray(rows + slot * seen.bytes, rows + (slot + 1) * seen.bytes)
            at += n
            const choice = legal.length === 0 ? 0 : this.learns ? this.table.choose(seenRow, n, legal) : legal[Math.floor(Math.random() * legal.length)]
            if (leaf.dtype === 'U8') row[leaf.offset + i] = choice
            else row.writeInt32LE(leaf.low + choice, leaf.offset + 4 * i)
          }
        }
      }
      return block
    })
    this.actions = blocks[0]
    this.before = Buffer.from(payload)
    const head = Buffer.alloc(align(8 + this.environments))
    head.fill(1, 8, 8 + this.environments)
    this.ask(STEP, Buffer.concat([head, ...blocks]), RESULT)
  }
  /// A number between a box's bounds; between -1 and 1 where it has none.
  draw({ space, dtype, offset }, row, i) {
    const bound = (side, otherwise) => (Array.isArray(side) ? side[i] : side) ?? otherwise
    const low = bound(space.low, Math.min(-1, bound(space.high, 1) - 1)), high = bound(space.high, Math.max(1, low + 1)), value = low + Math.random() * (high - low)
    if (dtype === 'F32') row.writeFloatLE(Math.fround(value), offset + 4 * i)
    else if (dtype === 'F64') row.writeDoubleLE(value, offset + 8 * i)
    else throw new Refused('UNSUPPORTED', `this trainer draws no ${dtype}`)
  }

  learn(payload) {
    const [{ slots, seen, done, rows, rewards, states, end }] = this.judge.behaviours, n = done.leaves[0].choices[0], low = done.leaves[0].low
    this.sums ??= new Float64Array(slots)
    for (let slot = 0, final = end; this.actions && slot < slots; slot++) {
      const row = bytes => bytes.subarray(rows + slot * seen.bytes, rows + (slot + 1) * seen.bytes)
      const state = payload[states + slot], reward = payload.readDoubleLE(rewards + 8 * slot)
      const last = state & 4 ? payload.subarray(final, final += seen.bytes) : row(payload)
      if (!(this.before[states + slot] & 16)) continue
      this.table.learn(row(this.before), n, element(done.leaves[0], this.actions.subarray(slot * done.bytes), 0) - low, reward, state & 1 ? null : last)
      this.sums[slot] += reward
      if (state & 3) { this.returns.push(this.sums[slot]); this.sums[slot] = 0 }
    }
  }
}

async function main() {
  const port = Number(process.argv[2] ?? 5005), steps = Number(process.argv[3] ?? 20000)
  for (let alone = 0; alone < 30;) {
    const trainer = new Trainer(port, steps), { why, nobody } = await trainer.over
    if (steps) {
      const last = trainer.returns.slice(-200), mean = last.reduce((sum, value) => sum + value, 0) / last.length
      console.log(`${why}: ${trainer.returns.length} episodes, mean return of the last ${last.length}: ${mean.toFixed(3)}`)
      process.exit(why === 'done' ? 0 : 1)
    }
    alone = nobody ? alone + 1 : 0
    if (nobody) await new Promise(resolve => setTimeout(resolve, 100))
  }
}
main()
