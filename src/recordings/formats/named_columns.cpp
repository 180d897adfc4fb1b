// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/named_columns.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "risley/core/median.hpp"
#include "risley/core/saturating.hpp"
#include "risley/core/text.hpp"
#include "risley/io/seconds.hpp"

#include "recordings/formats/cartesian.hpp"
#include "recordings/formats/format.hpp"

namespace risley::recordings {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kFarthest = 1e9;         // m
constexpr double kAngleSlack_deg = 1e-4;  // of float32 at 360
/// Times of 2001 to 2099 as seconds since 1970.
constexpr double kEarliestEpoch = 1e9, kLatestEpoch = 4.1e9;

/// A value that texts stand for.
template <class Value>
struct WordsFor {
  Value value;
  std::initializer_list<std::string_view> names;
};

/// Of the first that has this name.
template <class Value, std::size_t count>
std::optional<Value> meant_by(const std::array<WordsFor<Value>, count>& all,
                              std::string_view name) {
  for (const WordsFor<Value>& one : all) {
    if (std::find(one.names.begin(), one.names.end(), name) != one.names.end()) return one.value;
  }
  return std::nullopt;
}

bool is_whole(double value) { return value == std::floor(value); }

/// Smallest and largest number of a column; NaN without any.
std::pair<double, double> extent(const std::vector<Decimal>& samples) {
  double low = kNaN, high = kNaN;
  for (const Decimal& cell : samples) {
    low = std::fmin(low, cell.value);
    high = std::fmax(high, cell.value);
  }
  return {low, high};
}

bool all_whole(const std::vector<Decimal>& samples) {
  return std::all_of(samples.begin(), samples.end(), [](const Decimal& cell) {
    return !std::isfinite(cell.value) || is_whole(cell.value);
  });
}

/// Median of the steps above 0; 0 without any.
double median_step(const std::vector<Decimal>& samples) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const bool exact = samples[i].decimals == 0 && samples[i - 1].decimals == 0;
    const double step =
        exact ? static_cast<double>(saturating_difference(samples[i].digits, samples[i - 1].digits))
              : samples[i].value - samples[i - 1].value;
    if (step > 0.0) steps.push_back(step);
  }
  if (steps.empty()) return 0.0;
  return upper_median(steps);
}

}  // namespace

std::optional<NamedColumns::Unit> NamedColumns::unit_of(std::string_view text) {
  static const std::array<WordsFor<Unit>, 10> units = {{
      {{Unit::Kind::length, 1.0}, {"m", "meter", "metre", "meters", "metres"}},
      {{Unit::Kind::length, 100.0}, {"cm"}},
      {{Unit::Kind::length, 1000.0}, {"mm"}},
      {{Unit::Kind::angle, kDegreesPerRadian}, {"deg", "degree", "degrees", "\xC2\xB0"}},
      {{Unit::Kind::angle, 100.0 * kDegreesPerRadian}, {"centideg", "cdeg"}},
      {{Unit::Kind::angle, 1.0}, {"rad", "radian", "radians"}},
      {{Unit::Kind::time, 1.0, 0}, {"s", "sec", "second", "seconds"}},
      {{Unit::Kind::time, 1e3, 3}, {"ms", "millis", "milliseconds"}},
      {{Unit::Kind::time, 1e6, 6}, {"us", "\xC2\xB5s", "\xCE\xBCs", "micros", "microseconds"}},
      {{Unit::Kind::time, 1e9, 9}, {"ns", "nsec", "nanos", "nanoseconds"}},
  }};
  return meant_by(units, text);
}

NamedColumns::Role NamedColumns::role_of(std::string_view base) {
  static const std::array<WordsFor<Role>, 13> roles = {{
      {Role::x, {"x", "points:0", "points_0", "xyz:0", "position:0"}},
      {Role::y, {"y", "points:1", "points_1", "xyz:1", "position:1"}},
      {Role::z, {"z", "points:2", "points_2", "xyz:2", "position:2"}},
      {Role::range, {"range", "distance", "dist", "depth", "radius", "r"}},
      {Role::azimuth, {"azimuth", "phi", "yaw"}},
      {Role::zenith, {"zenith", "theta"}},
      {Role::elevation, {"elevation", "pitch", "altitude"}},
      {Role::time,
       {"time", "timestamp", "time_stamp", "t", "ts", "stamp", "offset_time", "gps_time",
        "gpstime"}},
      {Role::index, {"index", "shot", "shot_number", "row"}},
      {Role::intensity,
       {"intensity", "intensities", "reflectivity", "reflectivities", "reflectance", "i"}},
      {Role::return_number, {"return_number", "returnnumber", "return", "returnnum"}},
      {Role::tag, {"tag"}},
      {Role::beam, {"line", "beam", "ring", "laser_id", "laserid"}},
  }};
  if (const auto role = meant_by(roles, base)) return *role;
  // Arrays are often named in the plural.
  const bool plural = base.size() > 2 && base.ends_with('s');
  return plural ? role_of(base.substr(0, base.size() - 1)) : Role::none;
}

NamedColumns::Meaning NamedColumns::meaning_of(std::string_view name) {
  const std::string text = lower_case(std::string(trimmed(name)));
  const auto role_and_unit = [](std::string_view base, std::string_view unit_text) -> Meaning {
    std::string plain(trimmed(base));
    while (plain.ends_with('_')) plain.pop_back();
    for (char& c : plain) c = c == ' ' || c == '-' ? '_' : c;
    const Role role = role_of(plain);
    if (unit_text.empty() || role == Role::none) return {role, std::nullopt};
    const std::optional<Unit> unit = unit_of(unit_text);
    const auto wants = [&](Role first, Role last, Unit::Kind kind) {
      return role >= first && role <= last && (!unit || unit->kind != kind);
    };
    // A column with an unknown unit, or one not of this role, is ignored for the role.
    if (wants(Role::x, Role::range, Unit::Kind::length) ||
        wants(Role::azimuth, Role::elevation, Unit::Kind::angle) ||
        wants(Role::time, Role::time, Unit::Kind::time)) {
      return {};
    }
    return {role, unit};
  };
  if (const auto open = text.find_first_of("([/"); open != text.npos && open > 0) {
    std::string_view unit = std::string_view(text).substr(open + 1);
    if (unit.ends_with(')') || unit.ends_with(']')) unit.remove_suffix(1);
    return role_and_unit(std::string_view(text).substr(0, open), trimmed(unit));
  }
  if (const Meaning whole = role_and_unit(text, ""); whole.role != Role::none) return whole;
  const auto last = text.find_last_of("_ ");
  if (last == text.npos) return {};
  return role_and_unit(std::string_view(text).substr(0, last),
                       std::string_view(text).substr(last + 1));
}

NamedColumns::NamedColumns(std::vector<NamedColumn> columns) : columns_(std::move(columns)) {
  std::vector<Meaning> meanings;
  for (const NamedColumn& column : columns_) meanings.push_back(meaning_of(column.name));
  // Tables of pandas begin with the number of the row, without a name.
  if (columns_.size() > 1 && columns_.front().name.empty()) meanings.front().role = Role::index;
  const auto has = [&](Role role) {
    return std::any_of(meanings.begin(), meanings.end(),
                       [role](const Meaning& meaning) { return meaning.role == role; });
  };
  cartesian_ = has(Role::x) && has(Role::y) && has(Role::z);
  if (!cartesian_ && !(has(Role::azimuth) && (has(Role::zenith) || has(Role::elevation)))) {
    refuse_directions();
  }
  const auto takes = [&](Role role) {
    if (role == Role::none) return false;
    if (role <= Role::z) return cartesian_;
    if (role == Role::elevation) return !cartesian_ && !has(Role::zenith);
    return role > Role::elevation || !cartesian_;
  };
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const Role role = meanings[i].role;
    // Several columns can be times: only their values show which holds those of the shots.
    if (!takes(role) || (role != Role::time && find(role) != nullptr)) {
      unused_.push_back(i);
      continue;
    }
    sources_.push_back({wanted_.size(), meanings[i], columns_[i].type, {}});
    wanted_.push_back(i);
  }
}

void NamedColumns::refuse_directions() const {
  std::string names;
  for (const NamedColumn& column : columns_) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", column.name);
  }
  throw BadColumns{
      fmt::format("expected columns x, y and z, or azimuth and zenith (or elevation) with or "
                  "without range, each with its unit, as in x_m or azimuth_deg; found \"{}\"",
                  printable(names))};
}

const NamedColumns::Source* NamedColumns::find(Role role) const {
  const auto found = std::find_if(sources_.begin(), sources_.end(), [role](const Source& source) {
    return source.meaning.role == role;
  });
  return found != sources_.end() ? &*found : nullptr;
}

std::string NamedColumns::names_of(std::initializer_list<Role> roles) const {
  std::string names;
  for (const Role role : roles) {
    if (const Source* const source = find(role)) {
      names += fmt::format("{}{}", names.empty() ? "" : ", ", name_of(*source));
    }
  }
  return printable(names);
}

void NamedColumns::look_at(std::span<const Decimal> cells) {
  for (Source& source : sources_) source.samples.push_back(cells[source.cell]);
}

double NamedColumns::length_unit(std::initializer_list<Role> roles, RecordingHeader& header,
                                 std::vector<Warning>& warnings) const {
  std::optional<Unit> unit;
  std::size_t with_unit = 0;
  bool whole = true;
  double largest = 0;
  for (const Role role : roles) {
    const Source& source = *find(role);
    if (source.meaning.unit) {
      if (unit && unit->per_si != source.meaning.unit->per_si) {
        throw BadColumns{fmt::format("expected the same unit for the columns {}, found several",
                                     names_of(roles))};
      }
      unit = source.meaning.unit;
      ++with_unit;
    }
    const auto [low, high] = extent(source.samples);
    whole = whole && all_whole(source.samples);
    largest = std::fmax(largest, std::fmax(-low, high));
  }
  if (with_unit == roles.size()) return unit->per_si;
  if (with_unit > 0) {
    throw BadColumns{
        fmt::format("expected a unit for all of the columns {} or for none", names_of(roles))};
  }
  constexpr double kFewMetres = 20.0, kMillimetres = 1000.0;
  header.length_unit_assumed = true;
  if (!whole || largest < kFewMetres) return 1.0;
  const bool large = largest > kMillimetres;
  warn(warnings, kWarning.unit_guessed,
       "the columns {} have no unit and hold whole numbers up to {}: they were taken as {}, so "
       "that the largest is {:.4g} m ({:.4g} m if they are centimetres); state the unit in their "
       "names, as in {}_m, _cm or _mm",
       names_of(roles), largest, large ? "millimetres" : "metres",
       large ? largest / 1000.0 : largest, largest / 100.0, names_of({*roles.begin()}));
  return large ? 1000.0 : 1.0;
}

double NamedColumns::angle_unit(const Source& source) const {
  if (source.meaning.unit) return source.meaning.unit->per_si;
  bool any = false;
  for (const Source& other : sources_) {
    const Role role = other.meaning.role;
    if (role < Role::azimuth || role > Role::elevation || other.meaning.unit) continue;
    const auto [low, high] = extent(other.samples);
    if (std::fmax(-low, high) > kTwoPi) return kDegreesPerRadian;
    any = any || !std::isnan(low);
  }
  if (!any) return kDegreesPerRadian;  // no row needs it
  throw BadColumns{
      fmt::format("the angles of column {} may be degrees or radians, as none is above 2 pi; "
                  "expected the unit in the column's name, as in azimuth_deg or azimuth_rad",
                  printable(name_of(source)))};
}

Rounding NamedColumns::rounding(std::initializer_list<Role> roles) const {
  std::vector<const std::vector<Decimal>*> columns;
  CellType type = CellType::integer;
  for (const Role role : roles) {
    const Source& source = *find(role);
    columns.push_back(&source.samples);
    if (source.type == CellType::text || type == CellType::integer) type = source.type;
    if (source.type == CellType::float32 && type == CellType::float64) type = source.type;
  }
  return rounding_of(columns, type);
}

bool NamedColumns::is_shared_by_many(const Source& time) const {
  std::size_t rows = 0, times = 0;
  double last = kNaN, most_returns = 1.0;
  for (const Decimal& cell : time.samples) {
    ++rows;
    if (cell.value != last) ++times;
    last = cell.value;
  }
  if (const Source* const returns = find(Role::return_number)) {
    most_returns = std::fmax(most_returns, extent(returns->samples).second + 1.0);
  }
  if (times == 1) return static_cast<double>(rows) > most_returns;
  return times > 0 && rows / times >= kShotsOfOneTime;
}

int NamedColumns::time_shift(const Source& time, RecordingHeader& header,
                             std::vector<Warning>& warnings) const {
  const std::string name = printable(name_of(time));
  const auto extent_of_times = extent(time.samples);
  const double low = extent_of_times.first, high = extent_of_times.second;
  const bool gps = lower_case(name).starts_with("gps");
  const auto since_1970 = [&](int shift) {
    const double per_second = std::pow(10.0, shift);
    return low >= kEarliestEpoch * per_second && high <= kLatestEpoch * per_second;
  };
  if (time.meaning.unit) {
    const int shift = time.meaning.unit->decimal_shift;
    if (since_1970(shift) && !gps) header.time_reference = TimeReference::utc;
    return shift;
  }
  const double step = median_step(time.samples);
  const bool whole = all_whole(time.samples);
  if (lower_case(name).starts_with("offset_time") && whole) return 9;
  constexpr double kShortest_ns = 1e3, kLongest_ns = 1e5;  // between shots; no other unit fits
  if (whole && step >= kShortest_ns && step <= kLongest_ns) {
    if (since_1970(9) && !gps) header.time_reference = TimeReference::utc;
    warn(warnings, kWarning.unit_guessed,
         "column {} was taken as nanoseconds, because it rises by {} from shot to shot; state the "
         "unit in its name, as in time_ns",
         name, step);
    return 9;
  }
  constexpr double kLongest_s = 0.1;
  static constexpr std::array<std::pair<int, const char*>, 4> kUnits = {
      {{0, "seconds"}, {3, "milliseconds"}, {6, "microseconds"}, {9, "nanoseconds"}}};
  for (const auto& [shift, unit] : kUnits) {
    if (!since_1970(shift) || step > kLongest_s * std::pow(10.0, shift)) continue;
    if (!gps) header.time_reference = TimeReference::utc;
    if (shift != 0) {
      warn(warnings, kWarning.unit_guessed,
           "column {} was taken as {} since 1970; state the unit in its name, as in time_ns", name,
           unit);
    }
    return shift;
  }
  const bool fraction = time.type == CellType::float32 || time.type == CellType::float64 ||
                        std::any_of(time.samples.begin(), time.samples.end(),
                                    [](const Decimal& cell) { return cell.decimals != 0; });
  if (time.samples.empty() || (fraction && std::fmax(-low, high) < 9.2e9)) return 0;
  throw BadColumns{
      fmt::format("the unit of column {} is unclear: its values rise by {} from shot to shot, up "
                  "to {}; expected the unit in the column's name, as in time_s, time_us or time_ns",
                  name, step, high)};
}

void NamedColumns::settle_time(RecordingHeader& header, std::vector<Warning>& warnings) {
  const Source* chosen = nullptr;
  std::string shared;
  for (const Source& source : sources_) {
    if (source.meaning.role != Role::time) continue;
    if (is_shared_by_many(source)) {
      const auto [low, high] = extent(source.samples);
      header.all_times_equal = low == high;
      shared += fmt::format("{}{}", shared.empty() ? "" : ", ", name_of(source));
    } else if (chosen == nullptr) {
      chosen = &source;
    } else {
      unused_.push_back(wanted_[source.cell]);
    }
  }
  if (!shared.empty()) {
    warn(warnings, kWarning.no_shot_times,
         "column {} holds one time for many shots, that of their packet or frame, and no times of "
         "single shots{}",
         printable(shared), chosen != nullptr ? "" : ": the recording has no times");
  }
  header.has_times = chosen != nullptr;
  header.all_times_equal = header.all_times_equal && !header.has_times;
  auto& cell = cell_of_[static_cast<std::size_t>(Role::time)];
  cell.reset();
  if (chosen == nullptr) return;
  cell = chosen->cell;
  time_shift_ = time_shift(*chosen, header, warnings);
}

void NamedColumns::settle_index(std::vector<Warning>& warnings) {
  const Source* const index = find(Role::index);
  if (index == nullptr) return;
  double last = 0.0;
  for (const Decimal& cell : index->samples) {
    if (cell.value >= last && is_whole(cell.value)) {
      last = cell.value;
      continue;
    }
    warn(warnings, kWarning.columns_unused,
         "column {} does not count shots: {} follows {}; rows were counted instead",
         printable(name_of(*index)), cell.value, last);
    cell_of_[static_cast<std::size_t>(Role::index)].reset();
    return;
  }
}

void NamedColumns::settle_returns(RecordingHeader& header) {
  const Source* const returns = find(Role::return_number);
  if (returns == nullptr) return;
  const auto [low, high] = extent(returns->samples);
  if (std::isnan(high)) return;
  return_offset_ = low == 0.0 ? 1 : 0;  // some count returns from 0
  header.returns_per_shot = static_cast<int>(std::clamp(high + return_offset_, 1.0, 255.0));
}

void NamedColumns::settle_intensity(RecordingHeader& header, std::vector<Warning>& warnings) {
  const Source* const intensity = find(Role::intensity);
  header.has_intensity = intensity != nullptr;
  if (intensity == nullptr) return;
  const auto [low, high] = extent(intensity->samples);
  const std::string name = printable(name_of(*intensity));
  if (low < 0.0 || high > 255.0) {
    header.has_intensity = false;
    cell_of_[static_cast<std::size_t>(Role::intensity)].reset();
    warn(warnings, kWarning.columns_unused,
         "column {} holds {} to {}, expected intensities in [0, 255]; they were ignored", name, low,
         high);
  } else if (high <= 1.0 && !all_whole(intensity->samples)) {
    intensity_factor_ = 255.0;
    warn(warnings, kWarning.values_changed, "column {} holds {} to {}: it was multiplied by 255",
         name, low, high);
  }
}

void NamedColumns::settle(RecordingHeader& header, std::vector<Warning>& warnings) {
  for (const Source& source : sources_) {
    cell_of_[static_cast<std::size_t>(source.meaning.role)] = source.cell;
  }
  header.cartesian = cartesian_;
  header.has_range = cartesian_ || find(Role::range) != nullptr;
  header.devices.resize(1);
  header.devices.front().type = kUnknownDeviceType;
  if (cartesian_) {
    length_per_m_ = length_unit({Role::x, Role::y, Role::z}, header, warnings);
    length_rounding_ = rounding({Role::x, Role::y, Role::z});
  } else {
    const Role zenith = find(Role::zenith) != nullptr ? Role::zenith : Role::elevation;
    azimuth_per_rad_ = angle_unit(*find(Role::azimuth));
    zenith_per_rad_ = angle_unit(*find(zenith));
    azimuth_rounding_ = rounding({Role::azimuth});
    zenith_rounding_ = rounding({zenith});
    if (header.has_range) {
      length_per_m_ = length_unit({Role::range}, header, warnings);
      length_rounding_ = rounding({Role::range});
    }
  }
  settle_time(header, warnings);
  settle_index(warnings);
  settle_returns(header);
  settle_intensity(header, warnings);
  if (!unused_.empty()) {
    std::string names;
    for (const std::size_t column : unused_) {
      names += fmt::format("{}{}", names.empty() ? "" : ", ", columns_[column].name);
    }
    warn(warnings, kWarning.columns_unused, "columns that were not used: {}", printable(names));
  }
  for (Source& source : sources_) source.samples = {};
}

const Decimal* NamedColumns::cell(std::span<const Decimal> cells, Role role) const {
  const auto& place = cell_of_[static_cast<std::size_t>(role)];
  return place ? &cells[*place] : nullptr;
}

std::string NamedColumns::name_of(Role role) const {
  return printable(name(*cell_of_[static_cast<std::size_t>(role)]));
}

std::uint8_t NamedColumns::byte(std::span<const Decimal> cells, Role role) const {
  const Decimal* const number = cell(cells, role);
  if (number == nullptr || std::isnan(number->value)) return 0;
  const double value = number->value * (role == Role::intensity ? intensity_factor_ : 1.0);
  if (!(value >= 0.0 && value <= 255.0)) {
    throw BadRow{fmt::format("expected {} in [0, 255], found {}", name_of(role), number->value)};
  }
  return static_cast<std::uint8_t>(std::lround(value));
}

std::uint8_t NamedColumns::return_number(std::span<const Decimal> cells) const {
  const Decimal* const number = cell(cells, Role::return_number);
  if (number == nullptr || std::isnan(number->value)) return 1;
  const double value = number->value + return_offset_;
  if (!(value >= 1.0 && value <= 255.0) || !is_whole(value)) {
    throw BadRow{fmt::format("expected {} to be a whole number in [{}, {}], found {}",
                             name_of(Role::return_number), 1 - return_offset_, 255 - return_offset_,
                             number->value)};
  }
  return static_cast<std::uint8_t>(value);
}

std::int64_t NamedColumns::time_of(std::span<const Decimal> cells, std::uint8_t return_number) {
  if (const Decimal* const time = cell(cells, Role::time)) {
    const std::string& column = name(*cell_of_[static_cast<std::size_t>(Role::time)]);
    if (time->decimals >= 0) {
      Decimal seconds = *time;
      seconds.decimals += time_shift_;
      return nanoseconds_of(seconds, column);
    }
    if (std::isnan(time->value)) {
      throw BadRow{fmt::format("expected a time in column {}, found none", printable(column))};
    }
    if (time_shift_ == 0) return nanoseconds_of(*time, column);
    constexpr double kLatest_ns = 9.2e18;
    const double time_ns = time->value * std::pow(10.0, 9 - time_shift_);
    if (!(std::abs(time_ns) < kLatest_ns)) {
      throw BadRow{fmt::format("expected a time within +-9.2e9 s in column {}, found {} ns",
                               printable(column), time_ns)};
    }
    return std::llround(time_ns);
  }
  if (const Decimal* const index = cell(cells, Role::index)) {
    constexpr double kLargest = 0x1p53;
    if (!(index->value >= 0.0 && index->value <= kLargest) || !is_whole(index->value)) {
      throw BadRow{fmt::format("expected a shot number of 0 or more in column {}, found {}",
                               name_of(Role::index), index->value)};
    }
    return static_cast<std::int64_t>(index->value);
  }
  if (return_number <= 1 || next_shot_ == 0) ++next_shot_;
  return next_shot_ - 1;
}

/// A coordinate or a range, m; NaN if there is none.
double NamedColumns::length(const Decimal& cell, Role role, double low) const {
  const double value = cell.value / length_per_m_;
  if (value < low || value > kFarthest) {
    throw BadRow{
        fmt::format("expected {} in [{}, {}] m, found {}", name_of(role), low, kFarthest, value)};
  }
  return value;
}

Vector3<double> NamedColumns::point(std::span<const Decimal> cells) const {
  const auto coordinate = [&](Role role) { return length(*cell(cells, role), role, -kFarthest); };
  const Vector3<double> point{coordinate(Role::x), coordinate(Role::y), coordinate(Role::z)};
  return std::isnan(point.x + point.y + point.z) ? Vector3<double>{} : point;
}

SphericalAngles<double> NamedColumns::angles(std::span<const Decimal> cells) const {
  const auto angle = [&](Role role, double per_rad, double low_deg, double high_deg) {
    const double value = cell(cells, role)->value;
    const double value_deg = value / per_rad * kDegreesPerRadian;
    if (value_deg < low_deg - kAngleSlack_deg || value_deg > high_deg + kAngleSlack_deg) {
      throw BadRow{fmt::format("expected {} in [{}, {}] deg, found {:.9g}", name_of(role), low_deg,
                               high_deg, value_deg)};
    }
    // Values in degrees are not converted to radians and back.
    const double degrees = per_rad == kDegreesPerRadian ? value : value_deg;
    return degrees < low_deg ? low_deg : degrees > high_deg ? high_deg : degrees;
  };
  const double azimuth_deg = angle(Role::azimuth, azimuth_per_rad_, -180.0, 360.0);
  const bool has_zenith = cell(cells, Role::zenith) != nullptr;
  const double zenith_deg = has_zenith
                                ? angle(Role::zenith, zenith_per_rad_, 0.0, 180.0)
                                : 90.0 - angle(Role::elevation, zenith_per_rad_, -90.0, 90.0);
  if (std::isnan(azimuth_deg + zenith_deg)) return {kNaN, kNaN};
  return {azimuth_from_degrees(azimuth_deg), std::min(radians_from_degrees(zenith_deg), kPi)};
}

void NamedColumns::append(std::span<const Decimal> cells, Observations& rows) {
  // All errors of a row are detected before it begins.
  const std::uint8_t number = return_number(cells), intensity = byte(cells, Role::intensity),
                     tag = byte(cells, Role::tag), beam = byte(cells, Role::beam);
  Vector3<double> position;
  SphericalAngles<double> direction{kNaN, kNaN};
  double distance = kNaN;
  const Decimal* const range = cell(cells, Role::range);
  if (cartesian_) {
    position = point(cells);
  } else {
    direction = angles(cells);
    if (range != nullptr) distance = length(*range, Role::range, 0.0);
  }
  const std::size_t row = append_observation(rows, time_of(cells, number));
  rows.return_number[row] = number;
  rows.intensity[row] = intensity;
  rows.tag[row] = tag;
  rows.beam[row] = beam;
  if (cartesian_) {
    for (const Role role : {Role::x, Role::y, Role::z}) {
      length_rounding_.notice(*cell(cells, role));
    }
    const double largest =
        std::max({std::abs(position.x), std::abs(position.y), std::abs(position.z)});
    const double step = length_rounding_.step > 0.0 ? length_rounding_.step / length_per_m_
                                                    : length_rounding_.relative * largest;
    set_cartesian(rows, row, position, step);
    return;
  }
  const bool has_zenith = cell(cells, Role::zenith) != nullptr;
  const Decimal& azimuth_cell = *cell(cells, Role::azimuth);
  const Decimal& zenith_cell = *cell(cells, has_zenith ? Role::zenith : Role::elevation);
  azimuth_rounding_.notice(azimuth_cell);
  zenith_rounding_.notice(zenith_cell);
  const bool has_direction = !std::isnan(direction.azimuth);
  if (range != nullptr) {
    length_rounding_.notice(*range);
    if (std::isnan(distance) || !has_direction) distance = 0.0;
  }
  set_spherical(rows, row, direction.azimuth, direction.zenith, distance);
  if (range == nullptr) rows.valid[row] = has_direction ? 1 : 0;
  const auto set = [](float& resolution, const Rounding& rounding, double value, double per_si) {
    resolution = static_cast<float>(std::isnan(value) ? 0.0 : rounding.step_at(value) / per_si);
  };
  set(rows.azimuth_resolution[row], azimuth_rounding_, azimuth_cell.value, azimuth_per_rad_);
  set(rows.zenith_resolution[row], zenith_rounding_, zenith_cell.value, zenith_per_rad_);
  set(rows.range_resolution[row], length_rounding_, range != nullptr ? range->value : 0.0,
      length_per_m_);
}

}  // namespace risley::recordings
