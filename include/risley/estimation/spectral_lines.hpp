// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

using Complex = std::complex<double>;

/// One line of the spectrum of y + iz, the beam's position across the axis.
struct SpectralLine {
  double angular_velocity = 0;  ///< rad/s, signed: right-handed about X is positive
  double amplitude = 0;         ///< of the unit vector's transverse part
  double phase = 0;             ///< rad, at the reference time
};

/// A constant and two lines, fitted together. To first order a prism adds a vector that turns with
/// it, so each rotor owns one line.
struct RotorLines {
  std::vector<SpectralLine> lines;  ///< in the order of the speeds they were looked for with
  Complex constant;                 ///< where the optical axis stands: y + iz
  double unexplained = 0;           ///< mean square of what the fit leaves, of the unit vector
};

/// Finds the speeds of two rotors by fitting lines to the shots of a window, at the times that have
/// shots: half of the field may be missing, because sky returns nothing. A spectrum would be
/// smeared by such gaps; the fit of all lines together is not. The sums that every pair of speeds
/// needs come from two Fourier transforms. docs/theory/start.md
class LineSearch {
 public:
  /// Takes the best covered stretch of about 100 ms (more where shots are rare).
  /// @throws EstimationError when there is no stretch of kShortestStart seconds or it holds too few
  ///         shots
  explicit LineSearch(const AngleSeries& series);

  ShotRange shots() const { return shots_; }         ///< used rows
  std::int64_t time_ns() const { return time_ns_; }  ///< of the phases: the middle of the shots

  /// The best minima with speeds within a share of the given ones, rad/s, best first.
  std::vector<RotorLines> near(const std::pair<double, double>& speeds, double share,
                               std::size_t most) const;
  /// The best minima among all pairs of speeds up to the fastest, rad/s, best first.
  std::vector<RotorLines> anywhere(double fastest, std::size_t most) const;

 private:
  struct Candidate {
    std::ptrdiff_t first = 0, second = 0;  // places of the frequency grid
    double unexplained = 0;
  };
  struct Bins {
    std::ptrdiff_t first = 0, last = 0;  // both included
  };

  std::vector<RotorLines> best_of(Bins first, Bins second, bool ordered, std::size_t most) const;
  double unexplained(std::ptrdiff_t first, std::ptrdiff_t second) const;
  RotorLines refined(const Candidate& candidate) const;
  RotorLines fit(double first, double second) const;
  Complex sum_at(const std::vector<Complex>& spectrum, std::ptrdiff_t bin) const;
  Bins bins_about(double speed, double share) const;

  ShotRange shots_;
  std::int64_t time_ns_ = 0;
  double duration_ = 0;  // of the window, s
  double bin_speed_ = 0;
  double count_ = 0, power_ = 0;
  std::vector<Complex> shot_spectrum_, value_spectrum_;  // sum of exp(-i w t), of value times it
  std::vector<double> time_;                             // thinned, s from time_ns_
  std::vector<Complex> value_;
};

/// Duration of the shortest window that tells the rotors of a sensor apart, s.
inline constexpr double kShortestStart = 0.02;

}  // namespace risley::estimation
