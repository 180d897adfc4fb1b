#!/usr/bin/python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Executes the Python examples and writes docs/notebooks/NN-name.md: text, code, what the code prints, and pictures.

The examples are in the percent format, which editors and Jupyter (with jupytext) open as notebooks: "# %%" begins a
cell of code, "# %% [markdown]" one of text. Each is executed in a folder of its own, shown as "results".

Usage: PYTHONPATH=build/test/python tools/notebooks.py
Needs numpy and matplotlib.
"""
import contextlib
import io
import os
import pathlib
import re
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "examples/python"
DOCUMENTS = ROOT / "docs/notebooks"
CELL = re.compile(r"^# %%(.*)$", re.MULTILINE)
TEXT_MARK = " [markdown]"
LARGEST_PICTURE = 60000  # bytes


def cells_of(source):
    """(is text, lines) of every cell; what stands before the first one is no cell."""
    parts = CELL.split(source)[1:]
    for mark, body in zip(parts[::2], parts[1::2]):
        if mark not in ("", TEXT_MARK):
            raise ValueError(f'a cell begins with "# %%{mark}", expected "# %%" or "# %%{TEXT_MARK}"')
        yield mark == TEXT_MARK, body.strip("\n")


def text_of(body):
    """A cell of text without its comment signs."""
    return "\n".join(line[2:] if line.startswith("# ") else line.removeprefix("#") for line in body.split("\n"))


def pictures_of(folder, seen):
    """Pictures that a cell wrote."""
    return sorted(path for path in folder.glob("*.png") if path not in seen)


def execute(script, folder):
    """(is text, body, printed text, pictures) of every cell of an example that writes into a folder."""
    space = {"__name__": "__main__", "__file__": str(script)}
    before, sys.argv = sys.argv, [str(script), "--folder", str(folder)]
    seen = []
    try:
        for is_text, body in cells_of(script.read_text("utf-8")):
            printed, new = io.StringIO(), []
            if not is_text:
                with contextlib.redirect_stdout(printed):
                    exec(compile(body, str(script), "exec"), space)  # pylint: disable=exec-used
                new = pictures_of(folder, seen)
                seen += new
            yield is_text, body, printed.getvalue().replace(str(folder), "results"), new
    finally:
        sys.argv = before


def name_of(script):
    """The document of an example, without its ending."""
    return script.stem.replace("_", "-")


def document_of(script, folder):
    """The text of an example's document, and its pictures: {name: file}."""
    name = name_of(script)
    source = os.path.relpath(script, DOCUMENTS)
    note = f"*Made by `tools/notebooks.py` of [{script.name}]({source}), which begins with imports and options.*"
    blocks, pictures, has_begun = [], {}, False
    for is_text, body, printed, new in execute(script, folder):
        if is_text:
            blocks.append(text_of(body))
        elif not has_begun:  # imports and options, which are alike in all examples
            has_begun = True
        else:
            blocks.append(f"```python\n{body}\n```")
        if len(blocks) == 1:
            blocks.append(note)
        if printed:
            blocks.append(f"```\n{printed.rstrip()}\n```")
        for path in new:
            pictures[f"{name}-{path.name}"] = path
            blocks.append(f"![{path.stem}]({name}-{path.name})")
    return "\n\n".join(blocks) + "\n", pictures


def scripts():
    """The examples in their order."""
    return sorted(EXAMPLES.glob("[0-9][0-9]_*.py"))


def main():
    import matplotlib
    matplotlib.use("Agg")
    DOCUMENTS.mkdir(parents=True, exist_ok=True)
    for old in DOCUMENTS.iterdir():
        old.unlink()
    for script in scripts():
        with tempfile.TemporaryDirectory(prefix="risley-") as folder:
            text, pictures = document_of(script, pathlib.Path(folder))
            for name, path in pictures.items():
                if path.stat().st_size > LARGEST_PICTURE:
                    raise SystemExit(f"{name} has {path.stat().st_size} bytes, allowed are {LARGEST_PICTURE}")
                (DOCUMENTS / name).write_bytes(path.read_bytes())
        (DOCUMENTS / f"{name_of(script)}.md").write_text(text, "utf-8")
        print(DOCUMENTS / f"{name_of(script)}.md")


if __name__ == "__main__":
    main()
