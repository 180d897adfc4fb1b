#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""No kernel takes over a tenth more instructions than kernel_instructions.json says. callgrind counts them with AVX2,
which it knows, so the counts do not depend on what else the machine does. They do on the compiler: another version has
counts of its own, and without them the test is SKIPPED.

  kernel_instructions_test.py --keep   keep today's counts for this compiler: after a kernel has become faster, or for
                                       a new compiler. RISLEY_KERNEL_INSTRUCTIONS names the program that is counted and
                                       RISLEY_COMPILER what compiled it, as ctest does (`ctest --preset test -V -R ^instructions`)
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

REFERENCES = pathlib.Path(__file__).with_suffix("").with_name("kernel_instructions.json")
KERNELS = ("directions", "sequence", "jacobian", "accumulate", "wall", "filter")  # of kernel_instructions.cpp
ALLOWED = 1.1  # times the reference
SKIPPED = 77

HOW_TO_ADD = ("to keep its counts: RISLEY_KERNEL_INSTRUCTIONS={program} RISLEY_COMPILER='{compiler}' "
              "tests/instructions/kernel_instructions_test.py --keep")


def counts_of(folder, shots):
    """{kernel: instructions per shot} of callgrind's dumps, of which each was written at the end of one function."""
    found = {}
    for dump in sorted(pathlib.Path(folder).glob("out*")):
        text = dump.read_text(encoding="utf-8", errors="replace")
        trigger = re.search(r"^desc: Trigger: --dump-after=counted_(\w+)", text, re.MULTILINE)
        if trigger:
            total = int(re.search(r"^(?:totals|summary): (\d+)", text, re.MULTILINE).group(1))
            found[trigger.group(1)] = total / shots[trigger.group(1)]
    return found


def count(program):
    """{kernel: instructions per shot}; None where there is no AVX2."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(["valgrind", "--tool=callgrind", "--collect-atstart=no", "--toggle-collect=counted_*",
                               *(f"--dump-after=counted_{kernel}" for kernel in KERNELS),
                               f"--callgrind-out-file={folder}/out", program],
                              capture_output=True, text=True, check=False)
        if done.returncode == SKIPPED:
            return None
        if done.returncode != 0:
            raise SystemExit(f"{program} under valgrind: exit status {done.returncode}\n{done.stderr}")
        shots = {name: int(number) for name, number in (line.split() for line in done.stdout.splitlines())}
        found = counts_of(folder, shots)
    if set(found) != set(shots):
        raise SystemExit(f"kernels {sorted(shots)} ran, callgrind reports {sorted(found)}")
    return found


def faults(found, reference):
    """What is wrong with counts, a line each."""
    wrong = [f"{name}: {found[name]:.1f} instructions a shot, {100 * (found[name] / reference[name] - 1):+.1f} %: the "
             f"reference is {reference[name]:.1f}, at most {ALLOWED:g} times that is allowed"
             for name in sorted(set(found) & set(reference)) if found[name] > ALLOWED * reference[name]]
    wrong += [f"{name}: counted, and {REFERENCES.name} has no reference" for name in sorted(set(found) - set(reference))]
    wrong += [f"{name}: in {REFERENCES.name}, and not counted" for name in sorted(set(reference) - set(found))]
    return wrong


class JudgementTest(unittest.TestCase):
    def test_a_tenth_more_is_too_much(self):
        reference = {"a": 100.0, "b": 50.0}
        self.assertEqual(faults({"a": 109.0, "b": 20.0}, reference), [])
        wrong = faults({"a": 111.0, "b": 50.0}, reference)
        self.assertEqual(len(wrong), 1)
        self.assertIn("a: 111.0 instructions a shot, +11.0 %", wrong[0])

    def test_kernels_are_the_same(self):
        self.assertEqual(len(faults({"a": 1.0}, {"b": 1.0})), 2)

    def test_dumps(self):
        with tempfile.TemporaryDirectory() as folder:
            for number, (name, total) in enumerate((("wall", 500), ("filter", 40))):
                pathlib.Path(folder, f"out.{number}").write_text(
                    f"desc: Trigger: --dump-after=counted_{name}\nevents: Ir\nsummary: {total}\n", encoding="utf-8")
            pathlib.Path(folder, "out").write_text("desc: Trigger: Program termination\nsummary: 0\n", encoding="utf-8")
            self.assertEqual(counts_of(folder, {"wall": 100, "filter": 10}), {"wall": 5.0, "filter": 4.0})


def main():
    if not unittest.main(argv=sys.argv[:1], exit=False).result.wasSuccessful():
        return 1
    program, compiler = os.environ["RISLEY_KERNEL_INSTRUCTIONS"], os.environ["RISLEY_COMPILER"]
    if not shutil.which("valgrind"):
        print("SKIPPED: no valgrind: see scripts/install-dependencies --test")
        return SKIPPED
    references = json.loads(REFERENCES.read_text(encoding="utf-8"))
    how = HOW_TO_ADD.format(program=program, compiler=compiler)
    keep = sys.argv[1:] == ["--keep"]
    if compiler not in references and not keep:
        print(f"SKIPPED: {REFERENCES.name} knows {', '.join(sorted(references))}, not {compiler}; {how}")
        return SKIPPED
    found = count(program)
    if found is None:
        print("SKIPPED: this processor or this build has no AVX2")
        return SKIPPED
    reference = references.get(compiler, {})
    for name, value in found.items():
        compared = f", {100 * (value / reference[name] - 1):+.1f} %" if name in reference else ""
        print(f"{name:12} {value:10.1f} instructions a shot{compared}")
    if keep:
        references[compiler] = {name: round(value, 1) for name, value in found.items()}
        REFERENCES.write_text(json.dumps(references, indent=2, sort_keys=True) + "\n", encoding="utf-8")
        return 0
    wrong = faults(found, reference)
    if wrong:
        print("\n".join(wrong))
        return 1
    if any(value < 0.9 * reference[name] for name, value in found.items()):
        print(f"Over a tenth faster than the reference; {how}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
