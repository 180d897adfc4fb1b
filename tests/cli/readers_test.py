#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Clouds read back by programs of others: NumPy, Open3D, rosbag and laspy, as far as they are there."""
import base64
import csv
import importlib.util
import json
import math
import os
import pathlib
import sqlite3
import struct
import subprocess
import sys
import unittest

SYSTEM_PYTHON = "/usr/bin/python3"  # Debian's packages are there, whatever runs first on the path
if importlib.util.find_spec("numpy") is None and sys.executable != SYSTEM_PYTHON:
    os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, *sys.argv])

from command import CommandTest, run  # noqa: E402

WALL = ("planes:\n  - {name: wall, distance_m: 10, normal_azimuth_deg: 10, normal_zenith_deg: 80}\n")


def module(name):
    """A module, or None with a loud word."""
    if importlib.util.find_spec(name) is None:
        print(f"SKIPPED: no Python module {name} to read clouds back with", file=sys.stderr)
        return None
    return importlib.import_module(name)


class ReadersTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "wall.yaml").write_text(WALL)
        cls.make("simulate", "-o", "wall.nc", "--sensor", "mid-40-table3", "--scene", "wall.yaml",
                 "--duration-s", 1, "--rate-hz", 5000)
        cls.cloud("cloud.csv")
        with (cls.folder / "cloud.csv").open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        cls.expected = {key.rsplit("_", 1)[0] if "_" in key else key: [float(r[key]) for r in rows]
                        for key in rows[0]}

    @classmethod
    def make(cls, *arguments):
        done = run(*arguments, folder=cls.folder)
        assert done.returncode == 0, done.stderr

    @classmethod
    def cloud(cls, name, *more):
        cls.make("cloud", "wall.nc", "--calibration", "mid-40-table3", "-o", name,
                 "--common-factors", "yes", *more)
        return str(cls.folder / name)

    def compare(self, name, values, scale=1.0, tolerance=1e-6):
        """A column against that of the CSV, relative where it is large."""
        expected = self.expected[name]
        self.assertEqual(len(values), len(expected), name)
        for value, wanted in zip(values, expected):
            if math.isnan(wanted):
                self.assertTrue(math.isnan(value), name)
                continue
            self.assertLessEqual(abs(value / scale - wanted), tolerance * max(1.0, abs(wanted)),
                                 name)

    def test_npy(self):
        numpy = module("numpy")
        if numpy is None:
            self.skipTest("numpy")
        cloud = numpy.load(self.cloud("cloud.npy"))
        self.assertEqual(set(cloud.dtype.names), set(self.expected))
        for name in cloud.dtype.names:
            self.compare(name, cloud[name].astype(float).tolist())

    def test_ply_and_pcd(self):
        open3d, numpy = module("open3d"), module("numpy")
        if open3d is None or numpy is None:
            self.skipTest("open3d")
        for ending, prefix, tolerance in (("ply", "scalar_", 1e-6), ("pcd", "", 1e-6)):
            cloud = open3d.t.io.read_point_cloud(self.cloud(f"cloud.{ending}"))
            positions = cloud.point["positions"].numpy()
            for column, name in enumerate("XYZ"):
                self.compare(name, positions[:, column].tolist(), tolerance=tolerance)
            for name in ("StdX", "CovarianceYZ", "LidarRange", "IncidenceAngle", "PrismAngle2"):
                self.compare(name, cloud.point[prefix + name].numpy()[:, 0].tolist())

    def test_bag(self):
        rosbag = module("rosbag")
        if rosbag is None:
            self.skipTest("rosbag")
        path = self.cloud("cloud.bag")
        columns, times = {}, []
        with rosbag.Bag(path) as bag:
            for _, message, _ in bag.read_messages():
                numpy = importlib.import_module("numpy")
                kinds = {2: "u1", 6: "<u4", 7: "<f4", 8: "<f8"}
                dtype = numpy.dtype({"names": [f.name for f in message.fields],
                                     "formats": [kinds[f.datatype] for f in message.fields],
                                     "offsets": [f.offset for f in message.fields],
                                     "itemsize": message.point_step})
                rows = numpy.frombuffer(message.data, dtype)
                for name in rows.dtype.names:
                    columns.setdefault(name.lower(), []).extend(rows[name].astype(float).tolist())
                times += (message.header.stamp.to_sec() + 1e-9 * rows["offset_time"]).tolist()
        columns["beam"] = columns.pop("line")
        columns["time"] = [1e-9 * value for value in columns.pop("timestamp")]
        for name in self.expected:
            self.compare(name, columns[name.lower()])
        self.compare("Time", times, tolerance=1e-6)
        info = subprocess.run(["rosbag", "info", path], capture_output=True, text=True, check=False)
        self.assertIn("sensor_msgs/PointCloud2", info.stdout)

    def points_of(self, message):
        """Time in ns, x, y, z, intensity, tag and line of the points of a message."""
        if "points" in message:
            self.assertEqual(message["point_num"], len(message["points"]))
            return [(int(message["timebase"]) + p["offset_time"], p["x"], p["y"], p["z"],
                     p["reflectivity"], p["tag"], p["line"]) for p in message["points"]]
        stamp = message["header"]["stamp"]
        begin = 10**9 * stamp["sec"] + stamp["nanosec"]
        fields = {one["name"]: (one["offset"], one["datatype"]) for one in message["fields"]}
        self.assertEqual(list(fields), ["x", "y", "z", "intensity", "tag", "line", "timestamp",
                                        "offset_time"])
        kinds = {2: "B", 6: "I", 7: "f", 8: "d"}
        layout = "<" + "".join(kinds[datatype] for _, datatype in fields.values())
        self.assertEqual(struct.calcsize(layout), message["point_step"])
        rows = list(struct.iter_unpack(layout, base64.b64decode(message["data"])))
        self.assertEqual(len(rows), message["width"])
        for row in rows:
            self.assertAlmostEqual(row[6], begin + row[7], delta=300)  # as doubles have it
        return [(begin + row[7], *row[:6]) for row in rows]

    def from_ros1(self, path):
        """The messages of a bag of ROS 1, as the reader of ROS 2's prints them."""
        rosbag = importlib.import_module("rosbag")

        def plain(value):
            if hasattr(value, "__slots__"):
                if value.__class__.__name__ == "Time":
                    return {"sec": value.secs, "nanosec": value.nsecs}
                return {name: plain(getattr(value, name)) for name in value.__slots__}
            return [plain(one) for one in value] if isinstance(value, list) else value
        with rosbag.Bag(path) as bag:
            for topic, message, time, header in bag.read_messages(return_connection_header=True):
                # The class comes from the definition in the bag, and its sum is that of the type.
                self.assertEqual(message._md5sum.encode(), header["md5sum"])
                fields = plain(message)
                if "data" in fields:
                    fields["data"] = base64.b64encode(fields["data"]).decode()
                yield {"topic": topic, "type": header["type"].decode(), "time": time.to_nsec(),
                       "message": fields}

    def from_node(self, path):
        script = pathlib.Path(__file__).parent / "bag_reader.mjs"
        done = subprocess.run([os.environ["RISLEY_NODE"], "--preserve-symlinks", script, path],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return map(json.loads, done.stdout.splitlines())

    def from_folder(self, path):
        """The messages of a folder of ROS 2, as far as possible without ROS."""
        yaml = module("yaml")
        about = yaml.safe_load((pathlib.Path(path) / "metadata.yaml").read_text())
        about = about["rosbag2_bagfile_information"]
        database = sqlite3.connect(pathlib.Path(path) / about["relative_file_paths"][0])
        self.assertEqual(database.execute("PRAGMA integrity_check").fetchall(), [("ok",)])
        rows = database.execute(
            "SELECT name, type, encoded_message_definition, timestamp, data FROM messages"
            " JOIN topics ON topics.id = topic_id JOIN message_definitions ON topic_type = type"
            " ORDER BY timestamp").fetchall()
        self.assertEqual(about["message_count"], len(rows))
        self.assertEqual(about["starting_time"]["nanoseconds_since_epoch"], rows[0][3])
        self.assertEqual(about["duration"]["nanoseconds"], rows[-1][3] - rows[0][3])
        lines = [json.dumps({"topic": topic, "type": kind, "definition": definition, "time": str(time),
                             "bytes": base64.b64encode(data).decode()})
                 for topic, kind, definition, time, data in rows]
        (self.folder / "messages.jsonl").write_text("\n".join(lines))
        return self.from_node(self.folder / "messages.jsonl")

    def test_bags_of_every_kind(self):
        if module("rosbag") is None or not os.environ.get("RISLEY_NODE"):
            self.skipTest("rosbag, node")
        types = {("bag", "points"): "sensor_msgs/PointCloud2",
                 ("bag", "custom"): "livox_ros_driver/CustomMsg",
                 ("bag", "custom2"): "livox_ros_driver2/CustomMsg",
                 ("ros2", "points"): "sensor_msgs/msg/PointCloud2",
                 ("ros2", "custom"): "livox_interfaces/msg/CustomMsg",
                 ("ros2", "custom2"): "livox_ros_driver2/msg/CustomMsg"}
        single = lambda value: struct.unpack("<f", struct.pack("<f", value))[0]  # noqa: E731
        self.cloud("cloud.csv")
        for ending, read in (("bag", self.from_ros1), ("mcap", self.from_node),
                             ("db3", self.from_folder)):
            for kind in ("points", "custom", "custom2"):
                with self.subTest(ending=ending, kind=kind):
                    path = str(self.folder / f"{kind}.{ending}")
                    self.make("cloud", "wall.nc", "--calibration", "mid-40-table3", "-o", path,
                              "--message", kind, "--frame-rate-hz", 20, "--topic", "/lidar",
                              "--frame-id", "lidar_frame")
                    messages = list(read(path))
                    self.assertEqual(len(messages), 20)
                    points = []
                    for one in messages:
                        header = one["message"]["header"]
                        self.assertEqual((one["topic"], one["type"], header["frame_id"]),
                                         ("/lidar", types["bag" if ending == "bag" else "ros2", kind],
                                          "lidar_frame"))
                        stamp = 10**9 * header["stamp"]["sec"] + header["stamp"]["nanosec"]
                        self.assertEqual(int(one["time"]), stamp)
                        points += self.points_of(one["message"])
                    self.assertEqual(len(points), len(self.expected["X"]))
                    for i, (time, *xyz, intensity, tag, line) in enumerate(points):
                        self.assertAlmostEqual(time, 1e9 * self.expected["Time"][i], delta=2)
                        for value, name in zip(xyz, "XYZ"):
                            self.assertAlmostEqual(value, single(self.expected[name][i]), delta=1e-5)
                        self.assertEqual((intensity, tag, line),
                                         tuple(int(self.expected[name][i])
                                               for name in ("Intensity", "Tag", "Beam")))

    def test_las_and_laz(self):
        laspy = module("laspy")
        if laspy is None:
            self.skipTest("laspy")
        names = ["cloud.las"]
        done = run("cloud", "--help")
        if ".laz" in done.stdout:
            names.append("cloud.laz")
        for name in names:
            with self.subTest(name=name):
                try:
                    cloud = laspy.read(self.cloud(name))
                except laspy.errors.LaspyException as error:
                    self.skipTest(f"laspy: {error}")
                for axis in "XYZ":
                    self.compare(axis, list(map(float, getattr(cloud, axis.lower()))),
                                 tolerance=6e-5)
                self.compare("Intensity", list(map(float, cloud.intensity)), scale=256)
                self.compare("Time", list(map(float, cloud.gps_time)))
                self.compare("ReturnNumber", list(map(float, cloud.return_number)))
                for field in cloud.point_format.extra_dimension_names:
                    self.compare(field, list(map(float, cloud[field])))


if __name__ == "__main__":
    unittest.main()
