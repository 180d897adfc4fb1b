// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/simulation/rotor_dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/prism.hpp"

#include "simulation/streams.hpp"

namespace risley::simulation {
namespace {

constexpr std::int64_t kKnotInterval_ns = 1'000'000;
constexpr double kKnotInterval = 1e-3;
constexpr std::uint64_t kKnotsPerMilestone = 256;

const std::vector<std::pair<RotorKind, std::string>>& kinds() {
  static const std::vector<std::pair<RotorKind, std::string>> list{
      {RotorKind::constant, "constant"},
      {RotorKind::sinusoidal, "sinusoidal"},
      {RotorKind::hunting, "hunting"},
      {RotorKind::random_walk, "random-walk"}};
  return list;
}

}  // namespace

std::string to_string(RotorKind kind) {
  for (const auto& [each, name] : kinds()) {
    if (each == kind) return name;
  }
  return {};
}

RotorKind rotor_kind_from(std::string_view name) {
  for (const auto& [kind, each] : kinds()) {
    if (each == name) return kind;
  }
  throw InvalidArgument(fmt::format("unknown rotor motion \"{}\", known: {}", name,
                                    fmt::join(rotor_kind_names(), ", ")));
}

const std::vector<std::string>& rotor_kind_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const auto& [kind, name] : kinds()) list.push_back(name);
    return list;
  }();
  return names;
}

RotorSettings rotor_settings(RotorKind kind, int prisms) {
  if (prisms < 1 || prisms > kMaxPrisms) refuse_layout(prisms);
  RotorSettings settings;
  switch (kind) {
    case RotorKind::constant:
      break;
    case RotorKind::sinusoidal:
      settings.oscillation_speed_std = radians_from_degrees(2.2);
      settings.oscillation_period = {3.0, 4.3, 5.9, 7.7};
      settings.acceleration_noise = radians_from_degrees(0.05);
      break;
    case RotorKind::hunting:
      settings.oscillation_speed_std = radians_from_degrees(2.2);
      settings.oscillation_period = {1.0 / 2.3, 1.0 / 3.1, 1.0 / 3.7, 1.0 / 4.3};
      settings.acceleration_noise = radians_from_degrees(1.0);
      break;
    case RotorKind::random_walk:
      settings.acceleration_noise = radians_from_degrees(1.5);
      break;
  }
  const auto count = static_cast<std::size_t>(prisms);
  if (settings.oscillation_period.size() > count) settings.oscillation_period.resize(count);
  return settings;
}

RotorMotion::RotorMotion(const RotorSettings& settings, int prism, double start_angle,
                         double angular_velocity, std::int64_t last_time_ns, std::uint64_t seed)
    : start_angle_(start_angle),
      angular_velocity_(angular_velocity),
      acceleration_noise_(settings.acceleration_noise),
      last_time_ns_(last_time_ns),
      walk_(seed, stream::random_walk(prism)) {
  require_between("prism", prism, 0, kMaxPrisms - 1);
  require_not_below("oscillation_speed_std", settings.oscillation_speed_std, 0, "rad/s");
  require_not_below("acceleration_noise", settings.acceleration_noise, 0, "rad/s/sqrt(s)");
  require_finite("start_angle", start_angle, "rad");
  require_finite("angular_velocity", angular_velocity, "rad/s");
  require_at_least("last_time_ns", last_time_ns, 0);
  if (settings.oscillation_speed_std > 0.0) {
    require_at_least("values of oscillation_period", settings.oscillation_period.size(), prism + 1);
    require_above(fmt::format("oscillation_period[{}]", prism), settings.oscillation_period[prism],
                  0, "s");
    amplitude_ = std::numbers::sqrt2 * settings.oscillation_speed_std;
    frequency_ = kTwoPi / settings.oscillation_period[prism];
    phase_ = kTwoPi * RandomStream(seed, stream::kOscillationPhases).uniform(prism);
  }
  if (!settings.swing.empty()) {
    require_at_least("values of swing", settings.swing.size(), prism + 1);
    require_finite(fmt::format("swing[{}]", prism), settings.swing[prism], "rad/s");
    require_above("swing_frequency", settings.swing_frequency, 0, "rad/s");
    swing_ = settings.swing[prism];
    swing_frequency_ = settings.swing_frequency;
  }
  if (acceleration_noise_ > 0.0) {
    const auto last = static_cast<std::uint64_t>(last_time_ns / kKnotInterval_ns);
    Knot knot;
    for (std::uint64_t number = 0;; ++number) {
      if (number % kKnotsPerMilestone == 0) milestones_.push_back(knot);
      if (number == last) break;
      knot = next_knot(knot, number);
    }
  }
}

RotorMotion::Knot RotorMotion::next_knot(const Knot& knot, std::uint64_t number) const {
  // Speed and angle of integrated white noise after one step h, drawn jointly: variances q h and
  // q h^3 / 3, covariance q h^2 / 2.
  const double along = walk_.normal(2 * number);
  const double across = walk_.normal(2 * number + 1);
  const double speed_step = acceleration_noise_ * std::sqrt(kKnotInterval) * along;
  const double angle_step = acceleration_noise_ * std::sqrt(kKnotInterval) * kKnotInterval *
                            (0.5 * along + across / std::sqrt(12.0));
  return {knot.angle + kKnotInterval * knot.speed + angle_step, knot.speed + speed_step};
}

void RotorMotion::evaluate(std::span<const std::int64_t> time_ns, std::span<double> angle,
                           std::span<double> speed) const {
  require_length("angle", angle.size(), time_ns.size());
  require_length("speed", speed.size(), time_ns.size());
  Knot before, after;
  std::uint64_t number = 0;  // of the knot before
  bool located = false;
  for (std::size_t i = 0; i < time_ns.size(); ++i) {
    const std::int64_t now = time_ns[i];
    if (now < 0 || now > last_time_ns_ || (i > 0 && now < time_ns[i - 1])) {
      throw InvalidArgument(fmt::format("time_ns[{}] = {} ns, allowed ascending from 0 to {}", i,
                                        now, last_time_ns_));
    }
    const double time = static_cast<double>(now) * 1e-9;
    angle[i] = start_angle_ + angular_velocity_ * time;
    speed[i] = angular_velocity_;
    if (swing_ != 0.0) {
      angle[i] += swing_ / swing_frequency_ * std::sin(swing_frequency_ * time);
      speed[i] += swing_ * std::cos(swing_frequency_ * time);
    }
    if (amplitude_ > 0.0) {
      const double turn = frequency_ * time + phase_;
      angle[i] += amplitude_ / frequency_ * (std::cos(phase_) - std::cos(turn));
      speed[i] += amplitude_ * std::sin(turn);
    }
    if (acceleration_noise_ > 0.0) {
      const auto wanted = static_cast<std::uint64_t>(now / kKnotInterval_ns);
      if (!located || wanted / kKnotsPerMilestone > number / kKnotsPerMilestone) {
        number = wanted / kKnotsPerMilestone * kKnotsPerMilestone;
        before = milestones_[wanted / kKnotsPerMilestone];
        after = next_knot(before, number);
        located = true;
      }
      for (; number < wanted; ++number) {
        before = after;
        after = next_knot(after, number + 1);
      }
      // The cubic through both knots' angles and speeds: the mean effect of white noise between
      // them.
      const double h = kKnotInterval;
      const double u =
          static_cast<double>(now % kKnotInterval_ns) / static_cast<double>(kKnotInterval_ns);
      const double rise = after.angle - before.angle;
      const double c1 = h * before.speed;
      const double c2 = 3.0 * rise - h * (2.0 * before.speed + after.speed);
      const double c3 = h * (before.speed + after.speed) - 2.0 * rise;
      angle[i] += before.angle + u * (c1 + u * (c2 + u * c3));
      speed[i] += (c1 + u * (2.0 * c2 + u * 3.0 * c3)) / h;
    }
  }
}

}  // namespace risley::simulation
