#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""What Slurm says of a job, in the words of Snakemake: running, success or failed.

Usage: slurm_status.py JOB   JOB is what `sbatch --parsable` printed: NUMBER or NUMBER;CLUSTER

Asks `scontrol`, which needs no accounting. While the controller does not answer, a job counts as running. A job that
the controller does not know (any more) counts as failed: Snakemake sends it again, and if its chunk is whole the
command has nothing to do.
"""
import re
import subprocess
import sys

ALIVE = {"PENDING", "CONFIGURING", "RUNNING", "COMPLETING", "STAGE_OUT", "SUSPENDED", "STOPPED", "SIGNALING",
         "RESIZING", "REQUEUED", "REQUEUE_FED", "REQUEUE_HOLD", "SPECIAL_EXIT", "RESV_DEL_HOLD"}


def status(exit_status, stdout, stderr):
    """The word for what `scontrol show job` answered."""
    if exit_status != 0:
        return "failed" if "Invalid job id" in stderr else "running"
    found = re.search(r"\bJobState=(\w+)", stdout)
    if not found or found.group(1) in ALIVE:
        return "running"
    return "success" if found.group(1) == "COMPLETED" else "failed"


def main():
    if len(sys.argv) != 2 or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        return 0 if len(sys.argv) == 2 else 2
    job, _, cluster = sys.argv[1].partition(";")
    command = ["scontrol", *([f"--clusters={cluster}"] if cluster else []), "--oneliner", "show", "job", job]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        print(status(done.returncode, done.stdout, done.stderr))
    except subprocess.TimeoutExpired:
        print("running")
    return 0


if __name__ == "__main__":
    sys.exit(main())
