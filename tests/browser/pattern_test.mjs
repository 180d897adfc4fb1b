#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The page of pattern, and the rosette that grows on it.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { launch, openPage, skipWithoutBrowser } from './browser.mjs';
import { inspect, ownFolder, risley } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();
const file = join(folder, 'tele-15.html'), panorama = join(folder, 'mid-360.html');

inspect('pattern', async () => {
  await risley(folder, 0, 'pattern', '--sensor', 'tele-15', '--integration-s', '0.05,0.1',
               '--report', file);
  return file;
}, /Coverage and gaps/, false);

inspect('panorama', async () => {
  await risley(folder, 0, 'pattern', '--sensor', 'mid-360', '--integration-s', '0.1,0.5',
               '--report', panorama);
  return panorama;
}, /Density by elevation/, false);

let browser, page;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

test('the rosette grows as far as the slider stands, and at a press of the button', async () => {
  page = await openPage(browser, file);
  const points = () => page.tab.evaluate(() =>
    window.risley.charts[0].chart.getOption().series[0].data.length);
  const slider = page.tab.locator('.growth input'), time = page.tab.locator('.growth output');
  const button = page.tab.locator('.growth button');
  assert.equal(await page.tab.locator('.growth').count(), 1); // of the rosette alone
  const all = await points();
  assert.equal(all, 24_000);
  assert.equal(await time.innerText(), '0.1 s');
  await slider.fill('500');
  assert.equal(await points(), Math.ceil(0.25 * all));
  assert.equal(await time.innerText(), '0.025 s');
  await page.tab.locator('#theme').click(); // other colours, as far grown
  assert.equal(await points(), Math.ceil(0.25 * all));

  // Paper gets the whole picture.
  await page.tab.evaluate(() => window.dispatchEvent(new Event('beforeprint')));
  assert.equal(await points(), all);
  await page.tab.evaluate(() => window.dispatchEvent(new Event('afterprint')));
  assert.equal(await points(), Math.ceil(0.25 * all));

  await button.click();
  await page.tab.waitForFunction(() => {
    const { length } = window.risley.charts[0].chart.getOption().series[0].data;
    return length > 0 && length < 100;
  });
  assert.equal(await button.innerText(), 'Stop');
  await button.click();
  const stopped = await points();
  assert.ok(stopped < all, `${stopped} of ${all} points`);
  assert.equal(await button.innerText(), 'Watch it grow');
  assert.deepEqual(page.complaints, []);
  await page.context.close();
});

test('arrows move a panorama to where they point, as one looks out', async () => {
  page = await openPage(browser, panorama);
  const k = await page.tab.evaluate(() =>
    window.risley.charts.findIndex(({ data }) => data.kind === 'panorama'));
  await page.tab.focus('#' + await page.tab.evaluate((i) => window.risley.charts[i].place.id, k));
  const pressed = async (key) => {
    await page.tab.keyboard.press(key);
    return page.tab.evaluate((i) =>
      window.risley.charts[i].chart.getOption().dataZoom.map(({ start }) => start), k);
  };
  const [azimuth, elevation] = await pressed('+');
  const [right] = await pressed('ArrowRight');
  assert.ok(right < azimuth, `${right} against ${azimuth}`); // azimuths grow to the left
  const [, up] = await pressed('ArrowUp');
  assert.ok(up > elevation, `${up} against ${elevation}`);
  assert.deepEqual(page.complaints, []);
  await page.context.close();
});
