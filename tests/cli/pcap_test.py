#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Captures of a network as recordings: written here by hand, and of what a virtual sensor sends."""
import os
import struct
import time
import unittest

import captures
import lvx_file
from captures import HOST, framed, pcap, pcapng, udp
from command import ProcessTest
from livox_peer import AVIA, MID_40, MID_70, TYPES, Host, bound, frame, packet, send_with_room

BEGIN = 1_790_000_000 * 10**9
MID, OTHER = ("192.168.1.41", 65000), ("192.168.1.42", 65000)


def broadcast(code, device_type):
    return frame(2, 0, 0, 0, code.encode().ljust(16, b"\0") + struct.pack("<BH", device_type, 0))


def stream(data_type=1, count=300, step=1_000_000, sender=MID, first=0, stamp=0, **header):
    """Datagrams of a sensor: (time in ns, IPv4 packet)."""
    return [(BEGIN + (first + i) * step, udp(sender, (HOST, 56001), packet(data_type, stamp + (first + i) * step, i,
                                                                           **header)))
            for i in range(count)]


def links(datagrams, link=captures.ETHERNET, **options):
    return [(time_ns, framed(link, data, **options)) for time_ns, data in datagrams]


class PcapTest(ProcessTest):
    def write(self, name, data):
        (self.folder / name).write_bytes(data)
        return name

    def packets(self, name, status=0):
        """Device table and packets, as convert writes them."""
        out = name + ".lvx"
        self.expect(status, "convert", name, "-o", out)
        data = (self.folder / out).read_bytes()
        return lvx_file.devices(data), list(lvx_file.packets(data))

    def warnings(self, name, status=0):
        return [one["message"] for one in self.expect_json(status, "info", name)["warnings"]]

    def test_every_kind_of_capture(self):
        hello = [(BEGIN - 10**9, udp(MID, ("255.255.255.255", 55000), broadcast("0TFDG3B006H2Z11", MID_40)))]
        sent = hello + stream(count=50)
        expected = [packet(1, i * 1_000_000, i) for i in range(50)]
        kinds = [("plain", pcap(links(sent)))]
        for order in "<>":
            kinds.append(("nanoseconds" + order, pcap(links(sent), order=order, nanoseconds=True)))
            kinds.append(("pcapng" + order, pcapng(links(sent), order=order)))
        for tags in (1, 2):
            kinds.append((f"tags{tags}", pcap(links(sent, tags=tags))))
        for link in (captures.LOOPBACK, captures.RAW, captures.COOKED, captures.LOOP, captures.IPV4, captures.COOKED_2):
            kinds.append((f"link{link}", pcap(links(sent, link), link=link)))
            kinds.append((f"ng{link}", pcapng(links(sent, link), link=link)))
        kinds.append(("padded", pcap([(t, data + b"trailer") for t, data in links(sent)])))
        for number, (name, data) in enumerate(kinds):
            with self.subTest(name):
                # Its name says nothing.
                devices, packets = self.packets(self.write(f"capture{number}.any", data))
                self.assertEqual(devices, [("0TFDG3B006H2Z11", 0, MID_40)])
                self.assertEqual(packets, [(0, one) for one in expected])
                info = self.expect_json(0, "info", f"capture{number}.any")
                self.assertEqual((info["format"], info["observations"], info["warnings"]), ("pcap", 5000, []))

    def test_several_sensors_and_other_traffic(self):
        avia = stream(3, 700, 400_000, OTHER)
        samples = [(BEGIN + i * 5_000_000, udp((OTHER[0], 65001), (HOST, 56002), packet(6, i * 5_000_000, i)))
                   for i in range(50)]
        hello = [(BEGIN, udp(OTHER, ("255.255.255.255", 55000), broadcast("3JEDK1E001F6361", AVIA)))]
        noise = [(BEGIN + 10**7, udp(("8.8.8.8", 53), (HOST, 4000), bytes(918))),
                 (BEGIN + 10**7, udp(MID, (HOST, 56001), packet(1, 0, 0), protocol=6)),
                 (BEGIN + 10**7, udp(MID, (HOST, 56001), frame(1, 3, 0, 3, bytes(7))))]
        everything = sorted(stream() + avia + samples + hello + noise, key=lambda one: one[0])
        mixed = links(everything) + [(BEGIN + 10**9, framed(1, bytes(40), protocol=0x0806)), (BEGIN + 10**9, b"short")]
        devices, packets = self.packets(self.write("two.pcap", pcap(mixed)))
        self.assertEqual(devices, [("", 0, MID_40), ("3JEDK1E001F6361", 1, AVIA)])
        self.assertEqual([data for index, data in packets if index == 0], [packet(1, i * 10**6, i) for i in range(300)])
        self.assertEqual([data for index, data in packets if index == 1 and data[9] == 3],
                         [packet(3, i * 400_000, i) for i in range(700)])
        self.assertEqual(sum(data[9] == 6 for index, data in packets if index == 1), 50)
        (said,) = self.warnings("two.pcap")
        self.assertIn("192.168.1.41:65000: no broadcast names its serial number; by its packets it is a Livox Mid-40",
                      said)

    def test_a_hub_tells_its_sensors_apart(self):
        one, other = stream(count=20), stream(count=30)
        numbered = [(t, data[:30] + b"\2" + data[31:]) for t, data in other]  # lidar id
        hub = [(BEGIN, udp(MID, ("255.255.255.255", 55000), broadcast("13UUG1R00400170", 0)))]
        devices, packets = self.packets(self.write("hub.pcap", pcap(links(hub + one + numbered))))
        self.assertEqual([(code, kind) for code, _, kind in devices], [("", MID_40), ("", MID_40)])
        self.assertEqual([sum(index == i for index, _ in packets) for i in (0, 1)], [20, 30])
        self.assertEqual((self.folder / "hub.pcap.lvx").read_bytes().count(b"13UUG1R00400170"), 2)

    def test_types_that_only_packets_tell(self):
        for data_type, step, sensor in ((3, 960_000, MID_70), (8, 125_000, AVIA), (5, 480_000, MID_70)):
            name = self.write(f"type{data_type}.pcap", pcap(links(stream(data_type, 40, step))))
            self.assertIn("by its packets it is a Livox " + {MID_70: "Mid-70", AVIA: "Avia"}[sensor], self.warnings(name)[0])
            rate = self.expect_json(0, "info", name)["rate_hz"]
            self.assertAlmostEqual(rate, 240e3 if sensor == AVIA else 100e3, delta=200)
        name = self.write("fast.pcap", pcap(links(stream(3, 40, 400_000))))
        self.assertAlmostEqual(self.expect_json(0, "info", name)["rate_hz"], 240e3, delta=500)
        self.assertIn("its type is unknown", self.warnings(name)[0])

    def test_what_is_missing_is_counted(self):
        sent = stream()
        lost = sent[:100] + sent[103:200] + sent[201:]
        disorder = lost[:50] + [lost[51], lost[50]] + lost[52:]
        double = [one for one in disorder for _ in range(2)]
        name = self.write("lossy.pcap", pcap(links(double)))
        times = [struct.unpack_from("<Q", data, 10)[0] // 10**6 for _, data in self.packets(name)[1]]
        self.assertEqual(times, [i for i in range(300) if i not in (100, 101, 102, 200)])
        said = self.warnings(name)
        self.assertIn("192.168.1.41:65000: 4 packets are missing between others", said)
        self.assertIn("192.168.1.41:65000: 296 packets were captured twice; the second ones were ignored", said)

    def test_captures_of_parts(self):
        name = self.write("snap.pcap", pcap(links(stream(count=9)), snap=200))
        failed = self.expect_json(3, "info", name)
        self.assertIn("9 were cut by the snap length of 200 bytes", failed["error"])
        # Points are cut, inertial samples are not.
        samples = [(BEGIN + i * 5_000_000, udp(MID, (HOST, 56001), packet(6, i * 5_000_000, i))) for i in range(9)]
        name = self.write("part.pcap", pcap(links(stream(3, 9) + samples), snap=96))
        warnings = self.expect_json(0, "info", name)["warnings"]
        self.assertEqual([one["lost_records"] for one in warnings if one["code"] == "shots_lost"], [9 * 96])
        pieces = [(t, udp(MID, (HOST, 56001), packet(1, 0, 0), flags=0x2000)) for t, _ in stream(count=3)]
        name = self.write("pieces.pcap", pcap(links(stream(count=9) + pieces)))
        self.assertIn("3 fragments of datagrams were ignored; sensors send none", self.warnings(name))

    def test_a_capture_that_is_cut_off(self):
        for whole, head, record in ((pcap(links(stream(count=20))), 24, 16 + 14 + 28 + 918),
                                    (pcapng(links(stream(count=20))), 28 + 32, 32 + 960)):
            for bytes_left in (record * 12 + 1, record * 12 + 400, record * 13 - 1):
                name = self.write("cut.pcap", whole[:head + bytes_left])
                failed = self.expect_json(3, "info", name)
                self.assertIn(f"byte {head + record * 12}", failed["error"])
                self.assertEqual(self.packets(name, 3)[1], [(0, packet(1, i * 10**6, i)) for i in range(12)])
        failed = self.expect_json(3, "info", self.write("head.pcap", pcap([])[:20]))
        self.assertIn("is no whole capture", failed["error"])

    def test_what_is_no_capture_of_sensors(self):
        failed = self.expect_json(3, "info", self.write("none.pcap", pcap(links([(BEGIN, udp(MID, (HOST, 1), b"?"))]))))
        self.assertIn("holds no packet of a Livox sensor", failed["error"])
        failed = self.expect_json(3, "info", self.write("usb.pcap", pcap([], link=189)))
        self.assertIn("allowed Ethernet, Linux cooked, raw IP and loopback", failed["error"])
        name = self.write("sound.pcap", pcap(links(stream(count=9))))
        self.assertIn(".pcap", self.expect_json(2, "convert", name, "-o", "again.pcap")["error"])

    def test_clocks(self):
        pps = [(BEGIN + i * 10**6, udp(MID, (HOST, 56001), packet(1, i % 1000 * 10**6, i, 4))) for i in range(2500)]
        info = self.expect_json(0, "info", self.write("pps.pcap", pcap(links(pps))))
        self.assertEqual((info["pps_wraps"], info["time_reference"]), (2, "PPS"))
        self.assertAlmostEqual(info["duration_s"], 2.5, places=4)
        restarted = stream(count=100, stamp=5 * 10**9) + [
            (BEGIN + 10**10, udp(MID, ("255.255.255.255", 55000), broadcast("0TFDG3B006H2Z11", MID_40)))
        ] + [(t + 10**11, data) for t, data in stream(count=100)]
        name = self.write("restarted.pcap", pcap(links(restarted)))
        self.assertEqual(len(self.packets(name)[1]), 200)
        self.assertEqual(self.warnings(name), [])

    def test_the_same_datagrams_as_record(self):
        """What a virtual sensor sends, with faults, is kept by a host, sent once more to `record`, and captured."""
        emulator = self.start("emulate", "--interface", "127.0.0.61", "--serial", "CAPTURED0000011", "--sensor", "avia",
                              "--loss", 0.02, "--duplication", 0.02, "--disorder", 0.05, "--seed", 5)
        host = Host("127.0.0.62")
        self.addCleanup(host.close)
        _, hello = host.find("CAPTURED0000011")
        host.shake_hands()
        host.ask(0, 5, b"\1")
        host.ask(1, 8, b"\1")
        host.ask(0, 4, b"\1")
        received = host.receive(1)
        emulator.terminate()
        emulator.wait(20)
        self.assertGreater(len(received), 2000)
        sender = bound("127.0.0.61", 65000)
        self.addCleanup(sender.close)
        recorder = self.start("record", "-o", "live.lvx", "--passive", "--interface", "127.0.0.63", "--data-port", 56201,
                              "--find-s", 2, "--json")
        end = time.monotonic() + 60
        # The first packet, by which the recording finds the sensor: once more it is one that came twice.
        sample = min((one for one in received if one[9] != 6), key=lambda one: struct.unpack_from("<Q", one, 10))
        while not (self.folder / "live.lvx.unfinished").exists():
            self.assertLess(time.monotonic(), end)
            sender.sendto(hello, ("127.0.0.63", 55000))
            sender.sendto(sample, ("127.0.0.63", 56201))
            time.sleep(0.05)
        time.sleep(0.5)
        for one in received:
            send_with_room(sender, one, ("127.0.0.63", 56201))
            time.sleep(0.0002)
        time.sleep(1)
        recorder.terminate()
        out, _ = recorder.communicate(timeout=60)
        self.assertEqual(recorder.returncode, 0, out)
        said = (BEGIN, framed(1, udp(("127.0.0.61", 65000), ("255.255.255.255", 55000), hello)))
        records = [(BEGIN + i * 400_000, framed(1, udp(("127.0.0.61", 65000), ("127.0.0.63", 56201), one)))
                   for i, one in enumerate(received)]
        devices, packets = self.packets(self.write("live.pcap", pcap([said] + records, nanoseconds=True)))
        recorded = list(lvx_file.packets((self.folder / "live.lvx").read_bytes()))
        self.assertEqual(devices, [("CAPTURED0000011", 0, AVIA)])
        for inertial in (False, True):
            self.assertEqual([data for _, data in recorded if (data[9] == 6) == inertial],
                             [data for _, data in packets if (data[9] == 6) == inertial])
        self.assertEqual({TYPES[data[9]][0] for _, data in packets}, {96, 1})


if __name__ == "__main__":
    unittest.main()
