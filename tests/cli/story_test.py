#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Simulate, estimate, calibrate, estimate again, cloud: text, page and JSON tell one story of a unit."""
import html
import json
import re
import unittest

from command import SOURCE, CommandTest, run

HALL = SOURCE / "data" / "hall.yaml"
WALL = "planes:\n  - {name: wall, distance_m: 20, normal_azimuth_deg: 0, normal_zenith_deg: 90}\n"
SHORT = ("--duration-s", 2, "--rate-hz", 20000, "--seed", 3)
UNITS = {
    "bent": ("--sensor", "mid-40-table3", "--reported", "nominal", "--scene", HALL),
    "perfect": ("--sensor", "mid-40", "--scene", HALL),
    "wall": ("--sensor", "mid-40-table3", "--reported", "nominal", "--scene", "wall.yaml"),
    "noisy": ("--sensor", "mid-40-table3", "--noise-angle-deg", 0.05, "--scene", HALL),
}
PROVISO = re.compile("only walls")
HEALTHY = re.compile(r"healthy|in order|nothing is wrong|true beyond doubt", re.I)


class StoryTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "wall.yaml").write_text(WALL, encoding="utf-8")
        for name, unit in UNITS.items():
            done = run("simulate", "-o", f"{name}.nc", *unit, *SHORT, folder=cls.folder)
            assert done.returncode == 0, done.stderr

    def page_of(self, folder):
        """What a reader of the page sees: its verdict, and all of its text."""
        page = (self.folder / folder / "report.html").read_text(encoding="utf-8")
        main = re.sub(r"<(script|style)\b.*?</\1>", "", page[page.index("<main"):page.index("</main>")],
                      flags=re.S)
        verdict = re.search(r'<section class="verdict.*?</section>', main, re.S).group(0)
        return [" ".join(html.unescape(re.sub(r"<[^>]+>", " ", one)).split()) for one in (verdict, main)]

    def run_verb(self, status, *arguments, folder):
        """Runs a verb with a result folder once for text and once for JSON, which have to agree."""
        said = self.expect(status, *arguments, "-o", folder)
        result = self.expect_json(status, *arguments, "-o", folder)
        verdict = result["verdict"]
        page, _ = self.page_of(folder)
        self.assertIn(f"\n{verdict['code']}: {verdict['words']}\nwhat to do: {verdict['to_do']}\n",
                      said.stdout)
        for words in (verdict["words"], verdict["to_do"]):
            self.assertIn(words, page)
        self.assertRegex(page, rf"^[^.:]+[^.]*\. {verdict['code']} (Found|Why): ")
        # Once on stdout, and once more on stderr.
        self.assertLessEqual(said.stdout.count(verdict["words"]), 1)
        self.assertEqual(said.stdout.startswith("converged\n"), result["converged"])
        # What the page draws again is what it said.
        self.expect(0, "report", folder)
        self.assertEqual(self.page_of(folder)[0], page)
        return result, said

    def check_pointing(self, result, said, folder):
        """Total, shared and shape of the pointing error are the same in text, page and JSON."""
        page, _ = self.page_of(folder)
        number = r"([0-9.]+) ± ([0-9.]+)"
        found = re.search(rf"off by {number} degree .*: {number} shared by all beams and {number} in shape, "
                          r"([0-9.]+) at worst", said.stdout).groups()
        errors = result["pointing_error"]
        values = [errors[name][key] for name in ("total_deg", "shared_deg", "shape_deg")
                  for key in ("value", "sigma")] + [errors["worst_deg"]["value"]]
        for text, value in zip(found, values):
            self.assertEqual(text, f"{value:.{len(text.partition('.')[2])}f}")
        self.assertIn(f"{found[0]} ± {found[1]} degree", page)

    def check_cloud(self, name, calibration, kind):
        said = self.expect(0, "cloud", f"{name}.nc", "--calibration", calibration, "-o", f"{name}.las").stdout
        result = self.expect_json(0, "cloud", f"{name}.nc", "--calibration", calibration, "-o", f"{name}.las")
        used = result["calibration"]
        self.assertEqual(used["calibrated_against"], kind)
        self.assertIn(f"beams by {used['path']} (", said)
        return used["path"], said

    def test_a_bent_unit_that_believes_itself_perfect(self):
        first, _ = self.run_verb(0, "estimate", "bent.nc", folder="bent-1")
        self.assertEqual(first["verdict"]["code"], "consistent")
        verdict, _ = self.page_of("bent-1")
        self.assertRegex(verdict, PROVISO)
        self.assertIn("calibrate", first["verdict"]["to_do"])
        self.assertNotRegex(verdict.replace("a healthy unit of this kind has", ""), HEALTHY)
        self.assertEqual(first["warnings"], [])  # a real unit's rotors turn half a thousandth faster

        found, said = self.run_verb(0, "calibrate", "bent.nc", folder="bent-2")
        self.assertEqual(found["verdict"]["code"], "bent")
        self.check_pointing(found, said, "bent-2")
        self.assertAlmostEqual(found["pointing_error"]["total_deg"]["value"], 0.4034, delta=0.015)

        again, said = self.run_verb(0, "estimate", "bent.nc", "--sensor", "bent-2", folder="bent-3")
        self.assertEqual(again["verdict"]["code"], "unusual")
        for text in (again["verdict"]["words"], self.page_of("bent-3")[0]):
            self.assertIn("differ from its calibration", text)
            self.assertNotIn("preset", text)
            self.assertNotIn("walls", text)  # they have been asked
        self.assertEqual(again["verdict"]["to_do"],
                         "use the calibration and not this estimate for the unit's clouds")
        for text in (again["sensor_choice"]["words"], said.stdout):
            self.assertIn("a calibration from bent.nc", text)
        self.assertIn("bent-2/calibration.yaml", [one["path"] for one in again["inputs"]])
        self.assertIn("--sensor bent-2", self.page_of("bent-3")[1])

        path, said = self.check_cloud("bent", "bent-2", "planes")
        self.assertEqual(path, "bent-2/calibration.yaml")
        self.assertIn("(a calibration)", said)
        # The estimate holds what the sensor believes, and the cloud says that it may be wrong.
        self.assertRegex(self.check_cloud("bent", "bent-1", "directions")[1], PROVISO)
        self.assertIn("mid-40 (a preset)", self.check_cloud("bent", "mid-40", None)[1])

    def test_a_perfect_unit(self):
        first, _ = self.run_verb(0, "estimate", "perfect.nc", folder="perfect-1")
        self.assertEqual(first["verdict"]["code"], "consistent")
        self.assertRegex(self.page_of("perfect-1")[0], PROVISO)
        found, said = self.run_verb(0, "calibrate", "perfect.nc", folder="perfect-2")
        self.assertEqual(found["verdict"]["code"], "as_believed")
        total = found["pointing_error"]["total_deg"]
        self.assertLess(total["value"], 4 * found["datum"]["sigma_total_deg"])
        # What the sensor believes is as good: there is no calibration, unless it is forced.
        self.assertIn("calibration.yaml was not written, because the sensor's own parameters are as good: --force",
                      said.stderr)
        self.assertIs(found["calibration_written"], False)
        self.check_nothing_written("perfect", "perfect-2")
        found, said = self.run_verb(0, "calibrate", "perfect.nc", "--force", folder="perfect-2")
        self.assertIs(found["calibration_written"], True)
        self.assertNotIn("not written", said.stderr)
        again, _ = self.run_verb(0, "estimate", "perfect.nc", "--sensor", "perfect-2", folder="perfect-3")
        self.assertEqual((again["verdict"]["code"], again["verdict"]["to_do"]), ("consistent", "nothing"))
        self.assertIn("and so is its calibration", again["verdict"]["words"])
        self.assertNotRegex(self.page_of("perfect-3")[0], PROVISO)
        self.check_cloud("perfect", "perfect-2", "planes")

    def check_nothing_written(self, name, folder):
        """No calibration, and the verbs that ask for it say so."""
        self.assertFalse((self.folder / folder / "calibration.yaml").exists())
        for verb, *more in (("estimate", "--sensor", folder),
                            ("cloud", "-o", f"{name}.las", "--calibration", folder)):
            result = self.expect_json(3, verb, f"{name}.nc", *more)
            self.assertIn(f"{folder}/calibration.yaml: is missing", result["error"])
            self.assertIn("report.html beside it gives the reason", result["error"])
        self.assertFalse((self.folder / f"{name}.las").exists())

    def test_one_wall_straight_ahead(self):
        first, _ = self.run_verb(0, "estimate", "wall.nc", folder="wall-1")
        self.assertEqual(first["verdict"]["code"], "consistent")
        found, said = self.run_verb(1, "calibrate", "wall.nc", folder="wall-2")
        self.assertEqual(found["verdict"]["code"], "undecided")
        self.assertEqual(found["verdict"]["words"], found["reason"])
        self.assertIn("39 914 points on 1 plane,", said.stdout)
        self.assertTrue(self.page_of("wall-2")[0].startswith("Not converged: do not use these numbers."))
        self.check_nothing_written("wall", "wall-2")
        # With a prior the wall determines a little, which is not enough.
        found, said = self.run_verb(0, "calibrate", "wall.nc", "--prior-sigma-deg", 0.4, folder="wall-3")
        self.assertEqual(found["verdict"]["code"], "not_better")
        self.assertIn("calibration.yaml was not written, because it is not better", said.stderr)
        self.check_pointing(found, said, "wall-3")
        self.check_nothing_written("wall", "wall-3")

    def test_a_noisy_unit(self):
        noise = "12.5 times as noisy"
        first, _ = self.run_verb(0, "estimate", "noisy.nc", folder="noisy-1")
        self.assertEqual(first["verdict"]["code"], "unusual")
        self.assertIn(noise, first["verdict"]["words"])
        self.assertIn("calibrate it on walls", first["verdict"]["to_do"])
        found, said = self.run_verb(0, "calibrate", "noisy.nc", folder="noisy-2")
        # It points where it believes; its noise does not make it bent.
        self.assertIn(found["verdict"]["code"], ("as_believed", "not_better"))
        self.assertLess(found["pointing_error"]["total_deg"]["value"], 0.02)
        for text in (said.stderr, self.page_of("noisy-2")[0], " ".join(one["message"] for one in found["warnings"])):
            self.assertIn(noise, text)
        if found["verdict"]["code"] == "not_better":
            self.check_pointing(found, said, "noisy-2")
        self.check_nothing_written("noisy", "noisy-2")
        self.expect(0, "calibrate", "noisy.nc", "--force", "-o", "noisy-2")
        again, _ = self.run_verb(0, "estimate", "noisy.nc", "--sensor", "noisy-2", folder="noisy-3")
        self.assertEqual(again["verdict"]["code"], "unusual")
        self.assertIn(noise, again["verdict"]["words"])
        self.assertNotIn("sigma from", again["verdict"]["words"])
        self.check_cloud("noisy", "noisy-2", "planes")


if __name__ == "__main__":
    unittest.main()
