// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/named_text.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/block_file.hpp"

namespace risley::recordings {

NamedTextReader::NamedTextReader(const io::InputFile& file, std::string_view format,
                                 NamedTextLayout layout)
    : TextTableReader(file, std::string(format)),
      layout_(std::move(layout)),
      columns_(find_columns()) {
  set_column_count(layout_.names.size(), layout_.delimiter, layout_.lists);
  begin_rows_at(layout_.first_row_line);
  if (layout_.rows) set_row_count(*layout_.rows, layout_.rows_line);
  look_ahead(kNamedRowsLookedAt, [&](Fields fields) {
    read_cells(fields);
    columns_.look_at(cells_);
    return true;
  });
  try {
    columns_.settle(header_, layout_.warnings);
  } catch (const BadColumns& bad) {
    fail(layout_.names_line, bad.what());
  }
  for (Warning& warning : layout_.warnings) {
    warning.place.line = layout_.names_line;
    warnings_.push_back(std::move(warning));
  }
}

NamedColumns NamedTextReader::find_columns() const {
  std::vector<NamedColumn> columns;
  for (const std::string& name : layout_.names) columns.push_back({name, CellType::text});
  try {
    return NamedColumns(std::move(columns));
  } catch (const BadColumns& bad) {
    fail(layout_.names_line, bad.what());
  }
}

void NamedTextReader::read_cells(Fields fields) {
  const auto& wanted = columns_.wanted();
  cells_.resize(wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    cells_[i] = number_or_nan(fields[wanted[i]], columns_.name(i));
  }
}

void NamedTextReader::append_row(Fields fields, Chunk& chunk) {
  read_cells(fields);
  columns_.append(cells_, chunk.observations);
}

HeaderLines::HeaderLines(const io::InputFile& input) : path_(input.path()) {
  constexpr std::uint64_t kLongestHeader = std::uint64_t{1} << 16;
  io::BlockInput file(input);
  file_size_ = file.size();
  const auto count = static_cast<std::size_t>(std::min(file_size_, kLongestHeader));
  if (count > 0) bytes_.assign(reinterpret_cast<const char*>(file.at(0, count)), count);
}

std::string_view HeaderLines::next() {
  const std::string_view rest = std::string_view(bytes_).substr(static_cast<std::size_t>(offset_));
  const auto end = rest.find('\n');
  ++line_;
  if (end == rest.npos) {
    fail(bytes_.size() < file_size_
             ? fmt::format("expected a header of at most {} bytes, found a longer one",
                           bytes_.size())
             : std::string("expected further lines of the header, found the end of the file"));
  }
  offset_ += end + 1;
  std::string_view line = rest.substr(0, end);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return trimmed(line);
}

void HeaderLines::fail(const std::string& problem) const {
  throw FileError(path_, {{}, line_}, problem);
}

std::uint64_t count_field(std::string_view field, std::string_view name) {
  return static_cast<std::uint64_t>(integer_field(field, name, 0, INT64_MAX));
}

}  // namespace risley::recordings
