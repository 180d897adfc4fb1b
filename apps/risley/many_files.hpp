// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"

#include "command.hpp"

namespace risley::app {

/// Which inputs a verb is to read, and how what comes of many of them is told, as typed.
struct ManyWishes {
  std::vector<std::string> inputs;
  std::string list, table;
  bool resume = false;
};

/// Declares INPUT, --list, --table and --resume.
/// @param what  an input is, in words
CLI::Option* add_many_options(CLI::App& verb, ManyWishes& wishes, const std::string& what);

/// One input with its output.
struct FileJob {
  std::string input;
  std::string output;       ///< empty: none
  std::string place;        ///< of its results below a folder, unlike that of any other job
  std::string device = {};  ///< of the input's, where each has a job
};

/// What came of it.
struct FileOutcome {
  ExitStatus status = kDone;
  Json json;         ///< of this input alone
  std::string text;  ///< one line for people
};

/// The outcome of a job whose numbers have a verdict.
/// @param json    what was found, with converged and verdict
/// @param reason  why it did not converge, in words of the command; empty where it did
/// @param words   what it was made from
FileOutcome judged_outcome(const FileJob& file, Json json, const std::string& reason,
                           const std::string& words);

/// Jobs of one command.
struct FileJobs {
  std::vector<FileJob> jobs;
  /// Whether they are told as several are, with "results": by what was typed, not by how many
  /// inputs that came to.
  bool many = false;
  std::string folder;   ///< that all results go to; empty: none, or each into one of its own
  std::string records;  ///< folder for records of what was made; empty: none are kept
};

/// Whether the results of several inputs go to a folder for all.
bool are_several(const ManyWishes& wishes);
/// The same for a verb that makes one file of each input, whose output may be an existing folder.
bool output_is_folder(const ManyWishes& wishes, const std::string& output);

/// Inputs with their outputs.
/// @param output  as typed, empty for none: of one input the output itself, of several a folder, in
///                which every output stands where its input does below the folder that all share
/// @param into_folder  whether it is such a folder, which is made where it is missing
/// @param ending  of outputs in it, ".las"; empty for folders
/// @throws InvalidArgument, FileError
FileJobs file_jobs(const ManyWishes& wishes, const std::string& output, bool into_folder,
                   const std::string& ending);

/// How a verb works through its inputs.
struct FileWork {
  std::string label;              ///< for the bar, "estimating"
  const char* counted = nullptr;  ///< name in the JSON of what is summed up, if anything
  bool into_folders = false;      ///< outputs are folders, which are made by who fills them
  /// Files that a job writes; without it the output alone.
  std::function<std::vector<std::string>(const FileJob&)> files;
  std::function<FileOutcome(const FileJob&, const Progress&)> run;
};

/// Runs all jobs, several at a time, and prints what came of them. One alone is as if there were no
/// others: its JSON is the object, its errors leave by throwing. Of several, one that fails does
/// not stop the rest; the JSON has an entry per input under "results" and the sum of what is
/// counted, and a table may be written with a row for each. Results that are whole and made by the
/// same work from the same bytes are not made again with --resume. Memory does not grow with what
/// the jobs find: outcomes wait in a temporary file.
/// @param verb  its options are part of what makes two results the same
/// @return kDone when all went well, otherwise the highest status of those that did not
/// @throws Cancelled after the table of what was finished was written
ExitStatus run_file_jobs(const FileJobs& jobs, const FileWork& work, const ManyWishes& wishes,
                         const CLI::App& verb, const CommonOptions& common);

}  // namespace risley::app
