// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/rays.hpp"

#include "risley/core/require.hpp"
#include "risley/optics/batch.hpp"

#include "calibration/shot_blocks.hpp"

namespace risley::calibration {

Rays::Rays(const PrismTrain& train, const PrismGeometry& geometry,
           std::span<const std::vector<double>> rotation_angle,
           std::span<const std::uint8_t> emitter, estimation::ShotRange rows) {
  check_shape(train.shape());
  require_length("rotation_angle", rotation_angle.size(), train.prisms());
  const std::size_t shots = rotation_angle.front().size();
  for (const auto& column : rotation_angle) {
    require_length("rotation_angle of a prism", column.size(), shots);
  }
  require_length_or_none("beam", emitter.size(), shots);
  require_rows("rows", rows.begin, rows.end, shots);
  if (!emitter.empty()) emitter = emitter.subspan(rows.begin, rows.size());
  check_beams(train, emitter, rows.size());
  for (auto* column : {&x_, &y_, &z_, &origin_x_, &origin_y_, &origin_z_})
    column->resize(rows.size());
  for_each_block(rows.size(), [&](std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    std::vector<std::span<const double>> angles;
    for (const auto& column : rotation_angle) {
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
    observe_batch(train, angles, out, emitter.empty() ? emitter : emitter.subspan(begin, count));
  });
}

}  // namespace risley::calibration
