#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The page of reproduce, which computes for minutes.
import { spawnSync } from 'node:child_process';
import { join } from 'node:path';
import { skipWithoutBrowser } from './browser.mjs';
import { inspect, ownFolder, risley } from './pages.mjs';

skipWithoutBrowser();
if (spawnSync(process.env.RISLEY_COMMAND, ['reproduce', '--help'], { encoding: 'utf8' })
  .stdout.indexOf('Usage: risley reproduce') < 0) {
  console.log('SKIPPED: this command does not reproduce');
  process.exit(77);
}
const folder = ownFolder();

inspect('reproduce', () => {
  risley(folder, 0, 'reproduce', '-o', 'reproduce');
  return join(folder, 'reproduce/report.html');
}, /Table 3/, false);
