#!/usr/bin/env node
// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The page of reproduce, which computes for a minute.
//   RISLEY_REPRODUCED  folder that cli.reproduce_test kept; without it the command runs here
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

inspect('reproduce', async () => {
  const kept = process.env.RISLEY_REPRODUCED;
  if (kept) return join(kept, 'report.html');
  await risley(folder, 0, 'reproduce', '-o', 'reproduce');
  return join(folder, 'reproduce/report.html');
}, /Table 3/, false);
