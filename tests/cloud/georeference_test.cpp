// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/georeference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/cloud/point_covariance.hpp"
#include "risley/cloud/pointing.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/trajectories/geodesy.hpp"

#include "cloud/transverse_mercator.hpp"
#include "refusal.hpp"
#include "warning_codes.hpp"

namespace risley::cloud::georeference_test {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using trajectories::Trajectory;
using Wide = Eigen::Matrix<long double, 3, 1>;
using WideMatrix = Eigen::Matrix<long double, 3, 3>;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr double kRate = 200;

/// 50 degrees north, 2.7 degrees off the meridian of zone 32: 2.07 degrees of convergence.
const trajectories::Geodetic kOrigin{radians_from_degrees(50.1), radians_from_degrees(11.7), 250};

/// Where the platform is at a time: to the east at 5 m/s, back again from 110 s on, 80 m above the
/// origin, shaking.
Vector3d ned_place(double t) {
  const double east = t < 110 ? 5 * t : 5 * (220 - t);
  return {0.3 * std::sin(0.9 * t), east + 0.2 * std::sin(0.7 * t), -80 + 0.1 * std::sin(1.1 * t)};
}
trajectories::RollPitchHeading angles(double t) {
  const double two = radians_from_degrees(2);
  return {two * std::sin(3.1 * t), two * std::cos(2.3 * t),
          radians_from_degrees(t < 110 ? 90 : 270) + two * std::sin(1.7 * t)};
}

Trajectory trajectory(double seconds) {
  Trajectory result;
  result.frame = trajectories::Frame::geocentric;
  result.time_scale = trajectories::TimeScale::gps_second_of_week;
  result.gps_week = 2400;
  const Matrix3d axes = trajectories::geocentric_from_ned(kOrigin);
  const Vector3d origin = trajectories::geocentric_from_geodetic(kOrigin);
  for (int i = 0; i <= static_cast<int>(seconds * kRate); ++i) {
    const double t = i / kRate;
    result.time_ns.push_back(200'000 * kSecond + std::llround(1e9 * t));
    result.position.push_back(origin + axes * ned_place(t));
    result.attitude.push_back(Quaterniond(axes) * trajectories::ned_from_body(angles(t)));
  }
  return result;
}

/// X down, Y to the left, Z forward.
trajectories::Mount mount() {
  trajectories::Mount result;
  result.reference_point = "centre of the IMU";
  result.nominal << 0, 0, 1, 0, -1, 0, 1, 0, 0;
  const double degree = radians_from_degrees(1);
  result.boresight = {{{0.4 * degree, 0.002 * degree, "test"},
                       {-0.3 * degree, 0.003 * degree, "test"},
                       {0.2 * degree, 0.003 * degree, "test"}}};
  result.lever_arm = {{{0.10, 0.005, "test"}, {0.05, 0.005, "test"}, {0.12, 0.005, "test"}}};
  result.clock_offset = {0.25, 0.001, "test"};
  return result;
}

/// APX-18 of the reference scenario.
trajectories::ErrorModel apx18() {
  trajectories::ErrorModel model;
  const double degree = radians_from_degrees(1);
  model.sample_interval = 1 / kRate;
  const std::array<double, 6> sigma{0.02,           0.02,           0.03,
                                    0.025 * degree, 0.025 * degree, 0.08 * degree};
  for (std::size_t k = 0; k < 6; ++k) {
    model.terms[k] = {sigma[k], k == 5 ? 300.0 : 120.0, k < 3 ? 0 : 0.005 * degree, "test"};
  }
  return model;
}

constexpr double kRangeNoise = 0.02, kRangeOffset = 0.005;

/// A sensor with the ranges of these tests.
sensors::Sensor with_ranges(sensors::Sensor sensor) {
  sensor.range_noise = kRangeNoise;
  sensor.range_noise_per_range = sensor.range_noise_incidence = sensor.range_noise_weak_return = 0;
  sensor.set_knowledge({"range_offset_m", kRangeOffset, "test", 0});
  sensor.angle_noise = 0;
  return sensor;
}

/// The unit that the paper's Table 3 simulates, its beams, and how wrong its prisms may be.
class BentUnit {
 public:
  static constexpr double kPrismSigma = radians_from_degrees(0.005);

  BentUnit() : sensor_(with_ranges(sensors::load_sensor("mid-40-table3"))) {
    names_ = estimation::default_free_names(sensor_.train.shape());
    std::erase(names_, "refractive_index");
    sensor_.reference = sensors::CalibrationReference::planes;
    sensor_.covariance_names = names_;
    sensor_.covariance =
        kPrismSigma * kPrismSigma * MatrixXd::Identity(names_.size(), names_.size());
  }
  const sensors::Sensor& sensor() const { return sensor_; }
  sensors::Sensor& sensor() { return sensor_; }
  const std::vector<std::string>& names() const { return names_; }
  /// At a time, with each prism's errors so many sigmas off.
  Vector3d direction(double time, const std::vector<double>& sigmas) const {
    PrismTrain train = sensor_.train;
    for (std::size_t k = 0; k < names_.size(); ++k) {
      train.set(names_[k], train.get(names_[k]) + sigmas[k] * kPrismSigma);
    }
    std::vector<double> angles;
    for (const double speed : sensor_.angular_velocity) angles.push_back(speed * time);
    const auto d = observe(train, angles).direction;
    return {d.x, d.y, d.z};
  }

 private:
  sensors::Sensor sensor_;
  std::vector<std::string> names_;
};

/// Points of a sensor 80 m above ground, at times of the trajectory, with 20 mm of range noise and
/// a range offset that is known to 5 mm.
struct SensorPoints {
  CloudHeader header;
  PointingModel model;
  PointedShots shots;
  Points points;

  SensorPoints(const std::vector<double>& times, PointingModel of) : model(std::move(of)) {
    header.has_own_covariance = header.has_point_source = true;
    for (const CommonFactor& factor : model.factors) header.factors.push_back(factor.name);
    shots.resize(header.prisms, times.size());
    points.time_ns.resize(times.size());
    for (std::size_t i = 0; i < times.size(); ++i) {
      // The recording's clock is behind by the mount's offset.
      points.time_ns[i] = 200'000 * kSecond + std::llround(1e9 * (times[i] - 0.25));
      for (auto& column : shots.surface_normal) column[i] = std::nan("");
    }
  }

  std::size_t size() const { return points.size(); }
  /// A shot that meets the ground in a direction.
  void set(std::size_t shot, const Vector3d& direction) {
    shots.azimuth[shot] = std::atan2(direction.y(), direction.x());
    shots.zenith[shot] = std::acos(direction.z());
    shots.range[shot] = 80 / direction.x();
  }
  void compute(const SensorPoses& at) {
    header.resize(points, size());
    compute_points(model, header, shots, points, at);
  }
  Vector3d point(std::size_t i) const { return {points.x[i], points.y[i], points.z[i]}; }
};

/// Of directions that the sensor reports without error.
SensorPoints sensor_points(const std::vector<double>& times, const trajectories::Mount& mount) {
  const PointingOptions options{.reported_directions = true,
                                .beam_origin = false,
                                .beam_divergence = false,
                                .covariance = true};
  SensorPoints result(times, reported_pointing_model(with_ranges(sensors::load_sensor("mid-40")),
                                                     options, std::nullopt, mount));
  result.header.has_rotation_angles = false;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double aside = radians_from_degrees(19.0 * std::sin(1.0 + 37.0 * times[i]));
    const double turn = 11.0 * times[i];
    result.set(
        i, {std::cos(aside), std::sin(aside) * std::cos(turn), std::sin(aside) * std::sin(turn)});
  }
  return result;
}

/// Of a calibrated bent unit's beams, whose prisms have errors.
SensorPoints prism_points(const std::vector<double>& times, const BentUnit& unit,
                          const trajectories::Mount& mount) {
  SensorBelief belief;
  belief.sensor = unit.sensor();
  belief.covariance.resize(0, 0);
  SensorPoints result(
      times, pointing_model(unit.sensor(), belief, {.beam_origin = false, .beam_divergence = false},
                            mount));
  for (std::size_t i = 0; i < times.size(); ++i) {
    result.set(i, unit.direction(times[i], std::vector<double>(unit.names().size())));
    for (std::size_t k = 0; k < 2; ++k) {
      result.shots.rotation_angle[k][i] = unit.sensor().angular_velocity[k] * times[i];
    }
  }
  return result;
}

SensorPoses poses(const Georeference& georeference, const Points& points,
                  InstructionSet set = best_instruction_set()) {
  SensorPoses result;
  std::vector<std::size_t> rows;
  georeference.find_poses(points.time_ns, result, rows, set);
  EXPECT_EQ(rows.size(), points.size());
  return result;
}

// Records are 5 ms apart, and then 10: one and several polynomials between two of them.
TEST(Georeference, PosesAreThoseOfTheTrajectory) {
  MovingPlatform platform{trajectory(8), mount(), {}, ""};
  Trajectory& all = platform.trajectory;
  Trajectory sparse = all;
  sparse.time_ns.clear();
  sparse.position.clear();
  sparse.attitude.clear();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool in_gap = i > 600 && i<700, left_out = i> 1000 && i % 2 != 0;
    if (in_gap || left_out) continue;
    sparse.time_ns.push_back(all.time_ns[i]);
    sparse.position.push_back(all.position[i]);
    sparse.attitude.push_back(all.attitude[i]);
  }
  all = sparse;
  const Georeference georeference(platform, recordings::TimeReference::relative, 0);
  // Shots of 1 kHz from before the begin to behind the end, every hundredth out of order.
  std::vector<std::int64_t> times;
  for (std::int64_t i = -200; i < 8500; ++i) {
    const std::int64_t jump = i % 100 == 50 ? -1234 : 0;
    times.push_back(200'000 * kSecond + (i + jump) * 1'000'077);
  }
  const trajectories::Interpolation interpolation(all);
  const Matrix3d body_from_sensor = trajectories::body_from_sensor(platform.mount);
  const Vector3d lever = trajectories::lever_arm(platform.mount);
  for (const InstructionSet set : available_instruction_sets()) {
    SensorPoses got;
    std::vector<std::size_t> rows;
    georeference.find_poses(times, got, rows, set);
    ASSERT_EQ(got.size(), rows.size());
    EXPECT_LT((body_from_sensor * got.lever_arm - lever).norm(), 1e-12);
    std::size_t row = 0;
    double place = 0, turn = 0, velocity = 0, rate = 0;
    for (std::size_t i = 0; i < times.size(); ++i) {
      const auto pose = interpolation.at(times[i] + georeference.clock_shift_ns());
      ASSERT_EQ(pose.has_value(), row < rows.size() && rows[row] == i) << i;
      if (!pose) continue;
      const auto vector = [row](const std::array<std::vector<double>, 3>& columns) {
        return Vector3d(columns[0][row], columns[1][row], columns[2][row]);
      };
      Matrix3d frame_from_sensor;
      for (Index k = 0; k < 9; ++k) {
        frame_from_sensor.data()[k] = got.turn[k][row];
      }
      place = std::max(place, (vector(got.reference) - pose->position).norm());
      turn = std::max(
          turn, (frame_from_sensor - pose->attitude.toRotationMatrix() * body_from_sensor).norm());
      rate = std::max(rate, (frame_from_sensor * vector(got.rate) - pose->angular_velocity).norm());
      velocity = std::max(velocity, (frame_from_sensor * vector(got.velocity) - pose->velocity -
                                     pose->angular_velocity.cross(pose->attitude * lever))
                                        .norm());
      ++row;
    }
    EXPECT_EQ(row, rows.size());
    EXPECT_GT(rows.size(), 7000u);
    EXPECT_LT(rows.size(), 7600u) << "the gap and both ends";
    EXPECT_LT(place, 5e-9);
    EXPECT_LT(turn, 1e-10);
    // As they are up to 5 ms earlier, at 0.5 m/s^2 and 0.4 rad/s^2.
    EXPECT_LT(velocity, 5e-3);
    EXPECT_LT(rate, 5e-3);
    const std::vector<std::size_t> some{1, 5, 77};
    SensorPoses kept = got;
    kept.keep(some);
    ASSERT_EQ(kept.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(kept.turn[4][i], got.turn[4][some[i]]);
      EXPECT_EQ(kept.velocity[1][i], got.velocity[1][some[i]]);
    }
  }
}

/// Of the records themselves, in extended precision: no interpolation takes part.
TEST(Georeference, AgreesWithExtendedPrecisionOnAMap) {
  MovingPlatform platform{trajectory(20), mount(), {}, "EPSG:32632"};
  std::vector<double> times;
  for (int i = 10; i < 3990; i += 7) times.push_back(i / kRate);
  const Georeference georeference(platform, recordings::TimeReference::relative, 0);
  SensorPoints of = sensor_points(times, platform.mount);
  const SensorPoses at = poses(georeference, of.points);
  of.compute(at);
  const Points before = of.points;
  georeference.announce(of.header);
  georeference.apply(of.points, at);

  const UtmReferee zone{6378137.0L, 1 / 298.257223563L, 9 * M_PIl / 180};
  const auto angle = [](const trajectories::StatedValue& stated) {
    return static_cast<long double>(stated.value);
  };
  const auto& b = platform.mount.boresight;
  const Wide turn(angle(b[0]), angle(b[1]), angle(b[2]));
  const long double size = turn.norm();
  const WideMatrix boresight = Eigen::AngleAxis<long double>(size, turn / size).toRotationMatrix();
  double worst = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto record = static_cast<std::size_t>(std::llround(times[i] * kRate));
    const Quaterniond& q = platform.trajectory.attitude[record];
    const WideMatrix body = q.cast<long double>().toRotationMatrix();
    const Wide p(before.x[i], before.y[i], before.z[i]);
    const Wide lever(0.10L, 0.05L, 0.12L);
    const Wide place =
        platform.trajectory.position[record].cast<long double>() +
        body * (lever + platform.mount.nominal.cast<long double>() * (boresight * p));
    // Back from the map by Newton: which latitude, longitude and height is that place?
    long double latitude = kOrigin.latitude, longitude = kOrigin.longitude, height = 0;
    for (int step = 0; step < 40; ++step) {  // radii differ by some thousandths: converge slowly
      const auto reached = zone.geocentric(latitude, longitude, height);
      const Wide off = place - Wide(reached[0], reached[1], reached[2]);
      const long double sl = std::sin(latitude), cl = std::cos(latitude), so = std::sin(longitude),
                        co = std::cos(longitude);
      latitude += off.dot(Wide(-sl * co, -sl * so, cl)) / 6378137.0L;
      longitude += off.dot(Wide(-so, co, 0)) / (6378137.0L * cl);
      height += off.dot(Wide(cl * co, cl * so, sl));
    }
    const auto [east, north] = zone.map(latitude, longitude);
    worst = std::max({worst, static_cast<double>(std::abs(east - of.points.x[i])),
                      static_cast<double>(std::abs(north - of.points.y[i])),
                      static_cast<double>(std::abs(height - of.points.z[i]))});
  }
  EXPECT_GT(of.points.y.front(), 5.5e6);
  EXPECT_LT(worst, 1e-5);  // a hundredth of a millimetre; 0.1 mm is asked for
  RecordProperty("worst_m", fmt::format("{}", worst));
}

// Whole groups, and what is left of one.
TEST(Georeference, EveryInstructionSetGivesTheSame) {
  const MovingPlatform on_map{trajectory(20), mount(), apx18(), "EPSG:32632"};
  MovingPlatform local = on_map;
  local.crs.clear();
  local.trajectory.frame = trajectories::Frame::local;
  for (Vector3d& place : local.trajectory.position) place -= on_map.trajectory.position.front();
  for (const MovingPlatform* platform : {&on_map, &std::as_const(local)}) {
    const Georeference georeference(*platform, recordings::TimeReference::relative, 0);
    for (const std::size_t count : {1U, 7U, 8U, 9U, 100U}) {
      std::vector<double> times;
      for (std::size_t i = 0; i < count; ++i) times.push_back(3 + 0.0007 * static_cast<double>(i));
      const auto applied = [&](InstructionSet set) {
        SensorPoints of = sensor_points(times, platform->mount);
        const SensorPoses at = poses(georeference, of.points, set);
        of.compute(at);
        georeference.announce(of.header);
        georeference.apply(of.points, at, set);
        return of.points;
      };
      const Points plain = applied(InstructionSet::baseline);
      for (const InstructionSet set : available_instruction_sets()) {
        const Points other = applied(set);
        for (std::size_t i = 0; i < count; ++i) {
          EXPECT_NEAR(other.x[i], plain.x[i], 5e-9);
          EXPECT_NEAR(other.y[i], plain.y[i], 5e-9);
          EXPECT_NEAR(other.z[i], plain.z[i], 5e-9);
          for (std::size_t term = 0; term < kCovarianceTerms; ++term) {
            EXPECT_NEAR(other.covariance[term][i], plain.covariance[term][i], 1e-15);
            EXPECT_NEAR(other.own_covariance[term][i], plain.own_covariance[term][i], 1e-15);
          }
        }
      }
      // The total is own and the loadings' squares, and what the trajectory adds.
      EXPECT_GT(plain.covariance[kXX][0], plain.own_covariance[kXX][0]);
    }
  }
}

TEST(Georeference, TimesBecomeUtcAndStripsAreNumbered) {
  MovingPlatform platform{trajectory(220), mount(), apx18(), "EPSG:32632"};
  const Georeference georeference(platform, recordings::TimeReference::relative, 0);
  ASSERT_EQ(georeference.strips().size(), 2u);
  SensorPoints of = sensor_points({1.0, 50.0, 180.0}, platform.mount);
  const SensorPoses at = poses(georeference, of.points);
  of.compute(at);
  georeference.announce(of.header);
  georeference.apply(of.points, at);
  EXPECT_EQ(of.points.point_source, (std::vector<std::uint16_t>{1, 1, 2}));
  EXPECT_EQ(of.header.time_reference, recordings::TimeReference::utc);
  // 2400 weeks and 200,001 s of GPS time are 1,767,684,801 s of UTC since 1970.
  EXPECT_EQ(of.points.time_ns[0], (2400LL * 604'800 + 200'001 + 315'964'800 - 18) * kSecond);
  EXPECT_EQ(of.header.factors.size(), 8u);
  EXPECT_NE(of.header.frame.wkt.find("UTM zone 32N"), std::string::npos);
  ASSERT_TRUE(of.header.trajectory);
  EXPECT_NEAR(static_cast<double>(of.header.trajectory->time_ns.size()), 221, 1);
  // What stands with each point is the diagonal of the joint covariance.
  const std::vector<std::size_t> rows{0, 1, 2};
  const MatrixXd joint = joint_covariance(of.points, *of.header.trajectory, rows);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto first = static_cast<Index>(3 * i);
    EXPECT_NEAR(joint(first, first) / of.points.covariance[kXX][i], 1, 2e-3);
    EXPECT_NEAR(joint(first + 1, first + 1) / of.points.covariance[kYY][i], 1, 2e-3);
    EXPECT_NEAR(joint(first + 2, first + 2) / of.points.covariance[kZZ][i], 1, 2e-3);
  }
}

/// One draw of everything that may be wrong, and the points that then would have been measured, as
/// a surveyor would compute them: with nothing but rotation matrices.
class Draws {
 public:
  Draws(const MovingPlatform& platform, const SensorPoints& of, const BentUnit& unit,
        const std::vector<double>& times)
      : platform_(platform), of_(of), unit_(unit), times_(times) {
    const Index n = times.size();
    for (const double tau : {120.0, 300.0}) {
      MatrixXd kernel(n, n);
      for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < n; ++j) {
          kernel(i, j) = std::exp(-std::abs(times[i] - times[j]) / tau);
        }
      }
      kernel.diagonal().array() += 1e-12;
      factors_.push_back(kernel.llt().matrixL());
    }
  }

  /// Geocentric places of all points.
  std::vector<Vector3d> draw(std::uint64_t number) const {
    const RandomStream random(number, 1);
    std::uint64_t drawn = 0;
    const auto normal = [&] { return random.normal(drawn++); };
    const Index n = times_.size();
    const auto& terms = platform_.errors->terms;
    MatrixXd errors(n, 6);
    for (Index k = 0; k < 6; ++k) {
      Eigen::VectorXd z(n);
      for (Index i = 0; i < n; ++i) z[i] = normal();
      errors.col(k) = *terms[k].sigma * (factors_[k == 5 ? 1 : 0] * z);
    }
    trajectories::Mount mount = platform_.mount;
    for (auto& one : mount.boresight) one.value += one.sigma * normal();
    for (auto& one : mount.lever_arm) one.value += one.sigma * normal();
    const double clock = mount.clock_offset.sigma * normal();
    const double range = kRangeOffset * normal();
    std::vector<double> prisms(unit_.names().size());
    for (double& one : prisms) one = normal();
    const Matrix3d sensor = trajectories::body_from_sensor(mount);
    const Vector3d lever = trajectories::lever_arm(mount);
    const trajectories::Interpolation interpolation(platform_.trajectory);
    const Matrix3d axes = trajectories::geocentric_from_ned(kOrigin);
    std::vector<Vector3d> places;
    std::int64_t sample = -1;
    Vector3d white = Vector3d::Zero();
    for (Index i = 0; i < n; ++i) {
      const double t = times_[i] + clock;
      const auto pose = interpolation.at(200'000 * kSecond + std::llround(1e9 * t));
      const auto own = static_cast<std::int64_t>(std::floor(times_[i] * kRate + 1e-6));
      if (own != sample) {
        for (Index k = 0; k < 3; ++k) white[k] = terms[3].white * normal();
        sample = own;
      }
      Vector3d shift = errors.row(i).head<3>();
      shift[2] = -shift[2];  // up to down
      const Vector3d turn = errors.row(i).tail<3>().transpose() + white;
      const Quaterniond wrong(
          Eigen::AngleAxisd(turn.norm(), axes * turn.normalized()).toRotationMatrix());
      const Matrix3d body = (wrong * pose->attitude).toRotationMatrix();
      const double noise = kRangeNoise * normal() - range;
      const double measured = of_.point(i).norm() + noise;
      const Vector3d p = measured * unit_.direction(times_[i], prisms);
      places.push_back(pose->position + axes * shift + body * (lever + sensor * p));
    }
    return places;
  }

 private:
  const MovingPlatform& platform_;
  const SensorPoints& of_;
  const BentUnit& unit_;
  const std::vector<double>& times_;
  std::vector<MatrixXd> factors_;
};

/// Every so many rows of a table.
TrajectoryErrors thinned(const TrajectoryErrors& errors, std::size_t step) {
  TrajectoryErrors few = errors;
  few.time_ns.clear();
  few.position.clear();
  few.sigma.clear();
  for (std::size_t i = 0; i < errors.time_ns.size(); i += step) {
    few.time_ns.push_back(errors.time_ns[i]);
    few.position.push_back(errors.position[i]);
    few.sigma.push_back(errors.sigma[i]);
  }
  return few;
}

// What the file says of points, of their differences over a tenth of a second to half a minute, of
// mean and tilt of a roof's forty points and of two strips over it, against full draws of
// everything: prisms, mount, clock, ranges, trajectory. Tables of a place every second and every
// ten seconds say the same. With every point's covariance taken as
// its own, as if points were independent, differences and patches are wrong.
TEST(Georeference, CovariancesOfAnySetOfPointsAreTrue) {
  MovingPlatform platform{trajectory(220), mount(), apx18(), "EPSG:32632"};
  std::vector<double> times{20.0, 20.1, 21.0, 50.0};
  for (int i = 0; i < 40; ++i) times.push_back(60 + 0.0113 * i);
  for (int i = 0; i < 40; ++i) times.push_back(160 + 0.0113 * i);
  const Georeference georeference(platform, recordings::TimeReference::relative, 0);
  const BentUnit unit;
  SensorPoints sensor = prism_points(times, unit, platform.mount);
  const SensorPoses at = poses(georeference, sensor.points);
  sensor.compute(at);
  SensorPoints of = sensor;
  georeference.announce(of.header);
  georeference.apply(of.points, at);
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < times.size(); ++i) rows.push_back(i);
  const std::array<MatrixXd, 2> joint{
      joint_covariance(of.points, *of.header.trajectory, rows),
      joint_covariance(of.points, thinned(*of.header.trajectory, 10), rows)};

  struct Functional {
    std::string name;
    Eigen::MatrixXd weights;  // [3, 3 n]
    double squares[3] = {};
  };
  const Index n = times.size();
  std::vector<Functional> functionals;
  const auto add = [&](const std::string& name, const std::vector<double>& weight) {
    MatrixXd weights = MatrixXd::Zero(3, 3 * n);
    for (Index i = 0; i < n; ++i) {
      weights.block<3, 3>(0, 3 * i) = weight[i] * Matrix3d::Identity();
    }
    functionals.push_back({name, weights});
  };
  const auto pair = [&](std::size_t a, std::size_t b) {
    std::vector<double> weight(times.size());
    weight[a] = 1;
    if (b != a) weight[b] = -1;
    return weight;
  };
  add("a point", pair(0, 0));
  add("difference over 0.1 s", pair(0, 1));
  add("difference over 1 s", pair(0, 2));
  add("difference over 30 s", pair(0, 3));
  std::vector<double> roof(times.size()), strips(times.size());
  for (std::size_t i = 4; i < 44; ++i) roof[i] = strips[i] = 1.0 / 40;
  for (std::size_t i = 44; i < 84; ++i) strips[i] = -1.0 / 40;
  add("a roof", roof);
  add("a roof from strip to strip", strips);
  {  // the height's slope to the east, to the north, and to the north-east
    MatrixXd weights = MatrixXd::Zero(3, 3 * n);
    MatrixXd across(40, 3);
    for (Index i = 0; i < 40; ++i) {
      const auto row = static_cast<std::size_t>(4 + i);
      across.row(i) << of.points.x[row], of.points.y[row], of.points.x[row] + of.points.y[row];
    }
    for (Index axis = 0; axis < 3; ++axis) {
      const Eigen::VectorXd off = across.col(axis).array() - across.col(axis).mean();
      for (Index i = 0; i < 40; ++i) weights(axis, 3 * (4 + i) + 2) = off[i] / off.squaredNorm();
    }
    functionals.push_back({"a roof's tilt", weights});
  }

  const MapProjection map("EPSG:32632");
  const Draws draws(platform, sensor, unit, times);
  std::vector<MapTangent> tangents;
  std::vector<Vector3d> true_places;
  for (Index i = 0; i < n; ++i) {
    Vector3d place;
    const Vector3d arm = at.lever_arm + sensor.point(i);
    for (std::size_t k = 0; k < 3; ++k) {
      place[k] = at.reference[k][i] + at.turn[k][i] * arm.x() + at.turn[3 + k][i] * arm.y() +
                 at.turn[6 + k][i] * arm.z();
    }
    tangents.push_back(map.tangent(place));
    true_places.push_back(tangents.back().map(place));
    EXPECT_NEAR((true_places.back() - of.point(i)).norm(), 0, 1e-5);
  }
  constexpr int kDraws = 1000;
  for (int draw = 0; draw < kDraws; ++draw) {
    const std::vector<Vector3d> places = draws.draw(static_cast<std::uint64_t>(draw));
    Eigen::VectorXd off(3 * n);
    for (Index i = 0; i < n; ++i) {
      off.segment<3>(3 * i) = tangents[i].map(places[i]) - true_places[i];
    }
    for (Functional& one : functionals) {
      const Vector3d value = one.weights * off;
      for (Index axis = 0; axis < 3; ++axis) one.squares[axis] += value[axis] * value[axis];
    }
  }
  // What a cloud without a table states: each point's covariance, as its own.
  MatrixXd alone = MatrixXd::Zero(3 * n, 3 * n);
  for (Index i = 0; i < n; ++i) {
    alone.block<3, 3>(3 * i, 3 * i) = joint[0].block<3, 3>(3 * i, 3 * i);
  }
  for (const Functional& one : functionals) {
    std::array<Matrix3d, 2> predicted;
    for (std::size_t table = 0; table < 2; ++table) {
      predicted[table] = one.weights * joint[table] * one.weights.transpose();
    }
    const Matrix3d independent = one.weights * alone * one.weights.transpose();
    std::array<double, 3> wrong{};
    for (Index axis = 0; axis < 3; ++axis) {
      const double measured = one.squares[axis] / kDraws;
      for (std::size_t table = 0; table < 2; ++table) {
        const double ratio = measured / predicted[table](axis, axis);
        // 1,000 draws give a variance to 4.5 %; this is 2.7 sigmas.
        EXPECT_GT(ratio, 0.88) << one.name << " axis " << axis << " table " << table;
        EXPECT_LT(ratio, 1.12) << one.name << " axis " << axis << " table " << table;
        RecordProperty(fmt::format("{} {} {}", one.name, axis, table == 0 ? "1 s" : "10 s"),
                       fmt::format("{:.3f}", ratio));
      }
      wrong[axis] = measured / independent(axis, axis);
      RecordProperty(fmt::format("{} {} independent", one.name, axis),
                     fmt::format("{:.3f}", measured / independent(axis, axis)));
    }
    const double least = *std::ranges::min_element(wrong), most = *std::ranges::max_element(wrong);
    if (one.name.find("difference") != std::string::npos) {
      EXPECT_LT(most, 0.88) << one.name;
    } else if (one.name == "a roof's tilt") {
      EXPECT_GT(least, 1.12);
    } else if (one.name != "a point") {
      EXPECT_GT(least, 5) << one.name;
    }
  }
}

/// Covariances of some quantities with correlations of up to 0.9 between the first ones and the
/// last.
MatrixXd correlated(const Eigen::VectorXd& sigma) {
  const Index n = sigma.size();
  MatrixXd factor(n, n);
  const RandomStream random(7, 3);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      factor(i, j) = random.normal(static_cast<std::uint64_t>(n * i + j));
    }
    factor(i, 0) += i % 2 == 0 ? 4 : -4;  // what all have in common
    factor.row(i) *= sigma[i] / factor.row(i).norm();
  }
  return factor * factor.transpose();
}

// A flight that calibrates finds mount and prisms together. With that calibration a point's
// covariance is that of all of them, J C J', with J by differences of what a surveyor computes;
// with another one, of which only the variances differ, that of both apart.
TEST(Georeference, MountAndPrismsThatWereFoundTogetherAreCountedTogether) {
  const std::vector<double> times{20.0, 20.015, 21.0, 50.0, 150.0};
  MovingPlatform platform{trajectory(220), mount(), {}, "EPSG:32632"};
  trajectories::Mount& m = platform.mount;
  BentUnit unit;
  const auto prisms = static_cast<Index>(unit.names().size()), all = prisms + 7;
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(all, BentUnit::kPrismSigma);
  const auto sigmas = trajectories::mount_sigmas(m);
  sigma.tail(7) = Eigen::Map<const Eigen::VectorXd>(sigmas.data(), 7);
  m.covariance = {unit.names(), correlated(sigma)};
  m.covariance.names.insert(m.covariance.names.end(), trajectories::mount_names().begin(),
                            trajectories::mount_names().end());
  unit.sensor().covariance = m.covariance.matrix.topLeftCorner(prisms, prisms);

  const trajectories::Interpolation interpolation(platform.trajectory);
  const MapProjection map("EPSG:32632");
  /// @param errors  in sigmas
  const auto place = [&](double time, double range, const Eigen::VectorXd& errors) {
    trajectories::Mount moved = m;
    for (Index k = 0; k < 3; ++k) {
      moved.lever_arm[k].value += errors[prisms + 3 + k] * sigmas[k + 3];
    }
    const Vector3d turn =
        errors.segment<3>(prisms).cwiseProduct(Eigen::Map<const Vector3d>(sigmas.data()));
    const auto pose = interpolation.at(200'000 * kSecond +
                                       std::llround(1e9 * (time + errors[all - 1] * sigmas[6])));
    const std::vector<double> of_prisms(errors.data(), errors.data() + prisms);
    Vector3d p = range * unit.direction(time, of_prisms);
    p += turn.cross(p);
    return map.project(pose->position +
                       pose->attitude.toRotationMatrix() * (trajectories::lever_arm(moved) +
                                                            trajectories::body_from_sensor(m) * p));
  };
  const Georeference georeference(platform, recordings::TimeReference::relative, 0);
  const auto stated = [&] {
    SensorPoints of = prism_points(times, unit, m);
    const SensorPoses at = poses(georeference, of.points);
    of.compute(at);
    georeference.announce(of.header);
    georeference.apply(of.points, at);
    return of;
  };
  const SensorPoints together = stated();
  EXPECT_FALSE(together.model.mount_of_another);
  unit.sensor().covariance *= 1.001;
  const SensorPoints apart = stated();
  EXPECT_TRUE(apart.model.mount_of_another);
  MatrixXd independent = m.covariance.matrix;
  independent.topLeftCorner(prisms, prisms) = unit.sensor().covariance;
  independent.topRightCorner(prisms, 7).setZero();
  independent.bottomLeftCorner(7, prisms).setZero();

  const Eigen::VectorXd none = Eigen::VectorXd::Zero(all);
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double range = together.shots.range[i];
    MatrixXd jacobian(3, all);
    for (Index k = 0; k < all; ++k) {
      Eigen::VectorXd step = none;
      step[k] = 1;
      jacobian.col(k) = (place(times[i], range, step) - place(times[i], range, -step)) / 2;
      jacobian.col(k) /= k < prisms ? BentUnit::kPrismSigma : sigma[k];
    }
    const Vector3d along =
        (place(times[i], range + 0.5, none) - place(times[i], range - 0.5, none));
    const Matrix3d ranges =
        (kRangeNoise * kRangeNoise + kRangeOffset * kRangeOffset) * along * along.transpose();
    const auto check = [&](const SensorPoints& of, const MatrixXd& covariance) {
      const Matrix3d expected = jacobian * covariance * jacobian.transpose() + ranges;
      const auto& c = of.points.covariance;
      Matrix3d got;
      got << c[kXX][i], c[kXY][i], c[kXZ][i], c[kXY][i], c[kYY][i], c[kYZ][i], c[kXZ][i], c[kYZ][i],
          c[kZZ][i];
      EXPECT_LT((got - expected).norm(), 2e-3 * expected.norm()) << got << "\n" << expected;
      // The loadings say the same, but for the range's own noise.
      Matrix3d shared = Matrix3d::Zero();
      for (const auto& loading : of.points.loading) {
        const Vector3d one(loading[0][i], loading[1][i], loading[2][i]);
        shared += one * one.transpose();
      }
      EXPECT_LT((shared + kRangeNoise * kRangeNoise * along * along.transpose() - got).norm(),
                1e-4 * got.norm());
      return expected;
    };
    const Matrix3d joint = check(together, m.covariance.matrix), alone = check(apart, independent);
    EXPECT_GT((joint - alone).norm(), 0.1 * alone.norm()) << "the case proves nothing";
  }
}

TEST(Georeference, RefusesWhatCannotBe) {
  Trajectory local = trajectory(1);
  local.frame = trajectories::Frame::local;
  const MovingPlatform on_a_map{local, mount(), {}, "EPSG:32632"};
  EXPECT_NE(refusal([&] {
              Georeference(on_a_map, recordings::TimeReference::relative, 0);
            }).find("in a local frame"),
            std::string::npos);
  const MovingPlatform bare{trajectory(1), mount(), {}, ""};
  const Georeference georeference(bare, recordings::TimeReference::relative, 0);
  SensorPoses at;
  EXPECT_NE(refusal([&] { at.keep(std::vector<std::size_t>{0}); }).find("row"), std::string::npos);
  EXPECT_THAT(codes_of(georeference.warnings()),
              ::testing::ElementsAre("taken_as_exact", "clock_unknown", "map_assumed"));
  Points points;
  CloudHeader header;
  header.has_point_source = true;
  header.resize(points, 2);
  EXPECT_NE(refusal([&] { georeference.apply(points, {}); }).find("poses"), std::string::npos);
  at.resize(2);
  at.turn[4].pop_back();
  EXPECT_NE(refusal([&] { georeference.apply(points, at); }).find("turn of poses"),
            std::string::npos);
}

}  // namespace risley::cloud::georeference_test
