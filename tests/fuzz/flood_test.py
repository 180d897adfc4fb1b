#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Strangers flood every socket of a recording and of a virtual sensor: nothing of it reaches the file,
nothing is lost for it, and no process grows.

RISLEY_FLOOD_DATAGRAMS=N sends N datagrams in all, as fast as they are read, instead of a few."""
import json
import os
import pathlib
import signal
import subprocess
import tempfile
import time
import unittest

COMMAND, FLOOD = os.environ["RISLEY_COMMAND"], os.environ["RISLEY_FLOOD"]
HOST, SENSOR, STRANGER = "127.0.0.51", "127.0.0.52", "127.0.0.53"
SERIAL = "FLOODED00000011"
DATAGRAMS = int(os.environ.get("RISLEY_FLOOD_DATAGRAMS", "150000"))
PER_SECOND = 10_000 if DATAGRAMS < 1_000_000 else 40_000  # of each socket


def ports_of(process):
    """(address, port) of every UDP socket of a process."""
    sockets = set()
    for link in pathlib.Path(f"/proc/{process.pid}/fd").iterdir():
        target = os.readlink(link)
        if target.startswith("socket:["):
            sockets.add(target[8:-1])
    found = set()
    for line in pathlib.Path("/proc/net/udp").read_text(encoding="ascii").splitlines()[1:]:
        words = line.split()
        if words[9] in sockets:
            found.add(int(words[1].split(":")[1], 16))
    return found


def memory_kb(process):
    """Resident memory of a process."""
    for line in pathlib.Path(f"/proc/{process.pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1])
    raise AssertionError("no VmRSS")


class FloodTest(unittest.TestCase):
    """One sensor, one recording, and a host that belongs to neither."""

    def start(self, *words):
        # A sanitizer keeps what was freed, 256 MB of it by default.
        quarantine = "quarantine_size_mb=1:thread_local_quarantine_size_kb=64"
        options = os.environ.get("ASAN_OPTIONS", "") + ":" + quarantine
        process = subprocess.Popen([COMMAND, *words, "--json"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                   text=True, cwd=self.folder, env=os.environ | {"ASAN_OPTIONS": options})
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def end(self, process):
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate(timeout=30)
        self.assertEqual(process.returncode, 0)
        return json.loads(out)["sensors"][0] | {"strangers": json.loads(out).get("strangers")}

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="risley-flood-")  # pylint: disable=consider-using-with
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def test_every_socket(self):
        sensor = self.start("emulate", "--interface", SENSOR, "--serial", SERIAL, "--sensor", "avia")
        recording = self.start("record", "--interface", HOST, "--serial", SERIAL, "-o", "flooded.lvx")
        unfinished = pathlib.Path(self.folder) / "flooded.lvx.unfinished"
        deadline = time.monotonic() + 20
        while not unfinished.exists() or unfinished.stat().st_size < 200_000:
            self.assertLess(time.monotonic(), deadline, "no data")
            time.sleep(0.05)
        targets = [(HOST, port) for port in ports_of(recording)] + [(SENSOR, port) for port in ports_of(sensor)]
        self.assertEqual(len(targets), 5, targets)  # broadcasts of two generations, commands, data; the sensor
        each = DATAGRAMS // len(targets) + 1

        def flood(count, seed):
            floods = [subprocess.Popen([FLOOD, STRANGER, address, str(port), str(count), str(PER_SECOND),
                                        str(seed + i)], stdout=subprocess.PIPE, text=True)
                      for i, (address, port) in enumerate(targets)]
            return sum(int(one.communicate()[0]) for one in floods)

        sent = flood(each // 5, 1)  # what is taken once is not growth
        before = memory_kb(recording), memory_kb(sensor)
        sent += flood(each - each // 5, 100)
        after = memory_kb(recording), memory_kb(sensor)
        recorded, truth = self.end(recording), self.end(sensor)
        heard = recorded["rejected"] + recorded["strangers"] + truth["rejected"]
        print(f"{sent} datagrams to {len(targets)} sockets, {heard} of them counted; memory of the recording "
              f"{before[0]} to {after[0]} kB, of the sensor {before[1]} to {after[1]} kB; "
              f"{truth['rows']} rows, {recorded['lost']} packets lost, {recorded['kernel_drops']} datagrams "
              "dropped by the kernel", flush=True)
        self.assertGreaterEqual(sent, DATAGRAMS)
        self.assertGreater(heard, sent // 20)
        self.assertEqual(truth["sessions"], 1)
        self.assertEqual(recorded["sessions"], 1)
        # A kernel without room for the flood has none for the sensor either, but that is counted.
        self.assertEqual(recorded["packets"] + recorded["lost"], truth["packets"] + truth["lost"])
        if recorded["kernel_drops"] == 0:
            self.assertEqual(recorded["rows"], truth["rows"])
        for name, first, then in zip(("recording", "sensor"), before, after):
            self.assertLess(then, first + 8192, f"{name}: memory, kB")
        info = json.loads(subprocess.run([COMMAND, "info", "flooded.lvx", "--json"], cwd=self.folder,
                                         capture_output=True, check=True).stdout)
        self.assertEqual(info["observations"], recorded["rows"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
