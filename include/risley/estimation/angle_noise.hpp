// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <span>

#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

/// Noise of reported directions before rounding: one standard deviation of each angle, rad.
struct AngleNoise {
  double azimuth = 0, zenith = 0;
  /// Of one angle, taken over both.
  double rms() const { return std::sqrt(0.5 * (azimuth * azimuth + zenith * zenith)); }
};

/// Noise that is the same in both angles, rad.
constexpr AngleNoise equal_noise(double sigma) { return {sigma, sigma}; }

/// Noise below this is taken for this, rad: a tenth of a billionth of a degree.
inline constexpr double kLeastAngleNoise = 1e-12;

/// @throws InvalidArgument unless both are finite and above 0
void check_noise(const AngleNoise& noise);

/// Noise that weights can be made of: not below kLeastAngleNoise.
AngleNoise usable_noise(const AngleNoise& noise);

/// Noise read off residuals.
struct NoiseEstimate {
  AngleNoise value;  ///< 0 where rounding explains all of the scatter
  AngleNoise sigma;  ///< one standard deviation of the value
};

/// Noise with which half of the residuals would be as small as they are, rounding of each shot
/// apart; half of them may be gross errors. Not below kLeastAngleNoise.
/// @param azimuth, zenith  residuals [shots], rad; NaN counts as a gross error
AngleNoise robust_noise(const AngleSeries& series, std::span<const double> azimuth,
                        std::span<const double> zenith);

/// Scale of the residuals over noise and rounding of each shot, 1 where these explain them; half of
/// the residuals may be gross errors.
/// @param azimuth, zenith  as robust_noise
double robust_level(const AngleSeries& series, const AngleNoise& noise,
                    std::span<const double> azimuth, std::span<const double> zenith);

/// Most likely noise of normal residuals beside the known rounding of each shot: one variance
/// component per angle, its sigma from the scatter of the squares. docs/theory/map.md
/// @param outlier        [shots], shots that are not 0 are left out
/// @param used_share     share of the observed angles that the estimate itself used up
/// @param square_factor  1 + 2 (rho_1^2 + rho_2^2 + ...) of the residuals' autocorrelation
NoiseEstimate noise_components(const AngleSeries& series, std::span<const double> azimuth,
                               std::span<const double> zenith,
                               std::span<const unsigned char> outlier, double used_share,
                               double square_factor);

/// Mean square of residuals over their stated variances [shots], outliers left out; NaN when all
/// are.
double unit_variance(const AngleSeries& series, const AngleNoise& noise,
                     std::span<const double> azimuth, std::span<const double> zenith,
                     std::span<const unsigned char> outlier);

}  // namespace risley::estimation
