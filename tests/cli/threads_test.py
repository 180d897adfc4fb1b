#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Every output has the same bytes whatever the number of threads, but for the command line in it."""
import unittest

from command import SOURCE, CommandTest

RUNS = [
    ("simulate", "--rotor", "hunting", "--scene", SOURCE / "data/hall.yaml", "--duration-s", "0.2",
     "-o", "made.nc"),
    ("simulate", "--scene", SOURCE / "data/real-hall.yaml", "--duration-s", "0.2", "--set", "range_near_m=0.015",
     "--set", "range_incidence=0.3", "--set", "range_per_decade_m=0.01", "-o", "real.nc"),
    ("convert", "../walls.lvx", "-o", "walls.nc"),
    ("convert", "../walls.lvx", "-o", "walls.openpylivox.csv"),
    ("estimate", "../walls.lvx", "-o", "estimate"),
    ("calibrate", "../walls.lvx", "-o", "calibrate"),
    ("pattern", "--sensor", "avia", "--duration-s", "0.05", "--format", "npy", "-o", "avia.npy"),
    ("pattern", "--sensor", "horizon", "--duration-s", "0.02", "--report", "page.html"),
    ("observability", "../walls.lvx", "--json"),
    ("info", "../walls.lvx", "--json"),
]
RUNS += [("cloud", "../walls.lvx", "--calibration", "mid-40", "--common-factors", "yes", "-o",
          f"cloud.{ending}") for ending in ("npy", "nc")]
RUNS += [("cloud", "../walls.lvx", "--calibration", "mid-40", "-o", f"cloud.{ending}")
         for ending in ("las", "ply", "csv", "bag")]


def differing_bytes(one, other):
    """How many bytes differ, all of them where the lengths do."""
    if one == other:
        return 0
    if len(one) != len(other):
        return max(len(one), len(other))
    return sum(a != b for a, b in zip(one, other))


class ThreadsTest(CommandTest):
    """One, two and four threads; more of them than cores are threads all the same."""

    def test_bytes_do_not_depend_on_the_number_of_threads(self):
        self.expect(0, "simulate", "-o", "walls.lvx", "--rotor", "hunting", "--duration-s", "0.4",
                    "--scene", SOURCE / "data/hall.yaml")
        outputs = {}
        for threads in (1, 2, 4):
            inner = self.folder / "run"
            inner.mkdir()
            outer, self.folder = self.folder, inner
            for number, words in enumerate(RUNS):
                done = self.expect(0, *words, "--threads", threads)
                (inner / f"stdout-{number}").write_text(done.stdout)
            self.folder = outer
            outputs[threads] = {
                str(path.relative_to(inner)):
                path.read_bytes().replace(f"--threads {threads}".encode(), b"--threads N")
                for path in inner.rglob("*") if path.is_file()}
            inner.rename(outer / f"run-{threads}")
        self.assertGreater(len(outputs[1]), len(RUNS) + 12)
        for threads in (2, 4):
            self.assertEqual(set(outputs[threads]), set(outputs[1]))
            for name, content in outputs[1].items():
                if name.startswith("stdout"):  # the seconds that it took
                    continue
                # HDF5 keeps a checksum of four bytes beside its texts, the command line among them.
                allowed = 4 if name.endswith(".nc") else 0
                self.assertLessEqual(differing_bytes(content, outputs[threads][name]), allowed,
                                     f"{name}, {threads} threads")


if __name__ == "__main__":
    unittest.main()
