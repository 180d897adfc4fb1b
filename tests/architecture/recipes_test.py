# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""What only strangers' tools read is at least well formed, says the right version, and names what exists."""
import json
import pathlib
import re
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).parents[2]
VERSION = re.search(r"project\(risley VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")).group(1)


def read(name):
    return (ROOT / name).read_text(encoding="utf-8")


class RecipesTest(unittest.TestCase):
    def test_one_version(self):
        self.assertIn(f"\nversion: {VERSION}\n", read("CITATION.cff"))
        self.assertIn(f'  version: "{VERSION}"', read("packaging/conda/meta.yaml"))
        self.assertEqual(json.loads(read("packaging/vcpkg/vcpkg.json"))["version"], VERSION)

    def test_recipes_that_nobody_built_say_so(self):
        for name in ("Dockerfile", "conda/meta.yaml", "vcpkg/portfile.cmake", "vcpkg/vcpkg.json"):
            self.assertIn("UNTRIED", read(f"packaging/{name}"), name)

    def test_options_of_cmake_exist(self):
        known = "".join(read(name) for name in ("CMakeLists.txt", "python/CMakeLists.txt", "cmake/RisleyNpm.cmake"))
        recipes = ("pyproject.toml", "CMakePresets.json", "packaging/conda/meta.yaml", "packaging/vcpkg/portfile.cmake")
        for recipe in recipes:
            for option in re.findall(r"\bRISLEY_[A-Z0-9_]+", read(recipe)):
                if option not in ("RISLEY_COVERED_LAYERS",):
                    self.assertRegex(known, rf"(option|set)\({option}\b", f"{recipe}: {option}")

    def test_conda(self):
        text = read("packaging/conda/meta.yaml")
        self.assertNotIn("\t", text)
        for line in re.sub(r"\{\{.*?\}\}", "text", text).splitlines():
            self.assertRegex(line, r"^( *(#.*|- .+|[\w-]+:( .+)?))?$")
        self.assertEqual([line for line in text.splitlines() if re.match(r"\w", line)],
                         ["package:", "source:", "build:", "requirements:", "test:", "about:"])

    def test_vcpkg(self):
        port = json.loads(read("packaging/vcpkg/vcpkg.json"))
        self.assertEqual(port["name"], "risley")
        # CMake reads the file with the functions of vcpkg standing for nothing.
        functions = re.findall(r"^(vcpkg_\w+)\(", read("packaging/vcpkg/portfile.cmake"), re.MULTILINE)
        with tempfile.TemporaryDirectory() as folder:
            script = pathlib.Path(folder) / "try.cmake"
            script.write_text("".join(f"function({one})\nendfunction()\n" for one in set(functions)) +
                              f'set(CURRENT_PACKAGES_DIR "{folder}")\n'
                              f'include("{ROOT}/packaging/vcpkg/portfile.cmake")\n', encoding="utf-8")
            done = subprocess.run(["cmake", "-P", script], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_dockerfile(self):
        lines = re.sub(r"\\\n", " ", read("packaging/Dockerfile")).splitlines()
        words = [line.split(" ")[0] for line in lines if line and not line.startswith("#")]
        self.assertEqual(words[0], "FROM")
        self.assertLessEqual(set(words), {"FROM", "COPY", "WORKDIR", "ARG", "RUN", "ENTRYPOINT"})
        for command in re.findall(r"^RUN (.*)$", "\n".join(lines), re.MULTILINE):
            subprocess.run(["sh", "-n", "-c", command], check=True)

    def test_pyproject(self):
        try:
            import tomllib
        except ImportError:
            self.skipTest("no tomllib before Python 3.11")
        project = tomllib.loads(read("pyproject.toml"))
        pattern = project["tool"]["scikit-build"]["metadata"]["version"]["regex"]
        self.assertEqual(re.search(pattern, read("CMakeLists.txt"))["value"], VERSION)
        for name in [project["project"]["readme"], *project["project"]["license-files"]]:
            self.assertTrue((ROOT / name).is_file(), name)

    def test_works_of_others_are_named(self):
        text = read("THIRD-PARTY.md")
        for name in ("RisleyPackages", "RisleyDependencies"):
            for package in re.findall(r"^risley_package\([^)]*?DEBIAN ([\w+.-]+)", read(f"cmake/{name}.cmake"), re.MULTILINE):
                if package != "python3-dev":
                    self.assertIn(f"`{package}`", text)
        for name in ("cmake/RisleyCharts.cmake", "tests/browser/playwright.cmake"):
            packages = re.findall(r"risley_npm_package\(\w+ ([\w-]+)", read(name))
            self.assertTrue(packages)
            for package in packages:
                self.assertIn(f"`{package}`", text)


if __name__ == "__main__":
    unittest.main()
