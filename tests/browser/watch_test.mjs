#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The page of a recording that runs, in a browser: it follows, reports a bend, and keeps its policy.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { after, before, test } from 'node:test';
import { launch, newTab, skipWithoutBrowser } from './browser.mjs';
import { ownFolder } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();
const sensorAddress = '127.0.0.47', hostAddress = '127.0.0.37';
const serial = '<img/src=x>"&\'0'; // broadcast codes are visible ASCII
const patience = { timeout: 60_000 };
let browser, emulator, recorder, opened, url;

function start(...args) {
  return spawn(process.env.RISLEY_COMMAND, args, { cwd: folder, stdio: ['ignore', 'ignore', 'pipe'] });
}

before(async () => {
  emulator = start('emulate', '--interface', sensorAddress, '--serial', serial, '--rotor', 'hunting',
                   '--bend', 'prism_tilt_b_vertical_deg=0.02', '--bend-s', '8');
  recorder = start('record', '-o', 'watched.lvx', '--interface', hostAddress, '--serial', serial, '--watch', '0');
  let said = '';
  recorder.stderr.on('data', (bytes) => { said += bytes; });
  browser = await launch();
  opened = await newTab(browser);
  while (!url) {
    url = /http:\/\/[0-9.:]+\//.exec(said)?.[0];
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
