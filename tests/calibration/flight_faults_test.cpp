// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Flights whose trajectory or ground is not what is stated of them. RISLEY_SEEDS=20 makes the Monte
// Carlo of so many.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/calibration/flight_calibration.hpp"
#include "risley/core/angle.hpp"

#include "calibration/flights.hpp"
#include "calibration/process_check.hpp"
#include "seeds.hpp"
#include "warning_codes.hpp"

namespace risley::calibration::flight_faults_test {

using testing::FlightJump;
using testing::FlightSettings;
using testing::SimulatedFlight;

FlightSettings short_flight(int seed) {
  FlightSettings settings;
  settings.strip_length = 40;
  settings.shot_rate = 2500;
  settings.seed = static_cast<std::uint64_t>(seed);
  return settings;
}

/// A GNSS fix that is lost and regained, and an alignment of the IMU.
void add_jumps(FlightSettings& settings) {
  std::mt19937_64 generator(settings.seed + 5000);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto sign = [&] { return uniform(generator) < 0.5 ? -1.0 : 1.0; };
  const double duration = settings.strip_length / settings.speed;
  FlightJump fix;
  fix.strip = settings.seed % 4;
  fix.begin = duration * (0.2 + 0.2 * uniform(generator));
  fix.end = fix.begin + duration * (0.2 + 0.2 * uniform(generator));
  fix.size = {0.04 * sign(), 0.025 * sign(), 0.04 * sign(), 0, 0, 0};
  FlightJump alignment;
  alignment.strip = (settings.seed + 1 + settings.seed / 4) % 4;
  alignment.begin = duration * (0.3 + 0.4 * uniform(generator));
  alignment.size = {0, 0, 0, 0.03 * sign(), 0.03 * sign(), 0.1 * sign()};
  settings.jumps = {fix, alignment};
}

FlightCalibration calibrated(const SimulatedFlight& flight, double stated = 1) {
  FlightCalibrationOptions options = flight.options();
  options.coarse_shots = 40000;
  options.knot_spacing = 0.5;
  for (trajectories::ErrorTerm& term : options.errors.terms) *term.sigma *= stated;
  return calibrate_flight(flight.shots, flight.trajectory, options);
}

/// True over stated errors of the flights that are not undecided.
struct Honesty {
  double total = 0, shape = 0, lever = 0;  ///< sums of squares
  int flights = 0, said = 0;

  void add(const SimulatedFlight& flight, const FlightSettings& settings,
           const FlightCalibration& found) {
    if (found.verdict.code == CalibrationCode::undecided) {
      ++said;
      return;
    }
    const auto errors = flight_errors(flight, settings, found);
    ++flights;
    total += std::pow(errors.total / found.datum.total, 2);
    shape += std::pow(errors.shape / found.datum.shape, 2);
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<std::size_t>(FlightUnknowns::lever_arm(axis));
      lever += std::pow(errors.error[at] / found.unknowns[at].sigma, 2) / 3;
    }
  }

  /// 1.3 sigmas RMS over 20 flights; fewer may be off by more.
  void expect(const char* name) const {
    const double n = std::max(1, flights);
    std::printf("%s\n", fmt::format("{}: {} undecided, {} others: true over stated total {:.2f}, "
                                    "shape {:.2f}, lever arm {:.2f}",
                                    name, said, flights, std::sqrt(total / n), std::sqrt(shape / n),
                                    std::sqrt(lever / n))
                            .c_str());
    const double room = flights < 20 ? 1 + 2 / std::sqrt(n) : 1;
    EXPECT_LT(std::sqrt(total / n), 1.3 * room) << name;
    EXPECT_LT(std::sqrt(shape / n), 1.3 * room) << name;
    EXPECT_LT(std::sqrt(lever / n), 1.3 * room) << name;
  }
};

TEST(FlightFaults, JumpsAreNamedAndMended) {
  Honesty honesty;
  for (int seed = 1; seed <= testing::seeds_or(2); ++seed) {
    FlightSettings settings = short_flight(seed);
    add_jumps(settings);
    const SimulatedFlight flight(settings);
    const FlightCalibration found = calibrated(flight);
    honesty.add(flight, settings, found);
    const TrajectoryFit& fit = found.trajectory_fit;
    EXPECT_TRUE(fit.fits);
    EXPECT_THAT(codes_of(found.warnings), ::testing::Contains("trajectory_jumps"));
    // The position there and back, and the attitude, each at its time and of its size.
    const auto seen_at = [&](std::size_t strip, double time) {
      return std::ranges::find_if(fit.jumps, [&](const TrajectoryJump& jump) {
        const auto first = std::ranges::find(flight.shots.strip, strip);
        const double of_strip =
            1e-9 * static_cast<double>(flight.shots.time_ns[first - flight.shots.strip.begin()]);
        const double begin = 1e-9 * static_cast<double>(jump.begin_ns) - of_strip,
                     end = 1e-9 * static_cast<double>(jump.end_ns) - of_strip;
        return begin - 0.51 < time && time < end + 0.51;
      });
    };
    const FlightJump &fix = settings.jumps[0], &alignment = settings.jumps[1];
    const auto up = seen_at(fix.strip, fix.begin), down = seen_at(fix.strip, fix.end),
               turned = seen_at(alignment.strip, alignment.begin);
    ASSERT_TRUE(up != fit.jumps.end() && down != fit.jumps.end() && turned != fit.jumps.end())
        << "seed " << seed;
    EXPECT_NEAR(up->size[2], -fix.size[2], 0.012) << "seed " << seed;
    EXPECT_NEAR(down->size[2], fix.size[2], 0.012) << "seed " << seed;
    EXPECT_NEAR(degrees_from_radians(turned->size[3]), -alignment.size[3], 0.02);
    EXPECT_NEAR(degrees_from_radians(turned->size[5]), alignment.size[5], 0.07);
    EXPECT_GT(std::min({up->score, down->score, turned->score}), 5);
  }
  honesty.expect("jumps");
}

TEST(FlightFaults, HealthyTrajectoriesFitAsTheyAre) {
  for (int seed = 1; seed <= testing::seeds_or(2); ++seed) {
    FlightSettings settings = short_flight(seed);
    const SimulatedFlight flight(settings);
    const FlightCalibration found = calibrated(flight);
    const TrajectoryFit& fit = found.trajectory_fit;
    EXPECT_TRUE(fit.fits);
    EXPECT_TRUE(fit.jumps.empty()) << "seed " << seed;
    double chi2 = 0, expected = 0;
    for (std::size_t c = 0; c < fit.factor.size(); ++c) {
      EXPECT_EQ(fit.factor[c], 1) << "seed " << seed;
      chi2 += fit.chi2[c];
      expected += fit.expected[c];
    }
    EXPECT_NEAR(chi2 / expected, 1, 5 * std::sqrt(2 / expected)) << "seed " << seed;
    EXPECT_EQ(found.roughness, 0) << "seed " << seed;
    EXPECT_FALSE(found.clock_contradicts);
    EXPECT_EQ(found.verdict.code == CalibrationCode::undecided, found.attitude_delay.significant);
  }
}

TEST(FlightFaults, ErrorsLargerThanStatedAreCountedAsTheyAre) {
  Honesty honesty;
  for (int seed = 1; seed <= testing::seeds_or(2); ++seed) {
    FlightSettings settings = short_flight(seed);
    const SimulatedFlight flight(settings);
    const FlightCalibration found = calibrated(flight, 0.25);
    honesty.add(flight, settings, found);
    if (found.verdict.code == CalibrationCode::undecided) continue;
    const auto& factor = found.trajectory_fit.factor;
    EXPECT_GT(*std::ranges::max_element(factor), 2);
    EXPECT_THAT(codes_of(found.warnings), ::testing::Contains("trajectory_errors"));
  }
  honesty.expect("errors stated too small by 4");
}

TEST(FlightFaults, LateAttitudesAreSaid) {
  Honesty honesty;
  for (int seed = 1; seed <= testing::seeds_or(2); ++seed) {
    FlightSettings settings = short_flight(seed);
    settings.attitude_delay = 0.005;
    const SimulatedFlight flight(settings);
    const FlightCalibration found = calibrated(flight);
    EXPECT_NEAR(found.attitude_delay.value, 0.005, 4 * found.attitude_delay.sigma);
    EXPECT_LT(found.attitude_delay.sigma, 0.0015);
    if (found.attitude_delay.significant) {
      EXPECT_THAT(codes_of(found.warnings), ::testing::Contains("clocks_disagree"));
      EXPECT_NE(found.verdict.words.find("late by"), std::string::npos);
    }
    honesty.add(flight, settings, found);
  }
  honesty.expect("late attitudes");
  EXPECT_GE(honesty.said, honesty.flights);
}

TEST(FlightFaults, RoughGroundIsHonest) {
  Honesty honesty;
  for (int seed = 1; seed <= testing::seeds_or(2); ++seed) {
    FlightSettings settings = short_flight(seed);
    settings.roughness = 0.05;
    settings.roughness_length = 1.5;
    const SimulatedFlight flight(settings);
    const FlightCalibration found = calibrated(flight);
    EXPECT_GT(found.roughness, 0.003) << "seed " << seed;
    EXPECT_LT(found.roughness, 0.012) << "seed " << seed;
    EXPECT_TRUE(found.trajectory_fit.fits);
    honesty.add(flight, settings, found);
  }
  honesty.expect("rough ground");
}

TEST(FlightFaults, EverythingTogether) {
  Honesty honesty;
  for (int seed = 1; seed <= testing::seeds_or(1); ++seed) {
    FlightSettings settings = short_flight(seed);
    add_jumps(settings);
    settings.attitude_delay = 0.005;
    settings.roughness = 0.03;
    settings.roughness_length = 1.5;
    const SimulatedFlight flight(settings);
    const FlightCalibration found = calibrated(flight);
    EXPECT_FALSE(found.trajectory_fit.jumps.empty());
    honesty.add(flight, settings, found);
  }
  honesty.expect("everything together");
}

// A process whose steps have their variance, but for one.
TEST(ProcessCheck, FindsTheStepThatJumps) {
  FlightSettings settings = short_flight(1);
  const SimulatedFlight flight(settings);
  const TrajectoryKnots knots = make_knots(flight.shots, 0.5);
  FlightPriors priors{
      .process = {settings.errors, flight.trajectory}, .mean = {}, .information = {}};
  const Eigen::Index count = knots.size();
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd truth(kCorrections, count);
  FlightSystem::Band band{Eigen::VectorXd(kCorrections * count),
                          Eigen::VectorXd::Zero(kCorrections * (count - 1))};
  for (int c = 0; c < kCorrections; ++c) {
    const KnotSteps steps = knot_steps(knots, priors.process, c);
    double value = 0;
    for (Eigen::Index k = 0; k < count; ++k) {
      value = steps.decay[k] * value + steps.sigma[k] * normal(generator);
      truth(c, k) = value;
      // Known but for a hundredth of its step.
      band.diagonal[kCorrections * k + c] = 1e-4 * steps.sigma[k] * steps.sigma[k];
    }
  }
  const ProcessCheck sound = check_process(knots, truth, priors, band);
  EXPECT_TRUE(jumps_of(knots, sound).empty());
  EXPECT_EQ(process_factors(knots, sound), Eigen::VectorXd::Ones(kCorrections));
  for (int c = 0; c < kCorrections; ++c) {
    EXPECT_NEAR(sound.expected[c], static_cast<double>(count), 0.01 * static_cast<double>(count));
    EXPECT_NEAR(sound.chi2[c] / sound.expected[c], 1,
                5 * std::sqrt(2.0 / static_cast<double>(count)));
  }
  Eigen::MatrixXd jumping = truth;
  jumping.row(2).tail(count - 11).array() += 0.05;
  const ProcessCheck found = check_process(knots, jumping, priors, band);
  EXPECT_EQ(jumps_of(knots, found), std::vector<std::size_t>{10});
  EXPECT_NEAR(found.jump(2, 10), 0.05, 0.02);
  // A break there makes the jump an ordinary step.
  priors.breaks = {{.knot = 10, .sigma = {0, 0, 0.1, 0, 0, 0}}};
  EXPECT_TRUE(jumps_of(knots, check_process(knots, jumping, priors, band)).empty());
  const ProcessCheck large = check_process(knots, 3 * truth, priors, band);
  for (int c = 0; c < kCorrections; ++c) EXPECT_NEAR(process_factors(knots, large)[c], 3, 0.9);
}

}  // namespace risley::calibration::flight_faults_test
