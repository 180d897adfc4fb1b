#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Names of planes that are markup stay names, in the page and under the mouse.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { launch, openPage, skipWithoutBrowser } from './browser.mjs';
import { ownFolder, risley, source } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();
const planes = join(source, 'tests/golden/hostile/xss-planes.yaml');
let browser, page;

before(async () => {
  await risley(folder, 0, 'simulate', '-o', 'hall.lvx', '--sensor', 'mid-40-table3', '--reported',
               'nominal', '--scene', join(source, 'data/hall.yaml'), '--duration-s', '2');
  await risley(folder, 0, 'calibrate', 'hall.lvx', '--planes', planes, '-o', 'calibrate');
  browser = await launch();
  page = await openPage(browser, join(folder, 'calibrate/report.html'));
});
after(() => browser?.close());

test('no name runs under the mouse', async () => {
  const shown = await page.tab.evaluate(async () => {
    const texts = [];
    for (const { chart, data } of window.risley.charts) {
      for (let i = 0; i < data.series.length; ++i) {
        chart.dispatchAction({ type: 'showTip', seriesIndex: i, dataIndex: 0 });
        await new Promise((done) => setTimeout(done, 50));
        texts.push(chart.getDom().innerText);
      }
    }
    return texts.join('\n');
  });
  assert.match(shown, /<img src=x onerror=/); // it was under the mouse, as text
  assert.equal(await page.tab.locator('img').count(), 0);
  assert.equal(await page.tab.evaluate(() => window.pwned ?? window.pwned2), undefined);
  assert.deepEqual(page.complaints, []);
});

test('what is smuggled in all the same does not run', async () => {
  const ran = await page.tab.evaluate(async () => {
    const place = document.createElement('div');
    place.innerHTML = '<img src=x onerror="window.smuggled = 1">';
    const script = document.createElement('script');
    script.textContent = 'window.smuggled = 2';
    document.body.append(place, script);
    await new Promise((done) => setTimeout(done, 200));
    return window.smuggled;
  });
  assert.equal(ran, undefined);
  assert.ok(page.complaints.some((text) => text.includes('Content Security Policy')));
});
