// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/diagnostics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Core>

#include "risley/core/angle.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

namespace {

/// Fewer shots in a row do not reveal their correlation.
constexpr std::size_t kFewestInARow = 100;

/// Moments about the mean.
struct CentralMoments {
  double count = 0, mean = 0, mean_square = 0, second = 0, third = 0, fourth = 0;

  Moments moments() const {
    Moments result;
    if (!(count > 0)) {
      const double nan = std::numeric_limits<double>::quiet_NaN();
      result.mean = result.std = result.rms = result.skewness = result.kurtosis = nan;
      return result;
    }
    result.count = static_cast<std::size_t>(count);
    result.mean = mean;
    result.rms = std::sqrt(mean_square);
    result.std = std::sqrt(second * count / std::max(count - 1.0, 1.0));
    if (second > 0) {
      result.skewness = third / std::pow(second, 1.5);
      result.kurtosis = fourth / (second * second) - 3.0;
    }
    return result;
  }
};

}  // namespace

Moments moments(std::span<const double> values, std::span<const unsigned char> skip) {
  require_length_or_none("skip", skip.size(), values.size());
  const auto used = [&](std::size_t i) {
    return std::isfinite(values[i]) && (skip.empty() || skip[i] == 0);
  };
  CentralMoments result;
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!used(i)) continue;
    result.count += 1.0;
    sum += values[i];
    squares += values[i] * values[i];
  }
  result.mean = sum / result.count;
  result.mean_square = squares / result.count;
  for (std::size_t i = 0; i < values.size(); ++i) {  // second pass for accuracy
    if (!used(i)) continue;
    const double d = values[i] - result.mean;
    result.second += d * d;
    result.third += d * d * d;
    result.fourth += d * d * d * d;
  }
  for (double* moment : {&result.second, &result.third, &result.fourth}) *moment /= result.count;
  return result.moments();
}

Moments moments_together(std::span<const Moments> samples) {
  CentralMoments all;
  for (const Moments& one : samples) {
    if (one.count == 0) continue;
    const double n = static_cast<double>(one.count);
    all.count += n;
    all.mean += n * one.mean;
    all.mean_square += n * one.rms * one.rms;
  }
  all.mean /= all.count;
  all.mean_square /= all.count;
  for (const Moments& one : samples) {
    if (one.count == 0) continue;
    const double n = static_cast<double>(one.count), d = one.mean - all.mean;
    const double second = one.std * one.std * std::max(n - 1.0, 1.0) / n;
    const double third = one.skewness * std::pow(second, 1.5);
    const double fourth = second > 0 ? (one.kurtosis + 3.0) * second * second : 0.0;
    all.second += n * (second + d * d);
    all.third += n * (third + 3.0 * d * second + d * d * d);
    all.fourth += n * (fourth + 4.0 * d * third + 6.0 * d * d * second + d * d * d * d);
  }
  for (double* moment : {&all.second, &all.third, &all.fourth}) *moment /= all.count;
  return all.moments();
}

double robust_scale(std::span<const double> azimuth, std::span<const double> zenith) {
  require_length("zenith", zenith.size(), azimuth.size());
  // Half of the lengths of normal pairs are below sigma sqrt(2 ln 2).
  constexpr double kMedian = 1.1774100225154747;
  constexpr std::size_t kEnough = 20000;
  const std::size_t stride = std::max<std::size_t>(1, azimuth.size() / kEnough);
  std::vector<double> squares;
  for (std::size_t i = 0; i < azimuth.size(); i += stride) {
    const double square = azimuth[i] * azimuth[i] + zenith[i] * zenith[i];
    squares.push_back(std::isfinite(square) ? square : std::numeric_limits<double>::infinity());
  }
  if (squares.empty()) return std::numeric_limits<double>::infinity();
  return std::sqrt(upper_median(squares)) / kMedian;
}

std::vector<ShotRange> autocorrelation_windows(std::size_t shots) {
  constexpr std::size_t kWindows = 8, kWindowShots = 50000;
  const std::size_t spacing = std::max(kWindowShots, shots / kWindows);
  std::vector<ShotRange> windows;
  for (std::size_t begin = 0; begin + kFewestInARow <= shots; begin += spacing) {
    windows.push_back({begin, std::min(begin + kWindowShots, shots)});
  }
  return windows;
}

Autocorrelation autocorrelation(std::span<const std::int64_t> time_ns,
                                std::span<const double> azimuth, std::span<const double> zenith,
                                std::span<const unsigned char> skip) {
  constexpr double kSignificant = 2.0;  // sigmas: a group too many costs less than one too few
  constexpr std::size_t kMostLags = 4000;
  require_length("azimuth", azimuth.size(), time_ns.size());
  require_length("zenith", zenith.size(), time_ns.size());
  require_length_or_none("skip", skip.size(), time_ns.size());
  Autocorrelation result;
  if (time_ns.size() < kFewestInARow) return result;
  const std::int64_t step = median_step_ns(time_ns);
  if (step <= 0) return result;  // a stopped clock has no lags
  // Blocks spread over the recording, skipped shots as zeros with weight zero.
  struct EvenRun {
    std::vector<double> azimuth, zenith, weight;
  };
  std::vector<EvenRun> runs;
  double variance = 0, used = 0;
  for (const auto& [begin, end] : autocorrelation_windows(time_ns.size())) {
    EvenRun run;
    for (std::size_t i = begin; i < end; ++i) {
      if (i > begin) {  // missing shots keep their places; after a long gap a new run begins
        const std::int64_t missing = (time_ns[i] - time_ns[i - 1] + step / 2) / step - 1;
        if (missing < 0 || missing > 1000) {
          runs.push_back(std::exchange(run, {}));
        } else if (missing > 0) {
          const std::size_t size = run.azimuth.size() + static_cast<std::size_t>(missing);
          for (auto* column : {&run.azimuth, &run.zenith, &run.weight}) {
            column->resize(size, 0.0);
          }
        }
      }
      const bool good =
          (skip.empty() || skip[i] == 0) && std::isfinite(azimuth[i]) && std::isfinite(zenith[i]);
      run.azimuth.push_back(good ? azimuth[i] : 0.0);
      run.zenith.push_back(good ? zenith[i] : 0.0);
      run.weight.push_back(good ? 1.0 : 0.0);
      variance += good ? azimuth[i] * azimuth[i] + zenith[i] * zenith[i] : 0.0;
      used += good;
    }
    runs.push_back(std::move(run));
  }
  if (!(used > 0) || !(variance > 0)) return result;
  variance /= used;
  double scatter = 1.0, all_pairs = 0;
  // Lags are judged in groups of 1, 1, 2, 4, 8, ...: a weak correlation over many lags matters as
  // much as a strong one over few, and shows only in their mean.
  for (std::size_t first = 1, group = 1; first + group <= kMostLags + 1; first += group) {
    if (first > 2) group *= 2;
    std::vector<double> rho;
    double fewest_pairs = std::numeric_limits<double>::infinity(), sum = 0;
    for (std::size_t lag = first; lag < first + group; ++lag) {
      double products = 0, pairs = 0;
      for (const EvenRun& run : runs) {
        if (run.azimuth.size() <= lag) continue;
        const auto shared = static_cast<Eigen::Index>(run.azimuth.size() - lag);
        const auto product = [&](const std::vector<double>& column) {
          return Eigen::VectorXd::Map(column.data(), shared)
              .dot(Eigen::VectorXd::Map(column.data() + lag, shared));
        };
        products += product(run.azimuth) + product(run.zenith);
        pairs += product(run.weight);
      }
      fewest_pairs = std::min(fewest_pairs, pairs);
      rho.push_back(pairs > 0 ? products / pairs / variance : 0.0);
      sum += rho.back();
    }
    if (fewest_pairs < 100) break;
    // Bartlett: rho of correlated residuals scatters more, and neighbouring lags share that: the
    // variance of the sum of many is that of white residuals times the squared factor.
    const double count = static_cast<double>(group);
    const double spread = std::min(scatter * count * count, result.factor * result.factor * count);
    if (!(sum > kSignificant * std::sqrt(spread / (2.0 * fewest_pairs)))) break;
    for (const double one : rho) scatter += 2.0 * one * one;
    result.factor += 2.0 * sum;
    result.rho.insert(result.rho.end(), rho.begin(), rho.end());
    all_pairs = fewest_pairs;
  }
  // Few shots do not determine the factor well; its own standard deviation is added.
  if (!result.rho.empty()) {
    const double lags = static_cast<double>(result.rho.size());
    result.factor += 2.0 * result.factor * std::sqrt(lags / (2.0 * all_pairs));
  }
  return result;
}

AngleProfiler::AngleProfiler(std::size_t bins) : bins_(bins) {
  require_at_least("bins", static_cast<long long>(bins), 1);
}

void AngleProfiler::add(double angle, double azimuth_residual, double zenith_residual) {
  if (!std::isfinite(angle + azimuth_residual + zenith_residual)) return;
  const double turns = angle * (1.0 / kTwoPi);
  const double bins = static_cast<double>(bins_.size());
  // Rounded down manually if that is exact: it is done for every shot, and a call costs more.
  double whole = static_cast<double>(static_cast<std::int64_t>(std::clamp(turns, -1e15, 1e15)));
  if (whole > turns) whole -= 1.0;
  if (std::abs(turns) > 1e15) whole = std::floor(turns);
  const auto at = static_cast<std::size_t>((turns - whole) * bins);
  Bin& bin = bins_[std::min(at, bins_.size() - 1)];
  bin.count += 1.0;
  bin.azimuth += azimuth_residual;
  bin.zenith += zenith_residual;
  squares_azimuth_ += azimuth_residual * azimuth_residual;
  squares_zenith_ += zenith_residual * zenith_residual;
}

void AngleProfiler::add(const AngleProfiler& others) {
  require_length("bins", others.bins_.size(), bins_.size());
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    bins_[i].count += others.bins_[i].count;
    bins_[i].azimuth += others.bins_[i].azimuth;
    bins_[i].zenith += others.bins_[i].zenith;
  }
  squares_azimuth_ += others.squares_azimuth_;
  squares_zenith_ += others.squares_zenith_;
}

AngleProfile AngleProfiler::result() const {
  AngleProfile profile;
  double used = 0;
  for (const Bin& bin : bins_) used += bin.count;
  profile.sigma_azimuth = std::sqrt(squares_azimuth_ / std::max(used, 1.0));
  profile.sigma_zenith = std::sqrt(squares_zenith_ / std::max(used, 1.0));
  double chi2 = 0, counted = 0;
  for (const Bin& bin : bins_) {
    profile.count.push_back(static_cast<std::uint64_t>(bin.count));
    profile.mean_azimuth.push_back(bin.azimuth / bin.count);  // NaN without a shot
    profile.mean_zenith.push_back(bin.zenith / bin.count);
    if (!(bin.count > 0)) continue;
    chi2 += bin.count * std::pow(profile.mean_azimuth.back() / profile.sigma_azimuth, 2) +
            bin.count * std::pow(profile.mean_zenith.back() / profile.sigma_zenith, 2);
    counted += 2.0;
  }
  profile.chi2_per_bin = counted > 0 ? chi2 / counted : 0.0;
  return profile;
}

}  // namespace risley::estimation
