#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The page of a result folder, drawn again."""
import json
import unittest

from command import SOURCE, CommandTest


class ReportTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        test = cls()
        test.expect(0, "simulate", "-o", "unit.lvx", "--sensor", "mid-40-table3", "--scene",
                    SOURCE / "data/hall.yaml", "--reported", "nominal", "--duration-s", "2",
                    "--quiet")
        test.expect(0, "estimate", "unit.lvx", "-o", "estimate", "--states", "none", "--quiet")
        test.expect(0, "calibrate", "unit.lvx", "--truth", "unit.lvx.truth.yaml", "-o",
                    "calibrate", "--states", "none", "--quiet")

    def test_the_page_comes_out_as_it_was(self):
        for verb in ("estimate", "calibrate"):
            with self.subTest(verb=verb):
                page = self.folder / verb / "report.html"
                before = page.read_bytes()
                self.assertLess(len(before), 4 * 1024 * 1024)
                page.unlink()
                result = self.expect_json(0, "report", verb)
                self.assertEqual(result["html"], f"{verb}/report.html")
                self.assertEqual(result["verb"], verb)
                self.assertEqual(result["bytes"], len(before))
                self.assertEqual(page.read_bytes(), before)

    def test_another_place_for_the_page(self):
        result = self.expect_json(0, "report", "estimate", "-o", "sensor-17.html")
        self.assertEqual(result["html"], "sensor-17.html")
        self.assertEqual((self.folder / "sensor-17.html").read_bytes(),
                         (self.folder / "estimate/report.html").read_bytes())

    def test_the_page_needs_no_network_and_says_how_it_was_made(self):
        text = (self.folder / "estimate/report.html").read_text()
        own = text[text.index("<body>"):text.index("</main>")]  # without the libraries
        self.assertNotIn("http", own)
        self.assertNotIn("src=", own)
        for word in ("risley estimate unit.lvx -o estimate", "input_sha256", "seed", "version"):
            self.assertIn(word, own)

    def test_two_results_side_by_side(self):
        found = self.expect_json(0, "report", "estimate", "calibrate", "-o", "two.html")
        self.assertEqual(found["verbs"], ["estimate", "calibrate"])
        self.assertTrue(found["same_unit"])
        # The estimate is what the sensor believes; the calibration says how wrong that is.
        bent = json.loads((self.folder / "calibrate/report.json").read_text())["pointing_error"]
        for key in ("total_deg", "shared_deg", "shape_deg"):
            said = bent[key]["value"]
            self.assertAlmostEqual(found["directions"][key]["value"], said, delta=0.03 * said)
        self.assertGreater(found["differences"]["incident_beam_vertical_deg"]["sigma"], 0)
        self.assertIn("calibrate/calibration.yaml", [one["path"] for one in found["inputs"]])
        self.assertIn("<code>bent</code>", (self.folder / "two.html").read_text())
        self.assertIn("--output is missing",
                      self.expect(2, "report", "estimate", "calibrate").stderr)
        self.assertIn("calibration.yaml", self.expect(
            2, "report", "estimate", "calibrate", "-o", "calibrate/calibration.yaml").stderr)

    def test_a_folder_without_a_report(self):
        (self.folder / "empty").mkdir(exist_ok=True)
        done = self.expect(3, "report", "empty")
        self.assertIn("empty/report.json", done.stderr)
        self.assertIn("estimate -o", done.stderr)
        done = self.expect(3, "report", "nowhere")
        self.assertIn("nowhere", done.stderr)
        done = self.expect(3, "report", "unit.lvx")
        self.assertIn("expected a folder", done.stderr)

    def test_a_damaged_report_leaves_the_page_alone(self):
        folder = self.folder / "damaged"
        folder.mkdir(exist_ok=True)
        text = (self.folder / "estimate/report.json").read_text()
        (folder / "report.html").write_text("old")
        (folder / "report.json").write_text(text[:1000])
        done = self.expect(3, "report", "damaged")
        self.assertIn("damaged/report.json", done.stderr)
        self.assertIn("byte", done.stderr)
        data = json.loads(text)
        del data["parameters"]
        (folder / "report.json").write_text(json.dumps(data))
        self.assertIn("parameters is missing", self.expect(3, "report", "damaged").stderr)
        self.assertEqual((folder / "report.html").read_text(), "old")

    def test_what_did_not_converge_has_a_page_too(self):
        done = self.expect(1, "estimate", "unit.lvx", "-o", "wrong", "--free", "wedge_angle_deg",
                           "--free", "refractive_index_air",
                           "--quiet")
        self.assertIn("not converged", done.stderr)
        self.assertTrue((self.folder / "wrong/report.html").exists())
        self.assertFalse((self.folder / "wrong/calibration.yaml").exists())
        self.expect(0, "report", "wrong")


if __name__ == "__main__":
    unittest.main()
