#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Every public header may be included alone: it compiles when nothing of ours stands before it.

Headers of other libraries that the build parses once are there already, which makes this quick; so
a public header must include those that it names itself. For the same reason a header is compiled
after others of ours only where it includes all of them anyway: they can lend it nothing.

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


def included_by(headers):
    """The headers of ours that each includes, also through others."""
    direct = {header: [each for each in map(Path, re.findall(
        r'^#include "(.*)"', (ROOT / 'include' / header).read_text(), re.M)) if each in headers]
        for header in headers}
    closed = {}

    def close(header):
        if header not in closed:
            closed[header] = set(direct[header]).union(*map(close, direct[header]))
        return closed[header]
    return {header: close(header) for header in headers}


def chains_of(headers):
    """As few lists as possible of headers that include all before them in their list."""
    included = included_by(set(headers))
    after = {}  # the header that follows one in its list

    def follow(header, seen):
        """Finds a header to put before this one; others may have to change theirs."""
        for each in sorted(included[header] - seen):
            seen.add(each)
            if each not in after or follow(after[each], seen):
                after[each] = header
                return True
        return False
    firsts = set(headers)
    for header in headers:
        follow(header, set())
    firsts -= set(after.values())
    chains = []
    for header in sorted(firsts):
        chains.append([header])
        while chains[-1][-1] in after:
            chains[-1].append(after[chains[-1][-1]])
    return chains


def compile_chain(chain, directory, command):
    """Returns what the compiler says of headers, nothing if all is well."""
    return subprocess.run(f'{command} -fsyntax-only -x c++ -', shell=True, cwd=directory, text=True,
                          input=''.join(f'#include "{header}"\n' for header in chain),
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT).stdout


def main(arguments):
    if len(arguments) != 1:
        sys.exit(__doc__)
    of_layer = {source.parent.relative_to(ROOT / 'src').parts[0]: command
                for source, command in commands_of(Path(arguments[0]).resolve()).items()
                if source.is_relative_to(ROOT / 'src') and not source.stem.endswith('_kernel')}
    include = ROOT / 'include'
    headers = sorted(path.relative_to(include) for path in include.rglob('*.hpp'))
    said = list(map(missing_includes, headers))
    said += at_once(lambda chain: compile_chain(chain, *of_layer[chain[-1].parts[1]]),
                    chains_of(headers))
    for words in filter(None, said):
        print(words)
    if any(said):
        print('check_headers: failed, see above')
        return 1
    print(f'check_headers: {len(headers)} headers compile alone')
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
