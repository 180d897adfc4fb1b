#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Has a unit changed? Results on walls of different days, and what stands beside them."""
import os
import re
import unittest

from command import SOURCE, CommandTest, run

HALL = SOURCE / "data" / "hall.yaml"
DAYS = {"march": "0.02", "june": "0.02", "november": "0.06"}


class CompareTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for seed, (day, tilt) in enumerate(DAYS.items()):
            for words in (("simulate", "-o", f"{day}.nc", "--scene", HALL, "--reported", "nominal",
                           "--set", f"prism_tilt_b_vertical_deg={tilt}", "--duration-s", "3",
                           "--rate-hz", "50000", "--seed", str(seed)),
                          ("calibrate", f"{day}.nc", "-o", day, "--force")):
                done = run(*words, folder=cls.folder)
                assert done.returncode == 0, done.stderr
            # Every simulation is of a unit of its own.
            file = cls.folder / day / "calibration.yaml"
            file.write_text(re.sub(r"(?m)^serial: .*$", 'serial: "3GGDH5B00100011"', file.read_text()))

    def test_a_bend_between_two_days_is_seen(self):
        for number, day in enumerate(DAYS):
            os.utime(self.folder / day / "calibration.yaml", 2 * (1e9 + 1e7 * number,))
        result = self.expect_json(0, "compare", "march", "june", "november", "-o", "series.html")
        pairs = {(pair["a"], pair["b"]): pair for pair in result["pairs"]}
        self.assertEqual(list(pairs), [("march", "june"), ("june", "november"), ("march", "november")])
        self.assertFalse(pairs["march", "june"]["changed"])
        self.assertTrue(pairs["june", "november"]["changed"])
        self.assertTrue(pairs["march", "november"]["changed"])
        bent = pairs["march", "november"]
        self.assertLess(bent["p_value"], result["least_p_value"])
        self.assertAlmostEqual(result["least_p_value"], 0.01 / 3)
        self.assertEqual([one["path"] for one in result["inputs"]],
                         [f"{day}/calibration.yaml" for day in DAYS])
        page = (self.folder / "series.html").read_text()
        # What changed most comes first, over the dates, with its sigmas.
        self.assertEqual(re.search(r'"title":"([^"]+)"', page)[1], "prism_tilt_b_vertical_deg")
        self.assertIn('"dates":true', page)
        self.assertIn('"sigma":[', page)

    def test_text_says_which_pair_changed(self):
        text = self.expect(0, "compare", "march/calibration.yaml", "november").stdout
        self.assertRegex(text, r"march/calibration.yaml +november .* changed")
        self.assertNotRegex(self.expect(0, "compare", "march", "june").stdout, r"\d +changed\n")

    def test_what_has_no_sigma_is_not_tested(self):
        result = self.expect_json(0, "compare", "mid-40", "mid-40")
        self.assertIsNone(result["pairs"][0]["p_value"])
        self.assertFalse(result["pairs"][0]["changed"])

    def test_units_of_a_table(self):
        """Eight units of which one is bent, and one over time; a recording that is none."""
        fleet = self.folder / "fleet"
        fleet.mkdir()
        preset = self.expect(0, "preset", "show", "mid-40").stdout
        for number in range(8):
            unit = self.folder / f"unit-{number}.yaml"
            unit.write_text(preset.replace("\nmodel:", f'\nserial: "3GGDH5B0010001{number}"\nmodel:'))
            for day in ("may", "june") if number == 2 else ("may",):
                tilt = 0.3 if number == 5 else 0.1 if day == "june" else 0.02
                self.expect(0, "simulate", "-o", fleet / f"{number}-{day}.lvx", "--scene", HALL, "--sensor", unit,
                            "--reported", "nominal", "--set", f"prism_tilt_b_vertical_deg={tilt}", "--duration-s", "1",
                            "--seed", str(number + 100 * len(day)))
        (fleet / "9-cut.lvx").write_text("no recording")
        for table in ("fleet.csv", "fleet.nc"):
            self.expect(3, "calibrate", "fleet", "-o", "checked", "--force", "--no-report", "--states", "none",
                        "--walls", "flat",
                        "--resume", "--table", table, "--rate-hz", "20000")
        found = self.expect_json(0, "compare", "fleet.csv", "-o", "fleet.html")
        self.assertEqual([len(unit["results"]) for unit in found["units"]], [1, 1, 2, 1, 1, 1, 1, 1])
        self.assertEqual([unit["changed"] for unit in found["units"]],
                         [number == 2 for number in range(8)])
        self.assertEqual([(pair["a"], pair["b"]) for pair in found["pairs"]],
                         [("checked/2-june", "checked/2-may")])
        self.assertEqual([one["input"] for one in found["left_out"]], ["fleet/9-cut.lvx"])
        self.assertEqual([one["path"] for one in found["inputs"]],
                         ["fleet.csv"] + [f"{path}/calibration.yaml" for path in
                                          [result for unit in found["units"] for result in unit["results"]]])
        units = found["fleets"][0]["units"]
        self.assertEqual([unit["outlier"] for unit in units], [number == 5 for number in range(8)])
        self.assertEqual(units[5]["worst"], "prism_tilt_b_vertical_deg")
        self.assertTrue((self.folder / "fleet.html").exists())
        text = self.expect(0, "compare", "fleet.csv").stdout
        self.assertRegex(text, r"3GGDH5B00100015 .* outlier\n")
        other = self.expect_json(0, "compare", "fleet.nc")
        for key in ("pairs", "units", "fleets", "left_out"):
            self.assertEqual(other[key], found[key])
        (self.folder / "checked/0-may/calibration.yaml").write_text("model: {")
        self.assertEqual(self.expect_json(3, "compare", "fleet.csv")["left_out"][0]["failed"], True)
        self.expect(2, "compare", "fleet.csv", "-o", "checked/1-may/calibration.yaml")

    def test_what_is_wrong_is_named(self):
        self.assertIn("number of results = 1", self.expect(2, "compare", "march").stderr)
        self.assertIn("RESULT", self.expect(2, "compare").stderr)
        self.assertIn("the second 3 prisms", self.expect(2, "compare", "march", "horizon").stderr)
        self.assertIn("calibration.yaml", self.expect(3, "compare", "march", ".").stderr)
        self.assertIn("--false-alarm", self.expect(2, "compare", "march", "june", "--false-alarm",
                                                   "2").stderr)


if __name__ == "__main__":
    unittest.main()
