#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The virtual sensor: against a host that knows nothing of risley, and against risley record."""
import json
import os
import random
import signal
import struct
import time
import unittest

import lvx_file
import schemas
from command import SANITIZED, ProcessTest
from livox_peer import SENSOR_PORT, TYPES, Host, bound, frame, parse, send_with_room

ADDRESS, CODE = "127.0.0.41", "EMULATED0000011"


def header(packet):
    """Version, slot, id, timestamp type, data type, time."""
    version, slot, number, _, _, clock, kind, stamp = struct.unpack_from("<BBBBIBBQ", packet)
    return version, slot, number, clock, kind, stamp


class EmulateTest(ProcessTest):
    def emulate(self, *arguments, address=ADDRESS, code=CODE):
        return self.start("emulate", "--interface", address, "--serial", code, "--json", *arguments)

    def truth(self, process):
        """What an emulator says at its end."""
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=20)
        self.assertEqual(process.returncode, 0, err)
        schemas.check_output(("emulate",), out)
        return json.loads(out)["sensors"][0]

    def host(self):
        host = Host()
        self.addCleanup(host.close)
        return host

    def begin_recording(self, name, *arguments, interface="127.0.0.32"):
        return self.start("record", "-o", name, "--interface", interface, "--json", *arguments)

    def recorded(self, process, name):
        """What a recording says at its end of each of its sensors."""
        out, err = process.communicate(timeout=300)
        self.assertEqual(process.returncode, 0, out + err)
        schemas.check_output(("record",), out)
        result = json.loads(out)
        self.skip_where_the_kernel_drops(result)
        info = self.expect_json(0, "info", name)
        self.assertEqual(info["observations"], sum(one["rows"] for one in result["sensors"]))
        return result["sensors"]

    def record(self, name, *arguments):
        return self.recorded(self.begin_recording(name, *arguments), name)

    def test_known_frames_over_the_network(self):
        self.emulate(code="0TFDG3B006H2Z11")
        host = self.host()
        kind, broadcast = host.find("0TFDG3B006H2Z11")
        self.assertEqual(kind, 1)
        self.assertEqual(broadcast.hex(), "aa012200020000597e0000"
                         "3054464447334230303648325a31310001000034ab3f89")
        self.assertEqual(host.shake_hands(), b"\0")
        for asked, answered in (
                ("aa010f0000000004d7000338ba8d0c", "00010000000000"),  # heartbeat
                ("aa010f0000000004d70002ae8a8a7b", "0003080000"),      # device info
                ("aa011000000000b809000501" "63bc481e", "00"),         # spherical
                ("aa011000000000b809000500" "f58c4f69", "00"),         # Cartesian
                ("aa011000000000b809000401" "228d5307", "00"),         # start
                ("aa011000000000b809000400" "b4bd5470", "00"),         # stop
                ("aa0117000000006439010a14090a1100e9a435d0337994", "01"),  # UTC: it has its own clock
                ("aa010f0000000004d70006b74ee77c", "00")):             # disconnect
            host.commands.sendto(bytes.fromhex(asked), host.sensor)
            host.commands.settimeout(2)
            reply = parse(host.commands.recvfrom(2048)[0])
            self.assertEqual(reply, (1, 0, int(asked[18:20], 16), int(asked[20:22], 16),
                                     bytes.fromhex(answered)), asked)

    def test_every_data_type_at_its_rate(self):
        for sensor, device_type, modes in (("mid-40", 1, (None,)), ("mid-70", 6, (0, 2)),
                                           ("horizon", 3, (0, 2)), ("tele-15", 2, (1,)), ("avia", 7, (0, 2, 3))):
            process = self.emulate("--sensor", sensor)
            host = self.host()
            self.assertEqual(host.find(CODE)[0], device_type)
            self.assertEqual(host.shake_hands(kind=1), b"\0")  # as the maker's SDK has it
            for mode in modes:
                for spherical in (0, 1):
                    expected = spherical if device_type == 1 else spherical + {0: 2, 1: 2, 2: 4, 3: 7}[mode]
                    with self.subTest(sensor=sensor, data_type=expected):
                        if mode is not None:
                            self.assertEqual(host.ask(1, 6, bytes([mode])), b"\0")
                        self.assertEqual(host.ask(0, 5, bytes([spherical])), b"\0")
                        self.assertEqual(host.ask(0, 4, b"\1"), b"\0")
                        records, size, slow, fast = TYPES[expected]
                        step = slow if device_type in (1, 6) else fast
                        fifth_of_a_second = 200_000_000 // step
                        packets = host.receive_packets(fifth_of_a_second)
                        self.assertEqual(host.ask(0, 4, b"\0"), b"\0")
                        packets += host.receive(0)
                        self.assertGreaterEqual(len(packets), fifth_of_a_second)
                        self.assertEqual({len(one) for one in packets}, {18 + records * size})
                        self.assertEqual({header(one)[:5] for one in packets}, {(5, 1, 1, 0, expected)})
                        times = [header(one)[5] for one in packets]
                        self.assertEqual(times, list(range(times[0], times[-1] + 1, step)))
            self.assertEqual(host.ask(0, 6), b"\0")
            host.close()
            self.assertEqual(self.truth(process)["sessions"], 1)

    def test_points_lie_on_the_walls_of_the_scene(self):
        self.expect(0, "simulate", "-o", "room.lvx", "--scene", os.path.join(
            os.environ["RISLEY_SOURCE_DIR"], "data/room.yaml"), "--duration-s", 0.1)
        self.emulate("--scene", os.path.join(os.environ["RISLEY_SOURCE_DIR"], "data/room.yaml"))
        host = self.host()
        host.find(CODE)
        host.shake_hands(with_imu_port=False)  # as early clients do
        host.ask(0, 5, b"\1")
        host.ask(0, 4, b"\1")
        packets = host.receive_packets(110)
        rows = b"".join(one[18:] for one in packets)[:9 * 10_000]
        simulated = (self.folder / "room.lvx").read_bytes()
        # The same seed makes the same shots; the simulation rounds them as the packets do.
        told = b"".join(one[18:] for _, one in lvx_file.packets(simulated))
        self.assertEqual(rows, told)

    def test_inertial_samples(self):
        self.emulate("--sensor", "avia")
        host = self.host()
        host.find(CODE)
        host.shake_hands()
        self.assertEqual(host.ask(1, 8, b"\1"), b"\0")
        host.ask(0, 4, b"\1")
        samples = [one for one in host.receive_packets(1200) if header(one)[4] == 6]
        self.assertGreater(len(samples), 80)
        times = [header(one)[5] for one in samples]
        self.assertEqual(times, list(range(times[0], times[-1] + 1, 5_000_000)))
        self.assertEqual(struct.unpack("<6f", samples[0][18:]), (0, 0, 0, 0, 0, 1))

    def test_strangers_and_junk(self):
        process = self.emulate()
        host = self.host()
        host.find(CODE)
        host.shake_hands()
        host.ask(0, 4, b"\1")
        stranger = bound("127.0.0.66", 0)
        self.addCleanup(stranger.close)
        sensor = (ADDRESS, SENSOR_PORT)
        handshake = bytes((127, 0, 0, 66)) + struct.pack("<3H", 1, 2, 3)
        host.receive(2.0)  # by then it has what it needs for its own shots
        before = self.memory(process)
        for command_set, command, data in ((0, 4, b"\0"), (0, 6, b""), (0, 1, handshake), (0, 10, b"\0\0"), (0, 2, b"")):
            stranger.sendto(frame(0, 1, command_set, command, data), sensor)
        numbers = random.Random(1)
        for i in range(30_000):
            junk = numbers.randbytes(numbers.randrange(80))
            if i % 3 == 0:
                junk = frame(numbers.randrange(3), i, numbers.randrange(3), numbers.randrange(16), junk[:40])
            send_with_room(stranger, junk, sensor)
            if i % 10 == 0:  # from the host, and damaged
                stop = frame(0, i & 0xFFFF, 0, 4, b"\0")
                host.commands.sendto(stop[:-1] + bytes([stop[-1] ^ 1]), sensor)
                time.sleep(0.0005)
            if i % 1000 == 0:  # on a busy machine all of this takes longer than a session without heartbeats
                host.commands.sendto(frame(0, i & 0xFFFF, 0, 3), sensor)
        self.assertGreater(len(host.receive_packets(201)), 200)
        stranger.settimeout(0.2)
        with self.assertRaises(TimeoutError):
            stranger.recvfrom(100)
        if not SANITIZED:  # its allocator keeps what was freed
            self.assertLess(self.memory(process) - before, 4000)
        truth = self.truth(process)
        self.assertEqual(truth["sessions"], 1)
        self.assertGreater(truth["rejected"] + truth["kernel_drops"], 30_000)

    @staticmethod
    def memory(process):
        """kB."""
        with open(f"/proc/{process.pid}/status", encoding="ascii") as status:
            return int(next(line for line in status if line.startswith("VmRSS")).split()[1])

    def test_a_host_that_is_gone_is_forgotten(self):
        self.emulate()
        host = self.host()
        host.find(CODE)
        host.shake_hands()
        host.ask(0, 4, b"\1")
        gone = time.monotonic()
        with self.assertRaises(AssertionError):
            host.find(CODE, 3)
        host.find(CODE, 4)
        self.assertGreater(time.monotonic() - gone, 4)

    def check_counts(self, truth, recorded):
        for name in ("rows", "packets", "imu_samples", "lost", "duplicates", "reordered"):
            self.assertEqual(recorded[name], truth[name], name)
        self.assertEqual((recorded["kernel_drops"], recorded["late"], truth["unsent"]), (0, 0, 0))

    def test_record_counts_what_went_wrong(self):
        for faults in ((), ("--loss", 0.01), ("--duplication", 0.02), ("--disorder", 0.05),
                       ("--loss", 0.02, "--duplication", 0.02, "--disorder", 0.1, "--delay-ms", 30)):
            with self.subTest(faults):
                process = self.emulate(*faults, "--sensor", "avia", "--seed", 7)
                recorded = self.record("faults.lvx", "--serial", CODE, "--find-s", 20, "--duration-s", 1.5)[0]
                truth = self.truth(process)
                self.check_counts(truth, recorded)
                self.assertEqual(truth["lost"] > 0, "--loss" in faults)
                self.assertEqual(truth["duplicates"] > 0, "--duplication" in faults)
                self.assertEqual(truth["reordered"] > 0, "--disorder" in faults)

    def test_clocks(self):
        """Sources of time, drift and jumps: none of them is a loss, and losses stay counted."""
        cases = (
            (("--time", "ptp"), ["PTP"], 0),
            (("--time", "pps", "--clock-drift-ppm", 40), ["PPS"], 0),
            (("--clock-drift-ppm", -150), ["power-on"], 0),
            (("--time", "ptp", "--time-from-s", 2), ["power-on", "PTP"], 1),
            (("--time", "pps", "--clock-jump-s", 2.3, "--clock-jump-by-ms", 300), ["PPS", "PPS"], 1),
            (("--time", "pps", "--clock-jump-s", 2.3, "--clock-jump-by-ms", -250), ["PPS", "PPS"], 1),
            (("--clock-jump-s", 2, "--clock-jump-by-ms", 500), ["power-on", "power-on"], 1),
            # Back by more than its clock may have shown when it began to send.
            (("--clock-jump-s", 3, "--clock-jump-by-ms", -500), ["power-on", "power-on"], 1))
        for first in range(0, len(cases), 3):  # three at once: recording them takes most of the time
            running = []
            for place, case in enumerate(cases[first:first + 3]):
                code = f"CLOCK00000000{place}1"
                process = self.emulate("--loss", 0.01, *case[0], address=f"127.0.0.{101 + place}", code=code)
                recording = self.begin_recording(
                    f"{code}.lvx", "--serial", code, "--duration-s", 8 if case[2] == 0 else 5, "--find-s", 1.5,
                    interface=f"127.0.0.{111 + place}")
                running.append((case, process, recording, f"{code}.lvx"))
            for case, process, recording, name in running:
                with self.subTest(case[0]):
                    recorded = self.recorded(recording, name)[0]
                    self.check_clocks(*case, recorded, self.truth(process))

    def check_clocks(self, options, sources, jumps, recorded, truth):
        self.assertEqual([clock["source"] for clock in recorded["clocks"]], sources)
        self.assertEqual((recorded["clock_jumps"], truth["clock_jumps"]), (jumps, jumps))
        self.assertEqual([gap["cause"] for gap in recorded["gaps"]], ["clock"] * jumps)
        # A packet that is lost where the clock jumps cannot be distinguished from the jump.
        self.assertTrue(truth["lost"] - 3 * jumps <= recorded["lost"] <= truth["lost"],
                        (truth["lost"], recorded["lost"]))
        self.assertEqual(recorded["rows"], truth["rows"])
        clock = recorded["clocks"][-1]
        if jumps == 0:
            drift = options[-1] if "--clock-drift-ppm" in options else 0
            self.assertLess(abs(clock["drift_ppm"] - drift), 6 * clock["drift_sigma_ppm"] + 2)
            self.assertLess(clock["drift_sigma_ppm"], 100)
        if clock["source"] == "PTP":
            self.assertLess(abs(clock["offset_s"]["max"]), 0.05)
        says = {"PTP": ["PTP signal", "synchronised by PTP"], "PPS": ["PPS signal", "synchronised by PPS"]}
        self.assertEqual(recorded["status_changes"][-1]["says"], says.get(clock["source"], []))

    def test_a_recording_is_sent(self):
        self.expect(0, "simulate", "-o", "source.lvx", "--sensor", "avia", "--duration-s", 0.3, "--seed", 3,
                    "--scene", os.path.join(os.environ["RISLEY_SOURCE_DIR"], "data/room.yaml"))
        self.emulate("--recording", "source.lvx")
        host = self.host()
        self.assertEqual(host.find(CODE)[0], 7)
        host.shake_hands()
        host.ask(0, 5, b"\1")
        host.ask(0, 4, b"\1")
        rows = b"".join(one[18:] for one in host.receive_packets(1250) if header(one)[4] == 3)
        simulated = (self.folder / "source.lvx").read_bytes()
        told = b"".join(one[18:] for _, one in lvx_file.packets(simulated))
        # Depths and angles of every shot, and once more from the beginning; the tags are the emulator's.
        points = [rows[at:at + 9] for at in range(0, len(rows), 10)]
        source = [told[at:at + 9] for at in range(0, len(told), 10)]
        self.assertGreater(len(points), len(source))
        self.assertEqual(points[:len(source)], source)
        self.assertEqual(points[len(source):2 * len(source)], source[:len(points) - len(source)])

    def test_all_returns_and_gaps_of_a_recording_are_sent(self):
        def dual(number):
            body = b"".join(struct.pack("<HHIBBIBB", 9000, 100, 1000 + number, 50, 0x10,
                                        2000 + record if record % 2 else 0, 60, 0x20) for record in range(48))
            return b"\0" + struct.pack("<BBBBIBBQ", 5, 1, 1, 0, 0, 0, 5, number * 200_000) + body
        kept = [0, 1, 2, 6, 7]
        frame_bytes = b"".join(dual(number) for number in kept)
        head = b"livox_tech" + bytes(6) + b"\1\1\0\0" + struct.pack("<IIB", 0xAC0EA767, 50, 1)
        device = b"RECORDED0000011".ljust(32, b"\0") + struct.pack("<BBB6f", 0, 7, 0, *(0,) * 6)
        at = len(head + device)
        (self.folder / "dual.lvx").write_bytes(
            head + device + struct.pack("<QQQ", at, at + 24 + len(frame_bytes), 0) + frame_bytes)
        self.emulate("--recording", "dual.lvx")
        host = self.host()
        host.find(CODE)
        host.shake_hands()
        host.ask(0, 5, b"\1")
        host.ask(1, 6, b"\2")
        host.ask(0, 4, b"\1")
        packets = [one[18:] for one in host.receive_packets(20) if header(one)[4] == 5][:8]
        self.assertEqual(len(packets), 8)
        for number in range(8):
            expected = [(1000 + number, 2000 + record if record % 2 else 0) if number in kept else (0, 0)
                        for record in range(48)]
            self.assertEqual([(struct.unpack_from("<I", packets[number], 16 * record + 4)[0],
                               struct.unpack_from("<I", packets[number], 16 * record + 10)[0])
                              for record in range(48)], expected, number)

    def test_recordings_that_cannot_be_sent(self):
        for name, text, says in (("angles.sequence.csv", "Time/s,Azimuth/deg,Zenith/deg\n0,1,90\n0.00001,2,90\n", "ranges"),
                                 ("none.lvx", "", "is empty")):
            (self.folder / name).write_text(text, encoding="ascii")
            done = self.expect_json(3 if name == "none.lvx" else 2, "emulate", "--interface", ADDRESS, "--recording", name)
            self.assertIn(says, done["error"])

    def test_three_sensors_ten_times_faster(self):
        speed = 3 if SANITIZED else 10
        processes = [self.emulate("--sensor", "mid-40", "--speed", speed, address=f"127.0.0.{50 + i}",
                                  code=f"EMULATED000000{i}") for i in range(3)]
        recorded = self.record("three.lvx", "--duration-s", 2)
        self.assertEqual([one["serial"][-1] for one in recorded], ["0", "1", "2"])
        for process, one in zip(processes, recorded):
            self.check_counts(self.truth(process), one)
            self.assertEqual(one["lost"], 0)

    def test_wrong_checksums_are_survived(self):
        process = self.emulate("--wrong-checksums", 0.3, "--seed", 3)
        recorded = self.record("checksums.lvx", "--duration-s", 3, "--find-s", 4)[0]
        truth = self.truth(process)
        self.assertGreater(truth["wrong_checksums"], 0)
        self.assertEqual(recorded["rows"], truth["rows"])
        self.assertEqual(recorded["lost"], 0)

    def test_a_heartbeat_that_dies_and_a_restart(self):
        process = self.emulate("--heartbeat-dies-s", 1)
        recorded = self.record("heart.lvx", "--duration-s", 10)[0]
        truth = self.truth(process)
        self.assertEqual((truth["sessions"], recorded["sessions"]), (2, 2))
        self.assertEqual(recorded["rows"], truth["rows"])
        process = self.emulate("--restart-s", 1, "--restart-takes-s", 1)
        recorded = self.record("restart.lvx", "--duration-s", 7)[0]
        truth = self.truth(process)
        self.assertEqual((truth["restarts"], recorded["sessions"], recorded["clock_jumps"]), (1, 2, 1))
        self.assertEqual((recorded["rows"], recorded["lost"]), (truth["rows"], 0))
        self.assertEqual([gap["lost"] for gap in recorded["gaps"]], [None])

    def test_a_reboot_that_is_commanded(self):
        process = self.emulate("--restart-takes-s", 0.5)
        host = self.host()
        host.find(CODE)
        host.shake_hands()
        self.assertEqual(host.ask(0, 10, b"\0\0"), b"\0")
        self.assertIsNone(host.ask(0, 2, seconds=0.3))
        host.find(CODE, 3)
        self.assertEqual(self.truth(process)["restarts"], 1)


if __name__ == "__main__":
    unittest.main()
