// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

using Complex = std::complex<double>;

/// Shots that lines or a start are fitted to; more would only cost time.
inline constexpr std::size_t kEnoughShots = 1000;

/// Shots of a window as y + iz, the transverse part of the unit vector, with weights.
struct TransverseShots {
  std::vector<double> time, weight;  // s from the reference time
  std::vector<Complex> value;
};

/// Shots of some rows with a Hann window of weights, thinned to about so many.
TransverseShots hann_shots(const AngleSeries& series, ShotRange rows, std::int64_t reference_ns,
                           std::size_t most);

/// A constant and lines of given speeds, fitted to shots: amplitudes, and what stays unexplained.
struct LineFit {
  std::vector<Complex> amplitude;  // constant first
  double unexplained = 0;
};

LineFit fit_lines(const TransverseShots& shots, std::span<const double> speeds);

}  // namespace risley::estimation
