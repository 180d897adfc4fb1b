# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""tools/check_layers.py finds each kind of wrong include in a tree made for the purpose."""
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "tools"))
import check_layers  # noqa: E402

LAYERS = """risley_add_layer(core)
risley_add_layer(io LAYERS core)
risley_add_layer(hashes LAYERS core)
risley_add_layer(tables LAYERS core io)
risley_add_layer(simulation LAYERS core)
risley_add_layer(estimation   LAYERS core)
risley_add_layer(report LAYERS core estimation)
risley_layer_needs(core PUBLIC fmt BUILD random123)
"""


class CheckLayersTest(unittest.TestCase):
    def errors(self, files, layers=LAYERS):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in {"CMakeLists.txt": layers, **files}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            return check_layers.check(root)

    def test_includes_of_declared_layers_pass(self):
        self.assertEqual(self.errors({
            "include/risley/core/angle.hpp": "#include <cmath>\n",
            "include/risley/estimation/ekf.hpp": '#include "risley/core/angle.hpp"\n',
            "include/risley/report/text.hpp": "#include <fmt/format.h>\n",
            "src/tables/netcdf.cpp": "#include <netcdf.h>\n#include <fmt/format.h>\n",
            "src/report/html.cpp": '#include "risley/estimation/ekf.hpp"\n#include "report/page.hpp"\n',
            "apps/risley/main.cpp": '#include <tbb/global_control.h>\n#include "risley/simulation/a.hpp"\n#include "verb.hpp"\n',
        }), [])

    def test_every_wrong_include_is_found_with_its_line(self):
        for name, include, expected in (
            ("src/estimation/ekf.cpp", '#include "risley/simulation/noise.hpp"',
             "src/estimation/ekf.cpp:2: may not include the layer simulation"),
            ("include/risley/simulation/noise.hpp", "#include <risley/estimation/ekf.hpp>",
             "include/risley/simulation/noise.hpp:2: may not include the layer estimation"),
            ("src/core/angle.cpp", '  #  include "report/page.hpp"',
             "src/core/angle.cpp:2: may not include the layer report"),
            ("src/core/angle.cpp", '#include "../report/page.hpp"',
             "src/core/angle.cpp:2: \"../report/page.hpp\" hides its layer"),
            ("apps/risley/main.cpp", '#include "risley/clouds/cloud.hpp"',
             "apps/risley/main.cpp:2: risley/clouds/cloud.hpp is in no declared layer"),
            ("src/report/states.cpp", "#include <netcdf.h>",
             "src/report/states.cpp:2: only the layer tables may include netcdf.h"),
            ("src/report/states.cpp", "#include <tbb/parallel_for.h>",
             "src/report/states.cpp:2: only the layer parallel may include tbb/parallel_for.h"),
            ("apps/risley/main.cpp", "#include <yaml-cpp/yaml.h>",
             "apps/risley/main.cpp:2: only the layer io may include yaml-cpp/yaml.h"),
            ("include/risley/core/hash.hpp", "#include <openssl/evp.h>",
             "include/risley/core/hash.hpp:2: only the layer hashes may include openssl/evp.h"),
            ("include/risley/core/lanes.hpp", "#include <xsimd/xsimd.hpp>",
             "include/risley/core/lanes.hpp:2: the layer core does not hand on xsimd/xsimd.hpp"),
            ("include/risley/tables/netcdf.hpp", "#include <netcdf.h>",
             "include/risley/tables/netcdf.hpp:2: the layer tables does not hand on netcdf.h"),
        ):
            with self.subTest(include=include):
                errors = self.errors({name: f"// first line\n{include}\n"})
                self.assertEqual(len(errors), 1, errors)
                self.assertTrue(errors[0].startswith(expected), errors[0])

    def test_a_private_header_belongs_to_its_layer(self):
        self.assertEqual(self.errors({
            "src/estimation/ekf.cpp": '#include "estimation/knots.hpp"\n',
            "include/risley/estimation/ekf.hpp": '#include "estimation/knots.hpp"\n',
            "src/report/html.cpp": '#include "estimation/knots.hpp"\n',
            "apps/risley/main.cpp": '#include "report/chart.hpp"\n',
            "studies/paper/run.cpp": '#include "report/chart.hpp"\n',
            "bench/steps_bench.cpp": '#include "estimation/knots.hpp"\n',
        }), [
            "include/risley/estimation/ekf.hpp:1: estimation/knots.hpp is a private header of the layer"
            " estimation",
            "src/report/html.cpp:1: estimation/knots.hpp is a private header of the layer estimation",
            "apps/risley/main.cpp:1: report/chart.hpp is a private header of the layer report",
            "studies/paper/run.cpp:1: report/chart.hpp is a private header of the layer report",
        ])

    def test_libraries_know_no_option_of_the_command(self):
        self.assertEqual(self.errors({
            "src/core/a.cpp": 'throw Error("say \\"which\\" with --sensor");\n'
                              '// "--sensor" in a comment\n'
                              'f("x"); // "--sensor"\n'
                              'int i = 3; --i; puts("a -- b, ---");\n'
                              'link("https://a.b/c--d", "<code>--shot-rate-hz</code>");\n',
            "include/risley/report/b.hpp": 'f("--fix", "--free");\n',
            "apps/risley/main.cpp": 'verb.add_option("--sensor");\n',
        }), [
            'include/risley/report/b.hpp:1: a library knows no --fix, say "option NAME"',
            'include/risley/report/b.hpp:1: a library knows no --free, say "option NAME"',
            'src/core/a.cpp:1: a library knows no --sensor, say "option NAME"',
            'src/core/a.cpp:5: a library knows no --shot-rate-hz, say "option NAME"',
        ])

    def test_bindings_may_use_all_layers_and_nothing_may_use_them(self):
        self.assertEqual(self.errors({
            "src/python/optics.cpp": '#include <pybind11/pybind11.h>\n#include "python/arrays.hpp"\n'
                                     '#include "risley/core/angle.hpp"\n'
                                     '#include "estimation/knots.hpp"\n',
            "src/core/a.cpp": '#include <pybind11/pybind11.h>\n#include "python/arrays.hpp"\n',
        }), [
            "src/core/a.cpp:1: only the layer python may include pybind11/pybind11.h",
            "src/core/a.cpp:2: nothing may include the bindings (python/arrays.hpp)",
            "src/python/optics.cpp:4: estimation/knots.hpp is a private header of the layer estimation",
        ])

    def test_an_undeclared_folder_is_found(self):
        self.assertEqual(self.errors({"src/clouds/cloud.cpp": ""}),
                         ["src/clouds: the folder is no declared layer"])

    def test_a_layer_may_declare_only_what_stands_above_it(self):
        errors = self.errors({}, "risley_add_layer(core LAYERS optics)\nrisley_add_layer(optics)\n")
        self.assertEqual(
            errors, ["CMakeLists.txt: core declares optics, which does not stand above it"])

    def test_simulation_and_estimation_stay_strangers_through_others(self):
        errors = self.errors({}, "risley_add_layer(simulation)\n"
                                 "risley_add_layer(scenes LAYERS simulation)\n"
                                 "risley_add_layer(estimation LAYERS scenes)\n")
        self.assertEqual(errors, [
            "CMakeLists.txt: estimation reaches simulation; the two must stay strangers"])


if __name__ == "__main__":
    unittest.main()
