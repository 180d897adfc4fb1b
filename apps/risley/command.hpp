// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "risley/core/progress.hpp"
#include "risley/jobs/many_inputs.hpp"
#include "risley/jobs/provenance.hpp"
#include "risley/json/results.hpp"
#include "risley/optics/parameters.hpp"

namespace risley::app {

using json::Json;

using jobs::ExitStatus;
using enum jobs::ExitStatus;

/// Options that every verb has.
struct CommonOptions {
  bool json = false;
  bool quiet = false;
  bool no_progress = false;
  bool no_summary = false;  ///< print no text: with --quiet where a file is the result
  bool verbose = false;
  int threads = 0;  ///< 0: all cores
  std::uint64_t seed = 0;
  std::string command;  ///< as typed, quoted for a shell
  std::string verb;
  std::vector<std::string> inputs;  ///< INPUT, as typed
  std::vector<std::string> files;   ///< existing files that options name to be read
};

/// Does the work of a verb and prints its result.
using Run = std::function<ExitStatus(const CommonOptions&)>;

/// Each declares its options and returns the function that runs it.
Run declare_info(CLI::App& verb);
Run declare_convert(CLI::App& verb);
Run declare_simulate(CLI::App& verb);
Run declare_estimate(CLI::App& verb);
Run declare_observability(CLI::App& verb);
Run declare_calibrate(CLI::App& verb);
Run declare_cloud(CLI::App& verb);
Run declare_compare(CLI::App& verb);
Run declare_campaign(CLI::App& verb);
Run declare_identify(CLI::App& verb);
Run declare_pattern(CLI::App& verb);
Run declare_preset(CLI::App& verb);
Run declare_report(CLI::App& verb);
Run declare_reproduce(CLI::App& verb);
Run declare_record(CLI::App& verb);
Run declare_emulate(CLI::App& verb);

/// Declares an option with a few allowed values; the variable holds the default.
CLI::Option* add_choice(CLI::App& verb, const std::string& name, std::string& value,
                        const std::vector<std::string>& choices, const std::string& words);

/// From now on SIGINT, SIGTERM and SIGHUP cancel the computation, so that every unfinished output
/// is removed by its owner. Work that does not stop within two seconds, because it waits for a pipe
/// or cannot be cancelled, is ended; unfinished outputs are removed then, too. Writing to a closed
/// pipe, or beyond the file size limit, fails like any other write error.
void watch_signals();

/// The --json output in that case, before any computation.
void prepare_interruption(const CommonOptions& common);

/// For verbs that end a recording when interrupted: they may take longer.
void end_in_own_time();

/// Opens standard streams that the caller closed, so that no file gets their numbers and receives
/// terminal output.
void hold_standard_streams();

/// Whether progress is shown: on a terminal, without --quiet and --no-progress.
bool shows_progress(const CommonOptions& common);

/// print_text() prints nothing after this call.
void print_no_text();

/// A progress bar on stderr with the remaining time, if shows_progress(); the destructor clears it.
class ProgressBar {
 public:
  /// @param label  for work without named stages
  ProgressBar(std::string_view label, const CommonOptions& common);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// For a library function; a signal cancels it.
  Progress progress();

  /// Text after the bar from now on, such as the number of files done. @param text  short
  void note(std::string text);

 private:
  void show(double fraction, std::string_view stage);

  std::string label_;
  std::string note_;
  std::mutex note_mutex_;
  bool visible_;
  double started_, shown_ = -1.0;
};

/// Seconds on a clock that never jumps.
double now();

/// @param name  of the quantity. @throws InvalidArgument unless it is a finite number
double number_from(const std::string& text, std::string_view name);
/// A value of --rate-hz. @return nothing for 'full'  @throws InvalidArgument
std::optional<double> rate_from(const std::string& text);

/// The value of --noise-angle-deg, rad. @throws InvalidArgument
std::optional<double> noise_angle(const std::optional<double>& noise_angle_deg);

/// For a library function without a progress bar; a signal cancels it.
Progress cancellable();

/// Adds a file, or the files in a ROS 2 folder, to others.
void add_files(const std::string& path, std::vector<std::string>& files);

/// Fills inputs and files from a verb's command line.
void note_files(const CLI::App& verb, CommonOptions& common);

/// An object that begins with the common head: format_version, version, command, inputs with their
/// SHA-256, null where a file cannot be read.
/// @param known  hashes computed earlier, as in jobs::with_inputs()
Json with_head(const CommonOptions& common, const Json& object, const jobs::Provenance& known = {});

/// Prints on stdout without control characters, see printable(). close_stdout() checks once whether
/// all of it was written.
void print_text(std::string_view text);
template <class... Values>
void say(fmt::format_string<Values...> format, Values&&... values) {
  print_text(fmt::format(format, std::forward<Values>(values)...));
}

/// Writes what stdout still holds.
/// @return the status, at least kBadFile if part of the output could not be written
ExitStatus close_stdout(ExitStatus status);

/// No output may be a file that the command reads, under any name or link, nor another output.
/// @param outputs  names; empty ones, or - for stdout, do not count
/// @throws InvalidArgument
void require_apart(const CommonOptions& common, const std::vector<std::string>& outputs);

/// Prints one JSON object, with_head(), and a line feed on stdout.
void print_json(const CommonOptions& common, const Json& object,
                const jobs::Provenance& known = {});

/// Reports on stderr that the numbers failed a check; the reason only if the verdict's text is not
/// on stdout.
void log_failure(const std::string& reason, const CommonOptions& common);

/// A verdict as lines of text.
template <class Verdict>
void print_verdict(const Verdict& verdict) {
  say("{}: {}\nwhat to do: {}\n", to_string(verdict.code), verdict.words, verdict.to_do);
}

}  // namespace risley::app
