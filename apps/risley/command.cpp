// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "command.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>
#include <thread>
#include <unordered_map>

#include <fcntl.h>
#include <fmt/format.h>
#include <semaphore.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/io/file_identity.hpp"
#include "risley/io/temporaries.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/json/many_results.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::app {
namespace {

CancelFlag
    interrupted;  // NOLINT(*-avoid-non-const-global-variables): of the process, as signals are

sem_t interruptions;                    // NOLINT(*-avoid-non-const-global-variables): as above
std::string object_when_interrupted;    // NOLINT(*-avoid-non-const-global-variables): as above
bool prints_text = true;                // NOLINT(*-avoid-non-const-global-variables): as above
std::atomic<bool> in_own_time = false;  // NOLINT(*-avoid-non-const-global-variables): as above

void note_signal(int) {
  interrupted.set();
  ::sem_post(&interruptions);
}

/// Ends the process if it does not stop in time after an interruption.
void wait_for_interruption() {
  constexpr auto kPatience = std::chrono::milliseconds(1500);
  while (::sem_wait(&interruptions) != 0) {
  }
  std::this_thread::sleep_for(kPatience);
  if (in_own_time) return;
  io::remove_temporaries();
  constexpr std::string_view kWords = "risley: error: interrupted\n";
  [[maybe_unused]] auto written = ::write(STDERR_FILENO, kWords.data(), kWords.size());
  const std::string& object = object_when_interrupted;
  if (!object.empty()) written = ::write(STDOUT_FILENO, object.data(), object.size());
  ::_exit(kInterrupted);
}

std::string duration_text(double seconds) {
  const int whole = static_cast<int>(std::lround(std::min(seconds, 359999.0)));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

}  // namespace

CLI::Option* add_choice(CLI::App& verb, const std::string& name, std::string& value,
                        const std::vector<std::string>& choices, const std::string& words) {
  return verb.add_option(name, value, words)->check(CLI::IsMember(choices))->capture_default_str();
}

void watch_signals() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  ::sem_init(&interruptions, 0, 0);
  std::thread(wait_for_interruption).detach();
  std::signal(SIGINT, note_signal);
  std::signal(SIGTERM, note_signal);
  // nohup and similar programs need it ignored.
  if (std::signal(SIGHUP, note_signal) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
}

void prepare_interruption(const CommonOptions& common) {
  if (!common.json) return;
  Json inputs = Json::array();
  for (const auto* files : {&common.inputs, &common.files}) {
    for (const std::string& path : *files) inputs.push_back({{"path", path}, {"sha256", nullptr}});
  }
  Json object = {{"format_version", json::kFormatVersion},
                 {"version", RISLEY_VERSION},
                 {"command", common.command},
                 {"inputs", inputs},
                 {"error", "interrupted"},
                 {"exit_status", static_cast<int>(kInterrupted)}};
  if (common.verb == "estimate" || common.verb == "calibrate") {
    object.update(json::undecided("interrupted"));
  }
  object_when_interrupted = object.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void end_in_own_time() { in_own_time = true; }

void hold_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    // Gets the lowest free number, which is this one. Writing to stdout then fails.
    ::open("/dev/null", stream == STDERR_FILENO ? O_WRONLY : O_RDONLY);
  }
}

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

bool shows_progress(const CommonOptions& common) {
  return !common.quiet && !common.no_progress && isatty(STDERR_FILENO) != 0;
}

ProgressBar::ProgressBar(std::string_view label, const CommonOptions& common)
    : label_(label), visible_(shows_progress(common)), started_(now()) {}

ProgressBar::~ProgressBar() {
  if (visible_ && shown_ >= 0) std::fputs("\r\033[K", stderr);
}

void ProgressBar::note(std::string text) {
  const std::scoped_lock lock(note_mutex_);
  note_ = std::move(text);
}

Progress ProgressBar::progress() {
  return {[this](double fraction, std::string_view stage) { show(fraction, stage); }, &interrupted};
}

Progress cancellable() {
  return {[](double, std::string_view) {}, &interrupted};
}

void ProgressBar::show(double fraction, std::string_view stage) {
  const double time = now();
  if (!stage.empty() && stage != label_) {
    label_ = stage;
    started_ = time;
  }
  if (!visible_ || time - shown_ < 0.1) return;  // ten times a second is smooth enough
  shown_ = time;
  constexpr int kWidth = 30;
  const double done = std::clamp(fraction, 0.0, 1.0);
  const int filled = static_cast<int>(done * kWidth);
  const double elapsed = time - started_;
  const std::string remaining =
      done > 0.01 && elapsed > 1 ? duration_text(elapsed * (1 - done) / done) + " left" : "";
  const std::scoped_lock lock(note_mutex_);
  fmt::print(stderr, "\r\033[K{} [{:=<{}}{: <{}}] {:3.0f} % {}{}{}", label_, "", filled, "",
             kWidth - filled, 100 * done, note_, note_.empty() || remaining.empty() ? "" : ", ",
             remaining);
  std::fflush(stderr);
}

double number_from(const std::string& text, std::string_view name) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(value)) {
    throw InvalidArgument(fmt::format("{} = '{}', expected a number", name, text));
  }
  return value;
}

std::optional<double> rate_from(const std::string& text) {
  if (text == "full") return std::nullopt;
  const double rate = number_from(text, "--rate-hz");
  require_positive(kSetting.rate, rate);
  return rate;
}

std::optional<double> noise_angle(const std::optional<double>& noise_angle_deg) {
  if (!noise_angle_deg) return std::nullopt;
  const double noise = radians_from_degrees(*noise_angle_deg);
  require_positive(kSetting.noise_angle, noise);
  return noise;
}

void add_files(const std::string& path, std::vector<std::string>& files) {
  const std::vector<std::string> own = recordings::recording_files(path);
  files.insert(files.end(), own.begin(), own.end());
}

void note_files(const CLI::App& verb, CommonOptions& common) {
  namespace fs = std::filesystem;
  for (const CLI::Option* option : verb.get_options()) {
    for (const std::string& value : option->results()) {
      std::error_code ignored;
      const std::string name = option->get_name();
      if (name == "INPUT" || name == "FILE" || name == "PLAN") {
        add_files(value, common.inputs);
      } else if (name == "RESULT") {
        const std::string file = jobs::calibration_in(value).value_or(value);
        if (fs::is_regular_file(file, ignored)) common.inputs.push_back(file);
      } else if (name == "DIR") {
        common.inputs.push_back((fs::path(value) / "report.json").string());
        // For two results, compares the numbers as well.
        const std::optional<std::string> numbers = jobs::calibration_in(value);
        if (option->results().size() > 1 && numbers) common.files.push_back(*numbers);
      } else if (names_file_to_read(name) && (fs::is_regular_file(value, ignored) ||
                                              recordings::recording_files(value).size() > 1)) {
        add_files(value, common.files);
      }
    }
  }
  for (const CLI::App* sub : verb.get_subcommands()) note_files(*sub, common);
}

Json with_head(const CommonOptions& common, const Json& object, const jobs::Provenance& known) {
  std::unordered_map<std::string_view, std::string_view> hashes;
  for (std::size_t i = 0; i + 1 < known.size(); ++i) {
    if (known[i + 1].first == known[i].first + "_sha256") {
      hashes[known[i].second] = known[i + 1].second;
    }
  }
  Json inputs = Json::array();
  const auto add = [&](const std::string& path) {
    Json one = {{"path", path}, {"sha256", nullptr}};
    if (const auto found = hashes.find(path); found != hashes.end()) one["sha256"] = found->second;
    std::error_code ignored;
    if (one["sha256"].is_null() && !interrupted.is_set() &&
        std::filesystem::is_regular_file(path, ignored)) {
      try {
        one["sha256"] =
            hashes::sha256_of_file(path, {[](double, std::string_view) {}, &interrupted});
      } catch (const FileError&) {  // the verb reports the error
      } catch (const Cancelled&) {
      }
    }
    inputs.push_back(one);
  };
  for (const std::string& path : common.inputs) add(path);
  for (const std::string& path : common.files) add(path);
  Json whole = {{"format_version", json::kFormatVersion},
                {"version", RISLEY_VERSION},
                {"command", common.command},
                {"inputs", inputs}};
  whole.update(object);
  return whole;
}

void print_json(const CommonOptions& common, const Json& object, const jobs::Provenance& known) {
  const Json whole = with_head(common, object, known);
  // Serial numbers come from files and may hold invalid UTF-8.
  say("{}\n", whole.dump(2, ' ', false, Json::error_handler_t::replace));
}

void print_no_text() { prints_text = false; }

void print_text(std::string_view text) {
  if (!prints_text) return;
  const std::string shown = printable(text, true);
  std::fwrite(shown.data(), 1, shown.size(), stdout);
}

ExitStatus close_stdout(ExitStatus status) {
  std::cout.flush();
  errno = 0;
  std::fflush(stdout);
  const int error = errno;
  if (std::cout && std::ferror(stdout) == 0) return status;
  spdlog::error("stdout: cannot be written{}{}", error != 0 ? ": " : "",
                error != 0 ? std::strerror(error) : "");
  return std::max(status, kBadFile);
}

namespace {

/// The canonical path of a future file, whatever its spelling and links.
std::string place_of(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  fs::path place = fs::absolute(path, ignored);
  constexpr int kMostLinks = 40;
  for (int links = 0; links < kMostLinks && fs::is_symlink(place, ignored); ++links) {
    place = place.parent_path() / fs::read_symlink(place, ignored);
  }
  return fs::weakly_canonical(place, ignored).string();
}

}  // namespace

void require_apart(const CommonOptions& common, const std::vector<std::string>& outputs) {
  namespace fs = std::filesystem;
  std::vector<std::string> inputs = common.inputs;
  inputs.insert(inputs.end(), common.files.begin(), common.files.end());
  for (std::size_t i = 0, count = inputs.size(); i < count; ++i) {
    if (!inputs[i].ends_with(".truth.yaml")) continue;
    inputs.push_back(fs::path(inputs[i]).replace_extension(".nc").string());  // read with it
  }
  const auto identity_of = [](const std::string& path) {
    std::error_code ignored;
    return fs::is_regular_file(path, ignored) ? io::file_identity(path) : std::nullopt;
  };
  std::map<io::FileIdentity, std::string> read, written;
  std::map<std::string, std::string> names;
  for (const std::string& input : inputs) {
    if (const auto identity = identity_of(input)) read.try_emplace(*identity, input);
  }
  for (const std::string& output : outputs) {
    if (output.empty() || output == "-") continue;
    const auto identity = identity_of(output);
    if (const auto input = identity ? read.find(*identity) : read.end(); input != read.end()) {
      throw InvalidArgument(
          fmt::format("the output {} would replace {}, which this command reads: give another name",
                      output, input->second == output ? "the input of that name" : input->second));
    }
    const auto [named, is_new_name] = names.try_emplace(place_of(output), output);
    std::string other = is_new_name ? "" : named->second;
    if (identity && other.empty()) {
      const auto [place, is_new] = written.try_emplace(*identity, output);
      if (!is_new) other = place->second;
    }
    if (other.empty()) continue;
    throw InvalidArgument(fmt::format("the outputs {} and {} are the same file", other, output));
  }
}

void log_failure(const std::string& reason, const CommonOptions& common) {
  const bool is_seen = !common.json && isatty(STDOUT_FILENO) != 0 && isatty(STDERR_FILENO) != 0;
  spdlog::error("not converged{}", is_seen ? "" : ": " + reason);
}

}  // namespace risley::app
