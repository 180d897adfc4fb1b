// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/tables/table_file.hpp"

namespace risley::tables {

/// Whether a file is a table of TableFile's kinds: NetCDF by its first bytes, text by
/// its ending .csv. false also where it cannot be read.
bool is_table(const std::string& path);

/// Columns of such a table, row by row. In text, the fields may also stand between semicolons or
/// tabs, as spreadsheets write them.
/// @param columns  by name and kind; one that the table lacks has no value in any row
/// @return [rows][columns], cells of the columns' kinds or without a value
/// @throws FileError for damage, for values of another kind, and where the table has none of the
///         columns; Cancelled
std::vector<std::vector<TableCell>> read_table(const std::string& path,
                                               const std::vector<TableColumn>& columns,
                                               const Progress& progress = {});

}  // namespace risley::tables
