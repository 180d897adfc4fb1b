// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/recordings/livox/packet.hpp"

#include "recordings/reader_decorators.hpp"

namespace risley::recordings {
namespace {

/// Place of a device in a header. @throws InvalidArgument
std::uint8_t place_of(const RecordingHeader& header, const std::string& path,
                      const std::string& wanted) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < header.devices.size(); ++i) {
    const Device& device = header.devices[i];
    if (wanted == device.serial || wanted == device.topic) found.push_back(i);
  }
  if (found.empty()) {
    std::size_t place = 0;
    const char* const end = wanted.data() + wanted.size();
    const auto [stop, code] = std::from_chars(wanted.data(), end, place);
    if (code == std::errc() && stop == end && place < header.devices.size()) found = {place};
  }
  if (found.size() == 1) return static_cast<std::uint8_t>(found.front());
  throw InvalidArgument(fmt::format(
      "{} = \"{}\" names {} of the sensors of {}, expected the serial number, the topic or the "
      "number of one: {}",
      name_of(kSetting.device), wanted, found.empty() ? "none" : std::to_string(found.size()), path,
      devices_words(header)));
}

/// Keeps only the rows of one device.
class OneDeviceReader final : public Reader {
 public:
  OneDeviceReader(std::unique_ptr<Reader> inner, const std::string& path, const std::string& wanted)
      : inner_(std::move(inner)), place_(place_of(inner_->header(), path, wanted)) {
    describe();
  }

  bool read(Chunk& chunk, std::size_t max_rows) override {
    bool more = true;
    do {
      try {
        more = inner_->read(all_, max_rows);
      } catch (const FileError&) {
        describe();
        throw;
      }
      take(chunk);
    } while (more && chunk.observations.size() == 0 && chunk.packets.empty() && chunk.imu.empty());
    describe();
    return more;
  }

  double fraction_read() const override { return inner_->fraction_read(); }

 private:
  void describe() {
    header_ = inner_->header();
    index_ = header_.devices[place_].index;
    header_.devices = {header_.devices[place_]};
    warnings_ = inner_->warnings();
    clock_wraps_ = inner_->clock_wraps();
  }

  /// The device's part of all.
  void take(Chunk& chunk) {
    chunk.clear();
    const Observations& rows = all_.observations;
    std::vector<std::size_t> own;
    auto begin = all_.packet_begins.begin();
    for (std::size_t row = 0; row < rows.size(); ++row) {
      const bool begins = begin != all_.packet_begins.end() && *begin == row;
      if (begins) ++begin;
      if (rows.device[row] != place_) continue;
      if (begins) chunk.packet_begins.push_back(own.size());
      own.push_back(row);
    }
    chunk.observations.append(rows, own);
    std::fill(chunk.observations.device.begin(), chunk.observations.device.end(), std::uint8_t{0});
    for (const Packet& packet : all_.packets) {
      if (packet.device_index == index_) chunk.packets.push_back(packet);
    }
    for (ImuSample sample : all_.imu) {
      if (std::exchange(sample.device, std::uint8_t{0}) == place_) chunk.imu.push_back(sample);
    }
  }

  std::unique_ptr<Reader> inner_;
  std::uint8_t place_, index_ = 0;
  Chunk all_;
};

}  // namespace

std::unique_ptr<Reader> of_one_device(std::unique_ptr<Reader> reader, const std::string& path,
                                      const std::string& device) {
  return std::make_unique<OneDeviceReader>(std::move(reader), path, device);
}

}  // namespace risley::recordings
