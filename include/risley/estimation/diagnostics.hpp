// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

/// Sample statistics of residuals, in the unit of the sample.
struct Moments {
  std::size_t count = 0;
  double mean = 0;
  double std = 0;       ///< standard deviation about the mean
  double rms = 0;       ///< root of the mean square
  double skewness = 0;  ///< 0 for a normal distribution
  double kurtosis = 0;  ///< excess: 0 for a normal distribution
};

/// Moments of the finite values of a column; NaN if there are none.
/// @param skip  nonzero entries are skipped (outliers); empty skips nothing
Moments moments(std::span<const double> values, std::span<const unsigned char> skip = {});

/// Moments of several samples together.
Moments moments_together(std::span<const Moments> samples);

/// The shots of a recording used by autocorrelation(): some stretches, spread over it.
std::vector<ShotRange> autocorrelation_windows(std::size_t shots);

/// Standard deviation of one component of residual pairs, from the median of their lengths: half of
/// the pairs may be gross errors. Infinite when half of them are NaN.
double robust_scale(std::span<const double> azimuth, std::span<const double> zenith);

/// Correlation of residuals of neighbouring shots.
struct Autocorrelation {
  /// 1 + 2 (rho_1 + rho_2 + ...): factor on the variance of a mean compared with independent
  /// residuals. Never below 1.
  double factor = 1.0;
  std::vector<double> rho;  ///< at lags 1, 2, ... until it does not differ from zero
};

/// Autocorrelation of residual columns, both axes together; pairs with a missing shot between them
/// are skipped. The shots of autocorrelation_windows() give the same result as all. The sum ends
/// before the first group of 1, 1, 2, 4, ... lags whose mean is below 2 sigma; the factor is the
/// sum plus one standard deviation.
/// @param time_ns  of the shots @param skip  nonzero shots are skipped
Autocorrelation autocorrelation(std::span<const std::int64_t> time_ns,
                                std::span<const double> azimuth, std::span<const double> zenith,
                                std::span<const unsigned char> skip);

/// Mean residuals over the rotation angle of one prism, which reveal a bent sensor.
struct AngleProfile {
  std::vector<std::uint64_t> count;               ///< [bins], shots
  std::vector<double> mean_azimuth, mean_zenith;  ///< [bins], rad; NaN in an empty bin
  double sigma_azimuth = 0, sigma_zenith = 0;     ///< of one shot, rad
  /// Mean of the squared means over their variances, per bin and axis; about 1 when nothing depends
  /// on the angle.
  double chi2_per_bin = 0;
};

/// Collects an AngleProfile shot by shot.
class AngleProfiler {
 public:
  explicit AngleProfiler(std::size_t bins = 72);
  /// A shot with a non-finite number is skipped.
  /// @param angle  rotation angle of the prism, rad, any number of turns
  void add(double angle, double azimuth_residual, double zenith_residual);
  /// Adds all shots of another one with as many bins.
  void add(const AngleProfiler& others);
  /// The profile of the shots so far.
  AngleProfile result() const;

 private:
  struct Bin {
    double count = 0, azimuth = 0, zenith = 0;
  };
  std::vector<Bin> bins_;
  double squares_azimuth_ = 0, squares_zenith_ = 0;
};

}  // namespace risley::estimation
