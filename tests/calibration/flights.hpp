// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "risley/calibration/datum.hpp"
#include "risley/calibration/flight_calibration.hpp"
#include "risley/core/angle.hpp"
#include "risley/optics/batch.hpp"
#include "risley/sensors/preset.hpp"

/// Simulated flights by plain code: a body that sways on straight strips over analytic ground.
namespace risley::testing {

inline Eigen::Matrix3d flight_rotation(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (!(angle > 0)) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

/// 20, 20 and 30 mm, 0.025, 0.025 and 0.08 degrees, minutes long; white 0.005 degree at 200 Hz.
inline trajectories::ErrorModel flight_errors_of_a_good_unit() {
  trajectories::ErrorModel model = trajectories::assumed_error_model();
  constexpr double kSigma[] = {0.02, 0.02, 0.03, 0.025, 0.025, 0.08};  // m, degrees
  for (std::size_t i = 0; i < model.terms.size(); ++i) {
    model.terms[i].sigma = i < 3 ? kSigma[i] : radians_from_degrees(kSigma[i]);
    if (i >= 3) model.terms[i].white = radians_from_degrees(0.005);
  }
  model.sample_interval = 0.005;
  return model;
}

/// A sum of sinusoids and its integral.
class Sway {
 public:
  Sway() = default;
  Sway(std::mt19937_64& generator, int count, double lowest_hz, double highest_hz, double rms) {
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int i = 0; i < count; ++i) {
      frequency_.push_back(2 * std::numbers::pi *
                           (lowest_hz + (highest_hz - lowest_hz) * uniform(generator)));
      phase_.push_back(2 * std::numbers::pi * uniform(generator));
    }
    amplitude_ = rms * std::sqrt(2.0 / count);
  }
  double at(double time) const {
    double sum = 0;
    for (std::size_t i = 0; i < phase_.size(); ++i) {
      sum += amplitude_ * std::sin(frequency_[i] * time + phase_[i]);
    }
    return sum;
  }
  double integral(double time) const {
    double sum = 0;
    for (std::size_t i = 0; i < phase_.size(); ++i) {
      sum -= amplitude_ / frequency_[i] * std::cos(frequency_[i] * time + phase_[i]);
    }
    return sum;
  }

 private:
  double amplitude_ = 0;
  std::vector<double> frequency_, phase_;
};

/// One side of a gable roof: from the ridge down one side, over a rectangle of the plan.
struct Roof {
  Eigen::Vector2d centre, along;      ///< of the ridge; unit vector of it
  double side = 1;                    ///< of the ridge
  double height = 0, slope = 0;       ///< of the ridge, m; tangent
  double half_length = 4, width = 5;  ///< along the ridge, and across it on the plan, m

  Eigen::Vector3d normal() const {
    const Eigen::Vector2d across(-along.y(), along.x());
    return Eigen::Vector3d(side * slope * across.x(), side * slope * across.y(), 1).normalized();
  }
  Eigen::Vector3d ridge() const { return {centre.x(), centre.y(), height}; }
};

enum class Ground { flat, relief, village };

/// A jump of the trajectory's errors.
struct FlightJump {
  std::size_t strip = 0;
  double begin = 0;              ///< s of the strip at which it comes
  double end = 1e9;              ///< s of the same strip at which it goes again
  std::array<double, 6> size{};  ///< true less measured, in the order of the corrections, m, deg
};

/// Heights of rough ground: a Gaussian process with a squared exponential covariance, as waves.
class Roughness {
 public:
  Roughness() = default;
  Roughness(std::mt19937_64& generator, double sigma, double length) {
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(0, 2 * std::numbers::pi);
    constexpr int kWaves = 48;
    for (int i = 0; i < kWaves; ++i) {
      waves_.push_back(
          {normal(generator) / length, normal(generator) / length, uniform(generator)});
    }
    amplitude_ = sigma * std::sqrt(2.0 / kWaves);
  }
  double at(double x, double y) const {
    double sum = 0;
    for (const auto& [east, north, phase] : waves_) sum += std::cos(east * x + north * y + phase);
    return amplitude_ * sum;
  }

 private:
  double amplitude_ = 0;
  std::vector<std::array<double, 3>> waves_;
};

struct FlightSettings {
  Ground ground = Ground::village;
  double strip_length = 80, height = 80, speed = 5;  // m, m/s
  std::vector<double> headings_deg = {90, 270, 0, 180};
  double attitude_rms_deg = 2, velocity_rms = 0.15;
  double shot_rate = 5000;
  double range_noise = 0.02;
  bool trajectory_errors = true;
  /// Errors of the trajectory at knots of this spacing, linear between; 0: at every sample.
  double error_knots = 0;
  trajectories::ErrorModel errors = flight_errors_of_a_good_unit();
  Eigen::Vector3d boresight_deg{2, -1.5, 1};
  Eigen::Vector3d lever_arm{0.10, 0.05, 0.12};
  double range_offset = 0.01, clock_offset = 0.001;
  double clock_drift = 0;     ///< s/s that the trajectory's clock gains, about the flight's middle
  double attitude_delay = 0;  ///< by which the attitudes of the trajectory are late, s
  std::vector<FlightJump> jumps{};
  double roughness = 0, roughness_length = 1;  ///< of level ground: sigma and correlation, m
  std::uint64_t seed = 1;
};

/// A flight with its truth.
class SimulatedFlight {
 public:
  explicit SimulatedFlight(const FlightSettings& settings)
      : settings_(settings), generator_(settings.seed) {
    sensor = sensors::load_sensor("mid-40-table3");
    nominal << 0, 0, 1, 0, -1, 0, 1, 0, 0;
    boresight = flight_rotation(settings.boresight_deg * std::numbers::pi / 180);
    if (settings.ground == Ground::village) build();
    std::mt19937_64 of_ground(settings.seed + 990);
    rough_ = Roughness(of_ground, settings.roughness, settings.roughness_length);
    fly();
    shoot();
  }

  /// Where the body truly is.
  void pose(double time, Eigen::Vector3d& position, Eigen::Matrix3d& attitude) const {
    const auto strip = std::min<std::size_t>(static_cast<std::size_t>(time / period()),
                                             settings_.headings_deg.size() - 1);
    pose_of_strip(strip, time, position, attitude);
  }

  /// The same of a strip, a little before it begins or after it ends, too.
  void pose_of_strip(std::size_t strip, double time, Eigen::Vector3d& position,
                     Eigen::Matrix3d& attitude) const {
    const double begin = static_cast<double>(strip) * period();
    const double heading = settings_.headings_deg[strip] * std::numbers::pi / 180;
    const double along = settings_.speed * (time - begin - 0.5 * duration() - kLead);
    position =
        Eigen::Vector3d(along * std::sin(heading), along * std::cos(heading), settings_.height) +
        Eigen::Vector3d(velocity_[0].integral(time), velocity_[1].integral(time),
                        velocity_[2].integral(time));
    Eigen::Matrix3d enu_from_ned;
    enu_from_ned << 0, 1, 0, 1, 0, 0, 0, 0, -1;
    attitude = enu_from_ned * trajectories::ned_from_body({angle_[0].at(time), angle_[1].at(time),
                                                           heading + angle_[2].at(time)})
                                  .toRotationMatrix();
  }

  /// Range to the ground and what it meets: 0 the ground, i + 1 a roof.
  double range_of(const Eigen::Vector3d& start, const Eigen::Vector3d& direction,
                  std::size_t& surface) const {
    surface = 0;
    double range = -start.z() / direction.z();
    const bool hills = settings_.ground == Ground::relief;
    if (hills || settings_.roughness > 0) {
      for (int i = 0; i < 50; ++i) {
        const Eigen::Vector3d point = start + range * direction;
        const double hill = hills ? relief(point.x(), point.y()) : 0;
        const double rough = settings_.roughness > 0 ? rough_.at(point.x(), point.y()) : 0;
        const double change = (hill + rough - point.z()) / direction.z();
        range += change;
        if (std::abs(change) < (hills ? 1e-12 : 1e-5)) break;
      }
      if (hills) return range;
    }
    const Eigen::Vector2d ground = (start + range * direction).head<2>();
    for (std::size_t i = 0; i < roofs.size(); ++i) {
      const Roof& roof = roofs[i];
      if ((ground - roof.centre).squaredNorm() > 400) continue;
      const Eigen::Vector3d normal = roof.normal();
      const double own = normal.dot(roof.ridge() - start) / normal.dot(direction);
      const Eigen::Vector2d from = (start + own * direction).head<2>() - roof.centre;
      const double u = from.dot(roof.along),
                   v = roof.side * (from.y() * roof.along.x() - from.x() * roof.along.y());
      if (own < range && std::abs(u) <= roof.half_length && v >= 0 && v <= roof.width) {
        range = own;
        surface = i + 1;
      }
    }
    return range;
  }

  /// The plane of what a shot has met; not for relief.
  std::vector<calibration::GroundPlane> true_planes() const {
    std::vector<calibration::GroundPlane> planes{{{0, 0, 1}, {0, 0, 0}}};
    for (const Roof& roof : roofs) planes.push_back({roof.normal(), roof.ridge()});
    return planes;
  }

  /// Options of a calibration that starts at the nominal sensor and mount.
  calibration::FlightCalibrationOptions options() const {
    calibration::FlightCalibrationOptions options;
    options.sensor = sensors::load_sensor("mid-40");
    // What a recording determines by itself.
    options.sensor.set("refractive_index", sensor.get("refractive_index"));
    options.sensor.set_knowledge({"refractive_index", 1e-5, "its own estimate", 0});
    options.errors = settings_.errors;
    options.mount.nominal = nominal;
    std::mt19937_64 generator(settings_.seed + 77);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 3; ++i) {
      options.mount.boresight[i] = {0, radians_from_degrees(3.0), "as built"};
      options.mount.lever_arm[i] = {settings_.lever_arm[i] + 0.01 * normal(generator), 0.01,
                                    "tape"};
    }
    options.mount.clock_offset = {settings_.clock_offset + 0.002 * normal(generator), 0.002, "PPS"};
    options.range_offset_sigma = 0.02;
    return options;
  }

  std::size_t strips() const { return settings_.headings_deg.size(); }

  sensors::Sensor sensor;  ///< true
  Eigen::Matrix3d nominal, boresight;
  std::vector<Roof> roofs;
  calibration::FlightShots shots;
  std::vector<double> true_range;                  ///< [shots]
  std::vector<std::size_t> met;                    ///< [shots]
  std::vector<double> pose_time;                   ///< [shots], true, s
  trajectories::Trajectory trajectory;             ///< as measured, local
  std::vector<Eigen::Matrix<double, 6, 1>> error;  ///< [records]: true less measured

  const trajectories::ErrorTerm& term_of(int correction) const {
    return settings_.errors.terms[static_cast<std::size_t>(calibration::error_of(correction))];
  }

 private:
  static constexpr double kLead = 0.5, kTurn = 20;  // s of trajectory around a strip; of a turn

  double duration() const { return settings_.strip_length / settings_.speed; }
  double period() const { return duration() + 2 * kLead + kTurn; }

  static double relief(double x, double y) {
    return 3 * std::sin(2 * std::numbers::pi * x / 80) * std::cos(1.6 * std::numbers::pi * y / 80);
  }

  void build() {
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<Eigen::Vector2d> centres{{0, 0}};
    while (centres.size() < 20) {
      const Eigen::Vector2d centre(100 * uniform(generator_) - 50, 100 * uniform(generator_) - 50);
      const bool free = std::ranges::all_of(
          centres, [&](const Eigen::Vector2d& c) { return (c - centre).norm() > 12; });
      if (free) centres.push_back(centre);
    }
    for (const Eigen::Vector2d& centre : centres) {
      const double azimuth = 2 * std::numbers::pi * uniform(generator_);
      const double slope = (20 + 25 * uniform(generator_)) * std::numbers::pi / 180;
      const double height = 6 + 3 * uniform(generator_);
      for (const double side : {-1.0, 1.0}) {
        roofs.push_back({centre,
                         {std::cos(azimuth), std::sin(azimuth)},
                         side,
                         height,
                         std::tan(slope),
                         4,
                         5 * std::cos(slope)});
      }
    }
  }

  void fly() {
    const double rms = settings_.attitude_rms_deg * std::numbers::pi / 180;
    for (Sway& sway : angle_) sway = Sway(generator_, 6, 0.15, 1.2, rms);
    for (Sway& sway : velocity_) sway = Sway(generator_, 6, 0.05, 0.4, settings_.velocity_rms);
    std::normal_distribution<double> normal;
    constexpr double step = 0.005;
    Eigen::Matrix<double, 6, 1> state = Eigen::Matrix<double, 6, 1>::Zero();
    double last = -1;
    const auto advance = [&](double time) {
      for (int c = 0; c < 6; ++c) {
        const trajectories::ErrorTerm& term = term_of(c);
        const double sigma = *term.sigma;
        if (last < 0) {
          state[c] = sigma * normal(generator_);
        } else {
          const double decay = std::exp(-(time - last) / term.correlation_time);
          state[c] = decay * state[c] + sigma * std::sqrt(1 - decay * decay) * normal(generator_);
        }
      }
      last = time;
    };
    trajectory.frame = trajectories::Frame::local;
    for (std::size_t s = 0; s < strips(); ++s) {
      const double begin = static_cast<double>(s) * period();
      const auto records = static_cast<std::size_t>((duration() + 2 * kLead) / step);
      Eigen::Matrix<double, 6, 1> from = Eigen::Matrix<double, 6, 1>::Zero(), to = from;
      double knot_begin = -1, knot_end = -1;
      for (std::size_t i = 0; i < records; ++i) {
        const double time = begin + static_cast<double>(i) * step;
        Eigen::Matrix<double, 6, 1> off = Eigen::Matrix<double, 6, 1>::Zero();
        if (settings_.trajectory_errors) {
          if (settings_.error_knots > 0) {
            if (knot_end < 0) {
              advance(time);
              to = state;
              knot_end = time;
            }
            while (time >= knot_end) {
              from = to;
              knot_begin = knot_end;
              knot_end += settings_.error_knots;
              advance(knot_end);
              to = state;
            }
            const double w = (time - knot_begin) / settings_.error_knots;
            off = (1 - w) * from + w * to;
          } else {
            advance(time);
            off = state;
          }
          for (int c = 3; c < 6; ++c) {
            off[c] += term_of(c).white * normal(generator_);
          }
        }
        for (const FlightJump& jump : settings_.jumps) {
          const double since = time - begin - kLead;
          if (s < jump.strip || (s == jump.strip && since < jump.begin)) continue;
          if (jump.end < duration() && (s > jump.strip || since >= jump.end)) continue;
          for (int c = 0; c < 6; ++c) {
            const double size = jump.size[c];
            off[c] += c < 3 ? size : radians_from_degrees(size);
          }
        }
        Eigen::Vector3d position, elsewhere;
        Eigen::Matrix3d attitude, late;
        pose(time, position, attitude);
        if (settings_.attitude_delay != 0) {
          pose_of_strip(s, time - settings_.attitude_delay, elsewhere, late);
          attitude = late;
        }
        error.push_back(off);
        trajectory.time_ns.push_back(std::llround(time * 1e9) + kEpoch);
        trajectory.position.push_back(position - off.head<3>());
        trajectory.attitude.emplace_back(
            Eigen::Matrix3d(flight_rotation(-off.tail<3>()) * attitude));
        trajectory.attitude.back().normalize();
      }
    }
  }

  void shoot() {
    std::normal_distribution<double> normal;
    std::vector<double> times;
    for (std::size_t s = 0; s < strips(); ++s) {
      const auto count = static_cast<std::size_t>(duration() * settings_.shot_rate);
      for (std::size_t i = 0; i < count; ++i) {
        // A little uneven, so that a low rate does not beat with the rotors.
        const double jitter = 0.4 * std::sin(12.9898 * static_cast<double>(i % 100003));
        times.push_back(static_cast<double>(s) * period() + kLead +
                        (static_cast<double>(i) + 0.5 + jitter) / settings_.shot_rate);
        shots.strip.push_back(static_cast<std::uint16_t>(s));
      }
    }
    const std::size_t n = times.size();
    shots.rotation_angle.assign(2, std::vector<double>(n));
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < 2; ++k) {
        shots.rotation_angle[k][i] =
            std::remainder(sensor.angular_velocity[k] * times[i], 2 * std::numbers::pi);
      }
    }
    std::array<std::vector<double>, 6> out;
    for (auto& column : out) column.resize(n);
    DirectionColumns columns;
    columns.x = out[0];
    columns.y = out[1];
    columns.z = out[2];
    columns.origin_x = out[3];
    columns.origin_y = out[4];
    columns.origin_z = out[5];
    columns.geometry = sensor.geometry;
    const std::vector<std::span<const double>> angles{shots.rotation_angle[0],
                                                      shots.rotation_angle[1]};
    observe_batch(sensor.train, angles, columns);
    for (std::size_t i = 0; i < n; ++i) {
      Eigen::Vector3d position;
      Eigen::Matrix3d attitude;
      pose(times[i], position, attitude);
      const Eigen::Matrix3d mount = nominal * boresight;
      const Eigen::Vector3d start =
          position + attitude * (settings_.lever_arm +
                                 mount * Eigen::Vector3d(out[3][i], out[4][i], out[5][i]));
      const Eigen::Vector3d direction =
          attitude * mount * Eigen::Vector3d(out[0][i], out[1][i], out[2][i]);
      std::size_t own = 0;
      const double range = range_of(start, direction, own);
      true_range.push_back(range);
      met.push_back(own);
      pose_time.push_back(times[i]);
      shots.range.push_back(range + settings_.range_offset +
                            settings_.range_noise * normal(generator_));
      const double gained =
          settings_.clock_drift * (times[i] - 0.5 * (times.front() + times.back()));
      shots.time_ns.push_back(std::llround((times[i] - settings_.clock_offset - gained) * 1e9) +
                              kEpoch);
    }
  }

  static constexpr std::int64_t kEpoch = 1'300'000'000'000'000'000;
  FlightSettings settings_;
  std::mt19937_64 generator_;
  std::array<Sway, 3> angle_, velocity_;
  Roughness rough_;
};

/// What a calibration is off by.
struct FlightErrors {
  double total = 0, shape = 0;  ///< of boresight and prisms, RMS over the beams, rad
  double nees = 0;              ///< of all adjusted globals, per unknown
  Eigen::VectorXd error;        ///< [unknowns]
};

inline FlightErrors flight_errors(const SimulatedFlight& flight, const FlightSettings& settings,
                                  const calibration::FlightCalibration& found) {
  FlightErrors errors;
  const auto& model = found.model;
  std::vector<Vector3<double>> computed, truth;
  const std::size_t step = std::max<std::size_t>(1, flight.shots.size() / 4000);
  for (std::size_t i = 0; i < flight.shots.size(); i += step) {
    const std::vector<double> angles{flight.shots.rotation_angle[0][i],
                                     flight.shots.rotation_angle[1][i]};
    const auto direction = [&](const PrismTrain& train, const Eigen::Matrix3d& turn) {
      const Vector3<double> d = observe(train, angles).direction;
      const Eigen::Vector3d turned = turn * Eigen::Vector3d(d.x, d.y, d.z);
      return Vector3<double>(turned.x(), turned.y(), turned.z());
    };
    computed.push_back(direction(model.train, model.boresight));
    truth.push_back(direction(flight.sensor.train, flight.boresight));
  }
  const calibration::DirectionErrors directions = calibration::direction_errors(computed, truth);
  errors.total = std::hypot(directions.gauge, directions.shape);
  errors.shape = directions.shape;
  calibration::FlightModel true_model = model;
  true_model.train = flight.sensor.train;
  true_model.boresight = flight.boresight;
  true_model.lever_arm = settings.lever_arm;
  true_model.range_offset = settings.range_offset;
  true_model.clock_offset = settings.clock_offset;
  errors.error = calibration::unknown_values(model) - calibration::unknown_values(true_model);
  std::vector<Eigen::Index> adjusted;
  for (std::size_t i = 0; i < found.unknowns.size(); ++i) {
    if (!found.unknowns[i].held) adjusted.push_back(static_cast<Eigen::Index>(i));
  }
  const Eigen::MatrixXd covariance = found.covariance(adjusted, adjusted);
  const Eigen::VectorXd off = errors.error(adjusted);
  errors.nees = off.dot(covariance.ldlt().solve(off)) / static_cast<double>(adjusted.size());
  return errors;
}

}  // namespace risley::testing
