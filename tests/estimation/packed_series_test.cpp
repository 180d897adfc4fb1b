// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/packed_series.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <span>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "refusal.hpp"

namespace risley::estimation::packed_series_test {

constexpr double kStep = std::numbers::pi / 18000.0;  // 0.01 degree
constexpr std::size_t kRows = 3 * PackedSeries::kBlockRows + 100;

float variance_of(double step) { return static_cast<float>(step) * static_cast<float>(step) / 12; }

/// Shots 10 us apart, with angles in whole steps.
AngleSeries even_shots(std::size_t rows = kRows) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> steps(-1900, 1900);
  AngleSeries series;
  for (std::size_t i = 0; i < rows; ++i) {
    series.append(7 + 10'000 * static_cast<std::int64_t>(i), steps(random) * kStep,
                  (9000 + steps(random)) * kStep, 0, variance_of(kStep), variance_of(kStep));
  }
  return series;
}

void expect_same(const AngleSeries& found, const AngleSeries& series, std::size_t begin = 0) {
  const AngleSeries expected = rows_of(series, begin, begin + found.size());
  EXPECT_EQ(found.time_ns, expected.time_ns);
  EXPECT_EQ(found.azimuth, expected.azimuth);
  EXPECT_EQ(found.zenith, expected.zenith);
  EXPECT_EQ(found.beam, expected.beam);
  EXPECT_EQ(found.azimuth_rounding_variance, expected.azimuth_rounding_variance);
  EXPECT_EQ(found.zenith_rounding_variance, expected.zenith_rounding_variance);
  EXPECT_EQ(found.range, expected.range);
}

void expect_kept(const AngleSeries& series) {
  const PackedSeries packed(series);
  ASSERT_EQ(packed.size(), series.size());
  expect_same(packed.rows(), series);
  const std::size_t begin = PackedSeries::kBlockRows - 3, end = series.size() - 5;
  expect_same(packed.rows({begin, end}), series, begin);
  std::vector<std::int64_t> times;
  packed.times({begin, end}, times);
  const AngleSeries part = rows_of(series, begin, end);
  EXPECT_EQ(times, part.time_ns);
  PackedSeries single, all;
  std::vector<std::size_t> rows(series.size());
  std::iota(rows.begin(), rows.end(), 0);
  for (std::size_t i = 0; i < series.size(); ++i) {
    EXPECT_EQ(packed.time_ns(i), series.time_ns[i]);
    EXPECT_EQ(packed.beam(i), series.beam[i]);
    EXPECT_EQ(packed.angles(i), std::pair(series.azimuth[i], series.zenith[i]));
    single.append(packed, std::array{i});
  }
  expect_same(single.rows(), series);
  all.append(packed, std::span(rows).first(10));  // so that its blocks are others
  all.append(packed, std::span(rows).subspan(10));
  expect_same(all.rows(), series);
}

TEST(PackedSeries, KeepsAnglesInWholeSteps) { expect_kept(even_shots()); }

TEST(PackedSeries, KeepsAnglesOfAnyKind) {
  AngleSeries series = even_shots();
  series.azimuth[10] += 1e-9;  // in one block alone
  series.zenith[5000] = -0.0;  // not the same as 0
  series.zenith[5001] = 0.0;
  for (std::size_t i = 9000; i < series.size(); ++i) {
    series.azimuth[i] = std::sin(static_cast<double>(i));
    series.azimuth_rounding_variance[i] = 1e-9F * static_cast<float>(i);
  }
  series.zenith_rounding_variance[4097] = 0.0F;
  expect_kept(series);
  for (float& variance : series.azimuth_rounding_variance) variance = 0.0F;
  expect_kept(series);
  for (float& variance : series.azimuth_rounding_variance) variance = 1e-20F;  // too fine a grid
  expect_kept(series);
}

TEST(PackedSeries, KeepsTimesWithGapsJitterAndResets) {
  AngleSeries series = even_shots();
  const auto later = [&](std::size_t from, std::int64_t by) {
    for (std::size_t i = from; i < series.size(); ++i) series.time_ns[i] += by;
  };
  later(100, 30'000);  // shots without a return
  later(200, 990'000'000);
  later(5000, 1);               // no longer on the grid
  later(5001, 40'000'000'000);  // beyond 32 bits of nanoseconds
  later(9000, -500'000'000'000);
  expect_kept(series);
  later(0, INT64_C(1'700'000'000'000'000'000));
  expect_kept(series);
}

TEST(PackedSeries, KeepsEmittersAndRanges) {
  AngleSeries series = even_shots();
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (i > 5000) series.beam[i] = static_cast<std::uint8_t>(i % 6);
    series.range.push_back(0.01 * static_cast<double>(i));
  }
  expect_kept(series);
  const PackedSeries packed(series);
  EXPECT_TRUE(packed.has_ranges());
  EXPECT_EQ(packed.largest_beam(), 5);
  std::vector<std::size_t> shots(6, 0);
  for (const std::uint8_t beam : series.beam) ++shots[beam];
  EXPECT_EQ(packed.shots_of_beams(), shots);
  EXPECT_EQ(packed.duration(), series.duration());
}

TEST(PackedSeries, GrowsPieceByPiece) {
  const AngleSeries series = even_shots();
  PackedSeries packed;
  EXPECT_EQ(packed.duration(), 0);
  for (std::size_t begin = 0, rows = 1; begin < series.size(); begin += rows, rows *= 3) {
    packed.append(rows_of(series, begin, std::min(begin + rows, series.size())));
  }
  expect_same(packed.rows(), series);
  EXPECT_FALSE(packed.has_ranges());
}

TEST(PackedSeries, PicksRowsInAnyOrder) {
  const AngleSeries series = even_shots();
  const std::vector<std::size_t> rows{5, 3, kRows - 1, 5000, 5001, 4095, 4096, 5};
  PackedSeries picked;
  picked.append(PackedSeries(series), rows);
  AngleSeries expected;
  for (const std::size_t row : rows) expected.append(series, row);
  expect_same(picked.rows(), expected);
}

TEST(PackedSeries, FindsTheFirstRowAtATime) {
  const PackedSeries packed(even_shots());
  const std::int64_t time = packed.time_ns(5000);
  EXPECT_EQ(packed.first_at({0, kRows}, time), 5000);
  EXPECT_EQ(packed.first_at({0, kRows}, time - 1), 5000);
  EXPECT_EQ(packed.first_at({0, kRows}, time + 1), 5001);
  EXPECT_EQ(packed.first_at({5002, kRows}, time), 5002);
  EXPECT_EQ(packed.first_at({0, 4000}, time), 4000);
  EXPECT_EQ(packed.first_at({7, 7}, time), 7);
}

TEST(PackedSeries, IsThinnedByTicksAndBeams) {
  AngleSeries series = even_shots();
  for (std::size_t i = 0; i < series.size(); ++i) series.beam[i] = static_cast<std::uint8_t>(i % 6);
  for (std::size_t i = 9000; i < series.size(); ++i) series.time_ns[i] += 77'000;  // shots are lost
  std::vector<ShotRange> ranges{{3, 9000}, {9000, 9000}, {9001, kRows}};
  const std::vector<ShotRange> whole = ranges;
  const PackedSeries found = thinned(series, 7000.0, ranges);
  AngleSeries expected;
  TickSampler ticks(7000.0);
  for (std::size_t k = 0; k < whole.size(); ++k) {
    EXPECT_EQ(ranges[k].begin, expected.size());
    if (whole[k].size() > 0) ticks.restart(series.time_ns[whole[k].begin]);
    for (std::size_t i = whole[k].begin; i < whole[k].end; ++i) {
      if (ticks.take(series.time_ns[i], series.beam[i])) expected.append(series, i);
    }
    EXPECT_EQ(ranges[k].end, expected.size());
  }
  EXPECT_GT(expected.size(), 800);
  expect_same(found.rows(), expected);
}

TEST(PackedSeries, ChangesRows) {
  AngleSeries series = even_shots();
  PackedSeries packed(series);
  packed.change([](AngleSeries& rows) { mirror(rows, false); });
  mirror(series, false);
  expect_same(packed.rows(), series);
}

TEST(PackedSeries, RefusesColumnsOfOtherLengthsAndRowsThatAreNotThere) {
  AngleSeries series = even_shots(4);
  const PackedSeries packed(series);
  EXPECT_EQ(refusal([&] { return packed.rows({2, 5}); }), "rows = [2, 5), allowed within [0, 4)");
  series.range = {1, 2, 3, 4};
  PackedSeries other(series);
  EXPECT_EQ(refusal([&] { other.append(even_shots(4)); }), "range has 0 values, expected 4");
  EXPECT_EQ(refusal([&] { other.append(packed, std::array<std::size_t, 1>{0}); }),
            "range has 0 values, expected 1");
  EXPECT_EQ(refusal([&] { PackedSeries().append(packed, std::array<std::size_t, 1>{4}); }),
            "row = 4, allowed 0 to 3");
  EXPECT_EQ(refusal([&] {
              return packed.first_at({2, 5}, 0);
            }),
            "range = [2, 5), allowed within [0, 4)");
  series.zenith.pop_back();
  EXPECT_EQ(refusal([&] { PackedSeries{series}; }), "zenith has 3 values, expected 4");
}

}  // namespace risley::estimation::packed_series_test
