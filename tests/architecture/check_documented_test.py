# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""tools/check_documented.py finds each kind of name without a comment in a header made for the purpose."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).parents[2]
TOOL = ROOT / "tools/check_documented.py"
sys.path.insert(0, str(ROOT / "tools"))
import check_documented  # noqa: E402

# A line that lacks a comment ends in what is to be said of it.
HEADER = """\
#pragma once
/// A namespace.
namespace risley {
/// A struct.
struct Points {
  Points();
  ~Points();
  explicit Points(int n);
  int x, y;
  int size() const;
  bool empty() const;
  const int* begin() const;
  const int* end() const;
  Points& operator=(const Points&);
  friend bool operator==(const Points&, const Points&);
  static const int kMost = 3;  // variable risley::Points::kMost
  void move();  // function risley::Points::move()
  void turn();  ///< about Z
  enum class Kind { one, two };  // enum risley::Points::Kind
  struct Part { int n; };  // struct risley::Points::Part
 protected:
  void help();  // function risley::Points::help()
  int field_;
 private:
  struct Hidden {};
  void hide();
};
/// A base.
class Base {
 public:
  /// Says something.
  virtual void say() = 0;
};
/// What derives from it.
class Derived : public Base {
 public:
  void say() override;
};
struct Bare {};  // struct risley::Bare
enum class Colour { red };  // enum risley::Colour
using Number = double;  // typedef risley::Number
constexpr int kOne = 1;  // variable risley::kOne
int twice(int n);  // function risley::twice(int n)
/// @throws Error
int thrice(int n);
template <class T>
T half(T n);  // function risley::half(T n)
template <class T>
concept Any = true;  // concept risley::Any
namespace inner { /// A function.
int f(); }
}
int outside();  // function outside()
"""


class CheckDocumentedTest(unittest.TestCase):
    def check(self, header):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "docs/site").mkdir(parents=True)
            shutil.copy(ROOT / "docs/site/Doxyfile.in", root / "docs/site")
            (root / "include/risley/core").mkdir(parents=True)
            (root / "include/risley/core/a.hpp").write_text(header, encoding="utf-8")
            return check_documented.check(root)

    def test_everything_without_a_comment_is_found_with_its_line(self):
        expected = []
        for number, line in enumerate(HEADER.splitlines(), 1):
            _, mark, name = line.partition("  // ")
            if mark:
                expected.append(f"include/risley/core/a.hpp:{number}: {name} is not documented")
        inner = next(n for n, line in enumerate(HEADER.splitlines(), 1) if "inner" in line)
        expected.append(f"include/risley/core/a.hpp:{inner}: namespace risley::inner is not documented")
        self.assertEqual(sorted(self.check(HEADER)[1]), sorted(expected))

    def test_what_is_documented_passes_and_is_counted(self):
        text = "/// N.\nnamespace risley {\n/// F.\nint f();\n/// S.\nstruct S { int x; };\n}\n"
        self.assertEqual(self.check(text), (3, []))

    def test_comments_that_doxygen_does_not_understand_are_found(self):
        for comment, problem in (
            (r"As \u001b.", "unknown command"),
            ("As <N> says.", "<N>"),
            ("@param no_such  thing", "no_such"),
        ):
            with self.subTest(comment=comment):
                text = f"/// N.\nnamespace risley {{\n/// F.\n/// {comment}\nint f(int n);\n}}\n"
                errors = self.check(text)[1]
                self.assertTrue(errors)
                for error in errors:
                    self.assertRegex(error, rf"^include/risley/core/a\.hpp:\d+: warning: .*{problem}")

    def test_a_tree_without_names_is_found(self):
        self.assertEqual(self.check("#pragma once\n"), (0, ["no names found"]))


    def test_without_doxygen_it_says_that_it_was_skipped(self):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, str(TOOL)], env={**os.environ, "PATH": folder},
                                  capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 77)
        self.assertEqual(done.stdout,
                         "SKIPPED: no doxygen: see scripts/install-dependencies --site\n")


if __name__ == "__main__":
    if not shutil.which("doxygen"):
        print("SKIPPED: no doxygen: see scripts/install-dependencies --site")
        sys.exit(77)
    unittest.main()
