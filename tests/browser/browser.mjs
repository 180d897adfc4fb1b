// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Headless Chromium for the tests beside this file and for tools/pictures.mjs.
//   RISLEY_PLAYWRIGHT  folder of the package playwright-core (CMake sets it)
//   RISLEY_CHROMIUM    the browser, if it is not chromium or chromium-browser of PATH
import { accessSync, constants } from 'node:fs';
import { delimiter, join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

export const longestDrawing = 120_000; // ms, on a busy machine
export const usualView = { width: 1300, height: 900 };

function findChromium() {
  if (process.env.RISLEY_CHROMIUM) return process.env.RISLEY_CHROMIUM;
  for (const name of ['chromium', 'chromium-browser']) {
    for (const folder of (process.env.PATH ?? '').split(delimiter)) {
      try {
        accessSync(join(folder, name), constants.X_OK);
        return join(folder, name);
      } catch {
        continue;
      }
    }
  }
  return undefined;
}

// Ends the process with the status that ctest shows as skipped, if something is missing.
export function skipWithoutBrowser() {
  const missing = [];
  if (!process.env.RISLEY_PLAYWRIGHT) missing.push('RISLEY_PLAYWRIGHT');
  if (!findChromium()) missing.push('chromium (or RISLEY_CHROMIUM)');
  if (missing.length === 0) return;
  console.log('SKIPPED: no ' + missing.join(', no '));
  process.exit(77);
}

export async function launch() {
  const index = join(resolve(process.env.RISLEY_PLAYWRIGHT), 'index.mjs');
  const { chromium } = await import(pathToFileURL(index).href);
  return chromium.launch({
    executablePath: findChromium(),
    // WebGL without a graphics card, and only WebGL: the rest is drawn faster without OpenGL. Pages
    // close before what the slowest compiler of JavaScript does has paid.
    args: ['--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist',
           '--disable-gpu-compositing', '--disable-gpu-rasterization',
           '--disable-accelerated-2d-canvas', '--js-flags=--no-turbofan'],
  });
}

// A new tab. open: opens a file in it. draw: also waits until its diagrams are drawn, and returns the
// milliseconds from the start of the navigation until then. unfold: unfolds all
// sections and waits for their diagrams, openSections does not wait. complaints: what the page opened
// last says or asks for and should not.
export async function newTab(browser, options = {}) {
  const context = await browser.newContext({
    viewport: usualView, colorScheme: 'light', reducedMotion: 'reduce',
    ...options,
  });
  context.setDefaultTimeout(longestDrawing);
  const tab = await context.newPage();
  const complaints = [];
  let own;
  // The browser's own word about how it brings WebGL to the screen without a graphics card.
  const drivers = /GL Driver Message \(OpenGL, Performance, .* GPU stall due to ReadPixels/;
  tab.on('console', (message) => {
    if (['error', 'warning'].includes(message.type()) && !drivers.test(message.text())) {
      complaints.push(message.type() + ' on the console: ' + message.text());
    }
  });
  tab.on('pageerror', (error) => complaints.push('uncaught: ' + error.message));
  tab.on('request', (request) => {
    const url = request.url();
    if (url !== own && !/^(data|blob):/.test(url)) complaints.push('request: ' + url);
  });
  const open = async (file) => {
    complaints.length = 0;
    own = pathToFileURL(resolve(file)).href;
    await tab.goto(own);
  };
  const draw = async (file) => {
    await open(file);
    await tab.waitForFunction(() => document.documentElement.dataset.drawn, null,
                              { timeout: longestDrawing, polling: 10 });
    return tab.evaluate(() => performance.now());
  };
  const openSections = () => tab.evaluate(() => {
    for (const section of document.querySelectorAll('details')) section.open = true;
  });
  const unfold = async () => {
    await openSections();
    await tab.waitForFunction(() =>
      (window.risley?.charts.length ?? 0) === document.querySelectorAll('figure .plot').length, null,
                              { timeout: longestDrawing, polling: 10 });
  };
  return { tab, context, complaints, open, openSections, draw, unfold };
}

// A new tab in which all diagrams of a page are drawn; those that are not folded after so many
// milliseconds.
export async function openPage(browser, file, options = {}) {
  const opened = await newTab(browser, options);
  const milliseconds = await opened.draw(file);
  await opened.unfold();
  return { ...opened, milliseconds };
}
