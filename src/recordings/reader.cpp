// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/reader.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "risley/bags/bag.hpp"
#include "risley/core/setting.hpp"
#include "risley/io/file_head.hpp"

#include "recordings/formats/format.hpp"
#include "recordings/memory_reader.hpp"
#include "recordings/reader_decorators.hpp"

namespace risley::recordings {
namespace {

std::string known_formats() {
  std::string names;
  for (const Format* format : all_formats()) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", format->name);
  }
  return names;
}

/// The first bytes of an unknown file, as text where they are text.
std::string shown(std::string_view head) {
  constexpr std::size_t kShown = 16;
  head = head.substr(0, kShown);
  const bool is_text = std::all_of(head.begin(), head.end(), [](char c) {
    return std::isprint(static_cast<unsigned char>(c)) != 0;
  });
  if (is_text) return fmt::format("'{}'", head);
  std::string bytes;
  for (const char c : head) {
    bytes += fmt::format("{}{:02X}", bytes.empty() ? "" : " ", static_cast<unsigned char>(c));
  }
  return bytes;
}

std::string read_head(const std::string& path) {
  std::string head = io::read_file_head(path, kHeadBytes, "a recording");
  if (head.empty()) {
    throw FileError(path, {0, {}},
                    fmt::format("is empty, expected a recording ({})", known_formats()));
  }
  return head;
}

/// @throws FileError with what a file of no known kind is
[[noreturn]] void refuse_unknown(const std::string& path, std::string_view head,
                                 const std::string& expected) {
  const auto other = io::stands_for_another(path, head);
  throw FileError(path, {0, {}},
                  other ? *other : fmt::format("{}; it begins with {}", expected, shown(head)));
}

/// The file that tells the kind of a recording: itself, or the first of a folder of bags.
std::string told_by(const std::string& path) {
  std::error_code code;
  if (!std::filesystem::is_directory(path, code)) return path;
  return bags::files_of_bag_folder(path).front();
}

std::unique_ptr<Reader> open_as_it_is(const std::string& path, const Progress& progress) {
  const std::string first = told_by(path), head = read_head(first);
  if (first != path && !bags::bag_kind(head)) {
    refuse_unknown(first, head, "is not a ROS 2 bag");
  }
  for (const Format* format : all_formats()) {
    if (format->recognises(head)) return format->open(path, progress);
  }
  refuse_unknown(path, head, fmt::format("is of no known kind: expected {}", known_formats()));
}

}  // namespace

std::unique_ptr<Reader> open_recording(const Source& source, const ReadOptions& options,
                                       const Progress& progress) {
  const std::string& path = source.name();
  const auto open_device = [&]() -> std::unique_ptr<Reader> {
    std::unique_ptr<Reader> reader = source.recording()
                                         ? std::make_unique<MemoryReader>(source.recording())
                                         : open_as_it_is(path, progress);
    if (options.device.empty()) return reader;
    return of_one_device(std::move(reader), path, options.device);
  };
  std::unique_ptr<Reader> reader = with_judged_times(open_device, options, progress);
  if (options.shot_rate) reader = with_counted_times(std::move(reader), path, options);
  if (options.packet_places) reader = with_packet_places(std::move(reader), options);
  if (options.extrinsics) reader = in_sensor_frame(std::move(reader), *options.extrinsics);
  return with_plausibility(within_time_span(std::move(reader), path));
}

bool is_recording_folder(const std::string& path) { return bags::is_bag_folder(path); }

std::string devices_words(const RecordingHeader& header) {
  std::string words;
  for (std::size_t i = 0; i < header.devices.size(); ++i) {
    const Device& device = header.devices[i];
    words += fmt::format("{}{}: {}", words.empty() ? "" : "; ", i, device_type_name(device.type));
    if (!device.serial.empty()) words += ", serial " + device.serial;
    if (!device.topic.empty()) words += ", topic " + device.topic;
  }
  return words;
}

void require_one_device(const RecordingHeader& header, const std::string& name) {
  if (header.devices.size() == 1) return;
  throw InvalidArgument(
      fmt::format("{} holds {} sensors, and one is needed here ({}); {} chooses one, by its serial "
                  "number, its topic or its number in this list",
                  name, header.devices.size(), devices_words(header), name_of(kSetting.device)));
}

void require_times(const RecordingHeader& header) {
  if (header.has_times) return;
  throw MissingTimes(
      fmt::format("this recording of format {} holds no times of single shots, which are needed "
                  "here; expected a shot rate to count them by: say it with {}",
                  header.format, name_of(kSetting.shot_rate)));
}

Recording load_recording(const Source& source, const Progress& progress,
                         const ReadOptions& options) {
  const std::unique_ptr<Reader> reader = open_recording(source, options, progress);
  Recording recording;
  Chunk chunk;
  while (reader->read(chunk)) {
    for (const std::size_t row : chunk.packet_begins) {
      recording.data.packet_begins.push_back(recording.data.observations.size() + row);
    }
    recording.data.observations.append(chunk.observations);
    recording.data.packets.insert(recording.data.packets.end(), chunk.packets.begin(),
                                  chunk.packets.end());
    recording.data.imu.insert(recording.data.imu.end(), chunk.imu.begin(), chunk.imu.end());
    progress.report(reader->fraction_read());
  }
  recording.header = reader->header();
  recording.warnings = reader->warnings();
  return recording;
}

}  // namespace risley::recordings
