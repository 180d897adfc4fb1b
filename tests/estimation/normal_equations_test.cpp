// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/normal_equations.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "risley/core/angle.hpp"
#include "risley/optics/observation_adjoint.hpp"

#include "estimation/knot_model.hpp"
#include "optics/trains.hpp"
#include "parameter_name.hpp"

namespace risley::estimation::normal_equations_test {

constexpr double kNoise = radians_from_degrees(0.01);
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Knots with given numbers of shots, and what a train sees there: noise, rounding, gross errors.
struct Recording {
  AngleSeries series;
  RotorTrajectory knots;
};

Recording record(const PrismTrain& train, const std::vector<std::size_t>& shots, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Recording r;
  r.knots.prisms = train.prisms();
  r.knots.stretch_begin = {0};
  std::int64_t time = 1'000'000'000'000;
  for (const std::size_t count : shots) {
    r.knots.first_shot.push_back(r.series.size());
    r.knots.last_shot.push_back(r.series.size() + count);
    r.knots.time_ns.push_back(time + static_cast<std::int64_t>(count) * 5'000);
    const std::size_t state = r.knots.state.size();
    for (int k = 0; k < train.prisms(); ++k) {
      r.knots.state.push_back(kPi * uniform(generator));
      r.knots.state.push_back(800.0 * uniform(generator));
      r.knots.state.push_back(1000.0 * uniform(generator));
    }
    for (std::size_t i = 0; i < count; ++i, time += 10'000) {
      const double t = 1e-9 * static_cast<double>(time - r.knots.time_ns.back());
      std::vector<double> angles;
      for (std::size_t k = state; k < r.knots.state.size(); k += 3) {
        angles.push_back(r.knots.state[k] +
                         t * (r.knots.state[k + 1] + t * 0.5 * r.knots.state[k + 2]));
      }
      const Observation shot = observe(train, angles);
      const double size = uniform(generator) > 0.8 ? 30.0 * kNoise : kNoise;
      const double turn = uniform(generator) > 0.9 ? kTwoPi : 0.0;
      const auto step = static_cast<float>(uniform(generator) > 0.0 ? kNoise : 0.0);
      const double azimuth = (shot.valid ? shot.azimuth : 0.0) + size * normal(generator) + turn;
      const double zenith = (shot.valid ? shot.zenith : 1.5) + size * normal(generator);
      r.series.append(time, azimuth, zenith, 0, step * step / 12.0F, step * step / 3.0F);
    }
    time += 1'000'000;
  }
  return r;
}

/// The same by the plain scalar model: J^T J and J^T r of every knot over its states and the
/// parameters, with the sums of the terms' magnitudes that rounding errors are relative to.
struct Reference {
  std::vector<Eigen::MatrixXd> hessian, hessian_size;  ///< [knots]
  std::vector<Eigen::VectorXd> gradient, gradient_size;
  double cost = 0;
  std::size_t outliers = 0;
  std::vector<double> azimuth_residual, zenith_residual;
  std::vector<unsigned char> outlier;

  template <TrainLayout N>
  void fill(const Recording& r, const PrismTrain& train, const std::vector<FreeParameter>& free,
            const ShotWeights& weights) {
    const auto order = face_order_array<N>(train);
    const auto prepared = prepare<double, N>(parameter_array<N>(train), order);
    const auto derivatives = prepare_derivatives<double, N>(parameter_array<N>(train), order);
    const auto columns = static_cast<Eigen::Index>(3 * N + free.size());
    for (std::size_t knot = 0; knot < r.knots.size(); ++knot) {
      Eigen::MatrixXd h = Eigen::MatrixXd::Zero(columns, columns), h_size = h;
      Eigen::VectorXd g = Eigen::VectorXd::Zero(columns), g_size = g;
      const auto state = r.knots.state_of(knot);
      for (std::size_t i = r.knots.first_shot[knot]; i < r.knots.last_shot[knot]; ++i) {
        const double t = 1e-9 * static_cast<double>(r.series.time_ns[i] - r.knots.time_ns[knot]);
        std::array<double, N> angles;
        for (std::size_t k = 0; k < N; ++k) {
          angles[k] =
              wrap_to_pi(state[3 * k]) + t * state[3 * k + 1] + 0.5 * t * t * state[3 * k + 2];
        }
        const auto shot = linearise_angles(prepared, derivatives, angles);
        const auto square = [](double x) { return x * x; };
        const Eigen::Vector2d sigma(
            std::sqrt(square(weights.angle_noise.azimuth) +
                      static_cast<double>(r.series.azimuth_rounding_variance[i])),
            std::sqrt(square(weights.angle_noise.zenith) +
                      static_cast<double>(r.series.zenith_rounding_variance[i])));
        azimuth_residual.push_back(wrap_to_pi(r.series.azimuth[i] - shot.angles.azimuth));
        zenith_residual.push_back(r.series.zenith[i] - shot.angles.zenith);
        Eigen::Vector2d residual(azimuth_residual.back(), zenith_residual.back());
        residual = residual.cwiseQuotient(sigma);
        const double chi2 = residual.squaredNorm();
        outlier.push_back(!(shot.valid && chi2 <= weights.cut));
        if (outlier.back()) {
          ++outliers;
          cost += weights.cut;
          continue;
        }
        Eigen::MatrixXd row(2, columns);
        for (const int angle : {0, 1}) {
          const auto& slopes = angle == 0 ? shot.azimuth : shot.zenith;
          for (int k = 0; k < N; ++k) {
            const double slope = slopes.rotation_angles[static_cast<std::size_t>(k)];
            row.row(angle).segment<3>(3 * k) << slope, slope * t, slope * 0.5 * t * t;
          }
          for (std::size_t j = 0; j < free.size(); ++j) {
            double sum = 0;
            for (const int p : free[j].places) {
              sum += slopes.parameters[static_cast<std::size_t>(p)];
            }
            row(angle, 3 * N + static_cast<Eigen::Index>(j)) = sum;
          }
          row.row(angle) /= sigma[angle];
        }
        const double weight = std::pow(1.0 + weights.softening * chi2, -2);
        cost += chi2 / (1.0 + weights.softening * chi2);
        h += weight * row.transpose() * row;
        g += weight * row.transpose() * residual;
        h_size += weight * row.cwiseAbs().transpose() * row.cwiseAbs();
        g_size +=
            weight * row.cwiseAbs().transpose() * (residual.cwiseAbs() + Eigen::Vector2d::Ones());
      }
      hessian.push_back(h);
      hessian_size.push_back(h_size);
      gradient.push_back(g);
      gradient_size.push_back(g_size);
    }
  }

  Reference(const Recording& r, const PrismTrain& train, const std::vector<FreeParameter>& free,
            const ShotWeights& weights) {
    with_layout(train.layout(), [&]<TrainLayout N>() { fill<N>(r, train, free, weights); });
  }
};

/// Largest difference of two matrices as a share of the size of their entries; entries of size zero
/// must be equal.
double difference(const Eigen::MatrixXd& found, const Eigen::MatrixXd& expected,
                  const Eigen::MatrixXd& size) {
  double worst = 0;
  for (Eigen::Index i = 0; i < expected.rows(); ++i) {
    for (Eigen::Index j = 0; j < expected.cols(); ++j) {
      const double error = std::abs(found(i, j) - expected(i, j));
      if (error != 0) worst = std::max(worst, error / size(i, j));
      if (std::isnan(error)) return error;
    }
  }
  return worst;
}

void expect_equal(const NormalEquations& found, const Reference& expected, const Recording& r) {
  constexpr double kTolerance = 1e-10;
  const auto n = static_cast<Eigen::Index>(found.free);
  ASSERT_EQ(found.prisms, r.knots.prisms);
  ASSERT_EQ(found.knots(), r.knots.size());
  EXPECT_EQ(found.shots, r.series.size());
  EXPECT_EQ(found.outliers, expected.outliers);
  with_layout(found.prisms, [&]<TrainLayout N>() {
    constexpr int kD = 3 * N;
    using RowMajor = Eigen::Matrix<double, kD, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::MatrixXd statics = Eigen::MatrixXd::Zero(n, n), statics_size = statics;
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(n), gradient_size = gradient;
    ASSERT_EQ(found.coupling.size(), r.knots.size() * kD * static_cast<std::size_t>(n));
    for (std::size_t knot = 0; knot < r.knots.size(); ++knot) {
      SCOPED_TRACE(knot);
      const Eigen::MatrixXd& h = expected.hessian[knot];
      const Eigen::MatrixXd& h_size = expected.hessian_size[knot];
      EXPECT_LE(difference(knot_curvature<N>(found, knot), h.topLeftCorner(kD, kD),
                           h_size.topLeftCorner(kD, kD)),
                kTolerance);
      const Eigen::Map<const RowMajor> coupling(
          found.coupling.data() + knot * kD * static_cast<std::size_t>(n), kD, n);
      EXPECT_LE(difference(coupling, h.topRightCorner(kD, n), h_size.topRightCorner(kD, n)),
                kTolerance);
      const Eigen::Map<const Eigen::VectorXd> states(found.gradient.data() + knot * kD, kD);
      EXPECT_LE(difference(states, expected.gradient[knot].head(kD),
                           expected.gradient_size[knot].head(kD)),
                kTolerance);
      statics += h.bottomRightCorner(n, n);
      statics_size += h_size.bottomRightCorner(n, n);
      gradient += expected.gradient[knot].tail(n);
      gradient_size += expected.gradient_size[knot].tail(n);
    }
    EXPECT_LE(difference(found.static_hessian, statics, statics_size), kTolerance);
    EXPECT_LE(difference(found.static_gradient, gradient, gradient_size), kTolerance);
  });
}

struct Columns {
  std::vector<double> azimuth, zenith;
  std::vector<unsigned char> outlier;

  explicit Columns(std::size_t shots)
      : azimuth(shots, 77.0), zenith(shots, 78.0), outlier(shots, 9) {}
  ShotColumns spans() { return {azimuth, zenith, outlier}; }
};

/// None, one that all prisms share, the paper's choice, and every single place.
std::vector<std::vector<FreeParameter>> parameter_sets(TrainShape shape) {
  std::vector<std::string> every;
  for (const ParameterInfo& parameter : parameter_list(shape)) {
    if (parameter.kind != ParameterKind::train) continue;
    const bool shared = parameter.name == "refractive_index" || parameter.name == "wedge_angle_deg";
    if (!shared) every.push_back(parameter.name);
  }
  return {{},
          free_parameters({"wedge_angle_deg", "refractive_index"}, shape),
          free_parameters(default_free_names(shape), shape),
          free_parameters(every, shape)};
}

class NormalEquationsOfATrain : public ::testing::TestWithParam<std::string> {};

TEST_P(NormalEquationsOfATrain, EqualTheScalarModel) {
  const PrismTrain truth = testing::imperfect_train(GetParam(), 0.5, 1);
  const Recording r = record(truth, {1, 2, 7, 8, 9, 100, 3}, 2);
  PrismTrain train = truth;  // linearised a little beside it
  for (const int place : {place::incident_beam_vertical(), place::refractive_index(0)}) {
    train.set_place(place, truth[place] + 3e-4);
  }
  const std::vector<ShotWeights> weights{{{kNoise, 1.7 * kNoise}, 0.0, kInfinity},
                                         {{2 * kNoise, 2 * kNoise}, 0.05, kInfinity},
                                         {{kNoise, 1.7 * kNoise}, 0.05, 20.0},
                                         {{kNoise, 1.7 * kNoise}, 0.0, 1.5}};
  NormalEquations equations;  // keeps its memory, not its values
  for (const auto& free : parameter_sets(train.shape())) {
    for (const ShotWeights& weight : weights) {
      const Reference expected(r, train, free, weight);
      EXPECT_EQ(expected.outliers > 0, std::isfinite(weight.cut));
      EXPECT_LT(expected.outliers, r.series.size() - 10);
      for (const InstructionSet set : available_instruction_sets()) {
        SCOPED_TRACE(::testing::Message()
                     << free.size() << " free, cut " << weight.cut << ", " << to_string(set));
        Columns columns(r.series.size());
        accumulate(r.series, r.knots, train, free, weight, equations, columns.spans(), set);
        expect_equal(equations, expected, r);
        EXPECT_NEAR(equations.cost, expected.cost, 1e-10 * expected.cost);
        EXPECT_EQ(columns.outlier, expected.outlier);
        for (std::size_t i = 0; i < r.series.size(); ++i) {
          EXPECT_NEAR(columns.azimuth[i], expected.azimuth_residual[i], 1e-14);
          EXPECT_NEAR(columns.zenith[i], expected.zenith_residual[i], 1e-14);
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(FaceOrders, NormalEquationsOfATrain,
                         ::testing::Values("PA", "AP", "PA-AP", "AP-PA", "PA-AP-PA", "AP-AP-PA",
                                           "PA-AP-PA-AP"),
                         kByItself);

TEST(NormalEquations, ABeamThatDoesNotGetThroughIsAnOutlierAndCountsNothing) {
  for (const auto& [face_order, wedge_deg] :
       {std::pair("PA", 40.0), std::pair("PA-PA", 34.0), std::pair("PA-PA-PA", 31.0)}) {
    SCOPED_TRACE(face_order);
    PrismTrain train = testing::imperfect_train(face_order, 0.5, 3);
    train.set_place(place::incident_beam_vertical(), radians_from_degrees(5.0));
    for (int k = 0; k < train.prisms(); ++k) {  // steep: total reflection at some rotation angles
      train.set_place(place::wedge_angle(k), radians_from_degrees(wedge_deg));
    }
    const Recording r = record(train, {1, 9, 100, 1, 8, 30, 1, 60, 40, 1, 1, 7, 2, 50, 33, 17}, 4);
    const auto free = free_parameters(default_free_names(train.shape()), train.shape());
    const ShotWeights weights{{kNoise, 1.7 * kNoise}, 0.0, 1e9};  // so only those
    const Reference expected(r, train, free, weights);
    EXPECT_GT(expected.outliers, 50u);
    EXPECT_LT(expected.outliers, r.series.size() - 50);
    NormalEquations equations;
    for (const InstructionSet set : available_instruction_sets()) {
      SCOPED_TRACE(to_string(set));
      Columns columns(r.series.size());
      accumulate(r.series, r.knots, train, free, weights, equations, columns.spans(), set);
      expect_equal(equations, expected, r);
      EXPECT_NEAR(equations.cost, expected.cost, 1e-10 * expected.cost);
      EXPECT_EQ(columns.outlier, expected.outlier);
      for (std::size_t i = 0; i < r.series.size(); ++i) {
        EXPECT_EQ(std::isnan(columns.azimuth[i]), expected.outlier[i] != 0);
        EXPECT_EQ(std::isnan(columns.zenith[i]), expected.outlier[i] != 0);
      }
    }
  }
}

TEST(NormalEquations, ManyTurnsDoNotCostAccuracy) {
  const PrismTrain train = testing::imperfect_train("PA-AP", 0.5, 5);
  const auto free = free_parameters(default_free_names({2}), {2});
  const ShotWeights weights{{kNoise, 1.7 * kNoise}, 0.01, 30.0};
  Recording r = record(train, {1, 7, 100}, 6);
  const Recording few = r;
  // A power of two, so that the turns themselves are exact.
  for (std::size_t k = 0; k < r.knots.state.size(); k += 3) {
    r.knots.state[k] += k % 2 == 0 ? 131072 * kTwoPi : -65536 * kTwoPi;
  }
  const Reference expected(r, train, free, weights);
  NormalEquations equations;
  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    accumulate(r.series, r.knots, train, free, weights, equations, {}, set);
    expect_equal(equations, expected, r);
  }
  // Any other number: as good as a double can hold such an angle. Its derivative is below 1.
  const double turns = 100'003;
  r.knots.state = few.knots.state;
  for (std::size_t k = 0; k < r.knots.state.size(); k += 3) r.knots.state[k] += turns * kTwoPi;
  const double spacing = turns * kTwoPi * std::numeric_limits<double>::epsilon();
  const Reference near(few, train, free, weights);
  for (const InstructionSet set : available_instruction_sets()) {
    Columns columns(r.series.size());
    accumulate(r.series, r.knots, train, free, weights, equations, columns.spans(), set);
    for (std::size_t i = 0; i < r.series.size(); ++i) {
      EXPECT_NEAR(columns.azimuth[i], near.azimuth_residual[i], 2.0 * spacing);
      EXPECT_NEAR(columns.zenith[i], near.zenith_residual[i], 2.0 * spacing);
    }
  }
}

TEST(NormalEquations, TheNumberOfThreadsChangesNoBit) {
  const PrismTrain train = testing::imperfect_train("PA-AP", 0.5, 7);
  const auto free = free_parameters(default_free_names({2}), {2});
  const Recording r = record(train, std::vector<std::size_t>(3500, 3), 8);
  const ShotWeights weights{{kNoise, 1.7 * kNoise}, 0.02, 50.0};
  NormalEquations one, two;
  Columns columns_one(r.series.size()), columns_two(r.series.size());
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    accumulate(r.series, r.knots, train, free, weights, one, columns_one.spans());
  }
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
    accumulate(r.series, r.knots, train, free, weights, two, columns_two.spans());
  }
  EXPECT_EQ(one.curvature, two.curvature);
  EXPECT_EQ(one.coupling, two.coupling);
  EXPECT_EQ(one.gradient, two.gradient);
  EXPECT_EQ(one.static_hessian, two.static_hessian);
  EXPECT_EQ(one.static_gradient, two.static_gradient);
  EXPECT_EQ(one.cost, two.cost);
  EXPECT_EQ(one.outliers, two.outliers);
  EXPECT_EQ(columns_one.azimuth, columns_two.azimuth);
  EXPECT_EQ(columns_one.zenith, columns_two.zenith);
  EXPECT_EQ(columns_one.outlier, columns_two.outlier);
  // Blocks of knots are put together as if they were one.
  expect_equal(two, Reference(r, train, free, weights), r);
}

TEST(NormalEquations, ShotsThatNoKnotServesAreLeftAlone) {
  const PrismTrain train = testing::imperfect_train("PA-AP", 0.5, 9);
  Recording r = record(train, {5, 20, 9, 4}, 10);
  for (auto* column : {&r.knots.first_shot, &r.knots.last_shot}) column->erase(column->begin() + 1);
  r.knots.time_ns.erase(r.knots.time_ns.begin() + 1);
  r.knots.state.erase(r.knots.state.begin() + 6, r.knots.state.begin() + 12);
  for (const InstructionSet set : available_instruction_sets()) {
    NormalEquations equations;
    Columns columns(r.series.size());
    accumulate(r.series, r.knots, train, {}, {equal_noise(kNoise)}, equations, columns.spans(),
               set);
    EXPECT_EQ(equations.shots, 18u);
    for (std::size_t i = 0; i < r.series.size(); ++i) {
      const bool served = i < 5 || i >= 25;
      EXPECT_EQ(columns.azimuth[i] == 77.0, !served);
      EXPECT_EQ(columns.zenith[i] == 78.0, !served);
      EXPECT_EQ(columns.outlier[i], served ? 0 : 9);
    }
  }
}

TEST(NormalEquations, ScalingScalesAllInformation) {
  const PrismTrain train = testing::imperfect_train("PA-AP", 0.5, 11);
  const auto free = free_parameters(default_free_names({2}), {2});
  const Recording r = record(train, {5, 20}, 12);
  NormalEquations wide, scaled;
  accumulate(r.series, r.knots, train, free, {equal_noise(kNoise)}, scaled);
  scaled.scale(0.25);
  Recording half = r;  // the same data with twice the sigma everywhere
  for (auto* column :
       {&half.series.azimuth_rounding_variance, &half.series.zenith_rounding_variance}) {
    for (float& variance : *column) variance *= 4.0F;
  }
  accumulate(half.series, half.knots, train, free, {equal_noise(2 * kNoise)}, wide);
  const auto expect_scaled = [](const auto& found, const auto& expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < static_cast<std::size_t>(found.size()); ++i) {
      EXPECT_NEAR(found.data()[i], expected.data()[i], 1e-14 * std::abs(expected.data()[i]));
    }
  };
  expect_scaled(scaled.curvature, wide.curvature);
  expect_scaled(scaled.coupling, wide.coupling);
  expect_scaled(scaled.gradient, wide.gradient);
  expect_scaled(scaled.static_hessian, wide.static_hessian);
  expect_scaled(scaled.static_gradient, wide.static_gradient);
}

}  // namespace risley::estimation::normal_equations_test
