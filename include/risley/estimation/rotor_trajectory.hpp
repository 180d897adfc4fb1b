// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "risley/estimation/packed_series.hpp"

namespace risley::estimation {

/// Angle, speed and acceleration: the states of one rotor at a knot.
inline constexpr int kStatesPerRotor = 3;

/// Time for which a rotor is assumed to follow one parabola, s. Around the middle of so short a
/// piece real rotors leave the parabola by less than 1e-4 degree. docs/theory/map.md
inline constexpr double kKnotInterval = 0.002;

/// The motion of all rotors over a recording: one parabola of each per knot, a knot in the middle
/// of its shots. Knots follow each other in stretches; the rotors of one stretch are not connected
/// to those of the next, because the time between is unknown (the clock was reset) or too long to
/// count the turns.
struct RotorTrajectory {
  int prisms = 0;
  std::vector<std::int64_t> time_ns;               ///< [knots]
  std::vector<std::size_t> first_shot, last_shot;  ///< [knots], rows of the series, last exclusive
  std::vector<std::size_t> stretch_begin;          ///< first knot of each stretch
  /// [knots][prisms][3]: angle (rad, unwrapped), speed (rad/s), acceleration (rad/s^2).
  std::vector<double> state;
  /// Joint covariance of a knot's states, upper triangle row by row [knots][d (d + 1) / 2] with
  /// d = 3 prisms; empty where none was computed.
  std::vector<double> covariance;

  std::size_t size() const { return time_ns.size(); }
  int states() const { return kStatesPerRotor * prisms; }  ///< of one knot, all rotors together
  /// Knot after the last one of a stretch.
  std::size_t stretch_end(std::size_t stretch) const {
    return stretch + 1 < stretch_begin.size() ? stretch_begin[stretch + 1] : size();
  }
  /// The knot of a shot; none in an unused stretch.
  std::optional<std::size_t> knot_of_shot(std::size_t shot) const;
  /// The states of a knot [prisms][3], to read and to change.
  std::span<double> state_of(std::size_t knot) {
    const auto d = static_cast<std::size_t>(states());
    return {state.data() + knot * d, d};
  }
  /// The states of a knot [prisms][3].
  std::span<const double> state_of(std::size_t knot) const {
    const auto d = static_cast<std::size_t>(states());
    return {state.data() + knot * d, d};
  }

  /// Rotation angle of one rotor, rad, seconds from a knot.
  double angle(std::size_t knot, std::size_t rotor, double seconds) const {
    const auto s = state_of(knot).subspan(kStatesPerRotor * rotor);
    return s[0] + seconds * (s[1] + 0.5 * seconds * s[2]);
  }
  /// Speed of one rotor, rad/s, seconds from a knot.
  double speed(std::size_t knot, std::size_t rotor, double seconds) const {
    const auto s = state_of(knot).subspan(kStatesPerRotor * rotor);
    return s[1] + seconds * s[2];
  }
  /// Covariance of the angles of two rotors as a polynomial in the seconds from a knot: rad^2 times
  /// s^0, s^-1, ... s^-4.
  std::array<double, 5> angle_covariance_terms(std::size_t knot, std::size_t a,
                                               std::size_t b) const;
  /// Covariance of the angles of two rotors, rad^2, seconds from a knot.
  double angle_covariance(std::size_t knot, std::size_t a, std::size_t b, double seconds) const;
  /// Variance of the speed of one rotor as a polynomial in the seconds from a knot: (rad/s)^2 times
  /// s^0, s^-1, s^-2.
  std::array<double, 3> speed_variance_terms(std::size_t knot, std::size_t rotor) const;

 private:
  double covariance_entry(std::size_t knot, std::size_t row, std::size_t column) const;
};

/// Value of c[0] + c[1] x + c[2] x^2 + ...
template <std::size_t N>
double polynomial_at(const std::array<double, N>& c, double x) {
  double value = 0;
  for (std::size_t i = N; i-- > 0;) value = c[i] + x * value;
  return value;
}

/// Knots for the shots of some stretches, in which times ascend, on a regular grid from each
/// stretch's first shot and only where there are shots; states are zero.
RotorTrajectory make_knots(const PackedSeries& series, std::span<const ShotRange> ranges,
                           int prisms, double interval = kKnotInterval);

/// Fills the states of a trajectory with those of another one of the same stretches, each knot from
/// the other's nearest knot.
void interpolate(const RotorTrajectory& from, RotorTrajectory& to);

}  // namespace risley::estimation
