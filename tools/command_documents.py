#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Manual pages and shell completions of the risley command, made from its own --help-all.

Usage: tools/command_documents.py COMMAND FOLDER [--compress]
Writes FOLDER/man/risley.1 and a risley-VERB.1 of each verb (--compress: .1.gz), and
FOLDER/completions/risley.bash, _risley for zsh and risley.fish. SOURCE_DATE_EPOCH dates the pages.
"""
import argparse
import dataclasses
import gzip
import json
import os
import pathlib
import re
import shlex
import subprocess
import time

INDENT = "  "  # of an entry; deeper lines continue it
COLUMN = 30    # where the description of an entry begins, on the next line after a long name


@dataclasses.dataclass
class Entry:
    """An option, an argument or a verb: `head` as --help shows it, `text` describes it."""
    head: str
    text: str

    @property
    def names(self):
        return re.findall(r"(?<![\w-])--?[a-z][\w-]*", self.head)

    @property
    def long_name(self):
        return next((name for name in self.names if name.startswith("--")), None)

    @property
    def takes_value(self):
        return self.value_text != ""

    @property
    def value_text(self):
        """What follows the names."""
        return re.sub(r"(?<![\w-])--?[a-z][\w-]*,? ?", "", self.head).strip()

    @property
    def choices(self):
        found = re.search(r"\bone of: ([^(]*)", self.text)
        if found:
            return [one.strip() for one in found.group(1).split(",")]
        return self.value_text.split("|") if re.fullmatch(r"[a-z-]+(\|[a-z-]+)+", self.value_text) else []

    @property
    def repeatable(self):
        return "(repeatable)" in self.text or "..." in self.head


@dataclasses.dataclass
class Help:
    """What --help-all of a verb says, part by part."""
    description: str
    usage: str
    examples: list  # of lines
    sections: dict  # heading to entries, in order
    footer: list  # of paragraphs, as lines

    @property
    def entries(self):
        return [entry for entries in self.sections.values() for entry in entries]

    @property
    def options(self):
        return [entry for entry in self.entries if entry.names]

    @property
    def verbs(self):
        return [entry for entry in self.entries if re.fullmatch("[a-z]+", entry.head)]

    @property
    def positionals(self):
        return self.sections["Arguments"]


def split_entry(lines):
    """One entry from its lines: names and value, then the second column."""
    has_text = len(lines[0]) > COLUMN and lines[0][COLUMN - 2:COLUMN] == "  "
    head = lines[0][:COLUMN] if has_text else lines[0]
    text = [lines[0][COLUMN:]] if has_text else []
    return Entry(head.strip(), " ".join([*text, *(line.strip() for line in lines[1:])]))


def read_help(text):
    lines = text.rstrip("\n").split("\n")
    usage = next(i for i, line in enumerate(lines) if line.startswith("Usage:"))
    examples = [line[len(INDENT):] for line in lines[:usage] if line.startswith(INDENT)]
    result = Help(lines[0], lines[usage][len("Usage:"):].strip(), examples, {"Arguments": []}, [])
    gathered, section = [], result.sections["Arguments"]

    def finish():
        if gathered:
            section.append(split_entry(gathered))
            gathered.clear()

    for number, line in enumerate(lines[usage + 1:], usage + 1):
        if line.startswith(INDENT):
            if line[len(INDENT)] != " ":
                finish()
            gathered.append(line)
        elif line.endswith(":"):
            finish()
            section = result.sections[line[:-1]] = []
        elif line:
            finish()
            result.footer = lines[number:]
            break
    finish()
    return result


class Command:
    """The command, asked."""

    def __init__(self, path):
        self.path = path
        self.main = self.help()
        self.version = self.say("--version").strip()
        self.pages = {}  # by verb, or by verb and action: preset, preset show
        for entry in self.main.verbs:
            self.pages[(entry.head,)] = page = self.help(entry.head)
            for action in page.verbs:
                self.pages[entry.head, action.head] = self.help(entry.head, action.head)
        self.presets = [one["name"] for one in json.loads(self.say("preset", "list", "--json"))["presets"]]
        self.parameters = self.parameters_of_presets()

    def say(self, *words):
        return subprocess.run([self.path, *words], check=True, capture_output=True, text=True).stdout

    def help(self, *words):
        return read_help(self.say(*words, *(["--help-all"] if words else ["--help"])))

    def parameters_of_presets(self):
        names = []
        for preset in self.presets:
            text = self.say("preset", "show", preset)
            section = re.search(r"^parameters:\n((?:[ #].*\n)+)", text, re.MULTILINE).group(1)
            names += re.findall(r"^  (\w+):", section, re.MULTILINE)
        return list(dict.fromkeys(names))

    @property
    def verbs(self):
        return [words[0] for words in self.pages if len(words) == 1]

    def actions(self, verb):
        return [words[1] for words in self.pages if len(words) == 2 and words[0] == verb]

    def options(self, words):
        """Those of a verb; those of an action with its verb's."""
        found = {}
        for length in range(len(words), 0, -1):
            for option in self.pages[words[:length]].options:
                found.setdefault(option.names[-1], option)
        return list(found.values())

    def values(self, option):
        """What may follow an option: (kind, words), of a kind words, names (before =), presets, files or none."""
        name = option.names[-1]
        if option.choices:
            return "words", option.choices
        if name in ("--sensor", "--calibration", "--from"):
            return "presets", self.presets
        if name in ("--fix", "--free", "--set", "--reported"):
            speeds = name == "--set"
            names = [one for one in self.parameters if speeds or not one.startswith("angular_velocity")]
            return ("names" if name == "--set" else "words"), names + re.findall(r"'(\w+)'", option.text)
        quoted = re.findall(r"'(\w+)'", option.text)
        if quoted:
            return "words", quoted
        return ("none" if re.match(r"(N|NUMBER|HZ|[A-Z]+,.*)$", option.value_text) else "files"), []

    def arguments(self, words):
        """As values, of what follows a verb and is no option."""
        if words == ("preset", "show"):
            return "words", self.presets
        positionals = self.pages[words].positionals
        if not positionals or positionals[0].head.split(" ")[0] == "NAME":
            return "none", []
        return "files", []


# Manual pages

def roff(text):
    text = text.replace("\\", r"\e").replace("-", r"\-")
    return re.sub(r"^(?=[.'])", r"\\&", text, flags=re.MULTILINE)


def bold(text):
    return rf"\fB{roff(text)}\fR"


def roff_head(entry):
    rest = entry.value_text if entry.names else ""
    result = ", ".join(map(bold, entry.names)) if entry.names else bold(entry.head)
    return result + (rf" \fI{roff(rest)}\fR" if rest else "")


def roff_entries(entries):
    return [line for entry in entries for line in (".TP", roff_head(entry), roff(entry.text))]


def roff_footer(lines):
    """Paragraphs, and as a section of its own what "Exit status:" says."""
    result = []
    text = "\n".join(lines)
    for part in re.split(r"(?<=\.)\n(?=\w)|\n\n", text):
        if part.startswith("Exit status: "):
            result += [".SH EXIT STATUS", roff(" ".join(part[len("Exit status: "):].split()))]
        elif part.strip():
            result += [".PP", roff(" ".join(part.split()))]
    return result


def roff_page(command, words, page, date):
    name = "-".join(("risley", *words))
    lines = [f'.TH {roff(name.upper())} 1 "{date}" "{command.version}" "User Commands"',
             ".SH NAME", f"{roff(name)} \\- {roff(page.description)}",
             ".SH SYNOPSIS", roff_synopsis(page.usage)]
    for heading, entries in page.sections.items():
        if entries:
            lines += [f".SH {heading.upper()}", *roff_entries(entries)]
    for action in command.actions(words[0]) if words else []:
        below = command.pages[(*words, action)]
        lines += [f".SH {roff(' '.join(('risley', *words, action)).upper())}",
                  roff_synopsis(below.usage), ".PP", roff(below.description) + "."]
        for entries in below.sections.values():
            lines += roff_entries(entries)
    if page.examples:
        lines += [".SH EXAMPLES", ".EX", *map(roff, page.examples), ".EE"]
    lines += roff_footer(page.footer)
    others = [f"risley-{verb}" for verb in command.verbs] if not words else ["risley"]
    lines += [".SH SEE ALSO", ",\n".join(f".BR {roff(other)} (1)" for other in others).replace("(1),", "(1) ,")]
    return "\n".join(lines) + "\n"


def roff_synopsis(usage):
    words = usage.split(" ")
    plain = [word for word in words if re.fullmatch("[a-z]+", word)]
    rest = words[len(plain):]
    return bold(" ".join(plain)) + (rf" \fI{roff(' '.join(rest))}\fR" if rest else "")


def pages(command, date):
    yield "risley.1", roff_page(command, (), command.main, date)
    for verb in command.verbs:
        yield f"risley-{verb}.1", roff_page(command, (verb,), command.pages[verb,], date)


# Completions

def made_by(mark):
    return f"{mark} Made by tools/command_documents.py of what risley --help-all says.\n"


def bash_completion(command):
    choices, options = [], []
    for words in command.pages:
        where = " ".join(words)
        for option in command.options(words):
            kind, found = command.values(option)
            names = "|".join(f'"{where} {name}"' for name in option.names)
            if kind in ("words", "names", "presets"):
                choices.append((names, kind, " ".join(found)))
            elif option.takes_value:
                choices.append((names, kind, ""))
        every = " ".join(name for option in command.options(words) for name in option.names)
        actions = " ".join(command.actions(words[0])) if len(words) == 1 else ""
        kind, found = ("words", actions.split()) if actions else command.arguments(words)
        options.append((f'"{where}"', every, kind, " ".join(found)))
    lines = [made_by("#"), "_risley() {",
             "  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}",
             '  local verb=${COMP_WORDS[1]} kind=none choices="" options=""',
             "  if [ \"$COMP_CWORD\" -eq 1 ]; then",
             f'    choices="{" ".join(command.verbs)}" options="{main_options(command)}" kind=words',
             "  else",
             '    case "$verb ${COMP_WORDS[2]}" in']
    for verb in command.verbs:
        actions = command.actions(verb)
        if actions:
            found = "|".join(f'"{verb} {action}"' for action in actions)
            lines.append(f'      {found}) [ "$COMP_CWORD" -eq 2 ] || verb="$verb ${{COMP_WORDS[2]}}" ;;')
    lines += ["    esac", '    case "$verb $previous" in']
    for names, kind, found in choices:
        lines.append(f'      {names}) kind=value-{kind} choices="{found}" ;;')
    lines += ['      *) case "$verb" in']
    for where, every, kind, found in options:
        lines.append(f'        {where}) options="{every}" kind={kind} choices="{found}" ;;')
    lines += ["      esac ;;", "    esac", "  fi",
              '  case "$kind $current" in',
              "    value-*) ;;",
              '    *" -"*) kind=words choices=$options ;;',
              "  esac",
              '  COMPREPLY=()',
              "  case $kind in",
              '    *words | *names | *presets) mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$current") ;;',
              "  esac",
              "  case $kind in",
              "    *names) compopt -o nospace ;;",
              '    *presets) mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -f -- "$current") ;;',
              "    *files) compopt -o default ;;",
              "  esac",
              "}", "complete -F _risley risley"]
    return "\n".join(lines) + "\n"


def main_options(command):
    return " ".join(name for option in command.main.options for name in option.names)


def zsh_text(text):
    return re.sub(r"([\[\]\\:])", r"\\\1", text)


def zsh_action(kind, found):
    return {"words": f"({' '.join(found)})", "names": "_risley_names", "presets": "_risley_presets",
            "files": "_files", "none": " "}[kind]


def zsh_specs(command, options):
    for option in options:
        others = "(" + " ".join(option.names) + ")"
        start = "*" if option.repeatable else others if len(option.names) > 1 else ""
        for name in option.names:
            value = ""
            if option.takes_value:
                name += "=" if name.startswith("--") else ""
                value = f":{zsh_text(option.value_text.split(':')[0])}:{zsh_action(*command.values(option))}"
            yield shlex.quote(f"{start}{name}[{zsh_text(option.text)}]{value}")


def zsh_completion(command):
    names = " ".join(command.parameters)
    lines = ["#compdef risley", made_by("#"),
             "_risley_presets() {",
             f"  _alternative 'presets:preset:({' '.join(command.presets)})' 'files:file:_files'", "}",
             "_risley_names() {", f"  compadd -S = -- {names}", "}"]

    def level(function, words, entries, options):
        lines.extend([f"{function}() {{", "  local curcontext=$curcontext state line", "  local -a verbs",
                      "  _arguments -C \\"])
        lines.extend(f"    {spec} \\" for spec in zsh_specs(command, options))
        lines.extend(["    '1:verb:->verb' '*::argument:->argument'", "  case $state in", "    verb)",
                      "      verbs=("])
        lines.extend(f"        {shlex.quote(entry.head + ':' + zsh_text(entry.text))}" for entry in entries)
        lines.extend(["      )", "      _describe -t verbs verb verbs ;;", "    argument)",
                      "      case $line[1] in"])
        lines.extend(f"        {entry.head}) {zsh_function((*words, entry.head))} ;;" for entry in entries)
        lines.extend(["      esac ;;", "  esac", "}"])

    for words, page in command.pages.items():
        if page.verbs:
            level(zsh_function(words), words, page.verbs, page.options)
            continue
        lines += [f"{zsh_function(words)}() {{", "  _arguments \\"]
        lines += [f"    {spec} \\" for spec in zsh_specs(command, command.options(words))]
        lines += [f"    '*:argument:{zsh_action(*command.arguments(words))}'", "}"]
    level("_risley", (), command.main.verbs, command.main.options)
    lines += ['_risley "$@"']
    return "\n".join(lines) + "\n"


def zsh_function(words):
    return "_".join(("_risley", *words))


def fish_completion(command):
    lines = [made_by("#"),
             "function __risley_at # whether the words after risley begin so",
             "  set -l words (commandline -opc)",
             "  test (count $words) -gt (count $argv); or return 1",
             "  for i in (seq (count $argv))",
             "    test $words[(math $i + 1)] = $argv[$i]; or return 1",
             "  end", "end",
             "function __risley_ends # whether they are just these",
             "  __risley_at $argv; and test (count (commandline -opc)) -eq (math (count $argv) + 1)", "end",
             "complete -c risley -f"]

    def offer(where, options):
        for option in options:
            words = ["complete", "-c", "risley", "-n", where]
            for name in option.names:
                words += ["-l", name[2:]] if name.startswith("--") else ["-s", name[1:]]
            kind, found = command.values(option)
            if option.takes_value:
                words += {"files": ["-r", "-F"], "presets": ["-r", "-F", "-a", " ".join(found)],
                          "none": ["-x"], "names": ["-x", "-a", " ".join(one + "=" for one in found)],
                          "words": ["-x", "-a", " ".join(found)]}[kind]
            lines.append(fish_line([*words, "-d", option.text]))

    for entry in command.main.verbs:
        lines.append(fish_line(["complete", "-c", "risley", "-n", "__risley_ends", "-a", entry.head,
                                "-d", entry.text]))
    offer("__risley_ends", command.main.options)
    for words, page in command.pages.items():
        at = " ".join(words)
        for entry in page.verbs:
            lines.append(fish_line(["complete", "-c", "risley", "-n", f"__risley_ends {at}", "-a", entry.head,
                                    "-d", entry.text]))
        offer(f"__risley_at {at}", page.options)
        kind, found = command.arguments(words)
        if kind == "files" and not page.verbs:
            lines.append(fish_line(["complete", "-c", "risley", "-n", f"__risley_at {at}", "-F"]))
        elif found:
            lines.append(fish_line(["complete", "-c", "risley", "-n", f"__risley_at {at}", "-a",
                                    " ".join(found)]))
    return "\n".join(lines) + "\n"


def fish_line(words):
    def quoted(word):
        if re.fullmatch(r"[\w-]+", word):
            return word
        return "'" + word.replace("\\", "\\\\").replace("'", "\\'") + "'"
    return " ".join(map(quoted, words))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("command")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--compress", action="store_true", help="manual pages as .gz")
    arguments = parser.parse_args()
    command = Command(arguments.command)
    man, completions = arguments.folder / "man", arguments.folder / "completions"
    for folder in (man, completions):
        folder.mkdir(parents=True, exist_ok=True)
    date = time.strftime("%Y-%m-%d", time.gmtime(float(os.environ.get("SOURCE_DATE_EPOCH", time.time()))))
    for name, text in pages(command, date):
        if arguments.compress:
            (man / f"{name}.gz").write_bytes(gzip.compress(text.encode(), 9, mtime=0))
        else:
            (man / name).write_text(text, encoding="utf-8")
    for name, make in (("risley.bash", bash_completion), ("_risley", zsh_completion),
                       ("risley.fish", fish_completion)):
        (completions / name).write_text(make(command), encoding="utf-8")


if __name__ == "__main__":
    main()
