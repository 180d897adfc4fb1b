// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "risley/core/progress.hpp"

namespace risley::jobs {

/// What a result was made from, so that nobody has to make it again: small, beside the results, and
/// written when they are whole. Contents decide, not times of files.
struct ResultRecord {
  /// Everything that decides the result apart from its input, as text that is the same for the same
  /// work; with the version of the program.
  std::string work;
  std::vector<std::string> inputs;  ///< SHA-256 of every file of the input
  /// Files of the result, each with its SHA-256.
  std::vector<std::pair<std::string, std::string>> outputs;
  std::string outcome;  ///< what the one who made it wants to know again
};

/// Writes a record, the folder for it included; the record appears when it is whole.
/// @throws FileError
void save_record(const std::string& path, const ResultRecord& record);

/// Empty where there is no record, or what is there is none.
std::optional<ResultRecord> load_record(const std::string& path);

/// Whether a result need not be made again: it was made by the same work from the same bytes, and
/// all of its files still have the bytes that were written.
/// @throws Cancelled
bool is_whole(const ResultRecord& record, const std::string& work,
              const std::vector<std::string>& inputs, const Progress& progress = {});

/// Those of the files that exist, with their SHA-256. @throws FileError, Cancelled
std::vector<std::pair<std::string, std::string>> hashes_of(const std::vector<std::string>& files,
                                                           const Progress& progress = {});

}  // namespace risley::jobs
