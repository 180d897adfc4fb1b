// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <limits>
#include <vector>

#include <gmock/gmock.h>

#include "risley/cloud/cloud_writer.hpp"
#include "risley/cloud/pointing.hpp"
#include "risley/cloud/rotor_tracking.hpp"
#include "risley/cloud/surface_normals.hpp"
#include "risley/sensors/preset.hpp"

#include "cloud/cloud_samples.hpp"
#include "refusal.hpp"

namespace risley::cloud::entries_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

SensorBelief some_belief() {
  SensorBelief belief;
  belief.sensor = sensors::load_sensor("mid-40");
  belief.free = estimation::free_parameters({"refractive_index"}, {2});
  belief.covariance = 1e-10 * Eigen::MatrixXd::Identity(1, 1);
  belief.angle_sensitivity = Eigen::MatrixXd::Zero(2, 1);
  belief.rotor_process.assign(2, {});
  belief.angle_noise = 1e-4;
  return belief;
}

TEST(Entries, HeadersAndShotsHaveThePrismsOfASensor) {
  CloudHeader header;
  header.prisms = -1;
  Points points;
  EXPECT_EQ(refusal([&] { header.resize(points, 4); }), "number of prisms = -1, allowed 1 to 4");
  EXPECT_EQ(refusal([&] { return create_cloud("cloud.csv", header); }),
            "number of prisms = -1, allowed 1 to 4");
  PointedShots shots;
  EXPECT_EQ(refusal([&] { shots.resize(5, 4); }), "number of prisms = 5, allowed 1 to 4");
}

TEST(Entries, EveryFormatAsksForTheColumnsOfItsHeader) {
  const TestFolder folder;
  CloudHeader header;
  header.factors = {"range_offset_m"};
  for (const char* name : {"cloud.las", "cloud.ply", "cloud.csv", "cloud.npy", "cloud.nc",
                           "cloud.bag", "cloud.mcap"}) {
    const auto writer = create_cloud(folder.file(name), header);
    const auto run = [&](const auto& spoil) {
      Points points = make_points({"", 3, header});
      points.return_number.assign(3, 1);
      points.number_of_returns.assign(3, 1);
      spoil(points);
      return refusal([&] { writer->write(points); });
    };
    EXPECT_EQ(run([](Points& p) { p.x.pop_back(); }), "x_m has 2 values, expected 3") << name;
    EXPECT_EQ(run([](Points& p) { p.tag.pop_back(); }), "tag has 2 values, expected 3");
    EXPECT_EQ(run([](Points& p) { p.covariance[4].clear(); }),
              "covariance has 0 values, expected 3");
    EXPECT_EQ(run([](Points& p) { p.rotation_angle.pop_back(); }),
              "rotation_angle has 1 values, expected 2");
    EXPECT_EQ(run([](Points& p) { p.loading.clear(); }), "loading has 0 values, expected 1");
    EXPECT_EQ(run([](Points& p) { p.loading[0][2].pop_back(); }),
              "loading has 2 values, expected 3");
    EXPECT_EQ(run([](Points&) {}), "") << name;
  }
}

TEST(Entries, LasAsksForAScale) {
  EXPECT_EQ(refusal([] {
              return create_cloud("cloud.las", {}, {"", kNan, true});
            }),
            "las_scale = nan m, allowed above 0");
}

TEST(Entries, AModelAsksForABeliefThatBelongsTogether) {
  const auto run = [](const auto& spoil) {
    SensorBelief belief = some_belief();
    const sensors::Sensor calibration = belief.sensor;
    spoil(belief);
    return refusal([&] { return pointing_model(calibration, belief, {}); });
  };
  EXPECT_EQ(run([](SensorBelief&) {}), "");
  EXPECT_EQ(run([](SensorBelief& b) { b.covariance.resize(2, 1); }),
            "rows of the belief's covariance has 2 values, expected 1");
  EXPECT_EQ(run([](SensorBelief& b) { b.angle_sensitivity.resize(3, 1); }),
            "rows of angle_sensitivity has 3 values, expected 2");
  EXPECT_EQ(run([](SensorBelief& b) { b.angle_noise = kNan; }),
            "angle noise = nan rad, allowed 0 and above");
  EXPECT_EQ(refusal([] {
              PointingOptions options;
              options.reported_directions = true;
              options.beam_origin = false;
              return reported_pointing_model(sensors::load_sensor("mid-40"), options, -1.0);
            }),
            "angle noise = -1 rad, allowed 0 and above");
}

/// A model with the header, shots and points that belong to it.
struct Pointed {
  PointingModel model;
  CloudHeader header;
  PointedShots shots;
  Points points;

  Pointed() {
    const SensorBelief belief = some_belief();
    model = pointing_model(belief.sensor, belief, {});
    shots.resize(2, 3);
    for (double& range : shots.range) range = 10.0;
    header.resize(points, 3);
  }
  std::string run(InstructionSet set = best_instruction_set()) {
    return refusal([&] { compute_points(model, header, shots, points, {}, set); });
  }
};

TEST(Entries, PointsAskForColumnsOfAllShots) {
  EXPECT_EQ(Pointed().run(), "");
  Pointed one;
  one.shots.rotation_angle.pop_back();
  EXPECT_EQ(one.run(), "rotation_angle has 1 values, expected 2");
  one = {};
  one.shots.angle_covariance[2].pop_back();
  EXPECT_EQ(one.run(), "angle_covariance of two prisms has 2 values, expected 3");
  one = {};
  one.shots.zenith.pop_back();
  EXPECT_EQ(one.run(), "zenith has 2 values, expected 3");
  one = {};
  one.shots.surface_normal[1].clear();
  EXPECT_EQ(one.run(), "surface_normal has 0 values, expected 3");
  one = {};
  one.shots.beam[1] = 1;
  EXPECT_EQ(one.run(), "beam = 1 in row 1, allowed 0 to 0");
  one = {};
  one.points.incidence.pop_back();
  EXPECT_EQ(one.run(), "incidence_angle_deg has 2 values, expected 3");
}

TEST(Entries, PointsAskForAHeaderAndAModelThatFit) {
  Pointed one;
  one.header.prisms = 3;
  EXPECT_EQ(one.run(), "number of prisms of the cloud = 3, allowed 2 to 2");
  one = {};
  ASSERT_GT(one.model.factors.size(), 1U);
  one.header.factors.assign(one.model.factors.size() - 1, "factor");
  EXPECT_THAT(one.run(), ::testing::StartsWith("factors of the cloud has "));
  one = {};
  one.header.has_rotation_angles = false;
  EXPECT_EQ(one.run(), "the cloud has no rotation angles, which the model needs");
  one = {};
  one.model.range_offset = kNan;
  EXPECT_EQ(one.run(), "range offset = nan m, allowed finite");
  one = {};
  one.model.angle_noise = -1;
  EXPECT_EQ(one.run(), "angle noise = -1 rad, allowed 0 and above");
  one = {};
  one.model.factors.push_back({"empty", {}, 0});
  EXPECT_THAT(one.run(), ::testing::StartsWith("weights of a factor has 0 values, expected "));
}

TEST(Entries, TrackingAsksForARateProcessesAndColumns) {
  const SensorBelief belief = some_belief();
  for (const double rate : {0.0, kNan}) {
    EXPECT_THAT(refusal([&] { return RotorTracker(belief, rate); }),
                ::testing::AllOf(::testing::StartsWith("rate = "),
                                 ::testing::EndsWith(" Hz, allowed above 0")));
  }
  SensorBelief spoilt = belief;
  spoilt.rotor_process.pop_back();
  EXPECT_EQ(refusal([&] { return RotorTracker(spoilt, {}); }),
            "rotor_process has 1 values, expected 2");
  spoilt = belief;
  spoilt.angle_noise = 0;
  EXPECT_EQ(refusal([&] { return RotorTracker(spoilt, {}); }),
            "angle noise = 0 rad, allowed above 0");

  const RotorTracker tracker(belief, {});
  recordings::Observations piece;
  piece.time_ns.resize(2);
  const auto run = [&](const std::vector<std::size_t>& rows, std::size_t prisms,
                       std::size_t length) {
    std::vector<std::vector<double>> angle(prisms, std::vector<double>(length)),
        covariance(3, std::vector<double>(length));
    return refusal([&] { tracker.angles(piece, rows, angle, covariance); });
  };
  EXPECT_EQ(run({0, 2}, 2, 2), "row = 2, allowed 0 to 1");
  EXPECT_EQ(run({0, 1}, 1, 2), "angle has 1 values, expected 2");
  EXPECT_EQ(run({0, 1}, 2, 1), "angle of a prism has 1 values, expected 2");
}

TEST(Entries, ABeliefAsksForNoise) {
  EXPECT_EQ(refusal([] { return sensor_belief({}, {}, sensors::load_sensor("mid-40"), 0.0); }),
            "angle noise = 0 rad, allowed above 0");
}

TEST(Entries, SurfacesAskForNoise) {
  EXPECT_EQ(refusal([] { return SurfaceNormals(kNan); }), "range noise = nan m, allowed above 0");
}

}  // namespace risley::cloud::entries_test
