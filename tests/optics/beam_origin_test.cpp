// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/beam_origin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/plane.hpp"
#include "risley/core/simd.hpp"
#include "risley/optics/batch.hpp"

#include "optics/trains.hpp"

namespace risley::beam_origin_test {

const PrismGeometry kMid40{{0.007}, {0.030}};

double first_or_zero(const std::vector<double>& values) {
  return values.empty() ? 0.0 : values.front();
}

PrismTrain ideal_mid_40() { return PrismTrain(parse_face_order("PA-AP")); }

/// Y and Z where the beam leaves, mm.
std::array<double, 2> correction_mm(const PrismTrain& train, double a_deg, double b_deg) {
  const std::array<double, 2> angles{radians_from_degrees(a_deg), radians_from_degrees(b_deg)};
  const Ray ray = emergent_ray(train, kMid40, angles);
  EXPECT_TRUE(ray.valid);
  return {1e3 * ray.origin.y, 1e3 * ray.origin.z};
}

// Table A1, printed to 0.1 mm.
TEST(BeamOrigin, ReproducesTableA1) {
  const auto first = correction_mm(ideal_mid_40(), 96.667, 233.000);
  EXPECT_NEAR(first[0], 3.0, 0.05);
  EXPECT_NEAR(first[1], 0.8, 0.05);
  const auto second = correction_mm(ideal_mid_40(), 231.667, 95.333);
  EXPECT_NEAR(second[0], -2.1, 0.05);
  EXPECT_NEAR(second[1], 2.3, 0.05);
}

// Appendix A: all combinations of both rotation angles at 1/3 degree.
TEST(BeamOrigin, ReachesTheExtremesOfFigureA1) {
  constexpr std::size_t kSteps = 1081;
  std::vector<double> a(kSteps), b(kSteps), x(kSteps), y(kSteps), z(kSteps);
  for (std::size_t i = 0; i < kSteps; ++i) b[i] = radians_from_degrees(static_cast<double>(i) / 3);
  double smallest_y = 0, largest_y = 0, smallest_z = 0, largest_z = 0;
  for (std::size_t i = 0; i < kSteps; ++i) {
    std::fill(a.begin(), a.end(), b[i]);
    DirectionColumns out;
    out.origin_x = x;
    out.origin_y = y;
    out.origin_z = z;
    out.geometry = kMid40;
    const std::array<std::span<const double>, 2> angles{a, b};
    ASSERT_EQ(observe_batch(ideal_mid_40(), angles, out), 0u);
    smallest_y = std::min(smallest_y, *std::min_element(y.begin(), y.end()));
    largest_y = std::max(largest_y, *std::max_element(y.begin(), y.end()));
    smallest_z = std::min(smallest_z, *std::min_element(z.begin(), z.end()));
    largest_z = std::max(largest_z, *std::max_element(z.begin(), z.end()));
  }
  for (const double extreme : {-smallest_y, largest_y, -smallest_z, largest_z}) {
    EXPECT_NEAR(1e3 * extreme, 4.4, 0.05);
  }
}

TEST(BeamOrigin, PerpendicularFaceOfTheLastPrismStandsAtTheFramesOrigin) {
  const auto at = [](const char* order) { return face_positions(parse_face_order(order), kMid40); };
  EXPECT_EQ(at("PA-AP"), (std::vector<double>{-0.030, -0.023, -0.007, 0.0}));
  EXPECT_EQ(at("AP-PA"), (std::vector<double>{-0.037, -0.030, 0.0, 0.007}));
  EXPECT_EQ(at("PA-PA"), (std::vector<double>{-0.030, -0.023, 0.0, 0.007}));
  EXPECT_EQ(at("PA-AP-AP").front(), -0.060);
}

// Each point lies on its face and each piece of the way has the direction of its beam, for every
// face order: an independent walk in plain numbers.
TEST(BeamOrigin, WalksFromFaceToFace) {
  for (const std::string& order : testing::refracting_face_orders()) {
    const PrismTrain train = testing::imperfect_train(order, 0.5, 3);
    const auto positions = face_positions(train.face_order(), kMid40);
    with_layout(train.layout(), [&]<TrainLayout N>() {
      const auto prepared =
          prepare<double, N>(parameter_array<N>(train), face_order_array<N>(train));
      std::array<double, N> angles;
      for (std::size_t k = 0; k < N; ++k) angles[k] = 0.7 + 1.9 * static_cast<double>(k);
      const auto trace = trace_forward(prepared, angles);
      ASSERT_TRUE(trace.valid());
      Vector3<double> point{positions[0], 0, 0};
      for (std::size_t face = 1; face < 2 * N; ++face) {
        const Vector3<double> corner{positions[face], 0, 0};
        const Plane plane{trace.normal[face], dot(trace.normal[face], corner)};
        point += hit_distance(plane, point, trace.incident(face)) * trace.incident(face);
        EXPECT_NEAR(signed_distance(plane, point), 0.0, 1e-15);
      }
      const Ray ray = emergent_ray(train, kMid40, angles);
      EXPECT_LT(norm(ray.origin - point), 1e-15) << order;
      EXPECT_LT(norm(ray.direction - trace.direction()), 1e-15);
    });
  }
}

TEST(BeamOrigin, ThinPrismsAtOnePlaceLeaveTheBeamAtTheOrigin) {
  const std::array<double, 2> angles{1.0, 2.0};
  EXPECT_EQ(norm(emergent_ray(ideal_mid_40(), {}, angles).origin), 0.0);
}

TEST(BeamOrigin, EveryInstructionSetAgreesWithPlainNumbers) {
  constexpr std::size_t kShots = 37;
  const PrismTrain train = testing::imperfect_train("PA-AP", 0.5, 4);
  std::vector<double> a(kShots), b(kShots), x(kShots), y(kShots), z(kShots);
  for (std::size_t i = 0; i < kShots; ++i) {
    a[i] = 0.17 * static_cast<double>(i);
    b[i] = 5.0 - 0.11 * static_cast<double>(i);
  }
  const std::array<std::span<const double>, 2> angles{a, b};
  for (const InstructionSet set : available_instruction_sets()) {
    DirectionColumns out;
    out.origin_x = x;
    out.origin_y = y;
    out.origin_z = z;
    out.geometry = kMid40;
    observe_batch(train, angles, out, {}, set);
    for (std::size_t i = 0; i < kShots; ++i) {
      const Ray ray = emergent_ray(train, kMid40, std::array<double, 2>{a[i], b[i]});
      EXPECT_LT(norm(ray.origin - Vector3<double>{x[i], y[i], z[i]}), 1e-16) << to_string(set);
    }
  }
}

/// Parameters, rotation angles, face positions.
template <TrainLayout N>
constexpr int kOriginColumns = parameter_count(N) + 3 * N;
template <TrainLayout N>
using OriginJet = ceres::Jet<double, kOriginColumns<N>>;

/// The beam's origin by forward-mode automatic differentiation: the oracle.
template <TrainLayout N>
struct OriginOracle {
  Vector3<OriginJet<N>> origin;

  OriginOracle(const PrismTrain& train, const std::vector<double>& rotation_angles,
               const std::vector<double>& positions) {
    using Jet = OriginJet<N>;
    std::array<Jet, parameter_count(N)> parameters;
    for (int i = 0; i < parameter_count(N); ++i) {
      parameters[static_cast<std::size_t>(i)] = Jet(train[i], i);
    }
    std::array<Jet, N> rotation;
    std::array<Jet, 2 * N> position;
    for (std::size_t i = 0; i < N; ++i) {
      rotation[i] = Jet(rotation_angles[i], parameter_count(N) + static_cast<int>(i));
    }
    for (std::size_t i = 0; i < 2 * N; ++i) {
      position[i] = Jet(positions[i], parameter_count(N) + N + static_cast<int>(i));
    }
    const auto forward =
        trace_forward(prepare<Jet, N>(parameters, face_order_array<N>(train)), rotation);
    origin = beam_origin(forward, position);
  }
};

/// Largest difference of derivatives to the oracle's, relative to the oracle's largest entry.
template <class T, TrainLayout N, class Lane>
double origin_difference(const OriginJet<N>& oracle, const Gradient<T, N>& gradient,
                         const std::array<T, 2 * N>& face_position, const Lane& lane) {
  double worst = 0;
  for (int i = 0; i < kOriginColumns<N>; ++i) {
    const int angle = i - parameter_count(N), face = angle - N;
    const double entry = face >= 0 ? lane(face_position[static_cast<std::size_t>(face)])
                         : angle >= 0
                             ? lane(gradient.rotation_angles[static_cast<std::size_t>(angle)])
                             : lane(gradient.parameters[static_cast<std::size_t>(i)]);
    worst = std::max(worst, std::abs(entry - oracle.v[i]));
    if (std::isnan(entry)) return 1.0;
  }
  return worst / oracle.v.template lpNorm<Eigen::Infinity>();
}

/// Worst relative difference of the origin's three components, with everything evaluated in T.
template <class T, TrainLayout N, class Lane>
double origin_adjoint_error(const PrismTrain& train, const std::vector<double>& angles,
                            const Lane& lane) {
  const auto positions = face_positions(train.face_order(), kMid40);
  std::array<T, parameter_count(N)> parameters;
  for (int i = 0; i < parameter_count(N); ++i) {
    parameters[static_cast<std::size_t>(i)] = T(train[i]);
  }
  std::array<T, N> rotation;
  for (std::size_t i = 0; i < N; ++i) rotation[i] = T(angles[i]);
  std::array<T, 2 * N> position;
  for (std::size_t i = 0; i < 2 * N; ++i) position[i] = T(positions[i]);
  const auto order = face_order_array<N>(train);
  const auto prepared = prepare<T, N>(parameters, order);
  const auto derivatives = prepare_derivatives<T, N>(parameters, order);
  const auto forward = trace_forward(prepared, rotation);
  const auto path = beam_path(forward, position);
  const OriginOracle<N> oracle(train, angles, positions);

  const Vector3<T> none{T(0.0), T(0.0), T(0.0)};
  const std::array<Vector3<T>, 3> axes{Vector3<T>{T(1.0), T(0.0), T(0.0)},
                                       Vector3<T>{T(0.0), T(1.0), T(0.0)},
                                       Vector3<T>{T(0.0), T(0.0), T(1.0)}};
  std::array<BeamPathAdjoint<T, N>, 3> paths;
  for (std::size_t r = 0; r < 3; ++r) {
    paths[r] = beam_path_adjoint(forward, path, position, axes[r]);
  }
  const auto gradients = trace_adjoint(
      prepared, derivatives, forward, std::array<Vector3<T>, 3>{none, none, none},
      [&paths](std::size_t face, std::size_t r, Vector3<T>& beam, Vector3<T>& normal) {
        beam = beam + paths[r].incident[face];
        normal = normal + paths[r].normal[face];
      });
  const std::array<OriginJet<N>, 3> component{oracle.origin.x, oracle.origin.y, oracle.origin.z};
  double worst = 0;
  for (std::size_t r = 0; r < 3; ++r) {
    worst = std::max(
        worst, origin_difference<T, N>(component[r], gradients[r], paths[r].face_position, lane));
  }
  return worst;
}

// Parameters, rotation angles and face positions, for every face order, in plain numbers and in
// batches.
TEST(BeamOrigin, DerivativesEqualAutomaticDifferentiation) {
  using Batch = xsimd::batch<double>;
  const auto plain = [](double v) { return v; };
  const auto last_lane = [](const Batch& v) {
    double lanes[Batch::size];
    v.store_unaligned(lanes);
    return lanes[Batch::size - 1];
  };
  std::mt19937 generator(11);
  for (const std::string& order : testing::refracting_face_orders()) {
    SCOPED_TRACE(order);
    for (unsigned seed = 0; seed < 5; ++seed) {
      const PrismTrain train = testing::imperfect_train(order, 0.5, seed);
      with_layout(train.layout(), [&]<TrainLayout N>() {
        for (int draw = 0; draw < 3; ++draw) {
          const auto angles = testing::random_angles(N, generator);
          EXPECT_LT((origin_adjoint_error<double, N>(train, angles, plain)), 1e-12);
          EXPECT_LT((origin_adjoint_error<Batch, N>(train, angles, last_lane)), 1e-12);
        }
      });
    }
  }
}

// Moving a prism along the axis moves the positions that the geometry gives, face by face.
TEST(BeamOrigin, DerivativesByThicknessAndSpacingEqualCentralDifferences) {
  for (const char* order : {"PA-AP", "AP-PA", "PA-AP-AP", "AP-AP-PA"}) {
    SCOPED_TRACE(order);
    const PrismTrain train = testing::imperfect_train(order, 0.5, 9);
    std::mt19937 generator(12);
    const auto angles = testing::random_angles(train.prisms(), generator);
    with_layout(train.layout(), [&]<TrainLayout N>() {
      const auto forward = trace_forward(
          prepare<double, N>(parameter_array<N>(train), face_order_array<N>(train)), [&angles] {
            std::array<double, N> rotation;
            std::copy_n(angles.begin(), N, rotation.begin());
            return rotation;
          }());
      std::array<double, 2 * N> position;
      const auto positions = face_positions(train.face_order(), kMid40);
      std::copy_n(positions.begin(), 2 * N, position.begin());
      const auto path = beam_path(forward, position);
      constexpr double kStep = 1e-4;  // the origin is linear in both
      const std::array<PrismGeometry, 2> units{PrismGeometry{{1.0}, {}}, PrismGeometry{{}, {1.0}}};
      for (const PrismGeometry& unit : units) {
        const auto moved = [&](double step) {
          return emergent_ray(train,
                              {{kMid40.thickness[0] + step * first_or_zero(unit.thickness)},
                               {kMid40.spacing[0] + step * first_or_zero(unit.spacing)}},
                              angles)
              .origin;
        };
        const Vector3<double> rate = (0.5 / kStep) * (moved(kStep) - moved(-kStep));
        const auto over = face_positions(train.face_order(), unit);
        const auto adjoint = beam_path_adjoint(forward, path, position, {0.0, 1.0, 0.0});
        double sum = 0;
        for (std::size_t i = 0; i < over.size(); ++i) sum += adjoint.face_position[i] * over[i];
        EXPECT_NEAR(sum, rate.y, 1e-11);
      }
    });
  }
}

TEST(BeamOrigin, ABeamThatDoesNotGetThroughHasNoRay) {
  PrismTrain train = ideal_mid_40();
  train.set("wedge_angle_deg", radians_from_degrees(45.0));
  const Ray ray = emergent_ray(train, kMid40, std::array<double, 2>{0.0, 0.0});
  EXPECT_FALSE(ray.valid);
  EXPECT_TRUE(std::isnan(ray.origin.y));
  EXPECT_TRUE(std::isnan(ray.direction.x));
  EXPECT_THROW(emergent_ray(train, kMid40, std::array<double, 1>{0.0}), InvalidArgument);
}

}  // namespace risley::beam_origin_test
