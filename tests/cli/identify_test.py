#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""risley identify: which prisms made a scan."""
import os
import pathlib
import unittest

from command import CommandTest

FOLDER = os.environ.get("RISLEY_VENDOR_DATA")
# Faces, and wedge in degrees, index and revolutions per minute of every prism in beam order.
SEQUENCES = {
    "mid-40-sequence": ("PA-AP", ((18, 1.5089, -7294), (18, 1.5089, 4664))),
    "avia-sequence-every-40th": ("AP-PA", ((18, 1.8144, -7893), (18, 1.8144, 2448))),
    "horizon-sequence-every-40th":
        ("AP-PA-AP", ((20, 1.6106, 7352), (20, 1.6106, -7352), (17.5, 1.5799, 619))),
}


def directions(path):
    """Rows of azimuth and zenith, degrees."""
    lines = path.read_text().splitlines()[1:]
    return [[float(number) for number in line.split(",")[1:3]] for line in lines]


class IdentifyTest(CommandTest):
    def test_a_pattern_is_identified_and_made_again(self):
        arguments = ("--format", "livox-csv", "--duration-s", "0.5")
        self.expect(0, "pattern", "--sensor", "tele-15", *arguments, "-o", "scan.csv")
        result = self.expect_json(0, "identify", "scan.csv", "-o", "mine.yaml")
        self.assertEqual(result["verdict"]["code"], "identified")
        self.assertEqual(result["preset"], "tele-15")
        self.assertFalse(result["mirrored"])
        self.assertEqual((result["emitters"], result["timing"]), (6, "in_turn"))
        best = result["hypotheses"][0]
        self.assertEqual((best["faces"], best["equivalent_to"]), ("PA-AP", []))
        self.assertLess(best["rms_deg"], 2e-8)
        self.assertAlmostEqual(best["parameters"]["refractive_index_b"]["value"], 1.5089, delta=1e-6)
        self.assertGreaterEqual(best["parameters"]["wedge_angle_a_deg"]["sigma"],
                                best["parameters"]["wedge_angle_a_deg"]["sigma_given_held"])
        self.expect(0, "pattern", "--sensor", "mine.yaml", *arguments, "-o", "again.csv")
        before, after = directions(self.folder / "scan.csv"), directions(self.folder / "again.csv")
        self.assertEqual(len(before), len(after))
        worst = max(abs(a - b) for one, other in zip(before, after) for a, b in zip(one, other))
        self.assertLess(worst, 1e-7)
        # Any verb takes it.
        self.expect(0, "preset", "check", "mine.yaml")
        self.expect(0, "simulate", "--sensor", "mine.yaml", "--duration-s", "0.1", "-o", "s.nc")

    def test_a_scan_all_around_is_of_a_wedge_and_a_reflector(self):
        self.expect(0, "simulate", "--sensor", "mid-360", "--duration-s", "1", "-o", "scan.nc")
        result = self.expect_json(0, "identify", "scan.nc", "-o", "mine.yaml")
        self.assertEqual((result["verdict"]["code"], result["preset"]), ("identified", "mid-360"))
        self.assertEqual((result["emitters"], result["emitters_named"]), (4, True))
        best = result["hypotheses"][0]
        self.assertEqual(best["faces"], "AA-PMU")
        self.assertEqual(set(best["frame"]), {"yaw_deg", "pitch_deg", "roll_deg"})
        for name, truth in (("entrance_face_a_deg", 10), ("exit_face_a_deg", 29), ("mirror_face_b_deg", 50),
                            ("refractive_index_a", 1.9682)):
            value = best["parameters"][name]
            self.assertLess(abs(value["value"] - truth), 4.5 * value["sigma"], name)
        self.expect(0, "preset", "check", "mine.yaml")

    def test_what_does_not_turn_is_no_answer(self):
        rows = "\n".join(f"{0.0001 * i:.4f},10,90" for i in range(1, 3000))
        (self.folder / "still.csv").write_text(f"Time,Azimuth,Zenith\n{rows}\n")
        done = self.expect(1, "identify", "still.csv", "-o", "still.yaml")
        self.assertIn("turning line", done.stderr)
        self.assertFalse((self.folder / "still.yaml").exists())

    @unittest.skipUnless(FOLDER, "SKIPPED: RISLEY_VENDOR_DATA names no folder with the manufacturer's files")
    def test_the_makers_sequences(self):
        for name, (faces, prisms) in SEQUENCES.items():
            with self.subTest(name):
                recording = pathlib.Path(FOLDER) / f"livox-{name}.csv"
                result = self.expect_json(0, "identify", recording)
                self.assertEqual(result["preset"], name.replace("-every-40th", ""))
                best = result["hypotheses"][0]
                self.assertEqual(best["faces"], faces)
                six_beams = len(prisms) == 3 or "avia" in name
                self.assertLess(best["rms_deg"], 2e-8 if six_beams else 6e-6)
                for letter, (wedge_deg, index, rpm) in zip("abc", prisms):
                    value = {key: best["parameters"][f"{key}_{letter}{unit}"]["value"]
                             for key, unit in (("wedge_angle", "_deg"), ("refractive_index", ""),
                                               ("angular_velocity", "_deg_per_s"))}
                    self.assertAlmostEqual(value["wedge_angle"], wedge_deg, delta=1e-4)
                    self.assertAlmostEqual(value["refractive_index"], index, delta=1e-6)
                    self.assertAlmostEqual(value["angular_velocity"] / 6, rpm, delta=1e-4)
                if six_beams:  # every 40th shot is of the second, fourth or sixth
                    self.assertEqual(result["timing"], "together")
                    found = sorted(best["parameters"][f"incident_beam_{i}_vertical_deg"]["value"]
                                   for i in (1, 2, 3))
                    for value, expected in zip(found, (-1.346203, 0.448808, 2.242938)):
                        self.assertAlmostEqual(value, expected, delta=1e-6)
                else:
                    self.assertEqual(best["equivalent_to"], ["AP-AP"])


if __name__ == "__main__":
    unittest.main()
