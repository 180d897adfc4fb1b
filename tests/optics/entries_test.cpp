// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <array>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <span>
#include <vector>

#include <gmock/gmock.h>

#include "risley/optics/batch.hpp"
#include "risley/optics/beam_origin_map.hpp"
#include "risley/optics/inverse.hpp"
#include "risley/optics/observation_model.hpp"

#include "refusal.hpp"

namespace risley::entries_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// Stands for one that this processor does not run.
constexpr auto kUnknownSet = static_cast<InstructionSet>(3);

PrismTrain two_prisms(int emitters = 1) { return PrismTrain(parse_face_order("PA-AP"), emitters); }

TEST(Entries, TrainsAskForPrismsAndEmitters) {
  EXPECT_EQ(refusal([] { PrismTrain(std::vector<FaceOrder>{}); }),
            "number of prisms = 0, allowed 1 to 4");
  EXPECT_EQ(refusal([] { PrismTrain(std::vector<FaceOrder>(5)); }),
            "number of prisms = 5, allowed 1 to 4");
  EXPECT_EQ(refusal([] { two_prisms(9); }), "number of emitters = 9, allowed 1 to 8");
  EXPECT_EQ(refusal([] { check_shape({-1, 1}); }), "number of prisms = -1, allowed 1 to 4");
  EXPECT_EQ(refusal([] { parameter_list({2, 0}); }), "number of emitters = 0, allowed 1 to 8");
  EXPECT_EQ(refusal([] { own_prism_sizes(5); }), "number of prisms = 5, allowed 1 to 4");
  EXPECT_EQ(refusal([] { PrismTrain().without_errors(); }), "number of prisms = 0, allowed 1 to 4");
}

TEST(Entries, TrainsAskForPlacesOfTheirFlatVector) {
  PrismTrain train = two_prisms();
  EXPECT_EQ(refusal([&] { return train[-1]; }), "place = -1, allowed 0 to 14");
  EXPECT_EQ(refusal([&] { return train[15]; }), "place = 15, allowed 0 to 14");
  EXPECT_EQ(refusal([&] { train.set_place(15, 0.0); }), "place = 15, allowed 0 to 14");
  EXPECT_EQ(refusal([&] { train.set_place(14, 0.1); }), "");
  EXPECT_EQ(train[14], 0.1);
  EXPECT_EQ(refusal([] { return PrismTrain()[0]; }), "number of prisms = 0, allowed 1 to 4");
}

TEST(Entries, OneShotAsksForOneAnglePerPrismAndAnEmitter) {
  const PrismTrain train = two_prisms(3);
  const std::array angles{0.1, 0.2, 0.3};
  const auto two = std::span(angles).first(2);
  EXPECT_EQ(refusal([&] { return observe(train, angles); }),
            "rotation_angles has 3 values, expected 2");
  EXPECT_EQ(refusal([&] { return observe(train, two, 3); }), "beam = 3, allowed 0 to 2");
  EXPECT_EQ(refusal([&] { return emergent_ray(train, {}, angles); }),
            "rotation_angles has 3 values, expected 2");
  EXPECT_EQ(refusal([&] { return emergent_ray(train, {}, two, -1); }), "beam = -1, allowed 0 to 2");
}

TEST(Entries, FacePositionsAskForPrismsAndSizes) {
  const auto order = parse_face_order("PA-AP");
  EXPECT_EQ(refusal([] { return face_positions({}, {}); }), "number of prisms = 0, allowed 1 to 4");
  EXPECT_EQ(refusal([&] {
              return face_positions(order, {{0.01, kNan}, {}});
            }),
            "thickness = nan m, allowed finite");
  EXPECT_EQ(refusal([&] {
              return face_positions(order, {{}, {kInfinite}});
            }),
            "spacing = inf m, allowed finite");
  EXPECT_EQ(refusal([&] {
              return face_positions(order, {{}, {0.01, 0.01}});
            }),
            "spacing has 2 values, allowed none, 1 or 1");
}

TEST(Entries, InverseAsksForFixedAnglesAndAUnitVector) {
  const PrismTrain three(parse_face_order("PA-AP-PA"));
  const std::array<double, 1> not_a_number{kNan};
  const std::array two{0.1, 0.2};
  EXPECT_EQ(refusal([&] {
              return rotation_angles_for(three, {1, 0, 0}, two);
            }),
            "fixed_angles has 2 values, expected 1");
  EXPECT_EQ(refusal([&] {
              return rotation_angles_for(three, {1, 0, 0}, not_a_number);
            }),
            "fixed_angles = nan rad, allowed finite");
  EXPECT_EQ(refusal([] {
              return rotation_angles_for(two_prisms(), {0, 0, 0});
            }),
            "direction has length 0, expected a unit vector");
  EXPECT_EQ(refusal([] {
              return rotation_angles_for(two_prisms(), {kNan, 0, 0});
            }),
            "direction has length nan, expected a unit vector");
}

TEST(Entries, BeamOriginMapAsksForStepsAndACell) {
  const auto run = [](std::size_t steps, double cell) {
    return refusal([&] { return beam_origin_map(two_prisms(), {}, steps, cell); });
  };
  EXPECT_EQ(run(1, 0.1), "steps = 1, allowed 2 or more");
  EXPECT_EQ(run(2, 0.0), "cell = 0 deg, allowed above 0");
  EXPECT_EQ(run(2, kNan), "cell = nan deg, allowed above 0");
  EXPECT_EQ(run(2, kInfinite), "cell = inf deg, allowed above 0");
  EXPECT_EQ(run(2, 0.1), "");
}

/// Three shots of two prisms.
struct Shots {
  std::vector<double> first = std::vector<double>(3, 0.1), second = first;
  std::vector<double> three = std::vector<double>(3), four = std::vector<double>(4);
  PrismTrain train = two_prisms(2);

  std::vector<std::span<const double>> angles() const { return {first, second}; }
  /// Columns of derivatives that fit.
  std::vector<std::span<double>> gradient() {
    return std::vector<std::span<double>>(
        static_cast<std::size_t>(parameter_count(train.shape()) + train.prisms()), three);
  }
};

/// Some columns of directions, all in one place.
DirectionColumns columns(std::initializer_list<std::span<double> DirectionColumns::*> fields,
                         std::span<double> values) {
  DirectionColumns out;
  for (const auto field : fields) out.*field = values;
  return out;
}

TEST(Entries, BatchesAskForColumnsOfOneLength) {
  using Out = DirectionColumns;
  Shots shots;
  const auto run = [&](const DirectionColumns& out, const std::vector<std::uint8_t>& beam = {}) {
    return refusal([&] { observe_batch(shots.train, shots.angles(), out, beam); });
  };
  EXPECT_EQ(run(columns({&Out::x}, shots.four)), "x has 4 values, expected 3");
  EXPECT_EQ(run(columns({&Out::zenith}, shots.four)), "zenith has 4 values, expected 3");
  EXPECT_EQ(run(columns({&Out::origin_x, &Out::origin_y}, shots.three)),
            "origin_z has 0 values, expected 3");
  EXPECT_EQ(run(columns({&Out::origin_z}, shots.three)), "origin_x has 0 values, expected 3");
  EXPECT_EQ(run({}, {0, 1}), "beam has 2 values, expected 3");
  EXPECT_EQ(run({}, {0, 1, 2}), "beam = 2 in row 2, allowed 0 to 1");
  EXPECT_EQ(run(columns({&Out::azimuth}, shots.three), {0, 1, 1}), "");
  shots.second.pop_back();
  EXPECT_EQ(run({}), "a column of rotation_angles has 2 values, expected 3");
  shots.train = PrismTrain(parse_face_order("PA"));
  EXPECT_EQ(run({}), "rotation_angles has 2 values, expected 1");
}

TEST(Entries, LinearisedBatchesAskForThePlaceOfEveryColumn) {
  Shots shots;
  const auto run = [&](const LinearisationColumns& out) {
    return refusal([&] { linearise_batch(shots.train, shots.angles(), out); });
  };
  LinearisationColumns out{shots.three, shots.three, shots.gradient(), shots.gradient()};
  EXPECT_EQ(run(out), "");
  out.d_azimuth.front() = {};
  out.d_zenith.front() = {};
  EXPECT_EQ(run(out), "");
  out.d_zenith.back() = shots.four;
  EXPECT_EQ(run(out), "a column of d_zenith has 4 values, expected 3");
  out.d_azimuth.pop_back();
  EXPECT_EQ(run(out), "d_azimuth has 18 values, expected 19");
  out.azimuth = {};
  EXPECT_EQ(run(out), "azimuth has 0 values, expected 3");
}

}  // namespace risley::entries_test
