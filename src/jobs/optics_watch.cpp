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

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"
#include "risley/recordings/livox/packet_decoder.hpp"

namespace risley::jobs {
namespace {

using recordings::livox::PacketDecoder;
using recordings::livox::ShotGrid;

/// What only the thread has of a sensor.
struct Followed {
  std::optional<PacketDecoder> decoder;  // of the first generation
  std::optional<estimation::RunningEstimate> estimate;
};

}  // namespace

class OpticsWatch::Work {
 public:
  Work(const std::vector<WatchedSensor>& sensors, const GivenSensor& reference) {
    const std::optional<sensors::Sensor> given = given_sensor(reference);
    for (const WatchedSensor& watched : sensors) {
      OpticsHealth& health = health_.emplace_back();
      std::optional<sensors::Sensor>& sensor = sensors_.emplace_back();
      device_types_.push_back(watched.device_type);
      if (given && (given->serial.empty() || given->serial == watched.serial)) {
        if (given->device_type != watched.device_type) {
          throw InvalidArgument(fmt::format(
              "{}: it is a {}, and the sensor {} on the network is a {}; name another reference",
              reference.name(),
              recordings::device_type_name(static_cast<std::uint8_t>(given->device_type)),
              watched.serial, recordings::device_type_name(watched.device_type)));
        }
        sensor = given;
        health.is_reference = true;
      } else {
        sensor = preset_of_type(watched.device_type);
      }
      if (sensor) {
        health.reference = sensor->name;
      } else {
        health.words = "there is no preset for its type";
      }
    }
    grids_.resize(sensors.size());
    followed_.resize(sensors.size());
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
    } catch (const std::exception& error) {          // such as no memory: the recording goes on
      const std::scoped_lock lock(mutex_);
      health_[one.sensor].words = error.what();
    }
  }

  void follow(const Waiting& one) {
    Followed& followed = followed_[one.sensor];
    chunk_.clear();
    if (recordings::is_second_generation(device_types_[one.sensor])) {
      const auto header = recordings::livox::decode_numbered_header(one.packet);
      if (header.data_type == recordings::livox::kNumberedImu) return;
      const auto layout = recordings::livox::numbered_layout(header.data_type, header.records);
      if (!followed.estimate) begin(one.sensor, layout->cartesian);
      recordings::livox::decode_numbered_packet(one.packet, device_types_[one.sensor], 0, chunk_);
    } else {
      const auto header = recordings::livox::decode_packet_header(one.packet);
      if (header.data_type == recordings::livox::kImuDataType) return;
      if (!followed.estimate) {
        begin_decoder(one.sensor);
        begin(one.sensor, recordings::livox::record_layout(header.data_type)->cartesian);
      }
      followed.decoder->decode(one.packet, chunk_);
    }
    const bool estimated = followed.estimate->add(chunk_.observations, progress_);
    const std::scoped_lock lock(mutex_);
    ++health_[one.sensor].packets;
    if (estimated) health_[one.sensor].state = followed.estimate->state();
  }

  void begin_decoder(std::size_t sensor) {
    recordings::livox::PacketDecoderOptions decoding;
    decoding.device_type = device_types_[sensor];
    {
      const std::scoped_lock lock(mutex_);
      decoding.grid = grids_[sensor];
    }
    followed_[sensor].decoder.emplace(decoding);
  }

  void begin(std::size_t sensor, bool cartesian) {
    estimation::RunningOptions options;
    options.sensor = *sensors_[sensor];
    options.is_sensor = health_[sensor].is_reference;  // does not change
    options.cartesian = cartesian;
    followed_[sensor].estimate.emplace(std::move(options));
  }

  std::vector<std::uint8_t> device_types_;
  std::vector<std::optional<sensors::Sensor>> sensors_;

  mutable std::mutex mutex_;  // of all that follows
  std::condition_variable changed_;
  std::deque<Waiting> waiting_;
  std::vector<OpticsHealth> health_;
  std::vector<std::optional<ShotGrid>> grids_;
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

}  // namespace risley::jobs
