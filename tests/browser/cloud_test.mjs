#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The page of a cloud below its points, of which viewer_test.mjs has more.
import { join } from 'node:path';
import { skipWithoutBrowser } from './browser.mjs';
import { inspect, ownFolder, risley, source } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();
const file = join(folder, 'cloud.html');

inspect('cloud', async () => {
  await risley(folder, 0, 'simulate', '-o', 'hall.lvx', '--sensor', 'mid-40',
               '--scene', join(source, 'data/hall.yaml'), '--duration-s', '1');
  await risley(folder, 0, 'cloud', 'hall.lvx', '--calibration', 'mid-40', '-o', 'hall.las',
               '--report', file);
  return file;
}, /Uncertainty of the points/, false);
