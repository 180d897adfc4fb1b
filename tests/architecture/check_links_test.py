# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""tools/check_links.py finds each kind of broken link in a tree made for the purpose."""
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "tools"))
import check_links  # noqa: E402

FILES = {
    "docs/theory/map.md": "# The map: `A` & B, _again_\n## Twice\n## Twice\n<a id=\"here\"></a>\n"
                          "```sh\n# no heading\n```\n",
    "docs/images/page.png": "",
    "docs/files.md": "# Files\n",
}


class CheckLinksTest(unittest.TestCase):
    def errors(self, line, name="README.md"):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for file, text in {**FILES, name: f"# Title\n\n{line}\n"}.items():
                (root / file).parent.mkdir(parents=True, exist_ok=True)
                (root / file).write_text(text, encoding="utf-8")
            return check_links.check(root)

    def test_what_is_there_passes(self):
        for line in (
            "[map](docs/theory/map.md) and [files](docs/files.md#files)",
            "![page](docs/images/page.png \"a title\")",
            "[![page](docs/images/page.png)](docs/theory)",
            "[map](docs/theory/map.md#the-map-a--b-again)",
            "[second](docs/theory/map.md#twice-1), [hand](docs/theory/map.md#here)",
            "[self](#title), [web](https://example.org/none), <mailto:a@b.c>",
            "[map][m]\n\n[m]: docs/theory/map.md",
            "`[code](nowhere.md)` and\n```\n[block](nowhere.md)\n```",
            "an interval [0, 1] (rad) is none",
        ):
            with self.subTest(line=line):
                self.assertEqual(self.errors(line), [])

    def test_documents_in_folders_count_from_where_they_are(self):
        self.assertEqual(self.errors("[f](../files.md) ![p](../images/page.png)", "docs/a/b.md"), [])
        self.assertEqual(self.errors("[f](files.md)", "docs/a/b.md"),
                         ["docs/a/b.md:3: files.md does not exist"])

    def test_everything_broken_is_found_with_its_line(self):
        for line, expected in (
            ("[x](docs/none.md)", "docs/none.md does not exist"),
            ("![x](docs/images/none.png)", "docs/images/none.png does not exist"),
            ("[![x](docs/images/none.png)](docs/files.md)", "docs/images/none.png does not exist"),
            ("[x](docs/theory/map.md#no-heading)", "docs/theory/map.md#no-heading: no such heading"),
            ("[x](docs/theory/map.md#twice-2)", "docs/theory/map.md#twice-2: no such heading"),
            ("[x](#nowhere)", "#nowhere: no such heading"),
            ("[x](/etc/hosts)", "/etc/hosts leaves the repository"),
            ("[x](../README.md)", "../README.md leaves the repository"),
            ("[map][m]", "the reference of a link is not defined"),
            ("[m]: docs/none.md", "docs/none.md does not exist"),
        ):
            with self.subTest(line=line):
                self.assertEqual(self.errors(line), [f"README.md:3: {expected}"])

    def test_a_tree_without_documents_is_found(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(check_links.check(pathlib.Path(folder)), ["no documents found"])


if __name__ == "__main__":
    unittest.main()
