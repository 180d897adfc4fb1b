// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Point Cloud Data of the Point Cloud Library, versions 0.5 to 0.7, as text, as bytes and packed.
// Packed points are stored column by column; each column is unpacked separately, so that memory
// does not grow with their number.
#include <algorithm>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

#include "recordings/formats/binary_table.hpp"
#include "recordings/formats/format.hpp"
#include "recordings/formats/named_text.hpp"

namespace risley::recordings {
namespace {

using io::load;

constexpr std::string_view kPcd = "pcd";

struct PcdField {
  std::string name;
  std::uint64_t bytes = 4, count = 1;
  char type = 'F';
};

struct PcdHeader {
  std::vector<PcdField> fields;
  std::uint64_t points = 0;
  std::string data;
  std::uint64_t fields_line = 1, fields_offset = 0;
  std::uint64_t data_line = 1, data_offset = 0;  ///< of what follows the header
  std::vector<Warning> warnings;
};

/// Gives each field its value from one line of the header.
template <class Take>
void per_field(const HeaderLines& lines, PcdHeader& header,
               const std::vector<std::string_view>& words, const Take& take) {
  if (words.size() - 1 != header.fields.size()) {
    lines.fail(fmt::format("expected {} values after {}, as many as FIELDS, found {}",
                           header.fields.size(), words[0], words.size() - 1));
  }
  for (std::size_t i = 1; i < words.size(); ++i) take(header.fields[i - 1], words[i]);
}

PcdHeader read_pcd_header(const io::InputFile& file) {
  HeaderLines lines(file);
  PcdHeader header;
  std::optional<std::uint64_t> width, height, points;
  try {
    while (header.data.empty()) {
      const std::uint64_t offset = lines.offset();
      const std::string_view line = lines.next();
      if (line.empty() || line.starts_with('#')) continue;
      const auto words = fields_of(line, kBlanks);
      const std::string_view key = words[0];
      const auto only_value = [&] {
        if (words.size() != 2) lines.fail(fmt::format("expected one value after {}", key));
        return words[1];
      };
      if (key == "FIELDS" || key == "COLUMNS") {
        for (std::size_t i = 1; i < words.size(); ++i) {
          header.fields.push_back({.name = std::string(words[i])});
        }
        header.fields_line = lines.line();
        header.fields_offset = offset;
      } else if (key == "SIZE") {
        per_field(lines, header, words, [&](PcdField& field, std::string_view value) {
          field.bytes = static_cast<std::uint64_t>(integer_field(value, key, 1, 8));
        });
      } else if (key == "TYPE") {
        per_field(lines, header, words, [](PcdField& field, std::string_view value) {
          field.type = value.size() == 1 ? value.front() : '?';
        });
      } else if (key == "COUNT") {
        per_field(lines, header, words, [&](PcdField& field, std::string_view value) {
          field.count = static_cast<std::uint64_t>(integer_field(value, key, 0, kMostRecordBytes));
        });
      } else if (key == "WIDTH") {
        width = count_field(only_value(), key);
      } else if (key == "HEIGHT") {
        height = count_field(only_value(), key);
      } else if (key == "POINTS") {
        points = count_field(only_value(), key);
      } else if (key == "VIEWPOINT") {
        constexpr std::string_view kIdentity[] = {"0", "0", "0", "1", "0", "0", "0"};
        bool identity = words.size() == 8;
        for (std::size_t i = 1; identity && i < words.size(); ++i) {
          identity =
              decimal_field(words[i], key).value == decimal_field(kIdentity[i - 1], key).value;
        }
        if (!identity) {
          warn(header.warnings, kWarning.pose_unused,
               "the header states a pose of the sensor, \"{}\": it was ignored, and the points "
               "were taken to be in the frame of the sensor",
               printable(line));
        }
      } else if (key == "DATA") {
        header.data = std::string(only_value());
      } else if (key != "VERSION") {
        lines.fail(fmt::format("expected a line of a PCD header, found \"{}\"", printable(line)));
      }
    }
  } catch (const BadRow& bad) {
    lines.fail(bad.what());
  }
  header.data_line = lines.line() + 1;
  header.data_offset = lines.offset();
  if (header.fields.empty()) lines.fail("expected a FIELDS line before DATA, found none");
  std::uint64_t numbers = 0;
  for (const PcdField& field : header.fields) numbers += field.count;
  if (numbers > kMostRecordBytes) {
    lines.fail(
        fmt::format("expected points of at most {} numbers, found {}", kMostRecordBytes, numbers));
  }
  std::uint64_t product = 0;
  if (width && __builtin_mul_overflow(*width, height.value_or(1), &product)) {
    lines.fail(fmt::format("expected WIDTH x HEIGHT below 2^64, found {} x {}", *width, *height));
  }
  if (!width && !points) lines.fail("expected a POINTS or WIDTH line before DATA, found none");
  header.points = points.value_or(product);
  if (width && product != header.points) {
    warn(header.warnings, kWarning.header_contradicted,
         "the header has POINTS {} but WIDTH x HEIGHT = {}: POINTS was used", header.points,
         product);
  }
  return header;
}

/// Name of one number of a field.
std::string number_name(const PcdField& field, std::uint64_t number) {
  return field.count == 1 ? field.name : fmt::format("{}:{}", field.name, number);
}

NamedTextLayout text_layout(PcdHeader header) {
  NamedTextLayout layout;
  for (const PcdField& field : header.fields) {
    for (std::uint64_t i = 0; i < field.count; ++i) layout.names.push_back(number_name(field, i));
  }
  layout.names_line = header.fields_line;
  layout.first_row_line = header.data_line;
  layout.rows = header.points;
  layout.warnings = std::move(header.warnings);
  return layout;
}

BinaryTable binary_table(const io::InputFile& input, PcdHeader header) {
  const std::uint64_t file_size = input.size();
  const bool packed = header.data == "binary_compressed";
  const auto fail = [&](std::uint64_t offset, const std::string& problem) {
    throw FileError(input.path(), {offset, {}}, problem);
  };
  BinaryTable table;
  table.rows = header.points;
  table.columns_offset = header.fields_offset;
  table.warnings = std::move(header.warnings);
  std::uint64_t point_bytes = 0;
  std::vector<std::uint64_t> field_offsets;
  for (const PcdField& field : header.fields) {
    const auto type = number_type(field.type, field.bytes);
    if (!type && field.name != "_") {
      fail(header.fields_offset,
           fmt::format("expected numbers of type I or U with 1, 2, 4 or 8 bytes, or F with 4 or 8, "
                       "in field {}, found type {} with {} bytes",
                       printable(field.name), field.type, field.bytes));
    }
    const std::size_t lane = packed ? field_offsets.size() : 0;
    for (std::uint64_t i = 0; type && field.name != "_" && i < field.count; ++i) {
      const std::uint64_t offset = (packed ? 0 : point_bytes) + i * field.bytes;
      table.columns.push_back(
          {number_name(field, i), *type, lane, static_cast<std::size_t>(offset)});
    }
    field_offsets.push_back(point_bytes);
    point_bytes += field.bytes * field.count;
    if (point_bytes > kMostRecordBytes) {
      fail(header.fields_offset,
           fmt::format("expected points of at most {} bytes, found more", kMostRecordBytes));
    }
  }
  const std::uint64_t begin = header.data_offset;
  if (!packed) {
    table.lanes.push_back({[=] { return std::make_unique<FileSource>(input, begin, UINT64_MAX); },
                           static_cast<std::size_t>(point_bytes)});
    const std::uint64_t left = file_size - begin;
    if (point_bytes > 0 && header.points <= left / point_bytes &&
        left > header.points * point_bytes) {
      warn(table.warnings, kWarning.content_left_out, "{} bytes after the last point were not read",
           left - header.points * point_bytes);
    }
    return table;
  }
  constexpr std::size_t kSizesBytes = 8;
  if (file_size - begin < kSizesBytes) {
    fail(begin, "expected the two sizes of the compressed points, found the end of the file");
  }
  io::BlockInput file(input);
  const std::uint8_t* const sizes = file.at(begin, kSizesBytes);
  const auto packed_bytes = load<std::uint32_t>(sizes), all_bytes = load<std::uint32_t>(sizes + 4);
  std::uint64_t expected = 0;
  if (__builtin_mul_overflow(header.points, point_bytes, &expected) || expected != all_bytes) {
    fail(begin + 4,
         fmt::format("expected {} points of {} bytes, found a size of {} bytes before compression",
                     header.points, point_bytes, all_bytes));
  }
  const std::uint64_t packed_begin = begin + kSizesBytes;
  if (packed_bytes > file_size - packed_begin) {
    warn(table.warnings, kWarning.cut_off,
         "expected {} bytes of compressed points, found {}: the file was cut off", packed_bytes,
         file_size - packed_begin);
  }
  for (std::size_t i = 0; i < header.fields.size(); ++i) {
    const std::uint64_t before = field_offsets[i] * header.points;
    const auto open = [=]() -> std::unique_ptr<ByteSource> {
      auto source = std::make_unique<LzfSource>(
          std::make_unique<FileSource>(input, packed_begin, packed_begin + packed_bytes));
      source->skip(before);
      return source;
    };
    table.lanes.push_back(
        {open, static_cast<std::size_t>(header.fields[i].bytes * header.fields[i].count)});
  }
  return table;
}

bool is_pcd(std::string_view head) {
  if (head.starts_with("# .PCD")) return true;
  while (head.starts_with('#')) {
    const auto end = head.find('\n');
    if (end == head.npos) return false;
    head.remove_prefix(end + 1);
  }
  return head.starts_with("VERSION ") && head.find("FIELDS") != head.npos;
}

}  // namespace

const Format kPcdFormat = {
    kPcd,
    "",
    "PCD point cloud: text, binary or compressed binary (read only)",
    is_pcd,
    [](const io::InputFile& file, const Progress&) -> std::unique_ptr<Reader> {
      PcdHeader header = read_pcd_header(file);
      if (header.data == "ascii") {
        return std::make_unique<NamedTextReader>(file, kPcd, text_layout(std::move(header)));
      }
      if (header.data != "binary" && header.data != "binary_compressed") {
        throw FileError(file.path(), {{}, header.data_line - 1},
                        fmt::format("expected DATA ascii, binary or binary_compressed, found {}",
                                    printable(header.data)));
      }
      return std::make_unique<BinaryTableReader>(file.path(), kPcd,
                                                 binary_table(file, std::move(header)));
    },
};

}  // namespace risley::recordings
