// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "risley/json/results.hpp"
#include "risley/tables/table_file.hpp"

namespace risley::json {

/// The columns of a table in which every row is one of many results, by docs/schemas/columns.json.
/// A result is an object of json::of() to which `input`, `status`, `message`, and further names of
/// docs/files.md were added. Columns are those for which any result has a value, so the results are
/// looked at twice: first note() for each, then cells().
class ResultColumns {
 public:
  ResultColumns();
  /// Looks at a result, so that what it has gets its columns.
  void note(const Json& result);

  /// Names, kinds, units and descriptions.
  std::vector<tables::TableColumn> columns() const;
  /// One cell per column; what a result does not have, or has of another kind, is empty.
  std::vector<tables::TableCell> cells(const Json& result) const;

 private:
  struct Column {
    tables::TableColumn shown;
    std::vector<std::string> places;  ///< JSON pointers, of which the first with a value counts
    bool used = false;
  };
  void note_parameters(const Json& result);

  std::vector<Column> columns_;
  std::size_t parameters_at_ = 0, parameters_ = 0;  ///< where those of parameters are; how many
};

}  // namespace risley::json
