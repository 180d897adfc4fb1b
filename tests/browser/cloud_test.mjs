#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The page of a cloud, and the choice of its colours.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { launch, openPage, skipWithoutBrowser } from './browser.mjs';
import { inspect, ownFolder, risley, source } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();
const file = join(folder, 'cloud.html');

inspect('cloud', async () => {
  await risley(folder, 0, 'simulate', '-o', 'hall.lvx', '--sensor', 'mid-40',
               '--scene', join(source, 'data/hall.yaml'), '--duration-s', '1');
  await risley(folder, 0, 'cloud', 'hall.lvx', '--calibration', 'mid-40', '-o', 'hall.las',
               '--report', file);
  return file;
}, /Uncertainty of the points/, false);

let browser, page;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

test('the points take the colours that the reader chooses', async () => {
  page = await openPage(browser, file);
  const choice = page.tab.locator('.colouring select');
  assert.equal(await page.tab.locator('.colouring').count(), 1); // of the points alone
  const words = await choice.locator('option').allInnerTexts();
  assert.deepEqual(words, ['standard uncertainty of the position, mm', 'up, m', 'intensity',
                           'angle of incidence, deg']);
  const state = () => page.tab.evaluate(() => {
    const { chart } = window.risley.charts[0];
    const { series, visualMap } = chart.getOption();
    const rows = series[0].data.map((one) => one.value ?? one);
    return { values: rows.map((one) => one[3]), heights: rows.map((one) => one[2]),
             hidden: series[0].data.filter((one) => one.itemStyle?.opacity === 0).length,
             range: [visualMap[0].min, visualMap[0].max] };
  });
  const first = await state();
  assert.ok(first.values.length > 10_000, `${first.values.length} points`);
  assert.ok(first.range[0] > 0 && first.range[1] < 100, `${first.range} mm`);
  await choice.selectOption('up, m');
  const second = await state();
  assert.deepEqual(second.values, second.heights);
  assert.ok(second.range[0] < second.range[1]);
  await choice.selectOption('angle of incidence, deg');
  const third = await state();
  assert.ok(third.range[0] >= 0 && third.range[1] <= 90, `${third.range} deg`);
  assert.notDeepEqual(third.values, second.values);
  assert.equal(third.hidden, third.values.filter((one) => one === null).length);
  assert.ok(third.hidden > 0 && third.hidden < 0.1 * third.values.length, `${third.hidden} hidden`);
  await page.tab.locator('#theme').click(); // other colours of the page, the same of the points
  assert.deepEqual((await state()).values, third.values);
  assert.deepEqual(page.complaints, []);
  await page.context.close();
});
