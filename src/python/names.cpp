// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "python/names.hpp"

#include <array>

#include "risley/core/angle.hpp"

namespace risley::python {
namespace {

/// Endings of names in files, apart from those in SI units.
constexpr std::array<std::string_view, 4> kUnits = {"_deg_per_s", "_deg", "_m", "_s"};

/// A parameter by either name.
/// @param find  returns the entry of a name in files, null if there is none
template <class Find>
NamedParameter find_by_either_name(const std::string& name, const Find& find) {
  if (const ParameterInfo* info = find(name)) return {info, info->si_per_unit};
  for (const std::string_view unit : kUnits) {
    if (const ParameterInfo* info = find(name + std::string(unit))) return {info, 1.0};
  }
  return {};
}

}  // namespace

std::string si_name(const std::string& file_name) {
  for (const std::string_view unit : kUnits) {
    if (file_name.ends_with(unit)) return file_name.substr(0, file_name.size() - unit.size());
  }
  return file_name;
}

NamedParameter named_parameter(const std::string& name, TrainShape shape) {
  const NamedParameter known =
      find_by_either_name(name, [&](std::string_view wanted) -> const ParameterInfo* {
        for (const ParameterInfo& info : parameter_list(shape)) {
          if (info.name == wanted) return &info;
        }
        return nullptr;
      });
  return known.info != nullptr ? known : NamedParameter{&find_parameter(name, shape), 1.0};
}

NamedParameter parameter_of_any_train(const std::string& name) {
  return find_by_either_name(name, find_parameter_of_any_train);
}

std::string unit_of(const std::string& file_name) {
  if (file_name.ends_with("_deg_per_s")) return "deg/s";
  if (file_name.ends_with("_deg")) return "deg";
  if (file_name.ends_with("_m")) return "m";
  return file_name.ends_with("_s") ? "s" : "1";
}

std::string si_unit(const std::string& file_unit) {
  if (file_unit == "deg") return "rad";
  return file_unit == "deg/s" ? "rad/s" : file_unit;
}

FileUnit file_unit(const std::string& si_unit) {
  if (si_unit == "rad") return {"deg", kRadiansPerDegree};
  return si_unit == "rad/s" ? FileUnit{"deg/s", kRadiansPerDegree} : FileUnit{si_unit, 1};
}

}  // namespace risley::python
