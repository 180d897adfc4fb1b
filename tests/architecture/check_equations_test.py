# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""tools/check_equations.py finds each kind of missing thing in a tree made for the purpose."""
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "tools"))
import check_equations  # noqa: E402

HEAD = "| equation | what | code | test |\n|---|---|---|---|\n"
ROW = "| 1-31, 32 | all | `optics/snell.hpp` `refract` | `tests/snell_test.cpp` `Snell.Bends` |\n"
FILES = {
    "include/risley/optics/snell.hpp": "double refract(double x);  // once named bend\n",
    "tests/snell_test.cpp": "TEST(Snell, Bends) {\n}\nTEST_P(Snell,\n       IsLong) {}\n",
}


class CheckEquationsTest(unittest.TestCase):
    def errors(self, table):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in {"docs/equations.md": table, **FILES}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            return check_equations.check(root)

    def test_a_whole_table_passes(self):
        self.assertEqual(self.errors("# Title\n\n" + HEAD + ROW), [])

    def test_tests_with_a_line_break_are_found(self):
        self.assertEqual(self.errors(HEAD + ROW.replace("Bends", "IsLong")), [])

    def test_everything_that_is_missing_is_found_with_its_line(self):
        for old, new, expected in (
            ("`refract`", "`reflect`",
             "function reflect is not in include/risley/optics/snell.hpp"),
            ("`refract`", "`bend`", "function bend is not in include/risley/optics/snell.hpp"),
            ("`refract`", "", "1-31, 32 names no function"),
            ("Snell.Bends", "Snell.Breaks", "test Snell.Breaks is not in tests/snell_test.cpp"),
            (" `Snell.Bends`", "", "1-31, 32 names no test"),
            ("optics/snell.hpp", "optics/lens.hpp", "the file optics/lens.hpp does not exist"),
            ("tests/snell_test.cpp", "tests/lens_test.cpp",
             "the file tests/lens_test.cpp does not exist"),
            ("`optics/snell.hpp` ", "", "refract stands behind no file"),
            ("| all |", "| all | more |", "5 columns, expected equation, what, code, test"),
        ):
            with self.subTest(new=new):
                errors = self.errors(HEAD + ROW.replace(old, new))
                self.assertIn(f"docs/equations.md:3: {expected}", errors)

    def test_an_equation_without_a_row_is_found(self):
        self.assertEqual(self.errors(HEAD + ROW.replace("1-31, 32", "1-9, 11-32, Table 10")),
                         ["docs/equations.md: equation 10 has no row"])

    def test_a_document_without_a_table_is_found(self):
        self.assertEqual(self.errors("# Title\n"), ["docs/equations.md: no table found"])


if __name__ == "__main__":
    unittest.main()
