// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "trajectories/formats/pose_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/text_table.hpp"

#include "trajectories/formats/format.hpp"

namespace risley::trajectories {
namespace {

using io::BadRow;

constexpr std::size_t kPoseFields = static_cast<std::size_t>(PoseField::count);

std::size_t fields_in_line(const std::vector<PoseColumn>& columns) {
  std::size_t count = 0;
  for (const PoseColumn& column : columns) count += column.sexagesimal ? 3 : 1;
  return count;
}

/// Degrees of three fields; the sign is that of the degrees, also of -0.
double sexagesimal_degrees(std::span<const std::string_view> fields, const std::string& name) {
  const double degrees = io::decimal_field(fields[0], name).value;
  const double minutes = io::decimal_field(fields[1], name).value;
  const double seconds = io::decimal_field(fields[2], name).value;
  if (!(minutes >= 0 && minutes < 60 && seconds >= 0 && seconds <= 60)) {
    throw BadRow{
        fmt::format("expected degrees, minutes and seconds in column {}, found \"{} {} {}\"", name,
                    io::printable(fields[0]), io::printable(fields[1]), io::printable(fields[2]))};
  }
  const double size = std::abs(degrees) + minutes / 60 + seconds / 3600;
  return fields[0].starts_with('-') ? -size : size;
}

/// Digits behind the point of a field.
std::size_t decimals_in(std::string_view field) {
  const auto point = field.find('.');
  return point == std::string_view::npos ? 0 : field.size() - point - 1;
}

class RowReader {
 public:
  explicit RowReader(const PoseTable& table) : table_(table) {}

  /// @throws BadRow
  PoseRow row(std::span<const std::string_view> fields) {
    std::array<double, kPoseFields> values{};
    PoseRow row;
    std::size_t at = 0;
    std::optional<std::int64_t> week;
    for (const PoseColumn& column : table_.columns) {
      const std::size_t place = at;
      at += column.sexagesimal ? 3 : 1;
      if (column.field == PoseField::unused) continue;
      if (column.field == PoseField::time) {
        row.time_ns = time_ns(fields[place], column);
      } else if (column.field == PoseField::gps_week) {
        week = io::integer_field(fields[place], column.name, 0, 20000);
      } else if (column.sexagesimal) {
        values[static_cast<std::size_t>(column.field)] =
            column.scale * sexagesimal_degrees(fields.subspan(place, 3), column.name);
      } else {
        values[static_cast<std::size_t>(column.field)] =
            column.scale * io::decimal_field(without_plus(fields[place]), column.name).value;
      }
    }
    const auto value = [&](PoseField field) { return values[static_cast<std::size_t>(field)]; };
    row.place = {value(PoseField::latitude), value(PoseField::longitude), value(PoseField::height)};
    row.angles = {value(PoseField::roll), value(PoseField::pitch), value(PoseField::heading)};
    row.position = {value(PoseField::x), value(PoseField::y), value(PoseField::z)};
    row.velocity = {value(PoseField::velocity_1), value(PoseField::velocity_2),
                    value(PoseField::velocity_3)};
    row.accuracy.position = {value(PoseField::sigma_north), value(PoseField::sigma_east),
                             value(PoseField::sigma_down)};
    row.accuracy.roll = value(PoseField::sigma_roll);
    row.accuracy.pitch = value(PoseField::sigma_pitch);
    row.accuracy.heading = value(PoseField::sigma_heading);
    if (table_.contents.frame == Frame::local) {
      const Eigen::Quaterniond stated(value(PoseField::qw), value(PoseField::qx),
                                      value(PoseField::qy), value(PoseField::qz));
      const auto unit = unit_quaternion(stated);
      if (!unit) {
        throw BadRow{
            fmt::format("expected a quaternion of length 1, found length {:.6g}", stated.norm())};
      }
      row.attitude = table_.left_up ? right_down_from_left_up(*unit) : *unit;
    }
    if (week) {
      if (!first_week_) first_week_ = *week;
      constexpr std::int64_t kWeek_ns = 604'800'000'000'000;
      row.time_ns += (*week - *first_week_) * kWeek_ns;
    }
    return row;
  }

  std::optional<std::int64_t> first_week() const { return first_week_; }

 private:
  static std::string_view without_plus(std::string_view field) {
    if (field.starts_with('+')) field.remove_prefix(1);
    return field;
  }

  static std::int64_t time_ns(std::string_view field, const PoseColumn& column) {
    io::Decimal time = io::decimal_field(without_plus(field), column.name);
    constexpr double kMost = 9.0e9;  // s
    if (time.decimals >= 0) {
      time.decimals += column.time_decimals;
    }
    time.value *= std::pow(10.0, -column.time_decimals);
    if (!(std::abs(time.value) < kMost)) {
      throw BadRow{fmt::format("expected a time within +-9e9 s in column {}, found \"{}\"",
                               column.name, io::printable(field))};
    }
    return io::nanoseconds_of(time, column.name);
  }

  const PoseTable& table_;
  std::optional<std::int64_t> first_week_;
};

}  // namespace

bool has_field(const std::vector<PoseColumn>& columns, PoseField field) {
  return std::any_of(columns.begin(), columns.end(),
                     [field](const PoseColumn& column) { return column.field == field; });
}

void take_contents(PoseTable& table, std::vector<TrajectoryWarning>& warnings) {
  // A quantity counts when all its columns are there.
  const auto whole = [&](std::initializer_list<PoseField> fields, const char* what) {
    std::vector<std::string> there;
    for (const PoseColumn& column : table.columns) {
      if (std::find(fields.begin(), fields.end(), column.field) != fields.end()) {
        there.push_back(column.name);
      }
    }
    if (there.size() == fields.size()) return true;
    for (PoseColumn& column : table.columns) {
      if (std::find(fields.begin(), fields.end(), column.field) != fields.end()) {
        column.field = PoseField::unused;
      }
    }
    if (!there.empty()) {
      warnings.push_back({{},
                          fmt::format("{} are incomplete (only {}) and were left out", what,
                                      fmt::join(there, ", "))});
    }
    return false;
  };
  table.contents.has_velocity =
      whole({PoseField::velocity_1, PoseField::velocity_2, PoseField::velocity_3}, "velocities");
  table.contents.has_accuracy =
      whole({PoseField::sigma_north, PoseField::sigma_east, PoseField::sigma_down,
             PoseField::sigma_roll, PoseField::sigma_pitch, PoseField::sigma_heading},
            "standard deviations");
}

std::vector<std::string_view> lines_of(std::string_view head) {
  std::vector<std::string_view> lines;
  if (head.starts_with("\xEF\xBB\xBF")) head.remove_prefix(3);
  if (head.find('\0') != std::string_view::npos) return lines;
  for (auto end = head.find('\n'); end != std::string_view::npos; end = head.find('\n')) {
    std::string_view line = head.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    lines.push_back(line);
    head.remove_prefix(end + 1);
  }
  if (!head.empty()) lines.push_back(head);
  return lines;
}

Trajectory read_pose_table(const std::string& path, const PoseTable& table,
                           const Progress& progress,
                           const std::vector<TrajectoryWarning>& warnings) {
  io::LineReader lines(path);
  std::string_view line;
  while (lines.line_number() + 1 < table.first_row && lines.next(line)) {
  }
  PoseRows rows(path, table.contents);
  for (const TrajectoryWarning& warning : warnings) rows.warn(warning.place, warning.message);
  RowReader reader(table);
  std::vector<std::string_view> fields(fields_in_line(table.columns));
  std::optional<std::uint64_t> empty_line;
  std::size_t last_decimals = 0;
  while (lines.next(line)) {
    const FilePlace place{{}, lines.line_number()};
    constexpr std::size_t kOften = 4096;
    if (lines.line_number() % kOften == 0) progress.report(lines.fraction_read());
    if (io::trimmed(line).empty()) {
      if (rows.size() > 0 && !empty_line) empty_line = lines.line_number();
      continue;
    }
    if (table.comment != '\0' && io::trimmed(line).starts_with(table.comment)) continue;
    std::string problem;
    if (empty_line)
      problem =
          fmt::format("found a row after the empty line {}, which ends the records", *empty_line);
    std::optional<PoseRow> row;
    try {
      const std::size_t count = io::split_fields(line, table.delimiter, fields);
      if (count != fields.size()) {
        throw BadRow{fmt::format("expected {} fields, found {}", fields.size(), count)};
      }
      row = reader.row(fields);
    } catch (const BadRow& bad) {
      problem = bad.what();
    }
    const bool footer = table.has_footer && empty_line && !row;
    if (footer) {
      rows.warn(place, "text after the records was not read");
      break;
    }
    const bool cut = !lines.has_line_end() &&
                     (!row || (rows.size() > 0 && decimals_in(fields.back()) != last_decimals));
    if (cut) {
      rows.warn(place, "the last line is cut off and was left out");
      break;
    }
    if (!problem.empty()) throw FileError(path, place, problem);
    last_decimals = decimals_in(fields.back());
    rows.add(*row, place);
  }
  Trajectory trajectory = rows.finish();
  if (const auto week = reader.first_week()) trajectory.gps_week = static_cast<int>(*week);
  return trajectory;
}

}  // namespace risley::trajectories
