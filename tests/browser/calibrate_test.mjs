#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The pages of cloud and calibrate, made by the command and opened in a browser. What the script that
// all pages share does with mouse, keys, colours and paper is tried on the one of calibrate, which
// has diagrams of three dimensions, and in estimate_test.mjs.
import { join } from 'node:path';
import { skipWithoutBrowser } from './browser.mjs';
import { inspect, ownFolder, risley, source } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();

inspect('cloud', async () => {
  await risley(folder, 0, 'cloud', '--calibration', 'mid-40', '--beam-origin-map', 'origins.html');
  return join(folder, 'origins.html');
}, /beam/, false);

inspect('calibrate', async () => {
  await risley(folder, 0, 'simulate', '-o', 'hall.lvx', '--sensor', 'mid-40-table3', '--reported',
               'nominal', '--scene', join(source, 'data/hall.yaml'), '--duration-s', '10',
               '--seed', '1');
  await risley(folder, 0, 'calibrate', 'hall.lvx', '--truth', 'hall.lvx.truth.yaml', '-o', 'calibrate');
  return join(folder, 'calibrate/report.html');
}, /planes/);
