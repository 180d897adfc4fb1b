#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// docs/questions.md says where a page answers what a newcomer asks: on the first screen, or in the
// section that a click in the table of contents leads to.
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { launch, newTab, skipWithoutBrowser } from './browser.mjs';
import { ownFolder, risley, source } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();
const firstScreen = { width: 1280, height: 800 };

const rows = readFileSync(join(source, 'docs/questions.md'), 'utf8').split('\n')
  .filter((line) => line.startsWith('|')).map((line) => line.split('|').slice(1, -1).map((cell) => cell.trim()))
  .filter((cells) => cells.length === 6)
  .slice(2) // head and rule
  .map(([question, command, place, says]) => ({ question, command, place, says }));
const asked = rows.filter(({ place }) => place !== '–');

// Dots stand for anything.
const pattern = (says) => says.split('…').map((part) => part.replace(/[.*+?^${}()|[\]\\]/g, '\\$&'))
  .join('.+?');

// Where the smallest elements stand that say it: whether a reader sees all of them without scrolling, and in
// which section.
const find = (tab, says) => tab.evaluate((words) => {
  const text = (element) => element.innerText?.replace(/\s+/g, ' ') ?? '';
  const wanted = new RegExp(words);
  return [...document.querySelectorAll('main *, #viewer *')]
    .filter((one) => wanted.test(text(one)) && ![...one.children].some((child) => wanted.test(text(child))))
    .map((one) => ({ section: one.closest('details.section'), box: one.getBoundingClientRect() }))
    .filter(({ box }) => box.width > 0 && box.height > 0)
    .map(({ section, box }) => ({
      section: section?.querySelector('h2').innerText ?? null,
      seen: box.top >= 0 && box.left >= 0 && box.bottom <= innerHeight && box.right <= innerWidth,
    }));
}, pattern(says));

const pages = {
  calibrate: async () => {
    await risley(folder, 0, 'simulate', '-o', 'hall.nc', '--sensor', 'mid-40-table3', '--reported', 'nominal',
                 '--scene', join(source, 'data/hall.yaml'), '--duration-s', '2');
    await risley(folder, 0, 'calibrate', 'hall.nc', '-o', 'calibrate');
  },
  estimate: async () => {
    await risley(folder, 0, 'simulate', '-o', 'unit.nc', '--sensor', 'mid-40-table3', '--duration-s', '2');
    await risley(folder, 0, 'estimate', 'unit.nc', '-o', 'estimate');
  },
  cloud: async () => { // of what calibrate was made of
    mkdirSync(join(folder, 'cloud'));
    await risley(folder, 0, 'cloud', 'hall.nc', '--calibration', 'calibrate', '-o', 'hall.ply',
                 '--report', 'cloud/report.html');
  },
};

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

test('the table has all questions', () => {
  assert.ok(rows.length >= 10, `${rows.length} rows`);
  assert.deepEqual(new Set(asked.map(({ command }) => command)), new Set(Object.keys(pages)));
});

for (const [command, make] of Object.entries(pages)) {
  describe(command, () => {
    let page;
    before(async () => {
      await make();
      page = await newTab(browser, { viewport: firstScreen });
    });
    after(() => page?.context.close());

    for (const { question, place, says } of asked.filter((row) => row.command === command)) {
      test(question, async () => {
        await page.tab.goto('about:blank');
        await page.draw(join(folder, command, 'report.html'));
        if (place === 'first screen') {
          const found = await find(page.tab, says);
          assert.ok(found.some(({ seen, section }) => seen && section === null), says + ': ' + JSON.stringify(found));
          return;
        }
        await page.tab.locator('nav.contents').getByRole('link', { name: place, exact: true }).click();
        await page.tab.waitForFunction(() => document.querySelector('details.section:target')?.open);
        const found = await find(page.tab, says);
        assert.ok(found.some(({ seen, section }) => seen && section === place), says + ': ' + JSON.stringify(found));
      });
    }

    test('nothing is found that is folded, far down or not there', async () => {
      await page.tab.goto('about:blank');
      await page.draw(join(folder, command, 'report.html'));
      assert.deepEqual(await find(page.tab, 'a sentence that no page has'), []);
      if (command !== 'cloud') {
        assert.deepEqual(await find(page.tab, 'Gaps: steps longer than 1.8 times the usual one.'), []);
      }
      const last = await find(page.tab, 'How to make it again');
      assert.ok(last.some(({ section }) => section !== null));
      assert.ok(last.every(({ seen, section }) => !seen || section === null), JSON.stringify(last));
    });
  });
}
