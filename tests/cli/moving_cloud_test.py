#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Clouds of a moving sensor, and what users give them by mistake."""
import csv
import math
import sqlite3
import struct
import unittest

import las_file
from command import SOURCE, CommandTest, codes_of

DATA = SOURCE / "data"
FLIGHT = """risley_flight: 1
origin: {latitude_deg: 50, longitude_deg: 8.5, ellipsoidal_height_m: 250}
start: {scale: gps-second-of-week, time_s: 208800, gps_week: 2400}
rate_hz: 200
height_m: 80
speed_m_per_s: 5
turn_duration_s: 10
motion:
  seed: 4
  attitude: {lowest_hz: 0.15, highest_hz: 1.2, sinusoids: 6, roll_deg: 2, pitch_deg: 2, heading_deg: 2}
strips: [{headings_deg: [0, 180], length_m: 20}]
"""
GROUND = """risley_scene: 1
origin: {latitude_deg: 50, longitude_deg: 8.5, ellipsoidal_height_m: 250}
terrain: {kind: flat, height_m: 0}
"""
BEGIN, WEEK_S = 208800.0, 604800


class MovingCloudTest(CommandTest):
    """One short flight to the north over flat ground, 2 s of it recorded."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "flight.yaml").write_text(FLIGHT)
        done = cls().expect_json(
            0, "simulate", "-o", "a.lvx", "--flight", "flight.yaml", "--mount",
            DATA / "mount-nadir.yaml", "--scene", DATA / "village.yaml", "--rate-hz", 2000, "--start-s", 3,
            "--duration-s", 2, "--noise-range-m", 0)
        cls.trajectory = done["trajectory"]
        with open(cls.folder / cls.trajectory, encoding="utf-8", newline="") as file:
            cls.rows = list(csv.reader(file))

    def runTest(self):  # for setUpClass
        pass

    def write(self, name, change=None, keep=None):
        """The trajectory again, with changed fields or fewer rows."""
        names = self.rows[0]
        with open(self.folder / name, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(names)
            for fields in self.rows[1:]:
                row = dict(zip(names, fields))
                if keep and not keep(1e-9 * int(row["gps_second_of_week_ns"]) - BEGIN):
                    continue
                if change:
                    change(row)
                writer.writerow([row[one] for one in names])
        return name

    def cloud(self, status, *arguments, trajectory=None, mount="a.lvx.mount.truth.yaml",
              output="a.csv", crs="EPSG:32632"):
        given = ["cloud", "a.lvx", "-o", output, "--trajectory", trajectory or self.trajectory]
        given += ["--calibration", "a.lvx.truth.yaml", "--directions", "reported"]
        given += ["--mount", mount] if mount else []
        given += ["--crs", crs] if crs else []
        return self.expect_json(status, *given, *arguments) if status == 0 else \
            self.expect(status, *given, *arguments)

    def points(self, name):
        with open(self.folder / name, encoding="utf-8") as file:
            rows = csv.DictReader(file)
            return [[float(row[axis]) for axis in ("X_m", "Y_m", "Z_m")] for row in rows]

    def shifted(self, seconds):
        def change(row):
            row["gps_second_of_week_ns"] = str(int(row["gps_second_of_week_ns"]) + seconds * 10**9)
        return change

    def test_points_are_on_the_map(self):
        done = self.cloud(0)
        self.assertEqual(done["without_pose"], 0)
        self.assertGreater(done["points"], 3500)
        self.assertNotIn("map_assumed", codes_of(done))
        points = self.points("a.csv")
        self.assertLess(max(abs(p[0] - 464163) for p in points), 200)
        self.assertLess(max(abs(p[1] - 5538631) for p in points), 200)
        self.assertLess(max(abs(p[2] - 254) for p in points), 8)

    def test_results_of_a_flight_are_found_together(self):
        folder = self.folder / "flight"
        folder.mkdir()
        for name, file in (("calibration.yaml", "a.lvx.truth.yaml"), ("mount.yaml", "a.lvx.mount.truth.yaml"),
                           ("trajectory.csv", self.trajectory)):
            (folder / name).write_bytes((self.folder / file).read_bytes())
        self.cloud(0)
        self.expect_json(0, "cloud", "a.lvx", "-o", "found.csv", "--calibration", "flight", "--directions",
                         "reported", "--crs", "EPSG:32632")
        self.assertEqual(self.points("a.csv"), self.points("found.csv"))

    def test_latitudes_and_longitudes_are_answered_with_the_zone(self):
        self.assertIn("EPSG:25832", self.cloud(2, crs="EPSG:4258").stderr)

    def test_covariances_follow_from_the_table_by_its_recipe(self):
        done = self.cloud(0, "--trajectory-errors", DATA / "trajectory-errors.yaml",
                          "--common-factors", "yes", mount=DATA / "mount-as-built.yaml",
                          output="a.las")
        self.assertIn("boresight_x_deg", done["common_factors"])
        points, facts, rows = las_file.read(self.folder / "a.las")
        self.assertGreater(len(points), 30)
        self.assertGreaterEqual(len(rows), 2)
        number = {key: [float(v) for v in values] for key, values in facts.items()
                  if key in ("correlation_time_s", "white_m_and_rad", "sample_interval_s",
                             "first_sample_ns", "north", "east", "down")}
        factors = len([field for field in points[0]
                       if field.startswith("Loading") and field.endswith("X")])
        self.assertEqual(factors, len(done["common_factors"]))

        def cross(a, b):
            return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

        def lever(point):
            """Columns of L, sigmas and the sample."""
            time = point["time_ns"]
            k = max(i for i in range(len(rows) - 1) if i == 0 or rows[i][0] <= time)
            part = (time - rows[k][0]) / (rows[k + 1][0] - rows[k][0])
            row = [a + part * (b - a) for a, b in zip(rows[k][1:], rows[k + 1][1:])]
            arm = [x - r for x, r in zip(point["at"], row[:3])]
            north, east, down = number["north"], number["east"], number["down"]
            columns = [north, east, [-d for d in down]] + [cross(axis, arm)
                                                           for axis in (north, east, down)]
            sample = (time - number["first_sample_ns"][0]) * 1e-9 // number["sample_interval_s"][0]
            return columns, row[3:], sample

        def covariance(i, j, p, q):
            (left, s, own), (right, t, other) = lever(points[i]), lever(points[j])
            apart = 1e-9 * abs(points[i]["time_ns"] - points[j]["time_ns"])
            total = 0
            for k in range(6):
                shared = s[k] * t[k] * math.exp(-apart / number["correlation_time_s"][k])
                if own == other:
                    shared += number["white_m_and_rad"][k] ** 2
                total += left[k][p] * shared * right[k][q]
            for k in range(1, factors + 1):
                total += points[i][f"Loading{k}{'XYZ'[p]}"] * points[j][f"Loading{k}{'XYZ'[q]}"]
            if i == j:
                a, b = sorted((p, q))
                name = f"OwnVariance{'XYZ'[a]}" if a == b else f"OwnCovariance{'XYZ'[a]}{'XYZ'[b]}"
                total += points[i][name]
            return total
        for i in range(0, len(points), 7):
            for axis in range(3):
                stated = points[i][f"Variance{'XYZ'[axis]}"]
                self.assertAlmostEqual(covariance(i, i, axis, axis) / stated, 1, delta=0.01)
        # Two points differ by less than independent ones would, whatever lies between them.
        for i, j in ((0, 1), (0, len(points) - 1)):
            for axis in range(3):
                alone = covariance(i, i, axis, axis) + covariance(j, j, axis, axis)
                differ = alone - 2 * covariance(i, j, axis, axis)
                self.assertGreater(differ, 0)
                self.assertLess(differ, 0.9 * alone)

    def test_no_common_time_is_told_with_its_likely_cause(self):
        for seconds, words in ((18, "18 s are added"), (-18, "UTC"), (WEEK_S, "week"),
                               (1000, "are they of the same flight?")):
            name = self.write("late.csv", self.shifted(seconds), lambda t: 2.9 < t < 5.2)
            said = self.cloud(1, trajectory=name).stderr
            with self.subTest(seconds=seconds):
                self.assertIn("share no time", said)
                self.assertIn(f"{BEGIN + seconds + 2.9:.0f}"[:5], said)
                self.assertIn("208803.", said)
                self.assertIn(words, said)
                self.assertNotIn("a.csv", self.names() - {"a.csv"})
        # What brings them together again is what the message says.
        name = self.write("late.csv", self.shifted(18), lambda t: 2.9 < t < 5.2)
        mount = (self.folder / "a.lvx.mount.truth.yaml").read_text()
        self.assertIn("clock_offset_s: {value: 0.0012", mount)
        (self.folder / "late.yaml").write_text(
            mount.replace("clock_offset_s: {value: 0.0012", "clock_offset_s: {value: 18.0012"))
        late = self.cloud(0, trajectory=name, mount="late.yaml", output="late_points.csv")
        self.assertEqual(late["without_pose"], 0)

    def test_seconds_of_utc_are_not_gps_seconds(self):
        names = list(self.rows[0])
        time, week = names.index("gps_second_of_week_ns"), names.index("gps_week")
        gps_epoch, leap_seconds = 315964800, 18
        names[time] = "utc_unix_ns"
        with open(self.folder / "utc.csv", "w", encoding="utf-8") as file:
            for row in [names] + [list(one) for one in self.rows[1:]]:
                if row is not names:
                    row[time] = str(int(row[time]) + (int(row[week]) * WEEK_S + gps_epoch -
                                                      leap_seconds) * 10**9)
                file.write(",".join(row[:week] + row[week + 1:]) + "\n")
        said = self.cloud(1, trajectory="utc.csv", output="utc_points.csv").stderr
        self.assertIn("UTC second since 1970", said)
        self.assertIn("share no time", said)

    def test_degrees_where_radians_belong(self):
        names = [{"latitude_deg": "latitude_rad"}.get(n, n) for n in self.rows[0]]
        with open(self.folder / "degrees.csv", "w", encoding="utf-8") as file:
            file.write("\n".join(",".join(row) for row in [names] + self.rows[1:]) + "\n")
        said = self.cloud(3, trajectory="degrees.csv").stderr
        self.assertIn("latitude = ", said)
        self.assertIn("degrees stored where radians belong", said)
        self.assertIn("line 2", said)

    def test_headings_may_pass_north(self):
        headings = []

        def signed(row):
            heading = float(row["heading_deg"])
            headings.append(heading)
            row["heading_deg"] = repr(heading - 360 if heading > 180 else heading)
        name = self.write("signed.csv", signed, lambda t: 2.5 < t < 5.5)
        self.assertLess(min(headings), 10)
        self.assertGreater(max(headings), 350)
        whole = self.write("whole.csv", None, lambda t: 2.5 < t < 5.5)
        self.cloud(0, trajectory=name, output="signed_points.csv")
        self.cloud(0, trajectory=whole, output="whole_points.csv")
        for one, two in zip(self.points("signed_points.csv"), self.points("whole_points.csv")):
            self.assertLess(math.dist(one, two), 1e-5)

    def test_gaps_leave_their_shots_out_and_are_told(self):
        name = self.write("gap.csv", None, lambda t: not 3.5 < t < 4.0)
        done = self.cloud(0, trajectory=name, output="gap_points.csv")
        self.assertAlmostEqual(done["without_pose"], 1000, delta=30)
        self.assertIn("trajectory_gaps", codes_of(done))
        all_in = self.write("all_gap.csv", None, lambda t: not 2.9 < t < 5.2)
        said = self.cloud(1, trajectory=all_in, output="none.csv").stderr
        self.assertIn("where the trajectory has a gap", said)
        self.assertNotIn("none.csv", self.names())

    def test_a_mount_is_needed(self):
        said = self.cloud(2, mount=None).stderr
        self.assertIn("--mount is missing", said)
        self.assertIn("how the sensor is mounted", said)

    def test_wrong_maps_are_told(self):
        for crs, words in (("EPSG:4326", "latitudes and longitudes"), ("EPSG:2225", "US survey foot"),
                           ("EPSG:999999", "not a coordinate reference system that PROJ knows"),
                           ("nonsense", "EPSG:25832"),
                           ("EPSG:32632+5703", "grid"),       # NAVD88, without its grid
                           ("EPSG:32756", "is it the right zone?"),  # Sydney
                           ("EPSG:6340", "is it the right zone?")):  # North America
            with self.subTest(crs=crs):
                said = self.cloud(2, crs=crs, output="wrong.csv").stderr
                self.assertIn(words, said)
                self.assertTrue("crs" in said or crs in said, said)
                self.assertNotIn("wrong.csv", self.names())
        # The zone beside it works, with a warning that names both places.
        done = self.cloud(0, crs="EPSG:32633", output="beside.csv")
        (told,) = [one["message"] for one in done["warnings"] if one["code"] == "outside_map"]
        for words in ("UTM zone 33N", "longitude 12.00 to 18.00", "latitude 49.99"):
            self.assertIn(words, told)

    def test_a_bag_of_ros_is_a_trajectory(self):
        """Odometry in the map's own frame: x east, y north."""
        def quaternion(roll, pitch, yaw):
            c, s = [math.cos(a / 2) for a in (roll, pitch, yaw)], \
                [math.sin(a / 2) for a in (roll, pitch, yaw)]
            return (s[0] * c[1] * c[2] - c[0] * s[1] * s[2], c[0] * s[1] * c[2] + s[0] * c[1] * s[2],
                    c[0] * c[1] * s[2] - s[0] * s[1] * c[2], c[0] * c[1] * c[2] + s[0] * s[1] * s[2])

        def pose(time_s, frame):
            text = frame.encode() + b"\0"
            head = struct.pack("<iII", int(time_s), round(1e9 * (time_s % 1)), len(text)) + text
            head += b"\0" * (-len(head) % 8)
            turn = quaternion(0, 0, 0.1 * time_s)
            return b"\0\1\0\0" + head + struct.pack("<7d", 5 * time_s, 2, 40, *turn)
        bag = sqlite3.connect(self.folder / "slam.db3")
        bag.executescript(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, "
            "serialization_format TEXT, offered_qos_profiles TEXT);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, "
            "data BLOB);")
        for topic, name in ((1, "/slam"), (2, "/gps")):
            bag.execute("INSERT INTO topics VALUES(?, ?, 'geometry_msgs/msg/PoseStamped', 'cdr', '')",
                        (topic, name))
        for i in range(200):
            bag.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)",
                        (1 + i % 2, i, pose(10 + 0.01 * i, "map")))
        bag.commit()
        bag.close()
        said = self.expect(2, "info", "slam.db3").stderr
        for words in ("--trajectory-topic is missing", "/slam (geometry_msgs", "/gps (geometry_msgs"):
            self.assertIn(words, said)
        info = self.expect_json(0, "info", "slam.db3", "--trajectory-topic", "/slam")
        self.assertEqual((info["format"], info["records"], info["frame"]), ("ros2-bag", 100, "local"))
        self.assertIn("topic /slam", info["source"])
        self.assertIn("topic /gps",
                      self.expect(0, "info", "slam.db3", "--trajectory-topic", "/gps").stdout)
        done = self.expect_json(0, "convert", "slam.db3", "--trajectory-topic", "/gps", "-o",
                                "gps.csv")
        self.assertEqual(done["records"], 100)
        self.assertIn("/nothing", self.expect(2, "convert", "slam.db3", "--trajectory-topic",
                                              "/nothing", "-o", "no.csv").stderr)
        self.assertIn("is not a ROS bag", self.expect(2, "info", "gps.csv", "--trajectory-topic",
                                               "/gps").stderr)
        said = self.cloud(2, trajectory="slam.db3", crs=None).stderr
        self.assertIn("--trajectory-topic is missing", said)
        said = self.cloud(1, "--trajectory-topic", "/gps", trajectory="slam.db3", crs=None).stderr
        self.assertIn("share no time", said)


if __name__ == "__main__":
    unittest.main()
