// node decode.mjs FILE: what an MCAP file holds, as one line of JSON for the file and one per message. Messages are read
// with the official definitions; the file's own must have the same fields. Pixels become their SHA-256.
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { parse } from "@foxglove/rosmsg";
import { McapIndexedReader, McapStreamReader, TempBuffer } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import { definitionsOf, readerOf } from "./messages.mjs";

const plain = (key, value) => {
  if (typeof value === "bigint") return value.toString();
  if (key === "data" && value instanceof Uint8Array) {
    return { size: value.length, sha256: createHash("sha256").update(value).digest("hex") };
  }
  if (ArrayBuffer.isView(value)) return Array.from(value, (x) => (Number.isFinite(x) ? x : String(x)));
  return typeof value === "number" && !Number.isFinite(value) ? String(value) : value;
};
const print = (value) => console.log(JSON.stringify(value, plain));

/// Fields of all types, without constants, in a form to compare.
function fields(definitions) {
  const short = (name) => name?.replace("/msg/", "/") ?? "";
  return definitions
    .map(({ name, definitions: list }) => [
      short(name),
      list.filter((f) => !f.isConstant).map((f) => [f.name, short(f.type), !!f.isArray, f.arrayLength ?? 0]),
    ])
    .filter(([name]) => name !== "builtin_interfaces/Time") // a type of its own to the parser
    .sort()
    .map((entry) => JSON.stringify(entry));
}

function checkSchema(schema) {
  const text = new TextDecoder().decode(schema.data);
  const own = fields(parse(text, { ros2: true }));
  const official = fields(definitionsOf(schema.name));
  if (JSON.stringify(own) !== JSON.stringify(official)) {
    throw new Error(`${schema.name}: other fields than the official ones:\n${own.join("\n")}\n${official.join("\n")}`);
  }
}

function printMessage(message, channel, schema) {
  print({
    topic: channel.topic,
    type: schema.name,
    log: message.logTime,
    publish: message.publishTime,
    message: readerOf(schema.name).readMessage(message.data),
  });
}

const bytes = readFileSync(process.argv[2]);
const decompressHandlers = await loadDecompressHandlers();

if (process.argv[3] === "--torn") {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const schemas = new Map(), channels = new Map();
  reader.append(bytes);
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type !== "Message") continue;
    const channel = channels.get(record.channelId);
    printMessage(record, channel, schemas.get(channel.schemaId));
  }
} else {
  const file = await McapIndexedReader.Initialize({ readable: new TempBuffer(bytes), decompressHandlers });
  for (const schema of file.schemasById.values()) checkSchema(schema);
  const attachments = [];
  for await (const a of file.readAttachments({ validateCrcs: true })) {
    attachments.push({ name: a.name, text: new TextDecoder().decode(a.data) });
  }
  print({ header: file.header, statistics: { ...file.statistics, channelMessageCounts: undefined }, attachments });
  for await (const message of file.readMessages({ validateCrcs: true })) {
    const channel = file.channelsById.get(message.channelId);
    printMessage(message, channel, file.schemasById.get(channel.schemaId));
  }
}
