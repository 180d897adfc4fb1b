// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/helios_scanner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/batch.hpp"
#include "risley/optics/observation_model.hpp"

namespace risley::sensors {
namespace {

constexpr std::uint64_t kMostCompared = 1'000'000, kPiece = 65'536;
constexpr double kSameAngle = 1e-9;  // rad, far below any number in a file

/// Rotation angles of all rotors at time 0 as a common turn and a common time lag: start_k = turn +
/// speed_k lag, and the remainder.
struct Start {
  double turn = 0, lag = 0;
  std::vector<double> left;  ///< [prisms], rad
};

Start start_of(const std::vector<double>& start, const std::vector<double>& speed,
               const std::vector<double>& weight) {
  constexpr int kTries = 1000;  // beats of the two rotors whose speeds differ most
  const std::size_t prisms = start.size();
  std::size_t a = 0, b = 0;
  for (std::size_t i = 0; i < prisms; ++i) {
    for (std::size_t j = i + 1; j < prisms; ++j) {
      if (std::abs(speed[i] - speed[j]) > std::abs(speed[a] - speed[b])) a = i, b = j;
    }
  }
  const auto with_lag = [&](double lag) {
    Start result{wrap_to_pi(start[a] - speed[a] * lag), lag, {}};
    for (std::size_t k = 0; k < prisms; ++k) {
      result.left.push_back(wrap_to_pi(start[k] - result.turn - speed[k] * lag));
    }
    return result;
  };
  const double beat = speed[a] - speed[b];
  if (beat == 0) return with_lag(0);
  const double period = kTwoPi / std::abs(beat);
  double first = wrap_to_pi(start[a] - start[b]) / beat;
  if (first < -kSameAngle / std::abs(beat)) first += period;
  Start best;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < (prisms > 2 ? kTries : 1); ++i) {
    Start now = with_lag(first + i * period);
    double cost = 0;
    for (std::size_t k = 0; k < prisms; ++k) cost += std::pow(weight[k] * now.left[k], 2);
    if (cost < least) {
      least = cost;
      best = std::move(now);
    }
    if (std::sqrt(least) < kSameAngle) break;
  }
  return best;
}

bool is_tilted(const PrismTrain& train) {
  for (int i = 0; i < train.prisms(); ++i) {
    for (const int at : {place::prism_tilt_horizontal(i), place::prism_tilt_vertical(i),
                         place::bearing_tilt_horizontal(i), place::bearing_tilt_vertical(i)}) {
      if (train[at] != 0) return true;
    }
  }
  return false;
}

Eigen::Vector3d turned_axes(double x, double y, double z) { return {-y, x, z}; }

Eigen::Matrix3d about(const Eigen::Vector3d& axis, double angle) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

/// Angles about y, then x, then z of fixed axes.
std::array<double, 3> turn_angles(const Eigen::Matrix3d& turn) {
  return {std::atan2(-turn(2, 0), turn(2, 2)), std::asin(std::clamp(turn(2, 1), -1.0, 1.0)),
          std::atan2(-turn(0, 1), turn(1, 1))};
}

/// The pattern and the HELIOS++ version of it before rotation, in its axes, shot by shot.
class Comparison {
 public:
  Comparison(const Sensor& sensor, PrismTrain train, std::uint64_t rows,
             const ScanPatternOptions& options, double lag)
      : sensor_(sensor), train_(std::move(train)), options_(options), rows_(rows), lag_(lag) {
    const ScanSequence sequence = sensor.sequence.value_or(ScanSequence{});
    emitters_ = static_cast<std::uint64_t>(train_.emitters());
    first_shot_ = static_cast<std::uint64_t>(sequence.first_shot);
    rate_ = options.shot_rate.value_or(sensor.shot_rate);
    together_ = options.firing.value_or(sequence.firing) == Firing::together;
  }

  /// Calls visit(ours, theirs) with unit vectors.
  template <class Visit>
  void each(const Progress& progress, Visit visit) const {
    const auto prisms = static_cast<std::size_t>(train_.prisms());
    for (std::uint64_t row = 0; row < rows_; row += kPiece) {
      progress.report(static_cast<double>(row) / static_cast<double>(rows_));
      const auto count = static_cast<std::size_t>(std::min(kPiece, rows_ - row));
      const ScanPattern own = scan_pattern(sensor_, row, count, options_);
      std::vector<std::vector<double>> angles(prisms, std::vector<double>(count));
      for (std::size_t i = 0; i < count; ++i) {
        const double time = group_time(row + i) + lag_;
        for (std::size_t k = 0; k < prisms; ++k) {
          angles[k][i] = wrap_to_pi(sensor_.angular_velocity[k] * time);
        }
      }
      std::vector<double> x(count), y(count), z(count);
      DirectionColumns out;
      out.x = x;
      out.y = y;
      out.z = z;
      observe_batch(train_, std::vector<std::span<const double>>(angles.begin(), angles.end()), out,
                    own.emitter);
      for (std::size_t i = 0; i < count; ++i) {
        if (std::isnan(own.azimuth[i]) || std::isnan(x[i])) continue;
        const auto ours =
            direction_from_angles(SphericalAngles<double>{own.azimuth[i], own.zenith[i]});
        visit(turned_axes(ours.x, ours.y, ours.z), turned_axes(x[i], y[i], z[i]));
      }
    }
  }

 private:
  /// If the rotors are stationary for the whole group of a shot.
  double group_time(std::uint64_t shot) const {
    const std::uint64_t group = shot / emitters_;
    const std::uint64_t first =
        together_ ? (first_shot_ + group) * emitters_ : first_shot_ + group * emitters_;
    return static_cast<double>(first) / rate_;
  }

  const Sensor& sensor_;
  PrismTrain train_;
  const ScanPatternOptions& options_;
  std::uint64_t rows_, emitters_ = 1, first_shot_ = 0;
  double lag_, rate_ = 0;
  bool together_ = false;
};

}  // namespace

HeliosScanner helios_scanner(const Sensor& sensor, std::uint64_t rows,
                             const ScanPatternOptions& options, const Progress& progress) {
  const int prisms = sensor.prisms(), emitters = sensor.train.emitters();
  if (prisms > kHeliosPrisms) {
    throw InvalidArgument(
        fmt::format("sensor \"{}\" has {} prisms, a scanner of HELIOS++ can have {} at most",
                    sensor.name, prisms, kHeliosPrisms));
  }
  if (sensor.train.layout().reflects()) {
    throw InvalidArgument(fmt::format(
        "sensor \"{}\" reflects its beam within glass, a scanner of HELIOS++ has only prisms",
        sensor.name));
  }
  if (options.every != 1) {
    throw InvalidArgument(fmt::format(
        "every = {}, allowed 1: a scanner of HELIOS++ has prisms instead of rows", options.every));
  }
  rows = std::min(rows, kMostCompared);
  scan_pattern(sensor, 0, 1, options);  // reports the defects of the rest
  const ScanSequence sequence = sensor.sequence.value_or(ScanSequence{});
  const double rate = options.shot_rate.value_or(sensor.shot_rate);

  HeliosScanner result;
  std::vector<double> weights;
  result.refractive_index_air = sensor.train[place::refractive_index_air()];
  for (int i = 0; i < prisms; ++i) {
    const double wedge = sensor.train[place::wedge_angle(i)];
    const double index = sensor.train[place::refractive_index(i)];
    const bool angled_first =
        sensor.train.face_order()[static_cast<std::size_t>(i)] == FaceOrder::angled_perpendicular;
    result.rotor_frequency.push_back(sensor.angular_velocity[static_cast<std::size_t>(i)] / kTwoPi);
    result.angle.push_back(angled_first ? wedge : -wedge);
    result.refractive_index.push_back(index);
    weights.push_back(std::abs((index - 1) * wedge));
  }

  const Start start = start_of(start_angles(sensor, options), sensor.angular_velocity, weights);
  PrismTrain train = sensor.train.without_errors();
  const Eigen::Matrix3d common = about(Eigen::Vector3d::UnitY(), start.turn);
  for (int i = 0; i < emitters; ++i) {
    const int horizontal = place::incident_beam_horizontal(i, prisms);
    const int vertical = place::incident_beam_vertical(i, prisms);
    const auto beam = leaning_direction(sensor.train[horizontal], sensor.train[vertical]);
    const Eigen::Vector3d own = common.transpose() * turned_axes(beam.x, beam.y, beam.z);
    result.incident_beam.emplace_back(own.x(), own.y(), own.z());
    train.set_place(horizontal, std::atan2(own.x(), own.y()));
    train.set_place(vertical, std::asin(std::clamp(own.z(), -1.0, 1.0)));
  }

  const double pulses = rate / emitters;
  result.pulse_frequency = std::max(1L, std::lround(pulses));
  const bool in_turn = emitters > 1 && options.firing.value_or(sequence.firing) == Firing::in_turn;
  // If they fire in turn, the middle of a group represents it.
  result.time_lag = start.lag + (in_turn ? 0.5 * (emitters - 1) / rate : 0.0);

  const bool tilted = is_tilted(sensor.train);
  const Comparison comparison(sensor, train, rows, options, result.time_lag);
  Eigen::Matrix3d turn = common;
  if (tilted) {
    Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
    comparison.each(progress.part(0.0, 0.5),
                    [&](const Eigen::Vector3d& ours, const Eigen::Vector3d& theirs) {
                      products += ours * theirs.transpose();
                    });
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(products,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Matrix3d handed =
        Eigen::Vector3d(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant())
            .asDiagonal();
    turn = svd.matrixU() * handed * svd.matrixV().transpose();
  }
  result.turn = tilted ? turn_angles(turn) : std::array<double, 3>{start.turn, 0, 0};
  double squares = 0;
  comparison.each(progress.part(0.5, 1.0),
                  [&](const Eigen::Vector3d& ours, const Eigen::Vector3d& theirs) {
                    const Eigen::Vector3d there = turn * theirs;
                    const double angle = std::atan2(ours.cross(there).norm(), ours.dot(there));
                    squares += angle * angle;
                    result.worst = std::max(result.worst, angle);
                    ++result.compared;
                  });
  if (result.compared > 0) result.rms = std::sqrt(squares / static_cast<double>(result.compared));

  if (in_turn) {
    result.not_carried.emplace_back(
        "Emitters that fire one after another: in HELIOS++ all fire at every pulse.");
  }
  if (tilted) {
    result.not_carried.emplace_back(
        "Tilts of prisms and bearings: instead, the whole scanner is rotated for the best fit.");
  }
  for (int i = 0; i < prisms; ++i) {
    const double left = start.left[static_cast<std::size_t>(i)];
    if (std::abs(left) < kSameAngle) continue;
    result.not_carried.push_back(
        fmt::format("The rotation angle of prism {} at the start, which is {:.4g} degree off.",
                    prism_letter(i), degrees_from_radians(left)));
  }
  if (std::abs(pulses - static_cast<double>(result.pulse_frequency)) > 1e-9 * pulses) {
    result.not_carried.push_back(
        fmt::format("A pulse frequency of {:.10g} Hz: HELIOS++ takes only whole numbers.", pulses));
  }
  return result;
}

}  // namespace risley::sensors
