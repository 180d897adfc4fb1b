#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""A sensor that moves: flights and trajectories over terrain."""
import unittest

from command import SOURCE, CommandTest

DATA = SOURCE / "data"
FLIGHT = ("--flight", DATA / "flight-s4.yaml", "--mount", DATA / "mount-nadir.yaml",
          "--scene", DATA / "village.yaml")
SHORT = ("--rate-hz", "1000", "--start-s", "5", "--duration-s", "2")
EARTH = """risley_flight: 1
origin: {latitude_deg: 50, longitude_deg: 8.5, ellipsoidal_height_m: 250}
start: {scale: gps-second-of-week, time_s: 208800, gps_week: 2400}
rate_hz: 200
height_m: 80
speed_m_per_s: 5
turn_duration_s: 10
strips: [{headings_deg: [90, 270], length_m: 20}]
"""


class FlightTest(CommandTest):
    def simulate(self, status, *arguments):
        return self.expect_json(status, "simulate", *map(str, arguments))

    def test_a_flight_leaves_all_its_files(self):
        result = self.simulate(0, "-o", "a.lvx", *FLIGHT, *SHORT, "--trajectory-errors",
                               DATA / "trajectory-errors.yaml")
        self.assertEqual(result["observations"], 2000)
        self.assertEqual(result["no_return"], 0)
        self.assertEqual([strip["name"] for strip in result["strips"]],
                         ["strip 1", "strip 2", "strip 3", "strip 4"])
        self.assertAlmostEqual(result["strips"][0]["begin_s"], 208802)
        self.assertAlmostEqual(result["strips"][0]["end_s"], 208818)
        self.assertEqual(result["files"], [
            "a.lvx", "a.lvx.truth.yaml", "a.lvx.truth.nc", "a.lvx.trajectory.truth.csv",
            "a.lvx.trajectory.csv", "a.lvx.mount.truth.yaml", "a.lvx.strips.yaml"])
        for name in result["files"]:
            self.assertTrue((self.folder / name).stat().st_size > 0, name)
        self.assertEqual(result["trajectory"], "a.lvx.trajectory.csv")
        said = self.expect(0, "simulate", "-o", "b.lvx", *map(str, FLIGHT), *SHORT).stdout
        self.assertIn("trajectory without errors: b.lvx.trajectory.csv", said)
        self.assertIn("strip 4", said)
        # The trajectories are files that others read.
        info = self.expect_json(0, "info", "a.lvx.trajectory.csv")
        self.assertAlmostEqual(info["rate_hz"], 200)
        # What was flown once can be flown again, along the file, where the scene says where it lies.
        village = (DATA / "village.yaml").read_text(encoding="utf-8")
        origin = "origin: {latitude_deg: 50, longitude_deg: 8.5, ellipsoidal_height_m: 250}"
        (self.folder / "placed.yaml").write_text(village.replace("terrain:", f"terrain:\n  {origin}"))
        again = self.simulate(0, "-o", "c.lvx", "--trajectory", "a.lvx.trajectory.truth.csv",
                              "--mount", "a.lvx.mount.truth.yaml", "--scene", "placed.yaml", *SHORT)
        self.assertEqual(again["strips"], [])
        self.assertEqual((self.folder / "a.lvx").read_bytes(), (self.folder / "c.lvx").read_bytes())

    def test_same_seed_same_bytes(self):
        for name, threads in (("one", 1), ("two", 2), ("four", 4)):
            self.simulate(0, "-o", f"{name}.nc", *FLIGHT, *SHORT, "--seed", 3, "--threads", threads,
                          "--trajectory-errors", DATA / "trajectory-errors.yaml")
        for ending in ("", ".truth.nc", ".trajectory.csv", ".trajectory.truth.csv", ".strips.yaml"):
            one = (self.folder / f"one.nc{ending}").read_bytes()
            for other in ("two", "four"):
                self.assertEqual(one, (self.folder / f"{other}.nc{ending}").read_bytes(), ending)

    def test_on_the_earth_a_user_gets_an_sbet(self):
        (self.folder / "earth.yaml").write_text(EARTH)
        result = self.simulate(0, "-o", "earth.lvx", "--flight", "earth.yaml", *FLIGHT[2:],
                               "--rate-hz", 1000, "--trajectory-format", "sbet")
        self.assertEqual(result["trajectory"], "earth.lvx.trajectory.sbet")
        self.assertEqual(result["no_return"], 0)
        self.assertAlmostEqual(result["strips"][0]["begin_s"], 208802)
        info = self.expect_json(0, "info", "earth.lvx.trajectory.sbet")
        self.assertEqual(info["format"], "sbet")
        self.assertEqual((self.folder / "earth.lvx.trajectory.sbet").stat().st_size % 136, 0)
        # The same trajectory over a scene that does not say where it lies.
        failed = self.expect(2, "simulate", "-o", "no.lvx", "--trajectory",
                             "earth.lvx.trajectory.truth.csv", *map(str, FLIGHT[2:]))
        self.assertIn("give its terrain an origin", failed.stderr)

    def test_what_is_missing_is_told(self):
        (self.folder / "local.yaml").write_text("".join(
            line for line in EARTH.splitlines(True) if not line.startswith(("origin", "start"))))
        before = self.names()
        for status, words, arguments in (
                (2, "--mount is missing", FLIGHT[:2] + FLIGHT[4:]),
                (2, "--scene is missing", FLIGHT[:4]),
                (2, "--mount needs --trajectory or --flight", FLIGHT[2:]),
                (2, "--clock-drift-ppm needs", ("--clock-drift-ppm", "5")),
                (2, "excludes", FLIGHT + ("--trajectory", DATA / "flight-s4.yaml")),
                (2, "not both", FLIGHT + ("--station", "x")),
                (2, "the recording lasts from", FLIGHT + ("--duration-s", "500")),
                (2, "frame of its own",
                 ("--flight", "local.yaml") + FLIGHT[2:] + SHORT + ("--trajectory-format", "sbet")),
                (3, "missing.yaml", FLIGHT[:2] + ("--mount", "missing.yaml") + FLIGHT[4:]),
                (3, "risley_flight", ("--flight", DATA / "village.yaml") + FLIGHT[2:]),
                (3, "not a trajectory of a known kind",
                 ("--trajectory", DATA / "village.yaml") + FLIGHT[2:])):
            with self.subTest(words=words):
                done = self.expect(status, "simulate", "-o", "bad.lvx", *map(str, arguments))
                self.assertIn(words, done.stderr)
                self.assertEqual(self.names(), before)


if __name__ == "__main__":
    unittest.main()
