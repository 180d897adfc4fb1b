// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/scan_pattern.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "risley/core/require.hpp"
#include "risley/optics/batch.hpp"

#include "sensors/scan_kernel.hpp"

namespace risley::sensors {
namespace {

constexpr long double kTurn = 2.0L * std::numbers::pi_v<long double>;

/// Effect on the angles of speeds that swing by 1 rad/s: see ScanSequence.
class Swing {
 public:
  /// @param interval  at which speeds are summed, s
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

/// Shots of some rows, and their times.
struct Rows {
  ScanSequence sequence;
  std::vector<double> start;  ///< rotation angles at time 0, rad
  double rate = 0;            ///< Hz
  std::uint64_t first_row = 0, every = 1, group = 1, first_shot = 0, emitters = 1;
  bool together = false;

  Rows(const Sensor& sensor, std::uint64_t first, std::size_t rows,
       const ScanPatternOptions& options)
      : sequence(sensor.sequence.value_or(ScanSequence{})),
        start(start_angles(sensor, options)),
        rate(options.shot_rate.value_or(sensor.shot_rate)),
        first_row(first),
        every(options.every),
        first_shot(static_cast<std::uint64_t>(sequence.first_shot)),
        emitters(static_cast<std::uint64_t>(sensor.train.emitters())),
        together(options.firing.value_or(sequence.firing) == Firing::together) {
    if (options.whole_groups) group = emitters;
    require_length("angular_velocity of the sensor", sensor.angular_velocity.size(), start.size());
    require_between("shot_rate", rate, 1e-3, 1e9, "Hz");
    require_between("every", static_cast<double>(every), 1, 1e9);
    constexpr double kLongest = 1e7;
    require_between("end of the pattern",
                    static_cast<double>(first + rows) * static_cast<double>(every) / rate, 0,
                    kLongest, "s");
  }

  std::uint64_t shot(std::size_t i) const {
    const std::uint64_t row = first_row + i;
    return (every * (row / group + 1) - 1) * group + row % group;
  }
  double time(std::uint64_t shot) const { return static_cast<double>(first_shot + shot) / rate; }
  /// Shots that are fired at one time.
  std::uint64_t at_once() const { return together ? emitters : 1; }
  std::uint64_t step(std::uint64_t shot) const { return first_shot + shot / at_once(); }
  /// Of a step. After hundreds of turns double precision would cost the last printed digit.
  long double seconds(std::uint64_t step) const {
    return static_cast<long double>(step * at_once()) / static_cast<long double>(rate);
  }
  long double angle(const Sensor& sensor, std::size_t prism, long double seconds) const {
    return start[prism] + sensor.angular_velocity[prism] * seconds;
  }
};

double in_first_turn(long double angle) {
  return static_cast<double>(angle - kTurn * std::floor(angle / kTurn));
}

/// Rotation angles of every prism at some rows, rad, and the rows' emitters.
struct RowAngles {
  std::vector<std::vector<double>> angles;
  std::vector<std::uint8_t> emitter;

  RowAngles(const Sensor& sensor, const Rows& of, std::size_t rows)
      : angles(of.start.size(), std::vector<double>(rows)), emitter(rows) {
    const Swing swing(sensor, of.sequence, static_cast<double>(of.at_once()) / of.rate);
    for (std::size_t i = 0; i < rows; ++i) {
      const std::uint64_t shot = of.shot(i), step = of.step(shot);
      emitter[i] = static_cast<std::uint8_t>(shot % of.emitters);
      const long double time = of.seconds(step);
      const double swung = swing.at(step);
      for (std::size_t k = 0; k < angles.size(); ++k) {
        long double angle = of.angle(sensor, k, time);
        if (!of.sequence.swing.empty()) angle += of.sequence.swing[k] * swung;
        angles[k][i] = in_first_turn(angle);
      }
    }
  }
  std::vector<std::span<const double>> columns() const { return {angles.begin(), angles.end()}; }
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

ScanPattern scan_times(const Sensor& sensor, std::uint64_t first_row, std::size_t rows,
                       const ScanPatternOptions& options) {
  const Rows of(sensor, first_row, rows, options);
  ScanPattern pattern;
  pattern.time.resize(rows);
  pattern.emitter.resize(rows);
  for (std::size_t i = 0; i < rows; ++i) {
    const std::uint64_t shot = of.shot(i);
    pattern.time[i] = of.time(shot);
    pattern.emitter[i] = static_cast<std::uint8_t>(shot % of.emitters);
  }
  return pattern;
}

ScanPattern scan_pattern(const Sensor& sensor, std::uint64_t first_row, std::size_t rows,
                         const ScanPatternOptions& options) {
  const RowAngles at(sensor, Rows(sensor, first_row, rows, options), rows);
  ScanPattern pattern = scan_times(sensor, first_row, rows, options);
  pattern.azimuth.resize(rows);
  pattern.zenith.resize(rows);
  DirectionColumns out;
  out.azimuth = pattern.azimuth;
  out.zenith = pattern.zenith;
  observe_batch(sensor.train, at.columns(), out, at.emitter);
  return pattern;
}

void scan_directions(const Sensor& sensor, std::uint64_t first_row, std::span<double> out,
                     const ScanPatternOptions& options) {
  require_length("directions", out.size() % 3, 0);
  const std::size_t rows = out.size() / 3;
  const RowAngles at(sensor, Rows(sensor, first_row, rows, options), rows);
  std::vector<double> x(rows), y(rows), z(rows);
  DirectionColumns columns;
  columns.x = x;
  columns.y = y;
  columns.z = z;
  observe_batch(sensor.train, at.columns(), columns, at.emitter);
  for (std::size_t i = 0; i < rows; ++i) {
    out[3 * i] = x[i];
    out[3 * i + 1] = y[i];
    out[3 * i + 2] = z[i];
  }
}

void scan_directions(const Sensor& sensor, std::uint64_t first_row, std::span<float> out,
                     const ScanPatternOptions& options) {
  require_length("directions", out.size() % 3, 0);
  const std::size_t rows = out.size() / 3;
  const Rows of(sensor, first_row, rows, options);
  const bool steady = of.sequence.swing.empty() && of.at_once() == 1 && of.group == 1;
  if (!steady) {
    std::vector<double> exact(out.size());
    scan_directions(sensor, first_row, std::span<double>(exact), options);
    std::transform(exact.begin(), exact.end(), out.begin(),
                   [](double value) { return static_cast<float>(value); });
    return;
  }
  const long double first = of.seconds(of.step(of.shot(0)));
  std::vector<double> angle, step;
  for (std::size_t k = 0; k < of.start.size(); ++k) {
    angle.push_back(in_first_turn(of.angle(sensor, k, first)));
    step.push_back(sensor.angular_velocity[k] * static_cast<double>(of.every) / of.rate);
  }
  ScanArguments a;
  a.parameters = sensor.train.parameters().data();
  a.face_order = sensor.train.face_order().data();
  a.prisms = sensor.train.layout();
  a.emitters = of.emitters;
  a.first_emitter = of.shot(0) % of.emitters;
  a.emitter_step = of.every % of.emitters;
  a.angle = angle.data();
  a.step = step.data();
  a.rows = rows;
  a.direction = out.data();
  RISLEY_KERNEL_COPIES(scan).at(best_instruction_set())(a);
}

}  // namespace risley::sensors
