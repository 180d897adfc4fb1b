#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Calibration on walls: the keys that scripts read, files, and what cannot be calibrated."""
import random
import unittest

from command import codes_of
from walls import CALIBRATED, HALL, STATIONS, TURNED, WallsTest, truth_of, wall


class CalibrateTest(WallsTest):
    def test_hall(self):
        result = self.expect_json(0, "calibrate", "hall.nc", *truth_of("hall.nc"), "-o", "out")
        self.check(result, 5)
        self.check_truth(result, 0.04)
        self.assertEqual(result["parameters"].keys(), CALIBRATED)
        self.assertAlmostEqual(result["sigma0"], 1, delta=0.05)
        for name, true in (("incident_beam_vertical_deg", -0.385),
                           ("prism_tilt_b_horizontal_deg", 0.120)):
            value = result["parameters"][name]
            self.assertLess(abs(value["value"] - true), 5 * value["sigma_given_held"], name)
        self.assertEqual({path.name for path in (self.folder / "out").iterdir()},
                         {"calibration.yaml", "states.nc", "report.html", "report.json"})
        calibration = self.calibration_of("out")
        for key in ("input_sha256", "datum"):
            self.assertIn(f'"{key}": ', calibration)
        self.assertIn("calibrated_against: planes", calibration)
        self.assertRegex(calibration, r"range:\n  range_offset_m: {value: ")
        self.assertRegex(calibration, r"names: \[.*, range_offset_m, wedge_angle_deg, refractive_index\]")
        page = (self.folder / "out" / "report.html").read_text(encoding="utf-8")
        page = page[:page.index("</main>")]  # the libraries name addresses in their texts
        self.assertIn("risley calibrate hall.nc", page)
        self.assertNotRegex(page, r"(src|href)\s*=\s*[\"']?(https?:)?//")
        text = self.expect(0, "calibrate", "hall.nc", *truth_of("hall.nc")).stdout
        for word in ("converged", "incident_beam_vertical_deg", "range_offset_mm", "datum", "after"):
            self.assertIn(word, text)

    def test_tolerance(self):
        """The unit is off by 0.403 degree, whatever is tolerated; the verdict and its words say what that means."""
        for options, code, tolerance, words in (
                ((), "bent", 0.1, "; that is beyond the tolerance of 0.1 degree"),
                (("--tolerance-deg", "0.5"), "off_within_tolerance", 0.5,
                 "; that is within the tolerance of 0.5 degree"),
                (("--tolerance-deg", "0"), "bent", None, " at worst")):
            folder = f"tolerance-{tolerance}"
            result = self.expect_json(0, "calibrate", "hall.nc", *options, "-o", folder)
            self.assertEqual(result["verdict"]["code"], code)
            self.assertTrue(result["verdict"]["words"].endswith(words), result["verdict"]["words"])
            self.assertEqual((result["tolerance_deg"] is None), tolerance is None)
            if tolerance is not None:
                self.assertAlmostEqual(result["tolerance_deg"], tolerance)
                self.assertAlmostEqual(result["beyond_tolerance_probability"], code == "bent", delta=1e-3)
            self.assertIs(result["calibration_written"], True)
            self.assertTrue((self.folder / folder / "calibration.yaml").exists())
        self.assertIn("--tolerance-deg", self.expect(
            2, "calibrate", "hall.nc", "--tolerance-deg", "-1").stderr)

    def test_calibration_is_a_sensor(self):
        self.expect(0, "calibrate", "hall.nc", "-o", "sensor", "--states", "none")
        self.assertEqual({path.name for path in (self.folder / "sensor").iterdir()},
                         {"calibration.yaml", "report.html", "report.json"})
        sensor = ("--sensor", "sensor/calibration.yaml")
        self.assertTrue(self.expect_json(0, "estimate", "hall.nc", *sensor)["converged"])
        self.check(self.expect_json(0, "calibrate", "hall.nc", *sensor), 5)
        again = self.expect_json(0, "simulate", "-o", "again.nc", *sensor, "--scene", HALL,
                                 "--duration-s", "2", "--rate-hz", "1000")
        self.assertLess(again["truth"]["incident_beam_vertical_deg"], -0.3)
        # What simulates itself has nothing left to correct.
        result = self.expect_json(0, "calibrate", "again.nc", *sensor, *truth_of("again.nc"))
        self.assertLess(result["truth"]["before"]["total_deg"], 0.002)

    def test_a_list_of_recordings_is_an_input(self):
        self.write("list.txt", "# one evening\nhall.nc\n")
        found = self.expect_json(0, "calibrate", "--list", "list.txt", "-o", "listed", "--no-report")
        self.assertLessEqual({"list.txt", "hall.nc"}, {one["path"] for one in found["inputs"]})

    def test_parameters(self):
        result = self.expect_json(
            0, "calibrate", "hall.nc", "--fix", "incident_beam_vertical_deg=-0.385", "--fix",
            "bearing_tilt_a_vertical_deg", "--free", "prism_tilt_a_horizontal_deg", "-o", "chosen")
        self.assertEqual(result["parameters"].keys(),
                         CALIBRATED - {"incident_beam_vertical_deg",
                                       "bearing_tilt_a_vertical_deg"}
                         | {"prism_tilt_a_horizontal_deg"})
        self.assertIn("incident_beam_vertical_deg: {value: -0.385,", self.calibration_of("chosen"))

    def test_the_truth_of_another_recording_is_refused(self):
        for verb, *more in (("calibrate",), ("estimate",)):
            done = self.expect(2, verb, "hall.nc", *truth_of("hall.csv"))
            self.assertIn("--truth = hall.csv.truth.yaml belongs to another recording", done.stderr)

    def test_same_bytes_for_any_number_of_threads(self):
        results, calibrations = [], []
        for threads in (1, 2):
            folder = f"threads_{threads}"
            results.append(self.expect_json(0, "calibrate", "hall.nc", "--threads", threads, "-o",
                                            folder))
            del results[-1]["seconds"], results[-1]["command"]
            lines = self.calibration_of(folder).splitlines()
            calibrations.append([line for line in lines if '"command"' not in line])
        self.assertEqual(results[0], results[1])
        self.assertEqual(calibrations[0], calibrations[1])

    def test_walls_that_cannot_answer(self):
        self.expect(0, "simulate", "-o", "sky.csv", "--sensor", "mid-40-table3", "--rate-hz",
                    "1000", "--duration-s", "2")
        self.refused(1, ("sky.csv", "ranges"), "sky.csv")
        head, *rows = (self.folder / "hall.csv").read_text().splitlines()
        rows = [row.split(",") for row in rows]
        ranges = [row[0] for row in rows]
        chance = random.Random(1)
        chance.shuffle(ranges)

        def recording(name, changed):
            self.write(name, "\n".join([head, *(",".join(row) for row in changed)]) + "\n")

        recording("shuffled.csv", [[r, *row[1:]] for r, row in zip(ranges, rows)])
        self.refused(1, ("shuffled.csv", "no plane found"), "shuffled.csv")
        (self.folder / "earlier").mkdir()
        self.write("earlier/calibration.yaml", "of an earlier run of risley\n")  # is not this run's to remove
        self.expect(1, "calibrate", "shuffled.csv", "-o", "earlier")
        self.assertEqual(self.calibration_of("earlier"), "of an earlier run of risley\n")
        # Clutter everywhere but in a strip of 1.2 degrees.
        self.simulate("strip.csv", self.write("strip.yaml", wall(10, 0)))
        head, *rows = (self.folder / "strip.csv").read_text().splitlines()
        rows = [row.split(",") for row in rows]
        recording("strip.csv", [row if abs(float(row[1]) - 90) < 0.6
                                else [f"{chance.uniform(15, 90):.3f}", *row[1:]] for row in rows])
        self.refused(1, ("strip.csv", "one line"), "strip.csv")
        recording("few.csv", rows[:80])
        self.refused(1, ("few.csv", "80"), "few.csv")
        # One recording without walls does not spoil the others.
        result = self.expect_json(0, "calibrate", "shuffled.csv", "hall.csv")
        self.check(result, 5)
        self.assertIn("input_left_out", codes_of(result))

    def test_recordings_of_different_sensors(self):
        self.simulate("other.nc", HALL, "--set", "incident_beam_vertical_deg=0.3")
        self.refused(2, ("hall.nc", "other.nc", "serial number"), "hall.nc", "other.nc")
        # Without serial numbers the believed parameters decide.
        self.simulate("other.csv", HALL, "--set", "incident_beam_vertical_deg=0.3", "--reported",
                      "incident_beam_vertical_deg=0.3")
        self.refused(1, ("hall.csv", "incident_beam_vertical_deg"), "hall.csv", "other.csv")

    def test_wrong_arguments(self):
        for named, arguments in (
                ("INPUT", []),
                ("4 stations for 2 recordings", [*TURNED[:2], "--stations", STATIONS]),
                ("0 stations for 1 recordings", ["hall.nc", "--stations", HALL]),
                ("upright left", ["hall.nc", "--stations", STATIONS, "--station", "tilted"]),
                ("--stations", ["hall.nc", "--station", "upright"]),
                ("--truth", ["hall.nc", *truth_of("hall.nc", "hall.csv")]),
                ("--truth", ["hall.nc", "--truth", "hall.nc.truth.nc"]),
                ("guess", ["hall.nc", "--method", "guess"]),
                ("maybe", ["hall.nc", "--beam-origin", "maybe"]),
                ("sometimes", ["hall.nc", "--mirror", "sometimes"]),
                ("few", ["hall.nc", "--states", "few"]),
                ("--noise-range-m", ["hall.nc", "--noise-range-m", "0"]),
                ("--noise-angle-deg", ["hall.nc", "--noise-angle-deg", "0"]),
                ("--prior-sigma-deg", ["hall.nc", "--prior-sigma-deg", "0"]),
                ("--range-offset-sigma-m", ["hall.nc", "--range-offset-sigma-m", "-1"]),
                ("--range-offset-sigma-m", ["hall.nc", "--range-offset-sigma-m", "nan"]),
                ("--rate-hz", ["hall.nc", "--rate-hz", "fast"]),
                ("wedge", ["hall.nc", "--fix", "wedge"]),
                ("glass", ["hall.nc", "--free", "glass"]),
                ("rotation_angle_a_deg", ["hall.nc", "--free", "rotation_angle_a_deg"]),
                ("allowed -10 to 10", ["hall.nc", "--fix", "incident_beam_vertical_deg=99"]),
                ("mid-41", ["hall.nc", "--sensor", "mid-41"]),
                ("--plan", ["hall.nc", "--plan", HALL]),
                ("--output", ["--plan", HALL, "-o", "planned"]),
                ("--stations", ["--plan", HALL, "--stations", STATIONS]),
                ("--duration-s", ["hall.nc", "--duration-s", "3"]),
                ("given twice", ["hall.nc", "./hall.nc"]),
                ("angular_velocity_a_deg_per_s",
                 ["hall.nc", "--fix", "angular_velocity_a_deg_per_s=3"]),
                ("not both", ["hall.nc", "--fix", "refractive_index", "--free",
                              "refractive_index"]),
                ("--method paper", [*TURNED, "--method", "paper", "--stations", STATIONS]),
                ("--duration-s", ["--plan", HALL, "--duration-s", "0"]),
                ("--rate-hz", ["--plan", HALL, "--rate-hz", "-1"])):
            with self.subTest(arguments=arguments):
                self.refused(2, named, *arguments)

    def test_bad_files(self):
        self.write("no.yaml", "walls: []\n")
        self.write("empty.yaml", "planes: []\n")
        self.write("no.nc", "")
        for named, arguments in (
                ("missing.nc", ["missing.nc"]),
                ("missing.nc", ["hall.nc", "missing.nc"]),
                ("no.nc", ["no.nc"]),
                ("missing.yaml", ["hall.nc", "--stations", "missing.yaml"]),
                ("missing.yaml", ["hall.nc", "--planes", "missing.yaml"]),
                ("missing.yaml", ["--plan", "missing.yaml"]),
                ("missing.truth", ["hall.nc", "--truth", "missing.truth.yaml"]),
                ("walls", ["hall.nc", "--planes", "no.yaml"]),
                ("walls", ["--plan", "no.yaml"])):
            with self.subTest(arguments=arguments):
                self.refused(3, named, *arguments)
        self.refused(1, "meets a wall", "--plan", "empty.yaml")


if __name__ == "__main__":
    unittest.main()
