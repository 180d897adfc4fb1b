#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Reports which lines of layers a run of the preset coverage has reached, from what gcov counted.

Usage: tools/line_coverage.py BUILD [--missing] [--least PERCENT] LAYER...
  --missing  names the lines of each file that were not reached
  --least    fails where less of the first layer was reached
Exit status: 0 all well, 1 less was reached, 2 nothing was counted.
"""
import argparse
import collections
import gzip
import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def counts_of(build, layer):
    """How often each line was run, by file below src/LAYER."""
    files = collections.defaultdict(dict)
    for notes in sorted(build.glob(f"CMakeFiles/risley_{layer}.dir/**/*.gcda")):
        text = subprocess.run(["gcov", "--json-format", "--stdout", str(notes)], cwd=build, check=True,
                              capture_output=True).stdout
        if text[:2] == b"\x1f\x8b":
            text = gzip.decompress(text)
        for line in text.splitlines():
            for file in json.loads(line)["files"]:
                path = pathlib.Path(file["file"])
                path = (path if path.is_absolute() else build / path).resolve()
                if not path.is_relative_to(ROOT / "src" / layer):
                    continue
                seen = files[path.relative_to(ROOT)]
                for one in file["lines"]:  # once for each instance of a template
                    seen[one["line_number"]] = seen.get(one["line_number"], 0) + one["count"]
    return files


def spans(numbers):
    """1, 2, 3, 7 as 1-3, 7."""
    text, begin, last = [], None, None
    for number in [*numbers, None]:
        if last is not None and number == last + 1:
            last = number
            continue
        if begin is not None:
            text.append(f"{begin}-{last}" if last > begin else str(begin))
        begin = last = number
    return ", ".join(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("layers", nargs="+", metavar="LAYER")
    parser.add_argument("--missing", action="store_true")
    parser.add_argument("--least", type=float, default=0, metavar="PERCENT")
    wishes = parser.parse_args()
    status = 0
    for number, layer in enumerate(wishes.layers):
        files = counts_of(wishes.build.resolve(), layer)
        lines = sum(len(seen) for seen in files.values())
        if lines == 0:
            print(f"line_coverage: nothing was counted of src/{layer} in {wishes.build}", file=sys.stderr)
            return 2
        reached = sum(count > 0 for seen in files.values() for count in seen.values())
        for path, seen in sorted(files.items()):
            missing = sorted(line for line, count in seen.items() if count == 0)
            if wishes.missing and missing:
                print(f"{path}: {len(missing)} of {len(seen)} not reached: {spans(missing)}")
        print(f"src/{layer}: {reached} of {lines} lines, {100 * reached / lines:.1f} %")
        if number == 0 and 100 * reached < wishes.least * lines:
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
