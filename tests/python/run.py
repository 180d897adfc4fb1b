# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Runs a test with pytest: run.py SCRIPT. Exit status 77: skipped for want of a package."""
import importlib.util
import sys

MISSING = [name for name in ("numpy", "pytest", "hypothesis")
           if importlib.util.find_spec(name) is None]
if MISSING:
    print(f"SKIPPED: no {', '.join(MISSING)}: see scripts/install-dependencies --test")
    sys.exit(77)

import pytest  # noqa: E402

sys.exit(pytest.main(["-q", "-p", "no:cacheprovider", *sys.argv[1:]]))
