// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/convert_recording.hpp"

#include <fmt/format.h>

#include "risley/recordings/writer.hpp"

#include "jobs/open_input.hpp"

namespace risley::jobs {
namespace {

/// The header to write, with the type of sensor where the recording does not tell it.
recordings::RecordingHeader header_of(const recordings::Reader& reader,
                                      std::optional<std::uint8_t> sensor_type) {
  recordings::RecordingHeader header = reader.header();
  if (!sensor_type) return header;
  for (recordings::Device& device : header.devices) {
    const std::string told = recordings::device_type_name(device.type);
    if (told != "unknown" && device.type != *sensor_type) {
      throw InvalidArgument(
          fmt::format("option sensor_type {}: the recording tells that it is of a {}",
                      recordings::device_type_name(*sensor_type), told));
    }
    device.type = *sensor_type;
  }
  return header;
}

}  // namespace

ConvertedRecording convert_recording(const ConvertRecordingOptions& options,
                                     const Progress& progress) {
  ConvertedRecording result;
  const auto reader = open_input(options.recording, options.reading);
  const auto writer = recordings::create_recording(
      options.output, header_of(*reader, options.sensor_type), options.format);
  recordings::Chunk chunk;
  const auto read_next = [&] {
    try {
      return reader->read(chunk);
    } catch (const FileError& error) {
      result.damage = error;  // the sound part is worth keeping
      return false;
    }
  };
  while (read_next()) {
    writer->write(chunk);
    result.observations += chunk.observations.size();
    progress.report(reader->fraction_read());
  }
  writer->close();
  result.left_out = writer->left_out();
  result.input_format = reader->header().format;
  result.warnings = reader->warnings();
  return result;
}

}  // namespace risley::jobs
