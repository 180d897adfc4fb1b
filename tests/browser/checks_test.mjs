#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The checks are checked too: each must complain about a page that is broken in its way.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import * as checks from './checks.mjs';
import { launch, newTab, skipWithoutBrowser, usualView } from './browser.mjs';
import { ownFolder, risley } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();
const soon = { patience: 500 }; // what will not come is not waited for long
const briefly = { most: 1, ...soon };
let count = 0;
let browser, opened, whole, page;

before(async () => {
  await risley(folder, 0, 'simulate', '-o', 'short.nc', '--sensor', 'mid-40-table3', '--rotor',
               'sinusoidal', '--duration-s', '1', '--seed', '1');
  await risley(folder, 0, 'estimate', 'short.nc', '-o', 'short');
  const html = readFileSync(join(folder, 'short/report.html'), 'utf8');
  whole = withDiagrams(html, oneOfEachSort);
  // A page that was changed keeps its own policy from running it.
  page = withDiagrams(html, linesAndDots)
    .replace(/<meta http-equiv="Content-Security-Policy"[^>]*>/, '');
  browser = await launch();
});
after(() => browser?.close());

// The page with some of its diagrams.
function withDiagrams(html, choose) {
  const data = /(<script type="application\/json" id="page-data">\n)(.*?)(\n<\/script>)/s;
  const kept = choose(JSON.parse(data.exec(html)[2]));
  const ids = new Set(kept.map(({ id }) => id));
  return html.replace(data, (_, head, all, tail) => head + JSON.stringify(kept) + tail)
    .replace(/<figure .*?<\/figure>/gs, (figure) =>
      ids.has(/id="(chart-\d+)"/.exec(figure)[1]) ? figure : '');
}

// One diagram for all that are drawn in the same way, which is as good and faster.
function oneOfEachSort(charts) {
  const sort = ({ kind, palette, series }) => [kind, palette, ...series.map((one) => one.kind)].join();
  const kept = charts.filter((chart, i) =>
    i === charts.findIndex((other) => sort(other) === sort(chart)));
  assert.ok(kept.length >= 5 && kept.length < charts.length / 2, `${kept.length} sorts`);
  return kept;
}

// What is broken in every diagram is broken in these: the values of lines are shown along the
// first axis, those of dots beside them.
function linesAndDots(charts) {
  const kept = [(kind) => kind === 'line', (kind) => kind === 'points'].map((wanted) =>
    charts.find(({ series }) => wanted(series[0].kind)));
  assert.ok(kept.every(Boolean));
  return kept;
}

// The last place of a text in the page, where its own script and data stand.
function replaced(from, to) {
  const at = page.lastIndexOf(from);
  assert.ok(at >= 0, from);
  return page.slice(0, at) + to + page.slice(at + from.length);
}

// Opens a page in the tab of the page before, which is faster than in a new one.
async function withPage(html, visit, viewport = usualView, unfolded = true) {
  const file = join(folder, `page-${++count}.html`);
  writeFileSync(file, html);
  opened ??= await newTab(browser);
  await opened.tab.setViewportSize(viewport);
  await opened.draw(file);
  if (unfolded) await opened.unfold();
  try {
    return await visit(opened.tab, opened.complaints, file);
  } catch (error) {
    await opened.context.close(); // its state is unknown
    opened = undefined;
    throw error;
  }
}

// Whether some complaint is of this sort.
const complains = (complaints, sort) =>
  assert.ok(complaints.some((text) => sort.test(text)),
            `no ${sort} in ${JSON.stringify(complaints, null, 1)}`);

const addScript = (script) => replaced('</body>', `<script>${script}</script></body>`);

test('the page as it is: nothing to complain about', () => withPage(whole, async (tab, said) => {
  for (const check of [checks.checkDrawn, checks.checkColours, checks.checkTheme, checks.checkHover, checks.checkMouse,
                       checks.checkKeyboard, checks.checkWidth]) {
    assert.deepEqual(await check(tab), [], check.name);
  }
  assert.deepEqual(said, []);
}));

test('no values at all', () => withPage(
  page.replace(/"(x|y|value)":\[[^\]]*\]/g, '"$1":[]'),
  async (tab) => complains(await checks.checkDrawn(tab), /holds no values/)));

test('invisible values', () => withPage(
  replaced('const tone = colour(series.colour);', "const tone = 'transparent';"),
  async (tab) => {
    const complaints = await checks.checkDrawn(tab);
    complains(complaints, /no pixels of its colour/);
    complains(complaints, /points are not drawn/);
  }));

test('values at wrong places', () => withPage(
  replaced('const points = series.x.map((x, i) => [x, series.y[i]]);',
           'const points = series.x.map((x, i) => [x, i === 0 ? series.y[0] : series.y[i] / 3]);'),
  async (tab) => complains(await checks.checkDrawn(tab), /not drawn|not where/)));

test('a diagram without a name', () => withPage(
  replaced('aria-label="', 'data-label="'),
  async (tab) => complains(await checks.checkDrawn(tab), /has the label null/)));

test('an error on the console', () => withPage(
  addScript("console.error('so bad')"),
  async (tab, said) => complains(said, /error on the console: so bad/)));

test('a warning on the console', () => withPage(
  addScript("console.warn('take care')"),
  async (tab, said) => complains(said, /warning on the console: take care/)));

test('an uncaught error', () => withPage(
  addScript("setTimeout(() => { throw new Error('oh') })"),
  async (tab, said) => {
    if (said.length === 0) await tab.waitForEvent('pageerror'); // it may be still to come
    complains(said, /uncaught: oh/);
  }));

test('a picture from elsewhere', () => withPage(
  replaced('</body>', '<img src="http://127.0.0.1:9/a.png" alt=""></body>'),
  async (tab, said) => complains(said, /request: http:/)));

test('a neighbouring file', () => withPage(
  replaced('</body>', '<link rel="stylesheet" href="style.css"></body>'),
  async (tab, said) => complains(said, /request: file:.*style\.css/)));

test('no values under the mouse, or those of another point', async () => {
  await withPage(replaced("trigger: lines ? 'axis' : 'item'", "trigger: 'none'"),
                 async (tab) => complains(await checks.checkHover(tab, soon), /no tooltip/));
  await withPage(replaced('rounded(item.value[1], digits.y)', 'rounded(item.value[1] + 1, digits.y)'),
                 async (tab) => complains(await checks.checkHover(tab, {
                   most: 1, patience: 5000, // it does come
                 }),
                                          /the tooltip says/));
});

test('a mouse that does not zoom', () => withPage(
  replaced('dataZoomSelectActive: active', 'dataZoomSelectActive: false'),
  async (tab) => complains(await checks.checkMouse(tab, briefly), /a box .* zooms to/)));

test('a double click without effect', () => withPage(
  replaced("on('dblclick', () => showAll(chart))", "on('dblclick', () => undefined)"),
  async (tab) => complains(await checks.checkMouse(tab, briefly), /a double click leaves/)));

test('a wheel that is swallowed', () => withPage(
  replaced('if (!event.ctrlKey) event.stopPropagation();', ''),
  async (tab) => complains(await checks.checkMouse(tab, briefly), /does not scroll the page/)));

test('no keyboard', async () => {
  await withPage(page.replaceAll('tabindex="0"', ''),
                 async (tab) => complains(await checks.checkKeyboard(tab), /Tab does not reach/));
  await withPage(replaced("addEventListener('keydown'", "addEventListener('keyless'"),
                 async (tab) => {
                   const complaints = await checks.checkKeyboard(tab);
                   for (const sort of [/\+ does not zoom/, /arrows do not/, /n speaks/]) {
                     complains(complaints, sort);
                   }
                 });
});

test('a theme that stays', () => withPage(
  replaced("page.dataset.theme = dark ? 'dark' : 'light';", ''),
  async (tab) => complains(await checks.checkTheme(tab), /leaves the theme/)));

test('diagrams that keep their colours', () => withPage(
  replaced("page.dataset.theme = dark ? 'dark' : 'light';\n    redraw();",
           "page.dataset.theme = dark ? 'dark' : 'light';"),
  async (tab) => complains(await checks.checkTheme(tab), /is not drawn anew/)));

test('colours that colour-blind readers confuse, and faint ones', () => withPage(
  page.replaceAll(/--b: #[0-9a-f]+/g, '--b: #7f7b20').replaceAll(/--c: #[0-9a-f]+/g, '--c: #d0782c')
    .replaceAll(/--a: #[0-9a-f]+/g, '--a: #dfe3e8'),
  async (tab) => {
    await tab.evaluate(() => {
      const [first] = window.risley.charts;
      first.data.series.push({ ...first.data.series[0], colour: 'b' },
                             { ...first.data.series[0], colour: 'c' });
    });
    const complaints = await checks.checkColours(tab);
    complains(complaints, /look alike to eyes with no (red|green)/);
    complains(complaints, /has a contrast of/);
  }));

test('a scale of colours that goes to and fro', () => withPage(
  whole.replaceAll('#fde725;', '#202020;').replace(/<meta http-equiv="Content-Security-Policy"[^>]*>/, ''),
  async (tab) => complains(await checks.checkColours(tab), /to and fro in lightness/)));

test('paper without diagrams', async () => {
  await withPage(replaced("window.addEventListener('beforeprint', beforePrint);", ''),
                 async (tab) => complains(await checks.checkPrint(tab, join(folder, 'a.pdf')),
                                          /0 of \d+ diagrams are printed/));
  await withPage(page.replace('.printed { display: block;', '.printed { display: none;'),
                 async (tab) => complains(await checks.checkPrint(tab, join(folder, 'a.pdf')),
                                          /no picture of .* in the PDF/));
  await withPage(replaced("forEach((picture) => picture.remove())", 'forEach(() => undefined)'),
                 async (tab) => complains(await checks.checkPrint(tab, join(folder, 'a.pdf')),
                                          /printed pictures stay/));
});

test('pictures without their dots', () => withPage(
  replaced('paintAllOnPictures(entry.chart);', ''),
  async (tab) => complains(await checks.checkPrint(tab, join(folder, 'b.pdf')),
                           /printed with less than the screen shows/)));

test('a page that is too wide', () => withPage(
  replaced('</main>', '<p style="width: 900px">wide</p></main>'),
  async (tab) => complains(await checks.checkWidth(tab), /pixels wide where 400 are/),
  { width: 400, height: 800 }));

test('sections that unfold without their diagrams, and that paper does not get', () => withPage(
  replaced("toggle'", "toggled'").replace('for (const section of foldedAgain) section.open = true;', ''),
  async (tab) => {
    const complaints = await checks.checkFolding(tab, soon);
    complains(complaints, /are drawn once it is unfolded/);
    complains(complaints, /diagrams are printed/);
  }, usualView, false));

test('a file that is too large', () => {
  const file = join(folder, 'large.html');
  writeFileSync(file, page + ' '.repeat(5 << 20));
  complains(checks.checkFile(file), /allowed/);
});

test('tables that need JavaScript, and no note', () => withPage(
  page.replace(/<noscript>.*<\/noscript>/s, '').replace('<table', '<script>/*') .replace(
    '</table>', "*/document.write('<table><tr><td>late</table>')</script>"),
  async (tab, said, file) => {
    const bare = await newTab(browser, { javaScriptEnabled: false });
    await bare.open(file);
    await bare.openSections();
    const complaints = await checks.checkWithoutScript(bare.tab, tab);
    complains(complaints, /no note/);
    complains(complaints, /table differ/);
  }));
