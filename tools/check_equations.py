#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Checks that docs/equations.md leads somewhere: every equation of the paper has a row, and every
file, function and test that a row names exists.

A name stands behind the file that holds it: `optics/snell.hpp` `refract` in the column of the code,
`tests/optics/inverse_test.cpp` `Inverse.RefusesWhatItCannotAnswer` in that of the tests.

Usage: tools/check_equations.py [ROOT]
Exit status: 0 all well, 1 something is missing (one line each: file:line: what is wrong).
"""
import pathlib
import re
import sys

DOCUMENT = "docs/equations.md"
EQUATIONS = range(1, 33)
CODE_FOLDERS = ("include/risley", "src", "")
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
TEST = re.compile(r"^\s*(?:TYPED_)?TEST(?:_[FP])?\(\s*(\w+)\s*,\s*(\w+)\s*\)", re.MULTILINE)


def equations_of(cell):
    """The numbers in "3-9, 13-18"; none in "Table 1"."""
    numbers = set()
    for part in cell.split(","):
        match = re.fullmatch(r"\s*(\d+)(?:-(\d+))?\s*", part)
        if match:
            first = int(match.group(1))
            numbers.update(range(first, int(match.group(2) or first) + 1))
    return numbers


def find_file(root, name, folders):
    for folder in folders:
        if (root / folder / name).is_file():
            return root / folder / name
    return None


def names_in(path):
    """What a name behind a file may be: tests of a test, words of anything else."""
    text = path.read_text(encoding="utf-8")
    if path.suffix in (".hpp", ".cpp"):
        text = COMMENT.sub("", text)
    tests = {f"{suite}.{test}" for suite, test in TEST.findall(text)}
    return tests if path.name.endswith("_test.cpp") else set(re.findall(r"\w+", text))


def check_cell(root, cell, folders, what):
    """Errors of a cell and how many names it has."""
    errors, count = [], 0
    path = names = None
    for token in re.findall(r"`([^`]+)`", cell):
        if "/" in token:
            path = find_file(root, token, folders)
            if path is None:
                errors.append(f"the file {token} does not exist")
            names = names_in(path) if path else None
            continue
        count += 1
        if path is None and names is None and not errors:
            errors.append(f"{token} stands behind no file")
        elif names is not None and not set(token.split("::")) <= names:
            errors.append(f"{what} {token} is not in {path.relative_to(root)}")
    return errors, count


def check(root):
    """Every error of the table under root, as text."""
    seen, rows, errors = set(), 0, []
    lines = (root / DOCUMENT).read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines, 1):
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if not line.startswith("|") or cells[0] == "equation" or set(line) <= set("|-: "):
            continue
        rows += 1
        place = f"{DOCUMENT}:{number}"
        if len(cells) != 4:
            errors.append(f"{place}: {len(cells)} columns, expected equation, what, code, test")
            continue
        seen |= equations_of(cells[0])
        for cell, folders, what in ((cells[2], CODE_FOLDERS, "function"), (cells[3], ("",), "test")):
            found, count = check_cell(root, cell, folders, what)
            errors += [f"{place}: {error}" for error in found]
            if count == 0:
                errors.append(f"{place}: {cells[0]} names no {what}")
    if not rows:
        return [f"{DOCUMENT}: no table found"]
    for equation in sorted(set(EQUATIONS) - seen):
        errors.append(f"{DOCUMENT}: equation {equation} has no row")
    return errors


def main():
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).parents[1]
    errors = check(root)
    print("\n".join(errors) if errors else "check_equations: every equation leads to code and test")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
