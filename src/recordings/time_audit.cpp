// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/time_audit.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "risley/core/median.hpp"
#include "risley/core/saturating.hpp"

namespace risley::recordings {
namespace {

constexpr double kSecondsPerNanosecond = 1e-9;
constexpr double kGapFactor = 1.8;
constexpr std::int64_t kLatePacket_ns = 10'000'000;

/// Least and greatest of some values; NaN does not count.
class Extremes {
 public:
  void add(double value) {
    if (value < low_) low_ = value;
    if (value > high_) high_ = value;
  }
  void include_in(std::optional<ValueRange>& range) const {
    if (!(low_ <= high_)) return;
    if (!range) range = ValueRange{low_, high_};
    range->min = std::min(range->min, low_);
    range->max = std::max(range->max, high_);
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double low_ = kInfinity, high_ = -kInfinity;
};

bool is_gap(std::int64_t step_ns, std::int64_t nominal_ns) {
  return static_cast<double>(step_ns) > kGapFactor * static_cast<double>(nominal_ns);
}

/// Counts the contents of rows, in any order.
void count_columns(const Observations& o, TimeAuditResult& totals) {
  Extremes azimuth, zenith, range;
  for (std::size_t row = 0; row < o.size(); ++row) {
    ++totals.rows_by_return_number[o.return_number[row]];
    if (o.valid[row] == 0) {
      ++totals.no_return;
      continue;
    }
    azimuth.add(o.azimuth[row]);
    zenith.add(o.zenith[row]);
    range.add(o.range[row]);
  }
  azimuth.include_in(totals.azimuth);
  zenith.include_in(totals.zenith);
  range.include_in(totals.range);
}

}  // namespace

TimeAudit::TimeAudit(const RecordingHeader& header) {
  const auto is_second = [](const Device& one) { return is_second_generation(one.type); };
  if (std::none_of(header.devices.begin(), header.devices.end(), is_second)) return;
  for (const Device& device : header.devices) {
    auto& numbered = totals_.numbered_by_device.emplace_back();
    if (is_second(device)) numbered.emplace();
  }
}

/// Counts data reported only by sensors of the second generation.
void TimeAudit::add_numbered(const Chunk& chunk) {
  auto& devices = totals_.numbered_by_device;
  const Observations& o = chunk.observations;
  for (std::size_t row = 0; row < o.size(); ++row) {
    if (o.device[row] >= devices.size() || !devices[o.device[row]]) continue;
    NumberedAudit& device = *devices[o.device[row]];
    if (o.valid[row] != 0) {
      ++device.observations_by_tag[o.tag[row]];
    } else if (o.range[row] == 0 && o.intensity[row] == livox::kOutsideViewIntensity) {
      ++device.outside_view;
      --totals_.no_return;
    }
  }
  std::size_t row = 0, sample = 0;
  for (const Packet& packet : chunk.packets) {
    const bool is_imu = packet.is_imu();
    const bool known = is_imu ? sample < chunk.imu.size() : row < o.size();
    if (!known) break;
    const std::uint8_t device = is_imu ? chunk.imu[sample].device : o.device[row];
    row += packet.rows;
    sample += is_imu ? 1 : 0;
    if (packet.version != livox::kNumberedVersion || device >= devices.size() || !devices[device]) {
      continue;
    }
    const auto place = numbers_[{device, is_imu}].add(packet);
    devices[device]->lost_packets +=
        place.kind == livox::PacketNumbers::Kind::late ? -1 : static_cast<std::int64_t>(place.lost);
  }
}

void TimeAudit::add(const Chunk& chunk) {
  const Observations& o = chunk.observations;
  require_columns(o);
  totals_.imu += chunk.imu.size();
  count_columns(o, totals_);
  if (!totals_.numbered_by_device.empty()) add_numbered(chunk);
  std::size_t row = 0;
  for (const Packet& packet : chunk.packets) {
    if (packet.data_type < totals_.packets_by_data_type.size()) {
      ++totals_.packets_by_data_type[packet.data_type];
    }
    const std::size_t end = std::min<std::size_t>(row + packet.rows, o.size());
    if (row < end) add_packet(packet, o.device[row], o.time_ns[row]);
    for (; row < end; ++row) add_row(o, row);
  }
  for (; row < o.size(); ++row) add_row(o, row);
}

void TimeAudit::add_packet(const Packet& packet, std::uint8_t device, std::int64_t time_ns) {
  if (device >= devices_.size()) devices_.resize(device + std::size_t{1});
  DeviceState& state = devices_[device];
  state.source_changed = state.timestamp_type && *state.timestamp_type != packet.timestamp_type;
  state.timestamp_type = packet.timestamp_type;
  state.late_packet = false;
  if (state.last_packet_ns && time_ns <= *state.last_packet_ns && !state.source_changed) {
    ++totals_.non_monotonic_packets;
    state.late_packet = saturating_difference(*state.last_packet_ns, time_ns) < kLatePacket_ns;
  }
  if (!state.late_packet) state.last_packet_ns = time_ns;
}

void TimeAudit::add_row(const Observations& o, std::size_t row) {
  const std::uint8_t device = o.device[row];
  const std::int64_t time = o.time_ns[row];
  if (device >= devices_.size()) devices_.resize(device + std::size_t{1});
  DeviceState& state = devices_[device];
  if (totals_.observations == 0) totals_.first_time_ns = time;
  totals_.last_time_ns = time;
  const std::uint64_t row_number = totals_.observations++;
  ++state.rows;
  const bool same_shot =
      state.started && time == state.last_shot_ns && o.return_number[row] > state.last_return;
  state.last_return = o.return_number[row];
  if (same_shot) return;
  ++totals_.shots;
  // Shots of a late packet fill an earlier hole.
  if (state.late_packet && time <= state.last_shot_ns) return;
  if (state.started) {
    add_step(state, {saturating_difference(time, state.last_shot_ns), state.last_shot_ns,
                     row_number, state.source_changed});
  }
  state.source_changed = false;
  state.started = true;
  state.last_shot_ns = time;
}

void TimeAudit::add_step(DeviceState& state, const TimeStep& step) {
  if (step.step_ns < 0) {
    ++state.resets;
    return;
  }
  if (state.nominal_ns == 0) {
    state.first_steps.push_back(step);
    if (state.first_steps.size() == kStepsForMedian) settle(state);
    return;
  }
  const bool gap = is_gap(step.step_ns, state.nominal_ns);
  if (gap && step.source_changed) {
    ++state.resets;
    return;
  }
  state.covered_ns = saturating_sum(state.covered_ns, step.step_ns);
  if (!gap) {
    state.regular_ns = saturating_sum(state.regular_ns, step.step_ns);
    ++state.regular_steps;
    return;
  }
  const double missing_s =
      static_cast<double>(step.step_ns - state.nominal_ns) * kSecondsPerNanosecond;
  ++state.gaps.count;
  state.gaps.total_s += missing_s;
  if (missing_s > state.gaps.largest_s) {
    state.gaps.largest_s = missing_s;
    state.gaps.largest_after_ns = step.before_ns;
    state.gaps.largest_at_row = step.row;
  }
}

/// Uses the median of the steps so far as the nominal step and judges them by it.
void TimeAudit::settle(DeviceState& state) {
  std::vector<TimeStep> steps;
  steps.swap(state.first_steps);
  std::vector<std::int64_t> lengths;
  for (const TimeStep& step : steps) {
    if (step.step_ns > 0) lengths.push_back(step.step_ns);
  }
  if (lengths.empty()) return;
  state.nominal_ns = upper_median(lengths);
  for (const TimeStep& step : steps) add_step(state, step);
}

TimeAuditResult TimeAudit::result() const {
  TimeAuditResult result = totals_;
  std::int64_t regular_ns = 0, covered_ns = 0;
  std::uint64_t regular_steps = 0;
  for (DeviceState state : devices_) {
    if (state.nominal_ns == 0) settle(state);
    result.rows_by_device.push_back(state.rows);
    result.time_resets += state.resets;
    result.gaps.count += state.gaps.count;
    result.gaps.total_s += state.gaps.total_s;
    if (state.gaps.largest_s > result.gaps.largest_s) {
      result.gaps.largest_s = state.gaps.largest_s;
      result.gaps.largest_after_ns = state.gaps.largest_after_ns;
      result.gaps.largest_at_row = state.gaps.largest_at_row;
    }
    covered_ns = std::max(covered_ns, state.covered_ns);
    regular_ns = saturating_sum(regular_ns, state.regular_ns);
    regular_steps += state.regular_steps;
    if (result.nominal_step_s == 0) {
      result.nominal_step_s = static_cast<double>(state.nominal_ns) * kSecondsPerNanosecond;
    }
  }
  result.duration_s = static_cast<double>(covered_ns) * kSecondsPerNanosecond;
  if (regular_ns > 0) {
    result.rate_hz = static_cast<double>(regular_steps) /
                     (static_cast<double>(regular_ns) * kSecondsPerNanosecond);
  }
  return result;
}

TimeAuditResult audit_recording(Reader& reader, const Progress& progress) {
  TimeAudit audit(reader.header());
  Chunk chunk;
  while (reader.read(chunk)) {
    audit.add(chunk);
    progress.report(reader.fraction_read());
  }
  TimeAuditResult result = audit.result();
  result.pps_wraps = reader.clock_wraps();
  return result;
}

}  // namespace risley::recordings
