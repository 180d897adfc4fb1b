// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace risley::recordings::livox {

/// The facts in a status, each in words: "motor: warning", "PPS signal". Empty for a healthy
/// sensor without a signal. @param status  Packet::status
std::vector<std::string> status_words(std::uint32_t status);

/// Behaviour of a sensor's clock compared with the host's.
struct ClockDrift {
  double ppm = 0;        ///< by which the sensor's clock is faster
  double sigma_ppm = 0;  ///< one standard deviation
};

/// A period in which the clock of a sensor neither jumped nor changed its source.
struct ClockStretch {
  std::uint8_t timestamp_type = 0;                ///< Packet::timestamp_type
  std::int64_t host_from_ns = 0, host_to_ns = 0;  ///< when its packets came, by the host's clock
  /// Sensor's time less the host's, ns, of the packets that came with the least delay: least and
  /// greatest of all seconds.
  std::int64_t least_offset_ns = 0, greatest_offset_ns = 0;
  std::optional<ClockDrift> drift;  ///< empty if it was too short
};

/// A status that a sensor reports from some time on.
struct StatusChange {
  std::int64_t host_ns = 0;  ///< when the packet came
  std::uint32_t status = 0;  ///< Packet::status
};

/// Tracks the clock of a sensor against the host's, and its status. Packets can be late, but never
/// early: of every second the packet with the least delay is used, and a line through those gives
/// the drift. Memory does not grow with the time.
class ClockWatch {
 public:
  /// Number of stretches kept; later ones are dropped.
  static constexpr std::size_t kMostStretches = 100;
  /// Number of status changes kept; later ones are dropped.
  static constexpr std::size_t kMostChanges = 1000;

  /// A packet, in the order of the sensor's times.
  /// @param time_ns  the sensor's  @param host_ns  when it came
  void add(std::uint8_t timestamp_type, std::uint32_t status, std::int64_t time_ns,
           std::int64_t host_ns);
  /// The clock jumped: the next packet begins another stretch.
  void jump() { jumped_ = true; }

  /// So far, one after the other.
  std::vector<ClockStretch> stretches() const;
  /// So far; the first one is that of the first packet.
  const std::vector<StatusChange>& status_changes() const { return changes_; }

 private:
  /// Sums of a line through offsets over time.
  struct Line {
    std::int64_t begin_host_ns = 0, begin_offset_ns = 0;
    double points = 0, mean_x = 0, mean_y = 0;  // s, ns since the beginning
    double xx = 0, xy = 0, yy = 0;              // about the means

    void add(std::int64_t host_ns, std::int64_t offset_ns);
    std::optional<ClockDrift> drift() const;
  };
  /// The packet of a second that came with the least delay.
  struct Best {
    std::int64_t second_ends_ns = 0, host_ns = 0, offset_ns = 0;
  };

  void end_second();

  std::vector<ClockStretch> stretches_;  // the last one is open, without its last second
  Line line_;
  Best best_;
  bool jumped_ = true;
  std::vector<StatusChange> changes_;
  std::optional<std::uint32_t> status_;
};

}  // namespace risley::recordings::livox
