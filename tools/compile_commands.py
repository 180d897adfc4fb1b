# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""How CMake has the sources compiled, for the checks in this folder."""

import json
import os
import re
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def commands_of(build):
    """For every source the folder and the compiler's command, without what it reads and writes.

    Of a source that is compiled several times, as kernels are, the first one. Headers that gcc has
    parsed beforehand stay part of the command.
    """
    file = build / 'compile_commands.json'
    if not file.exists():
        sys.exit(f'{file} is missing; configure with --preset dev or test')
    commands = {}
    for entry in json.loads(file.read_text()):
        source = Path(entry['directory'], entry['file']).resolve()
        command = re.sub(r' -o \S+ -c \S+$', '', entry['command'])
        together = source.name.startswith('unity_') and source.suffix == '.cxx'
        for each in re.findall(r'^#include "(.*)"$', source.read_text(), re.M) if together else [source]:
            commands.setdefault(Path(each), (entry['directory'], command))
    return commands


def at_once(work, items):
    """Results of work for every item; RISLEY_JOBS limits how many are under way."""
    with ThreadPoolExecutor(int(os.environ.get('RISLEY_JOBS') or os.cpu_count())) as pool:
        return list(pool.map(work, items))
