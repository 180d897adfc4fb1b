#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""MCAP, folders of ROS 2, and clouds in bags whose points keep their times."""
import hashlib
import struct
import unittest

from command import SOURCE, CommandTest

MAGIC = b"\x89MCAP0\r\n"
HALL = SOURCE / "data" / "hall.yaml"


def text(words):
    return struct.pack("<I", len(words)) + words.encode()


def record(kind, content):
    return struct.pack("<BQ", kind, len(content)) + content


def custom(first_ns, count):
    """A CustomMsg of a Livox driver in CDR: shots each 10 us."""
    body = struct.pack("<iII", 0, 0, 2) + b"l\0"
    body += b"\0" * (-len(body) % 8) + struct.pack("<QIIi", first_ns, count, 0, count)
    for i in range(count):
        body += b"\0" * (-len(body) % 4) + struct.pack("<I3f3B", 10000 * i, 5, 1, 0.001 * i, 9, 16, 0)
    return b"\0\1\0\0" + body


def mcap(messages):
    """A file of single messages, without a summary. @return its bytes, and where messages begin"""
    data = MAGIC + record(1, text("ros2") + text("a test"))
    data += record(3, struct.pack("<H", 1) + text("livox_ros_driver2/msg/CustomMsg") +
                   text("ros2msg") + text(""))
    data += record(4, struct.pack("<HH", 7, 1) + text("/livox/lidar") + text("cdr") + text(""))
    places = []
    for i, message in enumerate(messages):
        places.append(len(data))
        data += record(5, struct.pack("<HIQQ", 7, i, i, i) + message)
    return data + record(15, bytes(4)) + record(2, bytes(20)) + MAGIC, places


def messages(first, count):
    return [custom(10**9 + 1_000_000 * (first + i), 100) for i in range(count)]


class BagsTest(CommandTest):
    def test_mcap(self):
        data, places = mcap(messages(0, 20))
        (self.folder / "whole.mcap").write_bytes(data)
        info = self.expect_json(0, "info", "whole.mcap")
        self.assertEqual((info["format"], info["observations"], info["warnings"]), ("mcap", 2000, []))
        self.assertAlmostEqual(info["rate_hz"], 1e5, delta=1)
        self.expect(0, "convert", "whole.mcap", "-o", "whole.nc")
        self.assertEqual(self.expect_json(0, "info", "whole.nc")["observations"], 2000)
        for name in ("again.mcap", "again.db3", "again.bag"):
            for _ in range(2):  # and once more over what is there
                self.expect(0, "convert", "whole.nc", "-o", name)
            info = self.expect_json(0, "info", name)
            self.assertEqual((info["observations"], info["no_return"], info["warnings"]),
                             (2000, 0, []))
        self.assertIn("allowed 0.25 to 1000", self.expect(
            2, "convert", "whole.nc", "-o", "slow.mcap", "--frame-rate-hz", "0.1").stderr)

        (self.folder / "cut.mcap").write_bytes(data[:places[7] + 50])
        done = self.expect(0, "convert", "cut.mcap", "-o", "cut.nc")
        self.assertIn("700 observations", done.stdout)
        self.assertIn("the file was not closed or is cut off", done.stderr)
        self.assertIn(f"(at byte {places[7]})", done.stderr)

        broken = bytearray(data)
        broken[places[12] + 1:places[12] + 9] = b"\xff" * 8
        (self.folder / "broken.mcap").write_bytes(broken)
        done = self.expect(3, "convert", "broken.mcap", "-o", "broken.nc")
        self.assertIn(f"byte {places[12]}: expected a record that ends by byte", done.stderr)
        self.assertIn("the 1200 observations before it are saved", done.stderr)

    def test_a_folder_of_ros_2(self):
        bag = self.folder / "drive"
        bag.mkdir()
        for part in range(3):
            (bag / f"drive_{part}.mcap").write_bytes(mcap(messages(5 * part, 5))[0])
        self.assertIn("drive_0.mcap, drive_1.mcap, drive_2.mcap) without metadata.yaml",
                      self.expect(3, "info", "drive").stderr)
        listed = "rosbag2_bagfile_information:\n  version: 8\n  relative_file_paths:\n" + "".join(
            f"    - drive_{part}.mcap\n" for part in range(3))
        (bag / "metadata.yaml").write_text(listed)
        info = self.expect_json(0, "info", "drive/")
        self.assertEqual((info["format"], info["observations"], info["gaps"]), ("mcap", 1500, 0))
        files = ["metadata.yaml", "drive_0.mcap", "drive_1.mcap", "drive_2.mcap"]
        self.assertEqual(
            [(one["path"].split("/")[-1], one["sha256"]) for one in info["inputs"]],
            [(name, hashlib.sha256((bag / name).read_bytes()).hexdigest()) for name in files])
        self.expect(0, "convert", "drive/", "-o", "out/", "--format", "netcdf")
        self.assertEqual([one.name for one in (self.folder / "out").iterdir()], ["drive.nc"])
        before = (bag / "drive_1.mcap").read_bytes()
        self.assertIn("would replace", self.expect(2, "convert", "drive", "--format", "netcdf", "-o",
                                                   "drive/drive_1.mcap").stderr)
        self.assertEqual((bag / "drive_1.mcap").read_bytes(), before)
        (bag / "drive_1.mcap").unlink()
        self.assertIn("not in the folder: drive_1.mcap", self.expect(3, "info", "drive").stderr)

    def test_a_topic_is_rectified_in_its_bag(self):
        self.expect(0, "simulate", "-o", "scan.mcap", "--sensor", "mid-40-table3", "--scene", HALL,
                    "--reported", "nominal", "--duration-s", "1", "--seed", "5")
        truth = ("--calibration", "scan.mcap.truth.yaml")
        made = self.expect_json(0, "cloud", "scan.mcap", *truth, "-o", "true.mcap", "--replace")
        self.assertEqual(made["format"], "mcap")
        self.expect(0, "cloud", "scan.mcap", *truth, "-o", "points.mcap", "--message", "custom",
                    "--topic", "/livox/lidar")
        before, after, points = (self.expect_json(0, "info", name)
                                 for name in ("scan.mcap", "true.mcap", "points.mcap"))
        self.assertEqual(after["observations"], before["observations"])
        self.assertEqual(after["observations"] - after["no_return"], points["observations"])
        self.assertEqual(points["observations"], made["points"])
        for output, more in (("a.las", ()), ("a.mcap", ("--extrinsics", "1,0,0"))):
            self.expect(2, "cloud", "scan.mcap", *truth, "-o", output, "--replace", *more)

    def test_a_cloud_in_a_bag_keeps_the_times_of_its_points(self):
        self.expect(0, "simulate", "-o", "scan.nc", "--sensor", "mid-40-table3", "--scene", HALL,
                    "--duration-s", "2", "--rate-hz", "19997", "--seed", "5")
        self.expect(0, "estimate", "scan.nc", "-o", "estimate")
        self.expect(0, "cloud", "scan.nc", "--calibration", "estimate", "-o", "cloud.bag")
        for name in ("scan.nc", "cloud.bag"):
            self.expect(0, "convert", name, "-o", name + ".sequence.csv")

        def times(name):
            lines = (self.folder / (name + ".sequence.csv")).read_text().splitlines()
            return [line.split(",")[0] for line in lines if line[:1].isdigit()]
        scanned, kept = times("scan.nc"), times("cloud.bag")
        self.assertEqual(len(scanned), 39994)
        self.assertGreater(len(kept), 39900)  # a hall answers nearly everywhere
        self.assertLessEqual(set(kept), set(scanned))
        self.assertEqual(self.expect_json(0, "info", "cloud.bag")["warnings"], [])


if __name__ == "__main__":
    unittest.main()
