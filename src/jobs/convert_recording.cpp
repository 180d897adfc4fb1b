// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/convert_recording.hpp"

#include <utility>

#include <fmt/format.h>

#include "risley/core/setting.hpp"
#include "risley/jobs/prepared_recording.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/recordings/writer.hpp"

namespace risley::jobs {
namespace {

/// The header to write, with a type of sensor if the recording does not state it.
recordings::RecordingHeader header_of(PreparedRecording& input,
                                      const ConvertRecordingOptions& options,
                                      ConvertedRecording& result, const Progress& progress) {
  recordings::RecordingHeader header = input.reader->header();
  if (options.sensor_type) {
    for (recordings::Device& device : header.devices) {
      const std::string told = recordings::device_type_name(device.type);
      if (told != "unknown" && device.type != *options.sensor_type && !device.type_inferred) {
        throw InvalidArgument(
            fmt::format("{} {}: the recording itself names a {}", name_of(kSetting.sensor_type),
                        recordings::device_type_name(*options.sensor_type), told));
      }
      device.type = *options.sensor_type;
    }
    return header;
  }
  recordings::Device& device = header.devices.front();
  // A type without a preset cannot be recognised by its scan.
  const bool named = device.type != recordings::kUnknownDeviceType &&
                     (!device.type_inferred || !preset_of_type(device.type));
  if (named || header.devices.size() > 1) return header;
  result.choice = input.choose({}, progress);
  if (result.choice->chosen_by == ChosenBy::scan) {
    device.type = static_cast<std::uint8_t>(result.choice->sensor.device_type);
  }
  return header;
}

}  // namespace

ConvertedRecording convert_recording(const ConvertRecordingOptions& options,
                                     const Progress& progress) {
  ConvertedRecording result;
  PreparedRecording input = prepare_recording(options.recording, options.reading,
                                              {.untold = UntoldShots::guessed}, progress.silent());
  const std::unique_ptr<recordings::Reader>& reader = input.reader;
  const auto writer = recordings::create_recording(
      options.output, header_of(input, options, result, progress.silent()), options.format,
      options.writing);
  input.close_questions();
  // While one chunk is written, the next is read.
  recordings::Chunk chunk, next;
  parallel::TaskGroup writing;
  const auto read_next = [&] {
    try {
      return reader->read(next);
    } catch (const FileError& error) {
      result.damage = error;  // the undamaged part is worth keeping
      return false;
    }
  };
  while (read_next()) {
    writing.wait();
    std::swap(chunk, next);
    writing.run([&] { writer->write(chunk); });
    result.observations += chunk.observations.size();
    progress.report(reader->fraction_read());
  }
  writing.wait();
  writer->close();
  result.left_out = writer->left_out();
  result.input_format = reader->header().format;
  result.warnings = input.all_warnings();
  result.time_uncertainty = input.time_uncertainty;
  return result;
}

}  // namespace risley::jobs
