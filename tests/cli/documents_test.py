#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The commands that the documents and --help show run in their order and print what is shown.

Each document has a folder of its own, with the repository's data/ and what DATA makes first. Of a
shell block the next block without a language is the output, of one command or of several; a line of
dots stands for lines left out, dots at the end of a line for the rest of it. MESSAGES has the
commands behind output that documents show without one.
"""
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from command import COMMAND, SOURCE, run, verbs
from documents_data import DATA, LEFT_OUT, MESSAGES, STATUS

TOLD = "\036"  # before the exit status of a command
SYSTEM_PYTHON = "/usr/bin/python3"  # Debian's numpy is there, whatever runs first on the path
DOTS = ("...", "…")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\w)")
DIFFERENT_EVERY_TIME = re.compile(r"\b(read|rotation angles|solved) [\d.]+ s\b")


def skip_aloud(command, reason):
    print(f"SKIPPED: {command}: {reason}", file=sys.stderr)


def blocks_of(text):
    """(language, lines) of the fenced blocks."""
    return [(language, body.splitlines())
            for language, body in re.findall(r"^```(\w*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)]


def commands_of(lines):
    """The commands of a shell block, each with all of its lines."""
    commands, begun = [], ""
    for line in lines:
        begun += line + "\n"
        whole = subprocess.run(["bash", "-n", "-c", begun], capture_output=True, check=False)
        if whole.returncode == 0 and not line.endswith("\\"):
            commands.append(begun)
            begun = ""
    assert not begun, f"a command without an end: {begun}"
    return commands


def help_text():
    """The examples of all verbs as one document of shell blocks, those first whose files others use."""
    ordered = sorted(verbs(), key=lambda verb: {"simulate": 0, "estimate": 1, "calibrate": 1}.get(verb, 2))
    examples = [run(verb, "--help").stdout.partition("Examples:\n")[2].partition("\n\n")[0] for verb in ordered]
    return "".join(f"```sh\n{re.sub('^  ', '', text, flags=re.MULTILINE)}\n```\n" for text in examples)


def plain(line):
    """Without what differs every time, and with columns that are as wide as they have to be."""
    line = DIFFERENT_EVERY_TIME.sub(r"\1 ? s", line.strip())
    return re.sub("-{3,}", "---", re.sub(" +", " ", line))


def same_line(shown, printed):
    """Texts are the same. So are numbers, but one whose last shown digit is rounded to its neighbour: sums of
    many shots are added up in an order that depends on how many the processor adds at once."""
    if shown.endswith(DOTS):
        shown = shown.rstrip(".…")
        printed = printed[:len(shown)]
    shown, printed = (plain(line) for line in (shown, printed))
    if NUMBER.sub("0", shown) != NUMBER.sub("0", printed):
        return False
    return all(same_number(a, b) for a, b in zip(NUMBER.findall(shown), NUMBER.findall(printed)))


def same_number(shown, printed):
    if shown == printed:
        return True
    parts = [re.fullmatch(r"([-+]?)(\d+)\.(\d+)(e[-+]?\d+)?", number) for number in (shown, printed)]
    if None in parts or parts[0][4] != parts[1][4] or len(parts[0][3]) != len(parts[1][3]):
        return False
    digits = [int(part[1] + part[2] + part[3]) for part in parts]  # of the sign, too
    return abs(digits[0] - digits[1]) <= 1


def follows(shown, printed):
    """Whether printed lines are those that are shown, where a line of dots stands for any."""
    if not shown:
        return not printed
    if shown[0].strip() in DOTS:
        return any(follows(shown[1:], printed[n:]) for n in range(len(printed) + 1))
    return bool(printed) and same_line(shown[0], printed[0]) and follows(shown[1:], printed[1:])


def whole_outputs(printed):
    """The output of neighbouring commands, in all ways."""
    return [sum(printed[begin:end], []) for begin in range(len(printed))
            for end in range(begin + 1, len(printed) + 1)]


class Shell:
    """One bash for a document: changes of its folder and environment last."""

    def __init__(self, folder):
        environment = dict(os.environ, PATH=f"{folder / 'build/command/apps/risley'}:{os.environ['PATH']}")
        self.bash = subprocess.Popen(["bash"], cwd=folder, env=environment, stdin=subprocess.PIPE,
                                     stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def run(self, command):
        """Exit status and printed lines."""
        self.bash.stdin.write(f"{{ set -o pipefail\n{command}\n}} </dev/null\nprintf '{TOLD}%d\\n' $?\n")
        self.bash.stdin.flush()
        printed = []
        for line in self.bash.stdout:
            text, told, status = line.rstrip("\n").partition(TOLD)
            if text or not told:
                printed.append(text)
            if told:
                return int(status), printed
        raise AssertionError(f"bash ended in {command}")

    def close(self):
        self.bash.stdin.close()
        self.bash.stdout.close()
        self.bash.wait()


class DocumentsTest(unittest.TestCase):
    """One test for each document; they are added below."""

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="risley-document-"))
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / "data").symlink_to(SOURCE / "data")
        (self.folder / "out").mkdir()  # docs/README.md, Before the examples
        built = self.folder / "build/command/apps/risley"
        built.mkdir(parents=True)
        (built / "risley").symlink_to(Path(COMMAND).resolve())
        self.shell = Shell(self.folder)
        self.addCleanup(self.shell.close)

    def lacks(self, command):
        """Whether a folder that a command needs is not here; says so."""
        missing = [name for name in re.findall(r"\$(RISLEY_\w+)", command) if not os.environ.get(name)]
        for name in missing:
            skip_aloud(command, f"{name} is not set")
        return bool(missing)

    def output_of(self, status, command):
        """What a command prints."""
        found, printed = self.shell.run(command)
        self.assertEqual(found, status, command + "\n".join(printed))
        return printed

    def outputs(self, commands):
        """What each command prints; no list where this machine lacks what one of them needs."""
        printed = []
        for command in commands:
            words = command.split()
            reason = next((why for start, why in LEFT_OUT.items() if command.startswith(start)), None)
            if "jq" in words and not shutil.which("jq"):
                skip_aloud(command.strip(), "no jq, and nothing that it would print is compared")
                return None
            if reason:
                skip_aloud(command.strip(), reason)
                continue
            printed.append(self.output_of(STATUS.get(command.strip(), 0), command))
        return printed

    def check_message(self, shown, commands):
        printed = []
        for status, command in commands:
            if self.lacks(command):
                return
            printed += self.output_of(status, command)
        apart = ["..."] + [part for line in shown for part in (line, "...")]
        self.assertTrue(follows(apart, printed), "\n".join(["shown:", *shown, "printed:", *printed]))

    def check_python(self, lines):
        """What a program prints, or None where it cannot run."""
        python = sys.executable
        if importlib.util.find_spec("numpy") is None:
            python = SYSTEM_PYTHON
            if subprocess.run([python, "-c", "import numpy"], capture_output=True, check=False).returncode:
                skip_aloud("\n".join(lines), "no Python module numpy")
                return None
        done = subprocess.run([python, "-c", "\n".join(lines)], cwd=self.folder, check=True,
                              capture_output=True, text=True)
        return [done.stdout.splitlines()]

    def check(self, name, text):
        for command in DATA.get(name, ()):
            if self.lacks(command):
                self.skipTest("data")
            self.output_of(0, command)
        messages = dict(MESSAGES.get(name, {}))
        printed = []
        for language, lines in blocks_of(text):
            if language == "sh":
                printed = self.outputs(commands_of(lines))
            elif language == "python":
                printed = self.check_python(lines)
            elif language == "":
                start = next((one for one in messages if lines[0].startswith(one)), None)
                with self.subTest(lines[0]):
                    if start:
                        self.check_message(lines, messages.pop(start))
                    elif printed is not None:
                        self.assertTrue(printed, f"{lines}: no command was shown before")
                        self.assertTrue(any(follows(lines, one) for one in whole_outputs(printed)),
                                        "\n".join(["shown:", *lines, "printed:", *sum(printed, [])]))
        self.assertFalse(messages, "the document does not show these any more")


def add_test(name, read):
    setattr(DocumentsTest, "test_" + re.sub(r"\W", "_", Path(name).stem),
            lambda self: self.check(name, read()))


for path in (SOURCE / "README.md", SOURCE / "docs/recording.md",
             *sorted((SOURCE / "docs/tutorials").glob("*.md"))):
    add_test(path.name, path.read_text)
add_test("help", help_text)


if __name__ == "__main__":
    unittest.main()
