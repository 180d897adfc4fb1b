#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Trajectories of moving platforms: info and convert."""
import math
import os
import pathlib
import struct
import unittest

from command import CommandTest

VENDOR = os.environ.get("RISLEY_VENDOR_DATA", "")


def sbet(records, wander=0.02, week=400825):
    """Bytes of a flight that turns slowly, velocities north-west-up turned by the wander."""
    data = b""
    for i in range(records):
        t = 0.005 * i
        north, east = 12 * math.cos(0.3 * t), 12 * math.sin(0.3 * t)
        latitude = 0.8 + 12 / 0.3 * math.sin(0.3 * t) / 6.3690e6
        longitude = 0.1 + 12 / 0.3 * (1 - math.cos(0.3 * t)) / (6.3891e6 * math.cos(0.8))
        x = math.cos(wander) * north - math.sin(wander) * east
        west = -(math.sin(wander) * north + math.cos(wander) * east)
        data += struct.pack("<17d", week + t, latitude, longitude, 480 + 0.5 * math.sin(t), x,
                            west, 0.5 * math.cos(t),
                            0.05 * math.sin(2 * t), 0.04, 0.5 * t + wander, wander, *[0] * 6)
    return data


def smrmsg(seconds, week=400820):
    """Bytes of accuracies at 1 Hz."""
    return b"".join(struct.pack("<10d", week + i, 0.02, 0.02, 0.03, 0.01, 0.01, 0.01, 0.25, 0.25, 1.0)
                    for i in range(seconds))


class TrajectoryTest(CommandTest):
    """What scripts see of them."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "flight.sbet").write_bytes(sbet(1000))
        (cls.folder / "noname.bin").write_bytes(sbet(1000))
        (cls.folder / "flight.smrmsg").write_bytes(smrmsg(20))

    def test_info_audits_by_content(self):
        for name in ("flight.sbet", "noname.bin"):
            info = self.expect_json(0, "info", name)
            self.assertEqual(info["format"], "sbet")
            self.assertEqual(info["records"], 1000)
            self.assertAlmostEqual(info["rate_hz"], 200, delta=0.01)
            self.assertAlmostEqual(info["duration_s"], 4.995, delta=1e-6)
            self.assertEqual(info["velocity_frame"], "north-west-up, turned by the wander angle",
                             info["velocity_frame_reason"])
            self.assertAlmostEqual(info["wander_deg"], math.degrees(0.02), delta=1e-9)
            self.assertIsNone(info["accuracy"])
            self.assertEqual(info["gaps"], 0)
        text = self.expect(0, "info", "flight.sbet").stdout
        self.assertIn("gps-second-of-week", text)
        self.assertIn("wander angle", text)

    def test_accuracies_come_from_an_smrmsg(self):
        info = self.expect_json(0, "info", "flight.sbet", "--accuracy", "flight.smrmsg")
        self.assertAlmostEqual(info["accuracy"]["heading_deg"], 1 / 60, delta=1e-12)
        self.assertAlmostEqual(info["accuracy"]["down_m"], 0.03, delta=1e-12)
        alone = self.expect_json(0, "info", "flight.smrmsg")
        self.assertEqual(alone["format"], "smrmsg")
        self.assertEqual(alone["records"], 20)
        self.assertAlmostEqual(alone["accuracy"]["heading_deg"], 1 / 60, delta=1e-12)
        text = self.expect(0, "info", "flight.smrmsg").stdout
        self.assertIn("0.017 degree (1.0 arc-minute)", text)
        (self.folder / "other.smrmsg").write_bytes(smrmsg(20, 300000))
        self.assertIn("other.smrmsg",
                      self.expect(3, "info", "flight.sbet", "--accuracy", "other.smrmsg").stderr)

    def test_convert_there_and_back(self):
        done = self.expect_json(0, "convert", "flight.sbet", "-o", "flight.csv", "--accuracy",
                                "flight.smrmsg")
        self.assertEqual(done["records"], 1000)
        csv = self.expect_json(0, "info", "flight.csv")
        self.assertEqual(csv["format"], "trajectory-csv")
        self.assertEqual(csv["velocity_frame"], "north-east-down")
        self.assertAlmostEqual(csv["accuracy"]["heading_deg"], 1 / 60, delta=1e-12)
        self.expect(0, "convert", "flight.csv", "-o", "again.sbet")
        again = self.expect_json(0, "info", "again.sbet")
        self.assertEqual(again["velocity_frame"], "north-east-down")
        self.assertEqual(again["wander_deg"], 0)
        self.assertEqual(again["first_time_ns"], csv["first_time_ns"])

    def test_mistakes_end_with_their_status(self):
        (self.folder / "cut.sbet").write_bytes(sbet(2)[:271])
        done = self.expect(3, "info", "cut.sbet")
        self.assertIn("cut.sbet", done.stderr)
        self.assertIn("271 bytes", done.stderr)
        self.assertIn("unknown ending", self.expect(2, "convert", "flight.sbet", "-o", "a.lvx").stderr)
        self.assertNotIn("a.lvx", self.names())
        self.expect(2, "info", "flight.sbet", "--shot-rate-hz", 1000)
        self.expect(2, "convert", "flight.sbet", "-o", "b.csv", "--sensor-type", "avia")
        (self.folder / "fix.pos").write_text(
            "% program   : RTKPOST ver.2.4.2\n"
            "2022/02/07 00:00:00.000 40.06 -105.22 1565.0 1 12\n")
        self.assertIn("neither roll nor pitch", self.expect(3, "info", "fix.pos").stderr)

    def test_recordings_stay_recordings(self):
        self.expect(0, "simulate", "-o", "unit.csv", "--duration-s", 0.1)
        info = self.expect_json(0, "info", "unit.csv")
        self.assertEqual(info["format"], "scan-sequence-csv")
        self.assertIn("--accuracy", self.expect(2, "info", "unit.csv", "--accuracy",
                                                "flight.smrmsg").stderr)

    @unittest.skipUnless(VENDOR, "RISLEY_VENDOR_DATA does not name the folder of real files")
    def test_real_files(self):
        folder = pathlib.Path(VENDOR) / "trajectory"
        info = self.expect_json(0, "info", folder / "leeward-sbet.out")
        self.assertEqual(info["velocity_frame"], "north-west-up, turned by the wander angle")
        self.assertAlmostEqual(info["wander_deg"], 1.02, delta=0.005)
        self.assertIn("badfile.sbet", self.expect(3, "info", folder / "badfile.sbet").stderr)
        info = self.expect_json(0, "info", folder / "first-3000.smrmsg")
        self.assertAlmostEqual(60 * info["accuracy"]["heading_deg"], 1.859, delta=0.001)


if __name__ == "__main__":
    if not VENDOR:
        print("SKIPPED: real files, RISLEY_VENDOR_DATA does not name their folder")
    unittest.main()
