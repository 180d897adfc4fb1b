#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The pictures of README.md and docs/: which commands make them, and which part of what page they
// show. `scripts/pictures` runs this.
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, rmSync, statSync, symlinkSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { launch, openPage } from '../tests/browser/browser.mjs';

const root = resolve(fileURLToPath(import.meta.url), '../..');
const command = process.env.RISLEY_COMMAND;
const folder = join(root, 'out/pictures'); // the commands run here, as those of the tutorials
const images = join(root, 'docs/images');
const recordings = process.env.RISLEY_VENDOR_DATA; // real ones; their pictures are left out without

// ---- what is computed, each once ----

const simulateUnit = 'risley simulate -o out/unit.lvx --sensor mid-40-table3 ' +
  '--scene data/room.yaml --duration-s 10 --rotor sinusoidal --seed 1';
const simulateHall = 'risley simulate -o out/hall.lvx --sensor mid-40-table3 ' +
  '--reported nominal --scene data/hall.yaml --duration-s 10';

const steps = {
  unit: () => run(simulateUnit),
  estimate: () => {
    need('unit');
    run('risley estimate out/unit.lvx --truth out/unit.lvx.truth.yaml -o out/unit/');
  },
  hall: () => run(simulateHall),
  calibrate: () => {
    need('hall');
    run('risley calibrate out/hall.lvx --truth out/hall.lvx.truth.yaml -o out/calibration/');
  },
  cloud: () => {
    need('calibrate');
    run('risley cloud out/hall.lvx --calibration out/calibration/calibration.yaml -o out/hall.las ' +
      '--report out/hall.html');
  },
  real: () => run(`risley estimate ${resolve(recordings, 'real/mid-40-hub-frame.csv')} ` +
    '--shot-rate-hz 100000 -o out/real/'),
  reproduce: () => run('risley reproduce -o out/reproduction/'),
};

// ---- the pictures ----

// page: the page, of which `keep` stays: {css}, {section: its heading},
// {figure: title}; or lines of a terminal. width: of the page. scale: 2 where text is small.
// rows, columns: as many of every table. before: what to do on the page first.
const pictures = [
  {
    file: 'walls.png', needs: ['calibrate'], page: 'out/calibration/report.html', width: 1160,
    keep: [{ css: '.verdict' }, { figure: /^Walls (before|after)/ }],
  },
  {
    file: 'estimate.png', needs: ['estimate'], page: 'out/unit/report.html', width: 1160,
    keep: [{ css: '.verdict' }, { figure: /^(Angular velocity of prism|Error of the rotation)/ },
           { figure: /^Histogram of the (azimuth|zenith) residuals/ }],
  },
  {
    file: 'residuals.png', needs: ['estimate'], page: 'out/unit/report.html', width: 1160,
    keep: [{ figure: /residuals over (time|the field of view)/i }],
  },
  {
    file: 'simulate.png', needs: ['estimate'], page: 'out/unit/report.html', width: 1160,
    keep: [{ figure: /^(Scan pattern|Density)/ }],
  },
  {
    file: 'calibrate.png', needs: ['calibrate'], page: 'out/calibration/report.html', width: 1160,
    keep: [{ css: '.verdict' }, { section: /^Where the sensor points/ },
           { figure: /^(Walls (before|after)|Thickness over the (angle of incidence|rotation angle of prism A))/ }],
  },
  {
    file: 'cloud.png', needs: ['cloud'], page: 'out/hall.html', width: 1100, show: '#viewer',
  },
  {
    file: 'reproduce.png', needs: ['reproduce'], page: 'out/reproduction/report.html', width: 1160,
    keep: [{ css: '.verdict' }, { section: /^Table 3: a simulated/, without: 'figure', rows: 10, columns: 6 },
           { figure: /^\([ab]\) prism [AB]$/ }],
  },
  {
    file: 'real-mid-40.png', needs: ['real'], page: 'out/real/report.html', width: 1160,
    skip: !recordings && 'RISLEY_VENDOR_DATA does not name a folder of real recordings',
    keep: [{ css: '.verdict' }, { figure: /residuals over (time|the field of view)/i },
           { figure: /^Scan pattern/ }],
  },
  { file: 'info.png', needs: ['unit'], terminal: infoLines },
  { file: 'convert.png', needs: ['unit'], terminal: convertLines },
  { file: 'observability.png', needs: [], terminal: () =>
    said('risley observability --duration-s 30') },
];

// ---- commands ----

const again = process.argv.includes('--again'); // with what the commands wrote last time
const done = new Set();
function need(name) {
  if (again || done.has(name)) return;
  done.add(name);
  steps[name]();
}

function run(line) {
  console.log('$ ' + line);
  const [program, ...words] = line.split(' ');
  return execFileSync(program === 'risley' ? command : program, words,
                      { cwd: folder, encoding: 'utf8', maxBuffer: 1 << 28,
                        stdio: ['ignore', 'pipe', 'inherit'] });
}

// A command and what it prints, as a terminal shows them; only lines that match, if asked for.
function said(line, only = /^/) {
  const lines = run(line).trimEnd().split('\n').filter((text) => only.test(text));
  return [{ typed: line }, ...lines];
}

// The packets of a recording in LVX 1.1 with other times (ns): change(time) returns [type, time].
function retimed(from, to, change) {
  const bytes = readFileSync(join(folder, from));
  let at = 24 + 5 + 59 * bytes.readUInt8(28);
  while (at < bytes.length) {
    const next = Number(bytes.readBigInt64LE(at + 8));
    for (at += 24; at < next;) {
      if (bytes.readUInt8(at + 10) !== 1) throw new Error('not spherical: ' + from);
      const [type, time] = change(Number(bytes.readBigUInt64LE(at + 11)), bytes.readUInt8(at + 9));
      bytes.writeUInt8(type, at + 9);
      bytes.writeBigUInt64LE(BigInt(time), at + 11);
      at += 19 + 100 * 9;
    }
  }
  writeFileSync(join(folder, to), bytes);
}

function infoLines() {
  let first;
  retimed('out/unit.lvx', 'out/gap.lvx', (time, type) => {
    first ??= time;
    return [type, time - first < 4e9 ? time : time + 2e8];
  });
  retimed('out/unit.lvx', 'out/pps.lvx', (time) => [4, (time + 321456000) % 1e9]);
  const times = /^(time from|gaps|time resets|PPS seconds)/;
  return [
    ...said('risley info out/unit.lvx'), '',
    { note: '# 0.2 s of packets missing' }, ...said('risley info out/gap.lvx', times), '',
    { note: '# a clock that falls to zero at every PPS edge' },
    ...said('risley info out/pps.lvx', times),
  ];
}

function convertLines() {
  const names = ['unit.nc', 'unit.csv', 'unit.sequence.csv'];
  const lines = names.flatMap((name) => said(`risley convert out/unit.lvx -o out/${name}`));
  lines.push(...said('risley convert out/unit.csv -o out/again.lvx'), '', { typed: 'ls out' });
  for (const name of ['unit.lvx', ...names, 'again.lvx']) {
    const megabytes = statSync(join(folder, 'out', name)).size / 1e6;
    lines.push(`${megabytes.toFixed(1).padStart(6)} MB  ${name}`);
  }
  for (const name of names.slice(1)) lines.push('', ...said(`head -3 out/${name}`));
  return lines;
}

// ---- pages ----

const escaped = (text) =>
  text.replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;');

function terminalPage(lines) {
  const html = lines.map((line) =>
    line.typed ? `<b>$ ${escaped(line.typed)}</b>`
      : line.note ? `<i>${escaped(line.note)}</i>` : escaped(line));
  const file = join(folder, 'terminal.html');
  writeFileSync(file, `<!doctype html><html lang="en" data-drawn="0"><meta charset="utf-8">
<title>terminal</title><style>
body { margin: 0; } main { display: inline-block; padding: 14px 18px; background: #f5f6f8; }
pre { margin: 0; max-width: 112ch; white-space: pre-wrap; font: 13px/1.45 "DejaVu Sans Mono", monospace; color: #1b1f24; }
b { color: #1a5fc4; font-weight: 600; } i { color: #5b6470; font-style: normal; }
</style><main><pre>${html.join('\n')}</pre></main></html>\n`);
  return file;
}

// Leaves only what is wanted on a page.
function keepOnly(wishes) {
  const main = document.querySelector('main');
  const kept = new Set();
  const missing = [];
  for (const { css, section, figure, without, rows, columns } of wishes) {
    const before = kept.size;
    if (css) main.querySelectorAll(css).forEach((element) => kept.add(element));
    if (section) {
      const found = [...main.querySelectorAll('details.section')].find((one) =>
        new RegExp(section).test(one.querySelector('h2').textContent));
      for (const part of found?.children ?? []) {
        if (!without || !part.matches('.charts, ' + without)) kept.add(part);
        const beyond = [rows && `tbody tr:nth-child(n + ${rows + 1})`,
                        columns && `tr > :nth-child(n + ${columns + 1})`].filter(Boolean).join();
        if (beyond) part.querySelectorAll(beyond).forEach((element) => element.remove());
      }
    }
    if (figure) {
      for (const one of main.querySelectorAll('figure')) {
        if (new RegExp(figure).test(one.querySelector('figcaption').textContent)) kept.add(one);
      }
    }
    if (kept.size === before) missing.push(css ?? section ?? figure);
  }
  for (const element of main.querySelectorAll('*')) {
    const stays = [...kept].some((one) => one.contains(element) || element.contains(one));
    if (!stays) element.style.setProperty('display', 'none', 'important');
  }
  main.style.padding = '1.25rem';
  const first = [...main.querySelectorAll('*')].find((element) => kept.has(element));
  if (first) first.style.marginTop = '0';
  return missing;
}

async function take(browser, picture) {
  picture.needs.forEach(need);
  const file = picture.page ? resolve(folder, picture.page) : terminalPage(picture.terminal());
  const { tab, context, complaints } = await openPage(browser, file, {
    viewport: { width: picture.width ?? 1300, height: 900 },
    deviceScaleFactor: picture.scale ?? 1,
  });
  if (picture.keep) {
    const wishes = picture.keep.map((wish) => Object.fromEntries(Object.entries(wish).map(
      ([key, value]) => [key, value instanceof RegExp ? value.source : value])));
    const missing = await tab.evaluate(keepOnly, wishes);
    if (missing.length > 0) throw new Error(`${picture.file}: the page has no ${missing.join(', ')}`);
  }
  if (picture.before) await tab.evaluate(picture.before);
  await tab.waitForTimeout(500); // diagrams follow their places
  const out = join(images, picture.file);
  await tab.locator(picture.show ?? 'main').screenshot({ path: out });
  await context.close();
  if (complaints.length > 0) throw new Error(`${picture.file}: ${complaints.join('; ')}`);
  console.log(`${picture.file}: ${Math.round(statSync(out).size / 1024)} KB`);
}

const wanted = process.argv.slice(2).filter((word) => word !== '--again');
const unknown = wanted.filter((name) => !pictures.some(({ file }) => file === name));
if (unknown.length > 0) {
  console.error(`unknown: ${unknown.join(', ')}; known: ${pictures.map((p) => p.file).join(', ')}`);
  process.exit(2);
}
mkdirSync(images, { recursive: true });
if (!again) {
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(join(folder, 'out'), { recursive: true });
  symlinkSync(join(root, 'data'), join(folder, 'data'));
}
const browser = await launch();
try {
  for (const picture of pictures) {
    if (wanted.length > 0 && !wanted.includes(picture.file)) continue;
    if (picture.skip) {
      console.log(`${picture.file}: SKIPPED, ${picture.skip}`);
    } else {
      await take(browser, picture);
    }
  }
} finally {
  await browser.close();
}
