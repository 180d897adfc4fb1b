#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""risley preset and risley pattern: what simulators and makers of presets are given."""
import math
import os
import pathlib
import unittest

from command import SOURCE, CommandTest, run


class PresetTest(CommandTest):
    def test_shown_as_it_stands(self):
        for path in sorted((SOURCE / "presets").glob("*.yaml")):
            self.assertEqual(self.expect(0, "preset", "show", path.stem).stdout, path.read_text())
        shown = self.expect_json(0, "preset", "show", "avia")
        self.assertEqual((shown["model"], shown["prisms"], shown["emitters"]), ("Avia", 2, 6))

    def test_a_new_one_works_everywhere(self):
        self.expect(0, "preset", "new", "unit-17", "--from", "horizon", "-o", "unit-17.yaml")
        text = (self.folder / "unit-17.yaml").read_text().replace("value: 1.5799", "value: 1.58")
        (self.folder / "unit-17.yaml").write_text(text)
        checked = self.expect_json(0, "preset", "check", "unit-17.yaml")["results"]
        self.assertEqual([(one["name"], one["status"]) for one in checked], [("unit-17", 0)])
        self.expect(0, "simulate", "-o", "unit.nc", "--sensor", "unit-17.yaml", "--duration-s", "0.1")

    def test_mistakes_have_their_line(self):
        (self.folder / "bad.yaml").write_text(
            self.expect(0, "preset", "show", "avia").stdout.replace("emitters: 6", "emitters: 60"))
        done = self.expect_json(3, "preset", "check", "bad.yaml", "missing.yaml")
        bad, missing = done["results"]
        self.assertRegex(bad["message"], r"bad\.yaml.*line \d+.*emitters")
        self.assertEqual((bad["status"], missing["status"]), (3, 3))


class PatternTest(CommandTest):
    def rows(self, text):
        lines = text.splitlines()
        self.assertEqual(lines[0], "Time,Azimuth,Zenith")
        return [tuple(map(float, line.split(","))) for line in lines[1:]]

    def test_csv_is_a_recording(self):
        made = self.expect_json(0, "pattern", "--sensor", "mid-40-sequence", "--format", "livox-csv",
                                "--duration-s", "0.5", "-o", "mid.csv")
        self.assertEqual((made["rows"], made["blocked"]), (50_000, 0))
        found = self.expect_json(0, "estimate", "mid.csv")
        self.assertEqual(found["combination"], 2)
        self.assertAlmostEqual(found["parameters"]["refractive_index"]["value"], 1.5089, delta=1e-6)

    def test_stdout_is_the_file(self):
        arguments = ("pattern", "--sensor", "avia", "--format", "livox-csv", "--duration-s", "0.01")
        self.expect(0, *arguments, "-o", "avia.csv")
        text = self.expect(0, *arguments, "-o", "-").stdout
        self.assertEqual((self.folder / "avia.csv").read_text(), text)
        rows = self.rows(text)
        self.assertEqual(len(rows), 2400)
        self.assertEqual(rows[1][0], round(1 / 240000, 9))
        every = self.rows(self.expect(0, *arguments, "-o", "-", "--every", "40").stdout)
        self.assertEqual(every, rows[39::40])
        refused = run(*arguments, "-o", "-", "--json")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("--json needs a file", refused.stderr)
        # Shots of a group fire one after another, unless they are told to fire together.
        held = self.rows(self.expect(0, *arguments, "-o", "-", "--firing", "together").stdout)
        self.assertEqual(held[0], rows[0])
        self.assertNotEqual(held[1], rows[1])

    def test_numpy_reads_the_same_directions(self):
        try:
            import numpy
        except ImportError:
            self.skipTest("SKIPPED: no numpy")
        arguments = ("pattern", "--sensor", "tele-15", "--duration-s", "0.3")
        self.expect(0, *arguments, "--format", "livox-csv", "-o", "tele.csv")
        self.expect(0, *arguments, "--format", "npy", "-o", "tele.npy")
        array = numpy.load(self.folder / "tele.npy")
        self.assertEqual((array.dtype, array.shape), (numpy.float32, (72_000, 2)))
        rows = self.rows((self.folder / "tele.csv").read_text())
        for i in (0, 1, 65_535, 65_536, 71_999):
            self.assertAlmostEqual(array[i, 0], math.radians(rows[i][1]), delta=1e-6)
            self.assertAlmostEqual(array[i, 1], math.radians(90 - rows[i][2]), delta=1e-6)

    def test_a_full_disk_is_said(self):
        if not os.path.exists("/dev/full"):
            self.skipTest("SKIPPED: no /dev/full")
        done = self.expect(3, "pattern", "--sensor", "avia", "--format", "npy", "-o", "/dev/full")
        self.assertIn("/dev/full", done.stderr)

    def test_rows_of_the_makers_sequences(self):
        folder = os.environ.get("RISLEY_VENDOR_DATA")
        if not folder:
            self.skipTest("SKIPPED: RISLEY_VENDOR_DATA names no folder")
        for sensor in ("avia", "horizon"):
            theirs = pathlib.Path(folder) / f"livox-{sensor}-sequence-every-40th.csv"
            ours = run("pattern", "--sensor", f"{sensor}-sequence", "--format", "livox-csv",
                       "--every", "40", "--duration-s", "4", "-o", "-").stdout.splitlines()
            lines = theirs.read_text().splitlines()
            self.assertEqual(len(ours), len(lines))
            other = sum(a != b for a, b in zip(ours, lines))
            self.assertLess(other, 0.001 * len(lines), sensor)  # in their last digit

    def test_emitters_that_a_file_does_not_name_fire_in_turn(self):
        self.expect(0, "simulate", "-o", "avia.nc", "--sensor", "avia", "--duration-s", "0.2")
        self.expect(0, "convert", "avia.nc", "-o", "avia.sequence.csv")
        arguments = ("estimate", "avia.sequence.csv", "--sensor", "avia",
                     "--truth", "avia.nc.truth.yaml")
        lost = self.expect_json(1, *arguments)
        self.assertTrue(any("no shot is of emitter 2" in one for one in lost["warnings"]))
        found = self.expect_json(0, *arguments, "--shot-rate-hz", "240000")
        self.assertTrue(found["converged"])
        self.assertFalse(any("emitter" in one for one in found["warnings"]))
        self.assertLess(found["truth"]["nees_parameters"], 2.2)


if __name__ == "__main__":
    unittest.main()
