// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The whole inspection of one page, as tests of node:test.
//   RISLEY_COMMAND     the built command
//   RISLEY_SOURCE_DIR  root of the repository
//   RISLEY_ARTEFACTS   folder for screenshots, PDFs and opening times; without it none are made
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { appendFileSync, existsSync, mkdirSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { text } from 'node:stream/consumers';
import { after, before, describe, test } from 'node:test';
import * as checks from './checks.mjs';
import { launch, newTab, openPage, usualView } from './browser.mjs';

const artefacts = process.env.RISLEY_ARTEFACTS;
export const source = process.env.RISLEY_SOURCE_DIR;

// A folder that goes when the process ends.
export function ownFolder() {
  const folder = mkdtempSync(join(tmpdir(), 'risley-browser-'));
  process.on('exit', () => rmSync(folder, { recursive: true, force: true }));
  return folder;
}

// Runs the command in a folder and demands an exit status.
export async function risley(folder, status, ...words) {
  const run = spawn(process.env.RISLEY_COMMAND, [...words, '--quiet'], { cwd: folder });
  const exit = new Promise((done) => run.on('error', done).on('close', done));
  const said = await Promise.all([text(run.stdout), text(run.stderr)]);
  assert.equal(await exit, status, words.join(' ') + '\n' + said.join(''));
}

let made = Promise.resolve(); // the pages so far
let browser;
after(() => browser?.close());

// make: makes the page and returns its path; the next page is made while this one is looked at.
// says: what its text must match. whole: also what the script that all pages share does with mouse,
// keys, colours and paper.
export function inspect(name, make, says, whole = true) {
  const testScript = whole ? test : () => undefined;
  const making = made.then(make);
  made = making.catch(() => {}); // reported by the tests of this page
  describe(name, () => {
    let page, file;
    const good = async (complaints) => assert.deepEqual(await complaints, []);
    const artefact = (ending) => artefacts && join(artefacts, name + ending);
    const takePicture = (tab, ending) =>
      artefacts && tab.screenshot({ path: artefact(ending + '.png'), fullPage: true });

    before(async () => {
      if (artefacts) mkdirSync(artefacts, { recursive: true });
      file = await making;
      assert.ok(existsSync(file), file);
      browser ??= await launch();
      page = await openPage(browser, file);
      const diagrams = await page.tab.evaluate(() => document.documentElement.dataset.drawn);
      const line = `${name}: ${diagrams} diagrams drawn ${Math.round(page.milliseconds)} ms ` +
        'after the start of the navigation';
      console.log(line); // never asserted: machines differ
      if (artefacts) appendFileSync(artefact('.txt'), line + '\n');
    });
    after(() => page?.context.close());

    // Loads it again where the reader's screen is of another kind.
    const startAgain = async (colorScheme, size) => {
      await page.tab.goto('about:blank'); // or the old diagrams would follow
      await page.tab.emulateMedia({ colorScheme });
      await page.tab.setViewportSize(size);
      await page.draw(file);
      await page.unfold();
    };

    test('its file is small', () => good(checks.checkFile(file)));
    test('says what it is about', async () => {
      assert.match(await page.tab.locator('main').innerText(), says);
    });
    test('draws every diagram', async () => {
      await takePicture(page.tab, '-light');
      await good(checks.checkDrawn(page.tab));
    });
    testScript('folds', async () => {
      const fresh = await newTab(browser);
      await fresh.draw(file);
      await takePicture(fresh.tab, '-folded');
      await good(checks.checkFolding(fresh.tab));
      await good(fresh.complaints);
      await fresh.context.close();
    });
    testScript('prints', () => good(checks.checkPrint(page.tab, artefact('.pdf'))));
    testScript('changes its colours', () => good(checks.checkTheme(page.tab)));
    test('has colours that stay distinct with colour blindness', () => good(checks.checkColours(page.tab)));
    test('shows values under the mouse', () => good(checks.checkHover(page.tab)));
    testScript('zooms and moves with the mouse', () => good(checks.checkMouse(page.tab)));
    testScript('rotates what has three dimensions', () => good(checks.checkRotation(page.tab)));
    testScript('obeys the keyboard', () => good(checks.checkKeyboard(page.tab)));
    testScript('is readable without JavaScript', async () => {
      const bare = await newTab(browser, { javaScriptEnabled: false });
      await bare.open(file);
      await bare.openSections();
      await good(checks.checkWithoutScript(bare.tab, page.tab));
      await good(bare.complaints);
      await bare.context.close();
    });
    testScript('follows a window that becomes narrow', async () => {
      await page.tab.setViewportSize({ width: 400, height: 800 });
      await page.tab.waitForFunction(() => document.documentElement.scrollWidth <= 400 &&
        window.risley.charts.every(({ chart, place }) => chart.getWidth() === place.clientWidth),
        null, { timeout: 30_000 }).catch(() => {}); // all diagrams follow; the check judges
      await good(checks.checkWidth(page.tab));
    });
    test('complains about nothing and asks for nothing', () => good(page.complaints));
    testScript('starts dark where the system is dark', async () => {
      await startAgain('dark', usualView);
      assert.equal(await page.tab.evaluate(() => document.documentElement.dataset.theme), 'dark');
      await takePicture(page.tab, '-dark');
      await good(page.complaints);
    });
    if (artefacts) testScript('is pictured as colour-blind eyes see it', async () => {
      await startAgain('light', usualView);
      const eyes = await page.context.newCDPSession(page.tab);
      for (const type of ['protanopia', 'deuteranopia', 'tritanopia']) {
        await eyes.send('Emulation.setEmulatedVisionDeficiency', { type });
        await takePicture(page.tab, '-' + type);
      }
      await eyes.send('Emulation.setEmulatedVisionDeficiency', { type: 'none' });
      await good(page.complaints);
    });
    testScript('fits a narrow screen', async () => {
      await startAgain('light', { width: 400, height: 800 });
      await takePicture(page.tab, '-narrow');
      await good(checks.checkWidth(page.tab));
      await good(checks.checkDrawn(page.tab));
      await good(page.complaints);
    });
  });
}
