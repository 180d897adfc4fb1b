#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Calibration on walls: what walls, stations, plans and priors determine."""
import unittest

from command import codes_of
from walls import CALIBRATED, HALL, NAMES, STATIONS, TURNED, WallsTest, truth_of, wall

# Four walls that meet ahead of the sensor, at 45 degrees of incidence.
NICHE = "planes:\n" + "".join(
    f"  - {{name: {name}, distance_m: 20, normal_azimuth_deg: {azimuth}, normal_zenith_deg: "
    f"{zenith}}}\n"
    for name, azimuth, zenith in (("left", 55, 90), ("right", -55, 90), ("up", 0, 35),
                                  ("down", 0, 145)))


class CalibrateDatumTest(WallsTest):
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


if __name__ == "__main__":
    unittest.main()
