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

/// How work ended; of the command, what the shell sees.
enum ExitStatus : int {
  kDone = 0,
  kNumbersFailed = 1,
  kWrongUsage = 2,
  kBadFile = 3,
  kFault = 4,          ///< of the program or of the machine: a bug, no memory
  kInterrupted = 130,  ///< 128 + SIGINT, as shells have it
};

/// Which inputs are meant, and where what comes of them goes.
struct ManyInputsOptions {
  std::vector<std::string> names;  ///< see InputNames
  std::string list;                ///< see InputNames
  /// Of one input the output itself, of several a folder, in which every output stands where its
  /// input does below the folder that all share; empty: none.
  std::string output;
  bool into_folder = false;  ///< whether it is such a folder, which is made where it is missing
  std::string table;         ///< to write with one row per input; empty: none
  bool resume = false;       ///< leave results that are whole as they are, see InputRun
};

/// One input with its output.
struct InputJob {
  std::string input;
  std::string output;       ///< empty: none
  std::string place;        ///< of its results below a folder, unlike that of any other job
  std::string device = {};  ///< of the input's, where each has a job
};

/// What came of one input.
struct InputOutcome {
  ExitStatus status = kDone;
  std::string json;           ///< an object of this input alone
  std::string text;           ///< one line for people
  std::uint64_t counted = 0;  ///< what all inputs are summed up in, such as points
};

/// The same, as it stands in the journal.
struct InputResult {
  InputOutcome outcome;
  std::vector<std::string> hashes;  ///< SHA-256 of the input's files
  double elapsed = 0;               ///< s
  bool skipped = false;             ///< it had been made before
};

/// What came of all of them.
struct InputCounts {
  std::size_t done = 0;     ///< how many went well, without those made before
  std::size_t skipped = 0;  ///< how many had been made before, and well
  std::size_t failed = 0;
  std::uint64_t counted = 0;  ///< the sum
  /// kDone when all went well, otherwise the highest status of those that did not.
  ExitStatus status = kDone;
};

/// How each input is worked through.
struct InputWork {
  std::string verb;           ///< "estimate"
  std::string label;          ///< for a bar, "estimating"
  std::string counted;        ///< name in the JSON of what is summed up, if anything
  bool into_folders = false;  ///< outputs are folders, created when they are filled
  std::string ending;         ///< of files in a folder for all, ".las"; empty: not known
  /// Files that a job writes; without it the output alone.
  std::function<std::vector<std::string>(const InputJob&)> files;
  std::function<InputOutcome(const InputJob&, const Progress&)> run;
  /// What came of a job whose exception is being handled.
  std::function<InputOutcome(const InputJob&)> failed;

  /// Those of `files`, or the output.
  std::vector<std::string> files_of(const InputJob& job) const;
};

/// All of them.
struct InputPlan {
  std::vector<InputJob> jobs;
  /// Whether results are shown as a list. What was asked for decides, not how many inputs matched.
  bool many = false;
  std::string folder;   ///< that all results go to; empty: none, or each into one of its own
  std::string journal;  ///< file that says what was made; empty: none is kept
};

/// Finds the inputs and says where their outputs go.
/// @throws InvalidArgument, FileError, Cancelled
InputPlan plan_inputs(const ManyInputsOptions& options, const InputWork& work,
                      const Progress& progress = {});

/// Settings by name, with their values, as a text that is the same for the same work: names of
/// existing files are replaced by the SHA-256 of what they hold.
/// @param program  that does it, with its version and verb  @throws FileError, Cancelled
std::string work_text(const std::string& program,
                      const std::vector<std::pair<std::string, std::vector<std::string>>>& settings,
                      const Progress& progress = {});

/// Runs all jobs, several at a time. One that fails does not stop the rest. What comes of them
/// waits in a file, so that memory does not grow: in the plan's journal, or in a temporary one.
///
/// The journal has a line per input, written when its result is whole: the work, SHA-256 of the
/// input and of every file of the result, and the outcome. With resume, a result is left as it is
/// where the same work made it from the same bytes and its files still have the bytes that were
/// written; contents decide, not times of files. What could not be read or written may be the
/// machine's fault and is tried again.
class InputRun {
 public:
  /// @param plan, work  must outlive it  @param work_text  see there
  /// @throws FileError where the table or the journal cannot be written, or another run has the
  ///         folder
  InputRun(const InputPlan& plan, const InputWork& work, const std::string& work_text,
           const ManyInputsOptions& options);
  ~InputRun();
  InputRun(const InputRun&) = delete;
  InputRun& operator=(const InputRun&) = delete;

  /// Called when a job has ended, from its thread, one at a time.
  using Ended = std::function<void(std::size_t ended, std::size_t failed)>;
  /// @return false where it was cancelled: what was finished is there all the same
  bool run(const Progress& progress, const Ended& ended = {});

  /// Calls with what came of each input, in their order.
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
