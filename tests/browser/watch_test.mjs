#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The page of a recording that runs, in a browser: it follows, shows the scan, reports a bend, and keeps its policy.
// Another page reads the points.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { createServer } from 'node:http';
import { after, before, test } from 'node:test';
import { launch, newTab, skipWithoutBrowser } from './browser.mjs';
import { ownFolder } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();
const sensorAddress = '127.0.0.47', hostAddress = '127.0.0.37';
const serial = '<img/src=x>"&\'0'; // broadcast codes are visible ASCII
const patience = { timeout: 60_000 };
let browser, emulator, recorder, opened, url, points;

function start(...args) {
  return spawn(process.env.RISLEY_COMMAND, args, { cwd: folder, stdio: ['ignore', 'ignore', 'pipe'] });
}

before(async () => {
  emulator = start('emulate', '--interface', sensorAddress, '--serial', serial, '--rotor', 'hunting',
                   '--bend', 'prism_tilt_b_vertical_deg=0.02', '--bend-s', '8');
  recorder = start('record', '-o', 'watched.lvx', '--interface', hostAddress, '--serial', serial, '--watch', '0',
                   '--publish', 'foxglove:0');
  let said = '';
  recorder.stderr.on('data', (bytes) => { said += bytes; });
  browser = await launch();
  opened = await newTab(browser);
  while (!url || !points) {
    url = /http:\/\/[0-9.:]+\//.exec(said)?.[0];
    points = /ws:\/\/[0-9.:]+\//.exec(said)?.[0];
    await new Promise((done) => setTimeout(done, 50));
    assert.equal(recorder.exitCode, null, said);
  }
  opened.complaints.length = 0;
  await opened.tab.goto(url);
});
after(async () => {
  emulator?.kill();
  recorder?.kill();
  await browser?.close();
});

const sees = (text) => opened.tab.getByText(text).first().waitFor(patience);

test('it shows what comes, and names from the network as text', async () => {
  await sees(/s recorded\./);
  await sees(`Livox Mid-40 ${serial}`);
  assert.equal(await opened.tab.locator('img').count(), 0);
  await sees('no change seen since the beginning');
  await sees(/Rotors: .*deg\/s/);
});

test('its scan grows', async () => {
  await sees(/Scan: azimuth 1\d\.\d\u00b0 to \u22121\d\.\d\u00b0 from left to right, zenith 7\d\.\d/);
  const shots = () => opened.tab.locator('canvas').evaluate((canvas) => {
    const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d', { willReadFrequently: true });
    copy.drawImage(canvas, 0, 0);
    const pixels = copy.getImageData(0, 0, canvas.width, canvas.height).data;
    return pixels.filter((value, i) => i % 4 === 3 && value > 0).length;
  });
  const first = await shots();
  assert.ok(first > 500, String(first));
  await new Promise((done) => setTimeout(done, 2000));
  assert.ok(await shots() > first);
  await sees(/Points: .* published, made with mid-40/);
});

test('a page of this machine gets points', async () => {
  const server = createServer((_, reply) => {
    reply.setHeader('Content-Type', 'text/html');
    reply.end('<!doctype html><link rel="icon" href="data:,"><p>viewer</p>');
  });
  await once(server.listen(0, '127.0.0.1'), 'listening');
  const { tab } = await newTab(browser);
  await tab.goto(`http://127.0.0.1:${server.address().port}/`);
  const got = await tab.evaluate((address) => new Promise((done, fail) => {
    const socket = new WebSocket(address, ['foxglove.websocket.v1']);
    const frames = [];
    let channel;
    socket.binaryType = 'arraybuffer';
    socket.onerror = () => fail(new Error('no connection'));
    socket.onmessage = ({ data }) => {
      if (typeof data === 'string') {
        [channel] = JSON.parse(data).channels ?? [channel];
        if (channel) socket.send(JSON.stringify({ op: 'subscribe', subscriptions: [{ id: 3, channelId: channel.id }] }));
        return;
      }
      const view = new DataView(data);
      frames.push([view.getUint8(0), view.getUint32(1, true), Number(view.getBigUint64(5, true)), data.byteLength]);
      if (frames.length < 10) return;
      socket.close();
      done({ protocol: socket.protocol, channel, frames });
    };
  }), points);
  server.close();
  assert.equal(got.protocol, 'foxglove.websocket.v1');
  assert.equal(got.channel.topic, '/risley/points');
  assert.equal(got.channel.schemaName, 'sensor_msgs/msg/PointCloud2');
  assert.match(got.channel.schema, /^std_msgs\/Header header\n/);
  for (const [opcode, subscription, time, bytes] of got.frames) {
    assert.deepEqual([opcode, subscription], [1, 3]);
    assert.ok(time > 0 && bytes > 1000, `${time} ${bytes}`);
  }
});

test('it reports a bend', async () => {
  await sees(/Alarm: the optics have changed: prism_tilt_b_vertical_deg by \+0\.0(1[89]|2[01])/);
  assert.ok(await opened.tab.locator('tr').filter({ hasText: 'prism_tilt_b_vertical_deg' }).count() > 0);
});

test('nothing is loaded from elsewhere, and what is smuggled in does not run', async () => {
  const strange = opened.complaints.filter((text) => !text.startsWith(`request: ${url}`));
  assert.deepEqual(strange, []);
  const ran = await opened.tab.evaluate(async () => {
    const place = document.createElement('div');
    place.innerHTML = '<img src=x onerror="window.smuggled = 1">';
    document.body.append(place);
    await new Promise((done) => setTimeout(done, 200));
    return window.smuggled;
  });
  assert.equal(ran, undefined);
});

test('it says when the recording is over', async () => {
  recorder.kill('SIGTERM');
  const [status] = await once(recorder, 'exit');
  assert.equal(status, 0);
  await sees('The recording is over.');
});
