#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Clouds: the keys that scripts read, points against the truth, many files, and what is refused."""
import csv
import math
import re
import unittest

from command import CommandTest, codes_of, run

WALL = ("planes:\n  - {name: wall, distance_m: 10, normal_azimuth_deg: 10, normal_zenith_deg: 80}\n")
NORMAL = tuple(math.cos(math.radians(10)) * f(math.radians(10)) for f in (math.cos, math.sin)) + (
    math.sin(math.radians(10)),)
KEYS = {"points", "format", "input", "output", "observations", "no_return", "outliers",
        "without_rotation_angle", "residuals", "repointing_deg", "common_factors", "warnings"}


class CloudTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "wall.yaml").write_text(WALL)
        cls.simulate("wall.nc", "--seed", 1)
        cls.simulate("other.nc", "--seed", 2)
        # A perfect calibration of the unit whose own one is wrong.
        done = run("estimate", "wall.nc", "-o", "believed", "--quiet", folder=cls.folder)
        assert done.returncode == 0, done.stderr

    @classmethod
    def simulate(cls, name, *more, seconds=3, rate=5000):
        done = run("simulate", "-o", name, "--sensor", "mid-40-table3", "--reported", "nominal",
                   "--scene", "wall.yaml", "--duration-s", seconds, "--rate-hz", rate,
                   "--noise-angle-deg", 0.004, "--noise-range-m", 0.02, *more, folder=cls.folder)
        assert done.returncode == 0, done.stderr

    def cloud(self, recording, output, *more, calibration="mid-40-table3"):
        return self.expect_json(0, "cloud", recording, "--calibration", calibration, "-o", output,
                                *more)

    def rows(self, name):
        with (self.folder / name).open(encoding="utf-8") as file:
            return [{key: float(value) for key, value in row.items()}
                    for row in csv.DictReader(file)]

    def distances(self, rows):
        """Signed distances from the wall, m."""
        return [sum(n * row[f"{axis}_m"] for n, axis in zip(NORMAL, "XYZ")) - 10 for row in rows]

    def true_calibration(self):
        """The unit's true parameters, held against planes."""
        text = (self.folder / "wall.nc.truth.yaml").read_text(encoding="utf-8")
        text = re.sub(r"(?ms)^serial:.*?\n", "", text)
        path = self.folder / "true.yaml"
        path.write_text(re.sub(r"(?m)^provenance:", "calibrated_against: planes\nprovenance:", text))
        return path.name

    def test_keys_and_counts(self):
        found = self.cloud("wall.nc", "keys.csv")
        self.assertLessEqual(KEYS, found.keys())
        self.assertEqual(found["format"], "csv")
        self.assertEqual(found["observations"], 15000)
        self.assertEqual(found["points"] + found["no_return"] + found["outliers"] +
                         found["without_rotation_angle"], 15000)
        self.assertEqual(len(self.rows("keys.csv")), found["points"])

    def test_true_calibration_flattens_the_wall(self):
        truth = self.true_calibration()
        thickness = {}
        for directions in ("smoothed", "reported"):
            self.cloud("wall.nc", f"{directions}.csv", "--directions", directions,
                       calibration=truth)
            off = self.distances(self.rows(f"{directions}.csv"))
            thickness[directions] = math.sqrt(sum(d * d for d in off) / len(off))
        # 20 mm of noise along beams that meet the wall at up to 30 degrees.
        self.assertLess(thickness["smoothed"], 0.0205)
        self.assertGreater(thickness["smoothed"], 0.018)
        self.assertGreater(thickness["reported"], 1.05 * thickness["smoothed"])

    def test_calibration_of_the_other_speed_combination(self):
        # The unit after the next power-up: its rotors run the other way, its prisms are the same.
        self.simulate("switched.csv", "--set", "angular_velocity_a_deg_per_s=-27997.8", "--set",
                      "angular_velocity_b_deg_per_s=43789.8")
        self.cloud("switched.csv", "switched_cloud.csv", calibration=self.true_calibration())
        off = self.distances(self.rows("switched_cloud.csv"))
        thickness = math.sqrt(sum(d * d for d in off) / len(off))
        self.assertLess(thickness, 0.0205)
        self.assertGreater(thickness, 0.018)

    def test_preset_that_contradicts_the_recording_is_taken_at_its_word(self):
        found = self.cloud("wall.nc", "word.csv", calibration="mid-40-table3")
        self.assertIn("calibration_doubtful", codes_of(found))
        off = self.distances(self.rows("word.csv"))
        self.assertLess(math.sqrt(sum(d * d for d in off) / len(off)), 0.0205)
        # The type says little, so the recording's own directions are taken.
        found = self.cloud("wall.nc", "type.csv", calibration="mid-40")
        self.assertEqual(found["repointing_deg"]["rms"], 0)
        self.assertEqual(found["warnings"], [])

    def test_covariance_of_a_point_is_positive_and_consistent(self):
        self.cloud("wall.nc", "covariance.csv")
        for row in self.rows("covariance.csv")[::50]:
            for axis in "XYZ":
                self.assertAlmostEqual(row[f"Std{axis}_m"] ** 2 / row[f"Variance{axis}_m2"], 1, 5)
            along = sum(n * row[f"{axis}_m"] for n, axis in zip(NORMAL, "XYZ"))
            self.assertGreater(along, 9.8)
            self.assertLess(abs(row["CovarianceXY_m2"]),
                            math.sqrt(row["VarianceX_m2"] * row["VarianceY_m2"]))

    def test_incidence_angles(self):
        self.cloud("wall.nc", "incidence.csv")
        rows = [row for row in self.rows("incidence.csv") if not math.isnan(
            row["IncidenceAngle_deg"])]
        self.assertGreater(len(rows), 14000)
        off = []
        for row in rows:
            beam = [row[f"{axis}_m"] for axis in "XYZ"]
            cosine = sum(n * b for n, b in zip(NORMAL, beam)) / math.sqrt(sum(b * b for b in beam))
            off.append(row["IncidenceAngle_deg"] - math.degrees(math.acos(min(1, cosine))))
        self.assertLess(math.sqrt(sum(d * d for d in off) / len(off)), 4)

    def test_same_bytes_whatever_the_threads(self):
        for threads in (1, 2, 3):
            self.cloud("wall.nc", f"threads{threads}.las", "--threads", threads)
        first = (self.folder / "threads1.las").read_bytes()
        for threads in (2, 3):
            # The command stands in the file; nothing else may differ.
            other = (self.folder / f"threads{threads}.las").read_bytes()
            self.assertEqual(first.replace(b"threads1", b"threads0").replace(b"--threads 1", b""),
                             other.replace(f"threads{threads}".encode(), b"threads0").replace(
                                 f"--threads {threads}".encode(), b""))

    def test_every_format(self):
        for ending in ("las", "ply", "pcd", "npy", "csv", "xyz", "nc", "bag"):
            found = self.cloud("wall.nc", f"format.{ending}")
            self.assertEqual(found["points"], 15000 - found["outliers"])
            self.assertTrue((self.folder / f"format.{ending}").stat().st_size > 15000)

    def test_common_factors_are_named_and_written(self):
        found = self.cloud("wall.nc", "factors.csv", "--common-factors", "yes")
        self.assertIn("prism_spacing_m", found["common_factors"])
        row = self.rows("factors.csv")[0]
        for k in range(1, len(found["common_factors"]) + 1):
            self.assertIn(f"Loading{k}X_m", row)

    def test_reported_directions_from_the_origin_need_no_rotation_angles(self):
        # Too short for any estimate.
        self.simulate("short.nc", seconds=0.01)
        self.refused(1, "rotation angles", "short.nc", "short.csv")
        self.cloud("short.nc", "short.csv", "--directions", "reported", "--beam-origin", "no")
        rows = self.rows("short.csv")
        self.assertNotIn("PrismAngle1_deg", rows[0])
        self.assertGreater(rows[0]["StdX_m"], 0.015)

    def test_calibration_of_the_recording_itself(self):
        found = self.cloud("wall.nc", "own.csv", calibration="believed/calibration.yaml")
        self.assertEqual(found["repointing_deg"]["rms"], 0)
        self.assertLess(found["residuals"]["azimuth_deg"]["rms"], 0.006)

    def refused(self, status, named, recording, output, *more, calibration="mid-40-table3"):
        before = self.names()
        found = self.expect_json(status, "cloud", recording, "--calibration", calibration, "-o",
                                 output, *more)
        self.assertIn(named, found["error"])
        self.assertEqual(self.names(), before)

    def test_calibrations_of_other_sensors(self):
        text = (self.folder / "believed/calibration.yaml").read_text(encoding="utf-8")
        self.assertIn("serial", text)
        other = self.folder / "serial.yaml"
        other.write_text(re.sub(r"(?m)^serial:.*$", 'serial: "3GGDJ9600100401"', text))
        self.refused(2, "3GGDJ9600100401", "wall.nc", "no.las", calibration=other.name)
        faces = self.folder / "faces.yaml"
        faces.write_text(text.replace("face_order: PA-AP", "face_order: AP-PA"))
        self.refused(1, "another sensor", "wall.nc", "no.las", calibration=faces.name)
        bent = self.folder / "bent.yaml"
        bent.write_text(re.sub(r"(incident_beam_vertical_deg: {value: )[^,]*", r"\g<1>0.4", text))
        self.refused(1, "incident_beam_vertical_deg", "wall.nc", "no.las", calibration=bent.name)

    def test_without_a_calibration_points_are_where_the_sensor_says(self):
        made = self.expect_json(0, "cloud", "wall.nc", "-o", "told.csv", "--beam-origin", "no")
        self.assertIn("calibration_assumed", codes_of(made))
        self.assertEqual(made["calibration"], {"path": "mid-40", "calibrated_against": None})
        self.cloud("wall.nc", "named.csv", "--beam-origin", "no", "--directions", "reported", calibration="mid-40")
        columns = ("X_m", "Y_m", "Z_m")
        for told, named in zip(self.rows("told.csv"), self.rows("named.csv")):
            self.assertEqual([told[c] for c in columns], [named[c] for c in columns])

    def test_another_sensor_is_refused_by_the_header_of_the_recording(self):
        self.expect(0, "convert", "wall.nc", "-o", "wall.lvx")
        done = self.expect(1, "cloud", "wall.lvx", "--calibration", "avia", "-o", "no.las")
        self.assertIn("Mid-40", done.stderr)

    def test_coordinates_beyond_las(self):
        self.refused(2, "allowed", "wall.nc", "far.las", "--las-scale-m", "1e-9")

    def test_no_ranges(self):
        done = run("simulate", "-o", "angles.csv", "--rate-hz", 1000, folder=self.folder)
        self.assertEqual(done.returncode, 0)
        self.refused(2, "no ranges", "angles.csv", "no.las")

    def test_many_files(self):
        (self.folder / "broken.nc").write_bytes((self.folder / "wall.nc").read_bytes()[:3000])
        found = self.expect_json(3, "cloud", "[wo]*r.nc", "wall.nc", "broken.nc", "--calibration",
                                 "mid-40-table3", "-o", "clouds", "--threads", 2)
        self.assertEqual(found["done"], 2)
        self.assertEqual(found["failed"], 1)
        by_input = {entry["input"]: entry for entry in found["results"]}
        self.assertEqual(by_input["broken.nc"]["status"], 3)
        self.assertIn("broken.nc", by_input["broken.nc"]["message"])
        self.assertEqual(found["points"], sum(e.get("points", 0) for e in found["results"]))
        self.assertEqual({p.name for p in (self.folder / "clouds").iterdir()},
                         {"wall.las", "other.las"})
        text = self.expect(3, "cloud", "wall.nc", "broken.nc", "--calibration", "mid-40-table3",
                           "-o", "clouds").stdout
        self.assertIn("1 of 2 files done", text)

    def test_converting_many_files(self):
        found = self.expect_json(0, "convert", "*r.nc", "wall.nc", "-o", "converted", "--format",
                                 "lvx-1.1", "--threads", 2)
        self.assertEqual(found["failed"], 0)
        self.assertEqual({p.name for p in (self.folder / "converted").iterdir()},
                         {"other.lvx", "wall.lvx"})
        self.assertEqual(self.expect_json(2, "convert", "wall.nc", "./wall.nc", "-o", "twice",
                                          "--format", "lvx-1.1")["exit_status"], 2)

    def test_page_of_the_points(self):
        found = self.expect_json(0, "cloud", "wall.nc", "--calibration", "mid-40-table3", "-o",
                                 "page.ply", "--report", "page.html")
        self.assertEqual(found["html"], "page.html")
        page = (self.folder / "page.html").read_text(encoding="utf-8")
        self.assertIn("Uncertainty of the points", page)
        self.assertIn(f"{found['points']:,}".replace(",", "\u202f"), page)
        error = self.expect(2, "cloud", "wall.nc", "other.nc", "--calibration", "mid-40-table3",
                            "-o", "clouds", "--report", "page.html").stderr
        self.assertIn("--report is for one recording, and there are 2", error)
        self.expect(2, "cloud", "wall.nc", "--calibration", "mid-40-table3", "-o", "same.ply",
                    "--report", "same.ply")
        self.assertFalse((self.folder / "same.ply").exists())

    def test_beam_origin_map(self):
        found = self.expect_json(0, "cloud", "--calibration", "mid-40", "--beam-origin-map",
                                 "map.html")
        for axis in ("y_m", "z_m"):
            self.assertAlmostEqual(found[axis]["max"], 0.0044, 4)
            self.assertAlmostEqual(found[axis]["min"], -0.0044, 4)
        self.assertIn("Largest Y", (self.folder / "map.html").read_text(encoding="utf-8"))


if __name__ == "__main__":
    unittest.main()
