// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "cloud/formats/point_fields.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <xsimd/xsimd.hpp>

#include "risley/core/angle.hpp"
#include "risley/io/little_endian.hpp"

namespace risley::cloud {
namespace {

/// A field whose numbers are a column as it is, or scaled. @param column  gives it from the points
template <class Column>
PointField scaled(std::string name, std::string unit, std::string description, FieldType type,
                  Column column, double scale = 1.0) {
  const auto fill = [column, scale](const Points& points, std::size_t first, auto values) {
    const auto* from = column(points).data() + first;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double value = scale * static_cast<double>(from[i]);
      values[i] = static_cast<std::remove_reference_t<decltype(values[i])>>(value);
    }
  };
  PointField field{std::move(name), std::move(unit), std::move(description), type, fill};
  if (type == FieldType::float32) field.floats = fill;
  return field;
}

/// Square roots. std::sqrt sets errno below zero, which keeps compilers from taking several at
/// once.
template <class Number>
void square_roots(const double* from, std::span<Number> to) {
  using Batch = xsimd::batch<double>;
  const std::size_t whole = to.size() - to.size() % Batch::size;
  for (std::size_t i = 0; i < whole; i += Batch::size) {
    alignas(Batch::arch_type::alignment()) double roots[Batch::size];
    xsimd::sqrt(Batch::load_unaligned(from + i)).store_aligned(roots);
    for (std::size_t k = 0; k < Batch::size; ++k) to[i + k] = static_cast<Number>(roots[k]);
  }
  for (std::size_t i = whole; i < to.size(); ++i) to[i] = static_cast<Number>(std::sqrt(from[i]));
}

PointField standard_deviation(const char* axis, CovarianceTerm term) {
  const auto fill = [term](const Points& points, std::size_t first, auto values) {
    square_roots(points.covariance[term].data() + first, values);
  };
  return {fmt::format("Std{}", axis), "m",  fmt::format("1 sigma of {} (m)", axis),
          FieldType::float32,         fill, fill};
}

}  // namespace

const TypeNames& names_of(FieldType type) {
  static constexpr TypeNames kNames[] = {
      {1, "|u1", "uchar", 'U', 2}, {4, "<f4", "float", 'F', 7}, {8, "<f8", "double", 'F', 8}};
  return kNames[static_cast<int>(type)];
}

std::vector<PointField> coordinate_fields(const CloudHeader& header) {
  constexpr FieldType kType = FieldType::float64;
  return {
      scaled(
          "X", "m", header.frame.axes[0], kType, [](const Points& p) -> auto& { return p.x; }),
      scaled(
          "Y", "m", header.frame.axes[1], kType, [](const Points& p) -> auto& { return p.y; }),
      scaled(
          "Z", "m", header.frame.axes[2], kType, [](const Points& p) -> auto& { return p.z; }),
  };
}

std::vector<PointField> sensor_fields() {
  constexpr FieldType kType = FieldType::uint8;
  return {
      scaled(
          "Time", "s", "of the shot, recording's clock", FieldType::float64,
          [](const Points& p) -> auto& { return p.time_ns; }, 1e-9),
      scaled(
          "Intensity", "", "as reported, 0-255", kType,
          [](const Points& p) -> auto& { return p.intensity; }),
      scaled(
          "ReturnNumber", "", "from 1", kType,
          [](const Points& p) -> auto& { return p.return_number; }),
      scaled(
          "NumberOfReturns", "", "of the shot", kType,
          [](const Points& p) -> auto& { return p.number_of_returns; }),
      scaled(
          "Tag", "", "of the sensor's record", kType,
          [](const Points& p) -> auto& { return p.tag; }),
      scaled(
          "Beam", "", "firing beam, from 0", kType,
          [](const Points& p) -> auto& { return p.beam; }),
  };
}

std::vector<PointField> uncertainty_fields(const CloudHeader& header) {
  std::vector<PointField> fields;
  const auto add = [&fields](std::string name, std::string unit, std::string description,
                             auto column, double scale = 1.0) {
    fields.push_back(scaled(std::move(name), std::move(unit), std::move(description),
                            FieldType::float32, column, scale));
  };
  if (header.has_covariance) {
    constexpr std::pair<const char*, CovarianceTerm> kAxes[] = {{"X", kXX}, {"Y", kYY}, {"Z", kZZ}};
    const auto add_term = [&add](std::string name, const char* description, CovarianceTerm term) {
      add(
          std::move(name), "m2",
          description, [term](const Points& p) -> auto& { return p.covariance[term]; });
    };
    for (const auto& [axis, term] : kAxes) fields.push_back(standard_deviation(axis, term));
    for (const auto& [axis, term] : kAxes) {
      add_term(fmt::format("Variance{}", axis), "variance (m2)", term);
    }
    add_term("CovarianceXY", "covariance (m2)", kXY);
    add_term("CovarianceXZ", "covariance (m2)", kXZ);
    add_term("CovarianceYZ", "covariance (m2)", kYZ);
  }
  if (header.has_own_covariance) {
    constexpr std::pair<const char*, CovarianceTerm> kTerms[] = {
        {"OwnVarianceX", kXX},    {"OwnVarianceY", kYY},    {"OwnVarianceZ", kZZ},
        {"OwnCovarianceXY", kXY}, {"OwnCovarianceXZ", kXZ}, {"OwnCovarianceYZ", kYZ}};
    for (const auto& [name, term] : kTerms) {
      add(
          name, "m2", "not shared with others (m2)", [term = term](const Points& p) -> auto& {
            return p.own_covariance[term];
          });
    }
  }
  add(
      "LidarRange", "m", "range from the last prism (m)",
      [](const Points& p) -> auto& { return p.range; });
  add(
      "IncidenceAngle", "degrees", "beam to surface normal (deg)",
      [](const Points& p) -> auto& { return p.incidence; }, kDegreesPerRadian);
  if (header.has_rotation_angles) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(header.prisms); ++k) {
      add(
          fmt::format("PrismAngle{}", k + 1), "degrees",
          "rotation angle (deg)", [k](const Points& p) -> auto& { return p.rotation_angle[k]; },
          kDegreesPerRadian);
    }
    add(
        "ResidualAzimuth", "degrees", "reported - smoothed (deg)",
        [](const Points& p) -> auto& { return p.azimuth_residual; }, kDegreesPerRadian);
    add(
        "ResidualZenith", "degrees", "reported - smoothed (deg)",
        [](const Points& p) -> auto& { return p.zenith_residual; }, kDegreesPerRadian);
  }
  return fields;
}

std::vector<PointField> loading_fields(const CloudHeader& header) {
  constexpr char kAxes[] = {'X', 'Y', 'Z'};
  std::vector<PointField> fields;
  for (std::size_t k = 0; k < header.factors.size(); ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      fields.push_back(scaled(
          fmt::format("Loading{}{}", k + 1, kAxes[axis]), "m", "per sigma of a common factor",
          FieldType::float32,
          [ k, axis ](const Points& p) -> auto& { return p.loading[k][axis]; }));
    }
  }
  return fields;
}

std::vector<PointField> all_fields(const CloudHeader& header) {
  std::vector<PointField> fields = coordinate_fields(header);
  for (auto& more : {sensor_fields(), uncertainty_fields(header), loading_fields(header)}) {
    fields.insert(fields.end(), more.begin(), more.end());
  }
  return fields;
}

RecordPacker::RecordPacker(std::vector<PointField> fields) : fields_(std::move(fields)) {
  for (const PointField& field : fields_) {
    offsets_.push_back(record_bytes_);
    record_bytes_ += names_of(field.type).bytes;
  }
}

void RecordPacker::pack(const Points& points, std::uint8_t* out, std::size_t stride) {
  if (points.size() == 0) return;
  values_.resize(points.size());
  for (std::size_t k = 0; k < fields_.size(); ++k) {
    fields_[k].values(points, 0, values_);
    with_number_type(fields_[k].type, [&]<class T>() {
      std::uint8_t* to = out + offsets_[k];
      for (const double value : values_) {
        io::store<T>(to, static_cast<T>(value));
        to += stride;
      }
    });
  }
}

}  // namespace risley::cloud
