#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Three sensors, faster than real ones, recorded into one file: every byte of it is what they sent.

RISLEY_THREE_SENSORS_S=360 records an hour of theirs, at ten times their speed, instead of a few seconds; needs 23 GB."""
import json
import mmap
import os
import pathlib
import shutil
import signal
import time
import unittest

import lvx_file
from command import SANITIZED, SOURCE, ProcessTest

SECONDS = float(os.environ.get("RISLEY_THREE_SENSORS_S", "2"))  # of this machine
LONG = SECONDS >= 60
SPEED = 10 if LONG else 2 if SANITIZED else 3  # beside other tests
# Sensor, data type, ns between packets.
SENSORS = (("mid-40", 1, 1_000_000), ("avia", 3, 400_000), ("horizon", 3, 400_000))
IMU = 6
TICKS = os.sysconf("SC_CLK_TCK")


def data_packets(data):
    """(index of the device, data type, time stamp, records) of every packet of a recording."""
    for device, packet in lvx_file.packets(data):
        yield device, packet[9], int.from_bytes(packet[10:18], "little"), packet[18:]


def without_tags(kind, points):
    """Depths, angles and reflectivities: the tags are the emulator's own."""
    if kind == 3:
        points = bytearray(points)
        points[9::10] = bytes(len(points) // 10)
    return bytes(points)


class ThreeSensorsTest(ProcessTest):
    def what_is_sent(self, sensor):
        """Packets of a recording that the virtual sensor sends over and over."""
        name = f"{sensor}.lvx"
        self.expect(0, "simulate", "-o", name, "--sensor", sensor, "--rotor", "hunting", "--duration-s",
                    10 if LONG else 1, "--scene", SOURCE / "data/room.yaml", "--seed", 5)
        return [without_tags(kind, points)
                for _, kind, _, points in data_packets((self.folder / name).read_bytes()) if kind != IMU]

    def figures(self, process):
        """Processor time so far, s, and most memory of its own, kB."""
        folder = pathlib.Path(f"/proc/{process.pid}")
        words = (folder / "stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
        status = (folder / "status").read_text(encoding="ascii").splitlines()
        memory = next(line for line in status if line.startswith("VmHWM"))
        return (int(words[11]) + int(words[12])) / TICKS, int(memory.split()[1])

    def test_every_byte(self):
        if LONG and shutil.disk_usage(self.folder).free < 7e7 * SECONDS:
            self.skipTest("SKIPPED: too little disk for this recording")
        sent = [self.what_is_sent(sensor) for sensor, *_ in SENSORS]
        codes = [f"THREE000000000{i}" for i in range(len(SENSORS))]
        sensors = [self.start("emulate", "--interface", f"127.0.0.{50 + i}", "--serial", code, "--recording",
                              f"{sensor}.lvx", "--speed", SPEED, "--json")
                   for i, (code, (sensor, *_)) in enumerate(zip(codes, SENSORS))]
        recording = self.start("record", "-o", "three.lvx", "--interface", "127.0.0.32", "--duration-s", SECONDS,
                               "--find-s", 4, "--json")
        seconds = memory = 0
        while recording.poll() is None:
            try:
                seconds, memory = self.figures(recording)
            except (OSError, IndexError, StopIteration):  # it ended meanwhile
                break
            time.sleep(0.05)
        out, err = recording.communicate(timeout=60)
        self.assertEqual(recording.returncode, 0, err)
        truth = []
        for process in sensors:
            process.send_signal(signal.SIGTERM)
            truth.append(json.loads(process.communicate(timeout=20)[0])["sensors"][0])
        self.skip_where_the_kernel_drops(json.loads(out))
        result = json.loads(out)["sensors"]
        self.assertEqual([one["serial"] for one in result], codes)
        wrong = ("lost", "duplicates", "reordered", "kernel_drops", "late", "rejected")
        self.assertEqual([[one[name] for name in wrong] for one in result], [[0] * len(wrong)] * len(result), wrong)
        for name in ("rows", "packets", "imu_samples"):
            self.assertEqual([one[name] for one in result], [one[name] for one in truth], name)
        seen, samples = self.compare(codes, sent)
        self.assertEqual(seen, [one["packets"] - one["imu_samples"] for one in truth])
        self.assertEqual(samples, [one["imu_samples"] for one in truth])
        size = (self.folder / "three.lvx").stat().st_size
        print(f"{SECONDS:g} s at {SPEED} x: {sum(one['rows'] for one in result)} rows, {size / 1e9:.2f} GB, all as sent; "
              f"{seconds:.1f} s of one processor, {memory / 1e3:.0f} MB", flush=True)
        if LONG:
            self.assertLess(seconds, SECONDS)
            self.assertLess(memory, 100_000)

    def compare(self, codes, sent):
        """Every packet of the file with what was sent. Returns how many there are of each sensor."""
        seen, samples, first, cycles = [0] * len(codes), [0] * len(codes), [None] * len(codes), [[] for _ in codes]
        with open(self.folder / "three.lvx", "rb") as file, \
                mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            order = [codes.index(serial) for serial, *_ in lvx_file.devices(data)]
            for device, kind, stamp, points in data_packets(data):
                i = order[device]
                if kind == IMU:
                    samples[i] += 1
                    continue
                _, expected, step = SENSORS[i]
                number, cycle = seen[i], cycles[i]
                if first[i] is None:
                    first[i] = stamp
                self.assertEqual(kind, expected)
                if stamp != first[i] + number * step:
                    self.fail(f"packet {number} of {codes[i]}: time {stamp}")
                if number < len(sent[i]):
                    self.assertEqual(without_tags(kind, points), sent[i][number], f"packet {number} of {codes[i]}")
                    cycle.append(points)
                elif points != cycle[number % len(cycle)]:
                    self.fail(f"packet {number} of {codes[i]}: other points")
                seen[i] += 1
        return seen, samples


if __name__ == "__main__":
    unittest.main(verbosity=2)
