// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "risley/core/angle.hpp"
#include "risley/trajectories/geodesy.hpp"
#include "risley/trajectories/trajectory.hpp"

namespace risley::trajectories {

/// A flight whose every derivative is known: geocentric, 200 Hz.
class KnownFlight {
 public:
  static constexpr double kStep = 0.005;    // s
  static constexpr double kBegin = 400825;  // second of week

  KnownFlight() : origin_{0.659119304, -2.07735761, 691.6} {
    axes_ = geocentric_from_ned(origin_);
    begin_ = geocentric_from_geodetic(origin_);
  }

  Eigen::Vector3d position(double t) const {
    return begin_ + axes_ * Eigen::Vector3d(-20 * t + 0.5 * std::sin(t), 9 * t + std::cos(0.7 * t),
                                            0.4 * std::sin(0.9 * t));
  }
  Eigen::Vector3d velocity(double t) const {  // geocentric
    return axes_ * Eigen::Vector3d(-20 + 0.5 * std::cos(t), 9 - 0.7 * std::sin(0.7 * t),
                                   0.36 * std::cos(0.9 * t));
  }
  RollPitchHeading angles(double t) const {
    return {0.1 * std::sin(1.1 * t), 0.05 + 0.08 * std::cos(1.7 * t),
            wrap_to_two_pi(radians_from_degrees(359) + 0.2 * t)};
  }
  Geodetic place(double t) const { return geodetic_from_geocentric(position(t)); }
  Eigen::Vector3d velocity_ned(double t) const {
    return geocentric_from_ned(place(t)).transpose() * velocity(t);
  }
  Eigen::Quaterniond attitude(double t) const {
    return Eigen::Quaterniond(geocentric_from_ned(place(t))) * ned_from_body(angles(t));
  }

 private:
  Geodetic origin_;
  Eigen::Matrix3d axes_;
  Eigen::Vector3d begin_;
};

/// The flight as a trajectory of its own.
inline Trajectory trajectory_of(const KnownFlight& flight, int records) {
  Trajectory t;
  t.frame = Frame::geocentric;
  t.time_scale = TimeScale::gps_second_of_week;
  for (int i = 0; i < records; ++i) {
    const double time = KnownFlight::kStep * i;
    t.time_ns.push_back(std::llround((KnownFlight::kBegin + time) * 1e9));
    t.position.push_back(flight.position(time));
    t.attitude.push_back(flight.attitude(time));
    t.velocity.push_back(flight.velocity(time));
  }
  return t;
}

using SbetRecord = std::array<double, 17>;

/// Records of an SBET, velocities north, east, down.
inline std::vector<SbetRecord> sbet_records(const KnownFlight& flight, int records,
                                            double wander = 0) {
  std::vector<SbetRecord> all;
  for (int i = 0; i < records; ++i) {
    const double t = KnownFlight::kStep * i;
    const Geodetic place = flight.place(t);
    const RollPitchHeading angles = flight.angles(t);
    const Eigen::Vector3d v = flight.velocity_ned(t);
    all.push_back({KnownFlight::kBegin + t, place.latitude, place.longitude, place.height, v.x(),
                   v.y(), v.z(), angles.roll, angles.pitch, wrap_to_pi(angles.heading + wander),
                   wander, 0, 0, 0, 0, 0, 0});
  }
  return all;
}

template <class Record>
std::string bytes_of(const std::vector<Record>& records) {
  std::string bytes(records.size() * sizeof(Record), '\0');
  if (!records.empty()) std::memcpy(bytes.data(), records.data(), bytes.size());
  return bytes;
}

inline void write_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// The path of a real file, empty where the folder of real files is not named.
inline std::string real_file(const std::string& name) {
  const char* const folder = std::getenv("RISLEY_VENDOR_DATA");
  return folder == nullptr ? std::string() : std::string(folder) + "/trajectory/" + name;
}

}  // namespace risley::trajectories
