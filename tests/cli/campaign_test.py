#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Monte Carlo campaigns: parts, kill -9 among them, threads, the merge, and what it says when some are missing."""
import csv
import json
import signal
import subprocess
import time
import unittest

from command import COMMAND, CommandTest

PLAN = """\
simulate: {sensor: mid-40-table3, duration_s: 0.1, rate_hz: 2000, format: sequence.csv}
estimate: {sensor: mid-40}
grid:
  simulate.noise_angle_deg: [0.01, 0.02]
seeds: {first: 1, count: 8}
"""


class CampaignTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "plan.yaml").write_text(PLAN)

    def files(self, folder):
        return sorted(str(path.relative_to(self.folder / folder))
                      for path in (self.folder / folder).rglob("*") if path.is_file())

    def test_all_at_once(self):
        whole = self.expect_json(0, "campaign", "plan.yaml", "-o", "whole", "--threads", "1")
        self.assertEqual((whole["cells"], whole["done"], whole["missing"]), (16, 16, []))
        self.assertEqual(self.files("whole"), ["cells.csv", "chunks/chunk-1-of-1.jsonl", "report.html", "summary.json"])
        page = (self.folder / "whole/report.html").read_text(encoding="utf-8")
        self.assertEqual(page.count('class="verdict"'), 1)
        self.assertIn('"sigma":', page)  # the bands
        written = json.loads((self.folder / "whole/summary.json").read_text())
        self.assertEqual(written["settings"], whole["settings"])
        self.assertEqual([one["grid"] for one in whole["settings"]],
                         [{"simulate.noise_angle_deg": "0.01"}, {"simulate.noise_angle_deg": "0.02"}])
        with open(self.folder / "whole/cells.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([int(row["cell"]) for row in rows], list(range(16)))
        self.assertEqual([int(row["seed"]) for row in rows], [1 + i // 2 for i in range(16)])
        errors = [float(row["refractive_index.error"]) for row in rows[::2]]
        index = whole["settings"][0]["parameters"]["refractive_index"]
        self.assertAlmostEqual(index["bias"], sum(errors) / 8, places=15)
        self.assertIn("16 of 16 cells", self.expect(0, "campaign", "plan.yaml", "-o", "whole").stdout)
        # A cell is what the single verbs make of its seed.
        self.expect_json(0, "simulate", "-o", "one.sequence.csv", "--sensor", "mid-40-table3", "--duration-s", "0.1",
                         "--rate-hz", "2000", "--noise-angle-deg", "0.01", "--seed", "3")
        one = self.expect_json(0, "estimate", "one.sequence.csv", "--sensor", "mid-40", "--truth",
                               "one.sequence.csv.truth.yaml")
        self.assertEqual(one["truth"]["parameters"]["refractive_index"]["error"],
                         float(rows[4]["refractive_index.error"]))
        self.check_parts(whole)

    def check_parts(self, whole):
        """Parts, one of them killed, by two threads and merged into another format."""
        first = self.expect_json(0, "campaign", "plan.yaml", "--chunk", "1/3", "-o", "parts", "--threads", "2")
        self.assertEqual((first["cells"], first["done"], first["made_before"]), (5, 5, False))
        again = self.expect_json(0, "campaign", "plan.yaml", "--chunk", "1/3", "-o", "parts")
        self.assertTrue(again["made_before"])
        self.expect_json(0, "campaign", "plan.yaml", "--chunk", "3/3", "-o", "parts")
        some = self.expect_json(3, "campaign", "plan.yaml", "--merge", "-o", "parts")
        self.assertEqual((some["done"], some["missing"]), (11, [[5, 9]]))
        self.assertIn("5 of 16 cells have no result (5-9)", some["error"])
        self.expect_json(0, "campaign", "plan.yaml", "--chunk", "2/3", "-o", "parts")
        parts = self.expect_json(0, "campaign", "plan.yaml", "--merge", "-o", "parts")
        self.assertEqual(parts["settings"], whole["settings"])
        self.assertEqual((self.folder / "parts/cells.csv").read_bytes(),
                         (self.folder / "whole/cells.csv").read_bytes())
        self.expect_json(0, "campaign", "plan.yaml", "--merge", "-o", "parts", "--table", "cells.nc")
        self.assertTrue((self.folder / "cells.nc").exists())

    def test_a_part_is_whole_or_not_there(self):
        (self.folder / "long.yaml").write_text(PLAN.replace("count: 8", "count: 4000"))
        part = [COMMAND, "campaign", "long.yaml", "--chunk", "1/2", "-o", "killed", "--quiet"]
        for sent, status in ((signal.SIGTERM, 130), (signal.SIGKILL, -9)):
            with subprocess.Popen(part, cwd=self.folder, stderr=subprocess.DEVNULL) as process:
                time.sleep(1.5)
                process.send_signal(sent)
                self.assertEqual(process.wait(), status)
            self.assertEqual(self.files("killed"), [])

    def test_wrong_use(self):
        for arguments, status, words in (
                ((), 2, "--output"),
                (("-o", "d", "--chunk", "3"), 2, "--chunk: found 3, expected I/N"),
                (("-o", "d", "--chunk", "4/3"), 2, "--chunk = 4/3"),
                (("-o", "d", "--chunk", "1/17"), 2, "16 cells"),
                (("-o", "d", "--chunk", "1/2", "--merge"), 2, "--merge"),
                (("-o", "d", "--chunk", "1/2", "--table", "t.csv"), 2, "--table"),
                (("-o", "d", "--merge", "--table", "t.txt"), 2, "t.txt"),
                (("-o", "d", "--merge", "--table", "plan.yaml"), 2, "plan.yaml"),
                (("-o", "plan.yaml",), 3, "plan.yaml")):
            with self.subTest(arguments):
                self.assertIn(words, self.expect(status, "campaign", "plan.yaml", *arguments).stderr)
        self.assertIn("no.yaml", self.expect(3, "campaign", "no.yaml", "-o", "d").stderr)
        (self.folder / "bad.yaml").write_text("simulate: {}\nestimate: {metod: map}\nseeds: {count: 1}\n")
        self.assertIn("estimate.metod", self.expect(3, "campaign", "bad.yaml", "-o", "d").stderr)
        self.assertFalse((self.folder / "d").exists())
        nothing = self.expect(3, "campaign", "plan.yaml", "--merge", "-o", "d").stderr
        self.assertRegex(nothing, "d/chunks: .*no chunk of a campaign")
        self.assertFalse((self.folder / "d").exists())


if __name__ == "__main__":
    unittest.main()
