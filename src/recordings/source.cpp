// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/source.hpp"

#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "risley/bags/bag.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/recordings/reader.hpp"

#include "recordings/shared_input.hpp"

namespace risley::recordings {
namespace {

void require_devices(const Recording& recording) {
  const std::size_t devices = recording.header.devices.size();
  if (devices == 0) throw InvalidArgument("recording has no device, expected at least one");
  const auto& device = recording.data.observations.device;
  for (std::size_t row = 0; row < device.size(); ++row) {
    if (device[row] < devices) continue;
    throw InvalidArgument(
        fmt::format("device = {} in row {}, allowed 0 to {}", device[row], row, devices - 1));
  }
}

/// Packets, if there are any, own all rows and inertial samples.
void require_packets(const Chunk& data) {
  if (data.packets.empty()) return;
  std::size_t rows = 0, samples = 0;
  for (const Packet& packet : data.packets) {
    rows += packet.rows;
    samples += packet.is_imu() ? 1 : 0;
  }
  require_length("rows of packets", rows, data.observations.size());
  require_length("inertial samples of packets", samples, data.imu.size());
}

}  // namespace

Source::Source(std::string path) : name_(std::move(path)) {}
Source::Source(const char* path) : name_(path) {}
Source::Source(const std::filesystem::path& path) : name_(path.string()) {}

Source::Source(std::shared_ptr<const Recording> recording, std::string name)
    : name_(std::move(name)), recording_(std::move(recording)) {
  if (!recording_) throw InvalidArgument("recording is missing, expected columns");
  require_angles(recording_->data.observations);
  require_devices(*recording_);
  require_packets(recording_->data);
}

bool Source::is_same_as(const Source& other) const {
  if (recording_ || other.recording_) return recording_ == other.recording_;
  std::error_code ignored;
  return std::filesystem::equivalent(name_, other.name_, ignored);
}

Source Source::held_open() const {
  Source result = *this;
  result.shared_ = shared();
  return result;
}

std::optional<FileError> Source::damage() const {
  return shared_ ? shared_->damage() : std::nullopt;
}

io::InputFile Source::open_file(const std::string& path) const {
  return path == name_ ? shared()->file() : io::InputFile(path);
}

std::shared_ptr<SharedInput> Source::shared() const {
  if (shared_) return shared_;
  if (recording_) return std::make_shared<SharedInput>(recording_, name_);
  return std::make_shared<SharedInput>(name_);
}

namespace {

/// SQLite's files beside a database: messages not in it yet.
void add_with_journals(const std::string& file, std::vector<std::string>& files) {
  files.push_back(file);
  for (const char* ending : {"-wal", "-journal"}) {
    std::error_code ignored;
    if (std::filesystem::is_regular_file(file + ending, ignored)) files.push_back(file + ending);
  }
}

}  // namespace

std::vector<std::string> recording_files(const Source& source) {
  if (source.recording()) return {};
  const std::string& path = source.name();
  std::error_code code;
  std::vector<std::string> files;
  if (!std::filesystem::is_directory(path, code)) {
    add_with_journals(path, files);
    return files;
  }
  try {
    files.push_back((std::filesystem::path(path) / "metadata.yaml").string());
    for (const std::string& file : bags::files_of_bag_folder(path)) add_with_journals(file, files);
    return files;
  } catch (const FileError&) {  // reading it reports the error
    return {path};
  }
}

}  // namespace risley::recordings
