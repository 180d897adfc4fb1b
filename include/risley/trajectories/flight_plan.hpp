// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/trajectories/geodesy.hpp"
#include "risley/trajectories/trajectory.hpp"

namespace risley::trajectories {

/// A straight line flown at constant speed, on a map: x east, y north, z up.
struct Strip {
  std::string name;
  std::array<double, 2> center{0.0, 0.0};  ///< of the line, m
  double heading = 0;                      ///< of the flight, rad, clockwise from north
  double length = 0;                       ///< m
  double height = 0;                       ///< z of the reference point, m
  double speed = 0;                        ///< m/s
};

/// Sums of sinusoids: the same number for each axis, of equal amplitude, one in each equal part of
/// a band of frequencies, with frequency and phase determined by the seed.
struct SinusoidMotion {
  std::array<double, 3> rms{0.0, 0.0, 0.0};            ///< of an axis, all sinusoids together
  double lowest_frequency = 1, highest_frequency = 1;  ///< Hz
  int sinusoids = 1;                                   ///< per axis
};

/// A planned flight: strips one after the other, with turns of a stated duration between them. In a
/// turn the platform moves as a multirotor does: without bank, along a polynomial of the fifth
/// degree that joins position and velocity of both strips, while its heading turns the shorter way,
/// by 180 degrees to the right. Before the first strip and after the last one it flies straight on.
/// Motion of attitude and velocity is added throughout.
struct FlightPlan {
  std::string name;
  /// Location of the map's x = y = z = 0 on the Earth, its axes east, north and up there; with it
  /// the trajectory is geocentric, otherwise local.
  std::optional<Geodetic> origin;
  TimeScale time_scale = TimeScale::unknown;
  std::optional<int> gps_week;
  double start = 0;           ///< time of the first record in that scale, s
  double rate = 200;          ///< records per second
  std::vector<Strip> strips;  ///< in the order flown
  double turn_duration = 20;  ///< from the end of a strip to the begin of the next, s
  double lead = 2;            ///< before the first strip and after the last one, s
  SinusoidMotion attitude;    ///< roll, pitch, heading, rad
  SinusoidMotion velocity;    ///< along x, y, z, m/s
  std::uint64_t seed = 0;     ///< of the motion
};

/// Time of a strip, on the trajectory's time scale.
struct StripTimes {
  std::string name;
  std::int64_t begin_ns = 0, end_ns = 0;
};

/// The file of strips: [{name, begin_ns, end_ns}] beside risley_strips: 1 and time_scale.
/// @param scale  of their times
std::string strip_times_text(const std::vector<StripTimes>& strips, TimeScale scale);

/// A flight as it was flown.
struct Flight {
  Trajectory trajectory;  ///< with velocities
  std::vector<StripTimes> strips;
};

/// The flight of a plan: one record every 1 / rate from start to the last strip's end and its lead,
/// which is rounded up to a record. Same plan, same bits.
/// @throws InvalidArgument as require_flight_plan
Flight fly(const FlightPlan& plan);

/// @throws InvalidArgument for a plan without strips, values that are not finite or invalid, and
/// more than kMostFlightRecords records
void require_flight_plan(const FlightPlan& plan);

/// Most records of a planned flight.
inline constexpr std::size_t kMostFlightRecords = 10'000'000;

/// Reads
///
///     risley_flight: 1
///     name: four crossing strips             # optional
///     origin: {latitude_deg: 50, longitude_deg: 8.5, ellipsoidal_height_m: 300}   # optional
///     start: {scale: gps-second-of-week, time_s: 208800, gps_week: 2400}          # optional
///     rate_hz: 200
///     height_m: 80
///     speed_m_per_s: 5
///     turn_duration_s: 20
///     lead_s: 2                              # optional
///     strips:
///       - {headings_deg: [90, 270, 0, 180], length_m: 160}      # through center_m: [0, 0]
///       - {heading_deg: 0, count: 3, spacing_m: 28, length_m: 160, height_m: 50}
///     motion:                                # optional, and so is each of the two
///       seed: 1
///       attitude: {roll_deg: 2, pitch_deg: 2, heading_deg: 2, lowest_hz: 0.15,
///                  highest_hz: 1.2, sinusoids: 6}
///       velocity: {x_m_per_s: 0.15, y_m_per_s: 0.15, z_m_per_s: 0.15, lowest_hz: 0.05,
///                  highest_hz: 0.4, sinusoids: 6}
///
/// A group of strips may have its own name, center_m, height_m and speed_m_per_s. Parallel strips
/// are flown from left to right of the heading, back and forth.
/// @param path  for messages only
/// @throws FileError with the line for anything else
FlightPlan parse_flight_plan(const std::string& text, const std::string& path);

/// parse_flight_plan of a file. @throws FileError
FlightPlan load_flight_plan(const std::string& path);

}  // namespace risley::trajectories
