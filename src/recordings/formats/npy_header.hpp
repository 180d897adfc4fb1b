// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "risley/core/error.hpp"

#include "recordings/formats/binary_table.hpp"
#include "recordings/formats/byte_source.hpp"

namespace risley::recordings {

/// The error in the header of an array; the reader adds file and place.
class BadArray : public Error {
 public:
  using Error::Error;
};

/// One number of an array's elements.
struct ArrayField {
  std::string name;  ///< empty for elements that are plain numbers
  NumberType type;
  std::size_t offset = 0;
};

/// The header of a NumPy array, at the beginning of .npy files and of the members of .npz files.
struct ArrayHeader {
  std::vector<ArrayField> fields;
  std::vector<std::string> other_fields;  ///< whose type is no number
  std::size_t element_bytes = 0;
  bool fortran_order = false;
  std::vector<std::uint64_t> shape;
  std::uint64_t data_offset = 0;  ///< from the beginning of the array

  bool is_structured() const { return fields.size() != 1 || !fields.front().name.empty(); }
  std::uint64_t elements() const;
  std::string shape_text() const;
};

inline constexpr std::string_view kArraySignature = "\x93NUMPY";

/// Reads the header and leaves the source at the first element.
/// @throws BadArray also when the elements would take more than 2^63 bytes
ArrayHeader read_array_header(ByteSource& source);

/// A lane of an array's bytes from `offset` on, counted from the array's beginning.
using OpenArray = std::function<std::unique_ptr<ByteSource>(std::uint64_t offset)>;

/// Whether an array is a table: structured, or of rows with 3 (x y z) or 4 (x y z intensity)
/// numbers.
bool is_table(const ArrayHeader& header);

/// Adds the columns of such an array to a table, and sets its number of rows.
/// @throws BadArray when it is none
void add_table(const ArrayHeader& header, const OpenArray& open, BinaryTable& table);

/// Adds an array of one dimension as a column.
void add_column(const ArrayHeader& header, const std::string& name, const OpenArray& open,
                BinaryTable& table);

}  // namespace risley::recordings
