// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/npy_header.hpp"

#include <algorithm>
#include <charconv>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/io/little_endian.hpp"

namespace risley::recordings {
namespace {

using io::load;

constexpr std::size_t kMostHeaderBytes = std::size_t{1} << 16;
constexpr int kDeepest = 8;

/// The Python literals of a header: a dictionary of texts, numbers, booleans, tuples and lists.
class LiteralReader {
 public:
  explicit LiteralReader(std::string_view text) : text_(text) {}

  bool take(char c) {
    skip_blanks();
    if (text_.empty() || text_.front() != c) return false;
    text_.remove_prefix(1);
    return true;
  }
  bool next_is(char c) {
    skip_blanks();
    return text_.starts_with(c);
  }
  void require(char c) {
    if (!take(c)) fail(fmt::format("'{}'", c));
  }
  bool at_text() { return next_is('\'') || next_is('"'); }
  std::string take_text() {
    if (!at_text()) fail("a text in quotes");
    const char quote = text_.front();
    const auto end = text_.find(quote, 1);
    if (end == text_.npos) fail("the end of a text");
    std::string text(text_.substr(1, end - 1));
    text_.remove_prefix(end + 1);
    return text;
  }
  std::uint64_t take_number() {
    skip_blanks();
    std::uint64_t number = 0;
    const auto result = std::from_chars(text_.data(), text_.data() + text_.size(), number);
    if (result.ec != std::errc()) fail("a whole number of 0 or more, below 2^64");
    text_.remove_prefix(static_cast<std::size_t>(result.ptr - text_.data()));
    take('L');  // of Python 2
    return number;
  }
  bool take_truth() {
    skip_blanks();
    for (const bool truth : {true, false}) {
      const std::string_view word = truth ? "True" : "False";
      if (!text_.starts_with(word)) continue;
      text_.remove_prefix(word.size());
      return truth;
    }
    fail("True or False");
  }
  /// The numbers of "(2, 3)" or of a bare "2".
  std::vector<std::uint64_t> take_shape() {
    if (!take('(')) return {take_number()};
    std::vector<std::uint64_t> shape;
    while (!take(')')) {
      shape.push_back(take_number());
      if (!take(',') && !next_is(')')) fail("',' or ')'");
    }
    return shape;
  }
  [[noreturn]] void fail(const std::string& expected) {
    throw BadArray{fmt::format("expected {} in the header of an array, found \"{}\"", expected,
                               printable(text_.substr(0, 24)))};
  }

 private:
  void skip_blanks() {
    while (!text_.empty() && (text_.front() == ' ' || text_.front() == '\n')) {
      text_.remove_prefix(1);
    }
  }
  std::string_view text_;
};

std::uint64_t checked_product(std::uint64_t a, std::uint64_t b) {
  std::uint64_t product = 0;
  if (__builtin_mul_overflow(a, b, &product) || product > INT64_MAX) {
    throw BadArray{fmt::format("expected an array of less than 2^63 bytes, found {} x {}", a, b)};
  }
  return product;
}

/// Meaning of a type such as "<f4" or "<M8[us]".
struct SimpleType {
  std::optional<NumberType> number;  ///< empty for other types
  std::uint64_t bytes = 0;
  std::string time_unit;
};

SimpleType simple_type(const std::string& text) {
  const bool has_order = !text.empty() && std::string_view("<>|=").find(text[0]) != text.npos;
  const bool big_endian = has_order && text[0] == '>';
  const std::string_view rest = std::string_view(text).substr(has_order ? 1 : 0);
  SimpleType type;
  const auto bad = [&] {
    throw BadArray{
        fmt::format("expected a type such as <f4, <f8 or <i4, found \"{}\"", printable(text))};
  };
  if (rest.size() < 2) bad();
  const char kind = rest[0];
  const auto result = std::from_chars(rest.data() + 1, rest.data() + rest.size(), type.bytes);
  if (result.ec != std::errc() || type.bytes > kMostRecordBytes) bad();
  if (kind == 'M' || kind == 'm') {  // times, as whole numbers of a unit
    std::string_view unit = rest.substr(static_cast<std::size_t>(result.ptr - rest.data()));
    if (unit.starts_with('[') && unit.ends_with(']')) unit = unit.substr(1, unit.size() - 2);
    type.time_unit = unit;
    type.number = number_type('i', type.bytes, big_endian);
  } else if (kind == 'b') {
    type.number = number_type('u', type.bytes, big_endian);
  } else {
    type.number = number_type(kind, type.bytes, big_endian);
    if (kind == 'U') {  // texts: four bytes a letter
      type.number.reset();
      type.bytes *= 4;
    }
  }
  return type;
}

void add_field(ArrayHeader& header, const std::string& name, const SimpleType& type,
               std::uint64_t count) {
  const std::uint64_t bytes = checked_product(type.bytes, count);
  if (header.element_bytes + bytes > kMostRecordBytes) {
    throw BadArray{fmt::format("expected array elements of at most {} bytes, found larger ones",
                               kMostRecordBytes)};
  }
  std::string full_name = name;
  if (!type.time_unit.empty() && !name.empty()) full_name += "_" + type.time_unit;
  for (std::uint64_t i = 0; type.number && i < count; ++i) {
    header.fields.push_back({count == 1 ? full_name : fmt::format("{}:{}", full_name, i),
                             *type.number,
                             header.element_bytes + static_cast<std::size_t>(i * type.bytes)});
  }
  if (!type.number) header.other_fields.push_back(name);
  header.element_bytes += static_cast<std::size_t>(bytes);
}

/// A list of fields: (name, type), (name, type, shape), where types may be lists again. Nameless
/// fields are padding.
void take_fields(LiteralReader& reader, ArrayHeader& header, int depth) {
  if (depth > kDeepest) reader.fail("less deeply nested types");
  reader.require('[');
  while (!reader.take(']')) {
    reader.require('(');
    std::string name;
    if (reader.take('(')) {  // (title, name)
      reader.take_text();
      reader.require(',');
      name = reader.take_text();
      reader.require(')');
    } else {
      name = reader.take_text();
    }
    reader.require(',');
    if (reader.next_is('[')) {
      take_fields(reader, header, depth + 1);
    } else {
      const SimpleType type = simple_type(reader.take_text());
      std::uint64_t count = 1;
      if (reader.take(',') && !reader.next_is(')')) {
        for (const std::uint64_t length : reader.take_shape()) {
          count = checked_product(count, length);
        }
      }
      if (name.empty()) {
        SimpleType padding = type;
        padding.number.reset();
        add_field(header, "", padding, count);
      } else {
        add_field(header, name, type, count);
      }
    }
    reader.require(')');
    reader.take(',');
  }
}

/// Elements of an array from a byte of its data on.
TableLane lane_of(const ArrayHeader& header, const OpenArray& open, std::uint64_t from,
                  std::size_t bytes) {
  return {[open, offset = header.data_offset + from] { return open(offset); }, bytes};
}

}  // namespace

std::uint64_t ArrayHeader::elements() const {
  std::uint64_t product = 1;
  for (const std::uint64_t length : shape) product *= length;
  return product;
}

std::string ArrayHeader::shape_text() const {
  return shape.empty() ? "a single element" : fmt::format("{}", fmt::join(shape, " x "));
}

ArrayHeader read_array_header(ByteSource& source) {
  std::array<std::uint8_t, 12> start{};
  constexpr std::size_t kVersion1Bytes = 10;
  const auto take = [&source](std::uint8_t* bytes, std::size_t count) {
    if (source.read(bytes, count) == count) return;
    throw BadArray{source.problem().empty()
                       ? "expected the header of an array, found the end of the file"
                       : fmt::format("expected the header of an array: {}", source.problem())};
  };
  take(start.data(), kVersion1Bytes);
  if (!std::equal(kArraySignature.begin(), kArraySignature.end(), start.begin(),
                  [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; })) {
    throw BadArray{"expected an array that begins with \\x93NUMPY"};
  }
  const int version = start[6];
  if (version < 1 || version > 3) {
    throw BadArray{fmt::format("expected an array of version 1, 2 or 3, found {}", version)};
  }
  std::uint64_t length = load<std::uint16_t>(start.data() + 8);
  ArrayHeader header;
  header.data_offset = kVersion1Bytes;
  if (version > 1) {
    take(start.data() + kVersion1Bytes, 2);
    length = load<std::uint32_t>(start.data() + 8);
    header.data_offset = start.size();
  }
  if (length > kMostHeaderBytes) {
    throw BadArray{
        fmt::format("expected a header of at most {} bytes, found {}", kMostHeaderBytes, length)};
  }
  std::string text(static_cast<std::size_t>(length), '\0');
  take(reinterpret_cast<std::uint8_t*>(text.data()), text.size());
  header.data_offset += length;
  LiteralReader reader(text);
  bool has_descr = false, has_order = false, has_shape = false;
  reader.require('{');
  while (!reader.take('}')) {
    const std::string key = reader.take_text();
    reader.require(':');
    if (key == "descr" && !has_descr) {
      has_descr = true;
      if (reader.next_is('[')) {
        take_fields(reader, header, 0);
      } else {
        add_field(header, "", simple_type(reader.take_text()), 1);
      }
    } else if (key == "fortran_order") {
      has_order = true;
      header.fortran_order = reader.take_truth();
    } else if (key == "shape") {
      has_shape = true;
      header.shape = reader.take_shape();
    } else {
      reader.fail("descr, fortran_order or shape");
    }
    if (!reader.take(',') && !reader.next_is('}')) reader.fail("',' or '}'");
  }
  if (!has_descr || !has_order || !has_shape) reader.fail("descr, fortran_order and shape");
  std::uint64_t bytes = std::max<std::size_t>(header.element_bytes, 1);
  // Lengths of 0 must not hide others out of bounds.
  for (const std::uint64_t one : header.shape) {
    bytes = checked_product(bytes, std::max<std::uint64_t>(one, 1));
  }
  return header;
}

bool is_table(const ArrayHeader& header) {
  if (header.is_structured()) return !header.fields.empty() && !header.shape.empty();
  return header.shape.size() == 2 && (header.shape[1] == 3 || header.shape[1] == 4);
}

void add_table(const ArrayHeader& header, const OpenArray& open, BinaryTable& table) {
  if (!is_table(header)) {
    throw BadArray{fmt::format(
        "expected an array of named fields such as x, y and z, or of rows with 3 (x y z) or 4 (x y "
        "z intensity) numbers; found {} {}",
        header.shape_text(), header.fields.empty() ? "elements of another type" : "numbers")};
  }
  const std::size_t first_lane = table.lanes.size();
  if (header.is_structured()) {
    table.rows = header.elements();
    for (const ArrayField& field : header.fields) {
      table.columns.push_back({field.name, field.type, first_lane, field.offset});
    }
    table.lanes.push_back(lane_of(header, open, 0, header.element_bytes));
    std::string others;
    for (const std::string& name : header.other_fields) {
      if (!name.empty()) others += (others.empty() ? "" : ", ") + name;
    }
    if (!others.empty()) {
      warn(table.warnings, kWarning.columns_unused,
           "fields that do not hold numbers were left out: {}", printable(others));
    }
    return;
  }
  static constexpr const char* kNames[] = {"x", "y", "z", "intensity"};
  const NumberType type = header.fields.front().type;
  const std::size_t columns = static_cast<std::size_t>(header.shape[1]);
  table.rows = header.shape[0];
  warn(table.warnings, kWarning.columns_guessed,
       "the columns of the array have no names: they were taken as x y z{}",
       columns == 4 ? " intensity" : "");
  for (std::size_t i = 0; i < columns; ++i) {
    const std::size_t lane = header.fortran_order ? first_lane + i : first_lane;
    table.columns.push_back({kNames[i], type, lane, header.fortran_order ? 0 : i * type.bytes});
    if (header.fortran_order) {
      table.lanes.push_back(lane_of(header, open, i * table.rows * type.bytes, type.bytes));
    }
  }
  if (!header.fortran_order) {
    table.lanes.push_back(lane_of(header, open, 0, columns * type.bytes));
  }
}

void add_column(const ArrayHeader& header, const std::string& name, const OpenArray& open,
                BinaryTable& table) {
  table.columns.push_back({name, header.fields.front().type, table.lanes.size(), 0});
  table.lanes.push_back(lane_of(header, open, 0, header.element_bytes));
}

}  // namespace risley::recordings
