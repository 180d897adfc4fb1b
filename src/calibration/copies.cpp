// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/copies.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

namespace risley::calibration {
namespace {

/// Number of shots of a recording searched in the others.
constexpr std::size_t kLookedFor = 200;
/// Share of them that only a copy can have.
constexpr double kCopiedPart = 0.9;
/// Rounding by formats: coordinates to 1 mm, which moves the range by that and the rotation angles,
/// found with all shots together, by less than this. Two readings of 2 cm noise differ by more.
constexpr double kSameRange = 1e-3;  // m
constexpr double kSameAngle = radians_from_degrees(0.05);

/// Cells of two rotation angles, twice as wide as the search tolerance.
constexpr std::int64_t kCells = 3600;
constexpr double kCell = kTwoPi / kCells;

std::int64_t cell_of(double angle) {
  const auto cell = static_cast<std::int64_t>(std::floor(wrap_to_two_pi(angle) / kCell));
  return std::clamp<std::int64_t>(cell, 0, kCells - 1);
}

/// One shot to search for.
struct Sought {
  std::size_t recording = 0;
  double angle_a = 0, angle_b = 0, range = 0;
  std::uint8_t beam = 0;
};

Sought shot_of(const RangedShots& shots, std::size_t row) {
  Sought shot;
  shot.angle_a = shots.rotation_angle[0][row];
  if (shots.prisms() > 1) shot.angle_b = shots.rotation_angle[1][row];
  shot.range = shots.range[row];
  if (!shots.beam.empty()) shot.beam = shots.beam[row];
  return shot;
}

bool is_same(const Sought& a, const Sought& b) {
  return a.beam == b.beam && std::abs(a.range - b.range) <= kSameRange &&
         std::abs(wrap_to_pi(a.angle_a - b.angle_a)) <= kSameAngle &&
         std::abs(wrap_to_pi(a.angle_b - b.angle_b)) <= kSameAngle;
}

}  // namespace

void require_no_copies(const std::vector<RangedRecording>& recordings) {
  if (recordings.size() < 2) return;
  std::vector<Sought> sought;
  std::vector<bool> marked(kCells * kCells);
  std::unordered_map<std::int64_t, std::vector<std::size_t>> by_cell;
  std::vector<std::size_t> count;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const RangedShots& shots = recordings[r].shots;
    const std::vector<std::size_t> rows = spread_rows(shots.size(), kLookedFor);
    count.push_back(rows.size());
    for (const std::size_t row : rows) {
      Sought shot = shot_of(shots, row);
      shot.recording = r;
      const std::int64_t a = cell_of(shot.angle_a), b = cell_of(shot.angle_b);
      for (std::int64_t i = -1; i <= 1; ++i) {
        for (std::int64_t j = -1; j <= 1; ++j) {
          const std::int64_t cell =
              ((a + i + kCells) % kCells) * kCells + (b + j + kCells) % kCells;
          marked[cell] = true;
          by_cell[cell].push_back(sought.size());
        }
      }
      sought.push_back(shot);
    }
  }
  std::vector<std::size_t> seen_in(sought.size(), recordings.size());
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const RangedShots& shots = recordings[r].shots;
    std::vector<std::size_t> found(recordings.size(), 0);
    for (std::size_t row = 0; row < shots.size(); ++row) {
      const Sought shot = shot_of(shots, row);
      const std::int64_t cell = cell_of(shot.angle_a) * kCells + cell_of(shot.angle_b);
      if (!marked[cell]) continue;
      for (const std::size_t i : by_cell.at(cell)) {
        const std::size_t other = sought[i].recording;
        if (other == r || seen_in[i] == r || !is_same(sought[i], shot)) continue;
        seen_in[i] = r;
        ++found[other];
      }
    }
    for (std::size_t other = 0; other < recordings.size(); ++other) {
      if (static_cast<double>(found[other]) <
          std::max(1.0, kCopiedPart * static_cast<double>(count[other]))) {
        continue;
      }
      const auto [first, second] = std::minmax(r, other);
      throw InvalidArgument(
          fmt::format("{} and {} hold the same shots, and a copy adds nothing: omit one of them",
                      recordings[first].name, recordings[second].name));
    }
  }
}

}  // namespace risley::calibration
