// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "trajectories/formats/pose_table.hpp"

#include <algorithm>
#include <array>
#include <chrono>
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

/// Days from the beginning of GPS time, a Sunday, to a date.
std::int64_t gps_day(std::string_view field, const PoseColumn& column) {
  std::string text(field);
  std::ranges::replace_if(
      text, [](char c) { return c == '/' || c == '.'; }, '-');
  std::array<std::string_view, 3> parts;
  if (io::split_fields(text, '-', parts) == parts.size()) {
    const std::size_t year_at = column.date_order == DateOrder::ymd ? 0 : 2;
    const std::size_t month_at = column.date_order == DateOrder::mdy ? 0 : 1;
    const std::size_t day_at = 3 - year_at - month_at;
    const auto number = [&](std::size_t at, std::int64_t low, std::int64_t high) {
      return io::integer_field(parts[at], column.name, low, high);
    };
    using namespace std::chrono;
    const year_month_day date{year(static_cast<int>(number(year_at, 1980, 2200))),
                              month(static_cast<unsigned>(number(month_at, 1, 12))),
                              std::chrono::day(static_cast<unsigned>(number(day_at, 1, 31)))};
    constexpr sys_days kFirst = year(1980) / 1 / 6;
    if (date.ok() && sys_days(date) >= kFirst) return (sys_days(date) - kFirst).count();
  }
  constexpr std::array kOrders{"year/month/day", "month/day/year", "day/month/year"};
  throw BadRow{fmt::format("expected a date {} since 1980 in column {}, found \"{}\"",
                           kOrders[static_cast<std::size_t>(column.date_order)], column.name,
                           io::printable(field))};
}

/// Digits after the point of a field.
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
    const auto value = [&](PoseField field) -> double& {
      return values[static_cast<std::size_t>(field)];
    };
    PoseRow row;
    std::size_t at = 0;
    std::optional<std::int64_t> week, day;
    for (const PoseColumn& column : table_.columns) {
      const std::size_t place = at;
      at += column.sexagesimal ? 3 : 1;
      if (column.field == PoseField::unused) continue;
      if (column.field == PoseField::time) {
        row.time_ns = time_ns(fields[place], column);
      } else if (column.field == PoseField::gps_week) {
        week = io::integer_field(fields[place], column.name, 0, 20000);
      } else if (column.field == PoseField::date) {
        day = gps_day(fields[place], column);
      } else if (column.sexagesimal) {
        value(column.field) =
            column.scale * sexagesimal_degrees(fields.subspan(place, 3), column.name);
      } else {
        value(column.field) =
            column.scale * io::decimal_field(without_plus(fields[place]), column.name).value;
      }
    }
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
    if (day) place_in_week(*day, row.time_ns, week);
    if (week) {
      if (!first_week_) first_week_ = *week;
      constexpr std::int64_t kWeek_ns = 604'800'000'000'000;
      row.time_ns += (*week - *first_week_) * kWeek_ns;
    }
    return row;
  }

  std::optional<std::int64_t> first_week() const { return first_week_; }

 private:
  /// Converts a second of the day, or of the week, to one of the week, as the first date after a
  /// Sunday shows; on a Sunday both are the same.
  void place_in_week(std::int64_t day, std::int64_t& time_ns, std::optional<std::int64_t>& week) {
    constexpr std::int64_t kDay_ns = 86'400'000'000'000, kDays = 7;
    constexpr std::int64_t kLate_ns =
        60'000'000'000;  // dates of UTC change at most this much later
    const std::int64_t before_ns = day % kDays * kDay_ns;
    const auto is_of_day = [](std::int64_t time) { return time >= 0 && time < kDay_ns + kLate_ns; };
    const bool in_day = is_of_day(time_ns), in_week = is_of_day(time_ns - before_ns);
    if (!in_day && !in_week && seconds_ != Seconds::of_week) {
      throw BadRow{
          fmt::format("expected a second of the day, or one of the GPS week on day {} of "
                      "it, as the date says, found {} s",
                      day % kDays, 1e-9 * static_cast<double>(time_ns))};
    }
    if (seconds_ == Seconds::untold && before_ns > 0) {
      seconds_ = in_week ? Seconds::of_week : Seconds::of_day;
    }
    if (first_day_ < 0) first_day_ = day;
    const bool of_day = seconds_ == Seconds::of_day;
    if (of_day) time_ns += before_ns;
    // Times of the week continue beyond its end without the date.
    if (!week) week = (of_day ? day : first_day_) / kDays;
  }

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
  enum class Seconds : std::uint8_t { untold, of_day, of_week } seconds_ = Seconds::untold;
  std::int64_t first_day_ = -1;  ///< of a table with dates
};

}  // namespace

bool has_field(const std::vector<PoseColumn>& columns, PoseField field) {
  return std::ranges::any_of(columns,
                             [field](const PoseColumn& column) { return column.field == field; });
}

std::vector<std::string_view> missing_fields(
    const std::vector<PoseColumn>& columns,
    std::initializer_list<std::pair<PoseField, std::string_view>> wanted) {
  std::vector<std::string_view> names;
  for (const auto& [field, name] : wanted) {
    if (!has_field(columns, field)) names.push_back(name);
  }
  return names;
}

bool is_angle(PoseField field) {
  return field == PoseField::latitude || field == PoseField::longitude ||
         (field >= PoseField::roll && field <= PoseField::heading);
}

bool is_angle_sigma(PoseField field) { return field >= PoseField::sigma_roll; }

void take_contents(PoseTable& table, std::vector<Warning>& warnings) {
  // A quantity is used if all its columns are present.
  const auto whole = [&](std::initializer_list<PoseField> fields, const char* what) {
    std::vector<std::string> there;
    for (const PoseColumn& column : table.columns) {
      if (std::ranges::find(fields, column.field) != fields.end()) {
        there.push_back(column.name);
      }
    }
    if (there.size() == fields.size()) return true;
    for (PoseColumn& column : table.columns) {
      if (std::ranges::find(fields, column.field) != fields.end()) {
        column.field = PoseField::unused;
      }
    }
    if (!there.empty()) {
      warn(warnings, kWarning.columns_unused, "{} are incomplete (only {}) and were ignored", what,
           fmt::join(there, ", "));
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
                           const Progress& progress, const std::vector<Warning>& warnings) {
  io::LineReader lines(path, io::LinesOf::table);
  std::string_view line;
  while (lines.line_number() + 1 < table.first_row && lines.next(line)) {
  }
  PoseRows rows(path, table.contents);
  append(rows.warnings(), warnings);
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
      warn(rows.warnings(), kWarning.content_left_out, "text after the records was not read")
          .place = place;
      break;
    }
    const bool cut = !lines.has_line_end() &&
                     (!row || (rows.size() > 0 && decimals_in(fields.back()) != last_decimals));
    if (cut) {
      warn(rows.warnings(), kWarning.cut_off, "the last line is cut off and was ignored").place =
          place;
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
