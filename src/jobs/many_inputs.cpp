// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/many_inputs.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/io/folder.hpp"
#include "risley/io/folder_lock.hpp"
#include "risley/io/json_text.hpp"
#include "risley/io/output_file.hpp"
#include "risley/jobs/inputs.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/tables/table_file.hpp"

#include "jobs/stopwatch.hpp"

namespace risley::jobs {
namespace {

namespace fs = std::filesystem;
using Line = nlohmann::ordered_json;

constexpr std::string_view kJournalEnding = ".records.jsonl";

/// Whether as many such inputs as there are threads might not fit into memory at the same time. An
/// estimate of ten minutes with its page takes up to four times the bytes of its file.
bool is_large(const std::string& input) {
  constexpr double kMemoryPerByte = 4.0;
  const double memory =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  double bytes = 0;
  for (const std::string& file : recordings::recording_files(input)) {
    std::error_code code;
    const std::uintmax_t size = fs::file_size(file, code);
    if (!code) bytes += static_cast<double>(size);
  }
  return kMemoryPerByte * bytes * static_cast<double>(parallel::thread_count()) > memory;
}

/// A file beside a result: "clouds/" has "clouds.records.jsonl".
std::string journal_beside(const std::string& result) {
  fs::path path = fs::path(result).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  if (path.empty() || path == "." || path.filename() == ".." || path == path.root_path()) {
    path /= "risley";
  }
  return path.string() + std::string(kJournalEnding);
}

void make_folder_for(const std::string& file) {
  const fs::path folder = fs::path(file).parent_path();
  if (!folder.empty()) io::make_folder(folder.string());
}

std::vector<std::string> hashes_alone(const FileHashes& files) {
  std::vector<std::string> hashes;
  for (const auto& [file, hash] : files) hashes.push_back(hash);
  return hashes;
}

InputResult result_of(const Line& line) {
  InputResult result;
  result.outcome = {static_cast<ExitStatus>(line.at("status").get<int>()), line.at("json").dump(),
                    line.at("text").get<std::string>(), line.at("counted").get<std::uint64_t>()};
  line.at("inputs_sha256").get_to(result.hashes);
  line.at("elapsed_s").get_to(result.elapsed);
  return result;
}

/// The combined progress of all jobs.
class SharedProgress {
 public:
  SharedProgress(std::size_t jobs, const Progress& shown) : fraction_(jobs), shown_(shown) {}

  /// For one of them. Its stages each go from 0 to 1; it never goes back.
  Progress of(std::size_t job) {
    return shown_.with([this, job](double fraction, std::string_view) { reach(job, fraction); });
  }
  void end(std::size_t job, bool sound, const InputRun::Ended& ended) {
    {
      const std::scoped_lock lock(mutex_);
      ++ended_;
      if (!sound) ++failed_;
      if (ended) ended(ended_, failed_);
    }
    reach(job, 1.0);
  }

 private:
  void reach(std::size_t job, double fraction) {
    const std::scoped_lock lock(mutex_);
    const double further = std::clamp(fraction, 0.0, 1.0) - fraction_[job];
    if (further > 0) {
      fraction_[job] += further;
      sum_ += further;
    }
    shown_.report(sum_ / static_cast<double>(fraction_.size()));
  }

  std::mutex mutex_;
  std::vector<double> fraction_;
  double sum_ = 0;
  std::size_t ended_ = 0, failed_ = 0;
  const Progress& shown_;
};

}  // namespace

std::vector<std::string> InputWork::files_of(const InputJob& job) const {
  if (files) return files(job);
  return job.output.empty() ? std::vector<std::string>() : std::vector{job.output};
}

InputPlan plan_inputs(const ManyInputsOptions& options, const InputWork& work,
                      const Progress& progress) {
  const InputNames names{options.names, options.list, {}};
  if (options.names.empty() && options.list.empty()) {
    throw InvalidArgument(
        fmt::format("INPUT is missing: a recording, or {}", name_of(kSetting.list)));
  }
  InputPlan plan;
  plan.many = are_many(names) || !options.table.empty() || options.resume;
  if (!options.table.empty()) tables::TableFile::check_name(options.table);
  if (options.resume && options.output.empty() && options.table.empty()) {
    throw InvalidArgument(fmt::format("{} needs results that stay: give {} or {}",
                                      name_of(kSetting.resume), name_of(kSetting.output),
                                      name_of(kSetting.table)));
  }
  // A single result without more has no folder of its own; with a table alone there is nothing to
  // resume.
  if (plan.many && (!options.output.empty() || options.resume)) {
    plan.journal = journal_beside(options.output.empty() ? options.table : options.output);
  }
  std::vector<std::string> excluded;
  for (const std::string& made : {options.output, options.table}) {
    if (!made.empty()) excluded.push_back(made);
  }
  const bool into_folder = options.into_folder && !options.output.empty();
  if (into_folder && !work.into_folders && work.ending.empty()) {
    throw InvalidArgument(fmt::format("several files need {}, because {} is a folder",
                                      name_of(kSetting.format), name_of(kSetting.output)));
  }
  for (const Input& input : find_inputs({options.names, options.list, excluded}, progress)) {
    plan.jobs.push_back({input.path,
                         into_folder
                             ? (fs::path(options.output) / (input.place + work.ending)).string()
                             : options.output,
                         input.place});
  }
  if (into_folder) {
    if (!work.into_folders) io::make_folder(options.output);
    std::error_code ignored;
    if (plan.many && fs::is_directory(options.output, ignored)) plan.folder = options.output;
  }
  return plan;
}

std::string work_text(const std::string& program,
                      const std::vector<std::pair<std::string, std::vector<std::string>>>& settings,
                      const Progress& progress) {
  std::vector<std::string> lines;
  for (const auto& [name, values] : settings) {
    std::string line = name + "=";
    for (const std::string& value : values) {
      std::string contents;
      for (const std::string& file : files_behind(value)) {
        contents += " sha256:" + hashes::sha256_of_file(file, progress);
      }
      line += " " + (contents.empty() ? value : contents);
    }
    lines.push_back(std::move(line));
  }
  std::sort(lines.begin(), lines.end());
  return fmt::format("{}\n{}\n", program, fmt::join(lines, "\n"));
}

/// Lines of JSON in a growing file, with random access.
class InputRun::Journal {
 public:
  /// @param path  empty: a temporary file @param go_on  append to the existing lines
  Journal(const std::string& path, bool go_on)
      : path_(path.empty() ? fs::temp_directory_path().string() : path),
        file_(nullptr, &std::fclose) {
    if (!path.empty()) require_own_result(path);
    file_.reset(path.empty() ? std::tmpfile() : std::fopen(path.c_str(), go_on ? "a+e" : "w+e"));
    if (!file_) fail();
    if (go_on) find_lines();
    // Terminates a line that a crash cut off.
    write("\n{\"risley\":\"records\"}\n");
  }

  /// Start of the last line of every place, from earlier runs.
  const std::map<std::string, long>& earlier() const { return earlier_; }

  /// @return where it begins
  long add(const Line& line) {
    return write(line.dump(-1, ' ', false, Line::error_handler_t::replace) + "\n");
  }

  Line at(long place) const {
    const std::scoped_lock lock(mutex_);
    if (std::fseek(file_.get(), place, SEEK_SET) != 0) fail();
    std::string text;
    next(text);
    return Line::parse(text);
  }

 private:
  [[noreturn]] void fail() const {
    throw FileError(path_, {}, fmt::format("cannot be written: {}", std::strerror(errno)));
  }

  bool next(std::string& text) const {
    text.clear();
    int c = ::getc_unlocked(file_.get());
    for (; c != EOF && c != '\n'; c = ::getc_unlocked(file_.get())) text += static_cast<char>(c);
    return c != EOF;
  }

  long write(const std::string& text) {
    const std::scoped_lock lock(mutex_);
    if (std::fseek(file_.get(), 0, SEEK_END) != 0 ||
        std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size() ||
        std::fflush(file_.get()) != 0) {
      fail();
    }
    return std::ftell(file_.get()) - static_cast<long>(text.size());
  }

  void find_lines() {
    std::rewind(file_.get());
    std::string text;
    for (long begin = 0; next(text); begin = std::ftell(file_.get())) {
      try {
        io::require_shallow_json(path_, text);
        const Line line = Line::parse(text);
        if (line.contains("place")) earlier_[line.at("place").get<std::string>()] = begin;
      } catch (const Line::exception&) {  // its result is made again
      } catch (const FileError&) {
      }
    }
  }

  std::string path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  mutable std::mutex mutex_;
  std::map<std::string, long> earlier_;
};

InputRun::InputRun(const InputPlan& plan, const InputWork& work, const std::string& work_text,
                   const ManyInputsOptions& options)
    : plan_(plan),
      work_(work),
      resume_(options.resume),
      work_hash_(hashes::sha256(work_text)),
      hashes_(plan.jobs.size()),
      lines_(plan.jobs.size(), -1),
      skipped_(plan.jobs.size()) {
  if (!plan.folder.empty()) lock_.emplace(plan.folder);
  if (!options.table.empty()) const io::OutputFile can_be_written(options.table);
  make_folder_for(plan.journal);
  journal_ = std::make_unique<Journal>(plan.journal, resume_);
}

InputRun::~InputRun() = default;

bool InputRun::run(const Progress& progress, const Ended& ended) {
  SharedProgress shared(plan_.jobs.size(), progress);
  const auto run_one = [&](std::size_t i) {
    const ExitStatus status = run_job(i, shared.of(i));
    shared.end(i, status == kDone, ended);
  };
  std::vector<std::size_t> together, alone;
  for (std::size_t i = 0; i < plan_.jobs.size(); ++i) {
    (is_large(plan_.jobs[i].input) ? alone : together).push_back(i);
  }
  bool whole = true;
  try {
    parallel::for_each_job(together.size(), [&](std::size_t k) { run_one(together[k]); });
    for (const std::size_t i : alone) run_one(i);
  } catch (const Cancelled&) {
    whole = false;
  }
  for_each([this](const InputJob&, const InputResult& result) {
    if (result.outcome.status != kDone) {
      ++counts_.failed;
      counts_.status = std::max(counts_.status, result.outcome.status);
    } else {
      ++(result.skipped ? counts_.skipped : counts_.done);
    }
    counts_.counted += result.outcome.counted;
  });
  return whole;
}

void InputRun::for_each(
    const std::function<void(const InputJob&, const InputResult&)>& call) const {
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    if (lines_[i] < 0) continue;
    InputResult result = result_of(journal_->at(lines_[i]));
    result.skipped = skipped_[i] != 0;
    call(plan_.jobs[i], result);
  }
}

FileHashes InputRun::hashes() const {
  FileHashes all;
  for (const FileHashes& of_one : hashes_) all.insert(all.end(), of_one.begin(), of_one.end());
  return all;
}

ExitStatus InputRun::run_job(std::size_t place, const Progress& progress) {
  const InputJob& job = plan_.jobs[place];
  const Stopwatch watch;
  InputOutcome outcome;
  bool is_made = false;
  try {
    // Before the work: if the file changes meanwhile, the result is recomputed.
    hashes_[place] = input_hashes(job.input, progress.silent());
    if (resume_) {
      if (const std::optional<ExitStatus> before = made_before(place, progress)) return *before;
    }
    if (!work_.into_folders) make_folder_for(job.output);
    outcome = work_.run(job, progress);
    is_made = true;
  } catch (const Cancelled&) {
    throw;
  } catch (...) {
    outcome = work_.failed(job);
  }
  // A file in the place of a failed result is from an earlier run.
  const FileHashes outputs = is_made ? outputs_of(job, progress) : FileHashes();
  lines_[place] = journal_->add({{"place", job.place},
                                 {"work_sha256", work_hash_},
                                 {"inputs_sha256", hashes_alone(hashes_[place])},
                                 {"outputs", outputs},
                                 {"status", static_cast<int>(outcome.status)},
                                 {"json", Line::parse(outcome.json)},
                                 {"text", outcome.text},
                                 {"counted", outcome.counted},
                                 {"elapsed_s", watch.seconds()}});
  return outcome.status;
}

/// Files of a result, named relative to the journal, so that both may be moved.
FileHashes InputRun::outputs_of(const InputJob& job, const Progress& progress) const {
  FileHashes outputs;
  if (plan_.journal.empty()) return outputs;
  const fs::path folder = fs::absolute(plan_.journal).lexically_normal().parent_path();
  for (const std::string& file : work_.files_of(job)) {
    std::error_code ignored;
    if (!fs::is_regular_file(file, ignored)) continue;
    outputs.emplace_back(fs::absolute(file).lexically_normal().lexically_relative(folder).string(),
                         hashes::sha256_of_file(file, progress.silent()));
  }
  return outputs;
}

/// The status of a result that need not be recomputed, which is recorded.
std::optional<ExitStatus> InputRun::made_before(std::size_t place, const Progress& progress) {
  const InputJob& job = plan_.jobs[place];
  const auto found = journal_->earlier().find(job.place);
  if (found == journal_->earlier().end()) return std::nullopt;
  try {
    const Line line = journal_->at(found->second);
    const ExitStatus status = result_of(line).outcome.status;
    if ((status != kDone && status != kNumbersFailed) || line.at("work_sha256") != work_hash_ ||
        line.at("inputs_sha256") != Line(hashes_alone(hashes_[place]))) {
      return std::nullopt;
    }
    const FileHashes outputs = outputs_of(job, progress);
    const auto noted = line.at("outputs").get<FileHashes>();
    // For a successful result, its files and no others.
    if (status == kDone && outputs.size() != noted.size()) return std::nullopt;
    for (const auto& output : noted) {
      if (std::find(outputs.begin(), outputs.end(), output) == outputs.end()) return std::nullopt;
    }
    lines_[place] = found->second;
    skipped_[place] = 1;
    return status;
  } catch (const Line::exception&) {  // made again
  } catch (const FileError&) {
  }
  return std::nullopt;
}

}  // namespace risley::jobs
