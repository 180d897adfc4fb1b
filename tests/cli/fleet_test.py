#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Many inputs in one command: which are meant, where results go, tables, and going on after a stop."""
import csv
import hashlib
import json
import os
import pathlib
import shutil
import signal
import subprocess
import time
import unittest

from command import COMMAND, SANITIZED, SOURCE, CommandTest, run

ROOM = SOURCE / "data" / "room.yaml"
FAST = ("--rate-hz", "2000", "--no-report", "--states", "none")


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


class FleetTest(CommandTest):
    """A folder of recordings of several kinds, a third of them damaged."""

    SOUND = ["east/scan", "north/deep/walk", "north/scan", "south.sequence", "west.openpylivox", "zenith"]
    DAMAGED = {"bad/cut.nc": 3, "bad/empty.lvx": 3, "bad/middle.lvx": 3, "bad/short.sequence.csv": 1,
               "bad/text.lvx": 3}

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.fleet = cls.folder / "fleet"
        for name in ("east", "north/deep", "bad"):
            (cls.fleet / name).mkdir(parents=True)
        for seed, name in enumerate(("east/scan.lvx", "north/scan.lvx", "north/deep/walk.nc", "zenith.lvx")):
            done = run("simulate", "-o", cls.fleet / name, "--sensor", "mid-40-table3", "--scene", ROOM,
                       "--duration-s", "0.3", "--rate-hz", "20000", "--seed", seed, folder=cls.folder)
            assert done.returncode == 0, done.stderr
        for source, target in (("east/scan.lvx", "south.sequence.csv"), ("zenith.lvx", "west.openpylivox.csv")):
            done = run("convert", cls.fleet / source, "-o", cls.fleet / target, folder=cls.folder)
            assert done.returncode == 0, done.stderr
        whole = (cls.fleet / "zenith.lvx").read_bytes()
        (cls.fleet / "bad/empty.lvx").write_bytes(b"")
        (cls.fleet / "bad/text.lvx").write_bytes(b"no recording at all")
        middle = len(whole) // 2
        (cls.fleet / "bad/middle.lvx").write_bytes(whole[:middle] + b"\xff" * 3000 + whole[middle + 3000:])
        (cls.fleet / "bad/cut.nc").write_bytes((cls.fleet / "north/deep/walk.nc").read_bytes()[:9000])
        lines = (cls.fleet / "south.sequence.csv").read_text().splitlines(True)
        (cls.fleet / "bad/short.sequence.csv").write_text("".join(lines[:40]))
        (cls.fleet / "notes.txt").write_text("no input\n")

    def estimate(self, status, *more):
        return self.expect_json(status, "estimate", "fleet", "-o", "results", *FAST, *more)

    def test_calibrations_each_on_its_own(self):
        found = self.expect_json(3, "calibrate", "fleet/east", "fleet/north", "fleet/bad/empty.lvx", "-o", "calibrated",
                                 "--table", "units.csv", "--no-report", "--states", "none")
        self.assertEqual([found[key] for key in ("done", "failed", "skipped")], [3, 1, 0])
        self.assertEqual(sorted(one["input"] for one in found["results"]),
                         ["fleet/bad/empty.lvx", "fleet/east/scan.lvx", "fleet/north/deep/walk.nc", "fleet/north/scan.lvx"])
        with open(self.folder / "units.csv", newline="", encoding="utf-8") as file:
            rows = {row["input"]: row for row in csv.DictReader(file)}
        self.assertEqual(rows["fleet/bad/empty.lvx"]["exit_status"], "3")
        for one in found["results"]:
            if one["status"] != 0:
                self.assertEqual(one["verdict"]["code"], "undecided")
                continue
            row = rows[one["input"]]
            tilt = one["parameters"]["prism_tilt_a_vertical_deg"]
            self.assertEqual(float(row["prism_tilt_a_vertical_deg"]), tilt["value"])
            self.assertEqual(float(row["sigma_prism_tilt_a_vertical_deg"]), tilt["sigma"])
            self.assertEqual(float(row["pointing_error_total_deg"]), one["pointing_error"]["total_deg"]["value"])
            self.assertEqual(float(row["tolerance_deg"]), one["tolerance_deg"])
            self.assertEqual(int(row["planes"]), len(one["planes"]))
            # The same as of this recording alone.
            alone = self.expect_json(0, "calibrate", one["input"])
            self.assertEqual(alone["parameters"], one["parameters"])
        again = self.expect_json(3, "calibrate", "fleet/east", "fleet/north", "fleet/bad/empty.lvx", "-o", "calibrated",
                                 "--table", "units.csv", "--no-report", "--states", "none", "--resume")
        self.assertEqual([again[key] for key in ("done", "failed", "skipped")], [0, 1, 3])
        self.assertIn("--truth is for one recording, and there are 3", self.expect(
            2, "calibrate", "fleet/east", "fleet/north", "--table", "t.csv", "--truth",
            "fleet/east/scan.lvx.truth.yaml").stderr)
        # Without a table, one calibration of all.
        joint = self.expect_json(0, "calibrate", "fleet/east", "fleet/north/scan.lvx")
        self.assertNotIn("results", joint)

    def counts(self, found):
        return found["done"], found["failed"], found["skipped"]

    def rows(self, name):
        with open(self.folder / name, newline="", encoding="utf-8") as table:
            return list(csv.DictReader(table))

    def all_names(self, folder):
        return sorted(str(path.relative_to(self.folder / folder))
                      for path in (self.folder / folder).rglob("*") if path.is_file())

    def test_1_one_bad_file_does_not_stop_the_rest(self):
        found = self.estimate(3, "--table", "fleet.csv")
        self.assertEqual(self.counts(found), (6, 5, 0))
        by_input = {one["input"]: one for one in found["results"]}
        self.assertEqual(len(by_input), 11)
        for name, status in self.DAMAGED.items():
            one = by_input[f"fleet/{name}"]
            self.assertEqual(one["status"], status, one)
            self.assertTrue(one["message"])
            self.assertEqual(one["verdict"]["code"], "undecided")
        self.assertIn("is empty", by_input["fleet/bad/empty.lvx"]["message"])
        self.assertIn("byte_offset", by_input["fleet/bad/middle.lvx"])
        self.assertEqual(self.all_names("results"), sorted(f"{name}/calibration.yaml" for name in self.SOUND))
        for one in found["inputs"]:
            self.assertEqual(one["sha256"], digest(self.folder / one["path"]))

        rows = {row["input"]: row for row in self.rows("fleet.csv")}
        self.assertEqual(rows.keys(), by_input.keys())
        for name, row in rows.items():
            self.assertEqual(row["sha256"], digest(self.folder / name))
            self.assertEqual(int(row["exit_status"]), by_input[name]["status"])
            self.assertEqual(row["message"], by_input[name]["message"])
            self.assertRegex(row["version"], r"^\d+\.\d+\.\d+$")
        scan = by_input["fleet/north/scan.lvx"]
        row = rows["fleet/north/scan.lvx"]
        self.assertEqual(row["verdict"], scan["verdict"]["code"])
        self.assertEqual(row["serial"], scan["serial"])
        for name, value in scan["parameters"].items():
            self.assertEqual(float(row[name]), value["value"])
            self.assertEqual(float(row[f"sigma_{name}"]), value["sigma"])
        self.assertEqual(float(row["noise_azimuth_deg"]), scan["noise"]["azimuth_deg"]["value"])
        self.assertGreater(float(row["seconds_total"]), 0)
        self.assertEqual(rows["fleet/bad/text.lvx"]["refractive_index_b"] if
                         "refractive_index_b" in row else "", "")

    def test_2_what_is_whole_is_not_made_again(self):
        started = os.times()
        found = self.estimate(3, "--table", "again.csv", "--resume")
        ended = os.times()  # processor time: others may be busy
        self.assertLess(ended.children_user - started.children_user, 1 if not SANITIZED else 60)
        self.assertEqual(self.counts(found), (0, 5, 6))
        # What could not be read may have been the machine's fault.
        self.assertTrue(all(one.get("skipped", False) == (one["status"] != 3) for one in found["results"]))
        again, before = self.rows("again.csv"), self.rows("fleet.csv")
        for row in again + before:
            if row["exit_status"] == "3":
                row["seconds_total"] = ""
        self.assertEqual(again, before)
        shutil.copy(self.folder / "fleet/zenith.lvx", self.folder / "before.lvx")
        try:  # another file of the same name; its time proves nothing
            times = os.stat(self.folder / "fleet/zenith.lvx")
            shutil.copy(self.folder / "fleet/east/scan.lvx", self.folder / "fleet/zenith.lvx")
            os.utime(self.folder / "fleet/zenith.lvx", ns=(times.st_atime_ns, times.st_mtime_ns))
            self.assertEqual(self.counts(self.estimate(3, "--resume")), (1, 5, 5))
        finally:
            shutil.move(self.folder / "before.lvx", self.folder / "fleet/zenith.lvx")
        half = self.folder / "results/east/scan/calibration.yaml"
        half.write_text(half.read_text()[:500])
        (self.folder / "results/north/scan/calibration.yaml").unlink()
        journal = self.folder / "results.records.jsonl"
        journal.write_text("".join(line if "south.sequence" not in line else "{\n"
                                   for line in journal.read_text().splitlines(True))[:-1])
        self.assertEqual(self.counts(self.estimate(3, "--resume")), (4, 5, 2))
        os.utime(self.folder / "fleet/north/scan.lvx")
        self.assertEqual(self.counts(self.estimate(3, "--resume")), (0, 5, 6))
        # Other options, other results.
        found = self.expect_json(3, "estimate", "fleet", "-o", "results", *FAST, "--mirror", "no", "--resume")
        self.assertEqual(found["skipped"], 0)

    def test_3_tables_are_of_two_kinds(self):
        words = ("info", "fleet", "--quiet")
        for name in ("info.csv", "info.nc"):
            self.expect(3, *words, "--table", name)
        rows = self.rows("info.csv")
        self.assertEqual(len(rows), 11)
        self.assertEqual((self.folder / "info.nc").read_bytes()[:4], b"\x89HDF")
        damaged = next(row for row in rows if row["input"] == "fleet/bad/middle.lvx")
        self.assertEqual(damaged["exit_status"], "3")
        self.assertGreater(int(damaged["observations"]), 0)  # those before the damage
        self.expect(2, *words, "--table", "info.xlsx")
        self.expect(2, *words, "--table", "info.sqlite")
        self.expect(3, *words, "--table", "nowhere/info.csv")

    def test_4_lists_and_patterns(self):
        (self.folder / "list.txt").write_text("# the two of May\nfleet/east/scan.lvx\nfleet/gone.lvx\n\n"
                                              "fleet/nor*/scan.lvx\n")
        found = self.expect_json(3, "info", "--list", "list.txt")
        self.assertEqual([(one["input"], one["status"]) for one in found["results"]],
                         [("fleet/east/scan.lvx", 0), ("fleet/gone.lvx", 3), ("fleet/north/scan.lvx", 0)])
        self.assertIn("fleet/gone.lvx", found["results"][1]["message"])
        self.assertIn({"path": "list.txt", "sha256": digest(self.folder / "list.txt")}, found["inputs"])
        found = self.expect_json(0, "info", "fleet/**/scan.lvx", "fleet/east/scan.lvx")
        self.assertEqual(self.counts(found), (2, 0, 0))
        self.assertIn("fleet/**/none", self.expect(2, "info", "fleet/**/none*").stderr)
        self.assertIn("nolist.txt", self.expect(3, "info", "--list", "nolist.txt").stderr)
        text = self.expect(0, "info", "fleet/**/scan.lvx").stdout.splitlines()
        self.assertEqual(text[-1], "2 of 2 files done")
        self.assertRegex(text[0], "^fleet/east/scan.lvx: lvx-1.1, Livox Mid-40, 30 000 observations in 0.29999 s$")

    def test_5_results_stand_as_their_inputs_do(self):
        found = self.expect_json(0, "convert", "fleet/**/scan.lvx", "-o", "converted", "--format", "netcdf")
        self.assertEqual(self.all_names("converted"), ["east/scan.nc", "north/scan.nc"])
        self.assertEqual(found["observations"], 60000)
        found = self.expect_json(0, "convert", "fleet/**/scan.lvx", "-o", "converted", "--format", "netcdf",
                                 "--resume", "--table", "converted.csv")
        self.assertEqual(self.counts(found), (0, 0, 2))
        self.assertEqual(found["observations"], 60000)
        shutil.copytree(self.folder / "fleet/east", self.folder / "more/east")
        shutil.copytree(self.folder / "fleet/north", self.folder / "more/north")
        cloud = ("cloud", "more", "--calibration", "mid-40-table3", "-o", "more/clouds/", "--format", "ply")
        self.assertEqual(self.counts(self.expect_json(0, *cloud)), (3, 0, 0))
        self.assertEqual(self.all_names("more/clouds"), ["east/scan.ply", "north/deep/walk.ply", "north/scan.ply"])
        # What was made is not read.
        self.assertEqual(self.counts(self.expect_json(0, *cloud, "--resume")), (0, 0, 3))

    def test_6_one_input_alone_is_as_ever(self):
        found = self.expect_json(0, "estimate", "fleet/zenith.lvx", "-o", "alone", *FAST)
        self.assertNotIn("results", found)
        self.assertEqual(self.all_names("alone"), ["calibration.yaml"])
        self.assertNotIn("alone.records.jsonl", self.names())
        for _ in range(2):
            found = self.expect_json(0, "estimate", "fleet/zenith.lvx", "-o", "alone", *FAST, "--resume")
        self.assertEqual(self.counts(found), (0, 0, 1))
        self.assertEqual(self.all_names("alone"), ["calibration.yaml"])
        self.assertIn("--output or --table", self.expect(2, "info", "fleet", "--resume").stderr)

    def test_7_what_cannot_be_meant_is_refused(self):
        for words, message in ((("info", "fleet", "--share", "x.nc"), "--share"),
                               (("estimate", "fleet", "--truth", "fleet/zenith.lvx.truth.yaml"), "--truth"),
                               (("estimate", "fleet", "--rate-hz", "fast"), "--rate-hz"),
                               (("info", "--table", "t.csv"), "INPUT"),
                               (("info", "fleet", "--table", "fleet/zenith.lvx.csv", "--list", "notes"), "notes"),
                               (("estimate", "fleet", "-o", "x", "--table", "x/east/scan/report.html"), "ending")):
            with self.subTest(words):
                self.assertIn(message, run(*words, folder=self.folder).stderr)

    def test_8_finished_results_stay_after_a_stop(self):
        many = self.folder / "many"
        many.mkdir()
        for i in range(24):
            data = bytearray((self.folder / "fleet/zenith.lvx").read_bytes())
            data[-1] ^= i  # none like another
            (many / f"{i:02}.lvx").write_bytes(data)
        words = ("estimate", "many", "-o", "kept", "--no-report", "--table", "kept.csv", "--threads", "1")

        def kept():
            journal = self.folder / "kept.records.jsonl"
            lines = journal.read_bytes().splitlines() if journal.exists() else []
            return len({json.loads(line)["place"] for line in lines if line.startswith(b'{"place"')})

        def stopped(how):
            with subprocess.Popen([COMMAND, *words, "--resume"], cwd=self.folder, stderr=subprocess.PIPE,
                                  stdout=subprocess.DEVNULL, text=True) as process:
                limit = time.monotonic() + (60 if not SANITIZED else 600)
                started = kept()
                while (kept() < started + 2
                       and process.poll() is None and time.monotonic() < limit):
                    time.sleep(0.01)
                process.send_signal(how)
                told = process.communicate(timeout=600)[1]
            return process.returncode, told, kept()

        status, told, whole = stopped(signal.SIGINT)
        self.assertEqual(status, 130)
        self.assertIn("--resume continues", told)
        self.assertGreaterEqual(whole, 2)
        self.assertEqual(len(self.rows("kept.csv")), whole)
        status, _, whole = stopped(signal.SIGKILL)
        self.assertEqual(status, -9)
        found = self.expect_json(0, *words, "--resume")
        self.assertEqual(found["done"] + found["skipped"], 24)
        self.assertGreaterEqual(found["skipped"], whole)
        self.assertEqual(len(self.rows("kept.csv")), 24)
        left = [path for path in self.folder.rglob("*.part-*")]
        self.assertEqual(left, [])


if __name__ == "__main__":
    unittest.main()
