// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/batch.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "risley/core/require.hpp"

#include "optics/batch_kernel.hpp"

namespace risley {
namespace {

/// What all kernels need, checked.
struct Call {
  BatchArguments arguments;
  std::vector<const double*> angle_columns;
  std::vector<double*> d_azimuth, d_zenith;
  std::vector<double> face_position;

  Call(const PrismTrain& train, std::span<const std::span<const double>> rotation_angles,
       std::span<const std::uint8_t> beam) {
    check_shape(train.shape());
    require_length("rotation_angles", rotation_angles.size(),
                   static_cast<std::size_t>(train.prisms()));
    arguments.shots = rotation_angles.front().size();
    for (const auto column : rotation_angles) {
      require_length("a column of rotation_angles", column.size(), arguments.shots);
      angle_columns.push_back(column.data());
    }
    arguments.rotation_angles = angle_columns.data();
    arguments.parameters = train.parameters().data();
    arguments.face_order = train.face_order().data();
    arguments.prisms = train.prisms();
    arguments.emitters = train.emitters();
    check_beams(train, beam, arguments.shots);
    if (!beam.empty()) arguments.beam = beam.data();
  }

  double* column(std::string_view name, std::span<double> values, bool required) const {
    if (values.empty() && !required) return nullptr;
    require_length(name, values.size(), arguments.shots);
    return values.data();
  }
};

}  // namespace

void check_beams(const PrismTrain& train, std::span<const std::uint8_t> beam, std::size_t shots) {
  if (beam.empty()) return;
  require_length("beam", beam.size(), shots);
  std::array<std::uint8_t, 64> mosts{};  // loops of a fixed length are vectorised
  std::size_t i = 0;
  for (; i + mosts.size() <= beam.size(); i += mosts.size()) {
    for (std::size_t k = 0; k < mosts.size(); ++k) mosts[k] = std::max(mosts[k], beam[i + k]);
  }
  for (std::size_t k = 0; i + k < beam.size(); ++k) mosts[k] = std::max(mosts[k], beam[i + k]);
  const std::uint8_t most = *std::max_element(mosts.begin(), mosts.end());
  if (most < train.emitters()) return;
  throw InvalidArgument(fmt::format("beam = {} in row {}, allowed 0 to {}", most,
                                    std::find(beam.begin(), beam.end(), most) - beam.begin(),
                                    train.emitters() - 1));
}

std::size_t observe_batch(const PrismTrain& train,
                          std::span<const std::span<const double>> rotation_angles,
                          const DirectionColumns& out, std::span<const std::uint8_t> beam,
                          InstructionSet set) {
  Call call(train, rotation_angles, beam);
  BatchArguments& a = call.arguments;
  a.direction[0] = call.column("x", out.x, false);
  a.direction[1] = call.column("y", out.y, false);
  a.direction[2] = call.column("z", out.z, false);
  a.azimuth = call.column("azimuth", out.azimuth, false);
  a.zenith = call.column("zenith", out.zenith, false);
  if (!out.origin_x.empty() || !out.origin_y.empty() || !out.origin_z.empty()) {
    call.face_position = face_positions(train.face_order(), out.geometry);
    a.face_position = call.face_position.data();
    a.origin[0] = call.column("origin_x", out.origin_x, true);
    a.origin[1] = call.column("origin_y", out.origin_y, true);
    a.origin[2] = call.column("origin_z", out.origin_z, true);
  }
  return RISLEY_KERNEL_COPIES(observe).at(set)(a);
}

std::size_t linearise_batch(const PrismTrain& train,
                            std::span<const std::span<const double>> rotation_angles,
                            const LinearisationColumns& out, std::span<const std::uint8_t> beam,
                            InstructionSet set) {
  Call call(train, rotation_angles, beam);
  BatchArguments& a = call.arguments;
  const auto gradient = [&](std::string_view name, const std::vector<std::span<double>>& columns,
                            std::vector<double*>& pointers) {
    const auto expected = static_cast<std::size_t>(parameter_count(train.shape()) + train.prisms());
    require_length(name, columns.size(), expected);
    const std::string one = fmt::format("a column of {}", name);
    for (const auto column : columns) pointers.push_back(call.column(one, column, true));
    return pointers.data();
  };
  a.azimuth = call.column("azimuth", out.azimuth, true);
  a.zenith = call.column("zenith", out.zenith, true);
  a.d_azimuth = gradient("d_azimuth", out.d_azimuth, call.d_azimuth);
  a.d_zenith = gradient("d_zenith", out.d_zenith, call.d_zenith);
  return RISLEY_KERNEL_COPIES(linearise).at(set)(a);
}

}  // namespace risley
