#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""A campaign while the command, a node, the controller and the scheduler are killed: the same command again makes the
same bytes as one undisturbed process. RISLEY_CAMPAIGN_CELLS=2000 is what scripts/nightly takes."""
import os
import signal
import subprocess
import time

from engines import CLUSTER, COMMAND, CampaignTest, chunk_processes, kill_chunk, main, needs, wait_until

CHUNKS = 12


class KilledTest(CampaignTest):
    cells = int(os.environ.get("RISLEY_CAMPAIGN_CELLS", "120"))

    @needs("snakemake", "slurmctld", "slurmd", "munged", "sbatch", root=True)
    def test_snakemake_and_slurm(self):
        cluster, output = self.folder / "cluster", self.folder / "slurm"
        self.addCleanup(self.run_words, [CLUSTER, "stop", cluster])
        self.expect(0, [CLUSTER, "start", cluster, 3])
        environment = dict(os.environ, SLURM_CONF=str(cluster / "etc/slurm.conf"))
        command = self.snakemake("slurm", output, CHUNKS)

        engine = self.start(command, "first.log", env=environment)
        self.addCleanup(engine.kill)
        wait_until(lambda: len(self.chunks(output)) >= 2, "two chunks")
        kept = self.chunks(output)
        kill_chunk(output)
        for name in ("node2", "slurmctld"):
            os.kill(int((cluster / "run" / name).read_text(encoding="utf-8")), signal.SIGKILL)
        time.sleep(2)  # Snakemake asks for its jobs, without an answer
        self.expect(0, [CLUSTER, "start", cluster])
        wait_until(lambda: len(self.chunks(output)) >= 5 and chunk_processes(output), "five chunks")
        kept |= self.chunks(output)
        self.assertLess(len(kept), CHUNKS)
        engine.kill()
        engine.wait()

        self.expect(0, command, env=environment)
        self.expect_reference(output)
        self.expect_kept(kept, output)

    @needs("parallel")
    def test_parallel(self):
        output = self.folder / "parallel"
        command = ["parallel", "--jobs", 2, "--joblog", self.folder / "joblog", "--resume-failed", COMMAND, "campaign",
                   self.plan, "--chunk", f"{{}}/{CHUNKS}", "--threads", 1, "-o", output, ":::", *range(1, CHUNKS + 1)]
        # GNU Parallel itself is killed; the chunks that it had begun go on, beside those of its next run.
        engine = self.start(command, "first.log")
        self.addCleanup(engine.kill)
        wait_until(lambda: len(self.chunks(output)) >= 2 and chunk_processes(output), "two chunks")
        kept = self.chunks(output)
        engine.kill()
        engine.wait()
        # The command is killed; GNU Parallel goes on and counts it.
        engine = self.start(command, "second.log")
        self.addCleanup(engine.kill)
        wait_until(lambda: len(self.chunks(output)) >= 5, "five chunks")
        kept |= self.chunks(output)
        kill_chunk(output, session=engine.pid)
        self.assertEqual(engine.wait(), 1)
        self.assertEqual(len(self.chunks(output)), CHUNKS - 1)
        missing = subprocess.run([COMMAND, "campaign", self.plan, "--merge", "-o", output], capture_output=True,
                                 text=True, check=False)
        self.assertEqual(missing.returncode, 3, missing.stderr)

        self.expect(0, command)
        self.expect(0, [COMMAND, "campaign", self.plan, "--merge", "-o", output])
        self.expect_reference(output)
        self.expect_kept(kept, output)


if __name__ == "__main__":
    main()
