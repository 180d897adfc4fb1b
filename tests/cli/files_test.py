#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Missing, unknown and damaged files."""
import json
import os
import pathlib
import resource
import signal
import struct
import subprocess
import time
import unittest

from command import COMMAND, SANITIZED, SOURCE, CommandTest, codes_of, run

HEADER = "Time/s,Azimuth/deg,Zenith/deg\n"
# Name, content, and what message and JSON must contain.
BAD = [
    ("missing.lvx", None, "no such file", {}),
    ("empty.lvx", b"", "empty", {"byte_offset": 0}),
    ("unknown.lvx", b"\x89PNG\r\n\x1a\n" + bytes(64), "no known kind", {"byte_offset": 0}),
    ("magic.lvx", b"livox_tick" + bytes(200), "no known kind", {"byte_offset": 0}),
    ("nan.csv", (HEADER + "0.00001,1.0,90.0\n0.00002,nan,90.0\n").encode(), "nan", {"line": 3}),
    ("word.csv", (HEADER + "0.00001,1.0,90.0\n0.00002,1.0,up\n").encode(), "up", {"line": 3}),
]


def until_it_catches(process, wanted):
    """Waits, on a busy machine, for a new process to have come to where it listens to a signal."""
    while process.poll() is None:
        status = pathlib.Path(f"/proc/{process.pid}/status").read_text(encoding="ascii")
        caught = next(line for line in status.splitlines() if line.startswith("SigCgt:"))
        if int(caught.split()[1], 16) & (1 << (wanted - 1)):
            return
        time.sleep(0.01)


class FilesTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name, content, _, _ in BAD:
            if content is not None:
                (cls.folder / name).write_bytes(content)

    def test_bad_inputs(self):
        for name, _, words, place in BAD:
            for verb in ("info", "estimate"):
                with self.subTest(name=name, verb=verb):
                    done = self.expect(3, verb, name)
                    self.assertIn(name, done.stderr)
                    self.assertIn(words, done.stderr)
                    result = self.expect_json(3, verb, name)
                    self.assertEqual(result["exit_status"], 3)
                    self.assertIn(words, result["error"])
                    for key, value in place.items():
                        self.assertEqual(result[key], value)

    def test_a_result_folder_stands_for_its_calibration(self):
        for name, preset in (("result", "avia"), ("nothing", None)):
            (self.folder / name).mkdir()
            if preset:
                text = self.expect(0, "preset", "show", preset).stdout
                (self.folder / name / "calibration.yaml").write_text(text)
        seconds = ["--duration-s", "0.01"]
        self.expect(0, "simulate", "-o", "a.sequence.csv", "--sensor", "result", *seconds)
        self.expect(0, "simulate", "-o", "b.sequence.csv", "--sensor", "avia", *seconds)
        self.assertEqual((self.folder / "a.sequence.csv").read_bytes(), (self.folder / "b.sequence.csv").read_bytes())
        inputs = self.expect_json(0, "simulate", "-o", "a.sequence.csv", "--sensor", "result", *seconds)["inputs"]
        self.assertEqual([one["path"] for one in inputs], ["result/calibration.yaml"])
        done = self.expect(3, "simulate", "-o", "c.sequence.csv", "--sensor", "nothing", *seconds)
        self.assertIn("nothing/calibration.yaml: is missing", done.stderr)

    def test_rows_before_damage_are_told(self):
        result = self.expect_json(3, "info", "nan.csv")
        self.assertEqual(result["observations"], 1)

    def test_bad_side_files(self):
        (self.folder / "bad.yaml").write_text("planes:\n  - {name: wall, distance: 3}\n")
        for arguments in (["--scene", "bad.yaml"], ["--sensor", "bad.yaml"],
                          ["--scene", "missing.yaml"]):
            before = self.names()
            done = self.expect(3, "simulate", "-o", "out.csv", *arguments)
            self.assertIn(arguments[1], done.stderr)
            self.assertEqual(self.names(), before)

    def test_unwritable_output_leaves_nothing(self):
        self.expect(0, "simulate", "-o", "good.csv", "--rate-hz", "1000")
        before = self.names()
        for arguments in (["simulate", "-o", "nowhere/out.csv", "--rate-hz", "1000"],
                          ["convert", "good.csv", "-o", "nowhere/out.csv"],
                          ["estimate", "good.csv", "-o", "good.csv/results"]):
            with self.subTest(arguments=arguments):
                done = self.expect(3, *arguments)
                self.assertIn(arguments[arguments.index("-o") + 1], done.stderr)
                self.assertEqual(self.names(), before)

    def test_interrupted_run_leaves_nothing(self):
        before = self.names()
        with subprocess.Popen([COMMAND, "simulate", "-o", "long.csv", "--duration-s", "1000"],
                              cwd=self.folder, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL) as process:
            limit = time.monotonic() + 30
            while self.names() == before and time.monotonic() < limit:
                time.sleep(0.02)
            self.assertNotEqual(self.names(), before)  # it was at work
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.wait(30), 130)
        self.assertEqual(self.names(), before)

    def test_a_run_without_a_bar_can_be_interrupted(self):
        # Reading, estimating and judging; a plan reports no progress.
        self.expect(0, "simulate", "-o", "unit.nc", "--duration-s", "5")
        before = self.names()
        for wait in (0.2, 0.5, 1.0) if not SANITIZED else (5, 10):
            with subprocess.Popen([COMMAND, "estimate", "unit.nc", "-o", "stopped", "--json",
                                   "--method", "ekf", "--rate-hz", "full"],
                                  cwd=self.folder, stdout=subprocess.PIPE,
                                  stderr=subprocess.DEVNULL) as process:
                until_it_catches(process, signal.SIGINT)
                time.sleep(wait)
                process.send_signal(signal.SIGINT)
                text = process.communicate(timeout=60 if not SANITIZED else 600)[0]
            self.assertEqual(process.returncode, 130)
            told = json.loads(text)
            self.assertEqual((told["error"], told["exit_status"]), ("interrupted", 130))
            self.assertEqual(self.names(), before)

    @unittest.skipIf(SANITIZED, "sanitizers take all addresses")
    def test_no_memory_is_a_fault_and_not_a_failed_estimate(self):
        self.expect(0, "simulate", "-o", "large.nc", "--duration-s", "20")

        def limited(megabytes, *arguments):
            def limit():
                resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))
            return subprocess.run([COMMAND, *arguments], cwd=self.folder, preexec_fn=limit,
                                  capture_output=True, text=True, timeout=300, check=False)

        enough = next(size for size in range(32, 4096, 16)
                      if limited(size, "--version").returncode == 0)
        done = limited(enough + 64, "estimate", "large.nc", "--threads", "1", "--json")
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertEqual(json.loads(done.stdout)["exit_status"], 4)

    @unittest.skipUnless(os.path.exists("/dev/full"), "no /dev/full")
    def test_full_disk_is_an_error(self):
        self.expect(3, "simulate", "-o", "/dev/full/out.csv", "--rate-hz", "1000")

    def test_hostile_files_are_refused_in_no_time(self):
        # Each once crashed, hung, took a gigabyte or invented points; see tests/golden/hostile.
        hostile = SOURCE / "tests/golden/hostile"
        for name, words in (("view-infinite.db3", "found a view"),
                            ("view-invents-points.db3", "found a view"),
                            ("bz2-claims-1GB.bag", "byte 4109"),
                            ("nc-invents-points.nc", "do not fit in a file of 68157 bytes"),
                            ("time-overflow.csv", "within 146 years")):
            with self.subTest(name=name):
                started = time.monotonic()
                self.assertIn(words, self.expect(3, "info", hostile / name).stderr)
                self.assertLess(time.monotonic() - started, 5)
        done = self.expect(3, "report", hostile / "report-covariance", "-o", "page.html")
        self.assertIn("page.correlation.matrix: 40 rows, expected 8", done.stderr)
        self.assertNotIn("page.html", self.names())

    def test_every_hostile_file_has_its_test(self):
        tests = "".join(path.read_text() for kind in ("py", "cpp", "mjs")
                        for path in (SOURCE / "tests").glob(f"*/*.{kind}"))
        for path in (SOURCE / "tests/golden/hostile").iterdir():
            self.assertIn(path.name, tests)

    def test_what_is_written_is_read(self):
        # A coordinate of -2147483.648 m.
        for ending in ("lvx", "nc", "openpylivox.csv", "sequence.csv"):
            with self.subTest(ending=ending):
                made = self.expect_json(0, "convert", SOURCE / "tests/golden/hostile/own-csv-unreadable.in",
                                        "-o", f"own.{ending}")
                self.assertGreaterEqual(made["observations"], 95)
                self.assertEqual(self.expect_json(0, "info", f"own.{ending}")["observations"],
                                 made["observations"])

    def test_escapes_are_shown_and_not_obeyed(self):
        (self.folder / "keys.yaml").write_text('"\\e[31mred\\e]0;title\\a": 1\n')
        done = self.expect(3, "simulate", "-o", "out.csv", "--scene", "keys.yaml")
        self.assertIn("\\u001b[31mred\\u001b]0;title\\u0007", done.stderr)
        self.assertNotIn("\x1b", done.stderr)
        (self.folder / "\x1b[31m.csv").write_text("no recording")
        self.assertNotIn("\x1b", self.expect(3, "info", "\x1b[31m.csv").stderr)
        self.expect(0, "simulate", "-o", "serial.lvx", "--duration-s", "0.01",
                    "--scene", SOURCE / "data/room.yaml")
        data = (self.folder / "serial.lvx").read_bytes()
        at = data.index(b"SIM")
        (self.folder / "serial.lvx").write_bytes(
            data[:at] + b"\x1b[31mA\x9b\xc2\x9bB\rC".ljust(16, b"\0") + data[at + 16:])
        for words in (("info", "serial.lvx"), ("info", "serial.lvx", "--json")):
            done = subprocess.run([COMMAND, *words], cwd=self.folder, capture_output=True)
            self.assertEqual(done.returncode, 0)
            self.assertIn(b"\\u001b[31mA", done.stdout)
            for obeyed in (b"\x1b", b"\x9b", b"\r"):
                self.assertNotIn(obeyed, done.stdout + done.stderr)

    def test_yaml_of_any_size_takes_time_in_proportion(self):
        plane = "{{name: w{}, distance_m: 30, normal_azimuth_deg: 0, normal_zenith_deg: 90}}"
        (self.folder / "keys.yaml").write_text("".join(f"key{i}: 1\n" for i in range(100000)))
        (self.folder / "planes.yaml").write_text(
            "planes:\n" + "".join(f"  - {plane.format(i)}\n" for i in range(50000)))
        for status, name in ((3, "keys.yaml"), (0, "planes.yaml")):
            started = time.monotonic()
            self.expect(status, "simulate", "-o", "one.csv", "--rate-hz", "1", "--scene", name)
            self.assertLess(time.monotonic() - started, 15)  # it was 30 s, and 0.6 s now
        scene = (SOURCE / "data/hall.yaml").read_text()
        (self.folder / "two.yaml").write_text(scene + "---\nplanes: []\n")
        done = self.expect(3, "simulate", "-o", "one.csv", "--scene", "two.yaml")
        self.assertIn("a second document", done.stderr)


def damaged_lvx(lvx):
    """The same file with a wrong packet version in its last frame."""
    data = bytearray(lvx)
    frame, last = 29 + 59 * data[28], 0
    while frame < len(data):
        last = frame
        frame = struct.unpack_from("<Q", data, frame + 8)[0]
    data[last + 24 + 1] = 99
    return bytes(data)


class LvxTest(CommandTest):
    """Recordings whose end or body is lost."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        done = run("simulate", "-o", "whole.lvx", "--duration-s", "0.5", "--scene",
                   SOURCE / "data" / "room.yaml", folder=cls.folder)
        assert done.returncode == 0, done.stderr
        cls.whole = (cls.folder / "whole.lvx").read_bytes()

    def test_cut_tail_is_a_warning(self):
        (self.folder / "cut.lvx").write_bytes(self.whole[:-1000])
        whole = self.expect_json(0, "info", "whole.lvx")
        self.assertEqual(whole["warnings"], [])
        cut = self.expect_json(0, "info", "cut.lvx")
        self.assertEqual(codes_of(cut), ["cut_off"])
        self.assertGreater(cut["warnings"][0]["byte_offset"], len(self.whole) - 3000)
        self.assertGreater(cut["warnings"][0]["lost_records"], 0)
        self.assertLess(0.9 * whole["observations"], cut["observations"])
        self.assertLess(cut["observations"], whole["observations"])
        done = self.expect(0, "convert", "cut.lvx", "-o", "cut.nc")
        self.assertIn("warning", done.stderr)
        self.assertEqual(self.expect_json(0, "info", "cut.nc")["observations"],
                         cut["observations"])

    def test_sound_part_of_a_damaged_body_is_saved(self):
        (self.folder / "damaged.lvx").write_bytes(damaged_lvx(self.whole))
        info = self.expect_json(3, "info", "damaged.lvx")
        whole = self.expect_json(0, "info", "whole.lvx")
        self.assertLess(0, info["observations"])
        self.assertLess(info["observations"], whole["observations"])
        self.assertIn("byte_offset", info)
        saved = self.expect_json(3, "convert", "damaged.lvx", "-o", "saved.nc")
        self.assertEqual(saved["observations"], info["observations"])
        self.assertEqual(self.expect_json(0, "info", "saved.nc")["observations"],
                         info["observations"])


if __name__ == "__main__":
    unittest.main()
