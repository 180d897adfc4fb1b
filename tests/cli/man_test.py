#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The manual pages hold everything that --help-all prints, and man and mandoc accept them."""
import os
import re
import shutil
import subprocess
import sys
import unittest

from command import COMMAND, SOURCE, CommandTest, verbs


def words_of(text):
    """Letters and digits alone: layout and hyphens differ."""
    return re.findall(r"\w+", text)


HEADINGS = {"Usage"}  # pages have SYNOPSIS


class ManTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        subprocess.run([sys.executable, SOURCE / "tools/command_documents.py", COMMAND, cls.folder], check=True,
                       env={**os.environ, "SOURCE_DATE_EPOCH": "86400"})
        cls.pages = sorted((cls.folder / "man").glob("*.1"))

    def test_one_page_per_verb(self):
        self.assertEqual([page.name for page in self.pages],
                         sorted(["risley.1", *(f"risley-{verb}.1" for verb in verbs())]))

    @unittest.skipUnless(shutil.which("mandoc"), "no mandoc")
    def test_nothing_of_the_help_is_lost(self):
        for verb in ["", *verbs()]:
            words = [verb] if verb else []
            page = self.folder / "man" / ("-".join(["risley", *words]) + ".1")
            shown = subprocess.run(["mandoc", "-T", "utf8", "-O", "width=1000", page], check=True,
                                   capture_output=True, text=True).stdout
            shown = set(words_of(re.sub(".\b", "", shown)))
            helps = [self.expect(0, *words, "--help-all" if verb else "--help").stdout]
            if verb == "preset":
                for action in ("list", "show", "check", "new"):
                    helps.append(self.expect(0, verb, action, "--help-all").stdout)
            for text in helps:
                missing = {word for word in words_of(text) if word not in shown and word.upper() not in shown}
                self.assertLessEqual(missing, HEADINGS, verb)

    @unittest.skipUnless(shutil.which("mandoc"), "no mandoc")
    def test_mandoc_does_not_warn(self):
        done = subprocess.run(["mandoc", "-T", "lint", "-W", "warning", *self.pages], capture_output=True,
                              text=True, check=False)
        self.assertEqual(done.stdout + done.stderr, "")

    @unittest.skipUnless(shutil.which("man"), "no man")
    def test_man_does_not_warn(self):
        for page in self.pages:
            done = subprocess.run(["man", "--warnings", "-l", page], capture_output=True, text=True, check=True,
                                  env={**os.environ, "MANWIDTH": "80", "LC_ALL": "C.UTF-8", "MANROFFSEQ": ""})
            self.assertEqual(done.stderr, "", page.name)
            self.assertIn("SYNOPSIS", done.stdout)

    def test_the_date_is_the_one_that_was_asked_for(self):
        for page in self.pages:
            self.assertIn('"1970-01-02"', page.read_text(encoding="utf-8").splitlines()[0])


if __name__ == "__main__":
    unittest.main()
