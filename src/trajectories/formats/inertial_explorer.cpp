// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/io/text_table.hpp"

#include "trajectories/formats/format.hpp"
#include "trajectories/formats/pose_table.hpp"

/// Text of NovAtel's (Waypoint's) Inertial Explorer: lines about the project, a line of names of
/// columns, a line of their units, rows. The exporting user chooses the columns.
namespace risley::trajectories {
namespace {

/// In lower case.
constexpr FieldName kExplorerNames[] = {
    {"week", PoseField::gps_week},
    {"gpsweek", PoseField::gps_week},
    {"date", PoseField::date},
    {"gpsdate", PoseField::date},
    {"gpstime", PoseField::time},
    {"corrtime", PoseField::time},
    {"latitude", PoseField::latitude},
    {"longitude", PoseField::longitude},
    {"h-ell", PoseField::height},
    {"roll", PoseField::roll},
    {"pitch", PoseField::pitch},
    {"heading", PoseField::heading},
    {"veast", PoseField::velocity_1},
    {"vnorth", PoseField::velocity_2},
    {"vup", PoseField::velocity_3},
    {"sdnorth", PoseField::sigma_north},
    {"sdeast", PoseField::sigma_east},
    {"sdheight", PoseField::sigma_down},
    {"sdup", PoseField::sigma_down},
    {"rollsd", PoseField::sigma_roll},
    {"pitchsd", PoseField::sigma_pitch},
    {"hdngsd", PoseField::sigma_heading},
    {"headingsd", PoseField::sigma_heading},
};

constexpr std::size_t kLongestHeader = 200;  // lines

/// A name or unit and its end in the line.
struct ExplorerWord {
  std::string text;
  std::size_t end = 0;
};

/// Names or units of a line: words, of which one in parentheses may contain blanks.
std::vector<ExplorerWord> placed_words(std::string_view line) {
  std::vector<ExplorerWord> words;
  for (std::size_t i = 0; i < line.size();) {
    if (line[i] == ' ' || line[i] == '\t' || line[i] == ',') {
      ++i;
      continue;
    }
    std::size_t end = 0;
    if (line[i] == '(' && line.find(')', i) != line.npos) {
      end = line.find(')', i) + 1;
    } else {
      end = std::min(line.find_first_of(" \t,", i), line.size());
    }
    words.push_back({lower_case(std::string(line.substr(i, end - i))), end});
    i = end;
  }
  return words;
}

std::vector<std::string> words_of_line(std::string_view line) {
  std::vector<std::string> words;
  for (ExplorerWord& word : placed_words(line)) words.push_back(std::move(word.text));
  return words;
}

/// The units of names, one each; columns without a unit have none written. Both lines end their
/// columns at the same places, or have commas; otherwise the units are those written.
std::vector<std::string> units_of(std::string_view names_line, std::string_view units_line) {
  const std::vector<ExplorerWord> names = placed_words(names_line);
  const std::vector<ExplorerWord> written = placed_words(units_line);
  std::vector<std::string> units;
  if (written.size() >= names.size()) return words_of_line(units_line);
  const std::vector<std::string_view> fields = io::fields_of(units_line, ',');
  if (fields.size() == names.size()) {
    for (const std::string_view field : fields) units.push_back(lower_case(std::string(field)));
    return units;
  }
  constexpr std::size_t kApart = 2;
  units.resize(names.size());
  std::size_t at = 0;
  for (const ExplorerWord& unit : written) {
    while (at < names.size() && names[at].end + kApart < unit.end) ++at;
    if (at == names.size() || names[at].end > unit.end + kApart) return words_of_line(units_line);
    units[at++] = unit.text;
  }
  return units;
}

bool has_word(const std::vector<std::string>& words, std::string_view word) {
  return std::ranges::find(words, word) != words.end();
}

/// Whether these are the lines of names and of units.
bool are_explorer_names(std::string_view names, std::string_view units) {
  if (units.find('(') == units.npos) return false;
  const std::vector<std::string> words = words_of_line(names);
  return (has_word(words, "latitude") || has_word(words, "x-ecef")) &&
         (has_word(words, "heading") || has_word(words, "roll") || has_word(words, "gpstime") ||
          has_word(words, "corrtime"));
}

bool is_explorer(const FileHead& head) {
  const std::vector<std::string_view> lines = lines_of(head.bytes);
  for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
    if (lines[i].find("Inertial Explorer") != lines[i].npos) return true;
    if (are_explorer_names(lines[i], lines[i + 1])) return true;
  }
  return false;
}

/// Content of a header apart from names and units.
struct ExplorerHeader {
  std::vector<std::string> names, units;
  std::uint64_t names_line = 0;
  /// Factor by which standard deviations were multiplied.
  double position_scale = 1, attitude_scale = 1;
  std::vector<Warning> warnings;
};

/// The factor after "Position:", 1 for "No scaling".
std::optional<double> scaling_of(std::string_view line) {
  const auto colon = line.find(':');
  const std::string text = lower_case(std::string(io::trimmed(line.substr(colon + 1))));
  if (text.starts_with("no scaling")) return 1;
  const std::vector<std::string_view> words = io::fields_of(text, io::kBlanks);
  if (words.empty()) return std::nullopt;
  try {
    const double scale = io::decimal_field(words[0], "").value;
    if (scale > 0 && scale < 1e3) return scale;
  } catch (const io::BadRow&) {
    return std::nullopt;
  }
  return std::nullopt;
}

ExplorerHeader read_explorer_header(const std::string& path) {
  ExplorerHeader header;
  io::LineReader lines(path, io::LinesOf::table);
  std::string_view line;
  std::string before;
  bool in_scaling = false;
  while (lines.next(line) && lines.line_number() <= kLongestHeader) {
    const std::string_view text = io::trimmed(line);
    if (are_explorer_names(before, line)) {
      header.names = words_of_line(before);
      header.units = units_of(before, line);
      header.names_line = lines.line_number() - 1;
      return header;
    }
    const bool is_scaling = text.find("caling") != text.npos && text.ends_with(':');
    if (is_scaling) in_scaling = true;
    const bool position = text.starts_with("Position:"), attitude = text.starts_with("Attitude:");
    if (in_scaling && (position || attitude)) {
      const auto scale = scaling_of(text);
      if (!scale) {
        header.warnings.push_back({kWarning.unit_guessed,
                                   fmt::format("\"{}\" is not a known scaling of standard "
                                               "deviations: they are taken as one sigma",
                                               io::printable(text)),
                                   {{}, lines.line_number()}});
      } else {
        (position ? header.position_scale : header.attitude_scale) = *scale;
        if (*scale != 1) {
          header.warnings.push_back({kWarning.values_changed,
                                     fmt::format("standard deviations of the {} were written {:g} "
                                                 "times as large: they are divided by that",
                                                 position ? "position" : "attitude", *scale),
                                     {{}, lines.line_number()}});
        }
      }
    }
    before = line;
  }
  throw FileError(
      path, {},
      "has no line of column names with a line of their units below it; expected text of Inertial "
      "Explorer with GPSTime, Latitude, Longitude, H-Ell, Roll, Pitch and Heading");
}

/// A possible unit of columns, and its factor.
struct ExplorerUnit {
  std::string_view written;  ///< in lower case
  double scale = 1;
  bool sexagesimal = false;
  DateOrder date_order = DateOrder::ymd;
};

constexpr ExplorerUnit kDates[] = {{""},
                                   {"(ymd)"},
                                   {"(y/m/d)"},
                                   {"(mdy)", 1, false, DateOrder::mdy},
                                   {"(m/d/y)", 1, false, DateOrder::mdy},
                                   {"(dmy)", 1, false, DateOrder::dmy},
                                   {"(d/m/y)", 1, false, DateOrder::dmy}};
constexpr ExplorerUnit kSeconds[] = {{""}, {"(sec)"}, {"(s)"}};
constexpr ExplorerUnit kAngles[] = {{"(deg)", kRadiansPerDegree},
                                    {"(degrees)", kRadiansPerDegree},
                                    {"(+/-deg)", kRadiansPerDegree},
                                    {"(+/-d m s)", kRadiansPerDegree, true},
                                    {"(d m s)", kRadiansPerDegree, true},
                                    {"(deg min sec)", kRadiansPerDegree, true},
                                    {"(rad)"},
                                    {"(radians)"},
                                    {"(arcmin)", kRadiansPerDegree / 60},
                                    {"(arcsec)", kRadiansPerDegree / 3600}};
constexpr ExplorerUnit kMetres[] = {{"(m)"}};
constexpr ExplorerUnit kSpeeds[] = {{"(m/s)"}};

/// The units of a field, and the one to name if it has another.
std::pair<std::span<const ExplorerUnit>, const char*> units_for(PoseField field) {
  if (is_angle(field) || is_angle_sigma(field)) return {kAngles, "(deg) or (+/-D M S)"};
  if (field == PoseField::date) return {kDates, "(YMD), (MDY) or (DMY)"};
  if (field == PoseField::time) return {kSeconds, "(sec)"};
  if (field == PoseField::height || field >= PoseField::sigma_north) return {kMetres, "(m)"};
  if (field >= PoseField::velocity_1) return {kSpeeds, "(m/s)"};
  return {};
}

/// Sets scale and fields of a column by its unit. @throws FileError
void set_unit(PoseColumn& column, const std::string& unit, const std::string& path,
              std::uint64_t line) {
  // Unused columns may take three fields, too.
  const bool unused = column.field == PoseField::unused;
  const auto [units, expected] =
      unused ? std::pair{std::span(kAngles), ""} : units_for(column.field);
  if (units.empty()) return;
  const auto found = std::ranges::find(units, unit, &ExplorerUnit::written);
  if (found != units.end()) {
    column.scale = found->scale;
    column.sexagesimal = found->sexagesimal;
    column.date_order = found->date_order;
  } else if (!unused) {
    throw FileError(
        path, {{}, line},
        fmt::format("column {} has {}, expected {}", column.name,
                    unit.empty() ? "no unit" : "the unit " + io::printable(unit), expected));
  }
}

Trajectory read_explorer(const std::string& path, const Progress& progress) {
  ExplorerHeader header = read_explorer_header(path);
  const auto refuse = [&](const std::string& problem) {
    throw FileError(path, {{}, header.names_line}, problem);
  };
  if (header.names.size() != header.units.size()) {
    refuse(fmt::format("names {} columns, and the line below has {} units", header.names.size(),
                       header.units.size()));
  }
  PoseTable table;
  table.delimiter = io::kBlanks;
  table.first_row = header.names_line + 2;
  table.has_footer = true;
  table.contents.format = "inertial-explorer";
  table.contents.time_scale = TimeScale::gps_second_of_week;
  table.contents.velocity_axes = VelocityAxes::east_north_up;
  const bool has_gps_time = has_word(header.names, "gpstime");
  for (std::size_t i = 0; i < header.names.size(); ++i) {
    PoseColumn column;
    column.name = io::printable(header.names[i]);
    for (const FieldName& known : kExplorerNames) {
      if (known.name != header.names[i]) continue;
      const bool second_time = known.name == "corrtime" && has_gps_time;
      if (second_time || has_field(table.columns, known.field)) continue;
      column.field = known.field;
    }
    set_unit(column, header.units[i], path, header.names_line + 1);
    table.columns.push_back(std::move(column));
  }
  const auto missing = missing_fields(table.columns, {{PoseField::time, "GPSTime"},
                                                      {PoseField::latitude, "Latitude"},
                                                      {PoseField::longitude, "Longitude"},
                                                      {PoseField::height, "H-Ell"},
                                                      {PoseField::roll, "Roll"},
                                                      {PoseField::pitch, "Pitch"},
                                                      {PoseField::heading, "Heading"}});
  if (!missing.empty()) {
    refuse(
        fmt::format("column {} is missing{}", fmt::join(missing, ", "),
                    has_word(header.names, "h-msl") && missing.size() == 1 && missing[0] == "H-Ell"
                        ? ": H-MSL is a height above a geoid that the file does not name; export "
                          "the ellipsoidal height"
                        : ""));
  }
  take_contents(table, header.warnings);
  for (PoseColumn& column : table.columns) {
    if (is_angle_sigma(column.field)) {
      column.scale /= header.attitude_scale;
    } else if (column.field >= PoseField::sigma_north) {
      column.scale /= header.position_scale;
    }
  }
  return read_pose_table(path, table, progress, header.warnings);
}

}  // namespace

const Format kInertialExplorerFormat{
    "inertial-explorer", "",     "text of NovAtel Inertial Explorer", is_explorer,
    read_explorer,       nullptr};

}  // namespace risley::trajectories
