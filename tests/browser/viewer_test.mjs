#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The viewer of points: five million of them, and what hands, keys and tools do with few.
import assert from 'node:assert/strict';
import { readFileSync, rmSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { launch, newTab, skipWithoutBrowser } from './browser.mjs';
import { ownFolder, risley, source } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();
const pageOf = (name) => join(folder, name + '.html');
const longestFirstPicture = 3000; // ms
const mostMemory = 700; // MB
const mostBytesPerPoint = 16;
const patience = 120_000; // ms, on machines that do much else

let browser;
before(async () => {
  browser = await launch();
});
after(() => browser?.close());

async function makeCloud(name, seconds, format) {
  await risley(folder, 0, 'simulate', '-o', name + '.lvx', '--sensor', 'mid-40',
               '--scene', join(source, 'data/hall.yaml'), '--duration-s', String(seconds));
  await risley(folder, 0, 'cloud', name + '.lvx', '--calibration', 'mid-40',
               '-o', name + '.' + format, '--report', pageOf(name));
}

async function settled({ tab }) {
  await tab.waitForFunction(() => document.getElementById('viewer').dataset.settled, null,
                            { timeout: patience, polling: 20 });
}

async function view(name, options) {
  const opened = await newTab(browser, options);
  await opened.open(pageOf(name));
  await settled(opened);
  return opened;
}

const state = ({ tab }) => tab.evaluate(() => window.risleyViewer.state());
const camera = ({ tab }) => tab.evaluate(() => {
  const { target, azimuth, elevation, distance } = window.risleyViewer.view;
  return { target: target.toArray(), azimuth, elevation, distance };
});
const reading = ({ tab }) => tab.locator('#viewer-reading').innerText();
const number = (text) => Number(text.replaceAll('\u202f', '').replace('−', '-'));
const numbers = (text) => [...text.matchAll(/[+−]?[\d\u202f]+\.\d+/g)].map(([one]) => number(one));
const apart = (a, b) => Math.hypot(...a.map((v, i) => v - b[i]));

// Proportional sets of the browser's processes that hold a page, MB.
async function memory() {
  const session = await browser.newBrowserCDPSession();
  const { processInfo } = await session.send('SystemInfo.getProcessInfo');
  await session.detach();
  const size = (id) => Number(/^Pss:\s+(\d+)/m.exec(readFileSync(`/proc/${id}/smaps_rollup`, 'utf8'))[1]) / 1024;
  return processInfo.filter(({ type }) => type === 'renderer' || type === 'GPU')
    .reduce((sum, { id }) => sum + size(id), 0);
}

test('five million points', async () => {
  await makeCloud('many', 51, 'las');
  for (const ending of ['.las', '.lvx', '.lvx.truth.nc']) rmSync(join(folder, 'many' + ending));
  const opened = await view('many');
  const { data, ...first } = await opened.tab.evaluate(() => ({
    data: { points: window.risleyViewer.data.points }, ...window.risleyViewer.state(),
  }));
  assert.ok(data.points >= 5e6, `${data.points} points`);
  const bytes = statSync(pageOf('many')).size;
  assert.ok(bytes < mostBytesPerPoint * data.points, `${bytes} bytes`);
  assert.ok(first.drawn < data.points / 2, `${first.drawn} drawn`); // what the screen can show
  assert.ok(first.unpacked < data.points, `${first.unpacked} unpacked`);
  const settledMemory = await memory();
  await opened.tab.evaluate(() => window.risleyViewer.unpackAll().then(() => null));
  assert.equal((await state(opened)).unpacked, data.points);
  for (const key of ['t', '0']) { // all of them have been on their way to the screen
    await opened.tab.locator('#viewer-points').press(key);
    await settled(opened);
  }
  const mostSeen = await memory();
  console.log(`viewer: ${data.points} points in ${(bytes / 1e6).toFixed(1)} MB, first picture after ` +
    `${Math.round(first.firstPicture)} ms, ${Math.round(settledMemory)} MB, all unpacked ${Math.round(mostSeen)} MB`);
  assert.ok(first.firstPicture < longestFirstPicture, `${first.firstPicture} ms`);
  assert.ok(mostSeen <= mostMemory, `${mostSeen} MB`);
  assert.deepEqual(opened.complaints, []);
  await opened.context.close();
});

describe('few points', () => {
  let cloud, opened, canvas;
  before(async () => {
    await makeCloud('hall', 1, 'xyz');
    cloud = readFileSync(join(folder, 'hall.xyz'), 'utf8').split('\n')
      .map((line) => line.split(/[ ,;\t]+/).slice(0, 3).map(Number))
      .filter((row) => row.length === 3 && row.every(Number.isFinite));
    opened = await view('hall');
    canvas = opened.tab.locator('#viewer-points');
  });
  after(() => opened?.context.close());

  test('fill the window and say what they are', async () => {
    const { tab } = opened;
    assert.deepEqual(await canvas.boundingBox(), { x: 0, y: 0, width: 1300, height: 900 });
    assert.equal((await state(opened)).unpacked, cloud.length);
    assert.match(await tab.locator('#viewer-words').innerText(), /points; standard uncertainty .* mm/);
    assert.match(await canvas.getAttribute('aria-label'), /All .* points are here/);
    await tab.locator('#viewer-about a').click();
    await tab.waitForFunction(() => document.querySelector('h1').getBoundingClientRect().top < 200);
    await tab.locator('main a[href="#viewer"]').click();
    await tab.waitForFunction(() => window.scrollY === 0);
  });

  test('take the colours that the reader chooses', async () => {
    const choice = opened.tab.locator('#viewer-colouring');
    const words = await choice.locator('option').allInnerTexts();
    assert.deepEqual(words, ['standard uncertainty of the position, mm', 'up, m', 'intensity',
                             'angle of incidence, deg']);
    const pictures = [];
    for (const [label, unit] of [[words[0], / mm$/], [words[1], / m$/], [words[3], / deg$/]]) {
      await choice.selectOption(label);
      await settled(opened);
      const ticks = await opened.tab.locator('#viewer-ticks span').allInnerTexts();
      assert.ok(ticks.length > 2 && ticks.every((one) => unit.test(one)), ticks.join());
      pictures.push((await canvas.screenshot()).toString('base64'));
    }
    assert.equal(new Set(pictures).size, 3);
    assert.ok(await opened.tab.locator('#viewer-unknown').isVisible()); // of the angles
    await choice.selectOption(words[0]);
  });

  test('turn, move, come nearer and go back, by mouse, keys and fingers', async () => {
    const { tab } = opened;
    await tab.locator('[data-does=reset]').click();
    const whole = await camera(opened);
    const changes = async (act, ...keys) => {
      const before = await camera(opened);
      await act();
      const now = await camera(opened);
      for (const key of ['target', 'azimuth', 'elevation', 'distance']) {
        assert.equal(JSON.stringify(now[key]) !== JSON.stringify(before[key]), keys.includes(key),
                     `${key} ${act}`);
      }
    };
    const drag = async (options = {}) => {
      if (options.shift) await tab.keyboard.down('Shift');
      await tab.mouse.move(600, 450);
      await tab.mouse.down();
      await tab.mouse.move(650, 500);
      await tab.mouse.move(700, 520);
      await tab.mouse.up();
      if (options.shift) await tab.keyboard.up('Shift');
    };
    await changes(() => drag(), 'azimuth', 'elevation');
    await changes(() => drag({ shift: true }), 'target');
    await changes(() => tab.mouse.wheel(0, -200), 'target', 'distance');
    await changes(() => canvas.press('ArrowLeft'), 'azimuth');
    await changes(() => canvas.press('ArrowUp'), 'elevation');
    await changes(() => canvas.press('Shift+ArrowUp'), 'target');
    await changes(() => canvas.press('+'), 'distance');
    await canvas.press('0');
    assert.deepEqual(await camera(opened), whole);
    const session = await opened.context.newCDPSession(tab);
    const touch = (type, ...points) => session.send('Input.dispatchTouchEvent', {
      type, touchPoints: points.map(([x, y], id) => ({ x, y, id })),
    });
    await changes(async () => {
      await touch('touchStart', [500, 500]);
      await touch('touchMove', [540, 520]);
      await touch('touchMove', [560, 530]);
      await touch('touchEnd');
    }, 'azimuth', 'elevation');
    await changes(async () => {
      await touch('touchStart', [500, 500], [600, 500]);
      await touch('touchMove', [480, 510], [640, 510]);
      await touch('touchMove', [460, 520], [680, 520]);
      await touch('touchEnd');
    }, 'target', 'distance');
    await tab.locator('[data-does=top]').click();
    assert.ok((await camera(opened)).elevation > 1.5);
    await canvas.press('0');
    await settled(opened);
  });

  test('have a distance', async () => {
    const { tab } = opened;
    await tab.locator('[data-does=distance]').click();
    for (const [x, y] of [[480, 620], [900, 400]]) await tab.mouse.click(x, y);
    const lines = (await reading(opened)).split('\n');
    const [distance, horizontal] = numbers(lines[0]), way = numbers(lines[1]);
    const [from, to] = [numbers(lines[2]), numbers(lines[3])];
    for (const end of [from, to]) { // as the file has them
      const nearest = cloud.reduce((least, row) => Math.min(least, apart(row, end)), Infinity);
      assert.ok(nearest < 0.001, `${end}: ${nearest} m from the nearest point`);
    }
    assert.ok(distance > 1);
    assert.ok(Math.abs(distance - apart(from, to)) < 0.0015, lines.join());
    assert.ok(Math.abs(horizontal - apart(from.slice(0, 2), to.slice(0, 2))) < 0.0015, lines.join());
    way.forEach((one, axis) => assert.ok(Math.abs(one - (to[axis] - from[axis])) < 0.0015, lines.join()));
    assert.equal(await tab.locator('#viewer-marks circle').count(), 2);
    await canvas.press('Escape');
    assert.doesNotMatch(await reading(opened), /Distance/);
  });

  test('have a profile', async () => {
    const { tab } = opened;
    await canvas.press('t');
    await settled(opened);
    await canvas.press('p');
    for (const [x, y] of [[450, 450], [850, 460]]) await tab.mouse.click(x, y);
    const head = tab.locator('#viewer-profile-words');
    const whole = () => tab.waitForFunction(() =>
      /points within/.test(document.getElementById('viewer-profile-words').textContent) &&
      !/…/.test(document.getElementById('viewer-profile-words').textContent), null, { timeout: patience });
    await whole();
    const [a, b] = (await state(opened)).ends;
    const length = apart(a.slice(0, 2), b.slice(0, 2));
    const within = (width) => cloud.filter(([x, y]) => {
      const u = [(b[0] - a[0]) / length, (b[1] - a[1]) / length], v = [x - a[0], y - a[1]];
      const s = u[0] * v[0] + u[1] * v[1];
      return s >= 0 && s <= length && Math.abs(u[0] * v[1] - u[1] * v[0]) <= width / 2;
    }).length;
    for (const width of [Number(await tab.locator('#viewer-width').inputValue()), 1]) {
      if (width === 1) {
        await tab.locator('#viewer-width').fill('1');
        await tab.locator('#viewer-width').press('Enter');
        await whole();
      }
      const count = number(/([\d\u202f]+) points/.exec(await head.innerText())[1]);
      assert.ok(count > 10 && Math.abs(count - within(width)) <= 2 + 0.005 * count, // on the edges
                `${count} points, ${within(width)} in the file`);
    }
    await tab.locator('#viewer-profile-points').hover({ position: { x: 640, y: 100 } });
    await tab.locator('#viewer-profile-close').click();
    assert.ok(await tab.locator('#viewer-profile').isHidden());
    await canvas.press('0');
  });

  test('show more of them where the reader looks closer', async () => {
    await settled(opened);
    const before = await camera(opened);
    await opened.tab.mouse.move(700, 450);
    for (let i = 0; i < 5; ++i) await opened.tab.mouse.wheel(0, -300);
    await settled(opened);
    assert.ok((await camera(opened)).distance < 0.2 * before.distance);
    assert.ok((await state(opened)).drawn > 0);
    await canvas.press('0');
  });

  test('are printed', async () => {
    const { tab } = opened;
    await tab.evaluate(() => window.dispatchEvent(new Event('beforeprint')));
    const picture = tab.locator('#viewer img.printed');
    assert.ok(await picture.evaluate(async (image) => {
      await image.decode();
      return image.naturalWidth > 1000;
    }));
    await tab.evaluate(() => window.dispatchEvent(new Event('afterprint')));
    assert.equal(await picture.count(), 0);
  });

  test('complain about nothing and ask for nothing', () => assert.deepEqual(opened.complaints, []));

  test('fit a narrow dark screen', async () => {
    const narrow = await view('hall', { viewport: { width: 400, height: 800 }, colorScheme: 'dark' });
    assert.ok(await narrow.tab.evaluate(() => document.documentElement.scrollWidth <= 400));
    assert.deepEqual(narrow.complaints, []);
    await narrow.context.close();
  });

  test('give way to words where there is no WebGL and no script', async () => {
    const without = await newTab(browser);
    await without.context.addInitScript(() => {
      HTMLCanvasElement.prototype.getContext = new Proxy(HTMLCanvasElement.prototype.getContext, {
        apply: (target, self, [kind, ...rest]) =>
          (kind.startsWith('webgl') ? null : Reflect.apply(target, self, [kind, ...rest])),
      });
    });
    await without.draw(pageOf('hall'));
    assert.match(await without.tab.locator('#viewer').innerText(), /needs? WebGL/);
    await without.context.close();
    const bare = await newTab(browser, { javaScriptEnabled: false });
    await bare.open(pageOf('hall'));
    assert.ok(await bare.tab.locator('#viewer').isHidden());
    assert.match(await bare.tab.locator('main').innerText(), /Uncertainty of the points/);
    await bare.context.close();
  });
});

test('what has changed has its colours', async () => {
  for (const name of ['first', 'second']) await makeCloud(name, 1, 'las');
  await risley(folder, 0, 'compare', 'first.las', 'second.las', '-o', pageOf('change'));
  const opened = await view('change');
  const words = await opened.tab.locator('#viewer-colouring option').allInnerTexts();
  assert.match(words[0], /^distance over the level of detection/);
  assert.match(await opened.tab.locator('#viewer-words').innerText(), /changed beyond the level of detection/);
  const state = await opened.tab.evaluate(() => window.risleyViewer.state());
  assert.equal(state.drawn, await opened.tab.evaluate(() => window.risleyViewer.data.points));
  assert.deepEqual(opened.complaints, []);
  await opened.context.close();
});
