// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"

#include "command.hpp"

namespace risley::app {

/// One file to make from another.
struct FileJob {
  std::string input, output;
};

/// What came of it.
struct FileOutcome {
  ExitStatus status = kDone;
  Json json;         ///< of this file alone
  std::string text;  ///< one line for people
};

/// Files for a verb that turns each of its inputs into one output.
/// @param inputs  names, or patterns as the shell knows them: a name with *, ? or [ that is no file
/// @param output  a file name for one input; a folder, made where it is missing, for several
///                inputs, for a pattern, or where it exists as one
/// @param ending  of the outputs in a folder, ".las"
/// @throws InvalidArgument for a pattern without a file, and for outputs that would overwrite each
///         other or an input
std::vector<FileJob> file_jobs(const std::vector<std::string>& inputs, const std::string& output,
                               const std::string& ending);

/// Whether file_jobs() puts its outputs into a folder.
bool output_is_folder(const std::vector<std::string>& inputs, const std::string& output);

/// Runs all jobs, several at a time unless NetCDF is among them (its library is not thread-safe),
/// and prints what came of them. One alone is as if there were no others: its JSON is
/// the object, its errors leave by throwing. Of several, one that fails does not stop the rest; the
/// JSON has an entry per file under "results" and the sum of `counted`.
/// @return kDone when all went well, otherwise the highest status of those that did not
ExitStatus run_file_jobs(const std::vector<FileJob>& jobs, const std::string& label,
                         const char* counted,
                         const std::function<FileOutcome(const FileJob&, const Progress&)>& work,
                         const CommonOptions& common);

}  // namespace risley::app
