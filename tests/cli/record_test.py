#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Recording from the network: against a sensor that knows nothing of risley, on loopback."""
import json
import signal
import struct
import subprocess
import sys
import time
import unittest
import unittest.mock

import livox_peer
import lvx_file
from command import COMMAND, ProcessTest
from livox_peer import AVIA, HORIZON, MID_40, MID_70, SENSOR_PORT, Sensor, bound, frame, packet, send_with_room

HOST = "127.0.0.1"


class RecordTest(ProcessTest):
    def setUp(self):
        super().setUp()
        self.sensors = []

    def tearDown(self):
        super().tearDown()
        for sensor in self.sensors:
            sensor.stop()

    def sensor(self, *arguments, **faults):
        self.sensors.append(Sensor(*arguments, **faults))
        return self.sensors[-1]

    def start(self, *arguments):
        return super().start("record", "--interface", HOST, *arguments)

    def wait_for(self, what, seconds=60):
        end = time.monotonic() + seconds
        while not what():
            self.assertLess(time.monotonic(), end, "it did not happen")
            time.sleep(0.02)

    def end(self, process, status=0):
        out, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, status, out + err)
        return out, err

    def size(self, name):
        """Bytes of a file, which need not be there yet."""
        return (self.folder / name).stat().st_size if (self.folder / name).exists() else 0

    def packets(self, name):
        data = (self.folder / name).read_bytes()
        return lvx_file.devices(data), list(lvx_file.packets(data))

    def times(self, name, device=0):
        return [struct.unpack_from("<Q", data, 10)[0] for index, data in self.packets(name)[1]
                if index == device and data[9] != 6]

    def record(self, name, *arguments, status=0):
        out, _ = self.end(self.start("-o", name, "--json", *arguments), status)
        return json.loads(out)

    def test_list_shows_what_is_there_and_disturbs_nobody(self):
        one = self.sensor("127.0.0.11", "PEER00000000011", MID_40)
        other = self.sensor("127.0.0.12", "PEER00000000021", AVIA)
        found = self.expect_json(0, "record", "--list", "--interface", HOST)
        self.assertEqual(found["sensors"],
                         [{"serial": "PEER00000000011", "sensor": "Livox Mid-40", "address": "127.0.0.11"},
                          {"serial": "PEER00000000021", "sensor": "Livox Avia", "address": "127.0.0.12"}])
        self.assertEqual((one.heard, other.heard), ([], []))

    def test_every_packet_of_several_sensors(self):
        mid, avia = self.sensor(), self.sensor("127.0.0.12", "3JEDPEERX000021", AVIA)
        result = self.record("two.lvx", "--duration-s", 2)
        self.assertEqual([one["serial"] for one in result["sensors"]], [mid.code, avia.code])
        devices, packets = self.packets("two.lvx")
        self.assertEqual(devices, [(mid.code, 0, MID_40), (avia.code, 1, AVIA)])
        for index, sensor in enumerate((mid, avia)):
            told = result["sensors"][index]
            self.assertEqual(self.times("two.lvx", index), sensor.times)
            self.assertEqual(told["packets"], len(sensor.times))
            self.assertEqual((told["lost"], told["kernel_drops"], told["rejected"]), (0, 0, 0))
            self.assertEqual(told["firmware"], "03.08.0000")
            self.assertEqual(sensor.spherical, 1)
            self.assertIn((0, 6), sensor.heard)
        rows = sum(one["rows"] for one in result["sensors"])
        info = self.expect_json(0, "info", "two.lvx")
        self.assertEqual(info["observations"], rows)
        self.assertEqual(rows, 100 * len(mid.times) + 96 * len(avia.times))
        # The bytes are those that came.
        first = [data for index, data in packets if index == 0][7]
        self.assertEqual(first, packet(1, mid.first_ns + 7_000_000, 7))

    def test_loss_duplicates_and_disorder_are_counted(self):
        sensor = self.sensor(loss=0.01, duplication=0.01, disorder=0.05)
        process = self.start("-o", "lossy.lvx", "--json")
        self.wait_for(lambda: sensor.lost > 20)
        process.send_signal(signal.SIGINT)
        result = json.loads(self.end(process)[0])["sensors"][0]
        self.assertEqual(result["lost"], sensor.lost)
        self.assertEqual(self.times("lossy.lvx"), sensor.times)
        self.assertEqual(result["duplicates"], sensor.sent - len(sensor.times))
        self.assertGreater(result["reordered"], 0)
        self.assertEqual(result["rows"], 100 * len(sensor.times))

    def test_a_recording_that_stands_still_for_a_while(self):
        """What came meanwhile waits in the kernel: packets that were overtaken are still put right."""
        sensor = self.sensor(disorder=0.5)
        process = self.start("-o", "still.lvx", "--json")
        for _ in range(4):
            count = len(sensor.times)
            self.wait_for(lambda: len(sensor.times) > count + 500)
            process.send_signal(signal.SIGSTOP)
            time.sleep(1.5)
            process.send_signal(signal.SIGCONT)
        self.wait_for(lambda: len(sensor.times) > count + 1000)
        process.send_signal(signal.SIGINT)
        result = json.loads(self.end(process)[0])["sensors"][0]
        self.assertEqual((result["lost"], result["late"], result["kernel_drops"]), (0, 0, 0))
        self.assertEqual(self.times("still.lvx"), sensor.times)

    def test_coordinates_and_return_modes(self):
        for sensor_type, options, data_type in (
                (MID_40, ("--coordinates", "cartesian"), 0),
                (MID_70, ("--return-mode", "first"), 3),
                (MID_70, ("--coordinates", "cartesian", "--return-mode", "strongest"), 2),
                (HORIZON, ("--coordinates", "cartesian", "--return-mode", "dual"), 4),
                (AVIA, ("--return-mode", "dual"), 5),
                (AVIA, ("--return-mode", "triple"), 8),
                (AVIA, ("--coordinates", "cartesian", "--return-mode", "triple"), 7)):
            with self.subTest(data_type):
                sensor = self.sensor(device_type=sensor_type)
                name = f"type{data_type}.lvx"
                result = self.record(name, "--serial", sensor.code, "--find-s", 20, "--duration-s", 0.3,
                                     *options)["sensors"][0]
                self.assertEqual({data[9] for _, data in self.packets(name)[1]}, {data_type})
                self.assertEqual(self.times(name), sensor.times)
                self.assertEqual(result["lost"], 0)
                self.assertEqual(result["rows"], self.expect_json(0, "info", name)["observations"])
                self.sensors.pop().stop()

    def test_a_signal_is_the_clean_end(self):
        for sent in (signal.SIGINT, signal.SIGTERM):
            sensor = self.sensor()
            process = self.start("-o", "signal.lvx", "--json")
            self.wait_for(lambda: len(sensor.times) > 500)
            process.send_signal(sent)
            out, _ = self.end(process)
            self.assertEqual(json.loads(out)["sensors"][0]["rows"], 100 * len(sensor.times))
            self.assertEqual(self.times("signal.lvx"), sensor.times)
            self.assertIn((0, 6), sensor.heard)
            self.assertFalse((self.folder / "signal.lvx.unfinished").exists())
            self.sensors.pop().stop()

    def test_strangers_never_reach_the_file(self):
        sensor = self.sensor()
        process = self.start("-o", "strange.lvx", "--json", "--serial", sensor.code)
        self.wait_for(lambda: sensor.sampling)
        stranger = bound("127.0.0.66", SENSOR_PORT)
        data_to, command_to = (HOST, sensor.host[1]), (HOST, sensor.host[2])
        for i in range(200):
            send_with_room(stranger, packet(1, 1_000_000 * i, i), data_to)
            send_with_room(stranger, frame(1, i, 0, 6, b"\0"), command_to)
            send_with_room(stranger, frame(2, i, 0, 0, b"PEER00000000661\0\1\0\0"), (HOST, 55000))
        # From the sensor's own address, but no packets.
        for junk in (b"", b"x", packet(1, 0, 0)[:-1], packet(1, 0, 0) + b"x", bytes(918), bytes(60000)):
            send_with_room(sensor.socket, junk, data_to)
        self.wait_for(lambda: len(sensor.times) > 300)
        process.send_signal(signal.SIGINT)
        result = json.loads(self.end(process)[0])["sensors"][0]
        self.assertEqual(result["rejected"], 406)
        self.assertEqual(result["lost"], 0)
        self.assertEqual(self.times("strange.lvx"), sensor.times)
        self.assertEqual(self.packets("strange.lvx")[0], [(sensor.code, 0, MID_40)])
        stranger.close()

    def test_a_killed_recording_can_be_read(self):
        sensor = self.sensor()
        process = self.start("-o", "killed.lvx")
        self.wait_for(lambda: self.size("killed.lvx.unfinished") > 600_000)
        process.kill()
        process.communicate()
        self.assertFalse((self.folder / "killed.lvx").exists())
        times = self.times("killed.lvx.unfinished")
        self.assertGreater(len(times), 600)
        self.assertEqual(times, sensor.times[:len(times)])
        info = self.expect_json(0, "info", "killed.lvx.unfinished")
        self.assertEqual(info["observations"], 100 * len(times))
        # It is not overwritten; the next one fails before it disturbs a sensor.
        self.wait_for(lambda: sensor.host is None)
        failed = self.expect_json(3, "record", "-o", "killed.lvx", "--interface", HOST)
        self.assertIn("killed.lvx.unfinished", failed["error"])
        self.assertEqual(self.times("killed.lvx.unfinished"), times)

    def test_a_sensor_that_dies_and_comes_back(self):
        sensor = self.sensor()
        process = self.start("-o", "gap.lvx", "--json")
        self.wait_for(lambda: len(sensor.times) > 500)
        self.sensors.pop().stop()
        before = sensor.times
        notes = (line for line in process.stderr if "receive buffer" not in line)  # of which few grant enough
        line = next(notes)
        self.assertIn("no data for 1 s", line)  # before it is given up
        self.assertIn("lost", next(notes))
        again = self.sensor(first_ns=1_000_000)
        self.wait_for(lambda: len(again.times) > 500)
        process.send_signal(signal.SIGINT)
        out, err = self.end(process)
        self.assertIn("data come again", err)
        result = json.loads(out)["sensors"][0]
        times = self.times("gap.lvx")
        self.assertEqual(times[-len(again.times):], again.times)
        # It may have died with packets in its hands.
        self.assertEqual(times[:len(times) - len(again.times)], before[:len(times) - len(again.times)])
        self.assertEqual((result["sessions"], result["clock_jumps"], result["lost"]), (2, 1, 0))
        self.assertEqual(len(result["gaps"]), 1)
        gap = result["gaps"][0]
        self.assertIsNone(gap["lost"])
        self.assertTrue(1 < gap["end_s"] - gap["begin_s"] < 20, gap)

    def test_netcdf_is_made_at_the_end(self):
        sensor = self.sensor(loss=0.01)
        result = self.record("converted.nc", "--duration-s", 1)
        self.assertEqual([name for name in self.names() if name.startswith("converted")], ["converted.nc"])
        self.assertEqual(result["output"], "converted.nc")
        self.assertEqual(result["bytes"], (self.folder / "converted.nc").stat().st_size)
        self.expect(0, "convert", "converted.nc", "-o", "back.lvx")
        self.assertEqual(self.times("back.lvx"), sensor.times)
        self.assertEqual(self.packets("back.lvx")[0], [(sensor.code, 0, MID_40)])
        # Until then it is an LVX file, which stays when the command is killed.
        self.sensors.pop().stop()
        sensor = self.sensor()
        process = self.start("-o", "killed.nc")
        self.wait_for(lambda: self.size("killed.nc.unfinished") > 200_000)
        process.kill()
        process.communicate()
        times = self.times("killed.nc.unfinished")
        self.assertEqual(times, sensor.times[:len(times)])
        self.assertGreater(len(times), 200)
        failed = self.expect_json(2, "record", "-o", "no.bag", "--interface", HOST)
        self.assertIn("no.bag: packets are recorded as LVX or NetCDF", failed["error"])

    def test_a_file_that_is_replaced(self):
        sensor = self.sensor()
        (self.folder / "before.lvx").write_bytes(b"before")
        (self.folder / "before.lvx").chmod(0o640)
        (self.folder / "link.lvx").symlink_to("before.lvx")
        self.record("link.lvx", "--duration-s", 0.5)
        self.assertTrue((self.folder / "link.lvx").is_symlink())
        self.assertEqual((self.folder / "before.lvx").stat().st_mode & 0o777, 0o640)
        self.assertEqual(self.times("before.lvx"), sensor.times)
        (self.folder / "folder.lvx").mkdir()
        self.wait_for(lambda: sensor.host is None)
        self.assertIn("folder.lvx", self.expect_json(3, "record", "-o", "folder.lvx", "--interface", HOST)["error"])

    def test_a_sensor_that_comes_later_cannot_join(self):
        sensor = self.sensor()
        process = self.start("-o", "later.lvx", "--json")
        self.wait_for(lambda: len(sensor.times) > 100)
        other = self.sensor("127.0.0.12", "PEER00000000021", AVIA)
        time.sleep(2.5)  # it broadcasts more than once
        process.send_signal(signal.SIGINT)
        _, err = self.end(process)
        self.assertEqual(err.count("PEER00000000021 at 127.0.0.12: appeared after the recording had begun"), 1, err)
        self.assertEqual(other.heard, [])
        self.assertEqual([code for code, _, _ in self.packets("later.lvx")[0]], [sensor.code])

    def test_what_a_sensor_says_of_itself(self):
        sensor = self.sensor()
        process = self.start("-o", "status.lvx", "--json")
        self.wait_for(lambda: len(sensor.times) > 300)
        sensor.status = 1 << 4 | 1 << 30
        self.wait_for(lambda: len(sensor.times) > 600)
        sensor.status = 0
        self.wait_for(lambda: len(sensor.times) > 900)
        process.send_signal(signal.SIGINT)
        changes = json.loads(self.end(process)[0])["sensors"][0]["status_changes"]
        self.assertEqual([one["says"] for one in changes], [[], ["motor: warning", "system: warning"], []])
        self.assertEqual([one["status"] for one in changes], [0, 1 << 4 | 1 << 30, 0])
        # Packets 300, 600 and some later are a millisecond apart by their own clock.
        self.assertTrue(0 < changes[1]["begin_s"] < changes[2]["begin_s"], changes)
        # The file has them, too: every packet has its status.
        stored = [struct.unpack_from("<I", data, 4)[0] for _, data in self.packets("status.lvx")[1]]
        self.assertEqual([stored[i] for i in range(len(stored)) if i == 0 or stored[i] != stored[i - 1]],
                         [0, 1 << 4 | 1 << 30, 0])

    def test_a_sensor_that_is_silent_for_a_while(self):
        sensor = self.sensor()
        process = self.start("-o", "pause.lvx", "--json")
        self.wait_for(lambda: len(sensor.times) > 500)
        sensor.loss = 1.0
        time.sleep(2)
        sensor.loss = 0.0
        count = len(sensor.times)
        self.wait_for(lambda: len(sensor.times) > count + 500)
        process.send_signal(signal.SIGINT)
        out, err = self.end(process)
        self.assertIn("no data for 1 s", err)
        result = json.loads(out)["sensors"][0]
        self.assertEqual(result["lost"], sensor.lost)
        self.assertEqual([gap["lost"] for gap in result["gaps"]], [sensor.lost])
        self.assertEqual(result["sessions"], 1)

    def test_a_real_interface_that_goes_down(self):
        """Two namespaces with a cable between them, which is pulled for a while."""
        script = """set -e
            mount -t tmpfs none /run; mkdir /run/netns; ip netns add sensor
            ip link add host type veth peer name there netns sensor
            ip link add other type veth peer name nobody
            ip addr add 192.168.1.5/24 dev host; ip addr add 10.9.9.1/24 brd + dev other
            ip netns exec sensor ip addr add 192.168.1.41/24 dev there
            ip netns exec sensor ip link set there up
            for one in lo host other nobody; do ip link set $one up; done
            echo ready
            ip netns exec sensor "$0" emulate --interface 192.168.1.41 --sensor avia --json > emulated.json &
            emulating=$!
            "$0" record --list --interface 10.9.9.1 --json > elsewhere.json
            "$0" record --interface 192.168.1.5 -o cable.lvx --json > recorded.json 2> cable.txt &
            recording=$!
            until [ "$(stat -c %s cable.lvx.unfinished 2> /dev/null || echo 0)" -gt 2000000 ]; do sleep 0.1; done
            ip link set host down; sleep 4; ip link set host up
            until grep -q "data come again" cable.txt; do sleep 0.1; done
            sleep 1
            for one in $recording $emulating; do kill -TERM $one; wait $one; done"""
        began = time.monotonic()
        done = subprocess.run(["unshare", "-rnm", "bash", "-c", script, COMMAND], cwd=self.folder, text=True,
                              capture_output=True, timeout=120, check=False)
        elapsed = time.monotonic() - began
        if not done.stdout.startswith("ready"):
            print(f"SKIPPED: namespaces cannot be made: {done.stderr}", file=sys.stderr)
            self.skipTest("namespaces")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads((self.folder / "elsewhere.json").read_text())["sensors"], [])
        result = json.loads((self.folder / "recorded.json").read_text())["sensors"][0]
        truth = json.loads((self.folder / "emulated.json").read_text())["sensors"][0]
        # Between two sessions the sensor sends nothing, but since when is unknown: the gap of a session says how many
        # packets may be missing.
        of = {cause: sum(gap["lost"] for gap in result["gaps"] if gap["cause"] == cause) for cause in ("loss", "session")}
        self.assertGreater(of["session"], 0)
        made = truth["packets"] + truth["lost"] + truth["lost_at_ends"]
        self.assertLessEqual(result["packets"] + result["lost"], made, (result, truth))
        self.assertGreaterEqual(result["packets"] + result["lost"] + of["session"], truth["packets"])
        self.assertLess(result["packets"] + of["session"], elapsed * (2500 + 200))
        self.assertEqual({gap["data"] for gap in result["gaps"]}, {"points", "imu"})
        self.assertGreaterEqual(result["lost"], of["loss"])
        longest = max(gap["end_s"] - gap["begin_s"] for gap in result["gaps"])
        self.assertTrue(3.5 < longest < elapsed, result["gaps"])
        self.assertIn("no data for 1 s", (self.folder / "cable.txt").read_text())

    def test_a_full_disk(self):
        sensor = self.sensor()
        (self.folder / "small").mkdir()
        script = """mount -t tmpfs -o size=1M none small && echo ready
            "$0" record --interface 127.0.0.1 -o small/full.lvx --duration-s 20; echo $?; ls small
            "$0" info small/full.lvx.unfinished --json > full.json"""
        done = subprocess.run(["unshare", "-rm", "bash", "-c", script, COMMAND], cwd=self.folder, text=True,
                              capture_output=True, timeout=120, check=False)
        if not done.stdout.startswith("ready"):
            print(f"SKIPPED: no small disk can be made: {done.stderr}", file=sys.stderr)
            self.skipTest("namespaces")
        self.assertEqual(done.stdout.split(), ["ready", "3", "full.lvx.unfinished"])
        self.assertRegex(done.stderr, "full.lvx.unfinished: byte.*No space left on device; .*recorded")
        info = json.loads((self.folder / "full.json").read_text())
        self.assertGreater(info["observations"], 80_000)
        self.assertEqual(info["warnings"], [])
        self.wait_for(lambda: not sensor.sampling)

    def test_passive_listens_and_sends_nothing(self):
        sender, other = bound("127.0.0.21", 0), bound("127.0.0.22", 0)
        process = self.start("-o", "passive.lvx", "--json", "--passive", "--find-s", 1, "--data-port",
                             56101, "--duration-s", 1)
        number = 0
        while process.poll() is None:
            send_with_room(sender, packet(1, number * 1_000_000, number), (HOST, 56101))
            send_with_room(other, packet(3, number * 960_000, number), (HOST, 56101))
            number += 1
            time.sleep(0.001)
        result = json.loads(self.end(process)[0])
        self.assertEqual([(one["serial"], one["sensor"], one["lost"]) for one in result["sensors"]],
                         [("127.0.0.21", "Livox Mid-40", 0), ("127.0.0.22", "Livox Mid-70", 0)])
        for index, step in enumerate((1_000_000, 960_000)):
            times = self.times("passive.lvx", index)
            self.assertGreater(len(times), 10)  # the rest was sent while it started and looked
            self.assertEqual(times, list(range(times[0], times[-1] + 1, step)))
        for one in (sender, other):
            one.setblocking(False)
            with self.assertRaises(BlockingIOError):
                one.recv(100)
            one.close()

    def test_nobody_is_there(self):
        failed = self.expect_json(3, "record", "-o", "nobody.lvx", "--interface", HOST, "--find-s", 0.3)
        self.assertIn("no sensor was heard", failed["error"])
        self.assertIn("127.0.0.1:55000", failed["error"])
        self.sensor()
        failed = self.expect_json(3, "record", "-o", "nobody.lvx", "--interface", HOST, "--find-s", 1.2,
                                  "--serial", "PEER00000000991")
        self.assertIn("PEER00000000991", failed["error"])
        self.assertEqual(self.expect_json(0, "record", "--list", "--interface", "127.0.0.2", "--find-s",
                                          0.1)["sensors"], [])
        self.assertFalse((self.folder / "nobody.lvx.unfinished").exists())

    def test_packets_that_are_all_rejected_end_too(self):
        sound = livox_peer.packet
        with unittest.mock.patch.object(livox_peer, "packet", lambda *a, **k: b"\x09" + sound(*a, **k)[1:]):
            self.sensor()
            began = time.monotonic()
            _, err = self.end(self.start("-o", "rejected.lvx", "--duration-s", "0.5"), 3)
        self.assertIn("rejected", err)
        self.assertLess(time.monotonic() - began, 20)

    def test_another_program_has_the_port(self):
        other = bound(HOST, 55000)
        failed = self.expect_json(3, "record", "--list", "--interface", HOST)
        self.assertIn("127.0.0.1:55000: Address already in use: another program", failed["error"])
        other.close()


if __name__ == "__main__":
    unittest.main()
