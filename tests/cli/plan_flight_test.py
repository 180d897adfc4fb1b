#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Planning a flight: what its calibration will determine, and how its points will lie on the ground."""
import unittest

from command import SOURCE, CommandTest

DATA = SOURCE / "data"
MOUNT = ("--mount", str(DATA / "mount-as-built.yaml"))
ERRORS = ("--trajectory-errors", str(DATA / "trajectory-errors.yaml"))
QUICK = ("--rate-hz", "1000", "--knot-spacing-s", "4")
PLAN = """risley_flight: 1
name: two opposite strips
rate_hz: 200
height_m: 40
speed_m_per_s: 5
turn_duration_s: 20
strips: [{headings_deg: [90, 270], length_m: 60}]
motion:
  seed: 4
  attitude: {roll_deg: 2, pitch_deg: 2, heading_deg: 2, lowest_hz: 0.15, highest_hz: 1.2, sinusoids: 6}
"""


class PlanFlightTest(CommandTest):
    def plan(self, *arguments, text=PLAN):
        (self.folder / "flight.yaml").write_text(text)
        return ("calibrate", "--plan", "flight.yaml", *arguments)

    def test_numbers(self):
        result = self.expect_json(0, *self.plan(*MOUNT, *ERRORS, *QUICK, "--scene",
                                                str(DATA / "village.yaml"), "--report", "page.html"))
        datum = result["datum"]
        self.assertLess(datum["sigma_total_deg"], 0.05)
        self.assertLess(datum["sigma_shape_deg"], datum["sigma_total_deg"])
        self.assertAlmostEqual(datum["height_m"], 40, delta=4)
        self.assertAlmostEqual(datum["sigma_total_m"] / datum["height_m"] / datum["sigma_total_deg"],
                               0.01745, delta=1e-4)
        unknowns = result["unknowns"]
        self.assertLess(unknowns["boresight_y_deg"]["sigma"], 0.1)
        self.assertAlmostEqual(unknowns["boresight_y_deg"]["prior_sigma"], 3)
        self.assertLess(unknowns["boresight_y_deg"]["prior_share"], 0.01)
        self.assertGreater(unknowns["lever_arm_z_m"]["prior_share"], 0.5)
        self.assertIn("incident_beam_vertical_deg", unknowns)
        self.assertAlmostEqual(result["shots"]["fired"], 24000, delta=700)
        self.assertLess(result["points"]["strips_adjusted_m"]["up"],
                        result["points"]["strips_trajectory_m"]["up"])
        distribution = result["distribution"]
        self.assertEqual(len(distribution["strips"]), 2)
        strip = distribution["strips"][0]
        # 100,000 shots a second on 27.9 m, 5 m/s.
        self.assertAlmostEqual(strip["nominal_density_per_m2"], 100000 / 27.9 / 5, delta=60)
        self.assertAlmostEqual(strip["swath_m"], 27.9, delta=1.5)
        self.assertAlmostEqual(strip["nominal_spacing_m"],
                               strip["nominal_density_per_m2"] ** -0.5, places=6)
        self.assertGreater(strip["middle_density_per_m2"], strip["nominal_density_per_m2"])
        self.assertLess(strip["empty_share"], 0.02)
        self.assertGreater(distribution["aggregate_density_per_m2"],
                           1.5 * strip["nominal_density_per_m2"])
        self.assertGreater(distribution["overlap"], 0.9)
        self.assertEqual(len(strip["profile"]["across_m"]), len(strip["profile"]["density_per_m2"]))
        page = (self.folder / "page.html").read_text()
        for words in ("Density from above", "Density across the strips", "Strip by strip", "ANPD"):
            self.assertIn(words, page)
        self.assertEqual(result["html"], "page.html")

    def test_words(self):
        said = self.expect(0, *self.plan(*MOUNT, *ERRORS, *QUICK))
        for words in ("boresight and prisms together", "not determined by this flight: ", "lever_arm_z_m",
                      "strip against strip", "ANPD", "dense: width"):
            self.assertIn(words, said.stdout)
        self.assertIn("no terrain is given", said.stderr)

    def test_what_a_mount_states_as_exact_is_not_looked_for(self):
        arguments = self.plan("--mount", str(DATA / "mount-nadir.yaml"), *ERRORS, *QUICK)
        self.assertIn("sigma of 0", self.expect(0, *arguments).stderr)
        held = self.expect_json(0, *arguments)["unknowns"]["boresight_x_deg"]
        self.assertTrue(held["held"])

    def refused(self, status, words, *arguments):
        said = self.expect(status, *arguments).stderr
        for word in words:
            self.assertIn(word, said)

    def test_refusals(self):
        self.refused(2, ("--mount", "missing"), *self.plan(*ERRORS))
        self.refused(2, ("--trajectory-errors", "missing"), *self.plan(*MOUNT))
        self.refused(2, ("strips",), "calibrate", "--plan", str(DATA / "hall.yaml"), *MOUNT)
        self.refused(2, ("terrain",), *self.plan(*MOUNT, *ERRORS, "--scene",
                                                 str(DATA / "hall.yaml")))
        self.refused(2, ("--empty-circle-m",), *self.plan(*MOUNT, *ERRORS, "--empty-circle-m", "0"))
        self.refused(2, ("--accuracy",), *self.plan(*MOUNT, *ERRORS, "--accuracy",
                                                    str(DATA / "hall.yaml")))
        self.refused(2, ("--knot-spacing-s",), "calibrate", "x.lvx", "--knot-spacing-s", "1")
        self.refused(3, ("flight.yaml", "line"), *self.plan(*MOUNT, *ERRORS, text="strips: 7\n"))
        self.refused(1, ("one strip",), *self.plan(
            *MOUNT, *ERRORS, *QUICK, text=PLAN.replace("[90, 270]", "[90]")))
        (self.folder / "errors.yaml").write_text(
            (DATA / "trajectory-errors.yaml").read_text().replace("{sigma: 0.03, ", "{"))
        self.refused(2, ("sigma",), *self.plan(*MOUNT, "--trajectory-errors", "errors.yaml"))
        self.refused(2, ("flight.yaml",), *self.plan(*MOUNT, *ERRORS, *QUICK, "--report",
                                                     "flight.yaml"))


if __name__ == "__main__":
    unittest.main()
