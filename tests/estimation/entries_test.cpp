// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <cstdint>
#include <limits>
#include <vector>

#include <gmock/gmock.h>

#include "risley/estimation/angle_noise.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/batch_map.hpp"
#include "risley/estimation/coordinate_rounding.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/ekf.hpp"
#include "risley/estimation/evaluation.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/estimation/process_likelihood.hpp"
#include "risley/estimation/rotor_states.hpp"
#include "risley/estimation/rotor_track.hpp"
#include "risley/estimation/rotor_trajectory.hpp"
#include "risley/estimation/smoother.hpp"
#include "risley/estimation/stored_pose.hpp"
#include "risley/estimation/weak_directions.hpp"

#include "refusal.hpp"

namespace risley::estimation::entries_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

AngleSeries shots(std::size_t count, std::int64_t step_ns = 10'000) {
  AngleSeries series;
  for (std::size_t i = 0; i < count; ++i) {
    series.append(static_cast<std::int64_t>(i) * step_ns, 0.1, 1.5);
  }
  return series;
}

TEST(Entries, StatisticsAskForColumnsOfOneLengthAndNumbers) {
  const AngleSeries series = shots(4);
  const std::vector<std::int64_t> still(200, 5);
  const std::vector<double> four(4), three(3), all(200), few(199);
  const std::vector<unsigned char> outlier(4), fewer(3);
  SquaredAngles squares;
  expect_refusals({
      {"skip has 3 values, expected 4 or none", [&] { moments(four, fewer); }},
      {"zenith has 3 values, expected 4", [&] { robust_scale(four, three); }},
      {"azimuth has 199 values, expected 200", [&] { autocorrelation(still, few, all, {}); }},
      {"zenith has 199 values, expected 200", [&] { autocorrelation(still, all, few, {}); }},
      {"skip has 4 values, expected 200 or none",
       [&] { autocorrelation(still, all, all, outlier); }},
      {"bins = 0, allowed 1 or more", [] { AngleProfiler(0); }},
      {"azimuth noise = nan rad, allowed 0 and above",
       [] {
         usable_noise({kNan, 1e-4});
       }},
      {"zenith has 3 values, expected 4", [&] { robust_noise(series, four, three); }},
      {"azimuth residuals has 3 values, expected 4",
       [&] { squares.add(series, three, four, outlier); }},
      {"outlier has 3 values, expected 4", [&] { squares.add(series, four, four, fewer); }},
      {"used share = 1, allowed 0 to ...", [&] { noise_components(squares, 1, 1); }},
      {"square factor = nan, allowed above 0", [&] { noise_components(squares, 0, kNan); }},
  });
}

TEST(Entries, AngleProfilerCountsNoNan) {
  AngleProfiler profiler(4);
  profiler.add(kNan, 1.0, 1.0);
  profiler.add(0.1, kNan, 1.0);
  profiler.add(0.1, 2.0, 1.0);
  EXPECT_THAT(profiler.result().count, ::testing::ElementsAre(1, 0, 0, 0));
  EXPECT_EQ(profiler.result().mean_azimuth[0], 2.0);
}

TEST(Entries, SeriesAskForRowsRatesAndGaps) {
  AngleSeries series = shots(4);
  std::vector<ShotRange> ranges{{3, 9}};
  const std::vector<std::int64_t> one{7};
  RotorStates states;
  states.resize(2, 4);
  expect_refusals({
      {"row = 2, allowed 0 to 1", [&] { series.append(shots(2), 2); }},
      {"rows = [2, 5), allowed within [0, 4)", [&] { rows_of(series, 2, 5); }},
      {"rows = [0, 5), allowed within [0, 4)",
       [&] {
         thinning_stride(series, {0, 5}, 1);
       }},
      {"most = 0, allowed 1 or more",
       [&] {
         thinning_stride(series, {0, 4}, 0);
       }},
      {"range = [3, 9), allowed within [0, 4)", [&] { thinned(series, 1000.0, ranges); }},
      {"shots = [3, 5), allowed within [0, 4)",
       [&] {
         rows_of(states, {3, 5});
       }},
      {"rate = 0 Hz, allowed above 0", [&] { thinned(series, 0.0, ranges); }},
      {"rate = nan Hz, allowed above 0", [] { ShotSelector({.rate = kNan}); }},
      {"longest gap = nan s, allowed 0 to ...", [&] { stretches(series, kNan); }},
      {"number of times = 1, allowed 2 or more", [&] { median_step_ns(one); }},
  });
  ranges = {{0, 4}, {4, 4}};  // an empty range at the end stays empty
  EXPECT_EQ(thinned(series, 1e9, ranges).size(), 4U);
  EXPECT_EQ(ranges[1].size(), 0U);
}

TEST(Entries, KnotsAskForRotorsAnIntervalRowsAndCovariances) {
  const AngleSeries series = shots(4);
  const std::vector<ShotRange> all{{0, 4}}, beyond{{0, 5}};
  RotorTrajectory bare = make_knots(series, all, 2), knots = bare;
  knots.covariance.resize(knots.size() * 21);
  expect_refusals({
      {"number of prisms = 0, allowed 1 to 4", [&] { make_knots(series, all, 0); }},
      {"interval = 0 s, allowed 1e-09 to ...", [&] { make_knots(series, all, 2, 0.0); }},
      {"range = [0, 5), allowed within [0, 4)", [&] { make_knots(series, beyond, 2); }},
      {"knot = 0, but there are none", [&] { bare.angle_covariance(0, 0, 0, 0.0); }},
      {"rotor = 2, allowed 0 to 1", [&] { knots.angle_covariance(0, 0, 2, 0.0); }},
      {"knot = 9, allowed 0 to ...", [&] { knots.speed_variance_terms(9, 0); }},
  });
}

TEST(Entries, ParametersRangesAndPosesAskForNumbers) {
  const auto free = free_parameters({"refractive_index"}, {2});
  const auto information = [](int n) { return Eigen::MatrixXd::Identity(n, n); };
  AngleSeries series = shots(4), with_ranges = series;
  with_ranges.range.resize(3);
  expect_refusals({
      {"number of prisms = 0, allowed 1 to 4", [] { default_free_names({0}); }},
      {"rows of the information has 2 values, expected 1",
       [&] { weak_directions(information(2), free, 0.5); }},
      {"most sigma = nan, allowed above 0", [&] { weak_directions(information(1), free, kNan); }},
      {"noise = -1 rad, allowed 0 and above", [&] { half_step_signal(series, -1.0); }},
      {"range has 3 values, expected 4 or none", [&] { half_step_signal(with_ranges, 1e-4); }},
      {"range has 3 values, expected 4 or none",
       [&] { add_half_steps(with_ranges, Eigen::Matrix3d::Identity()); }},
      {"field of view = nan rad, allowed 0 and above",
       [] { judge_stored_pose(shots(4), shots(4), kNan); }},
  });
}

/// Four shots of a train of two prisms, their knots and their normal equations.
struct Linear {
  AngleSeries series = shots(4);
  std::vector<ShotRange> all{{0, 4}};
  RotorTrajectory knots = make_knots(series, all, 2);
  PrismTrain train{parse_face_order("PA-AP")};
  std::vector<FreeParameter> free = free_parameters({"refractive_index"}, {2});
  ShotWeights weights{.angle_noise = equal_noise(1e-4)};
  NormalEquations equations;

  void run(const ShotColumns& columns = {}) {
    accumulate(series, knots, train, free, weights, equations, columns);
  }
};

TEST(Entries, NormalEquationsAskForShotsKnotsAndNoiseThatFit) {
  expect_refusals<Linear>({
      {"", [](Linear&) {}},
      {"zenith has 3 values, expected 4", [](Linear& l) { l.series.zenith.pop_back(); }},
      {"shots of a knot = [0, 5), allowed within [0, 4)",
       [](Linear& l) { l.knots.last_shot.back() = 5; }},
      {"state has 5 values, expected 6", [](Linear& l) { l.knots.state.pop_back(); }},
      {"number of prisms of the knots = 2, allowed 3 to 3",
       [](Linear& l) { l.train = PrismTrain(parse_face_order("PA-AP-PA")); }},
      {"angle noise = 0 deg, allowed above 0", [](Linear& l) { l.weights.angle_noise.zenith = 0; }},
      {"cut = nan, allowed above 0", [](Linear& l) { l.weights.cut = kNan; }},
      {"number of prisms = 0, allowed 1 to 4", [](Linear& l) { l.train = {}; }},
      {"beam = 1 in row 2, allowed 0 to 0",
       [](Linear& l) {
         l.series.beam = {0, 0, 1, 0};
       }},
      {"place of refractive_index = 15, allowed 0 to 14",
       [](Linear& l) { l.free.front().places = {15}; }},
      {"place of refractive_index = -1, allowed 0 to 14",
       [](Linear& l) { l.free.front().places = {-1}; }},
      {"number of free parameters = 16, allowed 0 to 15",
       [](Linear& l) { l.free = std::vector<FreeParameter>(16); }},
  });
  Linear linear;
  std::vector<double> residual(4);
  const ShotColumns columns{residual, {}, {}};
  expect_refusals({
      {"instruction set = unknown, this processor and binary allow baseline...",
       [&] {
         accumulate(linear.series, linear.knots, linear.train, linear.free, linear.weights,
                    linear.equations, {}, static_cast<InstructionSet>(3));
       }},
      {"zenith_residual has 0 values, expected 4", [&] { linear.run(columns); }},
      {"factor = 0, allowed above 0", [&] { linear.equations.scale(0); }},
  });
  EXPECT_EQ(NormalEquations{}.knots(), 0U);
}

TEST(Entries, SmootherAndWindowsAskForRotorsAndAPriorOfTheFreeParameters) {
  Linear linear;
  linear.run();
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(1), two = Eigen::VectorXd::Ones(2);
  const std::vector<RotorProcess> process(2, kTypicalRotor), few(1, kTypicalRotor);
  RotorTrajectory other = linear.knots;
  other.prisms = 7;
  const NormalEquations& equations = linear.equations;
  expect_refusals({
      {"prior information has 2 values, expected 1",
       [&] {
         smooth(equations, linear.knots, process, {two, one}, false);
       }},
      {"prior gradient has 2 values, expected 1",
       [&] {
         smooth(equations, linear.knots, process, {one, two}, false);
       }},
      {"process noise for 1 rotors given, the train has 2",
       [&] {
         smooth(equations, linear.knots, few, {one, one}, false);
       }},
      {"number of prisms = 7, allowed 1 to 4",
       [&] {
         smooth(equations, other, few, {one, one}, false);
       }},
      {"rotor = 2, allowed 0 to 1", [&] { RotorWindows(equations, linear.knots, 2); }},
  });
}

/// A start of two rotors that fits the shots of Linear.
Start two_rotors() {
  Start start;
  start.train = PrismTrain(parse_face_order("PA-AP"));
  start.rotation_angle = {0.0, 0.0};
  start.angular_velocity = {-700.0, 500.0};
  return start;
}

sensors::Sensor two_prisms() {
  sensors::Sensor sensor;
  sensor.train = PrismTrain(parse_face_order("PA-AP"));
  sensor.angular_velocity = {-700.0, 500.0};
  return sensor;
}

/// A run of an estimator, with what it is given.
template <class Options>
struct EstimatorCall {
  AngleSeries series = shots(4);
  Start start = two_rotors();
  Options options;

  void run() const {
    if constexpr (std::is_same_v<Options, EkfOptions>) {
      run_ekf(series, start, options);
    } else {
      run_batch_map(series, start, two_prisms(), options);
    }
  }
};

TEST(Entries, TheBatchEstimatorAsksForAStartOfEveryRotorAndSoundOptions) {
  using Map = EstimatorCall<BatchMapOptions>;
  expect_refusals<Map>({
      {"rotation_angle of the start has 1 values, expected 2",
       [](Map& m) { m.start.rotation_angle.pop_back(); }},
      {"angular_velocity of the start = nan rad/s, allowed finite",
       [](Map& m) { m.start.angular_velocity[1] = kNan; }},
      {"knot interval = nan s, allowed 1e-09 to ...",
       [](Map& m) { m.options.knot_interval = kNan; }},
      {"frame sigma = -1 rad, allowed 0 and above", [](Map& m) { m.options.frame_sigma = -1; }},
      {"outlier chi2 = 0, allowed above 0", [](Map& m) { m.options.outlier_chi2 = 0; }},
      {"most iterations = 0, allowed 1 or more", [](Map& m) { m.options.most_iterations = 0; }},
      {"process noise for 1 rotors given, the train has 2",
       [](Map& m) { m.options.rotor_process = {kTypicalRotor}; }},
      {"acceleration = nan rad/s/sqrt(s), allowed 0 and above",
       [](Map& m) {
         m.options.rotor_process = {kTypicalRotor, {kNan, 0, 0}};
       }},
  });
}

TEST(Entries, TheFilterAsksForAStartOfEveryRotorAndSoundOptions) {
  struct Ekf : EstimatorCall<EkfOptions> {
    Ekf() { options.angle_noise = 1e-4; }
  };
  expect_refusals<Ekf>({
      {"angle noise = nan deg, allowed above 0", [](Ekf& e) { e.options.angle_noise = kNan; }},
      {"parameter walk = -1 rad/sqrt(s), allowed 0 and above",
       [](Ekf& e) { e.options.parameter_walk = -1; }},
      {"gate = nan, allowed above 0", [](Ekf& e) { e.options.gate_chi_square = kNan; }},
      {"passes = 0, allowed 1 or more", [](Ekf& e) { e.options.passes = 0; }},
      {"angular_velocity of the start has 0 values, expected 2",
       [](Ekf& e) { e.start.angular_velocity.clear(); }},
      {"process noise for 1 rotors given, the train has 2",
       [](Ekf& e) { e.options.rotor_process = {kTypicalRotor}; }},
  });
}

TEST(Entries, TrackingAsksForKnotsAndShotsThatAreThere) {
  Linear linear;
  const auto run = [&](ShotRange rows, std::size_t last, const Start& start) {
    track_rotors(linear.series, rows, start, equal_noise(1e-4), linear.knots, 0, last);
  };
  expect_refusals({
      {"shots = [0, 5), allowed within [0, 4)",
       [&] {
         run({0, 5}, 1, two_rotors());
       }},
      {"knots = [0, 2), allowed within [0, 1)",
       [&] {
         run({0, 4}, 2, two_rotors());
       }},
      {"rotation_angle of the start has 0 values, expected 2",
       [&] {
         run({0, 4}, 1, {});
       }},
  });
}

/// An estimate of four shots of two prisms that hits the truth.
struct Judged {
  Estimate estimate;
  sensors::Sensor sensor = two_prisms();
  recordings::TruthColumns truth;

  Judged() {
    estimate.sensor = sensor;
    estimate.states.resize(2, 4);
    truth.resize(2, 4);
    for (std::size_t i = 0; i < 4; ++i) {
      estimate.states.time_ns[i] = truth.time_ns[i] = static_cast<std::int64_t>(i) * 10'000;
    }
  }
  void run() const { evaluate(estimate, sensor, truth); }
  /// Makes one parameter free that has several values.
  void free_one(std::size_t values) {
    estimate.free = free_parameters({"refractive_index"}, {2});
    estimate.values.resize(values);
  }
};

TEST(Entries, EvaluationAsksForAnEstimateAndTheTruthOfTheRecording) {
  expect_refusals<Judged>({
      {"", [](Judged&) {}},
      {"number of prisms = 0, allowed 1 to 4", [](Judged& j) { j.estimate.sensor.train = {}; }},
      {"shots of the estimate = 0, allowed 1 or more",
       [](Judged& j) { j.estimate.states.resize(2, 0); }},
      {"rotation_angle has 1 values, expected 2",
       [](Judged& j) { j.estimate.states.rotation_angle.pop_back(); }},
      {"a column of angular_velocity has 3 values, expected 4",
       [](Judged& j) { j.estimate.states.angular_velocity[1].pop_back(); }},
      {"angular_velocity_sigma has 0 values, expected 2",
       [](Judged& j) { j.estimate.states.angular_velocity_sigma.clear(); }},
      {"rotation_angle_covariance has 2 values, expected 3",
       [](Judged& j) { j.estimate.states.rotation_angle_covariance.pop_back(); }},
      {"number of values of the estimate = 0, allowed 1 or more", [](Judged& j) { j.free_one(0); }},
      {"a column of the covariance has 0 values, expected 1", [](Judged& j) { j.free_one(1); }},
      {"a row of the covariance has 2 values, expected 1",
       [](Judged& j) {
         j.free_one(1);
         j.estimate.covariance.resize(1, 2);
       }},
      {"number of prisms of the true sensor = 3, allowed 2 to 2",
       [](Judged& j) { j.sensor.train = PrismTrain(parse_face_order("PA-AP-PA")); }},
      {"number of emitters of the true sensor = 6, allowed 1 to 1",
       [](Judged& j) { j.sensor.train = PrismTrain(parse_face_order("PA-AP"), 6); }},
      {"rotation_angle has 3 values, expected 2", [](Judged& j) { j.truth.resize(3, 4); }},
      {"zenith_deg has 3 values, expected 4", [](Judged& j) { j.truth.zenith.pop_back(); }},
      {"the truth belongs to another recording: 1 of 4 shots have no row in it",
       [](Judged& j) { j.truth.time_ns[2] = 20'001; }},
  });
}

}  // namespace risley::estimation::entries_test
