// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/optics_watch.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

#include "jobs/emulated_scan.hpp"

namespace risley::jobs {
namespace {

constexpr std::uint8_t kSpherical = 1;  // of the Mid-40

SimulationOptions mid_40() {
  SimulationOptions options;
  options.rotor = simulation::RotorKind::hunting;
  options.threads = 1;
  return options;
}

/// The first packets of a virtual sensor.
std::vector<std::vector<std::uint8_t>> first_packets(std::uint64_t count) {
  EmulatedScan scan(mid_40(), "");
  std::vector<std::vector<std::uint8_t>> packets;
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto bytes = scan.next(kSpherical, scan.time_of(i, kSpherical));
    packets.emplace_back(bytes.begin(), bytes.end());
  }
  return packets;
}

TEST(OpticsWatch, ABendInPacketsIsToldOf) {
  EmulatedScan scan(mid_40(), "", {{"prism_tilt_b_vertical_deg", radians_from_degrees(0.02)}});
  OpticsWatch watch({{"BENDING00000001", recordings::kMid40}}, "");
  constexpr std::uint64_t kPackets = 9000, kBend = 6000;  // of 1 ms
  for (std::uint64_t i = 0; i < kPackets; ++i) {
    if (i == kBend) scan.bend();
    watch.add(0, scan.next(kSpherical, scan.time_of(i, kSpherical)));
    if (i % 1000 == 999) watch.finish(60);
  }
  const OpticsHealth health = watch.health().front();
  EXPECT_EQ(health.reference, "mid-40");
  EXPECT_FALSE(health.is_reference);
  EXPECT_EQ(health.words, "");
  EXPECT_EQ(health.packets, kPackets);
  EXPECT_EQ(health.dropped_packets, 0U);
  ASSERT_TRUE(health.state.alarm);
  EXPECT_GT(health.state.alarm->time_ns, scan.time_of(kBend, kSpherical));
  EXPECT_EQ(health.state.alarm->parameter, "prism_tilt_b_vertical_deg");
}

/// What it is too slow for is dropped and counted, and whoever brings it does not wait.
TEST(OpticsWatch, TooManyPacketsAreDroppedAndCounted) {
  constexpr std::uint64_t kPackets = 30'000;
  const auto packets = first_packets(kPackets);
  OpticsWatch watch({{"QUICK0000000001", recordings::kMid40}}, "");
  for (const auto& packet : packets) watch.add(0, packet);
  EXPECT_GT(watch.health().front().dropped_packets, 0U);
  watch.finish(60);
  const OpticsHealth health = watch.health().front();
  EXPECT_EQ(health.packets + health.dropped_packets, kPackets);
  EXPECT_FALSE(health.state.alarm);
}

/// At the end of a recording on a slow machine: what was not looked at is no proof of anything.
TEST(OpticsWatch, PacketsThatStillWaitAtTheEndAreCounted) {
  constexpr std::uint64_t kPackets = OpticsWatch::kMostWaiting;
  const auto packets = first_packets(kPackets);
  OpticsWatch watch({{"ENDING000000001", recordings::kMid40}}, "");
  for (const auto& packet : packets) watch.add(0, packet);
  watch.finish(0);
  EXPECT_GT(watch.health().front().dropped_packets, 0U);
  watch.finish(60);  // for the packet in hand
  const OpticsHealth health = watch.health().front();
  EXPECT_EQ(health.packets + health.dropped_packets, kPackets);
}

TEST(OpticsWatch, SensorsWithoutAPresetAreNotWatched) {
  OpticsWatch watch({{"UNKNOWN00000001", recordings::kUnknownDeviceType}}, "");
  watch.add(0, std::vector<std::uint8_t>(100));
  watch.finish(1);
  EXPECT_NE(watch.health().front().words, "");
  EXPECT_EQ(watch.health().front().packets, 0U);
}

TEST(OpticsWatch, AReferenceOfAnotherTypeIsRefused) {
  EXPECT_THROW(OpticsWatch({{"MID400000000001", recordings::kMid40}}, "avia"), InvalidArgument);
  OpticsWatch watch({{"MID400000000001", recordings::kMid40}}, "mid-40-table3");
  EXPECT_TRUE(watch.health().front().is_reference);
}

}  // namespace
}  // namespace risley::jobs
