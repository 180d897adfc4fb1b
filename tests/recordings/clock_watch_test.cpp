// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/clock_watch.hpp"

#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace risley::recordings::livox::clock_watch_test {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::int64_t kMs = 1'000'000;

/// Packets every millisecond with delays of a network; a clock that is faster by so many ppm.
void run(ClockWatch& watch, std::int64_t from_ms, std::int64_t to_ms, double ppm, unsigned seed,
         std::int64_t offset_ns = 0) {
  std::mt19937 random(seed);
  std::exponential_distribution<double> delay(1 / 200e3);  // ns
  for (std::int64_t i = from_ms; i < to_ms; ++i) {
    const auto host = static_cast<double>(i * kMs) / (1 + 1e-6 * ppm);
    watch.add(0, 0, i * kMs + offset_ns, static_cast<std::int64_t>(host + 50e3 + delay(random)));
  }
}

// The sigma is honest: over many recordings the errors are as large as it says.
TEST(ClockWatch, DriftAndItsSigma) {
  double sum = 0;
  constexpr int kRuns = 100;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    ClockWatch watch;
    run(watch, 0, 20'000, 12.5, seed);
    const auto stretches = watch.stretches();
    ASSERT_EQ(stretches.size(), 1U);
    ASSERT_TRUE(stretches[0].drift);
    EXPECT_NEAR(stretches[0].drift->ppm, 12.5, 0.05);
    EXPECT_LT(stretches[0].drift->sigma_ppm, 0.05);
    sum += std::pow((stretches[0].drift->ppm - 12.5) / stretches[0].drift->sigma_ppm, 2);
  }
  // 5 sigma of a chi-squared mean, a little wider for 18 degrees of freedom.
  EXPECT_NEAR(sum / kRuns, 1.125, 0.9);
}

TEST(ClockWatch, JumpsAndSourcesDivide) {
  ClockWatch watch;
  run(watch, 0, 2000, 0, 1);
  EXPECT_FALSE(watch.stretches()[0].drift);  // too short
  watch.jump();
  run(watch, 2000, 12'000, 0, 2, 300 * kMs);
  for (std::int64_t i = 12'000; i < 13'000; ++i) watch.add(4, 0x200, i * kMs, i * kMs);
  const auto stretches = watch.stretches();
  ASSERT_EQ(stretches.size(), 3U);
  EXPECT_NEAR(static_cast<double>(stretches[0].greatest_offset_ns), -50e3, 10e3);
  EXPECT_NEAR(static_cast<double>(stretches[1].least_offset_ns), 299.95e6, 20e3);
  EXPECT_TRUE(stretches[1].drift);
  EXPECT_EQ(stretches[2].timestamp_type, 4);
  EXPECT_EQ(stretches[2].least_offset_ns, 0);
  EXPECT_EQ(stretches[2].host_to_ns, 12'999 * kMs);
  ASSERT_EQ(watch.status_changes().size(), 2U);
  EXPECT_EQ(watch.status_changes()[1].status, 0x200U);
  EXPECT_EQ(watch.status_changes()[1].host_ns, 12'000 * kMs);
}

TEST(ClockWatch, KeepsNoMoreThanItSays) {
  ClockWatch watch;
  for (std::uint32_t i = 0; i < 5000; ++i) {
    watch.jump();
    watch.add(0, i, i * kMs, i * kMs);
  }
  EXPECT_EQ(watch.stretches().size(), ClockWatch::kMostStretches);
  EXPECT_EQ(watch.status_changes().size(), ClockWatch::kMostChanges);
  EXPECT_EQ(watch.stretches().back().host_from_ns, 99 * kMs);
}

TEST(ClockWatch, StatusInWords) {
  EXPECT_THAT(status_words(0), IsEmpty());
  EXPECT_THAT(status_words(0x8200), ElementsAre("PPS signal", "synchronised by GPS"));
  EXPECT_THAT(
      status_words(0xC0000000U | 1U | 1U << 2U | 2U << 4U | 1U << 6U | 4U << 14U),
      ElementsAre("temperature: high or low", "voltage: high", "motor: error",
                  "window: dirty or blocked", "synchronisation: abnormal", "unknown value"));
  EXPECT_THAT(status_words(7U << 14U | 1U << 8U | 1U << 13U),
              ElementsAre("firmware: error", "PTP signal", "unknown value"));
}

}  // namespace risley::recordings::livox::clock_watch_test
