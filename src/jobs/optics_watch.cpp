// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/optics_watch.hpp"

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/recordings/livox/packet_decoder.hpp"

#include "jobs/network_unit.hpp"

namespace risley::jobs {
namespace {

using recordings::livox::ShotGrid;

/// One of this many shots with a return is shown, and at most this many are kept for the viewer:
/// some seconds. The number is prime, so that every emitter is among them.
constexpr std::size_t kShownOf = 61, kMostSeen = 10'000;

/// Data of a sensor used only by the thread.
struct Followed {
  explicit Followed(std::uint8_t device_type) : packets(device_type) {}

  UnitPackets packets;
  std::optional<estimation::RunningEstimate> estimate;
  std::size_t returns = 0;  // since the last one shown
};

}  // namespace

class OpticsWatch::Work {
 public:
  Work(const std::vector<WatchedSensor>& sensors, const GivenSensor& reference) {
    const std::optional<sensors::Sensor> given = given_sensor(reference);
    for (const WatchedSensor& watched : sensors) {
      OpticsHealth& health = health_.emplace_back();
      SensorOfUnit& sensor =
          sensors_.emplace_back(sensor_of_unit(watched, given, reference.name()));
      health.is_reference = sensor.is_given;
      if (sensor.sensor) {
        health.reference = sensor.sensor->name;
      } else {
        health.words = kNoPreset;
      }
      followed_.emplace_back(watched.device_type);
    }
    grids_.resize(sensors.size());
    seen_.resize(sensors.size());
    thread_ = std::thread([this] { run(); });
  }

  ~Work() {
    {
      const std::scoped_lock lock(mutex_);
      ending_ = true;
      cancel_.set();
    }
    changed_.notify_all();
    thread_.join();
  }
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;

  void set_grid(std::size_t sensor, const ShotGrid& grid) {
    const std::scoped_lock lock(mutex_);
    grids_[sensor] = grid;
  }

  void add(std::size_t sensor, std::span<const std::uint8_t> packet) {
    const std::scoped_lock lock(mutex_);
    OpticsHealth& health = health_[sensor];
    if (!health.words.empty()) return;
    if (waiting_.size() >= kMostWaiting) {
      ++health.dropped_packets;
      return;
    }
    waiting_.push_back({sensor, {packet.begin(), packet.end()}});
    changed_.notify_all();
  }

  void finish(double longest) {
    std::unique_lock lock(mutex_);
    if (changed_.wait_for(lock, std::chrono::duration<double>(longest),
                          [this] { return waiting_.empty() && !busy_; })) {
      return;
    }
    for (const Waiting& one : waiting_) ++health_[one.sensor].dropped_packets;
    waiting_.clear();
  }

  std::vector<OpticsHealth> health() const {
    const std::scoped_lock lock(mutex_);
    return health_;
  }

  std::vector<SeenShot> take_seen(std::size_t sensor) {
    const std::scoped_lock lock(mutex_);
    return std::exchange(seen_[sensor], {});
  }

 private:
  struct Waiting {
    std::size_t sensor = 0;
    std::vector<std::uint8_t> packet;
  };

  void run() {
    parallel::Threads alone(1);  // recording needs the other cores
    try {
      alone.run([this] {
        while (const std::optional<Waiting> one = next()) take(*one);
      });
    } catch (const Cancelled&) {
    }
  }

  /// The packet that has waited longest, as soon as there is one; none at the end.
  std::optional<Waiting> next() {
    std::unique_lock lock(mutex_);
    busy_ = false;
    if (waiting_.empty()) changed_.notify_all();
    changed_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
    if (ending_) return std::nullopt;
    busy_ = true;
    Waiting first = std::move(waiting_.front());
    waiting_.pop_front();
    return first;
  }

  void take(const Waiting& one) {
    try {
      follow(one);
    } catch (const Cancelled&) {
      throw;
    } catch (const recordings::livox::BadPacket&) {  // counted by the writer of the file
    } catch (const std::exception& error) {          // such as out of memory: the recording
                                                     // continues
      const std::scoped_lock lock(mutex_);
      health_[one.sensor].words = error.what();
    }
  }

  void follow(const Waiting& one) {
    Followed& followed = followed_[one.sensor];
    chunk_.clear();
    {
      const std::scoped_lock lock(mutex_);
      if (grids_[one.sensor]) followed.packets.set_grid(*grids_[one.sensor]);
    }
    if (!followed.packets.decode(one.packet, chunk_)) return;
    if (!followed.estimate) begin(one.sensor, followed.packets.cartesian());
    see(one.sensor);
    const bool estimated = followed.estimate->add(chunk_.observations, progress_);
    const std::scoped_lock lock(mutex_);
    ++health_[one.sensor].packets;
    if (estimated) health_[one.sensor].state = followed.estimate->state();
  }

  void see(std::size_t sensor) {
    const recordings::Observations& rows = chunk_.observations;
    std::size_t& returns = followed_[sensor].returns;
    const std::scoped_lock lock(mutex_);
    for (std::size_t i = 0; i < rows.size() && seen_[sensor].size() < kMostSeen; ++i) {
      if (rows.valid[i] == 0 || !(rows.range[i] > 0) || ++returns < kShownOf) continue;
      returns = 0;
      seen_[sensor].push_back({static_cast<float>(rows.azimuth[i]),
                               static_cast<float>(rows.zenith[i]),
                               static_cast<float>(rows.range[i])});
    }
  }

  void begin(std::size_t sensor, bool cartesian) {
    estimation::RunningOptions options;
    options.sensor = *sensors_[sensor].sensor;
    options.is_sensor = health_[sensor].is_reference;  // does not change
    options.cartesian = cartesian;
    followed_[sensor].estimate.emplace(std::move(options));
  }

  std::vector<SensorOfUnit> sensors_;

  mutable std::mutex mutex_;  // of all that follows
  std::condition_variable changed_;
  std::deque<Waiting> waiting_;
  std::vector<OpticsHealth> health_;
  std::vector<std::optional<ShotGrid>> grids_;
  std::vector<std::vector<SeenShot>> seen_;
  bool ending_ = false, busy_ = false;

  CancelFlag cancel_;
  Progress progress_{[](double, std::string_view) {}, &cancel_};
  std::vector<Followed> followed_;  // of the thread
  recordings::Chunk chunk_;
  std::thread thread_;
};

OpticsWatch::OpticsWatch(const std::vector<WatchedSensor>& sensors, const GivenSensor& reference)
    : work_(std::make_unique<Work>(sensors, reference)) {}
OpticsWatch::~OpticsWatch() = default;

void OpticsWatch::set_grid(std::size_t sensor, const ShotGrid& grid) {
  work_->set_grid(sensor, grid);
}
void OpticsWatch::add(std::size_t sensor, std::span<const std::uint8_t> packet) {
  work_->add(sensor, packet);
}
void OpticsWatch::finish(double longest) { work_->finish(longest); }
std::vector<OpticsHealth> OpticsWatch::health() const { return work_->health(); }
std::vector<SeenShot> OpticsWatch::take_seen(std::size_t sensor) {
  return work_->take_seen(sensor);
}

}  // namespace risley::jobs
