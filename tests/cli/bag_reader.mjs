// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Prints the messages of a file of MCAP, or of lines of JSON with messages of ROS 2, as lines of
// JSON: read with the libraries in $RISLEY_MCAP_READERS, by the definitions that stand in the file.
import fs from 'node:fs';
import { createRequire } from 'node:module';
import path from 'node:path';

const require = createRequire(path.join(process.env.RISLEY_MCAP_READERS, 'here.js'));
const { McapIndexedReader, McapStreamReader } = require('@mcap/core');
const { parse } = require('@foxglove/rosmsg');
const { MessageReader } = require('@foxglove/rosmsg2-serialization');

const readers = new Map();

function print(topic, type, definition, time, bytes) {
  if (!readers.has(topic)) {
    readers.set(topic, new MessageReader(parse(definition, { ros2: true })));
  }
  const message = readers.get(topic).readMessage(bytes);
  if (message.data) message.data = Buffer.from(message.data).toString('base64');
  const plain = (key, value) =>
    typeof value === 'bigint' ? value.toString()
      : ArrayBuffer.isView(value) ? Array.from(value) : value;
  process.stdout.write(`${JSON.stringify({ topic, type, time: String(time), message }, plain)}\n`);
}

const [file] = process.argv.slice(2);
if (file.endsWith('.mcap')) {
  // From its index, and from the front: both have to find the same messages.
  const whole = fs.readFileSync(file);
  const stream = new McapStreamReader({ validateCrcs: true });
  stream.append(whole);
  let streamed = 0;
  for (let record; (record = stream.nextRecord());) streamed += record.type === 'Message' ? 1 : 0;
  if (!stream.done()) throw new Error('the file does not end as MCAP does');
  const reader = await McapIndexedReader.Initialize({
    readable: {
      size: async () => BigInt(whole.length),
      read: async (offset, size) => whole.subarray(Number(offset), Number(offset + size)),
    },
  });
  let indexed = 0;
  for await (const { channelId, logTime, data } of reader.readMessages()) {
    const channel = reader.channelsById.get(channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    if (channel.messageEncoding !== 'cdr' || schema.encoding !== 'ros2msg') {
      throw new Error(`${channel.messageEncoding} by ${schema.encoding}`);
    }
    print(channel.topic, schema.name, new TextDecoder().decode(schema.data), logTime, data);
    ++indexed;
  }
  const counted = Number(reader.statistics.messageCount);
  if (indexed !== streamed || counted !== streamed) {
    throw new Error(`${streamed} messages, ${indexed} in the index, ${counted} by the statistics`);
  }
} else {
  for (const line of fs.readFileSync(file, 'utf8').split('\n').filter(Boolean)) {
    const { topic, type, definition, time, bytes } = JSON.parse(line);
    print(topic, type, definition, time, Buffer.from(bytes, 'base64'));
  }
}
