// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/change_page.hpp"

#include <cstddef>
#include <string>

#include <gtest/gtest.h>

#include "report/page_reading.hpp"

namespace risley::report::change_page_test {

constexpr std::size_t kCells = 200;
constexpr double kCritical = 2.5;  // sigmas

/// Two clouds whose surface sank in some of the cells, each by a millimetre more than the last.
jobs::ComparedClouds compared(std::size_t changed) {
  jobs::ComparedClouds compared;
  compared.a = "march <1>.las";
  compared.b = "june.las";
  compared.points_a = 1'234'567;
  compared.points_b = 1'300'000;
  cloud::SurfaceChange& change = compared.change;
  change.critical = kCritical;
  change.uneven = 12;
  change.unseen = 3456;
  change.shared = 19;
  change.significant = static_cast<double>(changed) / kCells;
  for (std::size_t i = 0; i < kCells; ++i) {
    const auto number = static_cast<double>(i);
    cloud::SurfaceCell cell;
    cell.place = {691'000 + 0.5 * number, 5'336'000, 0.01 * number};
    cell.sigma = i < kCells / 2 ? 0.001 : 0.002;
    cell.significant = i < changed;
    cell.distance = cell.significant ? -0.003 - 0.001 * number : 0.001;
    cell.points_a = cell.points_b = 40;
    change.cells.push_back(cell);
  }
  return compared;
}

TEST(ChangePage, MatchesItsGoldenText) {
  const auto page = [](const jobs::ComparedClouds& clouds) {
    return change_page(clouds, {{"command", "risley compare \"march <1>.las\" june.las"}});
  };
  testing::GoldenPage golden("change", page(compared(3)));
  golden.differs("nothing changed", page(compared(0)));
  golden.differs("more cells than rows", page(compared(60)));
  jobs::ComparedClouds alone = compared(3);
  alone.options = {.cell = 1, .reach = 0.5, .false_alarm = 0.05};
  alone.change.shared = 0;
  alone.change.warnings = {{kWarning.common_errors_unknown, "june.las states <no> common errors"}};
  golden.differs("warnings and other settings", page(alone));
}

}  // namespace risley::report::change_page_test
