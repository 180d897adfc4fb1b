#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Checks that every public name of the headers in include/risley is documented, as Doxygen reads it.

A comment that Doxygen can see belongs to every

- namespace, class, struct, union, enumeration, alias and concept that is not private,
- function and constant (static member) of a namespace or a class, but for what is obvious:
  constructors, destructors, operators, begin, end, size and empty. A function that overrides
  another has its text.

Fields and enumerators may go without: their names and the text of what holds them say it. Whatever
Doxygen warns of, such as a command that it does not know or a parameter that does not exist, is
an error too.

Usage: tools/check_documented.py [ROOT]
Exit status: 0 all well, 1 something is missing (one line each: file:line: what), 77 no doxygen.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

OBVIOUS = {"begin", "end", "size", "empty"}
COMPOUNDS = {"namespace", "class", "struct", "union", "concept"}
OPTIONS = """
GENERATE_HTML     = NO
GENERATE_XML      = YES
XML_PROGRAMLISTING = NO
"""


def run_doxygen(root, folder):
    """Has the XML of the headers under root written into folder/xml. What Doxygen warned of."""
    configuration = (root / "docs/site/Doxyfile.in").read_text("utf-8") + OPTIONS
    for word, value in (("VERSION", ""), ("SOURCE", root), ("OUTPUT", folder)):
        configuration = configuration.replace(f"@{word}@", str(value))
    done = subprocess.run(["doxygen", "-"], input=configuration, text=True, capture_output=True,
                          check=False)
    log = folder / "doxygen.log"
    warnings = log.read_text("utf-8").splitlines() if log.is_file() else []
    if done.returncode != 0:
        warnings.append(f"doxygen failed: {done.stderr.strip()}")
    # Lists of namespaces are read several times, and what is wrong in them is said as often.
    return [line.replace(f"{root}/", "") for line in dict.fromkeys(warnings + done.stderr.splitlines())
            if line.strip()]


def has_text(element):
    """Whether a comment belongs to what the element describes."""
    if element.find("reimplements") is not None:
        return True
    return any((element.findtext(part) or "").strip() or len(element.find(part) or ())
               for part in ("briefdescription", "detaileddescription")
               if element.find(part) is not None)


def is_checked(member, owner):
    """Whether a comment is demanded of a member of a namespace, class or file."""
    kind, name = member.get("kind"), member.findtext("name")
    if kind in ("enum", "typedef"):
        return True
    if kind == "variable":
        return owner.get("kind") in ("namespace", "file") or member.get("static") == "yes"
    if kind != "function" or name in OBVIOUS or re.match(r"~|operator\b", name):
        return False
    constructed = re.sub(r"<.*", "", owner.findtext("compoundname")).strip().split("::")[-1]
    return name != constructed


def names_of(folder):
    """{id: (file, line, kind, name, whether documented)} of every name that a comment is demanded of."""
    names = {}

    def add(element, kind, name):
        place = element.find("location")
        file = place.get("declfile") or place.get("file")
        line = int(place.get("declline") or place.get("line") or 0)
        names[element.get("id")] = (file, line, kind, name, has_text(element))

    for path in sorted(folder.glob("*.xml")):
        for owner in xml.etree.ElementTree.parse(path).getroot().iter("compounddef"):
            if owner.get("prot") == "private":
                continue
            name = owner.findtext("compoundname")
            if owner.get("kind") in COMPOUNDS and name.startswith("risley"):
                add(owner, owner.get("kind"), name)
            for member in owner.iter("memberdef"):
                if member.get("prot") != "private" and is_checked(member, owner):
                    inside = f"{name}::" if owner.get("kind") in COMPOUNDS else ""
                    if inside or member.get("id") not in names:
                        add(member, member.get("kind"), inside + member.findtext("name")
                            + (member.findtext("argsstring") or ""))
    return names


def check(root):
    """(number of names, everything that is wrong, as text)"""
    root = root.resolve()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        errors = run_doxygen(root, folder)
        names = names_of(folder / "xml").values()
    if not names:
        errors.append("no names found")
    for file, line, kind, name, documented in sorted(names):
        if not documented:
            errors.append(f"include/{file}:{line}: {kind} {name} is not documented")
    return len(names), errors


def main():
    if not shutil.which("doxygen"):
        print("SKIPPED: no doxygen: see scripts/install-dependencies --site")
        return 77
    count, errors = check(pathlib.Path(sys.argv[1]) if len(sys.argv) > 1
                          else pathlib.Path(__file__).parents[1])
    print("\n".join(errors) if errors else f"check_documented: {count} names, each documented")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
