// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/io/text_table.hpp"

#include "trajectories/formats/format.hpp"
#include "trajectories/formats/pose_table.hpp"

/// Text exported by Applanix POSPac: lines about the project, a line of 20 names with commas, a
/// line of units, rows with blanks. Eastings and northings are of a map projection and not read.
namespace risley::trajectories {
namespace {

/// In lower case.
constexpr FieldName kPospacNames[] = {
    {"time", PoseField::time},
    {"latitude", PoseField::latitude},
    {"lat", PoseField::latitude},
    {"longitude", PoseField::longitude},
    {"long", PoseField::longitude},
    {"ellipsoid height", PoseField::height},
    {"roll", PoseField::roll},
    {"pitch", PoseField::pitch},
    {"heading", PoseField::heading},
    {"east velocity", PoseField::velocity_1},
    {"north velocity", PoseField::velocity_2},
    {"up velocity", PoseField::velocity_3},
    {"north sd", PoseField::sigma_north},
    {"east sd", PoseField::sigma_east},
    {"height sd", PoseField::sigma_down},
    {"roll sd", PoseField::sigma_roll},
    {"pitch sd", PoseField::sigma_pitch},
    {"heading sd", PoseField::sigma_heading},
};

std::vector<std::string> pospac_names(std::string_view line) {
  std::vector<std::string> names;
  for (const std::string_view field : io::fields_of(line, ',')) {
    names.push_back(lower_case(std::string(field)));
  }
  return names;
}

bool are_pospac_names(std::string_view line) {
  const std::vector<std::string> names = pospac_names(line);
  const auto has = [&](std::string_view name) {
    return std::ranges::find(names, name) != names.end();
  };
  return has("time") && has("distance") && (has("latitude") || has("lat")) && has("roll") &&
         has("pitch") && has("heading");
}

bool is_pospac(const FileHead& head) {
  const std::vector<std::string_view> lines = lines_of(head.bytes);
  return std::ranges::any_of(lines, are_pospac_names);
}

Trajectory read_pospac(const std::string& path, const Progress& progress) {
  PoseTable table;
  table.delimiter = io::kBlanks;
  table.has_footer = true;
  table.contents.format = "pospac";
  table.contents.time_scale = TimeScale::gps_second_of_week;
  table.contents.velocity_axes = VelocityAxes::east_north_up;
  io::LineReader lines(path, io::LinesOf::table);
  std::string_view line;
  std::string names, units;
  while (lines.next(line)) {
    if (!are_pospac_names(line)) continue;
    names = line;
    table.first_row = lines.line_number() + 1;
    break;
  }
  while (lines.next(line)) {
    const std::string_view text = io::trimmed(line);
    if (text.empty()) continue;
    if (text.starts_with('(')) {
      units = lower_case(std::string(text));
      table.first_row = lines.line_number() + 1;
    }
    break;
  }
  std::vector<Warning> warnings;
  // "(time in Sec, ..., orientation angles and SD in Degrees, ...)"
  bool degrees = false, arc_minutes = false;
  for (const std::string_view clause : io::fields_of(units, ',')) {
    const auto has = [clause](std::string_view word) { return clause.find(word) != clause.npos; };
    if (has("position") || !has("sd")) continue;
    arc_minutes = arc_minutes || has("arc");
    degrees = degrees || has("deg");
  }
  if (!degrees && !arc_minutes) {
    warnings.push_back({kWarning.unit_guessed,
                        "the unit of the standard deviations of roll, pitch and heading is not "
                        "stated: degrees are assumed",
                        {{}, table.first_row - 1}});
  }
  const std::uint64_t names_line = table.first_row - 1;
  const bool heights = names.find("ELLIPSOID HEIGHT") != names.npos;
  for (const std::string& name : pospac_names(names)) {
    PoseColumn column;
    column.name = io::printable(name);
    for (const FieldName& known : kPospacNames) {
      if (known.name == name && !has_field(table.columns, known.field)) column.field = known.field;
    }
    // "H" after the longitude, if the other height has another name.
    const bool is_height = !heights && (name == "h" || name == "height") &&
                           has_field(table.columns, PoseField::longitude) &&
                           !has_field(table.columns, PoseField::height);
    if (is_height) column.field = PoseField::height;
    if (is_angle(column.field)) column.scale = kRadiansPerDegree;
    if (is_angle_sigma(column.field)) {
      column.scale = kRadiansPerDegree / (arc_minutes ? 60 : 1);
    }
    table.columns.push_back(std::move(column));
  }
  const auto missing = missing_fields(table.columns, {{PoseField::time, "TIME"},
                                                      {PoseField::latitude, "LATITUDE"},
                                                      {PoseField::longitude, "LONGITUDE"},
                                                      {PoseField::height, "ELLIPSOID HEIGHT"},
                                                      {PoseField::roll, "ROLL"},
                                                      {PoseField::pitch, "PITCH"},
                                                      {PoseField::heading, "HEADING"}});
  if (!missing.empty()) {
    throw FileError(path, {{}, names_line},
                    fmt::format("column {} is missing", fmt::join(missing, ", ")));
  }
  take_contents(table, warnings);
  return read_pose_table(path, table, progress, warnings);
}

}  // namespace

const Format kPospacFormat{"pospac",  "",          "text exported by Applanix POSPac",
                           is_pospac, read_pospac, nullptr};

}  // namespace risley::trajectories
