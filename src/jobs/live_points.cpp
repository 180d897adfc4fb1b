// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/live_points.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "risley/bags/bag_writer.hpp"
#include "risley/bags/messages.hpp"
#include "risley/cloud/make_cloud.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/parallel/parallel.hpp"

#include "jobs/network_unit.hpp"

namespace risley::jobs {
namespace {

/// Packets that overtake each other by less are reordered, ns.
constexpr std::int64_t kHold = 5'000'000;
/// Interval between checks of packets.
constexpr std::chrono::milliseconds kLookAfter(4);
/// After a longer step of the sensor's clock everything restarts, ns: rotors hunt.
constexpr std::int64_t kLongestLiveStep = 500'000'000;

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// Packets between two threads.
class PacketQueue {
 public:
  struct Packet {
    std::vector<std::uint8_t> bytes;
    std::int64_t host_ns = 0;
  };

  /// @return false if there is no room
  bool add(std::span<const std::uint8_t> packet, std::int64_t host_ns) {
    const std::scoped_lock lock(mutex_);
    if (waiting_.size() >= LivePoints::kMostWaiting || ended_) return ended_;
    waiting_.push_back({{packet.begin(), packet.end()}, host_ns});
    return true;
  }

  /// Nothing more will come.
  void end() {
    {
      const std::scoped_lock lock(mutex_);
      ended_ = true;
    }
    changed_.notify_all();
  }

  /// Replaces packets by those that came since, after a short while.
  /// @return false if no more will come
  bool take(std::vector<Packet>& packets) {
    packets.clear();
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kLookAfter, [this] { return ended_; });
    std::swap(packets, waiting_);
    return !ended_ || !packets.empty();
  }

 private:
  std::mutex mutex_;  // of all that follows
  std::condition_variable changed_;
  std::vector<Packet> waiting_;
  bool ended_ = false;
};

/// Statistics of durations in constant memory: steps of 1 ms, those above together.
class Latencies {
 public:
  void add(std::int64_t ns) {
    const std::int64_t step = std::clamp<std::int64_t>(ns / kStep, 0, std::ssize(counts_) - 1);
    ++counts_[static_cast<std::size_t>(step)];
    ++all_;
    longest_ns_ = std::max(longest_ns_, ns);
  }
  /// s; empty where there is none.
  std::optional<double> quantile(double share) const {
    if (all_ == 0) return std::nullopt;
    std::uint64_t sum = 0;
    for (std::size_t step = 0; step < counts_.size(); ++step) {
      sum += counts_[step];
      if (static_cast<double>(sum) < share * static_cast<double>(all_)) continue;
      const auto end = static_cast<std::int64_t>(step + 1) * kStep;
      return 1e-9 * static_cast<double>(std::min(end, longest_ns_));
    }
    return longest();
  }
  std::optional<double> longest() const {
    return all_ == 0 ? std::nullopt : std::optional(1e-9 * static_cast<double>(longest_ns_));
  }

 private:
  static constexpr std::int64_t kStep = 1'000'000;
  std::array<std::uint64_t, 2000> counts_{};
  std::uint64_t all_ = 0;
  std::int64_t longest_ns_ = 0;
};

/// Rows of a running sensor, frame by frame. At a jump of the clock a recording ends, and the next
/// one begins.
class LiveReader final : public recordings::Reader {
 public:
  LiveReader(PacketQueue& queue, const WatchedSensor& unit, std::int64_t frame_ns)
      : queue_(queue), packets_(unit.device_type), frame_ns_(frame_ns) {
    header_.format = "live";
    recordings::Device device;
    device.serial = unit.serial;
    device.type = unit.device_type;
    header_.devices = {device};
  }

  UnitPackets& packets() { return packets_; }
  /// Arrival of the first packet of the last chunk.
  std::int64_t host_ns() const { return host_ns_; }
  /// No complete frame is waiting.
  bool has_caught_up() const { return arrived_.size() == next_ && !frame_is_whole(); }
  /// Packets dropped so far because they came too late.
  std::uint64_t late_packets() const { return late_; }
  /// Nothing will come any more.
  bool ended() const { return ended_; }

  bool read(recordings::Chunk& chunk, std::size_t /*max_rows*/) override {
    chunk.clear();
    bool silent = false;
    for (;;) {
      if (frame_is_whole() || (!held_.empty() && (silent || ended_ || jumped_))) {
        give_frame(chunk);
        return true;
      }
      if (std::exchange(jumped_, false)) {
        given_to_ns_.reset();
        newest_ns_.reset();
        if (std::exchange(any_, false)) return false;  // another recording begins
      }
      if (next_ == arrived_.size()) {
        if (ended_) return false;
        next_ = 0;
        ended_ = !queue_.take(arrived_);
        silent = arrived_.empty() && !held_.empty() && now_ns() - last_host_ns_ > frame_ns_;
      }
      while (next_ < arrived_.size() && !frame_is_whole() && hold(arrived_[next_])) ++next_;
    }
  }

  double fraction_read() const override { return 0; }

 private:
  struct Held {
    recordings::Observations rows;
    std::int64_t host_ns = 0;
  };

  bool frame_is_whole() const {
    return !held_.empty() && *newest_ns_ - held_.begin()->first >= frame_ns_ + kHold;
  }

  /// @return false where the clock jumps before it
  bool hold(const PacketQueue::Packet& packet) {
    one_.clear();
    try {
      if (!packets_.decode(packet.bytes, one_)) return true;
    } catch (const recordings::livox::BadPacket&) {  // the recording counts it
      return true;
    }
    if (one_.observations.size() == 0) return true;
    const std::int64_t begin = one_.observations.time_ns.front();
    const std::int64_t step = newest_ns_ ? begin - *newest_ns_ : 0;
    if (std::llabs(step) > kLongestLiveStep) {
      jumped_ = true;
      return false;
    }
    last_host_ns_ = packet.host_ns;
    if (given_to_ns_ && begin <= *given_to_ns_) {
      ++late_;
      return true;
    }
    newest_ns_ = std::max(newest_ns_.value_or(begin), begin);
    if (!std::exchange(any_, true)) header_.time_reference = packets_.time_reference();
    // Duplicates are dropped.
    held_.try_emplace(begin, Held{std::move(one_.observations), packet.host_ns});
    return true;
  }

  void give_frame(recordings::Chunk& chunk) {
    const std::int64_t begin = held_.begin()->first;
    host_ns_ = held_.begin()->second.host_ns;
    while (!held_.empty()) {
      const auto first = held_.begin();
      const recordings::Observations& rows = first->second.rows;
      if (chunk.observations.size() > 0 && rows.time_ns.back() - begin >= frame_ns_) break;
      host_ns_ = std::min(host_ns_, first->second.host_ns);
      given_to_ns_ = first->first;
      chunk.observations.append(rows);
      held_.erase(first);
    }
  }

  PacketQueue& queue_;
  UnitPackets packets_;
  std::int64_t frame_ns_;
  std::vector<PacketQueue::Packet> arrived_;
  std::size_t next_ = 0;               // of these
  std::map<std::int64_t, Held> held_;  // by time
  std::optional<std::int64_t> newest_ns_, given_to_ns_;
  std::int64_t host_ns_ = 0, last_host_ns_ = 0;
  std::uint64_t late_ = 0;
  bool any_ = false, jumped_ = false, ended_ = false;
  recordings::Chunk one_;
};

/// Counts the messages written to a bag.
class CountedBag final : public bags::BagWriter {
 public:
  explicit CountedBag(bags::BagWriter& bag) : bag_(bag) {}
  std::uint64_t messages() const { return messages_; }

  std::size_t add(const bags::Topic& topic) override { return bag_.add(topic); }
  void write(std::size_t topic, const bags::Message& message) override {
    bag_.write(topic, message);
    ++messages_;
  }
  void close() override { bag_.close(); }

 private:
  bags::BagWriter& bag_;
  std::uint64_t messages_ = 0;
};

/// A name that topics may have.
std::string topic_part(const std::string& serial) {
  std::string part = serial;
  std::ranges::replace_if(
      part, [](unsigned char letter) { return std::isalnum(letter) == 0; }, '_');
  return part;
}

}  // namespace

/// The points of one sensor.
class LivePoints::Unit {
 public:
  Unit(const WatchedSensor& unit, SensorOfUnit sensor, const LivePointsOptions& options,
       std::string topic)
      : options_(options),
        bag_(*options.bag),
        sensor_(std::move(sensor)),
        reader_(queue_, unit, static_cast<std::int64_t>(1e9 / options.messages.frame_rate)) {
    options_.messages.topic = std::move(topic);
    state_.is_calibrated = sensor_.is_given;
    if (!sensor_.sensor) {
      state_.words = kNoPreset;
      return;
    }
    state_.calibration = sensor_.sensor->name;
    settings_.live = true;
    settings_.pointing.reported_directions = !sensor_.is_given;
    // Now, so that viewers subscribe before the first points.
    bag_.add(bags::topic_of(options_.messages.topic, *options_.messages.message,
                            bags::Serialisation::cdr));
    thread_ = std::thread([this] { run(); });
  }

  ~Unit() {
    cancel_.set();
    queue_.end();
    if (thread_.joinable()) thread_.join();
  }
  Unit(const Unit&) = delete;
  Unit& operator=(const Unit&) = delete;

  void set_grid(const recordings::livox::ShotGrid& grid) {
    const std::scoped_lock lock(mutex_);
    grid_ = grid;
  }

  void add(std::span<const std::uint8_t> packet, std::int64_t host_ns) {
    if (thread_.joinable() && !queue_.add(packet, host_ns)) ++overflow_;
  }

  void end() { queue_.end(); }

  void wait_until(std::chrono::steady_clock::time_point latest) {
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, latest, [this] { return over_ || !thread_.joinable(); });
  }

  PublishedPoints published() const {
    const std::scoped_lock lock(mutex_);
    PublishedPoints result = state_;
    result.missing_packets += overflow_;
    return result;
  }

 private:
  void run() {
    parallel::Threads alone(1);  // recording needs the other cores
    try {
      alone.run([this] {
        while (!reader_.ended()) follow();
      });
    } catch (const Cancelled&) {
    } catch (const InvalidArgument& error) {  // it would come again
      const std::scoped_lock lock(mutex_);
      state_.words = error.what();
    }
    const std::scoped_lock lock(mutex_);
    over_ = true;
    changed_.notify_all();
  }

  /// Until the sensor's clock jumps, its rotors are lost or no more packets will come.
  void follow() {
    std::string words;
    try {
      {
        const std::scoped_lock lock(mutex_);
        if (grid_) reader_.packets().set_grid(*grid_);
      }
      const PublishedPoints before = published();
      const auto sink = [this](const cloud::CloudHeader& header) {
        return cloud::write_cloud_into(bag_, bags::BagKind::mcap, header, options_.messages);
      };
      cloud::CloudMaker maker(reader_, *sensor_.sensor, sink, settings_, progress_);
      bool caught_up = false;
      while (maker.next()) {
        if (caught_up) latencies_.add(now_ns() - reader_.host_ns());
        caught_up = caught_up || reader_.has_caught_up();
        progress_.check();
        take(before, maker.summary());
      }
    } catch (const Cancelled&) {
      throw;
    } catch (const InvalidArgument&) {
      throw;
    } catch (const std::exception& error) {  // such as rotors not yet turning
      words = error.what();
    }
    const std::scoped_lock lock(mutex_);
    if (!reader_.ended()) state_.words = words;
  }

  void take(const PublishedPoints& before, const cloud::CloudSummary& summary) {
    const std::scoped_lock lock(mutex_);
    state_.words.clear();
    state_.points = before.points + summary.points;
    state_.frames = bag_.messages();
    state_.missing_packets = reader_.late_packets();
    state_.latency = latencies_.quantile(0.99);
    state_.longest_latency = latencies_.longest();
  }

  LivePointsOptions options_;
  CountedBag bag_;
  SensorOfUnit sensor_;
  cloud::CloudOptions settings_;
  PacketQueue queue_;
  std::atomic<std::uint64_t> overflow_{0};

  mutable std::mutex mutex_;  // of all that follows
  std::condition_variable changed_;
  PublishedPoints state_;
  std::optional<recordings::livox::ShotGrid> grid_;
  bool over_ = false;

  CancelFlag cancel_;
  Progress progress_{[](double, std::string_view) {}, &cancel_};
  LiveReader reader_;  // of the thread
  Latencies latencies_;
  std::thread thread_;
};

std::optional<sensors::Sensor> require_usable(const LivePointsOptions& options) {
  require_between(kSetting.frame_rate, options.messages.frame_rate, kSlowestLiveFrames,
                  kFastestLiveFrames);
  return given_sensor(options.calibration);
}

LivePoints::LivePoints(const std::vector<WatchedSensor>& sensors,
                       const LivePointsOptions& options) {
  const std::optional<sensors::Sensor> given = require_usable(options);
  for (const WatchedSensor& sensor : sensors) {
    std::string topic = options.messages.topic;
    if (sensors.size() > 1) topic += "/" + topic_part(sensor.serial);
    units_.push_back(std::make_unique<Unit>(
        sensor, sensor_of_unit(sensor, given, options.calibration.name()), options, topic));
  }
}
LivePoints::~LivePoints() = default;

void LivePoints::set_grid(std::size_t sensor, const recordings::livox::ShotGrid& grid) {
  units_[sensor]->set_grid(grid);
}
void LivePoints::add(std::size_t sensor, std::span<const std::uint8_t> packet,
                     std::int64_t host_ns) {
  units_[sensor]->add(packet, host_ns);
}

void LivePoints::finish(double longest) {
  for (const auto& unit : units_) unit->end();
  const auto latest = std::chrono::steady_clock::now() +
                      std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                          std::chrono::duration<double>(longest));
  for (const auto& unit : units_) unit->wait_until(latest);
}

std::vector<PublishedPoints> LivePoints::published() const {
  std::vector<PublishedPoints> result;
  for (const auto& unit : units_) result.push_back(unit->published());
  return result;
}

}  // namespace risley::jobs
