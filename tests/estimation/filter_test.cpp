// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The filter's kernel against the filter as one writes it down: derivatives by the scalar model,
// the matrix F of the prediction, and Joseph's form of the update.
#include "estimation/filter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/optics/observation_adjoint.hpp"

#include "optics/trains.hpp"

namespace risley::estimation::filter_test {

constexpr double kNoise = radians_from_degrees(0.01);
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr std::size_t kShots = 60;

/// What the filter may be asked to do.
struct Case {
  std::string face_order;
  int emitters = 1;
  std::vector<std::string> free = {};  ///< empty: the paper's choice
  double gate = kInfinite;
  double walk = 0;
  bool reference = false;
  bool backwards = false;
  double wedge = 0;  ///< of every prism, rad, unless 0
};

/// Parameters, shots and start of a case.
struct Problem {
  PrismTrain train;
  AngleSeries series;
  EkfOptions options;
  std::vector<RotorProcess> process;
  std::vector<unsigned char> outlier;
  Solution before;  ///< the reference
  FilterState first;
  std::size_t invalid = 0;  ///< shots that do not get through

  explicit Problem(const Case& c)
      : train(testing::imperfect_train(c.face_order, 0.2, 5, c.emitters)) {
    const auto prisms = static_cast<std::size_t>(train.prisms());
    for (std::size_t k = 0; k < prisms && c.wedge > 0; ++k) {
      train.set_place(place::wedge_angle(static_cast<int>(k)), c.wedge);
    }
    const auto names = c.free.empty() ? default_free_names(train.shape()) : c.free;
    options.free = free_parameters(names, train.shape());
    for (FreeParameter& parameter : options.free) parameter.prior_sigma = 0.003;
    options.angle_noise = kNoise;
    options.parameter_walk = c.walk;
    std::mt19937_64 generator(7);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    const Eigen::VectorXd values = free_values(train, options.free);
    train = with_free_values(train, options.free, values);  // shared parameters, too
    before.trajectory.prisms = train.prisms();
    std::int64_t time = 1'000'000'000;
    for (std::size_t i = 0; i < kShots; ++i) {
      time += i % 7 == 3 ? 300'000 : 60'000;
      std::vector<double> angles;
      for (std::size_t k = 0; k < prisms; ++k) {
        const double speed = 500.0 - 900.0 * static_cast<double>(k);
        angles.push_back(0.3 + static_cast<double>(k) + 1e-9 * static_cast<double>(time) * speed);
        before.trajectory.state.insert(before.trajectory.state.end(), {angles[k], speed, 0.0});
      }
      before.trajectory.time_ns.push_back(time);
      const int beam = static_cast<int>(i) % c.emitters;
      const Observation shot = observe(train, angles, beam);
      invalid += !shot.valid;
      const double size = uniform(generator) > 0.9 ? 30.0 * kNoise : kNoise;
      const double turn = i % 5 == 0 ? kTwoPi : 0.0;
      series.append(time, (shot.valid ? shot.azimuth : 0.0) + size * normal(generator) + turn,
                    (shot.valid ? shot.zenith : 1.5) + size * normal(generator),
                    static_cast<std::uint8_t>(beam), i % 3 == 0 ? 1e-8F : 0.0F,
                    i % 4 == 0 ? 3e-8F : 0.0F);
      outlier.push_back(i % 11 == 4);
    }
    for (std::size_t k = 0; k < prisms; ++k) process.push_back({0.1 + 0.1 * double(k), 1e-3, 0.0});
    before.parameters = values;
    first.mean = Eigen::VectorXd(values.size() + 2 * train.prisms());
    first.mean.head(values.size()) = values;
    const std::size_t begin = c.backwards ? kShots - 1 : 0;
    for (std::size_t k = 0; k < prisms; ++k) {
      const auto at = values.size() + 2 * static_cast<Eigen::Index>(k);
      first.mean[at] = before.trajectory.angle(begin, k, 0.0);
      first.mean[at + 1] = before.trajectory.speed(begin, k, 0.0);
    }
    for (Eigen::Index i = 0; i < first.mean.size(); ++i) {
      first.mean[i] += (i < values.size() ? 1e-4 : 1e-3) * normal(generator);
    }
    first.covariance = Filter(series, train, options, process, nullptr).wide_covariance();
    first.time_ns = series.time_ns[begin];
  }
};

/// What a run gives.
struct Result {
  FilterState state;
  std::vector<unsigned char> refused = std::vector<unsigned char>(kShots);
  std::vector<double> chi_square = std::vector<double>(kShots), determinant = chi_square, kept;
};

/// Azimuth and zenith of a shot, and how they depend on free parameters and rotation angles.
struct Linearised {
  Eigen::Vector2d angles;
  Eigen::MatrixXd by_parameters, by_angles;  ///< [2, free], [2, prisms]

  Linearised(const PrismTrain& train, const std::vector<FreeParameter>& free,
             const std::vector<double>& rotation_angles, int beam)
      : by_parameters(2, free.size()), by_angles(2, train.prisms()) {
    with_layout(train.layout(), [&]<TrainLayout N>() {
      const auto parameters = parameter_array<N>(train, beam);
      const auto faces = face_order_array<N>(train);
      std::array<double, N> rotation;
      std::copy_n(rotation_angles.begin(), N, rotation.begin());
      const auto result =
          linearise_angles(prepare<double, N>(parameters, faces),
                           prepare_derivatives<double, N>(parameters, faces), rotation);
      angles = {result.angles.azimuth, result.angles.zenith};
      by_parameters.setZero();
      const std::array both{&result.azimuth, &result.zenith};
      for (Eigen::Index row = 0; row < 2; ++row) {
        const auto& gradient = *both[static_cast<std::size_t>(row)];
        for (std::size_t i = 0; i < free.size(); ++i) {
          for (const int at : free[i].places) {
            by_parameters(row, static_cast<Eigen::Index>(i)) += derivative_by(gradient, at, beam);
          }
        }
        for (std::size_t k = 0; k < N; ++k) {
          by_angles(row, static_cast<Eigen::Index>(k)) = gradient.rotation_angles[k];
        }
      }
    });
  }
};

Result plain_filter(const Problem& s, const Case& c, const FilterReference* reference) {
  Result result;
  FilterState& state = result.state = s.first;
  const auto prisms = static_cast<Eigen::Index>(s.train.prisms());
  const Eigen::Index statics = s.options.free.size(), size = statics + 2 * prisms;
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(size, size);
  for (std::size_t n = 0; n < kShots; ++n) {
    const std::size_t shot = c.backwards ? kShots - 1 - n : n;
    const double dt = 1e-9 * static_cast<double>(s.series.time_ns[shot] - state.time_ns);
    state.time_ns = s.series.time_ns[shot];
    Eigen::MatrixXd f = one, q = Eigen::MatrixXd::Zero(size, size);
    for (Eigen::Index i = 0; i < statics; ++i) q(i, i) = c.walk * c.walk * std::abs(dt);
    for (Eigen::Index k = 0; k < prisms; ++k) {
      const Eigen::Index angle = statics + 2 * k, speed = angle + 1;
      const auto step = step_covariance(s.process[static_cast<std::size_t>(k)], dt);
      f(angle, speed) = dt;
      q(angle, angle) = step.angle_angle;
      q(angle, speed) = q(speed, angle) = step.angle_speed;
      q(speed, speed) = step.speed_speed;
    }
    state.mean = (f * state.mean).eval();
    state.covariance = (f * state.covariance * f.transpose() + q).eval();
    const auto keep = [&] {
      result.kept.insert(result.kept.end(), state.mean.begin(), state.mean.end());
      const auto all = state.covariance.reshaped();
      result.kept.insert(result.kept.end(), all.begin(), all.end());
    };
    if (c.backwards) keep();
    result.determinant[n] = 1;
    if (!s.outlier[shot]) {
      Eigen::VectorXd at = state.mean;
      if (reference) {
        at.head(statics) = reference->before.parameters;
        for (Eigen::Index k = 0; k < prisms; ++k) at[statics + 2 * k] = reference->angles(shot)[k];
      }
      std::vector<double> angles;
      for (Eigen::Index k = 0; k < prisms; ++k) angles.push_back(at[statics + 2 * k]);
      const Linearised model(with_free_values(s.train, s.options.free, at.head(statics)),
                             s.options.free, angles, s.series.beam[shot]);
      Eigen::MatrixXd h = Eigen::MatrixXd::Zero(2, size);
      h.leftCols(statics) = model.by_parameters;
      for (Eigen::Index k = 0; k < prisms; ++k) h.col(statics + 2 * k) = model.by_angles.col(k);
      Eigen::VectorXd away = state.mean - at;
      for (Eigen::Index k = 0; k < prisms; ++k) away[statics + 2 * k + 1] = 0;
      const Eigen::Vector2d innovation{
          wrap_to_pi(s.series.azimuth[shot] - model.angles[0]) - h.row(0) * away,
          s.series.zenith[shot] - model.angles[1] - h.row(1) * away};
      Eigen::Matrix2d r = kNoise * kNoise * Eigen::Matrix2d::Identity();
      r(0, 0) += static_cast<double>(s.series.azimuth_rounding_variance[shot]);
      r(1, 1) += static_cast<double>(s.series.zenith_rounding_variance[shot]);
      const Eigen::Matrix2d scatter = h * state.covariance * h.transpose() + r;
      const double chi_square = innovation.dot(scatter.inverse() * innovation);
      if (chi_square <= c.gate) {
        const Eigen::MatrixXd gain = state.covariance * h.transpose() * scatter.inverse();
        const Eigen::MatrixXd rest = one - gain * h;
        state.mean += gain * innovation;
        state.covariance =
            (rest * state.covariance * rest.transpose() + gain * r * gain.transpose()).eval();
        result.chi_square[n] = chi_square;
        result.determinant[n] = scatter.determinant();
      } else {
        result.refused[shot] = 1;
      }
    }
    if (!c.backwards) keep();
  }
  return result;
}

Result run(const Problem& s, const Case& c, const FilterReference* reference, InstructionSet set) {
  Result result;
  result.state = s.first;
  const auto size = static_cast<std::size_t>(s.first.mean.size());
  result.kept.resize(kShots * size * (size + 1));
  FilterRun run;
  run.first = c.backwards ? kShots - 1 : 0;
  run.count = kShots;
  run.backwards = c.backwards;
  run.gate = c.gate;
  run.outlier = s.outlier.data();
  run.refused = result.refused.data();
  run.chi_square = result.chi_square.data();
  run.determinant = result.determinant.data();
  run.kept = result.kept.data();
  run.keep_predicted = c.backwards;
  const Filter filter(s.series, s.train, s.options, s.process, reference);
  EXPECT_EQ(filter.run(result.state, run, set), kShots);
  return result;
}

/// Largest difference of means in sigmas, and of covariances as correlations.
void expect_near(const double* mean, const double* covariance, const FilterState& expected,
                 const std::string& where) {
  const Eigen::Index size = expected.mean.size();
  const Eigen::VectorXd sigma = expected.covariance.diagonal().cwiseSqrt();
  const Eigen::Map<const Eigen::VectorXd> m(mean, size);
  const Eigen::Map<const Eigen::MatrixXd> p(covariance, size, size);
  EXPECT_LT((m - expected.mean).cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 1e-7) << where;
  const Eigen::MatrixXd off = (p - expected.covariance).cwiseQuotient(sigma * sigma.transpose());
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-7) << where;
  EXPECT_TRUE(p == p.transpose()) << where;
}

void compare(const Case& c) {
  const Problem problem(c);
  EXPECT_EQ(problem.invalid > 0, c.wedge > 0);
  const FilterReference linearised(problem.before);
  const FilterReference* const reference = c.reference ? &linearised : nullptr;
  const Result expected = plain_filter(problem, c, reference);
  const auto refused = std::count(expected.refused.begin(), expected.refused.end(), 1);
  EXPECT_EQ(refused > 0, c.gate < kInfinite || c.wedge > 0) << refused;
  const auto size = problem.first.mean.size();
  const std::size_t stride = static_cast<std::size_t>(size * (size + 1));
  for (const InstructionSet set : available_instruction_sets()) {
    const std::string where = c.face_order + ", " + to_string(set);
    const Result result = run(problem, c, reference, set);
    EXPECT_EQ(result.state.time_ns, expected.state.time_ns) << where;
    EXPECT_EQ(result.refused, expected.refused) << where;
    expect_near(result.state.mean.data(), result.state.covariance.data(), expected.state, where);
    for (std::size_t n = 0; n < kShots; ++n) {
      const std::string here = where + ", shot " + std::to_string(n);
      EXPECT_NEAR(result.chi_square[n], expected.chi_square[n], 1e-6 * (1 + expected.chi_square[n]))
          << here;
      EXPECT_NEAR(result.determinant[n] / expected.determinant[n], 1.0, 1e-7) << here;
      FilterState then;
      const double* const kept = expected.kept.data() + n * stride;
      then.mean = Eigen::Map<const Eigen::VectorXd>(kept, size);
      then.covariance = Eigen::Map<const Eigen::MatrixXd>(kept + size, size, size);
      const double* const ours = result.kept.data() + n * stride;
      expect_near(ours, ours + size, then, here);
    }
  }
}

/// Everything by which a train can be off, each prism for itself.
std::vector<std::string> every_parameter(const std::string& face_order, int emitters) {
  std::vector<std::string> names;
  const TrainShape shape{layout_of(parse_face_order(face_order)), emitters};
  for (const ParameterInfo& info : parameter_list(shape)) {
    if (info.kind == ParameterKind::train && info.places.size() == 1) names.push_back(info.name);
  }
  return names;
}

TEST(Filter, EqualsJosephsFormForEveryNumberOfPrisms) {
  for (const char* order : {"PA", "PA-AP", "AP-PA-PA", "PA-AP-AP-PA"})
    compare({.face_order = order});
}

TEST(Filter, EqualsItForEveryParameterOfEveryTrain) {
  for (const std::string& order : testing::all_face_orders()) {
    compare({.face_order = order, .free = every_parameter(order, 1)});
  }
  compare({.face_order = "PA-AP", .free = {"refractive_index"}});
  compare({.face_order = "PA-AP", .free = {"wedge_angle_b_deg"}, .walk = 1e-3});
}

TEST(Filter, EqualsItForSeveralEmitters) {
  for (const char* order : {"PA-AP", "PA-AP-PA"}) {
    compare({.face_order = order, .emitters = 6});
    compare({.face_order = order, .emitters = 3, .free = every_parameter(order, 3)});
  }
}

TEST(Filter, RefusesWhatLiesBeyondTheGateOrDoesNotGetThrough) {
  compare({.face_order = "PA-AP", .gate = 13.8, .walk = 1e-4});
  compare({.face_order = "PA-AP-PA", .gate = 13.8});
  for (const double gate : {13.8, kInfinite}) {
    compare({.face_order = "PA-PA", .gate = gate, .wedge = radians_from_degrees(33.0)});
  }
}

TEST(Filter, LinearisesAtAReferenceAndGoesBackwards) {
  for (const bool reference : {false, true}) {
    for (const char* order : {"PA", "PA-AP", "PA-AP-PA"}) {
      compare({.face_order = order, .reference = reference, .backwards = true});
      compare({.face_order = order, .emitters = 2, .gate = 13.8, .reference = reference});
    }
  }
}

TEST(Filter, StopsWhereItDiverges) {
  Problem problem({.face_order = "PA-AP"});
  problem.series.zenith[30] = kInfinite;
  const Filter filter(problem.series, problem.train, problem.options, problem.process, nullptr);
  FilterRun run;
  run.count = kShots;
  run.gate = kInfinite;
  run.outlier = problem.outlier.data();
  for (const InstructionSet set : available_instruction_sets()) {
    FilterState state = problem.first;
    EXPECT_EQ(filter.run(state, run, set), 30u) << to_string(set);
  }
}

}  // namespace risley::estimation::filter_test
