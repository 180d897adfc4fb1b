#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""What every verb's JSON object begins with, whose sensor it was, and the codes of verdicts."""
import hashlib
import json
import unittest

from command import SOURCE, CommandTest, run

HALL = SOURCE / "data" / "hall.yaml"
VERBS = ("info", "convert", "simulate", "record", "emulate", "estimate", "observability", "calibrate", "cloud",
         "compare", "campaign", "identify", "pattern", "preset", "report")
RATES = {"mid-40": 100000, "mid-70": 100000, "avia": 240000, "horizon": 240000, "tele-15": 240000}


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


class ContractTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name, *more in (("believed.nc",), ("bent.nc", "--reported", "nominal")):
            done = run("simulate", "-o", name, "--sensor", "mid-40-table3", "--scene", HALL,
                       "--duration-s", "2", "--rate-hz", "20000", "--seed", "3", *more,
                       folder=cls.folder)
            assert done.returncode == 0, done.stderr
        (cls.folder / "plan.yaml").write_text(
            f"simulate: {{duration_s: 0.5, rate_hz: 5000, scene: {HALL}}}\ncalibrate:\nseeds: {{count: 1}}\n")
        done = run("estimate", "believed.nc", "-o", "out", folder=cls.folder)
        assert done.returncode == 0, done.stderr

    def check_head(self, result, *inputs):
        self.assertEqual(result["format_version"], 1)
        self.assertRegex(result["version"], r"^\d+\.\d+\.\d+")
        self.assertTrue(result["command"].startswith("risley "), result["command"])
        expected = [{"path": name, "sha256": digest(self.folder / name)} for name in inputs]
        self.assertEqual(result["inputs"], expected)

    def test_every_verb_begins_its_object_alike(self):
        recording = "believed.nc"
        commands = {
            "info": ((recording,), (recording,)),
            "convert": ((recording, "-o", "copy.csv"), (recording,)),
            "simulate": (("-o", "more.nc", "--duration-s", "0.1", "--scene", HALL), (str(HALL),)),
            "estimate": ((recording,), (recording,)),
            "observability": ((recording,), (recording,)),
            "calibrate": ((recording,), (recording,)),
            "cloud": ((recording, "--calibration", "out/calibration.yaml", "-o", "cloud.las"),
                      (recording, "out/calibration.yaml")),
            "identify": ((recording,), (recording,)),
            "pattern": (("--sensor", "avia", "--format", "npy", "--duration-s", "0.01", "-o",
                         "avia.npy"), ()),
            "preset": (("check", "out/calibration.yaml"), ("out/calibration.yaml",)),
            "report": (("out",), ("out/report.json",)),
            "compare": (("out", "out"), ("out/calibration.yaml", "out/calibration.yaml")),
            "record": (("--list", "--interface", "127.0.0.91", "--find-s", "0.1"), ()),
            "emulate": (("--interface", "127.0.0.92", "--duration-s", "0.1"), ()),
            "campaign": (("plan.yaml", "--chunk", "1/1", "-o", "campaign"), ("plan.yaml", str(HALL))),
        }
        self.assertEqual(set(commands), set(VERBS))
        for verb, (arguments, inputs) in commands.items():
            with self.subTest(verb):
                result = self.expect_json(0, verb, *arguments)
                self.assertEqual(list(result)[:4], ["format_version", "version", "command",
                                                    "inputs"])
                self.check_head(result, *inputs)
                self.assertTrue(result["command"].startswith(f"risley {verb} "))
        self.check_head(self.expect_json(0, "preset", "list"))
        self.check_head(self.expect_json(0, "calibrate", "--plan", HALL, "--duration-s", "1"),
                        str(HALL))
        both = self.expect_json(0, "cloud", "be*[dt].nc", "--calibration", "mid-40", "-o", "clouds/")
        self.check_head(both, "believed.nc", "bent.nc")

    def test_objects_of_errors_begin_alike(self):
        self.check_head(self.expect_json(2, "estimate", "believed.nc", "--unknown"))
        missing = self.expect_json(3, "info", "missing.nc")
        self.assertEqual(missing["inputs"], [{"path": "missing.nc", "sha256": None}])
        self.check_head(self.expect_json(2, "estimate", "believed.nc", "--fix", "nonsense"),
                        "believed.nc")

    def check_verdict(self, result, code):
        self.assertEqual(list(result["verdict"]), ["code", "words", "to_do"])
        self.assertEqual(result["verdict"]["code"], code, result["verdict"])
        self.assertTrue(result["verdict"]["words"] and result["verdict"]["to_do"])
        self.assertLessEqual({"serial", "sensor"}, result.keys())

    def test_verdicts_of_estimates(self):
        result = self.expect_json(0, "estimate", "believed.nc")
        self.check_verdict(result, "consistent")
        self.assertEqual(result["sensor"], "Livox Mid-40")
        self.assertEqual(result["sensor_chosen_by"], "file")
        self.assertTrue(result["serial"].startswith("SIM"))
        self.expect(0, "simulate", "-o", "noisy.nc", "--duration-s", "2", "--rate-hz", "20000",
                    "--noise-angle-deg", "0.05")
        self.check_verdict(self.expect_json(0, "estimate", "noisy.nc"), "unusual")
        self.check_verdict(self.expect_json(0, "estimate", "bent.nc", "--sensor", "mid-40-table3"),
                           "unusual")
        self.check_verdict(self.expect_json(1, "estimate", "believed.nc", "--mirror", "yes"),
                           "inconsistent")
        self.check_verdict(self.expect_json(1, "estimate", "believed.nc", "--free",
                                            "refractive_index_air"), "undecided")
        self.expect(0, "simulate", "-o", "shorter.nc", "--duration-s", "0.01", "--rate-hz", "1000")
        self.check_verdict(self.expect_json(1, "estimate", "shorter.nc"), "undecided")

    def test_verdicts_of_calibrations(self):
        self.check_verdict(self.expect_json(0, "calibrate", "believed.nc"), "as_believed")
        self.check_verdict(self.expect_json(0, "calibrate", "bent.nc"), "bent")
        (self.folder / "wall.yaml").write_text(
            "planes:\n  - {name: wall, distance_m: 30, normal_azimuth_deg: 0, "
            "normal_zenith_deg: 90}\n", encoding="utf-8")
        self.expect(0, "simulate", "-o", "wall.nc", "--scene", "wall.yaml", "--duration-s", "1",
                    "--rate-hz", "20000")
        self.check_verdict(self.expect_json(1, "calibrate", "wall.nc"), "undecided")

    def test_sigmas_hold_what_held_parameters_may_be_off_by(self):
        usual = self.expect_json(0, "estimate", "believed.nc", "-o", "usual")["parameters"]
        for name, one in usual.items():
            self.assertGreaterEqual(one["sigma"], one["sigma_given_held"], name)
        index = usual["refractive_index"]
        self.assertGreater(index["sigma"], 20 * index["sigma_given_held"])
        # A wedge of 18 degrees that is off by 0.05 is made up for by (n - 1) * 0.05 / 18.
        self.assertAlmostEqual(index["sigma"] / (0.51 * 0.05 / 18), 1, delta=0.3)
        kept = (self.folder / "usual/calibration.yaml").read_text(encoding="utf-8")
        self.assertRegex(kept, r"refractive_index: \{[^}]*total_sigma: ")
        # The next estimate of the unit takes it for its start.
        again = self.expect_json(0, "estimate", "believed.nc", "--sensor",
                                 "usual/calibration.yaml")["parameters"]
        self.assertAlmostEqual(again["refractive_index"]["value"], index["value"],
                               delta=index["sigma_given_held"])
        exact = self.expect_json(0, "estimate", "believed.nc", "--sensor",
                                 "mid-40-table3")["parameters"]
        for name, one in exact.items():
            self.assertEqual(one["sigma"], one["sigma_given_held"], name)
        held = self.expect_json(0, "estimate", "believed.nc", "--sensor", "mid-40-table3", "--fix",
                                "prism_tilt_b_vertical_deg")["parameters"]
        self.assertTrue(any(one["sigma"] > 1.001 * one["sigma_given_held"]
                            for one in held.values()))

    def test_sensors_are_recognised_where_the_file_does_not_name_them(self):
        for sensor, rate in RATES.items():
            with self.subTest(sensor):
                self.expect(0, "simulate", "-o", f"{sensor}.csv", "--sensor", sensor,
                            "--duration-s", "0.1", "--rate-hz", rate)
                info = self.expect_json(0, "info", f"{sensor}.csv", "--shot-rate-hz", rate)
                self.assertEqual(info["sensor"].lower(), f"livox {sensor}")
                self.assertEqual((info["preset"], info["sensor_chosen_by"]), (sensor, "scan"))
                self.assertTrue(info["sensor_choice"]["fits"])
                self.assertIn("recognised from the scan", info["sensor_choice"]["words"])
        copied = self.expect_json(0, "convert", "mid-70.csv", "-o", "mid-70.nc")
        self.assertEqual(copied["sensor_chosen_by"], "scan")
        info = self.expect_json(0, "info", "mid-70.nc")
        self.assertEqual((info["sensor"], info["sensor_chosen_by"]), ("Livox Mid-70", "file"))
        estimate = self.expect_json(0, "estimate", "avia.csv", "--shot-rate-hz", "240000")
        self.assertEqual((estimate["preset"], estimate["sensor_chosen_by"]), ("avia", "scan"))
        self.check_verdict(estimate, "consistent")
        asked = self.expect_json(0, "estimate", "mid-70.csv", "--sensor", "mid-70")
        self.assertEqual((asked["preset"], asked["sensor_chosen_by"]), ("mid-70", "option"))

    def test_a_file_that_names_another_sensor_than_its_scan_shows(self):
        self.expect(0, "simulate", "-o", "wide.csv", "--sensor", "mid-70", "--duration-s", "0.5")
        self.expect(0, "convert", "wide.csv", "-o", "wide.nc", "--sensor-type", "mid-40")
        done = run("info", "wide.nc", folder=self.folder)
        self.assertRegex(done.stderr, "Mid-40.*Mid-70")
        info = json.loads(run("info", "wide.nc", "--json", folder=self.folder).stdout)
        self.assertEqual(info["sensor_chosen_by"], "file")
        self.assertFalse(info["sensor_choice"]["fits"])

    def test_what_cannot_be_told_is_called_a_guess(self):
        rows = "\n".join(f"{i},{10 + i % 7},0.1,{0.01 * (i % 5)}" for i in range(30))
        (self.folder / "few.csv").write_text(f"index,x_m,y_m,z_m\n{rows}\n", encoding="ascii")
        info = self.expect_json(0, "info", "few.csv")
        self.assertEqual((info["sensor"], info["sensor_chosen_by"]), ("unknown", "guess"))
        self.assertIn("guess", run("info", "few.csv", folder=self.folder).stderr)


if __name__ == "__main__":
    unittest.main()
