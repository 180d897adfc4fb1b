// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/recorded_scan.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/saturating.hpp"
#include "risley/core/setting.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"

namespace risley::jobs {
namespace {

/// A longer gap is not waited for, ns; the clock jumped.
constexpr std::int64_t kLongestRecordedGap = 10'000'000'000;
/// A tag that contains its return's number.
constexpr unsigned kEchoAt = 4;

double interval_ns(const recordings::livox::ShotGrid& grid) {
  return static_cast<double>(grid.interval_numerator_ns) / grid.interval_denominator;
}

}  // namespace

std::optional<recordings::livox::ShotGrid> grid_of_type(int device_type) {
  const auto type = static_cast<std::uint8_t>(device_type);
  if (type != device_type) return std::nullopt;
  if (const auto grid = recordings::livox::numbered_grid(type)) return grid;
  // Of packets with tags; those without are of the Mid-40, whose grid is the same.
  constexpr std::uint8_t kTagged = 2;
  return recordings::livox::shot_grid(type, kTagged);
}

std::string emulated_types_text() {
  std::string text = recordings::livox_types_text();
  for (const recordings::LivoxType& type : recordings::kLivoxTypes) {
    if (!type.first_generation && grid_of_type(type.number)) {
      text += fmt::format(", {} ({})", type.number, type.name);
    }
  }
  return text;
}

RecordedScan::RecordedScan(std::string path, std::uint8_t sensor_type)
    : path_(std::move(path)), source_(recordings::Source(path_).held_open()) {
  open();
  const recordings::RecordingHeader& header = reader_->header();
  recordings::require_times(header);
  const auto refuse = [&](const std::string& problem) {
    throw InvalidArgument(fmt::format("{} = {}: {}", name_of(kSetting.recording), path_, problem));
  };
  if (!header.has_range) refuse("has no ranges, which packets require");
  if (header.devices.size() != 1) {
    refuse(fmt::format("is of {} sensors, expected one; a virtual sensor is a single one",
                       header.devices.size()));
  }
  device_ = header.devices.front();
  if (device_.type_inferred || !grid_of_type(device_.type)) device_.type = sensor_type;
  const auto grid = grid_of_type(device_.type);
  if (!grid) {
    refuse(fmt::format("its device type {} cannot be emulated, allowed {}; name the sensor",
                       device_.type, emulated_types_text()));
  }
  grid_ = *grid;
  if (!find_row()) throw FileError(path_, {}, "holds no shots that could be sent");
}

void RecordedScan::open() {
  reader_ = recordings::open_recording(source_);
  chunk_.clear();
  row_ = 0;
  begin_ns_.reset();
}

bool RecordedScan::find_row() {
  while (row_ >= chunk_.observations.size()) {
    row_ = 0;
    if (!reader_->read_sound(chunk_)) return false;  // data before the damage were sent
  }
  return true;
}

std::int64_t RecordedScan::slot_of_row() const {
  const std::int64_t since = saturating_difference(chunk_.observations.time_ns[row_], *begin_ns_);
  return std::llround(static_cast<double>(since) / interval_ns(grid_));
}

void RecordedScan::next(recordings::Observations& record) {
  const std::size_t returns = record.size();
  std::fill(record.valid.begin(), record.valid.end(), std::uint8_t{0});
  std::fill(record.range.begin(), record.range.end(), 0.0);
  std::fill(record.azimuth.begin(), record.azimuth.end(), 0.0);
  std::fill(record.zenith.begin(), record.zenith.end(), 0.0);
  std::fill(record.intensity.begin(), record.intensity.end(), std::uint8_t{0});
  std::fill(record.tag.begin(), record.tag.end(), std::uint8_t{0});
  if (!find_row()) {  // over again
    open();
    if (!find_row()) return;
  }
  const auto begin_here = [&] {
    begin_ns_ = saturating_difference(
        chunk_.observations.time_ns[row_],
        static_cast<std::int64_t>(static_cast<double>(slot_) * interval_ns(grid_)));
  };
  if (!begin_ns_) begin_here();
  const auto longest =
      static_cast<std::int64_t>(static_cast<double>(kLongestRecordedGap) / interval_ns(grid_));
  const std::int64_t slot = slot_of_row();
  if (slot > slot_ + longest || slot < slot_ - longest) begin_here();
  for (; find_row() && slot_of_row() <= slot_; ++row_) {
    const recordings::Observations& rows = chunk_.observations;
    const std::size_t number = std::max<std::size_t>(rows.return_number[row_], 1) - 1;
    if (slot_of_row() < slot_ || number >= returns) continue;
    if (rows.valid[row_] == 0) {  // angles without a return are sent, too
      if (number > 0 || !std::isfinite(rows.azimuth[row_]) || !std::isfinite(rows.zenith[row_]))
        continue;
      record.azimuth[0] = rows.azimuth[row_];
      record.zenith[0] = rows.zenith[row_];
      continue;
    }
    record.azimuth[number] = rows.azimuth[row_];
    record.zenith[number] = rows.zenith[row_];
    record.range[number] = rows.range[row_];
    record.intensity[number] = rows.intensity[row_];
    record.valid[number] = 1;
    // The second generation's tags do not contain the return number.
    const bool as_it_is = rows.tag[row_] != 0 || recordings::is_second_generation(device_.type);
    record.tag[number] =
        as_it_is ? rows.tag[row_] : static_cast<std::uint8_t>((number + 1) << kEchoAt);
  }
  ++slot_;
}

}  // namespace risley::jobs
