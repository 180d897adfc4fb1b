#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Tables of Livox Viewer whose users cropped the scene: what every verb says of their times."""
import csv
import math
import unittest

from command import CommandTest, codes_of, run

HEADER = ("Version,Slot ID,LiDAR Index,Rsvd,Error Code,Timestamp Type,Data Type,Timestamp,X,Y,Z,"
          "Reflectivity,Tag,Ori_x,Ori_y,Ori_z,Ori_radius,Ori_theta,Ori_phi")
WALL_MM = 4000
POINTS = 96  # of a packet
UNIT = ("--set", "prism_tilt_a_vertical_deg=0.4", "--set", "bearing_tilt_a_horizontal_deg=-0.3",
        "--set", "prism_tilt_b_horizontal_deg=0.2", "--set", "incident_beam_vertical_deg=0.05")


class CroppedTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        done = run("simulate", "-o", "whole.csv", "--sensor", "mid-70", "--duration-s", 0.4,
                   "--rotor", "hunting", "--noise-angle-deg", "0.002", *UNIT, folder=cls.folder)
        assert done.returncode == 0, done.stderr
        with (cls.folder / "whole.csv").open(encoding="utf-8") as file:
            rows = [(float(a), float(z)) for _, a, z in list(csv.reader(file))[1:]]
        cls.times_s = {}
        for name, width, height in (("wide", 13, 12), ("narrow", 3, 3)):
            cls.times_s[name] = cls.crop(name + ".csv", rows, width, height)

    @classmethod
    def crop(cls, name, rows, width, height):
        """Millimetres of a wall within a window, one time per packet; the times of its shots."""
        times = []
        with (cls.folder / name).open("w", encoding="ascii") as file:
            file.write(HEADER + "\n")
            for shot, (azimuth, zenith) in enumerate(rows):
                azimuth = (azimuth + 180) % 360 - 180
                if abs(azimuth - 1) > width / 2 or abs(86 - zenith) > height / 2:
                    continue
                distance = WALL_MM / (math.sin(math.radians(zenith)) * math.cos(math.radians(azimuth)))
                y = round(distance * math.sin(math.radians(zenith)) * math.sin(math.radians(azimuth)))
                z = round(distance * math.cos(math.radians(zenith)))
                time_ns = 10**9 + shot // POINTS * POINTS * 10_000
                metres = f"{WALL_MM / 1000},{y / 1000},{z / 1000}"
                file.write(f"5,1,1,0,0x00000000,0,2,{time_ns},{metres},9,16,{WALL_MM},{y},{z},0,0,0\n")
                times.append(shot * 1e-5)
        return times

    def converted_times(self, name):
        self.expect(0, "convert", name + ".csv", "-o", name + "-out.csv", "--format",
                    "scan-sequence-csv")
        with (self.folder / (name + "-out.csv")).open(encoding="utf-8") as file:
            return [float(row[0]) for row in list(csv.reader(file))[1:]]

    def largest_error(self, name):
        found, true = self.converted_times(name), self.times_s[name]
        self.assertEqual(len(found), len(true))
        errors = [a - b for a, b in zip(found, true)]
        middle = (max(errors) + min(errors)) / 2  # the file counts from its first row
        return max(abs(error - middle) for error in errors)

    def test_a_narrow_window_of_a_bent_mid_70_tells_its_times(self):
        result = self.expect_json(0, "estimate", "wide.csv", "--sensor", "mid-70")
        self.assertEqual(result["observations_used"], len(self.times_s["wide"]))
        for name, true in (("prism_tilt_a_vertical_deg", 0.4), ("prism_tilt_b_horizontal_deg", 0.2)):
            value, sigma = (result["parameters"][name][key] for key in ("value", "sigma"))
            self.assertLess(abs(value - true), 4.5 * sigma, name)
        info = self.expect_json(0, "info", "wide.csv")
        self.assertEqual(info["sensor"], "Livox Mid-70")
        self.assertEqual(info["time_uncertainty_s"], 0)
        self.assertIn("packets_incomplete", codes_of(info))
        self.assertLess(self.largest_error("wide"), 1e-6)

    def test_what_nothing_tells_is_called_a_guess_and_not_estimated(self):
        refused = self.expect_json(1, "estimate", "narrow.csv", "--sensor", "mid-70")
        self.assertIn("export the recording again without cropping", refused["error"])
        info = self.expect_json(0, "info", "narrow.csv")
        self.assertGreater(info["time_uncertainty_s"], 1e-4)
        self.assertIn("times_guessed", codes_of(info))
        done = self.expect_json(0, "convert", "narrow.csv", "-o", "narrow.nc")
        self.assertEqual(done["observations"], len(self.times_s["narrow"]))
        self.assertEqual(done["time_uncertainty_s"], info["time_uncertainty_s"])
        times = self.converted_times("narrow")
        self.assertEqual(times, sorted(times))
        self.assertLess(self.largest_error("narrow"), 2 * info["time_uncertainty_s"])

    def test_identify_says_whose_optics_told_the_times_and_refuses_guesses(self):
        self.assertIn("export the recording again without cropping",
                      self.expect(1, "identify", "narrow.csv").stderr)
        done = self.expect(1, "identify", "wide.csv", "--most-prisms", 1)
        self.assertIn("not independent of", done.stderr)
        self.assertIn("export the recording again without cropping", done.stdout)


if __name__ == "__main__":
    unittest.main()
