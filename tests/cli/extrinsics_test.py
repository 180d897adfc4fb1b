#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Recordings in the frame of a hub or a vehicle, with the pose given or stored in the file."""
import math
import struct
import unittest

from command import SOURCE, CommandTest, codes_of, run

POSE = (30.0, -20.0, 10.0)  # yaw, pitch, roll, deg
TRANSLATION = (0.5, -1.0, 0.25)  # m
DEVICE = 29  # first byte of the first device in an LVX 1.1 file


def moved(point, translation=TRANSLATION):
    """p_recorded of a p_sensor."""
    x, y, z = point
    yaw, pitch, roll = map(math.radians, POSE)
    y, z = math.cos(roll) * y - math.sin(roll) * z, math.sin(roll) * y + math.cos(roll) * z
    z, x = math.cos(pitch) * z - math.sin(pitch) * x, math.sin(pitch) * z + math.cos(pitch) * x
    x, y = math.cos(yaw) * x - math.sin(yaw) * y, math.sin(yaw) * x + math.cos(yaw) * y
    return tuple(a + b for a, b in zip((x, y, z), translation))


class ExtrinsicsTest(CommandTest):
    """What scripts see of them."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()

        def made(*arguments):
            done = run(*arguments, folder=cls.folder)
            assert done.returncode == 0, done.stderr

        made("simulate", "-o", "own.openpylivox.csv", "--scene", SOURCE / "data" / "hall.yaml",
             "--duration-s", 0.5)
        cls.points = []  # time, s, and x, y, z, m
        rows = (cls.folder / "own.openpylivox.csv").read_text().splitlines()
        assert rows[0].startswith("//Distance,Zenith,Azimuth,Inten-sity,Time"), rows[0]
        for row in rows[1:]:
            distance, zenith, azimuth, _, time = map(float, row.split(",")[:5])
            zenith, azimuth = math.radians(zenith), math.radians(azimuth)
            cls.points.append((time, distance * math.sin(zenith) * math.cos(azimuth),
                               distance * math.sin(zenith) * math.sin(azimuth),
                               distance * math.cos(zenith)))
        for name, change in (("sensor", lambda p: p), ("hub", moved),
                             ("turned", lambda p: moved(p, (0, 0, 0)))):
            with open(cls.folder / f"{name}.csv", "w", encoding="ascii") as file:
                file.write("time_s,x_m,y_m,z_m\n")
                for time, *point in cls.points:
                    x, y, z = change(point)
                    file.write(f"{time:.9f},{x:.5f},{y:.5f},{z:.5f}\n")
        for name in ("sensor", "hub"):
            made("convert", f"{name}.csv", "-o", f"{name}.lvx", "--sensor-type", "mid-40")
            cls.store(f"{name}.lvx", POSE, TRANSLATION)

    @classmethod
    def store(cls, name, pose, translation, hub=b""):
        """States a pose in the header of an LVX file, whose points stay as they are."""
        content = bytearray((cls.folder / name).read_bytes())
        content[DEVICE + 16:DEVICE + 16 + len(hub)] = hub
        content[DEVICE + 34] = 1
        struct.pack_into("<6f", content, DEVICE + 35, *reversed(pose), *translation)
        (cls.folder / name).write_bytes(content)

    def assert_same_parameters(self, one, other):
        self.assertTrue(one["converged"] and other["converged"])
        self.assertIs(one["frame"]["estimated"], False)
        for name, value in one["parameters"].items():
            again = other["parameters"][name]
            self.assertAlmostEqual(value["value"], again["value"],
                                   delta=6 * math.hypot(value["sigma_given_held"], again["sigma_given_held"]), msg=name)

    def test_info_lists_the_stored_pose(self):
        device = self.expect_json(0, "info", "hub.lvx")["devices"][0]
        for found, expected in zip(device["extrinsics_deg"] + device["translation_m"],
                                   POSE + TRANSLATION):
            self.assertAlmostEqual(found, expected, places=5)
        self.assertIn("yaw 30 pitch -20 roll 10 deg", self.expect(0, "info", "hub.lvx").stdout)
        device = self.expect_json(0, "info", "sensor.csv")["devices"][0]
        self.assertIsNone(device["extrinsics_deg"])
        self.assertIsNone(device["translation_m"])

    def test_info_and_convert_turn_back(self):
        own = self.expect_json(0, "info", "sensor.csv")
        option = ("--extrinsics", "30,-20,10")
        turned = self.expect_json(0, "info", "turned.csv", *option)
        for key in ("azimuth_deg", "zenith_deg"):
            for end in ("min", "max"):
                self.assertAlmostEqual(own[key][end], turned[key][end], delta=1e-3)
        self.expect(0, "convert", "turned.csv", "-o", "back.nc", *option)
        back = self.expect_json(0, "info", "back.nc")
        self.assertAlmostEqual(back["azimuth_deg"]["max"], own["azimuth_deg"]["max"], delta=1e-3)
        self.expect(0, "convert", "hub.lvx", "-o", "back.lvx", *option)
        self.assertIsNone(self.expect_json(0, "info", "back.lvx")["devices"][0]["extrinsics_deg"])
        # A pose of zeros changes no byte.
        self.expect(0, "convert", "hub.lvx", "-o", "same.lvx", "--extrinsics", "0,0,0")
        self.assertEqual((self.folder / "same.lvx").read_bytes(),
                         (self.folder / "hub.lvx").read_bytes())

    def test_options_that_make_no_sense(self):
        for value in ("90", "1,2", "1,2,3,4", "a,b,c", "1,,3", "nan,0,0", "0,361,0", "1,2,3 deg"):
            done = self.expect(2, "info", "sensor.csv", "--extrinsics", value)
            self.assertIn("--extrinsics", done.stderr)
        self.expect(0, "info", "sensor.csv", "--extrinsics", "-90,0,0")

    def test_missing_returns_are_no_turn_of_the_frame(self):
        """Emitters of a sensor that looks all around are found by means, which sky moves."""
        (self.folder / "side.yaml").write_text("""planes:
  - {name: ahead, distance_m: 12, normal_azimuth_deg: 10, normal_zenith_deg: 85}
  - {name: left, distance_m: 3, normal_azimuth_deg: 90, normal_zenith_deg: 90}
  - {name: floor, distance_m: 1.4, normal_azimuth_deg: 0, normal_zenith_deg: 180}
""")
        self.expect(0, "simulate", "-o", "side.nc", "--sensor", "mid-360", "--duration-s", "0.1",
                    "--scene", "side.yaml", "--seed", "2")
        kept = self.expect_json(0, "estimate", "side.nc", "--truth", "side.nc.truth.yaml")
        self.assertNotIn("turned_back", codes_of(kept))
        turned = self.expect_json(0, "estimate", "side.nc", "--extrinsics", "90,0,0")
        self.assertTrue(turned["converged"])

    def test_estimate_decides_on_a_stored_pose(self):
        own = self.expect_json(0, "estimate", "sensor.csv", "--sensor", "mid-40")
        kept = self.expect_json(0, "estimate", "sensor.lvx")
        self.assert_same_parameters(kept, own)
        self.assertFalse({"turned_back", "pose_undecided"} & set(codes_of(kept)))
        back = self.expect_json(0, "estimate", "hub.lvx")
        self.assert_same_parameters(back, own)
        self.assertIn("turned_back", codes_of(back))
        told = self.expect_json(0, "estimate", "turned.csv", "--sensor", "mid-40",
                                "--extrinsics", "30,-20,10")
        self.assert_same_parameters(told, own)

    def test_where_shots_do_not_tell_hubs_count_as_moving(self):
        for hub, words in ((b"", "left unchanged"), (b"13UUG1R00400170", "turned back")):
            (self.folder / "roll.lvx").write_bytes((self.folder / "sensor.lvx").read_bytes())
            self.store("roll.lvx", (0, 0, 90), (0, 0, 0), hub)
            warnings = self.expect(0, "observability", "roll.lvx", "--rate-hz", 20000).stderr
            self.assertIn(words, warnings)
            self.assertIn("--extrinsics", warnings)

    def test_cloud_does_not_mix_frames(self):
        cloud = ("--calibration", "mid-40", "--directions", "reported", "-o")
        refused = self.expect(1, "cloud", "turned.csv", *cloud, "no.csv")
        self.assertIn("--extrinsics YAW,PITCH,ROLL", refused.stderr)
        self.assertIn("deg in yaw", refused.stderr)
        self.assertNotIn("no.csv", self.names())
        clouds = []
        for name in ("sensor.lvx", "hub.lvx"):
            made = self.expect_json(0, "cloud", name, *cloud, f"{name}.csv")
            self.assertIs("turned_back" in codes_of(made), name == "hub.lvx")
            lines = (self.folder / f"{name}.csv").read_text().splitlines()
            clouds.append([tuple(map(float, line.split(",")[:3])) for line in lines[1:2000]])
        distances = sorted(math.dist(a, b) for a, b in zip(*clouds))
        self.assertLess(distances[len(distances) // 2], 0.003)  # both are rounded to millimetres


if __name__ == "__main__":
    unittest.main()
