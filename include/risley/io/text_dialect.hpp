// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The variants in which programs and locales write the same table: UTF-16, decimal commas,
// semicolons, quotes. Readers see UTF-8 with commas between fields and points in numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace risley::io {

/// How characters stand in a file.
enum class TextEncoding : std::uint8_t { utf8, utf16_little, utf16_big };

/// By a byte order mark or, without one, by the zeros between characters of ASCII.
TextEncoding encoding_of(std::string_view bytes);

/// Converts the bytes of a text to UTF-8, piece by piece; invalid sequences become U+FFFD.
class TextDecoder {
 public:
  explicit TextDecoder(TextEncoding encoding) : encoding_(encoding) {}
  /// Appends the next bytes to a text, without a byte order mark.
  void append(std::string_view bytes, std::string& text);

 private:
  void append_unit(std::uint32_t unit, std::string& text);

  TextEncoding encoding_;
  std::string rest_;             ///< half of a unit
  std::uint32_t high_half_ = 0;  ///< of a pair of units
};

/// Characters at the beginning of a text used to recognise its dialect.
inline constexpr std::size_t kDialectBytes = 16384;

/// How the rows of a table are written.
struct TextDialect {
  bool semicolons = false;      ///< between fields, instead of commas
  bool decimal_commas = false;  ///< 7,541 is 7.541
  bool quotes = false;          ///< around fields, also of numbers
  bool stated = false;          ///< by a first line "sep=;", as written by spreadsheets

  /// Whether rows are in the form that every reader expects.
  bool is_plain() const { return !semicolons && !decimal_commas && !quotes && !stated; }
  /// A line with commas between fields, points in numbers and no quotes; blanks replace commas
  /// within other fields. A line that states the separator becomes a comment.
  /// @param room  buffer for a result that differs
  std::string_view plain(std::string_view line, std::string& room) const;
};

/// From the last complete rows of a text's beginning, up to kDialectBytes; plain for binary data. A
/// comma is a decimal one only if another character separates fields.
TextDialect dialect_of(std::string_view text);

}  // namespace risley::io
