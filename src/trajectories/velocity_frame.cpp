// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "trajectories/velocity_frame.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "risley/core/median.hpp"

namespace risley::trajectories {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::array kCandidates{
    VelocityAxes::north_east_down,
    VelocityAxes::east_north_up,
    VelocityAxes::north_west_up_wander,
    VelocityAxes::body,
    VelocityAxes::body_up,
};

constexpr std::size_t kFewestRecords = 10, kMostSpans = 2000, kMostSteps = 400;
constexpr double kWantedSpan_ns = 1e9, kSpansOfAll = 5, kGapSteps = 3.5;

/// North, east, down of a velocity of a file.
/// @param wander  rad  @param body  ned from body
Vector3d ned_of(VelocityAxes axes, const Vector3d& v, double wander,
                const Eigen::Quaterniond& body) {
  switch (axes) {
    case VelocityAxes::north_east_down:
    case VelocityAxes::frame:
      return v;
    case VelocityAxes::east_north_up:
      return {v.y(), v.x(), -v.z()};
    case VelocityAxes::north_west_up_wander:
      return {std::cos(wander) * v.x() - std::sin(wander) * v.y(),
              -std::sin(wander) * v.x() - std::cos(wander) * v.y(), -v.z()};
    case VelocityAxes::body:
      return body * v;
    case VelocityAxes::body_up:
      return body * Vector3d(v.x(), -v.y(), -v.z());
  }
  return v;
}

/// Sums of one candidate's residuals over spans of time.
struct Residuals {
  Vector3d squares{0, 0, 0};  ///< of residuals along north, east, down
  Vector3d rms(double spans) const { return (squares / spans).cwiseSqrt(); }
};

/// A comparison of all candidates with the positions.
struct Comparison {
  std::vector<std::pair<VelocityAxes, Residuals>> candidates;
  std::size_t spans = 0;
  double span = 0;           ///< usual length, s
  double speed_squares = 0;  ///< of the differenced positions
};

std::int64_t median_step(const std::vector<std::int64_t>& times) {
  std::vector<std::int64_t> steps(times.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = times[i + 1] - times[i];
  return upper_median(steps);
}

/// Velocities integrated over spans of up to a second, compared with the change of the position:
/// rounded positions and the noise of single records matter little then.
Comparison compare(const Trajectory& t, const std::vector<double>& wander,
                   const std::vector<VelocityAxes>& tried) {
  Comparison result;
  for (const VelocityAxes axes : tried) result.candidates.emplace_back(axes, Residuals{});
  const std::int64_t step = median_step(t.time_ns);
  const double all_ns = static_cast<double>(t.time_ns.back() - t.time_ns.front());
  const double wanted = std::min(kWantedSpan_ns, all_ns / kSpansOfAll);
  const std::size_t steps = std::clamp<std::size_t>(
      static_cast<std::size_t>(std::llround(wanted / static_cast<double>(step))), 1,
      std::min(kMostSteps, t.size() - 1));
  const std::size_t possible = (t.size() - 1) / steps;
  const std::size_t stride = steps * std::max<std::size_t>(1, possible / kMostSpans);
  const std::size_t count = tried.size();
  std::vector<Vector3d> sums(count), before(count), now(count);
  for (std::size_t begin = 0; begin + steps < t.size(); begin += stride) {
    const std::size_t end = begin + steps;
    bool whole = true;
    for (std::size_t i = begin; i < end && whole; ++i) {
      whole = static_cast<double>(t.time_ns[i + 1] - t.time_ns[i]) <=
              kGapSteps * static_cast<double>(step);
    }
    if (!whole) continue;
    std::ranges::fill(sums, Vector3d(0, 0, 0));
    for (std::size_t i = begin; i <= end; ++i) {
      const Matrix3d axes = ned_axes(t.frame, t.position[i]);
      const Eigen::Quaterniond body = Eigen::Quaterniond(axes).conjugate() * t.attitude[i];
      const double angle = wander.empty() ? 0 : wander[i];
      for (std::size_t k = 0; k < count; ++k) {
        now[k] = tried[k] == VelocityAxes::frame
                     ? t.velocity[i]
                     : Vector3d(axes * ned_of(tried[k], t.velocity[i], angle, body));
      }
      if (i > begin) {
        const double dt = 1e-9 * static_cast<double>(t.time_ns[i] - t.time_ns[i - 1]);
        for (std::size_t k = 0; k < count; ++k) sums[k] += 0.5 * dt * (before[k] + now[k]);
      }
      before.swap(now);
    }
    const double span = 1e-9 * static_cast<double>(t.time_ns[end] - t.time_ns[begin]);
    const Vector3d moved = t.position[end] - t.position[begin];
    const Matrix3d axes = ned_axes(t.frame, t.position[begin + steps / 2]);
    for (std::size_t k = 0; k < count; ++k) {
      const Vector3d off = axes.transpose() * (sums[k] - moved) / span;
      result.candidates[k].second.squares += off.cwiseAbs2();
    }
    result.speed_squares += moved.squaredNorm() / (span * span);
    ++result.spans;
    result.span = span;
  }
  return result;
}

std::string in_mm(const Vector3d& residual) {
  return fmt::format("{:.1f}, {:.1f}, {:.1f} mm/s", 1e3 * residual.x(), 1e3 * residual.y(),
                     1e3 * residual.z());
}

/// All velocities into the frame.
void turn(Trajectory& t, const std::vector<double>& wander, VelocityAxes axes) {
  if (axes == VelocityAxes::frame) return;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const Matrix3d ned = ned_axes(t.frame, t.position[i]);
    const Eigen::Quaterniond body = Eigen::Quaterniond(ned).conjugate() * t.attitude[i];
    t.velocity[i] = ned * ned_of(axes, t.velocity[i], wander.empty() ? 0 : wander[i], body);
  }
}

}  // namespace

std::string_view words_of(VelocityAxes axes) {
  switch (axes) {
    case VelocityAxes::north_east_down:
      return "north-east-down";
    case VelocityAxes::east_north_up:
      return "east-north-up";
    case VelocityAxes::north_west_up_wander:
      return "north-west-up, turned by the wander angle";
    case VelocityAxes::body:
      return "forward-right-down of the body";
    case VelocityAxes::body_up:
      return "forward-left-up of the body";
    case VelocityAxes::frame:
      return "axes of the frame";
  }
  return "undecided";
}

void settle_velocities(Trajectory& trajectory, const std::vector<double>& wander,
                       std::optional<VelocityAxes> stated) {
  if (trajectory.velocity.empty()) {
    trajectory.velocity_frame = VelocityFrame{"none", "the file holds no velocities", {}};
    return;
  }
  const bool still =
      std::ranges::all_of(trajectory.velocity, [](const Vector3d& v) { return v.isZero(0); });
  const bool few = trajectory.size() < kFewestRecords;
  std::vector<VelocityAxes> tried(kCandidates.begin(), kCandidates.end());
  if (stated == VelocityAxes::frame) tried.push_back(VelocityAxes::frame);
  Comparison comparison;
  if (!few && !still) comparison = compare(trajectory, wander, tried);
  auto& candidates = comparison.candidates;
  const auto spans = static_cast<double>(comparison.spans);
  const auto total = [&](const auto& candidate) { return candidate.second.rms(spans).norm(); };
  std::ranges::stable_sort(candidates, [](const auto& a, const auto& b) {
    return a.second.squares.sum() < b.second.squares.sum();
  });

  VelocityFrame found;
  const auto drop = [&](std::string reason) {
    found.name = "undecided";
    found.reason = std::move(reason);
    trajectory.velocity.clear();
    trajectory.velocity_frame = found;
  };
  const bool can_compare = comparison.spans >= 2;
  const std::string cannot =
      still ? "all velocities are 0"
      : few ? fmt::format("{} records, at least {} are needed to compare velocities with positions",
                          trajectory.size(), kFewestRecords)
            : "gaps leave too few records to compare velocities with positions";
  // Tolerance of a fit: a few centimetres per second, due to rounded positions, or 1 % of the
  // speed.
  const double speed = can_compare ? std::sqrt(comparison.speed_squares / spans) : 0;
  const double largest = 0.05 + 0.01 * speed;

  if (stated) {
    found.name = words_of(*stated);
    if (still) {
      drop("all velocities are 0: they were not written");
      return;
    }
    found.reason = can_compare ? "as the file states" : "as the file states; " + cannot;
    if (can_compare) {
      const auto own =
          std::ranges::find_if(candidates, [&](const auto& each) { return each.first == *stated; });
      found.residual = own->second.rms(spans);
      const auto& best = candidates.front();
      if (total(*own) > largest) {
        const bool other = total(best) <= largest && 3 * total(best) < total(*own);
        warn(trajectory.warnings, kWarning.velocity_frame,
             "velocities are stated as {} and differ from the change of the positions by {} "
             "(north, east, down){}",
             found.name, in_mm(*found.residual),
             other ? fmt::format("; as {} they would by {}", words_of(best.first),
                                 in_mm(best.second.rms(spans)))
                   : "");
      }
    }
    turn(trajectory, wander, *stated);
    trajectory.velocity_frame = found;
    return;
  }
  if (!can_compare) {
    drop(cannot);
    return;
  }
  const auto& best = candidates[0];
  const auto& second = candidates[1];
  found.residual = best.second.rms(spans);
  if (total(best) > largest) {
    drop(
        fmt::format("none of {} frames fits the change of the positions: with the best, {}, they "
                    "differ by {} (north, east, down); the columns of a CSV state their frame",
                    candidates.size(), words_of(best.first), in_mm(*found.residual)));
    return;
  }
  if (total(second) < std::max(3 * total(best), 2e-3)) {
    drop(
        fmt::format("{} and {} fit the change of the positions equally well: with them, they "
                    "differ by {} and {} (north, east, down)",
                    words_of(best.first), words_of(second.first), in_mm(*found.residual),
                    in_mm(second.second.rms(spans))));
    return;
  }
  found.name = words_of(best.first);
  found.reason = fmt::format(
      "{} spans of {:.3g} s, in which it leaves {} (north, east, down) and the next best, {}, {}",
      comparison.spans, comparison.span, in_mm(*found.residual), words_of(second.first),
      in_mm(second.second.rms(spans)));
  turn(trajectory, wander, best.first);
  trajectory.velocity_frame = found;
}

}  // namespace risley::trajectories
