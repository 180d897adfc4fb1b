#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""What may stand at the name of an output, and disks that fill up."""
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import time
import unittest

from command import COMMAND, SANITIZED, SOURCE, CommandTest, run


class OutputTest(CommandTest):
    """What may stand at an output's name, and disks that fill up."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name in ("A.NC", "B.NC", "C.NC"):
            done = run("simulate", "-o", "made.nc", "--rate-hz", "20000", "--seed", ord(name[0]),
                       folder=cls.folder)
            assert done.returncode == 0, done.stderr
            (cls.folder / "made.nc").rename(cls.folder / name)

    # Their memory may stay locked in a process forked beside threads: docs/decisions/0008.
    @unittest.skipIf(SANITIZED, "sanitizers do not stand it")
    def test_netcdf_files_of_any_name_are_converted_in_parallel(self):
        formats = {"nc": "netcdf", "sequence.csv": "scan-sequence-csv"}
        for ending in formats:
            names = []
            for name in "ABC":
                one = f"{name}.one.{ending}"
                self.expect(0, "convert", f"{name}.NC", "-o", one)
                names.append(one)
            for _ in range(5):
                done = self.expect(0, "convert", "A.NC", "B.NC", "C.NC", "-o", "together/",
                                   "--format", formats[ending])
                self.assertNotIn("HDF5", done.stderr)
                for name, one in zip("ABC", names):
                    made = list((self.folder / "together").glob(f"{name}.*"))
                    self.assertEqual(len(made), 1, made)
                    self.assertEqual(made[0].read_bytes(), (self.folder / one).read_bytes())
                    made[0].unlink()

    def test_devices_behind_a_name_survive(self):
        link = self.folder / "nothing.nc"
        link.symlink_to("/dev/null")
        self.expect(0, "convert", "A.NC", "-o", "nothing.nc")
        self.assertTrue(link.is_symlink())
        self.assertTrue(pathlib.Path("/dev/null").is_char_device())

    def test_a_fifo_gets_the_bytes(self):
        self.expect(0, "convert", "A.NC", "-o", "file.nc")
        os.mkfifo(self.folder / "fifo.nc")
        with open(self.folder / "received.nc", "wb") as received, \
                subprocess.Popen(["cat", "fifo.nc"], cwd=self.folder, stdout=received) as reader:
            self.expect(0, "convert", "A.NC", "-o", "fifo.nc")
            self.assertEqual(reader.wait(30), 0)
        self.assertEqual((self.folder / "received.nc").read_bytes(),
                         (self.folder / "file.nc").read_bytes())
        self.assertTrue((self.folder / "fifo.nc").is_fifo())

    def test_a_disk_that_fills_up_is_an_error_and_no_crash(self):
        small = self.folder / "small"
        small.mkdir()
        alone = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c"]
        mount = f"mount -t tmpfs -o size=100k none {small} && "
        if subprocess.run(alone + [mount + "true"], capture_output=True).returncode != 0:
            self.skipTest("no right to mount a small disk")
        for ending in ("nc", "sequence.csv"):
            with self.subTest(ending=ending):
                done = subprocess.run(
                    alone + [mount + f"{COMMAND} convert A.NC -o {small}/out.{ending}; "
                                     f"status=$?; ls -A {small}; exit $status"],
                    cwd=self.folder, capture_output=True, text=True)
                self.assertEqual(done.returncode, 3, done.stderr)
                self.assertIn("No space left on device", done.stderr)
                self.assertEqual(done.stdout, "")

    def test_what_cannot_be_printed_is_an_error(self):
        commands = (["info", "A.NC", "--json"], ["info", "A.NC"], ["preset", "list", "--json"],
                    ["preset", "show", "mid-40"], ["--help"], ["--version"])
        for command in commands:
            with self.subTest(command=command), open("/dev/full", "w") as full:
                done = subprocess.run([COMMAND, *command], cwd=self.folder, stdout=full,
                                      stderr=subprocess.PIPE, text=True)
                self.assertEqual(done.returncode, 3, done.stderr)
                self.assertIn("stdout: cannot be written", done.stderr)

    def test_a_closed_stdout_is_no_place_in_an_output(self):
        self.expect(0, "convert", "A.NC", "-o", "open.sequence.csv")
        done = subprocess.run(["sh", "-c", f"{COMMAND} convert A.NC -o closed.sequence.csv >&-"],
                              cwd=self.folder, stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertEqual((self.folder / "closed.sequence.csv").read_bytes(),
                         (self.folder / "open.sequence.csv").read_bytes())

    def test_a_hangup_removes_what_was_in_the_making_and_the_next_run_what_a_kill_left(self):
        before = self.names()
        for number, status, left in ((signal.SIGHUP, 130, 0), (signal.SIGKILL, -9, 2)):
            with subprocess.Popen([COMMAND, "simulate", "-o", "long.csv", "--duration-s", "1000"],
                                  cwd=self.folder, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL) as process:
                limit = time.monotonic() + 30
                while len(self.names() - before) < 2 and time.monotonic() < limit:
                    time.sleep(0.02)
                process.send_signal(number)
                self.assertEqual(process.wait(30), status)
            self.assertEqual(len(self.names() - before), left, self.names())
        self.expect(0, "simulate", "-o", "long.csv", "--rate-hz", "1000")
        self.assertEqual(self.names() - before,
                         {"long.csv", "long.csv.truth.nc", "long.csv.truth.yaml"})


class ResultTest(CommandTest):
    """Inputs and earlier results survive whatever a run does."""

    NOT_TOLD = ("--free", "wedge_angle_deg", "--free", "refractive_index_air")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        test = cls()
        test.expect(0, "simulate", "-o", "unit.lvx", "--sensor", "mid-40-table3", "--scene",
                    SOURCE / "data/hall.yaml", "--reported", "nominal", "--duration-s", "1")
        test.expect(0, "estimate", "unit.lvx", "-o", "result", "--quiet")

    def contents(self, name):
        return {path.name: path.read_bytes() for path in (self.folder / name).iterdir()}

    def copy(self, name):
        shutil.copytree(self.folder / "result", self.folder / name)
        return self.contents(name)

    def test_a_calibration_that_is_read_is_not_replaced(self):
        before = self.copy("own")
        os.link(self.folder / "own/calibration.yaml", self.folder / "linked.yaml")
        for sensor in ("own/calibration.yaml", "./own/../own/calibration.yaml", "linked.yaml"):
            for verb in ("estimate", "calibrate"):
                with self.subTest(verb=verb, sensor=sensor):
                    done = self.expect(2, verb, "unit.lvx", "--sensor", sensor, "-o", "own",
                                       *self.NOT_TOLD)
                    self.assertIn("give another name", done.stderr)
                    self.assertEqual(self.contents("own"), before)

    def test_no_output_is_an_input(self):
        text = (self.folder / "result/calibration.yaml").read_text()
        for name in ("cal.csv", "cal.yaml", "made.csv.truth.yaml", "cal.nc"):
            (self.folder / name).write_text(text)
        (self.folder / "scene.csv").write_text((SOURCE / "data/hall.yaml").read_text())
        shutil.copy(self.folder / "unit.lvx", self.folder / "same.lvx")
        (self.folder / "soft.lvx").symlink_to("same.lvx")
        os.link(self.folder / "same.lvx", self.folder / "hard.lvx")
        self.copy("drawn")
        damaged = (self.folder / "unit.lvx").read_bytes()[:200000]
        (self.folder / "cut.lvx").write_bytes(damaged)
        before = {path: path.read_bytes() for path in self.folder.rglob("*") if path.is_file()}
        for command in ("convert cut.lvx -o cut.lvx", "convert same.lvx -o hard.lvx",
                        "convert soft.lvx -o same.lvx", "convert same.lvx -o soft.lvx",
                        "convert same.lvx cut.lvx -o . --format lvx-1.1",
                        "cloud unit.lvx --calibration cal.csv -o cal.csv",
                        "cloud --calibration cal.yaml --beam-origin-map cal.yaml",
                        "preset new mine --from cal.yaml -o cal.yaml",
                        "simulate --scene scene.csv -o scene.csv",
                        "simulate --sensor made.csv.truth.yaml -o made.csv",
                        "pattern --sensor cal.yaml --report cal.yaml",
                        "pattern --sensor mid-40 --format npy -o x.npy --report x.npy",
                        "identify unit.lvx -o unit.lvx",
                        "info closed.nc --share closed.nc",
                        "report drawn -o drawn/report.json"):
            with self.subTest(command=command):
                if "closed.nc" in command:
                    self.expect(0, "convert", "unit.lvx", "-o", "closed.nc")
                    before[self.folder / "closed.nc"] = (self.folder / "closed.nc").read_bytes()
                self.expect(2, *command.split())
                self.assertEqual({path: path.read_bytes() for path in self.folder.rglob("*")
                                  if path.is_file()}, before)

    def test_a_run_that_fails_leaves_the_folder_as_it_was(self):
        before = self.copy("kept")
        (self.folder / "short.csv").write_text("Time/s,Azimuth/deg,Zenith/deg\n0.1,1.0,90.0\n")
        self.expect(1, "estimate", "short.csv", "--sensor", "mid-40", "-o", "kept")
        self.assertEqual(self.contents("kept"), before)
        self.expect(1, "calibrate", "short.csv", "--sensor", "mid-40", "-o", "kept")
        self.assertEqual(self.contents("kept"), before)

    def test_nothing_of_an_earlier_run_passes_for_one_of_the_last(self):
        before = self.copy("mixed")
        for states in ("states.earlier.nc", "states.earlier-2.nc"):
            done = self.expect(0, "estimate", "unit.lvx", "-o", "mixed", "--states", "none")
            self.assertIn(f"mixed/{states}", done.stderr)
            now = self.contents("mixed")
            self.assertNotIn("states.nc", now)
            self.assertEqual(now[states], before["states.nc"])
            (self.folder / "mixed/states.nc").write_bytes(before["states.nc"])
        calibration = (self.folder / "mixed/calibration.yaml").read_bytes()
        (self.folder / "mixed/notes.txt").write_text("mine")
        self.expect(1, "estimate", "unit.lvx", "-o", "mixed", *self.NOT_TOLD)
        now = self.contents("mixed")
        self.assertEqual(set(now), {"calibration.earlier.yaml", "states.earlier.nc", "notes.txt",
                                    "states.earlier-2.nc", "states.nc", "report.json",
                                    "report.html"})
        self.assertEqual(now["calibration.earlier.yaml"], calibration)
        self.assertIn(b"do not use these numbers", now["report.html"])

    def test_all_of_a_folder_appears_or_nothing(self):
        before = self.copy("whole")
        (self.folder / "whole/report.html").unlink()
        (self.folder / "whole/report.html").mkdir()  # the last one cannot be written
        self.expect(3, "estimate", "unit.lvx", "-o", "whole")
        (self.folder / "whole/report.html").rmdir()
        del before["report.html"]
        self.assertEqual(self.contents("whole"), before)

    def test_outputs_are_told_apart_by_their_files(self):
        (self.folder / "folder").mkdir()
        (self.folder / "other").symlink_to("folder")
        pattern = ("pattern", "--sensor", "mid-40", "--format", "npy", "--duration-s", "0.01")
        for one, other in (("x.npy", "./x.npy"), ("folder/x.npy", "other/x.npy"),
                           ("x.npy", "folder/../x.npy")):
            self.expect(2, *pattern, "-o", one, "--report", other)
        before = self.copy("page")
        for name in ("states.nc", "calibration.yaml", "report.json"):
            self.expect(3, "compare", "result", "result", "-o", f"page/{name}")
        self.assertEqual(self.contents("page"), before)

    def test_limits_and_closed_pipes_are_errors(self):
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        (self.folder / "limited").mkdir()
        done = subprocess.run([COMMAND, "convert", "unit.lvx", "-o", "limited/unit.csv"], cwd=self.folder,
                              preexec_fn=limit, stderr=subprocess.PIPE, check=False)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertEqual(list((self.folder / "limited").iterdir()), [])
        reading, writing = os.pipe()
        os.close(reading)
        done = subprocess.run([COMMAND, "preset", "show", "mid-40"], stdout=writing, stderr=subprocess.PIPE,
                              check=False)
        os.close(writing)
        self.assertEqual(done.returncode, 3, done.stderr)

    def test_a_small_stack_is_enough(self):
        done = subprocess.run(["sh", "-c", 'ulimit -s 128; exec "$0" estimate unit.lvx --quiet', str(COMMAND)],
                              cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_who_waits_for_a_pipe_ends_when_interrupted(self):
        os.mkfifo(self.folder / "scene.yaml")
        with subprocess.Popen([COMMAND, "simulate", "--scene", "scene.yaml", "-o", "waits.nc"],
                              cwd=self.folder, stderr=subprocess.DEVNULL) as process:
            time.sleep(0.3)
            began = time.monotonic()
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.wait(timeout=10), 130)
            self.assertLess(time.monotonic() - began, 2.5)

    def test_a_stopped_exchange_is_marked(self):
        self.copy("stopped")
        (self.folder / "stopped/INCOMPLETE").write_text("as a killed run leaves it")
        for words in (("report", "stopped"), ("compare", "stopped", "stopped"),
                      ("cloud", "unit.lvx", "--calibration", "stopped", "-o", "c.las"),
                      ("estimate", "unit.lvx", "--sensor", "stopped/calibration.yaml")):
            self.assertIn("INCOMPLETE", self.expect(3, *words).stderr)
        self.expect(0, "estimate", "unit.lvx", "-o", "stopped")
        self.assertNotIn("INCOMPLETE", self.contents("stopped"))


if __name__ == "__main__":
    unittest.main()
