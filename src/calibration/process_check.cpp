// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/process_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "risley/core/median.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;

/// A jump is significant beyond this many sigmas: there are thousands of steps.
constexpr double kJumpSigmas = 5;
/// One jump also shows in the neighbouring steps, up to here.
constexpr double kJumpsApart = 4;  // s
/// Share of a step's variance that the flight must determine.
constexpr double kLeastDetermined = 1e-3;
/// The process counts as larger than stated beyond this many sigmas of chi2, if it is this many
/// times as large. If one error is present, the others are less certain.
constexpr double kProcessSigmas = 5, kLeastRatio = 1.3;
constexpr double kOthersSigmas = 1, kOthersRatio = 1.1;
/// No conclusion from less, and only a weak one from less than the second number.
constexpr double kLeastExpected = 1, kHardlyTold = 15;

/// Share of the information of all steps that must remain away from jumps. Median of chi2 with one
/// degree of freedom.
constexpr double kLeastLeft = 0.15, kMedianOfChi2 = 0.4549;

/// Between two steps, s; 0 for neighbours.
double seconds_apart(const TrajectoryKnots& knots, std::size_t a, std::size_t b) {
  const auto [first, last] = std::minmax(a, b);
  if (first == last) return 0;
  return 1e-9 * static_cast<double>(knots.time_ns[last] - knots.time_ns[first + 1]);
}

double largest_score(const ProcessCheck& check, Index step) {
  return check.score.col(step).cwiseAbs().maxCoeff();
}

}  // namespace

ProcessCheck check_process(const TrajectoryKnots& knots, const Eigen::MatrixXd& corrections,
                           const FlightPriors& priors, const FlightSystem::Band& band) {
  const Index count = knots.size();
  ProcessCheck check;
  check.score = Eigen::MatrixXd::Zero(kCorrections, std::max<Index>(count - 1, 0));
  check.determined = check.jump = check.score;
  check.chi2 = check.expected = Eigen::VectorXd::Zero(kCorrections);
  for (int c = 0; c < kCorrections; ++c) {
    const KnotSteps steps = knot_steps(knots, priors.process, c, priors.breaks);
    for (Index k = 0; k < count; ++k) {
      const Index at = kCorrections * k + c;
      double off = corrections(c, k), variance = band.diagonal[at];
      if (k > 0) {
        const double decay = steps.decay[k];
        off -= decay * corrections(c, k - 1);
        variance +=
            decay * (decay * band.diagonal[at - kCorrections] - 2 * band.next[at - kCorrections]);
      }
      const double before = steps.sigma[k] * steps.sigma[k];
      const double determined = std::clamp(1 - variance / before, 0.0, 1.0);
      check.chi2[c] += off * off / before;
      check.expected[c] += determined;
      if (k == 0 || determined < kLeastDetermined) continue;
      check.determined(c, k - 1) = determined;
      check.score(c, k - 1) = off / std::sqrt(before * determined);
      check.jump(c, k - 1) = off / determined;
    }
  }
  return check;
}

std::vector<std::size_t> jumps_of(const TrajectoryKnots& knots, const ProcessCheck& check) {
  std::vector<Index> steps;
  for (Index k = 0; k < check.score.cols(); ++k) {
    if (largest_score(check, k) > kJumpSigmas) steps.push_back(k);
  }
  std::ranges::sort(
      steps, [&](Index a, Index b) { return largest_score(check, a) > largest_score(check, b); });
  std::vector<std::size_t> jumps;
  for (const Index k : steps) {
    const bool far = std::ranges::all_of(
        jumps, [&](std::size_t other) { return seconds_apart(knots, other, k) > kJumpsApart; });
    if (far) jumps.push_back(k);
  }
  std::ranges::sort(jumps);
  return jumps;
}

Eigen::VectorXd process_factors(const TrajectoryKnots& knots, const ProcessCheck& check,
                                bool alerted) {
  const std::vector<std::size_t> jumps = jumps_of(knots, check);
  Eigen::VectorXd chi2 = Eigen::VectorXd::Zero(kCorrections), expected = chi2;
  for (Index k = 0; k < check.score.cols(); ++k) {
    if (std::ranges::any_of(jumps, [&](std::size_t jump) {
          return seconds_apart(knots, jump, k) <= kJumpsApart;
        })) {
      continue;
    }
    chi2 += check.score.col(k).cwiseAbs2().cwiseProduct(check.determined.col(k));
    expected += check.determined.col(k);
  }
  // If jumps are everywhere, the median of all steps is more informative than the remaining ones.
  const Eigen::VectorXd of_all = check.determined.rowwise().sum();
  if (expected.sum() < kLeastLeft * of_all.sum()) {
    expected = of_all;
    for (Index c = 0; c < kCorrections; ++c) {
      std::vector<double> squares;
      for (Index k = 0; k < check.score.cols(); ++k) {
        if (check.determined(c, k) > 0) squares.push_back(std::pow(check.score(c, k), 2));
      }
      chi2[c] = squares.empty() ? 0 : expected[c] * median(squares) / kMedianOfChi2;
    }
  }
  const auto factors_beyond = [&](double sigmas, double least) {
    Eigen::VectorXd factors = Eigen::VectorXd::Ones(kCorrections);
    for (Index c = 0; c < kCorrections; ++c) {
      const double ratio = chi2[c] / std::max(expected[c], kLeastExpected);
      if (chi2[c] - expected[c] > sigmas * std::sqrt(2 * expected[c]) && ratio > least) {
        factors[c] = std::sqrt(ratio);
      }
    }
    return factors;
  };
  Eigen::VectorXd ones = Eigen::VectorXd::Ones(kCorrections);
  if (!alerted && factors_beyond(kProcessSigmas, kLeastRatio) == ones) return ones;
  Eigen::VectorXd factors = factors_beyond(kOthersSigmas, kOthersRatio);
  double sum = 0, count = 0;
  for (Index c = 0; c < kCorrections; ++c) {
    if (expected[c] < kHardlyTold) continue;
    sum += factors[c];
    ++count;
  }
  for (Index c = 0; c < kCorrections; ++c) {
    if (expected[c] < kHardlyTold && count > 0) factors[c] = std::max(factors[c], sum / count);
  }
  return factors;
}

}  // namespace risley::calibration
