// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/wall_flatness.hpp"

#include <cmath>

#include "risley/calibration/surface_steps.hpp"

namespace risley::calibration {
namespace {

/// Sigmas of a mean chi2, sqrt(2 / cells), beyond which it is more than chance.
constexpr double kBeyondChance = 4.0;

SurfaceReport inspect(const ViewDistances& d) {
  return inspect_surface({d.azimuth, d.zenith, d.distance, d.sigma});
}

}  // namespace

std::vector<SurfaceStep> leave_out_steps(const PlanarProblem& problem,
                                         std::vector<LabelledShots>& recordings) {
  std::vector<SurfaceStep> steps;
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    const std::size_t r = problem.views[v].recording;
    Labels& labels = recordings[r].labels;
    const ViewDistances d = view_distances(problem, v, recordings[r], labels.nearby);
    for (const StepRegion& step : inspect(d).steps) {
      for (const std::size_t row : step.rows) labels.view[d.rows[row]] = -1;
      steps.push_back(
          {r, v, step.height, step.azimuth, step.zenith, std::sqrt(step.solid_angle), step.points});
    }
  }
  return steps;
}

Evenness evenness_of(const PlanarProblem& problem, const std::vector<LabelledShots>& recordings) {
  double squares = 0, cells = 0;
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    const LabelledShots& recording = recordings[problem.views[v].recording];
    const SurfaceReport report =
        inspect(view_distances(problem, v, recording, recording.labels.view));
    squares += report.unevenness * static_cast<double>(report.cells);
    cells += static_cast<double>(report.cells);
  }
  Evenness result;
  if (cells == 0) return result;
  result.unevenness = squares / cells;
  const double significant = 1.0 + kBeyondChance * std::sqrt(2.0 / cells);
  if (result.unevenness > significant) result.variance_factor = result.unevenness;
  return result;
}

}  // namespace risley::calibration
