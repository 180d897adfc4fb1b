# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Recordings before walls, and checks of their calibration."""
import json

from command import SOURCE, CommandTest, run

HALL = SOURCE / "data" / "hall.yaml"
STATIONS = SOURCE / "data" / "stations.yaml"
NAMES = ("upright right", "upright left", "flipped right", "flipped left")
TURNED = [f"turned_{i}.nc" for i in range(len(NAMES))]

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


class WallsTest(CommandTest):
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
