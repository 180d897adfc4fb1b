// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_recordings.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/sensors/preset.hpp"

#include "refusal.hpp"

namespace risley::calibration::flight_recordings_test {

constexpr std::int64_t kSecond = 1'000'000'000;

/// One shot a second, whose range counts them.
RangedRecording recording(const std::string& name, int begin_s, int shots) {
  RangedRecording result;
  result.name = name;
  result.serial = "unit";
  result.believed = sensors::load_sensor("mid-40");
  result.believed.set("refractive_index", 1.5123);
  result.believed.set_knowledge({"refractive_index", 2e-6, "its own estimate", 0});
  result.shots.resize(2, shots);
  result.angle_sensitivity = Eigen::MatrixXd::Zero(2, 0);
  for (int i = 0; i < shots; ++i) {
    result.time_ns.push_back((begin_s + i) * kSecond);
    result.shots.range[i] = begin_s + i;
    result.shots.rotation_angle[0][i] = 3.1;
    result.shots.rotation_angle[1][i] = -0.01 * i;
    result.shots.angle_covariance[0][i] = 4e-6F;
    result.shots.angle_covariance[2][i] = 2e-6F;
  }
  return result;
}

std::vector<trajectories::FlownStrip> two_strips() {
  return {{105 * kSecond, 109 * kSecond, 0, 0}, {118 * kSecond, 122 * kSecond, 0, 0}};
}

TEST(FlightRecordings, AreTheShotsOfTheStripsInTheOrderOfTime) {
  const sensors::Sensor nominal = sensors::load_sensor("mid-40");
  // The later one first; the trajectory's clock is 100 s ahead.
  const FlightRecordings flight = flight_recordings({recording("b", 12, 15), recording("a", 0, 12)},
                                                    nominal, two_strips(), 100 * kSecond);
  ASSERT_EQ(flight.shots.size(), 10U);
  EXPECT_EQ(flight.shots.range, (std::vector<double>{5, 6, 7, 8, 9, 18, 19, 20, 21, 22}));
  EXPECT_EQ(flight.shots.strip, (std::vector<std::uint16_t>{0, 0, 0, 0, 0, 1, 1, 1, 1, 1}));
  EXPECT_EQ(flight.shots.time_ns.front(), 105 * kSecond);
  EXPECT_EQ(flight.outside_strips, 17U);
  EXPECT_EQ(flight.strip_rows, (std::vector<std::size_t>{5, 5}));
  EXPECT_NEAR(flight.rotation_angle_sigma, std::sqrt(3e-6), 1e-9);
  EXPECT_DOUBLE_EQ(flight.shots.rotation_angle[1][0], -0.05);
  require_flight_shots(flight.shots);
  // What the sensor states counts, unless something better is known.
  EXPECT_EQ(flight.sensor.get("refractive_index"), 1.5123);
  EXPECT_EQ(flight.sensor.find_knowledge("refractive_index")->sigma, 2e-6);
  sensors::Sensor calibrated = nominal;
  calibrated.set("prism_tilt_b_vertical_deg", 0.01);
  calibrated.covariance_names = {"prism_tilt_b_vertical_deg"};
  calibrated.covariance = Eigen::MatrixXd::Constant(1, 1, 1e-8);
  const FlightRecordings again =
      flight_recordings({recording("a", 0, 12)}, calibrated, two_strips(), 100 * kSecond);
  EXPECT_EQ(again.sensor.get("prism_tilt_b_vertical_deg"), 0.01);
  EXPECT_EQ(again.sensor.get("refractive_index"), nominal.get("refractive_index"));
  EXPECT_EQ(again.believed.get("refractive_index"), 1.5123);
}

TEST(FlightRecordings, RefuseWhatOneFlightCannotBe) {
  const sensors::Sensor nominal = sensors::load_sensor("mid-40");
  const auto refused = [&](const std::vector<RangedRecording>& recordings,
                           const std::vector<trajectories::FlownStrip>& strips = two_strips(),
                           const std::string& sensor = "mid-40") {
    return refusal([&] {
      flight_recordings(recordings, sensors::load_sensor(sensor), strips, 100 * kSecond);
    });
  };
  EXPECT_EQ(refused({recording("a", 0, 12)}), "");
  EXPECT_NE(refused({}), "");
  EXPECT_NE(refused({recording("a", 0, 12)}, {}), "");
  EXPECT_NE(refused({recording("a", 0, 12)}, two_strips(), "horizon"), "");
  EXPECT_NE(refused({recording("a", 0, 0)}), "");
  EXPECT_NE(refused({recording("a", 0, 12), recording("b", 8, 12)}).find("the same sensor cannot"),
            std::string::npos);
  RangedRecording other = recording("b", 12, 12);
  other.serial = "another unit";
  EXPECT_NE(refused({recording("a", 0, 12), other}).find("different sensors"), std::string::npos);
  RangedRecording short_column = recording("a", 0, 12);
  short_column.time_ns.pop_back();
  EXPECT_NE(refused({short_column}), "");
  EXPECT_THROW(flight_recordings({recording("a", 500, 12)}, nominal, two_strips(), 100 * kSecond),
               EstimationError);
}

}  // namespace risley::calibration::flight_recordings_test
