// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/table_file.hpp"

#include <cmath>
#include <limits>
#include <span>
#include <string_view>

#include <fmt/format.h>
#include <sqlite3.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/text.hpp"
#include "risley/io/netcdf.hpp"
#include "risley/io/output_file.hpp"
#include "risley/io/sqlite_input.hpp"
#include "risley/io/text_table.hpp"

namespace risley::io {

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

enum class TableFormat { csv, netcdf, sqlite };

struct TableEnding {
  std::string_view ending;
  TableFormat format;
};
constexpr TableEnding kTableEndings[] = {{".csv", TableFormat::csv},
                                         {".nc", TableFormat::netcdf},
                                         {".sqlite", TableFormat::sqlite},
                                         {".sqlite3", TableFormat::sqlite},
                                         {".db", TableFormat::sqlite}};

TableFormat table_format(const std::string& path) {
  const std::string name = lower_case(path);
  for (const TableEnding& one : kTableEndings) {
    if (name.ends_with(one.ending)) return one.format;
  }
  throw InvalidArgument(
      fmt::format("{}: the ending does not say which kind of table, allowed: .csv (text), .nc "
                  "(NetCDF), .sqlite, .sqlite3 or .db (SQLite)",
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

  TextOutput output_;
  bool is_first_ = true;
};

/// Texts have to be known before anything is written, so all of it is kept until then.
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
        // The library takes texts as those of C.
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

  OutputFile output_;
  TableAbout about_;
  std::vector<Column> columns_;
  std::size_t rows_ = 0;
};

struct CloseTable {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

class SqliteTable final : public TableFile::Writer {
 public:
  SqliteTable(std::string path, const std::vector<TableColumn>& columns, const TableAbout& about)
      : output_(std::move(path)) {
    sqlite3* database = nullptr;
    const int result =
        sqlite3_open_v2(output_.temporary_path().c_str(), &database, SQLITE_OPEN_READWRITE,
                        "unix-none");  // the output has a lock of its own
    database_.reset(database);
    check(result);
    // The file has no name yet: whoever is interrupted leaves nothing, so there is nothing to roll
    // back either.
    run("PRAGMA journal_mode=OFF");
    run("PRAGMA synchronous=OFF");
    run("BEGIN");
    std::string definition, places;
    for (const TableColumn& column : columns) {
      const char* type = column.kind == CellKind::text      ? "TEXT"
                         : column.kind == CellKind::integer ? "INTEGER"
                                                            : "REAL";
      definition +=
          fmt::format("{}{} {}", definition.empty() ? "" : ", ", sql_name(column.name), type);
      places += places.empty() ? "?" : ", ?";
    }
    run("CREATE TABLE columns (name TEXT, unit TEXT, description TEXT)");
    const Statement column_row = prepare("INSERT INTO columns VALUES (?, ?, ?)");
    for (const TableColumn& column : columns) {
      insert(column_row.get(), {column.name, column.unit, column.description});
    }
    run("CREATE TABLE about (name TEXT, value TEXT)");
    const Statement about_row = prepare("INSERT INTO about VALUES (?, ?)");
    for (const auto& [name, value] : about) insert(about_row.get(), {name, value});
    run(fmt::format("CREATE TABLE results ({})", definition));
    row_ = prepare(fmt::format("INSERT INTO results VALUES ({})", places));
  }
  void add(const std::vector<TableCell>& cells) override { insert(row_.get(), cells); }
  void close() override {
    row_.reset();
    run("COMMIT");
    check(sqlite3_close(database_.release()));
    output_.commit();
  }

 private:
  using Statement = std::unique_ptr<sqlite3_stmt, CloseTable>;

  void check(int result) const {
    if (result == SQLITE_OK || result == SQLITE_DONE || result == SQLITE_ROW) return;
    throw FileError(
        output_.path(), {},
        fmt::format("cannot be written: SQLite: {}",
                    database_ ? sqlite3_errmsg(database_.get()) : sqlite3_errstr(result)));
  }
  void run(const std::string& query) const {
    check(sqlite3_exec(database_.get(), query.c_str(), nullptr, nullptr, nullptr));
  }
  Statement prepare(const std::string& query) const {
    sqlite3_stmt* statement = nullptr;
    check(sqlite3_prepare_v2(database_.get(), query.c_str(), -1, &statement, nullptr));
    return Statement(statement);
  }
  void insert(sqlite3_stmt* statement, const std::vector<TableCell>& cells) const {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const int place = static_cast<int>(i) + 1;
      if (const auto* whole = std::get_if<std::int64_t>(&cells[i])) {
        check(sqlite3_bind_int64(statement, place, *whole));
      } else if (const auto* real = std::get_if<double>(&cells[i])) {
        check(sqlite3_bind_double(statement, place, *real));
      } else if (const auto* text = std::get_if<std::string>(&cells[i])) {
        check(sqlite3_bind_text(statement, place, text->data(), static_cast<int>(text->size()),
                                SQLITE_STATIC));
      } else {
        check(sqlite3_bind_null(statement, place));
      }
    }
    check(sqlite3_step(statement));
    check(sqlite3_reset(statement));
  }

  OutputFile output_;
  std::unique_ptr<sqlite3, CloseTable> database_;
  Statement row_;
};

/// The same cell, one without a value where it is not finite.
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
  throw InvalidArgument(fmt::format("column {}: the value is of another kind", column.name));
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
    case TableFormat::sqlite:
      writer_ = std::make_unique<SqliteTable>(path, columns_, about);
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

}  // namespace risley::io
