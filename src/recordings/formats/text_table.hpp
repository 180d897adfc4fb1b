// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/text_table.hpp"
#include "risley/recordings/observations.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::recordings {

using io::BadRow;
using io::Decimal;
using io::decimal_field;
using io::fields_of;
using io::integer_field;
using io::kBlanks;
using io::LineReader;
using io::nanoseconds_field;
using io::nanoseconds_of;
using io::normalized_header;
using io::number_or_nan;
using io::printable;
using io::TextOutput;
using io::trimmed;

/// Reads a table of rows, one per line, below one or more header lines. A byte order mark, CR LF,
/// blanks around fields and empty lines at the end are accepted. A last line without line end
/// counts only if it is certainly complete: it has all fields, and the last one is a decimal
/// fraction with as many decimals as that of the line before; otherwise it is dropped with a
/// warning. Any other invalid line is damage: the rows before it are returned, then FileError is
/// thrown. If the header states the number of rows, fewer are damage, and so are more unless the
/// format allows other data after them, which are not read.
class TextTableReader : public Reader {
 public:
  bool read(Chunk& chunk, std::size_t max_rows) final;
  double fraction_read() const final { return lines_.fraction_read(); }

 protected:
  using Fields = std::span<const std::string_view>;

  /// Opens the file and reads its first line.
  TextTableReader(const io::InputFile& file, std::string format);

  const std::string& table_header() const { return table_header_; }  ///< normalised
  /// Construction of a row; to be called once by the constructor of the derived class.
  /// @param lists  columns of any number of fields, stated in their first field; empty without
  void set_column_count(std::size_t columns, char delimiter = ',', std::vector<bool> lists = {}) {
    fields_.resize(columns);
    delimiter_ = delimiter;
    const bool any = std::find(lists.begin(), lists.end(), true) != lists.end();
    if (any) lists_ = std::move(lists);
  }
  /// Skips lines, so that the rows begin at this one (from 1).
  void begin_rows_at(std::uint64_t line);
  /// @param stated_in  line that states them if nothing else follows, otherwise 0
  void set_row_count(std::uint64_t rows, std::uint64_t stated_in) {
    rows_left_ = rows;
    all_stated_in_ = stated_in;
  }
  /// @throws FileError at line 1: the expected contents
  [[noreturn]] void refuse_header(const std::string& expected) const;

  std::uint64_t line_number() const { return lines_.line_number(); }

  /// Adds the observations of one row. Must not change the chunk when it throws BadRow.
  virtual void append_row(Fields fields, Chunk& chunk) = 0;

  /// Passes the valid rows among the first max_rows to a function, until that returns false or
  /// throws BadRow: the reader's source for the header before the first row is read.
  template <class Function>
  void look_ahead(std::size_t max_rows, Function&& function) const;

  [[noreturn]] void fail(std::uint64_t line, const std::string& problem) const;
  std::string path_;

 private:
  bool split(std::string_view line, std::span<std::string_view> fields, std::size_t& count) const;
  void require_no_more_rows();

  char delimiter_ = ',';
  std::vector<bool> lists_;
  std::optional<std::uint64_t> rows_left_;  ///< if the header states the number of rows
  std::uint64_t all_stated_in_ = 0, header_lines_ = 1;
  LineReader lines_;
  std::string table_header_;
  std::vector<std::string_view> fields_;
  int last_field_decimals_ = -1;  ///< of the row before, -1 before the first
  std::optional<std::uint64_t> empty_line_;
  std::optional<FileError> pending_;
  bool finished_ = false;
};

template <class Function>
void TextTableReader::look_ahead(std::size_t max_rows, Function&& function) const {
  try {
    LineReader lines(lines_.file(), io::LinesOf::table);
    std::string_view line;
    std::vector<std::string_view> fields(fields_.size());
    std::size_t count = 0;
    while (lines.line_number() < header_lines_ && lines.next(line)) {
    }
    if (rows_left_) max_rows = std::min<std::uint64_t>(max_rows, *rows_left_);
    for (std::size_t row = 0; row < max_rows && lines.next(line); ++row) {
      if (!lines.has_line_end() || !split(line, fields, count) || !function(Fields(fields))) return;
    }
  } catch (const BadRow&) {  // read() reports it when it gets there
  } catch (const FileError&) {
  }
}

/// Adds one row to all columns and sets those that text formats rarely have: intensity and tag 0,
/// first return, first beam, first device.
std::size_t append_observation(Observations& rows, std::int64_t time_ns);

/// Time format of a text format: its usual number of decimals if these are exact, and 9 (whole
/// nanoseconds) if not. The first chunk decides for the whole file; only a later time that does not
/// fit is written with 9 decimals individually.
class TimeColumn {
 public:
  explicit TimeColumn(int decimals) : decimals_(decimals) {}
  void look_at(const std::vector<std::int64_t>& times_ns);
  void append(TextOutput& output, std::int64_t time_ns) const;

 private:
  bool fits(std::int64_t time_ns) const;

  int decimals_;
  bool decided_ = false;
};

}  // namespace risley::recordings
