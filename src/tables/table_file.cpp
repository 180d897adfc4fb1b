// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/tables/table_file.hpp"

#include <cmath>
#include <limits>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/text.hpp"
#include "risley/io/output_file.hpp"
#include "risley/io/text_table.hpp"
#include "risley/tables/netcdf.hpp"

namespace risley::tables {

using TableAbout = std::vector<std::pair<std::string, std::string>>;

/// One of the formats.
class TableFile::Writer {
 public:
  Writer() = default;
  virtual ~Writer() = default;
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  virtual void add(const std::vector<TableCell>& cells) = 0;
  virtual void close() = 0;
};

namespace {

enum class TableFormat { csv, netcdf };

struct TableEnding {
  std::string_view ending;
  TableFormat format;
};
constexpr TableEnding kTableEndings[] = {{".csv", TableFormat::csv}, {".nc", TableFormat::netcdf}};

TableFormat table_format(const std::string& path) {
  const std::string name = lower_case(path);
  for (const TableEnding& one : kTableEndings) {
    if (name.ends_with(one.ending)) return one.format;
  }
  throw InvalidArgument(fmt::format(
      "{}: the ending does not give the kind of table, allowed: .csv (text) or .nc (NetCDF)",
      path));
}

class CsvTable final : public TableFile::Writer {
 public:
  CsvTable(const std::string& path, const std::vector<TableColumn>& columns) : output_(path) {
    for (const TableColumn& column : columns) append_text(column.name);
    end();
  }
  void add(const std::vector<TableCell>& cells) override {
    for (const TableCell& cell : cells) {
      if (const auto* text = std::get_if<std::string>(&cell)) {
        append_text(*text);
        continue;
      }
      begin_field();
      if (const auto* whole = std::get_if<std::int64_t>(&cell)) {
        fmt::format_to(std::back_inserter(output_.buffer()), "{}", *whole);
      } else if (const auto* real = std::get_if<double>(&cell)) {
        fmt::format_to(std::back_inserter(output_.buffer()), "{}", *real);
      }
    }
    end();
  }
  void close() override { output_.close(); }

 private:
  void begin_field() {
    if (!is_first_) output_.append(",");
    is_first_ = false;
  }
  void append_text(std::string_view text) {
    begin_field();
    if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
      output_.append(text);
      return;
    }
    output_.append("\"");
    for (const char c : text)
      output_.append(c == '"' ? std::string_view("\"\"") : std::string_view(&c, 1));
    output_.append("\"");
  }
  void end() {
    output_.end_row();
    is_first_ = true;
  }

  io::TextOutput output_;
  bool is_first_ = true;
};

/// Texts must be known before anything is written, so everything is kept until then.
class NetcdfTable final : public TableFile::Writer {
 public:
  NetcdfTable(std::string path, const std::vector<TableColumn>& columns, TableAbout about)
      : output_(std::move(path)), about_(std::move(about)) {
    for (const TableColumn& column : columns) columns_.push_back({column, {}, {}, {}});
  }
  void add(const std::vector<TableCell>& cells) override {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      Column& column = columns_[i];
      const TableCell& cell = cells[i];
      const auto* whole = std::get_if<std::int64_t>(&cell);
      if (column.is.kind == CellKind::text) {
        const auto* text = std::get_if<std::string>(&cell);
        // The library expects C strings.
        column.texts.push_back(text ? text->substr(0, text->find('\0')) : std::string());
      } else if (column.is.kind == CellKind::integer) {
        column.integers.push_back(whole ? *whole : TableFile::kMissingInteger);
      } else {
        const auto* real = std::get_if<double>(&cell);
        column.reals.push_back(real    ? *real
                               : whole ? static_cast<double>(*whole)
                                       : std::numeric_limits<double>::quiet_NaN());
      }
    }
    ++rows_;
  }
  void close() override {
    {
      NetcdfOutput file(output_);
      file.put_text("Conventions", "CF-1.8");
      for (const auto& [name, value] : about_) file.put_text(name, value);
      std::vector<NetcdfVariable> variables;
      // Without rows there is no length, but a dimension that may grow.
      const NetcdfDimension row =
          rows_ == 0 ? file.define_growing_dimension("row") : file.define_dimension("row", rows_);
      for (Column& column : columns_) variables.push_back(define(file, row, column));
      file.end_definitions();
      for (std::size_t i = 0; rows_ > 0 && i < columns_.size(); ++i) {
        if (columns_[i].is.kind == CellKind::integer)
          file.put(variables[i], 0, columns_[i].integers);
        if (columns_[i].is.kind == CellKind::real) file.put(variables[i], 0, columns_[i].reals);
      }
      file.close();
    }
    output_.commit();
  }

 private:
  struct Column {
    TableColumn is;
    std::vector<std::string> texts;
    std::vector<std::int64_t> integers;
    std::vector<double> reals;
  };

  static NetcdfVariable define(NetcdfOutput& file, const NetcdfDimension& row, Column& column) {
    if (column.is.kind == CellKind::text) {
      if (row.length > 0) {
        file.define_texts(column.is.name, row, column.is.description, std::move(column.texts));
      }
      return {};
    }
    NetcdfVariable variable = column.is.kind == CellKind::integer
                                  ? file.define<std::int64_t>(column.is.name, {&row}, {})
                                  : file.define<double>(column.is.name, {&row}, {});
    file.put_text(variable, "long_name", column.is.description);
    file.put_text(variable, "units", column.is.unit);
    return variable;
  }

  io::OutputFile output_;
  TableAbout about_;
  std::vector<Column> columns_;
  std::size_t rows_ = 0;
};

/// The same cell, without a value if it is not finite.
TableCell checked(const TableCell& cell, const TableColumn& column) {
  if (std::holds_alternative<std::monostate>(cell)) return cell;
  if (const auto* real = std::get_if<double>(&cell); real && column.kind == CellKind::real) {
    return std::isfinite(*real) ? cell : TableCell();
  }
  const bool fits =
      std::holds_alternative<std::string>(cell)
          ? column.kind == CellKind::text
          : std::holds_alternative<std::int64_t>(cell) && column.kind != CellKind::text;
  if (fits) return cell;
  throw InvalidArgument(fmt::format("column {}: the value has another type", column.name));
}

}  // namespace

void TableFile::check_name(const std::string& path) { table_format(path); }

TableFile::TableFile(const std::string& path, std::vector<TableColumn> columns, TableAbout about)
    : columns_(std::move(columns)) {
  require_at_least("number of columns", static_cast<long long>(columns_.size()), 1);
  switch (table_format(path)) {
    case TableFormat::csv:
      writer_ = std::make_unique<CsvTable>(path, columns_);
      break;
    case TableFormat::netcdf:
      writer_ = std::make_unique<NetcdfTable>(path, columns_, std::move(about));
      break;
  }
}

TableFile::~TableFile() = default;

void TableFile::add(const std::vector<TableCell>& cells) {
  require_length("cells of a row", cells.size(), columns_.size());
  std::vector<TableCell> row;
  row.reserve(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) row.push_back(checked(cells[i], columns_[i]));
  writer_->add(row);
}

void TableFile::close() { writer_->close(); }

}  // namespace risley::tables
