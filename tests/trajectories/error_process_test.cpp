// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/error_process.hpp"

#include <cmath>
#include <string>

#include <Eigen/Eigenvalues>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

#include "refusal.hpp"
#include "trajectories/known_flight.hpp"

namespace risley::trajectories::error_process_test {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

const std::string kStated = R"(risley_trajectory_errors: 1
sample_interval_s: 0.005
north_m: {sigma: 0.02, correlation_time_s: 120, source: data sheet}
east_m: {sigma: 0.02, correlation_time_s: 120, source: data sheet}
up_m: {sigma: 0.03, correlation_time_s: 60, source: data sheet}
tilt_north_deg: {sigma: 0.025, correlation_time_s: 120, white: 0.005, source: data sheet}
tilt_east_deg: {sigma: 0.025, correlation_time_s: 120, white: 0.005, source: data sheet}
heading_deg: {sigma: 0.08, correlation_time_s: 300, white: 0.005, source: assumed}
)";

TEST(ErrorProcess, CovariancesAreThoseOfTheStatement) {
  const Trajectory t = trajectory_of(KnownFlight(), 400);
  const ErrorProcess process(parse_error_model(kStated, "errors.yaml"), t);
  const std::int64_t at = t.time_ns[100];
  const PoseErrorMatrix same = process.covariance(at);
  EXPECT_DOUBLE_EQ(same(0, 0), 0.02 * 0.02);
  EXPECT_DOUBLE_EQ(same(2, 2), 0.03 * 0.03);
  const double degree = kRadiansPerDegree;
  EXPECT_NEAR(same(3, 3), (0.025 * 0.025 + 0.005 * 0.005) * degree * degree, 1e-18);
  EXPECT_NEAR(same(5, 5), (0.08 * 0.08 + 0.005 * 0.005) * degree * degree, 1e-18);
  EXPECT_EQ(same(0, 1), 0);
  const PoseErrorMatrix apart = process.covariance(at, at + 30 * kSecond_ns);
  EXPECT_NEAR(apart(0, 0), 0.02 * 0.02 * std::exp(-0.25), 1e-16);
  EXPECT_NEAR(apart(2, 2), 0.03 * 0.03 * std::exp(-0.5), 1e-16);
  EXPECT_NEAR(apart(5, 5), 0.08 * 0.08 * degree * degree * std::exp(-0.1), 1e-18);
  EXPECT_EQ(process.covariance(at + 30 * kSecond_ns, at), apart);
}

TEST(ErrorProcess, WhitePartsAreCommonToASample) {
  const Trajectory t = trajectory_of(KnownFlight(), 400);
  const ErrorProcess process(parse_error_model(kStated, "errors.yaml"), t);
  const std::int64_t begin = t.time_ns.front() + 7 * 5'000'000;
  EXPECT_EQ(process.sample(begin), 7);
  EXPECT_EQ(process.sample(begin + 4'999'999), 7);
  EXPECT_EQ(process.sample(begin - 1), 6);
  EXPECT_EQ(process.sample(t.time_ns.front() - 1), -1);
  const double white = std::pow(0.005 * kRadiansPerDegree, 2);
  const double together = process.covariance(begin, begin + 4'999'999)(4, 4);
  const double next = process.covariance(begin, begin + 5'000'000)(4, 4);
  EXPECT_NEAR(together - next, white, 1e-3 * white);
}

TEST(ErrorProcess, AccuraciesOfTheTrajectoryHoldWhereNothingIsStated) {
  Trajectory t = trajectory_of(KnownFlight(), 400);
  t.accuracy.resize(400);
  for (std::size_t i = 0; i < 400; ++i) {
    t.accuracy[i] = {{0.01 + 1e-5 * static_cast<double>(i), 0.02, 0.03}, 1e-4, 3e-4, 5e-4};
  }
  // It flies to the east: roll turns about east, pitch about north.
  for (std::size_t i = 0; i < 400; ++i) {
    t.attitude[i] =
        Eigen::Quaterniond(ned_axes(t.frame, t.position[i])) * ned_from_body({0.1, 0.05, kPi / 2});
  }
  const ErrorProcess process(assumed_error_model(), t);
  const PoseErrorVector sigmas = process.sigmas(t.time_ns[100] + 2'500'000);
  EXPECT_NEAR(sigmas[0], 0.011005, 1e-12);
  EXPECT_NEAR(sigmas[2], 0.03, 1e-15);
  EXPECT_NEAR(sigmas[3], 3e-4, 1e-15);
  EXPECT_NEAR(sigmas[4], 1e-4, 1e-15);
  EXPECT_NEAR(sigmas[5], 5e-4, 1e-15);
  EXPECT_EQ(process.correlation_times()[5], 300);
  EXPECT_EQ(process.sigmas(t.time_ns.front() - kSecond_ns), process.sigmas(t.time_ns.front()));
  EXPECT_EQ(process.sigmas(t.time_ns.back() + kSecond_ns), process.sigmas(t.time_ns.back()));
  EXPECT_EQ(process.sample(t.time_ns[5]), process.sample(t.time_ns[300]));  // nothing white
  // What is stated goes before.
  ErrorModel model = assumed_error_model();
  model.terms[0].sigma = 0.5;
  EXPECT_EQ(ErrorProcess(model, t).sigmas(t.time_ns[7])[0], 0.5);
  EXPECT_NEAR(ErrorProcess(model, t).sigmas(t.time_ns[7])[1], 0.02, 1e-15);
}

TEST(ErrorProcess, CovariancesOfManyTimesArePositive) {
  Trajectory t = trajectory_of(KnownFlight(), 400);
  t.accuracy.resize(400);
  for (std::size_t i = 0; i < 400; ++i) {
    t.accuracy[i] = {{0.01 + 1e-4 * static_cast<double>(i % 7), 0.02, 0.03}, 1e-4, 3e-4, 5e-4};
  }
  const ErrorProcess process(assumed_error_model(), t);
  constexpr int kTimes = 30;
  Eigen::MatrixXd all(kTimes, kTimes);
  for (int i = 0; i < kTimes; ++i) {
    for (int k = 0; k < kTimes; ++k) {
      all(i, k) =
          process.covariance(t.time_ns[0] + i * 61'000'000, t.time_ns[0] + k * 61'000'000)(0, 0);
    }
  }
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(all).eigenvalues().minCoeff(), 0);
}

std::string mistake(const std::string& what, const std::string& by) {
  return refusal<FileError>([&] { parse_error_model(replaced(kStated, what, by), "errors.yaml"); });
}

TEST(ErrorModel, MistakesAreNamedWithTheirLine) {
  EXPECT_THAT(mistake("risley_trajectory_errors: 1", "a: 1"),
              NamesField("risley_trajectory_errors"));
  EXPECT_THAT(mistake("tilt_north_deg", "tilt_nort_deg"), NamesField("tilt_north_deg"));
  EXPECT_THAT(mistake("correlation_time_s: 60, ", ""), NamesField("up_m.correlation_time_s", 5));
  EXPECT_THAT(mistake("correlation_time_s: 60", "correlation_time_s: 0"), NamesField("= 0 s"));
  EXPECT_THAT(mistake("sigma: 0.03", "sigma: -1"), NamesField("up_m.sigma"));
  EXPECT_THAT(mistake("sample_interval_s: 0.005\n", ""), NamesField("sample_interval_s"));
  EXPECT_THAT(mistake("source: assumed", "source: \"\""), NamesField("heading_deg.source", 8));
  EXPECT_EQ(mistake("sigma: 0.03, ", ""), "");
}

TEST(ErrorModel, EntriesRefuseWhatMakesNoSense) {
  const Trajectory t = trajectory_of(KnownFlight(), 20);
  const auto run = [&](auto&& change) {
    ErrorModel model = parse_error_model(kStated, "errors.yaml");
    change(model);
    const std::string message = refusal([&] { require_error_model(model); });
    EXPECT_EQ(message, refusal([&] { ErrorProcess(model, t); }));
    return message;
  };
  EXPECT_EQ(run([](ErrorModel&) {}), "");
  EXPECT_EQ(run([](ErrorModel& m) { m.terms[0].sigma = -1; }),
            "sigma of north_m = -1, allowed 0 and above");
  EXPECT_THAT(run([](ErrorModel& m) { m.terms[5].correlation_time = 0; }),
              NamesField("correlation time of heading_deg"));
  EXPECT_THAT(run([](ErrorModel& m) { m.terms[3].white = std::nan(""); }),
              NamesField("white part of tilt_north_deg"));
  EXPECT_THAT(run([](ErrorModel& m) { m.sample_interval = 0; }), NamesField("sample_interval"));
  EXPECT_THAT(refusal([&] { ErrorProcess(assumed_error_model(), t); }),
              NamesField("north_m, east_m, up_m, tilt_north_deg, tilt_east_deg, heading_deg"));
  EXPECT_THAT(refusal([&] { ErrorProcess(assumed_error_model(), {}); }), NamesField("records"));
}

}  // namespace risley::trajectories::error_process_test
