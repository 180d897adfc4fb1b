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
        return re.findall(r"^  ([a-z]+) ", text.split("Subcommands:")[1], re.MULTILINE)

    def test_verbs(self):
        self.assertEqual(complete("risley", ""), set(self.verbs()))

    def test_options(self):
        for verb in self.verbs():
            text = self.expect(0, verb, "--help").stdout
            options = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", text.split("Example:")[0]))
            # Descriptions may name the options of other verbs; lines that begin with one count.
            declared = {option for line in text.splitlines() if re.match(r"\s+-", line)
                        for option in re.findall(r"(?<![\w-])--[a-z][a-z-]+", line.split("  ")[1])}
            self.assertLessEqual(declared, options)
            self.assertGreater(len(declared), 5)
            self.assertEqual(complete("risley", verb, "--"), declared, verb)

    def test_choices(self):
        for verb, option in (("simulate", "--rotor"), ("simulate", "--quantize"),
                             ("estimate", "--states"), ("estimate", "--mirror"),
                             ("convert", "--format")):
            text = self.expect(0, verb, "--help").stdout
            shown = re.search(option + r" TEXT:\{([^}]+)\}", text).group(1)
            self.assertEqual(complete("risley", verb, option, ""), set(shown.split(",")), option)


if __name__ == "__main__":
    unittest.main()
