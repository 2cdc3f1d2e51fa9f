// Reads a log with the JavaScript MCAP packages: every CRC, every index, every message by its schema.
// Prints, as JSON, message counts by topic from both readers and a SHA-256 of each field's doubles.
import { createHash } from "node:crypto";
import { open, readFile } from "node:fs/promises";

import { crc32 } from "@foxglove/crc";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { loadDecompressHandlers, protobufFromBinaryDescriptor } from "@mcap/support";

const path = process.argv[2];
const decompressHandlers = await loadDecompressHandlers();

function fail(text) {
  throw new Error(text);
}

class JointStates {
  constructor(schema) {
    this.reader = new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true }));
    this.fields = ["position", "velocity", "effort"].map((name) => ({ name, repeated: true }));
  }

  decode(data) {
    return this.reader.readMessage(data);
  }
}

class Topic {
  constructor(channel, schema) {
    this.schema = schema.name;
    this.indexed = 0;
    this.streamed = 0;
    this.last = -1n;
    if (channel.messageEncoding === "cdr" && schema.encoding === "ros2msg") {
      this.type = new JointStates(schema);
      this.fields = this.type.fields;
      this.hashes = new Map(this.fields.map((field) => [field.name, createHash("sha256")]));
      return;
    }
    if (channel.messageEncoding !== "protobuf" || schema.encoding !== "protobuf") {
      fail(`${channel.topic} is not protobuf`);
    }
    this.type = protobufFromBinaryDescriptor(schema.data).lookupType(schema.name);
    this.fields = this.type.fieldsArray.filter((field) => field.type === "double");
    this.hashes = new Map(this.fields.map((field) => [field.name, createHash("sha256")]));
  }

  take(message) {
    if (message.logTime < this.last) fail("log time goes back");
    if (message.logTime !== message.publishTime) fail("publish time differs");
    this.last = message.logTime;
    this.indexed += 1;
    const decoded = this.type.decode(message.data);
    for (const field of this.fields) {
      const value = decoded[field.name];
      const doubles = field.repeated ? Float64Array.from(value) : Float64Array.of(value);
      this.hashes.get(field.name).update(new Uint8Array(doubles.buffer));
    }
  }
}

const file = await open(path);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, length) => {
    const buffer = new Uint8Array(Number(length));
    const { bytesRead } = await file.read(buffer, 0, Number(length), Number(offset));
    if (bytesRead !== Number(length)) fail("short read");
    return buffer;
  },
};
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
const topics = new Map();
for (const channel of reader.channelsById.values()) {
  topics.set(channel.id, new Topic(channel, reader.schemasById.get(channel.schemaId)));
}
for await (const message of reader.readMessages({ validateCrcs: true })) {
  topics.get(message.channelId).take(message);
}
const attachments = {};
for await (const attachment of reader.readAttachments({ validateCrcs: true })) {
  attachments[attachment.name] = Buffer.from(attachment.data).toString();
}
const metadata = [];
for await (const record of reader.readMetadata()) metadata.push(record.name);

const bytes = new Uint8Array(await readFile(path));
if (reader.dataSectionCrc !== crc32(bytes.subarray(0, Number(reader.dataEndOffset)))) fail("data CRC");
const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
stream.append(bytes);
for (let record; (record = stream.nextRecord()); ) {
  if (record.type === "Message") topics.get(record.channelId).streamed += 1;
}
if (!stream.done()) fail("the stream does not end");

const result = { attachments, metadata, messages: Number(reader.statistics.messageCount), topics: {} };
for (const channel of reader.channelsById.values()) {
  const topic = topics.get(channel.id);
  const sha256 = Object.fromEntries([...topic.hashes].map(([name, hash]) => [name, hash.digest("hex")]));
  const { schema, indexed, streamed } = topic;
  result.topics[channel.topic] = { schema, indexed, streamed, sha256 };
}
console.log(JSON.stringify(result));
await file.close();
