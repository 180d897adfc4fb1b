// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/text_dialect.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "risley/io/text_table.hpp"

namespace risley::io {
namespace {

constexpr std::uint32_t kByteOrderMarkUnit = 0xFEFF, kNoCharacter = 0xFFFD;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Characters of plain text in every second byte.
bool is_ascii_every_second(std::string_view bytes, std::size_t first) {
  constexpr std::size_t kFewest = 4, kLookedAt = 64;
  bytes = bytes.substr(0, std::min(bytes.size(), kLookedAt) / 2 * 2);
  if (bytes.size() < kFewest) return false;
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    const char c = bytes[i + first];
    const bool text = (c >= ' ' && c <= '~') || c == '\t' || c == '\r' || c == '\n';
    if (!text || bytes[i + 1 - first] != '\0') return false;
  }
  return true;
}

/// Text with and without quotes; quotes may occur within a field that begins with one.
struct Field {
  std::string text;
  bool quoted = false;
};

/// Fields of a line, some of which may be in quotes; nothing if a quote is not closed.
std::optional<std::vector<Field>> quoted_fields(std::string_view line, char delimiter) {
  std::vector<Field> fields(1);
  bool inside = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"') {
      inside = !inside;
      fields.back().quoted = true;
    } else if (!inside && c == delimiter) {
      fields.emplace_back();
    } else {
      fields.back().text += c;
    }
  }
  if (inside) return std::nullopt;
  for (Field& field : fields) field.text = trimmed(field.text);
  return fields;
}

/// A number with a decimal comma.
bool is_comma_number(std::string_view field) {
  const auto comma = field.find(',');
  if (comma == field.npos || comma + 1 == field.size() || !is_digit(field[comma + 1])) return false;
  std::string number(field);
  number[comma] = '.';
  try {
    return number.find(',') == number.npos && is_digit(number[comma - (comma > 0 ? 1 : 0)]) &&
           decimal_field(number.starts_with('+') ? number.substr(1) : number, "").value <= 1e308;
  } catch (const BadRow&) {
    return false;
  }
}

bool is_separator_line(std::string_view line) {
  constexpr std::string_view kStatement = "sep=";
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line.size() == kStatement.size() + 1 && line.starts_with(kStatement);
}

/// Complete lines of rows, the last ones of a text's beginning.
std::vector<std::string_view> last_rows(std::string_view text) {
  constexpr std::size_t kRows = 8;
  std::vector<std::string_view> rows;
  auto end = text.rfind('\n');
  if (end == text.npos) return rows;
  while (rows.size() < kRows && end != text.npos) {
    const auto begin = end == 0 ? text.npos : text.rfind('\n', end - 1);
    std::string_view line =
        text.substr(begin == text.npos ? 0 : begin + 1, end - (begin == text.npos ? 0 : begin + 1));
    if (line.ends_with('\r')) line.remove_suffix(1);
    line = trimmed(line);
    const bool comment = line.starts_with('#') || line.starts_with("//");
    if (!line.empty() && !comment && !is_separator_line(line)) rows.push_back(line);
    end = begin;
  }
  return rows;
}

/// The dialect of rows with this separator; nothing if it does not fit.
std::optional<TextDialect> dialect_between(char delimiter,
                                           const std::vector<std::string_view>& rows) {
  // With blanks, a date with a time may look like two fields.
  const std::size_t fewest_commas = delimiter == kBlanks ? 2 : 1;
  TextDialect dialect;
  dialect.semicolons = delimiter == ';';
  bool any = false;
  for (const std::string_view row : rows) {
    if (row.find_first_of(",;\t ") == row.npos) continue;  // a number of rows, a title
    std::vector<Field> fields;
    if (delimiter == kBlanks) {
      if (row.find('"') != row.npos) return std::nullopt;
      for (const std::string_view field : fields_of(row, kBlanks)) {
        fields.push_back({std::string(field), false});
      }
    } else if (auto split = quoted_fields(row, delimiter)) {
      fields = *std::move(split);
    } else {
      return std::nullopt;
    }
    if (fields.size() < 2) return std::nullopt;
    any = true;
    std::size_t commas = 0;
    for (const Field& field : fields) {
      dialect.quotes = dialect.quotes || field.quoted;
      if (field.text.find(',') == field.text.npos) continue;
      if (!is_comma_number(field.text)) return std::nullopt;
      ++commas;
    }
    dialect.decimal_commas = dialect.decimal_commas || commas >= fewest_commas;
  }
  return any ? std::optional(dialect) : std::nullopt;
}

}  // namespace

TextEncoding encoding_of(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.starts_with("\xFF\xFE"sv)) return TextEncoding::utf16_little;
  if (bytes.starts_with("\xFE\xFF"sv)) return TextEncoding::utf16_big;
  if (is_ascii_every_second(bytes, 0)) return TextEncoding::utf16_little;
  if (is_ascii_every_second(bytes, 1)) return TextEncoding::utf16_big;
  return TextEncoding::utf8;
}

void TextDecoder::append(std::string_view bytes, std::string& text) {
  if (encoding_ == TextEncoding::utf8) {
    text += bytes;
    return;
  }
  const bool little = encoding_ == TextEncoding::utf16_little;
  for (const char byte : bytes) {
    rest_ += byte;
    if (rest_.size() < 2) continue;
    const auto low = static_cast<unsigned char>(rest_[little ? 0 : 1]),
               high = static_cast<unsigned char>(rest_[little ? 1 : 0]);
    rest_.clear();
    append_unit(static_cast<std::uint32_t>(high << 8U | low), text);
  }
}

void TextDecoder::append_unit(std::uint32_t unit, std::string& text) {
  constexpr std::uint32_t kFirstHigh = 0xD800, kFirstLow = 0xDC00, kBehindLow = 0xE000;
  const bool is_low = unit >= kFirstLow && unit < kBehindLow;
  if (unit >= kFirstHigh && unit < kFirstLow) {
    high_half_ = unit;
    return;
  }
  std::uint32_t code = is_low ? kNoCharacter : unit;
  if (is_low && high_half_ != 0) {
    code = 0x10000 + ((high_half_ - kFirstHigh) << 10U) + (unit - kFirstLow);
  }
  high_half_ = 0;
  if (code == kByteOrderMarkUnit) return;
  const auto put = [&text](std::uint32_t byte) { text += static_cast<char>(byte); };
  if (code < 0x80) {
    put(code);
  } else if (code < 0x800) {
    put(0xC0 | code >> 6U);
    put(0x80 | (code & 0x3F));
  } else {
    if (code < 0x10000) {
      put(0xE0 | code >> 12U);
    } else {
      put(0xF0 | code >> 18U);
      put(0x80 | (code >> 12U & 0x3F));
    }
    put(0x80 | (code >> 6U & 0x3F));
    put(0x80 | (code & 0x3F));
  }
}

std::string_view TextDialect::plain(std::string_view line, std::string& room) const {
  if (is_plain()) return line;
  if (stated && is_separator_line(line)) return "#";
  room.clear();
  bool inside = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    const bool in_number =
        i > 0 && i + 1 < line.size() && is_digit(line[i - 1]) && is_digit(line[i + 1]);
    if (quotes && c == '"') {
      inside = !inside;
    } else if (c == ';' && semicolons) {
      room += inside ? ' ' : ',';
    } else if (c == ',' && decimal_commas && in_number && (semicolons || inside || !quotes)) {
      room += '.';
    } else if (c == ',' && (semicolons || inside)) {
      room += ' ';
    } else {
      room += c;
    }
  }
  return room;
}

TextDialect dialect_of(std::string_view text) {
  text = text.substr(0, kDialectBytes);
  const bool is_text = std::none_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\r' && c != '\t';
  });
  if (!is_text) return {};
  const std::vector<std::string_view> rows = last_rows(text);
  if (rows.empty()) return {};
  for (const char delimiter : {';', '\t', kBlanks, ','}) {
    std::optional<TextDialect> dialect = dialect_between(delimiter, rows);
    if (!dialect) continue;
    dialect->stated = text.starts_with("sep=") || text.starts_with("\xEF\xBB\xBFsep=");
    return *dialect;
  }
  return {};
}

}  // namespace risley::io
