// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/io/text_table.hpp"
#include "risley/trajectories/trajectory.hpp"
#include "risley/trajectories/trajectory_file.hpp"

namespace risley::trajectories {

/// Data that identify the format of a file.
struct FileHead {
  std::string name;        ///< of the file, in lower case
  std::string bytes;       ///< its beginning
  std::uint64_t size = 0;  ///< of the whole file
  bool has_ending(std::string_view ending) const { return name.ends_with(ending); }
};

/// Number of bytes examined at the beginning of a file.
inline constexpr std::size_t kHeadBytes = 16384;

/// One format of trajectories. Adding one means a file in this folder that defines one of these,
/// and one line in the list of trajectory_file.cpp.
struct Format {
  std::string_view name;    ///< Trajectory::format
  std::string_view ending;  ///< for writing; empty when it is read-only
  std::string_view description;
  bool (*recognises)(const FileHead& head);
  Trajectory (*read)(const std::string& path, const Progress& progress);
  /// nullptr when the format is read-only; as write_trajectory.
  std::vector<std::string> (*write)(const std::string& path, const Trajectory& trajectory);
};

extern const Format kSbetFormat;              // sbet.cpp
extern const Format kInertialExplorerFormat;  // inertial_explorer.cpp
extern const Format kPospacFormat;            // pospac.cpp
extern const Format kOpenmmsFormat;           // openmms.cpp
extern const Format kNamedCsvFormat;          // named_csv.cpp
extern const Format kTumFormat;               // tum.cpp
extern const Format kRtklibFormat;            // rtklib.cpp
extern const Format kKittiFormat;             // kitti.cpp
extern const Format kRosBagFormat;            // ros_bag.cpp

bool is_smrmsg(const FileHead& head);  // smrmsg.cpp

/// The complete lines at the beginning of a text, without carriage returns; none if it is not text.
std::vector<std::string_view> lines_of(std::string_view head);

/// The numbers of a line of text; nothing if it has another number of fields, or one that is not a
/// number.
template <std::size_t N>
std::optional<std::array<double, N>> numbers_in(std::string_view line, char delimiter) {
  std::array<std::string_view, N> fields;
  std::array<double, N> numbers{};
  if (io::split_fields(line, delimiter, fields) != N) return std::nullopt;
  try {
    for (std::size_t i = 0; i < N; ++i) numbers[i] = io::decimal_field(fields[i], "").value;
  } catch (const io::BadRow&) {
    return std::nullopt;
  }
  return numbers;
}

/// The numbers of a binary record.
template <std::size_t N>
std::array<double, N> numbers_of(const std::uint8_t* record) {
  std::array<double, N> numbers;
  for (std::size_t i = 0; i < N; ++i) numbers[i] = io::load<double>(record + 8 * i);
  return numbers;
}

}  // namespace risley::trajectories
