// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Texts with named columns in any order and unit, as written by scripts, CloudCompare, ParaView and
// spreadsheets. Columns are separated by commas, semicolons, tabs or blanks. The header line may
// begin with # or //, and comment lines may stand before it. A line with the number of rows may
// come before the rows or before the names; rows after it need no names (PTS).
#include <algorithm>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/error.hpp"
#include "risley/io/file_head.hpp"

#include "recordings/formats/format.hpp"
#include "recordings/formats/named_text.hpp"

namespace risley::recordings {
namespace {

constexpr std::string_view kNamedCsv = "named-csv";

/// The beginning of a table: the layout of its rows in the file, without names if there are none.
struct TableHead {
  NamedTextLayout layout;
  bool has_row = false;  ///< a row of as many numbers follows
};

bool is_comment(std::string_view line) { return line.starts_with('#') || line.starts_with("//"); }

std::string_view without_comment_mark(std::string_view line) {
  while (line.starts_with('#') || line.starts_with('/')) line.remove_prefix(1);
  return trimmed(line);
}

char delimiter_of(std::string_view line) {
  for (const char c : {'\t', ';', ','}) {
    if (line.find(c) != line.npos) return c;
  }
  return kBlanks;
}

bool is_number(std::string_view field) {
  try {
    number_or_nan(field, "");
    return true;
  } catch (const BadRow&) {
    return false;
  }
}

bool all_numbers(const std::vector<std::string_view>& fields) {
  return std::all_of(fields.begin(), fields.end(), is_number) &&
         std::any_of(fields.begin(), fields.end(), [](auto field) { return !field.empty(); });
}

std::string unquoted(std::string_view name) {
  if (name.size() >= 2 && name.front() == name.back() &&
      (name.front() == '"' || name.front() == '\''))
    name = trimmed(name.substr(1, name.size() - 2));
  return std::string(name);
}

bool is_text(std::string_view head) {
  return std::none_of(head.begin(), head.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 && c != '\n' && c != '\r' && c != '\t';
  });
}

/// The lines of the first bytes of a file; the last one may be cut.
struct HeadLines {
  explicit HeadLines(std::string_view head) {
    if (head.starts_with("\xEF\xBB\xBF")) head.remove_prefix(3);
    while (!head.empty()) {
      const auto end = head.find('\n');
      std::string_view line = head.substr(0, end);
      if (line.ends_with('\r')) line.remove_suffix(1);
      lines.push_back(trimmed(line));
      if (end == head.npos) return;
      head.remove_prefix(end + 1);
    }
  }
  std::vector<std::string_view> lines;
};

/// The number of rows stated on a separate line.
std::optional<std::uint64_t> stated_rows(std::string_view line) {
  try {
    return count_field(line, "");
  } catch (const BadRow&) {
    return std::nullopt;
  }
}

/// Columns after a number of rows without names, as in PTS exports of laser scanners.
std::vector<std::string> pts_names(std::size_t columns) {
  std::vector<std::string> names{"x", "y", "z", "intensity", "red", "green", "blue"};
  constexpr std::size_t kCoordinates = 3, kWithIntensity = 4, kWithColour = 6;
  if (columns == kWithColour) names.erase(names.begin() + kCoordinates);
  if (columns != kCoordinates && columns != kWithIntensity && columns != names.size()) return {};
  names.resize(columns);
  return names;
}

bool has_directions(const TableHead& head) {
  std::vector<NamedColumn> columns;
  for (const std::string& name : head.layout.names) columns.push_back({name, CellType::text});
  try {
    const NamedColumns found(std::move(columns));
    return true;
  } catch (const BadColumns&) {
    return false;
  }
}

/// Finds the line of names: the first line that is not a comment or, if that is a row of numbers,
/// the comment before it. Names are empty when there is no such line.
std::optional<TableHead> find_head(std::string_view bytes) {
  if (!is_text(bytes)) return std::nullopt;
  const std::vector<std::string_view> lines = HeadLines(bytes).lines;
  std::optional<std::size_t> comment;
  std::size_t at = 0;
  const auto skip_comments = [&] {
    for (; at < lines.size(); ++at) {
      if (lines[at].empty()) continue;
      if (!is_comment(lines[at])) break;
      comment = at;
    }
  };
  TableHead head;
  const auto take_count = [&] {
    const auto rows = at + 1 < lines.size() ? stated_rows(lines[at]) : std::nullopt;
    if (!rows) return;
    head.layout.rows = rows;
    head.layout.rows_line = at + 1;
    ++at;
    skip_comments();
  };
  skip_comments();
  take_count();
  const auto take_names = [&](std::size_t line) {
    const std::string_view text = without_comment_mark(lines[line]);
    head.layout.delimiter = delimiter_of(text);
    for (const auto name : fields_of(text, head.layout.delimiter))
      head.layout.names.push_back(unquoted(name));
    head.layout.names_line = line + 1;
  };
  const auto row_of = [&](std::size_t line, char delimiter) {
    auto fields = fields_of(lines[line], delimiter);
    const bool cut = line + 1 == lines.size() && bytes.size() >= kHeadBytes;
    if (cut && fields.size() > 1) fields.back() = "0";
    return fields;
  };
  if (at == lines.size()) {  // comments alone: names without a row
    if (!comment) return std::nullopt;
    take_names(*comment);
    head.layout.first_row_line = *comment + 2;
    return head;
  }
  // Truncated names are ignored.
  if (at + 1 == lines.size() && bytes.size() >= kHeadBytes) return std::nullopt;
  const auto first = row_of(at, delimiter_of(lines[at]));
  if (!all_numbers(first)) {
    take_names(at++);
    take_count();
    head.layout.first_row_line = at + 1;
    head.has_row = at < lines.size() && !is_comment(lines[at]) &&
                   row_of(at, head.layout.delimiter).size() <= head.layout.names.size() &&
                   all_numbers(row_of(at, head.layout.delimiter));
    return head;
  }
  if (first.size() < 2) return std::nullopt;
  head.layout.first_row_line = at + 1;
  head.has_row = true;
  head.layout.delimiter = delimiter_of(lines[at]);
  if (comment) {
    take_names(*comment);
    head.layout.delimiter = delimiter_of(lines[at]);
    const bool other = head.layout.rows && !has_directions(head);  // a comment without names
    if (other || head.layout.names.size() != first.size()) head.layout.names.clear();
  }
  if (!head.layout.names.empty() || !head.layout.rows) return head;
  head.layout.names = pts_names(first.size());
  if (!head.layout.names.empty()) {
    head.layout.names_line = head.layout.rows_line;
    warn(head.layout.warnings, kWarning.columns_guessed,
         "the columns have no names: behind a number of rows they were taken as {}",
         fmt::join(head.layout.names, ", "));
  }
  return head;
}

NamedTextLayout read_layout(const io::InputFile& file) {
  const auto head = find_head(io::read_file_head(file, kHeadBytes));
  if (!head) {
    throw FileError(file.path(), {{}, 1},
                    "expected a line with the names of the columns, found none");
  }
  if (head->layout.names.empty()) {
    throw FileError(
        file.path(), {{}, head->layout.first_row_line},
        "expected a line with the names of the columns before the first row, found numbers; add "
        "such a line, as in x_m,y_m,z_m or time_s,azimuth_deg,zenith_deg,range_m");
  }
  return head->layout;
}

}  // namespace

const Format kNamedCsvFormat = {
    kNamedCsv,
    "",
    "text table with named columns: x, y, z or azimuth, zenith, range (read only)",
    [](std::string_view bytes) {
      const auto head = find_head(bytes);
      return head && (head->has_row || has_directions(*head));
    },
    [](const io::InputFile& file, const Progress&) -> std::unique_ptr<Reader> {
      return std::make_unique<NamedTextReader>(file, kNamedCsv, read_layout(file));
    },
};

}  // namespace risley::recordings
