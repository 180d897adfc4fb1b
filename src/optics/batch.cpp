// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/batch.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "optics/batch_kernel.hpp"

namespace risley {
namespace {

void check_length(std::string_view column, std::size_t length, std::size_t shots) {
  if (length != shots) {
    throw InvalidArgument(
        fmt::format("column {} has {} values, the rotation angles have {}", column, length, shots));
  }
}

/// What all kernels need, checked.
struct Call {
  BatchArguments arguments;
  std::vector<const double*> angle_columns;
  std::vector<double*> d_azimuth, d_zenith;
  std::vector<double> face_position;

  Call(const PrismTrain& train, std::span<const std::span<const double>> rotation_angles) {
    if (rotation_angles.size() != static_cast<std::size_t>(train.prisms())) {
      throw InvalidArgument(fmt::format("{} columns of rotation angles given for {} prisms",
                                        rotation_angles.size(), train.prisms()));
    }
    arguments.shots = rotation_angles.front().size();
    for (const auto column : rotation_angles) {
      check_length("rotation_angle", column.size(), arguments.shots);
      angle_columns.push_back(column.data());
    }
    arguments.rotation_angles = angle_columns.data();
    arguments.parameters = train.parameters().data();
    arguments.face_order = train.face_order().data();
    arguments.prisms = train.prisms();
  }

  double* column(std::string_view name, std::span<double> values, bool required) const {
    if (values.empty() && !required) return nullptr;
    check_length(name, values.size(), arguments.shots);
    return values.data();
  }
};

void check_available(InstructionSet set) {
  const auto& sets = available_instruction_sets();
  if (std::find(sets.begin(), sets.end(), set) == sets.end()) {
    throw InvalidArgument(
        fmt::format("this processor or binary has no {} instructions", to_string(set)));
  }
}

}  // namespace

std::string to_string(InstructionSet set) {
  switch (set) {
    case InstructionSet::baseline:
      return "baseline";
    case InstructionSet::avx2:
      return "avx2";
    case InstructionSet::avx512:
      return "avx512";
  }
  return "baseline";
}

const std::vector<InstructionSet>& available_instruction_sets() {
  static const std::vector<InstructionSet> sets = [] {
    std::vector<InstructionSet> found{InstructionSet::baseline};
#ifdef RISLEY_HAS_X86_KERNELS
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
      found.push_back(InstructionSet::avx2);
      if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
          __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
          __builtin_cpu_supports("avx512vl")) {
        found.push_back(InstructionSet::avx512);
      }
    }
#endif
    return found;
  }();
  return sets;
}

std::size_t observe_batch(const PrismTrain& train,
                          std::span<const std::span<const double>> rotation_angles,
                          const DirectionColumns& out, InstructionSet set) {
  check_available(set);
  Call call(train, rotation_angles);
  BatchArguments& a = call.arguments;
  a.direction[0] = call.column("x", out.x, false);
  a.direction[1] = call.column("y", out.y, false);
  a.direction[2] = call.column("z", out.z, false);
  a.azimuth = call.column("azimuth", out.azimuth, false);
  a.zenith = call.column("zenith", out.zenith, false);
  if (!out.origin_x.empty()) {
    call.face_position = face_positions(train.face_order(), out.geometry);
    a.face_position = call.face_position.data();
    a.origin[0] = call.column("origin_x", out.origin_x, true);
    a.origin[1] = call.column("origin_y", out.origin_y, true);
    a.origin[2] = call.column("origin_z", out.origin_z, true);
  }
#ifdef RISLEY_HAS_X86_KERNELS
  if (set == InstructionSet::avx512) return kernel_avx512::observe(a);
  if (set == InstructionSet::avx2) return kernel_avx2::observe(a);
#endif
  return kernel_baseline::observe(a);
}

std::size_t observe_batch(const PrismTrain& train,
                          std::span<const std::span<const double>> rotation_angles,
                          const DirectionColumns& out) {
  return observe_batch(train, rotation_angles, out, available_instruction_sets().back());
}

std::size_t linearise_batch(const PrismTrain& train,
                            std::span<const std::span<const double>> rotation_angles,
                            const LinearisationColumns& out, InstructionSet set) {
  check_available(set);
  Call call(train, rotation_angles);
  BatchArguments& a = call.arguments;
  const auto gradient = [&](std::string_view name, const std::vector<std::span<double>>& columns,
                            std::vector<double*>& pointers) {
    const auto expected =
        static_cast<std::size_t>(parameter_count(train.prisms()) + train.prisms());
    if (columns.size() != expected) {
      throw InvalidArgument(
          fmt::format("{} has {} columns, expected {}", name, columns.size(), expected));
    }
    for (const auto column : columns) pointers.push_back(call.column(name, column, true));
    return pointers.data();
  };
  a.azimuth = call.column("azimuth", out.azimuth, true);
  a.zenith = call.column("zenith", out.zenith, true);
  a.d_azimuth = gradient("d_azimuth", out.d_azimuth, call.d_azimuth);
  a.d_zenith = gradient("d_zenith", out.d_zenith, call.d_zenith);
#ifdef RISLEY_HAS_X86_KERNELS
  if (set == InstructionSet::avx512) return kernel_avx512::linearise(a);
  if (set == InstructionSet::avx2) return kernel_avx2::linearise(a);
#endif
  return kernel_baseline::linearise(a);
}

std::size_t linearise_batch(const PrismTrain& train,
                            std::span<const std::span<const double>> rotation_angles,
                            const LinearisationColumns& out) {
  return linearise_batch(train, rotation_angles, out, available_instruction_sets().back());
}

}  // namespace risley
