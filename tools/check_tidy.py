#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Runs clang-tidy with the checks of .clang-tidy on the sources in src/, studies/ and apps/.

Most of its time goes into the headers of libraries, so the sources of a layer, or of several small ones, are
looked at in one piece, as one file that includes them all. That also finds a name which stands for
two things, or twice for the same, within a layer. Kernels, which have a compiler command of their
own, are looked at alone.

Usage: tools/check_tidy.py BUILD_FOLDER [--changed [COMMIT]]
  BUILD_FOLDER  holds compile_commands.json, as the presets dev and test write it
  --changed     only the pieces of sources that differ from COMMIT (without it: from the last one)
RISLEY_JOBS limits the number of processes. Exit status: 0 all well, 1 a check fails, 77 skipped for
want of clang-tidy.
"""

import json
import re
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

from compile_commands import ROOT, at_once, commands_of

LARGEST = 60  # sources of a piece of several layers: more leave a processor without work at the end


def changed_sources(commit):
    def git(*words):
        return subprocess.run(['git', *words, '--', 'src', 'studies', 'apps'], cwd=ROOT, check=True,
                              capture_output=True, text=True).stdout.splitlines()
    names = git('diff', '--name-only', '--diff-filter=d', commit)
    names += git('ls-files', '--others', '--exclude-standard')
    return {ROOT / name for name in names if name.endswith('.cpp')}


def pieces_of(sources, commands):
    """Lists of sources that are looked at as one file, those that take longest first."""
    layers, kernels = defaultdict(list), []
    for source in sources:
        if source not in commands:
            sys.exit(f'check_tidy: {source} is not in compile_commands.json; configure anew')
        if source.stem.endswith('_kernel'):
            kernels.append([source])
        else:
            layers[source.relative_to(ROOT).parts[:2]].append(source)
    pieces = [[]]
    for layer in layers.values():
        if pieces[-1] and len(pieces[-1]) + len(layer) > LARGEST:
            pieces.append([])
        pieces[-1] += layer
    return sorted(filter(None, pieces + kernels), key=len, reverse=True)


def command_of(sources, commands):
    """The command of the first source, with what others see besides."""
    command = re.sub(r' -Winvalid-pch -include \S+| --param \S+', '', commands[sources[0]][1])  # for gcc alone
    for source in sources:
        for option in re.findall(r' (?:-[DI]|-isystem )\S+', commands[source][1]):
            if option not in command:
                command += option
    return command


def look_at(sources, number, folder, commands):
    """Runs clang-tidy on one piece. Returns whether it passes, and what it said."""
    piece = folder / f'piece_{number}.cpp'
    piece.write_text(''.join(f'#include "{source}"\n' for source in sources))
    place = folder / f'piece_{number}'
    place.mkdir()
    directory, command = commands[sources[0]][0], command_of(sources, commands)
    (place / 'compile_commands.json').write_text(json.dumps(
        [{'directory': directory, 'command': f'{command} -c {piece}', 'file': str(piece)}]))
    done = subprocess.run(
        ['clang-tidy', '-p', str(place), f'--config-file={ROOT / ".clang-tidy"}', '--quiet',
         r'--header-filter=(include/risley|src|studies|apps)/.*\.[hc]pp$',
         '--extra-arg=-Wno-unknown-warning-option',
         '--extra-arg=-Wno-shadow',  # of a name in another file; the compiler looks for real ones
         str(piece)],
        capture_output=True, text=True)
    # Without the number of warnings in system headers.
    said = [line for line in (done.stdout + done.stderr).splitlines()
            if not re.match(r'\d+ (warning|error).* (generated|treated)', line)]
    return done.returncode == 0, '\n'.join(said)


def main(arguments):
    if not arguments or len(arguments) > 3 or arguments[1:2] not in ([], ['--changed']):
        sys.exit(__doc__)
    if not shutil.which('clang-tidy'):
        print('check_tidy: SKIPPED, there is no clang-tidy (scripts/install-dependencies --lint)')
        return 77
    build = Path(arguments[0]).resolve()
    commands = commands_of(build)
    pieces = pieces_of(
        sorted(source for folder in ('src', 'studies', 'apps')
               for source in (ROOT / folder).rglob('*.cpp')), commands)
    if arguments[1:]:
        changed = changed_sources((arguments[2:] or ['HEAD'])[0])
        pieces = [piece for piece in pieces if changed.intersection(piece)]
    folder = build / 'tidy'
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    results = at_once(lambda piece: look_at(piece[1], piece[0], folder, commands),
                      enumerate(pieces))
    for passed, said in results:
        if said:
            print(said)
    if not all(passed for passed, _ in results):
        print('check_tidy: failed, see above')
        return 1
    print(f'check_tidy: {sum(map(len, pieces))} sources pass')
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
