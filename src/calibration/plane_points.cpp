// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/plane_points.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/prism.hpp"

namespace risley::calibration {
namespace {

/// Shots whose rotor states are in memory at a time: some megabytes.
constexpr std::size_t kStatesBlock = 65536;

}  // namespace

void RangedShots::resize(int prisms, std::size_t shots) {
  require_between("number of prisms", prisms, 1, kMaxPrisms);
  const auto n = static_cast<std::size_t>(prisms);
  rotation_angle.resize(n);
  angle_covariance.resize(n * (n + 1) / 2);
  for (auto& column : rotation_angle) column.resize(shots);
  for (auto& column : angle_covariance) column.resize(shots);
  range.resize(shots);
  beam.resize(shots);
}

void RangedShots::set_row(std::size_t row, const RangedShots& from, std::size_t from_row) {
  for (std::size_t k = 0; k < rotation_angle.size(); ++k) {
    rotation_angle[k][row] = from.rotation_angle[k][from_row];
  }
  for (std::size_t k = 0; k < angle_covariance.size(); ++k) {
    angle_covariance[k][row] = from.angle_covariance[k][from_row];
  }
  range[row] = from.range[from_row];
  beam[row] = from.beam.empty() ? std::uint8_t{0} : from.beam[from_row];
}

RangedShots rows_of(const RangedShots& shots, const std::vector<std::size_t>& rows) {
  if (!rows.empty())
    require_place("row", *std::max_element(rows.begin(), rows.end()), shots.size());
  RangedShots result;
  result.resize(shots.prisms(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) result.set_row(i, shots, rows[i]);
  return result;
}

RangedRecording ranged_recording(const estimation::Estimate& estimate, std::string name,
                                 std::string serial) {
  if (!estimate.converged) {
    throw EstimationError(
        fmt::format("{}: the rotation angles were not found: {}", name, estimate.reason));
  }
  if (!estimate.common_angles || !estimate.series.has_ranges()) {
    throw EstimationError(fmt::format(
        "{}: calibration needs ranges, and an estimate of all shots at once (method map)", name));
  }
  const int prisms = estimate.sensor.prisms();
  RangedRecording recording;
  recording.believed = estimate.sensor;
  recording.free = estimate.free;
  recording.covariance = estimate.covariance;
  recording.angle_sensitivity = estimate.common_angles->sensitivity;
  recording.mean_angle_covariance =
      algebra::SymmetricSolver(estimate.common_angles->information).inverse();
  recording.held_changes = estimate.held_changes;
  recording.serial = std::move(serial);
  RangedShots& shots = recording.shots;
  shots.resize(prisms, estimate.series.size());
  recording.time_ns.resize(estimate.series.size());
  std::size_t row = 0;
  for (std::size_t begin = 0; begin < estimate.series.size(); begin += kStatesBlock) {
    const std::size_t end = std::min(begin + kStatesBlock, estimate.series.size());
    const estimation::RotorStates states = states_of_shots(estimate, {begin, end});
    const estimation::AngleSeries rows = estimate.series.rows({begin, end});
    for (std::size_t i = 0; i < states.size(); ++i) {
      const double range = rows.range[i];
      if (!(range > 0.0)) {
        ++recording.without_range;
        continue;
      }
      if (states.outlier[i] != 0 || std::isnan(states.rotation_angle[0][i])) {
        ++recording.outliers;
        continue;
      }
      for (std::size_t k = 0; k < shots.rotation_angle.size(); ++k) {
        shots.rotation_angle[k][row] = std::remainder(states.rotation_angle[k][i], kTwoPi);
      }
      for (std::size_t k = 0; k < shots.angle_covariance.size(); ++k) {
        shots.angle_covariance[k][row] = static_cast<float>(states.rotation_angle_covariance[k][i]);
      }
      shots.range[row] = range;
      shots.beam[row] = rows.beam[i];
      recording.time_ns[row] = states.time_ns[i];
      ++row;
    }
  }
  shots.resize(prisms, row);
  recording.time_ns.resize(row);
  if (row == 0) {
    throw EstimationError(fmt::format("{}: no shot has both a direction and a range", name));
  }
  recording.name = std::move(name);
  return recording;
}

std::vector<std::size_t> spread_rows(std::size_t shots, std::size_t most) {
  // Places within equal parts by the golden ratio, which falls into step with nothing periodic.
  constexpr double kGolden = 0.6180339887498949;
  const std::size_t count = std::min(shots, most);
  std::vector<std::size_t> rows(count);
  const double part =
      static_cast<double>(shots) / static_cast<double>(std::max<std::size_t>(count, 1));
  for (std::size_t i = 0; i < count; ++i) {
    const double place = std::fmod(0.5 + kGolden * static_cast<double>(i), 1.0);
    rows[i] = static_cast<std::size_t>((static_cast<double>(i) + place) * part);
  }
  return rows;
}

}  // namespace risley::calibration
