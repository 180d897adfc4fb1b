// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "command_line.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <sstream>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/text.hpp"
#include "risley/jobs/result_files.hpp"

#include "help_text.hpp"

namespace risley::app {
namespace {

/// Common options that affect a verb, and are therefore shown; all verbs accept them.
enum Uses : unsigned { kNothing = 0, kThreads = 1, kSeed = 2 };

struct Verb {
  const char* name;
  const char* group;
  const char* description;
  const char* examples;
  const char* usual;  ///< options that --help shows without --help-all
  unsigned uses;
  Run (*declare)(CLI::App& verb);
};

constexpr const char* kLook = "Look";
constexpr const char* kCalibrate = "Calibrate";
constexpr const char* kPoints = "Make points";
constexpr const char* kSimulate = "Simulate";

constexpr Verb kVerbs[] = {
    {"info", kLook, "Show the contents of a recording, and check its times",
     "  risley info recording.lvx\n  risley info recording.lvx --json\n"
     "  risley info recording.lvx --share excerpt.nc",
     "--device --share --share-ranges --table", kThreads, declare_info},
    {"convert", kLook,
     "Convert a recording or trajectory to the format given by the output's ending",
     "  risley convert recording.lvx -o recording.csv\n"
     "  risley convert 'survey/*.lvx' --format netcdf -o converted/",
     "--output --device", kThreads, declare_convert},
    {"record", kLook, "Record Livox sensors from the network",
     "  risley record -o hall.lvx --interface 192.168.1.5 --duration-s 30\n"
     "  risley record --list",
     "--output --interface --list --duration-s --serial --passive --watch --optics", kNothing,
     declare_record},
    {"emulate", kLook, "Emulate a sensor on the network, with any faults you choose",
     "  risley emulate --interface 127.0.0.5 --sensor avia --duration-s 60\n"
     "  risley emulate --interface 127.0.0.5 --loss 0.01 --speed 10\n"
     "  risley emulate --interface 127.0.0.7 --sensor mid-360",
     "--interface --sensor --serial --scene --recording --duration-s --speed --set --seed", kSeed,
     declare_emulate},
    {"report", kLook,
     "Draw the page of a result folder again from its report.json, or compare two results on one",
     "  risley report result/\n  risley report result/ -o sensor-17.html\n"
     "  risley report result/ calibration/ -o both.html",
     "--output", kNothing, declare_report},
    {"estimate", kCalibrate,
     "Estimate the sensor's parameters and rotation angles from a recording",
     "  risley estimate recording.lvx -o result/\n"
     "  risley estimate unit.csv --truth unit.csv.truth.yaml --json",
     "--output --sensor --method --rate-hz --noise-angle-deg --fix --free --truth --table",
     kThreads, declare_estimate},
    {"calibrate", kCalibrate, "Calibrate the sensor on scans of plane walls or on a flight",
     "  risley calibrate wall.lvx -o calibration/\n"
     "  risley calibrate upright.lvx flipped.lvx --stations stations.yaml -o calibration/\n"
     "  risley calibrate --plan hall.yaml --duration-s 30",
     "--output --sensor --stations --same-walls --tolerance-deg --force --plan --trajectory "
     "--mount",
     kThreads | kSeed, declare_calibrate},
    {"observability", kCalibrate,
     "Show how well a recording, planned or recorded, determines each parameter",
     "  risley observability --sensor mid-40 --duration-s 30 --rate-hz 100000\n"
     "  risley observability recording.lvx --free wedge_angle_deg",
     "--sensor --duration-s --rate-hz --fix --free", kThreads, declare_observability},
    {"compare", kCalibrate, "Find out whether a unit has changed, from results of different days",
     "  risley compare march/ june/ november/\n"
     "  risley compare march/calibration.yaml november/calibration.yaml -o changes.html",
     "--output --unlike --false-alarm --anywhere", kThreads, declare_compare},
    {"cloud", kPoints, "Make point clouds with covariances from recordings and a calibration",
     "  risley cloud recording.lvx --calibration calibration/calibration.yaml -o cloud.las\n"
     "  risley cloud 'flight/*.lvx' --calibration mid-40 --format ply -o clouds/",
     "--calibration --output --directions --covariance --trajectory --mount --crs "
     "--report",
     kThreads, declare_cloud},
    {"simulate", kSimulate, "Simulate a recording with known truth",
     "  risley simulate -o room.lvx --sensor mid-40 --scene data/room.yaml --duration-s 10\n"
     "  risley simulate -o unit.csv --rate-hz 1000 --set prism_tilt_a_vertical_deg=0.1 --seed 7\n"
     "  risley simulate -o flight.lvx --flight data/flight-v4.yaml --mount data/mount-nadir.yaml "
     "\\\n"
     "    --scene data/village.yaml --rate-hz 5000",
     "--output --sensor --duration-s --rate-hz --scene --station --set --reported --flight --mount "
     "--seed",
     kThreads | kSeed, declare_simulate},
    {"pattern", kSimulate,
     "Export a sensor's scan pattern for simulators, or show how it covers the field of view",
     "  risley pattern --sensor avia --format npy --duration-s 4 -o avia.npy\n"
     "  risley pattern --sensor horizon-sequence --format livox-csv --every 40 -o -\n"
     "  risley pattern --sensor horizon --format helios-xml -o horizon.xml\n"
     "  risley pattern --sensor tele-15 --coverage --report tele-15.html",
     "--output --format --sensor --duration-s --rate-hz --every --coverage --report", kThreads,
     declare_pattern},
    {"identify", kSimulate, "Identify the prisms that made a scan, from its directions alone",
     "  risley identify sequence.csv -o mine.yaml\n"
     "  risley identify frame.pcd --shot-rate-hz 240385 --json",
     "--output --force --shot-rate-hz --most-prisms --fastest-hz", kThreads, declare_identify},
    {"preset", kSimulate, "List, show, check or copy sensor presets",
     "  risley preset list\n  risley preset show avia\n"
     "  risley preset new unit-17 --from avia -o unit-17.yaml\n  risley preset check unit-17.yaml",
     "--output --from", kNothing, declare_preset},
    {"campaign", kSimulate, "Simulate and estimate or calibrate repeatedly, according to a plan",
     "  risley campaign plan.yaml -o campaign/\n"
     "  risley campaign plan.yaml --chunk 3/40 -o campaign/\n"
     "  risley campaign plan.yaml --merge -o campaign/",
     "--output --chunk --merge --table --seed", kThreads | kSeed, declare_campaign},
    {"reproduce", kSimulate,
     "Reproduce every table and figure of the paper, beside the paper's own values",
     "  risley reproduce -o reproduction/\n"
     "  risley reproduce --full --recording stationary.lvx -o reproduction/",
     "--output --full --recording --seed", kThreads | kSeed, declare_reproduce},
};

/// Text of --seed, which CLI11 would wrap around.
std::string seed_problem(const std::string& text) {
  std::uint64_t seed = 0;
  const char* const end = text.data() + text.size();
  const auto [last, code] = std::from_chars(text.data(), end, seed);
  if (code == std::errc() && last == end) return {};
  return fmt::format("found {}, allowed whole numbers 0 to {}", text,
                     std::numeric_limits<std::uint64_t>::max());
}

void add_common_options(CLI::App& verb, unsigned uses, CommonOptions& common) {
  constexpr const char* kHidden = "";
  verb.add_flag("--json", common.json, "Print the result as exactly one JSON object on stdout")
      ->group(kCommonGroup);
  auto* quiet = verb.add_flag("--quiet", common.quiet,
                              "Print only errors and the result: no progress, no warnings, no "
                              "summary of files written by --output or --table")
                    ->group(kCommonGroup);
  verb.add_flag("--no-progress", common.no_progress, "Show no progress bar");
  verb.add_flag("--verbose", common.verbose, "Print more detail on stderr")->excludes(quiet);
  auto* threads =
      verb.add_option("--threads", common.threads, "Number of threads (default: all cores)")
          ->check(CLI::Range(1, 4096));
  if ((uses & kThreads) == 0) threads->group(kHidden);
  auto* seed = verb.add_option("--seed", common.seed, "Seed of all random numbers (default: 0)")
                   ->check(CLI::Validator(seed_problem, ""));
  if ((uses & kSeed) == 0) seed->group(kHidden);
  verb.get_help_ptr()->group(kCommonGroup)->description("Print this help");
  verb.set_help_all_flag("--help-all", "Print this help with all options")->group(kCommonGroup);
}

/// Whether a verb writes a file, so that its printed output is only a summary.
bool writes_a_file(const CLI::App& verb) {
  for (const CLI::Option* option : verb.get_options()) {
    const std::string name = option->get_name();
    if ((name == "--output" || name == "--table") && option->count() > 0) return true;
  }
  const auto below = verb.get_subcommands();
  return std::any_of(below.begin(), below.end(),
                     [](const CLI::App* action) { return writes_a_file(*action); });
}

/// The command as it could be typed again.
std::string shell_text(const std::vector<std::string>& words) {
  std::string command = "risley";
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=.,:/@%";
  for (const std::string& word : words) {
    command += ' ';
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) {
      command += word;
      continue;
    }
    command += '\'';
    for (const char c : word) command += c == '\'' ? std::string("'\\''") : std::string(1, c);
    command += '\'';
  }
  return command;
}

/// The first unknown option of a verb, in words; CLI11 would name its value as well. Empty: there
/// is none.
std::string unknown_option(const CLI::App& verb, const std::vector<std::string>& words) {
  std::vector<std::string> names;
  const auto add_names = [&names](const CLI::App& app) {
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  };
  add_names(verb);
  for (const CLI::App* below : verb.get_subcommands([](const CLI::App*) { return true; })) {
    add_names(*below);
  }
  for (const std::string& word : words) {
    if (word == "--") break;
    const std::string name = word.substr(0, word.find('='));
    if (!name.starts_with("--") || std::find(names.begin(), names.end(), name) != names.end()) {
      continue;
    }
    return fmt::format("unknown option {}{}", name, did_you_mean(name, names));
  }
  return {};
}

/// The error in words; CLI11 would not name an unknown verb.
std::string usage_error(const CLI::ParseError& error, const std::vector<std::string>& words,
                        const CLI::App& app) {
  const std::string first = words.empty() ? "-" : words.front();
  std::vector<std::string> names;
  for (const Verb& verb : kVerbs) {
    if (first == verb.name) {
      const std::string unknown = unknown_option(*app.get_subcommand(first), words);
      return fmt::format("{} (see risley {} --help)", unknown.empty() ? error.what() : unknown,
                         first);
    }
    names.emplace_back(verb.name);
  }
  if (first.starts_with('-')) return fmt::format("{} (see risley --help)", error.what());
  return fmt::format("unknown verb '{}'{}, known: {}", first, did_you_mean(first, names),
                     fmt::join(names, ", "));
}

/// Whether a text, or part of it between commas or after an equals sign, is NaN or infinite.
bool holds_no_number(const std::string& text) {
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find_first_of(",=:", begin), text.size());
    std::string part = lower_case(text.substr(begin, end - begin));
    if (part.starts_with('+') || part.starts_with('-')) part.erase(0, 1);
    if (part == "inf" || part == "infinity" || part == "nan" || part.starts_with("nan(")) {
      return true;
    }
    begin = end + 1;
  }
  return false;
}

/// The first option with a value of NaN or infinity, which no computation accepts. File names may
/// contain anything. Empty: there is none.
std::string not_a_number(const CLI::App& verb) {
  for (const CLI::Option* option : verb.get_options()) {
    if (option->get_lnames().empty()) continue;  // inputs
    for (const std::string& value : option->results()) {
      std::error_code ignored;
      if (!holds_no_number(value) || std::filesystem::exists(value, ignored)) continue;
      return fmt::format("{} = {}, expected finite numbers", option->get_name(), value);
    }
  }
  for (const CLI::App* below : verb.get_subcommands()) {
    if (std::string found = not_a_number(*below); !found.empty()) return found;
  }
  return {};
}

/// Options for a calibration also accept the output folder of `calibrate` or `estimate`.
void take_result_folders(CLI::App& verb) {
  for (CLI::Option* option : verb.get_options([](const CLI::Option* one) {
         return one->check_lname("sensor") || one->check_lname("calibration");
       })) {
    const bool takes_flights = verb.get_name() == "cloud";
    option->transform(CLI::Validator(
        [takes_flights](std::string& value) {
          std::error_code ignored;
          if (std::filesystem::is_regular_file(value, ignored)) jobs::require_settled(value);
          // A folder of a flight also stands for its mount and trajectory.
          const bool flight =
              std::filesystem::exists(std::filesystem::path(value) / "mount.yaml", ignored);
          if (!(takes_flights && flight)) value = jobs::calibration_in(value).value_or(value);
          return std::string();
        },
        ""));
  }
}

}  // namespace

CommandLine::CommandLine()
    : app_("Observation model, simulator and estimator for Risley-prism lidars", "risley") {
  app_.formatter(std::make_shared<HelpFormatter>());
  app_.set_version_flag("--version", "risley " RISLEY_VERSION);
  app_.require_subcommand(1);
  for (const Verb& verb : kVerbs) {
    CLI::App& sub = *app_.add_subcommand(verb.name, verb.description)->group(verb.group);
    runs_[&sub] = verb.declare(sub);
    take_result_folders(sub);
    add_common_options(sub, verb.uses, common_);
    arrange_options(sub, verb.usual);
    sub.footer(verb.examples);
  }
  app_.get_help_ptr()->group(kCommonGroup)->description("Print this help");
  app_.get_option("--version")->group(kCommonGroup)->description("Print the version");
  app_.footer(
      "Exit status: 0 success, 1 no trustworthy result from these data, 2 wrong usage, 3 a bad "
      "file,\n4 a fault in the program or the machine, 130 interrupted.\nrisley VERB --help shows "
      "a verb's usual options, risley VERB --help-all all of them.");
}

CommandLine::Parsed CommandLine::parse(const std::vector<std::string>& words) {
  common_ = {};
  common_.command = shell_text(words);
  Parsed parsed;
  std::vector<std::string> reversed(words.rbegin(), words.rend());
  if (words.empty()) {
    reversed = {"--help"};
  } else if (words.front() == "help") {  // risley help VERB
    reversed.pop_back();
    reversed.insert(reversed.begin(), "--help");
  }
  try {
    app_.parse(std::move(reversed));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {  // --help, --version
      std::ostringstream text;
      app_.exit(error, text, text);
      parsed.help = text.str();
    } else {
      common_.json = std::find(words.begin(), words.end(), "--json") != words.end();
      if (!words.empty()) common_.verb = words.front();
      parsed.problem = usage_error(error, words, app_);
    }
    return parsed;
  }
  parsed.verb = app_.get_subcommands().front();
  common_.verb = parsed.verb->get_name();
  if (const std::string unusable = not_a_number(*parsed.verb); !unusable.empty()) {
    parsed.problem = fmt::format("{} (see risley {} --help)", unusable, common_.verb);
    return parsed;
  }
  common_.no_summary = common_.quiet && !common_.json && writes_a_file(*parsed.verb);
  note_files(*parsed.verb, common_);
  return parsed;
}

}  // namespace risley::app
