# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""What the tests beside this file share: a campaign, the engines that run it, and how to kill what takes part."""
import os
import pathlib
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

COMMAND = os.environ["RISLEY_COMMAND"]
SOURCE = pathlib.Path(__file__).parents[2]
WORKFLOW = SOURCE / "workflows/campaign"
CLUSTER = SOURCE / "scripts/cluster-on-this-machine"

# 100 shots of a sensor that is named, in the format that is written and read the fastest.
PLAN = """\
simulate: {{sensor: mid-40, duration_s: 0.05, rate_hz: 2000, noise_angle_deg: 0.01, rotor: constant, format: csv}}
estimate: {{sensor: mid-40}}
grid:
  simulate.noise_angle_deg: [0.01, 0.05]
seeds: {{first: 1, count: {seeds}}}
"""


def needs(*programs, root=False):
    """Skips a test, and says so, where a program or root is missing."""
    path = f"{os.environ['PATH']}:/usr/sbin:/sbin"
    missing = [program for program in programs if not shutil.which(program, path=path)]
    if missing:
        return unittest.skip(f"SKIPPED: no {', '.join(missing)}: see scripts/install-dependencies --cluster")
    return unittest.skipIf(root and os.geteuid() != 0, "SKIPPED: needs root")


def wait_until(question, what, seconds=600):
    """Asks twenty times a second; what it answers if that is true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        answer = question()
        if answer:
            return answer
        time.sleep(0.05)
    raise AssertionError(f"{what}: not within {seconds} s")


def chunk_processes(output):
    """Numbers of the processes that compute a chunk of a campaign."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        try:
            words = (entry / "cmdline").read_bytes().decode(errors="replace").split("\0")
        except (OSError, ValueError):
            continue
        if COMMAND in words[:2] and "--chunk" in words and str(output) in words:
            found.append(int(entry.name))
    return found


def kill_chunk(output, session=None):
    """As a lack of memory does: kills a process that computes a chunk, of a session if that is said, before the chunk
    is whole."""
    def kill_one():
        for process in chunk_processes(output):
            try:
                if session not in (None, os.getsid(process)):
                    continue
                words = pathlib.Path(f"/proc/{process}/cmdline").read_text(encoding="utf-8").split("\0")
                os.kill(process, signal.SIGSTOP)
                chunk = words[words.index("--chunk") + 1].replace("/", "-of-")
                whole = (pathlib.Path(output) / f"chunks/chunk-{chunk}.jsonl").exists()
                os.kill(process, signal.SIGCONT if whole else signal.SIGKILL)
                if not whole:
                    return True
            except (ProcessLookupError, FileNotFoundError, ValueError):
                continue  # it has ended
        return False
    wait_until(kill_one, "a chunk that is computed")


class CampaignTest(unittest.TestCase):
    """A folder with a plan."""
    cells = 10
    reference = None

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="risley-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.folder.chmod(0o755)  # munge wants its socket to be reached by all
        cls.plan = cls.folder / "plan.yaml"
        cls.plan.write_text(PLAN.format(seeds=cls.cells // 2), encoding="utf-8")

    @classmethod
    def run_words(cls, words, **options):
        """The finished process, with stdout and stderr together."""
        return subprocess.run([str(word) for word in words], cwd=cls.folder, text=True, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, check=False, timeout=3000, **options)

    def start(self, words, log, **options):
        """A process of a session of its own."""
        with open(self.folder / log, "w", encoding="utf-8") as out:
            return subprocess.Popen([str(word) for word in words], cwd=self.folder, stdout=out,
                                    stderr=subprocess.STDOUT, start_new_session=True, **options)

    def expect(self, status, words, **options):
        done = self.run_words(words, **options)
        self.assertEqual(done.returncode, status, f"{shlex.join(done.args)}\n{done.stdout}")
        return done

    def chunks(self, output):
        """Chunk files: name -> what changes when one is written again."""
        return {path.name: (path.stat().st_ino, path.stat().st_mtime_ns)
                for path in sorted(pathlib.Path(output).glob("chunks/chunk-*.jsonl"))}

    def snakemake(self, profile, output, chunks, command=COMMAND):
        """The command of docs/clusters.md."""
        return ["snakemake", "--snakefile", WORKFLOW / "Snakefile", "--profile", WORKFLOW / "profiles" / profile,
                "--config", f"plan={self.plan}", f"output={output}", f"chunks={chunks}", f"command={command}"]

    def expect_reference(self, output):
        """The same bytes as from one undisturbed process of one thread, every cell once."""
        if not type(self).reference:
            folder = self.folder / "reference"
            self.expect(0, [COMMAND, "campaign", self.plan, "-o", folder, "--threads", 1])
            type(self).reference = (folder / "cells.csv").read_bytes()
        table = (pathlib.Path(output) / "cells.csv").read_bytes()
        cells = [line.split(b",")[0] for line in table.splitlines() if line[:1].isdigit()]
        self.assertEqual(cells, [b"%d" % cell for cell in range(self.cells)])
        self.assertEqual(table, self.reference)

    def expect_kept(self, before, output):
        """Chunks that were whole when something was killed were not computed again."""
        after = self.chunks(output)
        self.assertEqual({name: after.get(name) for name in before}, before)


def main():
    """Runs the tests of a script. Exit status 77 where all of them were skipped."""
    result = unittest.main(verbosity=2, exit=False).result
    if not result.wasSuccessful():
        sys.exit(1)
    if len(result.skipped) == result.testsRun:
        sys.exit(77)
