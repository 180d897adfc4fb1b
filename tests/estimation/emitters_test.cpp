// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The normal equations of a sensor with several emitters are the sum of those that its emitters
// would have alone.
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/optics/observation_model.hpp"

#include "optics/trains.hpp"
#include "parameter_name.hpp"

namespace risley::estimation::emitters_test {

constexpr double kNoise = radians_from_degrees(0.01);

struct Recording {
  AngleSeries series;
  RotorTrajectory knots;
};

/// Knots with given numbers of shots; every shot is of any emitter.
Recording record(const PrismTrain& train, const std::vector<std::size_t>& shots, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::uniform_int_distribution<int> any(0, train.emitters() - 1);
  Recording r;
  r.knots.prisms = train.prisms();
  r.knots.stretch_begin = {0};
  std::int64_t time = 1'000'000'000;
  for (const std::size_t count : shots) {
    r.knots.first_shot.push_back(r.series.size());
    r.knots.last_shot.push_back(r.series.size() + count);
    r.knots.time_ns.push_back(time + static_cast<std::int64_t>(count) * 2'000);
    for (int k = 0; k < train.prisms(); ++k) {
      r.knots.state.push_back(kPi * uniform(generator));
      r.knots.state.push_back(800.0 * uniform(generator));
      r.knots.state.push_back(1000.0 * uniform(generator));
    }
    for (std::size_t i = 0; i < count; ++i, time += 4'000) {
      const double t = 1e-9 * static_cast<double>(time - r.knots.time_ns.back());
      std::vector<double> angles;
      for (std::size_t k = 0; k < static_cast<std::size_t>(train.prisms()); ++k) {
        angles.push_back(r.knots.angle(r.knots.size() - 1, k, t));
      }
      const int beam = any(generator);
      const Observation shot = observe(train, angles, beam);
      const double size = uniform(generator) > 0.8 ? 30.0 * kNoise : kNoise;
      r.series.time_ns.push_back(time);
      r.series.azimuth.push_back(shot.azimuth + size * normal(generator));
      r.series.zenith.push_back(shot.zenith + size * normal(generator));
      r.series.azimuth_rounding_variance.push_back(1e-9F);
      r.series.zenith_rounding_variance.push_back(2e-9F);
      r.series.beam.push_back(static_cast<std::uint8_t>(beam));
    }
  }
  return r;
}

/// The shots of one emitter.
Recording of_emitter(const Recording& all, int beam) {
  Recording own;
  own.knots = all.knots;
  for (std::size_t knot = 0; knot < all.knots.size(); ++knot) {
    own.knots.first_shot[knot] = own.series.size();
    for (std::size_t i = all.knots.first_shot[knot]; i < all.knots.last_shot[knot]; ++i) {
      if (all.series.beam[i] != beam) continue;
      own.series.time_ns.push_back(all.series.time_ns[i]);
      own.series.azimuth.push_back(all.series.azimuth[i]);
      own.series.zenith.push_back(all.series.zenith[i]);
      own.series.azimuth_rounding_variance.push_back(all.series.azimuth_rounding_variance[i]);
      own.series.zenith_rounding_variance.push_back(all.series.zenith_rounding_variance[i]);
      own.series.beam.push_back(0);
    }
    own.knots.last_shot[knot] = own.series.size();
  }
  return own;
}

struct Emitters {
  std::string order;
  int count = 1;

  friend std::ostream& operator<<(std::ostream& out, const Emitters& one) {
    return out << one.order << " with " << one.count;
  }
};

class NormalEquationsOfEmitters : public ::testing::TestWithParam<Emitters> {};

TEST_P(NormalEquationsOfEmitters, AreTheSumOfThoseOfEach) {
  const PrismTrain truth = testing::imperfect_train(GetParam().order, 0.5, 1, GetParam().count);
  const Recording all = record(truth, {1, 7, 8, 9, 100, 64, 3, 2500}, 2);
  PrismTrain train = truth;  // linearised a little beside it
  train.set_place(place::incident_beam_vertical(0, train.prisms()), 3e-4 + train[2]);
  // Every place that has a name.
  std::vector<std::string> names;
  for (const ParameterInfo& info : parameter_list(train.shape())) {
    const bool shared = info.name == "refractive_index" || info.name == "wedge_angle_deg";
    if (info.kind == ParameterKind::train && !shared) names.push_back(info.name);
  }
  const auto free = free_parameters(names, train.shape());
  const ShotWeights weights{{kNoise, 1.7 * kNoise}, 0.05, 20.0};

  const auto n = static_cast<Eigen::Index>(free.size());
  NormalEquations expected;
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(n);
  std::vector<double> coupling(
      all.knots.size() * static_cast<std::size_t>(3 * train.prisms()) * free.size(), 0.0);
  std::vector<double> curvature, states;
  double cost = 0;
  std::size_t outliers = 0;
  std::vector<double> azimuth_residual(all.series.size()), zenith_residual(all.series.size());
  std::vector<unsigned char> outlier(all.series.size());
  for (int beam = 0; beam < train.emitters(); ++beam) {
    const PrismTrain own_train = testing::train_of_emitter(train, beam);
    const Recording own = of_emitter(all, beam);
    std::vector<FreeParameter> own_free;
    std::vector<std::size_t> columns;
    for (std::size_t j = 0; j < free.size(); ++j) {
      const int at = testing::place_of_emitter(free[j].places.front(), beam, train.prisms());
      if (at < 0) continue;
      own_free.push_back(free[j]);
      own_free.back().places = {at};
      columns.push_back(j);
    }
    NormalEquations part;
    std::vector<double> azimuth(own.series.size()), zenith(own.series.size());
    std::vector<unsigned char> out(own.series.size());
    accumulate(own.series, own.knots, own_train, own_free, weights, part, {azimuth, zenith, out},
               InstructionSet::baseline);
    for (std::size_t i = 0, row = 0; i < all.series.size(); ++i) {
      if (all.series.beam[i] != beam) continue;
      azimuth_residual[i] = azimuth[row];
      zenith_residual[i] = zenith[row];
      outlier[i] = out[row++];
    }
    cost += part.cost;
    outliers += part.outliers;
    curvature.resize(part.curvature.size());
    states.resize(part.gradient.size());
    for (std::size_t i = 0; i < curvature.size(); ++i) curvature[i] += part.curvature[i];
    for (std::size_t i = 0; i < states.size(); ++i) states[i] += part.gradient[i];
    const std::size_t rows = part.coupling.size() / columns.size();
    for (std::size_t a = 0; a < columns.size(); ++a) {
      const auto row = static_cast<Eigen::Index>(columns[a]);
      gradient[row] += part.static_gradient[static_cast<Eigen::Index>(a)];
      for (std::size_t b = 0; b < columns.size(); ++b) {
        hessian(row, static_cast<Eigen::Index>(columns[b])) +=
            part.static_hessian(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
      }
      for (std::size_t i = 0; i < rows; ++i) {
        coupling[i * free.size() + columns[a]] += part.coupling[i * columns.size() + a];
      }
    }
  }
  EXPECT_GT(outliers, 5u);
  EXPECT_LT(outliers, all.series.size() / 2);

  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    NormalEquations found;
    std::vector<double> azimuth(all.series.size()), zenith(all.series.size());
    std::vector<unsigned char> out(all.series.size());
    accumulate(all.series, all.knots, train, free, weights, found, {azimuth, zenith, out}, set);
    EXPECT_EQ(found.outliers, outliers);
    EXPECT_EQ(out, outlier);
    for (std::size_t i = 0; i < azimuth.size(); ++i) {
      EXPECT_NEAR(azimuth[i], azimuth_residual[i], 1e-12) << i;
      EXPECT_NEAR(zenith[i], zenith_residual[i], 1e-12) << i;
    }
    EXPECT_NEAR(found.cost, cost, 1e-10 * cost);
    const auto near = [](const auto& a, const auto& b, double size) {
      for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-10 * size) << i;
    };
    const auto largest = [](const std::vector<double>& values) {
      double size = 0;
      for (const double value : values) size = std::max(size, std::abs(value));
      return size;
    };
    ASSERT_EQ(found.coupling.size(), coupling.size());
    near(found.curvature, curvature, largest(curvature));
    near(found.gradient, states, largest(states));
    near(found.coupling, coupling, largest(coupling));
    EXPECT_LT((found.static_hessian - hessian).cwiseAbs().maxCoeff(),
              1e-10 * hessian.cwiseAbs().maxCoeff());
    EXPECT_LT((found.static_gradient - gradient).cwiseAbs().maxCoeff(),
              1e-10 * gradient.cwiseAbs().maxCoeff());
    // No shot is of two emitters.
    const auto column = [&](const char* name) {
      return static_cast<Eigen::Index>(std::find(names.begin(), names.end(), name) - names.begin());
    };
    if (train.emitters() > 1) {
      EXPECT_EQ(found.static_hessian(column("incident_beam_1_vertical_deg"),
                                     column("incident_beam_2_vertical_deg")),
                0.0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Trains, NormalEquationsOfEmitters,
                         ::testing::Values(Emitters{"PA", 6}, Emitters{"PA-AP", 1},
                                           Emitters{"PA-AP", 2}, Emitters{"AP-PA", 6},
                                           Emitters{"AP-PA-AP", 6}, Emitters{"PA-PA-AP", 8},
                                           Emitters{"PA-AP-AP-PA", 8}),
                         [](const auto& one) {
                           return parameter_name(one.param.order + std::to_string(one.param.count));
                         });

}  // namespace risley::estimation::emitters_test
