#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Has a unit changed? Results on walls of different days, and what stands beside them."""
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

    def test_a_bend_between_two_days_is_seen(self):
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
        self.assertIn("2 of 3 pairs differ by more than chance explains", page)

    def test_text_says_which_pair_changed(self):
        text = self.expect(0, "compare", "march/calibration.yaml", "november").stdout
        self.assertRegex(text, r"march/calibration.yaml +november .* changed")
        self.assertNotRegex(self.expect(0, "compare", "march", "june").stdout, r"\d +changed\n")

    def test_what_has_no_sigma_is_not_tested(self):
        result = self.expect_json(0, "compare", "mid-40", "mid-40")
        self.assertIsNone(result["pairs"][0]["p_value"])
        self.assertFalse(result["pairs"][0]["changed"])

    def test_what_is_wrong_is_named(self):
        self.assertIn("RESULT", self.expect(2, "compare", "march").stderr)
        self.assertIn("the second 3 prisms", self.expect(2, "compare", "march", "horizon").stderr)
        self.assertIn("calibration.yaml", self.expect(3, "compare", "march", ".").stderr)
        self.assertIn("--false-alarm", self.expect(2, "compare", "march", "june", "--false-alarm",
                                                   "2").stderr)


if __name__ == "__main__":
    unittest.main()
