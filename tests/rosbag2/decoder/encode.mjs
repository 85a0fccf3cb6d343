// node encode.mjs IN.mcap OUT KIND [PNG_FOLDER]: the messages of a file anew, each read and written with the official
// definitions. KIND: zstd, plain (chunks), unchunked, unindexed (zstd, no summary); png (zstd, images as CompressedImage
// from PNG_FOLDER/cam0/data/STAMP.png); raw, raw_zstd: OUT is a stream of (length, JSON head, length, bytes) for other
// storages. No attachments.
import { closeSync, openSync, readFileSync, writeFileSync, writeSync } from "node:fs";
import { createRequire } from "node:module";
import { McapIndexedReader, McapWriter, TempBuffer } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import { readerOf, writerOf } from "./messages.mjs";

const zstd = createRequire(import.meta.url)("@foxglove/wasm-zstd");
await zstd.isLoaded;
const [, , input, output, kind, pngs] = process.argv;

function compressed(topic, message) {
  const { sec, nanosec, nsec } = message.header.stamp;
  const stamp = BigInt(sec) * 1000000000n + BigInt(nanosec ?? nsec);
  const camera = topic.split("/")[1];
  return { header: message.header, format: "mono8; png compressed ", data: readFileSync(`${pngs}/${camera}/data/${stamp}.png`) };
}

async function* messages() {
  const decompressHandlers = await loadDecompressHandlers();
  const readable = new TempBuffer(readFileSync(input));
  const file = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  for await (const record of file.readMessages()) {
    const channel = file.channelsById.get(record.channelId);
    const schema = file.schemasById.get(channel.schemaId);
    const message = readerOf(schema.name).readMessage(record.data);
    const image = kind === "png" && schema.name === "sensor_msgs/msg/Image";
    const type = image ? "sensor_msgs/msg/CompressedImage" : schema.name;
    const topic = image ? `${channel.topic}/compressed` : channel.topic;
    const data = writerOf(type).writeMessage(image ? compressed(topic, message) : message);
    yield { topic, type, definition: schema.data, log: record.logTime, data };
  }
}

async function writeMcap() {
  const out = { parts: [], length: 0n };
  const writable = {
    position: () => out.length,
    write: async (data) => {
      out.parts.push(Buffer.from(data));
      out.length += BigInt(data.length);
    },
  };
  const unindexed = kind === "unindexed";
  const writer = new McapWriter({
    writable,
    useChunks: kind !== "unchunked",
    chunkSize: 768 * 1024,
    ...(unindexed ? { useMessageIndex: false, useChunkIndex: false, useStatistics: false, useSummaryOffsets: false,
                      repeatSchemas: false, repeatChannels: false } : {}),
    compressChunk: ["plain", "unchunked"].includes(kind)
      ? undefined
      : (data) => ({ compression: "zstd", compressedData: zstd.compress(data, 3) }),
  });
  await writer.start({ profile: "ros2", library: "test" });
  const schemas = new Map(), channels = new Map();
  let sequence = 0;
  for await (const { topic, type, definition, log, data } of messages()) {
    if (!schemas.has(type)) {
      schemas.set(type, await writer.registerSchema({ name: type, encoding: "ros2msg", data: definition }));
    }
    if (!channels.has(topic)) {
      const info = { topic, messageEncoding: "cdr", schemaId: schemas.get(type), metadata: new Map() };
      channels.set(topic, await writer.registerChannel(info));
    }
    await writer.addMessage({ channelId: channels.get(topic), sequence: sequence++, logTime: log, publishTime: log, data });
  }
  await writer.end();
  writeFileSync(output, Buffer.concat(out.parts));
}

async function writeRaw() {
  const file = openSync(output, "w");
  const put = (bytes) => {
    const length = Buffer.alloc(4);
    length.writeUInt32LE(bytes.length);
    writeSync(file, length);
    writeSync(file, bytes);
  };
  for await (const { topic, type, log, data } of messages()) {
    put(Buffer.from(JSON.stringify({ topic, type, log: log.toString() })));
    put(kind === "raw_zstd" ? zstd.compress(data, 3) : Buffer.from(data));
  }
  closeSync(file);
}

await (kind.startsWith("raw") ? writeRaw() : writeMcap());
