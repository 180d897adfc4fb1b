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

/// Options that differ from others in one field.
template <class Options, class Value>
Options with(Value Options::*field, std::type_identity_t<Value> value, Options options = {}) {
  options.*field = std::move(value);
  return options;
}

TEST(Entries, MomentsAskForFlagsOfAllValues) {
  const std::vector<double> values(4);
  const std::vector<unsigned char> skip(3);
  EXPECT_EQ(refusal([&] { return moments(values, skip); }),
            "skip has 3 values, expected 4 or none");
}

TEST(Entries, RobustScaleAsksForPairs) {
  const std::vector<double> azimuth(4), zenith(3);
  EXPECT_EQ(refusal([&] { return robust_scale(azimuth, zenith); }),
            "zenith has 3 values, expected 4");
}

TEST(Entries, AutocorrelationAsksForColumnsOfOneLength) {
  const std::vector<std::int64_t> still(200, 5);
  const std::vector<double> azimuth(200), zenith(200), few(199);
  const std::vector<unsigned char> skip(200);
  EXPECT_EQ(refusal([&] { return autocorrelation(still, few, zenith, skip); }),
            "azimuth has 199 values, expected 200");
  EXPECT_EQ(refusal([&] { return autocorrelation(still, azimuth, few, skip); }),
            "zenith has 199 values, expected 200");
  EXPECT_EQ(refusal([&] {
              return autocorrelation(still, azimuth, zenith, {skip.data(), 7});
            }),
            "skip has 7 values, expected 200 or none");
}

TEST(Entries, AngleProfilerAsksForABinAndCountsNoNan) {
  EXPECT_EQ(refusal([] { return AngleProfiler(0); }), "bins = 0, allowed 1 or more");
  AngleProfiler profiler(4);
  profiler.add(kNan, 1.0, 1.0);
  profiler.add(0.1, kNan, 1.0);
  profiler.add(0.1, 2.0, 1.0);
  EXPECT_THAT(profiler.result().count, ::testing::ElementsAre(1, 0, 0, 0));
  EXPECT_EQ(profiler.result().mean_azimuth[0], 2.0);
}

TEST(Entries, NoiseAsksForNumbersAndColumnsOfTheSeries) {
  const AngleSeries series = shots(4);
  const std::vector<double> four(4), three(3);
  const std::vector<unsigned char> outlier(4), few(3);
  EXPECT_EQ(refusal([] {
              return usable_noise({kNan, 1e-4});
            }),
            "azimuth noise = nan rad, allowed 0 and above");
  EXPECT_EQ(refusal([&] { return robust_noise(series, four, three); }),
            "zenith has 3 values, expected 4");
  SquaredAngles squares;
  EXPECT_EQ(refusal([&] { squares.add(series, three, four, outlier); }),
            "azimuth residuals has 3 values, expected 4");
  EXPECT_EQ(refusal([&] { squares.add(series, four, four, few); }),
            "outlier has 3 values, expected 4");
  EXPECT_THAT(refusal([&] { return noise_components(squares, 1, 1); }),
              ::testing::StartsWith("used share = 1, allowed 0 to "));
  EXPECT_EQ(refusal([&] { return noise_components(squares, 0, kNan); }),
            "square factor = nan, allowed above 0");
}

TEST(Entries, SeriesAskForRowsThatAreThere) {
  AngleSeries series = shots(4);
  EXPECT_EQ(refusal([&] {
              series.append(shots(2), 2);
              return 0;
            }),
            "row = 2, allowed 0 to 1");
  EXPECT_EQ(refusal([&] { return rows_of(series, 2, 5); }), "rows = [2, 5), allowed within [0, 4)");
  EXPECT_EQ(refusal([&] {
              return thinning_stride(series, {0, 5}, 1);
            }),
            "rows = [0, 5), allowed within [0, 4)");
  EXPECT_EQ(refusal([&] {
              return thinning_stride(series, {0, 4}, 0);
            }),
            "most = 0, allowed 1 or more");
  std::vector<ShotRange> ranges{{3, 9}};
  EXPECT_EQ(refusal([&] { return thinned(series, 1000.0, ranges); }),
            "range = [3, 9), allowed within [0, 4)");
  RotorStates states;
  states.resize(2, 4);
  EXPECT_EQ(refusal([&] {
              return rows_of(states, {3, 5});
            }),
            "shots = [3, 5), allowed within [0, 4)");
}

TEST(Entries, AnEmptyRangeAtTheEndStaysEmpty) {
  const AngleSeries series = shots(4);
  std::vector<ShotRange> ranges{{0, 4}, {4, 4}};
  EXPECT_EQ(thinned(series, 1e9, ranges).size(), 4U);
  EXPECT_EQ(ranges[1].size(), 0U);
}

TEST(Entries, RatesAndGapsAreNumbers) {
  const AngleSeries series = shots(4);
  std::vector<ShotRange> ranges{{0, 4}};
  for (const double rate : {0.0, -1.0, kNan}) {
    EXPECT_THAT(refusal([&] { return thinned(series, rate, ranges); }),
                ::testing::AllOf(::testing::StartsWith("rate = "),
                                 ::testing::EndsWith(" Hz, allowed above 0")));
    EXPECT_THAT(refusal([&] { return ShotSelector({.rate = rate}); }),
                ::testing::StartsWith("rate = "));
  }
  EXPECT_THAT(refusal([&] { return stretches(series, kNan); }),
              ::testing::StartsWith("longest gap = nan s, allowed 0 to "));
}

TEST(Entries, AStepNeedsTwoTimes) {
  const std::vector<std::int64_t> one{7};
  EXPECT_EQ(refusal([&] { return median_step_ns(one); }), "number of times = 1, allowed 2 or more");
}

TEST(Entries, KnotsAskForRotorsAnIntervalAndRows) {
  const AngleSeries series = shots(4);
  const std::vector<ShotRange> all{{0, 4}}, beyond{{0, 5}};
  EXPECT_EQ(refusal([&] { return make_knots(series, all, 0); }),
            "number of prisms = 0, allowed 1 to 4");
  EXPECT_THAT(refusal([&] { return make_knots(series, all, 2, 0.0); }),
              ::testing::StartsWith("interval = 0 s, allowed 1e-09 to "));
  EXPECT_EQ(refusal([&] { return make_knots(series, beyond, 2); }),
            "range = [0, 5), allowed within [0, 4)");
}

TEST(Entries, TrajectoriesAskForCovariancesThatAreThere) {
  const std::vector<ShotRange> all{{0, 4}};
  RotorTrajectory knots = make_knots(shots(4), all, 2);
  EXPECT_EQ(refusal([&] { return knots.angle_covariance(0, 0, 0, 0.0); }),
            "knot = 0, but there are none");
  knots.covariance.resize(knots.size() * 21);
  EXPECT_EQ(refusal([&] { return knots.angle_covariance(0, 0, 2, 0.0); }),
            "rotor = 2, allowed 0 to 1");
  EXPECT_EQ(refusal([&] { return knots.speed_variance_terms(9, 0); }),
            "knot = 9, allowed 0 to " + std::to_string(knots.size() - 1));
}

TEST(Entries, WeakDirectionsAskForInformationOfTheFreeParameters) {
  const auto free = free_parameters({"refractive_index"}, {2});
  EXPECT_EQ(refusal([&] { return weak_directions(Eigen::MatrixXd::Identity(2, 2), free, 0.5); }),
            "rows of the information has 2 values, expected 1");
  EXPECT_EQ(refusal([&] { return weak_directions(Eigen::MatrixXd::Identity(1, 1), free, kNan); }),
            "most sigma = nan, allowed above 0");
}

TEST(Entries, HalfStepsAskForRangesOfAllShotsAndNoise) {
  AngleSeries series = shots(4);
  EXPECT_EQ(refusal([&] { return half_step_signal(series, -1.0); }),
            "noise = -1 rad, allowed 0 and above");
  series.range.resize(3);
  EXPECT_EQ(refusal([&] { return half_step_signal(series, 1e-4); }),
            "range has 3 values, expected 4 or none");
  EXPECT_EQ(refusal([&] {
              add_half_steps(series, Eigen::Matrix3d::Identity());
              return 0;
            }),
            "range has 3 values, expected 4 or none");
}

TEST(Entries, DefaultParametersAskForPrisms) {
  EXPECT_EQ(refusal([] { return default_free_names({0}); }),
            "number of prisms = 0, allowed 1 to 4");
}

TEST(Entries, AStoredPoseAsksForAFieldOfView) {
  EXPECT_EQ(refusal([] { return judge_stored_pose(shots(4), shots(4), kNan); }),
            "field of view = nan rad, allowed 0 and above");
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

  int run(const ShotColumns& columns = {}) {
    accumulate(series, knots, train, free, weights, equations, columns);
    return 0;
  }
};

TEST(Entries, NormalEquationsAskForShotsKnotsAndNoiseThatFit) {
  {
    Linear linear;
    linear.series.zenith.pop_back();
    EXPECT_EQ(refusal([&] { return linear.run(); }), "zenith has 3 values, expected 4");
  }
  {
    Linear linear;
    linear.knots.last_shot.back() = 5;
    EXPECT_EQ(refusal([&] { return linear.run(); }),
              "shots of a knot = [0, 5), allowed within [0, 4)");
  }
  {
    Linear linear;
    linear.knots.state.pop_back();
    EXPECT_EQ(refusal([&] { return linear.run(); }), "state has 5 values, expected 6");
  }
  {
    Linear linear;
    linear.train = PrismTrain(parse_face_order("PA-AP-PA"));
    EXPECT_EQ(refusal([&] { return linear.run(); }),
              "number of prisms of the knots = 2, allowed 3 to 3");
  }
  {
    Linear linear;
    linear.weights.angle_noise.zenith = 0;
    EXPECT_EQ(refusal([&] { return linear.run(); }), "angle noise = 0 deg, allowed above 0");
  }
  {
    Linear linear;
    linear.weights.cut = kNan;
    EXPECT_EQ(refusal([&] { return linear.run(); }), "cut = nan, allowed above 0");
  }
  {
    Linear linear;
    std::vector<double> residual(4);
    ShotColumns columns;
    columns.azimuth_residual = residual;
    EXPECT_EQ(refusal([&] { return linear.run(columns); }),
              "zenith_residual has 0 values, expected 4");
  }
  {
    Linear linear;
    linear.train = {};
    EXPECT_EQ(refusal([&] { return linear.run(); }), "number of prisms = 0, allowed 1 to 4");
  }
  {
    Linear linear;
    linear.series.beam = {0, 0, 1, 0};
    EXPECT_EQ(refusal([&] { return linear.run(); }), "beam = 1 in row 2, allowed 0 to 0");
  }
  {
    Linear linear;
    linear.free.front().places = {15};
    EXPECT_EQ(refusal([&] { return linear.run(); }),
              "place of refractive_index = 15, allowed 0 to 14");
    linear.free.front().places = {-1};
    EXPECT_EQ(refusal([&] { return linear.run(); }),
              "place of refractive_index = -1, allowed 0 to 14");
    linear.free = std::vector<FreeParameter>(16);
    EXPECT_EQ(refusal([&] { return linear.run(); }),
              "number of free parameters = 16, allowed 0 to 15");
  }
  Linear linear;
  EXPECT_EQ(refusal([&] { return linear.run(); }), "");
  EXPECT_EQ(refusal([&] {
              linear.equations.scale(0);
              return 0;
            }),
            "factor = 0, allowed above 0");
  EXPECT_EQ(NormalEquations{}.knots(), 0U);
}

TEST(Entries, NormalEquationsAskForAnInstructionSetOfTheProcessor) {
  Linear linear;
  EXPECT_THAT(
      refusal([&] {
        accumulate(linear.series, linear.knots, linear.train, linear.free, linear.weights,
                   linear.equations, {}, static_cast<InstructionSet>(3));
      }),
      ::testing::StartsWith("instruction set = unknown, this processor and binary allow baseline"));
  EXPECT_EQ(linear.equations.knots(), 0U);
}

TEST(Entries, SmootherAsksForOneProcessPerRotorAndAPriorOfTheFreeParameters) {
  Linear linear;
  linear.run();
  const ParameterPrior prior{Eigen::VectorXd::Ones(1), Eigen::VectorXd::Zero(1)};
  std::vector<RotorProcess> process(2, kTypicalRotor);
  const auto run = [&](const ParameterPrior& p) {
    return smooth(linear.equations, linear.knots, process, p, false);
  };
  EXPECT_EQ(refusal([&] {
              return run({Eigen::VectorXd::Ones(2), prior.gradient});
            }),
            "prior information has 2 values, expected 1");
  EXPECT_EQ(refusal([&] {
              return run({prior.information, Eigen::VectorXd::Zero(2)});
            }),
            "prior gradient has 2 values, expected 1");
  process.pop_back();
  EXPECT_EQ(refusal([&] { return run(prior); }),
            "process noise for 1 rotors given, the train has 2");
  linear.knots.prisms = 7;
  EXPECT_EQ(refusal([&] { return run(prior); }), "number of prisms = 7, allowed 1 to 4");
}

TEST(Entries, RotorWindowsAskForARotorOfTheTrain) {
  Linear linear;
  linear.run();
  EXPECT_EQ(refusal([&] { return RotorWindows(linear.equations, linear.knots, 2); }),
            "rotor = 2, allowed 0 to 1");
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

using Processes = std::vector<RotorProcess>;

/// Options that differ in one member.
template <class Options, class Member, class Value>
Options with(Options options, Member Options::*member, const Value& value) {
  options.*member = value;
  return options;
}

EkfOptions quiet() { return with(EkfOptions{}, &EkfOptions::angle_noise, 1e-4); }

TEST(Entries, TheBatchEstimatorAsksForAStartOfEveryRotorAndSoundOptions) {
  const AngleSeries series = shots(4);
  const auto run = [&](const Start& start, const BatchMapOptions& options) {
    return refusal([&] { return run_batch_map(series, start, two_prisms(), options); });
  };
  Start start = two_rotors();
  start.rotation_angle.pop_back();
  EXPECT_EQ(run(start, {}), "rotation_angle of the start has 1 values, expected 2");
  start = two_rotors();
  start.angular_velocity[1] = kNan;
  EXPECT_EQ(run(start, {}), "angular_velocity of the start = nan rad/s, allowed finite");
  start = two_rotors();
  EXPECT_THAT(run(start, with(BatchMapOptions{}, &BatchMapOptions::knot_interval, kNan)),
              ::testing::StartsWith("knot interval = nan s, allowed 1e-09 to "));
  EXPECT_EQ(run(start, with(BatchMapOptions{}, &BatchMapOptions::frame_sigma, -1)),
            "frame sigma = -1 rad, allowed 0 and above");
  EXPECT_EQ(run(start, with(BatchMapOptions{}, &BatchMapOptions::outlier_chi2, 0)),
            "outlier chi2 = 0, allowed above 0");
  EXPECT_EQ(run(start, with(BatchMapOptions{}, &BatchMapOptions::most_iterations, 0)),
            "most iterations = 0, allowed 1 or more");
  EXPECT_EQ(run(start,
                with(BatchMapOptions{}, &BatchMapOptions::rotor_process, Processes{kTypicalRotor})),
            "process noise for 1 rotors given, the train has 2");
  EXPECT_EQ(run(start, with(BatchMapOptions{}, &BatchMapOptions::rotor_process,
                            Processes{kTypicalRotor, {kNan, 0, 0}})),
            "acceleration = nan rad/s/sqrt(s), allowed 0 and above");
}

TEST(Entries, TheFilterAsksForAStartOfEveryRotorAndSoundOptions) {
  const AngleSeries series = shots(4);
  const auto run = [&](const Start& start, const EkfOptions& options) {
    return refusal([&] { return run_ekf(series, start, options); });
  };
  const EkfOptions usual = with(&EkfOptions::angle_noise, 1e-4);
  EXPECT_EQ(run(two_rotors(), with(quiet(), &EkfOptions::angle_noise, kNan)),
            "angle noise = nan deg, allowed above 0");
  EXPECT_EQ(run(two_rotors(), with(quiet(), &EkfOptions::parameter_walk, -1)),
            "parameter walk = -1 rad/sqrt(s), allowed 0 and above");
  EXPECT_EQ(run(two_rotors(), with(quiet(), &EkfOptions::gate_chi_square, kNan)),
            "gate = nan, allowed above 0");
  EXPECT_EQ(run(two_rotors(), with(quiet(), &EkfOptions::passes, 0)),
            "passes = 0, allowed 1 or more");
  Start start = two_rotors();
  start.angular_velocity.clear();
  EXPECT_EQ(run(start, quiet()), "angular_velocity of the start has 0 values, expected 2");
  EXPECT_EQ(run(two_rotors(), with(quiet(), &EkfOptions::rotor_process, Processes{kTypicalRotor})),
            "process noise for 1 rotors given, the train has 2");
}

TEST(Entries, TrackingAsksForKnotsAndShotsThatAreThere) {
  Linear linear;
  const auto run = [&](ShotRange rows, std::size_t last, const Start& start) {
    return refusal([&] {
      track_rotors(linear.series, rows, start, equal_noise(1e-4), linear.knots, 0, last);
      return 0;
    });
  };
  EXPECT_EQ(run({0, 5}, 1, two_rotors()), "shots = [0, 5), allowed within [0, 4)");
  EXPECT_EQ(run({0, 4}, 2, two_rotors()), "knots = [0, 2), allowed within [0, 1)");
  EXPECT_EQ(run({0, 4}, 1, Start{}), "rotation_angle of the start has 0 values, expected 2");
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
  std::string run() const {
    return refusal([&] { return evaluate(estimate, sensor, truth); });
  }
};

TEST(Entries, EvaluationAsksForShotsAndColumnsOfTheEstimate) {
  EXPECT_EQ(Judged().run(), "");
  {
    Judged judged;
    judged.estimate.sensor.train = {};
    EXPECT_EQ(judged.run(), "number of prisms = 0, allowed 1 to 4");
  }
  {
    Judged judged;
    judged.estimate.states.resize(2, 0);
    EXPECT_EQ(judged.run(), "shots of the estimate = 0, allowed 1 or more");
  }
  {
    Judged judged;
    judged.estimate.states.rotation_angle.pop_back();
    EXPECT_EQ(judged.run(), "rotation_angle has 1 values, expected 2");
  }
  {
    Judged judged;
    judged.estimate.states.angular_velocity[1].pop_back();
    EXPECT_EQ(judged.run(), "a column of angular_velocity has 3 values, expected 4");
  }
  {
    Judged judged;
    judged.estimate.states.angular_velocity_sigma.clear();
    EXPECT_EQ(judged.run(), "angular_velocity_sigma has 0 values, expected 2");
  }
  {
    Judged judged;
    judged.estimate.states.rotation_angle_covariance.pop_back();
    EXPECT_EQ(judged.run(), "rotation_angle_covariance has 2 values, expected 3");
  }
  Judged judged;
  judged.estimate.free = free_parameters({"refractive_index"}, {2});
  EXPECT_EQ(judged.run(), "number of values of the estimate = 0, allowed 1 or more");
  judged.estimate.values.resize(1);
  EXPECT_EQ(judged.run(), "a column of the covariance has 0 values, expected 1");
  judged.estimate.covariance.resize(1, 2);
  EXPECT_EQ(judged.run(), "a row of the covariance has 2 values, expected 1");
}

TEST(Entries, EvaluationAsksForTheTruthOfTheRecording) {
  {
    Judged judged;
    judged.sensor.train = PrismTrain(parse_face_order("PA-AP-PA"));
    EXPECT_EQ(judged.run(), "number of prisms of the true sensor = 3, allowed 2 to 2");
  }
  {
    Judged judged;
    judged.sensor.train = PrismTrain(parse_face_order("PA-AP"), 6);
    EXPECT_EQ(judged.run(), "number of emitters of the true sensor = 6, allowed 1 to 1");
  }
  {
    Judged judged;
    judged.truth.resize(3, 4);
    EXPECT_EQ(judged.run(), "rotation_angle has 3 values, expected 2");
  }
  {
    Judged judged;
    judged.truth.zenith.pop_back();
    EXPECT_EQ(judged.run(), "zenith_deg has 3 values, expected 4");
  }
  Judged judged;
  judged.truth.time_ns = {0, 10'000, 20'001, 30'000};
  EXPECT_EQ(judged.run(), "the truth belongs to another recording: 1 of 4 shots have no row in it");
}

}  // namespace risley::estimation::entries_test
