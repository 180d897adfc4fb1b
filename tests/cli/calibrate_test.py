#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Calibration on walls: the keys that scripts read, files, plans, and what cannot be calibrated."""
import json
import random
import unittest

from command import SOURCE, CommandTest, codes_of, run

HALL = SOURCE / "data" / "hall.yaml"
STATIONS = SOURCE / "data" / "stations.yaml"
NAMES = ("upright right", "upright left", "flipped right", "flipped left")
TURNED = [f"turned_{i}.nc" for i in range(len(NAMES))]

# Four walls that meet ahead of the sensor, at 45 degrees of incidence.
NICHE = "planes:\n" + "".join(
    f"  - {{name: {name}, distance_m: 20, normal_azimuth_deg: {azimuth}, normal_zenith_deg: "
    f"{zenith}}}\n"
    for name, azimuth, zenith in (("left", 55, 90), ("right", -55, 90), ("up", 0, 35),
                                  ("down", 0, 145)))

KEYS = {"converged", "iterations", "parameters", "planes", "datum", "before", "after", "sigma0",
        "seconds", "pointing_error", "verdict"}
POINTING = {"total_deg", "shared_deg", "shape_deg", "worst_deg"}
PLANE = {"normal", "offset_m", "points", "outliers", "rms_m"}
DATUM = {"kind", "sigma_roll_deg", "sigma_pitch_deg", "sigma_yaw_deg"}
ERRORS = {"azimuth_rmse_deg", "zenith_rmse_deg", "azimuth_bias_deg", "zenith_bias_deg",
          "total_deg", "gauge_deg", "shape_deg"}
CALIBRATED = {"incident_beam_horizontal_deg", "incident_beam_vertical_deg",
              "bearing_tilt_a_horizontal_deg", "bearing_tilt_a_vertical_deg",
              "prism_tilt_a_vertical_deg", "prism_tilt_b_horizontal_deg",
              "prism_tilt_b_vertical_deg", "prism_tilt_a_horizontal_deg"}


def wall(distance_m, azimuth_deg, zenith_deg=90, more=""):
    """A scene of one plane."""
    return (f"planes:\n  - {{name: wall, distance_m: {distance_m}, normal_azimuth_deg: "
            f"{azimuth_deg}, normal_zenith_deg: {zenith_deg}{more}}}\n")


def truth_of(*recordings):
    """Arguments that judge a calibration by the recordings' truth."""
    return ["--truth", *(f"{name}.truth.yaml" for name in recordings)]


class CalibrateTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.simulate("hall.nc", HALL)
        cls.simulate("hall.csv", HALL, "--seed", 2)
        for seed, (name, station) in enumerate(zip(TURNED, NAMES)):
            cls.simulate(name, STATIONS, "--station", station, "--seed", seed, seconds=2)

    @classmethod
    def simulate(cls, name, scene, *more, seconds=4, noise_m=0.02):
        """A recording of a bent unit that believes to be a perfect one."""
        done = run("simulate", "-o", name, "--sensor", "mid-40-table3", "--reported", "nominal",
                   "--scene", scene, "--duration-s", seconds, "--rate-hz", 1000,
                   "--noise-range-m", noise_m, *more, folder=cls.folder)
        assert done.returncode == 0, done.stderr

    def write(self, name, text):
        (self.folder / name).write_text(text)
        return name

    def calibration_of(self, folder):
        return (self.folder / folder / "calibration.yaml").read_text(encoding="utf-8")

    def refused(self, status, named, *arguments):
        """No calibration: the exit status, and a message that names the thing."""
        output = [] if "--plan" in arguments else ["-o", "refused"]
        done = self.expect(status, "calibrate", *arguments, *output, "--json")
        result = json.loads(done.stdout)
        if "converged" in result:
            self.assertFalse(result["converged"])
        reason = result.get("reason") or result["error"]
        for word in [named] if isinstance(named, str) else named:
            self.assertIn(word, reason)
            self.assertIn(word, done.stderr)
        self.assertFalse((self.folder / "refused" / "calibration.yaml").exists())
        return result

    def check(self, result, planes, kind="walls only"):
        self.assertLessEqual(KEYS, result.keys())
        self.assertTrue(result["converged"], result.get("reason"))
        self.assertGreater(result["iterations"], 0)
        for value in result["parameters"].values():
            self.assertEqual(value.keys(), {"value", "sigma", "sigma_given_held"})
            self.assertGreater(value["sigma_given_held"], 0)
            self.assertGreaterEqual(value["sigma"], value["sigma_given_held"])
        self.assertEqual(len(result["planes"]), planes)
        for plane in result["planes"]:
            self.assertLessEqual(PLANE, plane.keys())
            self.assertAlmostEqual(sum(x * x for x in plane["normal"]), 1, places=9)
            self.assertGreater(plane["offset_m"], 0)
            self.assertGreater(plane["points"], 100)
            self.assertLess(plane["outliers"], 0.1 * plane["points"])
            self.assertLess(plane["rms_m"], 0.021)
        self.assertLessEqual(DATUM, result["datum"].keys())
        self.assertEqual(result["datum"]["kind"], kind)
        for name in POINTING:
            self.assertGreater(result["pointing_error"][name]["value"], 0)
            self.assertGreater(result["pointing_error"][name]["sigma"], 0)
        self.assertLess(result["after"]["plane_rms_m"], result["before"]["plane_rms_m"])
        self.assertLessEqual({"read", "solve", "total"}, result["seconds"].keys())

    def check_truth(self, result, most_deg):
        for which in ("before", "after"):
            self.assertLessEqual(ERRORS, result["truth"][which].keys())
        before, after = result["truth"]["before"], result["truth"]["after"]
        self.assertAlmostEqual(before["total_deg"], 0.403, delta=0.001)
        self.assertLess(after["total_deg"], most_deg)
        self.assertLess(after["shape_deg"], 0.1 * before["shape_deg"] + 0.005)
        self.assertLess(after["total_deg"], 5 * result["datum"]["sigma_total_deg"])
        for found, true in (("total_deg", "total_deg"), ("shared_deg", "gauge_deg"),
                            ("shape_deg", "shape_deg")):
            known = result["pointing_error"][found]
            self.assertLess(abs(known["value"] - before[true]), 5 * known["sigma"])

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

    def test_paper(self):
        self.simulate("niche.nc", self.write("niche.yaml", NICHE))
        result = self.expect_json(0, "calibrate", "niche.nc", "--method", "paper",
                                  *truth_of("niche.nc"), "-o", "paper")
        self.check(result, 4)
        self.check_truth(result, 0.3)
        self.assertEqual(result["method"], "paper")
        self.assertEqual(result["parameters"].keys(), CALIBRATED - {"prism_tilt_a_horizontal_deg"})
        self.assertEqual(result["datum"]["kind"], "walls only")
        self.assertTrue((self.folder / "paper" / "calibration.yaml").exists())
        self.assertNotIn("range_offset_m", self.calibration_of("paper"))

    def test_stations(self):
        stations = [word for name in NAMES for word in ("--station", name)]
        result = self.expect_json(0, "calibrate", *TURNED, "--stations", STATIONS,
                                  *truth_of(*TURNED), "-o", "turned")
        self.check(result, 4, "known stations")
        self.check_truth(result, 0.06)
        self.assertEqual({test["name"] for test in result["prior_tests"]}, set(NAMES))
        self.assertEqual({path.name for path in (self.folder / "turned").iterdir()},
                         {"calibration.yaml", "report.html", "report.json", *(f"states_{i}.nc" for i in
                                                               range(1, 5))})
        calibration = self.calibration_of("turned")
        self.assertIn('"input_4": "turned_3.nc"', calibration)
        self.assertIn('"input_4_sha256": ', calibration)
        named = self.expect_json(0, "calibrate", *TURNED, "--stations", STATIONS, *stations)
        self.assertEqual(named["parameters"], result["parameters"])
        # Two of the four, flipped: with names, each with its own option of truth.
        pair = [TURNED[3], TURNED[0]]
        result = self.expect_json(
            0, "calibrate", *pair, "--stations", STATIONS, "--station", NAMES[3], "--station",
            NAMES[0], "--truth", pair[0] + ".truth.yaml", "--truth", pair[1] + ".truth.yaml")
        self.check(result, 2, "known stations")
        self.check_truth(result, 0.1)
        self.assertEqual([plane["recording"] for plane in result["planes"]], pair)
        # The same without stations leaves the common direction loose.
        loose = self.expect_json(0, "calibrate", *pair)
        self.assertEqual(loose["datum"]["kind"], "walls only")
        self.assertGreater(loose["datum"]["sigma_pitch_deg"],
                           1.5 * result["datum"]["sigma_pitch_deg"])

    def test_planes(self):
        scene = self.write("tilted.yaml", wall(20, 50))
        self.simulate("tilted.nc", scene)
        result = self.expect_json(0, "calibrate", "tilted.nc", *truth_of("tilted.nc"))
        self.check(result, 1)
        self.check_truth(result, 0.4)
        self.assertEqual(result["planes"][0]["name"], "plane 1")
        # A name alone is a name, a sigma makes it a datum.
        named = self.expect_json(0, "calibrate", "tilted.nc", "--planes", scene)
        self.assertEqual(named["planes"][0]["name"], "wall")
        self.assertEqual(named["datum"], result["datum"])
        known = self.write("known.yaml", wall(20, 50, 90, ", sigma_deg: 0.01"))
        told = self.expect_json(0, "calibrate", "tilted.nc", "--planes", known,
                                *truth_of("tilted.nc"))
        self.check(told, 1, "known planes")
        self.check_truth(told, 0.4)
        self.assertLess(told["datum"]["sigma_yaw_deg"], result["datum"]["sigma_yaw_deg"])
        self.assertEqual(told["prior_tests"][0]["kind"], "plane")
        # A wall that stands elsewhere than it is said to.
        self.refused(1, ("known planes", "distance 20.0"), "tilted.nc", "--planes",
                     self.write("elsewhere.yaml", wall(20, -30, 90, ", sigma_deg: 0.01")))
        self.refused(1, ("plane wall", "contradicts"), "tilted.nc", "--planes",
                     self.write("askew.yaml", wall(20, 53, 90, ", sigma_deg: 0.01")))

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

    def test_range_offset(self):
        head, *rows = (self.folder / "hall.csv").read_text().splitlines()
        rows = [row.split(",", 1) for row in rows]
        self.write("longer.csv", "\n".join(
            [head, *(f"{float(distance) + 0.02:.3f},{rest}" for distance, rest in rows)]) + "\n")
        for name, true in (("hall.csv", 0), ("longer.csv", 0.02)):
            for options, sigma in (([], 0.01), (["--walls", "flat"], 0.005)):
                found = self.expect_json(0, "calibrate", name, *options)["range_offset_m"]
                self.assertLess(found["sigma"], sigma)
                self.assertLess(abs(found["value"] - true), 4 * found["sigma_given_held"])
        held = self.expect_json(0, "calibrate", "hall.nc", "--range-offset-sigma-m", "0", "-o",
                                "held")
        self.assertEqual(held["range_offset_m"],
                         {"value": 0, "sigma": 0, "sigma_given_held": 0, "prior_sigma": 0})
        self.assertNotIn("range_offset_m", self.calibration_of("held"))

    def test_prior(self):
        """A wall that faces the sensor does not determine the direction that all beams share."""
        self.simulate("facing.nc", self.write("facing.yaml", wall(30, 0)), seconds=10)
        result = self.refused(1, ("incident_beam", "--prior-sigma-deg"), "facing.nc")
        self.assertTrue(result["unobservable"])
        self.assertTrue((self.folder / "refused" / "report.html").exists())
        result = self.expect_json(0, "calibrate", "facing.nc", "--prior-sigma-deg", "0.4",
                                  *truth_of("facing.nc"))
        self.check(result, 1)
        self.assertIn("poor_datum", codes_of(result))
        self.assertLess(result["parameters"]["incident_beam_vertical_deg"]["sigma"], 0.4)

    def test_beam_origin(self):
        self.simulate("axis.nc", HALL, "--beam-origin", "no", noise_m=0.001)
        errors = {}
        for choice in ("yes", "no"):
            errors[choice] = self.expect_json(
                0, "calibrate", "axis.nc", "--beam-origin", choice, "--noise-range-m", "0.001",
                *truth_of("axis.nc"), "-o", choice)["truth"]["after"]["shape_deg"]
        # The walls show that there is no spacing, but for what is known of it before.
        self.assertGreater(errors["yes"], errors["no"])
        self.assertLess(errors["yes"], 0.001)
        self.assertRegex(self.calibration_of("no"), r"prism_spacing_m: \{value: 0,")
        self.assertRegex(self.calibration_of("yes"), r"prism_spacing_a_m: \{value: ")

    def test_plan(self):
        self.assertIsNotNone(self.expect_json(0, "calibrate", "--plan", HALL)["rolled_180_deg"])
        hall = self.expect_json(0, "calibrate", "--plan", HALL, "--rate-hz", "1000",
                                "--duration-s", "4", "--walls", "flat")
        self.assertEqual(hall["parameters"].keys(), CALIBRATED)
        self.assertEqual({row["name"] for row in hall["walls"]},
                         {"end", "left wall", "right wall", "ceiling", "floor"})
        self.assertEqual(hall["datum"]["kind"], "walls only")
        self.assertEqual(hall["unobservable"], [])
        self.assertAlmostEqual(hall["observations"], 4000, delta=10)
        made = self.expect_json(0, "calibrate", "hall.nc", "--walls", "flat")
        for name, value in hall["parameters"].items():
            self.assertAlmostEqual(made["parameters"][name]["sigma_given_held"] / value["sigma"], 1,
                                   delta=0.3, msg=name)
        stations = self.expect_json(0, "calibrate", "--plan", STATIONS, "--rate-hz", "1000",
                                    "--duration-s", "2", "--walls", "flat")
        self.assertEqual(stations["datum"]["kind"], "known stations")
        self.assertEqual([row["station"] for row in stations["walls"]], list(NAMES))
        made = self.expect_json(0, "calibrate", *TURNED, "--stations", STATIONS, "--walls", "flat")
        for key in ("sigma_pitch_deg", "sigma_yaw_deg"):
            self.assertAlmostEqual(made["datum_given_held"][key] / stations["datum"][key], 1, delta=0.3)
        facing = self.write("plan.yaml", wall(10, 0))
        arguments = ("calibrate", "--plan", facing, "--rate-hz", "1000")
        poor = self.expect_json(0, *arguments)
        self.assertTrue(poor["unobservable"])
        for word in ("upside down", "incidence", "farther away", "longer"):
            self.assertTrue(any(word in text for text in poor["advice"]), word)
        text = self.expect(0, *arguments).stdout
        self.assertIn("advice: ", text)
        self.assertIn("not determined by these walls: ", text)
        self.assertIn("share %", text)
        kept = self.expect_json(0, *arguments, "--prior-sigma-deg", "0.1")
        self.assertLess(kept["parameters"]["incident_beam_vertical_deg"]["sigma"], 0.1)
        self.assertEqual(kept["unobservable"], [])

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

    def test_a_power_up_between_recordings(self):
        # The same unit, its rotors in the other combination of speeds.
        self.simulate("switched.csv", HALL, "--set", "angular_velocity_a_deg_per_s=-27997.8",
                      "--set", "angular_velocity_b_deg_per_s=43789.8")
        result = self.expect_json(0, "calibrate", "hall.csv", "switched.csv",
                                  *truth_of("hall.csv", "switched.csv"))
        self.check(result, 10)
        self.check_truth(result, 0.04)

    def test_stations_that_contradict_the_data(self):
        text = STATIONS.read_text()
        # Upside down, and said to be upright.
        self.refused(1, ("station upright right", "contradicts"), TURNED[0], TURNED[2],
                     "--stations",
                     self.write("unflipped.yaml", text.replace("roll_deg: 180", "roll_deg: 0")),
                     "--station", NAMES[0], "--station", NAMES[2])
        # One of four turned by a degree more than it is said to be.
        turned = text.replace("{name: flipped left, roll_deg: 180, yaw_deg: 30",
                              "{name: flipped left, roll_deg: 180, yaw_deg: 31")
        self.assertNotEqual(turned, text)
        result = self.refused(1, ("station flipped left", "contradicts"), *TURNED, "--stations",
                              self.write("turned.yaml", turned))
        misfits = {test["name"]: test["chi2"] for test in result["prior_tests"]}
        self.assertEqual(max(misfits, key=misfits.get), "flipped left")

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
