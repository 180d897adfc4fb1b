#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Checks that code compiled for one instruction set cannot stand in for anybody else's.

The linker keeps one copy of every weak function (an inline one or a template instance). If an
object compiled with, say, -mavx2 holds one whose name does not say so, that copy may serve the
whole program and stop older processors with an illegal instruction. So the name of every weak
function in such an object must name the instruction set, in a template argument or a namespace.
Weak data (V and u in nm) is the same in every copy and may be shared.

Usage: tools/check_simd_symbols.py INSTRUCTION_SET OBJECT...     (for example avx2 kernel.cpp.o)
Exit status: 0 all well, 1 a function could leak or an object defines none.
"""
import os
import re
import subprocess
import sys

WEAK_FUNCTION = "W"
FUNCTIONS = (WEAK_FUNCTION, "T")
LINE = re.compile(r"^[0-9a-f]+ (\w) (.*)$")


def leaking_functions(symbols, instruction_set):
    """The weak ones among (type, name) pairs of nm whose name lacks the instruction set."""
    tag = re.compile(rf"(?<![A-Za-z]){re.escape(instruction_set)}[a-z]*(?![A-Za-z])")
    return [name for kind, name in symbols if kind == WEAK_FUNCTION and not tag.search(name)]


def symbols_of(path):
    """(type, demangled name) of each symbol that the object file defines."""
    text = subprocess.run([os.environ.get("NM", "nm"), "--demangle", "--defined-only", path],
                          check=True, capture_output=True, text=True).stdout
    return [match.groups() for match in map(LINE.match, text.splitlines()) if match]


def check(path, instruction_set):
    symbols = symbols_of(path)
    if not any(kind in FUNCTIONS for kind, _ in symbols):
        return [f"{path}: defines no function"]
    return [f"{path}: weak function without '{instruction_set}' in its name: {name}"
            for name in leaking_functions(symbols, instruction_set)]


def main():
    if len(sys.argv) < 3:
        print(__doc__, file=sys.stderr)
        return 2
    instruction_set, paths = sys.argv[1], sys.argv[2:]
    errors = [error for path in paths for error in check(path, instruction_set)]
    print("\n".join(errors) if errors else f"check_simd_symbols: {instruction_set} stays at home")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
