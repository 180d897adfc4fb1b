// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/trajectory_knots.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;

constexpr double kMostKnots = 1e5;

double seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-9; }

void require_component(int component) {
  require_place("component", static_cast<std::size_t>(component), kPoseErrors);
}

/// A time among knots of one strip: the knot before it, and the weight of the one behind that.
struct KnotPlace {
  std::size_t knot = 0;
  double weight = 0;
};

/// @param begin, end  knots of the strip
KnotPlace place_among(const TrajectoryKnots& knots, std::size_t begin, std::size_t end,
                      std::int64_t time_ns) {
  const auto first = knots.time_ns.begin() + static_cast<std::ptrdiff_t>(begin);
  const auto last = knots.time_ns.begin() + static_cast<std::ptrdiff_t>(end);
  const auto behind = std::upper_bound(first + 1, last - 1, time_ns);
  KnotPlace place;
  place.knot = static_cast<std::size_t>(behind - knots.time_ns.begin()) - 1;
  const double step = seconds(knots.time_ns[place.knot + 1] - knots.time_ns[place.knot]);
  place.weight = std::clamp(seconds(time_ns - knots.time_ns[place.knot]) / step, 0.0, 1.0);
  return place;
}

}  // namespace

void require_process(const PoseErrorProcess& process) {
  for (std::size_t i = 0; i < kPoseErrors; ++i) {
    require_above(fmt::format("sigma[{}] of the trajectory's errors", i), process.sigma[i], 0,
                  i < 3 ? "m" : "rad");
    require_above(fmt::format("correlation_time[{}] of the trajectory's errors", i),
                  process.correlation_time[i], 0, "s");
  }
  require_not_below("white_attitude", process.white_attitude, 0, "rad");
  require_above("sample_interval", process.sample_interval, 0, "s");
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
          "spacing of the knots = {} s makes more than {:.0f} of them, allowed longer ones",
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
  require_length("rows of the corrections", static_cast<std::size_t>(corrections.rows()),
                 kPoseErrors);
  require_length("corrections", static_cast<std::size_t>(corrections.cols()), from.size());
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(kPoseErrors, static_cast<Index>(to.size()));
  for (std::size_t k = 0; k < to.size(); ++k) {
    const auto range = std::equal_range(from.strip.begin(), from.strip.end(), to.strip[k]);
    const auto begin = static_cast<std::size_t>(range.first - from.strip.begin());
    const auto end = static_cast<std::size_t>(range.second - from.strip.begin());
    if (begin == end) continue;
    const KnotPlace place = place_among(from, begin, end, to.time_ns[k]);
    const auto knot = static_cast<Index>(place.knot);
    result.col(static_cast<Index>(k)) =
        (1 - place.weight) * corrections.col(knot) + place.weight * corrections.col(knot + 1);
  }
  return result;
}

KnotInformation knot_information(const TrajectoryKnots& knots, const PoseErrorProcess& process,
                                 int component) {
  require_process(process);
  require_component(component);
  const auto at = static_cast<std::size_t>(component);
  const double information = 1 / (process.sigma[at] * process.sigma[at]);
  KnotInformation result{std::vector<double>(knots.size()),
                         std::vector<double>(knots.size() > 0 ? knots.size() - 1 : 0)};
  if (knots.size() == 0) return result;
  result.diagonal[0] = information;
  for (std::size_t k = 1; k < knots.size(); ++k) {
    const double step = seconds(knots.time_ns[k] - knots.time_ns[k - 1]);
    // Of the later value given the earlier one, decay times which it is expected.
    const double decay = std::exp(-step / process.correlation_time[at]);
    const double gained = -information / std::expm1(-2 * step / process.correlation_time[at]);
    // Both knots of two strips may have one time: what they have in common is then known well.
    const double known = std::min(gained, 1e12 * information);
    result.diagonal[k] += known;
    result.diagonal[k - 1] += decay * decay * known;
    result.next[k - 1] = -decay * known;
  }
  return result;
}

Eigen::MatrixXd covariance_between_knots(const PoseErrorProcess& process, int component,
                                         double spacing, int parts) {
  require_process(process);
  require_component(component);
  require_above("spacing", spacing, 0, "s");
  require_at_least("parts", parts, 1);
  const auto at = static_cast<std::size_t>(component);
  const double variance = process.sigma[at] * process.sigma[at];
  // Of two places by what share of the interval they are apart, less 1: differences of covariances
  // count, and those of close places are small.
  const auto covariance = [&](double share) {
    return variance * std::expm1(-std::abs(share) * spacing / process.correlation_time[at]);
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

}  // namespace risley::calibration
