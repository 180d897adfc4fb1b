// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/station.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/algebra/rotation_vector.hpp"
#include "risley/cloud/georeference.hpp"
#include "risley/cloud/station_adjustment.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/random.hpp"
#include "risley/trajectories/geodesy.hpp"

#include "refusal.hpp"
#include "seeds.hpp"

namespace risley::cloud::station_test {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::HasSubstr;

constexpr double kDegree = kRadiansPerDegree;

StatedPose stated() {
  StatedPose pose;
  pose.place = {464163.20, 5538631.75, 301.482};
  pose.sigma = {0.003, 0.004, 0.006};
  pose.angles = {2 * kDegree, -3 * kDegree, 120 * kDegree};
  pose.angle_sigma = {0.01 * kDegree, 0.02 * kDegree, 0.03 * kDegree};
  return pose;
}

/// A point of the sensor's frame on the map.
Vector3d mapped(const StandingPose& pose, const MapProjection* map, const Vector3d& point) {
  const Vector3d place = pose.position + pose.turn * point;
  return map == nullptr ? place : map->project(place);
}

TEST(Station, StandsAsItSays) {
  StatedPose level = stated();
  level.angles = {0, 0, 90 * kDegree};
  const StandingPose pose = standing_pose(level, nullptr);
  // Forward is east, left is north, up is up.
  EXPECT_LT((mapped(pose, nullptr, {10, 2, 1}) - level.place - Vector3d(10, 2, 1)).norm(), 1e-9);
  level.angles.pitch = 90 * kDegree;  // forward is up, up is west
  const StandingPose up = standing_pose(level, nullptr);
  EXPECT_LT((mapped(up, nullptr, {10, 2, 1}) - level.place - Vector3d(-1, 2, 10)).norm(), 1e-9);
}

TEST(Station, HeadingsAreFromTheGridOfTheMap) {
  const MapProjection map("EPSG:25832", "");
  StatedPose level = stated();
  level.place.x() = 300'000;  // where the grid leans by two degrees
  level.angles = {0, 0, 30 * kDegree};
  const Vector3d ahead = mapped(standing_pose(level, &map), &map, {20, 0, 0}) - level.place;
  EXPECT_NEAR(std::atan2(ahead.x(), ahead.y()), 30 * kDegree, 1e-6);
  EXPECT_NEAR(ahead.z(), 20 * 20 / (2 * 6.38e6), 1e-5);  // a level line leaves the ellipsoid
  // The same place on the ellipsoid, where headings are from true north.
  StatedPose there = level;
  const auto place = trajectories::geodetic_from_geocentric(standing_pose(level, &map).position);
  there.geographic = true;
  there.place = {place.latitude, place.longitude, place.height};
  const Vector3d other = mapped(standing_pose(there, nullptr), &map, {20, 0, 0}) - level.place;
  const double leans = std::atan2(other.x(), other.y()) - 30 * kDegree;
  EXPECT_NEAR(leans, -std::atan(std::tan(place.longitude - 9 * kDegree) * std::sin(place.latitude)),
              1e-5);
}

TEST(Station, PosesComeBackFromTheMap) {
  const MapProjection map("EPSG:25832", "");
  for (const MapProjection* on : {&map, static_cast<const MapProjection*>(nullptr)}) {
    const StatedPose put = stated();
    const StatedPose got = pose_on_map(standing_pose(put, on), on);
    EXPECT_LT((got.place - put.place).norm(), 1e-6);
    EXPECT_LT((got.sigma - put.sigma).norm(), 1e-9);
    EXPECT_NEAR(got.angles.roll, put.angles.roll, 1e-9);
    EXPECT_NEAR(got.angles.pitch, put.angles.pitch, 1e-9);
    EXPECT_NEAR(got.angles.heading, put.angles.heading, 1e-9);
    EXPECT_NEAR(got.angle_sigma.roll, put.angle_sigma.roll, 1e-9);
    EXPECT_NEAR(got.angle_sigma.pitch, put.angle_sigma.pitch, 1e-9);
    EXPECT_NEAR(got.angle_sigma.heading, put.angle_sigma.heading, 1e-9);
  }
}

TEST(Station, PointsOfAStandingSensorGoWhereTheMapSays) {
  const MapProjection map("EPSG:25832", "");
  StandingSensor sensor;
  sensor.pose = standing_pose(stated(), &map);
  sensor.number = 3;
  sensor.crs = "EPSG:25832";
  const Georeference georeference(sensor);
  CloudHeader header;
  georeference.announce(header);
  EXPECT_THAT(header.frame.wkt, HasSubstr("ETRS"));
  EXPECT_TRUE(georeference.warnings().empty());
  Points points;
  header.resize(points, 2);
  const std::array<Vector3d, 2> seen{Vector3d(30, -4, 2), Vector3d(5, 1, 0)};
  for (std::size_t i = 0; i < 2; ++i) {
    points.x[i] = seen[i].x();
    points.y[i] = seen[i].y();
    points.z[i] = seen[i].z();
    points.covariance[kXX][i] = points.own_covariance[kXX][i] = 4e-4;  // along the optical axis
  }
  SensorPoses poses;
  std::vector<std::size_t> rows;
  georeference.find_poses(points.time_ns, poses, rows);
  ASSERT_EQ(rows.size(), 2U);
  georeference.apply(points, poses);
  for (std::size_t i = 0; i < 2; ++i) {
    const Vector3d expected = mapped(sensor.pose, &map, seen[i]);
    EXPECT_LT((Vector3d(points.x[i], points.y[i], points.z[i]) - expected).norm(), 2e-6);
    EXPECT_EQ(points.point_source[i], 3);
    const double trace =
        points.covariance[kXX][i] + points.covariance[kYY][i] + points.covariance[kZZ][i];
    EXPECT_NEAR(trace, 4e-4, 1e-6);
  }
}

TEST(Station, FilesSayWhatIsWrong) {
  const std::string head = "risley_stations: 1\nstations:\n  - name: a\n";
  const std::string target =
      "      - {name: %, place_m: [1, 2, 3], sigma_m: [0.01, 0.01, 0.01], in_scan_m: [4, 5, 6], "
      "in_scan_sigma_m: 0.01}\n";
  const auto targets = [&](const std::string& names) {
    std::string text = head + "    targets:\n";
    for (const char name : names) {
      text += target;
      text.replace(text.rfind('%'), 1, 1, name);
    }
    return text;
  };
  EXPECT_EQ(parse_stations(targets("pqr"), "s.yaml").stations.front().targets.size(), 3U);
  const auto refused = [](const std::string& text) {
    return refusal<FileError>([&] { parse_stations(text, "s.yaml"); });
  };
  EXPECT_THAT(refused("planes: []\n"), NamesField("risley_stations"));
  EXPECT_THAT(refused(targets("pq")), NamesField("stations[0].targets"));
  EXPECT_THAT(refused(targets("ppq")), NamesField("twice"));
  EXPECT_THAT(refused(head), NamesField("position"));
  EXPECT_THAT(refused(targets("pqr") + "    attitude: {}\n"), NamesField("attitude"));
  const Stations read = parse_stations(
      head +
          "    position: {latitude_deg: 50, longitude_deg: 9, ellipsoidal_height_m: 100, "
          "sigma_m: [0.01, 0.02, 0.03]}\n"
          "    attitude: {roll_deg: 1, pitch_deg: 2, heading_deg: 3, sigma_deg: [0.1, 0.2, 0.3]}\n",
      "s.yaml");
  const StatedPose& pose = *read.stations.front().stated;
  EXPECT_TRUE(pose.geographic);
  EXPECT_NEAR(pose.place[0], 50 * kDegree, 1e-12);
  EXPECT_NEAR(pose.angle_sigma.heading, 0.3 * kDegree, 1e-12);
}

/// Targets of a known pose that was measured with noise, some of it common to all.
struct Survey {
  StandingPose truth;
  std::vector<StationTarget> targets;
  std::vector<MeasuredTarget> measured;
  VectorXd factors;  ///< the sensor's common errors, in sigmas

  Survey(const MapProjection* map, std::uint64_t seed, const std::vector<Vector3d>& seen) {
    const RandomStream noise(seed, 0);
    std::uint64_t next = 0;
    const auto normal = [&] {
      return Vector3d(noise.normal(next), noise.normal(next + 1), noise.normal(next + 2));
    };
    truth = standing_pose(stated(), map);
    factors = VectorXd::Zero(2);
    factors << noise.normal(1000), noise.normal(1001);
    const Matrix3d axes = map_axes(map, truth.position);
    for (const Vector3d& p : seen) {
      StationTarget target;
      target.name = std::to_string(targets.size());
      target.sigma = {0.003, 0.003, 0.005};
      const Vector3d off = axes * target.sigma.cwiseProduct(normal());
      next += 3;
      const Vector3d place = truth.position + truth.turn * p + off;
      target.place = map == nullptr ? place : map->project(place);
      MeasuredTarget one;
      one.own = Vector3d(1e-5, 4e-6, 4e-6).asDiagonal();
      one.loading = {0.01 * p.normalized(), Vector3d(0, 0, 1).cross(p) * 3e-4};
      one.at = p + factors[0] * one.loading[0] + factors[1] * one.loading[1] +
               one.own.cwiseSqrt() * normal();
      next += 3;
      targets.push_back(target);
      measured.push_back(one);
    }
  }
};

const std::vector<Vector3d> kAround{{20, 5, 1}, {15, -6, 3}, {30, 2, -1}, {8, 1, 2}, {25, -9, 0}};

// The error of the pose is that of the covariance, and goes with the sensor's own errors as it is
// said to: NEES with and without them.
TEST(Station, ErrorsOfAnAdjustedPoseAreAsStated) {
  const MapProjection map("EPSG:25832", "");
  const auto seeds = static_cast<std::uint64_t>(testing::seeds_or(200));
  double given_factors = 0, whole = 0, chi2 = 0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const Survey survey(&map, seed, kAround);
    const AdjustedStation found = adjust_station(survey.targets, survey.measured, &map);
    const StandingPose& truth = survey.truth;
    Eigen::Matrix<double, 6, 1> error;
    error << algebra::rotation_vector(Matrix3d(truth.turn.transpose() * found.pose.turn)),
        truth.turn.transpose() * (found.pose.position - truth.position);
    const Eigen::Matrix<double, 6, 1> own = error - found.pose.response * survey.factors;
    given_factors += own.dot(found.pose.covariance.ldlt().solve(own)) / 6;
    const StandingCovariance all =
        found.pose.covariance + found.pose.response * found.pose.response.transpose();
    whole += error.dot(all.ldlt().solve(error)) / 6;
    chi2 += found.chi2 / found.degrees_of_freedom;
    EXPECT_EQ(found.degrees_of_freedom, 9);
  }
  const double n = static_cast<double>(seeds), band = 4 * std::sqrt(2 / (6 * n));
  EXPECT_NEAR(given_factors / n, 1, band);
  EXPECT_NEAR(whole / n, 1, band);
  EXPECT_NEAR(chi2 / n, 1, 4 * std::sqrt(2 / (9 * n)));
}

/// Where a pose puts a place of the frame, less where that is, by a covariance of one sigma each in
/// the columns.
Eigen::MatrixXd moved(const StandingPose& pose, const Vector3d& place,
                      const Eigen::MatrixXd& columns) {
  const Vector3d p = pose.turn.transpose() * (place - pose.position);
  Eigen::MatrixXd result(3, columns.cols());
  for (Eigen::Index k = 0; k < columns.cols(); ++k) {
    const Vector3d turn = columns.col(k).head<3>(), shift = columns.col(k).tail<3>();
    result.col(k) = pose.turn * (turn.cross(p) + shift);
  }
  return result;
}

// Three stations see the same five targets, this year and next. What is wrong with the targets'
// places is wrong for all: the mean of the three is not as good as that of independent ones, and
// next year is wrong by the same.
TEST(Station, StationsShareTheErrorsOfTheirTargets) {
  const std::vector<Vector3d> at{{0, 0, 0}, {3, -2, 0.3}, {2, 2, -0.2}};
  const Vector3d place(30, 3, 1), sigma(0.003, 0.003, 0.005);
  const auto seeds = static_cast<std::uint64_t>(testing::seeds_or(200));
  double mean = 0, independent = 0, change = 0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const RandomStream noise(seed, 1);
    std::uint64_t next = 0;
    const auto normal = [&] {
      next += 3;
      return Vector3d(noise.normal(next), noise.normal(next + 1), noise.normal(next + 2));
    };
    std::vector<Vector3d> places;
    for (const Vector3d& truth : kAround) places.emplace_back(truth + sigma.cwiseProduct(normal()));
    std::array<Vector3d, 2> error;
    std::array<Eigen::MatrixXd, 2> shared;
    std::array<Matrix3d, 2> own, all_own;
    std::array<std::string, 2> words;
    for (std::size_t year = 0; year < 2; ++year) {
      std::vector<Station> stations(at.size());
      std::vector<std::optional<AdjustedStation>> adjusted;
      for (std::size_t s = 0; s < at.size(); ++s) {
        std::vector<MeasuredTarget> measured;
        for (std::size_t t = 0; t < places.size(); ++t) {
          stations[s].targets.push_back({std::to_string(t), places[t], sigma, {}, 0.0, {}});
          MeasuredTarget& one = measured.emplace_back();
          one.own = Vector3d(1e-5, 4e-6, 4e-6).asDiagonal();
          one.at = kAround[t] - at[s] + one.own.cwiseSqrt() * normal();
        }
        adjusted.emplace_back(adjust_station(stations[s].targets, measured, nullptr));
      }
      std::vector<StandingCovariance> alone;
      for (const auto& one : adjusted) alone.push_back(one->pose.covariance);
      words[year] = share_targets(stations, adjusted);
      error[year] = Vector3d::Zero();
      shared[year] = Eigen::MatrixXd::Zero(3, 6);
      own[year] = all_own[year] = Matrix3d::Zero();
      for (std::size_t s = 0; s < at.size(); ++s) {
        const StandingPose& pose = adjusted[s]->pose;
        error[year] += (pose.position + pose.turn * (place - at[s]) - place) / 3;
        shared[year] += moved(pose, place, pose.of_survey) / 3;
        const auto variance = [&](const StandingCovariance& of) {
          const Eigen::MatrixXd columns = moved(pose, place, of.llt().matrixL());
          return Matrix3d(columns * columns.transpose() / 9);
        };
        own[year] += variance(pose.covariance);
        all_own[year] += variance(alone[s]);
      }
    }
    const auto nees = [](const Vector3d& e, const Matrix3d& c) {
      return e.dot(c.ldlt().solve(e)) / 3;
    };
    mean += nees(error[0], own[0] + shared[0] * shared[0].transpose());
    independent += nees(error[0], all_own[0]);
    EXPECT_EQ(words[0], words[1]);
    const Eigen::MatrixXd less = shared[1] - shared[0];
    change += nees(error[1] - error[0], own[0] + own[1] + less * less.transpose());
  }
  const double n = static_cast<double>(seeds), band = 4 * std::sqrt(2 / (3 * n));
  EXPECT_NEAR(mean / n, 1, band);
  EXPECT_GT(independent / n, 1.4);
  EXPECT_LT(change / n, 1 + band);
  EXPECT_GT(change / n, 0.7 - band);
}

TEST(Station, ATargetThatIsWrongIsNamed) {
  Survey survey(nullptr, 7, kAround);
  survey.targets[2].place.y() += 0.1;
  const AdjustedStation found = adjust_station(survey.targets, survey.measured, nullptr);
  EXPECT_LT(found.p_value, 1e-6);
  EXPECT_EQ(found.worst, 2U);
}

TEST(Station, TargetsOnALineAreRefused) {
  const Survey line(nullptr, 3, {{10, 1, 0}, {20, 2, 0}, {30, 3, 0}});
  EXPECT_THAT(refusal([&] { adjust_station(line.targets, line.measured, nullptr); }),
              NamesField("line"));
}

/// Points on a sphere and on what is behind it.
Points sphere_points(const Vector3d& center, double radius, std::uint64_t seed) {
  const RandomStream noise(seed, 0);
  Points points;
  CloudHeader header;
  header.has_own_covariance = true;
  header.factors = {"range"};
  std::vector<Vector3d> all;
  for (int i = -20; i <= 20; ++i) {
    for (int j = -20; j <= 20; ++j) {
      const Vector3d aim = center + Vector3d(0, 0.01 * i, 0.01 * j);
      const Vector3d beam = aim.normalized();
      const double along = beam.dot(center), aside = (along * beam - center).squaredNorm();
      const double range =
          aside < radius * radius ? along - std::sqrt(radius * radius - aside) : along + 0.25;
      all.emplace_back(beam * (range + 0.01 * noise.normal(all.size())));
    }
  }
  header.resize(points, all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    points.x[i] = all[i].x();
    points.y[i] = all[i].y();
    points.z[i] = all[i].z();
    const Vector3d beam = all[i].normalized();
    const Matrix3d own = 1e-4 * beam * beam.transpose() + 1e-8 * Matrix3d::Identity();
    const CovarianceTerm terms[] = {kXX, kXY, kXZ, kYY, kYZ, kZZ};
    const int of[][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
    for (std::size_t k = 0; k < 6; ++k) {
      points.own_covariance[terms[k]][i] = points.covariance[terms[k]][i] = own(of[k][0], of[k][1]);
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      points.loading[0][axis][i] = 0.005 * beam[static_cast<Eigen::Index>(axis)];
    }
  }
  return points;
}

TEST(Station, SpheresAreFoundFromAnApproximatePlace) {
  const Vector3d center(12, 1, 0.5);
  std::vector<StationTarget> targets(1);
  targets[0].name = "ball";
  targets[0].in_scan = center + Vector3d(0.06, -0.05, 0.04);
  targets[0].radius = 0.1;
  const auto seeds = static_cast<std::uint64_t>(testing::seeds_or(40));
  double nees = 0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    TargetPoints search(targets);
    search.sink()->write(sphere_points(center, 0.1, seed));
    const MeasuredTarget found = search.measured().front();
    const Vector3d off = found.at - center;
    nees += off.dot(found.own.ldlt().solve(off)) / 3;
    EXPECT_GT(found.points, 100U);
    // An error of all ranges moves the sphere along the beam.
    EXPECT_NEAR(found.loading.front().dot(center.normalized()), 0.005, 5e-4);
  }
  const double n = static_cast<double>(seeds);
  EXPECT_NEAR(nees / n, 1, 4 * std::sqrt(2 / (3 * n)));
}

TEST(Station, WhatIsNoSphereIsRefused) {
  std::vector<StationTarget> targets(1);
  targets[0].name = "ball";
  targets[0].in_scan = {12, 1, 0.5};
  targets[0].radius = 0.3;
  TargetPoints search(targets);
  search.sink()->write(sphere_points(targets[0].in_scan, 0.1, 1));
  EXPECT_THAT(refusal([&] { search.measured(); }), NamesField("ball"));
  targets[0].in_scan = {40, 1, 0.5};
  EXPECT_THAT(refusal([&] { TargetPoints(targets).measured(); }), NamesField("point"));
}

}  // namespace risley::cloud::station_test
