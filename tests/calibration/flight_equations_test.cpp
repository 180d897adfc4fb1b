// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_equations.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "risley/calibration/planar_adjustment.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/plane.hpp"

#include "optics/trains.hpp"
#include "parameter_name.hpp"
#include "refusal.hpp"

namespace risley::calibration::flight_equations_test {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Vector3d eigen(const Vector3<double>& v) { return {v.x, v.y, v.z}; }
Vector3<double> plain(const Vector3d& v) { return {v[0], v[1], v[2]}; }

Matrix3d turned(const Vector3d& vector) {
  const double angle = vector.norm();
  if (angle == 0) return Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

/// Two strips over three pieces of ground, every quantity off its nominal value.
struct Flight {
  FlightShots shots;
  ShotPoses poses;
  PlaneOfShot plane;
  FlightModel model;
  FlightWeights weights;
  std::vector<double> truth;  ///< predicted ranges

  explicit Flight(const std::string& face_order, int emitters = 1, std::size_t count = 500) {
    std::mt19937_64 generator(7);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto random3 = [&](double sigma) {
      return Vector3d(sigma * normal(generator), sigma * normal(generator),
                      sigma * normal(generator));
    };
    model.train = testing::imperfect_train(face_order, 0.5, 3, emitters);
    model.geometry = {{0.007}, {0.03}};
    model.free = estimation::free_parameters(estimation::default_free_names(model.train.shape()),
                                             model.train.shape());
    model.nominal << 0, 0, 1, 0, -1, 0, 1, 0, 0;
    model.boresight = turned(random3(0.03));
    model.lever_arm = {0.1, 0.05, 0.12};
    model.range_offset = 0.013;
    model.clock_offset = 0.0015;
    poses.clock_offset = 0.0010;
    model.planes = {{Vector3d(0.1, -0.05, 1).normalized(), {3, -4, 0.5}},
                    {Vector3d(0.5, 0.3, 1).normalized(), {-6, 2, 2}},
                    {Vector3d(-0.2, 0.9, 1).normalized(), {1, 7, 3}}};
    const auto prisms = static_cast<std::size_t>(model.train.prisms());
    shots.rotation_angle.resize(prisms);
    for (std::size_t i = 0; i < count; ++i) {
      const bool second = i >= count / 2;
      for (auto& column : shots.rotation_angle) column.push_back(kPi * uniform(generator));
      shots.time_ns.push_back(static_cast<std::int64_t>(1e15) +
                              static_cast<std::int64_t>(i) * 2'000'000 +
                              (second ? 20'000'000'000 : 0));
      shots.strip.push_back(second ? 1 : 0);
      if (emitters > 1) {
        shots.beam.push_back(static_cast<std::uint8_t>(i % static_cast<std::size_t>(emitters)));
      }
      shots.range.push_back(80);
      plane.push_back(static_cast<std::int32_t>(generator() % 4) - 1);
      ShotPose pose{};
      const Vector3d position = Vector3d(0, 0, 80) + random3(5);
      const Eigen::Quaterniond attitude(turned(random3(0.05)) *
                                        turned(Vector3d(0, 0, second ? 2 : 0.3)) *
                                        turned(Vector3d(kPi, 0, 0)));
      const Vector3d velocity = random3(5), omega = random3(0.5);
      pose.attitude[0] = attitude.w();
      for (int k = 0; k < 3; ++k) {
        pose.position[k] = position[k];
        pose.attitude[k + 1] = attitude.vec()[k];
        pose.velocity[k] = static_cast<float>(velocity[k]);
        pose.angular_velocity[k] = static_cast<float>(omega[k]);
      }
      poses.pose.push_back(pose);
    }
    model.knots = make_knots(shots, 0.1);
    model.corrections = Eigen::MatrixXd::NullaryExpr(6, model.knots.size(),
                                                     [&] { return 1e-4 * normal(generator); });
    weights.range_variance = 4e-4;
    for (std::size_t i = 0; i < count; ++i) {
      truth.push_back(kNaN);
      if (plane[i] == kNoPlane) continue;
      truth[i] = predicted(model, i);
      shots.range[i] = truth[i] + 0.02 * normal(generator);
    }
  }

  std::size_t interval_of(std::size_t shot) const {
    std::size_t i = 0;
    while (model.knots.intervals[i].end_shot <= shot) ++i;
    return i;
  }
  double knot_weight(std::size_t shot) const {
    const auto& interval = model.knots.intervals[interval_of(shot)];
    return static_cast<double>(shots.time_ns[shot] - interval.begin_ns) /
           static_cast<double>(interval.end_ns - interval.begin_ns);
  }

  /// The range that scalar code expects, with the corrected pose moved and turned by `error`.
  /// @param origin_train  whose prisms the beam's origin is of
  double predicted(const FlightModel& m, std::size_t i,
                   const Eigen::Matrix<double, 6, 1>& error = Eigen::Matrix<double, 6, 1>::Zero(),
                   const std::optional<PrismTrain>& origin_train = {}) const {
    std::vector<double> angles;
    for (const auto& column : shots.rotation_angle) angles.push_back(column[i]);
    const int beam = shots.beam.empty() ? 0 : shots.beam[i];
    const Ray ray = emergent_ray(m.train, m.geometry, angles, beam);
    const Ray start = emergent_ray(origin_train.value_or(m.train), m.geometry, angles, beam);
    const auto knot = static_cast<Index>(m.knots.intervals[interval_of(i)].knot);
    const double w = knot_weight(i);
    const Eigen::Matrix<double, 6, 1> moved =
        (1 - w) * m.corrections.col(knot) + w * m.corrections.col(knot + 1);
    const ShotPose& pose = poses.pose[i];
    const double dt = m.clock_offset - poses.clock_offset;
    Vector3d position(pose.position), velocity, omega;
    for (int k = 0; k < 3; ++k) {
      velocity[k] = pose.velocity[k];
      omega[k] = pose.angular_velocity[k];
    }
    position += moved.head<3>() + error.head<3>() + dt * velocity;
    const Eigen::Quaterniond attitude(pose.attitude[0], pose.attitude[1], pose.attitude[2],
                                      pose.attitude[3]);
    const Vector3d turn = moved.tail<3>() + dt * omega;
    const Matrix3d local =
        turned(error.tail<3>()) * turned(turn) * attitude.normalized().toRotationMatrix();
    const Matrix3d mount = m.nominal * m.boresight;
    const Vector3d from = position + local * (m.lever_arm + mount * eigen(start.origin));
    const Vector3d along = local * mount * eigen(ray.direction);
    const GroundPlane& ground = m.planes[plane[i]];
    return ground.normal.dot(ground.centre - from) / ground.normal.dot(along) + m.range_offset;
  }

  /// Derivatives of the predicted range by central differences, in the order of FlightRows.
  Eigen::VectorXd slopes(std::size_t i) const {
    const int globals = model.unknowns().size();
    Eigen::VectorXd row(globals + 9);
    const auto slope = [&](double step, const auto& range_at) {
      return (range_at(step) - range_at(-step)) / (2 * step);
    };
    const auto by_model = [&](double step, const auto& change) {
      return slope(step, [&](double h) {
        FlightModel other = model;
        change(other, h);
        return predicted(other, i, Eigen::Matrix<double, 6, 1>::Zero(), model.train);
      });
    };
    for (int k = 0; k < 3; ++k) {
      row[FlightUnknowns::boresight(k)] = by_model(1e-5, [&](FlightModel& m, double h) {
        m.boresight = m.boresight * turned(h * Vector3d::Unit(k));
      });
      row[FlightUnknowns::lever_arm(k)] =
          by_model(1e-3, [&](FlightModel& m, double h) { m.lever_arm[k] += h; });
    }
    row[FlightUnknowns::range_offset()] =
        by_model(1e-3, [](FlightModel& m, double h) { m.range_offset += h; });
    row[FlightUnknowns::clock_offset()] =
        by_model(1e-4, [](FlightModel& m, double h) { m.clock_offset += h; });
    for (std::size_t j = 0; j < model.free.size(); ++j) {
      row[FlightUnknowns::parameter(static_cast<int>(j))] =
          by_model(1e-5, [&](FlightModel& m, double h) {
            for (const int place : model.free[j].places)
              m.train.set_place(place, m.train[place] + h);
          });
    }
    if (model.drift_about_ns) {
      row[model.unknowns().clock_drift()] =
          row[FlightUnknowns::clock_offset()] * 1e-9 *
          static_cast<double>(shots.time_ns[i] - *model.drift_about_ns);
    }
    if (model.attitude_delay) {
      const auto& rate = poses.pose[i].angular_velocity;
      Eigen::Matrix<double, 6, 1> late = Eigen::Matrix<double, 6, 1>::Zero();
      late.tail<3>() = Vector3d(rate[0], rate[1], rate[2]);
      row[model.unknowns().attitude_delay()] =
          slope(1e-4, [&](double h) { return predicted(model, i, h * late, model.train); });
    }
    for (int k = 0; k < 6; ++k) {
      row[globals + k] = slope(k < 3 ? 1e-3 : 1e-5, [&](double h) {
        return predicted(model, i, h * Eigen::Matrix<double, 6, 1>::Unit(k));
      });
    }
    const auto p = static_cast<std::size_t>(plane[i]);
    const auto tangents = tangents_of(plain(model.planes[p].normal));  // a lambda needs a name
    for (int k = 0; k < 2; ++k) {
      row[globals + 6 + k] = by_model(1e-5, [&](FlightModel& m, double h) {
        m.planes[p].normal =
            (m.planes[p].normal + h * eigen(k == 0 ? tangents.first : tangents.second))
                .normalized();
      });
    }
    row[globals + 8] = by_model(
        1e-3, [&](FlightModel& m, double h) { m.planes[p].centre += h * m.planes[p].normal; });
    return row;
  }

  /// The rows of all shots that have a plane [columns, shots], NaN elsewhere.
  Eigen::MatrixXd rows(InstructionSet set) const {
    Eigen::MatrixXd all =
        Eigen::MatrixXd::Constant(model.unknowns().size() + 12, shots.size(), kNaN);
    for_each_flight_piece(
        shots, poses, plane, model, weights,
        [&](std::size_t, const FlightRows& found) {
          for (std::size_t r = 0; r < found.shots.size(); ++r) {
            all.col(found.shots[r]) = Eigen::Map<const Eigen::VectorXd>(
                found.values.data() + r * static_cast<std::size_t>(found.columns), found.columns);
          }
        },
        set);
    return all;
  }
};

class EveryTrain : public ::testing::TestWithParam<std::pair<std::string, int>> {};

TEST_P(EveryTrain, DerivativesAreThoseOfThePredictedRange) {
  Flight flight(GetParam().first, GetParam().second);
  for (const InstructionSet set : available_instruction_sets()) {
    if (set == available_instruction_sets().back()) {
      flight.model.drift_about_ns = flight.shots.time_ns[flight.shots.size() / 3];
      flight.model.attitude_delay = true;
    }
    const Eigen::MatrixXd rows = flight.rows(set);
    const int globals = flight.model.unknowns().size();
    int checked = 0;
    for (std::size_t i = 0; i < flight.shots.size(); i += 5) {
      if (flight.plane[i] == kNoPlane) {
        EXPECT_TRUE(std::isnan(rows(0, i)));
        continue;
      }
      ++checked;
      const Eigen::VectorXd row = rows.col(i);
      EXPECT_NEAR(row[globals + 9], flight.shots.range[i] - flight.truth[i], 1e-9);
      const Eigen::VectorXd slopes = flight.slopes(i);
      for (Index c = 0; c < slopes.size(); ++c) {
        // The turn that a step of the clock brings, some 1e-4 rad, does not turn its own axis.
        double size = std::abs(slopes[c]);
        if (c == FlightUnknowns::clock_offset()) size = 15 * row.segment<3>(globals + 3).norm();
        if (flight.model.drift_about_ns && c == flight.model.unknowns().clock_drift()) {
          size =
              15 * row.segment<3>(globals + 3).norm() * 1e-9 *
              std::abs(static_cast<double>(flight.shots.time_ns[i] - *flight.model.drift_about_ns));
        }
        EXPECT_NEAR(row[c], slopes[c], 1e-6 + 2e-5 * size)
            << "shot " << i << ", column " << c << ", " << to_string(set);
      }
    }
    EXPECT_GT(checked, 50);
  }
}

INSTANTIATE_TEST_SUITE_P(Trains, EveryTrain,
                         ::testing::Values(std::pair{"PA-AP", 1}, std::pair{"PA-AP", 3},
                                           std::pair{"AP-PA-AP", 1}),
                         [](const auto& train) {
                           return parameter_name(train.param.first) +
                                  std::to_string(train.param.second);
                         });

TEST(FlightEquations, AreTheSumsOfTheRows) {
  Flight flight("PA-AP");
  flight.model.drift_about_ns = flight.shots.time_ns[flight.shots.size() / 3];
  flight.model.attitude_delay = true;
  flight.weights.white = {1e-3, 2e-3, 3e-3, 1e-4, 2e-4, 3e-4};
  flight.weights.sample_interval = 0.02;
  std::vector<double> together(flight.model.knots.intervals.size());  // in a sample, on average
  flight.weights.rotation_angle_variance = 1e-10;
  flight.weights.gate = 2;
  flight.shots.range[10] = 70;  // an outlier, if it has a plane
  flight.plane[10] = 0;
  for (std::size_t i = 0; i < flight.shots.size(); ++i) {
    const auto& interval = flight.model.knots.intervals[flight.interval_of(i)];
    if (flight.plane[i] == kNoPlane) continue;
    together[flight.interval_of(i)] +=
        0.02e9 / static_cast<double>(interval.end_ns - interval.begin_ns);
  }
  for (const InstructionSet set : available_instruction_sets()) {
    const Eigen::MatrixXd rows = flight.rows(set);
    const FlightEquations found = flight_equations(flight.shots, flight.poses, flight.plane,
                                                   flight.model, flight.weights, set);
    const int g = flight.model.unknowns().size();
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> white(flight.weights.white.data());
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(g, g);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(g);
    const std::size_t knots = flight.model.knots.intervals.size();
    std::vector<Eigen::MatrixXd> knot_global(knots, Eigen::MatrixXd::Zero(12, g)),
        knot_hessian(knots, Eigen::MatrixXd::Zero(12, 12));
    std::vector<Eigen::VectorXd> knot_gradient(knots, Eigen::VectorXd::Zero(12));
    std::vector<Eigen::MatrixXd> plane(knots * 3, Eigen::MatrixXd::Zero(3, g + 16));
    double cost = 0;
    std::size_t used = 0, outliers = 0;
    for (std::size_t i = 0; i < flight.shots.size(); ++i) {
      if (flight.plane[i] == kNoPlane) continue;
      const Eigen::VectorXd row = rows.col(i);
      const double residual = row[g + 9], variance = row[g + 10], weight = row[g + 11];
      ++used;
      if (weight == 0) {
        ++outliers;
        EXPECT_GT(std::abs(residual), 2 * std::sqrt(variance));
      } else {
        // What the shots of a sample share counts as each one's own, as many times.
        const double shared = 1 / weight - variance;
        EXPECT_NEAR(
            shared,
            row.segment<6>(g).cwiseProduct(white).squaredNorm() * together[flight.interval_of(i)],
            1e-9);
        EXPECT_LE(residual * residual, 4 / weight);
      }
      EXPECT_GT(variance, 4e-4);
      const std::size_t interval = flight.interval_of(i);
      const double w = flight.knot_weight(i);
      Eigen::VectorXd knot(12);
      knot << (1 - w) * row.segment<6>(g), w * row.segment<6>(g);
      hessian += weight * row.head(g) * row.head(g).transpose();
      gradient += weight * residual * row.head(g);
      knot_global[interval] += weight * knot * row.head(g).transpose();
      knot_hessian[interval] += weight * knot * knot.transpose();
      knot_gradient[interval] += weight * residual * knot;
      Eigen::VectorXd all(g + 16);
      all << row.head(g), knot, residual, row.segment<3>(g + 6);
      plane[interval * 3 + static_cast<std::size_t>(flight.plane[i])] +=
          weight * row.segment<3>(g + 6) * all.transpose();
      cost += weight * residual * residual;
    }
    EXPECT_GT(outliers, 0U);
    EXPECT_EQ(found.shots, used);
    EXPECT_EQ(found.outliers, outliers);
    EXPECT_EQ(found.lost, 0U);
    EXPECT_NEAR(found.cost, cost, 1e-9 * cost);
    const auto near = [](const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
      return (a - b).cwiseAbs().maxCoeff() <= 1e-9 * (1 + b.cwiseAbs().maxCoeff());
    };
    EXPECT_TRUE(near(found.hessian, hessian));
    EXPECT_TRUE(near(found.gradient, gradient));
    for (std::size_t k = 0; k < knots; ++k) {
      EXPECT_TRUE(near(found.knot_global[k], knot_global[k]));
      EXPECT_TRUE(near(found.knot_hessian[k], knot_hessian[k]));
      EXPECT_TRUE(near(found.knot_gradient[k], knot_gradient[k]));
    }
    for (const PlaneBlock& block : found.plane_blocks) {
      const Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>> products(
          found.plane_products.data() + block.at, 3, g + 16);
      EXPECT_TRUE(near(products, plane[block.interval * 3 + block.plane]));
    }
  }
}

TEST(FlightEquations, DoNotDependOnThreads) {
  const Flight flight("PA-AP", 1, 100000);
  const auto run = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return flight_equations(flight.shots, flight.poses, flight.plane, flight.model, flight.weights);
  };
  const FlightEquations one = run(1), four = run(4);
  EXPECT_EQ(one.hessian, four.hessian);
  EXPECT_EQ(one.plane_products, four.plane_products);
  EXPECT_EQ(one.cost, four.cost);
}

TEST(FlightEquations, CountShotsThatMissTheirPlane) {
  Flight flight("PA-AP");
  flight.model.planes[1].centre.z() = 500;  // above the flight
  const FlightEquations found =
      flight_equations(flight.shots, flight.poses, flight.plane, flight.model, flight.weights);
  const auto on_it = std::ranges::count(flight.plane, 1);
  EXPECT_EQ(found.lost, static_cast<std::size_t>(on_it));
  EXPECT_TRUE(found.hessian.allFinite());
}

TEST(FlightEquations, RefuseWhatDoesNotBelongTogether) {
  const Flight flight("PA-AP");
  const auto refused = [&](const auto& damage) {
    Flight other = flight;
    damage(other);
    return refusal([&] {
      flight_equations(other.shots, other.poses, other.plane, other.model, other.weights);
    });
  };
  EXPECT_EQ(refused([](Flight&) {}), "");
  EXPECT_NE(refused([](Flight& f) { f.plane[5] = 3; }).find("plane of shot 5 = 3"),
            std::string::npos);
  EXPECT_NE(refused([](Flight& f) { f.plane.pop_back(); }), "");
  EXPECT_NE(refused([](Flight& f) { f.poses.pose.pop_back(); }), "");
  EXPECT_NE(refused([](Flight& f) { f.shots.rotation_angle.pop_back(); }), "");
  EXPECT_NE(refused([](Flight& f) { f.weights.range_variance = 0; }), "");
  EXPECT_NE(refused([](Flight& f) { f.weights.gate = kNaN; }), "");
  EXPECT_NE(refused([](Flight& f) { f.model.corrections(0, 0) = kNaN; }), "");
  EXPECT_NE(refused([](Flight& f) { f.model.corrections.resize(6, 2); }), "");
  EXPECT_NE(refused([](Flight& f) { f.model.boresight *= 2; }), "");
  EXPECT_NE(refused([](Flight& f) { f.model.planes[0].normal *= 2; }), "");
  EXPECT_NE(refused([](Flight& f) { f.model.free[0].places = {99}; }), "");
  EXPECT_NE(refused([](Flight& f) { f.model.knots.intervals.pop_back(); }), "");
}

}  // namespace risley::calibration::flight_equations_test
