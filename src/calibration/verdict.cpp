// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/verdict.hpp"

#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"

namespace risley::calibration {
namespace {

bool contradicts(const PriorTest& test) {
  return test.degrees_of_freedom != 0 && !(test.chi2 <= test.critical);
}

}  // namespace

std::string reason_of_failure(const Calibration& c, const PlanarSolution& solution) {
  std::string reason;
  if (!solution.converged || !c.covariance.allFinite()) {
    reason = "the adjustment did not converge";
  }
  if (!c.unobservable.empty()) {
    reason = fmt::format(
        "the walls do not tell {}, only to {:.2g} degrees: walls tilted by 30 degrees and more "
        "against the axis do, or a prior (option prior_sigma)",
        estimation::direction_text(c.unobservable.front()), c.unobservable.front().sigma);
  }
  const PriorTest* worst = nullptr;
  for (const PriorTest& test : c.prior_tests) {
    if (!contradicts(test)) continue;
    if (worst == nullptr || test.chi2 > worst->chi2) worst = &test;
  }
  if (worst != nullptr) {
    reason = fmt::format(
        "{} {} contradicts the data: what is stated of it is off by {:.3g} degrees, chi2 {:.3g} "
        "where {:.3g} is the limit",
        worst->station ? "station" : "plane", worst->name, degrees_from_radians(worst->misfit),
        worst->chi2, worst->critical);
    std::string others;
    for (const PriorTest& test : c.prior_tests) {
      if (&test == worst || !contradicts(test)) continue;
      others += (others.empty() ? "" : ", ") + test.name;
    }
    if (!others.empty()) {
      reason += fmt::format("; so do {}: they contradict each other", others);
    }
  }
  return reason;
}

std::vector<std::string> warnings_of(const Calibration& c, const PlanarSolution& solution,
                                     const std::vector<RangedRecording>& recordings) {
  std::vector<std::string> warnings;
  const double boresight = std::hypot(c.datum.sigma_pitch, c.datum.sigma_yaw);
  if (boresight > kPoorDatum) {
    warnings.push_back(fmt::format(
        "the direction that all beams share is only known to {:.2g} degrees (pitch {:.2g}, yaw "
        "{:.2g}); their directions against each other to {:.2g}",
        degrees_from_radians(boresight), degrees_from_radians(c.datum.sigma_pitch),
        degrees_from_radians(c.datum.sigma_yaw), degrees_from_radians(c.datum.shape)));
  }
  for (const SurfaceStep& step : c.steps) {
    warnings.push_back(fmt::format(
        "{}: a region of {:.2g} degrees stands {:.0f} mm off plane {} (azimuth {:.1f}, zenith "
        "{:.1f}); its {} shots are left out",
        recordings[step.recording].name, degrees_from_radians(step.size), 1e3 * step.height,
        c.planes[step.plane].name, degrees_from_radians(step.azimuth),
        degrees_from_radians(step.zenith), step.points));
  }
  if (c.variance_factor > 1.0) {
    warnings.push_back(
        fmt::format("the walls are uneven: means over a square degree scatter {:.2g} times as much "
                    "as the noise "
                    "allows; variances are enlarged by that, and boresight may be off by more",
                    c.unevenness));
  }
  if (solution.lost > 0) {
    warnings.push_back(fmt::format("{} shots do not meet their plane", solution.lost));
  }
  return warnings;
}

}  // namespace risley::calibration
