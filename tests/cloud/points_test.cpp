// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/points.hpp"

#include <cstdint>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "risley/recordings/observations.hpp"

#include "refusal.hpp"

namespace risley::cloud::points_test {

/// Number of each column, a different one for each, so that mixed-up columns differ.
template <class Function>
void number_columns(Points& p, const Function& function) {
  int number = 0;
  for_each_point_column(p, [&](const auto&, auto& column) { function(column, number++); });
}

/// The value that a row of a column gets.
template <class T>
T value_at(int column, std::size_t row) {
  return static_cast<T>(37 * column + 3 * static_cast<int>(row));
}

void fill(Points& points) {
  number_columns(points, [](auto& column, int number) {
    using T = typename std::decay_t<decltype(column)>::value_type;
    for (std::size_t i = 0; i < column.size(); ++i) column[i] = value_at<T>(number, i);
  });
}

/// Every column holds these rows of what fill() wrote, or is empty.
void expect_rows(Points& points, const std::vector<std::size_t>& rows, bool all_full) {
  number_columns(points, [&](auto& column, int number) {
    using T = typename std::decay_t<decltype(column)>::value_type;
    if (column.empty() && !all_full) return;
    ASSERT_EQ(column.size(), rows.size()) << number;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_EQ(column[i], value_at<T>(number, rows[i])) << number << ' ' << i;
    }
  });
}

CloudHeader full_header() {
  CloudHeader header;
  header.prisms = 3;
  header.has_own_covariance = header.has_point_source = header.has_row = true;
  header.factors = {"one", "two"};
  return header;
}

TEST(Points, KeepTakesTheSameRowsOfEveryColumn) {
  for (const std::vector<std::size_t>& rows :
       {std::vector<std::size_t>{}, {0}, {9}, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, {1, 2, 5, 9}}) {
    Points points;
    full_header().resize(points, 10);
    fill(points);
    points.keep(rows);
    EXPECT_EQ(points.size(), rows.size());
    expect_rows(points, rows, true);
  }
}

TEST(Points, KeepLeavesColumnsEmptyThatAreNotThere) {
  CloudHeader header;
  header.has_covariance = header.has_rotation_angles = false;
  Points points;
  header.resize(points, 6);
  fill(points);
  const std::vector<std::size_t> rows{2, 3};
  points.keep(rows);
  expect_rows(points, rows, false);
  EXPECT_EQ(points.x.size(), 2u);
  EXPECT_TRUE(points.covariance[kZZ].empty());
  EXPECT_TRUE(points.azimuth_residual.empty());
  EXPECT_TRUE(points.loading.empty());
}

TEST(CloudHeader, ResizeGivesWhatItAnnouncesAndEmptiesTheRest) {
  Points points;
  full_header().resize(points, 7);
  EXPECT_EQ(points.rotation_angle.size(), 3u);
  EXPECT_EQ(points.loading.size(), 2u);
  number_columns(points, [](auto& column, int number) { EXPECT_EQ(column.size(), 7u) << number; });

  CloudHeader bare = full_header();
  bare.has_covariance = bare.has_rotation_angles = false;
  bare.factors.clear();
  bare.resize(points, 4);
  EXPECT_EQ(points.size(), 4u);
  for (const auto* column : {&points.x, &points.y, &points.z, &points.range, &points.incidence}) {
    EXPECT_EQ(column->size(), 4u);
  }
  for (const auto* column : {&points.intensity, &points.return_number, &points.number_of_returns,
                             &points.tag, &points.beam}) {
    EXPECT_EQ(column->size(), 4u);
  }
  for (const auto& column : points.covariance) EXPECT_TRUE(column.empty());
  EXPECT_TRUE(points.rotation_angle.empty());
  EXPECT_TRUE(points.azimuth_residual.empty());
  EXPECT_TRUE(points.zenith_residual.empty());
  EXPECT_TRUE(points.loading.empty());
}

TEST(Observations, DropFrontTakesTheSameRowsOffEveryColumn) {
  recordings::Observations o;
  const auto each = [&o](const auto& function) {
    int number = 0;
    for_each_column<recordings::kObservationColumns>(
        [&](auto& column) { function(column, number++); }, o);
  };
  o.resize(9);
  each([](auto& column, int number) {
    using T = typename std::decay_t<decltype(column)>::value_type;
    for (std::size_t i = 0; i < column.size(); ++i) column[i] = value_at<T>(number, i);
  });
  std::size_t first = 0;
  for (const std::size_t rows : {0u, 2u, 4u, 3u}) {
    o.drop_front(rows);
    first += rows;
    EXPECT_EQ(o.size(), 9 - first);
    each([first](auto& column, int number) {
      using T = typename std::decay_t<decltype(column)>::value_type;
      ASSERT_EQ(column.size(), 9 - first) << number;
      for (std::size_t i = 0; i < column.size(); ++i) {
        EXPECT_EQ(column[i], value_at<T>(number, first + i)) << number;
      }
    });
  }
}

TEST(Points, KeepsOnlyRowsThatAreThereInTheirOrder) {
  Points points;
  CloudHeader{}.resize(points, 4);
  const auto keep = [&](const std::vector<std::size_t>& rows) {
    return refusal([&] {
      points.keep(rows);
      return 0;
    });
  };
  EXPECT_EQ(keep({1, 4}), "row = 4, allowed 0 to 3");
  EXPECT_EQ(keep({2, 1}), "row = 1 after row 2, allowed ascending");
  EXPECT_EQ(points.size(), 4U);
}

}  // namespace risley::cloud::points_test
