// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "risley/core/random.hpp"

namespace risley::simulation {

/// How the rotors run.
enum class RotorKind {
  constant,     ///< at their nominal speed                                      [B21 Eq. (1-2)]
  sinusoidal,   ///< speed oscillates slowly, as the paper saw it                [B21 Fig. 9]
  hunting,      ///< a hunting controller: fast small oscillation, speed that wanders off
  random_walk,  ///< only white acceleration: exactly the motion model of the estimators
};

/// As rotor_kind_names() lists it.
std::string to_string(RotorKind kind);
/// @throws InvalidArgument that lists the known names
RotorKind rotor_kind_from(std::string_view name);
/// All names: "constant", "sinusoidal", "hunting", "random-walk".
const std::vector<std::string>& rotor_kind_names();

/// Speed of a rotor = nominal + swing + oscillation + random walk. The swing is a cosine from time
/// zero that belongs to the type of sensor (sensors::ScanSequence). The oscillation is a sine of
/// constant amplitude whose phase the seed decides; the random walk is integrated white
/// acceleration, zero at time zero, so its standard deviation after t seconds is acceleration_noise
/// sqrt(t).
struct RotorSettings {
  double oscillation_speed_std = 0;  ///< of the speed, rad/s; the amplitude is sqrt(2) times it
  std::vector<double> oscillation_period;  ///< s, one per prism in beam order
  double acceleration_noise = 0;           ///< rad/s/sqrt(s), the same for all prisms
  std::vector<double> swing;               ///< of the speed, one per prism, rad/s; empty: none
  double swing_frequency = 0;              ///< rad/s
};

/// The settings of a kind. Every prism has its own period.
/// constant:    nothing is added.
/// sinusoidal:  2.2 deg/s standard deviation of the speed [B21 Table 3], periods 3, 4.3, 5.9 and
///              7.7 s, random walk 0.05 deg/s/sqrt(s).
/// hunting:     the same 2.2 deg/s at 2.3, 3.1, 3.7 and 4.3 Hz (the angle swings by about 0.2 deg),
///              random walk 1 deg/s/sqrt(s): after a minute the angle is off by 4.7 rad (1 sigma).
/// random_walk: 1.5 deg/s/sqrt(s).
/// @throws InvalidArgument for a number of prisms that no train has
RotorSettings rotor_settings(RotorKind kind, int prisms);

/// One rotor's angle and speed at any time of a recording. They depend only on the arguments of the
/// constructor and the time; the speed is the derivative of the angle.
class RotorMotion {
 public:
  /// @param prism  0 for the first in beam order; selects period and random numbers
  /// @param start_angle       at time zero, rad
  /// @param angular_velocity  nominal, rad/s
  /// @param last_time_ns  largest time to be requested
  /// @throws InvalidArgument for a prism that no train has, a last time below 0, settings that are
  /// negative, not finite or lack a period or swing, and an angle or speed that is not finite
  RotorMotion(const RotorSettings& settings, int prism, double start_angle, double angular_velocity,
              std::int64_t last_time_ns, std::uint64_t seed);

  /// Angle, rad, not wrapped, and speed, rad/s, at times in ascending order. Thread-safe.
  /// @throws InvalidArgument for times that descend or lie outside [0, last_time_ns], or for spans
  ///         of different lengths
  void evaluate(std::span<const std::int64_t> time_ns, std::span<double> angle,
                std::span<double> speed) const;

 private:
  /// Contribution of the random walk at a knot.
  struct Knot {
    double angle = 0, speed = 0;
  };
  /// The knot after one given by its number.
  Knot next_knot(const Knot& knot, std::uint64_t number) const;

  double start_angle_, angular_velocity_;
  double amplitude_ = 0, frequency_ = 0, phase_ = 0;  ///< rad/s, rad/s, rad
  double swing_ = 0, swing_frequency_ = 0;            ///< rad/s
  double acceleration_noise_ = 0;
  std::int64_t last_time_ns_ = 0;
  RandomStream walk_;
  std::vector<Knot> milestones_;  ///< every kKnotsPerMilestone-th knot
};

}  // namespace risley::simulation
