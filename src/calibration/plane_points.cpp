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
#include "risley/parallel/parallel.hpp"

#include "calibration/shot_blocks.hpp"

namespace risley::calibration {
namespace {

/// Shots of a block with a range and a valid direction, and the number of others.
struct SoundShots {
  RangedShots shots;
  std::vector<std::int64_t> time_ns;
  std::size_t without_range = 0, outliers = 0;
};

SoundShots sound_shots(const estimation::Estimate& estimate, estimation::ShotRange block) {
  const estimation::RotorStates states = states_of_shots(estimate, block);
  const estimation::AngleSeries rows = estimate.series.rows(block);
  SoundShots sound;
  std::vector<std::size_t> taken;
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!(rows.range[i] > 0.0)) {
      ++sound.without_range;
    } else if (states.outlier[i] != 0 || std::isnan(states.rotation_angle[0][i])) {
      ++sound.outliers;
    } else {
      taken.push_back(i);
    }
  }
  RangedShots& shots = sound.shots;
  shots.resize(estimate.sensor.prisms(), taken.size());
  sound.time_ns.resize(taken.size());
  const auto take = [&](const auto& from, auto& to, const auto& change) {
    for (std::size_t i = 0; i < taken.size(); ++i) to[i] = change(from[taken[i]]);
  };
  const auto same = [](auto value) { return value; };
  for (std::size_t k = 0; k < shots.rotation_angle.size(); ++k) {
    take(states.rotation_angle[k], shots.rotation_angle[k], wrap_to_pi);
  }
  for (std::size_t k = 0; k < shots.angle_covariance.size(); ++k) {
    take(states.rotation_angle_covariance[k], shots.angle_covariance[k],
         [](double value) { return static_cast<float>(value); });
  }
  take(rows.range, shots.range, same);
  take(rows.beam, shots.beam, same);
  if (!rows.intensity.empty()) {
    shots.intensity.resize(taken.size());
    take(rows.intensity, shots.intensity, same);
  }
  take(states.time_ns, sound.time_ns, same);
  return sound;
}

/// Copies the shots of an estimate in parallel, some megabytes of rotor states at a time.
void take_shots(const estimation::Estimate& estimate, RangedRecording& recording) {
  const std::size_t size = estimate.series.size();
  std::vector<SoundShots> blocks(block_count(size));
  for_each_block(size, [&](std::size_t begin, std::size_t end) {
    blocks[begin / kBlockShots] = sound_shots(estimate, {begin, end});
  });
  std::vector<std::size_t> first;
  std::size_t count = 0;
  for (const SoundShots& block : blocks) {
    first.push_back(count);
    count += block.shots.size();
    recording.without_range += block.without_range;
    recording.outliers += block.outliers;
  }
  RangedShots& shots = recording.shots;
  shots.resize(estimate.sensor.prisms(), count);
  if (!blocks.empty() && !blocks.front().shots.intensity.empty()) shots.intensity.resize(count);
  recording.time_ns.resize(count);
  for_each_block(size, [&](std::size_t begin, std::size_t) {
    const std::size_t number = begin / kBlockShots;
    const SoundShots block = std::move(blocks[number]);
    const auto put = [at = first[number]](const auto& from, auto& to) {
      std::ranges::copy(from, to.begin() + at);
    };
    for_each_column<kRangedShotColumns>(put, block.shots, shots);
    put(block.time_ns, recording.time_ns);
  });
}

}  // namespace

static_assert(lists_all_columns<RangedShots, kRangedShotColumns>());

void RangedShots::resize(int prisms, std::size_t shots) {
  require_between("number of prisms", prisms, 1, kMaxPrisms);
  rotation_angle.resize(prisms);
  angle_covariance.resize(prisms * (prisms + 1) / 2);
  // All at once: most of the time for long columns goes into first touching their memory.
  const std::size_t angles = prisms, covariances = angle_covariance.size();
  parallel::for_each(angles + covariances + 2, [&](std::size_t i) {
    if (i < angles) {
      rotation_angle[i].resize(shots);
    } else if (i < angles + covariances) {
      angle_covariance[i - angles].resize(shots);
    } else if (i == angles + covariances) {
      range.resize(shots);
    } else {
      beam.resize(shots);
    }
  });
}

RangedShots columns_like(const RangedShots& shots, std::size_t size) {
  RangedShots result;
  result.resize(shots.prisms(), size);
  if (!shots.intensity.empty()) result.intensity.resize(size);
  result.range_terms.assign(shots.range_terms.size(), std::vector<float>(size));
  return result;
}

RangedShots rows_of(const RangedShots& shots, const std::vector<std::size_t>& rows) {
  if (!rows.empty()) require_place("row", *std::ranges::max_element(rows), shots.size());
  RangedShots result = columns_like(shots, rows.size());
  for_each_block(rows.size(), [&](std::size_t begin, std::size_t end) {
    const auto take = [&](const auto& from, auto& to) {
      if (from.empty()) return;  // emitters that are not known
      for (std::size_t i = begin; i < end; ++i) to[i] = from[rows[i]];
    };
    for_each_column<kRangedShotColumns>(take, shots, result);
  });
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
  RangedRecording recording;
  recording.believed = estimate.sensor;
  recording.free = estimate.free;
  recording.covariance = estimate.covariance;
  recording.angle_sensitivity = estimate.common_angles->sensitivity;
  recording.mean_angle_covariance =
      algebra::SymmetricSolver(estimate.common_angles->information).inverse();
  recording.held_changes = estimate.held_changes;
  recording.serial = std::move(serial);
  take_shots(estimate, recording);
  if (recording.shots.size() == 0) {
    throw EstimationError(fmt::format("{}: no shot has both a direction and a range", name));
  }
  recording.name = std::move(name);
  return recording;
}

std::vector<std::size_t> spread_rows(std::size_t shots, std::size_t most) {
  // Places within equal parts by the golden ratio, which beats with nothing periodic.
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
