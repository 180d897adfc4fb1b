// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "many_files.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/jobs/inputs.hpp"

namespace risley::app {
namespace {

using jobs::InputJob;
using jobs::InputResult;
using jobs::InputRun;

/// Options that affect where and how results are printed, not the results.
constexpr std::array<std::string_view, 12> kOfPrinting = {
    "INPUT",     "--list",  "--output",      "--table",   "--resume", "--json",
    "--threads", "--quiet", "--no-progress", "--verbose", "--help",   "--help-all"};

/// Everything that determines results apart from the inputs.
std::string settings_text(const CLI::App& verb, const CommonOptions& common) {
  std::vector<std::pair<std::string, std::vector<std::string>>> settings;
  for (const CLI::Option* option : verb.get_options()) {
    const std::string name = option->get_name();
    if (std::find(kOfPrinting.begin(), kOfPrinting.end(), name) != kOfPrinting.end()) continue;
    std::vector<std::string> values = option->results();
    if (values.empty()) values.push_back(option->get_default_str());
    if (!values.front().empty()) settings.emplace_back(name, std::move(values));
  }
  return jobs::work_text(fmt::format("risley {} {}", RISLEY_VERSION, common.verb), settings,
                         cancellable());
}

std::string summary(const InputRun& run, const jobs::InputPlan& plan, const jobs::InputWork& work) {
  const auto& [done, skipped, failed, counted, status] = run.counts();
  std::string text = fmt::format("{} of {} files done", done, plan.jobs.size());
  if (skipped > 0) text += fmt::format(", {} done before", skipped);
  if (failed > 0) text += fmt::format(", {} failed", failed);
  if (!work.counted.empty()) text += fmt::format(", {} {} in all", grouped(counted), work.counted);
  return text;
}

/// The object of print_json(), its results one after the other.
void print_object(const InputRun& run, const jobs::InputWork& work, const std::string& table,
                  const CommonOptions& typed) {
  jobs::Provenance known;
  for (const auto& [file, hash] : run.hashes()) {
    const std::string name = fmt::format("input_{}", known.size());
    known.emplace_back(name, file);
    known.emplace_back(name + "_sha256", hash);
  }
  Json object = json::counts_of(run, work);
  if (!table.empty()) object["table"] = table;
  object["results"] = Json::array();
  const auto dumped = [](const Json& json) {
    return json.dump(2, ' ', false, Json::error_handler_t::replace);
  };
  constexpr std::string_view kEnd = "[]\n}";
  const std::string head = dumped(with_head(typed, object, known));
  print_text(std::string_view(head).substr(0, head.size() - kEnd.size()));
  std::string_view before = "[\n    ";
  run.for_each([&](const InputJob& job, const InputResult& result) {
    std::string text(before);
    for (const char c : dumped(json::one_of_several(job, result))) {
      text += c;
      if (c == '\n') text += "    ";
    }
    print_text(text);
    before = ",\n    ";
  });
  print_text("\n  ]\n}\n");
}

ExitStatus run_several(const jobs::InputPlan& plan, const jobs::InputWork& work,
                       const jobs::ManyInputsOptions& wishes, const CLI::App& verb,
                       const CommonOptions& typed) {
  InputRun run(plan, work, plan.journal.empty() ? "" : settings_text(verb, typed), wishes);
  const bool whole = [&] {
    ProgressBar bar(work.label, typed);
    return run.run(bar.progress(), [&](std::size_t ended, std::size_t failed) {
      bar.note(fmt::format("{} of {}{}", ended, plan.jobs.size(),
                           failed > 0 ? fmt::format(", {} failed", failed) : ""));
    });
  }();
  if (!wishes.table.empty()) {
    json::write_table(wishes.table, run,
                      {{"title", fmt::format("risley {}, one row per input", typed.verb)},
                       {"command", typed.command},
                       {"version", RISLEY_VERSION},
                       {"source", "risley " RISLEY_VERSION}});
  }
  if (!whole) {
    spdlog::warn("{}; {}", summary(run, plan, work),
                 plan.journal.empty() ? "unfinished inputs have to be processed again"
                                      : "the same command with --resume continues");
    throw Cancelled();
  }
  if (typed.json) {
    print_object(run, work, wishes.table, typed);
  } else {
    run.for_each([](const InputJob&, const InputResult& result) {
      say("{}{}\n", result.outcome.text, result.skipped ? " (done before)" : "");
    });
    say("{}\n", summary(run, plan, work));
    if (!wishes.table.empty()) say("table: {}\n", wishes.table);
  }
  run.for_each([](const InputJob&, const InputResult& result) {
    if (result.outcome.status != kDone) spdlog::error(result.outcome.text);
  });
  return run.counts().status;
}

}  // namespace

CLI::Option* add_many_options(CLI::App& verb, jobs::ManyInputsOptions& wishes,
                              const std::string& what) {
  auto* inputs = verb.add_option(
      "INPUT", wishes.names,
      what +
          "; folders, for all recordings in and below them; quoted patterns such as '*.lvx' or "
          "'survey/**/*.lvx' (** is any number of folders)");
  verb.add_option(
          "--list", wishes.list,
          "Text file with further inputs, one per line; lines that begin with # are ignored")
      ->type_name("FILE");
  verb.add_option("--table", wishes.table,
                  "Table to write, one row per input, as .csv or .nc (NetCDF)")
      ->type_name("FILE");
  verb.add_flag(
      "--resume", wishes.resume,
      "Skip inputs whose results are complete and come from the same bytes, options and version");
  return inputs;
}

bool are_several(const jobs::ManyInputsOptions& wishes) {
  return jobs::are_many({wishes.names, wishes.list, {}});
}

bool output_is_folder(const jobs::ManyInputsOptions& wishes) {
  std::error_code ignored;
  if (!are_several(wishes) && wishes.output.ends_with(".db3")) return false;  // a folder, and a bag
  return are_several(wishes) || wishes.output.ends_with('/') ||
         std::filesystem::is_directory(wishes.output, ignored);
}

CommonOptions with_recordings_found(jobs::ManyInputsOptions& wishes, CommonOptions common) {
  std::vector<std::string> found;
  const auto add = [&found](const jobs::InputNames& names) {
    for (jobs::Input& input : jobs::find_inputs(names, cancellable())) {
      found.push_back(std::move(input.path));
    }
  };
  for (const std::string& name : wishes.names) {
    jobs::are_many({{name}, "", {}}) ? add({{name}, "", {}}) : found.push_back(name);
  }
  if (!wishes.list.empty()) {
    add({{}, wishes.list, {}});
    common.files.push_back(wishes.list);
  }
  if (found == wishes.names) return common;
  wishes.names = std::move(found);
  common.inputs.clear();
  for (const std::string& name : wishes.names) add_files(name, common.inputs);
  return common;
}

void log_words(const std::string& words, bool is_wrong) {
  is_wrong ? spdlog::error(words) : spdlog::warn(words);
}

ExitStatus run_inputs(const jobs::InputPlan& plan, const jobs::InputWork& work,
                      const jobs::ManyInputsOptions& wishes, const CLI::App& verb,
                      const CommonOptions& common) {
  CommonOptions typed = common;  // patterns are names by now
  typed.inputs.clear();
  std::vector<std::string> outputs = {wishes.table};
  for (const InputJob& job : plan.jobs) {
    add_files(job.input, typed.inputs);
    const std::vector<std::string> files = work.files_of(job);
    outputs.insert(outputs.end(), files.begin(), files.end());
  }
  if (!wishes.list.empty()) typed.files.push_back(wishes.list);
  require_apart(typed, outputs);
  if (plan.many) return run_several(plan, work, wishes, verb, typed);
  jobs::InputOutcome outcome;
  {
    ProgressBar bar(work.label, common);
    outcome = work.run(plan.jobs.front(), bar.progress());
  }
  common.json ? print_json(typed, Json::parse(outcome.json)) : say("{}\n", outcome.text);
  return outcome.status;
}

}  // namespace risley::app
