// decode.mjs: MAVLink bytes from standard input; one line of JSON per packet that node-mavlink finds and whose checksum
// it accepts. Integers of 64 bits become strings.
import { createMavLinkStream, common, minimal } from 'node-mavlink'

const registry = { ...minimal.REGISTRY, ...common.REGISTRY }

createMavLinkStream(process.stdin, {
  onCrcError: () => console.log(JSON.stringify({ name: 'CRC_ERROR' })),
}).on('data', ({ header, payload, protocol }) => {
  const type = registry[header.msgid]
  const line = { name: type.MSG_NAME, length: header.payloadLength, header, fields: protocol.data(payload, type) }
  console.log(JSON.stringify(line, (key, value) => (typeof value === 'bigint' ? value.toString() : value)))
})
