#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Help, versions and wrong usage."""
import os
import re
import unittest

from command import SOURCE, CommandTest, verbs

VERBS = ("info", "convert", "simulate", "record", "emulate", "estimate", "observability", "calibrate", "cloud",
         "compare", "campaign", "identify", "pattern", "preset", "report", "reproduce")

# Arguments that are wrong, and what the message must name.
WRONG = [
    (["frobnicate"], "frobnicate"),
    (["info"], "INPUT"),
    (["info", "a.lvx", "--colour"], "--colour"),
    (["info", "a.lvx", "--threads", "0"], "--threads"),
    (["convert", "a.lvx"], "--output"),
    (["convert", "a.lvx", "-o", "b.lvx", "--format", "pdf"], "pdf"),
    (["simulate"], "--output"),
    (["simulate", "-o", "a.xyz"], ".xyz"),
    (["simulate", "-o", "a.csv", "--sensor", "mid-41"], "mid-41"),
    (["simulate", "-o", "a.csv", "--rotor", "square"], "square"),
    (["simulate", "-o", "a.csv", "--quantize", "maybe"], "maybe"),
    (["simulate", "-o", "a.csv", "--duration-s", "-1"], "--duration-s"),
    (["simulate", "-o", "a.csv", "--duration-s", "nan"], "--duration-s"),
    (["simulate", "-o", "a.csv", "--rate-hz", "0"], "--rate-hz"),
    (["simulate", "-o", "a.csv", "--noise-angle-deg", "-0.1"], "--noise-angle-deg"),
    (["simulate", "-o", "a.csv", "--noise-angle-deg", "inf"], "--noise-angle-deg"),
    (["simulate", "-o", "a.csv", "--set", "refractive_index=9"], "refractive_index = 9"),
    (["simulate", "-o", "a.csv", "--set", "refractive_index=nan"], "refractive_index"),
    (["simulate", "-o", "a.csv", "--set", "refractive_index=1.5x"], "1.5x"),
    (["simulate", "-o", "a.csv", "--set", "refractive_index"], "NAME=VALUE"),
    (["simulate", "-o", "a.csv", "--set", "wedge=18"], "wedge"),
    (["simulate", "-o", "a.csv", "--set", "wedge_angle_deg=75"], "wedge_angle_deg = 75 deg"),
    (["simulate", "-o", "a.csv", "--reported", "perfect"], "perfect"),
    (["simulate", "-o", "a.csv", "--start-angles-deg", "1,2,3"], "start"),
    (["simulate", "-o", "a.csv", "--quiet", "--verbose"], "--quiet"),
    (["convert", "a.lvx", "a.csv", "-o", "folder"], "--format"),
    (["cloud", "--beam-origin-map", "a.html"], "--calibration"),
    (["cloud", "--calibration", "mid-40", "-o", "a.las"], "INPUT"),
    (["cloud", "a.lvx", "--calibration", "mid-40"], "--output"),
    (["cloud", "a.lvx", "--calibration", "mid-41", "-o", "a.las"], "mid-41"),
    (["cloud", "a.lvx", "--calibration", "mid-40", "-o", "a.pdf"], ".pdf"),
    (["cloud", "a.lvx", "--calibration", "mid-40", "-o", "a.las", "--format", "e57"], "e57"),
    (["cloud", "a.lvx", "--calibration", "mid-40", "-o", "a.las", "--rate-hz", "0"], "--rate-hz"),
    (["cloud", "a.lvx", "--calibration", "mid-40", "-o", "a.las", "--las-scale-m", "0"],
     "--las-scale-m"),
    (["cloud", "a.lvx", "--calibration", "mid-40", "-o", "a.las", "--covariance", "no",
      "--common-factors", "yes"], "--common-factors"),
    (["cloud", "none*.lvx", "--calibration", "mid-40", "-o", "folder/"], "none*.lvx"),
    (["simulat", "-o", "a.csv"], "did you mean simulate?"),
    (["simulate", "-o", "a.csv", "--set", "wedge_angle=18"], "did you mean wedge_angle_deg?"),
    (["simulate", "-o", "a.csv", "--set", "refractiv_index=1.5"], "did you mean refractive_index?"),
    (["convert", "a.lvx", "-o", "a.las"], "risley cloud RECORDING --calibration CALIBRATION"),
    (["simulate", "-o", "a.csv", "--sensor", "mid40"], "did you mean mid-40?"),
    (["estimate", "a.lvx", "--noise", "0.01"],
     "unknown option --noise, did you mean --noise-angle-deg? (see"),
    (["estimate", "a.lvx", "--sensr=mid-40"], "unknown option --sensr, did you mean --sensor?"),
    (["preset", "new", "mine", "--form", "avia"], "unknown option --form, did you mean --from?"),
    (["identify"], "INPUT"),
    (["identify", "a.csv", "--most-prisms", "4"], "--most-prisms"),
    (["identify", "a.csv", "--fastest-hz", "0"], "--fastest-hz"),
    (["pattern", "--format", "npy"], "--output"),
    (["pattern", "-o", "a.npy"], "--format"),
    (["pattern", "-o", "a.npy", "--format", "pdf"], "pdf"),
    (["pattern", "-o", "a.npy", "--format", "npy", "--duration-s", "0"], "--duration-s"),
    (["pattern", "-o", "a.npy", "--format", "npy", "--every", "0"], "--every"),
    (["pattern", "-o", "a.npy", "--format", "npy", "--sensor", "mid-40", "--start-angles-deg", "10"],
     "rotation_angle"),
    (["preset"], "subcommand"),
    (["preset", "show", "avai"], "did you mean avia?"),
    (["preset", "new", "a/b", "--from", "avia"], "a/b"),
    (["preset", "new", "mine"], "--from"),
    (["report"], "DIR"),
    (["compare"], "RESULT"),
    (["campaign", "-o", "results"], "PLAN"),
    (["calibrate", "--plan", "a.yaml", "--table", "t.csv"], "go with recordings, not with --plan"),
    (["simulate", "-o", "a.csv", "--seed", "-1"], "found -1, allowed whole numbers 0 to"),
    (["simulate", "-o", "a.csv", "--seed=-1"], "found -1"),
    (["simulate", "-o", "a.csv", "--seed", "18446744073709551616"], "18446744073709551615"),
    (["simulate", "-o", "a.csv", "--seed", "0.5"], "found 0.5"),
    (["reproduce"], "--output"),
    (["record"], "--output"),
    (["record", "--list", "-o", "a.lvx"], "--list"),
    (["record", "--list", "--passive"], "--passive"),
    (["record", "--list", "--interface", "eth0"], "--interface = eth0"),
    (["record", "--list", "--interface", "192.0.2.1"], "127.0.0.1"),
    (["record", "-o", "a.lvx", "--duration-s", "0"], "--duration-s"),
    (["record", "-o", "a.lvx", "--return-mode", "last"], "last"),
    (["record", "-o", "a.lvx", "--find-s", "0"], "--find-s"),
    (["emulate"], "--interface"),
    (["emulate", "--interface", "192.0.2.1"], "--interface = 192.0.2.1"),
    (["emulate", "--interface", "127.0.0.5", "--loss", "2"], "--loss"),
    (["emulate", "--interface", "127.0.0.5", "--speed", "0"], "--speed"),
    (["emulate", "--interface", "127.0.0.5", "--sensor", "mid-41"], "mid-41"),
    (["emulate", "--interface", "127.0.0.5", "--serial", "sixteen-letters."], "15"),
    (["estimate", "a.csv", "--rate-hz", "fast"], "--rate-hz"),
    (["estimate", "a.csv", "--method", "guess"], "guess"),
    (["estimate", "a.csv", "--method", "ekf", "--states", "all"], "--rate-hz full"),
]


class UsageTest(CommandTest):
    def test_numbers_are_finite(self):
        for words in (("simulate", "-o", "n.nc", "--start-angles-deg", "nan,0"),
                      ("simulate", "-o", "n.nc", "--duration-s", "inf"),
                      ("simulate", "-o", "n.nc", "--set", "wedge_angle_deg=-Infinity"),
                      ("cloud", "a.lvx", "--calibration", "mid-40", "-o", "a.las", "--las-scale-m", "NaN")):
            with self.subTest(words=words):
                self.assertIn("finite", self.expect(2, *words).stderr)

    def test_names_of_files_stay_as_they_are(self):
        for name in ("an option rate.csv", "an option sensor.lvx"):
            self.assertIn(name, self.expect(3, "info", name).stderr)

    def test_version(self):
        self.assertRegex(self.expect(0, "--version").stdout, r"^risley \d+\.\d+\.\d+\n$")

    def test_help_is_found_in_every_way(self):
        text = self.expect(0, "--help").stdout
        self.assertEqual(self.expect(0).stdout, text)
        self.assertEqual(self.expect(0, "help").stdout, text)
        self.assertEqual(sorted(verbs()), sorted(VERBS))
        for verb in VERBS:
            self.assertEqual(self.expect(0, "help", verb).stdout, self.expect(0, verb, "--help").stdout)

    def test_help_matches_its_golden_text(self):
        for verb in ("", *VERBS):
            text = self.expect(0, verb or "help", *["--help"] * bool(verb)).stdout
            if verb:
                seen = set(text.splitlines())
                more = [line for line in self.expect(0, verb, "--help-all").stdout.splitlines() if line not in seen]
                text += "\n======== with --help-all also\n" + "".join(line + "\n" for line in more)
            text = re.sub(r"(?m)^ +\.laz .*\n|\blaz, ", "", text)  # only builds with LASzip have it
            golden = SOURCE / f"tests/cli/golden/{verb or 'risley'}.txt"
            with self.subTest(golden=golden.name):
                wanted = golden.read_text(encoding="utf-8") if golden.exists() else ""
                if text != wanted and os.environ.get("RISLEY_UPDATE_GOLDEN"):
                    golden.write_text(text, encoding="utf-8")
                self.assertEqual(text.splitlines(), wanted.splitlines(), "RISLEY_UPDATE_GOLDEN=1 writes it")
        kept = {path.stem for path in (SOURCE / "tests/cli/golden").iterdir()}
        self.assertEqual(kept, {"risley", *VERBS})

    def test_help_of_each_verb_has_an_example(self):
        for verb in VERBS:
            text = self.expect(0, verb, "--help").stdout
            self.assertRegex(text, rf"\n\nExamples:\n\s+risley {verb} ")
            self.assertLessEqual(text.count("\n"), 45 if verb == "calibrate" else 60, verb)
            text = self.expect(0, verb, "--help-all").stdout
            for option in ("--json", "--quiet", "--no-progress", "--verbose"):
                self.assertIn(option, text)
            self.assertNotRegex(text, r"\{|TEXT:|FLOAT|Excludes|\(\d+x\)")

    def test_seed_and_threads_are_shown_where_they_matter(self):
        for option, verb in (("--seed", "info"), ("--seed", "estimate"), ("--threads", "preset")):
            self.assertNotIn(option, self.expect(0, verb, "--help-all").stdout)
        self.expect(0, "preset", "list", "--seed", "3", "--threads", "2")
        self.assertIn("--seed", self.expect(0, "simulate", "--help").stdout)

    def test_quiet_prints_what_was_asked_for(self):
        self.expect(0, "simulate", "-o", "quiet.csv", "--rate-hz", "1000")
        for words in (("simulate", "-o", "quiet.csv", "--rate-hz", "1000"), ("convert", "quiet.csv", "-o", "quiet.nc")):
            done = self.expect(0, *words, "--quiet")
            self.assertEqual(done.stdout + done.stderr, "")
        self.assertNotEqual(self.expect(0, "info", "quiet.csv", "--quiet").stdout, "")
        self.expect_json(0, "simulate", "-o", "quiet.csv", "--rate-hz", "1000", "--quiet")

    def test_help_fits_into_a_terminal(self):
        for verb in (None, *VERBS):
            for line in self.expect(0, *filter(None, (verb, "--help-all" if verb else "--help"))).stdout.splitlines():
                self.assertLessEqual(len(line), 100, line)

    def test_wrong_usage(self):
        (self.folder / "a.lvx").write_bytes(b"")
        (self.folder / "a.csv").write_text("Time/s,Azimuth/deg,Zenith/deg\n0,1,90\n")
        before = self.names()
        for arguments, named in WRONG:
            with self.subTest(arguments=arguments):
                done = self.expect(2, *arguments)
                self.assertIn(named, done.stderr)
                self.assertEqual(done.stdout, "")
                self.assertEqual(self.names(), before)

    def test_wrong_usage_as_json(self):
        for arguments in (["info"], ["simulate", "-o", "a.csv", "--set", "refractive_index=9"]):
            result = self.expect_json(2, *arguments)
            self.assertEqual(result["exit_status"], 2)
            self.assertTrue(result["error"])

    def test_no_bar_off_a_terminal(self):
        done = self.expect(0, "simulate", "-o", "bar.csv", "--rate-hz", "1000")
        self.assertIsNone(re.search(r"[\r\033]", done.stderr))


if __name__ == "__main__":
    unittest.main()
