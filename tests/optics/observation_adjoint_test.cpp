// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/observation_adjoint.hpp"

#include <cmath>

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "risley/core/simd.hpp"
#include "risley/optics/batch.hpp"

#include "optics/trains.hpp"
#include "parameter_name.hpp"

namespace risley::observation_adjoint_test {

template <TrainLayout N>
constexpr int kColumns = parameter_count(N) + N;

/// Derivatives of the forward model by forward-mode automatic differentiation: the oracle.
template <TrainLayout N, class Inner = double>
struct Oracle {
  using Jet = ceres::Jet<double, kColumns<N>>;
  SphericalAngles<Jet> angles;
  Vector3<Jet> direction;

  Oracle(const PrismTrain& train, const std::vector<double>& rotation_angles) {
    std::array<Jet, parameter_count(N)> parameters;
    for (int i = 0; i < parameter_count(N); ++i) {
      parameters[static_cast<std::size_t>(i)] = Jet(train[i], i);
    }
    std::array<Jet, N> rotation;
    for (int i = 0; i < N; ++i) {
      rotation[static_cast<std::size_t>(i)] =
          Jet(rotation_angles[static_cast<std::size_t>(i)], parameter_count(N) + i);
    }
    direction = trace(prepare<Jet, N>(parameters, face_order_array<N>(train)), rotation).direction;
    angles = angles_from_direction(direction);
  }
};

/// Largest difference of a gradient to the oracle's, relative to the oracle's largest entry.
template <TrainLayout N, class Get>
double difference(const ceres::Jet<double, kColumns<N>>& oracle, const Get& entry) {
  double worst = 0;
  const double scale = oracle.v.template lpNorm<Eigen::Infinity>();
  for (int i = 0; i < kColumns<N>; ++i) worst = std::max(worst, std::abs(entry(i) - oracle.v[i]));
  return worst / scale;
}

template <class T, TrainLayout N, class Lane>
auto entry_of(const Gradient<T, N>& gradient, const Lane& lane) {
  return [&gradient, lane](int i) {
    return lane(i < parameter_count(N)
                    ? gradient.parameters[static_cast<std::size_t>(i)]
                    : gradient.rotation_angles[static_cast<std::size_t>(i - parameter_count(N))]);
  };
}

/// Worst relative difference of all five gradients, with the adjoint evaluated in T.
template <class T, TrainLayout N, class Lane>
double adjoint_error(const PrismTrain& train, const std::vector<double>& angles, const Lane& lane) {
  std::array<T, parameter_count(N)> parameters;
  for (int i = 0; i < parameter_count(N); ++i) {
    parameters[static_cast<std::size_t>(i)] = T(train[i]);
  }
  std::array<T, N> rotation;
  for (std::size_t i = 0; i < N; ++i) rotation[i] = T(angles[i]);
  const auto order = face_order_array<N>(train);
  const auto prepared = prepare<T, N>(parameters, order);
  const auto derivatives = prepare_derivatives<T, N>(parameters, order);
  const auto by_angles = linearise_angles(prepared, derivatives, rotation);
  const auto by_direction = linearise_direction(prepared, derivatives, rotation);

  const Oracle<N> oracle(train, angles);
  double worst = difference<N>(oracle.angles.azimuth, entry_of(by_angles.azimuth, lane));
  worst = std::max(worst, difference<N>(oracle.angles.zenith, entry_of(by_angles.zenith, lane)));
  worst = std::max(worst,
                   difference<N>(oracle.direction.x, entry_of(by_direction.components[0], lane)));
  worst = std::max(worst,
                   difference<N>(oracle.direction.y, entry_of(by_direction.components[1], lane)));
  worst = std::max(worst,
                   difference<N>(oracle.direction.z, entry_of(by_direction.components[2], lane)));
  // The value itself.
  worst = std::max(worst, std::abs(lane(by_angles.angles.azimuth) - oracle.angles.azimuth.a));
  worst = std::max(worst, std::abs(lane(by_angles.angles.zenith) - oracle.angles.zenith.a));
  return worst;
}

template <TrainLayout N>
void check_all_scalars(const std::string& face_order) {
  using Jet = ceres::Jet<double, 2>;
  using Batch = xsimd::batch<double>;
  std::mt19937 generator(5);
  for (unsigned seed = 0; seed < 20; ++seed) {
    const PrismTrain train = testing::imperfect_train(face_order, 0.5, seed);
    for (int i = 0; i < 20; ++i) {
      const auto angles = testing::random_angles(N, generator);
      EXPECT_LT((adjoint_error<double, N>(train, angles, [](double v) { return v; })), 1e-12);
      EXPECT_LT((adjoint_error<Jet, N>(train, angles, [](const Jet& v) { return v.a; })), 1e-12);
      EXPECT_LT((adjoint_error<Batch, N>(train, angles,
                                         [](const Batch& v) {
                                           double lanes[Batch::size];
                                           v.store_unaligned(lanes);
                                           return lanes[Batch::size - 1];
                                         })),
                1e-12);
    }
  }
}

class AdjointOfEveryTrain : public ::testing::TestWithParam<std::string> {};

TEST_P(AdjointOfEveryTrain, EqualsAutomaticDifferentiationInEveryScalar) {
  with_layout(layout_of(parse_face_order(GetParam())),
              [&]<TrainLayout N>() { check_all_scalars<N>(GetParam()); });
}

TEST_P(AdjointOfEveryTrain, EqualsCentralDifferences) {
  PrismTrain train = testing::imperfect_train(GetParam(), 0.5, 1);
  std::mt19937 generator(6);
  const auto angles = testing::random_angles(train.prisms(), generator);
  with_layout(train.layout(), [&]<TrainLayout N>() {
    std::array<double, N> rotation;
    std::copy_n(angles.begin(), N, rotation.begin());
    const auto order = face_order_array<N>(train);
    const auto parameters = parameter_array<N>(train);
    const auto result =
        linearise_angles(prepare<double, N>(parameters, order),
                         prepare_derivatives<double, N>(parameters, order), rotation);
    for (int i = 0; i < parameter_count(N); ++i) {
      const int prism = (i - place::refractive_index(0)) / 6;
      if (i >= place::bearing_tilt_horizontal(prism) &&
          !N.has_bearing(static_cast<std::size_t>(prism))) {
        EXPECT_EQ(result.zenith.parameters[static_cast<std::size_t>(i)], 0.0);
        continue;
      }
      const double step = 1e-6;
      PrismTrain up = train, down = train;
      up.set_place(i, train[i] + step);
      down.set_place(i, train[i] - step);
      const double numeric =
          (observe(up, angles).zenith - observe(down, angles).zenith) / (2 * step);
      EXPECT_NEAR(result.zenith.parameters[static_cast<std::size_t>(i)], numeric, 1e-8) << i;
    }
  });
}

TEST_P(AdjointOfEveryTrain, BatchesOfEveryInstructionSetEqualTheScalarModel) {
  const PrismTrain train = testing::imperfect_train(GetParam(), 0.5, 2);
  const int prisms = train.prisms();
  const double direction_error = train.layout().reflects() ? 4e-15 : 2e-15;  // one surface more
  constexpr std::size_t kShots = 165;  // some blocks of groups, and no multiple of any lane count
  std::mt19937 generator(8);
  std::vector<std::vector<double>> columns(static_cast<std::size_t>(prisms),
                                           std::vector<double>(kShots));
  for (auto& column : columns) {
    for (double& angle : column) angle = testing::random_angles(1, generator)[0];
  }
  const std::vector<std::span<const double>> angles(columns.begin(), columns.end());
  const auto gradient_columns = static_cast<std::size_t>(parameter_count(prisms) + prisms);
  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    std::vector<double> x(kShots), y(kShots), z(kShots), azimuth(kShots), zenith(kShots);
    EXPECT_EQ(observe_batch(train, angles, {x, y, z, azimuth, zenith}, {}, set), 0u);
    std::vector<std::vector<double>> d_azimuth(gradient_columns, std::vector<double>(kShots));
    auto d_zenith = d_azimuth;
    std::vector<double> azimuth2(kShots), zenith2(kShots);
    LinearisationColumns out{azimuth2,
                             zenith2,
                             {d_azimuth.begin(), d_azimuth.end()},
                             {d_zenith.begin(), d_zenith.end()}};
    EXPECT_EQ(linearise_batch(train, angles, out, {}, set), 0u);
    for (std::size_t i = 0; i < kShots; ++i) {
      std::vector<double> shot_angles;
      for (const auto& column : columns) shot_angles.push_back(column[i]);
      const Observation shot = observe(train, shot_angles);
      EXPECT_NEAR(x[i], shot.direction.x, direction_error);
      EXPECT_NEAR(y[i], shot.direction.y, direction_error);
      EXPECT_NEAR(z[i], shot.direction.z, direction_error);
      EXPECT_NEAR(azimuth[i], shot.azimuth, 2e-15);
      EXPECT_NEAR(zenith[i], shot.zenith, 2e-15);
      EXPECT_NEAR(azimuth2[i], shot.azimuth, 2e-15);
      EXPECT_NEAR(zenith2[i], shot.zenith, 2e-15);
      with_layout(train.layout(), [&]<TrainLayout N>() {
        const Oracle<N> oracle(train, shot_angles);
        EXPECT_LT(difference<N>(oracle.angles.azimuth,
                                [&](int c) { return d_azimuth[static_cast<std::size_t>(c)][i]; }),
                  1e-12);
        EXPECT_LT(difference<N>(oracle.angles.zenith,
                                [&](int c) { return d_zenith[static_cast<std::size_t>(c)][i]; }),
                  1e-12);
      });
    }
  }
}

// Some derivatives are not even computed then; the others are the same to the last bit.
TEST_P(AdjointOfEveryTrain, ColumnsThatNobodyWantsStayAway) {
  const PrismTrain train = testing::imperfect_train(GetParam(), 0.5, 4);
  const auto prisms = static_cast<std::size_t>(train.prisms());
  constexpr std::size_t kShots = 50;
  std::mt19937 generator(9);
  std::vector<std::vector<double>> angles(prisms, std::vector<double>(kShots));
  for (auto& column : angles) {
    for (double& angle : column) angle = testing::random_angles(1, generator)[0];
  }
  const std::vector<std::span<const double>> angle_columns(angles.begin(), angles.end());
  const std::size_t columns = static_cast<std::size_t>(parameter_count(train.prisms())) + prisms;
  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    const auto linearised = [&](const auto& wanted) {
      std::array<std::vector<std::vector<double>>, 2> gradients;
      std::vector<double> azimuth(kShots), zenith(kShots);
      LinearisationColumns out{azimuth, zenith, {}, {}};
      for (std::size_t angle = 0; angle < 2; ++angle) {
        for (std::size_t i = 0; i < columns; ++i) {
          gradients[angle].emplace_back(wanted(i) ? kShots : 0);
        }
        auto& spans = angle == 0 ? out.d_azimuth : out.d_zenith;
        spans.assign(gradients[angle].begin(), gradients[angle].end());
      }
      linearise_batch(train, angle_columns, out, {}, set);
      return gradients;
    };
    const auto all = linearised([](std::size_t) { return true; });
    for (std::size_t only = 0; only < columns; ++only) {
      const auto one = linearised([only](std::size_t i) { return i == only; });
      EXPECT_EQ(one[0][only], all[0][only]) << only;
      EXPECT_EQ(one[1][only], all[1][only]) << only;
    }
  }
}

TEST_P(AdjointOfEveryTrain, TurnsOfTheWholeBeamAreThoseOfTheDirection) {
  const PrismTrain train = testing::imperfect_train(GetParam(), 0.5, 3);
  std::mt19937 generator(7);
  const auto angles = testing::random_angles(train.prisms(), generator);
  with_layout(train.layout(), [&]<TrainLayout N>() {
    std::array<double, N> rotation;
    std::copy_n(angles.begin(), N, rotation.begin());
    auto shot = linearise_angles(
        prepare<double, N>(parameter_array<N>(train), face_order_array<N>(train)),
        prepare_derivatives<double, N>(parameter_array<N>(train), face_order_array<N>(train)),
        rotation);
    add_turn_derivatives(shot);
    const Vector3<double>& v = shot.direction;
    const double step = 1e-6;
    const auto difference = [&](const Vector3<double>& axis) {
      const auto up = angles_from_direction(v + step * cross(axis, v));
      const auto down = angles_from_direction(v - step * cross(axis, v));
      return SphericalAngles<double>{(up.azimuth - down.azimuth) / (2 * step),
                                     (up.zenith - down.zenith) / (2 * step)};
    };
    const auto yaw = difference(in_sensor_frame<N>(Vector3<double>{0, 0, 1}));
    const auto pitch = difference(in_sensor_frame<N>(Vector3<double>{0, 1, 0}));
    const auto at_yaw = static_cast<std::size_t>(place::frame_yaw(N));
    const auto at_pitch = static_cast<std::size_t>(place::frame_pitch(N));
    EXPECT_NEAR(shot.azimuth.parameters[at_yaw], yaw.azimuth, 1e-8);
    EXPECT_NEAR(shot.zenith.parameters[at_yaw], yaw.zenith, 1e-8);
    EXPECT_NEAR(shot.azimuth.parameters[at_pitch], pitch.azimuth, 1e-8);
    EXPECT_NEAR(shot.zenith.parameters[at_pitch], pitch.zenith, 1e-8);
  });
}

INSTANTIATE_TEST_SUITE_P(FaceOrders, AdjointOfEveryTrain,
                         ::testing::ValuesIn(testing::all_face_orders()), kByItself);

}  // namespace risley::observation_adjoint_test
