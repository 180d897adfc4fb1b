#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Recordings in formats of others, written by NumPy and by hand, and recordings without times."""
import importlib.util
import os
import pathlib
import sys
import unittest

SYSTEM_PYTHON = "/usr/bin/python3"  # Debian's packages are there, whatever runs first on the path
if importlib.util.find_spec("numpy") is None and sys.executable != SYSTEM_PYTHON:
    os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, *sys.argv])

from command import CommandTest, run  # noqa: E402

VENDOR = os.environ.get("RISLEY_VENDOR_DATA", "")
RATE = 10000


class NamedFormatsTest(CommandTest):
    """What scripts see of them."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        done = run("simulate", "-o", "seq.sequence.csv", "--duration-s", 1, "--rate-hz", RATE,
                   folder=cls.folder)
        assert done.returncode == 0, done.stderr
        rows = (cls.folder / "seq.sequence.csv").read_text().splitlines()[1:]
        cls.angles = [tuple(map(float, row.split(",")[1:])) for row in rows]
        with open(cls.folder / "angles.csv", "w", encoding="ascii") as file:
            file.write("azimuth_deg;zenith_deg\n")
            for azimuth, zenith in cls.angles:
                file.write(f"{azimuth:.5f};{zenith:.5f}\n")

    def test_info_counts_every_warning_that_it_prints(self):
        with open(self.folder / "mm.csv", "w", encoding="ascii") as file:
            file.write("x,y,z\n")
            for row in range(2000):
                file.write(f"{7541.123 + row:.3f},{1322.5 - 3 * row % 997:.3f},{2.25 * row:.3f}\n")
        done = self.expect(0, "info", "mm.csv")
        printed = done.stderr.count("warning: ")
        self.assertGreaterEqual(printed, 2)  # its unit and a guess of the sensor
        self.assertRegex(done.stdout, rf"(?m)^warnings +{printed}$")
        self.assertEqual(len(self.expect_json(0, "info", "mm.csv")["warnings"]), printed)

    def test_info_works_without_times(self):
        info = self.expect_json(0, "info", "angles.csv")
        self.assertEqual(info["format"], "named-csv")
        self.assertIs(info["has_times"], False)
        self.assertEqual(info["observations"], len(self.angles))
        for key in ("duration_s", "rate_hz", "first_time_ns", "last_time_ns", "largest_gap_s"):
            self.assertIsNone(info[key], key)
        text = self.expect(0, "info", "angles.csv").stdout
        self.assertIn("none of single shots", text)
        counted = self.expect_json(0, "info", "angles.csv", "--shot-rate-hz", RATE)
        self.assertIs(counted["has_times"], True)
        self.assertAlmostEqual(counted["rate_hz"], RATE, delta=1e-6)
        self.assertAlmostEqual(counted["duration_s"], (len(self.angles) - 1) / RATE, delta=1e-9)

    def test_verbs_that_need_times_say_so(self):
        for arguments in (("estimate", "angles.csv", "--sensor", "mid-40"),
                          ("observability", "angles.csv", "--sensor", "mid-40"),
                          ("calibrate", "angles.csv", "--sensor", "mid-40"),
                          ("cloud", "points.csv", "--calibration", "mid-40", "-o", "a.las"),
                          ("convert", "points.csv", "-o", "a.lvx")):
            (self.folder / "points.csv").write_text("x_m,y_m,z_m\n1.000,2.000,3.000\n0,0,0\n")
            with self.subTest(arguments=arguments):
                done = self.expect(2, *arguments)
                self.assertIn("--shot-rate-hz", done.stderr)
                self.assertIn("no times of single shots", done.stderr)
        for rate in ("0", "-1", "nan", "inf", "fast"):
            self.assertIn("--shot-rate-hz",
                          self.expect(2, "info", "angles.csv", "--shot-rate-hz", rate).stderr)
        self.assertNotIn("a.las", self.names())
        self.assertNotIn("a.lvx", self.names())

    def test_estimate_counts_times(self):
        with_times = self.expect_json(0, "estimate", "seq.sequence.csv")
        counted = self.expect_json(0, "estimate", "angles.csv", "--sensor", "mid-40",
                                   "--shot-rate-hz", RATE)
        self.assertTrue(counted["converged"])
        for name, one in with_times["parameters"].items():
            other = counted["parameters"][name]
            self.assertAlmostEqual(one["value"], other["value"],
                                   delta=0.1 * one["sigma_given_held"] + 1e-9, msg=name)

    def test_convert_keeps_places(self):
        (self.folder / "few.csv").write_text(
            "index,x_m,y_m,z_m\n0,10.000,1.000,1.000\n1,0,0,0\n4,10.000,1.000,2.000\n")
        self.expect(0, "convert", "few.csv", "-o", "few.nc")
        self.assertIs(self.expect_json(0, "info", "few.nc")["has_times"], False)
        info = self.expect_json(0, "info", "few.nc", "--shot-rate-hz", 100000)
        self.assertEqual(info["last_time_ns"], 40000)
        self.assertEqual(info["no_return"], 1)
        failed = self.expect(2, "convert", "few.csv", "-o", "few.lvx", "--shot-rate-hz", 100000)
        self.assertIn("type 255 (unknown)", failed.stderr)
        self.expect(0, "convert", "few.csv", "-o", "few.lvx", "--shot-rate-hz", 100000,
                    "--sensor-type", "mid-40")
        failed = self.expect(2, "convert", "few.lvx", "-o", "other.lvx", "--sensor-type", "avia")
        self.assertIn("Mid-40", failed.stderr)
        info = self.expect_json(0, "info", "few.lvx")
        self.assertEqual(info["observations"] - info["no_return"], 2)

    def test_numpy_reads_and_writes(self):
        if importlib.util.find_spec("numpy") is None:
            print("SKIPPED: no Python module numpy to write arrays with", file=sys.stderr)
            self.skipTest("numpy")
        numpy = importlib.import_module("numpy")
        shots = 5000
        grid = numpy.arange(shots)
        points = numpy.round(numpy.column_stack(
            [20 + 0.003 * grid % 7, 2 * numpy.sin(grid), numpy.cos(grid)]), 3)
        points[::9] = 0
        times = grid * 10_000
        single = points.astype("<f4")
        record = numpy.zeros(shots, [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("t_ns", "<i8")])
        record["x"], record["y"], record["z"] = single.T
        record["t_ns"] = times
        numpy.save(self.folder / "c.npy", single)
        numpy.save(self.folder / "fortran.npy", numpy.asfortranarray(points))
        numpy.save(self.folder / "record.npy", record)
        numpy.save(self.folder / "swapped.npy", record.astype(record.dtype.newbyteorder(">")))
        numpy.savez(self.folder / "columns.npz", x=points[:, 0], y=points[:, 1], z=points[:, 2],
                    time=times * 1e-9)
        numpy.savez_compressed(self.folder / "points.npz", points=single, time_ns=times)
        numpy.savetxt(self.folder / "savetxt.csv", points, delimiter=",", header="x,y,z")
        expected = None
        for name in ("c.npy", "fortran.npy", "record.npy", "swapped.npy", "columns.npz",
                     "points.npz", "savetxt.csv"):
            with self.subTest(name=name):
                info = self.expect_json(0, "info", name)
                self.assertEqual(info["observations"], shots)
                self.assertEqual(info["no_return"], len(points[::9]))
                has_times = name not in ("c.npy", "fortran.npy", "savetxt.csv")
                self.assertIs(info["has_times"], has_times)
                if has_times:
                    self.assertAlmostEqual(info["rate_hz"], 1e5, delta=1e-3)
                self.expect(0, "convert", name, "-o", "again.openpylivox.csv", "--shot-rate-hz",
                            100000)
                lines = (self.folder / "again.openpylivox.csv").read_text()
                expected = expected or lines
                coordinates = [",".join(line.split(",")[:3]) for line in lines.splitlines()]
                self.assertEqual(coordinates,
                                 [",".join(line.split(",")[:3]) for line in expected.splitlines()])

    @unittest.skipUnless(VENDOR, "RISLEY_VENDOR_DATA does not name the folder of real recordings")
    def test_real_recordings(self):
        folder = pathlib.Path(VENDOR)
        for name, form, rows, nulls in (("real/mid-40-hub-frame.csv", "named-csv", 10000, 4647),
                                        ("real/horizon-1.pcd", "pcd", 23986, None),
                                        ("real/tele-15.pcd", "pcd", 24037, None)):
            info = self.expect_json(0, "info", folder / name)
            self.assertEqual((info["format"], info["observations"]), (form, rows))
            self.assertIs(info["has_times"], False)
            if nulls is not None:
                self.assertEqual(info["no_return"], nulls)
        for name in ("avia", "horizon"):
            info = self.expect_json(0, "info", folder / f"livox-{name}-sequence-every-40th.csv")
            self.assertEqual((info["format"], info["observations"]), ("named-csv", 24000))
            self.assertAlmostEqual(info["rate_hz"], 6000, delta=1)
            self.assertIs(info["has_range"], False)


if __name__ == "__main__":
    if not VENDOR:
        print("SKIPPED: real recordings, RISLEY_VENDOR_DATA does not name their folder",
              file=sys.stderr)
    unittest.main()
