# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The codes of warnings, their meanings in docs/files.md, and who uses them."""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).parents[2]
HEADER = (ROOT / "include/risley/core/warning.hpp").read_text(encoding="utf-8")
CODES = re.findall(r'WarningCode (\w+)\{\s*"(\w+)"\};((?:\s*///<? .*)+)', HEADER)


class WarningCodesTest(unittest.TestCase):
    def test_the_table_says_what_the_header_says(self):
        self.assertEqual(len(CODES), len(re.findall(r'\{\s*"', HEADER)))
        meanings = [(name, " ".join(re.findall(r"///<? (.*)", words))) for name, _, words in CODES]
        _, _, text = (ROOT / "docs/files.md").read_text(encoding="utf-8").partition("\n| code | ")
        self.assertEqual(re.findall(r"^\| `(\w+)` \| (.*) \|$", text.partition("\n\n")[0], re.MULTILINE), meanings)

    def test_every_code_has_its_own_name_and_is_used(self):
        used = {name for path in (ROOT / "src").rglob("*.?pp")
                for name in re.findall(r"kWarning\.(\w+)", path.read_text(encoding="utf-8"))}
        self.assertEqual([name for name, text, _ in CODES if name != text or name not in used], [])


if __name__ == "__main__":
    unittest.main()
