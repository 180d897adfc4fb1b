// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What no sensor in its own frame records is said, whatever the format.
#include "risley/recordings/plausibility.hpp"

#include <cmath>
#include <functional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/las_bytes.hpp"

namespace risley::recordings::plausibility_test {

using namespace format_tests;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::size_t kRows = 3000;

/// A point of a scan that fills a cone of 2 x 19 deg, m from the sensor.
std::array<double, 3> point(std::size_t i, double range = 8.0) {
  const double off = radians_from_degrees(19.0 * std::sin(0.0117 * static_cast<double>(i)));
  const double about = 0.37 * static_cast<double>(i);
  return {range * std::cos(off), range * std::sin(off) * std::cos(about),
          range * std::sin(off) * std::sin(about)};
}

/// A text table of points that a function makes of those of the scan.
std::string table(const std::function<std::array<double, 3>(std::array<double, 3>)>& made,
                  const std::string& names = "x,y,z") {
  std::string text = "time_s," + names + "\n";
  for (std::size_t i = 0; i < kRows; ++i) {
    const auto p = made(point(i, 4.0 + 9.0 * static_cast<double>(i % 100) / 100));
    text += fmt::format("{:.6f},{:.4f},{:.4f},{:.4f}\n", 1e-5 * static_cast<double>(i), p[0], p[1],
                        p[2]);
  }
  return text;
}

std::vector<Warning> warnings(const std::string& bytes, std::size_t chunk_rows = 65536) {
  const TestFolder folder;
  put_bytes(folder.file("a"), bytes);
  const auto reader = open_recording(folder.file("a"));
  Chunk chunk;
  std::size_t rows = 0;
  while (reader->read(chunk, chunk_rows)) rows += chunk.observations.size();
  EXPECT_EQ(rows, kRows);
  return reader->warnings();
}

auto scaled(double by) {
  return [by](std::array<double, 3> p) {
    return std::array<double, 3>{by * p[0], by * p[1], by * p[2]};
  };
}

TEST(Plausibility, AScanIsLeftAlone) {
  for (const double range : {1.0, 30.0, 70.0}) {
    EXPECT_THAT(warnings(table(scaled(range))), IsEmpty()) << range;
  }
}

TEST(Plausibility, MapCoordinatesAreNone) {
  // UTM, a national grid, and one with few kilometres.
  for (const auto& [east, north] : {std::pair{447'000.0, 5'538'000.0},
                                    {2'600'000.0, 1'200'000.0},
                                    {12'000.0, 4'000.0},
                                    {1'100.0, 300.0}}) {
    const std::string text = table([east = east, north = north](std::array<double, 3> p) {
      return std::array<double, 3>{east + p[0], north + p[1], 314.0 + p[2]};
    });
    for (const std::size_t chunk_rows : {std::size_t{100}, std::size_t{65536}}) {
      EXPECT_THAT(warnings(text, chunk_rows), ElementsAre(Warns(kWarning.implausible_values)));
    }
  }
}

TEST(Plausibility, RangesBeyondAllReachNameTheirUnit) {
  EXPECT_THAT(warnings(table(scaled(1000.0))),
              ElementsAre(Warns(kWarning.implausible_values, {"millimetres"})));
  EXPECT_THAT(warnings(table(scaled(1000.0), "x_m,y_m,z_m")),
              ElementsAre(Warns(kWarning.implausible_values, {"millimetres"})));
  EXPECT_THAT(warnings(table(scaled(1000.0), "x_mm,y_mm,z_mm")), IsEmpty());
  EXPECT_THAT(warnings(table(scaled(100.0))),
              ElementsAre(Warns(kWarning.implausible_values, {"centimetres"})));
  // A few far ones are no unit; more of them are said.
  std::vector<double> range(kRows, 20.0);
  std::fill_n(range.begin(), kRows / 200, 5000.0);
  EXPECT_FALSE(beyond_reach(range, kFarthestReach, "all"));
  std::fill_n(range.begin(), kRows / 20, 5000.0);
  const auto some = beyond_reach(range, kFarthestReach, "all");
  ASSERT_TRUE(some);
  EXPECT_THAT(*some, ::testing::Not(NamesField("millimetres")));
  EXPECT_FALSE(beyond_reach(std::vector<double>(10, 5000.0), kFarthestReach, "all"));
}

TEST(Plausibility, EveryFormatIsJudged) {
  las_bytes::LasFile las;
  std::string ply = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n",
      kRows);
  std::string pcd = fmt::format(
      "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA ascii\n",
      kRows);
  for (std::size_t i = 0; i < kRows; ++i) {
    const auto p = point(i, 8000.0);
    las.points.emplace_back();
    las.points.back().gps_time = 1e-5 * static_cast<double>(i);
    for (std::size_t k = 0; k < 3; ++k) {
      las.points.back().xyz[k] = static_cast<std::int32_t>(std::lround(1000.0 * p[k]));
    }
    for (std::string* text : {&ply, &pcd}) {
      *text += fmt::format("{:.3f} {:.3f} {:.3f}\n", p[0], p[1], p[2]);
    }
  }
  for (const std::string& bytes : {las.bytes(), ply, pcd}) {
    EXPECT_THAT(warnings(bytes),
                ::testing::Contains(Warns(kWarning.implausible_values, {"millimetres"})))
        << bytes.substr(0, 4);
  }
}

TEST(Plausibility, FewPointsOfAMapAreEnough) {
  las_bytes::LasFile las;
  las.offset = {500'000.0, 5'000'000.0, 0.0};
  for (std::size_t i = 0; i < 40; ++i) {
    las.points.emplace_back();
    las.points.back().gps_time = 1e-5 * static_cast<double>(i);
    las.points.back().xyz = {static_cast<std::int32_t>(37 * i), 41, 1000};
  }
  const TestFolder folder;
  put_bytes(folder.file("a.las"), las.bytes());
  const Recording read = load_recording(folder.file("a.las"));
  ASSERT_FALSE(read.warnings.empty());
  EXPECT_THAT(read.warnings.front(), Warns(kWarning.implausible_values));
}

TEST(Plausibility, DirectionsWithoutRangesAreJudged) {
  const auto directions = [](double per_deg, const char* names) {
    std::string text = fmt::format("time_s,{}\n", names);
    for (std::size_t i = 0; i < kRows; ++i) {
      const auto n = static_cast<double>(i);
      text += fmt::format("{:.6f},{:.7f},{:.7f}\n", 1e-5 * n, per_deg * 19.0 * std::sin(0.37 * n),
                          per_deg * (90.0 + 19.0 * std::sin(0.0117 * n)));
    }
    return text;
  };
  EXPECT_THAT(warnings(directions(1.0, "azimuth_deg,zenith_deg")), IsEmpty());
  EXPECT_THAT(warnings(directions(kRadiansPerDegree, "azimuth_deg,zenith_deg")),
              ElementsAre(Warns(kWarning.implausible_values, {"radians"})));
  EXPECT_THAT(warnings(directions(kRadiansPerDegree, "azimuth_rad,zenith_rad")), IsEmpty());
  EXPECT_THAT(warnings(directions(1e-5, "azimuth_deg,elevation_deg")),
              ElementsAre(Warns(kWarning.implausible_values)));
}

TEST(Plausibility, SpreadOfDirections) {
  std::vector<double> azimuth, zenith;
  for (std::size_t i = 0; i < 1000; ++i) {
    azimuth.push_back(std::remainder(radians_from_degrees(170.0 + 0.02 * static_cast<double>(i)),
                                     kTwoPi));  // over the cut, to 190 deg
    zenith.push_back(radians_from_degrees(85.0 + 0.01 * static_cast<double>(i)));
  }
  const DirectionSpread spread = direction_spread(azimuth, zenith);
  EXPECT_NEAR(degrees_from_radians(spread.azimuth_to - spread.azimuth_from), 19.98, 1e-9);
  EXPECT_NEAR(degrees_from_radians(spread.azimuth_from), 170.0, 1e-9);
  EXPECT_NEAR(degrees_from_radians(spread.zenith_to - spread.zenith_from), 9.9, 0.05);
  EXPECT_NEAR(degrees_from_radians(spread.radius), std::hypot(10.0, 5.0), 0.2);
}

TEST(Plausibility, WholeNumbersWithoutAUnitAreAnAssumption) {
  const auto header_of = [](double scale, const std::string& names) {
    const TestFolder folder;
    std::string text = names + "\n";
    for (std::size_t i = 0; i < 50; ++i) {
      const auto p = point(i);
      text += fmt::format("{:.0f},{:.0f},{:.0f}\n", scale * p[0], scale * p[1], scale * p[2]);
    }
    put_bytes(folder.file("a.csv"), text);
    return load_recording(folder.file("a.csv"));
  };
  for (const double scale : {1000.0, 100.0}) {
    const Recording assumed = header_of(scale, "x,y,z");
    EXPECT_TRUE(assumed.header.length_unit_assumed);
    ASSERT_FALSE(assumed.warnings.empty());
    EXPECT_THAT(assumed.warnings.front(), Warns(kWarning.unit_guessed, {"centimetres"}));
  }
  EXPECT_FALSE(header_of(1000.0, "x_mm,y_mm,z_mm").header.length_unit_assumed);
  EXPECT_FALSE(header_of(100.0, "x_cm,y_cm,z_cm").header.length_unit_assumed);
}

}  // namespace risley::recordings::plausibility_test
