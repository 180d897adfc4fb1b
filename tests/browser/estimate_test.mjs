#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The pages of estimate, made by the command and opened in a browser. What the script that all pages
// share does with mouse, keys, colours and paper is tried here and in calibrate_test.mjs.
import { join } from 'node:path';
import { skipWithoutBrowser } from './browser.mjs';
import { inspect, ownFolder, risley } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();

inspect('not-converged', async () => {
  await risley(folder, 0, 'simulate', '-o', 'short.nc', '--sensor', 'mid-40-table3', '--rotor',
               'sinusoidal', '--duration-s', '2', '--seed', '1');
  await risley(folder, 1, 'estimate', 'short.nc', '--free', 'wedge_angle_deg',
               '--free', 'refractive_index_air', '-o', 'not-converged');
  return join(folder, 'not-converged/report.html');
}, /Not converged: do not use these numbers/, false);

inspect('estimate', async () => {
  await risley(folder, 0, 'simulate', '-o', 'mid.nc', '--sensor', 'mid-40-table3', '--rotor',
               'sinusoidal', '--duration-s', '30', '--seed', '1');
  await risley(folder, 0, 'estimate', 'mid.nc', '--truth', 'mid.nc.truth.yaml', '-o', 'estimate');
  return join(folder, 'estimate/report.html');
}, /3\u202f000\u202f000 shots/);
