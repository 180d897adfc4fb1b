#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The page of a calibration in flight, made by the command and opened in a browser: it alone has maps
// of the ground, north up. A name in its mount that is markup stays a name.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { launch, openPage, skipWithoutBrowser } from './browser.mjs';
import { inspect, ownFolder, risley, source } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();
const file = join(folder, 'calibrate/report.html');
const plan = `risley_flight: 1
rate_hz: 200
height_m: 60
speed_m_per_s: 5
turn_duration_s: 10
strips: [{headings_deg: [90, 270, 0, 180], length_m: 60}]
motion:
  seed: 4
  attitude: {roll_deg: 2, pitch_deg: 2, heading_deg: 2, lowest_hz: 0.15, highest_hz: 1.2, sinusoids: 6}
`;
const markup = '<img src=x onerror="window.pwned = 1">';

inspect('flight', async () => {
  const data = (name) => join(source, 'data', name);
  const errors = ['--trajectory-errors', data('trajectory-errors.yaml')];
  writeFileSync(join(folder, 'plan.yaml'), plan);
  const mount = readFileSync(data('mount-as-built.yaml'), 'utf8');
  writeFileSync(join(folder, 'mount.yaml'), mount.replace(/^name: .*$/m, `name: '${markup}'`));
  await risley(folder, 0, 'simulate', '-o', 'strips.lvx', '--sensor', 'mid-40-table3', '--reported',
               'nominal', '--rate-hz', '5000', '--flight', 'plan.yaml',
               '--mount', data('mount-nadir.yaml'), '--scene', data('village.yaml'), ...errors);
  await risley(folder, 0, 'calibrate', 'strips.lvx', '--trajectory', 'strips.lvx.trajectory.csv',
               '--mount', 'mount.yaml', ...errors, '--truth', 'strips.lvx.truth.yaml',
               '-o', 'calibrate');
  return file;
}, /lie [0-9.]+ mm apart before and [0-9]\.[0-9] mm after/);

let browser, page;

before(async () => {
  browser = await launch();
});
after(() => browser?.close());

test('north is up and east is to the right', async () => {
  page = await openPage(browser, file);
  const maps = await page.tab.evaluate(() => window.risley.charts
    .filter(({ data }) => data.kind === 'ground')
    .map(({ chart }) => [[0, 0], [10, 10]].map((place) => chart.convertToPixel('grid', place))));
  assert.ok(maps.length > 10, `${maps.length} maps`);
  for (const [middle, northEast] of maps) {
    assert.ok(northEast[0] > middle[0] && northEast[1] < middle[1]);
    // One metre is as long either way.
    const [right, up] = [northEast[0] - middle[0], middle[1] - northEast[1]];
    assert.ok(Math.abs(right - up) < 0.02 * right, `${right} and ${up} pixels`);
  }
});

test('the name of the mount stays a name', async () => {
  assert.ok((await page.tab.locator('.lead').innerText()).includes(markup));
  assert.equal(await page.tab.locator('img').count(), 0);
  assert.equal(await page.tab.evaluate(() => window.pwned), undefined);
  assert.deepEqual(page.complaints, []);
});
