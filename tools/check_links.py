#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Checks that the links of the documents lead somewhere: files, pictures and headings.

README.md, CONTRIBUTING.md, CHANGELOG.md and docs/**/*.md; addresses on the network are not tried.

Usage: tools/check_links.py [ROOT]
Exit status: 0 all well, 1 a link is broken (one line each: file:line: what is wrong).
"""
import pathlib
import re
import sys
import urllib.parse

TOP = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")
FENCE = re.compile(r"^\s*(```|~~~)")
CODE = re.compile(r"(`+)(.+?)\1(?!`)")
LINK = re.compile(r"\]\(\s*(?:<([^>]*)>|([^\s)]*))(?:\s+\"[^\"]*\")?\s*\)")
DEFINITION = re.compile(r"^\s{0,3}\[[^\]]+\]:\s*<?([^\s>]+)>?")
REFERENCE = re.compile(r"\[[^\]]*\]\[([^\]]+)\]")
HEADING = re.compile(r"^\s{0,3}#{1,6}\s+(.*?)\s*#*\s*$")
ANCHOR = re.compile(r"<a\s+(?:id|name)=\"([^\"]+)\"")
SCHEME = re.compile(r"^[a-zA-Z][a-zA-Z0-9+.-]*:")


def prose(text):
    """(line number, line) of everything outside of fenced blocks."""
    fence = None
    for number, line in enumerate(text.splitlines(), 1):
        mark = FENCE.match(line)
        if mark and fence in (None, mark.group(1)):
            fence = None if fence else mark.group(1)
        elif not fence:
            yield number, line


def anchors_of(text):
    """The anchors that GitHub gives the headings, and those written by hand."""
    anchors = set()
    for _, line in prose(text):
        anchors.update(ANCHOR.findall(line))
        heading = HEADING.match(line)
        if not heading:
            continue
        words = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading.group(1)).lower()
        words = re.sub(r"(?<![\w`])_([^_]+)_(?![\w`])", r"\1", words)  # emphasis
        name = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        same = 0
        while (unique := f"{name}-{same}" if same else name) in anchors:
            same += 1
        anchors.add(unique)
    return anchors


def targets(text):
    """(line number, target) of every link and picture; None where a reference is not defined."""
    lines = [(number, CODE.sub("", line)) for number, line in prose(text)]
    defined = {line[line.index("[") + 1:line.index("]")].lower()
               for _, line in lines if DEFINITION.match(line)}
    for number, line in lines:
        definition = DEFINITION.match(line)
        if definition:
            yield number, definition.group(1)
            continue
        for pointed, plain in LINK.findall(line):
            yield number, pointed or plain
        for name in REFERENCE.findall(line):
            if name.lower() not in defined:
                yield number, None


def check_target(root, document, target):
    """What is wrong with a link of a document, or None."""
    if target is None:
        return "the reference of a link is not defined"
    if SCHEME.match(target) or target.startswith("//"):
        return None
    name, _, anchor = target.partition("#")
    path = (document.parent / urllib.parse.unquote(name)).resolve() if name else document
    if name.startswith("/") or not path.is_relative_to(root):
        return f"{target} leaves the repository"
    if not path.exists():
        return f"{target} does not exist"
    if anchor and path.suffix == ".md" and anchor not in anchors_of(path.read_text("utf-8")):
        return f"{target}: no such heading"
    return None


def check(root):
    """Every broken link of the documents under root, as text."""
    root = root.resolve()
    documents = [root / name for name in TOP if (root / name).is_file()]
    documents += sorted((root / "docs").rglob("*.md"))
    if not documents:
        return ["no documents found"]
    errors = []
    for document in documents:
        for number, target in targets(document.read_text("utf-8")):
            wrong = check_target(root, document, target)
            if wrong:
                errors.append(f"{document.relative_to(root)}:{number}: {wrong}")
    return errors


def main():
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).parents[1]
    errors = check(root)
    print("\n".join(errors) if errors else "check_links: every link of the documents leads somewhere")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
