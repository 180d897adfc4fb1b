// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What a page of results has to do. Every check takes an open page and returns complaints: an
// empty list is good. checks_test.mjs proves that they can complain.
import { statSync } from 'node:fs';
import { contrast, difference, eyes, lab } from './colours.mjs';
import { look } from './looking.mjs';

const largestFile = 4 * 1024 * 1024;
const noise = 0.02; // of an axis: a pixel or two of a drawn box

// CIELAB units between colours that stand for different things; 2.3 are just noticed side by side.
const leastDifference = 20;
const leastContrast = 3; // of lines and dots with what is behind them, WCAG 1.4.11
const tallestPage = 4000; // before anything is unfolded
const otherPixels = 0.002; // of a picture: by so much it may differ from itself
const longestReaction = 30_000; // ms, of a page to a hand, on a busy machine; a good one is not waited for

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

// Brings a diagram to the middle of the window. place: its corner, in pixels of the window.
const boxOf = (tab, { index }) => tab.evaluate((k) => {
  const { place } = window.risley.charts[k];
  place.scrollIntoView({ block: 'center' });
  const { x, y } = place.getBoundingClientRect();
  const area = window.looking.area(k);
  return { x: x + area.x, y: y + area.y, width: area.width, height: area.height, place: { x, y } };
}, index);

const extents = (tab, { index }) => tab.evaluate((k) => window.looking.extents(k), index);

// Repaints come with the next frames.
const frames = (tab) => tab.evaluate(() => new Promise((done) =>
  requestAnimationFrame(() => requestAnimationFrame(done))));

// The last value read, whether or not it became good, for the message of a failure.
async function whenGood(tab, read, good, patience = longestReaction) {
  const last = performance.now() + patience;
  for (;;) {
    const found = await read();
    if (good(found) || performance.now() > last) return found;
    await frames(tab);
  }
}

// Keys one after another, as quickly.
const press = (tab, ...keys) => Promise.all(keys.map((key) => tab.keyboard.press(key)));

// A mouse in a quick hand: it does not wait for the page to be drawn between its events.
async function gesture(tab, events) {
  const session = await tab.context().newCDPSession(tab);
  await Promise.all(events.map(([type, [x, y], more]) =>
    session.send('Input.dispatchMouseEvent', { type, x, y, ...more })));
  await session.detach();
}

function drag(tab, from, to, { shiftKey = false } = {}) {
  const middle = from.map((v, i) => 0.5 * (v + to[i]));
  const modifiers = shiftKey ? 8 : 0, left = { modifiers, button: 'left', clickCount: 1 };
  return gesture(tab, [
    ['mouseMoved', from, { modifiers }], ['mousePressed', from, { ...left, buttons: 1 }],
    ['mouseMoved', middle, { modifiers, buttons: 1 }],
    ['mouseMoved', to, { modifiers, buttons: 1 }], ['mouseReleased', to, left],
  ]);
}

const doubleClick = (tab, at) => gesture(tab, [['mouseMoved', at], ...[1, 2].flatMap((clickCount) =>
  ['mousePressed', 'mouseReleased'].map((type) => [type, at, { button: 'left', clickCount }]))]);

const differences = (tab, one, other) =>
  tab.evaluate(([a, b]) => window.looking.differences(a, b), [one, other]);

// Keeps how all diagrams look, once they look so twice in a row: those of three dimensions become
// finer for some frames.
async function remember(tab, album) {
  const keep = (name) => tab.evaluate((name) => window.looking.remember(name), name);
  if ((await spaceOnes(tab)).length === 0) {
    await keep(album);
    return;
  }
  await whenGood(tab, async () => {
    await keep('two frames before');
    await frames(tab);
    await keep(album);
    return differences(tab, 'two frames before', album);
  }, (changes) => changes.every(({ same }) => same));
}

export function checkFile(file) {
  const { size } = statSync(file);
  return size > largestFile ? [`${size} bytes, allowed ${largestFile}`] : [];
}

// Every figure stands in the page, has a name for screen readers, and shows its data.
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
// most: so many diagrams at most, where one that fails is enough. patience: ms to wait for it, for
// pages that will not do it
export async function checkHover(tab, { most = Infinity, patience = longestReaction } = {}) {
  await look(tab);
  const complaints = [];
  for (const figure of (await flatOnes(tab)).slice(0, most)) {
    const { place } = await boxOf(tab, figure);
    const point = await tab.evaluate((k) => window.looking.pointToHover(k), figure.index);
    if (!point) {
      complaints.push(`${figure.title}: no point to point at`);
      continue;
    }
    await tab.mouse.move(place.x + point.x - 3, place.y + point.y);
    await tab.mouse.move(place.x + point.x, place.y + point.y);
    const tip = await whenGood(tab, () => tab.evaluate(
      ([k, x, y]) => window.looking.tooltip(k, x, y), [figure.index, point.x, point.y]),
                               ({ visible, right }) => visible && right, patience);
    if (!tip.visible) complaints.push(`${figure.title}: no tooltip at ${JSON.stringify(point)}`);
    else if (!tip.right) complaints.push(`${figure.title}: the tooltip says ${tip.text}`);
    await tab.mouse.move(2, 2);
  }
  return complaints;
}

// Boxes thick and thin, double click, wheel, Shift and dragging.
// most, patience: as for checkHover
export async function checkMouse(tab, { most = Infinity, patience = longestReaction } = {}) {
  await look(tab);
  const complaints = [];
  for (const figure of oneOfEachSort(await flatOnes(tab)).slice(0, most)) {
    const say = (text) => complaints.push(`${figure.title}: ${text}`);
    const box = await boxOf(tab, figure);
    const whole = await extents(tab, figure);
    const at = (x, y) => [box.x + x * box.width, box.y + y * box.height];
    const middle = at(0.5, 0.5);
    const reach = (good) => whenGood(tab, () => extents(tab, figure), good, patience);
    const corners = [at(0.3, 0.25), at(0.6, 0.7)];
    const wanted = await tab.evaluate(([k, points]) => {
      const { chart } = window.risley.charts[k];
      const values = points.map((p) => chart.convertFromPixel({ gridIndex: 0 }, p));
      return [0, 1].map((i) => values.map((v) => v[i]).sort((a, b) => a - b));
    }, [figure.index, corners.map(([x, y]) => [x - box.place.x, y - box.place.y])]);

    await drag(tab, ...corners);
    const isWanted = (found) => found.every((axis, i) =>
      axis.every((end, j) => near(end, wanted[i][j], width(whole[i]))));
    const zoomed = await reach(isWanted);
    if (!isWanted(zoomed)) {
      say(`a box ${JSON.stringify(wanted)} zooms to ${JSON.stringify(zoomed)}`);
    }

    await tab.keyboard.down('Shift');
    await drag(tab, at(0.3, 0.5), at(0.5, 0.5), { shiftKey: true });
    await tab.keyboard.up('Shift');
    const isMoved = ([found]) =>
      Math.abs(Math.abs(found[0] - zoomed[0][0]) - 0.2 * width(zoomed[0])) <=
        0.05 * width(zoomed[0]) && near(width(found), width(zoomed[0]), width(whole[0]));
    const moved = await reach(isMoved);
    if (!isMoved(moved)) {
      const came = await tab.evaluate(() => window.looking.mouseNotes());
      say(`Shift and dragging moves ${JSON.stringify(zoomed)} to ${JSON.stringify(moved)}, after ${came}`);
    }

    const isWhole = (found) => sameExtents(found, whole);
    await doubleClick(tab, middle);
    const restored = await reach(isWhole);
    if (!isWhole(restored)) say('a double click leaves ' + JSON.stringify(restored));

    await drag(tab, at(0.3, 0.5), [at(0.6, 0)[0], at(0, 0.5)[1] + 2]);
    const isThin = (found) =>
      found[0].every((end, j) => near(end, wanted[0][j], width(whole[0]))) &&
      near(width(found[1]), width(whole[1]), width(whole[1]));
    const thin = await reach(isThin);
    if (!isThin(thin)) say('a box that is hardly a line zooms to ' + JSON.stringify(thin));
    await doubleClick(tab, middle);
    await reach(isWhole);

    const scrolled = () => tab.evaluate(() => window.scrollY);
    const before = await scrolled();
    await tab.mouse.move(...middle);
    await tab.keyboard.down('Control');
    await tab.mouse.wheel(0, -240);
    const isNearer = (found) => found.every((axis, i) => width(axis) < 0.98 * width(whole[i]));
    const wheeled = await reach(isNearer);
    await tab.keyboard.up('Control');
    if (!isNearer(wheeled)) {
      say('Ctrl and the wheel do not zoom: ' + JSON.stringify(wheeled));
    }
    await frames(tab); // in which it would scroll
    if (Math.abs((await scrolled()) - before) > 1) say('Ctrl and the wheel scroll the page');

    await tab.mouse.wheel(0, before > 200 ? -150 : 150);
    await tab.waitForFunction((from) => Math.abs(window.scrollY - from) > 50, before,
                              { timeout: patience })
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
  const wanted = ['theme', ...figures.map(({ id }) => id)];
  let reached = new Set();
  await tab.evaluate(() => {
    document.activeElement.blur();
    window.scrollTo(0, 0);
    window.reached = [];
    document.addEventListener('focusin', ({ target }) => window.reached.push(target.id));
  });
  for (let i = 0; i < 4 * figures.length + 20 && !wanted.every((id) => reached.has(id)); i += 10) {
    await press(tab, ...Array(10).fill('Tab'));
    reached = new Set(await tab.evaluate(() => window.reached));
  }
  if (!reached.has('theme')) complaints.push('Tab does not reach the button #theme');
  for (const figure of figures) {
    const say = (text) => complaints.push(`${figure.title}: ${text}`);
    if (!reached.has(figure.id)) say('Tab does not reach it');
    if (figure.kind === 'space') continue;
    await tab.focus('#' + figure.id);
    const whole = await extents(tab, figure);
    await tab.evaluate((k) => window.looking.followKeys(k), figure.index);
    await press(tab, '+', '+', 'ArrowRight', 'ArrowUp', '-', '0', 'n', 'n', 'p');
    const notes = await tab.evaluate(() => window.looking.keyNotes());
    const [, zoomed, , moved, out, all] = notes.map((note) => note.extents);
    if (!zoomed.every((axis, i) => width(axis) < 0.8 * width(whole[i]))) say('+ does not zoom');
    if (!moved.every((axis, i) => Math.abs(axis[0] - zoomed[i][0]) > 0.02 * width(zoomed[i]))) {
      say('arrows do not move it');
    }
    if (!(width(out[0]) > width(moved[0]))) say('- does not zoom out');
    if (!sameExtents(all, whole)) say('0 does not show all');
    const spoken = notes.slice(6).map((note) => note.spoken);
    const labels = await tab.evaluate((k) => {
      const { data } = window.risley.charts[k];
      return { x: data.x_label, y: data.y_label, points: data.series[0].x.length };
    }, figure.index);
    if (!spoken.every((text) => text.includes(labels.x) && text.includes(labels.y) &&
                      /\d/.test(text))) say('n speaks ' + JSON.stringify(spoken));
    if (labels.points > 1 && (spoken[0] === spoken[1] || spoken[0] !== spoken[2])) {
      say('n and p do not go through the points: ' + JSON.stringify(spoken));
    }
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
    // The picture once two in a row are the same: a push goes on for some frames.
    const quiet = async (good) => {
      let last = await picture();
      return whenGood(tab, async () => {
        const before = last;
        last = await picture();
        return before === last ? last : undefined;
      }, (found) => found !== undefined && good(found));
    };
    const still = await quiet(() => true); // newly drawn pictures become finer for some frames
    if (still === undefined) say('it does not come to rest');
    await drag(tab, [box.x + 0.5 * box.width, box.y + 0.5 * box.height],
               [box.x + 0.6 * box.width, box.y + 0.5 * box.height]);
    let now = await quiet((found) => found !== still);
    if (now === still) say('dragging does not rotate it');
    await tab.focus('#' + figure.id);
    for (const key of ['ArrowRight', 'ArrowUp', '+']) {
      const before = now;
      await tab.keyboard.press(key);
      now = await quiet((found) => found !== before);
      if (now === before) say(key + ' changes nothing');
    }
    await tab.keyboard.press('0');
    if (await quiet((found) => found === still) !== still) say('0 does not turn it back');
    await tab.mouse.move(2, 2);
  }
  return complaints;
}

// The button changes the colours, everything is drawn in both, and the way back is the way back.
// Colours that stand for different things in one diagram stay distinct with colour blindness, and
// scales run from dark to light or have their middle at one end of it, light and dark.
export async function checkColours(tab) {
  const complaints = [];
  for (let turn = 0; turn < 2; ++turn) {
    const found = await tab.evaluate(() => {
      const style = getComputedStyle(document.documentElement);
      const named = (name) => style.getPropertyValue('--' + name).trim();
      return { theme: document.documentElement.dataset.theme, behind: named('panel'),
               diagrams: window.risley.charts.map(({ data, chart }) => ({
                 title: data.title,
                 colours: [...new Set(data.series.filter((one) => one.value.length === 0)
                   .map((one) => named(one.colour)))],
                 scale: chart.getOption().visualMap?.[0]?.inRange.color ?? [],
                 palette: data.palette,
               })) };
    });
    for (const { title, colours, scale, palette } of found.diagrams) {
      const say = (text) => complaints.push(`${title}: ${text} (theme ${found.theme})`);
      for (const colour of colours) {
        const ratio = contrast(colour, found.behind);
        if (ratio < leastContrast) say(`${colour} has a contrast of ${ratio.toFixed(1)}`);
      }
      for (const [eye, matrix] of Object.entries(eyes)) {
        colours.forEach((one, i) => colours.slice(i + 1).forEach((other) => {
          const units = difference(one, other, matrix);
          if (units < leastDifference) say(`${one} and ${other} look alike to eyes with ${eye}`);
        }));
        const light = scale.map((one) => lab(one, matrix)[0]);
        const steps = light.slice(1).map((one, i) => one - light[i]);
        const half = steps.length / 2;
        const rises = palette === 'diverging'
          ? steps.every((step, i) => (i < half) === (step > 0)) ||
            steps.every((step, i) => (i < half) === (step < 0))
          : steps.every((step) => step > 0);
        if (!rises) say(`the scale goes to and fro in lightness for eyes with ${eye}`);
        if (palette === 'diverging' && scale.length > 0 &&
            difference(scale[0], scale.at(-1), matrix) < leastDifference) {
          say(`the ends of the scale look alike to eyes with ${eye}`);
        }
      }
    }
    await tab.click('#theme');
    await frames(tab);
  }
  return [...new Set(complaints)];
}

export async function checkTheme(tab) {
  await look(tab);
  const complaints = [];
  const theme = () => tab.evaluate(() => document.documentElement.dataset.theme);
  const paper = () => tab.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const first = { theme: await theme(), paper: await paper() };
  await remember(tab, 'first');
  await tab.click('#theme');
  await tab.mouse.move(2, 2);
  await frames(tab);
  if (await theme() === first.theme) complaints.push('the button leaves the theme');
  if (await paper() === first.paper) complaints.push('the button leaves the paper');
  const titles = (await figuresOf(tab)).map(({ title }) => title);
  await remember(tab, 'other');
  (await differences(tab, 'first', 'other')).forEach(({ same }, i) => {
    if (same) complaints.push(titles[i] + ': is not drawn anew');
  });
  for (const complaint of await checkDrawn(tab)) {
    complaints.push(`${complaint} (theme ${await theme()})`);
  }
  await tab.click('#theme');
  await tab.mouse.move(2, 2);
  await frames(tab);
  await remember(tab, 'again');
  (await differences(tab, 'first', 'again')).forEach(({ share }, i) => {
    if (share > otherPixels) complaints.push(titles[i] + ': looks different afterwards');
  });
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
  const onScreen = await tab.evaluate(async () => {
    const busy = [];
    for (const { data, place } of window.risley.charts) {
      const canvas = place.querySelector('canvas');
      busy.push(data.kind === 'space' ? 0 : (await window.looking.seen(canvas.toDataURL())).busy);
    }
    return busy;
  });
  await tab.evaluate(() => {
    window.addEventListener('beforeprint', () => {
      window.printed = [...document.querySelectorAll('img.printed')].map((image) => ({
        url: image.src, alt: image.alt, shown: getComputedStyle(image).display,
      }));
    }, { once: true });
  });
  await remember(tab, 'before');
  const pdf = await tab.pdf({ path: file, format: 'A4', margin: {
    top: '12mm', bottom: '12mm', left: '12mm', right: '12mm',
  } });
  const printed = await tab.evaluate(async () => {
    const found = [];
    for (const one of window.printed ?? []) {
      found.push({ alt: one.alt, ...await window.looking.seen(one.url) });
    }
    return found;
  });
  const pages = (pdf.toString('latin1').match(/\/Type \/Page\b(?!s)/g) ?? []).length;
  if (pages === 0) complaints.push('the PDF has no pages');
  if (printed.length !== titles.length) {
    complaints.push(`${printed.length} of ${titles.length} diagrams are printed`);
  }
  const inPdf = new Set(picturesIn(pdf).map(String));
  printed.forEach((picture, i) => {
    if (picture.alt !== titles[i]) complaints.push(`${titles[i]}: printed as ${picture.alt}`);
    if (picture.busy < 0.01) complaints.push(`${titles[i]}: printed blank`);
    if (picture.busy < 0.7 * onScreen[i]) {
      complaints.push(`${titles[i]}: printed with less than the screen shows, ` +
        `${picture.busy.toFixed(3)} of the picture instead of ${onScreen[i].toFixed(3)}`);
    }
    if (!inPdf.has(String(picture.size))) {
      complaints.push(`${titles[i]}: no picture of ${picture.size} in the PDF`);
    }
  });
  await frames(tab);
  if (await tab.locator('img.printed').count() > 0) complaints.push('printed pictures stay');
  await remember(tab, 'after');
  (await differences(tab, 'before', 'after')).forEach(({ share }, i) => {
    if (share > otherPixels) complaints.push(`${titles[i]}: looks different after printing`);
  });
  return complaints;
}

// What stands folded is not drawn; a link of the contents leads into its section, the button unfolds
// all, paper gets all, and a page is short before somebody unfolds it.
export async function checkFolding(tab, { patience = longestReaction } = {}) {
  const complaints = [];
  const state = () => tab.evaluate(() => ({
    places: document.querySelectorAll('figure .plot').length,
    folded: document.querySelectorAll('details.section:not([open])').length,
    hidden: document.querySelectorAll('details.section:not([open]) .plot').length,
    drawn: window.risley.charts.length, height: document.documentElement.scrollHeight,
  }));
  const first = await state();
  if (first.height > tallestPage) complaints.push(`${first.height} pixels high, allowed ${tallestPage}`);
  if (first.drawn !== first.places - first.hidden) {
    complaints.push(`${first.drawn} of ${first.places - first.hidden} diagrams drawn at first`);
  }

  await tab.evaluate(() => window.addEventListener('beforeprint', () => {
    window.printedDiagrams = document.querySelectorAll('img.printed').length;
  }, { once: true }));
  await tab.pdf();
  const printed = await tab.evaluate(() => window.printedDiagrams);
  if (printed !== first.places) complaints.push(`${printed} of ${first.places} diagrams are printed`);
  const { folded } = await state();
  if (folded !== first.folded) complaints.push(`${folded} of ${first.folded} sections folded again`);

  const links = await tab.locator('nav.contents a').count();
  const sections = await tab.locator('details.section').count();
  if (links !== sections) complaints.push(`${links} links to ${sections} sections`);
  for (let i = links - 1; i >= 0; --i) {
    const link = tab.locator('nav.contents a').nth(i);
    const title = await link.innerText();
    const section = tab.locator(`[id="${(await link.getAttribute('href')).slice(1)}"]`);
    await link.click();
    const seen = () => section.evaluate((one) => ({
      open: one.open, top: one.getBoundingClientRect().top, room: window.innerHeight,
      places: one.querySelectorAll('.plot').length,
      drawn: window.risley.charts.filter(({ place }) => one.contains(place)).length,
    }));
    const good = ({ open, top, room, places, drawn }) =>
      open && drawn === places && top >= -1 && top < room;
    const found = await whenGood(tab, seen, good, patience);
    if (!found.open) complaints.push(`${title}: the link does not unfold it`);
    if (found.drawn !== found.places) {
      complaints.push(`${title}: ${found.drawn} of ${found.places} diagrams are drawn once it is unfolded`);
    }
    if (!(found.top >= -1 && found.top < found.room)) complaints.push(`${title}: stands at ${found.top}`);
  }

  const isWhole = (now) => now.folded === 0 && now.drawn === now.places;
  if ((await state()).folded > 0) await tab.click('#unfold');
  const all = await whenGood(tab, state, isWhole, patience);
  if (!isWhole(all)) complaints.push(`the button leaves ${JSON.stringify(all)}`);
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
