// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/setting.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

namespace risley {
namespace {

constexpr Setting kFilesToRead[] = {kSetting.accuracy,   kSetting.calibration,
                                    kSetting.control,    kSetting.flight,
                                    kSetting.from,       kSetting.mount,
                                    kSetting.plan,       kSetting.planes,
                                    kSetting.recording,  kSetting.scene,
                                    kSetting.sensor,     kSetting.stations,
                                    kSetting.trajectory, kSetting.trajectory_errors,
                                    kSetting.truth};

/// What flags end in.
struct FlagUnit {
  std::string_view ending, unit, si_unit;
  double si_per_unit = 1;
};

constexpr FlagUnit kUnits[] = {
    {"-deg", "deg", "rad", kRadiansPerDegree},
    {"-hz", "Hz", "Hz"},
    {"-m", "m", "m"},
    {"-ms", "ms", "s", 1e-3},
    {"-ppm", "ppm", "", 1e-6},
    {"-s", "s", "s"},
    {"", "", ""},
};

const FlagUnit& unit_of(Setting setting) {
  return *std::find_if(std::begin(kUnits), std::end(kUnits),
                       [&](const FlagUnit& unit) { return setting.flag.ends_with(unit.ending); });
}

std::atomic<SettingStyle> written_as{
    SettingStyle::option};  // NOLINT(*-avoid-non-const-global-variables): of the process

/// A value as spelled by the front end.
std::string in_its_unit(Setting setting, double value) {
  const double per_unit = written_as == SettingStyle::flag ? unit_of(setting).si_per_unit : 1;
  return fmt::format("{:.12g}", value / per_unit);
}

[[noreturn]] void refuse(Setting setting, double value, const std::string& allowed) {
  const FlagUnit& unit = unit_of(setting);
  const std::string_view text = written_as == SettingStyle::flag ? unit.unit : unit.si_unit;
  throw InvalidArgument(fmt::format("{} = {}{}{}, allowed {}", name_of(setting),
                                    in_its_unit(setting, value), text.empty() ? "" : " ", text,
                                    allowed));
}

}  // namespace

void write_settings_as(SettingStyle style) { written_as = style; }

std::string flag_of(Setting setting) { return fmt::format("--{}", setting.flag); }

std::string keyword_of(Setting setting) {
  const std::string_view flag = setting.flag;
  if (flag == kSetting.bend_time.flag) return "bend_s";  // beside what bends
  std::string keyword(flag.substr(0, flag.size() - unit_of(setting).ending.size()));
  std::replace(keyword.begin(), keyword.end(), '-', '_');
  return keyword;
}

std::string name_of(Setting setting) {
  if (written_as == SettingStyle::flag) return flag_of(setting);
  const std::string keyword = keyword_of(setting);
  return written_as == SettingStyle::keyword ? keyword : "option " + keyword;
}

bool names_file_to_read(std::string_view option) {
  return std::any_of(std::begin(kFilesToRead), std::end(kFilesToRead),
                     [&](Setting setting) { return flag_of(setting) == option; });
}

void require_positive(Setting setting, double value) {
  if (!(value > 0) || !std::isfinite(value)) refuse(setting, value, "above 0");
}

void require_not_negative(Setting setting, double value) {
  if (!(value >= 0) || !std::isfinite(value)) refuse(setting, value, "0 and above");
}

void require_between(Setting setting, double value, double lowest, double highest) {
  if (value >= lowest && value <= highest) return;
  refuse(setting, value,
         fmt::format("{} to {}", in_its_unit(setting, lowest), in_its_unit(setting, highest)));
}

}  // namespace risley
