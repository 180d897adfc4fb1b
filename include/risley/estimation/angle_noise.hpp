// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

/// Noise of reported directions before rounding: one standard deviation of each angle, rad.
struct AngleNoise {
  double azimuth = 0, zenith = 0;
  /// Of one angle, averaged over both.
  double rms() const { return std::sqrt(0.5 * (azimuth * azimuth + zenith * zenith)); }
};

/// Noise that is the same in both angles, rad.
constexpr AngleNoise equal_noise(double sigma) { return {sigma, sigma}; }

/// Noise below this is raised to this, rad: a tenth of a billionth of a degree.
inline constexpr double kLeastAngleNoise = 1e-12;

/// @throws InvalidArgument unless both are finite and above 0
void check_noise(const AngleNoise& noise);

/// Noise usable for weights: not below kLeastAngleNoise.
AngleNoise usable_noise(const AngleNoise& noise);

/// Noise read off residuals.
struct NoiseEstimate {
  AngleNoise value;  ///< 0 if rounding explains all of the scatter
  AngleNoise sigma;  ///< one standard deviation of the value
};

/// This many evenly spread shots are enough for robust_noise(); of more it uses every n-th.
inline constexpr std::size_t kRobustNoiseShots = 4000;
/// The same for robust_level().
inline constexpr std::size_t kRobustLevelShots = 20000;

/// The n for which every n-th shot gives that many.
constexpr std::size_t robust_stride(std::size_t shots, std::size_t enough) {
  return shots < enough ? 1 : shots / enough;
}

/// Noise for which half of the residuals would be as small as they are, each shot's rounding apart;
/// half of them may be gross errors. Not below kLeastAngleNoise.
/// @param azimuth, zenith  residuals [shots], rad; NaN counts as a gross error
AngleNoise robust_noise(const AngleSeries& series, std::span<const double> azimuth,
                        std::span<const double> zenith);

/// Scale of the residuals over noise and rounding of each shot, 1 if these explain them; half of
/// the residuals may be gross errors.
/// @param azimuth, zenith  as robust_noise
double robust_level(const AngleSeries& series, const AngleNoise& noise,
                    std::span<const double> azimuth, std::span<const double> zenith);

/// Squared residuals of one angle, grouped by the rounding of the shots: sufficient to find the
/// noise beside it. Roundings that differ by less than a 500th share a group.
class SquaredResiduals {
 public:
  /// Sums over shots of one rounding.
  struct Group {
    double count = 0, squares = 0, fourth_powers = 0;
    double rounding = 0;  ///< sum of the rounding variances, rad^2
    double rounding_variance() const { return rounding / count; }  ///< mean of them, rad^2
  };
  /// @param residual  [shots], rad  @param rounding  [shots], their variances, rad^2
  /// @param outlier  [shots], nonzero shots are skipped
  void add(std::span<const double> residual, std::span<const float> rounding,
           std::span<const unsigned char> outlier);
  /// Adds what was gathered elsewhere.
  void add(const SquaredResiduals& others);
  const std::vector<Group>& groups() const { return groups_; }  ///< as they were met

 private:
  void add(const Group& more, float rounding);

  std::vector<Group> groups_;
  std::unordered_map<std::uint32_t, std::size_t> group_of_;
};

/// Squared residuals of both angles.
struct SquaredAngles {
  SquaredResiduals azimuth, zenith;

  /// @param azimuth_residual, zenith_residual  [shots], rad
  /// @param outlier  [shots], nonzero shots are skipped
  void add(const AngleSeries& series, std::span<const double> azimuth_residual,
           std::span<const double> zenith_residual, std::span<const unsigned char> outlier);
  /// Adds what was gathered elsewhere.
  void add(const SquaredAngles& others);
};

/// Most likely noise of normal residuals beside the known rounding of each shot: one variance
/// component per angle, its sigma from the scatter of the squares. docs/theory/map.md
/// @param used_share  share of the observed angles used up by the estimate itself
/// @param square_factor  1 + 2 (rho_1^2 + rho_2^2 + ...) of the residuals' autocorrelation
NoiseEstimate noise_components(const SquaredAngles& squares, double used_share,
                               double square_factor);

/// Mean square of residuals over their stated variances; NaN when there is none.
double unit_variance(const SquaredAngles& squares, const AngleNoise& noise);

}  // namespace risley::estimation
