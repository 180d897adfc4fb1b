// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/angle_noise.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/diagnostics.hpp"

namespace risley::estimation {
namespace {

/// The median of the square of a standard normal number.
constexpr double kMedianSquare = 0.454936423119572;

/// Median of squared residuals over their variances; NaN counts as infinite.
double median_square(std::span<const double> residual, std::span<const float> rounding,
                     double noise_variance) {
  const std::size_t stride = robust_stride(residual.size(), kRobustNoiseShots);
  std::vector<double> squares;
  squares.reserve(residual.size() / stride + 1);
  for (std::size_t i = 0; i < residual.size(); i += stride) {
    const double square =
        residual[i] * residual[i] / (noise_variance + static_cast<double>(rounding[i]));
    squares.push_back(std::isfinite(square) ? square : std::numeric_limits<double>::infinity());
  }
  if (squares.empty()) return std::numeric_limits<double>::infinity();
  return upper_median(squares);
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

Component component(const SquaredResiduals& residuals, double used_share, double square_factor) {
  const double scale = 1.0 / (1.0 - used_share);
  double variance = 0;
  // Weights for a first guess based only on the scatter, then Fisher scoring.
  double count = 0;
  for (const SquaredResiduals::Group& group : residuals.groups()) {
    variance += group.squares;
    count += group.count;
  }
  if (!(count > 0)) return {};
  variance *= scale / count;
  constexpr double kLeast = kLeastAngleNoise * kLeastAngleNoise;
  double sigma = 0;
  constexpr int kMostRounds = 30;
  for (int round = 0; round < kMostRounds; ++round) {
    const double at = std::max(variance, kLeast);
    double weights = 0, sum = 0, scatter = 0;
    for (const SquaredResiduals::Group& group : residuals.groups()) {
      // Of noise = scale r^2 - q, and of (noise - at)^2, over the shots of a group.
      const double q = group.rounding_variance();
      const double weight = 1.0 / ((at + q) * (at + q));
      const double off = at + q;
      weights += group.count * weight;
      sum += weight * (scale * group.squares - group.rounding);
      scatter += weight * weight *
                 (scale * scale * group.fourth_powers - 2.0 * off * scale * group.squares +
                  group.count * off * off);
    }
    const double next = sum / weights;
    sigma = std::sqrt(square_factor * std::max(scatter, 0.0)) / weights;
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
  const std::size_t stride = robust_stride(azimuth.size(), kRobustLevelShots);
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

void SquaredResiduals::add(std::span<const double> residual, std::span<const float> rounding,
                           std::span<const unsigned char> outlier) {
  require_length("rounding", rounding.size(), residual.size());
  require_length("outlier", outlier.size(), residual.size());
  for (std::size_t i = 0; i < residual.size();) {
    // Rounding is usually the same from shot to shot.
    Group run;
    const float own = rounding[i];
    do {
      if (outlier[i] != 0) continue;
      const double square = residual[i] * residual[i];
      run.count += 1.0;
      run.squares += square;
      run.fourth_powers += square * square;
    } while (++i < residual.size() && rounding[i] == own);
    run.rounding = run.count * static_cast<double>(own);
    if (run.count > 0) add(run, own);
  }
}

void SquaredResiduals::add(const Group& more, float rounding) {
  // Sign, exponent and nine bits behind the binary point.
  const std::uint32_t key = std::bit_cast<std::uint32_t>(rounding) >> 14;
  const std::size_t place = group_of_.try_emplace(key, groups_.size()).first->second;
  if (place == groups_.size()) groups_.emplace_back();
  Group& group = groups_[place];
  group.count += more.count;
  group.squares += more.squares;
  group.fourth_powers += more.fourth_powers;
  group.rounding += more.rounding;
}

void SquaredResiduals::add(const SquaredResiduals& others) {
  for (const Group& group : others.groups_) {
    add(group, static_cast<float>(group.rounding_variance()));
  }
}

void SquaredAngles::add(const AngleSeries& series, std::span<const double> azimuth_residual,
                        std::span<const double> zenith_residual,
                        std::span<const unsigned char> outlier) {
  require_length("azimuth residuals", azimuth_residual.size(), series.size());
  require_length("zenith residuals", zenith_residual.size(), series.size());
  require_length("outlier", outlier.size(), series.size());
  azimuth.add(azimuth_residual, series.azimuth_rounding_variance, outlier);
  zenith.add(zenith_residual, series.zenith_rounding_variance, outlier);
}

void SquaredAngles::add(const SquaredAngles& others) {
  azimuth.add(others.azimuth);
  zenith.add(others.zenith);
}

NoiseEstimate noise_components(const SquaredAngles& squares, double used_share,
                               double square_factor) {
  require_between("used share", used_share, 0, 1.0 - 1e-9);
  require_above("square factor", square_factor, 0);
  const Component a = component(squares.azimuth, used_share, square_factor);
  const Component z = component(squares.zenith, used_share, square_factor);
  return {{a.value, z.value}, {a.sigma, z.sigma}};
}

double unit_variance(const SquaredAngles& squares, const AngleNoise& noise) {
  double sum = 0, count = 0;
  const auto add = [&](const SquaredResiduals& residuals, double sigma) {
    for (const SquaredResiduals::Group& group : residuals.groups()) {
      sum += group.squares / (sigma * sigma + group.rounding_variance());
      count += group.count;
    }
  };
  add(squares.azimuth, noise.azimuth);
  add(squares.zenith, noise.zenith);
  return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace risley::estimation
