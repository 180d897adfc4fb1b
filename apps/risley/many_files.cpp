// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "many_files.hpp"

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <numeric>
#include <string_view>

#include <fmt/format.h>
#include <glob.h>
#include <spdlog/spdlog.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "risley/core/error.hpp"

#include "recording_text.hpp"
#include "result_folder.hpp"

namespace risley::app {
namespace {

namespace fs = std::filesystem;

bool is_pattern(const std::string& name) {
  std::error_code ignored;
  return name.find_first_of("*?[") != std::string::npos && !fs::exists(name, ignored);
}

std::vector<std::string> files_of(const std::string& pattern) {
  glob_t found{};
  std::vector<std::string> names;
  if (::glob(pattern.c_str(), GLOB_MARK, nullptr, &found) == 0) {
    for (std::size_t i = 0; i < found.gl_pathc; ++i) {
      std::string name = found.gl_pathv[i];
      if (name.ends_with('/')) {  // a folder: only one of ROS 2
        std::error_code ignored;
        if (!fs::exists(fs::path(name) / "metadata.yaml", ignored)) continue;
        name.pop_back();
      }
      names.push_back(std::move(name));
    }
  }
  ::globfree(&found);
  if (names.empty()) throw InvalidArgument(fmt::format("{}: no file has such a name", pattern));
  return names;
}

/// Name of a file without its ending, or of a folder.
std::string bare_name(const std::string& name) {
  fs::path path(name);
  if (!path.has_filename()) path = path.parent_path();
  std::error_code ignored;
  return (fs::is_directory(path, ignored) ? path.filename() : path.stem()).string();
}

/// The progress of all jobs together.
class SharedProgress {
 public:
  SharedProgress(std::size_t jobs, Progress shown) : fraction_(jobs), shown_(std::move(shown)) {}

  Progress of(std::size_t job) {
    return shown_.with([this, job](double fraction, std::string_view) {
      const std::scoped_lock lock(mutex_);
      fraction_[job] = fraction;
      shown_.report(std::accumulate(fraction_.begin(), fraction_.end(), 0.0) /
                    static_cast<double>(fraction_.size()));
    });
  }

 private:
  std::mutex mutex_;
  std::vector<double> fraction_;
  Progress shown_;
};

FileOutcome failed(const FileJob& job, const Failure& failure) {
  Json json = {{"input", job.input},
               {"status", static_cast<int>(failure.status)},
               {"message", failure.message}};
  if (failure.details.is_object()) json.update(failure.details);
  return {failure.status, json, fmt::format("{}: failed: {}", job.input, failure.message)};
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

}  // namespace

bool output_is_folder(const std::vector<std::string>& inputs, const std::string& output) {
  std::error_code ignored;
  return inputs.size() > 1 || output.ends_with('/') || fs::is_directory(output, ignored) ||
         std::any_of(inputs.begin(), inputs.end(), is_pattern);
}

std::vector<FileJob> file_jobs(const std::vector<std::string>& inputs, const std::string& output,
                               const std::string& ending) {
  if (!output_is_folder(inputs, output)) return {{inputs.front(), output}};
  std::vector<FileJob> jobs;
  for (const std::string& input : inputs) {
    for (const std::string& name : is_pattern(input) ? files_of(input) : std::vector{input}) {
      const fs::path made = fs::path(output) / (bare_name(name) + ending);
      for (const FileJob& other : jobs) {
        if (other.output == made.string()) {
          throw InvalidArgument(fmt::format("{} and {} would both be written to {}", other.input,
                                            name, made.string()));
        }
      }
      jobs.push_back({name, made.string()});
    }
  }
  make_result_folder(output);
  return jobs;
}

ExitStatus run_file_jobs(const std::vector<FileJob>& jobs, const std::string& label,
                         const char* counted,
                         const std::function<FileOutcome(const FileJob&, const Progress&)>& work,
                         const CommonOptions& common) {
  CommonOptions told = common;  // patterns are names by now
  told.inputs.clear();
  for (const FileJob& job : jobs) add_files(job.input, told.inputs);
  std::vector<std::string> outputs;
  outputs.reserve(jobs.size());
  for (const FileJob& job : jobs) outputs.push_back(job.output);
  require_apart(told, outputs);
  if (jobs.size() == 1) {
    FileOutcome outcome;
    {
      ProgressBar bar(label, common);
      outcome = work(jobs.front(), bar.progress());
    }
    common.json ? print_json(told, outcome.json) : say("{}\n", outcome.text);
    return outcome.status;
  }
  std::vector<FileOutcome> outcomes(jobs.size());
  {
    ProgressBar bar(label, common);
    SharedProgress progress(jobs.size(), bar.progress());
    const auto run_one = [&](std::size_t i) {
      try {
        // A thread that waits within one file must not begin another.
        tbb::this_task_arena::isolate([&] { outcomes[i] = work(jobs[i], progress.of(i)); });
      } catch (const Cancelled&) {
        throw;
      } catch (...) {
        outcomes[i] = failed(jobs[i], current_failure());
      }
    };
    tbb::parallel_for(std::size_t{0}, jobs.size(), run_one, tbb::simple_partitioner());
  }
  ExitStatus status = kDone;
  std::size_t sound = 0;
  std::uint64_t total = 0;
  Json results = Json::array();
  for (const FileOutcome& outcome : outcomes) {
    if (outcome.status == kDone) {
      ++sound;
    } else {
      status = std::max(status, outcome.status);
    }
    total += outcome.json.value(counted, std::uint64_t{0});
    results.push_back(of_several(outcome));
  }
  if (common.json) {
    print_json(told, {{counted, total},
                      {"done", sound},
                      {"failed", jobs.size() - sound},
                      {"skipped", 0},
                      {"results", results}});
  } else {
    for (const FileOutcome& outcome : outcomes) say("{}\n", outcome.text);
    say("{} of {} files done, {} {} in all\n", sound, jobs.size(), grouped(total), counted);
  }
  for (const FileOutcome& outcome : outcomes) {
    if (outcome.status != kDone) spdlog::error(outcome.text);
  }
  return status;
}

}  // namespace risley::app
