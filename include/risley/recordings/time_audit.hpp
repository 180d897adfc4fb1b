// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"
#include "risley/recordings/observations.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::recordings {

/// Smallest and largest value; empty when there was none.
struct ValueRange {
  double min, max;
};

/// Missing time inside a recording.
struct TimeGaps {
  std::uint64_t count = 0;
  double total_s = 0;                 ///< missing time: the steps without their nominal steps
  double largest_s = 0;               ///< missing time of the largest one
  std::int64_t largest_after_ns = 0;  ///< time of the last shot before it
  std::uint64_t largest_at_row = 0;   ///< first row after it, from 0
};

/// Packet statistics of a sensor of the second generation.
struct NumberedAudit {
  std::int64_t lost_packets = 0;   ///< missing between others, by their numbers
  std::uint64_t outside_view = 0;  ///< rows outside the configured field of view
  std::array<std::uint64_t, 256> observations_by_tag{};  ///< valid rows
};

/// Contents of a recording and quality of its times.
struct TimeAuditResult {
  std::uint64_t observations = 0;  ///< rows: one per return
  std::uint64_t shots = 0;
  /// Rows that are not valid, without those outside a configured field of view.
  std::uint64_t no_return = 0;
  std::int64_t first_time_ns = 0, last_time_ns = 0;  ///< of the first and the last row
  /// From the first to the last shot of the device with the longest recording, s; jumps of the
  /// clock, back or to another time source, do not count.
  double duration_s = 0;
  double nominal_step_s = 0;  ///< median time between two shots of one device
  double rate_hz = 0;         ///< shots of one device per second, excluding gaps; 0 when unknown
  TimeGaps gaps;              ///< steps longer than 1.8 nominal steps
  /// Backward jumps, and jumps at a change of the time source. Packets that are repeated or late by
  /// less than 10 ms do not count.
  std::uint64_t time_resets = 0;
  std::uint64_t non_monotonic_packets = 0;    ///< not later than the device's previous packet
  std::uint64_t pps_wraps = 0;                ///< Reader::clock_wraps(), when a reader was audited
  std::optional<ValueRange> azimuth, zenith;  ///< of valid rows, rad
  std::optional<ValueRange> range;            ///< of valid rows that have one, m
  std::array<std::uint64_t, 256> rows_by_return_number{};
  std::vector<std::uint64_t> rows_by_device;             ///< up to the last device with rows
  std::array<std::uint64_t, 18> packets_by_data_type{};  ///< data types 0 to 17
  /// By device, of those of the second generation; not more than the header has.
  std::vector<std::optional<NumberedAudit>> numbered_by_device;
  std::uint64_t imu = 0;  ///< inertial samples
};

/// Audits a recording chunk by chunk; its memory does not grow with the recording.
class TimeAudit {
 public:
  TimeAudit() = default;
  /// Of a recording with these devices.
  explicit TimeAudit(const RecordingHeader& header);

  /// @throws InvalidArgument as require_columns()
  void add(const Chunk& chunk);

  /// What was seen so far.
  TimeAuditResult result() const;

 private:
  /// Number of steps kept until the nominal step is known.
  static constexpr std::size_t kStepsForMedian = 4096;

  struct TimeStep {
    std::int64_t step_ns, before_ns;
    std::uint64_t row;
    bool source_changed;
  };

  /// One device. A shot is compared with the previous shot of the same device.
  struct DeviceState {
    std::uint64_t rows = 0;
    bool started = false, source_changed = false, late_packet = false;
    std::int64_t last_shot_ns = 0;
    std::uint8_t last_return = 0;
    std::optional<std::int64_t> last_packet_ns;
    std::optional<std::uint8_t> timestamp_type;
    std::vector<TimeStep> first_steps;
    std::int64_t nominal_ns = 0;  // 0 until it is known
    std::int64_t covered_ns = 0;
    std::int64_t regular_ns = 0;
    std::uint64_t regular_steps = 0;
    std::uint64_t resets = 0;
    TimeGaps gaps;
  };

  void add_numbered(const Chunk& chunk);
  void add_row(const Observations& rows, std::size_t row);
  void add_packet(const Packet& packet, std::uint8_t device, std::int64_t time_ns);
  static void add_step(DeviceState& state, const TimeStep& step);
  static void settle(DeviceState& state);

  TimeAuditResult totals_;
  std::map<std::pair<std::uint8_t, bool>, livox::PacketNumbers> numbers_;  // by device; inertial
  std::vector<DeviceState> devices_;
};

/// Reads a recording to its end and audits it. @throws FileError at damage
TimeAuditResult audit_recording(Reader& reader, const Progress& progress = {});

}  // namespace risley::recordings
