// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Recordings whose times have six decimals: parameters are as good as their covariance says.
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "statistics/simulated.hpp"

namespace risley::rounded_times_test {

/// NEES per parameter of an estimate from times in whole microseconds.
double nees(const char* sensor, std::uint64_t seed) {
  simulation::SimulationSettings settings;
  settings.truth = sensors::load_sensor(sensor);
  settings.duration = 0.3;
  settings.seed = seed;
  testing::Simulated simulated = testing::simulate(settings);
  recordings::Recording rounded;
  rounded.header.devices.resize(1);
  rounded.header.has_range = false;
  rounded.data.observations = simulated.observations;
  for (std::int64_t& time : rounded.data.observations.time_ns) {
    time = std::llround(1e-3 * static_cast<double>(time)) * 1000;
  }
  const recordings::Recording read = recordings::load_recording(
      {std::make_shared<const recordings::Recording>(std::move(rounded)), "in memory"});
  // The truth of a shot, at the time that was found for it: all times may be shifted by the same.
  simulated.truth.time_ns = read.data.observations.time_ns;
  const auto estimate =
      testing::estimate(estimation::Method::map, read.data.observations,
                        degrees_from_radians(settings.truth.angle_noise), {}, sensor);
  return estimation::evaluate(estimate, settings.truth, simulated.truth).nees_parameters;
}

TEST(RoundedTimes, ToMicrosecondsLeaveAnHonestAvia) {
  double mean = 0;
  for (const std::uint64_t seed : {1, 2, 3}) mean += nees("avia", seed) / 3;
  EXPECT_GT(mean, 0.5);
  EXPECT_LT(mean, 1.6);
}

TEST(RoundedTimes, ToMicrosecondsLeaveAnHonestHorizon) {
  double mean = 0;
  for (const std::uint64_t seed : {1, 2, 3}) mean += nees("horizon", seed) / 3;
  EXPECT_GT(mean, 0.5);
  EXPECT_LT(mean, 1.6);
}

}  // namespace risley::rounded_times_test
