// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/angle_noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/diagnostics.hpp"

namespace risley::estimation {
namespace {

/// Half of the squares of a standard normal number are below this.
constexpr double kMedianSquare = 0.454936423119572;

/// Median of squared residuals over their variances; NaN counts as infinite.
double median_square(std::span<const double> residual, std::span<const float> rounding,
                     double noise_variance) {
  constexpr std::size_t kEnough = 4000;
  const std::size_t stride = std::max<std::size_t>(1, residual.size() / kEnough);
  std::vector<double> squares;
  squares.reserve(residual.size() / stride + 1);
  for (std::size_t i = 0; i < residual.size(); i += stride) {
    const double square =
        residual[i] * residual[i] / (noise_variance + static_cast<double>(rounding[i]));
    squares.push_back(std::isfinite(square) ? square : std::numeric_limits<double>::infinity());
  }
  if (squares.empty()) return std::numeric_limits<double>::infinity();
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return *middle;
}

double robust_sigma(std::span<const double> residual, std::span<const float> rounding) {
  constexpr double kLargest = 1.0;  // rad
  double low = std::log(kLeastAngleNoise), high = std::log(kLargest);
  // The median falls as the noise grows.
  constexpr int kHalvings = 16;  // to half a thousandth
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    const bool too_small =
        median_square(residual, rounding, std::exp(2.0 * middle)) > kMedianSquare;
    (too_small ? low : high) = middle;
  }
  return std::exp(0.5 * (low + high));
}

struct Component {
  double value = 0, sigma = 0;
};

Component component(std::span<const double> residual, std::span<const float> rounding,
                    std::span<const unsigned char> outlier, double used_share,
                    double square_factor) {
  const double scale = 1.0 / (1.0 - used_share);
  double variance = 0;
  // Weights that are right for a first guess of nothing but the scatter itself, then Fisher
  // scoring.
  double count = 0;
  for (std::size_t i = 0; i < residual.size(); ++i) {
    if (outlier[i] != 0) continue;
    variance += residual[i] * residual[i];
    count += 1.0;
  }
  if (!(count > 0)) return {};
  variance *= scale / count;
  constexpr double kLeast = kLeastAngleNoise * kLeastAngleNoise;
  double sigma = 0;
  constexpr int kMostRounds = 30;
  for (int round = 0; round < kMostRounds; ++round) {
    const double at = std::max(variance, kLeast);
    double weights = 0, sum = 0, scatter = 0;
    for (std::size_t i = 0; i < residual.size(); ++i) {
      if (outlier[i] != 0) continue;
      const double q = static_cast<double>(rounding[i]);
      const double weight = 1.0 / ((at + q) * (at + q));
      const double noise = scale * residual[i] * residual[i] - q;
      weights += weight;
      sum += weight * noise;
      scatter += weight * weight * (noise - at) * (noise - at);
    }
    const double next = sum / weights;
    sigma = std::sqrt(square_factor * scatter) / weights;
    const bool done = std::abs(next - variance) < 1e-3 * sigma;
    variance = next;
    if (done) break;
  }
  const double value = std::sqrt(std::max(variance, 0.0));
  return {value, std::min(sigma / (2.0 * std::max(value, kLeastAngleNoise)), std::sqrt(sigma))};
}

}  // namespace

void check_noise(const AngleNoise& noise) {
  for (const double sigma : {noise.azimuth, noise.zenith}) {
    if (sigma > 0 && std::isfinite(sigma)) continue;
    throw InvalidArgument(
        fmt::format("angle noise = {} deg, allowed above 0", degrees_from_radians(sigma)));
  }
}

AngleNoise usable_noise(const AngleNoise& noise) {
  require_not_below("azimuth noise", noise.azimuth, 0, "rad");
  require_not_below("zenith noise", noise.zenith, 0, "rad");
  return {std::max(noise.azimuth, kLeastAngleNoise), std::max(noise.zenith, kLeastAngleNoise)};
}

AngleNoise robust_noise(const AngleSeries& series, std::span<const double> azimuth,
                        std::span<const double> zenith) {
  require_length("azimuth", azimuth.size(), series.size());
  require_length("zenith", zenith.size(), series.size());
  return {robust_sigma(azimuth, series.azimuth_rounding_variance),
          robust_sigma(zenith, series.zenith_rounding_variance)};
}

double robust_level(const AngleSeries& series, const AngleNoise& noise,
                    std::span<const double> azimuth, std::span<const double> zenith) {
  constexpr std::size_t kEnough = 20000;
  const std::size_t stride = std::max<std::size_t>(1, azimuth.size() / kEnough);
  const auto over_sigma = [stride](std::span<const double> residual, double sigma,
                                   std::span<const float> rounding) {
    std::vector<double> scaled;
    for (std::size_t i = 0; i < residual.size(); i += stride) {
      scaled.push_back(residual[i] / std::sqrt(sigma * sigma + static_cast<double>(rounding[i])));
    }
    return scaled;
  };
  return robust_scale(over_sigma(azimuth, noise.azimuth, series.azimuth_rounding_variance),
                      over_sigma(zenith, noise.zenith, series.zenith_rounding_variance));
}

NoiseEstimate noise_components(const AngleSeries& series, std::span<const double> azimuth,
                               std::span<const double> zenith,
                               std::span<const unsigned char> outlier, double used_share,
                               double square_factor) {
  require_length("azimuth", azimuth.size(), series.size());
  require_length("zenith", zenith.size(), series.size());
  require_length("outlier", outlier.size(), series.size());
  require_between("used share", used_share, 0, 1.0 - 1e-9);
  require_above("square factor", square_factor, 0);
  Component a, z;
  tbb::parallel_invoke(
      [&] {
        a = component(azimuth, series.azimuth_rounding_variance, outlier, used_share,
                      square_factor);
      },
      [&] {
        z = component(zenith, series.zenith_rounding_variance, outlier, used_share, square_factor);
      });
  return {{a.value, z.value}, {a.sigma, z.sigma}};
}

double unit_variance(const AngleSeries& series, const AngleNoise& noise,
                     std::span<const double> azimuth, std::span<const double> zenith,
                     std::span<const unsigned char> outlier) {
  require_length("azimuth residuals", azimuth.size(), series.size());
  require_length("zenith residuals", zenith.size(), series.size());
  require_length("outlier", outlier.size(), series.size());
  double sum = 0, count = 0;
  const double azimuth_noise = noise.azimuth * noise.azimuth;
  const double zenith_noise = noise.zenith * noise.zenith;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (outlier[i]) continue;
    sum += azimuth[i] * azimuth[i] /
               (azimuth_noise + static_cast<double>(series.azimuth_rounding_variance[i])) +
           zenith[i] * zenith[i] /
               (zenith_noise + static_cast<double>(series.zenith_rounding_variance[i]));
    count += 2.0;
  }
  return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace risley::estimation
