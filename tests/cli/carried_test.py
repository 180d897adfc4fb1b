#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The command with the libraries that a wheel carries, in a file system that holds nothing else but the C library."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(os.environ["RISLEY_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "tools"))
import carry_libraries  # pylint: disable=wrong-import-position
import try_wheel  # pylint: disable=wrong-import-position

ENTER = ("unshare", "--map-root-user", "--mount", "--pid", "--fork", "--mount-proc=/proc")
SYSTEM = ("libc.so.6", "libm.so.6", "libresolv.so.2", "libstdc++.so.6", "libgcc_s.so.1", "libpthread.so.0", "libdl.so.2",
          "librt.so.1")


def skip(reason):
    """Says that this machine cannot run the test."""
    print(f"SKIPPED: {reason}")
    sys.exit(77)


class CarriedTest(unittest.TestCase):
    def test_it_needs_nothing_else(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            tree = root / "risley"
            for part in ("proc", "tmp", "lib64", "risley/bin", "risley/lib", "risley/work"):
                (root / part).mkdir(parents=True)
            command = pathlib.Path(os.environ["RISLEY_COMMAND"])
            shutil.copy(command, tree / "bin/risley")
            for library in command.parents[2].glob("librisley_*.so.*"):  # where they are shared
                shutil.copy(library, tree / "lib", follow_symlinks=False)
            versions = carry_libraries.carry(tree)
            self.assertIn("GLIBC", versions)
            licences = tree / "share/doc/risley/libraries"
            for package in ("libtbb12", "libsqlite3-0", "proj-data"):
                self.assertTrue((licences / f"{package}.copyright").exists(), package)
            shutil.copytree(SOURCE / "data", tree / "data")
            known = carry_libraries.system_libraries()
            for name in SYSTEM:
                shutil.copy(known[name], tree / "lib")
            shutil.copy(known["ld-linux-x86-64.so.2"], root / "lib64")

            def run(*words):
                done = subprocess.run([*ENTER, "--root", root, "--wd", "/risley/work", "/risley/bin/risley", *words],
                                      check=False, capture_output=True, text=True, env={"PROJ_DATA": "/nowhere"})
                self.assertEqual(done.returncode, 0, f"{words}: {done.stderr}")
                return done.stdout

            try_wheel.use(run, tree / "work", "/risley/data")


if __name__ == "__main__":
    if not shutil.which("patchelf"):
        skip("patchelf is not installed: see scripts/install-dependencies --wheel")
    if subprocess.run([*ENTER, "true"], check=False, capture_output=True).returncode != 0:
        skip("this machine does not let unshare(1) make a namespace")
    if os.environ.get("RISLEY_SANITIZED") == "ON":
        skip("the sanitizers need libraries of their own")
    unittest.main()
