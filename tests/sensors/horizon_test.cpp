// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The preset "horizon" against the maker's scan sequence, which only the maker may hand out.
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::sensors::horizon_test {

TEST(Horizon, IsThreePrismsAndSixEmitters) {
  const Sensor sensor = load_sensor("horizon");
  EXPECT_EQ(to_string(sensor.train.face_order()), "AP-PA-AP");
  EXPECT_EQ(sensor.train.emitters(), 6);
  EXPECT_EQ(sensor.device_type, 3);
  EXPECT_EQ(sensor.angular_velocity[0], -sensor.angular_velocity[1]);
  EXPECT_NEAR(sensor.get("incident_beam_5_vertical_deg"), std::atan(1.5 * 0.47 / 30.0),
              1e-14);  // as many digits as the file has
  EXPECT_EQ(preset_text(parse_preset(preset_text(sensor), "again")), preset_text(sensor));
}

// Rows of every 40th shot. In the file the six shots of 25 us share one rotor angle, which is that
// of their end; at time 0 the thin edges of all prisms point along Y; and its y is turned.
TEST(Horizon, RepeatsTheMakersSequence) {
  const char* folder = std::getenv("RISLEY_VENDOR_DATA");
  if (folder == nullptr) GTEST_SKIP() << "RISLEY_VENDOR_DATA names no folder";
  const std::string path = std::string(folder) + "/livox-horizon-sequence-every-40th.csv";
  std::ifstream file(path);
  if (!file) GTEST_SKIP() << path << " is not there";
  const Sensor sensor = load_sensor("horizon");
  std::string line;
  std::getline(file, line);
  ASSERT_EQ(line.substr(0, 19), "Time,Azimuth,Zenith");
  double worst = 0, squares = 0;
  int rows = 0;
  while (std::getline(file, line)) {
    const char* text = line.c_str();
    char* end = nullptr;
    const double time = std::strtod(text, &end);
    const double azimuth = radians_from_degrees(std::strtod(end + 1, &end));
    const double zenith = radians_from_degrees(std::strtod(end + 1, &end));
    const long shot = std::lround(time * 240000.0) - 1;
    const double rotor_time = 25e-6 * static_cast<double>(shot / 6 + 1);
    std::vector<double> angles;
    for (const double speed : sensor.angular_velocity) {
      angles.push_back(wrap_to_two_pi(0.5 * kPi + speed * rotor_time));
    }
    const Observation own = observe(sensor.train, angles, static_cast<int>(shot % 6));
    const Vector3<double> expected{std::sin(zenith) * std::cos(azimuth),
                                   -std::sin(zenith) * std::sin(azimuth), std::cos(zenith)};
    const double miss = norm(own.direction - expected);
    worst = std::max(worst, miss);
    squares += miss * miss;
    ++rows;
  }
  EXPECT_GT(rows, 20000);
  EXPECT_LT(degrees_from_radians(std::sqrt(squares / rows)), 1e-7);
  RecordProperty("worst_deg", std::to_string(degrees_from_radians(worst)));
  EXPECT_LT(degrees_from_radians(worst), 1e-6);
}

}  // namespace risley::sensors::horizon_test
