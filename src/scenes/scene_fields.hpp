// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <set>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/io/yaml_map.hpp"

/// Fields of scene files.
namespace risley::scenes {

/// rad
inline double angle(const io::YamlMap& map, std::string_view key, long double lower_deg,
                    long double upper_deg) {
  return radians_from_degrees(map.real(key, lower_deg, upper_deg, "deg"));
}

template <std::size_t N>
std::array<double, N> numbers(const io::YamlMap& map, std::string_view key, long double lower,
                              long double upper, std::string_view unit = "m") {
  std::array<double, N> values{};
  std::ranges::copy(map.reals(key, N, lower, upper, unit), values.begin());
  return values;
}

/// Names of the entries of a file so far.
using Names = std::set<std::string>;

/// The name of an entry, which must be unique.
inline std::string new_name(const io::YamlMap& map, Names& earlier) {
  std::string name = map.words("name");
  if (!earlier.insert(name).second) {
    io::fail_at(map.path(), map.at("name").line,
                fmt::format("{} = \"{}\" appears twice", map.field("name"), name));
  }
  return name;
}

}  // namespace risley::scenes
