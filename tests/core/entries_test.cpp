// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <limits>

#include <gmock/gmock.h>

#include "risley/core/golden_section.hpp"
#include "risley/core/instruction_set.hpp"

#include "refusal.hpp"

namespace risley::entries_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(Entries, GoldenSectionAsksForAnIntervalAndATolerance) {  // without one it would never end
  const auto run = [](double a, double b, double tolerance) {
    return refusal(
        [&] { golden_section_minimum([](double x) { return x * x; }, a, b, tolerance); });
  };
  EXPECT_EQ(run(-1.0, 1.0, 0.0), "tolerance = 0, allowed above 0");
  EXPECT_EQ(run(-1.0, 1.0, kNan), "tolerance = nan, allowed above 0");
  EXPECT_EQ(run(kNan, 1.0, 0.1), "a = nan, allowed finite");
  EXPECT_EQ(run(-1.0, kInfinite, 0.1), "b = inf, allowed -1 and above");
  EXPECT_EQ(run(1.0, -1.0, 0.1), "b = -1, allowed 1 and above");
  EXPECT_EQ(run(1.0, 1.0, 0.1), "");
}

int one() { return 1; }

TEST(Entries, KernelsAskForAnInstructionSetOfTheProcessor) {
  const auto unknown = static_cast<InstructionSet>(3);  // one that no processor runs
  const auto begins =
      ::testing::StartsWith("instruction set = unknown, this processor and binary allow baseline");
  EXPECT_THAT(refusal([&] { check_available(unknown); }), begins);
  const KernelCopies<int()> kernel{&one, nullptr, nullptr};
  EXPECT_THAT(refusal([&] { kernel.at(unknown); }), begins);
  for (const InstructionSet set : available_instruction_sets()) EXPECT_EQ(kernel.at(set)(), 1);
}

}  // namespace risley::entries_test
