// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "identification/whole_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace risley::identification {
namespace {

/// Segments of the rotors' curves, s.
constexpr std::array<double, 9> kSegmentLengths{1.6,  0.8,   0.4,    0.2,    0.1,
                                                0.05, 0.025, 0.0125, 0.00625};
constexpr double kUnknownPrice = 1.5;
constexpr double kFewestSegmentShots = 30, kMostSegments = 250;
/// Smaller is better. An unknown fitted to chance alone gains 1. Unmodelled motion bends the
/// optics, while a surplus unknown of a curve costs little.
double evidence(const TrainFit& fit, double limit) {
  const double angles = 2.0 * static_cast<double>(fit.azimuth_residual.size());
  return angles * std::log(mean_square(fit, limit)) +
         kUnknownPrice * static_cast<double>(fit.unknowns);
}

/// A model of the trial window extended over all of a grid, in segments of about that length.
std::optional<RotorCurves> carried(const ShotGrid& grid, const TrainModel& model, double length,
                                   const Progress& progress) {
  const double whole = grid.duration() + grid.step;
  const int count = std::max(1, static_cast<int>(std::lround(whole / length)));
  const int prisms = model.train.prisms();
  RotorCurves all(prisms, 0, whole, count, 2, false);
  // A segment starts as the tangent to its neighbour and is fitted to its own shots.
  const auto follow = [&](int segment, const RotorCurves& from, double at) {
    const double begin = all.segment_length() * segment, end = begin + all.segment_length();
    RotorCurves own(prisms, begin, end, 1, 2, false);
    for (int k = 0; k < prisms; ++k) {
      const double speed = from.angular_velocity(k, at);
      own.coefficient(k, 0) = from.angle(k, at) + speed * (0.5 * (begin + end) - at);
      own.coefficient(k, 1) = 0.5 * speed * (end - begin);
    }
    const std::size_t first = row_at(grid, begin), last = row_at(grid, end);
    if (static_cast<double>(last - first) >= 0.5 * kFewestSegmentShots && last > first) {
      TrainModel part = model;
      part.rotors = own;
      const TrainFit fit =
          fit_train(rows_of(grid, first, last), part, {}, {.iterations = 8}, progress.silent());
      if (!std::isfinite(fit.rms)) return false;
      own = fit.model.rotors;
    }
    all.coefficient.middleCols(all.first_coefficient(segment), 3) = own.coefficient;
    return true;
  };
  const double middle = 0.5 * (model.rotors.begin + model.rotors.end);
  const int first = all.segment_of(middle);
  if (!follow(first, model.rotors, middle)) return {};
  const double tiny = 1e-9 * all.segment_length();  // to this side of a border
  for (int s = first + 1; s < count; ++s) {
    if (!follow(s, all, all.segment_length() * s - tiny)) return {};
  }
  for (int s = first; s-- > 0;) {
    if (!follow(s, all, all.segment_length() * (s + 1) + tiny)) return {};
  }
  return all;
}

}  // namespace

std::size_t row_at(const ShotGrid& grid, double time) {
  const auto at = std::lower_bound(grid.time.begin(), grid.time.end(), time);
  return static_cast<std::size_t>(at - grid.time.begin());
}

double correlation_factor(const TrainFit& fit) {
  double product = 0, square = 0;
  const double limit = outlier_limit(fit);
  const auto add = [&](const std::vector<double>& residual) {
    for (std::size_t i = 1; i < residual.size(); ++i) {
      if (std::abs(residual[i]) > limit || std::abs(residual[i - 1]) > limit) continue;
      product += residual[i] * residual[i - 1];
      square += residual[i] * residual[i];
    }
  };
  add(fit.azimuth_residual);
  add(fit.zenith_residual);
  const double rho = square > 0 ? std::clamp(product / square, 0.0, 0.99) : 0.0;
  return (1 + rho) / (1 - rho);
}

double chi2_excess(const TrainFit& worse, const TrainFit& better) {
  const double limit = outlier_limit(better);
  const double shots = static_cast<double>(better.shots) / correlation_factor(better);
  return 2.0 * shots * (mean_square(worse, limit) / mean_square(better, limit) - 1);
}

std::optional<TrainFit> fit_whole(const ShotGrid& grid, const TrainModel& model,
                                  const TrainFreedom& freedom, const Motion& motion, int iterations,
                                  const Progress& progress) {
  const double shots = static_cast<double>(grid.size());
  const double spacing = grid.duration() / shots;
  double length = std::min(std::max(0.05, kFewestSegmentShots * spacing), grid.duration() / 3);
  if (motion.length > 0 && !motion.smooth) length = motion.length;
  const std::optional<RotorCurves> followed = carried(grid, model, length, progress);
  if (!followed) return {};
  TrainModel start = model;
  start.rotors = *followed;
  const int prisms = model.train.prisms();
  const double end = followed->end;
  if (motion.length == 0) {
    start.rotors = resampled(*followed, RotorCurves(prisms, 0, end, 1, 1, true));
  } else if (motion.smooth) {
    const int segments = std::max(1, static_cast<int>(std::lround(end / motion.length)));
    start.rotors = resampled(*followed, RotorCurves(prisms, 0, end, segments, 3, true));
  }
  TrainFit fit = fit_train(grid, start, freedom,
                           {.iterations = iterations, .without_outliers = true}, progress.silent());
  if (!std::isfinite(fit.rms)) return {};
  return fit;
}

Motion choose_motion(const ShotGrid& grid, const TrainModel& model, const TrainFreedom& freedom,
                     const Progress& progress) {
  Motion chosen;
  std::optional<TrainFit> best;
  const auto judge = [&](const Motion& motion) {
    progress.check();
    auto fit = fit_whole(grid, model, freedom, motion, 10, progress);
    if (!fit) return false;
    const double limit = best ? std::min(outlier_limit(*best), outlier_limit(*fit)) : 0;
    // Constant speed is no worse a description than a curve that fits by chance.
    const double lead = best && chosen.length == 0 ? kFairLead : 0;
    if (best && evidence(*fit, limit) + lead >= evidence(*best, limit)) return false;
    best = std::move(fit);
    chosen = motion;
    return true;
  };
  judge({});
  for (const bool smooth : {true, false}) {
    int worse = 0;
    for (const double length : kSegmentLengths) {
      const double share = length / grid.duration();
      if (share > (smooth ? 0.6 : 0.3) || 1 / share > kMostSegments ||
          share * static_cast<double>(grid.size()) < kFewestSegmentShots) {
        continue;
      }
      worse = judge({length, smooth}) ? 0 : worse + 1;
      if (worse == 2) break;
    }
    if (chosen.length == 0) break;  // rotors that turn evenly do not jump either
  }
  return chosen;
}

}  // namespace risley::identification
