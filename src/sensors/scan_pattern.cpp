// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/scan_pattern.hpp"

#include <cmath>
#include <numbers>
#include <span>

#include "risley/core/require.hpp"
#include "risley/optics/batch.hpp"

namespace risley::sensors {
namespace {

constexpr long double kTurn = 2.0L * std::numbers::pi_v<long double>;

/// What speeds that swing by 1 rad/s add to the angles: see ScanSequence.
class Swing {
 public:
  /// @param interval  at which speeds are added up, s
  Swing(const Sensor& sensor, const ScanSequence& sequence, double interval)
      : interval_(sequence.swing.empty() ? 0 : interval),
        half_step_(0.5 * swing_angular_frequency(sensor) * interval) {}

  /// After a number of steps. @return rad per rad/s
  double at(std::uint64_t step) const {
    if (interval_ == 0) return 0;
    // The sum of cos(2 j x) for j = 0 ... step.
    const double x = half_step_;
    if (std::abs(std::sin(x)) < 1e-12) return interval_ * static_cast<double>(step + 1);
    const auto last = static_cast<double>(2 * step + 1);
    return interval_ * (std::sin(last * x) + std::sin(x)) / (2 * std::sin(x));
  }

 private:
  double interval_, half_step_;  // s, rad
};

}  // namespace

std::vector<double> start_angles(const Sensor& sensor, const ScanPatternOptions& options) {
  const auto prisms = static_cast<std::size_t>(sensor.prisms());
  std::vector<double> start = options.rotation_angle;
  if (start.empty() && sensor.sequence) start = sensor.sequence->rotation_angle;
  if (start.empty()) start.assign(prisms, 0.0);
  require_length("rotation_angle", start.size(), prisms);
  return start;
}

double swing_angular_frequency(const Sensor& sensor) {
  if (!sensor.sequence || sensor.sequence->swing.empty()) return 0;
  require_length("swing of the sequence", sensor.sequence->swing.size(),
                 static_cast<std::size_t>(sensor.prisms()));
  require_at_least("prisms of a sensor that swings", sensor.prisms(), 2);
  return sensor.sequence->swings_per_beat *
         std::abs(sensor.angular_velocity[1] - sensor.angular_velocity[0]);
}

ScanPattern scan_pattern(const Sensor& sensor, std::uint64_t first_row, std::size_t rows,
                         const ScanPatternOptions& options) {
  const auto prisms = static_cast<std::size_t>(sensor.prisms());
  const ScanSequence sequence = sensor.sequence.value_or(ScanSequence{});
  const std::vector<double> start = start_angles(sensor, options);
  require_length("angular_velocity of the sensor", sensor.angular_velocity.size(), prisms);
  const double rate = options.shot_rate.value_or(sensor.shot_rate);
  require_between("shot_rate", rate, 1e-3, 1e9, "Hz");
  require_between("every", static_cast<double>(options.every), 1, 1e9);
  constexpr double kLongest = 1e7;
  require_between("end of the pattern",
                  static_cast<double>(first_row + rows) * static_cast<double>(options.every) / rate,
                  0, kLongest, "s");

  const auto emitters = static_cast<std::uint64_t>(sensor.train.emitters());
  const std::uint64_t group = options.whole_groups ? emitters : 1;
  const auto first_shot = static_cast<std::uint64_t>(sequence.first_shot);
  const bool together = options.firing.value_or(sequence.firing) == Firing::together;
  const std::uint64_t together_shots = together ? emitters : 1;
  const Swing swing(sensor, sequence, static_cast<double>(together_shots) / rate);
  ScanPattern pattern;
  pattern.time.resize(rows);
  pattern.azimuth.resize(rows);
  pattern.zenith.resize(rows);
  pattern.emitter.resize(rows);
  std::vector<std::vector<double>> angles(prisms, std::vector<double>(rows));
  for (std::size_t i = 0; i < rows; ++i) {
    const std::uint64_t row = first_row + i;
    const std::uint64_t shot = (options.every * (row / group + 1) - 1) * group + row % group;
    pattern.time[i] = static_cast<double>(first_shot + shot) / rate;
    pattern.emitter[i] = static_cast<std::uint8_t>(shot % emitters);
    const std::uint64_t step = first_shot + (together ? shot / emitters : shot);
    // Hundreds of turns in, double precision would cost the last printed digit.
    const long double time =
        static_cast<long double>(step * together_shots) / static_cast<long double>(rate);
    const double swung = swing.at(step);
    for (std::size_t k = 0; k < prisms; ++k) {
      long double angle = start[k] + sensor.angular_velocity[k] * time;
      if (!sequence.swing.empty()) angle += sequence.swing[k] * swung;
      angles[k][i] = static_cast<double>(angle - kTurn * std::floor(angle / kTurn));
    }
  }
  const std::vector<std::span<const double>> columns(angles.begin(), angles.end());
  DirectionColumns out;
  out.azimuth = pattern.azimuth;
  out.zenith = pattern.zenith;
  observe_batch(sensor.train, columns, out, pattern.emitter);
  return pattern;
}

}  // namespace risley::sensors
