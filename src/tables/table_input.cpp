// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/tables/table_input.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/io/text_table.hpp"
#include "risley/tables/netcdf.hpp"

namespace risley::tables {
namespace {

using Rows = std::vector<std::vector<TableCell>>;

constexpr std::string_view kHdf5Mark = "\x89HDF\r\n";
constexpr std::string_view kClassicNetcdfMark = "CDF";
constexpr const char* kRowDimension = "row";

std::string head_of(const std::string& path) {
  std::string head(16, '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(stream.gcount(), 0)));
  return head;
}

bool is_netcdf(std::string_view head) {
  return head.starts_with(kHdf5Mark) || head.starts_with(kClassicNetcdfMark);
}

std::string names_of(const std::vector<TableColumn>& columns) {
  std::string names;
  for (const TableColumn& column : columns) {
    names += (names.empty() ? "" : ", ") + column.name;
  }
  return names;
}

[[noreturn]] void fail_without_columns(const std::string& path,
                                       const std::vector<TableColumn>& columns) {
  throw FileError(
      path, {},
      fmt::format("expected a table of results, found none of the columns {}", names_of(columns)));
}

/// Rows of text in which quoted fields may contain anything, line feeds included.
class CsvInput {
 public:
  explicit CsvInput(const std::string& path) : path_(path), lines_(path) {}

  /// @return false at the end of the file
  bool next(std::vector<std::string>& fields) {
    std::string_view line;
    do {
      if (!lines_.next(line)) return false;
    } while (line.empty());
    line_ = lines_.line_number();
    if (!delimiter_) delimiter_ = delimiter_of(line);
    fields.assign(1, {});
    bool in_quotes = false;
    std::size_t at = 0;
    while (true) {
      if (at == line.size()) {
        if (!in_quotes) return true;
        add(fields.back(), '\n');
        if (!lines_.next(line)) fail("expected the quotes of a field to be closed");
        at = 0;
        continue;
      }
      const char c = line[at++];
      if (in_quotes && c == '"' && at < line.size() && line[at] == '"') {
        add(fields.back(), line[at++]);
      } else if (c == '"' && (in_quotes || fields.back().empty())) {
        in_quotes = !in_quotes;
      } else if (!in_quotes && c == *delimiter_) {
        fields.emplace_back();
      } else {
        add(fields.back(), c);
      }
    }
  }
  [[noreturn]] void fail(const std::string& problem) const {
    throw FileError(path_, {{}, line_}, problem);
  }

 private:
  static char delimiter_of(std::string_view header) {
    const std::size_t first = header.find_first_of(",;\t");
    return first == std::string_view::npos ? ',' : header[first];
  }
  void add(std::string& field, char c) const {
    constexpr std::size_t kLongestField = std::size_t{1} << 16;
    if (field.size() == kLongestField) {
      fail(fmt::format("expected a field of at most {} bytes, found a longer one", kLongestField));
    }
    field += c;
  }

  std::string path_;
  io::LineReader lines_;
  std::uint64_t line_ = 0;  ///< in which the row begins
  std::optional<char> delimiter_;
};

TableCell cell_of(const std::string& field, const TableColumn& column) {
  if (field.empty()) return {};
  constexpr auto kLow = std::numeric_limits<std::int64_t>::min();
  constexpr auto kHigh = std::numeric_limits<std::int64_t>::max();
  switch (column.kind) {
    case CellKind::text:
      return field;
    case CellKind::integer:
      return io::integer_field(io::trimmed(field), column.name, kLow, kHigh);
    case CellKind::real:
      break;
  }
  return io::decimal_field(io::trimmed(field), column.name).value;
}

Rows read_text(const std::string& path, const std::vector<TableColumn>& columns,
               const Progress& progress) {
  CsvInput input(path);
  std::vector<std::string> header, fields;
  if (!input.next(header)) fail_without_columns(path, columns);
  std::vector<std::optional<std::size_t>> places;
  for (const TableColumn& column : columns) {
    const auto at = std::find(header.begin(), header.end(), column.name);
    places.emplace_back();
    if (at == header.end()) continue;
    places.back() = static_cast<std::size_t>(at - header.begin());
    if (std::find(at + 1, header.end(), column.name) != header.end()) {
      input.fail(fmt::format("the column {} stands twice", column.name));
    }
  }
  if (std::none_of(places.begin(), places.end(), [](const auto& one) { return one.has_value(); })) {
    fail_without_columns(path, columns);
  }
  Rows rows;
  while (input.next(fields)) {
    progress.check();
    if (fields.size() != header.size()) {
      input.fail(fmt::format("expected {} fields, found {}", header.size(), fields.size()));
    }
    rows.emplace_back();
    for (std::size_t i = 0; i < columns.size(); ++i) {
      try {
        rows.back().push_back(places[i] ? cell_of(fields[*places[i]], columns[i]) : TableCell());
      } catch (const io::BadRow& error) {
        input.fail(error.what());
      }
    }
  }
  return rows;
}

std::vector<TableCell> column_of(const NetcdfInput& file, const NetcdfDimension& row,
                                 const TableColumn& column) {
  std::vector<TableCell> cells(row.length);
  if (column.kind == CellKind::text) {
    std::vector<std::string> texts = file.texts(column.name, row);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (!texts[i].empty()) cells[i] = std::move(texts[i]);
    }
  } else if (column.kind == CellKind::integer) {
    std::vector<std::int64_t> values;
    file.get(file.variable<std::int64_t>(column.name, {&row}), 0, row.length, values);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (values[i] != TableFile::kMissingInteger) cells[i] = values[i];
    }
  } else {
    std::vector<double> values;
    file.get(file.variable<double>(column.name, {&row}), 0, row.length, values);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (std::isfinite(values[i])) cells[i] = values[i];
    }
  }
  return cells;
}

Rows read_netcdf(const std::string& path, const std::vector<TableColumn>& columns,
                 const Progress& progress) {
  const NetcdfInput file(path, progress);
  const auto has = [&](const TableColumn& column) { return file.has_variable(column.name); };
  if (std::none_of(columns.begin(), columns.end(), has)) fail_without_columns(path, columns);
  const NetcdfDimension row = file.dimension(kRowDimension);
  std::error_code code;
  const std::uint64_t bytes = std::filesystem::file_size(path, code);
  if (code || row.length > bytes) {  // every row has at least a text
    file.fail(fmt::format("{} rows do not fit in a file of {} bytes", row.length, bytes));
  }
  Rows rows(row.length, std::vector<TableCell>(columns.size()));
  for (std::size_t i = 0; i < columns.size() && row.length > 0; ++i) {
    if (!has(columns[i])) continue;
    std::vector<TableCell> cells = column_of(file, row, columns[i]);
    for (std::size_t k = 0; k < cells.size(); ++k) rows[k][i] = std::move(cells[k]);
  }
  return rows;
}

}  // namespace

bool is_table(const std::string& path) {
  const std::string head = head_of(path);
  return is_netcdf(head) || (!head.empty() && lower_case(path).ends_with(".csv"));
}

Rows read_table(const std::string& path, const std::vector<TableColumn>& columns,
                const Progress& progress) {
  const std::string head = head_of(path);
  if (is_netcdf(head)) return read_netcdf(path, columns, progress);
  return read_text(path, columns, progress);
}

}  // namespace risley::tables
