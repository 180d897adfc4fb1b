// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "cloud/formats/point_fields.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <xsimd/xsimd.hpp>

#include "risley/core/angle.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/optics/parameters.hpp"

namespace risley::cloud {
namespace {

/// Rows processed together: data read and written stay in the cache.
constexpr std::size_t kPackedRows = 256;

/// Square roots of up to kPackedRows numbers. std::sqrt sets errno below zero, which keeps
/// compilers from taking several at once.
void square_roots(const double* from, std::size_t count, double* to) {
  using Batch = xsimd::batch<double>;
  const std::size_t whole = count - count % Batch::size;
  for (std::size_t i = 0; i < whole; i += Batch::size) {
    xsimd::sqrt(Batch::load_unaligned(from + i)).store_unaligned(to + i);
  }
  for (std::size_t i = whole; i < count; ++i) to[i] = std::sqrt(from[i]);
}

template <class To, class From>
void store_numbers(const From* from, std::size_t count, double factor, std::uint8_t* to,
                   std::size_t stride) {
  for (std::size_t i = 0; i < count; ++i, to += stride) {
    if constexpr (std::is_floating_point_v<To>) {
      io::store<To>(to, static_cast<To>(factor * static_cast<double>(from[i])));
    } else {
      io::store<To>(to, static_cast<To>(from[i]));
    }
  }
}

/// What distinguishes one of several similar columns, in each of PointColumn's texts.
struct Words {
  std::string field, note, variable, meaning;
};

constexpr CovarianceTerm kVariancesFirst[] = {kXX, kYY, kZZ, kXY, kXZ, kYZ};
constexpr std::pair<int, int> kAxesOfTerm[] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
constexpr std::string_view kAxes = "xyz", kCapitals = "XYZ";

Words words_of_term(CovarianceTerm term, bool deviation) {
  const auto [a, b] = kAxesOfTerm[term];
  const char capital = kCapitals[a];
  if (deviation) return {{capital}, {capital}, {kAxes[a]}, fmt::format("{}_m", kAxes[a])};
  return {a == b ? fmt::format("Variance{}", capital)
                 : fmt::format("Covariance{}{}", capital, kCapitals[b]),
          a == b ? "variance" : "covariance", fmt::format("{}{}", kAxes[a], kAxes[b]),
          fmt::format("{}_m and {}_m", kAxes[a], kAxes[b])};
}

}  // namespace

const TypeNames& names_of(PointType type) {
  static constexpr TypeNames kNames[] = {{1, "|u1", "uchar", 'U', 2, 1},
                                         {4, "<f4", "float", 'F', 7, 9},
                                         {8, "<f8", "double", 'F', 8, 10},
                                         {4, "<i4", "int", 'I', 5, 6},
                                         {8, "<i8", nullptr, 'I', 0, 8}};
  return kNames[static_cast<int>(type)];
}

const UnitNames& names_of(PointUnit unit) {
  static constexpr UnitNames kNames[] = {
      {"", "", "1", 1},      {"m", "m", "m", 1},
      {"m2", "m2", "m2", 1}, {"degrees", "deg", "degree", kDegreesPerRadian},
      {"s", "s", "s", 1e-9}, {"ns", "ns", "ns", 1}};
  return kNames[static_cast<int>(unit)];
}

void PointField::store(const Points& points, std::size_t first, std::size_t rows, std::uint8_t* to,
                       std::size_t stride) const {
  const double factor = names_of(column->unit).per_unit_of_memory;
  const auto put = [&](const auto* from, std::size_t count) {
    with_number_type(type, [&]<class To>() {
      if (stride == sizeof(To)) {  // which compilers turn into wide instructions
        store_numbers<To>(from, count, factor, to, sizeof(To));
      } else {
        store_numbers<To>(from, count, factor, to, stride);
      }
    });
  };
  std::visit(
      [&](auto place) {
        const auto& all = points.*place;
        using Column = std::remove_cvref_t<decltype(all)>;
        if constexpr (std::is_arithmetic_v<typename Column::value_type>) {
          put(all.data() + first, rows);
        } else if constexpr (std::is_same_v<typename Column::value_type, std::vector<double>>) {
          const double* from = all[index].data() + first;
          if (!column->is(PointColumn::kDerived)) return put(from, rows);
          double roots[kPackedRows];
          for (std::size_t i = 0; i < rows; i += kPackedRows, to += kPackedRows * stride) {
            const std::size_t count = std::min(kPackedRows, rows - i);
            square_roots(from + i, count, roots);
            put(roots, count);
          }
        } else {
          put(all[index][axis].data() + first, rows);
        }
      },
      column->place);
}

std::vector<PointField> fields_of(const PointColumn& column, const CloudHeader& header) {
  std::vector<PointField> fields;
  if (!header.announces(column)) return fields;
  const auto text = [](std::string_view pattern, const std::string& word, const Words& words) {
    return fmt::format(fmt::runtime(pattern), word, words.variable);
  };
  const auto add = [&](const Words& words, std::size_t index = 0, std::size_t axis = 0) {
    fields.push_back({&column, text(column.field, words.field, words),
                      text(column.note, words.note, words),
                      text(column.variable, words.variable, words),
                      text(column.meaning, words.meaning, words), column.type, index, axis});
  };
  std::visit(
      [&](auto place) {
        using Column = std::remove_cvref_t<decltype(std::declval<Points>().*place)>;
        if constexpr (std::is_same_v<Column, decltype(Points::covariance)>) {
          const bool deviation = column.is(PointColumn::kDerived);
          for (const CovarianceTerm term : std::span(kVariancesFirst).first(deviation ? 3 : 6)) {
            add(words_of_term(term, deviation), term);
          }
        } else if constexpr (std::is_same_v<Column, decltype(Points::rotation_angle)>) {
          for (int k = 0; k < header.prisms; ++k) {
            add({std::to_string(k + 1), {}, {prism_letter(k)}, {prism_capital(k)}}, k);
          }
        } else if constexpr (std::is_same_v<Column, decltype(Points::loading)>) {
          for (std::size_t k = 0; k < header.factors.size(); ++k) {
            for (std::size_t i = 0; i < 3; ++i) {
              add({fmt::format("{}{}", k + 1, kCapitals[i]),
                   {},
                   {kAxes[i]},
                   fmt::format("{}_m", kAxes[i])},
                  k, i);
            }
          }
        } else {
          const std::size_t axis = kCapitals.find(column.axis);
          const std::string word = axis < 3 ? header.frame.axes[axis] : std::string();
          add({{}, word, {}, word});
        }
      },
      column.place);
  return fields;
}

std::vector<PointField> all_fields(const CloudHeader& header) {
  std::vector<PointField> all;
  for (const PointColumn& column : kPointColumns) {
    if (column.field.empty()) continue;
    std::ranges::move(fields_of(column, header), std::back_inserter(all));
  }
  std::stable_partition(all.begin(), all.end(), [](const PointField& field) {
    return kCapitals.find(field.column->axis) < 3;
  });
  return all;
}

RecordPacker::RecordPacker(std::vector<PointField> fields) : fields_(std::move(fields)) {
  for (const PointField& field : fields_) {
    offsets_.push_back(record_bytes_);
    record_bytes_ += names_of(field.type).bytes;
  }
}

void RecordPacker::pack(const Points& points, std::size_t first, std::size_t rows,
                        std::uint8_t* out, std::size_t stride) const {
  for (const std::size_t end = first + rows; first < end; first += kPackedRows) {
    const std::size_t count = std::min(kPackedRows, end - first);
    for (std::size_t k = 0; k < fields_.size(); ++k) {
      fields_[k].store(points, first, count, out + offsets_[k], stride);
    }
    out += count * stride;
  }
}

}  // namespace risley::cloud
