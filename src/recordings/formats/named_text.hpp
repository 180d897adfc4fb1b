// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "recordings/formats/named_columns.hpp"
#include "recordings/formats/text_table.hpp"

namespace risley::recordings {

/// Position of the rows of a text, and the names of its columns.
struct NamedTextLayout {
  std::vector<std::string> names;
  std::vector<bool> lists;  ///< columns of any number of fields, that first; empty without any
  char delimiter = kBlanks;
  std::uint64_t names_line = 1, first_row_line = 2;  ///< from 1
  std::optional<std::uint64_t> rows;                 ///< if the file states their number
  std::uint64_t rows_line = 0;    ///< if it does so and nothing may follow them, otherwise 0
  std::vector<Warning> warnings;  ///< of the part before the rows
};

/// Reads rows of numbers whose columns have names.
class NamedTextReader final : public TextTableReader {
 public:
  /// @throws FileError when the columns cannot form rows
  NamedTextReader(const io::InputFile& file, std::string_view format, NamedTextLayout layout);

 private:
  NamedColumns find_columns() const;
  void read_cells(Fields fields);
  void append_row(Fields fields, Chunk& chunk) override;

  NamedTextLayout layout_;
  NamedColumns columns_;
  std::vector<Decimal> cells_;
};

/// The lines at the beginning of a file, followed by text or bytes.
class HeaderLines {
 public:
  /// @throws FileError
  explicit HeaderLines(const io::InputFile& input);

  /// The next line without its end and the blanks around it.
  /// @throws FileError at the end of the file, or of the longest header
  std::string_view next();
  std::uint64_t line() const { return line_; }      ///< of the last line, from 1
  std::uint64_t offset() const { return offset_; }  ///< of the byte behind it
  std::uint64_t file_size() const { return file_size_; }
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  std::string path_, bytes_;
  std::uint64_t file_size_ = 0, line_ = 0, offset_ = 0;
};

/// A whole number of a header. @throws BadRow
std::uint64_t count_field(std::string_view field, std::string_view name);

}  // namespace risley::recordings
