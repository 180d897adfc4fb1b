#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The recordings in data/recordings are what the commands in their README make, and small."""
import re
import shutil
import unittest

from command import SOURCE, CommandTest

FOLDER = SOURCE / "data/recordings"
COMMANDS = re.findall(r"^risley (simulate -o data/recordings/(\S+) .*)$",
                      (FOLDER / "README.md").read_text(encoding="utf-8"), re.MULTILINE)


class SampleRecordingsTest(CommandTest):
    def rows(self, recording):
        """Time, angles, range and intensity of every shot, as text."""
        self.expect(0, "convert", recording, "-o", "rows.csv")
        return (self.folder / "rows.csv").read_text().splitlines()

    def test_every_recording_has_its_command(self):
        self.assertEqual(sorted(name for _, name in COMMANDS),
                         sorted(path.name for path in FOLDER.iterdir() if path.suffix != ".md"))

    def test_every_sensor_type_has_a_recording(self):
        types = {one["model"] for one in self.expect_json(0, "preset", "list")["presets"]}
        self.assertEqual({name.split(".")[0] for _, name in COMMANDS}, {one.lower() for one in types})

    def test_recordings_are_made_again(self):
        shutil.copytree(SOURCE / "data", self.folder / "data", ignore=shutil.ignore_patterns("recordings"))
        (self.folder / "data/recordings").mkdir()
        for command, name in COMMANDS:
            with self.subTest(name):
                self.assertLess((FOLDER / name).stat().st_size, 1_000_000)
                self.expect(0, *command.split())
                kept = self.rows(FOLDER / name)
                made = self.rows(self.folder / "data/recordings" / name)
                self.assertEqual(len(kept), len(made))
                # Processors round differently, which moves a value that lies between two steps.
                self.assertLess(sum(map(str.__ne__, kept, made)), 1e-3 * len(kept))


if __name__ == "__main__":
    unittest.main()
