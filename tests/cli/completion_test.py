#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The shell completion knows every verb, every option and every choice."""
import re
import shutil
import subprocess
import unittest

from command import SOURCE, CommandTest

COMPLETION = SOURCE / "completions" / "risley.bash"


def complete(*words):
    """What bash offers for the last word."""
    script = (f'source "{COMPLETION}"; compopt() {{ :; }}; COMP_WORDS=("$@"); '
              'COMP_CWORD=$(($# - 1)); _risley; printf "%s\\n" "${COMPREPLY[@]}"')
    done = subprocess.run(["bash", "-c", script, "bash", *words], capture_output=True, text=True,
                          check=True)
    return set(done.stdout.split())


@unittest.skipUnless(shutil.which("bash"), "no bash")
class CompletionTest(CommandTest):
    def verbs(self):
        text = self.expect(0, "--help").stdout
        after = re.split("subcommands:", text, flags=re.IGNORECASE)[1]
        return re.findall(r"^  ([a-z]+) ", after, re.MULTILINE)

    def test_verbs(self):
        self.assertEqual(complete("risley", ""), set(self.verbs()))

    def test_options(self):
        for verb in self.verbs():
            text = self.expect(0, verb, "--help").stdout
            # Descriptions may name other options; only lines that begin with one declare it.
            declared = set(re.findall(r"^\s+(?:-\w,\s*)?(--[a-z][a-z-]+)", text, re.MULTILINE))
            self.assertGreater(len(declared), 5)
            self.assertEqual(complete("risley", verb, "--"), declared, verb)

    def test_choices(self):
        for verb, option in (("simulate", "--rotor"), ("simulate", "--quantize"),
                             ("estimate", "--states"), ("estimate", "--mirror"),
                             ("convert", "--format"), ("convert", "--sensor-type"),
                             ("pattern", "--format"), ("pattern", "--firing")):
            text = self.expect(0, verb, "--help").stdout
            shown = re.search(option + r" TEXT:\{([^}]+)\}", text).group(1)
            self.assertEqual(complete("risley", verb, option, ""), {one.strip() for one in shown.split(",")}, option)

    def test_presets(self):
        names = {one["name"] for one in self.expect_json(0, "preset", "list")["presets"]}
        self.assertLessEqual(names, complete("risley", "simulate", "--sensor", ""))  # and files
        self.assertEqual(complete("risley", "preset", "show", ""), names)
        self.assertEqual(complete("risley", "preset", ""), {"list", "show", "check", "new"})
        for action in ("show", "new"):
            text = self.expect(0, "preset", action, "--help").stdout
            declared = set(re.findall(r"^\s+(?:-\w,\s*)?(--[a-z][a-z-]+)", text, re.MULTILINE))
            self.assertLess(declared, complete("risley", "preset", action, "--"))


if __name__ == "__main__":
    unittest.main()
