#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The manufacturer's simulated scan sequence, whose parameters section 3.1 of the paper states."""
import os
import pathlib
import sys
import unittest

from command import CommandTest

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


if __name__ == "__main__":
    if not FOLDER:
        print("SKIPPED: RISLEY_VENDOR_DATA does not name the folder of livox-mid-40-sequence.csv")
        sys.exit(77)
    unittest.main()
