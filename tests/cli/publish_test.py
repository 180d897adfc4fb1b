#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Points that record publishes while it records, seen by viewers that know nothing of risley."""
import csv
import json
import math
import os
import re
import struct
import subprocess
import unittest

from command import COMMAND, SANITIZED, SOURCE, ProcessTest
from foxglove_viewer import Follower, Viewer, cloud_of, columns

import schemas

HOST, CODE = "127.0.0.37", "PUBLISHED000011"
HALL = SOURCE / "data" / "hall.yaml"
LISTENER = os.environ.get("RISLEY_DDS_LISTENER")  # of builds with Fast DDS
in_real_time = unittest.skipIf(SANITIZED, "SKIPPED: with sanitizers points are slower than a sensor")


class PublishTest(ProcessTest):
    def emulate(self, *arguments, address="127.0.0.47", code=CODE):
        return self.start("emulate", "--interface", address, "--serial", code, "--scene", HALL, "--rotor", "hunting",
                          *arguments)

    def start_record(self, name, publish, *arguments, codes=(CODE,)):
        serials = [word for code in codes for word in ("--serial", code)]
        return self.start("record", "-o", name, "--interface", HOST, *serials, "--find-s", 20, "--publish", publish,
                          "--json", *arguments)

    def record(self, name, *arguments, codes=(CODE,)):
        process = self.start_record(name, "foxglove:0", *arguments, codes=codes)
        line = process.stderr.readline()
        found = re.search(r"points at ws://([0-9.]+):(\d+)/", line)
        self.assertTrue(found, line)
        return process, (found[1], int(found[2]))

    def end(self, process):
        out, err = process.communicate(timeout=120)
        self.assertEqual(process.returncode, 0, out + err)
        schemas.check_output(("record",), out)
        result = json.loads(out)
        self.skip_where_the_kernel_drops(result)
        return result, err

    def cloud(self, recording, *arguments):
        """Points of a recording by their time: x, y, z and sigmas."""
        self.expect(0, "cloud", recording, "-o", "cloud.csv", *arguments)
        names = [f"{name}_m" for name in ("X", "Y", "Z", "StdX", "StdY", "StdZ")]
        with open(self.folder / "cloud.csv", encoding="utf-8") as file:
            return {round(1e9 * float(row["Time_s"])): [float(row[name]) for name in names]
                    for row in csv.DictReader(file)}

    @in_real_time
    def test_points_are_those_of_a_cloud(self):
        """The sensor reports what it believes; a calibration knows better."""
        unit = ("--set", "prism_tilt_b_vertical_deg=0.02", "--reported", "nominal")
        self.emulate(*unit, "--disorder", 0.02, "--disorder-packets", 3)
        self.expect(0, "simulate", "-o", "unit.nc", "--duration-s", 0.1, *unit)
        truth = re.sub(r"(?ms)^serial:.*?\n", "", (self.folder / "unit.nc.truth.yaml").read_text(encoding="utf-8"))
        (self.folder / "true.yaml").write_text(
            re.sub(r"(?m)^provenance:", "calibrated_against: planes\nprovenance:", truth), encoding="utf-8")
        process, url = self.record("seen.lvx", "--duration-s", 5, "--calibration", "true.yaml")
        follower = Follower(url)
        result, _ = self.end(process)
        follower.join(20)
        self.assertIsNone(follower.failure)
        sensor = result["sensors"][0]
        self.assertEqual((sensor["lost"], sensor["kernel_drops"], sensor["publishing"]["missing_packets"]), (0, 0, 0))
        self.assertEqual((sensor["publishing"]["words"], sensor["publishing"]["is_calibrated"]), ("", True))
        self.assertEqual(follower.topics, {"/risley/points"})
        self.assertEqual((sensor["published"], sensor["publishing"]["frames"]), (follower.points, follower.count))
        self.assertEqual(result["viewers"]["dropped_frames"], 0)
        frames = [(cloud.stamp_ns, len(cloud.data) // cloud.step) for cloud in follower.clouds]
        self.assertEqual(frames, sorted(frames))
        self.assertTrue(all(count <= 5000 for _, count in frames), frames)
        after = self.cloud("seen.lvx", "--calibration", "true.yaml")
        names = ("timestamp", "x", "y", "z", "StdX", "StdY", "StdZ")
        squares, worst, count = 0, 0, 0
        for cloud in follower.clouds:
            for time_ns, *point in columns(cloud, names):
                other = after[round(time_ns)]
                for axis in range(3):
                    # Both share the errors of range and calibration, so they differ by the rotors' alone.
                    apart = abs(point[axis] - other[axis]) / point[axis + 3]
                    worst, squares = max(worst, apart), squares + apart * apart
                count += 1
        self.assertGreater(count, 0.99 * len(after))
        self.assertLess(worst, 1)
        self.assertLess(math.sqrt(squares / (3 * count)), 0.2)

    @in_real_time
    def test_viewers_never_disturb_the_recording(self):
        """One that reads, one that never does, one that comes and goes, and what is no viewer."""
        self.emulate("--sensor", "avia", code=CODE)
        process, url = self.record("crowd.lvx", "--duration-s", 8)
        follower = Follower(url, keep=False)
        dead = Viewer(*url, receive_buffer=4096)
        messages = dead.messages()
        next(messages)  # subscribed, and never read from again
        for _ in range(5):
            guest = Follower(url, most=3)
            guest.join(20)
            self.assertIsNone(guest.failure)
            self.assertEqual(guest.count, 3)
        result, _ = self.end(process)
        follower.join(20)
        sensor = result["sensors"][0]
        self.assertEqual((sensor["lost"], sensor["kernel_drops"], sensor["publishing"]["missing_packets"]), (0, 0, 0))
        self.assertIsNone(follower.failure)
        self.assertEqual(follower.points, sensor["published"])
        self.assertGreater(result["viewers"]["dropped_frames"], 0)
        self.assertEqual(result["viewers"]["connections"], 7)
        messages.close()
        dead.close()

    @in_real_time
    def test_sensors_have_topics_of_their_own(self):
        other = "PUBLISHED000021"
        self.emulate()
        self.emulate("--sensor", "mid-360", address="127.0.0.48", code=other)
        process, url = self.record("both.lvx", "--duration-s", 4, "--topic", "/scan", "--frame-id", "mast",
                                   "--frame-rate-hz", 10, codes=(CODE, other))
        follower = Follower(url)
        result, err = self.end(process)
        follower.join(20)
        self.assertIsNone(follower.failure)
        self.assertEqual(follower.topics, {f"/scan/{CODE}", f"/scan/{other}"})
        self.assertEqual({cloud.frame_id for cloud in follower.clouds}, {"mast"})
        self.assertEqual(sum(one["published"] for one in result["sensors"]), follower.points)
        self.assertEqual([one["publishing"]["calibration"] for one in result["sensors"]], ["mid-40", "mid-360"])
        self.assertEqual(err.count("no calibration was given for its points"), 2)

    @in_real_time
    @unittest.skipUnless(LISTENER, "SKIPPED: built without Fast DDS")
    def test_nodes_of_ros_2_see_the_points(self):
        """By Fast DDS alone: one that is reliable, one of best effort, one that never takes a message."""
        self.emulate()
        kinds = ("reliable", "best_effort", "deaf")
        listeners = []
        for kind in kinds:
            with open(self.folder / kind, "wb") as output:
                listeners.append(subprocess.Popen([LISTENER, "83", "rt/scan", kind], stdout=output,
                                                  stderr=subprocess.PIPE))
        for listener in listeners:
            self.addCleanup(listener.kill)
            self.assertEqual(listener.stderr.readline(), b"ready\n")
        process = self.start_record("nodes.lvx", "dds:83", "--topic", "/scan", "--frame-id", "mast", "--duration-s", 4)
        self.assertIn("domain 83", process.stderr.readline())
        result, _ = self.end(process)
        sensor = result["sensors"][0]
        self.assertEqual((sensor["lost"], sensor["kernel_drops"], sensor["publishing"]["missing_packets"]), (0, 0, 0))
        after = self.cloud("nodes.lvx", "--directions", "reported")
        for listener, kind in zip(listeners, kinds):
            self.assertEqual(listener.wait(30), 0)
            listener.stderr.close()
            data, at, clouds = (self.folder / kind).read_bytes(), 0, []
            while at < len(data):
                size, = struct.unpack_from("<I", data, at)
                clouds.append(cloud_of(data[at + 4:at + 4 + size]))
                at += 4 + size
            count = sum(len(cloud.data) // cloud.step for cloud in clouds)
            if kind == "deaf":
                self.assertEqual(count, 0)
                continue
            if kind == "reliable":
                self.assertEqual((len(clouds), count), (sensor["publishing"]["frames"], sensor["published"]))
            self.assertGreater(count, 0.25 * sensor["published"], kind)  # the first second comes at once
            self.assertEqual({cloud.frame_id for cloud in clouds}, {"mast"})
            for time_ns, *point in columns(clouds[-1], ("timestamp", "x", "y", "z")):
                for one, other in zip(point, after[round(time_ns)]):
                    self.assertAlmostEqual(one, other, delta=0.005)

    def test_what_cannot_be_is_refused(self):
        for status, arguments, words in (
                (2, ("--publish", "here"), "foxglove:PORT"),
                (2, ("--publish", "foxglove:here"), "expected a port"),
                (2, ("--publish", "dds:300"), "300"),
                (2, ("--publish", "dds:here"), "here"),
                (2, ("--publish", "foxglove:0.0.0.0:0"), "0.0.0.0"),
                (3, ("--publish", "foxglove:0", "--calibration", "no-such-file.yaml"), "no-such-file.yaml"),
                (2, ("--publish", "foxglove:0", "--frame-rate-hz", 1), "--frame-rate-hz"),
                (2, ("--calibration", "mid-40"), "--publish")):
            done = subprocess.run([COMMAND, "record", "-o", "x.lvx", "--interface", HOST, *map(str, arguments)],
                                  cwd=self.folder, capture_output=True, text=True, timeout=60, check=False)
            self.assertEqual(done.returncode, status, (arguments, done.stderr))
            self.assertIn(words, done.stderr, arguments)


if __name__ == "__main__":
    unittest.main()
