#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Simulate, look, convert, estimate: the keys that scripts read, and results that repeat."""
import hashlib
import pathlib
import unittest

from command import SOURCE, CommandTest, codes_of, run

INFO_KEYS = {"format", "sensor", "observations", "no_return", "duration_s", "rate_hz", "has_range",
             "gaps", "time_resets", "azimuth_deg", "zenith_deg"}
ESTIMATE_KEYS = {"converged", "method", "observations_used", "outliers", "combination", "mirrored",
                 "parameters", "residuals", "seconds", "truth"}
MOMENTS = {"mean", "std", "rms", "skewness", "kurtosis"}
ESTIMATED = {"refractive_index", "incident_beam_horizontal_deg", "incident_beam_vertical_deg",
             "bearing_tilt_a_horizontal_deg", "bearing_tilt_a_vertical_deg",
             "prism_tilt_a_vertical_deg", "prism_tilt_b_horizontal_deg",
             "prism_tilt_b_vertical_deg", "angular_velocity_a_deg_per_s",
             "angular_velocity_b_deg_per_s", "rotation_angle_a_deg", "rotation_angle_b_deg"}
ROOM = SOURCE / "data" / "room.yaml"


def digest(path):
    return hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()


class ChainTest(CommandTest):
    def check_info(self, name, expected):
        info = self.expect_json(0, "info", name)
        self.assertLessEqual(INFO_KEYS, info.keys())
        for key in ("azimuth_deg", "zenith_deg"):
            self.assertLessEqual({"min", "max"}, info[key].keys())
            self.assertLess(info[key]["min"], info[key]["max"])
        for key, value in expected.items():
            self.assertEqual(info[key], value, key)
        return info

    def check_estimate(self, result, method="map"):
        self.assertLessEqual(ESTIMATE_KEYS, result.keys())
        self.assertTrue(result["converged"])
        self.assertEqual(result["method"], method)
        self.assertFalse(result["mirrored"])
        self.assertLessEqual(ESTIMATED, result["parameters"].keys())
        for value in result["parameters"].values():
            self.assertEqual(value.keys(), {"value", "sigma", "sigma_given_held"})
            self.assertGreaterEqual(value["sigma"], value["sigma_given_held"])
        for axis in ("azimuth_deg", "zenith_deg"):
            self.assertLessEqual(MOMENTS, result["residuals"][axis].keys())
        self.assertLessEqual({"read", "solve", "total"}, result["seconds"].keys())
        truth = result["truth"]
        self.assertEqual(truth["parameters"].keys(), result["parameters"].keys())
        for name, value in truth["parameters"].items():
            self.assertEqual(value.keys(), {"true", "error", "error_over_sigma"})
            self.assertLess(abs(value["error_over_sigma"]), 6, name)
        self.assertEqual(truth["rotation_angle_rmse_deg"].keys(), {"a", "b"})
        self.assertLessEqual({"nees_parameters", "nees_rotation_angles"}, truth.keys())

    def test_lvx(self):
        simulated = self.expect_json(
            0, "simulate", "-o", "unit.lvx", "--sensor", "mid-40-table3", "--scene", ROOM,
            "--duration-s", "4", "--rate-hz", "1000", "--seed", "1")
        self.assertEqual(simulated["observations"], 4000)
        self.assertAlmostEqual(simulated["truth"]["wedge_angle_deg"], 18, places=9)
        info = self.check_info("unit.lvx", {"has_range": True, "time_resets": 0})
        self.assertIn("Mid-40", info["sensor"])
        # The packets of this format have a place for each of 100 000 shots a second.
        self.assertEqual(info["observations"] - info["no_return"], 4000)
        result = self.expect_json(0, "estimate", "unit.lvx", "--truth", "unit.lvx.truth.yaml",
                                  "-o", "out")
        self.check_estimate(result)
        self.assertEqual(result["combination"], 2)
        self.assertEqual({path.name for path in (self.folder / "out").iterdir()},
                         {"calibration.yaml", "states.nc", "report.html", "report.json"})
        page = (self.folder / "out" / "report.html").read_text(encoding="utf-8")
        self.assertIn(digest(self.folder / "unit.lvx"), page)
        self.assertIn("risley estimate unit.lvx", page)
        self.assertNotRegex(page, r"(src|href)\s*=\s*[\"']?(https?:)?//")
        self.assertLess(len(page), 4_000_000)
        calibration = (self.folder / "out" / "calibration.yaml").read_text(encoding="utf-8")
        self.assertIn(digest(self.folder / "unit.lvx"), calibration)
        # What the preset states of sizes, which directions do not show, goes along.
        self.assertRegex(calibration, r"prism_thickness_m: \{value: 0.007, unit: \"m\", sigma: 0.001, ")
        # A calibration is a preset: it serves as a sensor.
        again = self.expect_json(0, "estimate", "unit.lvx", "--sensor", "out/calibration.yaml")
        self.assertTrue(again["converged"])

    def test_csv(self):
        simulated = self.expect_json(
            0, "simulate", "-o", "unit.csv", "--duration-s", "4", "--rate-hz", "1000",
            "--noise-angle-deg", "0.01", "--quantize", "no", "--seed", "2",
            "--set", "prism_tilt_a_vertical_deg=0.1", "--start-angles-deg", "10,20")
        truth = simulated["truth"]
        self.assertAlmostEqual(truth["prism_tilt_a_vertical_deg"], 0.1, places=9)
        self.assertAlmostEqual(truth["rotation_angle_a_deg"], 10, places=9)
        self.check_info("unit.csv", {"observations": 4000, "has_range": False, "gaps": 0})
        self.assertEqual(self.expect_json(0, "convert", "unit.csv", "-o", "unit.nc")
                         ["observations"], 4000)
        self.check_info("unit.nc", {"observations": 4000, "has_range": False})
        self.expect(0, "convert", "unit.nc", "-o", "again", "--format", "scan-sequence-csv")
        self.assertEqual(digest(self.folder / "unit.csv"), digest(self.folder / "again"))
        result = self.expect_json(0, "estimate", "unit.csv", "--truth", "unit.csv.truth.yaml",
                                  "--noise-angle-deg", "0.01")
        self.check_estimate(result)
        self.assertEqual(result["combination"], 1)
        self.assertEqual(result["observations_used"], 4000)
        filtered = self.expect_json(0, "estimate", "unit.csv", "--truth", "unit.csv.truth.yaml",
                                    "--noise-angle-deg", "0.01", "--method", "ekf", "-o", "ekf")
        self.check_estimate(filtered, "ekf")
        for name, value in result["parameters"].items():
            if name.startswith("rotation_angle"):
                continue
            self.assertAlmostEqual(value["value"], filtered["parameters"][name]["value"],
                                   delta=2 * value["sigma_given_held"], msg=name)

    def test_fixed_and_freed(self):
        self.expect(0, "simulate", "-o", "fix.csv", "--duration-s", "2", "--rate-hz", "1000",
                    "--noise-angle-deg", "0.01", "--quantize", "no")
        result = self.expect_json(0, "estimate", "fix.csv", "--noise-angle-deg", "0.01",
                                  "--fix", "refractive_index=1.51", "--fix",
                                  "bearing_tilt_a_vertical_deg",
                                  "--free", "prism_tilt_a_horizontal_deg", "--method", "ekf")
        self.assertNotIn("refractive_index", result["parameters"])
        self.assertNotIn("bearing_tilt_a_vertical_deg", result["parameters"])
        self.assertIn("prism_tilt_a_horizontal_deg", result["parameters"])
        self.assertEqual(result["fixed"]["refractive_index_a"], 1.51)
        self.expect(2, "estimate", "fix.csv", "--fix", "no_such_parameter")
        # The batch estimator notices that these data do not determine the tilt, and names it.
        result = self.expect_json(1, "estimate", "fix.csv", "--noise-angle-deg", "0.01",
                                  "--free", "prism_tilt_a_horizontal_deg")
        self.assertFalse(result["converged"])
        self.assertIn("prism_tilt_a_horizontal_deg", result["reason"])
        self.assertIn("prism_tilt_a_horizontal_deg", result["unobservable"][0]["direction"])
        self.assertGreater(result["unobservable"][0]["sigma"], 0.3)

    def test_states(self):
        self.expect(0, "simulate", "-o", "full.lvx", "--scene", ROOM, "--duration-s", "0.5")
        sizes = {}
        for states in ("knots", "all", "none"):
            self.expect(0, "estimate", "full.lvx", "--states", states, "-o", states)
            path = self.folder / states / "states.nc"
            sizes[states] = path.stat().st_size if path.exists() else 0
        self.assertEqual(sizes["none"], 0)
        self.assertGreater(sizes["all"], 20 * sizes["knots"])
        self.assertGreater(sizes["knots"], 1000)
        self.expect(2, "estimate", "full.lvx", "--states", "all", "--method", "ekf")

    def test_clock_reset(self):
        self.expect(0, "simulate", "-o", "one.csv", "--duration-s", "2", "--rate-hz", "1000",
                    "--noise-angle-deg", "0.01", "--quantize", "no")
        lines = (self.folder / "one.csv").read_text().splitlines()
        for i in range(1001, len(lines)):
            time, rest = lines[i].split(",", 1)
            lines[i] = f"{float(time) - 0.9:.5f},{rest}"
        (self.folder / "reset.csv").write_text("\n".join(lines) + "\n")
        result = self.expect_json(0, "estimate", "reset.csv", "--noise-angle-deg", "0.01")
        self.assertTrue(result["converged"])
        self.assertEqual(result["observations_used"], 2000)
        self.assertIn("clock_reset", codes_of(result))

    def test_observability(self):
        plan = self.expect_json(0, "observability", "--duration-s", "10", "--rate-hz", "1000",
                                "--noise-angle-deg", "0.01", "--no-rounding")
        self.assertLessEqual({"parameters", "correlation", "unobservable"}, plan.keys())
        self.assertLessEqual(ESTIMATED, plan["parameters"].keys())
        for value in plan["parameters"].values():
            self.assertLessEqual({"sigma", "sensitivity"}, value.keys())
        names = plan["correlation"]["names"]
        self.assertEqual(len(plan["correlation"]["matrix"]), len(names))
        self.assertEqual(len(plan["correlation"]["matrix"][0]), len(names))
        self.assertIsNone(plan["parameters"]["refractive_index_air"]["sigma"])
        self.assertTrue(any("refractive_index_air" in weak["direction"]
                            for weak in plan["unobservable"]))
        self.expect(0, "simulate", "-o", "seen.csv", "--duration-s", "10", "--rate-hz", "1000",
                    "--noise-angle-deg", "0.01", "--quantize", "no", "--rotor", "sinusoidal")
        seen = self.expect_json(0, "observability", "seen.csv", "--noise-angle-deg", "0.01")
        for name in ("refractive_index", "bearing_tilt_a_vertical_deg", "prism_tilt_b_vertical_deg"):
            self.assertAlmostEqual(seen["parameters"][name]["sigma"] /
                                   plan["parameters"][name]["sigma"], 1, delta=0.05)
        text = self.expect(0, "observability", "seen.csv", "--noise-angle-deg", "0.01").stdout
        self.assertIn("keep it fixed", text)
        self.expect(2, "observability", "--duration-s", "0")
        self.assertIsNone(plan["emitters"])

    def test_observability_of_six_emitters(self):
        plan = ("observability", "--sensor", "horizon", "--duration-s", "0.5", "--rate-hz", "24000")
        seen = self.expect_json(0, *plan)
        emitters = seen["emitters"]
        self.assertEqual(emitters["count"], 6)
        self.assertIn(emitters["alone"], (3, 4))
        glass = emitters["parameters"]["refractive_index_a"]
        self.assertLess(glass["sigma_directions_known"], glass["sigma"])
        self.assertIsNone(glass["sigma_alone"])
        self.assertTrue(emitters["unobservable_alone"])
        self.assertAlmostEqual(glass["sigma"] / seen["parameters"]["refractive_index_a"]["sigma"],
                               1, delta=1e-3)
        for name in seen["parameters"]:
            if name.startswith("incident_beam"):
                self.assertLess(seen["parameters"][name]["sigma"], 0.001)
        text = self.expect(0, *plan).stdout
        self.assertIn("only the 6 emitters together determine", text)
        self.assertIn("not determined by emitter", text)

    def test_reported_nominal(self):
        arguments = ("--sensor", "mid-40-table3", "--rate-hz", "1000", "--duration-s", "0.2",
                     "--noise-angle-deg", "0", "--quantize", "no")
        self.expect(0, "simulate", "-o", "true.csv", *arguments)
        self.expect(0, "simulate", "-o", "believed.csv", *arguments, "--reported", "nominal")
        self.assertNotEqual(digest(self.folder / "true.csv"), digest(self.folder / "believed.csv"))

    def test_same_seed_same_bytes(self):
        outputs = []
        for threads, seed in ((1, 5), (2, 5), (2, 6)):
            folder = self.folder / f"{threads}-{seed}"
            folder.mkdir()
            done = run("simulate", "-o", "same.lvx", "--scene", ROOM, "--duration-s", "0.5",
                       "--rotor", "sinusoidal", "--threads", threads, "--seed", seed,
                       folder=folder)
            self.assertEqual(done.returncode, 0, done.stderr)
            outputs.append((digest(folder / "same.lvx"), digest(folder / "same.lvx.truth.nc")))
        self.assertEqual(outputs[0], outputs[1])
        self.assertNotEqual(outputs[0][0], outputs[2][0])

    def test_recordings_that_cannot_answer(self):
        self.expect(0, "simulate", "-o", "short.csv", "--duration-s", "0.015")
        invalid = ["//Distance,Zenith,Azimuth,Inten-sity,Time\n"]
        invalid += [f"0.000,90.00,0.00,0,{0.00001 * i:.6f}\n" for i in range(100)]
        (self.folder / "blind.csv").write_text("".join(invalid))
        for name in ("short.csv", "blind.csv"):
            with self.subTest(name=name):
                result = self.expect_json(1, "estimate", name)
                self.assertFalse(result["converged"])
                self.assertTrue(result["reason"])
                self.assertEqual(result["exit_status"], 1)
                self.assertTrue(self.expect(1, "estimate", name).stderr)

    def test_not_converged_still_writes(self):
        name = "<b>noisy's.csv"  # must not become part of the page's HTML
        self.expect(0, "simulate", "-o", name, "--duration-s", "1", "--rate-hz", "2000",
                    "--noise-angle-deg", "0.05", "--quantize", "no")
        result = self.expect_json(1, "estimate", name, "--noise-angle-deg", "0.002",
                                  "--process-noise", "1", "-o", "noisy")
        self.assertFalse(result["converged"])
        self.assertTrue(result["reason"])
        self.assertTrue(result["parameters"])
        page = (self.folder / "noisy" / "report.html").read_text(encoding="utf-8")
        self.assertNotIn("<b>noisy", page)
        self.assertIn("&lt;b&gt;noisy", page)


if __name__ == "__main__":
    unittest.main()
