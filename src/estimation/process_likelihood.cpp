// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/process_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/golden_section.hpp"
#include "risley/core/require.hpp"
#include "risley/parallel/parallel.hpp"

#include "estimation/knot_model.hpp"

namespace risley::estimation {
namespace {

/// Short recordings are cut into enough windows for their rotors' wander to show.
constexpr double kFewestWindows = 50.0;
constexpr std::size_t kFewestWindowShots = 8;
/// Distance of the other rotors from the linearisation within a window, before its data.
constexpr double kOtherSigma[] = {radians_from_degrees(1.0), radians_from_degrees(300.0),
                                  radians_from_degrees(1e5)};
/// Searched range of white acceleration, deg/s/sqrt(s), and white jerk, deg/s^2/sqrt(s), decades.
constexpr double kLowestAcceleration = -6, kHighestAcceleration = 3;
constexpr double kLowestJerk = -5, kHighestJerk = 8;
/// A motion model with one number more must be this much likelier.
constexpr double kWorthIt = 3.0;
constexpr int kRounds = 8;

RotorProcess process_of(double acceleration_decade, double jerk_decade) {
  const auto intensity = [](double decade) {
    return std::isfinite(decade) ? radians_from_degrees(std::pow(10.0, decade)) : 0.0;
  };
  return {intensity(acceleration_decade), 0.0, intensity(jerk_decade)};
}

constexpr double kNone = -std::numeric_limits<double>::infinity();

/// The decade that minimises a cost: steps of one decade, then a golden section around the best.
template <class Cost>
double best_decade(const Cost& cost, double lowest, double highest) {
  constexpr double kTolerance = 0.12;  // far below what the data resolve
  double best = highest, best_cost = std::numeric_limits<double>::infinity();
  for (double decade = highest; decade >= lowest - 1e-9; decade -= 1.0) {
    const double value = cost(decade);
    if (value < best_cost) {
      best_cost = value;
      best = decade;
    }
  }
  return golden_section_minimum(cost, best - 1.0, best + 1.0, kTolerance);
}

/// Length of the windows of a trajectory, s.
double window_length(const RotorTrajectory& at) {
  double covered = 0;
  for (std::size_t stretch = 0; stretch < at.stretch_begin.size(); ++stretch) {
    const std::size_t first = at.stretch_begin[stretch], last = at.stretch_end(stretch) - 1;
    covered += 1e-9 * static_cast<double>(at.time_ns[last] - at.time_ns[first]);
  }
  return std::clamp(covered / kFewestWindows, kKnotInterval, kRotorWindow);
}

}  // namespace

RotorWindows::RotorWindows(const NormalEquations& equations, const RotorTrajectory& at, int rotor,
                           std::size_t most_windows, double length) {
  require_between("rotor", rotor, 0, at.prisms - 1);
  require_length("gradient", equations.gradient.size(), at.state.size());
  using Square = KnotSquare<Eigen::Dynamic>;
  using Vector = KnotVector<Eigen::Dynamic>;
  const int prisms = at.prisms;
  const Eigen::Index states = at.states();
  // Own states first, followed by the others.
  std::vector<int> order{rotor};
  for (int k = 0; k < prisms; ++k) {
    if (k != rotor) order.push_back(k);
  }
  std::size_t stretch = 0, before = 0;
  for (std::size_t knot = 0; knot < at.size() && windows_.size() < most_windows;) {
    const bool fresh = stretch < at.stretch_begin.size() && at.stretch_begin[stretch] == knot;
    if (fresh) ++stretch;
    const std::size_t end =
        stretch < at.stretch_begin.size() ? at.stretch_begin[stretch] : at.size();
    const std::size_t first = knot;
    std::size_t shots = 0;
    while (knot < end) {
      const double span = 1e-9 * static_cast<double>(at.time_ns[knot] - at.time_ns[first]);
      if (span >= 0.95 * length && shots >= kFewestWindowShots) break;
      shots += at.last_shot[knot] - at.first_shot[knot];
      ++knot;
    }
    const std::size_t middle = first + (knot - first) / 2;
    Square curvature = Square::Zero(states, states);
    Vector gradient = Vector::Zero(states);
    const Vector center = Eigen::Map<const Vector>(at.state_of(middle).data(), states);
    for (std::size_t i = first; i < knot; ++i) {
      const double dt = 1e-9 * static_cast<double>(at.time_ns[i] - at.time_ns[middle]);
      // The knot's deviation as a function of the window's: T u + e.
      Square h = knot_curvature<Eigen::Dynamic>(equations, i);
      const Vector own_state = Eigen::Map<const Vector>(at.state_of(i).data(), states);
      const Vector e = motion_offset(center, own_state, dt);
      const double* own = equations.gradient.data() + i * static_cast<std::size_t>(states);
      Vector g = Eigen::Map<const Vector>(own, states) - h * e;
      for (int k = 0; k < prisms; ++k) {
        retreat_rows(g, 3 * k, dt);
        retreat_rows(h, 3 * k, dt);
      }
      for (int k = 0; k < prisms; ++k) retreat_columns(h, 3 * k, dt);
      curvature += h;
      gradient += g;
    }
    Square sorted(states, states);
    Vector sorted_gradient(states);
    for (int i = 0; i < prisms; ++i) {
      const int k = 3 * order[static_cast<std::size_t>(i)];
      sorted_gradient.segment<3>(3 * i) = gradient.segment<3>(k);
      for (int j = 0; j < prisms; ++j) {
        const int l = 3 * order[static_cast<std::size_t>(j)];
        sorted.block<3, 3>(3 * i, 3 * j) = curvature.block<3, 3>(k, l);
      }
    }
    Window window;
    window.curvature = sorted.topLeftCorner<3, 3>();
    window.gradient = sorted_gradient.head<3>();
    if (prisms > 1) {
      const Eigen::Index others = states - 3;
      for (Eigen::Index i = 0; i < others; ++i) {
        sorted(3 + i, 3 + i) += 1.0 / (kOtherSigma[i % 3] * kOtherSigma[i % 3]);
      }
      const Eigen::Matrix<double, Eigen::Dynamic, 3> cross = sorted.bottomLeftCorner(others, 3);
      const algebra::SymmetricSolver solver(sorted.bottomRightCorner(others, others));
      const Eigen::Matrix<double, Eigen::Dynamic, 3> share = solver.solve_columns(cross);
      window.curvature -= cross.transpose() * share;
      window.gradient -= share.transpose() * sorted_gradient.tail(others);
    }
    window.state = center.segment<3>(3 * rotor);
    if (!fresh && !windows_.empty()) {
      window.step = 1e-9 * static_cast<double>(at.time_ns[middle] - at.time_ns[before]);
      window.offset = motion_offset(windows_.back().state, window.state, window.step);
    }
    before = middle;
    windows_.push_back(window);
  }
}

double RotorWindows::log_likelihood(const RotorProcess& process) const {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d p;
  double sum = 0;
  for (const Window& window : windows_) {
    if (window.step > 0) {
      advance_rows(mean, 0, window.step);
      mean += window.offset;
      advance_rows(p, 0, window.step);
      advance_columns(p, 0, window.step);
      p += step_noise(process, window.step);
    } else {
      const Eigen::Vector3d sigma(kFirstAngleSigma, kFirstSpeedSigma,
                                  first_acceleration_sigma(process));
      p = sigma.array().square().matrix().asDiagonal();
      mean.setZero();
      if (!(process.jerk > 0)) mean[2] = -window.state[2];
    }
    const Eigen::Vector3d gradient = window.gradient - window.curvature * mean;
    double log_determinant = 0;
    if (!add_information(p, window.curvature, &log_determinant)) {
      return -std::numeric_limits<double>::infinity();
    }
    const Eigen::Vector3d step = p * gradient;
    sum += -0.5 * log_determinant + 0.5 * gradient.dot(step) -
           0.5 * mean.dot(window.curvature * mean) + window.gradient.dot(mean);
    mean += step;
  }
  return std::isfinite(sum) ? sum : -std::numeric_limits<double>::infinity();
}

std::vector<RotorProcess> likeliest_process(const NormalEquations& equations,
                                            const RotorTrajectory& linearisation) {
  constexpr std::size_t kMostWindows = 3000;
  const double length = window_length(linearisation);
  std::vector<RotorProcess> result(static_cast<std::size_t>(linearisation.prisms));
  parallel::for_each(result.size(), [&](int rotor) {
    const RotorWindows windows(equations, linearisation, rotor, kMostWindows, length);
    const auto cost = [&](double acceleration, double jerk) {
      return -windows.log_likelihood(process_of(acceleration, jerk));
    };
    const double walk_alone = best_decade([&](double a) { return cost(a, kNone); },
                                          kLowestAcceleration, kHighestAcceleration);
    const double jerk_alone =
        best_decade([&](double j) { return cost(kNone, j); }, kLowestJerk, kHighestJerk);
    // More numbers only if the data are this much likelier with them.
    RotorProcess best = process_of(walk_alone, kNone);
    double best_cost = cost(walk_alone, kNone);
    if (const double value = cost(kNone, jerk_alone); value + kWorthIt < best_cost) {
      best = process_of(kNone, jerk_alone);
      best_cost = value;
    }
    // Both together: each is then smaller than it would have to be alone. They trade off slowly, so
    // several rounds are made, as long as the gain is worth it.
    double walk = walk_alone, jerk = jerk_alone, both = std::numeric_limits<double>::infinity();
    for (int round = 0; round < kRounds; ++round) {
      const double before = both;
      walk = best_decade([&](double a) { return cost(a, jerk); }, walk_alone - 3.0, walk_alone);
      jerk = best_decade([&](double j) { return cost(walk, j); }, jerk_alone - 2.0, jerk_alone);
      both = cost(walk, jerk);
      if (before - both < 0.1 * kWorthIt || both > best_cost - 0.1 * kWorthIt) break;
    }
    if (both + kWorthIt < best_cost) best = process_of(walk, jerk);
    result[static_cast<std::size_t>(rotor)] = best;
  });
  return result;
}

}  // namespace risley::estimation
