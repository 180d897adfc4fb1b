# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The risley command, to compare the package with."""
import json
import os
import subprocess


def command(*words, status=0):
    """What a verb prints."""
    done = subprocess.run([os.environ["RISLEY_COMMAND"], *map(str, words), "--json"],
                          capture_output=True, text=True, check=False)
    assert done.returncode == status, done.stderr
    return json.loads(done.stdout)


def help_of(verb):
    """All options of a verb."""
    return subprocess.run([os.environ["RISLEY_COMMAND"], verb, "--help-all"],
                          capture_output=True, text=True, check=True).stdout


def command_text(*words):
    """What a verb prints for people."""
    return subprocess.run([os.environ["RISLEY_COMMAND"], *map(str, words)],
                          capture_output=True, text=True, check=True).stdout
