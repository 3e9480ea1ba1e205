// What both ends of protocol 2 need: frames, CRC, JSON. spec/protocol2.md is the law; R numbers are its rules.
'use strict'

const TYPES = { HELLO: 1, WELCOME: 2, CONFIGURE: 3, SPEC: 4, RESET: 5, STEP: 6, RESULT: 7, ERROR: 8, GOAWAY: 9, BYE: 10, PING: 11, PONG: 12, PAUSED: 13, RESUMED: 14, RENDER: 15 }
const FIRST_LIMIT = 4096, LAST_LIMIT = 1 << 26  // bytes of payload before WELCOME, and ever
const CONNECTION = new Set(['BAD_MAGIC', 'MALFORMED', 'FRAME_TOO_LARGE', 'CRC_MISMATCH', 'UNSUPPORTED_VERSION', 'AUTH_FAILED', 'CAPACITY'])

/// The next multiple of 8.
const align = n => Math.ceil(n / 8) * 8

/// Something that the other end said and should not have; `code` as in the table of errors.
class Refused extends Error {
  constructor(code, message, more = {}, request) { super(message); Object.assign(this, { code, more, request }) }
}

const CRC_TABLE = Array.from({ length: 256 }, (_, n) => {
  for (let bit = 0; bit < 8; bit++) n = n & 1 ? (n >>> 1) ^ 0x82F63B78 : n >>> 1
  return n >>> 0
})
function crc32c(bytes) {
  let crc = 0xFFFFFFFF
  for (const byte of bytes) crc = CRC_TABLE[(crc ^ byte) & 255] ^ (crc >>> 8)
  return (crc ^ 0xFFFFFFFF) >>> 0
}

/// One object (R7): JSON.parse takes names that come twice, any depth, half a surrogate pair, and reads 1e999 as infinity.
function readJson(bytes) {
  if (bytes.length > 1 << 20) throw new Refused('MALFORMED', 'more than 1 MiB of JSON')
  let text, value, values = 0
  try {
    text = new TextDecoder('utf-8', { fatal: true, ignoreBOM: true }).decode(bytes)
    value = JSON.parse(text, (name, value) => {
      const fits = name.isWellFormed() && (isText(value) ? value.isWellFormed() : typeof value !== 'number' || Number.isFinite(value))
      if (!fits || ++values > 1 << 18) throw new Error('a name, text or number that cannot be, or too many')
      return value
    })
  } catch (error) { throw new Refused('MALFORMED', error.message) }
  if (value === null || typeof value !== 'object' || Array.isArray(value)) throw new Refused('MALFORMED', 'no JSON object')
  const open = []
  let last = null
  for (const [token] of text.matchAll(/"(?:[^"\\]|\\.)*"|[{}[\]:]/g)) {
    if (token === '{' || token === '[') open.push(new Set())
    else if (token === '}' || token === ']') open.pop()
    else if (token === ':') {
      const name = JSON.parse(last)
      if (open.at(-1).has(name)) throw new Refused('MALFORMED', `${name} twice`)
      open.at(-1).add(name)
    }
    if (open.length > 64) throw new Refused('MALFORMED', 'JSON nested too deep')
    last = token
  }
  return value
}

/// A member of its kind (R9), or what holds where it is missing.
function member(object, name, fits, otherwise) {
  if (!(name in object)) return otherwise
  if (!fits(object[name])) throw new Refused('MALFORMED', `${name} is ${JSON.stringify(object[name])}`)
  return object[name]
}
const isText = value => typeof value === 'string', isWhole = Number.isSafeInteger
/// A name by spec/names.md: 1 to 255 bytes of characters that show.
const HIDDEN = /[\u0000-\u001f\u007f-\u009f\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufdd0-\ufdef\ufeff\ufff9-\ufffb\ufffe\uffff\u{e0000}-\u{e00ff}]/u
const isName = value => isText(value) && value !== '' && Buffer.byteLength(value) <= 255 && !HIDDEN.test(value)
const isTexts = value => Array.isArray(value) && value.every(isText)

/// Names are judged in `expect` too, though they are only compared (R32).
function checkNames(value, key) {
  const names = key === 'name' ? [value] : key === 'agents' && Array.isArray(value) ? value : []
  if (names.some(name => isText(name) && !isName(name))) throw new Refused('MALFORMED', 'an expected name that is none')
  if (value && typeof value === 'object') for (const [below, inner] of Object.entries(value)) checkNames(inner, below)
}

/// A whole frame.
function frame(type, request, session, payload) {
  const bytes = Buffer.alloc(32 + payload.length)
  bytes.writeUInt32LE(0x43534EC0, 0)
  bytes.writeUInt16LE(type, 4)
  bytes.writeUInt32LE(payload.length, 8)
  bytes.writeBigUInt64LE(BigInt(request), 16)
  bytes.writeUInt32LE(session, 24)
  payload.copy(bytes, 32)
  return bytes
}

/// Bytes in, frames out, however they are cut or joined (R1).
class FrameReader {
  constructor() { this.input = Buffer.alloc(0); this.limit = FIRST_LIMIT }
  feed(data) { this.input = Buffer.concat([this.input, data]) }
  /// The next whole frame, or null.
  next() {
    const input = this.input
    if (input.length >= 4 && input.readUInt32LE(0) !== 0x43534EC0) throw new Refused('BAD_MAGIC', 'no frame of protocol 2')
    if (input.length < 32) return null
    const flags = input.readUInt16LE(6), length = input.readUInt32LE(8), request = Number(input.readBigUInt64LE(16))
    if (flags > 1 || input.readUInt32LE(28) !== 0) throw new Refused('MALFORMED', 'unknown bits of a header are 0', {}, request)
    if (length > this.limit) throw new Refused('FRAME_TOO_LARGE', `${length} bytes; at most ${this.limit}`, {}, request)
    if (input.length < 32 + length) return null
    const payload = input.subarray(32, 32 + length)
    this.input = input.subarray(32 + length)
    if (flags === 1 && crc32c(payload) !== input.readUInt32LE(12)) throw new Refused('CRC_MISMATCH', 'a payload was changed', {}, request)
    return { type: input.readUInt16LE(4), request, session: input.readUInt32LE(24), payload }
  }
}

module.exports = { TYPES, FIRST_LIMIT, LAST_LIMIT, CONNECTION, Refused, FrameReader, align, frame, readJson, member, isText, isWhole, isTexts, isName, checkNames }
