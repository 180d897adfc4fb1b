// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "risley/estimation/angle_series.hpp"
#include "risley/optics/prism.hpp"

namespace risley::estimation {

/// A position across the axis, y + iz.
using Complex = std::complex<double>;

/// One line of the spectrum of y + iz, the beam's position across the axis.
struct SpectralLine {
  double angular_velocity = 0;  ///< rad/s, signed: right-handed about X is positive
  double amplitude = 0;         ///< of the unit vector's transverse part
  double phase = 0;             ///< rad, at the reference time
};

/// Mean position of one emitter's shots, without the rotors' lines.
struct EmitterConstant {
  std::uint8_t beam = 0;
  double share = 0;  ///< of the shots
  Complex constant;  ///< y + iz
};

/// A constant for each emitter and a line for each turning rotor, fitted together. To first order a
/// prism adds a vector that turns with it, so each rotor owns one line.
struct RotorLines {
  /// In the order of the given speeds; all zero for a rotor at rest.
  std::vector<SpectralLine> lines;
  Complex constant;  ///< position of the optical axis: y + iz, mean of the shots' emitters
  std::vector<EmitterConstant> emitters;  ///< those that have shots
  double unexplained = 0;                 ///< mean square of the remainder, of the unit vector
  /// Its increase with a change of the lines' complex amplitudes, as change^H normal change,
  /// [turning rotors squared]. Small if the shots hardly determine them.
  Eigen::MatrixXcd normal;
};

/// Unexplained mean square when the lines have given amplitudes and only their phases are free.
/// @param amplitude  [lines]; those of rotors at rest are ignored
double unexplained_with(const RotorLines& lines, std::span<const double> amplitude);

/// Finds the speeds of the rotors by fitting lines to the shots of a window, at the times with
/// shots: half of the field may be missing, because sky returns nothing. Such gaps would smear a
/// spectrum, but not the joint fit of all lines. The sums needed for every choice of speeds come
/// from one Fourier transform of the values and one of each emitter's shots. docs/theory/start.md
class LineSearch {
 public:
  /// Uses the best covered stretch of about 100 ms (more if shots are rare).
  /// @throws EstimationError when there is no stretch of kShortestStart seconds or it holds too few
  ///         shots
  explicit LineSearch(const AngleSeries& series);

  ShotRange shots() const { return shots_; }         ///< used rows
  std::int64_t time_ns() const { return time_ns_; }  ///< of the phases: the middle of the shots

  /// The best minima with speeds within a share of the given ones, rad/s, best first.
  /// @param speeds      one per rotor, 1 to kMaxPrisms; two of them may be equal and opposite
  /// @param with_image  of two speeds: a third line lies as far beyond the second as the first lies
  /// before it, as for the strongly deflected beam of a reflector
  std::vector<RotorLines> near(std::span<const double> speeds, double share, std::size_t most,
                               bool with_image = false) const;
  /// The best minima among all pairs of speeds up to the fastest, rad/s, best first.
  std::vector<RotorLines> anywhere(double fastest, std::size_t most) const;

 private:
  struct Candidate {
    std::array<std::ptrdiff_t, kMaxPrisms> bin{};  // of each turning rotor's speed
    double unexplained = 0;
  };
  struct Bins {
    std::ptrdiff_t first = 0, last = 0;  // both included
  };
  /// The shots of one emitter.
  struct Emitter {
    std::uint8_t beam = 0;
    double count = 0;
    std::vector<Complex> spectrum;  // sum of exp(-i w t)
    Complex value;                  // sum of the values
  };

  std::vector<RotorLines> best_of(std::span<const Bins> bins, bool ordered, std::size_t most,
                                  bool with_image = false) const;
  template <int Lines>
  double unexplained(std::span<const std::ptrdiff_t> bins) const;
  template <int Lines>
  class Sums;
  template <int Lines>
  RotorLines refined(const Candidate& candidate) const;
  Bins bins_about(double speed, double share) const;

  ShotRange shots_;
  std::int64_t time_ns_ = 0;
  double duration_ = 0;  // of the window, s
  double bin_speed_ = 0;
  double count_ = 0, power_ = 0;
  std::vector<Emitter> emitters_;        // those that have shots
  std::vector<Complex> value_spectrum_;  // sum of the values times exp(-i w t)
  std::vector<double> time_;             // thinned, s from time_ns_
  std::vector<std::size_t> emitter_;     // of the thinned shots, place in emitters_
  std::vector<Complex> value_;
};

/// Range of the search around a rotor's usual speed, as a share of it.
inline constexpr double kUsualShare = 0.06;
/// Number of minima tried in a search for speeds.
inline constexpr std::size_t kMostMinima = 4;

/// Duration of the shortest window that separates the rotors of a sensor, s.
inline constexpr double kShortestStart = 0.02;

}  // namespace risley::estimation
