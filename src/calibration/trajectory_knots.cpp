// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/trajectory_knots.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/saturating.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;

constexpr double kMostKnots = 1e5;

double seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-9; }

constexpr double kLeastSigma = 1e-7;  // of a correction, m and rad

/// Standard deviation of a correction at a time, of its Gauss-Markov part.
double sigma_at(const trajectories::ErrorProcess& process, int correction, std::int64_t time_ns) {
  const auto row = static_cast<Index>(error_of(correction));
  return std::max(process.sigmas(time_ns)[row], kLeastSigma);
}

double correlation_time(const trajectories::ErrorProcess& process, int correction) {
  return process.correlation_times()[static_cast<Index>(error_of(correction))];
}

/// A time among knots of one strip: the previous knot, and the weight of the next one.
struct KnotPlace {
  std::size_t knot = 0;
  double weight = 0;
};

/// @param begin, end  knots of the strip
KnotPlace place_among(const TrajectoryKnots& knots, std::size_t begin, std::size_t end,
                      std::int64_t time_ns) {
  const auto first = knots.time_ns.begin() + begin;
  const auto last = knots.time_ns.begin() + end;
  const auto behind = std::upper_bound(first + 1, last - 1, time_ns);
  KnotPlace place;
  place.knot = static_cast<std::size_t>(behind - knots.time_ns.begin()) - 1;
  const double step = seconds(knots.time_ns[place.knot + 1] - knots.time_ns[place.knot]);
  place.weight = std::clamp(seconds(time_ns - knots.time_ns[place.knot]) / step, 0.0, 1.0);
  return place;
}

void require_columns_of(const TrajectoryKnots& knots, const Eigen::MatrixXd& columns) {
  require_at_least("knots", knots.size(), 1);
  require_length("rows of the corrections", columns.rows(), kCorrections);
  require_length("corrections", columns.cols(), knots.size());
}

/// The knots before and after a time.
struct Neighbours {
  const TrajectoryKnots& knots;
  std::int64_t time_ns;
  std::size_t next;  ///< the first knot after the time

  Neighbours(const TrajectoryKnots& all, std::int64_t at)
      : knots(all),
        time_ns(at),
        next(std::ranges::upper_bound(all.time_ns, at) - all.time_ns.begin()) {}

  bool has_before() const { return next > 0; }
  bool has_behind() const { return next < knots.size(); }
  bool within_strip() const {
    return has_before() && has_behind() && knots.strip[next] == knots.strip[next - 1];
  }
  double since_before() const {
    return seconds(saturating_difference(time_ns, knots.time_ns[next - 1]));
  }
  double until_behind() const {
    return seconds(saturating_difference(knots.time_ns[next], time_ns));
  }
  Eigen::Matrix<double, kCorrections, 1> between(const Eigen::MatrixXd& columns) const {
    const double weight = since_before() / (since_before() + until_behind());
    return (1 - weight) * columns.col(next - 1) + weight * columns.col(next);
  }
};

}  // namespace

trajectories::PoseError error_of(int correction) {
  using trajectories::PoseError;
  constexpr PoseError kErrors[kCorrections] = {PoseError::east,       PoseError::north,
                                               PoseError::up,         PoseError::tilt_east,
                                               PoseError::tilt_north, PoseError::heading};
  require_place("correction", correction, kCorrections);
  return kErrors[correction];
}

TrajectoryKnots make_knots(const FlightShots& shots, double spacing) {
  require_flight_shots(shots);
  require_above("spacing of the knots", spacing, 0, "s");
  TrajectoryKnots knots;
  for (std::size_t first = 0; first < shots.size();) {
    const std::uint16_t strip = shots.strip[first];
    std::size_t end = first;
    while (end < shots.size() && shots.strip[end] == strip) ++end;
    // A strip of a single time still has two knots.
    const std::int64_t begin_ns = shots.time_ns[first];
    const std::int64_t length_ns = std::max<std::int64_t>(shots.time_ns[end - 1] - begin_ns, 1000);
    const double wanted = std::max(1.0, std::round(seconds(length_ns) / spacing));
    if (static_cast<double>(knots.size()) + wanted + 1 > kMostKnots) {
      throw InvalidArgument(fmt::format(
          "spacing of the knots = {} s makes more than {:.0f} of them: choose a longer one",
          spacing, kMostKnots));
    }
    const auto intervals = static_cast<std::int64_t>(wanted);
    std::size_t shot = first;
    for (std::int64_t i = 0; i <= intervals; ++i) {
      const auto time_ns = begin_ns + static_cast<std::int64_t>(std::llround(
                                          static_cast<double>(length_ns) * static_cast<double>(i) /
                                          static_cast<double>(intervals)));
      knots.time_ns.push_back(time_ns);
      knots.strip.push_back(strip);
      if (i == 0) continue;
      TrajectoryKnots::Interval interval;
      interval.knot = knots.size() - 2;
      interval.begin_ns = knots.time_ns[interval.knot];
      interval.end_ns = time_ns;
      interval.first_shot = shot;
      while (shot < end && (shots.time_ns[shot] < time_ns || i == intervals)) ++shot;
      interval.end_shot = shot;
      knots.intervals.push_back(interval);
    }
    first = end;
  }
  return knots;
}

Eigen::MatrixXd resampled(const TrajectoryKnots& from, const Eigen::MatrixXd& corrections,
                          const TrajectoryKnots& to) {
  require_length("rows of the corrections", corrections.rows(), kCorrections);
  require_length("corrections", corrections.cols(), from.size());
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(kCorrections, to.size());
  for (std::size_t k = 0; k < to.size(); ++k) {
    const auto range = std::equal_range(from.strip.begin(), from.strip.end(), to.strip[k]);
    const auto begin = static_cast<std::size_t>(range.first - from.strip.begin());
    const auto end = static_cast<std::size_t>(range.second - from.strip.begin());
    if (begin == end) continue;
    const KnotPlace place = place_among(from, begin, end, to.time_ns[k]);
    const auto knot = static_cast<Index>(place.knot);
    result.col(k) =
        (1 - place.weight) * corrections.col(knot) + place.weight * corrections.col(knot + 1);
  }
  return result;
}

KnotSteps knot_steps(const TrajectoryKnots& knots, const trajectories::ErrorProcess& process,
                     int correction, const std::vector<ProcessBreak>& breaks) {
  const double time = correlation_time(process, correction);
  KnotSteps steps{std::vector<double>(knots.size()), std::vector<double>(knots.size())};
  double before = 0;
  for (std::size_t k = 0; k < knots.size(); ++k) {
    const double sigma = sigma_at(process, correction, knots.time_ns[k]);
    steps.sigma[k] = sigma;
    if (k > 0) {
      const double apart = seconds(knots.time_ns[k] - knots.time_ns[k - 1]);
      // In sigmas of the process, whose variance is 1 everywhere.
      steps.decay[k] = std::exp(-apart / time) * sigma / before;
      // Both knots of two strips may have one time: their common part is then known well.
      steps.sigma[k] *= std::sqrt(std::max(-std::expm1(-2 * apart / time), 1e-12));
    }
    before = sigma;
  }
  for (const ProcessBreak& one : breaks) {
    require_place("knot before a break", one.knot + 1, knots.size());
    double& sigma = steps.sigma[one.knot + 1];
    sigma = std::hypot(sigma, one.sigma[correction]);
  }
  return steps;
}

KnotInformation knot_information(const TrajectoryKnots& knots,
                                 const trajectories::ErrorProcess& process, int correction,
                                 const std::vector<ProcessBreak>& breaks) {
  const KnotSteps steps = knot_steps(knots, process, correction, breaks);
  KnotInformation result{std::vector<double>(knots.size()),
                         std::vector<double>(knots.size() > 0 ? knots.size() - 1 : 0)};
  for (std::size_t k = 0; k < knots.size(); ++k) {
    const double known = 1 / (steps.sigma[k] * steps.sigma[k]);
    result.diagonal[k] += known;
    if (k == 0) continue;
    result.diagonal[k - 1] += steps.decay[k] * steps.decay[k] * known;
    result.next[k - 1] = -steps.decay[k] * known;
  }
  return result;
}

Eigen::MatrixXd covariance_between_knots(const trajectories::ErrorProcess& process, int correction,
                                         std::int64_t begin_ns, std::int64_t end_ns, int parts) {
  const double time = correlation_time(process, correction);
  const double spacing = seconds(saturating_difference(end_ns, begin_ns));
  require_above("spacing", spacing, 0, "s");
  require_at_least("parts", parts, 1);
  const double sigma = sigma_at(process, correction, begin_ns + (end_ns - begin_ns) / 2);
  // Distance of two places as a share of the interval, less 1: differences of covariances are
  // needed, and those of close places are small.
  const auto covariance = [&](double share) {
    return sigma * sigma * std::expm1(-std::abs(share) * spacing / time);
  };
  Eigen::MatrixXd result(parts, parts);
  const auto middle = [&](int part) { return (part + 0.5) / parts; };
  for (int i = 0; i < parts; ++i) {
    for (int j = 0; j < parts; ++j) {
      const double s = middle(i), t = middle(j);
      result(i, j) = covariance(s - t) - (1 - s) * covariance(t) - s * covariance(1 - t) -
                     (1 - t) * covariance(s) - t * covariance(1 - s) +
                     ((1 - s) * t + s * (1 - t)) * covariance(1);
    }
  }
  return result;
}

Eigen::Matrix<double, kCorrections, 1> correction_at(const TrajectoryKnots& knots,
                                                     const Eigen::MatrixXd& corrections,
                                                     const trajectories::ErrorProcess& process,
                                                     std::int64_t time_ns) {
  require_columns_of(knots, corrections);
  const Neighbours near(knots, time_ns);
  if (near.within_strip()) return near.between(corrections);
  Eigen::Matrix<double, kCorrections, 1> found;
  for (int c = 0; c < kCorrections; ++c) {
    // Expectation of a Gauss-Markov process that is known before, after, or on both sides.
    double before = 0, left = 0, after = 0, right = 0;
    const double time = correlation_time(process, c);
    const auto in_sigmas = [&](std::size_t knot) {
      return corrections(c, knot) / sigma_at(process, c, knots.time_ns[knot]);
    };
    if (near.has_before()) {
      before = std::exp(-near.since_before() / time);
      left = in_sigmas(near.next - 1);
    }
    if (near.has_behind()) {
      after = std::exp(-near.until_behind() / time);
      right = in_sigmas(near.next);
    }
    const double both = before * after, rest = std::max(1 - both * both, 1e-15);
    found[c] = sigma_at(process, c, time_ns) *
               (before * (1 - after * after) * left + after * (1 - before * before) * right) / rest;
  }
  return found;
}

Eigen::Matrix<double, kCorrections, 1> correction_sigma_at(
    const TrajectoryKnots& knots, const Eigen::MatrixXd& knot_sigma,
    const trajectories::ErrorProcess& process, std::int64_t time_ns) {
  require_columns_of(knots, knot_sigma);
  const Neighbours near(knots, time_ns);
  if (near.within_strip()) return near.between(knot_sigma);
  Eigen::Matrix<double, kCorrections, 1> found;
  for (int c = 0; c < kCorrections; ++c) {
    double variance = 1;  // in squared sigmas of the process
    const auto add = [&](std::size_t knot, double apart) {
      const double kept = std::exp(-2 * apart / correlation_time(process, c));
      const double own = knot_sigma(c, knot) / sigma_at(process, c, knots.time_ns[knot]);
      variance = std::min(variance, 1 - kept * (1 - own * own));
    };
    if (near.has_before()) add(near.next - 1, near.since_before());
    if (near.has_behind()) add(near.next, near.until_behind());
    found[c] = sigma_at(process, c, time_ns) * std::sqrt(std::max(variance, 0.0));
  }
  return found;
}

}  // namespace risley::calibration
