// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/rotor_track.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "risley/core/angle.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/normal_equations.hpp"

#include "estimation/block_fit.hpp"
#include "estimation/entry_checks.hpp"

namespace risley::estimation {
namespace {

/// Uncertainty of the start if only few shots decided it.
constexpr double kStartAngleSigma = radians_from_degrees(5.0);
constexpr double kStartSpeedSigma = radians_from_degrees(100.0);
/// A prediction this uncertain may lie in a neighbouring minimum: then a grid of angles is tried.
constexpr double kLostSigma = radians_from_degrees(8.0);
constexpr int kGridHalf = 12;  // steps to half a turn
constexpr double kGridStep = radians_from_degrees(15.0);

/// Fewest shots of a window for a scale of residuals.
constexpr std::size_t kFewestShots = 12;

class Tracker {
 public:
  Tracker(const AngleSeries& series, const Start& start, const AngleNoise& noise)
      : series_(series), start_(start), prisms_(start.train.prisms()) {
    weights_.angle_noise = noise;
    knot_.prisms = prisms_;
    knot_.stretch_begin = {0};
    knot_.state.resize(static_cast<std::size_t>(knot_.states()));
    usual_level_ = std::max(1.0, start.residual_rms / noise.rms());
  }

  /// Updates a state with the shots of some rows. @return whether there were any
  bool update(RotorState& state, ShotRange rows) {
    if (rows.size() == 0) return false;
    const RotorState predicted = state;
    double uncertain = 0;
    for (int k = 0; k < prisms_; ++k) {
      uncertain = std::max(uncertain, std::sqrt(state.covariance(3 * k, 3 * k)));
    }
    if (uncertain > kLostSigma) look_around(state, rows, 3.0 * uncertain);
    if (!improve(state, predicted, rows)) return false;
    if (!lost(rows)) return true;
    // The prediction is invalid, such as that of a piece whose times repeat.
    RotorState anew = predicted;
    for (int k = 0; k < prisms_; ++k) anew.covariance(3 * k, 3 * k) = kPi * kPi;
    const RotorState loose = anew;
    look_around(anew, rows, kPi);
    if (improve(anew, loose, rows) && !lost(rows)) state = anew;
    return true;
  }

 private:
  void accumulate_at(const RotorState& state, ShotRange rows) {
    knot_.time_ns = {state.time_ns};
    knot_.first_shot = {rows.begin};
    knot_.last_shot = {rows.end};
    std::copy_n(state.mean.data(), knot_.state.size(), knot_.state.begin());
    rows_ = rows;
    residuals_.resize(2 * series_.size());
    accumulate(series_, knot_, start_.train, {}, weights_, equations_,
               {{residuals_.data(), series_.size()},
                {residuals_.data() + series_.size(), series_.size()},
                {}});
  }

  /// Gauss-Newton steps from a state to the shots and the prediction together.
  bool improve(RotorState& state, const RotorState& predicted, ShotRange rows) {
    constexpr int kRounds = 4;
    for (int round = 0; round < kRounds; ++round) {
      accumulate_at(state, rows);
      weights_.softening = softening_at(level());
      accumulate_at(state, rows);
      if (!step_towards(equations_, predicted, state)) {
        state = predicted;
        return false;
      }
    }
    return true;
  }

  /// Residuals not explained by noise or wandering rotors.
  bool lost(ShotRange rows) const {
    constexpr double kLostResidual = radians_from_degrees(1.0);
    return rows.size() >= kFewestShots && !(scale() < kLostResidual);
  }

  /// Scale of the residuals of the rows, rad.
  double scale() const {
    return robust_scale({residuals_.data() + rows_.begin, rows_.size()},
                        {residuals_.data() + series_.size() + rows_.begin, rows_.size()});
  }

  /// Scale of the residuals over the noise; that of the start if shots are few.
  double level() const {
    if (rows_.size() < kFewestShots) return usual_level_;
    return std::clamp(scale() / weights_.angle_noise.rms(), 1.0, 1e6);
  }

  /// Moves the angles to the best of a grid about the prediction.
  void look_around(RotorState& state, ShotRange rows, double reach) {
    const double softening = std::exchange(weights_.softening, softening_at(10.0 * usual_level_));
    const int half = std::clamp(static_cast<int>(std::ceil(reach / kGridStep)), 1, kGridHalf);
    std::vector<int> offset(static_cast<std::size_t>(prisms_), -half);
    RotorState best = state;
    double least = std::numeric_limits<double>::infinity();
    for (;;) {
      RotorState trial = state;
      for (int k = 0; k < prisms_; ++k) {
        trial.mean[3 * k] += kGridStep * offset[static_cast<std::size_t>(k)];
      }
      accumulate_at(trial, rows);
      if (equations_.cost < least) {
        least = equations_.cost;
        best = trial;
      }
      std::size_t digit = 0;
      while (digit < offset.size() && ++offset[digit] > half) offset[digit++] = -half;
      if (digit == offset.size()) break;
    }
    state.mean = best.mean;
    weights_.softening = softening;
  }

  const AngleSeries& series_;
  const Start& start_;
  int prisms_;
  ShotWeights weights_;
  RotorTrajectory knot_;
  NormalEquations equations_;
  std::vector<double> residuals_;
  ShotRange rows_;
  double usual_level_;
};

}  // namespace

void track_rotors(const AngleSeries& series, ShotRange shots, const Start& start,
                  const AngleNoise& noise, RotorTrajectory& knots, std::size_t first,
                  std::size_t last) {
  require_rows("shots", shots.begin, shots.end, series.size());
  require_rows("knots", first, last, knots.size());
  require_length("state", knots.state.size(),
                 knots.size() * static_cast<std::size_t>(knots.states()));
  require_start(start, knots.prisms);
  check_noise(noise);
  Tracker tracker(series, start, noise);
  const auto step_ns = static_cast<std::int64_t>(start.motion.window * 1e9);
  const auto rows_about = [&](std::int64_t middle) {
    const auto begin = series.time_ns.begin();
    const auto from = begin + static_cast<std::ptrdiff_t>(shots.begin);
    const auto to = begin + static_cast<std::ptrdiff_t>(shots.end);
    return ShotRange{
        static_cast<std::size_t>(std::lower_bound(from, to, middle - step_ns / 2) - begin),
        static_cast<std::size_t>(std::lower_bound(from, to, middle + step_ns / 2) - begin)};
  };
  // Windows are straight: the change of a rotor's speed within one is noise of the next.
  RotorState at_start = state_of(start, kStartAngleSigma, [](double) { return kStartSpeedSigma; });
  tracker.update(at_start, rows_about(start.time_ns));
  const auto follow = [&](std::int64_t direction) {
    std::vector<RotorState> states{at_start};
    const std::int64_t end =
        direction > 0 ? series.time_ns[shots.end - 1] : series.time_ns[shots.begin];
    RotorState now = at_start;
    while (direction * (end - now.time_ns) > 0) {
      predict(now, now.time_ns + direction * step_ns, start.motion.process);
      if (tracker.update(now, rows_about(now.time_ns))) states.push_back(now);
    }
    if (now.time_ns != states.back().time_ns) states.push_back(now);  // only predicted
    return states;
  };
  std::vector<RotorState> points = follow(-1);
  std::reverse(points.begin(), points.end());
  const std::vector<RotorState> ahead = follow(1);
  points.insert(points.end(), ahead.begin() + 1, ahead.end());
  std::size_t near = 0;
  for (std::size_t knot = first; knot < last; ++knot) {
    const std::int64_t time = knots.time_ns[knot];
    while (near + 1 < points.size() &&
           std::llabs(points[near + 1].time_ns - time) < std::llabs(points[near].time_ns - time)) {
      ++near;
    }
    const double seconds = 1e-9 * static_cast<double>(time - points[near].time_ns);
    const auto state = knots.state_of(knot);
    for (std::size_t k = 0; k < static_cast<std::size_t>(knots.prisms); ++k) {
      const auto at = static_cast<Eigen::Index>(3 * k);
      state[3 * k] = points[near].mean[at] + seconds * points[near].mean[at + 1];
      state[3 * k + 1] = points[near].mean[at + 1];
      state[3 * k + 2] = 0;
    }
  }
}

}  // namespace risley::estimation
