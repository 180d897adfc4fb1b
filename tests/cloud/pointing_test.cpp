// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/pointing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/sensors/footprint.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/sensors/range_values.hpp"

#include "optics/trains.hpp"
#include "parameter_name.hpp"
#include "refusal.hpp"

namespace risley::cloud::pointing_test {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using sensors::CalibrationReference;
using ::testing::ElementsAre;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Vector3d eigen(const Vector3<double>& v) { return {v.x, v.y, v.z}; }

void move_all(std::vector<double>& values, double step) {
  for (double& value : values) value += step;
}

/// A train, the sizes of its prisms, and the rotation angles of one shot.
struct Beam {
  PrismTrain train;
  PrismGeometry geometry;
  std::vector<double> angles;

  Vector3d direction() const { return eigen(emergent_ray(train, geometry, angles).direction); }
  Vector3d point(double range) const {
    const Ray ray = emergent_ray(train, geometry, angles);
    return eigen(ray.origin) + range * eigen(ray.direction);
  }
};

/// Derivative of a point by the number that change(beam, step) changes.
template <class Change>
Vector3d rate_of(const Beam& beam, double range, double step, const Change& change) {
  Beam up = beam, down = beam;
  change(up, step);
  change(down, -step);
  return (up.point(range) - down.point(range)) / (2.0 * step);
}

Vector3d rate_by_place(const Beam& beam, double range, int place) {
  return rate_of(beam, range, 1e-5, [place](Beam& b, double step) {
    b.train.set_place(place, b.train[place] + step);
  });
}

Vector3d rate_by_angle(const Beam& beam, double range, std::size_t prism) {
  return rate_of(beam, range, 1e-5, [prism](Beam& b, double step) { b.angles[prism] += step; });
}

/// What one shot must give, in plain numbers.
struct Expected {
  Vector3d point = Vector3d::Zero(), direction = Vector3d::Zero();
  /// Without and with the movement of the beam's origin along the beam.
  Matrix3d covariance = Matrix3d::Zero(), full_covariance = Matrix3d::Zero();
  /// How far the two may be apart by what is left out.
  double left_out = 0;
  std::vector<Vector3d> loading;
  double range = 0, incidence = kNaN, azimuth_residual = 0, zenith_residual = 0;

  /// An error that moves the point, less or with what it moves along the beam.
  void add(const MatrixXd& rates, const MatrixXd& covariance_of_them) {
    const Matrix3d across = Matrix3d::Identity() - direction * direction.transpose();
    const Matrix3d whole = rates * covariance_of_them * rates.transpose();
    covariance += across * whole * across;
    full_covariance += whole;
    const double along = std::sqrt(std::max(direction.dot(whole * direction), 0.0));
    left_out += along * (2.0 * std::sqrt(whole.trace()) + along);
  }
};

/// What a unit of each range error adds to the range of one shot, as the simulator has it.
struct RangeShares {
  double near = 0, incidence = 0, per_decade = 0;

  RangeShares(const sensors::Sensor& sensor, const PointedShots& shots, std::size_t i,
              const Vector3d& direction, double range)
      : near(sensors::near_share(range)) {
    const double intensity = shots.intensity[i];
    if (!(intensity < 0)) per_decade = sensors::intensity_decades(intensity);
    const Vector3<double> normal{shots.surface_normal[0][i], shots.surface_normal[1][i],
                                 shots.surface_normal[2][i]};
    if (std::isnan(normal.x)) return;
    const Vector3<double> beam{direction.x(), direction.y(), direction.z()};
    const sensors::FootprintAxes axes = sensors::footprint_axes(beam);
    const double whole = sensors::footprint_depth(
        range, sensors::footprint_slope(normal, beam, axes.horizontal),
        sensors::footprint_slope(normal, beam, axes.vertical), sensor.beam_divergence_horizontal,
        sensor.beam_divergence_vertical);
    const double least = std::cos(radians_from_degrees(80));
    const double cosine = std::abs(dot(normal, beam));
    incidence = cosine < least ? whole * cosine / least : whole;
  }

  /// Of all errors of that emitter, the constant one included.
  double sum(double range_offset, const sensors::RangeErrors& errors, std::size_t emitter) const {
    return range_offset + errors.near * near + errors.incidence * incidence +
           errors.per_decade * per_decade +
           (errors.emitter.empty() ? 0.0 : errors.emitter[emitter]);
  }
};

/// The range that is reported as it is in spite of these errors.
double true_range(const sensors::Sensor& sensor, const PointedShots& shots, std::size_t i,
                  const Vector3d& direction, double range_offset,
                  const sensors::RangeErrors& errors) {
  double range = shots.range[i];
  for (int step = 0; step < 50; ++step) {
    range =
        shots.range[i] -
        RangeShares(sensor, shots, i, direction, range).sum(range_offset, errors, shots.beam[i]);
  }
  return range;
}

Beam beam_of(const PointingModel& model, const PointedShots& shots, std::size_t i) {
  Beam beam{model.train, model.geometry, {}};
  for (const auto& column : shots.rotation_angle) beam.angles.push_back(column[i]);
  return beam;
}

Expected expected_point(const PointingModel& model, const PointedShots& shots, std::size_t i) {
  const Beam beam = beam_of(model, shots, i);
  const std::size_t prisms = beam.angles.size();
  const Ray ray = emergent_ray(beam.train, beam.geometry, beam.angles);
  const bool reported = model.options.reported_directions;
  Expected e;
  const double azimuth = shots.azimuth[i], zenith = shots.zenith[i];
  e.direction = reported ? eigen(direction_from_angles(SphericalAngles<double>{azimuth, zenith}))
                         : eigen(ray.direction);
  e.range = true_range(model.sensor, shots, i, e.direction, model.range_offset, model.range_errors);
  e.point = eigen(ray.origin) + e.range * e.direction;
  const Observation believed = observe(model.believed, beam.angles);
  e.azimuth_residual = wrap_to_pi(azimuth - believed.azimuth);
  e.zenith_residual = zenith - believed.zenith;

  // The range.
  const Vector3d normal(shots.surface_normal[0][i], shots.surface_normal[1][i],
                        shots.surface_normal[2][i]);
  double tangent = 0;
  if (!normal.hasNaN()) {
    e.incidence = std::atan2(normal.cross(e.direction).norm(), std::abs(normal.dot(e.direction)));
    tangent = std::tan(e.incidence);
  }
  const double range_variance =
      model.sensor.range_variance(e.range, tangent, shots.intensity[i]) + shots.range_rounding[i];
  const Matrix3d along = e.direction * e.direction.transpose();
  e.covariance += range_variance * along;
  e.full_covariance += range_variance * along;

  // The direction.
  MatrixXd rates(3, prisms);
  for (std::size_t k = 0; k < prisms; ++k) {
    rates.col(k) = rate_by_angle(beam, e.range, k);
  }
  if (reported) {
    MatrixXd turned(3, 2);
    const double noise = model.angle_noise * model.angle_noise;
    turned.col(0) = e.range * std::sin(zenith) * Vector3d(-std::sin(azimuth), std::cos(azimuth), 0);
    turned.col(1) = e.range * Vector3d(std::cos(zenith) * std::cos(azimuth),
                                       std::cos(zenith) * std::sin(azimuth), -std::sin(zenith));
    e.add(turned,
          Eigen::Vector2d(noise + shots.azimuth_rounding[i], noise + shots.zenith_rounding[i])
              .asDiagonal()
              .toDenseMatrix());
  } else {
    MatrixXd covariance(rates.cols(), rates.cols());
    std::size_t pair = 0;
    for (Index k = 0; k < rates.cols(); ++k) {
      for (Index l = k; l < rates.cols(); ++l) {
        covariance(k, l) = covariance(l, k) = shots.angle_covariance[pair++][i];
      }
    }
    e.add(rates, covariance);
  }
  if (model.options.beam_divergence) {
    const double h = kDivergenceSigma * model.sensor.beam_divergence_horizontal;
    const double v = kDivergenceSigma * model.sensor.beam_divergence_vertical;
    MatrixXd spread(3, 2);
    spread.col(0) = rate_by_place(beam, e.range, place::incident_beam_horizontal());
    spread.col(1) = rate_by_place(beam, e.range, place::incident_beam_vertical());
    e.add(spread, Eigen::Vector2d(h * h, v * v).asDiagonal().toDenseMatrix());
  }

  // What all shots share.
  MatrixXd common(3, model.places.size() + prisms + 2);
  Index column = 0;
  for (const int place : model.places) common.col(column++) = rate_by_place(beam, e.range, place);
  for (Index k = 0; k < rates.cols(); ++k) common.col(column++) = rates.col(k);
  common.col(column++) = rate_of(
      beam, e.range, 1e-4, [](Beam& b, double step) { move_all(b.geometry.thickness, step); });
  common.col(column++) = rate_of(beam, e.range, 1e-4,
                                 [](Beam& b, double step) { move_all(b.geometry.spacing, step); });
  const Matrix3d across = Matrix3d::Identity() - along;
  const RangeShares shares(model.sensor, shots, i, e.direction, e.range);
  for (const CommonFactor& factor : model.factors) {
    const Vector3d whole = common * factor.weights;
    const Vector3d along_beam =
        shares.sum(factor.range_offset, factor.range_errors, shots.beam[i]) * e.direction;
    const Vector3d moved = across * whole - along_beam;
    const double extra = std::abs(e.direction.dot(whole));
    e.loading.push_back(moved);
    e.covariance += moved * moved.transpose();
    const Vector3d full = whole - along_beam;
    e.full_covariance += full * full.transpose();
    e.left_out += extra * (2.0 * moved.norm() + extra);
  }
  return e;
}

Matrix3d covariance_of(const Points& points, std::size_t i) {
  Matrix3d c;
  const auto at = [&](CovarianceTerm term) { return points.covariance[term][i]; };
  c << at(kXX), at(kXY), at(kXZ), at(kXY), at(kYY), at(kYZ), at(kXZ), at(kYZ), at(kZZ);
  return c;
}

Vector3d point_of(const Points& points, std::size_t i) {
  return {points.x[i], points.y[i], points.z[i]};
}

Vector3d loading_of(const Points& points, std::size_t factor, std::size_t i) {
  const auto& columns = points.loading[factor];
  return {columns[0][i], columns[1][i], columns[2][i]};
}

/// Random numbers one after the other.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : stream_(seed, 77) {}
  double normal() { return stream_.normal(next_++); }
  double between(double a, double b) { return a + (b - a) * stream_.uniform(next_++); }

 private:
  RandomStream stream_;
  std::uint64_t next_ = 0;
};

/// A model with everything in it: imperfect train, all parts of the range's noise, five factors
/// that act on everything at once.
PointingModel imperfect_model(const std::string& order, unsigned seed,
                              const PointingOptions& options = {}) {
  Dice dice(seed);
  PointingModel model;
  model.train = testing::imperfect_train(order, 0.5, seed);
  model.believed = testing::imperfect_train(order, 0.5, seed + 1000);
  model.geometry = {{0.0}, {0.0}};
  if (options.beam_origin) model.geometry = {{0.007}, {0.030}};
  model.range_offset = 0.031;
  model.angle_noise = 7e-5;
  model.options = options;
  sensors::Sensor& sensor = model.sensor;
  sensor.train = model.train;
  sensor.range_noise = 0.004;
  sensor.range_noise_per_range = 1e-4;
  sensor.range_noise_incidence = 0.002;
  sensor.range_noise_weak_return = 0.03;
  sensor.beam_divergence_horizontal = radians_from_degrees(0.03);
  sensor.beam_divergence_vertical = radians_from_degrees(0.28);
  const int prisms = model.train.prisms();
  for (int place = 0; place < parameter_count(prisms); ++place) {
    if (place == place::bearing_tilt_horizontal(prisms - 1)) continue;
    if (place == place::bearing_tilt_vertical(prisms - 1)) continue;
    if (place == place::incident_beam_vertical()) continue;  // not every place has a factor
    model.places.push_back(place);
  }
  for (int j = 0; j < 5; ++j) {
    CommonFactor factor;
    factor.name = fmt::format("factor_{}", j);
    factor.weights.resize(std::ssize(model.places) + prisms + 2);
    for (Index i = 0; i < factor.weights.size(); ++i) {
      factor.weights[i] = (i + j) % 3 == 0 ? 0.0 : 1e-4 * dice.normal();
    }
    factor.weights.tail(2) = 1e-3 * Eigen::Vector2d(dice.normal(), dice.normal());
    factor.range_offset = 2e-3 * dice.normal();
    model.factors.push_back(factor);
  }
  return model;
}

/// Shots at random rotation angles. Reported directions are near those of the believed train when
/// residuals are wanted, or near the true beam.
PointedShots random_shots(const PointingModel& model, std::size_t count, unsigned seed) {
  Dice dice(seed + 5000);
  const int prisms = model.train.prisms();
  PointedShots shots;
  shots.resize(prisms, count);
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<double> angles;
    MatrixXd root(prisms, prisms);
    for (int k = 0; k < prisms; ++k) {
      angles.push_back(dice.between(-20.0, 20.0));
      shots.rotation_angle[k][i] = angles.back();
      for (int l = 0; l < prisms; ++l) root(k, l) = 3e-5 * dice.normal();
    }
    const MatrixXd covariance = root * root.transpose();
    std::size_t pair = 0;
    for (int k = 0; k < prisms; ++k) {
      for (int l = k; l < prisms; ++l) shots.angle_covariance[pair++][i] = covariance(k, l);
    }
    const Observation seen = observe(model.train, angles);
    shots.azimuth[i] = wrap_to_pi(seen.azimuth + 1e-4 * dice.normal());
    shots.zenith[i] = seen.zenith + 1e-4 * dice.normal();
    shots.azimuth_rounding[i] = 3e-9 * dice.between(0, 1);
    shots.zenith_rounding[i] = 3e-9 * dice.between(0, 1);
    shots.range_rounding[i] = 1e-6 * dice.between(0, 1);
    shots.range[i] = i % 5 == 0 ? 0.5 + model.range_offset : std::exp(dice.between(-0.5, 5.3));
    shots.intensity[i] = std::floor(dice.between(0, 256));
    Vector3d normal(dice.normal(), dice.normal(), dice.normal());
    normal.normalize();
    if (i % 3 == 1) normal.setConstant(kNaN);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      shots.surface_normal[axis][i] = normal[axis];
    }
  }
  return shots;
}

CloudHeader header_of(const PointingModel& model, bool covariance = true, bool loadings = true) {
  CloudHeader header;
  header.prisms = model.train.prisms();
  header.has_covariance = covariance;
  if (loadings) {
    for (const CommonFactor& factor : model.factors) header.factors.push_back(factor.name);
  }
  return header;
}

Points points_of(const PointingModel& model, const CloudHeader& header, const PointedShots& shots,
                 InstructionSet set = available_instruction_sets().back()) {
  Points points;
  header.resize(points, shots.size());
  compute_points(model, header, shots, points, {}, set);
  return points;
}

/// Largest entry of a difference of covariances over the stated one's trace.
double relative_difference(const Matrix3d& found, const Matrix3d& stated) {
  const double worst = (found - stated).cwiseAbs().maxCoeff() / stated.trace();
  return std::isfinite(worst) ? worst : std::numeric_limits<double>::infinity();
}

/// @param range_error  of what the corrections of ranges leave, m
void expect_points(const PointingModel& model, const PointedShots& shots, const Points& points,
                   double range_error = 0) {
  for (std::size_t i = 0; i < shots.size(); ++i) {
    SCOPED_TRACE(fmt::format("shot {} of {}", i, shots.size()));
    const Expected e = expected_point(model, shots, i);
    EXPECT_LT((point_of(points, i) - e.point).norm(), 1e-14 * (10.0 + e.range) + range_error);
    if (range_error == 0) {
      EXPECT_DOUBLE_EQ(points.range[i], e.range);
    } else {
      EXPECT_NEAR(points.range[i], e.range, range_error);
    }
    EXPECT_NEAR(points.azimuth_residual[i], e.azimuth_residual,
                1e-15 + 1e-8 * std::abs(e.azimuth_residual));
    EXPECT_NEAR(points.zenith_residual[i], e.zenith_residual,
                1e-15 + 1e-8 * std::abs(e.zenith_residual));
    if (std::isnan(e.incidence)) {
      EXPECT_TRUE(std::isnan(points.incidence[i]));
    } else {
      EXPECT_NEAR(points.incidence[i], e.incidence, 1e-7);  // root of 1 - cosine^2
    }
    for (std::size_t k = 0; k < points.rotation_angle.size(); ++k) {
      const double angle = points.rotation_angle[k][i];
      EXPECT_TRUE(angle >= 0 && angle < kTwoPi) << angle;
      EXPECT_NEAR(wrap_to_pi(angle - shots.rotation_angle[k][i]), 0.0, 1e-14);
    }
    for (std::size_t j = 0; j < points.loading.size(); ++j) {
      EXPECT_LT((loading_of(points, j, i) - e.loading[j]).norm(), 1e-9 * (10.0 + e.range));
    }
    if (points.covariance[0].empty()) continue;
    const Matrix3d found = covariance_of(points, i);
    EXPECT_LT(relative_difference(found, e.covariance), 1e-7);
    EXPECT_LT((found - e.full_covariance).cwiseAbs().maxCoeff(),
              e.left_out + 1e-7 * e.covariance.trace());
  }
}

struct PointCase {
  std::string order;
  bool reported = false, origin = true;

  friend std::ostream& operator<<(std::ostream& out, const PointCase& one) {
    return out << one.order << (one.reported ? " reported" : " smoothed")
               << (one.origin ? " with origin" : " from zero");
  }
};

class PointsOfEveryTrain : public ::testing::TestWithParam<PointCase> {};

// All columns of every length of tail, where ranges have an offset alone, and where they have all
// errors: corrected, and their uncertainties along the beam.
TEST_P(PointsOfEveryTrain, EqualPlainNumbersInEveryInstructionSet) {
  PointingOptions options;
  options.reported_directions = GetParam().reported;
  options.beam_origin = GetParam().origin;
  for (unsigned count = 1; count <= 17; ++count) {
    options.beam_divergence = count % 4 != 0;
    PointingModel model = imperfect_model(GetParam().order, count, options);
    PointedShots shots = random_shots(model, count, count);
    for (const InstructionSet set : available_instruction_sets()) {
      SCOPED_TRACE(to_string(set));
      expect_points(model, shots, points_of(model, header_of(model), shots, set));
    }
    if (count % 5 != 0) model.range_errors = {0.02, 0.3, 0.01, {0.004}};
    for (std::size_t j = 0; j < model.factors.size(); ++j) {
      const double size = 1e-3 * static_cast<double>(j + 1);
      sensors::RangeErrors& errors = model.factors[j].range_errors;
      if (j != 1) errors.near = size;
      if (j != 2) errors.incidence = -20 * size;
      if (j > 2) errors.per_decade = size;
      if (j == 4) errors.emitter = {size};
    }
    for (std::size_t i = 3; i < count; i += 6) shots.intensity[i] = -1;  // not known
    for (std::size_t i = 0; i < count; i += 7) {                         // grazing
      const Expected e = expected_point(model, shots, i);
      const Vector3d across = e.direction.unitOrthogonal() + 0.01 * e.direction;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        shots.surface_normal[axis][i] = across.normalized()[axis];
      }
    }
    for (const InstructionSet set : available_instruction_sets()) {
      SCOPED_TRACE(to_string(set));
      expect_points(model, shots, points_of(model, header_of(model), shots, set), 1e-12);
    }
  }
}

// Straight up, where the footprint has no horizontal axis, and with an emitter's error of its own.
TEST(ComputePoints, RangesOfReportedDirectionsLoseTheErrorsOfTheirEmitter) {
  PointingModel model;
  model.train = model.believed = testing::imperfect_train("PA-AP", 0.1, 3, 6);
  model.options.reported_directions = true;
  model.options.beam_origin = false;
  model.sensor = sensors::load_sensor("avia");
  model.range_offset = 0.02;
  model.range_errors = {0.02, 0.3, 0.01, {0.001, 0.002, 0.003, 0.004, 0.005, 0.006}};
  CommonFactor factor;
  factor.weights = VectorXd::Zero(4);
  factor.range_errors.emitter = {0, 0, 0, 0.5e-3, 0, 0};
  model.factors = {factor};
  PointedShots shots;
  shots.resize(2, 9);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    shots.beam[i] = static_cast<std::uint8_t>((i + 3) % 6);
    shots.zenith[i] = i == 0 ? 0.0 : 0.2 * static_cast<double>(i);
    shots.azimuth[i] = i == 0 ? 0.0 : 0.3;
    shots.range[i] = 1.5 + static_cast<double>(i);
    shots.intensity[i] = 10;
    shots.surface_normal[0][i] = 0.6;
    shots.surface_normal[2][i] = 0.8;
  }
  CloudHeader header = header_of(model);
  header.has_rotation_angles = false;
  for (const InstructionSet set : available_instruction_sets()) {
    const Points points = points_of(model, header, shots, set);
    for (std::size_t i = 0; i < shots.size(); ++i) {
      SCOPED_TRACE(fmt::format("{} shot {}", to_string(set), i));
      const Vector3d direction =
          eigen(direction_from_angles(SphericalAngles<double>{shots.azimuth[i], shots.zenith[i]}));
      const double range =
          true_range(model.sensor, shots, i, direction, model.range_offset, model.range_errors);
      EXPECT_NEAR(points.range[i], range, 1e-12);
      const double moved = shots.beam[i] == 3 ? -0.5e-3 : 0.0;
      EXPECT_LT((loading_of(points, 0, i) - moved * direction).norm(), 1e-15);
    }
  }
  // A footprint's depth is that of the simulator.
  const RangeShares shares(model.sensor, shots, 0, Vector3d::UnitZ(), 1.0);
  EXPECT_GT(shares.incidence, 0);
  model.range_errors.near = kNaN;
  EXPECT_THROW(points_of(model, header, shots), InvalidArgument);
  model.range_errors = {0, 0, 0, {0.001}};
  EXPECT_THROW(points_of(model, header, shots), InvalidArgument);
}

std::vector<PointCase> point_cases() {
  std::vector<PointCase> cases;
  for (const char* order :
       {"PA", "PA-PA", "PA-AP", "AP-AP", "AP-PA", "PA-AP-PA", "AP-PA-PA", "PA-AP-AP-PA"}) {
    for (const bool reported : {false, true}) {
      for (const bool origin : {true, false}) cases.push_back({order, reported, origin});
    }
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Trains, PointsOfEveryTrain, ::testing::ValuesIn(point_cases()),
                         [](const auto& one) {
                           return parameter_name(one.param.order) +
                                  (one.param.reported ? "Reported" : "Smoothed") +
                                  (one.param.origin ? "WithOrigin" : "FromZero");
                         });

// Residuals are those of the parameters that directions are reported with, of a reflector, too.
TEST(ComputePoints, ResidualsOfAReflectorAreThoseOfTheBelievedTrain) {
  PointingModel model;
  model.sensor = sensors::load_sensor("mid-360");
  model.train = model.believed = model.sensor.train;
  for (int place = 0; place < parameter_count(model.train.shape()); ++place) {
    if (place == place::refractive_index_air()) continue;
    model.train.set_place(place, model.train[place] + 1e-3 * std::sin(place + 1.0));
  }
  constexpr std::size_t kShots = 40;
  Dice dice(4);
  PointedShots shots;
  shots.resize(model.train.prisms(), kShots);
  for (std::size_t i = 0; i < kShots; ++i) {
    for (auto& column : shots.rotation_angle) column[i] = dice.between(-20.0, 20.0);
    shots.beam[i] = static_cast<std::uint8_t>(i % 4);
    shots.zenith[i] = 1.2;
    shots.range[i] = 7.0;
  }
  const auto at = [&](const PrismTrain& train, std::size_t i) {
    std::vector<double> angles;
    for (const auto& column : shots.rotation_angle) angles.push_back(column[i]);
    return observe(train, angles, shots.beam[i]);
  };
  for (std::size_t i = 0; i < kShots; ++i) {
    const Observation believed = at(model.believed, i);
    shots.azimuth[i] = wrap_to_pi(believed.azimuth + 1e-4 * dice.normal());
    shots.zenith[i] = believed.zenith + 1e-4 * dice.normal();
  }
  const Points points = points_of(model, header_of(model), shots);
  for (std::size_t i = 0; i < kShots; ++i) {
    SCOPED_TRACE(i);
    const Observation believed = at(model.believed, i);
    EXPECT_NEAR(points.azimuth_residual[i], wrap_to_pi(shots.azimuth[i] - believed.azimuth), 1e-11);
    EXPECT_NEAR(points.zenith_residual[i], shots.zenith[i] - believed.zenith, 1e-11);
    EXPECT_LT((point_of(points, i) - 7.0 * eigen(at(model.train, i).direction)).norm(), 1e-12);
  }
}

// A point is the same whether its emitter has the train for itself or shares it.
TEST(ComputePoints, EveryEmitterIsItself) {
  constexpr int kEmitters = 6;
  for (const char* order : {"PA", "PA-AP", "AP-PA-AP", "PA-AP-AP-PA"}) {
    for (const bool same : {true, false}) {
      SCOPED_TRACE(fmt::format("{} {}", order, same));
      PointingModel model = imperfect_model(order, 11);
      model.train = testing::imperfect_train(order, 0.5, 11, kEmitters);
      model.believed = same ? model.train : testing::imperfect_train(order, 0.5, 12, kEmitters);
      const int prisms = model.train.prisms();
      // A factor of everything, of all emitters too.
      model.places.clear();
      for (int at = 0; at < parameter_count(model.train.shape()); ++at) model.places.push_back(at);
      Dice dice(13);
      const auto rest = prisms + std::ssize(model.sizes);
      for (CommonFactor& factor : model.factors) {
        factor.weights.resize(std::ssize(model.places) + rest);
        for (double& weight : factor.weights) weight = 1e-4 * dice.normal();
      }
      PointingModel first = model;
      first.train = testing::train_of_emitter(model.train, 0);
      PointedShots shots = random_shots(first, 43, 14);
      for (std::size_t i = 0; i < shots.size(); ++i) {
        shots.beam[i] = static_cast<std::uint8_t>((i * i + i / 2) % kEmitters);
      }
      const CloudHeader header = header_of(model);
      for (const InstructionSet set : available_instruction_sets()) {
        SCOPED_TRACE(to_string(set));
        const Points found = points_of(model, header, shots, set);
        for (int beam = 0; beam < kEmitters; ++beam) {
          PointingModel own = model;
          own.train = testing::train_of_emitter(model.train, beam);
          own.believed = testing::train_of_emitter(model.believed, beam);
          own.places.clear();
          std::vector<Index> rows;
          for (const int at : model.places) {
            const int mine = testing::place_of_emitter(at, beam, prisms);
            if (mine < 0) continue;
            own.places.push_back(mine);
            rows.push_back(at);
          }
          for (Index i = 0; i < rest; ++i) {
            rows.push_back(std::ssize(model.places) + i);
          }
          for (CommonFactor& factor : own.factors) {
            factor.weights = VectorXd(factor.weights(rows));
          }
          PointedShots alone = shots;
          std::ranges::fill(alone.beam, std::uint8_t{0});
          const Points expected = points_of(own, header, alone, set);
          for (std::size_t i = 0; i < shots.size(); ++i) {
            if (shots.beam[i] != beam) continue;
            EXPECT_LT((point_of(found, i) - point_of(expected, i)).norm(), 1e-12);
            EXPECT_NEAR(found.azimuth_residual[i], expected.azimuth_residual[i], 1e-14);
            EXPECT_NEAR(found.zenith_residual[i], expected.zenith_residual[i], 1e-14);
            EXPECT_LT(relative_difference(covariance_of(found, i), covariance_of(expected, i)),
                      1e-12);
            for (std::size_t j = 0; j < model.factors.size(); ++j) {
              EXPECT_LT((loading_of(found, j, i) - loading_of(expected, j, i)).norm(), 1e-13);
            }
          }
        }
      }
      shots.beam[5] = kEmitters;
      EXPECT_THROW(points_of(model, header, shots), InvalidArgument);
    }
  }
}

// A covariance or loadings less do not change what is left.
TEST(ComputePoints, ColumnsDoNotDependOnWhichOthersAreThere) {
  const PointingModel model = imperfect_model("PA-AP", 3);
  const PointedShots shots = random_shots(model, 21, 3);
  const Points all = points_of(model, header_of(model), shots);
  const Points without_loadings = points_of(model, header_of(model, true, false), shots);
  const Points bare = points_of(model, header_of(model, false, false), shots);
  EXPECT_EQ(without_loadings.covariance, all.covariance);
  EXPECT_TRUE(without_loadings.loading.empty());
  for (const Points* points : {&without_loadings, &bare}) {
    EXPECT_EQ(points->x, all.x);
    EXPECT_EQ(points->y, all.y);
    EXPECT_EQ(points->z, all.z);
    EXPECT_EQ(points->range, all.range);
  }
  EXPECT_TRUE(bare.covariance[0].empty());
}

// Points where the sensor says, from the frame's origin; the footprint lies along azimuth and
// zenith and the range offset is all that they share.
TEST(ComputePoints, DoWithoutRotationAngles) {
  sensors::Sensor sensor = sensors::load_sensor("mid-40-table3");
  sensor.reference = CalibrationReference::directions;
  sensor.range_offset = 0.02;
  sensor.range_noise_incidence = 0.004;
  sensor.range_noise_weak_return = 0.02;
  sensor.set_knowledge({"range_offset_m", 0.005, "assumed"});
  PointingOptions options;
  options.reported_directions = true;
  EXPECT_TRUE(needs_rotation_angles(sensor, options));
  EXPECT_THROW(reported_pointing_model(sensor, options, std::nullopt), InvalidArgument);
  options.beam_origin = false;
  EXPECT_FALSE(needs_rotation_angles(sensor, options));
  EXPECT_TRUE(needs_rotation_angles(sensor, {}));
  for (const bool divergence : {true, false}) {
    options.beam_divergence = divergence;
    const PointingModel model = reported_pointing_model(sensor, options, 9e-5);
    EXPECT_EQ(reported_pointing_model(sensor, options, std::nullopt).angle_noise,
              sensor.angle_noise);
    ASSERT_EQ(model.factors.size(), 1u);
    CloudHeader header = header_of(model);
    header.has_rotation_angles = false;
    const PointedShots shots = random_shots(model, 19, 7);
    for (const InstructionSet set : available_instruction_sets()) {
      const Points points = points_of(model, header, shots, set);
      EXPECT_TRUE(points.azimuth_residual.empty());
      EXPECT_TRUE(points.rotation_angle.empty());
      for (std::size_t i = 0; i < shots.size(); ++i) {
        SCOPED_TRACE(fmt::format("{} shot {}", to_string(set), i));
        const double azimuth = shots.azimuth[i], zenith = shots.zenith[i];
        const double range = shots.range[i] - 0.02;
        const Vector3d d = eigen(direction_from_angles(SphericalAngles<double>{azimuth, zenith}));
        EXPECT_LT((point_of(points, i) - range * d).norm(), 1e-14 * (10.0 + range));
        const Vector3d level(-std::sin(azimuth), std::cos(azimuth), 0.0);
        const Vector3d upright = level.cross(d);
        const double spread = divergence ? kDivergenceSigma : 0.0;
        const double noise = 9e-5 * 9e-5;
        const double h = std::pow(spread * sensor.beam_divergence_horizontal, 2) +
                         std::pow(std::sin(zenith), 2) * (noise + shots.azimuth_rounding[i]);
        const double v = std::pow(spread * sensor.beam_divergence_vertical, 2) + noise +
                         shots.zenith_rounding[i];
        const Vector3d normal(shots.surface_normal[0][i], shots.surface_normal[1][i],
                              shots.surface_normal[2][i]);
        const double tangent =
            normal.hasNaN() ? 0.0 : normal.cross(d).norm() / std::abs(normal.dot(d));
        const double along = sensor.range_variance(range, tangent, shots.intensity[i]) +
                             shots.range_rounding[i] + 0.005 * 0.005;
        const Matrix3d stated = range * range * h * level * level.transpose() +
                                range * range * v * upright * upright.transpose() +
                                along * d * d.transpose();
        EXPECT_LT(relative_difference(covariance_of(points, i), stated), 1e-12);
        EXPECT_LT((loading_of(points, 0, i) + 0.005 * d).norm(), 1e-15);
      }
    }
  }
  sensor.reference = CalibrationReference::planes;
  EXPECT_TRUE(needs_rotation_angles(sensor, options));
}

TEST(ComputePoints, ResidualsAreExactUpToATenthOfARadian) {
  const PointingModel model = imperfect_model("PA-AP", 6);
  PointedShots shots = random_shots(model, 24, 6);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const double off = 0.098 - 0.008 * static_cast<double>(i);  // to -0.086
    shots.azimuth[i] = wrap_to_pi(shots.azimuth[i] + off);
    shots.zenith[i] += off;
  }
  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    expect_points(model, shots, points_of(model, header_of(model), shots, set));
  }
}

// A damaged record must not look like a sound one, however far off it is.
TEST(ComputePoints, ResidualsOfOutliersAreLarge) {
  const PointingModel model = imperfect_model("PA-AP", 8);
  const std::vector<double> offs{0.2, 0.4, 0.6, 1.0, 1.5, 2.0, 2.5, 2.9, 3.1, kPi};
  PointedShots shots = random_shots(model, 2 * offs.size(), 8);
  const PointedShots sound = shots;
  for (std::size_t i = 0; i < offs.size(); ++i) {
    shots.azimuth[i] = wrap_to_pi(sound.azimuth[i] + offs[i]);
    shots.azimuth[offs.size() + i] = wrap_to_pi(sound.azimuth[offs.size() + i] - offs[i]);
  }
  for (const InstructionSet set : available_instruction_sets()) {
    const Points points = points_of(model, header_of(model), shots, set);
    for (std::size_t i = 0; i < shots.size(); ++i) {
      EXPECT_GT(std::abs(points.azimuth_residual[i]), 0.15) << offs[i % offs.size()];
    }
  }
  shots = sound;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const double off = std::min(offs[i % offs.size()], 1.2);
    shots.zenith[i] += i < offs.size() ? off : -off;
  }
  for (const InstructionSet set : available_instruction_sets()) {
    const Points points = points_of(model, header_of(model), shots, set);
    for (std::size_t i = 0; i < shots.size(); ++i) {
      EXPECT_GT(std::abs(points.zenith_residual[i]), 0.15) << offs[i % offs.size()];
    }
  }
}

TEST(ComputePoints, RotationAnglesAreBelowAFullTurn) {
  const PointingModel model = imperfect_model("PA-AP", 9);
  PointedShots shots = random_shots(model, 6, 9);
  shots.rotation_angle[0] = {-1e-17, -1e-300, 0.0, kTwoPi, -kTwoPi, 1e6};
  const Points points = points_of(model, header_of(model), shots);
  for (const double angle : points.rotation_angle[0]) {
    EXPECT_GE(angle, 0.0);
    EXPECT_LT(angle, kTwoPi);
  }
}

TEST(ComputePoints, WhatIsNotKnownIsNaNAndLeavesItsNeighboursAlone) {
  for (const bool reported : {false, true}) {
    PointingOptions options;
    options.reported_directions = reported;
    const PointingModel model = imperfect_model("PA-AP", 4, options);
    const PointedShots shots = random_shots(model, 19, 4);
    PointedShots broken = shots;
    for (const std::size_t i : {0u, 6u, 18u}) broken.rotation_angle[i == 6][i] = kNaN;
    for (const InstructionSet set : available_instruction_sets()) {
      const Points sound = points_of(model, header_of(model), shots, set);
      const Points points = points_of(model, header_of(model), broken, set);
      for (std::size_t i = 0; i < shots.size(); ++i) {
        SCOPED_TRACE(fmt::format("{} shot {}", to_string(set), i));
        if (i == 0 || i == 6 || i == 18) {
          EXPECT_TRUE(point_of(points, i).array().isNaN().all());
          if (!reported) {
            EXPECT_TRUE(std::isnan(points.azimuth_residual[i]));
            EXPECT_TRUE(std::isnan(points.zenith_residual[i]));
          }
        } else {
          EXPECT_EQ(point_of(points, i), point_of(sound, i));
          EXPECT_EQ(covariance_of(points, i), covariance_of(sound, i));
        }
      }
    }
  }
}

TEST(ComputePoints, ABeamThatDoesNotGetThroughHasNoPoint) {
  for (const bool reported : {false, true}) {
    for (const bool origin : {false, true}) {
      PointingOptions options;
      options.reported_directions = reported;
      options.beam_origin = origin;
      PointingModel model = imperfect_model("PA-PA", 5, options);
      model.train.set("wedge_angle_deg", radians_from_degrees(31.0));
      PointedShots shots = random_shots(imperfect_model("PA-PA", 5, options), 40, 5);
      std::size_t lost = 0;
      for (const InstructionSet set : available_instruction_sets()) {
        const Points points = points_of(model, header_of(model), shots, set);
        for (std::size_t i = 0; i < shots.size(); ++i) {
          const Beam beam = beam_of(model, shots, i);
          const bool valid = emergent_ray(beam.train, beam.geometry, beam.angles).valid;
          lost += valid ? 0 : 1;
          EXPECT_EQ(point_of(points, i).array().isNaN().all(), !valid);
          EXPECT_EQ(point_of(points, i).array().isNaN().any(), !valid);
        }
      }
      EXPECT_GT(lost, 5u);
      EXPECT_LT(lost, 40 * available_instruction_sets().size());
    }
  }
}

/// Rebuilt from a model's factors: the covariance of all places, of the rotation angles, of
/// thickness and spacing, and of the range offset.
MatrixXd covariance_of_factors(const PointingModel& model) {
  const int prisms = model.train.prisms();
  const Index count = parameter_count(prisms), size = count + prisms + 3;
  MatrixXd sum = MatrixXd::Zero(size, size);
  for (const CommonFactor& factor : model.factors) {
    VectorXd all = VectorXd::Zero(size);
    Index row = 0;
    for (const int place : model.places) all[place] = factor.weights[row++];
    for (Index i = count; i < size - 1; ++i) all[i] = factor.weights[row++];
    EXPECT_EQ(row, factor.weights.size());
    all[size - 1] = factor.range_offset;
    sum += all * all.transpose();
  }
  return sum;
}

std::vector<std::string> names_of(const PointingModel& model) {
  std::vector<std::string> names;
  for (const CommonFactor& factor : model.factors) names.push_back(factor.name);
  return names;
}

/// A full covariance with strong correlations between quantities of given sigmas.
MatrixXd correlated(const VectorXd& sigma, std::uint64_t seed) {
  Dice dice(seed);
  const Index n = sigma.size();
  MatrixXd root(n, n + 1);
  for (double& entry : root.reshaped()) entry = dice.normal();
  root.col(0) *= 2.0;
  MatrixXd c = root * root.transpose();
  const VectorXd scale = c.diagonal().cwiseSqrt().cwiseInverse().cwiseProduct(sigma);
  return scale.asDiagonal() * c * scale.asDiagonal();
}

/// Sigmas as a calibration finds them, SI units.
VectorXd typical_sigmas(const std::vector<std::string>& names, double scale = 1.0) {
  VectorXd sigma(names.size());
  for (Index i = 0; i < sigma.size(); ++i) {
    const std::string& name = names[i];
    sigma[i] = scale * (name == "range_offset_m"         ? 0.002
                        : name.starts_with("refractive") ? 1e-4
                                                         : radians_from_degrees(0.003));
  }
  return sigma;
}

/// A calibrated Mid-40 and what one of its recordings says.
struct Case {
  sensors::Sensor calibration = sensors::load_sensor("mid-40-table3");
  SensorBelief belief;

  explicit Case(CalibrationReference reference, std::uint64_t seed = 1) {
    calibration.reference = reference;
    belief.sensor = sensors::load_sensor("mid-40-table3");
    belief.sensor.train = testing::imperfect_train("PA-AP", 0.2, 8);
    belief.angle_noise = 6e-5;
    set_free(estimation::default_free_names({2}), seed);
    if (reference == CalibrationReference::none) return;
    calibration.covariance_names = estimation::default_free_names({2});
    if (reference == CalibrationReference::planes) {
      calibration.covariance_names.insert(calibration.covariance_names.begin() + 2,
                                          "range_offset_m");
      calibration.covariance_names.push_back("prism_tilt_a_horizontal_deg");
      calibration.range_offset = 0.012;
    }
    calibration.covariance = correlated(typical_sigmas(calibration.covariance_names), seed + 1);
  }

  void set_free(const std::vector<std::string>& names, std::uint64_t seed) {
    const int prisms = belief.sensor.prisms();
    belief.free = estimation::free_parameters(names, belief.sensor.shape());
    belief.covariance = correlated(typical_sigmas(names, 0.5), seed + 2);
    belief.angle_sensitivity.resize(prisms, names.size());
    Dice dice(seed + 3);
    for (double& entry : belief.angle_sensitivity.reshaped()) entry = dice.normal();
  }

  /// [places + prisms + 3, names]: what named quantities do.
  MatrixXd effect(const std::vector<std::string>& names, bool beam, bool angles) const {
    const int prisms = calibration.prisms();
    const Index count = parameter_count(prisms);
    MatrixXd m = MatrixXd::Zero(count + prisms + 3, names.size());
    for (Index j = 0; j < m.cols(); ++j) {
      const std::string& name = names[j];
      if (name == "range_offset_m") {
        m(m.rows() - 1, j) = 1.0;
        continue;
      }
      if (beam) {
        for (const int place : find_parameter(name, calibration.shape()).places) m(place, j) = 1.0;
      }
      for (std::size_t f = 0; angles && f < belief.free.size(); ++f) {
        if (belief.free[f].name != name) continue;
        m.block(count, j, prisms, 1) = belief.angle_sensitivity.col(f);
      }
    }
    return m;
  }

  std::vector<std::string> free_names() const {
    std::vector<std::string> names;
    for (const auto& free : belief.free) names.push_back(free.name);
    return names;
  }

  PointingModel model(const PointingOptions& options = {}) const {
    return pointing_model(calibration, belief, options);
  }
  MatrixXd covariance_against_planes() const;
};

/// Variances of thickness, spacing and (when it is not with the others) the range offset.
MatrixXd geometry_variance(const sensors::Sensor& sensor, Index size) {
  const auto variance = [&sensor](const char* name) {
    const sensors::Knowledge* known = sensor.find_knowledge(name);
    return known == nullptr ? 0.0 : known->sigma * known->sigma;
  };
  VectorXd all = VectorXd::Zero(size);
  all[size - 3] = variance("prism_thickness_m");
  all[size - 2] = variance("prism_spacing_m");
  all[size - 1] = variance("range_offset_m");
  return all.asDiagonal();
}

/// The beam's by the calibration, that of the rotation angles by the recording.
MatrixXd Case::covariance_against_planes() const {
  const MatrixXd beam = effect(calibration.covariance_names, true, false);
  const MatrixXd angles = effect(free_names(), false, true);
  const MatrixXd sum = beam * calibration.covariance * beam.transpose() +
                       angles * belief.covariance * angles.transpose();
  return sum + geometry_variance(calibration, sum.rows());
}

void expect_same_covariance(const MatrixXd& found, const MatrixXd& stated) {
  ASSERT_EQ(found.rows(), stated.rows());
  const VectorXd scale = stated.diagonal().cwiseSqrt();
  for (Index i = 0; i < found.rows(); ++i) {
    for (Index j = 0; j < found.cols(); ++j) {
      EXPECT_NEAR(found(i, j), stated(i, j), 1e-9 * scale[i] * scale[j]) << i << ' ' << j;
    }
  }
}

TEST(PointingModel, OfATypeTakesTheRecordingsParametersAndTheirErrors) {
  Case one(CalibrationReference::none);
  for (const std::string& name : one.free_names()) {
    one.calibration.set_knowledge({name, 0.05, "assumed"});
  }
  one.calibration.set_knowledge({"range_offset_m", 0.005, "assumed"});
  const PointingModel model = one.model();
  EXPECT_EQ(model.train.parameters(), one.belief.sensor.train.parameters());
  EXPECT_EQ(model.believed.parameters(), one.belief.sensor.train.parameters());
  EXPECT_EQ(model.angle_noise, 6e-5);
  EXPECT_THAT(model.geometry.spacing, ElementsAre(0.030));
  std::vector<std::string> names = one.free_names();
  for (const char* more : {"prism_thickness_m", "prism_spacing_m", "range_offset_m"}) {
    names.push_back(more);
  }
  EXPECT_EQ(names_of(model), names);
  const MatrixXd effect = one.effect(one.free_names(), true, true);
  MatrixXd stated = effect * one.belief.covariance * effect.transpose();
  stated += geometry_variance(one.calibration, stated.rows());
  expect_same_covariance(covariance_of_factors(model), stated);
}

// A unit whose parameters are known to 0.002 degree and that reports directions 0.2 degree off.
TEST(PointingModel, AUnitThatContradictsTheRecordingIsTakenAtItsWord) {
  Case one(CalibrationReference::none);
  one.calibration.set_knowledge(
      {"wedge_angle_deg", 1e-4, "assumed"});  // no recording determines it
  const PointingModel model = one.model();
  EXPECT_EQ(model.reference, CalibrationReference::planes);
  EXPECT_EQ(model.train.parameters(), one.calibration.train.parameters());
  EXPECT_EQ(model.believed.parameters(), one.belief.sensor.train.parameters());
  const auto names = names_of(model);
  EXPECT_THAT(names, ::testing::Contains("wedge_angle_deg"));
  for (const std::string& name : one.free_names()) {
    EXPECT_THAT(names, ::testing::Contains(name));
  }
  for (const CommonFactor& factor : model.factors) {
    if (factor.name != "incident_beam_vertical_deg") continue;
    EXPECT_DOUBLE_EQ(factor.weights.lpNorm<Eigen::Infinity>(),
                     one.calibration.find_knowledge(factor.name)->sigma);
  }
}

TEST(PointingModel, CalibratedAgainstDirectionsMovesTheRotationAnglesToo) {
  const Case one(CalibrationReference::directions);
  const PointingModel model = one.model();
  EXPECT_EQ(model.train.parameters(), one.belief.sensor.train.parameters());
  const auto& names = one.calibration.covariance_names;
  const MatrixXd effect = one.effect(names, true, true);
  MatrixXd stated = effect * one.calibration.covariance * effect.transpose();
  stated += geometry_variance(one.calibration, stated.rows());
  expect_same_covariance(covariance_of_factors(model), stated);
  // Places that nothing moves are left out.
  for (const int place :
       {place::refractive_index_air(), place::wedge_angle(0), place::wedge_angle(1),
        place::prism_tilt_horizontal(0), place::bearing_tilt_horizontal(1)}) {
    EXPECT_EQ(std::ranges::count(model.places, place), 0) << place;
  }
  EXPECT_EQ(model.places.size(), 9u);
}

TEST(PointingModel, ReportedDirectionsOwnNothingToTheParameters) {
  const Case one(CalibrationReference::directions);
  PointingOptions options;
  options.reported_directions = true;
  EXPECT_THAT(names_of(one.model(options)), ElementsAre("prism_thickness_m", "prism_spacing_m"));
  options.beam_origin = false;
  const PointingModel thin = one.model(options);
  EXPECT_THAT(names_of(thin), ElementsAre());
  EXPECT_THAT(thin.geometry.thickness, ElementsAre());
  EXPECT_TRUE(thin.places.empty());
}

TEST(PointingModel, CalibratedAgainstPlanesHasErrorsOfBothTrains) {
  const Case one(CalibrationReference::planes);
  // The range offset's sigma of the calibration's covariance counts, and no other one beside it.
  sensors::Sensor calibration = one.calibration;
  calibration.set_knowledge({"range_offset_m", 0.005, "assumed"});
  const PointingModel model = pointing_model(calibration, one.belief, {});
  EXPECT_EQ(model.train.parameters(), one.calibration.train.parameters());
  EXPECT_EQ(model.believed.parameters(), one.belief.sensor.train.parameters());
  EXPECT_EQ(model.range_offset, 0.012);
  std::vector<std::string> names = one.calibration.covariance_names;
  for (const char* own : {"rotation_angle_a_deg", "rotation_angle_b_deg"}) names.push_back(own);
  names.push_back("prism_thickness_m");
  names.push_back("prism_spacing_m");
  EXPECT_EQ(names_of(model), names);
  expect_same_covariance(covariance_of_factors(model), one.covariance_against_planes());
}

/// Sigma of the point that all factors together give to a size of the model, m.
double sigma_of_size(const PointingModel& model, const std::string& name) {
  const auto first = std::ssize(model.places) + static_cast<Index>(model.train.prisms());
  for (std::size_t i = 0; i < model.sizes.size(); ++i) {
    if (model.sizes[i].name != name) continue;
    double variance = 0;
    for (const CommonFactor& factor : model.factors) {
      variance += std::pow(factor.weights[first + static_cast<Index>(i)], 2);
    }
    return std::sqrt(variance);
  }
  return 0;
}

// What walls found of prisms and their sizes goes together, and the preset's sigmas are replaced.
TEST(PointingModel, TakesSizesOfPrismsJointlyWithTheOthers) {
  Case one(CalibrationReference::planes);
  auto& names = one.calibration.covariance_names;
  const std::vector<std::string> sizes = {"prism_thickness_a_m", "prism_thickness_b_m",
                                          "prism_spacing_a_m"};
  const Index n = names.size();
  names.insert(names.end(), sizes.begin(), sizes.end());
  VectorXd sigma = typical_sigmas(names);
  sigma.tail(3) << 0.4e-3, 0.3e-3, 2e-3;
  one.calibration.covariance = correlated(sigma, 21);
  const PointingModel model = one.model();
  std::vector<std::string> found;
  for (const PrismSize& size : model.sizes) found.push_back(size.name);
  EXPECT_EQ(found, sizes);
  std::vector<std::string> expected = names;
  for (const char* own : {"rotation_angle_a_deg", "rotation_angle_b_deg"}) expected.push_back(own);
  EXPECT_EQ(names_of(model), expected);
  for (Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(sigma_of_size(model, sizes[i]), sigma[n + i], 1e-12);
  }
  // The same covariance between a tilt and a size.
  const auto place = find_parameter("prism_tilt_b_vertical_deg", {2}).places.front();
  const auto tilt = std::ranges::find(names, "prism_tilt_b_vertical_deg");
  const auto row = std::ranges::find(model.places, place) - model.places.begin();
  double covariance = 0;
  for (const CommonFactor& factor : model.factors) {
    covariance +=
        factor.weights[row] * factor.weights[std::ssize(model.places) + 2];  // thickness of A
  }
  EXPECT_NEAR(covariance, one.calibration.covariance(tilt - names.begin(), n),
              1e-9 * sigma[0] * sigma[n]);

  // Beams that start at the frame's origin know no sizes; what the others say stays.
  PointingOptions from_zero;
  from_zero.beam_origin = false;
  const PointingModel thin = one.model(from_zero);
  EXPECT_TRUE(thin.sizes.empty());
  EXPECT_EQ(names_of(thin).size(), expected.size() - 3);
}

/// The numbers of a factor along the beam: range_offset_m, range_near_m, range_incidence,
/// range_per_decade_m, range_emitter_1_m.
VectorXd range_numbers(const CommonFactor& factor) {
  const sensors::RangeErrors& errors = factor.range_errors;
  VectorXd numbers(5);
  numbers << factor.range_offset, errors.near, errors.incidence, errors.per_decade,
      errors.emitter.empty() ? 0.0 : errors.emitter.front();
  return numbers;
}

TEST(PointingModel, TakesRangeErrorsJointlyWithTheOthers) {
  Case one(CalibrationReference::planes);
  auto& names = one.calibration.covariance_names;
  const std::vector<std::string> more = {"range_near_m", "range_incidence", "range_per_decade_m",
                                         "range_emitter_1_m"};
  names.insert(names.end(), more.begin(), more.end());
  VectorXd sigma = typical_sigmas(names);
  sigma.tail(4) << 4e-3, 0.08, 6e-3, 1e-3;
  const MatrixXd& c = one.calibration.covariance = correlated(sigma, 23);
  one.calibration.range_errors = {0.015, 0.3, 0.01, {0.002}};
  // What is in the covariance does not count again.
  one.calibration.set_knowledge({"range_near_m", 0.01, "calibrated"});
  const PointingModel model = one.model();
  EXPECT_EQ(model.range_errors, one.calibration.range_errors);
  std::vector<std::string> expected = names;
  for (const char* own :
       {"rotation_angle_a_deg", "rotation_angle_b_deg", "prism_thickness_m", "prism_spacing_m"}) {
    expected.emplace_back(own);
  }
  EXPECT_EQ(names_of(model), expected);
  const int place = find_parameter("prism_tilt_b_vertical_deg", {2}).places.front();
  const auto tilt = std::ranges::find(names, "prism_tilt_b_vertical_deg");
  const auto row = std::ranges::find(model.places, place) - model.places.begin();
  MatrixXd found = MatrixXd::Zero(6, 6);
  for (const CommonFactor& factor : model.factors) {
    VectorXd numbers(6);
    numbers << range_numbers(factor), factor.weights[row];
    found += numbers * numbers.transpose();
  }
  const Index n = names.size();
  const std::vector<Index> rows{2, n - 4, n - 3, n - 2, n - 1, tilt - names.begin()};
  expect_same_covariance(found, c(rows, rows));
}

TEST(PointingModel, ARangeErrorThatIsStatedCountsWhereTheCovarianceHasNone) {
  Case one(CalibrationReference::planes);
  one.calibration.set_knowledge({"range_per_decade_m", 0.001, "measured", 0.004});
  const PointingModel model = one.model();
  ASSERT_EQ(model.factors.back().name, "range_per_decade_m");
  EXPECT_EQ(range_numbers(model.factors.back())[3], 0.004);  // with what was held
}

// A number that a point could depend on is never left out without a word.
TEST(PointingModel, RefusesNamesThatItDoesNotKnow) {
  for (const char* name : {"range_nearr_m", "range_emitter_2_m", "prism_thickness_c_m"}) {
    for (const bool reported : {false, true}) {
      for (const auto reference :
           {CalibrationReference::directions, CalibrationReference::planes}) {
        SCOPED_TRACE(name);
        Case one(reference);
        one.calibration.covariance_names.emplace_back(name);
        one.calibration.covariance =
            correlated(typical_sigmas(one.calibration.covariance_names), 24);
        PointingOptions options;
        options.reported_directions = reported;
        EXPECT_THAT(refusal([&] { one.model(options); }), ::testing::HasSubstr(name));
      }
    }
  }
}

// As many quantities as a calibration of the largest sensor finds.
TEST(PointingModel, HasRoomForAllThatWallsTellOfAnAvia) {
  sensors::Sensor avia = sensors::load_sensor("avia");
  SensorBelief belief;
  belief.sensor = avia;
  const auto names = estimation::default_free_names(avia.shape());
  belief.free = estimation::free_parameters(names, avia.shape());
  belief.covariance = correlated(typical_sigmas(names), 25);
  belief.angle_sensitivity.resize(avia.prisms(), belief.free.size());
  Dice dice(27);
  for (double& entry : belief.angle_sensitivity.reshaped()) entry = dice.normal();
  belief.angle_noise = 6e-5;
  avia.reference = CalibrationReference::planes;
  for (const ParameterInfo& parameter : parameter_list(avia.shape())) {
    if (parameter.kind == ParameterKind::train) avia.covariance_names.push_back(parameter.name);
  }
  for (const PrismSize& size : own_prism_sizes(avia.prisms())) {
    avia.covariance_names.push_back(size.name);
  }
  for (const sensors::RangeValue& value : sensors::range_values(avia.train.emitters())) {
    avia.covariance_names.push_back(value.name);
  }
  avia.covariance = correlated(typical_sigmas(avia.covariance_names), 26);
  const PointingModel model = pointing_model(avia, belief, {});
  EXPECT_EQ(model.factors.size(), avia.covariance_names.size() + 2);
}

TEST(PointingModel, ASizeThatIsStatedCountsWhereTheCovarianceHasNone) {
  Case one(CalibrationReference::planes);
  one.calibration.set_knowledge({"prism_thickness_m", 0.001, "measured", 0.004});
  one.calibration.covariance_names.emplace_back("prism_spacing_a_m");
  VectorXd sigma = typical_sigmas(one.calibration.covariance_names);
  sigma.tail(1) << 2e-3;
  one.calibration.covariance = correlated(sigma, 22);
  const PointingModel model = one.model();
  EXPECT_EQ(model.sizes.size(), 2u);
  EXPECT_EQ(sigma_of_size(model, "prism_thickness_m"), 0.004);  // with what was held
  EXPECT_NEAR(sigma_of_size(model, "prism_spacing_a_m"), 2e-3, 1e-12);
}

// Names that are no parameters of the beam have no factor.
TEST(PointingModel, LeavesOutSpeedsOfACalibration) {
  Case one(CalibrationReference::directions);
  const MatrixXd inner = one.calibration.covariance;
  auto& names = one.calibration.covariance_names;
  names.insert(names.begin() + 1, "angular_velocity_a_deg_per_s");
  one.calibration.covariance = correlated(VectorXd::Constant(names.size(), 1e-3), 9);
  const PointingModel model = one.model();
  EXPECT_EQ(std::ranges::count(names, "angular_velocity_a_deg_per_s"), 1);
  const auto factors = names_of(model);
  EXPECT_EQ(std::ranges::count(factors, "angular_velocity_a_deg_per_s"), 0);
  EXPECT_EQ(factors.size(), names.size() - 1 + 2);
}

TEST(PointingModel, RefusesAnotherFaceOrder) {
  Case one(CalibrationReference::directions);
  one.belief.sensor.train = PrismTrain(parse_face_order("AP-PA"));
  EXPECT_THAT(refusal([&] { one.model(); }),
              AllOf(::testing::HasSubstr("PA-AP"), ::testing::HasSubstr("AP-PA")));
}

// One quantity follows from others: one factor fewer, the same covariance.
TEST(PointingModel, TakesACovarianceThatHasNoInverse) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    Case one(CalibrationReference::planes, 100 + seed);
    auto& c = one.calibration.covariance;
    const Index dependent = 4;
    VectorXd times = VectorXd::Zero(c.rows());
    if (seed < 2) {
      times[1] = seed == 0 ? 1.0 : -2.0;
    } else {
      times[1] = 0.7;
      times[3] = -1.3;
    }
    MatrixXd from = MatrixXd::Identity(c.rows(), c.rows());
    from.row(dependent) = times;
    c = MatrixXd(from * c * from.transpose());
    const PointingModel model = one.model();
    expect_same_covariance(covariance_of_factors(model), one.covariance_against_planes());
    const auto names = names_of(model);
    const std::string& name = one.calibration.covariance_names[dependent];
    EXPECT_EQ(std::ranges::count(names, name), 0);
    EXPECT_EQ(names.size(), static_cast<std::size_t>(c.rows()) - 1 + 2 + 2);
  }
}

TEST(PointingModel, RefusesMoreFactorsThanItCanHold) {
  Case one(CalibrationReference::planes);
  const std::size_t many = 100;
  one.calibration.covariance_names.assign(many, "wedge_angle_a_deg");
  one.calibration.covariance = 1e-8 * MatrixXd::Identity(many, many);
  EXPECT_THROW(one.model(), InvalidArgument);
}

TEST(PointingModel, OfFourPrismsGivesPoints) {
  Case one(CalibrationReference::planes);
  const char* order = "PA-AP-PA-AP";
  one.calibration.train = testing::imperfect_train(order, 0.3, 21);
  one.belief.sensor.train = testing::imperfect_train(order, 0.3, 22);
  one.set_free(estimation::default_free_names({4}), 23);
  one.calibration.covariance_names = estimation::default_free_names({4});
  one.calibration.covariance = correlated(typical_sigmas(one.calibration.covariance_names), 24);
  const PointingModel model = one.model();
  EXPECT_EQ(model.factors.size(), one.belief.free.size() + 4 + 2);
  expect_same_covariance(covariance_of_factors(model), one.covariance_against_planes());
  const PointedShots shots = random_shots(model, 11, 25);
  expect_points(model, shots, points_of(model, header_of(model), shots));
}

// Rotation angles that follow an error of a parameter so that the direction stays where it was:
// then the parameter's factor moves a point by what the beam's origin moves, and by nothing
// without.
TEST(PointingModel, AngleSensitivityTakesParameterErrorsOutOfThePoint) {
  Case one(CalibrationReference::directions);
  const Beam beam{one.belief.sensor.train, {}, {0.4, 1.7}};
  MatrixXd by_angles(3, 2);
  for (Index k = 0; k < 2; ++k) {
    by_angles.col(k) = rate_by_angle(beam, 1.0, k);
  }
  const MatrixXd normal_matrix = by_angles.transpose() * by_angles;
  for (std::size_t j = 0; j < one.belief.free.size(); ++j) {
    Vector3d rate = Vector3d::Zero();
    for (const int place : one.belief.free[j].places) rate += rate_by_place(beam, 1.0, place);
    one.belief.angle_sensitivity.col(j) = -normal_matrix.ldlt().solve(by_angles.transpose() * rate);
  }
  PointedShots shots;
  shots.resize(2, 1);
  shots.rotation_angle[0][0] = beam.angles[0];
  shots.rotation_angle[1][0] = beam.angles[1];
  shots.range[0] = 100.0;
  PointingOptions options;
  for (const bool origin : {false, true}) {
    options.beam_origin = origin;
    const PointingModel model = one.model(options);
    const Points points = points_of(model, header_of(model), shots);
    for (std::size_t j = 0; j < one.belief.free.size(); ++j) {
      EXPECT_LT(loading_of(points, j, 0).norm(), origin ? 1e-5 : 1e-11) << model.factors[j].name;
    }
  }
}

}  // namespace risley::cloud::pointing_test
