// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/writer.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "risley/core/text.hpp"

#include "recordings/formats/format.hpp"

namespace risley::recordings {
namespace {

/// One file name ending and its format.
struct Ending {
  std::string_view text;
  const Format* format;
  std::string_view condition;  ///< for the help
};

/// Two formats share ".csv": directions alone make a scan sequence, points an openpylivox table.
constexpr std::string_view kSharedEnding = ".csv";

const std::vector<Ending>& endings() {
  static const std::vector<Ending> all = [] {
    std::vector<Ending> list;
    for (const Format* format : all_formats()) {
      if (format->create == nullptr || format->ending == kSharedEnding) continue;
      list.push_back({format->ending, format, ""});
    }
    const auto add = [&list](Ending ending) {
      const bool known = std::any_of(list.begin(), list.end(), [&](const Ending& other) {
        return other.text == ending.text && other.format == ending.format;
      });
      if (!known) list.push_back(ending);
    };
    add({".openpylivox.csv", &kOpenpylivoxCsvFormat, ""});
    add({".sequence.csv", &kScanSequenceCsvFormat, ""});
    add({kSharedEnding, &kOpenpylivoxCsvFormat, " (recordings with ranges)"});
    add({kSharedEnding, &kScanSequenceCsvFormat, " (recordings without ranges)"});
    return list;
  }();
  return all;
}

std::unique_ptr<Writer> create(const Format& format, const std::string& path,
                               const RecordingHeader& header, const WriteOptions& options) {
  if (!format.holds_shot_numbers) require_times(header);
  return format.create(path, header, options);
}

}  // namespace

const std::vector<WritableFormat>& writable_formats() {
  static const std::vector<WritableFormat> formats = [] {
    std::vector<WritableFormat> list;
    for (const Ending& ending : endings()) {
      list.push_back({std::string(ending.format->name), std::string(ending.text),
                      fmt::format("{}{}", ending.format->description, ending.condition)});
    }
    return list;
  }();
  return formats;
}

std::unique_ptr<Writer> create_recording(const std::string& path, const RecordingHeader& header,
                                         const std::string& format, const WriteOptions& options) {
  if (!format.empty()) {
    std::string known;
    for (const Format* one : all_formats()) {
      if (one->create == nullptr) continue;
      if (one->name == format) return create(*one, path, header, options);
      known += fmt::format("{}{}", known.empty() ? "" : ", ", one->name);
    }
    throw InvalidArgument(fmt::format("format = {}, allowed {}", format, known));
  }
  const std::string name = lower_case(path);
  const Ending* best = nullptr;
  for (const Ending& ending : endings()) {
    if (!name.ends_with(ending.text)) continue;
    if (ending.text == kSharedEnding &&
        header.has_range != (ending.format == &kOpenpylivoxCsvFormat)) {
      continue;
    }
    if (best == nullptr || ending.text.size() > best->text.size()) best = &ending;
  }
  if (best == nullptr) {
    std::string known;
    for (const Ending& ending : endings()) {
      if (known.ends_with(ending.text)) continue;
      known += fmt::format("{}{}", known.empty() ? "" : ", ", ending.text);
    }
    throw InvalidArgument(fmt::format("{}: unknown ending, allowed {}", path, known));
  }
  return create(*best->format, path, header, options);
}

}  // namespace risley::recordings
