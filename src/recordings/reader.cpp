// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/reader.hpp"

#include <utility>

#include <fmt/format.h>

#include "risley/bags/bag.hpp"
#include "risley/core/setting.hpp"

#include "recordings/reader_decorators.hpp"
#include "recordings/shared_input.hpp"

namespace risley::recordings {

bool Reader::read_sound(Chunk& chunk, std::size_t max_rows) {
  try {
    return read(chunk, max_rows);
  } catch (const FileError&) {
    return false;
  }
}

std::unique_ptr<Reader> open_recording(const Source& source, const ReadOptions& options,
                                       const Progress& progress) {
  const std::string& path = source.name();
  const std::shared_ptr<SharedInput> input = source.shared();
  const auto open_device = [&]() -> std::unique_ptr<Reader> {
    std::unique_ptr<Reader> reader = input->read(progress);
    if (options.device.empty()) return reader;
    return of_one_device(std::move(reader), path, options.device);
  };
  const bool counted = options.shot_rate.has_value();
  std::unique_ptr<Reader> reader =
      with_judged_times(open_device, input->judgement(options.device, counted, [&] {
        return judge_times(*open_device(), counted, progress);
      }));
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
    recording.data.append(std::move(chunk));
    progress.report(reader->fraction_read());
  }
  recording.header = reader->header();
  recording.warnings = reader->warnings();
  return recording;
}

}  // namespace risley::recordings
