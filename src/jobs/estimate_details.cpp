// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/estimate_details.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "risley/core/angle.hpp"
#include "risley/core/median.hpp"
#include "risley/estimation/observability.hpp"

namespace risley::jobs {
namespace {

using estimation::Estimate;
using estimation::ResidualMap;

constexpr std::size_t kPieces = 20;
constexpr double kDensityDuration = 0.5;  // s, as in [B21 Fig. 2b]
constexpr double kDensityCellDeg = 0.5;
constexpr double kFieldCell = radians_from_degrees(1.0);
constexpr double kCoarser = 2;  // cells of a sensor that scans all around, which has many
constexpr double kAngleCell = radians_from_degrees(10.0);
constexpr double kFewestShotsInCell = 5;  // shots that make a mean
constexpr double kFewestOfTypical = 0.1;  // and of a typical cell's shots

RotorSpeed rotor_speed(const estimation::RotorStates& states, std::size_t rotor) {
  constexpr double kRounding = 1e-9;
  RotorSpeed result;
  const std::vector<double>& speed = states.angular_velocity[rotor];
  result.mean = estimation::moments(speed, states.outlier).mean;
  result.change.reserve(speed.size());
  for (const double value : speed) {
    const double difference = value - result.mean;
    result.change.push_back(std::abs(difference) < kRounding * std::abs(result.mean) ? 0.0
                                                                                     : difference);
  }
  result.moments = estimation::moments(result.change, states.outlier);
  return result;
}

ResidualPlane plane_of(ResidualMap map) {
  ResidualPlane result;
  std::vector<std::uint64_t> counts = map.count;
  const double typical = counts.empty() ? 1.0 : static_cast<double>(upper_median(counts));
  // A rim cell grazed by few beams would dominate the colours of all others.
  result.fewest_shots = std::max(kFewestShotsInCell, std::ceil(kFewestOfTypical * typical));
  result.azimuth_noise = map.sigma_azimuth / std::sqrt(typical);
  result.zenith_noise = map.sigma_zenith / std::sqrt(typical);
  result.map = std::move(map);
  return result;
}

ShotDensity shot_density(const estimation::AngleSeries& head, double cell_deg) {
  ShotDensity result;
  result.duration = kDensityDuration;
  result.cell = radians_from_degrees(cell_deg);
  std::map<std::pair<long, long>, double> count;
  for (; result.total < head.size() && head.time(result.total) <= kDensityDuration;
       ++result.total) {
    const auto cell = [cell_deg](double angle) {
      return std::lround(std::floor(degrees_from_radians(angle) / cell_deg));
    };
    count[{cell(head.azimuth[result.total]), cell(head.zenith[result.total])}] += 1.0;
  }
  for (const auto& [place, shots] : count) {
    result.x.push_back(result.cell * (static_cast<double>(place.first) + 0.5));
    result.y.push_back(result.cell * (static_cast<double>(place.second) + 0.5));
    result.shots.push_back(shots);
  }
  if (!count.empty()) {
    result.mean_per_cell = static_cast<double>(result.total) / static_cast<double>(count.size());
  }
  return result;
}

}  // namespace

EstimateDetails estimate_details(const Estimate& estimate, const sensors::Sensor& nominal,
                                 const estimation::AngleSeries& head,
                                 const std::optional<estimation::Evaluation>& evaluation,
                                 const Progress& progress) {
  EstimateDetails result;
  progress.report(0.0);
  if (estimate.converged) {
    result.advice = estimation::observability_words(
        estimation::observability_of_estimate(estimate, progress.part(0.0, 0.2)),
        estimate.sensor.shape());
    progress.report(0.2);
    result.pieces =
        estimation::estimate_piecewise(estimate, nominal, kPieces, progress.part(0.2, 0.8));
  }
  for (int rotor = 0; rotor < estimate.states.prisms(); ++rotor) {
    result.speeds.push_back(rotor_speed(estimate.states, static_cast<std::size_t>(rotor)));
  }
  if (evaluation) {
    for (const auto& error : evaluation->rotation_angle_error) {
      result.rotation_angle_errors.push_back(estimation::moments(error, estimate.states.outlier));
    }
  }
  progress.report(0.8);
  const double coarser = estimate.sensor.train.layout().axis_up ? kCoarser : 1;
  result.residuals_over_field =
      plane_of(estimation::residuals_over_field(estimate, coarser * kFieldCell));
  for (int x = 0; x < estimate.states.prisms(); ++x) {
    for (int y = x + 1; y < estimate.states.prisms(); ++y) {
      progress.check();
      result.residuals_over_angles.push_back(
          {x, y, plane_of(estimation::residuals_over_angles(estimate, x, y, kAngleCell))});
    }
  }
  result.density = shot_density(head, coarser * kDensityCellDeg);
  progress.report(1.0);
  return result;
}

}  // namespace risley::jobs
