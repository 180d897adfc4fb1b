// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdio>
#include <exception>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <malloc.h>
#include <pthread.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"
#include "risley/json/many_results.hpp"

#include "command_line.hpp"

namespace risley::app {
namespace {

/// Reports an error: a message on stderr, and with --json an object on stdout.
ExitStatus fail(ExitStatus status, const std::string& message, const CommonOptions& common,
                const Json& details = {}) {
  spdlog::error(message);
  if (common.json) {
    Json object = {{"error", message}, {"exit_status", static_cast<int>(status)}};
    if (details.is_object()) object.update(details);
    if (common.verb == "estimate" || common.verb == "calibrate") {
      object.update(json::undecided(message));
    }
    print_json(common, object);
  }
  return status;
}

ExitStatus run_verb(const Run& run, const CommonOptions& common) {
  try {
    return run(common);
  } catch (...) {
    const json::Failure failure = json::current_failure();
    return fail(failure.status, failure.message, common, failure.details);
  }
}

ExitStatus run_command(const std::vector<std::string>& words) {
  CommandLine line;
  CommandLine::Parsed parsed;
  try {
    parsed = line.parse(words);
  } catch (...) {  // a result named by an option is not usable
    CommonOptions common = line.common();
    common.json = std::find(words.begin(), words.end(), "--json") != words.end();
    if (!words.empty()) common.verb = words.front();
    const json::Failure failure = json::current_failure();
    return fail(failure.status, failure.message, common, failure.details);
  }
  const CommonOptions& common = line.common();
  if (parsed.help) {
    std::fputs(parsed.help->c_str(), stdout);
    return kDone;
  }
  if (parsed.problem) return fail(kWrongUsage, *parsed.problem, common);
  if (common.quiet) spdlog::set_level(spdlog::level::err);
  if (common.no_summary) print_no_text();
  if (common.verbose) spdlog::set_level(spdlog::level::debug);
  if (common.threads > 0) {
    // Never lifted: oneTBB might then start threads, and without memory for them it ends the
    // process without a message.
    [[maybe_unused]] static const auto* const limit =
        std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                              static_cast<std::size_t>(common.threads))
            .release();
  }
  prepare_interruption(common);
  return run_verb(line.run_of(*parsed.verb), common);
}

/// The message of a log entry on one line without control characters.
class PrintableMessage final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& line) override {
    const std::string text = printable({message.payload.data(), message.payload.size()}, false);
    line.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<PrintableMessage>();
  }
};

void start_log() {
  const auto log = spdlog::stderr_color_mt("risley");
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<PrintableMessage>('*').set_pattern("risley: %^%l%$: %*");
  log->set_formatter(std::move(formatter));
  log->set_level(spdlog::level::trace);
  spdlog::set_default_logger(log);
  spdlog::set_level(spdlog::level::warn);
}

/// Freed memory is kept for reuse instead of being returned to the kernel, which would have to zero
/// every page again.
void keep_freed_memory() {
#ifdef M_MMAP_THRESHOLD
  constexpr int kColumn = 1 << 25, kAll = std::numeric_limits<int>::max();
  ::mallopt(M_MMAP_THRESHOLD, kColumn);
  ::mallopt(M_TRIM_THRESHOLD, kAll);
#endif
}

/// Runs a command on a large enough stack, whatever the stack limit of the process.
ExitStatus run_on_large_stack(const std::vector<std::string>& words) {
  struct Task {
    const std::vector<std::string>& words;
    ExitStatus status;
  } task{words, kFault};
  const auto run = [](void* of) -> void* {
    auto* own = static_cast<Task*>(of);
    own->status = run_command(own->words);
    return nullptr;
  };
  constexpr std::size_t kStackBytes = std::size_t{8} << 20U;
  pthread_attr_t attributes;
  pthread_t thread;
  ::pthread_attr_init(&attributes);
  const bool started = ::pthread_attr_setstacksize(&attributes, kStackBytes) == 0 &&
                       ::pthread_create(&thread, &attributes, run, &task) == 0;
  ::pthread_attr_destroy(&attributes);
  if (!started) return run_command(words);
  ::pthread_join(thread, nullptr);
  return task.status;
}

/// An uncaught exception is a bug, or memory ran out where it could not be reported.
[[noreturn]] void end_by_fault() {
  constexpr std::string_view kWords =
      "risley: error: internal error or out of memory: unfinished outputs were discarded\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kWords.data(), kWords.size());
  ::_exit(kFault);
}

}  // namespace
}  // namespace risley::app

int main(int argc, char** argv) {
  using namespace risley::app;
  std::set_terminate(end_by_fault);
  risley::write_settings_as(risley::SettingStyle::flag);
  keep_freed_memory();
  hold_standard_streams();
  start_log();
  watch_signals();
  return close_stdout(run_on_large_stack({argv + std::min(argc, 1), argv + argc}));
}
