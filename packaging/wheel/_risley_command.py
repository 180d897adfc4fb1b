# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The command risley of a wheel: the program in the package's folder, which this process becomes.

A module of its own, because importing the package would take longer than most commands.
"""
import os
import pathlib
import sys


def main() -> None:
    """Runs it with the words of this process."""
    command = pathlib.Path(__file__).parent / "risley" / "bin" / "risley"
    os.execv(command, sys.argv)
