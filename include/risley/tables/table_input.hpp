// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/tables/table_file.hpp"

namespace risley::tables {

/// Whether a file is a table of TableFile's kinds: NetCDF by its first bytes, text by its ending
/// .csv. false also if it cannot be read.
bool is_table(const std::string& path);

/// Columns of a table of this kind, row by row. In text, semicolons or tabs may also separate the
/// fields, as in spreadsheets.
/// @param columns  by name and kind; one that the table lacks has no value in any row
/// @return [rows][columns], cells of the columns' kinds or without a value
/// @throws FileError for damage, for values of another kind, and if the table has none of the
/// columns; Cancelled
std::vector<std::vector<TableCell>> read_table(const std::string& path,
                                               const std::vector<TableColumn>& columns,
                                               const Progress& progress = {});

}  // namespace risley::tables
