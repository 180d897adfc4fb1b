#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Every public header may be included alone: it compiles when nothing of ours stands before it.

Headers of other libraries that the build parses once are there already, which makes this quick; so
a public header must include those that it names itself.

Usage: tools/check_headers.py BUILD_FOLDER
  BUILD_FOLDER  holds compile_commands.json, as the presets dev and test write it
RISLEY_JOBS limits the number of compilers. Exit status: 0 all well, 1 a header fails.
"""

import re
import subprocess
import sys
from pathlib import Path

from compile_commands import ROOT, at_once, commands_of

# What stands in the parsed headers (RISLEY_EIGEN_HEADERS) by the names that headers of ours use.
NAMES_OF = {
    'algorithm': r'std::(clamp|copy|fill|find|max|min|sort|transform)\b', 'array': r'std::array\b',
    'cmath': r'std::(abs|atan2|cos|hypot|isfinite|isnan|sin|sqrt|tan)\b',
    'cstdint': r'std::u?int\d+_t\b', 'filesystem': r'std::filesystem\b',
    'functional': r'std::function\b', 'map': r'std::(multi)?map\b',
    'memory': r'std::(make_unique|shared_ptr|unique_ptr)\b', 'optional': r'std::(nullopt|optional)\b',
    'span': r'std::span\b', 'string': r'std::(string|to_string)\b',
    'string_view': r'std::string_view\b', 'vector': r'std::vector\b', 'Eigen/': r'Eigen::',
    'fmt/': r'fmt::',
}


def missing_includes(header):
    """A line for every header that is named and not included."""
    text = re.sub(r'//.*', '', (ROOT / 'include' / header).read_text())
    return ''.join(f'include/{header}: names {re.search(names, text)[0]} and lacks <{include}...>\n'
                   for include, names in NAMES_OF.items()
                   if re.search(names, text) and f'#include <{include}' not in text)


def compile_alone(header, directory, command):
    """Returns what the compiler says of a header, nothing if all is well."""
    return subprocess.run(f'{command} -fsyntax-only -x c++ -', shell=True, cwd=directory, text=True,
                          input=f'#include "{header}"\n', stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT).stdout


def main(arguments):
    if len(arguments) != 1:
        sys.exit(__doc__)
    of_layer = {source.parent.relative_to(ROOT / 'src').parts[0]: command
                for source, command in commands_of(Path(arguments[0]).resolve()).items()
                if source.is_relative_to(ROOT / 'src') and not source.stem.endswith('_kernel')}
    include = ROOT / 'include'
    headers = sorted(path.relative_to(include) for path in include.rglob('*.hpp'))
    said = at_once(lambda header: missing_includes(header) +
                   compile_alone(header, *of_layer[header.parts[1]]), headers)
    for words in filter(None, said):
        print(words)
    if any(said):
        print('check_headers: failed, see above')
        return 1
    print(f'check_headers: {len(headers)} headers compile alone')
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
