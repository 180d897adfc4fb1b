// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/batch.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include <fmt/format.h>

#include "risley/core/require.hpp"

#include "optics/batch_kernel.hpp"

namespace risley {
namespace {

/// What all kernels need, checked.
struct KernelColumns {
  BatchArguments arguments;
  std::vector<const double*> angle_columns;
  std::vector<double*> d_azimuth, d_zenith;
  std::vector<double> face_position;

  KernelColumns(const PrismTrain& train, std::span<const std::span<const double>> rotation_angles,
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
    arguments.prisms = train.layout();
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
  // Eight beams at a time: the addition carries a byte that is too large into its highest bit.
  constexpr std::uint64_t kOnes = 0x0101010101010101, kLow = 0x7f * kOnes, kHigh = 0x80 * kOnes;
  const std::uint64_t lift = (0x80 - static_cast<std::uint64_t>(train.emitters())) * kOnes;
  std::uint64_t over = 0;
  const auto take = [&](std::uint64_t beams) { over |= (((beams & kLow) + lift) | beams) & kHigh; };
  std::size_t i = 0;
  for (; i + 8 <= beam.size(); i += 8) {
    std::uint64_t beams = 0;
    std::memcpy(&beams, beam.data() + i, 8);
    take(beams);
  }
  for (; i < beam.size(); ++i) take(beam[i]);
  if (over == 0) return;
  const std::uint8_t most = *std::max_element(beam.begin(), beam.end());
  throw InvalidArgument(fmt::format("beam = {} in row {}, allowed 0 to {}", most,
                                    std::find(beam.begin(), beam.end(), most) - beam.begin(),
                                    train.emitters() - 1));
}

std::size_t observe_batch(const PrismTrain& train,
                          std::span<const std::span<const double>> rotation_angles,
                          const DirectionColumns& out, std::span<const std::uint8_t> beam,
                          InstructionSet set) {
  KernelColumns own(train, rotation_angles, beam);
  BatchArguments& a = own.arguments;
  a.direction[0] = own.column("x", out.x, false);
  a.direction[1] = own.column("y", out.y, false);
  a.direction[2] = own.column("z", out.z, false);
  a.azimuth = own.column("azimuth", out.azimuth, false);
  a.zenith = own.column("zenith", out.zenith, false);
  if (!out.origin_x.empty() || !out.origin_y.empty() || !out.origin_z.empty()) {
    own.face_position = face_positions(train.face_order(), out.geometry);
    a.face_position = own.face_position.data();
    a.origin[0] = own.column("origin_x", out.origin_x, true);
    a.origin[1] = own.column("origin_y", out.origin_y, true);
    a.origin[2] = own.column("origin_z", out.origin_z, true);
  }
  return RISLEY_KERNEL_COPIES(observe).at(set)(a);
}

std::size_t linearise_batch(const PrismTrain& train,
                            std::span<const std::span<const double>> rotation_angles,
                            const LinearisationColumns& out, std::span<const std::uint8_t> beam,
                            InstructionSet set) {
  KernelColumns own(train, rotation_angles, beam);
  BatchArguments& a = own.arguments;
  const auto gradient = [&](std::string_view name, const std::vector<std::span<double>>& columns,
                            std::vector<double*>& pointers) {
    const auto expected = static_cast<std::size_t>(parameter_count(train.shape()) + train.prisms());
    require_length(name, columns.size(), expected);
    const std::string one = fmt::format("a column of {}", name);
    for (const auto column : columns) pointers.push_back(own.column(one, column, false));
    return pointers.data();
  };
  a.azimuth = own.column("azimuth", out.azimuth, true);
  a.zenith = own.column("zenith", out.zenith, true);
  a.d_azimuth = gradient("d_azimuth", out.d_azimuth, own.d_azimuth);
  a.d_zenith = gradient("d_zenith", out.d_zenith, own.d_zenith);
  return RISLEY_KERNEL_COPIES(linearise).at(set)(a);
}

}  // namespace risley
