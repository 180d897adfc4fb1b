// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/block_file.hpp"
#include "risley/io/output_file.hpp"
#include "risley/io/text_dialect.hpp"

/// @file
/// Tables in text files: lines, fields, numbers.
namespace risley::io {

/// First line of a text without byte order mark, line end and blanks: it identifies a header.
std::string normalized_header(std::string_view text);

/// Kind of lines: tables come in plain dialect (TextDialect), other text unchanged.
enum class LinesOf : std::uint8_t { text, table };

/// Reads a file line by line in large blocks, in constant memory; UTF-16 as UTF-8.
class LineReader {
 public:
  /// @throws FileError when the file cannot be read
  explicit LineReader(InputFile file, LinesOf lines_of = LinesOf::text);

  /// The next line without its line end (LF or CR LF) and, in line 1, without a byte order mark;
  /// it lives until the next call. false at the end of the file.
  /// @throws FileError for a read error or a line longer than 64 KiB
  bool next(std::string_view& line);

  const InputFile& file() const { return file_; }             ///< that is read
  std::uint64_t line_number() const { return line_number_; }  ///< of the last line, from 1
  bool has_line_end() const { return has_line_end_; }         ///< of the last line
  double fraction_read() const;                               ///< of the file's bytes, [0, 1]

 private:
  void refill();
  std::size_t read_bytes(char* to, std::size_t most);
  void require_length(std::size_t length) const;

  InputFile file_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;  ///< unread part of the buffer
  bool at_end_ = false, has_line_end_ = true;
  std::uint64_t line_number_ = 0, bytes_read_ = 0;
  std::optional<TextDecoder> decoder_;  ///< of what is no UTF-8
  TextDialect dialect_;
  std::string raw_, decoded_, plain_;  ///< bytes of the file, their text, a line in plain dialect
};

/// The error in one line; its reader adds the file and the line.
class BadRow : public Error {
 public:
  using Error::Error;
};

/// A number as written in a text: digits * 10^-decimals, exact.
struct Decimal {
  double value = 0.0;
  std::int64_t digits = 0;
  int decimals = -1;  ///< digits after the point; -1 if only `value` is known (exponents)
};

/// @throws BadRow with the column's name when the field is not a finite number
Decimal decimal_field(std::string_view field, std::string_view column);

/// @throws BadRow with the column's name when the field is not a whole number in [low, high]
std::int64_t integer_field(std::string_view field, std::string_view column, std::int64_t low,
                           std::int64_t high);

/// Seconds as whole nanoseconds, exact up to 9 decimals and rounded beyond.
/// @throws BadRow when they do not fit 64 bits
std::int64_t nanoseconds_field(std::string_view field, std::string_view column);
/// The same for a number already parsed.
std::int64_t nanoseconds_of(const Decimal& seconds, std::string_view column);

/// A number, or NaN: an empty field, "nan" or an infinity. @throws BadRow for anything else
Decimal number_or_nan(std::string_view field, std::string_view column);

/// The separator of two fields: this character, or any number of blanks and tabs.
inline constexpr char kBlanks = ' ';

/// Text without blanks and tabs at its ends.
std::string_view trimmed(std::string_view text);

/// For messages: short, and without control bytes for a terminal.
std::string printable(std::string_view text);

/// Fields of a line, without surrounding blanks.
std::vector<std::string_view> fields_of(std::string_view line, char delimiter);

/// The same if their number is known. @return their number; `fields` receives as many as it has
/// room for
std::size_t split_fields(std::string_view line, char delimiter, std::span<std::string_view> fields);

/// Powers of ten that fit in 64 bits: 10^0 to 10^18. @throws InvalidArgument for others
std::int64_t power_of_ten(int exponent);

/// Text written to a file in large blocks, which appears under its name at close().
class TextOutput {
 public:
  /// @throws FileError
  explicit TextOutput(const std::string& path);

  /// Text not yet written to the file, for fmt to append to.
  fmt::memory_buffer& buffer() { return buffer_; }
  /// Text as it is.
  void append(std::string_view text) { buffer_.append(text.data(), text.data() + text.size()); }
  /// value with a fixed number of decimals, 0 to 18, rounded to nearest.
  void append_fixed(double value, int decimals);
  /// digits * 10^-decimals.
  void append_decimal(std::int64_t digits, int decimals);
  /// Writes a full buffer to the file; to be called after each row. @throws FileError
  void end_row() {
    buffer_.push_back('\n');
    if (buffer_.size() >= kBlockSize) flush();
  }
  /// @throws FileError
  void close();

 private:
  static constexpr std::size_t kBlockSize = std::size_t{1} << 20;
  void append_digits(std::uint64_t digits, int decimals, bool negative);
  void flush();
  [[noreturn]] void fail() const;

  OutputFile output_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  fmt::memory_buffer buffer_;
};

}  // namespace risley::io
