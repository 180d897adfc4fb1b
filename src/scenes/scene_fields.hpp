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

inline double number(const io::YamlMap& map, std::string_view key, long double lower,
                     long double upper, std::string_view unit) {
  return static_cast<double>(map.number(key, lower, upper, unit));
}

/// rad
inline double angle(const io::YamlMap& map, std::string_view key, long double lower_deg,
                    long double upper_deg) {
  return radians_from_degrees(number(map, key, lower_deg, upper_deg, "deg"));
}

template <std::size_t N>
std::array<double, N> numbers(const io::YamlMap& map, std::string_view key, long double lower,
                              long double upper, std::string_view unit = "m") {
  const io::YamlMap::Entry& entry = map.at(key);
  if (!entry.value.is_list() || entry.value.items.size() != N) {
    io::fail_at(map.path(), entry.line,
                fmt::format("{}: expected a list of {} numbers in {}", map.field(key), N, unit));
  }
  std::array<double, N> values{};
  for (std::size_t i = 0; i < N; ++i) {
    const std::string field = fmt::format("{}[{}]", map.field(key), i);
    values[i] = static_cast<double>(io::yaml_number(entry.value.items[i], map.path(), field));
    if (values[i] < lower || values[i] > upper) {
      io::fail_at(
          map.path(), entry.line,
          fmt::format("{} = {:g} {}, allowed {:g} to {:g}", field, values[i], unit, lower, upper));
    }
  }
  return values;
}

/// The names that entries of a file have so far.
using Names = std::set<std::string>;

/// The name of an entry that no earlier entry has.
inline std::string new_name(const io::YamlMap& map, Names& earlier) {
  std::string name = map.text("name");
  if (name.empty()) io::fail_at(map.path(), map.at("name").line, map.field("name") + " is empty");
  if (!earlier.insert(name).second) {
    io::fail_at(map.path(), map.at("name").line,
                fmt::format("{} = \"{}\" appears twice", map.field("name"), name));
  }
  return name;
}

/// Calls read(YamlMap) for every map of a list that may be absent.
template <class Read>
void for_each_map(const io::YamlMap& root, std::string_view key, Read&& read) {
  const io::YamlMap::Entry* entry = root.find(key);
  if (entry == nullptr) return;
  if (!entry->value.is_list()) {
    io::fail_at(root.path(), entry->line, fmt::format("{}: expected a list", root.field(key)));
  }
  for (std::size_t i = 0; i < entry->value.items.size(); ++i) {
    read(
        io::YamlMap(entry->value.items[i], root.path(), fmt::format("{}[{}]", root.field(key), i)));
  }
}

}  // namespace risley::scenes
