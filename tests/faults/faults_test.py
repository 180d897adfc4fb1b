#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Every verb while calls of the C library fail, one at a time: the old output stays whole or the new
one is there whole, the exit status says which, and nothing else is left behind.

RISLEY_EVERY_FAULT=1 lets each of the first 200 calls of a kind fail, which takes minutes."""
import concurrent.futures
import filecmp
import os
import pathlib
import random
import shutil
import subprocess
import tempfile
import time
import unittest

COMMAND = os.environ["RISLEY_COMMAND"]
SOURCE = pathlib.Path(os.environ["RISLEY_SOURCE_DIR"])
FAULTS = os.environ["RISLEY_FAULTS"]
EVERY = os.environ.get("RISLEY_EVERY_FAULT")
SANITIZED = os.environ.get("RISLEY_SANITIZED") == "ON"  # with a malloc that cannot fail

# Which calls of a kind fail: each, or some that come closer to each other where runs are short.
NUMBERS = range(1, 201) if EVERY else (1, 2, 7, 40)

# Status of a run that met the fault. What is not written is a matter of files; libraries report a lack
# of memory as an error of the file that they were at.
STATUSES = {"write": {3}, "sync": {3}, "rename": {3}, "create": {3}, "close": {3}}
if not SANITIZED:
    STATUSES["memory"] = {3, 4}

# Name, arguments, output; inputs are made by make_inputs().
FILES = [(f"convert to {ending}", ["convert", "walls.nc", "-o"], f"out.{ending}")
         for ending in ("nc", "lvx", "openpylivox.csv", "sequence.csv")]
FILES += [(f"cloud to {ending}", ["cloud", "walls.nc", "--calibration", "mid-40", "-o"],
           f"out.{ending}") for ending in ("las", "ply", "pcd", "csv", "npy", "nc", "bag")]
FILES += [(f"pattern to {name}", ["pattern", "--sensor", "avia", "--duration-s", "0.002", "--format",
                                  name, "-o"], f"out.{ending}")
          for name, ending in (("livox-csv", "csv"), ("npy", "npy"), ("helios-xml", "xml"),
                               ("json", "json"), ("usda", "usda"))]
FILES += [("simulate", ["simulate", "--duration-s", "0.01", "-o"], "out.nc"),
          ("preset new", ["preset", "new", "mine", "--from", "mid-40", "-o"], "out.yaml"),
          ("report", ["report", "result", "-o"], "out.html"),
          ("compare", ["compare", "result", "result", "-o"], "out.html"),
          ("compare a table", ["compare", "table.csv", "-o"], "out.html"),
          ("campaign", ["campaign", "plan.yaml", "--merge", "-o", "campaign", "--table"], "out.csv")]
FILES += [("page of a pattern", ["pattern", "--sensor", "avia", "--duration-s", "0.002", "--report"],
           "out.html"),
          ("map of beam origins", ["cloud", "--calibration", "mid-40", "--beam-origin-map"], "map.html")]
FILES += [("excerpt", ["info", "walls.nc", "--share"], "out.nc"),
          ("convert a trajectory", ["convert", "trajectory.csv", "-o"], "out.csv")]
FLIGHT = ["--trajectory", "trajectory.csv", "--mount", str(SOURCE / "data/mount-nadir.yaml")]
TRAJECTORY_ERRORS = ["--trajectory-errors", str(SOURCE / "data/trajectory-errors.yaml")]
SIMULATED_FLIGHT = ["simulate", *FLIGHT, "--scene", str(SOURCE / "data/village.yaml"), "--rate-hz", "2000",
                    "--duration-s", "0.2", "-o"]
if EVERY:  # which take longer
    FILES += [("simulate a flight", SIMULATED_FLIGHT, "out.nc"),
              ("cloud of a flight", ["cloud", "flown.nc", "--calibration", "mid-40", *FLIGHT, "-o"], "out.las"),
              ("identify", ["identify", "short.nc", "-o"], "out.yaml")]
FOLDERS = [("estimate", ["estimate", "walls.nc", "-o"], "result"),
           ("calibrate", ["calibrate", "walls.nc", "-o"],
            "result")]
if EVERY:
    FOLDERS += [("calibrate a flight", ["calibrate", "strips.lvx", "--trajectory", "strips.lvx.trajectory.csv",
                                        "--mount", str(SOURCE / "data/mount-as-built.yaml"), *TRAJECTORY_ERRORS, "-o"],
                 "result"),
                ("reproduce", ["reproduce", "-o"], "result")]  # a minute each
STDOUT = [("info", ["info", "walls.nc", "--json"]), ("estimate", ["estimate", "walls.nc", "--json"]),
          ("observability", ["observability", "walls.nc", "--json"]),
          ("trajectory", ["info", "trajectory.csv", "--json"]),
          ("plan", ["calibrate", "--plan", str(SOURCE / "data/room.yaml"), "--duration-s", "1", "--json"])]


def run(folder, arguments, fault=None):
    """The finished process, and whether the fault happened."""
    environment = dict(os.environ)
    fired = folder / ".fired"
    if fault:
        environment |= {"LD_PRELOAD": FAULTS, "RISLEY_FAULT": f"{fault[0]} {fault[1]}",
                        "RISLEY_FAULT_FIRED": str(fired)}
    done = subprocess.run([COMMAND, *arguments, "--threads", "1"], cwd=folder, env=environment,
                          capture_output=True, timeout=600, check=False)
    happened = fired.exists()
    if happened:
        fired.unlink()
    return done, happened


def state(folder):
    """Bytes of every file below a folder, by name."""
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(folder.rglob("*")) if path.is_file()}


def same_run(one, other):
    """Whether two outputs are of runs alike: times and random names within them may differ."""
    return len(one) == len(other) or abs(len(one) - len(other)) < 200 + len(one) // 50


class Faults(unittest.TestCase):
    """Each case in a folder of its own, copied from one with inputs and old outputs."""

    @classmethod
    def setUpClass(cls):
        cls.root = pathlib.Path(tempfile.mkdtemp(prefix="risley-faults-"))
        inputs = cls.root / "inputs"
        inputs.mkdir()
        for name, more in (("walls.nc", ["--duration-s", "0.3", "--seed", "1"]),
                           ("old.nc", ["--duration-s", "0.35", "--seed", "2"])):
            done, _ = run(inputs, ["simulate", "-o", name, "--rate-hz", "10000", "--scene",
                                   str(SOURCE / "data/room.yaml"), *more])
            assert done.returncode == 0, done.stderr
        done, _ = run(inputs, ["estimate", "old.nc", "-o", "result"])
        assert done.returncode == 0, done.stderr
        shutil.copytree(inputs / "result", inputs / "twice")
        (inputs / "table.csv").write_text("input,output,exit_status,message\nold.nc,result,0,\nagain.nc,twice,0,\n")
        (inputs / "plan.yaml").write_text(
            "simulate: {duration_s: 0.1, rate_hz: 1000, format: sequence.csv}\nestimate: {sensor: mid-40}\n"
            "seeds: {count: 2}\n")
        done, _ = run(inputs, ["campaign", "plan.yaml", "--chunk", "1/1", "-o", "campaign"])
        assert done.returncode == 0, done.stderr
        done, _ = run(inputs, ["simulate", "-o", "flight.lvx", "--flight", str(SOURCE / "data/flight-s4.yaml"),
                               *FLIGHT[2:], "--scene", str(SOURCE / "data/village.yaml"), "--rate-hz", "100",
                               "--duration-s", "0.1"])
        assert done.returncode == 0, done.stderr
        lines = (inputs / "flight.lvx.trajectory.csv").read_text().splitlines(keepends=True)
        for left in inputs.glob("flight.lvx*"):
            left.unlink()
        (inputs / "trajectory.csv").write_text("".join(lines[:120]))
        if EVERY:
            (inputs / "strips.yaml").write_text(
                "risley_flight: 1\nrate_hz: 200\nheight_m: 40\nspeed_m_per_s: 3\nturn_duration_s: 4\n"
                "strips: [{headings_deg: [90, 270, 0, 180], length_m: 33}]\n")
            for arguments in (SIMULATED_FLIGHT + ["flown.nc"],
                              ["simulate", "-o", "strips.lvx", "--flight", "strips.yaml", *FLIGHT[2:], "--scene",
                               str(SOURCE / "data/village.yaml"), "--rate-hz", "300", *TRAJECTORY_ERRORS],
                              ["simulate", "-o", "short.nc", "--duration-s", "0.05", "--rate-hz", "10000"]):
                done, _ = run(inputs, arguments)
                assert done.returncode == 0, done.stderr
        cls.inputs = inputs

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.root)

    def copy_of_inputs(self):
        """A new folder with the inputs and old outputs."""
        folder = pathlib.Path(tempfile.mkdtemp(dir=self.root))
        shutil.copytree(self.inputs, folder, dirs_exist_ok=True)
        return folder

    def whole_run(self, arguments, output):
        """What a run without a fault leaves, inputs included."""
        folder = self.copy_of_inputs()
        done, _ = run(folder, [*arguments, output])
        self.assertEqual(done.returncode, 0, f"{arguments}: {done.stderr}")
        return state(folder)

    def each(self, cases, check, at_a_time=2):
        """Runs check(case, kind, number) until a kind of call does not happen any more."""
        wrong = []

        def all_of(case_and_kind):
            case, kind = case_and_kind
            seen = 0
            for number in NUMBERS:
                folder = self.copy_of_inputs()
                try:
                    if not check(folder, case, kind, number):
                        break
                    seen += 1
                except AssertionError as error:
                    seen += 1
                    wrong.append(str(error))
                finally:
                    shutil.rmtree(folder)
            return seen
        jobs = [(case, kind) for case in cases for kind in STATUSES]
        with concurrent.futures.ThreadPoolExecutor(at_a_time) as pool:
            faults = sum(pool.map(all_of, jobs))
        print(f"{faults} faults in {len(cases)} cases, {len(wrong)} with a wrong end", flush=True)
        self.assertEqual(wrong, [], "\n".join(wrong))
        self.assertGreater(faults, 3 * len(cases))

    def expect_status(self, done, kind, where):
        """A fault is reported by status and message, or did no harm."""
        self.assertIn(done.returncode, STATUSES[kind] | {0}, f"{where}: {done.stderr[-600:]}")
        if done.returncode != 0:
            self.assertIn(b"error", done.stderr, where)


class FilesTest(Faults):
    """What computes from files."""

    def test_a_file_is_the_old_or_the_new_one(self):
        expected = {name: self.whole_run(arguments, output) for name, arguments, output in FILES}

        def check(folder, case, kind, number):
            name, arguments, output = case
            where = f"{name}, {kind} {number}"
            old = b"of an earlier run"
            if output.endswith(".html"):  # nothing but a page is replaced by one
                old = (folder / "result" / "report.html").read_bytes() + b"<!-- of an earlier run -->"
            (folder / output).write_bytes(old)
            done, happened = run(folder, [*arguments, output], (kind, number))
            if not happened:
                self.assertEqual(done.returncode, 0, f"{where}: {done.stderr}")
                return False
            self.expect_status(done, kind, where)
            after = state(folder)
            self.assertEqual(set(after) - set(expected[name]), set(), f"{where}: left behind")
            if after[output] == old:
                self.assertNotEqual(done.returncode, 0, f"{where}: nothing was written")
            else:
                self.assertTrue(same_run(after[output], expected[name][output]),
                                f"{where}: half an output, {len(after[output])} bytes")
            for other, content in expected[name].items():
                if other in after and other not in (output,):
                    self.assertTrue(same_run(after[other], content), f"{where}: half of {other}")
            return True
        self.each(FILES, check)

    def test_a_folder_is_of_one_run_or_says_that_it_is_not(self):
        expected = {name: {one.removeprefix(f"{output}/"): content
                           for one, content in self.whole_run(arguments, output).items()
                           if one.startswith(f"{output}/")}
                    for name, arguments, output in FOLDERS}
        before = state(self.inputs / "result")

        def check(folder, case, kind, number):
            name, arguments, output = case
            where = f"{name}, {kind} {number}"
            done, happened = run(folder, [*arguments, output], (kind, number))
            if not happened:
                self.assertEqual(done.returncode, 0, f"{where}: {done.stderr}")
                return False
            self.expect_status(done, kind, where)
            after = state(folder / output)
            extra = {one for one in set(after) - set(before) - set(expected[name])
                     if ".earlier" not in one and one != "INCOMPLETE"}
            self.assertEqual(extra, set(), f"{where}: left behind")
            if "INCOMPLETE" in after:
                self.assertNotEqual(done.returncode, 0, where)
                return True
            is_old = all(after.get(one) == content for one, content in before.items())
            is_new = all(one in after and after[one] != before.get(one) and
                         same_run(after[one], content) for one, content in expected[name].items())
            self.assertTrue(is_old or is_new, f"{where}: of two runs")
            if done.returncode == 0:
                self.assertTrue(is_new, f"{where}: nothing was written")
            return True
        self.each(FOLDERS, check)

    def test_what_cannot_be_printed_is_no_success(self):
        def check(folder, case, kind, number):
            name, arguments = case
            where = f"{name}, {kind} {number}"
            done, happened = run(folder, arguments, (kind, number))
            if not happened:
                return False
            self.expect_status(done, kind, where)
            if done.returncode == 0:
                self.assertTrue(done.stdout.rstrip().endswith(b"}"), where)
            return True
        for case in STDOUT:  # which write no files
            for kind in STATUSES.keys() & {"write", "memory"}:
                for number in NUMBERS:
                    if not check(self.inputs, case, kind, number):
                        break

    def test_a_killed_run_leaves_the_old_or_the_new_file(self):
        reference = self.copy_of_inputs()
        arguments = ["convert", "walls.nc", "-o", "out.lvx"]
        begin = time.monotonic()
        done, _ = run(reference, arguments)
        self.assertEqual(done.returncode, 0)
        length = time.monotonic() - begin
        moments = random.Random(1)
        for _ in range(200 if EVERY else 12):
            folder = self.copy_of_inputs()
            (folder / "out.lvx").write_bytes(b"old")
            with subprocess.Popen([COMMAND, *arguments], cwd=folder, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL) as process:
                time.sleep(1.2 * length * moments.random())
                process.kill()
            if (folder / "out.lvx").read_bytes() != b"old":
                self.assertTrue(filecmp.cmp(folder / "out.lvx", reference / "out.lvx", False))
            done, _ = run(folder, arguments)  # and the next one clears up
            self.assertEqual(done.returncode, 0)
            self.assertEqual(set(state(folder)), set(state(reference)))
            shutil.rmtree(folder)


class RecordingTest(Faults):
    """What needs the ports of sensors."""

    def test_a_recording_is_the_new_one_or_unfinished(self):
        serial, unfinished = "FAULTS000000011", "out.lvx.unfinished"
        arguments = ["record", "--interface", "127.0.0.1", "--serial", serial, "--find-s", "5",
                     "--duration-s", "0.2", "-o", "out.lvx"]

        def check(folder, _, kind, number):
            where = f"record, {kind} {number}"
            old = b"of an earlier run"
            (folder / "out.lvx").write_bytes(old)
            done, happened = run(folder, arguments, (kind, number))
            if not happened:
                self.assertEqual(done.returncode, 0, f"{where}: {done.stderr}")
                return False
            self.expect_status(done, kind, where)
            made = set(state(folder)) - set(state(self.inputs))
            self.assertLessEqual(made, {"out.lvx", unfinished}, f"{where}: left behind")
            # What was recorded before the fault is worth more than a clean folder.
            # Of the new file only the folder's sync may have failed.
            renamed = (folder / "out.lvx").read_bytes() != old
            self.assertTrue(renamed or done.returncode != 0, where)
            self.assertFalse(renamed and unfinished in made, where)
            if unfinished in made:
                self.assertNotEqual(done.returncode, 0, where)
                read, _ = run(folder, ["info", unfinished])
                self.assertIn(read.returncode, {0, 3}, f"{where}: {read.stderr}")
            if renamed:
                read, _ = run(folder, ["info", "out.lvx"])
                self.assertEqual(read.returncode, 0, f"{where}: {read.stderr}")
            return True

        with subprocess.Popen([COMMAND, "emulate", "--interface", "127.0.0.71", "--serial", serial,
                               "--speed", "10"], stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL) as sensor:
            try:
                self.each([("record",)], check, at_a_time=1)  # all need the same port
            finally:
                sensor.terminate()


if __name__ == "__main__":
    unittest.main(verbosity=2)
