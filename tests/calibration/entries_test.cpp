// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <limits>
#include <vector>

#include <gmock/gmock.h>

#include "risley/calibration/calibrate.hpp"
#include "risley/calibration/calibration_plan.hpp"
#include "risley/calibration/fitted_plane.hpp"
#include "risley/calibration/plane_equations.hpp"
#include "risley/calibration/plane_segmentation.hpp"
#include "risley/calibration/rays.hpp"
#include "risley/sensors/preset.hpp"

#include "refusal.hpp"

namespace risley::calibration::entries_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

PrismTrain two_prisms() { return PrismTrain(parse_face_order("PA-AP")); }

RangedShots some_shots(std::size_t count) {
  RangedShots shots;
  shots.resize(2, count);
  for (double& range : shots.range) range = 10.0;
  return shots;
}

TEST(Entries, ShotsHaveThePrismsOfASensor) {
  RangedShots shots;
  EXPECT_EQ(refusal([&] { shots.resize(0, 4); }), "number of prisms = 0, allowed 1 to 4");
  EXPECT_EQ(refusal([&] { shots.resize(5, 4); }), "number of prisms = 5, allowed 1 to 4");
}

TEST(Entries, RowsOfShotsAreThere) {
  const RangedShots shots = some_shots(4);
  EXPECT_EQ(refusal([&] { return rows_of(shots, {0, 4, 1}); }), "row = 4, allowed 0 to 3");
  EXPECT_EQ(rows_of(shots, {}).size(), 0U);
}

TEST(Entries, RaysAskForAnglesOfEveryPrismAndShot) {
  const auto run = [](const RangedShots& shots) {
    return refusal([&] { return Rays(two_prisms(), {}, shots); });
  };
  RangedShots shots = some_shots(4);
  shots.rotation_angle.pop_back();
  EXPECT_EQ(run(shots), "rotation_angle has 1 values, expected 2");
  shots = some_shots(4);
  shots.rotation_angle[1].pop_back();
  EXPECT_EQ(run(shots), "rotation_angle of a prism has 3 values, expected 4");
  shots = some_shots(4);
  shots.beam.pop_back();
  EXPECT_EQ(run(shots), "beam has 3 values, expected 4 or none");
  shots = some_shots(4);
  shots.beam[2] = 1;
  EXPECT_EQ(run(shots), "beam = 1 in row 2, allowed 0 to 0");
  EXPECT_EQ(run(some_shots(4)), "");
  EXPECT_EQ(refusal([&] {
              return Rays(two_prisms(), {}, some_shots(4), {2, 5});
            }),
            "rows = [2, 5), allowed within [0, 4)");
}

TEST(Entries, PlaneEquationsAskForColumnsPlacesAndNumbers) {
  PlaneView sound;
  sound.train = two_prisms();
  sound.places = {0};
  sound.range_variance = 4e-4;
  sound.plane = {{1, 0, 0}, 10};
  sound.tangent_1 = {0, 1, 0};
  sound.tangent_2 = {0, 0, 1};
  const auto run = [](const RangedShots& shots, const PlaneView& view,
                      const ResidualColumns& columns = {}) {
    return refusal([&] { return plane_equations(shots, view, columns); });
  };
  const RangedShots shots = some_shots(4);
  EXPECT_EQ(run(shots, sound), "");
  RangedShots spoilt = shots;
  spoilt.angle_covariance.pop_back();
  EXPECT_EQ(run(spoilt, sound), "angle_covariance has 2 values, expected 3");
  spoilt = shots;
  spoilt.angle_covariance[1].pop_back();
  EXPECT_EQ(run(spoilt, sound), "angle_covariance of two prisms has 3 values, expected 4");
  std::vector<double> three(3);
  EXPECT_EQ(run(shots, sound, {three, {}}), "residual has 3 values, expected 4 or none");
  EXPECT_EQ(run(shots, sound, {{}, three}), "variance has 3 values, expected 4 or none");
  PlaneView view = sound;
  view.places = {-1};
  EXPECT_THAT(run(shots, view), ::testing::StartsWith("place = -1, allowed 0 to "));
  view = sound;
  view.range_variance = 0;
  EXPECT_EQ(run(shots, view), "range variance = 0 m^2, allowed above 0");
  view = sound;
  view.range_offset = kNan;
  EXPECT_EQ(run(shots, view), "range offset = nan m, allowed finite");
  view = sound;
  view.plane.distance = kNan;
  EXPECT_EQ(run(shots, view), "distance = nan m, allowed finite");
}

TEST(Entries, SegmentationAsksForOptionsThatMakeSense) {
  const std::vector<Vector3<double>> points(200, {1, 2, 3});
  const auto run = [&points](auto SegmentationOptions::*field, double value) {
    SegmentationOptions options;
    options.*field = value;
    return refusal([&] { return segment_planes(points, options); });
  };
  using Options = SegmentationOptions;
  EXPECT_EQ(run(&Options::range_noise, 0), "range noise = 0 m, allowed above 0");
  EXPECT_EQ(run(&Options::pointing_noise, -1), "pointing noise = -1 rad, allowed 0 and above");
  EXPECT_EQ(run(&Options::gate, kNan), "gate = nan, allowed above 0");
  EXPECT_EQ(run(&Options::least_fraction, 2), "least fraction = 2, allowed 0 to 1");
  EXPECT_EQ(run(&Options::least_extent, kNan), "least extent = nan rad, allowed 0 and above");
}

TEST(Entries, AFittedPlaneAsksForRowsThatAreThere) {
  const std::vector<Vector3<double>> points{{1, 0, 0}, {1, 1, 0}, {1, 0, 1}};
  const std::vector<std::size_t> use{0, 3, 1};
  EXPECT_EQ(refusal([&] { return fitted_plane(points, use); }), "row = 3, allowed 0 to 2");
}

TEST(Entries, APlanAsksForNumbersWithinTheirRanges) {
  const auto run = [](auto CalibrationPlan::*field, double value) {
    CalibrationPlan plan;
    plan.sensor = sensors::load_sensor("mid-40");
    plan.*field = value;
    return refusal([&] { return forecast(plan); });
  };
  using Plan = CalibrationPlan;
  EXPECT_EQ(run(&Plan::duration, kNan), "duration = nan s, allowed above 0");
  EXPECT_EQ(run(&Plan::rate, 0), "rate = 0 Hz, allowed above 0");
  EXPECT_EQ(run(&Plan::range_noise, -1), "range noise = -1 m, allowed above 0");
  EXPECT_EQ(run(&Plan::prior_sigma, 0), "prior sigma = 0 rad, allowed above 0");
  EXPECT_EQ(run(&Plan::range_offset_sigma, kNan),
            "sigma of the range offset = nan m, allowed 0 and above");
}

/// A recording whose columns and matrices belong together, and options for it.
struct OneRecording {
  RangedRecording recording;
  CalibrationOptions options;

  OneRecording() {
    options.sensor = sensors::load_sensor("mid-40");
    recording.believed = options.sensor;
    recording.shots = some_shots(4);
    recording.free = estimation::free_parameters({"refractive_index"}, {2});
    recording.covariance = Eigen::MatrixXd::Identity(1, 1);
    recording.angle_sensitivity = Eigen::MatrixXd::Zero(2, 1);
    recording.mean_angle_covariance = Eigen::MatrixXd::Identity(2, 2);
  }
  std::string run() const {
    return refusal([this] { return calibrate({recording}, options); });
  }
};

TEST(Entries, ACalibrationAsksForRecordingsAndStationsOfThem) {
  const OneRecording one;
  EXPECT_EQ(refusal([&] { return calibrate({}, one.options); }),
            "number of recordings = 0, allowed 1 or more");
  OneRecording two;
  two.options.stations.resize(2);
  EXPECT_EQ(two.run(), "stations has 2 values, expected 1 or none");
}

TEST(Entries, ACalibrationAsksForNumbersWithinTheirRanges) {
  OneRecording one;
  one.options.range_noise = kNan;
  EXPECT_EQ(one.run(), "range noise = nan m, allowed above 0");
  one = {};
  one.options.prior_sigma = 0;
  EXPECT_EQ(one.run(), "prior sigma = 0 rad, allowed above 0");
  one = {};
  one.options.range_offset_sigma = -1;
  EXPECT_EQ(one.run(), "sigma of the range offset = -1 m, allowed 0 and above");
  one = {};
  one.options.fixed = {{"prism_tilt_a_vertical_deg", kNan}};
  EXPECT_EQ(one.run(), "prism_tilt_a_vertical_deg = nan, allowed finite");
}

TEST(Entries, ACalibrationAsksForColumnsAndMatricesThatBelongTogether) {
  OneRecording one;
  one.recording.shots = some_shots(0);
  EXPECT_EQ(one.run(), "number of shots = 0, allowed 1 or more");
  one = {};
  one.recording.shots.rotation_angle[0].pop_back();
  EXPECT_EQ(one.run(), "rotation_angle of a prism has 3 values, expected 4");
  one = {};
  one.recording.covariance.resize(1, 2);
  EXPECT_EQ(one.run(), "columns of the covariance has 2 values, expected 1");
  one = {};
  one.recording.angle_sensitivity.resize(3, 1);
  EXPECT_EQ(one.run(), "rows of angle_sensitivity has 3 values, expected 2");
  one = {};
  one.recording.mean_angle_covariance.resize(0, 0);
  EXPECT_EQ(one.run(), "rows of mean_angle_covariance has 0 values, expected 2");
}

}  // namespace risley::calibration::entries_test
