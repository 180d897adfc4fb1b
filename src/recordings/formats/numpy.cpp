// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// NumPy arrays: one in a .npy file, several by name in a .npz file, which is a zip file.
#include <algorithm>
#include <memory>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/text.hpp"

#include "recordings/formats/binary_table.hpp"
#include "recordings/formats/format.hpp"
#include "recordings/formats/npy_header.hpp"
#include "recordings/formats/zip_archive.hpp"

namespace risley::recordings {
namespace {

constexpr std::string_view kNpyName = "npy", kNpzName = "npz";
constexpr std::string_view kMemberEnding = ".npy";

BinaryTable npy_table(const io::InputFile& file) {
  FileSource source(file, 0, UINT64_MAX);
  try {
    const ArrayHeader header = read_array_header(source);
    BinaryTable table;
    add_table(
        header,
        [file](std::uint64_t offset) {
          return std::make_unique<FileSource>(file, offset, UINT64_MAX);
        },
        table);
    const std::uint64_t end = header.data_offset + header.elements() * header.element_bytes;
    const std::uint64_t size = file.size();
    if (size > end) {
      warn(table.warnings, kWarning.content_left_out, "{} bytes after the array were not read",
           size - end);
    }
    return table;
  } catch (const BadArray& bad) {
    throw FileError(file.path(), {0, {}}, bad.what());
  }
}

/// An array of an archive.
struct Member {
  std::string name;  ///< without its ending
  ArrayHeader header;
  OpenArray open;
  std::uint64_t begin = 0;

  bool is_column() const {
    const bool one_wide = header.shape.size() == 2 && header.shape[1] == 1;
    return (header.shape.size() == 1 || one_wide) && !header.is_structured() &&
           !header.fields.empty();
  }
};

/// Chooses the array of the points: the only table, or the one with that name.
const Member* find_table(const std::vector<Member>& members) {
  static const std::set<std::string> names = {"points", "xyz",       "data",       "cloud",
                                              "arr_0",  "positions", "point_cloud"};
  const Member* only = nullptr;
  std::size_t tables = 0;
  for (const Member& member : members) {
    if (!is_table(member.header)) continue;
    if (names.contains(lower_case(member.name))) return &member;
    only = &member;
    ++tables;
  }
  return tables == 1 ? only : nullptr;
}

std::vector<Member> npz_members(const io::InputFile& file, std::vector<std::string>& left_out) {
  std::vector<Member> members;
  for (const ZipMember& zipped : zip_members(file)) {
    if (!zipped.name.ends_with(kMemberEnding)) {
      left_out.push_back(zipped.name);
      continue;
    }
    Member member;
    member.name = zipped.name.substr(0, zipped.name.size() - kMemberEnding.size());
    member.begin = zipped.begin;
    member.open = [file, zipped](std::uint64_t offset) {
      return open_member(file, zipped, offset);
    };
    const auto source = member.open(0);
    try {
      member.header = read_array_header(*source);
    } catch (const BadArray& bad) {
      throw FileError(file.path(), {zipped.begin, {}},
                      fmt::format("member {}: {}", printable(zipped.name), bad.what()));
    }
    const std::uint64_t expected =
        member.header.data_offset + member.header.elements() * member.header.element_bytes;
    if (!member.header.other_fields.empty() && member.header.fields.empty()) {
      left_out.push_back(member.name);  // texts and objects
      continue;
    }
    if (expected != zipped.bytes) {
      throw FileError(file.path(), {zipped.begin, {}},
                      fmt::format("expected {} bytes in member {} ({} of {} bytes), found {}",
                                  expected, printable(zipped.name), member.header.shape_text(),
                                  member.header.element_bytes, zipped.bytes));
    }
    members.push_back(std::move(member));
  }
  return members;
}

BinaryTable npz_table(const io::InputFile& file) {
  std::vector<std::string> left_out;
  const std::vector<Member> members = npz_members(file, left_out);
  if (members.empty()) {
    throw FileError(file.path(), {0, {}},
                    "expected a zip file of NumPy arrays, found no array in it");
  }
  BinaryTable table;
  table.columns_offset = members.front().begin;
  std::string found;
  for (const Member& member : members) {
    found += fmt::format("{}{} ({})", found.empty() ? "" : ", ", member.name,
                         member.header.shape_text());
  }
  const Member* const points = find_table(members);
  const Member* first_column = nullptr;
  for (const Member& member : members) {
    if (member.is_column() && first_column == nullptr) first_column = &member;
  }
  if (points != nullptr) {
    table.columns_offset = points->begin;
    add_table(points->header, points->open, table);
  } else if (first_column != nullptr) {
    // Most arrays have the length of the recording; others are something else.
    std::size_t most = 0;
    for (const Member& member : members) {
      if (!member.is_column()) continue;
      const auto as_long = static_cast<std::size_t>(
          std::count_if(members.begin(), members.end(), [&](const Member& other) {
            return other.is_column() && other.header.shape[0] == member.header.shape[0];
          }));
      if (as_long > most) {
        most = as_long;
        table.rows = member.header.shape[0];
      }
    }
  } else {
    throw FileError(file.path(), {table.columns_offset, {}},
                    fmt::format("expected arrays x, y and z of equal length, or one array of "
                                "points; found {}",
                                printable(found)));
  }
  for (const Member& member : members) {
    if (&member == points) continue;
    if (member.is_column() && member.header.shape[0] == table.rows) {
      add_column(member.header, member.name, member.open, table);
    } else {
      left_out.push_back(member.name);
    }
  }
  if (!left_out.empty()) {
    std::string names;
    for (const std::string& name : left_out) names += (names.empty() ? "" : ", ") + name;
    warn(table.warnings, kWarning.columns_unused,
         "members that are not columns of {} rows were left out: {}", table.rows, printable(names));
  }
  return table;
}

}  // namespace

const Format kNpyFormat = {
    kNpyName,
    "",
    "NumPy array of named fields, or of rows x y z [intensity] (read only)",
    [](std::string_view head) { return head.starts_with(kArraySignature); },
    [](const io::InputFile& file, const Progress&) -> std::unique_ptr<Reader> {
      return std::make_unique<BinaryTableReader>(file.path(), kNpyName, npy_table(file));
    },
};

const Format kNpzFormat = {
    kNpzName,
    "",
    "NumPy arrays by name, such as x, y, z and time (read only)",
    [](std::string_view head) { return head.starts_with("PK\x03\x04"); },
    [](const io::InputFile& file, const Progress&) -> std::unique_ptr<Reader> {
      return std::make_unique<BinaryTableReader>(file.path(), kNpzName, npz_table(file));
    },
};

}  // namespace risley::recordings
