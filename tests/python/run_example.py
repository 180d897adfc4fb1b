# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Runs an example: run_example.py SCRIPT [ARGUMENT...]. Exit status 77: skipped for want of numpy."""
import importlib.util
import runpy
import sys

if importlib.util.find_spec("numpy") is None:
    print("SKIPPED: no numpy: see scripts/install-dependencies --test")
    sys.exit(77)
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
