#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""docs/questions.md says where text and JSON answer what a newcomer asks; pages are looked at by
tests/browser/questions_test.mjs."""
import re
import unittest

from command import SOURCE, CommandTest, run

MAKE = {
    "calibrate": ("calibrate", "hall.nc"),
    "estimate": ("estimate", "unit.nc"),
    "cloud": ("cloud", "hall.nc", "--calibration", "mid-40", "-o", "out/hall.ply", "--report", "out/hall.html"),
}


def questions():
    """Rows of the table: question, command, and what text and JSON have."""
    for line in (SOURCE / "docs" / "questions.md").read_text().splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) == 6 and cells[1] in MAKE:
            yield cells[0], cells[1], cells[4], cells[5].strip("`")


class QuestionsTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "out").mkdir()
        scene = ("--scene", SOURCE / "data" / "hall.yaml", "--reported", "nominal")
        for name, *more in (("hall.nc", *scene), ("unit.nc",)):
            done = run("simulate", "-o", name, "--sensor", "mid-40-table3", "--duration-s", 2,
                       *more, folder=cls.folder)
            assert done.returncode == 0, done.stderr

    def test_text_and_json_have_the_answers(self):
        rows = list(questions())
        self.assertEqual({command for _, command, _, _ in rows}, set(MAKE))
        self.assertGreaterEqual(len(rows), 10)
        texts = {name: self.expect(0, *words).stdout for name, words in MAKE.items()}
        results = {name: self.expect_json(0, *words) for name, words in MAKE.items()}
        for question, command, text, place in rows:
            with self.subTest(question):
                # Dots stand for anything within a line.
                said = ".+?".join(re.escape(part.strip()) for part in text.split("…"))
                self.assertRegex(texts[command], f"(?m)^{said}" if text[0] != "…" else said)
                value = results[command]
                for key in place.split("."):
                    self.assertIn(key, value)
                    value = value[key]


if __name__ == "__main__":
    unittest.main()
