// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Trains with several emitters: every law of one emitter holds for each of them.
#include <algorithm>
#include <cmath>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/optics/batch.hpp"
#include "risley/optics/beam_origin_map.hpp"
#include "risley/optics/inverse.hpp"
#include "risley/optics/observation_adjoint.hpp"

#include "optics/trains.hpp"
#include "parameter_name.hpp"
#include "refusal.hpp"

namespace risley::emitters_test {

using testing::imperfect_train;
using testing::train_of_emitter;

TEST(TrainShape, EveryPlaceOfEveryShapeHasOneNameOfItsOwn) {
  for (int prisms = 1; prisms <= kMaxPrisms; ++prisms) {
    for (int emitters = 1; emitters <= kMaxEmitters; ++emitters) {
      SCOPED_TRACE(::testing::Message() << prisms << " prisms, " << emitters << " emitters");
      const TrainShape shape{prisms, emitters};
      EXPECT_EQ(PrismTrain(std::vector<FaceOrder>(static_cast<std::size_t>(prisms)), emitters)
                    .parameters()
                    .size(),
                static_cast<std::size_t>(parameter_count(shape)));
      EXPECT_LE(parameter_count(shape), kMaxParameters);
      std::vector<int> names(static_cast<std::size_t>(parameter_count(shape)), 0);
      std::set<std::string> seen;
      int beams = 0;
      for (const ParameterInfo& info : parameter_list(shape)) {
        EXPECT_TRUE(seen.insert(info.name).second) << info.name;
        EXPECT_EQ(&find_parameter(info.name, shape), &info);
        if (info.kind != ParameterKind::train || info.places.size() > 1) continue;
        ++names.at(static_cast<std::size_t>(info.places.front()));
        const bool is_beam = info.name.starts_with("incident_beam");
        beams += is_beam;
        EXPECT_EQ(place::emitter(info.places.front(), prisms) >= 0, is_beam) << info.name;
      }
      EXPECT_EQ(beams, 2 * emitters);
      for (int at = 0; at < parameter_count(shape); ++at) {
        // The shared names of one prism have one place too; the last bearing is the frame.
        const bool nameless = at == place::bearing_tilt_horizontal(prisms - 1) ||
                              at == place::bearing_tilt_vertical(prisms - 1);
        if (prisms > 1 || nameless) {
          EXPECT_EQ(names[static_cast<std::size_t>(at)], nameless ? 0 : 1) << at;
        }
      }
    }
  }
}

TEST(TrainShape, EmittersAreNamedByTheirNumberFromOne) {
  const TrainShape six{3, 6};
  EXPECT_EQ(find_parameter("incident_beam_1_horizontal_deg", six).places, std::vector{1});
  EXPECT_EQ(find_parameter("incident_beam_6_vertical_deg", six).places, std::vector{30});
  EXPECT_EQ(parameter_count(six), 31);
  EXPECT_THROW(find_parameter("incident_beam_vertical_deg", six), InvalidArgument);
  EXPECT_THROW(find_parameter("incident_beam_1_vertical_deg", {3, 1}), InvalidArgument);
  for (const char* name : {"incident_beam_vertical_deg", "incident_beam_6_vertical_deg",
                           "wedge_angle_d_deg", "angular_velocity_a_deg_per_s"}) {
    const ParameterInfo* info = find_parameter_of_any_train(name);
    ASSERT_NE(info, nullptr) << name;
    EXPECT_EQ(info->name, name);
  }
  EXPECT_EQ(find_parameter_of_any_train("incident_beam_9_vertical_deg"), nullptr);
}

TEST(PrismTrain, OneThatWasNotSetIsRefusedEverywhere) {
  const PrismTrain train;
  EXPECT_EQ(train.prisms(), 0);
  EXPECT_THROW(observe(train, {}), InvalidArgument);
  EXPECT_THROW(emergent_ray(train, {}, {}), InvalidArgument);
  EXPECT_THROW(rotation_angles_for(train, {1, 0, 0}), InvalidArgument);
  EXPECT_THROW(beam_origin_map(train, {}, 10, 0.1), InvalidArgument);
  EXPECT_THROW(observe_batch(train, {}, {}), InvalidArgument);
  EXPECT_THROW(linearise_batch(train, {}, {}), InvalidArgument);
  EXPECT_THROW(train.get("refractive_index"), InvalidArgument);
}

TEST(PrismTrain, EmittersKeepTheirDirectionsWithoutErrors) {
  const PrismTrain train = imperfect_train("PA-AP-PA", 0.5, 1, 6);
  const PrismTrain ideal = train.without_errors();
  EXPECT_EQ(ideal.get("incident_beam_4_vertical_deg"), train.get("incident_beam_4_vertical_deg"));
  EXPECT_EQ(ideal.get("bearing_tilt_a_vertical_deg"), 0.0);
  EXPECT_EQ(imperfect_train("PA-AP", 0.5, 1).without_errors().get("incident_beam_vertical_deg"),
            0.0);
}

struct Emitters {
  std::string order;
  int count = 1;

  friend std::ostream& operator<<(std::ostream& out, const Emitters& one) {
    return out << one.order << " with " << one.count;
  }
};

class EveryEmitter : public ::testing::TestWithParam<Emitters> {
 protected:
  PrismTrain train_ = imperfect_train(GetParam().order, 0.5, 4, GetParam().count);
  int prisms_ = train_.prisms();
  std::mt19937 generator_{9};
};

TEST_P(EveryEmitter, SeesTheTrainWithItsOwnBeam) {
  for (int beam = 0; beam < train_.emitters(); ++beam) {
    const PrismTrain own = train_of_emitter(train_, beam);
    const auto angles = testing::random_angles(prisms_, generator_);
    const Observation found = observe(train_, angles, beam), expected = observe(own, angles);
    EXPECT_EQ(found.azimuth, expected.azimuth);
    EXPECT_EQ(found.zenith, expected.zenith);
    const PrismGeometry geometry = testing::some_geometry(train_);
    const Ray ray = emergent_ray(train_, geometry, angles, beam);
    const Ray own_ray = emergent_ray(own, geometry, angles);
    EXPECT_EQ(ray.origin.y, own_ray.origin.y);
    EXPECT_EQ(ray.direction.z, own_ray.direction.z);
  }
  EXPECT_THROW(observe(train_, testing::random_angles(prisms_, generator_), train_.emitters()),
               InvalidArgument);
  EXPECT_THROW(observe(train_, testing::random_angles(prisms_, generator_), -1), InvalidArgument);
}

TEST_P(EveryEmitter, HasDerivativesByItsOwnPlacesAlone) {
  const auto angles = testing::random_angles(prisms_, generator_);
  for (int beam = 0; beam < train_.emitters(); ++beam) {
    with_layout(train_.layout(), [&]<TrainLayout N>() {
      std::array<double, N> rotation;
      std::copy_n(angles.begin(), N, rotation.begin());
      const auto parameters = parameter_array<N>(train_, beam);
      const auto order = face_order_array<N>(train_);
      const auto shot =
          linearise_angles(prepare<double, N>(parameters, order),
                           prepare_derivatives<double, N>(parameters, order), rotation);
      for (int at = 0; at < parameter_count(train_.shape()); ++at) {
        const double step = 1e-6;
        PrismTrain up = train_, down = train_;
        up.set_place(at, train_[at] + step);
        down.set_place(at, train_[at] - step);
        const double numeric =
            (observe(up, angles, beam).zenith - observe(down, angles, beam).zenith) / (2 * step);
        EXPECT_NEAR(derivative_by(shot.zenith, at, beam), numeric, 1e-8) << at;
        if (place::emitter(at, N) == beam) {
          EXPECT_GT(std::abs(derivative_by(shot.zenith, at, beam)) +
                        std::abs(derivative_by(shot.azimuth, at, beam)),
                    1e-3);
        }
      }
    });
  }
}

TEST_P(EveryEmitter, IsItselfInBatchesOfEveryInstructionSet) {
  constexpr std::size_t kShots = 83;  // no multiple of any lane count
  std::vector<std::vector<double>> columns(static_cast<std::size_t>(prisms_));
  for (auto& column : columns) {
    for (std::size_t i = 0; i < kShots; ++i) {
      column.push_back(testing::random_angles(1, generator_)[0]);
    }
  }
  std::vector<std::uint8_t> beam;
  std::uniform_int_distribution<int> any(0, train_.emitters() - 1);
  for (std::size_t i = 0; i < kShots; ++i) {
    beam.push_back(static_cast<std::uint8_t>(any(generator_)));
  }
  const std::vector<std::span<const double>> angles(columns.begin(), columns.end());
  const auto places = static_cast<std::size_t>(parameter_count(train_.shape()));
  const auto rotors = static_cast<std::size_t>(prisms_);
  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    std::vector<double> azimuth(kShots), zenith(kShots), x(kShots), y(kShots), z(kShots);
    DirectionColumns directions;
    directions.azimuth = azimuth;
    directions.origin_x = x;
    directions.origin_y = y;
    directions.origin_z = z;
    directions.geometry = testing::some_geometry(train_);
    EXPECT_EQ(observe_batch(train_, angles, directions, beam, set), 0u);
    std::vector<std::vector<double>> d_azimuth(places + rotors, std::vector<double>(kShots, 7.0));
    auto d_zenith = d_azimuth;
    LinearisationColumns out{
        azimuth, zenith, {d_azimuth.begin(), d_azimuth.end()}, {d_zenith.begin(), d_zenith.end()}};
    EXPECT_EQ(linearise_batch(train_, angles, out, beam, set), 0u);
    for (std::size_t i = 0; i < kShots; ++i) {
      const PrismTrain own = train_of_emitter(train_, beam[i]);
      std::vector<double> shot_angles;
      for (const auto& column : columns) shot_angles.push_back(column[i]);
      const Observation shot = observe(own, shot_angles);
      EXPECT_NEAR(azimuth[i], shot.azimuth, 4e-15);
      EXPECT_NEAR(zenith[i], shot.zenith, 4e-15);
      const Ray ray = emergent_ray(own, directions.geometry, shot_angles);
      EXPECT_NEAR(y[i], ray.origin.y, 1e-15);
      EXPECT_NEAR(z[i], ray.origin.z, 1e-15);
      with_layout(train_.layout(), [&]<TrainLayout N>() {
        std::array<double, N> rotation;
        std::copy_n(shot_angles.begin(), N, rotation.begin());
        const auto order = face_order_array<N>(own);
        const auto expected = linearise_angles(
            prepare<double, N>(parameter_array<N>(own), order),
            prepare_derivatives<double, N>(parameter_array<N>(own), order), rotation);
        for (std::size_t at = 0; at < places; ++at) {
          const int mine = testing::place_of_emitter(static_cast<int>(at), beam[i], N);
          const auto value = [&](const Gradient<double, N>& gradient) {
            return mine < 0 ? 0.0 : gradient.parameters[static_cast<std::size_t>(mine)];
          };
          EXPECT_NEAR(d_azimuth[at][i], value(expected.azimuth), 1e-12) << at;
          EXPECT_NEAR(d_zenith[at][i], value(expected.zenith), 1e-12) << at;
          if (mine < 0) {
            EXPECT_EQ(d_zenith[at][i], 0.0);
          }
        }
        for (std::size_t k = 0; k < rotors; ++k) {
          EXPECT_NEAR(d_zenith[places + k][i], expected.zenith.rotation_angles[k], 1e-12);
        }
      });
    }
    // Without a column all shots are the first emitter's.
    std::vector<double> first(kShots), stated(kShots);
    DirectionColumns one, other;
    one.zenith = first;
    other.zenith = stated;
    observe_batch(train_, angles, one, {}, set);
    observe_batch(train_, angles, other, std::vector<std::uint8_t>(kShots, 0), set);
    EXPECT_EQ(first, stated);
  }
}

TEST_P(EveryEmitter, IsInvertedWithItsOwnBeam) {
  if (prisms_ < 2) return;
  for (int beam = 0; beam < train_.emitters(); ++beam) {
    const auto angles = testing::random_angles(prisms_, generator_);
    const Observation shot = observe(train_, angles, beam);
    const std::span<const double> fixed(angles.data(), angles.size() - 2);
    const InverseSolution solution = rotation_angles_for(train_, shot.direction, fixed, beam);
    double nearest = HUGE_VAL;
    for (const RotationPair& pair : solution.pairs) {
      auto again = angles;
      again[again.size() - 2] = pair.first;
      again.back() = pair.second;
      EXPECT_LT(norm(observe(train_, again, beam).direction - shot.direction), 1e-9);
      nearest = std::min(nearest, std::abs(wrap_to_pi(pair.second - angles.back())) +
                                      std::abs(wrap_to_pi(pair.first - angles[again.size() - 2])));
    }
    EXPECT_LT(nearest, 1e-6);
  }
  EXPECT_THROW(rotation_angles_for(train_, {1, 0, 0},
                                   std::vector<double>(static_cast<std::size_t>(prisms_ - 2)),
                                   train_.emitters()),
               InvalidArgument);
}

std::vector<Emitters> every_kind() {
  std::vector<Emitters> kinds;
  for (const std::string& order : testing::all_face_orders()) kinds.push_back({order, 6});
  for (const int count : {1, 2, kMaxEmitters}) {
    for (const char* order : {"PA", "PA-AP", "AP-PA-AP", "PA-AP-AP-PA"}) {
      kinds.push_back({order, count});
    }
  }
  return kinds;
}

INSTANTIATE_TEST_SUITE_P(Trains, EveryEmitter, ::testing::ValuesIn(every_kind()),
                         [](const auto& one) {
                           return parameter_name(one.param.order + std::to_string(one.param.count));
                         });

TEST(Beams, EveryValueInEveryRowIsChecked) {
  for (const int emitters : {1, 2, 3, kMaxEmitters}) {
    const PrismTrain train = imperfect_train("PA-AP", 0.5, 1, emitters);
    for (std::size_t row = 0; row < 21; ++row) {
      for (int value = 0; value < 256; ++value) {
        std::vector<std::uint8_t> beam(21, static_cast<std::uint8_t>(emitters - 1));
        beam[row] = static_cast<std::uint8_t>(value);
        if (value < emitters) {
          EXPECT_NO_THROW(check_beams(train, beam, beam.size()));
        } else {
          EXPECT_THROW(check_beams(train, beam, beam.size()), InvalidArgument);
        }
      }
    }
  }
}

TEST(InstructionSets, AnUnavailableOneIsRefusedEveryTime) {
  const std::vector<double> column(3, 0.1);
  const std::vector<std::span<const double>> angles{column};
  std::vector<double> zenith(3);
  DirectionColumns out;
  out.zenith = zenith;
  const PrismTrain train = imperfect_train("PA", 0.5, 1);
  for (int attempt = 0; attempt < 2; ++attempt) {
    EXPECT_THROW(observe_batch(train, angles, out, {}, static_cast<InstructionSet>(3)),
                 InvalidArgument);
    for (const InstructionSet set :
         {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
      const auto& sets = available_instruction_sets();
      if (std::find(sets.begin(), sets.end(), set) != sets.end()) continue;
      EXPECT_THROW(observe_batch(train, angles, out, {}, set), InvalidArgument);
    }
  }
}

TEST(PrismGeometry, SizesMayBePerPrism) {
  const auto order = parse_face_order("AP-PA-AP");
  const auto same = face_positions(order, {{0.007}, {0.03}});
  EXPECT_EQ(face_positions(order, {{0.007, 0.007, 0.007}, {0.03, 0.03}}), same);
  const auto own = face_positions(order, {{0.001, 0.002, 0.003}, {0.01, 0.02}});
  const std::vector<double> expected{-0.031, -0.03, -0.02, -0.018, -0.003, 0.0};
  ASSERT_EQ(own.size(), expected.size());
  for (std::size_t i = 0; i < own.size(); ++i) EXPECT_NEAR(own[i], expected[i], 1e-15) << i;
  EXPECT_EQ(face_positions(order, {}), std::vector<double>(6, 0.0));
  EXPECT_THAT(refusal([&] { face_positions(order, {{1.0, 2.0}, {}}); }), NamesField("thickness"));
  // Positions are linear in the named sizes, and the shared ones move all of a kind.
  std::vector<double> sum(6, 0.0);
  const std::vector<double> values{0.001, 0.002, 0.003, 0.01, 0.02};
  const auto sizes = own_prism_sizes(3);
  ASSERT_EQ(sizes.size(), values.size());
  EXPECT_EQ(sizes[4].name, "prism_spacing_b_m");
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const auto rate = face_positions(order, sizes[k].rate);
    for (std::size_t i = 0; i < 6; ++i) sum[i] += values[k] * rate[i];
  }
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(sum[i], own[i], 1e-15);
}

}  // namespace risley::emitters_test
