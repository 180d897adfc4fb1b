// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "many_files.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "risley/core/error.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/io/folder.hpp"
#include "risley/io/folder_lock.hpp"
#include "risley/io/output_file.hpp"
#include "risley/jobs/inputs.hpp"
#include "risley/jobs/result_record.hpp"
#include "risley/json/result_columns.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/tables/table_file.hpp"

#include "recording_text.hpp"
#include "result_folder.hpp"

namespace risley::app {
namespace {

namespace fs = std::filesystem;

/// Options that change where and how results are told, not what they are.
constexpr std::array<std::string_view, 10> kOfTelling = {
    "INPUT",  "--list",    "--output", "--table",   "--resume",
    "--json", "--threads", "--quiet",  "--verbose", "--help"};

/// What came of one input, as it waits in the spool and stands in a record.
struct Finished {
  FileOutcome outcome;
  std::vector<std::string> hashes;  ///< SHA-256 of the input's files
  double elapsed = 0;               ///< s
  bool skipped = false;             ///< it had been made before

  Json to_json() const {
    return {{"json", outcome.json},
            {"text", outcome.text},
            {"status", static_cast<int>(outcome.status)},
            {"sha256", hashes},
            {"elapsed_s", elapsed},
            {"skipped", skipped}};
  }
  static Finished from_json(const Json& json) {
    Finished found;
    found.outcome = {static_cast<ExitStatus>(json.at("status").get<int>()), json.at("json"),
                     json.at("text").get<std::string>()};
    json.at("sha256").get_to(found.hashes);
    json.at("elapsed_s").get_to(found.elapsed);
    json.at("skipped").get_to(found.skipped);
    return found;
  }
};

/// Outcomes in a temporary file, in any order, to be read in that of the inputs.
class Spool {
 public:
  explicit Spool(std::size_t jobs) : at_(jobs, -1), file_(std::tmpfile(), &std::fclose) {
    if (!file_) fail();
  }

  void add(std::size_t job, const Finished& finished) {
    const std::string line =
        finished.to_json().dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
    const std::scoped_lock lock(mutex_);
    if (std::fseek(file_.get(), 0, SEEK_END) != 0) fail();
    at_[job] = std::ftell(file_.get());
    if (std::fwrite(line.data(), 1, line.size(), file_.get()) != line.size()) fail();
  }

  /// Calls with each outcome that there is.
  template <class Call>
  void for_each(const Call& call) const {
    if (std::fflush(file_.get()) != 0) fail();
    std::string line;
    for (const long place : at_) {
      if (place < 0) continue;
      if (std::fseek(file_.get(), place, SEEK_SET) != 0) fail();
      line.clear();
      for (int c = ::getc_unlocked(file_.get()); c != EOF && c != '\n';
           c = ::getc_unlocked(file_.get())) {
        line += static_cast<char>(c);
      }
      call(Finished::from_json(Json::parse(line)));
    }
  }

 private:
  [[noreturn]] static void fail() {
    throw FileError(
        fs::temp_directory_path().string(), {},
        fmt::format("no temporary file can be written there: {}", std::strerror(errno)));
  }

  std::vector<long> at_;  ///< where the lines begin
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  std::mutex mutex_;
};

/// The progress of all jobs together.
class SharedProgress {
 public:
  SharedProgress(std::size_t jobs, ProgressBar& bar)
      : fraction_(jobs), bar_(bar), shown_(bar.progress()) {}

  /// For one of them. Its stages each go from 0 to 1; what it has reached once stays reached.
  Progress of(std::size_t job) {
    return shown_.with([this, job](double fraction, std::string_view) { reach(job, fraction); });
  }
  void finish(std::size_t job, bool sound) {
    {
      const std::scoped_lock lock(mutex_);
      ++finished_;
      if (!sound) ++failed_;
      bar_.note(fmt::format("{} of {}{}", finished_, fraction_.size(),
                            failed_ > 0 ? fmt::format(", {} failed", failed_) : ""));
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
  std::size_t finished_ = 0, failed_ = 0;
  ProgressBar& bar_;
  Progress shown_;
};

FileOutcome failed(const FileJob& job, const Failure& failure, const CommonOptions& common) {
  Json json = {{"input", job.input},
               {"status", static_cast<int>(failure.status)},
               {"message", failure.message}};
  if (failure.details.is_object()) json.update(failure.details);
  if (common.verb == "estimate" || common.verb == "calibrate") {
    json.update(undecided(failure.message));
  }
  std::string_view words = failure.message;
  if (words.starts_with(job.input + ": ")) words.remove_prefix(job.input.size() + 2);
  return {failure.status, json, fmt::format("{}: failed: {}", job.input, words)};
}

/// An outcome beside others: "status" and "message" stand where an object of its own has "error".
Json of_several(const FileOutcome& outcome) {
  Json json = outcome.json;
  json["status"] = static_cast<int>(outcome.status);
  if (!json.contains("message")) json["message"] = json.value("error", "");
  json.erase("error");
  json.erase("exit_status");
  return json;
}

/// All that decides results apart from the inputs, as text; files that options name count by their
/// bytes.
std::string work_text(const CLI::App& verb, const CommonOptions& common) {
  std::vector<std::string> lines;
  for (const CLI::Option* option : verb.get_options()) {
    const std::string name = option->get_name();
    if (std::find(kOfTelling.begin(), kOfTelling.end(), name) != kOfTelling.end()) continue;
    std::vector<std::string> values = option->results();
    if (values.empty() && !option->get_default_str().empty()) {
      values.push_back(option->get_default_str());
    }
    if (values.empty()) continue;
    for (std::string& value : values) {
      std::string contents;
      for (const std::string& file : jobs::files_behind(value)) {
        contents += " sha256:" + hashes::sha256_of_file(file, cancellable());
      }
      if (!contents.empty()) value = contents;
    }
    lines.push_back(fmt::format("{}={}", name, fmt::join(values, " ")));
  }
  std::sort(lines.begin(), lines.end());
  return fmt::format("risley {} {}\n{}\n", RISLEY_VERSION, common.verb, fmt::join(lines, "\n"));
}

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

/// Whether the same would come of the same bytes again. What could not be read or written may be
/// the machine's fault, and is quickly found out again.
bool is_of_input(const FileOutcome& outcome) {
  return outcome.status == kDone || outcome.status == kNumbersFailed;
}

std::vector<std::string> files_of(const FileWork& work, const FileJob& job) {
  if (work.files) return work.files(job);
  return job.output.empty() ? std::vector<std::string>() : std::vector{job.output};
}

/// All jobs of one command.
class Runner {
 public:
  Runner(const FileJobs& jobs, const FileWork& work, const ManyWishes& wishes, const CLI::App& verb,
         const CommonOptions& common)
      : jobs_(jobs.jobs),
        records_(jobs.records),
        work_(work),
        wishes_(wishes),
        common_(common),
        hashes_(jobs_.size()),
        spool_(jobs_.size()) {
    if (!records_.empty()) work_text_ = work_text(verb, common);
    if (!jobs.folder.empty()) lock_.emplace(jobs.folder);
    if (!wishes.table.empty()) const io::OutputFile can_be_written(wishes.table);
  }

  ExitStatus run(const CommonOptions& told) {
    const bool interrupted = !run_all();
    if (!wishes_.table.empty()) write_table();
    count();
    if (interrupted) {
      spdlog::warn("{}; {}", summary(),
                   records_.empty() ? "what is not done has to be done again"
                                    : "the same command with --resume does the rest");
      throw Cancelled();
    }
    told.json ? print_object(told) : print_lines();
    spool_.for_each([](const Finished& one) {
      if (one.outcome.status != kDone) spdlog::error(one.outcome.text);
    });
    return status_;
  }

 private:
  /// @return whether all were run
  bool run_all() {
    ProgressBar bar(work_.label, common_);
    SharedProgress progress(jobs_.size(), bar);
    const auto run_one = [&](std::size_t i) {
      Finished finished;
      const double started = now();
      try {
        finished = outcome_of(i, progress.of(i));
      } catch (const Cancelled&) {
        throw;
      } catch (...) {
        finished.outcome = failed(jobs_[i], current_failure(), common_);
        for (const auto& [file, hash] : hashes_[i]) finished.hashes.push_back(hash);
        finished.elapsed = now() - started;
      }
      spool_.add(i, finished);
      progress.finish(i, finished.outcome.status == kDone);
    };
    std::vector<std::size_t> together, alone;
    for (std::size_t i = 0; i < jobs_.size(); ++i) {
      (is_large(jobs_[i].input) ? alone : together).push_back(i);
    }
    try {
      parallel::for_each_job(together.size(), [&](std::size_t k) { run_one(together[k]); });
      for (const std::size_t i : alone) run_one(i);
    } catch (const Cancelled&) {
      return false;
    }
    return true;
  }

  Finished outcome_of(std::size_t i, const Progress& progress) {
    const FileJob& job = jobs_[i];
    const double started = now();
    // Before the work: if the file changes meanwhile, the result is made again.
    hashes_[i] = jobs::input_hashes(job.input, progress.silent());
    Finished finished;
    for (const auto& [file, hash] : hashes_[i]) finished.hashes.push_back(hash);
    if (wishes_.resume) {
      if (std::optional<Finished> before = made_before(job, finished.hashes, progress)) {
        return *std::move(before);
      }
    }
    bool is_made = false;
    try {
      make_folder_of(job);
      finished.outcome = work_.run(job, progress);
      is_made = true;
    } catch (const Cancelled&) {
      throw;
    } catch (...) {
      finished.outcome = failed(job, current_failure(), common_);
    }
    finished.elapsed = now() - started;
    if (!records_.empty() && is_of_input(finished.outcome)) {
      // What stands where a failed result would be is of an earlier run.
      keep(job, finished, is_made ? files_of(work_, job) : std::vector<std::string>(), progress);
    }
    return finished;
  }

  std::string record_of(const FileJob& job) const {
    return (fs::path(records_) / (job.place + ".json")).string();
  }

  /// Results are named by their place beside the folder of records, so that both may be moved.
  std::string beside_records(const std::string& file) const {
    return fs::absolute(file)
        .lexically_relative(fs::absolute(records_).lexically_normal())
        .string();
  }

  static std::string absolute_name(const std::string& file) {
    return fs::absolute(file).lexically_normal().string();
  }
  static std::set<std::string> names_of(
      const std::vector<std::pair<std::string, std::string>>& files) {
    std::set<std::string> names;
    for (const auto& [file, hash] : files) names.insert(absolute_name(file));
    return names;
  }

  std::optional<Finished> made_before(const FileJob& job, const std::vector<std::string>& hashes,
                                      const Progress& progress) const {
    std::optional<jobs::ResultRecord> record = jobs::load_record(record_of(job));
    if (!record) return std::nullopt;
    for (auto& [file, hash] : record->outputs) {
      file = (fs::absolute(records_) / file).lexically_normal().string();
    }
    if (!jobs::is_whole(*record, work_text_, hashes, progress.silent())) return std::nullopt;
    try {
      Finished finished = Finished::from_json(Json::parse(record->outcome));
      // Files of a result that stand there have to be those of the record.
      const std::set<std::string> known = names_of(record->outputs);
      for (const std::string& file : files_of(work_, job)) {
        std::error_code ignored;
        if (finished.outcome.status == kDone && fs::exists(file, ignored) &&
            !known.contains(absolute_name(file))) {
          return std::nullopt;
        }
      }
      Json& json = finished.outcome.json;
      json["input"] = job.input;
      if (json.contains("output") && !job.output.empty()) json["output"] = job.output;
      finished.skipped = true;
      return finished;
    } catch (const Json::exception&) {  // made again
      return std::nullopt;
    }
  }

  void keep(const FileJob& job, const Finished& finished, const std::vector<std::string>& files,
            const Progress& progress) const {
    jobs::ResultRecord record{work_text_, finished.hashes, {}, {}};
    record.outputs = jobs::hashes_of(files, progress.silent());
    for (auto& [file, hash] : record.outputs) file = beside_records(file);
    record.outcome = finished.to_json().dump(-1, ' ', false, Json::error_handler_t::replace);
    jobs::save_record(record_of(job), record);
  }

  void make_folder_of(const FileJob& job) const {
    if (work_.into_folders || job.output.empty()) return;
    const fs::path folder = fs::path(job.output).parent_path();
    if (!folder.empty()) io::make_folder(folder.string());
  }

  void write_table() const {
    json::ResultColumns columns;
    spool_.for_each([&](const Finished& one) { columns.note(row_of(one)); });
    tables::TableFile table(wishes_.table, columns.columns(),
                            {{"title", fmt::format("risley {}, one row per input", common_.verb)},
                             {"command", common_.command},
                             {"version", RISLEY_VERSION},
                             {"source", "risley " RISLEY_VERSION}});
    spool_.for_each([&](const Finished& one) { table.add(columns.cells(row_of(one))); });
    table.close();
  }

  static Json row_of(const Finished& finished) {
    Json row = of_several(finished.outcome);
    if (!finished.hashes.empty())
      row["sha256"] = fmt::format("{}", fmt::join(finished.hashes, " "));
    row["elapsed_s"] = finished.elapsed;
    row["version"] = RISLEY_VERSION;
    return row;
  }

  void count() {
    spool_.for_each([&](const Finished& one) {
      if (one.outcome.status != kDone) {
        ++failed_;
        status_ = std::max(status_, one.outcome.status);
      } else if (one.skipped) {
        ++skipped_;
      } else {
        ++done_;
      }
      if (work_.counted != nullptr) {
        total_ += one.outcome.json.value(work_.counted, std::uint64_t{0});
      }
    });
  }

  std::string summary() const {
    std::string text = fmt::format("{} of {} files done", done_, jobs_.size());
    if (skipped_ > 0) text += fmt::format(", {} done before", skipped_);
    if (failed_ > 0) text += fmt::format(", {} failed", failed_);
    if (work_.counted != nullptr)
      text += fmt::format(", {} {} in all", grouped(total_), work_.counted);
    return text;
  }

  void print_lines() const {
    spool_.for_each([](const Finished& one) {
      say("{}{}\n", one.outcome.text, one.skipped ? " (done before)" : "");
    });
    say("{}\n", summary());
    if (!wishes_.table.empty()) say("table: {}\n", wishes_.table);
  }

  /// The object of print_json(), its results one after the other.
  void print_object(const CommonOptions& told) const {
    jobs::Provenance known;
    for (const auto& of_one : hashes_) {
      for (const auto& [file, hash] : of_one) {
        const std::string name = fmt::format("input_{}", known.size());
        known.emplace_back(name, file);
        known.emplace_back(name + "_sha256", hash);
      }
    }
    Json object = Json::object();
    if (work_.counted != nullptr) object[work_.counted] = total_;
    object.update({{"done", done_}, {"failed", failed_}, {"skipped", skipped_}});
    if (!wishes_.table.empty()) object["table"] = wishes_.table;
    object["results"] = Json::array();
    const auto dumped = [](const Json& json) {
      return json.dump(2, ' ', false, Json::error_handler_t::replace);
    };
    constexpr std::string_view kEnd = "[]\n}";
    const std::string head = dumped(with_head(told, object, known));
    print_text(std::string_view(head).substr(0, head.size() - kEnd.size()));
    std::string_view before = "[\n    ";
    spool_.for_each([&](const Finished& one) {
      Json result = of_several(one.outcome);
      if (one.skipped) result["skipped"] = true;
      std::string text(before);
      for (const char c : dumped(result)) {
        text += c;
        if (c == '\n') text += "    ";
      }
      print_text(text);
      before = ",\n    ";
    });
    print_text("\n  ]\n}\n");
  }

  const std::vector<FileJob>& jobs_;
  const std::string& records_;
  const FileWork& work_;
  const ManyWishes& wishes_;
  const CommonOptions& common_;
  std::string work_text_;
  std::vector<std::vector<std::pair<std::string, std::string>>>
      hashes_;  ///< of every input's files
  Spool spool_;
  std::optional<io::FolderLock> lock_;  ///< of the folder for all results
  std::size_t done_ = 0, failed_ = 0, skipped_ = 0;
  std::uint64_t total_ = 0;
  ExitStatus status_ = kDone;
};

/// A folder beside a result: "clouds/" has "clouds.records".
std::string records_beside(const std::string& result) {
  fs::path path = fs::path(result).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  if (path.empty() || path == "." || path.filename() == ".." || path == path.root_path()) {
    return (path / "risley.records").string();
  }
  return path.string() + ".records";
}

}  // namespace

FileOutcome judged_outcome(const FileJob& file, Json json, const std::string& reason,
                           const std::string& words) {
  const bool converged = json.at("converged").get<bool>();
  json["input"] = file.input;
  if (!file.output.empty()) json["output"] = file.output;
  json["message"] = reason;
  std::string text =
      fmt::format("{}: {}", file.input, json.at("verdict").at("code").get<std::string>());
  if (!converged) text += fmt::format(", not converged: {}", reason);
  text += "; " + words;
  return {converged ? kDone : kNumbersFailed, std::move(json), std::move(text)};
}

CLI::Option* add_many_options(CLI::App& verb, ManyWishes& wishes, const std::string& what) {
  auto* inputs = verb.add_option(
      "INPUT", wishes.inputs,
      what +
          "; folders, for all recordings in and below them; quoted patterns such as '*.lvx' or "
          "'survey/**/*.lvx' (** is any number of folders)");
  verb.add_option("--list", wishes.list,
                  "Text file with further inputs, one a line; lines that begin with # do not count")
      ->type_name("FILE");
  verb.add_option(
          "--table", wishes.table,
          "Table to write with one row per input; the ending chooses the format: .csv or .nc "
          "(NetCDF)")
      ->type_name("FILE");
  verb.add_flag(
      "--resume", wishes.resume,
      "Skip inputs whose results are whole and were made from the same bytes with the same "
      "options and version");
  return inputs;
}

bool are_several(const ManyWishes& wishes) {
  return jobs::are_many({wishes.inputs, wishes.list, {}});
}

bool output_is_folder(const ManyWishes& wishes, const std::string& output) {
  std::error_code ignored;
  return are_several(wishes) || output.ends_with('/') || fs::is_directory(output, ignored);
}

FileJobs file_jobs(const ManyWishes& wishes, const std::string& output, bool into_folder,
                   const std::string& ending) {
  if (wishes.inputs.empty() && wishes.list.empty()) {
    throw InvalidArgument("INPUT is missing: a recording, or --list");
  }
  FileJobs result;
  result.many = are_several(wishes) || !wishes.table.empty() || wishes.resume;
  if (!wishes.table.empty()) tables::TableFile::check_name(wishes.table);
  if (wishes.resume && output.empty() && wishes.table.empty()) {
    throw InvalidArgument("--resume needs results that stay: give --output or --table");
  }
  // Results of one input without more have always stood alone; a table alone has nothing to resume.
  if (result.many && (!output.empty() || wishes.resume)) {
    result.records = records_beside(output.empty() ? wishes.table : output);
  }
  std::vector<std::string> excluded;
  for (const std::string& made : {output, result.records, wishes.table}) {
    if (!made.empty()) excluded.push_back(made);
  }
  for (const jobs::Input& input :
       jobs::find_inputs({wishes.inputs, wishes.list, excluded}, cancellable())) {
    const std::string made = into_folder && !output.empty()
                                 ? (fs::path(output) / (input.place + ending)).string()
                                 : output;
    result.jobs.push_back({input.path, made, input.place});
  }
  if (into_folder && !output.empty()) {
    if (!ending.empty()) io::make_folder(output);
    std::error_code ignored;
    if (result.many && fs::is_directory(output, ignored)) result.folder = output;
  }
  return result;
}

ExitStatus run_file_jobs(const FileJobs& jobs, const FileWork& work, const ManyWishes& wishes,
                         const CLI::App& verb, const CommonOptions& common) {
  CommonOptions told = common;  // patterns are names by now
  told.inputs.clear();
  std::vector<std::string> outputs = {wishes.table};
  for (const FileJob& job : jobs.jobs) {
    add_files(job.input, told.inputs);
    const std::vector<std::string> files = files_of(work, job);
    outputs.insert(outputs.end(), files.begin(), files.end());
  }
  if (!wishes.list.empty()) told.files.push_back(wishes.list);
  require_apart(told, outputs);
  if (!jobs.many) {
    FileOutcome outcome;
    {
      ProgressBar bar(work.label, common);
      outcome = work.run(jobs.jobs.front(), bar.progress());
    }
    common.json ? print_json(told, outcome.json) : say("{}\n", outcome.text);
    return outcome.status;
  }
  return Runner(jobs, work, wishes, verb, common).run(told);
}

}  // namespace risley::app
