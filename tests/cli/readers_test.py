#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Clouds read back by programs of others: NumPy, Open3D, rosbag and laspy, as far as they are there."""
import csv
import importlib.util
import math
import os
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
        for name in self.expected:
            self.compare(name, columns[name.lower()])
        self.compare("Time", times, tolerance=1e-6)
        info = subprocess.run(["rosbag", "info", path], capture_output=True, text=True, check=False)
        self.assertIn("sensor_msgs/PointCloud2", info.stdout)

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
