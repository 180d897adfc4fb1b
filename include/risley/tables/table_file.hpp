// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace risley::tables {

/// Kind of a column's values.
enum class CellKind { text, integer, real };

/// A column of a table.
struct TableColumn {
  std::string name;
  CellKind kind = CellKind::text;
  std::string unit = {};  ///< "1" for numbers without, empty for texts
  std::string description = {};
};

/// A value, or none.
using TableCell = std::variant<std::monostate, std::int64_t, double, std::string>;

/// A table that is written row by row and appears under its name, complete, at close(). The ending
/// of the name selects the format:
///
/// - .csv: a line of names, then one line per row; a cell without a value is empty, texts with
///   commas, quotes or line feeds stand in quotes;
/// - .nc: NetCDF-4, one variable per column along the dimension `row`; a missing number is NaN, a
///   missing whole number kMissingInteger, a missing text empty.
///
/// CSV cannot hold units, descriptions and `about`. Non-finite numbers count as missing.
class TableFile {
 public:
  /// NetCDF's value for a missing whole number; the library's own fill value.
  static constexpr std::int64_t kMissingInteger = -9223372036854775806LL;

  /// @throws InvalidArgument for a name with another ending, naming the supported ones
  static void check_name(const std::string& path);

  /// @param about  the table as a whole, name and value each
  /// @throws InvalidArgument as check_name(), and without columns; FileError
  TableFile(const std::string& path, std::vector<TableColumn> columns,
            std::vector<std::pair<std::string, std::string>> about);
  ~TableFile();
  TableFile(const TableFile&) = delete;
  TableFile& operator=(const TableFile&) = delete;

  /// @param cells  one per column, of its kind or without a value; whole numbers are accepted for
  /// real ones. @throws InvalidArgument for others; FileError
  void add(const std::vector<TableCell>& cells);
  /// @throws FileError
  void close();

  class Writer;

 private:
  std::vector<TableColumn> columns_;
  std::unique_ptr<Writer> writer_;
};

}  // namespace risley::tables
