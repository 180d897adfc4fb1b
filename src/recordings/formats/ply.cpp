// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Polygon files: the vertices are shots in order; faces and other elements are skipped, and so are
// lists among the properties of vertices.
#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"

#include "recordings/formats/binary_table.hpp"
#include "recordings/formats/format.hpp"
#include "recordings/formats/named_text.hpp"

namespace risley::recordings {
namespace {

constexpr std::string_view kPly = "ply";
constexpr std::string_view kScalarPrefix = "scalar_";  // CloudCompare's additional columns

struct PlyProperty {
  std::string name;
  NumberType type;
  std::optional<NumberType> length;  ///< of a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::uint64_t line = 1, offset = 0;  ///< in the header
  std::vector<PlyProperty> properties;

  bool has_list() const {
    return std::any_of(properties.begin(), properties.end(),
                       [](const PlyProperty& property) { return property.length.has_value(); });
  }
  std::uint64_t bytes() const {
    std::uint64_t sum = 0;
    for (const PlyProperty& property : properties) sum += property.type.bytes;
    return sum;
  }
};

struct PlyHeader {
  bool text = true, big_endian = false;
  std::vector<PlyElement> elements;
  std::uint64_t data_line = 1, data_offset = 0;
};

std::optional<NumberType> ply_type(std::string_view name, bool big_endian) {
  struct Named {
    std::string_view name;
    char kind;
    std::uint64_t bytes;
  };
  static constexpr Named kTypes[] = {
      {"char", 'i', 1},  {"int8", 'i', 1},    {"uchar", 'u', 1},  {"uint8", 'u', 1},
      {"short", 'i', 2}, {"int16", 'i', 2},   {"ushort", 'u', 2}, {"uint16", 'u', 2},
      {"int", 'i', 4},   {"int32", 'i', 4},   {"uint", 'u', 4},   {"uint32", 'u', 4},
      {"float", 'f', 4}, {"float32", 'f', 4}, {"double", 'f', 8}, {"float64", 'f', 8},
      {"int64", 'i', 8}, {"uint64", 'u', 8},
  };
  for (const Named& type : kTypes) {
    if (type.name == name) return number_type(type.kind, type.bytes, big_endian);
  }
  return std::nullopt;
}

void read_property(const HeaderLines& lines, const std::vector<std::string_view>& words,
                   PlyHeader& header) {
  if (header.elements.empty()) lines.fail("expected an element before its first property");
  const bool list = words.size() == 5 && words[1] == "list";
  if (!list && words.size() != 3) {
    lines.fail("expected \"property TYPE NAME\" or \"property list TYPE TYPE NAME\"");
  }
  const auto type = ply_type(words[words.size() - 2], header.big_endian);
  const auto length = list ? ply_type(words[2], header.big_endian) : std::nullopt;
  if (!type || (list && (!length || length->kind == NumberType::Kind::floating))) {
    lines.fail(fmt::format("expected a type such as uchar, int, float or double, found \"{}\"",
                           printable(words[list && type ? 2 : words.size() - 2])));
  }
  std::string_view name = words.back();
  if (name.starts_with(kScalarPrefix)) name.remove_prefix(kScalarPrefix.size());
  header.elements.back().properties.push_back({std::string(name), *type, length});
}

PlyHeader read_ply_header(const io::InputFile& file) {
  HeaderLines lines(file);
  PlyHeader header;
  bool has_format = false;
  lines.next();  // "ply"
  while (true) {
    const std::uint64_t offset = lines.offset();
    const auto words = fields_of(lines.next(), kBlanks);
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format" && words.size() == 3) {
      header.text = words[1] == "ascii";
      header.big_endian = words[1] == "binary_big_endian";
      if (!header.text && !header.big_endian && words[1] != "binary_little_endian") {
        lines.fail(fmt::format(
            "expected the format ascii, binary_little_endian or binary_big_endian, found \"{}\"",
            printable(words[1])));
      }
      has_format = true;
    } else if (words[0] == "element" && words.size() == 3) {
      if (!has_format) lines.fail("expected the format line before the first element");
      try {
        header.elements.push_back(
            {std::string(words[1]), count_field(words[2], "element"), lines.line(), offset, {}});
      } catch (const BadRow& bad) {
        lines.fail(bad.what());
      }
    } else if (words[0] == "property") {
      read_property(lines, words, header);
    } else {
      lines.fail(fmt::format("expected a line of a PLY header, found \"{}\"", printable(words[0])));
    }
  }
  header.data_line = lines.line() + 1;
  header.data_offset = lines.offset();
  const auto vertices =
      std::find_if(header.elements.begin(), header.elements.end(),
                   [](const PlyElement& element) { return element.name == "vertex"; });
  if (vertices == header.elements.end()) lines.fail("expected an element vertex, found none");
  header.elements.erase(vertices + 1, header.elements.end());
  return header;
}

/// A column name that no reader interprets.
std::string name_of_list(const std::string& name) { return fmt::format("list {}", name); }

NamedTextLayout text_layout(const PlyHeader& header) {
  NamedTextLayout layout;
  const PlyElement& vertices = header.elements.back();
  for (const PlyProperty& property : vertices.properties) {
    layout.lists.push_back(property.length.has_value());
    layout.names.push_back(property.length ? name_of_list(property.name) : property.name);
  }
  layout.names_line = vertices.line;
  layout.rows = vertices.count;
  layout.first_row_line = header.data_line;
  for (auto element = header.elements.begin(); element + 1 != header.elements.end(); ++element) {
    // Lines are counted only up to the end of the file.
    layout.first_row_line += std::min(element->count, UINT64_MAX - layout.first_row_line);
  }
  return layout;
}

/// End of an element that begins at an offset. @throws FileError when the file ends before
std::uint64_t end_of(const PlyElement& element, std::uint64_t offset, io::BlockInput& file) {
  const auto require = [&](std::uint64_t count, std::uint64_t bytes) {
    if (bytes == 0 || count <= (file.size() - offset) / bytes) return count * bytes;
    throw FileError(file.path(), {offset, {}},
                    fmt::format("expected {} x {} bytes of the element {}, found the end of the "
                                "file after {}",
                                count, bytes, printable(element.name), file.size() - offset));
  };
  if (!element.has_list()) return offset + require(element.count, element.bytes());
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& property : element.properties) {
      std::uint64_t numbers = 1;
      if (property.length) {
        const std::size_t bytes = property.length->bytes;
        require(1, bytes);
        const Decimal length = property.length->cell(file.at(offset, bytes));
        if (length.value < 0.0 || length.decimals != 0) {
          throw FileError(file.path(), {offset, {}},
                          fmt::format("expected a list of 0 or more numbers in the element {}, "
                                      "found {}",
                                      printable(element.name), length.value));
        }
        numbers = static_cast<std::uint64_t>(length.digits);
        offset += bytes;
      }
      offset += require(numbers, property.type.bytes);
    }
  }
  return offset;
}

/// The records of vertices without the lists among their properties.
class WithoutLists final : public ByteSource {
 public:
  WithoutLists(std::unique_ptr<ByteSource> all, std::vector<PlyProperty> properties)
      : all_(std::move(all)), properties_(std::move(properties)) {}

  std::size_t read(std::uint8_t* bytes, std::size_t count) override {
    std::size_t done = 0;
    while (done < count) {
      if (given_ == record_.size() && !next_record()) break;
      const std::size_t piece = std::min(count - done, record_.size() - given_);
      std::copy_n(record_.begin() + static_cast<std::ptrdiff_t>(given_), piece, bytes + done);
      given_ += piece;
      done += piece;
    }
    return done;
  }
  std::uint64_t file_offset() const override { return all_->file_offset(); }

 private:
  /// @return false at the end or at damage
  bool next_record() {
    record_.clear();
    given_ = 0;
    for (const PlyProperty& property : properties_) {
      if (property.length ? take_list(property) : take_number(property)) continue;
      record_.clear();
      return false;
    }
    return true;
  }

  bool take_number(const PlyProperty& property) {
    const std::size_t before = record_.size();
    record_.resize(before + property.type.bytes);
    return all_->read(record_.data() + before, property.type.bytes) == property.type.bytes;
  }

  bool take_list(const PlyProperty& property) {
    std::array<std::uint8_t, 8> number{};
    if (all_->read(number.data(), property.length->bytes) < property.length->bytes) return false;
    const Decimal length = property.length->cell(number.data());
    if (length.value < 0.0) {
      problem_ = fmt::format("found a list of {} numbers", length.value);
      return false;
    }
    // More than any file has also ends with it.
    const double bytes = length.value * static_cast<double>(property.type.bytes);
    const auto wanted = static_cast<std::uint64_t>(std::min(bytes, 0x1p62));
    return all_->skip(wanted) == wanted;
  }

  std::unique_ptr<ByteSource> all_;
  std::vector<PlyProperty> properties_;
  std::vector<std::uint8_t> record_;  ///< a vertex
  std::size_t given_ = 0;             ///< of it
};

BinaryTable binary_table(const io::InputFile& input, const PlyHeader& header) {
  io::BlockInput file(input);
  std::uint64_t begin = header.data_offset;
  for (auto element = header.elements.begin(); element + 1 != header.elements.end(); ++element) {
    begin = end_of(*element, begin, file);
  }
  const PlyElement& vertices = header.elements.back();
  BinaryTable table;
  table.rows = vertices.count;
  table.columns_offset = vertices.offset;
  std::size_t offset = 0;
  std::string lists;
  for (const PlyProperty& property : vertices.properties) {
    if (property.length) {
      lists += fmt::format("{}{}", lists.empty() ? "" : ", ", property.name);
      continue;
    }
    table.columns.push_back({property.name, property.type, 0, offset});
    offset += property.type.bytes;
  }
  if (lists.empty()) {
    table.lanes.push_back(
        {[=] { return std::make_unique<FileSource>(input, begin, UINT64_MAX); }, offset});
  } else {
    warn(table.warnings, kWarning.columns_unused, "lists of the vertices were not used: {}", lists);
    table.lanes.push_back({[=, properties = vertices.properties] {
                             return std::make_unique<WithoutLists>(
                                 std::make_unique<FileSource>(input, begin, UINT64_MAX),
                                 properties);
                           },
                           offset});
  }
  return table;
}

}  // namespace

const Format kPlyFormat = {
    kPly,
    "",
    "PLY point cloud: text or binary (read only)",
    [](std::string_view head) { return head.starts_with("ply\n") || head.starts_with("ply\r\n"); },
    [](const io::InputFile& file, const Progress&) -> std::unique_ptr<Reader> {
      const PlyHeader header = read_ply_header(file);
      if (header.text) {
        return std::make_unique<NamedTextReader>(file, kPly, text_layout(header));
      }
      return std::make_unique<BinaryTableReader>(file.path(), kPly, binary_table(file, header));
    },
};

}  // namespace risley::recordings
