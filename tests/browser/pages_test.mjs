#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The pages of estimate, calibrate and cloud, made by the command and opened in a browser. What
// the script that they share does with mouse, keys, colours and paper is tried on two of them.
import { join } from 'node:path';
import { skipWithoutBrowser } from './browser.mjs';
import { inspect, ownFolder, risley, source } from './pages.mjs';

skipWithoutBrowser();
const folder = ownFolder();

inspect('estimate', () => {
  risley(folder, 0, 'simulate', '-o', 'mid.nc', '--sensor', 'mid-40-table3', '--rotor',
         'sinusoidal', '--duration-s', '30', '--seed', '1');
  risley(folder, 0, 'estimate', 'mid.nc', '--truth', 'mid.nc.truth.yaml', '-o', 'estimate');
  return join(folder, 'estimate/report.html');
}, /3\u202f000\u202f000 shots/);

inspect('calibrate', () => {
  risley(folder, 0, 'simulate', '-o', 'hall.lvx', '--sensor', 'mid-40-table3', '--reported',
         'nominal', '--scene', join(source, 'data/hall.yaml'), '--duration-s', '10', '--seed', '1');
  risley(folder, 0, 'calibrate', 'hall.lvx', '--truth', 'hall.lvx.truth.yaml', '-o', 'calibrate');
  return join(folder, 'calibrate/report.html');
}, /planes/);

inspect('cloud', () => {
  risley(folder, 0, 'cloud', '--calibration', 'mid-40', '--beam-origin-map', 'origins.html');
  return join(folder, 'origins.html');
}, /beam/, false);

inspect('not-converged', () => {
  risley(folder, 0, 'simulate', '-o', 'short.nc', '--sensor', 'mid-40-table3', '--rotor',
         'sinusoidal', '--duration-s', '2', '--seed', '1');
  risley(folder, 1, 'estimate', 'short.nc', '--free', 'wedge_angle_deg',
         '--free', 'refractive_index_air', '-o', 'not-converged');
  return join(folder, 'not-converged/report.html');
}, /Not converged: do not use these numbers/, false);
