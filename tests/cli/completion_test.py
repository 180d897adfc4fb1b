#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The shell completions know every verb, every option and every choice."""
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from command import COMMAND, SOURCE, CommandTest, verbs

FOLDER = tempfile.TemporaryDirectory()
COMPLETIONS = Path(FOLDER.name) / "completions"


def setUpModule():
    subprocess.run([sys.executable, SOURCE / "tools/command_documents.py", COMMAND, FOLDER.name], check=True)


def tearDownModule():
    FOLDER.cleanup()


def run_shell(shell, script, *words, folder=None):
    return subprocess.run([shell, "-c", script, shell, *words], capture_output=True, text=True, check=True,
                          cwd=folder, timeout=120).stdout


def complete(*words):
    """What bash offers for the last word."""
    return set(run_shell("bash", f'source "{COMPLETIONS}/risley.bash"; compopt() {{ :; }}; COMP_WORDS=("$@"); '
                         'COMP_CWORD=$(($# - 1)); _risley; printf "%s\\n" "${COMPREPLY[@]}"', *words).split())


def complete_in_fish(line, folder):
    """What fish offers at the end of a line."""
    text = run_shell("fish", f'complete -e risley; source "{COMPLETIONS}/risley.fish"; complete -C "{line}"',
                     folder=folder)
    return {one.split("\t")[0] for one in text.splitlines()}


# Zsh completes in a terminal of its own; what it would add is printed instead.
ZSH = r"""
zmodload zsh/zpty zsh/zselect
zpty shell zsh -f -i
zpty -w shell 'PS1=; stty -echo; cd "$FOLDER"; fpath=("$COMPLETIONS" $fpath); autoload -U compinit; compinit -D -u'
zpty -w shell 'compadd() {
  local -A found; local -a here; zparseopts -E -a here O:=found A:=found D:=found
  (( ${#found} )) && { builtin compadd "$@"; return }
  builtin compadd -A here "$@"; builtin compadd "$@"; local status_=$?
  print -r -- "<${(j:> <:)here}>" >>"$FOUND"; return status_ }'
zpty -w shell 'bindkey "^I" complete-word; zle -C complete-word complete-word _main_complete'
zpty -w shell "print -r -- ready >>\"\$FOUND\""
until [[ -s $FOUND ]]; do zselect -t 2; done
zpty -w -n shell "$1"$'\t'
same=0 before=""
until (( same > 25 )); do # half a second without a change
  zselect -t 2
  now=$(<$FOUND)
  if [[ $now == ready || $now != $before ]]; then same=0; else (( ++same )); fi
  before=$now
done
zpty -d shell
"""


class CommandWithVerbs(CommandTest):
    def declared(self, *verb):
        """The options of a verb. Descriptions may name other ones; only lines that begin with one declare it."""
        text = self.expect(0, *verb, "--help-all").stdout
        return set(re.findall(r"^\s+(?:-\w,\s*)?(--[a-z][a-z-]+)", text, re.MULTILINE))

    def choices(self, verb, option):
        text = self.expect(0, verb, "--help-all").stdout
        shown = re.search(option + r" ([a-z-]+(\|[a-z-]+)+)", text)
        if shown:
            return set(shown.group(1).split("|"))
        # A long list is part of the description.
        entry = re.search(rf"^  {option} NAME(.*?)^(  \S|$)", text, re.MULTILINE | re.DOTALL).group(1)
        return set(" ".join(entry.split()).partition("one of: ")[2].partition(" (")[0].split(", "))


@unittest.skipUnless(shutil.which("bash"), "no bash")
class CompletionTest(CommandWithVerbs):
    def test_verbs(self):
        self.assertEqual(complete("risley", ""), set(verbs()))

    def test_options(self):
        for verb in verbs():
            declared = self.declared(verb)
            self.assertGreater(len(declared), 5)
            self.assertEqual(complete("risley", verb, "--"), declared, verb)

    def test_choices(self):
        for verb, option in (("simulate", "--rotor"), ("simulate", "--quantize"),
                             ("estimate", "--states"), ("estimate", "--mirror"),
                             ("convert", "--format"), ("convert", "--sensor-type"),
                             ("pattern", "--format"), ("pattern", "--firing")):
            self.assertEqual(complete("risley", verb, option, ""), self.choices(verb, option), option)

    def test_presets(self):
        names = {one["name"] for one in self.expect_json(0, "preset", "list")["presets"]}
        self.assertLessEqual(names, complete("risley", "simulate", "--sensor", ""))  # and files
        self.assertEqual(complete("risley", "preset", "show", ""), names)
        self.assertEqual(complete("risley", "preset", ""), {"list", "show", "check", "new"})
        for action in ("show", "new"):
            self.assertLess(self.declared("preset", action), complete("risley", "preset", action, "--"))

    def test_names(self):
        for verb in ("estimate", "calibrate", "observability"):
            for option in ("--fix", "--free"):
                offered = complete("risley", verb, option, "")
                self.assertLessEqual({"refractive_index_air", "wedge_angle_deg", "prism_tilt_c_vertical_deg"}, offered)
        self.assertIn("angular_velocity_a_deg_per_s", complete("risley", "simulate", "--set", ""))
        self.assertIn("nominal", complete("risley", "simulate", "--reported", ""))
        self.assertEqual(complete("risley", "estimate", "--rate-hz", ""), {"full"})
        self.assertLessEqual({"auto", "paper"}, complete("risley", "estimate", "--process-noise", ""))


@unittest.skipUnless(shutil.which("fish"), "no fish")
class FishTest(CommandWithVerbs):
    def complete(self, line):
        return complete_in_fish(line, self.folder)

    def test_verbs(self):
        self.assertEqual(self.complete("risley "), set(verbs()))
        self.assertEqual(self.complete("risley preset "), {"list", "show", "check", "new"})

    def test_options(self):
        for verb in verbs():
            self.assertEqual({one for one in self.complete(f"risley {verb} --") if one.startswith("--")},
                             self.declared(verb), verb)
        self.assertLess(self.declared("preset", "new"), self.complete("risley preset new --"))

    def test_values(self):
        self.assertEqual(self.complete("risley simulate --rotor "), self.choices("simulate", "--rotor"))
        names = {one["name"] for one in self.expect_json(0, "preset", "list")["presets"]}
        self.assertLessEqual(names, self.complete("risley simulate --sensor "))
        self.assertEqual(self.complete("risley preset show "), names)
        (self.folder / "a.lvx").touch()
        self.assertEqual(self.complete("risley info a."), {"a.lvx"})


@unittest.skipUnless(shutil.which("zsh"), "no zsh")
class ZshTest(CommandWithVerbs):
    def complete(self, line):
        found = self.folder / "found"
        found.write_text("")
        script = f"export FOUND={found} COMPLETIONS={COMPLETIONS} FOLDER={self.folder}\n" + ZSH
        run_shell("zsh", script, line)
        return set(re.findall(r"<([^>]+)>", found.read_text()))

    def test_verbs(self):
        self.assertEqual(self.complete("risley "), set(verbs()))
        self.assertEqual(self.complete("risley preset "), {"list", "show", "check", "new"})

    def test_options(self):
        for verb in ("convert", "preset", "observability", "calibrate"):  # a second each
            self.assertEqual(self.complete(f"risley {verb} --"), self.declared(verb), verb)
        self.assertLess(self.declared("preset", "new"), self.complete("risley preset new --"))

    def test_values(self):
        self.assertEqual(self.complete("risley simulate --rotor "), self.choices("simulate", "--rotor"))
        names = {one["name"] for one in self.expect_json(0, "preset", "list")["presets"]}
        self.assertLessEqual(names, self.complete("risley simulate --sensor "))
        self.assertEqual(self.complete("risley preset show "), names)


if __name__ == "__main__":
    unittest.main()
