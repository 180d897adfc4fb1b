// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What a page of results has to do. Every check takes an open page and returns complaints: an
// empty list is good. checks_test.mjs proves that they can complain.
import { statSync } from 'node:fs';
import { look } from './looking.mjs';

const largestFile = 4 * 1024 * 1024;
const noise = 0.02; // of an axis: a pixel or two of a drawn box

const otherPixels = 0.002; // of a picture: by so much it may differ from itself

const width = ([from, to]) => to - from;
const near = (a, b, span) => Math.abs(a - b) <= noise * span;
const sameExtents = (a, b) =>
  a.every((axis, i) => axis.every((end, j) => near(end, b[i][j], width(b[i]))));

export async function figuresOf(tab) {
  return tab.evaluate(() => window.risley.charts.map(({ data, place }, index) => ({
    index, id: place.id, kind: data.kind, title: data.title,
    sort: [data.kind, data.palette, data.value_range !== null, ...data.series.map((series) =>
      series.kind + (series.value.length > 0) + (series.x.length > 1000))].join(),
    aria: place.getAttribute('aria-label'),
    caption: place.closest('figure').querySelector('figcaption').textContent,
  })));
}

// The first of all that are drawn in the same way, for checks that take long.
const oneOfEachSort = (figures) => figures.filter(({ sort }, i) =>
  i === figures.findIndex((other) => other.sort === sort));

const flatOnes = async (tab) => (await figuresOf(tab)).filter(({ kind }) => kind !== 'space');
const spaceOnes = async (tab) => (await figuresOf(tab)).filter(({ kind }) => kind === 'space');

async function boxOf(tab, { id, index }) {
  const place = tab.locator('#' + id);
  await place.evaluate((element) => element.scrollIntoView({ block: 'center' }));
  const { x, y } = await place.boundingBox();
  const area = await tab.evaluate((k) => window.looking.area(k), index);
  return { x: x + area.x, y: y + area.y, width: area.width, height: area.height, place: { x, y } };
}

const extents = (tab, { index }) => tab.evaluate((k) => window.looking.extents(k), index);
// Tooltips and repaints come with the next frames.
const frames = (tab) => tab.evaluate(() => new Promise((done) =>
  requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 30)))));

const differ = async (tab, one, other) => one !== other &&
  await tab.evaluate(([a, b]) => window.looking.difference(a, b), [one, other]) > otherPixels;

export function checkFile(file) {
  const { size } = statSync(file);
  return size > largestFile ? [`${size} bytes, allowed ${largestFile}`] : [];
}

// Every figure stands in the page, is named for those who do not see it, and shows its data.
export async function checkDrawn(tab) {
  await look(tab);
  const complaints = [];
  const figures = await figuresOf(tab);
  const places = await tab.locator('figure .plot').count();
  if (figures.length === 0) complaints.push('no diagram');
  if (figures.length !== places) complaints.push(`${figures.length} of ${places} diagrams drawn`);
  for (const figure of figures) {
    const say = (text) => complaints.push(`${figure.title}: ${text}`);
    if (figure.caption !== figure.title) say('has the caption ' + figure.caption);
    if (!figure.aria?.includes(figure.title)) say('has the label ' + figure.aria);
    const all = await tab.evaluate((k) => window.looking.drawn(k), figure.index);
    if (!all.some(({ values }) => values > 0)) say('holds no values');
    for (const one of all) {
      if (one.values === 0 || one.hidden) continue;
      const counts = JSON.stringify(one);
      const dots = Math.min(one.values, 10); // others may cover most of a thin one
      if (one.pixels < dots) say('a series has no pixels of its colour: ' + counts);
      if (figure.kind === 'space') continue;
      if (one.any < 0.95 * one.looked) say('points are not drawn: ' + counts);
      if (one.looked > 0 && one.own === 0) say('a series is not where its points are: ' + counts);
    }
  }
  return complaints;
}

// Pointing at a value shows it.
export async function checkHover(tab) {
  await look(tab);
  const complaints = [];
  for (const figure of await flatOnes(tab)) {
    const { place } = await boxOf(tab, figure);
    const point = await tab.evaluate((k) => window.looking.pointToHover(k), figure.index);
    if (!point) {
      complaints.push(`${figure.title}: no point to point at`);
      continue;
    }
    await tab.mouse.move(place.x + point.x - 3, place.y + point.y);
    await tab.mouse.move(place.x + point.x, place.y + point.y);
    await frames(tab);
    const tip = await tab.evaluate(([k, x, y]) => window.looking.tooltip(k, x, y),
                                   [figure.index, point.x, point.y]);
    if (!tip.visible) complaints.push(`${figure.title}: no tooltip at ${JSON.stringify(point)}`);
    else if (!tip.right) complaints.push(`${figure.title}: the tooltip says ${tip.text}`);
    await tab.mouse.move(2, 2);
  }
  return complaints;
}

// Boxes thick and thin, double click, wheel, Shift and dragging.
// most: so many diagrams at most, where one that fails is enough
export async function checkMouse(tab, most = Infinity) {
  await look(tab);
  const complaints = [];
  for (const figure of oneOfEachSort(await flatOnes(tab)).slice(0, most)) {
    const say = (text) => complaints.push(`${figure.title}: ${text}`);
    const box = await boxOf(tab, figure);
    const whole = await extents(tab, figure);
    const at = (x, y) => [box.x + x * box.width, box.y + y * box.height];
    const middle = at(0.5, 0.5);
    const drag = async (from, to) => {
      await tab.mouse.move(...from);
      await tab.mouse.down();
      await tab.mouse.move(0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1]));
      await tab.mouse.move(...to);
      await tab.mouse.up();
      await frames(tab);
    };
    const corners = [at(0.3, 0.25), at(0.6, 0.7)];
    const wanted = await tab.evaluate(([k, points]) => {
      const { chart } = window.risley.charts[k];
      const values = points.map((p) => chart.convertFromPixel({ gridIndex: 0 }, p));
      return [0, 1].map((i) => values.map((v) => v[i]).sort((a, b) => a - b));
    }, [figure.index, corners.map(([x, y]) => [x - box.place.x, y - box.place.y])]);

    await drag(...corners);
    const zoomed = await extents(tab, figure);
    if (!zoomed.every((axis, i) => axis.every((end, j) => near(end, wanted[i][j], width(whole[i]))))) {
      say(`a box ${JSON.stringify(wanted)} zooms to ${JSON.stringify(zoomed)}`);
    }

    await tab.keyboard.down('Shift');
    await drag(at(0.3, 0.5), at(0.5, 0.5));
    await tab.keyboard.up('Shift');
    const moved = await extents(tab, figure);
    const way = Math.abs(moved[0][0] - zoomed[0][0]);
    if (Math.abs(way - 0.2 * width(zoomed[0])) > 0.05 * width(zoomed[0]) ||
        !near(width(moved[0]), width(zoomed[0]), width(whole[0]))) {
      say(`Shift and dragging moves ${JSON.stringify(zoomed)} to ${JSON.stringify(moved)}`);
    }

    await tab.mouse.dblclick(...middle);
    await frames(tab);
    const restored = await extents(tab, figure);
    if (!sameExtents(restored, whole)) say('a double click leaves ' + JSON.stringify(restored));

    await drag(at(0.3, 0.5), [at(0.6, 0)[0], at(0, 0.5)[1] + 2]);
    const thin = await extents(tab, figure);
    if (!thin[0].every((end, j) => near(end, wanted[0][j], width(whole[0]))) ||
        !near(width(thin[1]), width(whole[1]), width(whole[1]))) {
      say('a box that is hardly a line zooms to ' + JSON.stringify(thin));
    }
    await tab.mouse.dblclick(...middle);
    await frames(tab);

    const scrolled = () => tab.evaluate(() => window.scrollY);
    const before = await scrolled();
    await tab.keyboard.down('Control');
    await tab.mouse.wheel(0, -240);
    await tab.waitForTimeout(120);
    await tab.keyboard.up('Control');
    const wheeled = await extents(tab, figure);
    if (!wheeled.every((axis, i) => width(axis) < 0.98 * width(whole[i]))) {
      say('Ctrl and the wheel do not zoom: ' + JSON.stringify(wheeled));
    }
    if (Math.abs((await scrolled()) - before) > 1) say('Ctrl and the wheel scroll the page');

    await tab.mouse.wheel(0, before > 200 ? -150 : 150);
    await tab.waitForFunction((from) => Math.abs(window.scrollY - from) > 50, before,
                              { timeout: 5000 })
      .catch(() => say('the wheel does not scroll the page'));
    if (!sameExtents(await extents(tab, figure), wheeled)) say('the wheel alone zooms');
    await tab.mouse.move(2, 2);
    await tab.evaluate((k) => window.risley.charts[k].place.dispatchEvent(
      new KeyboardEvent('keydown', { key: '0' })), figure.index);
  }
  return complaints;
}

// Tab reaches every diagram; keys zoom, move, show all and speak.
export async function checkKeyboard(tab) {
  await look(tab);
  const complaints = [];
  const figures = await figuresOf(tab);
  const reached = new Set();
  await tab.evaluate(() => { document.activeElement.blur(); window.scrollTo(0, 0); });
  for (let i = 0; i < 4 * figures.length + 20; ++i) {
    await tab.keyboard.press('Tab');
    reached.add(await tab.evaluate(() => document.activeElement.id));
  }
  if (!reached.has('theme')) complaints.push('Tab does not reach the button #theme');
  for (const figure of figures) {
    const say = (text) => complaints.push(`${figure.title}: ${text}`);
    if (!reached.has(figure.id)) say('Tab does not reach it');
    if (figure.kind === 'space') continue;
    await tab.focus('#' + figure.id);
    const whole = await extents(tab, figure);
    await tab.keyboard.press('+');
    await tab.keyboard.press('+');
    const zoomed = await extents(tab, figure);
    if (!zoomed.every((axis, i) => width(axis) < 0.8 * width(whole[i]))) say('+ does not zoom');
    await tab.keyboard.press('ArrowRight');
    await tab.keyboard.press('ArrowUp');
    const moved = await extents(tab, figure);
    if (!moved.every((axis, i) => Math.abs(axis[0] - zoomed[i][0]) > 0.02 * width(zoomed[i]))) {
      say('arrows do not move it');
    }
    await tab.keyboard.press('-');
    if (!(width((await extents(tab, figure))[0]) > width(moved[0]))) say('- does not zoom out');
    await tab.keyboard.press('0');
    if (!sameExtents(await extents(tab, figure), whole)) say('0 does not show all');
    const spoken = [];
    for (const key of ['n', 'n', 'p']) {
      await tab.keyboard.press(key);
      spoken.push(await tab.locator('#spoken').textContent());
    }
    const labels = await tab.evaluate((k) => {
      const { data } = window.risley.charts[k];
      return { x: data.x_label, y: data.y_label, points: data.series[0].x.length };
    }, figure.index);
    if (!spoken.every((text) => text.includes(labels.x) && text.includes(labels.y) &&
                      /\d/.test(text))) say('n speaks ' + JSON.stringify(spoken));
    if (labels.points > 1 && (spoken[0] === spoken[1] || spoken[0] !== spoken[2])) {
      say('n and p do not go through the points: ' + JSON.stringify(spoken));
    }
    await tab.keyboard.press('0');
  }
  return complaints;
}

// Dragging and arrow keys rotate what has three dimensions.
export async function checkRotation(tab) {
  await look(tab);
  const complaints = [];
  for (const figure of await spaceOnes(tab)) {
    const say = (text) => complaints.push(`${figure.title}: ${text}`);
    const box = await boxOf(tab, figure);
    const picture = () => tab.evaluate((k) => window.risley.charts[k].chart.getDataURL(),
                                       figure.index);
    const still = await picture();
    if (still !== await picture()) say('it does not stand still');
    await tab.mouse.move(box.x + 0.5 * box.width, box.y + 0.5 * box.height);
    await tab.mouse.down();
    await tab.mouse.move(box.x + 0.6 * box.width, box.y + 0.5 * box.height, { steps: 4 });
    await tab.mouse.up();
    await tab.waitForTimeout(200);
    const turned = await picture();
    if (turned === still) say('dragging does not rotate it');
    await tab.focus('#' + figure.id);
    for (const key of ['ArrowRight', 'ArrowUp', '+']) {
      const before = await picture();
      await tab.keyboard.press(key);
      await tab.waitForTimeout(200);
      if (await picture() === before) say(key + ' changes nothing');
    }
    await tab.keyboard.press('0');
    await tab.waitForTimeout(200);
    if (await picture() !== still) say('0 does not turn it back');
  }
  return complaints;
}

// The button changes the colours, everything is drawn in both, and the way back is the way back.
export async function checkTheme(tab) {
  await look(tab);
  const complaints = [];
  const theme = () => tab.evaluate(() => document.documentElement.dataset.theme);
  const paper = () => tab.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const pictures = () => tab.evaluate(() => window.risley.charts.map(({ chart }) =>
    chart.getDataURL()));
  const first = { theme: await theme(), paper: await paper(), pictures: await pictures() };
  await tab.click('#theme');
  await tab.mouse.move(2, 2);
  await frames(tab);
  if (await theme() === first.theme) complaints.push('the button leaves the theme');
  if (await paper() === first.paper) complaints.push('the button leaves the paper');
  const titles = (await figuresOf(tab)).map(({ title }) => title);
  (await pictures()).forEach((picture, i) => {
    if (picture === first.pictures[i]) complaints.push(titles[i] + ': is not drawn anew');
  });
  for (const complaint of await checkDrawn(tab)) {
    complaints.push(`${complaint} (theme ${await theme()})`);
  }
  await tab.click('#theme');
  await tab.mouse.move(2, 2);
  await frames(tab);
  for (const [i, picture] of (await pictures()).entries()) {
    if (await differ(tab, picture, first.pictures[i])) {
      complaints.push(titles[i] + ': looks different afterwards');
    }
  }
  return complaints;
}

// Widths and heights of the pictures in a PDF of Chromium.
function picturesIn(pdf) {
  const text = pdf.toString('latin1');
  return [...text.matchAll(/<<[^<>]*\/Subtype \/Image[^<>]*>>/g)].map(([entry]) => [
    Number(/\/Width (\d+)/.exec(entry)?.[1]), Number(/\/Height (\d+)/.exec(entry)?.[1]),
  ]);
}

// Printed pages show every diagram, in light colours; afterwards the page is as it was.
export async function checkPrint(tab, file) {
  await look(tab);
  const complaints = [];
  const titles = (await figuresOf(tab)).map(({ title }) => title);
  await tab.evaluate(() => {
    window.addEventListener('beforeprint', () => {
      window.printed = [...document.querySelectorAll('img.printed')].map((image) => ({
        url: image.src, alt: image.alt, shown: getComputedStyle(image).display,
      }));
    }, { once: true });
  });
  const before = await tab.evaluate(() => window.risley.charts.map(({ chart }) =>
    chart.getDataURL()));
  const pdf = await tab.pdf({ path: file, format: 'A4', margin: {
    top: '12mm', bottom: '12mm', left: '12mm', right: '12mm',
  } });
  const printed = await tab.evaluate(async () => Promise.all((window.printed ?? []).map(
    async (one) => {
      const image = new Image();
      image.src = one.url;
      await image.decode();
      return {
        alt: one.alt, busy: await window.looking.busyShare(one.url),
        size: [image.naturalWidth, image.naturalHeight],
      };
    })));
  const pages = (pdf.toString('latin1').match(/\/Type \/Page\b(?!s)/g) ?? []).length;
  if (pages === 0) complaints.push('the PDF has no pages');
  if (printed.length !== titles.length) {
    complaints.push(`${printed.length} of ${titles.length} diagrams are printed`);
  }
  const inPdf = new Set(picturesIn(pdf).map(String));
  printed.forEach((picture, i) => {
    if (picture.alt !== titles[i]) complaints.push(`${titles[i]}: printed as ${picture.alt}`);
    if (picture.busy < 0.01) complaints.push(`${titles[i]}: printed blank`);
    if (!inPdf.has(String(picture.size))) {
      complaints.push(`${titles[i]}: no picture of ${picture.size} in the PDF`);
    }
  });
  await frames(tab);
  if (await tab.locator('img.printed').count() > 0) complaints.push('printed pictures stay');
  const after = await tab.evaluate(() => window.risley.charts.map(({ chart }) =>
    chart.getDataURL()));
  for (const [i, picture] of after.entries()) {
    if (await differ(tab, picture, before[i])) {
      complaints.push(`${titles[i]}: looks different after printing`);
    }
  }
  return complaints;
}

// Nothing sticks out sideways.
export async function checkWidth(tab) {
  const found = await tab.evaluate(() => {
    const room = document.documentElement.clientWidth;
    return {
      room, needed: document.documentElement.scrollWidth,
      wide: [...document.querySelectorAll('main *')].filter((element) =>
        !element.closest('.wide, .hidden, .plot') &&
        element.getBoundingClientRect().right > room + 1)
        .map((element) => element.tagName + '.' + element.className).slice(0, 5),
    };
  });
  return found.needed > found.room
    ? [`${found.needed} pixels wide where ${found.room} are: ${found.wide.join(', ')}`] : [];
}

// Texts and tables are there without JavaScript, and a note says why diagrams are not.
export async function checkWithoutScript(bare, tab) {
  const complaints = [];
  if (!await bare.locator('noscript p').isVisible()) complaints.push('no note');
  for (const selector of ['h1', 'h2', 'table', 'td', 'figcaption']) {
    const [found, wanted] = [await bare.locator(selector).allInnerTexts(),
                             await tab.locator(selector).allInnerTexts()];
    if (found.join('\n') !== wanted.join('\n')) complaints.push(selector + ' differ');
  }
  return complaints;
}
