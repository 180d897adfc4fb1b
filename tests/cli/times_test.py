#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Recordings with times that are of no use as they stand, and recordings of several sensors."""
import json
import math
import struct
import unittest

import lvx_file
from command import SOURCE, CommandTest, codes_of, run

STAMP = 10  # first byte of a packet's time stamp


def lvx(tables, packets):
    """A file of one frame. tables: of devices, as a file has them."""
    head = bytearray(b"livox_tech".ljust(16, b"\0") + b"\1\1\0\0")
    head += struct.pack("<I", 0xAC0EA767) + struct.pack("<IB", 50, len(tables)) + b"".join(tables)
    body = b"".join(bytes([device]) + packet for device, packet in packets)
    frame = struct.pack("<QQQ", len(head), len(head) + lvx_file.FRAME_BYTES + len(body), 0)
    return bytes(head) + frame + body


class TimesTest(CommandTest):
    """What scripts see of them."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.tables, cls.packets = [], []
        for number in (0, 1):
            done = run("simulate", "-o", f"{number}.lvx", "--scene", SOURCE / "data" / "hall.yaml",
                       "--duration-s", 0.15, "--seed", number, folder=cls.folder)
            assert done.returncode == 0, done.stderr
            data = (cls.folder / f"{number}.lvx").read_bytes()
            table = bytearray(data[lvx_file.HEADER_BYTES:][:lvx_file.DEVICE_BYTES])
            table[:16] = f"3WEDH00000000{number}1".encode().ljust(16, b"\0")
            table[32] = number
            cls.tables.append(bytes(table))
            cls.packets.append([packet for _, packet in lvx_file.packets(data)])

    def estimate(self, name, *options):
        done = run("estimate", name, "--json", *options, folder=self.folder)
        return done, json.loads(done.stdout)

    def stamped(self, name, stamps_ns):
        packets = [(0, packet[:STAMP] + struct.pack("<Q", stamp) + packet[STAMP + 8:])
                   for packet, stamp in zip(self.packets[0], stamps_ns)]
        (self.folder / name).write_bytes(lvx(self.tables[:1], packets))

    def test_packets_with_useless_stamps_are_counted(self):
        count = len(self.packets[0])
        for name, stamps in (("constant.lvx", [7] * count),
                             ("apart.lvx", [10_000_000 * i for i in range(count)])):
            self.stamped(name, stamps)
            done, result = self.estimate(name)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(result["sensor"], "Livox Mid-40")
            self.assertEqual(result["observations_used"] + result["outliers"], 15000)
            self.assertIn("times", done.stderr)

    def test_rows_in_any_order_and_with_shared_times_are_all_used(self):
        done = run("convert", "0.lvx", "-o", "0.openpylivox.csv", folder=self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = []
        for number, line in enumerate((self.folder / "0.openpylivox.csv").read_text()
                                      .splitlines()[1:]):
            distance, zenith, azimuth = map(float, line.split(",")[:3])
            zenith, azimuth = math.radians(zenith), math.radians(azimuth)
            rows.append((number, distance * math.sin(zenith) * math.cos(azimuth),
                         distance * math.sin(zenith) * math.sin(azimuth),
                         distance * math.cos(zenith)))

        def write(name, columns, chosen, time=None):
            with open(self.folder / name, "w", encoding="ascii") as file:
                file.write(columns + "\n")
                for number, *point in chosen:
                    text = ",".join(f"{value:.3f}" for value in point)
                    file.write(f"{time(number)},{text}\n" if time else text + "\n")

        write("sorted.csv", "time_s,x_m,y_m,z_m", sorted(rows, key=lambda row: row[2]),
              lambda number: f"{1e-5 * number:.5f}")
        write("shared.csv", "time_s,x_m,y_m,z_m", rows, lambda number: f"{number // 10 * 1e-4:.4f}")
        for name in ("sorted.csv", "shared.csv"):
            done, result = self.estimate(name)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(result["observations_used"] + result["outliers"], len(rows))
            self.assertEqual(len(result["warnings"]), 1, result["warnings"])
            result = json.loads(run("info", name, "--json", folder=self.folder).stdout)
            self.assertEqual(result["time_resets"], 0)
        # Without times, and without the shots of a part of the field.
        write("removed.csv", "x_m,y_m,z_m", [row for row in rows if row[2] < 0.3])
        done, result = self.estimate("removed.csv", "--shot-rate-hz", 100000)
        self.assertEqual(done.returncode, 1)
        self.assertIn("removed", result["error"])
        result = json.loads(run("info", "removed.csv", "--json", folder=self.folder).stdout)
        self.assertIn("shots_lost", codes_of(result))

    def test_one_of_two_devices_can_be_chosen(self):
        both = [(i, packet) for pair in zip(*self.packets) for i, packet in enumerate(pair)]
        (self.folder / "two.lvx").write_bytes(lvx(self.tables, both))
        result = json.loads(run("info", "two.lvx", "--json", folder=self.folder).stdout)
        self.assertEqual([one["observations"] for one in result["devices"]], [15000, 15000])
        done, result = self.estimate("two.lvx")
        self.assertEqual(done.returncode, 2)
        for word in ("--device", "3WEDH0000000001", "3WEDH0000000011"):
            self.assertIn(word, result["error"])
        alone = self.estimate("1.lvx")[1]
        for wanted in ("3WEDH0000000011", "1"):
            done, result = self.estimate("two.lvx", "--device", wanted)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(result["serial"], "3WEDH0000000011")
            self.assertEqual(result["parameters"], alone["parameters"])
        self.assertEqual(self.estimate("two.lvx", "--device", "2")[0].returncode, 2)
        done = run("convert", "two.lvx", "-o", "one.nc", "--every-device", "--json",
                   folder=self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["done"], 2)
        for number in (0, 1):
            result = json.loads(run("info", f"one-3WEDH00000000{number}1.nc", "--json",
                                  folder=self.folder).stdout)
            self.assertEqual((result["observations"], len(result["devices"])), (15000, 1))


if __name__ == "__main__":
    unittest.main()
