#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""How much memory a job takes for every shot more."""
import os
import unittest

from command import COMMAND, SANITIZED, SOURCE, CommandTest

RATE = 100_000  # Hz
LENGTHS = (4, 16)  # s
MOST_BYTES = 18.0  # a shot; some 13 stay


@unittest.skipIf(SANITIZED, "a sanitizer takes memory of its own")
class MemoryTest(CommandTest):
    """Peaks of two recordings of different length, so that what every run takes does not count."""

    def peak(self, *arguments):
        """The most memory that a command had, bytes."""
        child = os.posix_spawn(COMMAND, [COMMAND, *map(str, arguments)], os.environ, file_actions=[
            (os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)])
        _, status, usage = os.wait4(child, 0)
        self.assertEqual(os.waitstatus_to_exitcode(status), 0, arguments)
        return 1024 * usage.ru_maxrss

    def test_estimate_keeps_few_bytes_of_a_shot(self):
        peaks = []
        for seconds in LENGTHS:
            recording = self.folder / f"{seconds}.lvx"
            self.expect(0, "simulate", "-o", recording, "--sensor", "mid-40-table3", "--rotor", "hunting",
                        "--scene", SOURCE / "data/hall.yaml", "--duration-s", seconds)
            peaks.append(self.peak("estimate", recording, "-o", self.folder / f"{seconds}", "--no-report", "--quiet",
                                   "--threads", 1))
        each = (peaks[1] - peaks[0]) / (RATE * (LENGTHS[1] - LENGTHS[0]))
        self.assertLess(each, MOST_BYTES)
        self.assertGreater(each, 0)  # or other things hide what a shot takes


if __name__ == "__main__":
    unittest.main()
