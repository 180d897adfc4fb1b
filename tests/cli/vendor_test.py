#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The manufacturer's simulated scan sequence, whose parameters section 3.1 of the paper states."""
import os
import pathlib
import sys
import unittest

from command import CommandTest, codes_of

FOLDER = os.environ.get("RISLEY_VENDOR_DATA", "")


class VendorTest(CommandTest):
    def test_section_3_1(self):
        recording = pathlib.Path(FOLDER) / "livox-mid-40-sequence.csv"
        result = self.expect_json(0, "estimate", recording, "--method", "ekf",
                                  "--noise-angle-deg", "0.001")
        self.assertTrue(result["converged"])
        self.assertEqual(result["combination"], 2)
        value = {name: one["value"] for name, one in result["parameters"].items()}
        self.assertAlmostEqual(value["refractive_index"], 1.50890, delta=1e-5)
        self.assertAlmostEqual(value["angular_velocity_a_deg_per_s"], -43764, delta=0.05)
        self.assertAlmostEqual(value["angular_velocity_b_deg_per_s"], 27984, delta=0.05)
        for name in value:
            if "tilt" in name or "incident_beam" in name:
                self.assertLess(abs(value[name]), 1e-3, name)

    def check_exactly_nominal(self, result):
        self.assertTrue(result["converged"])
        self.assertEqual(result["method"], "map")
        self.assertEqual(result["combination"], 2)
        value = {name: one["value"] for name, one in result["parameters"].items()}
        self.assertAlmostEqual(value["refractive_index"], 1.5089, delta=2e-7)
        self.assertAlmostEqual(value["angular_velocity_a_deg_per_s"], -43764, delta=0.001)
        self.assertAlmostEqual(value["angular_velocity_b_deg_per_s"], 27984, delta=0.001)
        for name in value:
            if "tilt" in name or "incident_beam" in name:
                self.assertLess(abs(value[name]), 1e-5, name)
        for axis in ("azimuth_deg", "zenith_deg"):
            self.assertLess(result["residuals"][axis]["rms"], 5e-6)

    def test_all_shots_to_the_last_digit(self):
        recording = pathlib.Path(FOLDER) / "livox-mid-40-sequence.csv"
        arguments = ("--method", "map", "--rate-hz", "full", "--noise-angle-deg", "0.000005")
        result = self.expect_json(0, "estimate", recording, *arguments)
        self.check_exactly_nominal(result)
        self.assertFalse(result["mirrored"])
        freed = self.expect_json(0, "estimate", recording, *arguments, "--free", "wedge_angle_deg")
        self.assertTrue(freed["converged"])
        self.assertAlmostEqual(freed["parameters"]["wedge_angle_deg"]["value"], 18, delta=1e-4)

    def test_the_sequence_needs_no_option(self):
        recording = pathlib.Path(FOLDER) / "livox-mid-40-sequence.csv"
        result = self.expect_json(0, "estimate", recording)
        self.check_exactly_nominal(result)
        value = result["parameters"]["refractive_index"]["value"]
        self.assertAlmostEqual(value, 1.5089, delta=1e-7)
        for axis in ("azimuth_deg", "zenith_deg"):  # single precision, not the preset's noise
            self.assertLess(result["noise"][axis]["value"], 5e-6)

    def test_a_real_unit_half_under_the_sky_and_turned_by_a_hub(self):
        recording = pathlib.Path(FOLDER) / "real" / "mid-40-hub-frame.csv"
        result = self.expect_json(0, "estimate", recording, "--shot-rate-hz", "100000")
        self.assertEqual(result["combination"], 1)
        self.assertFalse(result["mirrored"])
        value = {name: one["value"] for name, one in result["parameters"].items()}
        self.assertAlmostEqual(value["refractive_index"], 1.5090, delta=0.0002)
        self.assertAlmostEqual(value["angular_velocity_a_deg_per_s"], -28010, delta=5)
        self.assertAlmostEqual(value["angular_velocity_b_deg_per_s"], 43812, delta=5)
        self.assertAlmostEqual(result["frame"]["yaw_deg"]["value"], 25.86, delta=0.1)
        self.assertAlmostEqual(result["frame"]["pitch_deg"]["value"], -0.03, delta=0.1)
        for axis in ("azimuth_deg", "zenith_deg"):
            self.assertLess(result["residuals"][axis]["rms"], 0.005)
        self.assertEqual(result["sensor"], "Livox Mid-40")
        self.assertEqual(result["sensor_chosen_by"], "scan")
        smooth = self.expect_json(0, "estimate", recording, "--shot-rate-hz", "100000",
                                  "--process-noise", "none")
        squares = [smooth["residuals"][axis]["rms"] ** 2 for axis in ("azimuth_deg", "zenith_deg")]
        self.assertLess((sum(squares) / 2) ** 0.5, 0.012)
        # Without times nothing is made up.
        self.assertIn("--shot-rate-hz", self.expect(2, "estimate", recording).stderr)

    def test_a_real_tele_15_whose_file_names_no_emitters(self):
        recording = pathlib.Path(FOLDER) / "real" / "tele-15.pcd"
        arguments = ("estimate", recording, "--sensor", "tele-15", "--shot-rate-hz", "240385")
        result = self.expect_json(0, *arguments)
        self.assertTrue(result["converged"])
        self.assertEqual(result["slips"], [])
        value = {name: one["value"] for name, one in result["parameters"].items()}
        self.assertAlmostEqual(value["refractive_index"], 1.5089, delta=5e-4)
        self.assertAlmostEqual(value["angular_velocity_a_deg_per_s"], -59022, delta=0.0005 * 59022)
        self.assertAlmostEqual(value["angular_velocity_b_deg_per_s"], 18522, delta=0.0005 * 18522)
        for axis in ("azimuth_deg", "zenith_deg"):
            self.assertLess(result["residuals"][axis]["rms"], 0.002)
        elevations = [value[f"incident_beam_{i}_vertical_deg"] for i in range(1, 7)]
        # In the order of the preset, whichever fired first.
        for found, nominal in zip(elevations, (-0.792, -0.475, -0.158, 0.158, 0.475, 0.792)):
            self.assertAlmostEqual(found, nominal, delta=0.01)

    def test_real_units_are_recognised_as_they_are(self):
        real = pathlib.Path(FOLDER) / "real"
        for name, rate, sensor in (("tele-15.pcd", "240385", "Tele-15"),
                                   ("horizon-1.pcd", "240385", "Horizon"),
                                   ("mid-40-hub-frame.csv", "100000", "Mid-40"),
                                   ("avia-viewer-1.csv", None, "Avia"),
                                   ("avia-viewer-13.csv", None, "Avia")):
            with self.subTest(name):
                rates = ("--shot-rate-hz", rate) if rate else ()
                info = self.expect_json(0, "info", real / name, *rates)
                self.assertEqual(info["sensor"], f"Livox {sensor}")
                self.assertEqual(info["sensor_chosen_by"], "scan")
                best, following = info["sensor_choice"]["misfits"]
                self.assertEqual(best["preset"], sensor.lower())
                self.assertGreater(following["misfit_deg"], 3 * best["misfit_deg"])
                if rate:  # without times and rate it is a guess, and called one
                    info = self.expect_json(0, "info", real / name)
                    self.assertEqual(info["sensor"], f"Livox {sensor}")
                    self.assertEqual(info["sensor_chosen_by"], "guess")

    def test_emitters_of_a_real_tele_15_are_numbered_as_the_preset_has_them(self):
        recording = pathlib.Path(FOLDER) / "real" / "tele-15.pcd"
        result = self.expect_json(0, "estimate", recording, "--shot-rate-hz", "240385")
        self.assertEqual(result["preset"], "tele-15")
        self.assertFalse(result["mirrored"])
        self.assertEqual(result["verdict"]["code"], "consistent")
        for i in range(1, 7):
            value = result["parameters"][f"incident_beam_{i}_vertical_deg"]["value"]
            self.assertAlmostEqual(value, (i - 3.5) * 0.3168, delta=0.01)
    def test_a_real_horizon_lost_six_shots_nine_times(self):
        recording = pathlib.Path(FOLDER) / "real" / "horizon-1.pcd"
        arguments = ("estimate", recording, "--sensor", "horizon", "--shot-rate-hz")
        result = self.expect_json(0, *arguments, "240385")
        self.assertEqual([slip["shots"] for slip in result["slips"]], 9 * [6])
        # Packets of 96 shots: always at their border.
        self.assertEqual(len({slip["row"] % 96 for slip in result["slips"]}), 1)
        value = {name: one["value"] for name, one in result["parameters"].items()}
        for letter, index, speed in (("a", 1.6106, -44112), ("b", 1.6106, 44112), ("c", 1.5799, -3714)):
            self.assertAlmostEqual(value[f"refractive_index_{letter}"], index, delta=5e-4)
            self.assertAlmostEqual(value[f"angular_velocity_{letter}_deg_per_s"], speed,
                                   delta=0.0005 * abs(speed))
        self.assertLess(self.residual_of(result), 0.006)
        self.assertLess(result["outliers"], 0.001 * result["observations_used"])
        self.assertIsNone(result["shot_clock"])
        # A round shot rate is noticed and kept.
        slow = self.expect_json(0, *arguments, "240000")
        self.assertEqual(len(slow["slips"]), 9)
        self.assertAlmostEqual(slow["shot_clock"]["shot_rate_hz"], 240385, delta=50)
        self.assertIn("clock_rate", codes_of(slow))

    def test_a_real_avia_whose_packets_lack_points(self):
        for name, rows in (("avia-viewer-1.csv", 17951), ("avia-viewer-13.csv", 20491)):
            for rate in ((), ("--shot-rate-hz", "240000")):
                with self.subTest(name, rate=rate):
                    recording = pathlib.Path(FOLDER) / "real" / name
                    result = self.expect_json(0, "estimate", recording, *rate)
                    self.assertEqual(result["sensor_chosen_by"], "scan")
                    self.assertEqual(result["preset"], "avia")
                    self.assertFalse(result["mirrored"])
                    value = {key: one["value"] for key, one in result["parameters"].items()}
                    self.assertAlmostEqual(value["refractive_index"], 1.8144, delta=5e-4)
                    for letter, speed in (("a", -47358), ("b", 14688)):
                        self.assertAlmostEqual(value[f"angular_velocity_{letter}_deg_per_s"], speed,
                                               delta=0.0005 * abs(speed))
                    # 240,000 are not quite what the packets of these files say.
                    self.assertLess(self.residual_of(result), 0.0105 if rate else 0.010)
                    self.assertGreater(result["observations_used"], 0.998 * rows)
                    self.assertLess(result["outliers"], 0.001 * rows)
                    self.assertIn("packets_incomplete", codes_of(result))
            # Other verbs know the same times.
            with self.subTest(name, verb="convert"):
                done = self.expect_json(0, "convert", recording, "-o", "placed.nc")
                self.assertEqual(done["time_uncertainty_s"], 0)
                again = self.expect_json(0, "estimate", "placed.nc", "--sensor", "avia")
                self.assertLess(self.residual_of(again), 0.010)

    @staticmethod
    def residual_of(result):
        """Root mean square of the residuals per axis, degrees."""
        squares = [result["residuals"][axis]["rms"] ** 2 for axis in ("azimuth_deg", "zenith_deg")]
        return (sum(squares) / 2) ** 0.5

    def test_public_copies_have_the_elevation_the_other_way(self):
        lines = (pathlib.Path(FOLDER) / "livox-mid-40-sequence.csv").read_text().splitlines()
        with open(self.folder / "mirrored.csv", "w", encoding="ascii") as file:
            file.write(lines[0] + "\n")
            for line in lines[1:]:
                time, azimuth, zenith = line.split(",")
                file.write(f"{time},{azimuth},{180 - float(zenith):.5f}\n")
        result = self.expect_json(0, "estimate", "mirrored.csv")
        self.check_exactly_nominal(result)
        self.assertTrue(result["mirrored"])
        self.assertIn("mirrored", codes_of(result))
        # Taken as it is, it is refused and not bent until it fits.
        taken = self.expect_json(1, "estimate", "mirrored.csv", "--mirror", "no")
        self.assertFalse(taken["converged"])


if __name__ == "__main__":
    if not FOLDER:
        print("SKIPPED: RISLEY_VENDOR_DATA does not name the folder of livox-mid-40-sequence.csv")
        sys.exit(77)
    unittest.main()
