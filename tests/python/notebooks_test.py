# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""docs/notebooks holds what the examples say and print now."""
import importlib.util
import os
import pathlib
import re
import sys

import pytest

SOURCE = pathlib.Path(os.environ["RISLEY_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "tests/cli"))
from documents_test import same_line  # noqa: E402

spec = importlib.util.spec_from_file_location("notebooks", SOURCE / "tools/notebooks.py")
notebooks = importlib.util.module_from_spec(spec)
spec.loader.exec_module(notebooks)

PICTURE = re.compile(r"^!\[[^]]*\]\(([^)]*)\)$")


@pytest.fixture
def no_matplotlib(monkeypatch):
    """Pictures differ from version to version, and take time."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)


def lines_of(text):
    """(inside of printed text, line) of a document without its pictures."""
    fence, lines = None, []
    for line in text.splitlines():
        if line.startswith("```"):
            fence = None if fence is not None else line
        if not PICTURE.match(line):
            lines.append((fence == "```", line))
    return [one for one, after in zip(lines, lines[1:] + [(False, "")]) if one[1] or after[1]]


def differences(shown, made):
    """What a document shows that is not made any more: code and text to the letter, printed numbers but for a last
    digit that is rounded to its neighbour."""
    shown, made = lines_of(shown), lines_of(made)
    found = [(one[1], other[1]) for one, other in zip(shown, made)
             if one != other and not (one[0] and other[0] and same_line(one[1], other[1]))]
    return found + [("lines", len(shown), len(made))] * (len(shown) != len(made))


@pytest.mark.parametrize("script", notebooks.scripts(), ids=lambda script: script.stem)
def test_document_is_fresh(script, tmp_path, no_matplotlib):
    shown = (notebooks.DOCUMENTS / f"{notebooks.name_of(script)}.md").read_text("utf-8")
    made, _ = notebooks.document_of(script, tmp_path)
    assert not differences(shown, made), "tools/notebooks.py writes docs/notebooks anew"


def test_every_document_has_its_example_and_every_picture_its_document():
    names = {notebooks.name_of(script) for script in notebooks.scripts()}
    assert len(names) == 5
    assert {path.stem for path in notebooks.DOCUMENTS.glob("*.md")} == names
    shown = set()
    for name in names:
        pictures = set(map(PICTURE.match, (notebooks.DOCUMENTS / f"{name}.md").read_text("utf-8").splitlines()))
        pictures.discard(None)
        assert pictures, name
        shown |= {one.group(1) for one in pictures}
    drawn = list(notebooks.DOCUMENTS.glob("*.png"))
    assert {path.name for path in drawn} == shown
    assert max(path.stat().st_size for path in drawn) <= notebooks.LARGEST_PICTURE


EXAMPLE = """# %% [markdown]
# # Sum
#
# Text.

# %%
import sys

# %%
print(f"{1 + 1:.3f} in {sys.argv[2]}/sum.txt")
"""


@pytest.fixture
def example(tmp_path):
    script = tmp_path / "09_sum.py"
    script.write_text("# A line before the first cell.\n" + EXAMPLE, "utf-8")
    return script


def test_a_document_has_text_code_and_output(example, tmp_path):
    text, pictures = notebooks.document_of(example, tmp_path)
    assert pictures == {}
    lines = text.splitlines()
    assert lines[:3] == ["# Sum", "", "Text."]
    assert lines[5:] == ["", "```python", EXAMPLE.splitlines()[-1], "```", "", "```", "2.000 in results/sum.txt", "```"]


def test_a_stale_document_is_noticed(example, tmp_path):
    fresh, _ = notebooks.document_of(example, tmp_path)
    assert not differences(fresh, fresh)
    assert not differences(fresh.replace("2.000 in", "2.001 in"), fresh)
    assert not differences(fresh + "\n![sum](sum.png)\n", fresh)
    for old, new in (("2.000 in", "2.002 in"), ("1 + 1", "1 + 2"), ("Text.", "Words."), ("```\n", "```\nmore\n")):
        assert differences(fresh.replace(old, new), fresh), old


def test_an_unknown_mark_is_refused():
    with pytest.raises(ValueError, match="begins with"):
        list(notebooks.cells_of("# %% [raw]\n# text\n"))
