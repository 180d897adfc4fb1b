#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""A simulated Mid-360 as LVX 2, as a capture of its packets, and as bags of its driver: all are the same recording."""
import sqlite3
import struct
import unittest

import captures
from bags_test import mcap
from captures import HOST, framed, pcap, udp
from command import SOURCE, CommandTest
from control_peer import control, packet
from lvx2_file import devices, packages

HALL = SOURCE / "data" / "hall.yaml"
BEGIN = 1_790_000_000 * 10**9
POINT = struct.Struct("<iiiBB")
SENSOR, POINTS, IMU, COMMAND, SEARCH = "192.168.1.112", 56300, 56400, 56200, 56000
SERIAL = "47MDGEN2000001"


def search_reply(kind=9):
    return control(0, struct.pack("<BB16s4BH", 0, kind, SERIAL.encode(), 192, 168, 1, 112, 56100), 1)


def push(*entries):
    return control(0x0102, struct.pack("<HH", len(entries), 0) +
                   b"".join(struct.pack("<HH", key, len(value)) + value for key, value in entries))


def sent(data, port=POINTS, to=56301):
    return udp((SENSOR, port), (HOST, to), data)


def custom(group):
    """A CustomMsg of livox_ros_driver2 in CDR of some packages."""
    first_ns = group[0][1]
    points = [(time_ns - first_ns + 4947 * i, point, i % 4)
              for _, time_ns, _, _, _, data in group for i, point in enumerate(POINT.iter_unpack(data))]
    body = struct.pack("<iII", first_ns // 10**9, first_ns % 10**9, 2) + b"l\0"
    body += b"\0" * (-len(body) % 8) + struct.pack("<QIB3xI", first_ns, len(points), 192, len(points))
    for offset, (x, y, z, intensity, tag), line in points:
        body += b"\0" * (-len(body) % 4) + struct.pack("<I3f3B", offset, x / 1000, y / 1000, z / 1000, intensity, tag,
                                                       line)
    return b"\0\1\0\0" + body


def db3(path, messages):
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, "
                         "offered_qos_profiles TEXT)")
        database.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        database.execute("INSERT INTO topics VALUES(1, '/livox/lidar', 'livox_ros_driver2/msg/CustomMsg', 'cdr', '')")
        database.executemany("INSERT INTO messages VALUES(?, 1, ?, ?)", [(i, i, one) for i, one in enumerate(messages)])
    database.close()


class SecondGenerationTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.simulated = None

    def whole(self):
        """The packages of a simulated recording, its.lvx2."""
        self.expect(0, "simulate", "-o", "its.lvx2", "--sensor", "mid-360", "--scene", HALL, "--duration-s", "0.5")
        return list(packages((self.folder / "its.lvx2").read_bytes()))

    def capture(self, name, datagrams):
        (self.folder / name).write_bytes(pcap(
            [(BEGIN + 480_000 * i, framed(captures.ETHERNET, one)) for i, one in enumerate(datagrams)], nanoseconds=True))
        return name

    def second(self, name, status=0):
        info = self.expect_json(status, "info", name)
        return info, [one["second_generation"] for one in info["devices"]]

    def test_one_recording_in_every_form(self):
        whole = self.whole()
        data = (self.folder / "its.lvx2").read_bytes()
        self.assertEqual([one[2] for one in devices(data)], [9])
        self.assertEqual([number for _, _, number, _, _, _ in whole], [i % 65536 for i in range(len(whole))])
        self.assertEqual({len(one[5]) for one in whole}, {1344})
        begins = {}
        for frame, time_ns, *_ in whole:
            self.assertLess(time_ns - begins.setdefault(frame, time_ns), 50_000_000)
        self.assertEqual(len(begins), 10)
        self.expect(0, "convert", "its.lvx2", "-o", "again.lvx2")
        self.assertEqual((self.folder / "again.lvx2").read_bytes(), data)

        self.capture("its.pcap", [sent(search_reply(), SEARCH, 56000)] +
                     [sent(packet(time_ns, number, points)) for _, time_ns, number, _, _, points in whole])
        groups = [whole[i:i + 208] for i in range(0, len(whole), 208)]
        messages = [custom(group) for group in groups]
        (self.folder / "its.mcap").write_bytes(mcap(messages)[0])
        db3(self.folder / "its.db3", messages)
        found = {}
        for name in ("its.lvx2", "its.pcap", "its.mcap", "its.db3"):
            with self.subTest(name):
                info, (second, ) = self.second(name)
                self.assertEqual((info["observations"], info["gaps"], second["lost_packets"]),
                                 (96 * len(whole), 0, 0))
                self.assertEqual(info["devices"][0]["type"], "Livox Mid-360")
                result = self.expect_json(0, "estimate", name, "--truth", "its.lvx2.truth.yaml")
                found[name] = {key: result[key] for key in ("parameters", "residuals", "verdict", "observations_used",
                                                            "outliers", "truth")}
                self.assertEqual(found[name], found["its.lvx2"])
        self.assertEqual(found["its.lvx2"]["verdict"]["code"], "consistent")

    def test_what_a_capture_lacks_is_counted_by_numbers(self):
        points = b"".join(POINT.pack(2000 + 7 * i, 300, 5 * i, i, 0x10 if i % 8 == 0 else 0) if i % 4 != 3 else
                          POINT.pack(0, 0, 0, 60 if i == 7 else 0, 0) for i in range(96))
        numbers = [65_000 + i for i in range(2000)]
        lost = [i for i in range(1, 1999) if i % 50 == 49]
        kept = [i for i in numbers if i - 65_000 not in lost]
        kept[10], kept[11] = kept[11], kept[10]
        kept.insert(100, kept[99])
        datagrams = [sent(packet(10**9 + 480_000 * i, i % 65536, points)) for i in kept]
        for i in range(20):  # counted apart
            datagrams.insert(20 * i, sent(packet(10**9 + 5_000_000 * i, i, struct.pack("<6f", 0, 0, 0, 0, 0, 1), 0), IMU,
                                          56401))
        view = struct.pack("<5i", 10, 350, -5, 50, 0)
        datagrams += [sent(search_reply(), SEARCH, 56000),
                      sent(push((0x8002, bytes((13, 18, 2, 44))), (0x0015, view), (0x0017, b"\1"), (0x1234, b"??")),
                           COMMAND, 56201),
                      sent(b"no packet")]
        info, (second, ) = self.second(self.capture("its.pcap", datagrams))
        self.assertEqual(info["devices"][0]["serial"], SERIAL)
        self.assertEqual(info["imu_samples"], 20)
        self.assertEqual(second["lost_packets"], len(lost))
        self.assertEqual((second["address"], second["firmware"]), (SENSOR, "13.18.2.44"))
        self.assertEqual(second["field_of_view"], "azimuth 10 to 350 deg, elevation -5 to 50 deg")
        packets = 2000 - len(lost)
        self.assertEqual(info["observations"], 96 * packets)
        self.assertEqual(second["outside_field_of_view"], packets)
        self.assertEqual(info["no_return"], 23 * packets)
        self.assertEqual([(one["tag"], one["observations"]) for one in second["tags"]], [(0, 60 * packets),
                                                                                        (16, 12 * packets)])
        said = " ".join(one["message"] for one in info["warnings"])
        self.assertIn(f"{SERIAL}: {len(lost)} packets are missing", said)
        self.assertIn(f"{SERIAL}: 1 packets were captured twice", said)
        self.assertEqual(info["time_resets"], 0)
        # LVX 2 and the lossless format know what is missing, too.
        for form in ("its.lvx2", "its.nc"):
            self.expect(0, "convert", "its.pcap", "-o", form)
            again, (as_file, ) = self.second(form)
            self.assertEqual((again["observations"], again["no_return"], again["imu_samples"]),
                             (info["observations"], info["no_return"], 20))
            self.assertEqual((as_file["lost_packets"], as_file["address"], as_file["tags"]),
                             (len(lost), SENSOR, second["tags"]))

    def test_several_sensors_and_generations(self):
        points = b"".join(POINT.pack(2000 + 7 * i, 300, 5 * i, i, 0) for i in range(96))
        datagrams = []
        for i in range(200):
            for last, interval, period in ((112, 4750, 480_000), (100, 2102, 212_389)):
                if last == 100 and i == 7:
                    continue
                datagrams.append(udp((f"192.168.1.{last}", POINTS), (HOST, 56301),
                                     packet(10**9 + period * i, i, points, interval=interval)))
        info, second = self.second(self.capture("two.pcap", datagrams))
        self.assertEqual([one["type"] for one in info["devices"]], ["Livox Mid-360", "Livox HAP"])
        self.assertEqual([one["lost_packets"] for one in second], [0, 1])
        self.expect(0, "convert", "two.pcap", "-o", "two.lvx2")
        self.assertEqual([one[1:] for one in devices((self.folder / "two.lvx2").read_bytes())],
                         [(SENSOR, 9), ("192.168.1.100", 10)])

    def test_a_hap_is_read_and_its_optics_are_not_known(self):
        points = b"".join(POINT.pack(5000 + 7 * i, 30 * i - 1500, 5 * i, i, 0) for i in range(96))
        self.capture("hap.pcap", [udp(("192.168.1.100", 57000), (HOST, 57000),
                                      packet(10**9 + 212_389 * i, i, points, interval=2102)) for i in range(500)])
        info, _ = self.second("hap.pcap")
        self.assertEqual(info["sensor"], "Livox HAP")
        self.assertAlmostEqual(info["rate_hz"], 452_000, delta=500)
        self.expect(0, "convert", "hap.pcap", "-o", "hap.lvx2")
        self.assertEqual(self.expect_json(0, "info", "hap.lvx2")["observations"], 48_000)
        for verb in (("estimate", ), ("observability", ), ("calibrate", )):
            said = self.expect(2, *verb, "hap.lvx2").stderr
            self.assertRegex(said, "optics of a Livox HAP.* not known")
            self.assertNotIn("beam =", said)

    def test_damage_and_versions(self):
        whole = self.whole()
        data = bytearray((self.folder / "its.lvx2").read_bytes())
        at = 29 + 63 + 24 + 50 * (27 + 1344)
        data[at] = 9
        (self.folder / "damaged.lvx2").write_bytes(data)
        done = self.expect(3, "convert", "damaged.lvx2", "-o", "saved.nc")
        self.assertIn(f"byte {at}", done.stderr)
        self.assertEqual(self.expect_json(0, "info", "saved.nc")["observations"], 96 * 50)
        (self.folder / "cut.lvx2").write_bytes((self.folder / "its.lvx2").read_bytes()[:-1000])
        info, (second, ) = self.second("cut.lvx2")
        self.assertEqual((info["observations"], second["lost_packets"]), (96 * (len(whole) - 1), 0))
        self.assertIn("cut off", info["warnings"][0]["message"])
        self.assertIn("LVX 2 does not", self.expect(2, "simulate", "-o", "mid-40.lvx2", "--duration-s", "0.1",
                                             "--scene", HALL).stderr)


if __name__ == "__main__":
    unittest.main()
