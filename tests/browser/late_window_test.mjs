#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// A window may have no width at first: a tab in the background, a folded panel of another page.
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { launch, longestDrawing, newTab, skipWithoutBrowser } from './browser.mjs';
import { ownFolder, risley, source } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();
let browser, opened;

before(async () => {
  await risley(folder, 0, 'simulate', '-o', 'hall.lvx', '--sensor', 'mid-40-table3', '--reported',
               'nominal', '--scene', join(source, 'data/hall.yaml'), '--duration-s', '2');
  await risley(folder, 0, 'calibrate', 'hall.lvx', '-o', 'calibrate');
  writeFileSync(join(folder, 'folded.html'),
                '<!DOCTYPE html><title>folded</title><iframe style="width: 0; height: 800px; border: 0"' +
                ' src="calibrate/report.html"></iframe>');
  browser = await launch();
  opened = await newTab(browser);
});
after(() => browser?.close());

test('diagrams wait for a width, and complain about nothing', async () => {
  await opened.open(join(folder, 'folded.html'));
  const frame = opened.tab.frames()[1];
  await frame.waitForLoadState('load');
  await new Promise((done) => setTimeout(done, 500));
  assert.equal(await frame.evaluate(() => document.documentElement.dataset.drawn), undefined);
  await opened.tab.evaluate(() => { document.querySelector('iframe').style.width = '1000px'; });
  await frame.waitForFunction(() => document.documentElement.dataset.drawn, null,
                              { timeout: longestDrawing });
  const widths = await frame.evaluate(() => window.risley.charts.map(({ chart }) => chart.getWidth()));
  assert.ok(widths.length > 0 && widths.every((width) => width > 100), `${widths}`);
  await frame.locator('#unfold').click(); // the other sections have their room now
  await frame.waitForFunction((before) => window.risley.charts.length > before &&
    window.risley.charts.every(({ chart }) => chart.getWidth() > 100), widths.length,
    { timeout: longestDrawing });
  await opened.tab.evaluate(() => { document.querySelector('iframe').style.width = '0'; });
  await new Promise((done) => setTimeout(done, 300));
  // The page asks for itself in its frame.
  assert.deepEqual(opened.complaints.filter((one) => !/^request: file:.*report\.html$/.test(one)), []);
});
