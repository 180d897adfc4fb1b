# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The packages that CMake names when one is missing are those that scripts/install-dependencies installs."""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).parents[2]


class PackagesTest(unittest.TestCase):
    def test_cmake_and_the_script_name_the_same_packages(self):
        named = set()
        for file in ("RisleyPackages.cmake", "RisleyDependencies.cmake"):
            text = (ROOT / "cmake" / file).read_text(encoding="utf-8")
            named |= set(re.findall(r"^risley_package\([^)]*?DEBIAN ([\w+.-]+)", text, re.MULTILINE))
        self.assertGreater(len(named), 10)
        script = (ROOT / "scripts/install-dependencies").read_text(encoding="utf-8")
        installed = set(re.findall(r"^  ([\w+.-]+) +#|\+=\(([\w+.-]+)\)", script, re.MULTILINE))
        installed = {name for names in installed for name in names}
        self.assertEqual(sorted(named - installed), [])


if __name__ == "__main__":
    unittest.main()
