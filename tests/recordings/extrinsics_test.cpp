// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/extrinsics.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/writer.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/formats/cartesian.hpp"
#include "recordings/lvx_bytes.hpp"

namespace risley::recordings::extrinsics_test {

using format_tests::TestFolder;
using ::testing::HasSubstr;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// p_recorded of a p_sensor, one turn after the other as the definition has them.
Vector3<double> recorded_point(const Extrinsics& pose, Vector3<double> p) {
  const auto turned = [](double angle, double& first, double& second) {
    const double a = first, b = second;
    first = std::cos(angle) * a - std::sin(angle) * b;
    second = std::sin(angle) * a + std::cos(angle) * b;
  };
  turned(pose.roll, p.y, p.z);
  turned(pose.pitch, p.z, p.x);
  turned(pose.yaw, p.x, p.y);
  return p + pose.translation;
}

Extrinsics pose_deg(double yaw, double pitch, double roll, Vector3<double> translation = {}) {
  return {radians_from_degrees(yaw), radians_from_degrees(pitch), radians_from_degrees(roll),
          translation};
}

/// Angles all around and both poles' neighbourhoods: every yaw with every pitch.
std::vector<Extrinsics> many_poses() {
  constexpr std::array kRolls{-90.0, 0.0, 17.0, 180.0, 0.0};
  std::vector<Extrinsics> poses;
  for (const double yaw : {-180.0, -90.0, -0.3, 0.0, 41.0, 180.0, 300.0}) {
    for (const double pitch : {-90.0, -35.0, 0.0, 2.0, 90.0, 179.0}) {
      const double roll = kRolls[poses.size() % kRolls.size()];
      poses.push_back(pose_deg(yaw, pitch, roll, {0.4, -1.2, 0.05 * yaw}));
    }
  }
  return poses;
}

/// Shots in the cone of a Mid-40; every seventh has no return, every fourteenth no direction.
Observations sensor_rows(std::size_t count, bool with_ranges) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform;
  Observations rows;
  rows.resize(count);
  for (std::size_t row = 0; row < count; ++row) {
    rows.time_ns[row] = static_cast<std::int64_t>(row) * 10'000;
    const double off = radians_from_degrees(19.2) * uniform(random);
    const double around = kTwoPi * uniform(random);
    const auto angles = angles_from_direction(Vector3<double>{
        std::cos(off), std::sin(off) * std::cos(around), std::sin(off) * std::sin(around)});
    set_spherical(rows, row, angles.azimuth, angles.zenith,
                  row % 7 == 0 ? 0.0 : 2.0 + 50.0 * uniform(random));
    if (row % 14 == 0) rows.azimuth[row] = rows.zenith[row] = kNaN;
    if (!with_ranges) {
      rows.range[row] = kNaN;
      rows.valid[row] = std::isnan(rows.azimuth[row]) ? 0 : 1;
    }
    rows.intensity[row] = static_cast<std::uint8_t>(row);
    rows.return_number[row] = 1;
  }
  return rows;
}

/// The same rows as a hub would give them: nulls without a direction stay as they are.
Observations moved_rows(const Observations& rows, const Extrinsics& pose) {
  Observations moved = rows;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (std::isnan(rows.azimuth[row])) continue;
    const auto beam = direction_from_angles<double>({rows.azimuth[row], rows.zenith[row]});
    Extrinsics used = pose;
    const bool has_point = rows.range[row] > 0.0;
    if (!has_point) used.translation = {};
    const auto point = recorded_point(used, (has_point ? rows.range[row] : 1.0) * beam);
    const auto angles = angles_from_direction(point);
    moved.azimuth[row] = angles.azimuth;
    moved.zenith[row] = angles.zenith;
    if (has_point) moved.range[row] = norm(point);
  }
  return moved;
}

RecordingHeader header_of(bool has_range) {
  RecordingHeader header;
  header.devices.resize(1);
  header.devices.front().extrinsic_enabled = true;
  header.devices.front().roll_pitch_yaw_deg = {1.0F, 2.0F, 3.0F};
  header.devices.front().translation_m = {0.1F, 0.2F, 0.3F};
  header.has_range = has_range;
  return header;
}

std::string saved(const TestFolder& folder, const Observations& rows, bool has_range = true) {
  std::string path = folder.file("moved.nc");
  const auto writer = create_recording(path, header_of(has_range));
  Chunk chunk;
  chunk.observations = rows;
  writer->write(chunk);
  writer->close();
  return path;
}

void expect_same_shots(const Observations& found, const Observations& expected) {
  ASSERT_EQ(found.size(), expected.size());
  EXPECT_EQ(found.time_ns, expected.time_ns);
  EXPECT_EQ(found.valid, expected.valid);
  EXPECT_EQ(found.intensity, expected.intensity);
  for (std::size_t row = 0; row < expected.size(); ++row) {
    SCOPED_TRACE(row);
    if (std::isnan(expected.azimuth[row])) {
      EXPECT_TRUE(std::isnan(found.azimuth[row]) && std::isnan(found.zenith[row]));
    } else {
      EXPECT_NEAR(found.azimuth[row], expected.azimuth[row], 1e-12);
      EXPECT_NEAR(found.zenith[row], expected.zenith[row], 1e-12);
    }
    if (std::isnan(expected.range[row])) {
      EXPECT_TRUE(std::isnan(found.range[row]));
    } else {
      EXPECT_NEAR(found.range[row], expected.range[row], 1e-11);
    }
  }
}

TEST(Extrinsics, PointsComeBackFromAnyPose) {
  const TestFolder folder;
  const Observations rows = sensor_rows(100, true);
  for (const Extrinsics& pose : many_poses()) {
    SCOPED_TRACE(fmt::format("yaw {} pitch {} roll {}", pose.yaw, pose.pitch, pose.roll));
    const std::string path = saved(folder, moved_rows(rows, pose));
    const Recording back = load_recording(path, {}, {.extrinsics = pose});
    expect_same_shots(back.data.observations, rows);
    EXPECT_TRUE(back.warnings.empty());
    EXPECT_FALSE(back.header.devices.front().extrinsic_enabled);
    EXPECT_FALSE(stored_extrinsics(back.header.devices.front()));
  }
}

TEST(Extrinsics, DirectionsAloneAreTurnedAndNotMoved) {
  const TestFolder folder;
  const Observations rows = sensor_rows(100, false);
  for (Extrinsics pose : many_poses()) {
    const std::string path = saved(folder, moved_rows(rows, pose), false);
    const Recording moved = load_recording(path, {}, {.extrinsics = pose});
    expect_same_shots(moved.data.observations, rows);
    EXPECT_THAT(moved.warnings,
                ::testing::ElementsAre(Warns(kWarning.pose_unused, {"92 directions", "0.4 -1.2"})));
    pose.translation = {};
    EXPECT_TRUE(load_recording(path, {}, {.extrinsics = pose}).warnings.empty());
  }
}

TEST(Extrinsics, AMovedOriginIsAShotWithoutReturn) {
  const TestFolder folder;
  const Extrinsics pose = pose_deg(30, 20, 10, {0.1234, -0.0567, 1.0005});
  Observations rows;
  rows.resize(2);
  set_cartesian(rows, 0, {0.123, -0.057, 1.001}, kMillimetre);  // as millimetres
  set_cartesian(rows, 1, {0.123, -0.057, 1.004}, kMillimetre);
  const Recording back = load_recording(saved(folder, rows), {}, {.extrinsics = pose});
  const Observations& found = back.data.observations;
  EXPECT_EQ(found.valid, (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(found.range[0], 0.0);
  EXPECT_TRUE(std::isnan(found.azimuth[0]) && std::isnan(found.zenith[0]));
  EXPECT_NEAR(found.range[1], 0.0035, 1e-4);
}

TEST(Extrinsics, StepsOfCoordinatesStayThoseOfTheCoordinates) {
  const TestFolder folder;
  for (const Extrinsics& pose : many_poses()) {
    Observations sensor, moved;
    sensor.resize(3);
    moved.resize(3);
    const Vector3<double> points[] = {{10.0, 1.0, -2.0}, {3.0, -0.5, 0.9}, {40.0, 0.0, 0.0}};
    for (std::size_t row = 0; row < 3; ++row) {
      set_cartesian(sensor, row, points[row], kMillimetre);
      set_cartesian(moved, row, recorded_point(pose, points[row]), kMillimetre);
    }
    const Recording back = load_recording(saved(folder, moved), {}, {.extrinsics = pose});
    const Observations& found = back.data.observations;
    for (std::size_t row = 0; row < 3; ++row) {
      const auto near = [&](float a, float b) { EXPECT_NEAR(a / b, 1.0F, 1e-5F) << row; };
      near(found.azimuth_resolution[row], sensor.azimuth_resolution[row]);
      near(found.zenith_resolution[row], sensor.zenith_resolution[row]);
      near(found.range_resolution[row], sensor.range_resolution[row]);
    }
  }
}

TEST(Extrinsics, OfTwoAngularStepsTheLargerCounts) {
  const TestFolder folder;
  Observations rows;
  rows.resize(2);
  const auto step = static_cast<float>(kCentidegree);
  set_spherical(rows, 0, 0.3, radians_from_degrees(30), 5.0);  // azimuth's step is half as wide
  set_spherical(rows, 1, 0.3, radians_from_degrees(90), 5.0);
  rows.azimuth_resolution[1] = 3 * step;
  const Recording back =
      load_recording(saved(folder, rows), {}, {.extrinsics = pose_deg(0, -90, 0)});
  const Observations& found = back.data.observations;
  const float expected[] = {step, 3 * step};
  for (std::size_t row = 0; row < 2; ++row) {
    EXPECT_NEAR(found.zenith_resolution[row] / expected[row], 1.0F, 1e-5F);
    EXPECT_NEAR(found.azimuth_resolution[row] * std::sin(found.zenith[row]) / expected[row], 1.0,
                1e-5);
    EXPECT_EQ(found.range_resolution[row], static_cast<float>(kMillimetre));
  }
}

TEST(Extrinsics, RoundingAlongAndAcrossTheBeamMixAsTheLineOfSightTurns) {
  const TestFolder folder;
  Observations rows;
  rows.resize(1);
  set_spherical(rows, 0, 0.0, radians_from_degrees(90), 10.0);
  // The sensor stands 10 m beside the point: what was along the beam is across it now.
  const Recording back = load_recording(saved(folder, rows), {},
                                        {.extrinsics = pose_deg(0, 0, 0, {10.0, -10.0, 0.0})});
  const Observations& found = back.data.observations;
  EXPECT_NEAR(found.range[0], 10.0, 1e-12);
  EXPECT_NEAR(found.azimuth[0], kPi / 2, 1e-12);
  EXPECT_NEAR(found.range_resolution[0], 10.0 * kCentidegree, 1e-9);
  EXPECT_NEAR(found.zenith_resolution[0], kMillimetre / 10.0, 1e-9);
}

TEST(Extrinsics, PacketsAreLeftOutUnlessNothingIsTurned) {
  const TestFolder folder;
  const std::string path = folder.file("one.lvx");
  std::string bytes = lvx_bytes::header_lvx11({{"0TFDG3B006H2Z11", 0, 1}});
  std::mt19937 random(2);
  lvx_bytes::put_frame(
      bytes,
      {lvx_bytes::package(0, 1, 0, 500, random), lvx_bytes::package(0, 1, 6, 1'000'500, random)},
      0);
  format_tests::put_bytes(path, bytes);
  const Recording as_it_is = load_recording(path);
  ASSERT_EQ(as_it_is.data.packets.size(), 2U);
  const auto pose = stored_extrinsics(as_it_is.header.devices.front());
  ASSERT_TRUE(pose);
  EXPECT_NEAR(pose->roll, radians_from_degrees(1.5), 1e-9);
  EXPECT_NEAR(pose->pitch, radians_from_degrees(-2.25), 1e-9);
  EXPECT_NEAR(pose->yaw, radians_from_degrees(90.0), 1e-9);
  EXPECT_NEAR(pose->translation.z, -0.3, 1e-7);
  const Recording turned = load_recording(path, {}, {.extrinsics = pose});
  EXPECT_TRUE(turned.data.packets.empty());
  EXPECT_EQ(turned.data.imu.size(), 1U);
  EXPECT_EQ(turned.data.observations.time_ns, as_it_is.data.observations.time_ns);
  EXPECT_EQ(turned.data.observations.valid, as_it_is.data.observations.valid);
  EXPECT_FALSE(stored_extrinsics(turned.header.devices.front()));
  const Recording same = load_recording(path, {}, {.extrinsics = Extrinsics{}});
  EXPECT_EQ(same.data.packets.size(), 2U);
  EXPECT_TRUE(format_tests::is_same(same.data.observations, as_it_is.data.observations));
  EXPECT_TRUE(stored_extrinsics(same.header.devices.front()));
  // Counted times and the pose go together.
  const Recording both = load_recording(path, {}, {.shot_rate = 1000.0, .extrinsics = pose});
  EXPECT_EQ(both.data.observations.time_ns[7], 7'000'000);
  EXPECT_TRUE(
      format_tests::same_bits(both.data.observations.zenith, turned.data.observations.zenith));
}

TEST(Extrinsics, PosesThatMakeNoSenseAreRefused) {
  const TestFolder folder;
  const std::string path = saved(folder, sensor_rows(3, true));
  const std::string names[] = {"yaw",           "pitch",         "roll",
                               "translation.x", "translation.y", "translation.z"};
  for (std::size_t field = 0; field < 6; ++field) {
    for (const double value : {kNaN, HUGE_VAL, -HUGE_VAL}) {
      Extrinsics pose;
      double* const fields[] = {&pose.yaw,           &pose.pitch,         &pose.roll,
                                &pose.translation.x, &pose.translation.y, &pose.translation.z};
      *fields[field] = value;
      try {
        open_recording(path, {.extrinsics = pose});
        ADD_FAILURE() << names[field] << " = " << value;
      } catch (const InvalidArgument& error) {
        EXPECT_THAT(error.what(), HasSubstr("extrinsics." + names[field] + " = "));
      }
    }
  }
  const std::string two = folder.file("two.lvx");
  std::string bytes = lvx_bytes::header_lvx11({{"0TFDG3B006H2Z11", 0, 1}, {"other", 1, 1}});
  std::mt19937 random(2);
  lvx_bytes::put_frame(bytes, {lvx_bytes::package(0, 1, 0, 500, random)}, 0);
  format_tests::put_bytes(two, bytes);
  EXPECT_THROW(open_recording(two, {.extrinsics = pose_deg(1, 0, 0)}), InvalidArgument);
}

TEST(Extrinsics, AStoredPoseOfZerosOrOfNoNumberIsNone) {
  Device device;
  EXPECT_FALSE(stored_extrinsics(device));
  device.translation_m = {0.0F, 0.0F, 1e-3F};
  EXPECT_TRUE(stored_extrinsics(device));
  device.roll_pitch_yaw_deg = {std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F};
  EXPECT_FALSE(stored_extrinsics(device));
}

}  // namespace risley::recordings::extrinsics_test
