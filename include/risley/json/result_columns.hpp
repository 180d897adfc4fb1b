// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "risley/json/results.hpp"
#include "risley/tables/table_file.hpp"

namespace risley::json {

/// The columns of a table with one result per row, by docs/schemas/columns.json. A result is an
/// object of json::of() to which `input`, `status`, `message`, and further names of docs/files.md
/// were added. Columns are those with a value in any result, so there are two passes over the
/// results: first note() for each, then cells().
class ResultColumns {
 public:
  ResultColumns();
  /// Registers the columns of a result.
  void note(const Json& result);

  /// Names, kinds, units and descriptions.
  std::vector<tables::TableColumn> columns() const;
  /// One cell per column; empty if the result has no value of that kind.
  std::vector<tables::TableCell> cells(const Json& result) const;

 private:
  struct Column {
    tables::TableColumn shown;
    std::vector<std::string> places;  ///< JSON pointers; the first one with a value is used
    bool used = false;
  };
  void note_parameters(const Json& result);

  std::vector<Column> columns_;
  std::size_t parameters_at_ = 0, parameters_ = 0;  ///< where those of parameters are; how many
};

}  // namespace risley::json
