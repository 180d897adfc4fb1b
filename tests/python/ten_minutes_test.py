# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""docs/python.md is one program that prints what it shows."""
import contextlib
import io
import os
import pathlib
import re
import sys

SOURCE = pathlib.Path(os.environ["RISLEY_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "tests/cli"))
from documents_test import same_line  # noqa: E402

BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_the_page_prints_what_it_shows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").symlink_to(SOURCE / "data")
    names, printed, programs = {"__name__": "page"}, "", 0
    for language, text in BLOCK.findall((SOURCE / "docs/python.md").read_text("utf-8")):
        if language == "python" and "risley.emulate" not in text:  # which tests/python/network_test.py does
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(compile(text, "docs/python.md", "exec"), names)
            printed, programs = out.getvalue(), programs + 1
        elif language == "":
            shown, made = text.splitlines(), printed.splitlines()
            assert len(shown) == len(made) and all(map(same_line, shown, made)), \
                f"shown:\n{text}\nprinted:\n{printed}"
    assert programs >= 7


def test_icp_weights_and_rays_take_ten_lines():
    blocks = [text for language, text in BLOCK.findall((SOURCE / "docs/python.md").read_text("utf-8"))
              if language == "python"]
    assert len(blocks[0].splitlines()) <= 10 and "own_covariance" in blocks[0]
    assert any("from_dlpack" in text and len(text.splitlines()) <= 10 for text in blocks)
