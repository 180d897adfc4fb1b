// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "risley/cloud/points.hpp"

namespace risley::cloud {

/// Name of a type in formats, if they support it.
struct TypeNames {
  std::size_t bytes;
  const char *npy, *ply;
  char pcd;
  std::uint8_t ros;  ///< PointField::datatype
  std::uint8_t las;  ///< data type of extra bytes
};
const TypeNames& names_of(PointType type);

/// What formats call a unit.
struct UnitNames {
  const char *plain, *suffix, *netcdf;
  double per_unit_of_memory;
};
const UnitNames& names_of(PointUnit unit);

/// Calls function.operator()<T>() with the type of the numbers.
template <class Function>
void with_number_type(PointType type, const Function& function) {
  if (type == PointType::uint8) function.template operator()<std::uint8_t>();
  if (type == PointType::float32) function.template operator()<float>();
  if (type == PointType::float64) function.template operator()<double>();
  if (type == PointType::int32) function.template operator()<std::int32_t>();
  if (type == PointType::int64) function.template operator()<std::int64_t>();
}

/// A number of every point in files: one of those that an entry of kPointColumns represents.
struct PointField {
  const PointColumn* column;
  std::string name, note;         ///< in records; no name: not in records
  std::string variable, meaning;  ///< in NetCDF
  PointType type;                 ///< that of the column, or the format's own
  std::size_t index = 0;          ///< term, prism or common factor
  std::size_t axis = 0;           ///< of the factor

  /// Stores the numbers of the rows [first, first + rows), `stride` bytes apart.
  void store(const Points& points, std::size_t first, std::size_t rows, std::uint8_t* to,
             std::size_t stride) const;
  /// "m", "degrees"; empty without one
  const char* unit() const { return names_of(column->unit).plain; }
};

/// Those of one column that the header announces; variances before covariances.
std::vector<PointField> fields_of(const PointColumn& column, const CloudHeader& header);
/// All of records: X, Y and Z, then the others in the order of kPointColumns.
std::vector<PointField> all_fields(const CloudHeader& header);

/// Points as packed records, little-endian, shared by several binary formats.
class RecordPacker {
 public:
  explicit RecordPacker(std::vector<PointField> fields);

  const std::vector<PointField>& fields() const { return fields_; }
  std::size_t record_bytes() const { return record_bytes_; }
  /// Byte at which a field starts in its record.
  std::size_t offset(std::size_t field) const { return offsets_[field]; }

  /// Packs the rows [first, first + rows) into records that begin `stride` bytes apart, the first
  /// at `out`, which may be null if there are no rows.
  void pack(const Points& points, std::size_t first, std::size_t rows, std::uint8_t* out,
            std::size_t stride) const;

 private:
  std::vector<PointField> fields_;
  std::vector<std::size_t> offsets_;
  std::size_t record_bytes_ = 0;
};

}  // namespace risley::cloud
