#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""What may stand at the name of an output, and disks that fill up."""
import os
import pathlib
import subprocess
import unittest

from command import COMMAND, CommandTest, run


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


if __name__ == "__main__":
    unittest.main()
