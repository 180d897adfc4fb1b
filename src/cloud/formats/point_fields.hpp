// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "risley/cloud/points.hpp"

namespace risley::cloud {

/// How a field's numbers stand in a file.
enum class FieldType : std::uint8_t { uint8, float32, float64 };

/// What formats call a type.
struct TypeNames {
  std::size_t bytes;
  const char *npy, *ply;
  char pcd;
  std::uint8_t ros;  ///< PointField::datatype
};
const TypeNames& names_of(FieldType type);

/// Calls function.operator()<T>() with the type of the numbers.
template <class Function>
void with_number_type(FieldType type, const Function& function) {
  if (type == FieldType::uint8) function.template operator()<std::uint8_t>();
  if (type == FieldType::float32) function.template operator()<float>();
  if (type == FieldType::float64) function.template operator()<double>();
}

/// One number per point as files hold it.
struct PointField {
  std::string name;         ///< as PDAL names it where it has a name: "StdX", "LidarRange"
  std::string unit;         ///< "m", "m2", "degrees", "s"; empty without one
  std::string description;  ///< at most 31 characters, which is what LAS has room for
  FieldType type = FieldType::float32;
  /// Fills a column with the values of the points from `first` on, in the field's unit.
  std::function<void(const Points& points, std::size_t first, std::span<double> values)> values;
  /// The same as float32, which the float32 fields made below have.
  std::function<void(const Points& points, std::size_t first, std::span<float> values)> floats = {};
};

/// X, Y and Z (m, float64).
std::vector<PointField> coordinate_fields(const CloudHeader& header);
/// Time (s, float64, as recorded), Intensity, ReturnNumber, NumberOfReturns, Tag and Beam.
std::vector<PointField> sensor_fields();
/// What LAS needs extra bytes for (float32): StdX ... StdZ, VarianceX ... VarianceZ, CovarianceXY,
/// CovarianceXZ, CovarianceYZ where there is a covariance, OwnVarianceX ... OwnCovarianceYZ where
/// points have it, LidarRange, IncidenceAngle, and
/// PrismAngle1 ..., ResidualAzimuth, ResidualZenith where rotation angles are known. Angles in
/// degrees.
std::vector<PointField> uncertainty_fields(const CloudHeader& header);
/// Loading<factor>X, ...Y, ...Z of every common factor (m, float32), factors counted from 1.
std::vector<PointField> loading_fields(const CloudHeader& header);
/// All of these, in this order.
std::vector<PointField> all_fields(const CloudHeader& header);

/// Points as packed records, little-endian: what several binary formats share.
class RecordPacker {
 public:
  explicit RecordPacker(std::vector<PointField> fields);

  const std::vector<PointField>& fields() const { return fields_; }
  std::size_t record_bytes() const { return record_bytes_; }
  /// Byte at which a field starts in its record.
  std::size_t offset(std::size_t field) const { return offsets_[field]; }

  /// Packs all points into records that begin `stride` bytes apart, the first at `out`, which
  /// may be null where there are no points.
  void pack(const Points& points, std::uint8_t* out, std::size_t stride);

 private:
  std::vector<PointField> fields_;
  std::vector<std::size_t> offsets_;
  std::size_t record_bytes_ = 0;
  std::vector<double> values_;
};

}  // namespace risley::cloud
