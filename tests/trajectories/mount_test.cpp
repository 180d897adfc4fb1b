// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/mount.hpp"

#include <cmath>
#include <cstdint>
#include <string>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

#include "refusal.hpp"

namespace risley::trajectories::mount_test {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kHexacopter = R"(risley_mount: 1
name: hexacopter
reference_point: centre of the IMU
sensor_axes: {x: down, y: left, z: forward, source: drawing}
boresight:
  x_deg: {value: 0.2, sigma: 3, source: as built}
  y_deg: {value: -0.1, sigma: 3, source: as built}
  z_deg: {value: 0.3, sigma: 3, source: as built}
lever_arm:
  x_m: {value: 0.1, sigma: 0.01, source: tape}
  y_m: {value: 0.05, sigma: 0.01, source: tape}
  z_m: {value: 0.12, sigma: 0.01, source: tape}
clock_offset_s: {value: -18, sigma: 0.002, source: GPS less UTC}
)";

TEST(Mount, ReadsWhatIsStated) {
  const Mount mount = parse_mount(kHexacopter, "mount.yaml");
  EXPECT_EQ(mount.name, "hexacopter");
  EXPECT_EQ(mount.reference_point, "centre of the IMU");
  EXPECT_EQ(mount.nominal * Vector3d(1, 0, 0), Vector3d(0, 0, 1));   // the optical axis: down
  EXPECT_EQ(mount.nominal * Vector3d(0, 1, 0), Vector3d(0, -1, 0));  // left
  EXPECT_EQ(mount.nominal * Vector3d(0, 0, 1), Vector3d(1, 0, 0));   // forward
  EXPECT_EQ(mount.nominal_source, "drawing");
  EXPECT_DOUBLE_EQ(mount.boresight[0].value, radians_from_degrees(0.2));
  EXPECT_DOUBLE_EQ(mount.boresight[2].sigma, radians_from_degrees(3));
  EXPECT_EQ(mount.lever_arm[1].value, 0.05);
  EXPECT_EQ(mount.lever_arm[2].sigma, 0.01);
  EXPECT_EQ(mount.clock_offset.value, -18);
  EXPECT_EQ(mount.clock_offset.source, "GPS less UTC");
  EXPECT_EQ(lever_arm(mount), Vector3d(0.1, 0.05, 0.12));
}

TEST(Mount, BoresightTurnsAboutTheAxesOfTheSensorBeforeTheNominalMount) {
  Mount mount = parse_mount(kHexacopter, "mount.yaml");
  const auto turned = [&](int axis) -> Matrix3d {
    for (int i = 0; i < 3; ++i) {
      mount.boresight[i].value = i == axis ? 0.01 : 0;
    }
    return body_from_sensor(mount);
  };
  // About its X axis, which looks down: the sensor yaws. Its Z axis, which looks forward, goes
  // against Y of the sensor, to the right.
  EXPECT_LT((turned(0) * Vector3d::UnitZ() - Vector3d(std::cos(0.01), std::sin(0.01), 0)).norm(),
            1e-15);
  // About its Y axis to the left: its view moves from down to backward.
  EXPECT_LT((turned(1) * Vector3d::UnitX() - Vector3d(-std::sin(0.01), 0, std::cos(0.01))).norm(),
            1e-15);
  // About its Z axis forward: its view moves to the left.
  EXPECT_LT((turned(2) * Vector3d::UnitX() - Vector3d(0, -std::sin(0.01), std::cos(0.01))).norm(),
            1e-15);
  // Small rotations: no order, and the matrix of the whole vector.
  mount.boresight[0].value = 0.02;
  mount.boresight[1].value = -0.03;
  const Vector3d vector(0.02, -0.03, 0.01);
  const Matrix3d whole =
      mount.nominal * Eigen::AngleAxisd(vector.norm(), vector.normalized()).toRotationMatrix();
  EXPECT_LT((body_from_sensor(mount) - whole).norm(), 1e-15);
}

void expect_same(const StatedValue& a, const StatedValue& b) {
  EXPECT_EQ(a.value, b.value);
  EXPECT_EQ(a.sigma, b.sigma);
  EXPECT_EQ(a.source, b.source);
}

TEST(Mount, WritesWhatItReads) {
  Mount mount = parse_mount(kHexacopter, "mount.yaml");
  mount.name = "a \"quoted\" name: #1";
  mount.boresight[1] = {0.123456789012345678, 1e-5, "estimate \\ 2"};
  mount.lever_arm[0] = {1.0 / 3, 1e-12, "tape"};
  mount.clock_offset = {-1e9 / 7, 3e-7, "log"};
  for (int i = 0; i < 2; ++i) {
    const Mount again = parse_mount(mount_text(mount), "again.yaml");
    EXPECT_EQ(again.name, mount.name);
    EXPECT_EQ(again.reference_point, mount.reference_point);
    EXPECT_EQ(again.nominal, mount.nominal);
    EXPECT_EQ(again.nominal_source, mount.nominal_source);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      expect_same(again.boresight[axis], mount.boresight[axis]);
      expect_same(again.lever_arm[axis], mount.lever_arm[axis]);
    }
    expect_same(again.clock_offset, mount.clock_offset);
    mount.nominal = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  }
  EXPECT_THAT(mount_text(parse_mount(kHexacopter, "mount.yaml")),
              HasSubstr("sensor_axes: {x: down, y: left, z: forward,"));
}

/// Calibrated in flight: three quantities of the mount with two of the sensor.
Mount calibrated_mount() {
  Mount mount = parse_mount(kHexacopter, "mount.yaml");
  mount.boresight[1].sigma = 1e-4;
  mount.lever_arm[0].sigma = 0.01;
  mount.clock_offset.sigma = 1.0 / 3e4;
  const Eigen::VectorXd sigma =
      (Eigen::VectorXd(5) << 1e-4, 0.01, 1.0 / 3e4, 2e-4, 0.003).finished();
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Constant(5, 5, 0.3);
  correlation(0, 3) = correlation(3, 0) = -0.4;
  correlation.diagonal().setOnes();
  mount.covariance = {{"boresight_y_deg", "lever_arm_x_m", "clock_offset_s",
                       "incident_beam_vertical_deg", "range_offset_m"},
                      sigma.asDiagonal() * correlation * sigma.asDiagonal()};
  // What rounding makes of the halves is none of this.
  mount.covariance.matrix =
      Eigen::MatrixXd(mount.covariance.matrix.selfadjointView<Eigen::Lower>());
  return mount;
}

TEST(Mount, WritesTheCovarianceThatItHasWithItsSensor) {
  const Mount mount = calibrated_mount();
  const Mount again = parse_mount(mount_text(mount), "again.yaml");
  EXPECT_EQ(again.covariance.names, mount.covariance.names);
  EXPECT_EQ(again.covariance.matrix, mount.covariance.matrix);
}

// With the calibration that it was found with a mount has all covariances; with another one, or of
// a sensor that has none, its own alone.
TEST(Mount, KnowsWhichCalibrationItWasFoundWith) {
  const Mount mount = calibrated_mount();
  const std::vector<std::string> of_sensor{"range_offset_m", "incident_beam_vertical_deg"};
  const algebra::NamedCovariance sensor = mount.covariance.part(of_sensor);
  ASSERT_EQ(sensor.names, of_sensor);
  EXPECT_TRUE(found_together(mount, sensor));
  const algebra::NamedCovariance joint = joint_covariance(sensor, mount);
  // Behind the sensor's the seven of the mount, all of which have a sigma.
  ASSERT_EQ(joint.names.size(), 2 + kMountQuantities);
  for (std::size_t i = 0; i < joint.names.size(); ++i) {
    for (std::size_t j = 0; j < joint.names.size(); ++j) {
      const auto own = mount.covariance.find(joint.names[i]),
                 other = mount.covariance.find(joint.names[j]);
      const double got = joint.matrix(i, j);
      if (own >= 0 && other >= 0) {
        EXPECT_EQ(got, mount.covariance.matrix(own, other)) << joint.names[i] << joint.names[j];
      } else if (i == j) {
        EXPECT_GT(got, 0);
      } else {
        EXPECT_EQ(got, 0);
      }
    }
  }
  algebra::NamedCovariance another = sensor;
  another.matrix *= 1 + 1e-6;
  EXPECT_FALSE(found_together(mount, another));
  const algebra::NamedCovariance apart = joint_covariance(another, mount);
  EXPECT_EQ(apart.matrix.topRightCorner(2, 7), (Eigen::MatrixXd::Zero(2, 7)));
  EXPECT_EQ(apart.matrix.topLeftCorner(2, 2), another.matrix);
  EXPECT_EQ(apart.matrix.bottomRightCorner(7, 7), joint.matrix.bottomRightCorner(7, 7));
  EXPECT_FALSE(found_together(mount, {}));
  EXPECT_EQ(joint_covariance({{}, Eigen::MatrixXd(0, 0)}, mount).matrix,
            joint.matrix.bottomRightCorner(7, 7));
}

TEST(Mount, RefusesACovarianceThatIsNotOfItsSigmas) {
  std::string text = mount_text(calibrated_mount());
  const std::string sigma = "sigma: 0.01, source";
  const auto at = text.find(sigma, text.find("lever_arm"));
  ASSERT_NE(at, std::string::npos);
  text.replace(at, sigma.size(), "sigma: 0.02, source");
  EXPECT_THAT(refusal<FileError>([&] { parse_mount(text, "mount.yaml"); }),
              AllOf(NamesField("lever_arm_x_m"), NamesField("0.01"), NamesField("0.02")));
}

TEST(Mount, TheTextOfAnEmptyMountIsRead) {
  const Mount again = parse_mount(mount_text({}), "again.yaml");
  EXPECT_EQ(again.nominal, Matrix3d::Identity());
  EXPECT_EQ(again.reference_point, "not stated");
}

TEST(Mount, RoundedMatricesBecomeRotations) {
  const std::string matrix =
      "body_from_sensor:\n"
      "  matrix: [[0.2588, 0, 0.9659], [0, -1, 0], [0.9659, 0, -0.2588]]\n"
      "  source: tilted bracket";
  const Mount mount = parse_mount(
      replaced(kHexacopter, "sensor_axes: {x: down, y: left, z: forward, source: drawing}", matrix),
      "mount.yaml");
  EXPECT_LT((mount.nominal.transpose() * mount.nominal - Matrix3d::Identity()).norm(), 1e-15);
  EXPECT_NEAR(mount.nominal(0, 0), std::sin(radians_from_degrees(15)), 5e-5);
}

TEST(Mount, MistakesAreNamedWithTheirLine) {
  constexpr const char* kAxes = "sensor_axes: {x: down, y: left, z: forward, source: drawing}";
  struct Mistake {
    const char *what, *by;
    int line;
    const char* message;
  };
  const Mistake mistakes[] = {
      {"risley_mount: 1", "mount: 1", 1, "is not a mount of a sensor"},
      {"risley_mount: 1", "risley_mount: 2", 1, "risley_mount = 2"},
      {"lever_arm:", "lever_arms:", 9, "did you mean lever_arm?"},
      {"x_deg:", "x_rad:", 6, "unknown field boresight.x_rad"},
      {"value: 0.1,", "", 10, "lever_arm.x_m.value is missing"},
      {"sigma: 0.002, ", "", 13, "clock_offset_s.sigma is missing"},
      {"sigma: 0.002", "sigma: -1", 13, "sigma = -1 s, allowed 0"},
      {"source: GPS less UTC", "source: \"\"", 13, "source is empty"},
      {"value: 0.2", "value: 90", 6, "x_deg.value = 90 deg, allowed -45"},
      {"value: 0.12", "value: 1200", 12, "allowed -1000 to 1000"},
      {"value: 0.12", "value: .nan", 12, "finite number"},
      {"reference_point: centre of the IMU\n", "", 1, "reference_point is missing"},
      {"x: down", "x: donw", 4, "did you mean down?"},
      {"z: forward", "z: backward", 4,
       "left-handed: where x points down and y left, z points forward"},
      {"y: left", "y: up", 4, "same line"},
      {kAxes, "", 1, "body_from_sensor may be given instead"},
      {kAxes,
       "sensor_axes: {x: down, y: left, z: forward, source: a}\n"
       "body_from_sensor: {matrix: [[1,0,0],[0,1,0],[0,0,1]], source: a}",
       5, "expected only one of them"},
      {kAxes, "body_from_sensor: {matrix: [[1,0,0],[0,1,0],[0,0,-1]], source: a}", 4,
       "mirror image"},
      {kAxes, "body_from_sensor: {matrix: [[1,0,0],[0,1,0.1],[0,0,1]], source: a}", 4,
       "is not a rotation"},
      {kAxes, "body_from_sensor: {matrix: [[1,0,0],[0,57,0],[0,0,1]], source: a}", 4,
       "matrix[1][1] = 57, allowed -1 to 1"},
      {kAxes, "body_from_sensor: {matrix: [[1,0,0],[0,1]], source: a}", 4, "3 rows of 3 numbers"},
      {kAxes, "body_from_sensor: {matrix: [[1,0],[0,1],[0,0]], source: a}", 4,
       "3 rows of 3 numbers"}};
  for (const auto& [what, by, line, message] : mistakes) {
    EXPECT_THAT(
        line_and_problem([&] { parse_mount(replaced(kHexacopter, what, by), "mount.yaml"); }),
        AllOf(StartsWith(std::to_string(line) + ": "), HasSubstr(message)));
  }
}

}  // namespace risley::trajectories::mount_test
