#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Sensors of the second generation on the network: recorded, and emulated for a host as the maker's SDK is one."""
import http.client
import json
import re
import signal
import struct
import time
import unittest
import zlib

import schemas
from command import SANITIZED, SOURCE, ProcessTest
from control_peer import ALL_KEYS, Host, Sensor, control, packet, parse
from livox_peer import bound, send_with_room
from lvx2_file import devices, packages

ADDRESS, SERIAL, HOST = "127.0.0.71", "47MDVIRTUAL001", "127.0.0.36"
HALL = SOURCE / "data" / "hall.yaml"


class RecordMid360Test(ProcessTest):
    def emulate(self, *arguments, address=ADDRESS, serial=SERIAL, sensor="mid-360"):
        return self.start("emulate", "--interface", address, "--serial", serial, "--sensor", sensor, "--json", *arguments)

    def begin(self, name, *arguments):
        return self.start("record", "-o", name, "--interface", HOST, "--json", *arguments)

    def end(self, process, status=0):
        """What a process says at its end."""
        out, err = process.communicate(timeout=120)
        self.assertEqual(process.returncode, status, out + err)
        schemas.check_output(process.args[1:2], out)
        return json.loads(out)

    def truth(self, process):
        process.send_signal(signal.SIGTERM)
        return self.end(process)["sensors"][0]

    def wait_for(self, what, seconds=60):
        end = time.monotonic() + seconds
        while not what():
            self.assertLess(time.monotonic(), end, "it did not happen")
            time.sleep(0.02)

    def data(self, name):
        return (self.folder / name).read_bytes()

    def times(self, name):
        return [time_ns for _, time_ns, _, kind, _, _ in packages(self.data(name)) if kind != 0]

    def round_trip(self, name):
        self.expect(0, "convert", name, "-o", "again.lvx2")
        self.assertEqual(self.data("again.lvx2"), self.data(name))

    def test_a_host_as_the_makers_sdk_is_one(self):
        process = self.emulate("--time", "ptp")
        host = Host()
        self.addCleanup(host.close)
        self.assertEqual(host.find(SERIAL), (9, ADDRESS, 56100))
        self.assertEqual(host.get(0x8010), {0x8010: b"\1"})
        self.assertEqual(host.tell_where(), b"\0\0\0")
        self.assertEqual(host.set((0x0021, b"\1")), b"\x20\x21\0")  # it has no such key
        self.assertEqual(host.set((0x001A, b"\1")), b"\0\0\0")
        self.assertEqual(host.set((0x0000, b"\x11")), b"\3\0\0")
        values = host.get(*ALL_KEYS)
        self.assertEqual(tuple(values), ALL_KEYS)
        self.assertEqual(values[0x8000], SERIAL.encode().ljust(16, b"\0"))
        self.assertEqual(values[0x8002], bytes((13, 18, 2, 44)))
        states = []
        while not states or states[-1] != 1:
            state = host.get(0x8006)[0x8006][0]
            if not states or states[-1] != state:
                states.append(state)
        self.assertIn(states, ([6, 9, 1], [6, 1]))
        for kind, size in ((1, 14), (2, 8), (3, 10)):
            self.assertEqual(host.set((0x0000, bytes((kind, )))), b"\0\0\0")
            received = host.receive(host.points, 300, 56300)
            received = [one for one in received if one[10] == kind]
            numbers, clocks = [], []
            for one in received:
                version, length, interval, records, number, frame, data_type, clock, safety, check = struct.unpack_from(
                    "<BHHHHBBBB11xI", one)
                self.assertEqual((version, length, interval, records, frame, data_type, clock, safety),
                                 (0, len(one), 4750, 96, 0, kind, 1, 0))
                self.assertEqual((len(one), check), (36 + 96 * size, zlib.crc32(one[28:])))
                numbers.append(number)
                clocks.append(struct.unpack_from("<Q", one, 28)[0])
            self.assertGreater(len(numbers), 100)
            self.assertEqual(numbers, [(numbers[0] + i) % 65536 for i in range(len(numbers))])
            self.assertEqual(clocks, list(range(clocks[0], clocks[-1] + 1, 480_000)))
            self.assertLess(abs(clocks[-1] * 1e-9 - time.time()), 5)
        samples = host.receive(host.imu, 50, 56400)
        self.assertEqual({len(one) for one in samples}, {60})
        self.assertEqual([struct.unpack_from("<H", one, 7)[0] for one in samples],
                         list(range(len(samples))))
        self.assertEqual(struct.unpack_from("<6f", samples[0], 36), (0, 0, 0, 0, 0, 1))
        command, reply, _, _ = parse(host.receive(host.pushes, 1, 56200)[0])
        self.assertEqual((command, reply), (0x0102, 0))
        # The clock it follows, as it says itself.
        self.assertEqual(host.get(0x800C)[0x800C], b"\1")
        self.assertLess(abs(struct.unpack("<q", host.get(0x8009)[0x8009])[0] * 1e-9 - time.time()), 2)
        self.assertEqual(host.ask(0x0301, b"\0\1"), b"\0")
        self.assertEqual(host.ask(0x0400, b""), b"\x20")
        self.assertEqual(host.set((0x001A, b"\2")), b"\0\0\0")
        self.wait_for(lambda: host.get(0x8006)[0x8006] == b"\2")
        truth = self.truth(process)
        self.assertEqual((truth["sessions"], truth["sensor"]), (1, "Livox Mid-360"))

    def test_every_packet_is_recorded_and_counted(self):
        for faults in ((), ("--loss", 0.02, "--duplication", 0.02, "--disorder", 0.1, "--delay-ms", 30)):
            with self.subTest(faults):
                process = self.emulate("--seed", 7, "--scene", HALL, *faults)
                result = self.end(self.begin("every.lvx2", "--serial", SERIAL, "--find-s", 20, "--duration-s", 2))
                self.skip_where_the_kernel_drops(result)
                truth, recorded = self.truth(process), result["sensors"][0]
                for name in ("rows", "packets", "imu_samples", "lost", "duplicates", "reordered"):
                    self.assertEqual(recorded[name], truth[name], name)
                self.assertEqual((recorded["late"], truth["unsent"], recorded["sessions"]), (0, 0, 1))
                self.assertEqual(truth["lost"] > 0, bool(faults))
                self.assertEqual(recorded["firmware"], "13.18.2.44")
                self.assertEqual([one["work_state"] for one in recorded["reports"]][-1], "sampling")
                self.assertEqual(recorded["temperature_deg_c"], {"min": 52.13, "max": 52.13})
                self.assertEqual(devices(self.data("every.lvx2")), [(SERIAL, ADDRESS, 9)])
                info = self.expect_json(0, "info", "every.lvx2")
                self.assertEqual((info["observations"], info["imu_samples"], info["time_resets"]),
                                 (recorded["rows"], recorded["imu_samples"], 0))
                self.assertEqual(info["devices"][0]["second_generation"]["lost_packets"], recorded["lost"])
                self.round_trip("every.lvx2")

    def test_both_generations_in_one_run(self):
        process = [self.emulate(), self.emulate(address="127.0.0.72", serial="MIXED0000000011", sensor="avia")]
        recording = self.begin("both.lvx", "--duration-s", 2)
        result = self.end(recording)
        self.skip_where_the_kernel_drops(result)
        recorded = {one["serial"]: one for one in result["sensors"]}
        self.assertEqual([(one["output"], one["lost"]) for one in recorded.values()], [("both.lvx2", 0), ("both.lvx", 0)])
        for one, serial in zip(process, (SERIAL, "MIXED0000000011")):
            truth, told = self.truth(one), recorded[serial]
            self.assertEqual((told["rows"], told["packets"], told["imu_samples"]),
                             (truth["rows"], truth["packets"], truth["imu_samples"]))
            self.assertEqual(self.expect_json(0, "info", told["output"])["observations"], told["rows"])
        self.assertEqual(result["bytes"], sum((self.folder / name).stat().st_size for name in ("both.lvx", "both.lvx2")))

    def test_a_hap_that_knows_nothing_of_risley(self):
        sensor = Sensor("127.0.0.73", "6FEGEN20000002")
        self.addCleanup(sensor.stop)
        found = self.expect_json(0, "record", "--list", "--interface", HOST)
        self.assertEqual(found["sensors"], [{"serial": sensor.serial, "sensor": "Livox HAP", "address": sensor.address}])
        self.assertEqual(sensor.heard, [])
        process = self.begin("hap.lvx2", "--watch", 0)
        url = re.search(r"http://([0-9.]+):(\d+)/", process.stderr.readline())
        self.wait_for(lambda: len(sensor.sent) > 2000)
        connection = http.client.HTTPConnection(url[1], int(url[2]), timeout=20)
        connection.request("GET", "/events")
        with connection.getresponse() as reply:
            events = (json.loads(line[6:]) for line in reply if line.startswith(b"data: "))
            event = next(one for one in events
                         if (one["sensors"][0]["report"] or {}).get("work_state") == "sampling")
        connection.close()
        self.assertIn("no preset", event["sensors"][0]["optics"]["words"])
        process.send_signal(signal.SIGINT)
        result = self.end(process)
        self.skip_where_the_kernel_drops(result)
        recorded = result["sensors"][0]
        self.assertEqual((recorded["lost"], recorded["firmware"]), (0, "1.2.3.4"))
        self.assertEqual(self.times("hap.lvx2"), sensor.sent)
        # Coordinates in mm, to this host, and back to what it was; this one has no inertial samples to switch on.
        self.assertEqual(sensor.values[0x0000], b"\2")
        self.assertEqual(sensor.values[0x001A], b"\2")
        self.assertEqual([sorted(one) for one in sensor.heard],
                         [[0x0006, 0x0007], [0x0000], [0x001C], [0x001A], [0x0000], [0x001C], [0x001A]])
        self.round_trip("hap.lvx2")
        said = self.expect(2, "estimate", "hap.lvx2").stderr
        self.assertRegex(said, "optics of a Livox HAP.* not known")

    @unittest.skipIf(SANITIZED, "SKIPPED: with sanitizers the watch is slower than a sensor")
    def test_a_bend_while_recording_is_told_of(self):
        process = self.emulate("--rotor", "hunting", "--scene", HALL, "--bend", "mirror_face_b_deg=0.02", "--bend-s", 7)
        recording = self.begin("bent.lvx2", "--serial", SERIAL, "--find-s", 20, "--optics", "mid-360", "--duration-s", 11)
        optics = self.end(recording)["sensors"][0]["optics"]
        self.assertEqual((optics["alarms"], optics["unfit_pieces"], optics["dropped_packets"]), (1, 0, 0))
        alarm = optics["alarm"]
        self.assertEqual((alarm["kind"], alarm["parameter"]), ("changed", "mirror_face_b_deg"))
        self.assertLess(abs(alarm["difference"] - 0.02), 5 * alarm["sigma"])
        self.assertTrue(7 < alarm["after_s"] < 10, alarm)
        self.truth(process)

    def test_a_sensor_that_restarts(self):
        process = self.emulate("--restart-s", 2, "--restart-takes-s", 3)
        recording = self.begin("again.lvx2", "--serial", SERIAL, "--find-s", 20)
        self.wait_for(lambda: (self.folder / "again.lvx2.unfinished").exists())
        for line in recording.stderr:
            if "data come again" in line:
                break
        time.sleep(1)
        recording.send_signal(signal.SIGINT)
        recorded, truth = self.end(recording)["sensors"][0], self.truth(process)
        self.assertEqual((recorded["packets"], recorded["rows"], recorded["lost"]), (truth["packets"], truth["rows"], 0))
        self.assertEqual((recorded["sessions"], truth["restarts"]), (2, 1))
        # Points and inertial samples began again.
        self.assertEqual((recorded["clock_jumps"], [gap["cause"] for gap in recorded["gaps"]]), (2, ["clock"] * 2))
        self.assertEqual(self.expect_json(0, "info", "again.lvx2")["observations"], recorded["rows"])

    def test_a_killed_recording_can_be_read(self):
        self.emulate()
        recording = self.begin("killed.lvx2", "--serial", SERIAL, "--find-s", 20)
        unfinished = self.folder / "killed.lvx2.unfinished"
        self.wait_for(lambda: unfinished.exists() and unfinished.stat().st_size > 2_000_000)
        recording.kill()
        recording.communicate()
        info = self.expect_json(0, "info", "killed.lvx2.unfinished")
        self.assertGreater(info["observations"], 100_000)
        self.assertEqual(info["devices"][0]["second_generation"]["lost_packets"], 0)

    def test_one_netcdf_is_of_one_generation(self):
        process = [self.emulate(), self.emulate(address="127.0.0.72", serial="MIXED0000000011", sensor="mid-40")]
        failed = self.end(self.begin("both.nc", "--duration-s", 1), 2)
        self.assertIn("both generations", failed["error"])
        result = self.end(self.begin("one.nc", "--serial", SERIAL, "--find-s", 20, "--duration-s", 1))
        self.assertEqual(self.expect_json(0, "info", "one.nc")["observations"], result["sensors"][0]["rows"])
        for one in process:
            self.truth(one)

    def test_passive_and_strangers(self):
        sender = bound("127.0.0.74", 56300)
        self.addCleanup(sender.close)
        process = self.begin("passive.lvx2", "--passive", "--find-s", 1, "--data-port", 56301, "--duration-s", 1)
        points = struct.pack("<iiiBB", 3000, 100, 5, 9, 0) * 96
        number = 0
        while process.poll() is None:
            send_with_room(sender, packet(10**9 + 480_000 * number, number % 65536, points), (HOST, 56301))
            send_with_room(sender, control(0x0102), (HOST, 56301))
            number += 1
            time.sleep(0.001)
        result = self.end(process)["sensors"][0]
        self.assertEqual((result["serial"], result["sensor"], result["lost"]), ("127.0.0.74", "Livox Mid-360", 0))
        times = self.times("passive.lvx2")
        self.assertEqual(times, list(range(times[0], times[-1] + 1, 480_000)))


if __name__ == "__main__":
    unittest.main()
