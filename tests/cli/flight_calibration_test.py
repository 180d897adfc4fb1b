#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""From a flight to a mount, a calibration and a corrected trajectory."""
import json
import unittest

from command import SOURCE, CommandTest, codes_of

DATA = SOURCE / "data"
PLAN = """risley_flight: 1
rate_hz: 200
height_m: 60
speed_m_per_s: 5
turn_duration_s: 10
strips: [{headings_deg: [90, 270, 0, 180], length_m: 55}]
motion:
  seed: 4
  attitude: {roll_deg: 2, pitch_deg: 2, heading_deg: 2, lowest_hz: 0.15, highest_hz: 1.2, sinusoids: 6}
"""
ERRORS = ("--trajectory-errors", DATA / "trajectory-errors.yaml")
TRUE_BORESIGHT = {"x_deg": 0.8, "y_deg": -0.5, "z_deg": 0.3}
TRUE_LEVER = {"x": 0.10, "y": 0.05, "z": 0.12}


class FlightCalibrationTest(CommandTest):
    def run_json(self, status, *arguments):
        return self.expect_json(status, *map(str, arguments))

    def fly(self, name, rate_hz, *more):
        (self.folder / "plan.yaml").write_text(PLAN)
        self.run_json(0, "simulate", "-o", name, "--sensor", "mid-40-table3", "--reported",
                      "nominal", "--rate-hz", rate_hz, "--flight", "plan.yaml", "--mount",
                      DATA / "mount-nadir.yaml", "--scene", DATA / "village.yaml", *ERRORS, *more)

    def calibrate(self, status, name, *more):
        return self.run_json(status, "calibrate", name, "--trajectory", f"{name}.trajectory.csv",
                             "--mount", DATA / "mount-as-built.yaml", *ERRORS, *more)

    def within(self, found, true, what):
        self.assertGreater(found["sigma"], 0, what)
        self.assertLess(abs(found["value"] - true), 4.5 * found["sigma"], what)

    def level_place(self, name):
        """East and north of level ground that many points lie on."""
        points = [tuple(map(float, line.split()[:3]))
                  for line in (self.folder / name).read_text().splitlines()
                  if line[0] in "-0123456789"]
        for step in range(100):
            east, north = 2 * (step % 10) - 9, 2 * (step // 10) - 9
            near = [p[2] for p in points if (p[0] - east) ** 2 + (p[1] - north) ** 2 < 3]
            if len(near) > 50 and max(map(abs, near)) < 0.15:
                return east, north
        raise AssertionError("no level ground")

    def test_a_bent_unit_on_an_unknown_mount(self):
        self.fly("a.lvx", 2500)
        result = self.calibrate(0, "a.lvx", "-o", "out", "--truth", "a.lvx.truth.yaml",
                                "--knot-spacing-s", 0.5)
        self.assertTrue(result["converged"], result["reason"])
        self.assertEqual(result["verdict"]["code"], "bent")
        for axis, true in TRUE_BORESIGHT.items():
            self.within(result["boresight"][axis], true, axis)
        for axis, true in TRUE_LEVER.items():
            self.within(result["lever_arm_m"][axis], true, axis)
        self.within(result["clock_offset_s"], 0.0012, "clock")
        truth = result["truth"]
        self.assertGreater(truth["before"]["total_deg"], 0.2)
        self.assertLess(truth["after"]["total_deg"], 4 * result["datum"]["sigma_total_deg"])
        self.assertLess(truth["after"]["shape_deg"], 0.002)
        strips = result["strips"]
        self.assertEqual(strips["count"], 4)
        self.assertGreater(strips["before"]["rms_m"], 0.05)
        self.assertLess(strips["after"]["rms_m"], 0.006)
        self.assertEqual(len(strips["pairs"]), 6)
        self.assertEqual(len(result["inputs"]), 5)
        folder = self.folder / "out"
        self.assertEqual(sorted(path.name for path in folder.iterdir()),
                         ["calibration.yaml", "mount.yaml", "report.html", "report.json",
                          "trajectory.csv"])
        self.assertEqual(json.loads((folder / "report.json").read_text())["verb"], "calibrate")
        # What it wrote is what the next verbs take.
        self.run_json(0, "report", "out")
        info = self.run_json(0, "info", "out/trajectory.csv")
        self.assertLess(info["accuracy"]["heading_deg"], 0.07)
        points = {}
        for name, mount, calibration, trajectory in (
                ("before", DATA / "mount-as-built.yaml", "mid-40", "a.lvx.trajectory.csv"),
                ("after", "out/mount.yaml", "out/calibration.yaml", "out/trajectory.csv")):
            cloud = self.run_json(0, "cloud", "a.lvx", "--calibration", calibration,
                                  "--trajectory", trajectory, "--mount", mount, *ERRORS,
                                  "--rate-hz", "full", "-o", f"{name}.xyz")
            self.assertEqual(cloud["strips"], 4)
            self.assertNotIn("taken_as_exact", codes_of(cloud))
            heights = [float(line.split()[2])
                       for line in (self.folder / f"{name}.xyz").read_text().splitlines()
                       if line[0] in "-0123456789"]
            level = [height for height in heights if abs(height) < 0.5]
            points[name] = (sum(height * height for height in level) / len(level)) ** 0.5
        # Most of the ground is level: 20 mm of range noise and what strips are off.
        self.assertGreater(points["before"], 2 * points["after"])
        self.assertLess(points["after"], 0.06)
        # A mount and a calibration that were found together belong together.
        cloud = self.run_json(0, "cloud", "a.lvx", "--calibration", "mid-40", "--trajectory",
                              "out/trajectory.csv", "--mount", "out/mount.yaml", *ERRORS,
                              "-o", "apart.las")
        self.assertIn("taken_as_exact", codes_of(cloud))
        # A calibration is where the next one begins, and known ground is what it is fixed on.
        east, north = self.level_place("after.xyz")
        (self.folder / "control.yaml").write_text(
            f"risley_control: 1\nground:\n  - {{name: yard, place_m: [{east}, {north}, 0], "
            "sigma_m: 0.005}\n")
        again = self.run_json(0, "calibrate", "a.lvx", "--trajectory", "a.lvx.trajectory.csv",
                              "--mount", "out/mount.yaml", "--sensor", "out/calibration.yaml",
                              *ERRORS, "--knot-spacing-s", 1, "--control", "control.yaml")
        self.assertEqual(again["verdict"]["code"], "as_believed")
        self.assertEqual(result["control"], [])
        yard = again["control"][0]
        self.assertEqual((yard["name"], yard["used"], yard["significant"]), ("yard", True, False))
        self.assertGreater(yard["shots"], 20)
        self.assertLess(abs(yard["off_m"]), 0.02)
        self.assertIn("control.yaml", [one["path"] for one in again["inputs"]])
        for axis in TRUE_BORESIGHT:
            self.assertLess(again["boresight"][axis]["sigma"], result["boresight"][axis]["sigma"])

    def test_a_unit_that_believes_in_another_index(self):
        self.fly("b.lvx", 1500, "--reported", "refractive_index=1.512")
        result = self.calibrate(0, "b.lvx", "-o", "contradicted", "--knot-spacing-s", 5)
        self.assertEqual(result["verdict"]["code"], "undecided")
        self.assertIn("--free", result["verdict"]["to_do"])
        index = result["held"]["refractive_index"]
        self.assertTrue(index["significant"])
        self.assertLess(abs(index["told"] - 1.509), 5 * index["sigma"])
        self.assertIn("held_contradicted", codes_of(result))
        self.assertEqual(sorted(path.name for path in (self.folder / "contradicted").iterdir()),
                         ["report.html", "report.json"])

    def test_what_is_missing_or_does_not_fit_is_told(self):
        self.fly("c.lvx", 300)
        before = self.names()
        trajectory = ("--trajectory", "c.lvx.trajectory.csv")
        mount = ("--mount", DATA / "mount-as-built.yaml")
        lines = (self.folder / "c.lvx.trajectory.truth.csv").read_text().splitlines(keepends=True)
        (self.folder / "other.csv").write_text(
            lines[0] + "".join(f"{int(line.split(',', 1)[0]) + 10**13},{line.split(',', 1)[1]}"
                               for line in lines[1:]))
        (self.folder / "one-strip.csv").write_text("".join(lines[:2600]))
        before = self.names()
        for status, words, arguments in (
                (2, "--mount is missing", trajectory + ERRORS),
                (2, "--trajectory is missing", mount + ERRORS),
                (2, "states no accuracies",
                 ("--trajectory", "c.lvx.trajectory.truth.csv") + mount),
                (2, "excludes", trajectory + mount + ("--planes", DATA / "hall.yaml")),
                (3, "risley_control is missing",
                 trajectory + mount + ERRORS + ("--control", DATA / "hall.yaml")),
                (2, "--trajectory", ("--control", DATA / "hall.yaml")),
                (2, "--knot-spacing-s", trajectory + mount + ERRORS + ("--knot-spacing-s", "0")),
                (1, "share no time", ("--trajectory", "other.csv") + mount + ERRORS),
                (1, "at least 2", ("--trajectory", "one-strip.csv") + mount + ERRORS)):
            with self.subTest(words=words):
                done = self.expect(status, "calibrate", "c.lvx", "-o", "bad",
                                   *map(str, arguments))
                self.assertIn(words, done.stderr)
                self.assertEqual(self.names(), before)


if __name__ == "__main__":
    unittest.main()
