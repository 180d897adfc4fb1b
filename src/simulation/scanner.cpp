// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/simulation/scanner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/batch.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/sensors/range_values.hpp"
#include "risley/sensors/scan_pattern.hpp"
#include "risley/simulation/noise.hpp"

#include "simulation/beam_returns.hpp"
#include "simulation/platform_poses.hpp"
#include "simulation/streams.hpp"

namespace risley::simulation {
namespace {

constexpr std::size_t kBlockRows = 4096;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
/// On the sensor's scale, of a matt surface of reflectivity 1 that faces the sensor.
constexpr double kFullIntensity = 150.0;
constexpr double kMostIntensity = 255.0;

/// Quantities of the true sensor needed by a simulation.
void require_sensor(const sensors::Sensor& sensor) {
  require_between("device_type", sensor.device_type, 0, 255);
  require_length("angular_velocity of the sensor", sensor.angular_velocity.size(), sensor.prisms());
  face_positions(sensor.train.face_order(), sensor.geometry);  // rejects sizes that do not fit
  require_not_below("range_minimum", sensor.range_minimum, 0, "m");
  require_not_below("range_maximum", sensor.range_maximum, 0, "m");
  require_finite("range_offset", sensor.range_offset, "m");
  require_length_or_none("emitter of range_errors", sensor.range_errors.emitter.size(),
                         sensor.train.emitters());
  for (const sensors::RangeValue& value : sensors::range_values(sensor.train.emitters())) {
    require_finite(value.name, sensors::get_range_value(sensor, value.name), value.unit);
  }
  require_not_below("beam_divergence_horizontal", sensor.beam_divergence_horizontal, 0, "rad");
  require_not_below("beam_divergence_vertical", sensor.beam_divergence_vertical, 0, "rad");
}

SimulationSettings checked(SimulationSettings settings) {
  const auto prisms = static_cast<std::size_t>(settings.truth.prisms());
  require_between("duration", settings.duration, 1e-9, 1e7, "s");
  if (!settings.rate) settings.rate = settings.truth.shot_rate;
  require_between("rate", *settings.rate, 1e-3, 1e9, "Hz");
  require_between("duration times rate", settings.duration * *settings.rate, 0.5, 1e12, "shots");
  if (!settings.angle_noise) settings.angle_noise = settings.truth.angle_noise;
  if (!settings.range_noise) settings.range_noise = settings.truth.range_noise;
  require_between("threads", settings.threads, 0, 4096);
  check_shape(settings.truth.shape());
  require_sensor(settings.truth);
  if (settings.reported && settings.reported->shape() != settings.truth.shape()) {
    throw InvalidArgument(
        fmt::format("the reported sensor has {} prisms and {} emitters, the true one {} and {}",
                    settings.reported->prisms(), settings.reported->train.emitters(), prisms,
                    settings.truth.train.emitters()));
  }
  if (settings.start_angles.empty()) {
    const RandomStream random(settings.seed, stream::kStartAngles);
    for (std::size_t i = 0; i < prisms; ++i) {
      settings.start_angles.push_back(kTwoPi * random.uniform(i));
    }
  }
  require_length("start_angles", settings.start_angles.size(), prisms);
  if (!settings.rotor_settings) {
    settings.rotor_settings = rotor_settings(settings.rotor, settings.truth.prisms());
    settings.rotor_settings->swing_frequency = sensors::swing_angular_frequency(settings.truth);
    if (settings.rotor_settings->swing_frequency > 0) {
      settings.rotor_settings->swing = settings.truth.sequence->swing;
    }
  }
  if (!settings.station.empty() && !settings.scene) {
    throw InvalidArgument(fmt::format("station \"{}\" needs a scene", settings.station));
  }
  if (settings.scene) {
    require_at_least("surfaces of the scene", settings.scene->surfaces(), 1);
  }
  if (settings.platform) first_clock_reading_ns(*settings.platform);  // refuses
  if (settings.platform && !settings.scene) {
    throw InvalidArgument("a sensor that moves along a trajectory needs a scene");
  }
  if (settings.platform && !settings.station.empty()) {
    throw InvalidArgument(
        fmt::format("a sensor moves along a trajectory or stands at station \"{}\", not both",
                    settings.station));
  }
  return settings;
}

NoiseSettings noise_settings(const SimulationSettings& settings) {
  NoiseSettings noise;
  noise.angle = *settings.angle_noise;
  noise.range = *settings.range_noise;
  if (settings.quantize) {
    noise.angle_resolution = settings.truth.angle_resolution;
    noise.range_resolution = settings.truth.range_resolution;
  }
  return noise;
}

/// A serial number that follows from the optics, so that all recordings of one simulated unit agree
/// on it. Broadcast codes have 15 characters; the last one counts the sensor's heads.
std::string simulated_serial(const sensors::Sensor& sensor) {
  std::uint64_t hash = 14695981039346656037U;  // FNV-1a, the same on every machine
  const std::string text = to_string(sensor.train.face_order()) +
                           fmt::format("{}", fmt::join(sensor.train.parameters(), ","));
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  }
  return fmt::format("SIM{:011}1", hash % 100'000'000'000);
}

recordings::RecordingHeader make_header(const SimulationSettings& settings) {
  recordings::RecordingHeader header;
  header.format = "simulation";
  recordings::Device device;
  device.serial =
      settings.truth.serial.empty() ? simulated_serial(settings.truth) : settings.truth.serial;
  device.type = static_cast<std::uint8_t>(settings.truth.device_type);
  header.devices.push_back(device);
  header.time_reference = recordings::TimeReference::power_on;
  if (settings.platform &&
      settings.platform->trajectory->time_scale == trajectories::TimeScale::utc_unix) {
    header.time_reference = recordings::TimeReference::utc;
  }
  header.has_range = settings.scene.has_value();
  header.has_intensity = settings.scene.has_value();
  return header;
}

std::span<double> part(std::vector<double>& column, std::size_t first, std::size_t count) {
  return std::span(column).subspan(first, count);
}

}  // namespace

class Scanner::State {
 public:
  explicit State(SimulationSettings given)
      : settings(checked(std::move(given))),
        header(make_header(settings)),
        shots(static_cast<std::uint64_t>(std::llround(settings.duration * *settings.rate))),
        noise_(noise_settings(settings), settings.seed),
        threads_(settings.threads),
        bush_depth_(settings.seed, stream::kBushDepth),
        has_bushes_(settings.scene && settings.scene->terrain &&
                    !settings.scene->terrain->parts().bushes.empty()) {
    if (settings.scene) {
      station_ = settings.scene->station(settings.station);
      returns_.emplace(*settings.scene, settings.truth);
    }
    if (settings.platform) poses_.emplace(*settings.platform, *settings.scene, time_of(shots - 1));
    for (int i = 0; i < settings.truth.prisms(); ++i) {
      rotors_.emplace_back(*settings.rotor_settings, i, settings.start_angles[i],
                           settings.truth.angular_velocity[i], time_of(shots - 1), settings.seed);
    }
  }

  bool read(recordings::Chunk& chunk, recordings::TruthColumns& truth, std::size_t max_rows) {
    chunk.clear();
    const auto rows = static_cast<std::size_t>(std::min<std::uint64_t>(max_rows, shots - done));
    chunk.observations.resize(rows);
    truth.resize(settings.truth.prisms(), rows);
    if (rows == 0) return false;
    const std::size_t blocks = (rows + kBlockRows - 1) / kBlockRows;
    threads_.run([&] {
      parallel::for_each(blocks, [&](std::size_t block) {
        const std::size_t first = block * kBlockRows;
        fill(chunk.observations, truth, first, std::min(kBlockRows, rows - first));
      });
    });
    const auto& valid = chunk.observations.valid;
    no_return += static_cast<std::uint64_t>(std::ranges::count(valid, 0));
    done += rows;
    return true;
  }

  const SimulationSettings settings;
  const recordings::RecordingHeader header;
  const std::uint64_t shots;
  std::uint64_t done = 0, no_return = 0;

 private:
  std::int64_t time_of(std::uint64_t shot) const {
    return std::llround(static_cast<long double>(shot) * 1e9L /
                        static_cast<long double>(*settings.rate));
  }

  /// Rows [first, first + count) of the pieces; the row 0 of a piece is shot number done.
  void fill(recordings::Observations& rows, recordings::TruthColumns& truth, std::size_t first,
            std::size_t count) const {
    const std::uint64_t first_shot = done + first;
    std::vector<std::int64_t> times(count);  // since the first shot
    const std::int64_t first_clock_ns = poses_ ? poses_->first_clock_ns() : 0;
    for (std::size_t i = 0; i < count; ++i) {
      times[i] = time_of(first_shot + i);
      truth.time_ns[first + i] = rows.time_ns[first + i] = first_clock_ns + times[i];
    }

    std::vector<std::vector<double>> wrapped(rotors_.size());
    std::vector<std::span<const double>> angles;
    for (std::size_t prism = 0; prism < rotors_.size(); ++prism) {
      const auto angle = part(truth.rotation_angle[prism], first, count);
      rotors_[prism].evaluate(times, angle, part(truth.angular_velocity[prism], first, count));
      wrapped[prism].resize(count);
      std::ranges::transform(angle, wrapped[prism].begin(), wrap_to_two_pi);
      angles.emplace_back(wrapped[prism]);
    }
    std::vector<double> x, y, z, origin_x, origin_y, origin_z;
    DirectionColumns beam;
    if (settings.scene) {
      for (auto* column : {&x, &y, &z, &origin_x, &origin_y, &origin_z}) column->resize(count);
      beam = {x, y, z, {}, {}, origin_x, origin_y, origin_z, settings.truth.geometry};
    }
    beam.azimuth = part(truth.azimuth, first, count);
    beam.zenith = part(truth.zenith, first, count);
    const auto emitters = static_cast<std::uint64_t>(settings.truth.train.emitters());
    std::vector<std::uint8_t> emitter(count);
    for (std::size_t i = 0; i < count; ++i) {
      emitter[i] = static_cast<std::uint8_t>((first_shot + i) % emitters);
    }
    observe_batch(settings.truth.train, angles, beam, emitter);

    const auto azimuth = part(rows.azimuth, first, count);
    const auto zenith = part(rows.zenith, first, count);
    if (settings.reported) {
      DirectionColumns reported;
      reported.azimuth = azimuth;
      reported.zenith = zenith;
      observe_batch(settings.reported->train, angles, reported, emitter);
    } else {
      std::ranges::copy(beam.azimuth, azimuth.begin());
      std::ranges::copy(beam.zenith, zenith.begin());
    }
    for (std::size_t i = 0; i < count; ++i) {  // without a beam there is nothing to report
      if (std::isnan(beam.azimuth[i])) azimuth[i] = zenith[i] = kNaN;
    }
    noise_.apply_to_angles(first_shot, azimuth, zenith);

    std::optional<PlatformPoses::Cursor> cursor;
    if (poses_) cursor.emplace(*poses_);
    const bool plain = settings.truth.range_errors == sensors::RangeErrors{};
    const auto range = part(rows.range, first, count);
    const auto true_range = part(truth.range, first, count);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t row = first + i;
      true_range[i] = kNaN;
      range[i] = settings.scene ? 0.0 : kNaN;
      rows.intensity[row] = 0;
      if (settings.scene && !std::isnan(beam.azimuth[i])) {
        SceneBeam of_shot =
            in_scene(cursor, times[i], {origin_x[i], origin_y[i], origin_z[i]}, {x[i], y[i], z[i]});
        if (has_bushes_) of_shot.penetration = bush_depth_.uniform(first_shot + i);
        const BeamReturn found = returns_->of(of_shot);
        true_range[i] = found.true_range;
        if (found.range > 0.0) {
          const double intensity =
              std::min(kMostIntensity, std::round(kFullIntensity * found.reflectance));
          rows.intensity[row] = static_cast<std::uint8_t>(intensity);
          const double error =
              plain ? settings.truth.range_offset
                    : sensors::range_error(settings.truth, found.range, found.footprint_depth,
                                           intensity, emitter[i]);
          range[i] = std::max(0.0, found.range + error);
        }
      }
    }
    noise_.apply_to_ranges(first_shot, range);

    const auto angle_step = static_cast<float>(noise_.settings().angle_resolution);
    const auto range_step = static_cast<float>(noise_.settings().range_resolution);
    for (std::size_t row = first; row < first + count; ++row) {
      const bool valid = !std::isnan(rows.azimuth[row]) && rows.range[row] != 0.0;
      rows.azimuth_resolution[row] = angle_step;
      rows.zenith_resolution[row] = angle_step;
      rows.range_resolution[row] = settings.scene ? range_step : 0.0F;
      if (!valid) rows.intensity[row] = 0;
      rows.return_number[row] = 1;
      rows.tag[row] = 0;
      rows.beam[row] = emitter[row - first];
      rows.device[row] = 0;
      rows.valid[row] = valid ? 1 : 0;
    }
  }

  /// A beam of the sensor where the sensor is then.
  /// @param cursor  of the calling thread, if the sensor moves
  SceneBeam in_scene(std::optional<PlatformPoses::Cursor>& cursor, std::int64_t time_ns,
                     const Vector3<double>& origin, const Vector3<double>& direction) const {
    const auto beam_of = [&](const Vector3<double>& from, const auto& turned) {
      SceneBeam beam{from, turned(direction), {}, 0.5, 1e-9 * static_cast<double>(time_ns)};
      if (returns_->needs_axes()) {
        const sensors::FootprintAxes axes = sensors::footprint_axes(direction);
        beam.axes = {turned(axes.horizontal), turned(axes.vertical)};
      }
      return beam;
    };
    if (!cursor) {
      return beam_of(station_.position + station_.scene_from_sensor(origin),
                     [&](const Vector3<double>& v) { return station_.scene_from_sensor(v); });
    }
    const PlatformPoses::SensorPose pose = cursor->at(time_ns);
    return beam_of(pose.point(origin), [&](const Vector3<double>& v) { return pose.direction(v); });
  }

  ObservationNoise noise_;
  parallel::Threads threads_;
  scenes::Station station_;
  std::optional<PlatformPoses> poses_;
  std::optional<BeamReturns> returns_;
  RandomStream bush_depth_;
  bool has_bushes_ = false;
  std::vector<RotorMotion> rotors_;
};

Scanner::Scanner(SimulationSettings settings)
    : state_(std::make_unique<State>(std::move(settings))) {}
Scanner::~Scanner() = default;

const SimulationSettings& Scanner::settings() const { return state_->settings; }
const recordings::RecordingHeader& Scanner::header() const { return state_->header; }
std::uint64_t Scanner::shots() const { return state_->shots; }
std::uint64_t Scanner::shots_done() const { return state_->done; }
std::uint64_t Scanner::no_return() const { return state_->no_return; }
const std::vector<double>& Scanner::start_angles() const { return state_->settings.start_angles; }

bool Scanner::read(recordings::Chunk& chunk, recordings::TruthColumns& truth,
                   std::size_t max_rows) {
  require_at_least("max_rows", max_rows, 1);
  return state_->read(chunk, truth, max_rows);
}

}  // namespace risley::simulation
