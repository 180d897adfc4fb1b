# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Runs the risley command for the tests beside this file."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import schemas

COMMAND = os.environ["RISLEY_COMMAND"]
SOURCE = pathlib.Path(os.environ["RISLEY_SOURCE_DIR"])
SANITIZED = os.environ.get("RISLEY_SANITIZED") == "ON"  # many times slower, and no limit of memory


def run(*arguments, folder=None):
    """The finished process, with text of stdout and stderr; what --json prints is as its schema."""
    done = subprocess.run([COMMAND, *map(str, arguments)], cwd=folder, capture_output=True,
                          text=True, timeout=3000 if SANITIZED else 300, check=False)
    if "--json" in arguments:
        schemas.check_output(arguments, done.stdout)
    return done


def verbs():
    """The verbs that --help lists."""
    return re.findall(r"^  ([a-z]+) ", run("--help").stdout, re.MULTILINE)


def codes_of(result):
    """What its warnings are about."""
    return [one["code"] for one in result["warnings"]]


class CommandTest(unittest.TestCase):
    """A test with a folder of its own."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="risley-cli-"))

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def expect(self, status, *arguments):
        """Runs in the test's folder and demands an exit status."""
        done = run(*arguments, folder=self.folder)
        self.assertEqual(done.returncode, status, f"{arguments}\n{done.stdout}\n{done.stderr}")
        return done

    def expect_json(self, status, *arguments):
        """As expect with --json: stdout must be one object and nothing else."""
        result = json.loads(self.expect(status, *arguments, "--json").stdout)
        self.assertIsInstance(result, dict)
        return result

    def names(self):
        """What lies in the folder."""
        return {path.name for path in self.folder.iterdir()}


class ProcessTest(CommandTest):
    """A test that starts commands which run beside it, and end with it."""

    def setUp(self):
        self.processes = []

    def tearDown(self):
        for process in self.processes:
            process.kill()
            process.wait()
            for pipe in (process.stdout, process.stderr):
                if pipe:
                    pipe.close()

    def start(self, *arguments, **options):
        """A running command, with text of stdout and stderr unless options of Popen say otherwise."""
        process = subprocess.Popen([COMMAND, *map(str, arguments)], cwd=self.folder, text=True,
                                   **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options})
        self.processes.append(process)
        return process

    def skip_where_the_kernel_drops(self, recorded):
        """A sensor does not wait: without enough memory from the kernel, its packets cannot all be kept."""
        buffer = recorded["receive_buffer_bytes"]
        drops = sum(one["kernel_drops"] for one in recorded["sensors"])
        if drops > 0 and buffer["granted"] < buffer["asked"]:
            print(f"SKIPPED: the kernel dropped {drops} packets; allow more with "
                  f"sysctl -w net.core.rmem_max={buffer['asked']}", file=sys.stderr)
            self.skipTest("receive buffer")
