// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/flight_unknowns.hpp"

#include <algorithm>
#include <array>

#include "risley/core/error.hpp"

namespace risley::report {
namespace {

struct NamedUnknown {
  const char *name, *long_name, *symbol, *unit;
  double scale;
};

constexpr std::array<NamedUnknown, 8> kMountUnknowns = {{
    {"boresight_x_deg", "boresight about the sensor's X", "β_X", "deg", 1},
    {"boresight_y_deg", "boresight about the sensor's Y", "β_Y", "deg", 1},
    {"boresight_z_deg", "boresight about the sensor's Z", "β_Z", "deg", 1},
    {"lever_arm_x_m", "lever arm forward", "l_x", "m", 1},
    {"lever_arm_y_m", "lever arm to the right", "l_y", "m", 1},
    {"lever_arm_z_m", "lever arm down", "l_z", "m", 1},
    {"range_offset_m", "range offset, which the sensor adds to every range", "c", "mm", 1e3},
    {"clock_offset_s", "clock offset, added to the recording's times", "τ", "ms", 1e3},
}};

const NamedUnknown* find_named(std::string_view name) {
  const auto* const found = std::find_if(kMountUnknowns.begin(), kMountUnknowns.end(),
                                         [&](const auto& one) { return one.name == name; });
  return found == kMountUnknowns.end() ? nullptr : found;
}

}  // namespace

bool is_of_train(std::string_view name) { return find_named(name) == nullptr; }

UnknownInfo unknown_info(const std::string& name, TrainShape shape) {
  if (const NamedUnknown* named = find_named(name)) {
    return {named->long_name, named->symbol, named->unit, named->scale};
  }
  try {
    const ParameterInfo& info = find_parameter(name, shape);
    return {info.long_name, info.symbol, info.unit};
  } catch (const InvalidArgument&) {
    return {name, name, ""};
  }
}

std::string words_of_unknowns(std::string_view text, TrainShape shape) {
  std::string result;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string long_name = unknown_info(std::string(text.substr(0, end)), shape).long_name;
    if (!result.empty()) result += ' ';
    result += long_name.substr(0, long_name.find(','));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return result;
}

}  // namespace risley::report
