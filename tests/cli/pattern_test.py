#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""risley preset and risley pattern: what simulators and makers of presets are given."""
import json
import math
import os
import pathlib
import re
import unittest
from xml.etree import ElementTree

from command import SOURCE, CommandTest, codes_of, run


class PresetTest(CommandTest):
    def test_shown_as_it_stands(self):
        for path in sorted((SOURCE / "presets").glob("*.yaml")):
            self.assertEqual(self.expect(0, "preset", "show", path.stem).stdout, path.read_text())
        shown = self.expect_json(0, "preset", "show", "avia")
        self.assertEqual((shown["model"], shown["prisms"], shown["emitters"]), ("Avia", 2, 6))

    def test_a_new_one_works_everywhere(self):
        self.expect(0, "preset", "new", "unit-17", "--from", "horizon", "-o", "unit-17.yaml")
        text = (self.folder / "unit-17.yaml").read_text().replace("value: 1.5799", "value: 1.58")
        (self.folder / "unit-17.yaml").write_text(text)
        checked = self.expect_json(0, "preset", "check", "unit-17.yaml")["results"]
        self.assertEqual([(one["name"], one["status"]) for one in checked], [("unit-17", 0)])
        self.expect(0, "simulate", "-o", "unit.nc", "--sensor", "unit-17.yaml", "--duration-s", "0.1")

    def test_mistakes_have_their_line(self):
        (self.folder / "bad.yaml").write_text(
            self.expect(0, "preset", "show", "avia").stdout.replace("emitters: 6", "emitters: 60"))
        done = self.expect_json(3, "preset", "check", "bad.yaml", "missing.yaml")
        bad, missing = done["results"]
        self.assertRegex(bad["message"], r"bad\.yaml.*line \d+.*emitters")
        self.assertEqual((bad["status"], missing["status"]), (3, 3))


class PatternTest(CommandTest):
    def rows(self, text):
        lines = text.splitlines()
        self.assertEqual(lines[0], "Time,Azimuth,Zenith")
        return [tuple(map(float, line.split(","))) for line in lines[1:]]

    def test_csv_is_a_recording(self):
        made = self.expect_json(0, "pattern", "--sensor", "mid-40-sequence", "--format", "livox-csv",
                                "--duration-s", "0.5", "-o", "mid.csv")
        self.assertEqual((made["rows"], made["blocked"]), (50_000, 0))
        found = self.expect_json(0, "estimate", "mid.csv")
        self.assertEqual(found["combination"], 2)
        self.assertAlmostEqual(found["parameters"]["refractive_index"]["value"], 1.5089, delta=1e-6)

    def test_stdout_is_the_file(self):
        arguments = ("pattern", "--sensor", "avia", "--format", "livox-csv", "--duration-s", "0.01")
        self.expect(0, *arguments, "-o", "avia.csv")
        text = self.expect(0, *arguments, "-o", "-").stdout
        self.assertEqual((self.folder / "avia.csv").read_text(), text)
        rows = self.rows(text)
        self.assertEqual(len(rows), 2400)
        self.assertEqual(rows[1][0], round(1 / 240000, 9))
        every = self.rows(self.expect(0, *arguments, "-o", "-", "--every", "40").stdout)
        # The last of 40 rounds of its six emitters.
        self.assertEqual(every, [row for first in range(39 * 6, 2400, 40 * 6) for row in rows[first:first + 6]])
        refused = run(*arguments, "-o", "-", "--json")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("--json needs a file", refused.stderr)
        # Shots of a group fire one after another, unless they are set to fire together.
        held = self.rows(self.expect(0, *arguments, "-o", "-", "--firing", "together").stdout)
        self.assertEqual(held[0], rows[0])
        self.assertNotEqual(held[1], rows[1])

    def test_numpy_reads_the_same_directions(self):
        try:
            import numpy
        except ImportError:
            self.skipTest("SKIPPED: no numpy")
        arguments = ("pattern", "--sensor", "tele-15", "--duration-s", "0.3")
        self.expect(0, *arguments, "--format", "livox-csv", "-o", "tele.csv")
        self.expect(0, *arguments, "--format", "npy", "-o", "tele.npy")
        array = numpy.load(self.folder / "tele.npy")
        self.assertEqual((array.dtype, array.shape), (numpy.float32, (72_000, 2)))
        rows = self.rows((self.folder / "tele.csv").read_text())
        for i in (0, 1, 65_535, 65_536, 71_999):
            self.assertAlmostEqual(array[i, 0], math.radians(rows[i][1]), delta=1e-6)
            self.assertAlmostEqual(array[i, 1], math.radians(90 - rows[i][2]), delta=1e-6)

    def test_every_format_is_one_file_and_the_same_on_stdout(self):
        for name in ("livox-csv", "npy", "helios-xml", "json", "usda"):
            arguments = ("pattern", "--sensor", "avia", "--duration-s", "0.01", "--format", name)
            made = self.expect_json(0, *arguments, "-o", "one." + name)
            self.assertEqual((made["format"], made["rows"], made["blocked"]), (name, 2400, 0))
            if name != "npy":  # bytes
                self.assertEqual((self.folder / ("one." + name)).read_text(),
                                 self.expect(0, *arguments, "-o", "-").stdout)
            # Nothing beside it.
            self.assertEqual([path.name for path in self.folder.glob(f"*{name}*")], ["one." + name])
        self.assertIn("--format", self.expect(2, "pattern", "-o", "-").stderr)
        self.assertIn("nothing to do", self.expect(2, "pattern").stderr)

    def test_helios_gets_a_sensor_whose_preset_has_no_sequence(self):
        made = self.expect_json(0, "pattern", "--sensor", "mid-40", "--duration-s", "0.01", "--format",
                                "helios-xml", "-o", "plain.xml")
        self.assertLess(made["residual"]["worst_deg"], 1e-6)
        self.expect(2, "pattern", "--sensor", "mid-40", "--format", "helios-xml", "-o", "one.xml",
                    "--start-angles-deg", "1")

    def test_isaac_gets_every_shot_with_its_time(self):
        arguments = ("pattern", "--sensor", "horizon", "--duration-s", "0.05")
        self.expect(0, *arguments, "--format", "livox-csv", "-o", "horizon.csv")
        rows = self.rows((self.folder / "horizon.csv").read_text())
        made = self.expect_json(0, *arguments, "--format", "json", "-o", "horizon.json")
        whole = json.loads((self.folder / "horizon.json").read_text())
        profile = whole["profile"]
        self.assertEqual((whole["type"], profile["scanType"]), ("lidar", "solidState"))
        self.assertEqual(whole["_not_carried"], made["not_carried"])
        self.assertEqual(profile["scanRateBaseHz"], 20)
        state, = profile["emitterStates"]
        emitters = profile["numberOfEmitters"]
        self.assertEqual((emitters, sum(profile["numRaysPerLine"])), (12_000, 12_000))
        for name in ("azimuthDeg", "elevationDeg", "fireTimeNs", "channelId"):
            self.assertEqual(len(state[name]), emitters, name)
        for i in range(0, emitters, 97):
            self.assertAlmostEqual(state["azimuthDeg"][i], rows[i][1], delta=6e-7)
            self.assertAlmostEqual(state["elevationDeg"][i], 90 - rows[i][2], delta=6e-7)
            self.assertEqual(state["fireTimeNs"][i], round(1e9 * i / 240_000))
            self.assertEqual(state["channelId"][i], i % 6 + 1)
        # USD has the same arrays.
        self.expect(0, *arguments, "--format", "usda", "-o", "horizon.usda")
        text = (self.folder / "horizon.usda").read_text()
        self.assertTrue(text.startswith("#usda 1.0\n"))
        self.assertEqual(text.count("{"), text.count("}"))
        for name, kind in (("azimuthDeg", "float"), ("elevationDeg", "float"),
                           ("fireTimeNs", "uint"), ("channelId", "uint")):
            found = re.search(rf"{kind}\[\] omni:sensor:Core:emitterState:s001:{name} = (\[.*\])",
                              text).group(1)
            self.assertEqual(json.loads(found), state[name], name)
        self.assertIn("uint omni:sensor:Core:numberOfEmitters = 12000", text)
        # More than 32 bits of nanoseconds.
        long = self.expect(2, "pattern", "--sensor", "horizon", "--duration-s", "5",
                           "--format", "usda", "-o", "a.usda")
        self.assertIn("duration = 5 s", long.stderr)
        self.assertFalse((self.folder / "a.usda").exists())

    def test_helios_says_what_it_costs(self):
        helios = ("pattern", "--format", "helios-xml", "--sensor")
        exact = self.expect_json(0, *helios, "horizon-sequence", "-o", "exact.xml")
        self.assertLess(exact["residual"]["worst_deg"], 1e-9)
        self.assertEqual(exact["residual"]["turn_deg"]["y"], -90)
        lost = self.expect_json(0, *helios, "horizon", "-o", "lost.xml")
        self.assertGreater(lost["residual"]["rms_deg"], 0.05)
        self.assertEqual(lost["rows"], 240_000)
        root = ElementTree.parse(self.folder / "lost.xml").getroot()
        scanner, = root.findall("scanner")
        self.assertEqual((root.tag, scanner.get("optics")), ("document", "risley"))
        self.assertEqual([scanner.get(f"angle{k}_deg") for k in (1, 2, 3)], ["20", "-20", "17.5"])
        self.assertEqual(len(scanner.findall("channels/channel/incidentBeam")), 6)
        comment = (self.folder / "lost.xml").read_text().split("<!--")[1].split("-->")[0]
        self.assertNotIn("--", comment)
        for one in lost["not_carried"]:
            self.assertIn(one, comment)
        said = self.expect(0, *helios, "horizon", "-o", "lost.xml").stdout
        self.assertIn("not carried: Emitters that fire one after another", said)

    def test_coverage_and_page(self):
        made = self.expect_json(0, "pattern", "--sensor", "mid-70", "--coverage",
                                "--integration-s", "0.1,0.4", "--cell-deg", "1", "--report", "a.html")
        coverage = made["coverage"]
        self.assertEqual(made["rows"], 40_000)
        self.assertEqual([one["time_s"] for one in coverage["after"]], [0.1, 0.4])
        first, last = coverage["after"]
        self.assertEqual((first["shots"], last["shots"]), (10_000, 40_000))
        self.assertLess(first["covered"], last["covered"])
        self.assertGreater(first["gap_deg"], last["gap_deg"])
        self.assertAlmostEqual(last["density_per_deg2"]["mean"],
                               40_000 / coverage["field_of_view"]["deg2"], places=9)
        self.assertAlmostEqual(coverage["field_of_view"]["half_angle_deg"], 35.2, delta=0.3)
        covers = coverage["time_to_cover_s"]
        self.assertLess(covers["50"], 0.4)
        self.assertIsNone(covers["99"])  # not in so short a time
        self.assertIn("<title>Scan pattern: mid-70</title>", (self.folder / "a.html").read_text())
        table = self.expect(0, "pattern", "--sensor", "mid-70", "--coverage",
                            "--integration-s", "0.1").stdout
        self.assertIn("largest gap, deg", table)
        self.assertIn("10 000", table)
        refused = self.expect(2, "pattern", "--coverage", "-o", "-", "--format", "npy")
        self.assertIn("--coverage prints on stdout", refused.stderr)

    def test_a_full_disk_is_said(self):
        if not os.path.exists("/dev/full"):
            self.skipTest("SKIPPED: no /dev/full")
        done = self.expect(3, "pattern", "--sensor", "avia", "--format", "npy", "-o", "/dev/full")
        self.assertIn("/dev/full", done.stderr)

    def test_rows_of_the_makers_sequences(self):
        folder = os.environ.get("RISLEY_VENDOR_DATA")
        if not folder:
            self.skipTest("SKIPPED: RISLEY_VENDOR_DATA names no folder")
        for sensor in ("avia", "horizon"):
            theirs = pathlib.Path(folder) / f"livox-{sensor}-sequence-every-40th.csv"
            ours = run("pattern", "--sensor", f"{sensor}-sequence", "--format", "livox-csv",
                       "--duration-s", "4", "-o", "-").stdout.splitlines()
            ours = ours[:1] + ours[40::40]
            lines = theirs.read_text().splitlines()
            self.assertEqual(len(ours), len(lines))
            other = sum(a != b for a, b in zip(ours, lines))
            self.assertLess(other, 0.001 * len(lines), sensor)  # in their last digit

    def test_emitters_that_a_file_does_not_name_fire_in_turn(self):
        self.expect(0, "simulate", "-o", "avia.nc", "--sensor", "avia", "--duration-s", "0.2")
        self.expect(0, "convert", "avia.nc", "-o", "avia.sequence.csv")
        arguments = ("estimate", "avia.sequence.csv", "--sensor", "avia",
                     "--truth", "avia.nc.truth.yaml")
        # Evenly spaced times are counted ones: emitters are found with and without the rate.
        for rate in ((), ("--shot-rate-hz", "240000")):
            found = self.expect_json(0, *arguments, *rate)
            self.assertTrue(found["converged"])
            self.assertEqual(found["slips"], [])
            self.assertNotIn("firing_order", codes_of(found))
            self.assertLess(found["truth"]["nees_parameters"], 2.2)


if __name__ == "__main__":
    unittest.main()
