#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""A small campaign through every engine in docs/clusters.md, and what happens to lost files."""
import importlib.util
import os
import unittest

from engines import CLUSTER, COMMAND, WORKFLOW, CampaignTest, main, needs


class SlurmStatusTest(unittest.TestCase):
    """What the profile for Slurm makes of the answers of scontrol."""

    def test_words(self):
        script = WORKFLOW / "profiles/slurm/slurm_status.py"
        self.assertTrue(os.access(script, os.X_OK))
        spec = importlib.util.spec_from_file_location("slurm_status", script)
        slurm_status = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(slurm_status)
        for answer, word in (
                ((0, "JobId=5 JobName=x JobState=COMPLETED Reason=None Dependency=(null)", ""), "success"),
                ((0, "JobId=5 JobState=RUNNING Reason=None", ""), "running"),
                ((0, "JobId=5 JobState=PENDING Reason=BeginTime", ""), "running"),
                ((0, "JobId=5 JobState=COMPLETING Reason=None", ""), "running"),
                ((0, "JobId=5 JobState=FAILED Reason=NonZeroExitCode", ""), "failed"),
                ((0, "JobId=5 JobState=NODE_FAIL Reason=None", ""), "failed"),
                ((0, "JobId=5 JobState=OUT_OF_MEMORY Reason=None", ""), "failed"),
                ((0, "JobId=5 JobState=TIMEOUT Reason=TimeLimit", ""), "failed"),
                ((0, "JobId=5 JobState=CANCELLED Reason=None", ""), "failed"),
                ((1, "", "slurm_load_jobs error: Invalid job id specified"), "failed"),
                ((1, "", "slurm_load_jobs error: Unable to contact slurm controller (connect failure)"), "running"),
                ((0, "", ""), "running")):
            self.assertEqual(slurm_status.status(*answer), word, answer)


class EnginesTest(CampaignTest):
    """Ten cells."""

    @needs("snakemake")
    def test_snakemake_on_this_machine(self):
        output = self.folder / "local"
        command = self.snakemake("local", output, 4)
        self.expect(0, command)
        self.expect_reference(output)
        self.assertEqual(len(self.chunks(output)), 4)
        # Nothing to do.
        kept = self.chunks(output)
        self.assertIn("Nothing to be done", self.expect(0, command).stdout)
        # A chunk is lost after Snakemake saw it: the merge names its cells, and the next run makes it again.
        (output / "cells.csv").unlink()
        (output / "chunks/chunk-3-of-4.jsonl").unlink()
        del kept["chunk-3-of-4.jsonl"]
        self.expect(1, command)
        self.assertFalse((output / "cells.csv").exists())
        self.expect(0, command)
        self.expect_reference(output)
        self.expect_kept(kept, output)

    @needs("snakemake")
    def test_a_whole_chunk_outlives_a_job_that_is_called_failed(self):
        output, seen, command = self.folder / "failed", self.folder / "seen", self.folder / "fails-once"
        command.write_text(f'#!/bin/sh\n{COMMAND} "$@" && {{ [ -e {seen} ] || {{ : > {seen}; exit 1; }}; }}\n',
                           encoding="utf-8")
        command.chmod(0o755)
        words = self.snakemake("local", output, 1, command)
        self.expect(1, [*words, "--restart-times", 0])
        kept = self.chunks(output)
        self.assertEqual(list(kept), ["chunk-1-of-1.jsonl"])
        self.expect(0, words)
        self.expect_reference(output)
        self.expect_kept(kept, output)

    @needs("snakemake")
    def test_settings_that_are_missing_or_wrong_are_named(self):
        for words, message in ((["plan=plan.yaml", "output=out"], "chunks is missing"),
                               (["plan=plan.yaml", "output=out", "chunks=0"], "chunks = 0, wanted"),
                               (["output=out", "chunks=2"], "plan is missing")):
            done = self.expect(1, ["snakemake", "--snakefile", WORKFLOW / "Snakefile", "--cores", 1, "--config",
                                   *words])
            self.assertIn(message, done.stdout)

    @needs("parallel")
    def test_parallel(self):
        output = self.folder / "parallel"
        self.expect(0, ["sh", "-c", f"seq 4 | parallel --jobs 2 --joblog {self.folder}/joblog --resume-failed "
                        f"{COMMAND} campaign {self.plan} --chunk {{}}/4 --threads 1 -o {output}"])
        self.expect(0, [COMMAND, "campaign", self.plan, "--merge", "-o", output])
        self.expect_reference(output)

    @needs("slurmctld", "slurmd", "munged", "sbatch", root=True)
    def test_array_of_sbatch(self):
        cluster, output = self.folder / "cluster", self.folder / "array"
        self.addCleanup(self.run_words, [CLUSTER, "stop", cluster])
        started = self.expect(0, [CLUSTER, "start", cluster, 2])
        environment = dict(os.environ, SLURM_CONF=str(cluster / "etc/slurm.conf"))
        self.assertEqual(started.stdout, f"export SLURM_CONF={cluster}/etc/slurm.conf\n")
        self.expect(0, ["sbatch", "--wait", "--array=1-4", f"--output={self.folder}/array-%a.log", "--wrap",
                        f"{COMMAND} campaign {self.plan} --chunk $SLURM_ARRAY_TASK_ID/4 --threads 1 -o {output}"],
                    env=environment)
        self.expect(0, [COMMAND, "campaign", self.plan, "--merge", "-o", output])
        self.expect_reference(output)
        self.expect(0, [CLUSTER, "stop", cluster])
        self.assertEqual(list((cluster / "run").iterdir()), [])


if __name__ == "__main__":
    main()
