// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Meaning of columns by their names, and conversion of their cells to rows: shared by every format
// with named columns.
//
// Names, in any case and order, each with or without a unit as "x_m", "x [mm]", "X (m)", "Time/s":
// x, y, z; or azimuth (phi, yaw) and zenith (theta) or elevation (pitch, altitude), with or without
// range (distance, depth, radius, r); time (timestamp, t, offset_time, gps_time); index (shot,
// shot_number, row); intensity (reflectivity, reflectance, i); return_number (return, returnnum);
// tag; line (beam, ring, laser_id).
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "risley/core/direction.hpp"
#include "risley/recordings/observations.hpp"

#include "recordings/formats/rounding.hpp"
#include "recordings/formats/text_table.hpp"

namespace risley::recordings {

struct NamedColumn {
  std::string name;
  CellType type = CellType::text;
};

/// Columns that cannot form rows; the reader adds the file and the place.
class BadColumns : public Error {
 public:
  using Error::Error;
};

/// Number of rows that a reader shows to NamedColumns before the first is made.
inline constexpr std::size_t kNamedRowsLookedAt = 8192;

/// Turns the cells of named columns into observations.
class NamedColumns {
 public:
  /// Finds the columns by their names.
  /// @throws BadColumns when those of a direction are missing: the columns found and those needed
  explicit NamedColumns(std::vector<NamedColumn> columns);

  /// Numbers of the columns that form rows; look_at() and append() take their cells in this order.
  /// Integers beyond 64 bits and floats have decimals = -1, cells without a number are NaN.
  const std::vector<std::size_t>& wanted() const { return wanted_; }
  const std::string& name(std::size_t wanted) const { return columns_[wanted_[wanted]].name; }

  /// One of the first rows, kept until settle().
  void look_at(std::span<const Decimal> cells);

  /// Decides units, rounding and the meaning of times from the rows seen, and completes the header.
  /// @param warnings  receives assumptions and ignored columns
  /// @throws BadColumns when a unit is unclear
  void settle(RecordingHeader& header, std::vector<Warning>& warnings);

  /// Adds one row. @throws BadRow, leaving the rows unchanged
  void append(std::span<const Decimal> cells, Observations& rows);

 private:
  enum class Role : std::uint8_t {
    x,
    y,
    z,
    range,
    azimuth,
    zenith,
    elevation,
    time,
    index,
    intensity,
    return_number,
    tag,
    beam,
    none
  };
  struct Unit {
    enum class Kind : std::uint8_t { length, angle, time } kind;
    double per_si;          ///< how many are 1 m or 1 rad
    int decimal_shift = 0;  ///< of a time: seconds are the number * 10^-shift
  };
  struct Meaning {
    Role role = Role::none;
    std::optional<Unit> unit;
  };
  /// A column that is used, or may be: its cell in look_at() and append().
  struct Source {
    std::size_t cell = 0;
    Meaning meaning;
    CellType type = CellType::text;
    std::vector<Decimal> samples;
  };

  static Meaning meaning_of(std::string_view name);
  static std::optional<Unit> unit_of(std::string_view text);
  static Role role_of(std::string_view base);
  [[noreturn]] void refuse_directions() const;
  const Source* find(Role role) const;
  const std::string& name_of(const Source& source) const { return name(source.cell); }
  std::string names_of(std::initializer_list<Role> roles) const;

  double length_unit(std::initializer_list<Role> roles, RecordingHeader& header,
                     std::vector<Warning>& warnings) const;
  double angle_unit(const Source& source) const;
  Rounding rounding(std::initializer_list<Role> roles) const;
  void settle_time(RecordingHeader& header, std::vector<Warning>& warnings);
  void settle_index(std::vector<Warning>& warnings);
  void settle_returns(RecordingHeader& header);
  void settle_intensity(RecordingHeader& header, std::vector<Warning>& warnings);
  bool is_shared_by_many(const Source& time) const;
  int time_shift(const Source& time, RecordingHeader& header, std::vector<Warning>& warnings) const;

  /// The cell of a role, nullptr if no column has it.
  const Decimal* cell(std::span<const Decimal> cells, Role role) const;
  std::uint8_t byte(std::span<const Decimal> cells, Role role) const;
  std::uint8_t return_number(std::span<const Decimal> cells) const;
  /// Time or shot number; counts the shot.
  std::int64_t time_of(std::span<const Decimal> cells, std::uint8_t return_number);
  Vector3<double> point(std::span<const Decimal> cells) const;
  SphericalAngles<double> angles(std::span<const Decimal> cells) const;
  double range(std::span<const Decimal> cells) const;
  double length(const Decimal& cell, Role role, double low) const;
  std::string name_of(Role role) const;

  std::vector<NamedColumn> columns_;
  std::vector<std::size_t> wanted_, unused_;
  std::vector<Source> sources_;
  std::array<std::optional<std::size_t>, static_cast<std::size_t>(Role::none)> cell_of_{};
  bool cartesian_ = false;
  double length_per_m_ = 1.0, azimuth_per_rad_ = 1.0, zenith_per_rad_ = 1.0;
  int time_shift_ = 0;
  double intensity_factor_ = 1.0;
  int return_offset_ = 0;
  Rounding length_rounding_, azimuth_rounding_, zenith_rounding_;
  std::int64_t next_shot_ = 0;
};

}  // namespace risley::recordings
