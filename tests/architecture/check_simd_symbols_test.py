# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""tools/check_simd_symbols.py separates harmless symbols from functions that could leak."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "tools"))
import check_simd_symbols  # noqa: E402

SOURCE = """
namespace tags { struct avx2 {}; struct avx512bw {}; struct myavx2ish {}; }
template <class T> __attribute__((noinline)) int tagged(T*) { return sizeof(T); }
inline __attribute__((noinline)) int plain(int x) {
  static int data[] = {1, 2};
  return x * data[x];
}
namespace avx2 { inline __attribute__((noinline)) int own(int x) { return x + 1; } }
static __attribute__((noinline)) int local(int x) { return x - 1; }
tags::avx2 a; tags::avx512bw b; tags::myavx2ish c;
int entry(int x) {
  return tagged(&a) + tagged(&b) + tagged(&c) + plain(x) + avx2::own(x) + local(x);
}
"""


class CheckSimdSymbolsTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def compiled(self, source):
        path = pathlib.Path(self.folder.name) / "kernel.cpp"
        path.write_text(source, encoding="utf-8")
        subprocess.run([os.environ.get("CXX", "c++"), "-c", path, "-o", f"{path}.o"], check=True)
        return f"{path}.o"

    def leaks(self, instruction_set):
        symbols = check_simd_symbols.symbols_of(self.compiled(SOURCE))
        return sorted(name.split("(")[0].removeprefix("int ")
                      for name in check_simd_symbols.leaking_functions(symbols, instruction_set))

    def test_only_untagged_weak_functions_leak(self):
        self.assertEqual(self.leaks("avx2"),
                         ["plain", "tagged<tags::avx512bw>", "tagged<tags::myavx2ish>"])

    def test_a_tag_may_go_on_behind_the_name(self):
        self.assertNotIn("tagged<tags::avx512bw>", self.leaks("avx512"))
        self.assertIn("tagged<tags::avx2>", self.leaks("avx512"))

    def test_the_error_names_object_and_symbol(self):
        errors = check_simd_symbols.check(self.compiled(SOURCE), "avx2")
        self.assertTrue(any("kernel.cpp.o" in error and "plain(int)" in error for error in errors))

    def test_an_object_without_functions_is_an_error(self):
        self.assertEqual(len(check_simd_symbols.check(self.compiled(""), "avx2")), 1)


if __name__ == "__main__":
    unittest.main()
