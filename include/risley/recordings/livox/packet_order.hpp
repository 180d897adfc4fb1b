// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "risley/recordings/livox/clock_watch.hpp"
#include "risley/recordings/livox/packet.hpp"
#include "risley/recordings/livox/packet_decoder.hpp"

namespace risley::recordings::livox {

/// Statistics of one sensor's packets.
struct PacketCounts {
  std::uint64_t packets = 0;      ///< in order, each once, inertial samples among them
  std::uint64_t rows = 0;         ///< observations of those packets
  std::uint64_t imu_samples = 0;  ///< inertial samples of those packets
  /// Packets missing between others, by the times or numbers of those.
  std::uint64_t lost = 0;
  std::uint64_t duplicates = 0;  ///< that were left out
  std::uint64_t reordered = 0;   ///< that were put right
  std::uint64_t late = 0;        ///< of the lost: came too late, and were dropped
  std::uint64_t rejected = 0;    ///< that no sensor sends
  /// Places where the clock of the sensor jumped or restarted, so that nothing can be counted.
  std::uint64_t clock_jumps = 0;
  /// Packets whose checksum is not that of their bytes; they are kept. Second generation only.
  std::uint64_t wrong_checksums = 0;
};

/// Reason for a discontinuity between the times of successive packets.
enum class GapCause : std::uint8_t {
  loss,     ///< packets between them were lost
  clock,    ///< the clock jumped, changed its source or restarted
  session,  ///< the sensor was stopped and restarted between them
};

/// A place where more than 0.1 s is missing, the clock jumped, or another session began. Times are
/// the sensor's, ns.
struct PacketGap {
  std::int64_t from_ns = 0, to_ns = 0;            ///< of the packets around it
  std::int64_t host_from_ns = 0, host_to_ns = 0;  ///< when they came, by the host's clock
  /// Lost packets; between two sessions as many as would be if the sensor had not stopped, which
  /// PacketCounts::lost does not count; empty if the clock jumped.
  std::optional<std::uint64_t> lost;
  bool imu = false;  ///< of inertial samples, not of points
  GapCause cause = GapCause::loss;
};

/// Puts the packets of one sensor in order and counts missing ones. Packets that overtake each
/// other are reordered as long as not more than kWindow came in between. Each generation of sensors
/// has its own: PacketOrder, NumberedOrder.
class PacketSequence {
 public:
  /// Packets that wait for others.
  static constexpr std::size_t kWindow = 64;
  /// Longest time that a packet waits, ns.
  static constexpr std::int64_t kLongestWait = 1'000'000'000;
  /// Number of gaps kept; later ones are only counted.
  static constexpr std::size_t kMostGaps = 1000;
  /// Shorter gaps are only counted, ns.
  static constexpr std::int64_t kNotableGap = 100'000'000;

  virtual ~PacketSequence() = default;

  /// The shot grid of special firmware, which the device type does not determine.
  virtual void set_grid(const ShotGrid& /*grid*/) {}
  /// Adds a datagram that the sensor sent to the data port.
  /// @param host_ns  when it came  @return whether it is a packet
  virtual bool add(std::span<const std::uint8_t> packet, std::int64_t host_ns) = 0;
  /// Advances the time for waiting packets.
  virtual void advance(std::int64_t host_ns) = 0;
  /// No more packets will come, or the sensor has returned: no packet is held back.
  virtual void flush() = 0;
  /// Packets in order since the last call.
  std::vector<std::vector<std::uint8_t>> take();

  /// The sensor's clock and its status, from the packets of points.
  const ClockWatch& clock() const { return clock_; }
  const PacketCounts& counts() const { return counts_; }        ///< of what take() has given
  const std::vector<PacketGap>& gaps() const { return gaps_; }  ///< the first kMostGaps
  /// When the first packet came, by the host's clock; empty before there is one.
  std::optional<std::int64_t> first_host_ns() const { return first_host_ns_; }

 protected:
  /// Keeps a gap, unless there are too many.
  void note_gap(const PacketGap& gap) {
    if (gaps_.size() < kMostGaps) gaps_.push_back(gap);
  }

  PacketCounts counts_;
  std::optional<std::int64_t> first_host_ns_;
  std::vector<std::vector<std::uint8_t>> ready_;
  ClockWatch clock_;

 private:
  std::vector<PacketGap> gaps_;
};

/// Packets of the first generation. They have no numbers, so everything follows from their times
/// and the period of their data type. A jump of the clock ahead differs from loss by the packets'
/// arrival: they can be late, never early. A jump back by less than kWindow packets, or ahead by
/// less than 10 ms, is not detected.
class PacketOrder final : public PacketSequence {
 public:
  /// @param device_type  as recordings::Device::type
  explicit PacketOrder(std::uint8_t device_type);

  void set_grid(const ShotGrid& grid) override { grid_ = grid; }
  bool add(std::span<const std::uint8_t> packet, std::int64_t host_ns) override;
  void advance(std::int64_t host_ns) override;
  /// Times further back than this are those of a restarted clock, and packets missing before it are
  /// a pause between two sessions.
  void flush() override;

 private:
  struct Held {
    std::vector<std::uint8_t> bytes;
    std::int64_t host_ns = 0, period_ns = 0;
    std::uint32_t rows = 0;
  };
  /// Identifies duplicates of a packet: its time and its bytes.
  using Mark = std::pair<std::int64_t, std::size_t>;
  /// When packets came since the clock last jumped.
  struct Arrivals {
    std::int64_t first_time_ns = 0, first_host_ns = 0;
    std::int64_t last_time_ns = 0, last_host_ns = 0;
    /// Greatest difference of sensor's and host's time: of the last seconds, and of those before.
    std::int64_t offset_ns = 0, offset_before_ns = 0, turn_ns = 0;
    bool empty = true;

    void add(std::int64_t time_ns, std::int64_t host_ns);
    /// Whether the sensor's clock runs as fast as the host's, as far as the packets show.
    bool in_real_time() const;
    /// How much earlier a packet arrives than it can have been sent, ns; negative: it does not.
    std::int64_t early_ns(std::int64_t time_ns, std::int64_t host_ns) const;
  };
  /// Points, or inertial samples.
  struct Track {
    std::map<std::int64_t, Held> held;  // by time
    std::optional<std::int64_t> last_ns;
    std::int64_t last_period_ns = 0, last_host_ns = 0;
    std::deque<Mark> recent;                          // of the last packets returned
    std::vector<std::pair<std::int64_t, Held>> late;  // one after the other, by time
    std::optional<std::uint8_t> timestamp_type;
    bool jumped = false;   // before the next packet
    bool flushed = false;  // before the next packet
    bool paused = false;   // before the next packet returned
    Arrivals arrivals;
  };

  void place(Track& track, std::int64_t time_ns, Held&& packet);
  void place_late(Track& track, std::int64_t time_ns, Held&& packet);
  std::int64_t passed_ns(const Track& track, std::int64_t time_ns, const Held& packet) const;
  void restart(Track& track);
  void give_out(Track& track);
  std::int64_t period_of(std::uint8_t data_type) const;

  std::uint8_t device_type_;
  std::optional<ShotGrid> grid_;
  PacketDecoder decoder_;
  Chunk chunk_;
  std::array<Track, 2> tracks_;
};

}  // namespace risley::recordings::livox
