#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""risley reproduce: the paper's tables beside ours."""
import json
import math
import os
import shutil
import subprocess
import unittest

import schemas
from command import COMMAND, CommandTest

TABLES = {"table_1", "table_2", "figure_2", "section_2_3", "zero_position", "section_3_1", "table_3",
          "table_3_filter", "section_3_3", "table_a1", "figure_a1", "triple_prism",
          "triple_prism_models", "triple_prism_emitters"}
FIGURES = ("figure_2", "figure_7", "figure_8", "figure_9", "figure_10", "figure_11", "figure_12",
           "figure_a1")


class ReproduceTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        # Longer than run() waits: a sanitizer's build takes many minutes.
        done = subprocess.run([COMMAND, "reproduce", "-o", "result", "--quiet", "--json"],
                              cwd=cls.folder, capture_output=True, text=True, check=False)
        schemas.check_output(["reproduce"], done.stdout)
        cls.result = json.loads(done.stdout)
        cls.status = done.returncode
        if os.environ.get("RISLEY_REPRODUCED"):  # for other tests of the page
            shutil.copytree(os.path.join(cls.folder, "result"), os.environ["RISLEY_REPRODUCED"],
                            dirs_exist_ok=True)
        cls.tables = cls.result["tables"]

    def row(self, table, term):
        rows = [row for row in self.tables[table]["rows"] if row["term"] == term]
        self.assertEqual(len(rows), 1, f"{table}: {term}")
        return rows[0]

    def test_every_row_passes_for_a_reason(self):
        self.assertEqual(self.status, 0)
        self.assertEqual(set(self.tables), TABLES)
        for name, table in self.tables.items():
            self.assertTrue(table["rows"], name)
            for row in table["rows"]:
                where = f"{name}: {row['term']}"
                self.assertIs(row["pass"], True, f"{where}: {row['reason']}")
                self.assertIsInstance(row["ours"], (int, float), where)
                self.assertIsInstance(row["paper"], (int, float, type(None)), where)
                self.assertTrue(row["unit"] and row["bound"] and row["reason"], where)
                # The verdict can be worked out again from what is written.
                for check in row["checks"]:
                    least = -math.inf if check["least"] is None else check["least"]
                    greatest = math.inf if check["greatest"] is None else check["greatest"]
                    slack = 1e-8 * abs(check["value"])
                    self.assertLessEqual(least - slack, check["value"], where)
                    self.assertGreaterEqual(greatest + slack, check["value"], where)
        rows = sum(len(table["rows"]) for table in self.tables.values())
        self.assertEqual((self.result["rows"], self.result["passed"]), (rows, rows))

    def test_printed_digits(self):
        for table, term, text in (("table_a1", "beam 1, Y correction", "3.0"),
                                  ("table_a1", "beam 2, Z correction", "2.3"),
                                  ("zero_position", "zenith in the zero position", "109.2"),
                                  ("section_3_3", "RMSE of the reported azimuth", "0.077")):
            row = self.row(table, term)
            self.assertEqual(row["paper_text"], text)
            self.assertEqual(row["paper"], float(text))
            decimals = len(text.split(".")[1])
            self.assertEqual(f"{row['ours']:.{decimals}f}", text)

    def test_future_work_has_no_numbers_of_the_paper(self):
        own = [row for name, table in self.tables.items() if name.startswith("triple_prism")
               for row in table["rows"]]
        self.assertEqual(len(own), 49)
        self.assertTrue(all(row["paper"] is None for row in own))
        self.assertEqual(self.result["rows"] - len(own), 121)

    def test_draws_of_the_paper_are_placed_among_ours(self):
        draw = self.row("section_3_3", "RMSE of the adjusted azimuth")["distribution"]
        self.assertGreaterEqual(draw["draws"], 60)
        self.assertLess(draw["quantile_05"], draw["median"])
        self.assertLess(draw["median"], draw["quantile_95"])
        self.assertTrue(2.5 <= draw["percentile_of_paper"] <= 97.5)

    def test_files(self):
        folder = self.folder / "result"
        self.assertEqual({path.name for path in folder.iterdir()},
                         {"reproduction.json", "report.html"})
        written = json.loads((folder / "reproduction.json").read_text(encoding="utf-8"))
        self.assertEqual(written, self.result)
        page = (folder / "report.html").read_text(encoding="utf-8")
        self.assertIn(f"{self.result['passed']} of {self.result['rows']} rows pass", page)
        for figure in FIGURES:
            self.assertIn(f'id="{figure}_diagrams"', page)

    def test_a_recording_that_is_none(self):
        (self.folder / "none.lvx").write_text("no recording", encoding="utf-8")
        self.expect(3, "reproduce", "-o", "other", "--recording", "none.lvx")
        self.expect(3, "reproduce", "-o", "other", "--recording", "missing.lvx")


if __name__ == "__main__":
    unittest.main()
