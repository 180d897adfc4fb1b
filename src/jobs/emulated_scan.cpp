// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/emulated_scan.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"
#include "risley/recordings/livox/packet_encoder.hpp"
#include "risley/scenes/scene.hpp"

namespace risley::jobs {
namespace {

using namespace recordings::livox;

constexpr double kScanDuration = 600;          // s; then it begins again
constexpr std::size_t kShotsAtOnce = 24'000;   // a multiple of all packets' shots
constexpr std::uint8_t kFirstEcho = 1U << 4U;  // of a tag: first real return
constexpr const char* kRoom = R"(planes:
  - {name: front, distance_m: 12, normal_azimuth_deg: 4, normal_zenith_deg: 90}
  - {name: back, distance_m: 9, normal_azimuth_deg: 180, normal_zenith_deg: 90}
  - {name: left, distance_m: 5, normal_azimuth_deg: 90, normal_zenith_deg: 90}
  - {name: right, distance_m: 6, normal_azimuth_deg: -90, normal_zenith_deg: 90}
  - {name: floor, distance_m: 1.5, normal_azimuth_deg: 0, normal_zenith_deg: 180}
  - {name: ceiling, distance_m: 2.5, normal_azimuth_deg: 0, normal_zenith_deg: 0}
)";

simulation::SimulationSettings settings_of(const SimulationOptions& options) {
  SimulationOptions wanted = options;
  wanted.duration = kScanDuration;
  wanted.rate = 100'000;
  wanted.quantize = false;  // the contents of packets are rounded as by the sensor
  simulation::SimulationSettings settings = simulation_settings(wanted);
  const int type = settings.truth.device_type;
  const std::optional<ShotGrid> grid = grid_of_type(type);
  if (!grid) {
    throw InvalidArgument(
        fmt::format("{} = {}: the device type {} is none that can be emulated, allowed {}",
                    name_of(kSetting.sensor), options.sensor.name(), type, emulated_types_text()));
  }
  settings.rate = 1e9 * grid->interval_denominator / grid->interval_numerator_ns;
  if (!settings.scene) settings.scene = scenes::parse_scene(kRoom, "the built-in room");
  return settings;
}

/// Reads the next shots; the last ones are followed by the first again.
void read_on(const simulation::SimulationSettings& settings,
             std::unique_ptr<simulation::Scanner>& scanner, recordings::Chunk& chunk) {
  recordings::TruthColumns truth;
  if (scanner && scanner->read(chunk, truth, kShotsAtOnce)) return;
  scanner = std::make_unique<simulation::Scanner>(settings);
  scanner->read(chunk, truth, kShotsAtOnce);
}

}  // namespace

EmulatedScan::EmulatedScan(const SimulationOptions& options, const std::string& recording,
                           const ParameterValues& bend)
    : settings_(settings_of(options)), grid_(*grid_of_type(settings_.truth.device_type)) {
  if (recording.empty()) {
    scanner_ = std::make_unique<simulation::Scanner>(settings_);
    device_ = scanner_->header().devices.front();
  } else {
    recorded_.emplace(recording, static_cast<std::uint8_t>(settings_.truth.device_type));
    device_ = recorded_->device();
    grid_ = recorded_->grid();
  }
  if (bend.empty()) return;
  if (recorded_) {
    throw InvalidArgument(
        fmt::format("{} changes simulated optics: it does not apply to the shots of a recording",
                    name_of(kSetting.bend)));
  }
  SimulationOptions bent = options;
  for (const auto& [name, change] : bend) {
    bent.set.emplace_back(name, settings_.truth.get(name) + change);
  }
  bent_settings_ = settings_of(bent);
  // The sensor's own parameters do not change.
  bent_settings_->reported = settings_.reported;
}

void EmulatedScan::read_shots() {
  next_shot_ = 0;
  read_on(settings_, scanner_, chunk_);
  if (bent_settings_) read_on(*bent_settings_, bent_scanner_, bent_chunk_);
}

void EmulatedScan::begin() {
  number_ = imu_number_ = 0;
  set_header(recordings::TimeReference::power_on, 0);
}

void EmulatedScan::set_header(recordings::TimeReference source, std::uint32_t status) {
  // With pulses, the second generation sends complete times, using the hour that the host sets.
  const bool has_pulses = source == recordings::TimeReference::pps;
  header_.timestamp_type = numbered()
                               ? time_type_of(has_pulses ? recordings::TimeReference::utc : source)
                               : timestamp_type_of(source);
  header_.status = status;
}

RecordLayout EmulatedScan::layout_of(std::uint8_t data_type) const {
  if (!numbered()) return *record_layout(data_type);
  constexpr std::uint16_t kRecords = 96;
  return *numbered_layout(data_type, data_type == kNumberedImu ? std::uint16_t{1} : kRecords);
}

std::uint8_t* EmulatedScan::begin_packet(std::uint8_t data_type) {
  const std::size_t head = numbered() ? kNumberedHeaderBytes : kPacketHeaderBytes;
  packet_.resize(head + layout_of(data_type).bytes());
  return &packet_[head];
}

std::span<const std::uint8_t> EmulatedScan::end_packet(std::uint8_t data_type,
                                                       std::int64_t time_ns) {
  if (numbered()) {
    NumberedHeader header;
    header.data_type = data_type;
    header.records = layout_of(data_type).records;
    constexpr std::int64_t kIntervalUnit_ns = 100;
    header.interval = static_cast<std::uint16_t>(
        (grid_.offset_ns(header.records - 1U) + kIntervalUnit_ns / 2) / kIntervalUnit_ns);
    header.number = data_type == kNumberedImu ? imu_number_++ : number_++;
    header.time_type = header_.timestamp_type;
    header.time_ns = static_cast<std::uint64_t>(time_ns);
    encode_numbered_header(header, packet_);
    return packet_;
  }
  recordings::Packet header = header_;
  header.data_type = data_type;
  header.timestamp = encode_timestamp(header.timestamp_type, time_ns);
  encode_packet_header(header, packet_.data());
  return packet_;
}

void EmulatedScan::simulate_shot(bool tagged) {
  if (next_shot_ == chunk_.observations.size()) read_shots();
  const recordings::Observations& shots = (bent_ ? bent_chunk_ : chunk_).observations;
  record_.azimuth[0] = shots.azimuth[next_shot_];
  record_.zenith[0] = shots.zenith[next_shot_];
  record_.range[0] = shots.range[next_shot_];
  record_.valid[0] = shots.valid[next_shot_];
  record_.intensity[0] = shots.intensity[next_shot_];
  record_.tag[0] = tagged && shots.valid[next_shot_] != 0 ? kFirstEcho : std::uint8_t{0};
  ++next_shot_;
}

std::span<const std::uint8_t> EmulatedScan::next(std::uint8_t data_type, std::int64_t time_ns) {
  const RecordLayout layout = layout_of(data_type);
  record_.clear();
  record_.resize(layout.returns);
  std::uint8_t* bytes = begin_packet(data_type);
  for (std::uint32_t shot = 0; shot < layout.records; ++shot) {
    if (recorded_) {
      recorded_->next(record_);
      if (!layout.tagged) std::fill(record_.tag.begin(), record_.tag.end(), std::uint8_t{0});
    } else {
      simulate_shot(layout.tagged && !numbered());
    }
    if (numbered()) {
      encode_numbered_record(data_type, record_, 0, shot, bytes);
    } else {
      encode_record(layout, record_, 0, shot, bytes);
    }
    bytes += layout.bytes_per_record;
  }
  return end_packet(data_type, time_ns);
}

std::span<const std::uint8_t> EmulatedScan::imu(std::int64_t time_ns) {
  const std::uint8_t data_type = numbered() ? kNumberedImu : kImuDataType;
  recordings::ImuSample sample;
  sample.acceleration_g = {0, 0, 1};
  encode_imu(sample, begin_packet(data_type));
  return end_packet(data_type, time_ns);
}

std::uint64_t EmulatedScan::period_numerator_ns(std::uint8_t data_type) const {
  return std::uint64_t{layout_of(data_type).records} * grid_.interval_numerator_ns;
}

std::int64_t EmulatedScan::time_of(std::uint64_t packets, std::uint8_t data_type) const {
  return static_cast<std::int64_t>(packets * period_numerator_ns(data_type) /
                                   grid_.interval_denominator);
}

std::uint64_t EmulatedScan::packets_in(std::int64_t time_ns, std::uint8_t data_type) const {
  return static_cast<std::uint64_t>(time_ns) * grid_.interval_denominator /
         period_numerator_ns(data_type);
}

}  // namespace risley::jobs
