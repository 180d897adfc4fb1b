// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/wall_flatness.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "risley/calibration/surface_steps.hpp"
#include "risley/parallel/parallel.hpp"

namespace risley::calibration {
namespace {

/// The surface of every view, from the shots with some labels; rows of steps are those of the
/// view's recording.
template <class LabelsOf>
std::vector<SurfaceReport> inspect_views(const PlanarProblem& problem,
                                         const std::vector<LabelledShots>& recordings,
                                         const LabelsOf& labels_of) {
  std::vector<SurfaceReport> reports(problem.views.size());
  // The largest first: otherwise one thread would be left with it at the end.
  std::vector<std::size_t> order(reports.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    return problem.views[a].shots->size() > problem.views[b].shots->size();
  });
  parallel::for_each(order.size(), [&](std::size_t i) {
    const std::size_t v = order[i];
    const LabelledShots& recording = recordings[problem.views[v].recording];
    const ViewDistances d = view_distances(problem, v, recording, labels_of(recording.labels));
    reports[v] = inspect_surface({d.azimuth, d.zenith, d.distance, d.sigma});
    for (StepRegion& step : reports[v].steps) {
      for (std::size_t& row : step.rows) row = d.rows[row];
    }
  });
  return reports;
}

}  // namespace

std::vector<SurfaceStep> leave_out_steps(const PlanarProblem& problem,
                                         std::vector<LabelledShots>& recordings) {
  const std::vector<SurfaceReport> reports = inspect_views(
      problem, recordings, [](const Labels& labels) -> const auto& { return labels.nearby; });
  std::vector<SurfaceStep> steps;
  for (std::size_t v = 0; v < reports.size(); ++v) {
    const std::size_t r = problem.views[v].recording;
    for (const StepRegion& step : reports[v].steps) {
      for (const std::size_t row : step.rows) recordings[r].labels.view[row] = -1;
      steps.push_back(
          {r, v, step.height, step.azimuth, step.zenith, std::sqrt(step.solid_angle), step.points});
    }
  }
  return steps;
}

}  // namespace risley::calibration
