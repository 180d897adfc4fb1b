// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/clock.hpp"

#include <gtest/gtest.h>

#include "refusal.hpp"

namespace risley::trajectories::clock_test {

constexpr std::int64_t kSecond = 1'000'000'000;

Trajectory from_to(TimeScale scale, std::int64_t first, std::int64_t last) {
  Trajectory result;
  result.time_scale = scale;
  for (const std::int64_t t : {first, last}) {
    result.time_ns.push_back(t * kSecond);
    result.position.emplace_back(0, 0, 0);
    result.attitude.emplace_back(Eigen::Quaterniond::Identity());
  }
  return result;
}

// 23 November 2026, 12:00:00 UTC: GPS second 1479470418, week 2446, second of week 129618.
constexpr std::int64_t kUtc = 1'795'435'200;

TEST(TrajectoryClock, UtcBecomesEveryScaleAndBack) {
  const auto there = [](const Trajectory& trajectory) {
    return *shift_from_utc_ns(trajectory, kUtc * kSecond) / kSecond + kUtc;
  };
  EXPECT_EQ(there(from_to(TimeScale::utc_unix, kUtc, kUtc + 9)), kUtc);
  EXPECT_EQ(there(from_to(TimeScale::gps, 1'479'470'418, 1'479'470'419)), 1'479'470'418);
  EXPECT_EQ(there(from_to(TimeScale::adjusted_gps, 479'470'418, 479'470'419)), 479'470'418);
  EXPECT_EQ(there(from_to(TimeScale::utc_second_of_day, 43'000, 43'500)), 43'200);
  Trajectory week = from_to(TimeScale::gps_second_of_week, 129'000, 130'000);
  EXPECT_EQ(there(week), 129'618) << "the week that fits";
  EXPECT_FALSE(shift_to_utc_ns(week));
  week.gps_week = 2446;
  EXPECT_EQ(there(week), 129'618);
  ASSERT_TRUE(shift_to_utc_ns(week));
  EXPECT_EQ(*shift_to_utc_ns(week), (kUtc - 129'618) * kSecond);
  EXPECT_EQ(*shift_to_utc_ns(from_to(TimeScale::gps, 1'479'470'418, 1'479'470'419)),
            (kUtc - 1'479'470'418) * kSecond);
  EXPECT_FALSE(shift_from_utc_ns(from_to(TimeScale::unknown, 0, 1), kUtc * kSecond));
  EXPECT_NE(refusal([] { shift_from_utc_ns({}, 0); }).find("records"), std::string::npos);
}

TEST(TrajectoryClock, StampsInUtcTellTheOffsetOfTimesFromPowerOn) {
  constexpr std::int64_t kPowerOn = 10;  // s, when UTC was kUtc
  const Trajectory week = from_to(TimeScale::gps_second_of_week, 129'600, 129'700);
  const auto words = [&](std::optional<std::int64_t> stamps_after) {
    return no_overlap_words(week, kPowerOn * kSecond, (kPowerOn + 5) * kSecond, stamps_after);
  };
  // GPS second of week 129618 is kUtc.
  EXPECT_NE(words((kUtc - kPowerOn) * kSecond).find("129608.000000 s are added"),
            std::string::npos);
  EXPECT_EQ(words((kUtc - 5000) * kSecond).find("stamps"), std::string::npos);
  EXPECT_EQ(words({}).find("stamps"), std::string::npos);
}

TEST(TrajectoryClock, SaysWhyNoTimeIsShared) {
  const Trajectory week = from_to(TimeScale::gps_second_of_week, 129'000, 129'100);
  const auto words = [&](std::int64_t first, std::int64_t last) {
    return no_overlap_words(week, first * kSecond, last * kSecond);
  };
  EXPECT_NE(words(128'990, 128'999).find("18 s are added"), std::string::npos) << words(1, 2);
  EXPECT_NE(words(129'110, 129'115).find("-18 s"), std::string::npos);
  EXPECT_NE(words(129'000 + 604'800, 129'100 + 604'800).find("a week apart"), std::string::npos);
  EXPECT_NE(words(129'000 + 3 * 604'800, 129'100 + 3 * 604'800).find("whole weeks"),
            std::string::npos);
  EXPECT_NE(words(10, 20).find("same flight"), std::string::npos);
  EXPECT_NE(words(10, 20).find("129000.000 s to 129100.000 s (GPS second of week)"),
            std::string::npos);
  EXPECT_NE(words(10, 20).find("10.000 s to 20.000 s"), std::string::npos);
}

}  // namespace risley::trajectories::clock_test
