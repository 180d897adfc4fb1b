// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/block_file.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/io/seconds.hpp"
#include "risley/trajectories/geodesy.hpp"

#include "trajectories/formats/format.hpp"
#include "trajectories/formats/pose_rows.hpp"

/// SBET, Applanix's smoothed best estimate of trajectory: records of 17 numbers of 8 bytes and
/// nothing else.
namespace risley::trajectories {
namespace {

constexpr std::size_t kSbetRecord = 136;

/// Numbers of a record.
enum SbetField {
  kSbetTime,  // GPS second of week
  kSbetLatitude,
  kSbetLongitude,
  kSbetHeight,
  kSbetVelocity,  // three, along axes chosen by the writer
  kSbetRoll = 7,
  kSbetPitch,
  kSbetPlatformHeading,
  kSbetWander,
  kSbetAcceleration,  // three, and three angular rates
  kSbetFields = 17,
};

using SbetNumbers = std::array<double, kSbetFields>;

/// Whether numbers can be a record, in radians or, by mistake, in degrees.
bool looks_like_sbet(const SbetNumbers& n) {
  const auto within = [](double value, double limit) { return std::abs(value) <= limit; };
  return n[kSbetTime] >= 0 && n[kSbetTime] < 1.3e6 && within(n[kSbetLatitude], 90) &&
         within(n[kSbetLongitude], 360) && within(n[kSbetHeight], 1e5) &&
         within(n[kSbetVelocity], 1e4) && within(n[kSbetVelocity + 1], 1e4) &&
         within(n[kSbetVelocity + 2], 1e4) && within(n[kSbetRoll], 360) &&
         within(n[kSbetPitch], 90) && within(n[kSbetPlatformHeading], 720) &&
         within(n[kSbetWander], 360) &&
         std::all_of(n.begin() + kSbetAcceleration, n.end(),
                     [&](double value) { return within(value, 1e4); });
}

bool is_sbet(const FileHead& head) {
  const bool named = head.has_ending(".sbet") ||
                     (head.has_ending(".out") && head.name.find("sbet") != std::string::npos);
  if (named) return true;
  const std::size_t records = std::min<std::size_t>(head.bytes.size() / kSbetRecord, 20);
  if (records == 0 || head.size % kSbetRecord != 0) return false;
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(head.bytes.data());
  double before = 0;
  for (std::size_t i = 0; i < records; ++i) {
    const SbetNumbers numbers = numbers_of<kSbetFields>(bytes + i * kSbetRecord);
    if (!looks_like_sbet(numbers)) return false;
    if (numbers[kSbetTime] == 0 && numbers[kSbetLatitude] == 0) return false;  // zeros are no pose
    const double step = numbers[kSbetTime] - before;
    constexpr double kWeek = 604800;
    if (i > 0 && std::abs(step - kWeek * std::round(step / kWeek)) > 100) return false;
    before = numbers[kSbetTime];
  }
  return true;
}

Trajectory read_sbet(const std::string& path, const Progress& progress) {
  io::BlockInput file(path);
  if (file.size() == 0 || file.size() % kSbetRecord != 0) {
    throw FileError(path, {},
                    fmt::format("has {} bytes, not a multiple of the 136 bytes of a record: the "
                                "file was cut off or is not an SBET",
                                file.size()));
  }
  RowContents contents;
  contents.format = "sbet";
  contents.time_scale = TimeScale::gps_second_of_week;
  contents.has_velocity = contents.has_wander = true;
  PoseRows rows(path, contents);
  for (std::uint64_t offset = 0; offset < file.size(); offset += kSbetRecord) {
    const SbetNumbers n = numbers_of<kSbetFields>(file.at(offset, kSbetRecord));
    const auto time_ns = io::nanoseconds_from_seconds(n[kSbetTime]);
    constexpr double kMostWeeks = 20 * 604800.0;
    if (!time_ns || n[kSbetTime] < -1 || n[kSbetTime] > kMostWeeks) {
      throw FileError(path, {offset, {}},
                      fmt::format("time = {:.10g} s, allowed 0 to 604800 (GPS second of week), or "
                                  "some weeks more where times continue beyond a week",
                                  n[kSbetTime]));
    }
    PoseRow row;
    row.time_ns = *time_ns;
    row.place = {n[kSbetLatitude], n[kSbetLongitude], n[kSbetHeight]};
    row.velocity = {n[kSbetVelocity], n[kSbetVelocity + 1], n[kSbetVelocity + 2]};
    row.wander = n[kSbetWander];
    row.angles = {n[kSbetRoll], n[kSbetPitch], n[kSbetPlatformHeading] - n[kSbetWander]};
    rows.add(row, {offset, {}});
    constexpr std::size_t kOften = 4096;
    if (rows.size() % kOften == 0) {
      progress.report(static_cast<double>(offset) / static_cast<double>(file.size()));
    }
  }
  return rows.finish();
}

std::vector<std::string> write_sbet(const std::string& path, const Trajectory& trajectory) {
  if (trajectory.frame != Frame::geocentric) {
    throw InvalidArgument(
        "an SBET holds latitudes and longitudes; this trajectory is in a frame of its own");
  }
  if (trajectory.time_scale != TimeScale::gps_second_of_week) {
    throw InvalidArgument(fmt::format(
        "an SBET counts GPS seconds of the week; this trajectory's times are of the scale {}",
        to_string(trajectory.time_scale)));
  }
  io::BlockOutput file(path);
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const Eigen::Vector3d& position = trajectory.position[i];
    const Geodetic place = geodetic_from_geocentric(position);
    const RollPitchHeading angles =
        roll_pitch_heading(Frame::geocentric, position, trajectory.attitude[i]);
    SbetNumbers n{};
    n[kSbetTime] = io::seconds_from_nanoseconds(trajectory.time_ns[i]);
    n[kSbetLatitude] = place.latitude;
    n[kSbetLongitude] = place.longitude;
    n[kSbetHeight] = place.height;
    n[kSbetRoll] = angles.roll;
    n[kSbetPitch] = angles.pitch;
    n[kSbetPlatformHeading] = wrap_to_pi(angles.heading);
    if (!trajectory.velocity.empty()) {
      const Eigen::Vector3d ned = geocentric_from_ned(place).transpose() * trajectory.velocity[i];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        n[kSbetVelocity + axis] = ned[axis];
      }
    }
    std::uint8_t* bytes = file.append(kSbetRecord);
    for (std::size_t k = 0; k < n.size(); ++k) io::store<double>(bytes + 8 * k, n[k]);
  }
  file.commit();
  std::vector<std::string> left_out{"accelerations and angular rates are 0"};
  if (trajectory.velocity.empty()) left_out.emplace_back("velocities are 0");
  if (!trajectory.accuracy.empty()) left_out.emplace_back("accuracies are left out");
  if (trajectory.gps_week) left_out.emplace_back("the GPS week is dropped");
  return left_out;
}

}  // namespace

const Format kSbetFormat{"sbet",  ".sbet",   "SBET, wander angle 0, velocities north, east, down",
                         is_sbet, read_sbet, write_sbet};

}  // namespace risley::trajectories
