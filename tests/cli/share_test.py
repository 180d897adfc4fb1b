#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Excerpts to be sent, and LAS clouds as recordings."""
import json
import unittest

from command import SOURCE, CommandTest, run

SENSOR = "mid-40-table3"


class ShareTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name, seconds in (("short.lvx", 0.9), ("long.lvx", 2.5)):
            cls.make("simulate", "-o", name, "--sensor", SENSOR, "--duration-s", seconds, "--scene",
                     SOURCE / "data" / "room.yaml")
        info = run("info", "short.lvx", "--json", folder=cls.folder)
        cls.serial = json.loads(info.stdout)["devices"][0]["serial"]

    @classmethod
    def make(cls, *arguments):
        done = run(*arguments, folder=cls.folder)
        assert done.returncode == 0, done.stderr

    def test_an_excerpt_gives_the_same_estimate(self):
        found = self.expect_json(0, "info", "short.lvx", "--share", "short.nc")["excerpt"]
        self.assertEqual(found["shots"], 90000)
        self.assertFalse(found["has_range"])
        self.assertFalse(found["rounded"])
        self.assertIn("ranges", found["does_not_hold"])
        whole = self.expect_json(0, "estimate", "short.lvx")
        excerpt = self.expect_json(0, "estimate", "short.nc")
        for key in ("observations_used", "outliers", "combination", "parameters", "residuals"):
            self.assertEqual(excerpt[key], whole[key])

    def test_an_excerpt_tells_little(self):
        self.assertTrue(self.serial)
        self.assertIn(self.serial.encode(), (self.folder / "long.lvx").read_bytes())
        done = self.expect(0, "info", "long.lvx", "--share", "long.nc")
        for words in ("does not hold: serial numbers; ranges;", "times from 0"):
            self.assertIn(words, done.stdout)
        content = (self.folder / "long.nc").read_bytes()
        for word in (self.serial, "long.lvx", str(self.folder)):
            self.assertNotIn(word.encode(), content)
        info = self.expect_json(0, "info", "long.nc")
        self.assertLessEqual(info["duration_s"], 1.0)
        self.assertGreater(info["duration_s"], 0.9)
        self.assertEqual(info["first_time_ns"], 0)
        self.assertEqual(info["time_reference"], "relative")
        self.assertFalse(info["has_range"])
        self.assertFalse(info["has_intensity"])
        self.assertEqual(info["sensor"], "Livox Mid-40")
        self.assertEqual(info["devices"][0]["serial"], "")

    def test_ranges_are_shared_when_asked(self):
        found = self.expect_json(0, "info", "short.lvx", "--share", "ranges.nc", "--share-ranges")
        self.assertIn("ranges", found["excerpt"]["holds"])
        self.assertEqual(self.expect_json(0, "info", "ranges.nc")["range_m"], found["range_m"])

    def test_wrong_usage_writes_nothing(self):
        before = self.names()
        for arguments, words in ((["--share", "out.lvx"], "must end in .nc"),
                                 (["--share-ranges"], "needs --share")):
            done = self.expect(2, "info", "short.lvx", *arguments)
            self.assertIn(words, done.stderr)
        self.expect(3, "info", "short.lvx", "--share", "nowhere/out.nc")
        self.make("convert", "short.lvx", "-o", "own.nc")
        self.assertIn("would replace", self.expect(2, "info", "own.nc", "--share", "own.nc").stderr)
        self.assertEqual(self.names(), before | {"own.nc"})

    def test_a_cloud_is_a_recording(self):
        cloud = self.expect_json(0, "cloud", "short.lvx", "--calibration", SENSOR, "-o",
                                 "cloud.las")
        info = self.expect_json(0, "info", "cloud.las")
        self.assertEqual(info["format"], "las")
        self.assertEqual(info["observations"], cloud["points"])
        self.assertEqual(info["sensor"], "Livox Mid-40")
        self.assertEqual(info["devices"][0]["serial"], self.serial)
        self.assertEqual(info["warnings"], [])
        original = self.expect_json(0, "info", "short.lvx")
        for key in ("first_time_ns", "last_time_ns", "time_resets", "gaps"):
            self.assertEqual(info[key], original[key], key)
        for key, tolerance in (("range_m", 0.05), ("azimuth_deg", 0.1), ("zenith_deg", 0.1)):
            for end in ("min", "max"):
                self.assertAlmostEqual(info[key][end], original[key][end], delta=tolerance)

    def test_directions_survive_a_cloud_and_an_excerpt_of_it(self):
        # Reported directions from the origin, in millimetres as a Cartesian recording has them.
        self.make("cloud", "short.lvx", "--calibration", SENSOR, "--directions", "reported",
                  "--beam-origin", "no", "--las-scale-m", 0.001, "-o", "reported.las")
        whole = self.expect_json(0, "estimate", "reported.las")
        found = self.expect_json(0, "info", "reported.las", "--share", "reported.nc")["excerpt"]
        self.assertTrue(found["rounded"])
        excerpt = self.expect_json(0, "estimate", "reported.nc")
        for name, one in whole["parameters"].items():
            other = excerpt["parameters"][name]
            self.assertLess(abs(one["value"] - other["value"]), 0.5 * one["sigma_given_held"], name)
            self.assertAlmostEqual(one["sigma_given_held"] / other["sigma_given_held"], 1, delta=0.1, msg=name)

    def test_a_cut_cloud_gives_its_sound_part(self):
        self.make("cloud", "short.lvx", "--calibration", SENSOR, "-o", "whole.las")
        content = (self.folder / "whole.las").read_bytes()
        (self.folder / "cut.las").write_bytes(content[:len(content) // 2])
        info = self.expect_json(3, "info", "cut.las", "--share", "cut.nc")
        self.assertIn("byte_offset", info)
        self.assertGreater(info["observations"], 40000)
        self.assertEqual(info["excerpt"]["shots"], info["observations"])


if __name__ == "__main__":
    unittest.main()
