# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The codes of warnings are those of docs/files/json.md, and all are used."""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).parents[2]
HEADER = (ROOT / "include/risley/core/warning.hpp").read_text(encoding="utf-8")
CODES = re.findall(r'(\w+)\{"(\w+)"\}', HEADER)


class WarningCodesTest(unittest.TestCase):
    def test_the_documents_have_all(self):
        _, _, text = (ROOT / "docs/files/json.md").read_text(encoding="utf-8").partition("\n| code | ")
        told = re.findall(r"^\| `(\w+)` \| \w.* \|$", text.partition("\n\n")[0], re.MULTILINE)
        self.assertEqual(told, [text for _, text in CODES])

    def test_every_code_has_its_own_name_and_is_used(self):
        used = {name for path in (ROOT / "src").rglob("*.?pp")
                for name in re.findall(r"kWarning\.(\w+)", path.read_text(encoding="utf-8"))}
        self.assertEqual([name for name, text in CODES if name != text or name not in used], [])


if __name__ == "__main__":
    unittest.main()
