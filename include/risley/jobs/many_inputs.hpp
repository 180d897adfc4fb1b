// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/io/folder_lock.hpp"
#include "risley/jobs/inputs.hpp"

namespace risley::jobs {

/// How work ended; for the command, its exit status.
enum ExitStatus : int {
  kDone = 0,
  kNumbersFailed = 1,
  kWrongUsage = 2,
  kBadFile = 3,
  kFault = 4,          ///< of the program or of the machine: a bug, no memory
  kInterrupted = 130,  ///< 128 + SIGINT, as shells have it
};

/// The inputs, and the destination of their results.
struct ManyInputsOptions {
  std::vector<std::string> names;  ///< see InputNames
  std::string list;                ///< see InputNames
  /// For one input the output itself, for several a folder, whose layout mirrors that of the inputs
  /// below their common folder; empty: none.
  std::string output;
  bool into_folder = false;  ///< whether it is a folder; it is created if missing
  std::string table;         ///< to write with one row per input; empty: none
  bool resume = false;       ///< keep complete results, see InputRun
};

/// One input with its output.
struct InputJob {
  std::string input;
  std::string output;       ///< empty: none
  std::string place;        ///< of its results below a folder, unique among the jobs
  std::string device = {};  ///< of the input's, where each has a job
};

/// What came of one input.
struct InputOutcome {
  ExitStatus status = kDone;
  std::string json;           ///< an object of this input alone
  std::string text;           ///< one line for people
  std::uint64_t counted = 0;  ///< count over all inputs, such as points
};

/// The same, as written in the journal.
struct InputResult {
  InputOutcome outcome;
  std::vector<std::string> hashes;  ///< SHA-256 of the input's files
  double elapsed = 0;               ///< s
  bool skipped = false;             ///< it had been made before
};

/// Result of all of them.
struct InputCounts {
  std::size_t done = 0;     ///< number of successes, without earlier ones
  std::size_t skipped = 0;  ///< number of earlier successes
  std::size_t failed = 0;
  std::uint64_t counted = 0;  ///< the sum kDone when all succeeded, otherwise the highest status of
                              ///< those that failed.
  ExitStatus status = kDone;
};

/// How each input is processed.
struct InputWork {
  std::string verb;           ///< "estimate"
  std::string label;          ///< for a bar, "estimating"
  std::string counted;        ///< name of the sum in the JSON, if any
  bool into_folders = false;  ///< outputs are folders, created when needed
  std::string ending;         ///< of files in a folder for all, ".las"; empty: not known
  /// Files that a job writes; without it only the output.
  std::function<std::vector<std::string>(const InputJob&)> files;
  std::function<InputOutcome(const InputJob&, const Progress&)> run;
  /// Outcome of a job that threw an exception.
  std::function<InputOutcome(const InputJob&)> failed;

  /// Those of `files`, or the output.
  std::vector<std::string> files_of(const InputJob& job) const;
};

/// All of them.
struct InputPlan {
  std::vector<InputJob> jobs;
  /// Whether results are shown as a list. The request decides, not the number of matching inputs.
  bool many = false;
  std::string folder;   ///< for all results; empty: none, or one for each
  std::string journal;  ///< record of finished results; empty: none is kept
};

/// Finds the inputs and assigns their outputs.
/// @throws InvalidArgument, FileError, Cancelled
InputPlan plan_inputs(const ManyInputsOptions& options, const InputWork& work,
                      const Progress& progress = {});

/// Settings by name, with their values, as a text that identifies the work: names of existing files
/// are replaced by the SHA-256 of their contents.
/// @param program  its name, version and verb @throws FileError, Cancelled
std::string work_text(const std::string& program,
                      const std::vector<std::pair<std::string, std::vector<std::string>>>& settings,
                      const Progress& progress = {});

/// Runs all jobs, several at a time. A failure does not stop the rest. Their results wait in a
/// file, so that memory does not grow: in the plan's journal, or in a temporary one.
///
/// The journal has a line per input, written when its result is complete: the work, SHA-256 of the
/// input and of every file of the result, and the outcome. With resume, a result is kept if the
/// same work made it from the same bytes and its files still have the bytes that were written;
/// contents decide, not file times. Inputs that could not be read or written may have failed
/// because of the machine and are tried again.
class InputRun {
 public:
  /// @param plan, work  must outlive it  @param work_text  see there
  /// @throws FileError if the table or the journal cannot be written, or another run has locked the
  /// folder
  InputRun(const InputPlan& plan, const InputWork& work, const std::string& work_text,
           const ManyInputsOptions& options);
  ~InputRun();
  InputRun(const InputRun&) = delete;
  InputRun& operator=(const InputRun&) = delete;

  /// Called at the end of a job, from its thread, one at a time.
  using Ended = std::function<void(std::size_t ended, std::size_t failed)>;
  /// @return false if it was cancelled: finished results are still available
  bool run(const Progress& progress, const Ended& ended = {});

  /// Calls with the result of each input, in their order.
  void for_each(const std::function<void(const InputJob&, const InputResult&)>& call) const;
  /// Files of inputs with their SHA-256.
  FileHashes hashes() const;
  /// Once it has run.
  const InputCounts& counts() const { return counts_; }

 private:
  class Journal;
  ExitStatus run_job(std::size_t place, const Progress& progress);
  FileHashes outputs_of(const InputJob& job, const Progress& progress) const;
  std::optional<ExitStatus> made_before(std::size_t place, const Progress& progress);

  const InputPlan& plan_;
  const InputWork& work_;
  bool resume_;
  std::string work_hash_;
  std::vector<FileHashes> hashes_;  ///< of every input's files
  std::vector<long> lines_;         ///< in the journal; -1: not finished
  std::vector<char> skipped_;
  InputCounts counts_;
  std::optional<io::FolderLock> lock_;  ///< of the folder for all results
  std::unique_ptr<Journal> journal_;
};

}  // namespace risley::jobs
