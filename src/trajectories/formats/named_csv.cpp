// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/io/text_table.hpp"
#include "risley/trajectories/geodesy.hpp"

#include "trajectories/formats/format.hpp"
#include "trajectories/formats/pose_table.hpp"

/// CSV whose header names the columns, each with its unit: for users' own systems, and the output
/// format.
namespace risley::trajectories {
namespace {

enum class CsvUnit { time, angle, length, speed, none };

/// A name of a column without its unit.
struct CsvName {
  std::string_view base;
  PoseField field;
  CsvUnit unit;
  double sign = 1;
  TimeScale scale = TimeScale::unknown;
};

constexpr std::array kCsvNames{
    CsvName{"time", PoseField::time, CsvUnit::time},
    CsvName{"gps_second_of_week", PoseField::time, CsvUnit::time, 1, TimeScale::gps_second_of_week},
    CsvName{"utc_second_of_day", PoseField::time, CsvUnit::time, 1, TimeScale::utc_second_of_day},
    CsvName{"gps", PoseField::time, CsvUnit::time, 1, TimeScale::gps},
    CsvName{"adjusted_gps", PoseField::time, CsvUnit::time, 1, TimeScale::adjusted_gps},
    CsvName{"utc_unix", PoseField::time, CsvUnit::time, 1, TimeScale::utc_unix},
    CsvName{"gps_week", PoseField::gps_week, CsvUnit::none},
    CsvName{"latitude", PoseField::latitude, CsvUnit::angle},
    CsvName{"longitude", PoseField::longitude, CsvUnit::angle},
    CsvName{"ellipsoidal_height", PoseField::height, CsvUnit::length},
    CsvName{"x", PoseField::x, CsvUnit::length},
    CsvName{"y", PoseField::y, CsvUnit::length},
    CsvName{"z", PoseField::z, CsvUnit::length},
    CsvName{"roll", PoseField::roll, CsvUnit::angle},
    CsvName{"pitch", PoseField::pitch, CsvUnit::angle},
    CsvName{"heading", PoseField::heading, CsvUnit::angle},
    CsvName{"qx", PoseField::qx, CsvUnit::none},
    CsvName{"qy", PoseField::qy, CsvUnit::none},
    CsvName{"qz", PoseField::qz, CsvUnit::none},
    CsvName{"qw", PoseField::qw, CsvUnit::none},
    CsvName{"velocity_north", PoseField::velocity_1, CsvUnit::speed},
    CsvName{"velocity_east", PoseField::velocity_2, CsvUnit::speed},
    CsvName{"velocity_down", PoseField::velocity_3, CsvUnit::speed},
    CsvName{"velocity_up", PoseField::velocity_3, CsvUnit::speed, -1},
    CsvName{"velocity_x", PoseField::velocity_1, CsvUnit::speed},
    CsvName{"velocity_y", PoseField::velocity_2, CsvUnit::speed},
    CsvName{"velocity_z", PoseField::velocity_3, CsvUnit::speed},
    CsvName{"sigma_north", PoseField::sigma_north, CsvUnit::length},
    CsvName{"sigma_east", PoseField::sigma_east, CsvUnit::length},
    CsvName{"sigma_up", PoseField::sigma_down, CsvUnit::length},
    CsvName{"sigma_down", PoseField::sigma_down, CsvUnit::length},
    CsvName{"sigma_roll", PoseField::sigma_roll, CsvUnit::angle},
    CsvName{"sigma_pitch", PoseField::sigma_pitch, CsvUnit::angle},
    CsvName{"sigma_heading", PoseField::sigma_heading, CsvUnit::angle},
};

/// A unit as it ends a name.
struct CsvUnitName {
  CsvUnit unit;
  std::string_view suffix;
  double scale;
  int time_decimals;
};

constexpr std::array kCsvUnits{
    CsvUnitName{CsvUnit::time, "_s", 1, 0},
    CsvUnitName{CsvUnit::time, "_ms", 1, 3},
    CsvUnitName{CsvUnit::time, "_us", 1, 6},
    CsvUnitName{CsvUnit::time, "_ns", 1, 9},
    CsvUnitName{CsvUnit::angle, "_deg", kRadiansPerDegree, 0},
    CsvUnitName{CsvUnit::angle, "_rad", 1, 0},
    CsvUnitName{CsvUnit::length, "_m", 1, 0},
    CsvUnitName{CsvUnit::speed, "_m_per_s", 1, 0},
    CsvUnitName{CsvUnit::none, "", 1, 0},
};

struct CsvColumn {
  const CsvName* name;
  const CsvUnitName* unit;
};

std::optional<CsvColumn> csv_column(std::string_view written) {
  for (const CsvName& name : kCsvNames) {
    if (!written.starts_with(name.base)) continue;
    for (const CsvUnitName& unit : kCsvUnits) {
      if (unit.unit == name.unit && written.substr(name.base.size()) == unit.suffix) {
        return CsvColumn{&name, &unit};
      }
    }
  }
  return std::nullopt;
}

const std::vector<std::string>& all_csv_names() {
  static const std::vector<std::string> all = [] {
    std::vector<std::string> names;
    for (const CsvName& name : kCsvNames) {
      for (const CsvUnitName& unit : kCsvUnits) {
        if (unit.unit == name.unit) names.push_back(fmt::format("{}{}", name.base, unit.suffix));
      }
    }
    return names;
  }();
  return all;
}

/// Alternative names, as used by receivers and data sets.
struct CsvAlias {
  std::string_view written, base;
};
constexpr CsvAlias kCsvAliases[] = {{"timestamp", "time"},
                                    {"time_stamp", "time"},
                                    {"t", "time"},
                                    {"lat", "latitude"},
                                    {"lon", "longitude"},
                                    {"long", "longitude"},
                                    {"lng", "longitude"},
                                    {"ellipsoid_height", "ellipsoidal_height"},
                                    {"tx", "x"},
                                    {"ty", "y"},
                                    {"tz", "z"},
                                    {"q_x", "qx"},
                                    {"q_y", "qy"},
                                    {"q_z", "qz"},
                                    {"q_w", "qw"},
                                    {"p_rs_r_x", "x"},
                                    {"p_rs_r_y", "y"},
                                    {"p_rs_r_z", "z"},
                                    {"q_rs_x", "qx"},
                                    {"q_rs_y", "qy"},
                                    {"q_rs_z", "qz"},
                                    {"q_rs_w", "qw"},
                                    {"v_rs_r_x", "velocity_x"},
                                    {"v_rs_r_y", "velocity_y"},
                                    {"v_rs_r_z", "velocity_z"}};
constexpr std::string_view kEurocPosition = "p_rs_r_x";

/// Units in brackets.
struct CsvUnitAlias {
  std::string_view written, suffix;
};
constexpr std::array kCsvUnitAliases{
    CsvUnitAlias{"", ""},
    CsvUnitAlias{"s", "_s"},
    CsvUnitAlias{"sec", "_s"},
    CsvUnitAlias{"seconds", "_s"},
    CsvUnitAlias{"ms", "_ms"},
    CsvUnitAlias{"us", "_us"},
    CsvUnitAlias{"ns", "_ns"},
    CsvUnitAlias{"deg", "_deg"},
    CsvUnitAlias{"degrees", "_deg"},
    CsvUnitAlias{"\xC2\xB0", "_deg"},
    CsvUnitAlias{"rad", "_rad"},
    CsvUnitAlias{"m", "_m"},
    CsvUnitAlias{"m/s", "_m_per_s"},
    CsvUnitAlias{"m s^-1", "_m_per_s"},
};

/// "Lat [deg]" as latitude_deg, "#timestamp [ns]" as time_ns; unknown names unchanged, in lower
/// case.
std::string csv_name(std::string_view written) {
  while (written.starts_with('#') || written.starts_with('"')) written.remove_prefix(1);
  while (written.ends_with('"')) written.remove_suffix(1);
  std::string name = lower_case(std::string(io::trimmed(written)));
  std::string base = name;
  std::string_view suffix;
  const auto open = name.find_first_of("[(");
  if (open != name.npos && open > 0 && (name.ends_with(']') || name.ends_with(')'))) {
    const std::string_view unit =
        io::trimmed(std::string_view(name).substr(open + 1, name.size() - open - 2));
    const auto known = std::ranges::find_if(
        kCsvUnitAliases, [&](const CsvUnitAlias& one) { return one.written == unit; });
    if (known == kCsvUnitAliases.end()) return name;
    suffix = known->suffix;
    base = io::trimmed(name.substr(0, open));
  } else {
    for (const CsvUnitName& unit : kCsvUnits) {
      if (unit.suffix.size() <= suffix.size() || !name.ends_with(unit.suffix)) continue;
      suffix = unit.suffix;
    }
    base.resize(name.size() - suffix.size());
  }
  std::ranges::replace(base, ' ', '_');
  for (const CsvAlias& alias : kCsvAliases) {
    if (alias.written == base) base = alias.base;
  }
  return base + std::string(suffix);
}

char csv_delimiter(std::string_view header) { return header.find(',') != header.npos ? ',' : '\t'; }

std::vector<std::string> header_names(std::string_view line) {
  std::vector<std::string> names;
  for (const std::string_view field : io::fields_of(line, csv_delimiter(line))) {
    names.push_back(csv_name(field));
  }
  // EuRoC counts nanoseconds, whether its header states it or not.
  if (lower_case(std::string(line)).find(kEurocPosition) != std::string::npos) {
    std::ranges::replace(names, std::string("time"), std::string("time_ns"));
  }
  return names;
}

/// Two or more of a header's names are those of an attitude or of a geographic place, or nearly so.
bool is_trajectory_csv(const FileHead& head) {
  const std::vector<std::string_view> lines = lines_of(head.bytes);
  if (lines.empty()) return false;
  const char delimiter = csv_delimiter(lines[0]);
  if (lines.size() > 1 && !lines[1].empty() && lines[1].find(delimiter) == lines[1].npos) {
    return false;  // names of another kind of table
  }
  static const std::vector<std::string> kAttitude{"roll_deg", "pitch_deg", "heading_deg",
                                                  "roll_rad", "pitch_rad", "heading_rad"};
  static const std::vector<std::string> kQuaternion{"qx", "qy", "qz", "qw"};
  int found = 0;
  const std::vector<std::string> names = header_names(lines[0]);
  // A cloud may have the place of each point, too.
  const bool has_points = std::ranges::any_of(names, [](const std::string& name) {
    return name == "x" || name.starts_with("x_") || name.starts_with("range") ||
           name.starts_with("azimuth");
  });
  for (const std::string& name : names) {
    const bool is_quaternion = std::ranges::find(kQuaternion, name) != kQuaternion.end();
    const bool without_unit = name == "roll" || name == "pitch" || name == "heading";
    const bool is_place =
        !has_points && (name.starts_with("latitude") || name.starts_with("longitude"));
    if (is_place || is_quaternion || without_unit || !near_miss(name, kAttitude).empty()) ++found;
  }
  return found >= 2;
}

/// Ambiguous names, and their unambiguous replacements.
void refuse_ambiguous(const std::string& path, const std::vector<PoseColumn>& columns,
                      const std::vector<std::string>& unknown) {
  std::vector<std::string> names, remedies;
  const auto look_for = [&](PoseField field, std::initializer_list<std::string_view> bases,
                            const char* remedy) {
    if (has_field(columns, field)) return;
    for (const std::string& name : unknown) {
      const std::string_view base = std::string_view(name).substr(0, name.rfind('_'));
      const bool meant = std::ranges::find(bases, base) != bases.end() ||
                         std::ranges::find(bases, name) != bases.end();
      if (!meant) continue;
      names.push_back(io::printable(name));
      remedies.emplace_back(remedy);
      return;
    }
  };
  look_for(PoseField::height, {"alt", "altitude", "height", "h", "elevation"},
           "call a height above the ellipsoid ellipsoidal_height_m (one above the geoid has to be "
           "converted)");
  look_for(PoseField::heading, {"yaw", "azimuth"},
           "call an angle that counts clockwise from north heading_deg");
  if (names.empty() || !has_field(columns, PoseField::latitude)) return;
  throw FileError(path, {{}, 1},
                  fmt::format("is a trajectory, but does not say what {} is: {}",
                              fmt::join(names, " or "), fmt::join(remedies, ", ")));
}

/// Columns by a header. @throws FileError at its line
PoseTable csv_table(const std::string& path, std::string_view header,
                    std::vector<Warning>& warnings) {
  const auto refuse = [&](const std::string& problem) { throw FileError(path, {{}, 1}, problem); };
  PoseTable table;
  table.first_row = 2;
  table.delimiter = csv_delimiter(header);
  table.contents.format = "trajectory-csv";
  const CsvName* time = nullptr;
  std::vector<std::string> unknown;
  bool along_north = false, along_x = false;
  for (const std::string& name : header_names(header)) {
    PoseColumn column;
    column.name = name;
    if (const auto found = csv_column(name)) {
      column.field = found->name->field;
      if (has_field(table.columns, column.field)) {
        refuse(fmt::format("column {} repeats {}", io::printable(name),
                           std::ranges::find_if(table.columns, [&](const PoseColumn& other) {
                             return other.field == column.field;
                           })->name));
      }
      column.scale = found->unit->scale * found->name->sign;
      column.time_decimals = found->unit->time_decimals;
      if (column.field == PoseField::time) time = found->name;
      along_north = along_north || name.starts_with("velocity_north");
      along_x = along_x || name.starts_with("velocity_x");
    } else {
      unknown.push_back(name);
    }
    table.columns.push_back(std::move(column));
  }
  refuse_ambiguous(path, table.columns, unknown);
  for (const std::string& name : unknown) {
    for (const char* unit : {"_deg", "_s", "_m", "_m_per_s"}) {
      if (!csv_column(name + unit)) continue;
      refuse(fmt::format("column {} names no unit, did you mean {}{}?", io::printable(name), name,
                         unit));
    }
    const std::string meant = did_you_mean(name, all_csv_names());
    if (!meant.empty()) refuse(fmt::format("unknown column {}{}", io::printable(name), meant));
  }
  if (time == nullptr) {
    refuse(fmt::format(
        "has no column of times: expected time_s, gps_second_of_week_s, utc_second_of_day_s, "
        "gps_s, adjusted_gps_s or utc_unix_s, or the same in _ms, _us or _ns; the columns are {}",
        io::printable(header)));
  }
  table.contents.time_scale = time->scale;
  const auto geodetic = missing_fields(table.columns, {{PoseField::latitude, "latitude_deg"},
                                                       {PoseField::longitude, "longitude_deg"},
                                                       {PoseField::height, "ellipsoidal_height_m"},
                                                       {PoseField::roll, "roll_deg"},
                                                       {PoseField::pitch, "pitch_deg"},
                                                       {PoseField::heading, "heading_deg"}});
  const auto local = missing_fields(table.columns, {{PoseField::x, "x_m"},
                                                    {PoseField::y, "y_m"},
                                                    {PoseField::z, "z_m"},
                                                    {PoseField::qx, "qx"},
                                                    {PoseField::qy, "qy"},
                                                    {PoseField::qz, "qz"},
                                                    {PoseField::qw, "qw"}});
  if (!geodetic.empty() && !local.empty()) {
    const bool meant_local =
        has_field(table.columns, PoseField::x) ||
        (has_field(table.columns, PoseField::qx) && !has_field(table.columns, PoseField::latitude));
    refuse(fmt::format("column {} is missing; expected {}",
                       fmt::join(meant_local ? local : geodetic, ", "),
                       meant_local ? "x_m, y_m, z_m, qx, qy, qz, qw"
                                   : "latitude_deg, longitude_deg, ellipsoidal_height_m, roll_deg, "
                                     "pitch_deg, heading_deg"));
  }
  if (geodetic.empty() && local.empty()) {
    refuse("holds poses twice, as latitude and longitude and as x, y, z; expected one of them");
  }
  const bool is_local = local.empty();
  table.contents.frame = is_local ? Frame::local : Frame::geocentric;
  table.left_up = is_local;
  if (along_north && along_x) refuse("holds velocities along north and along x; expected one");
  if (along_north || along_x) {
    table.contents.velocity_axes =
        along_north ? VelocityAxes::north_east_down : VelocityAxes::frame;
    if (along_x && !is_local) {
      refuse(
          "holds velocities along x, y, z and poses by latitude and longitude; expected "
          "velocity_north_m_per_s, velocity_east_m_per_s, velocity_down_m_per_s");
    }
  }
  take_contents(table, warnings);
  for (const std::string& name : unknown) {
    warnings.push_back({kWarning.columns_unused,
                        fmt::format("column {} was ignored", io::printable(name)),
                        {{}, 1}});
  }
  return table;
}

Trajectory read_trajectory_csv(const std::string& path, const Progress& progress) {
  std::vector<Warning> warnings;
  PoseTable table;
  {
    io::LineReader lines(path, io::LinesOf::table);
    std::string_view header;
    if (!lines.next(header)) throw FileError(path, {{}, 1}, "expected a header line");
    table = csv_table(path, header, warnings);
  }
  return read_pose_table(path, table, progress, warnings);
}

std::string_view csv_time_name(TimeScale scale) {
  for (const CsvName& name : kCsvNames) {
    if (name.field == PoseField::time && name.scale == scale) return name.base;
  }
  return "time";
}

/// @param end_row  called after each row, also after the names
template <class EndRow>
void append_csv(const Trajectory& trajectory, fmt::memory_buffer& buffer, const EndRow& end_row) {
  const bool local = trajectory.frame == Frame::local;
  const bool has_velocity = !trajectory.velocity.empty();
  const bool has_accuracy = !trajectory.accuracy.empty();
  const auto append = [&](std::string_view text) {
    buffer.append(text.data(), text.data() + text.size());
  };
  append(fmt::format("{}_ns", csv_time_name(trajectory.time_scale)));
  if (trajectory.gps_week) append(",gps_week");
  append(local ? ",x_m,y_m,z_m,qx,qy,qz,qw"
               : ",latitude_deg,longitude_deg,ellipsoidal_height_m,roll_deg,pitch_deg,"
                 "heading_deg");
  if (has_velocity) {
    append(local ? ",velocity_x_m_per_s,velocity_y_m_per_s,velocity_z_m_per_s"
                 : ",velocity_north_m_per_s,velocity_east_m_per_s,velocity_down_m_per_s");
  }
  if (has_accuracy) {
    append(
        ",sigma_north_m,sigma_east_m,sigma_up_m,sigma_roll_deg,sigma_pitch_deg,"
        "sigma_heading_deg");
  }
  end_row();
  const auto add = [&](double value) { fmt::format_to(fmt::appender(buffer), ",{}", value); };
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    fmt::format_to(fmt::appender(buffer), "{}", trajectory.time_ns[i]);
    if (trajectory.gps_week) {
      fmt::format_to(fmt::appender(buffer), ",{}", *trajectory.gps_week);
    }
    const Eigen::Vector3d& position = trajectory.position[i];
    Eigen::Vector3d velocity = has_velocity ? trajectory.velocity[i] : Eigen::Vector3d::Zero();
    if (local) {
      const Eigen::Quaterniond q = left_up_from_right_down(trajectory.attitude[i]);
      for (const double value :
           {position.x(), position.y(), position.z(), q.x(), q.y(), q.z(), q.w()}) {
        add(value);
      }
    } else {
      const Geodetic place = geodetic_from_geocentric(position);
      const RollPitchHeading angles =
          roll_pitch_heading(Frame::geocentric, position, trajectory.attitude[i]);
      add(degrees_from_radians(place.latitude));
      add(degrees_from_radians(place.longitude));
      add(place.height);
      for (const double angle : {angles.roll, angles.pitch, angles.heading}) {
        add(degrees_from_radians(angle));
      }
      velocity = geocentric_from_ned(place).transpose() * velocity;
    }
    if (has_velocity) {
      for (const double value : velocity) add(value);
    }
    if (has_accuracy) {
      const PoseAccuracy& accuracy = trajectory.accuracy[i];
      for (const double value : accuracy.position) add(value);
      for (const double angle : {accuracy.roll, accuracy.pitch, accuracy.heading}) {
        add(degrees_from_radians(angle));
      }
    }
    end_row();
  }
}

std::vector<std::string> write_trajectory_csv(const std::string& path,
                                              const Trajectory& trajectory) {
  io::TextOutput output(path);
  append_csv(trajectory, output.buffer(), [&] { output.end_row(); });
  output.close();
  return {};
}

}  // namespace

const Format kNamedCsvFormat{"trajectory-csv",
                             ".csv",
                             "CSV whose columns name their units",
                             is_trajectory_csv,
                             read_trajectory_csv,
                             write_trajectory_csv};

std::string trajectory_csv(const Trajectory& trajectory) {
  require_trajectory(trajectory);
  fmt::memory_buffer buffer;
  append_csv(trajectory, buffer, [&] { buffer.push_back('\n'); });
  return fmt::to_string(buffer);
}

}  // namespace risley::trajectories
