// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/rays.hpp"

#include <span>

#include "risley/optics/batch.hpp"

#include "calibration/entry_checks.hpp"
#include "calibration/shot_blocks.hpp"

namespace risley::calibration {

Rays::Rays(const PrismTrain& train, const PrismGeometry& geometry, const RangedShots& shots,
           estimation::ShotRange rows) {
  require_angle_columns(shots, train);
  require_rows("rows", rows.begin, rows.end, shots.size());
  const auto beam = shots.beam.empty() ? std::span<const std::uint8_t>()
                                       : std::span(shots.beam).subspan(rows.begin, rows.size());
  check_beams(train, beam, rows.size());
  for (auto* column : {&x_, &y_, &z_, &origin_x_, &origin_y_, &origin_z_})
    column->resize(rows.size());
  for_each_block(rows.size(), [&](std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    std::vector<std::span<const double>> angles;
    for (const auto& column : shots.rotation_angle) {
      angles.emplace_back(std::span(column).subspan(rows.begin + begin, count));
    }
    const auto part = [&](std::vector<double>& column) {
      return std::span(column).subspan(begin, count);
    };
    DirectionColumns out{part(x_), part(y_), part(z_), {}, {}};
    out.origin_x = part(origin_x_);
    out.origin_y = part(origin_y_);
    out.origin_z = part(origin_z_);
    out.geometry = geometry;
    observe_batch(train, angles, out, beam.empty() ? beam : beam.subspan(begin, count));
  });
}

}  // namespace risley::calibration
