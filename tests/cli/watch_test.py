#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Watching the optics while recording: alarms, the status line and the page."""
import http.client
import json
import os
import pty
import re
import select
import signal
import socket
import subprocess
import time
import unittest

import schemas
from command import COMMAND, SANITIZED, ProcessTest

HOST, CODE = "127.0.0.35", "WATCHED00000011"
BEND = "prism_tilt_b_vertical_deg=0.02"
in_real_time = unittest.skipIf(SANITIZED, "SKIPPED: with sanitizers the watch is slower than a sensor")


def events(url, seconds):
    """Events of the page until the recording is over."""
    connection = http.client.HTTPConnection(*url, timeout=seconds)
    connection.request("GET", "/events")
    reply = connection.getresponse()
    assert reply.status == 200, reply.status
    with reply:
        for line in reply:
            if line.startswith(b"data: "):
                yield json.loads(line[6:])
    connection.close()


class WatchTest(ProcessTest):
    def emulate(self, *arguments, address="127.0.0.45", code=CODE):
        return self.start("emulate", "--interface", address, "--serial", code, "--rotor", "hunting", *arguments)

    def record(self, name, *arguments, code=CODE, **options):
        return self.start("record", "-o", name, "--interface", HOST, "--serial", code, "--find-s", 20, *arguments,
                          **options)

    def page(self, process):
        """Address and port of a recording's page."""
        line = process.stderr.readline()
        found = re.search(r"http://([0-9.]+):(\d+)/", line)
        self.assertTrue(found, line)
        return found[1], int(found[2])

    def end(self, process, status=0):
        out, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, status, out + err)
        return out, err

    @in_real_time
    def test_a_bend_while_recording_is_told_of_within_five_seconds(self):
        bend_s = 7
        self.emulate("--bend", BEND, "--bend-s", bend_s)
        process = self.record("bent.lvx", "--watch", 0, "--duration-s", bend_s + 7, "--json")
        alarmed_at, phases = None, []
        for event in events(self.page(process), 30):
            optics = event["sensors"][0]["optics"]
            if not phases or phases[-1] != optics["phase"]:
                phases.append(optics["phase"])
            if optics["alarmed"] and alarmed_at is None:
                alarmed_at = event["duration_s"]
        self.assertTrue(event["over"])
        self.assertEqual(phases, ["waiting", "beginning", "watching"])
        self.assertIsNotNone(alarmed_at)
        self.assertGreater(alarmed_at, bend_s)
        self.assertLess(alarmed_at, bend_s + 5)
        out, err = self.end(process)
        schemas.check_output(("record",), out)
        sensor = json.loads(out)["sensors"][0]
        self.assertEqual(sensor["lost"], 0)
        optics = sensor["optics"]
        self.assertEqual((optics["alarms"], optics["alarm"]["kind"]), (1, "changed"))
        self.assertEqual(optics["alarm"]["parameter"], "prism_tilt_b_vertical_deg")
        self.assertLess(abs(optics["alarm"]["difference"] - 0.02), 5 * optics["alarm"]["sigma"])
        self.assertEqual((optics["dropped_packets"], optics["unfit_pieces"]), (0, 0))
        self.assertRegex(err, CODE + ": its optics have changed: prism_tilt_b_vertical_deg, if nothing else "
                              r"differs, is \+0.0[12]\d* \+- .* by chance is (at most|below) [1-9]")

    @in_real_time
    def test_a_unit_that_stays_as_it_is_raises_no_alarm(self):
        self.emulate("--sensor", "avia", "--loss", 0.01, address="127.0.0.46", code="WATCHED00000021")
        process = self.record("well.lvx", "--optics", "avia", "--duration-s", 8, code="WATCHED00000021")
        out, err = self.end(process)
        self.assertIn("WATCHED00000021: no change of the optics detected", out)
        self.assertNotIn("changed", err)

    def test_a_unit_that_is_not_its_reference_is_told_of(self):
        self.emulate("--set", "prism_tilt_b_vertical_deg=3")
        seconds = 30 if SANITIZED else 8  # for the same five pieces
        process = self.record("other.lvx", "--optics", "mid-40", "--duration-s", seconds, "--json")
        out, err = self.end(process)
        optics = json.loads(out)["sensors"][0]["optics"]
        self.assertTrue(optics["is_reference"])
        self.assertEqual(optics["alarm"]["kind"], "unlike")
        self.assertIn("its optics are not those of mid-40", err)
        process = self.record("other.lvx", "--optics", "avia", "--duration-s", 1)
        self.assertIn("name another", self.end(process, 2)[1])

    def test_browsers_never_disturb_the_recording(self):
        self.emulate("--speed", 4)
        process = self.record("crowd.lvx", "--watch", 0, "--duration-s", 6, "--json")
        url = self.page(process)
        crowd = [socket.create_connection(url) for _ in range(20)]
        for one in crowd:  # ask, and never read
            one.sendall(b"GET /events HTTP/1.1\r\nHost: %s:%d\r\n\r\n" % (url[0].encode(), url[1]))
        for _ in range(300):
            socket.create_connection(url).close()
        strange = http.client.HTTPConnection(*url, timeout=10)
        strange.request("GET", "/events", headers={"Host": "example.org"})
        self.assertEqual(strange.getresponse().status, 403)
        strange.close()
        out, _ = self.end(process)
        self.skip_where_the_kernel_drops(json.loads(out))
        sensor = json.loads(out)["sensors"][0]
        self.assertEqual((sensor["lost"], sensor["kernel_drops"]), (0, 0))
        self.assertGreater(sensor["packets"], 5000)
        for one in crowd:
            one.close()

    def test_a_line_on_a_terminal_and_none_elsewhere(self):
        self.emulate()
        controller, terminal = pty.openpty()
        process = self.record("line.lvx", "--optics", "own", stderr=terminal)
        os.close(terminal)
        shown, end = b"", time.monotonic() + 20
        while b"getting to know them" not in shown.replace(b"\r\n", b""):
            self.assertLess(time.monotonic(), end, shown)
            if select.select([controller], [], [], 1)[0]:
                try:
                    shown += os.read(controller, 4096)
                except OSError:  # the terminal is closed
                    self.fail((process.wait(), shown))
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate(timeout=20)
        self.assertEqual(process.returncode, 0)
        os.close(controller)
        self.assertRegex(shown, rb"\r\x1b\[K[0-9.]+ s \| WATCHED00000011: [0-9 \xe2\x80\xaf,]+ packets, 0 lost")
        self.assertIn("optics not compared: the recording is too short", out)
        _, err = self.end(self.record("line.lvx", "--duration-s", 1))
        self.assertNotIn("\x1b", err)

    def test_what_cannot_be_is_refused(self):
        for arguments, words in (
                (("record", "-o", "x.lvx", "--interface", HOST, "--watch", "here"), "expected a port"),
                (("record", "-o", "x.lvx", "--interface", HOST, "--watch", "0.0.0.0:0"), "0.0.0.0"),
                (("record", "-o", "x.lvx", "--interface", HOST, "--optics", "no-such-sensor"), "no-such-sensor"),
                (("emulate", "--interface", "127.0.0.45", "--bend", BEND), "--bend-s"),
                (("emulate", "--interface", "127.0.0.45", "--bend", "nothing_deg=1", "--bend-s", 1), "nothing_deg")):
            done = subprocess.run([COMMAND, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True,
                                  timeout=60, check=False)
            self.assertNotEqual(done.returncode, 0, arguments)
            self.assertIn(words, done.stderr, arguments)


if __name__ == "__main__":
    unittest.main()
