// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/rotor_tracking.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"

#include "refusal.hpp"
#include "statistics/simulated.hpp"

namespace risley::cloud::rotor_tracking_test {

using recordings::Observations;
using sensors::CalibrationReference;
using ::testing::HasSubstr;
using testing::Simulated;

/// The unit of Table 3 with rotors that swing as it saw them.
Simulated record(double duration, double rate, std::uint64_t seed) {
  auto settings = testing::table3_settings(seed);
  settings.duration = duration;
  settings.rate = rate;
  return testing::simulate(settings);
}

/// Its true parameters as a calibration against directions.
sensors::Sensor calibration() {
  sensors::Sensor sensor = sensors::load_sensor("mid-40-table3");
  sensor.reference = CalibrationReference::directions;
  sensor.angle_noise = radians_from_degrees(0.01);
  sensor.covariance_names = estimation::default_free_names({2});
  const Eigen::Index n = sensor.covariance_names.size();
  const double sigma = radians_from_degrees(0.002);
  sensor.covariance = sigma * sigma * Eigen::MatrixXd::Identity(n, n);
  return sensor;
}

SensorBelief belief_of(const Observations& rows, const sensors::Sensor& sensor) {
  estimation::ShotSelector selector({});
  selector.add(rows);
  return sensor_belief(selector.series(), selector.head(), sensor, std::nullopt);
}

Observations rows_of(const Observations& all, std::size_t begin, std::size_t end) {
  Observations rows = all;
  rows.resize(end);
  rows.drop_front(begin);
  return rows;
}

void erase_rows(Simulated& data, std::size_t begin, std::size_t end) {
  Observations rest = rows_of(data.observations, end, data.observations.size());
  data.observations.resize(begin);
  data.observations.append(rest);
  const auto cut = [begin, end](auto& column) {
    using Step = std::ptrdiff_t;
    column.erase(column.begin() + static_cast<Step>(begin),
                 column.begin() + static_cast<Step>(end));
  };
  cut(data.truth.time_ns);
  for (auto& column : data.truth.rotation_angle) cut(column);
  for (auto& column : data.truth.angular_velocity) cut(column);
}

std::size_t row_at(const Simulated& data, double seconds) {
  const auto& times = data.observations.time_ns;
  return static_cast<std::size_t>(
      std::ranges::lower_bound(times, static_cast<std::int64_t>(seconds * 1e9)) - times.begin());
}

struct Angles {
  std::vector<std::vector<double>> angle, covariance;

  Angles(const RotorTracker& tracker, const Observations& piece,
         const std::vector<std::size_t>& rows)
      : angle(2, std::vector<double>(rows.size())), covariance(3, angle[0]) {
    tracker.angles(piece, rows, angle, covariance);
  }
  Angles(const RotorTracker& tracker, const Observations& piece)
      : Angles(tracker, piece, all_rows(piece)) {}

  static std::vector<std::size_t> all_rows(const Observations& piece) {
    std::vector<std::size_t> rows(piece.size());
    std::iota(rows.begin(), rows.end(), std::size_t{0});
    return rows;
  }
  bool unknown(std::size_t i) const {
    return std::isnan(angle[0][i]) && std::isnan(angle[1][i]) && std::isnan(covariance[0][i]) &&
           std::isnan(covariance[1][i]) && std::isnan(covariance[2][i]);
  }
};

/// How angles compare with the truth.
struct Honesty {
  double worst_sigmas = 0, worst_deg = 0, squares = 0, chi2 = 0;
  std::size_t rows = 0, unknown = 0;

  /// @param first  row of the truth that is row 0 of the piece
  void add(const Angles& found, const recordings::TruthColumns& truth, std::size_t first) {
    for (std::size_t i = 0; i < found.angle[0].size(); ++i) {
      if (found.unknown(i)) {
        ++unknown;
        continue;
      }
      double error[2];
      for (std::size_t k = 0; k < 2; ++k) {
        error[k] = wrap_to_pi(found.angle[k][i] - truth.rotation_angle[k][first + i]);
        const double sigma = std::sqrt(found.covariance[k == 0 ? 0 : 2][i]);
        worst_sigmas = std::max(worst_sigmas, std::abs(error[k]) / sigma);
        worst_deg = std::max(worst_deg, degrees_from_radians(std::abs(error[k])));
        squares += error[k] * error[k];
      }
      const double a = found.covariance[0][i], ab = found.covariance[1][i],
                   b = found.covariance[2][i];
      chi2 += (error[0] * error[0] * b - 2 * error[0] * error[1] * ab + error[1] * error[1] * a) /
              (a * b - ab * ab);
      ++rows;
    }
  }

  /// Normalised estimation error squared, per degree of freedom.
  double nees() const { return chi2 / (2.0 * static_cast<double>(rows)); }

  /// Rotors that swing slowly are known a little better than the white jerk of their model says.
  void expect(double least_nees = 0.5, double most_nees = 1.25) const {
    EXPECT_LT(worst_sigmas, 4.0);
    EXPECT_GT(nees(), least_nees);
    EXPECT_LT(nees(), most_nees);
  }
  void record(const std::string& prefix) const {
    const auto one = [&prefix](const char* name, double value) {
      ::testing::Test::RecordProperty(prefix + name, fmt::format("{:.4g}", value));
    };
    one("worst_sigmas", worst_sigmas);
    one("worst_deg", worst_deg);
    one("rms_deg", degrees_from_radians(std::sqrt(squares / (2.0 * static_cast<double>(rows)))));
    one("nees", nees());
  }
};

TEST(SensorBelief, HoldsTheParametersOfACalibrationAgainstDirections) {
  const Simulated data = record(3.0, 10000, 1);
  const sensors::Sensor sensor = calibration();
  const SensorBelief belief = belief_of(data.observations, sensor);
  EXPECT_EQ(belief.sensor.train.parameters(), sensor.train.parameters());
  EXPECT_EQ(belief.start.train.parameters(), sensor.train.parameters());
  EXPECT_FALSE(belief.mirrored);
  EXPECT_EQ(belief.free.size(), sensor.covariance_names.size());
  EXPECT_EQ(belief.angle_sensitivity.rows(), 2);
  EXPECT_EQ(belief.angle_sensitivity.cols(), std::ssize(belief.free));
  EXPECT_NEAR(belief.angle_noise / sensor.angle_noise, 1.0, 0.01);  // found
  EXPECT_GE(belief.residual_variance_factor, 1.0);
  EXPECT_LT(belief.residual_variance_factor, 1.1);
}

TEST(SensorBelief, FindsTheParametersOfAType) {
  const Simulated data = record(3.0, 10000, 2);
  sensors::Sensor type = sensors::load_sensor("mid-40");
  type.angle_noise = radians_from_degrees(0.01);
  const SensorBelief belief = belief_of(data.observations, type);
  const sensors::Sensor truth = sensors::load_sensor("mid-40-table3");
  for (std::size_t j = 0; j < belief.free.size(); ++j) {
    const int place = belief.free[j].places.front();
    EXPECT_LT(std::abs(belief.sensor.train[place] - truth.train[place]),
              4.0 * std::sqrt(belief.covariance(j, j)))
        << belief.free[j].name;
  }
}

// Parameters that only the calibration has are free, those that it lacks are not.
TEST(SensorBelief, FreesWhatTheCalibrationHasFreed) {
  const Simulated data = record(2.0, 10000, 3);
  sensors::Sensor sensor = calibration();
  auto& names = sensor.covariance_names;
  std::erase(names, "prism_tilt_b_vertical_deg");
  names.back() = "angular_velocity_a_deg_per_s";
  names.push_back("range_offset_m");
  const Eigen::Index n = names.size();
  sensor.covariance = Eigen::MatrixXd(1e-6 * Eigen::MatrixXd::Identity(n, n));
  std::vector<std::string> free;
  for (const auto& one : belief_of(data.observations, sensor).free) free.push_back(one.name);
  EXPECT_EQ(std::ranges::count(free, "prism_tilt_b_vertical_deg"), 0);
  EXPECT_EQ(std::ranges::count(free, "range_offset_m"), 0);
  EXPECT_EQ(free.size(), names.size() - 2);
}

TEST(SensorBelief, RefusesTheCalibrationOfAnotherSensorByTheWorstName) {
  const Simulated data = record(2.0, 10000, 4);
  for (const char* name : {"incident_beam_vertical_deg", "prism_tilt_a_vertical_deg"}) {
    sensors::Sensor other = calibration();
    other.set(name, other.get(name) + radians_from_degrees(0.3));
    EXPECT_THAT(refusal<EstimationError>([&] { belief_of(data.observations, other); }),
                AllOf(HasSubstr("another sensor"), HasSubstr(name), HasSubstr("sigma")));
    // A wide calibration is not contradicted.
    other.covariance *= 1e6;
    EXPECT_NO_THROW(belief_of(data.observations, other)) << name;
  }
}

TEST(SensorBelief, RefusesAnotherFaceOrder) {
  const Simulated data = record(2.0, 10000, 5);
  for (const char* order : {"PA-PA", "AP-AP", "AP-PA"}) {
    sensors::Sensor other = calibration();
    PrismTrain train(parse_face_order(order));
    for (int place = 0; place < parameter_count(2); ++place) {
      train.set_place(place, other.train[place]);
    }
    other.train = train;
    EXPECT_THROW(belief_of(data.observations, other), EstimationError) << order;
  }
}

// A Mid-40 changes its speed combination at every power-up; its prisms stay what they are.
TEST(SensorBelief, TakesACalibrationMadeInTheOtherSpeedCombination) {
  const Simulated data = record(2.0, 10000, 6);
  const sensors::Sensor sensor = calibration();
  const sensors::Sensor other = sensors::with_combination(sensor, 1);
  const SensorBelief belief = belief_of(data.observations, other);
  EXPECT_EQ(belief.sensor.train.parameters(), sensor.train.parameters());
  EXPECT_EQ(belief.sensor.combination, 2);
  EXPECT_NEAR(belief.sensor.angular_velocity[0], sensor.angular_velocity[0],
              radians_from_degrees(10.0));
  EXPECT_NEAR(belief.sensor.angular_velocity[1], sensor.angular_velocity[1],
              radians_from_degrees(10.0));
}

/// Tracks a recording in pieces of so many seconds and looks at every row.
Honesty track_in_pieces(const Simulated& data, const SensorBelief& belief,
                        std::optional<double> rate, double seconds, double overlap) {
  RotorTracker tracker(belief, rate);
  Honesty honesty;
  const std::size_t rows = data.observations.size();
  const double end = 1e-9 * static_cast<double>(data.observations.time_ns.back());
  for (double from = 0; from < end - overlap; from += seconds - overlap) {
    const std::size_t begin = row_at(data, from);
    const std::size_t stop = std::min(rows, row_at(data, from + seconds));
    const Observations piece = rows_of(data.observations, begin, stop);
    tracker.track(piece);
    honesty.add(Angles(tracker, piece), data.truth, begin);
  }
  return honesty;
}

// Every row has its angles, also those that the thinned series left out.
TEST(RotorTracker, FindsTheAnglesOfEveryRowOverOverlappingPieces) {
  const Simulated data = record(5.0, 20000, 11);
  const SensorBelief belief = belief_of(data.observations, calibration());
  double last_deg = 1.0;
  for (const std::optional<double> rate :
       {std::optional<double>(1000.0), std::optional<double>(10000.0), std::optional<double>()}) {
    SCOPED_TRACE(rate.value_or(0));
    const Honesty honesty = track_in_pieces(data, belief, rate, 1.3, 0.1);
    honesty.record(fmt::format("{}_hz_", rate.value_or(20000)));
    honesty.expect(0.7);
    EXPECT_EQ(honesty.unknown, 0u);
    EXPECT_LT(honesty.worst_deg, rate == 1000.0 ? 0.05 : 0.03);
    const double rms = std::sqrt(honesty.squares / static_cast<double>(honesty.rows));
    EXPECT_LT(rms, last_deg);  // more directions, better angles
    last_deg = rms;
  }
}

// Rotors that do not run as smoothly as those of the paper.
TEST(RotorTracker, IsHonestAboutRestlessRotors) {
  for (const auto kind : {simulation::RotorKind::constant, simulation::RotorKind::hunting,
                          simulation::RotorKind::random_walk}) {
    SCOPED_TRACE(simulation::to_string(kind));
    auto settings = testing::table3_settings(21);
    settings.duration = 3.0;
    settings.rate = 20000;
    settings.rotor = kind;
    const Simulated data = testing::simulate(settings);
    const SensorBelief belief = belief_of(data.observations, calibration());
    for (const double rate : {1000.0, 10000.0}) {
      const Honesty honesty = track_in_pieces(data, belief, rate, 1.3, 0.1);
      honesty.record(fmt::format("{}_{}_hz_", simulation::to_string(kind), rate));
      // Errors of a constant rotor last as long as a piece: they are few.
      const bool constant = kind == simulation::RotorKind::constant;
      honesty.expect(constant ? 0.1 : 0.5, constant ? 2.5 : 1.25);
      EXPECT_EQ(honesty.unknown, 0u);
    }
  }
}

TEST(RotorTracker, RowsCanBeAskedForInAnyPart) {
  const Simulated data = record(2.0, 10000, 12);
  const SensorBelief belief = belief_of(data.observations, calibration());
  RotorTracker tracker(belief, 1000.0);
  tracker.track(data.observations);
  const Angles all(tracker, data.observations);
  const std::vector<std::size_t> rows{3, 4, 977, 978, 5000, 12345, 19999};
  const Angles some(tracker, data.observations, rows);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < 2; ++k) EXPECT_EQ(some.angle[k][i], all.angle[k][rows[i]]);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(some.covariance[k][i], all.covariance[k][rows[i]]);
    }
  }
  EXPECT_TRUE(Angles(tracker, data.observations, {}).angle[0].empty());
}

// The clock starts again within a piece: another recording follows the first.
TEST(RotorTracker, GoesOnAfterAClockReset) {
  const Simulated first = record(2.0, 10000, 13), second = record(1.5, 10000, 14);
  Simulated data = first;
  data.observations.append(second.observations);
  data.truth.append(second.truth);
  const SensorBelief belief = belief_of(first.observations, calibration());
  for (const std::optional<double> rate :
       {std::optional<double>(1000.0), std::optional<double>()}) {
    RotorTracker tracker(belief, rate);
    tracker.track(data.observations);
    Honesty honesty;
    honesty.add(Angles(tracker, data.observations), data.truth, 0);
    honesty.expect();
    EXPECT_EQ(honesty.unknown, 0u);

    // The next piece begins shortly before the end.
    const std::size_t begin = data.observations.size() - 1000;
    Observations next = rows_of(data.observations, begin, data.observations.size());
    tracker.track(next);
    Honesty after;
    after.add(Angles(tracker, next), data.truth, begin);
    EXPECT_LT(after.worst_sigmas, 4.0);
    EXPECT_EQ(after.unknown, 0u);
  }
}

// A piece of times that the piece before had too, with other angles.
TEST(RotorTracker, ForgetsAPieceWhoseTimesComeAgain) {
  const Simulated first = record(2.0, 10000, 15), second = record(1.5, 10000, 16);
  const SensorBelief belief = belief_of(first.observations, calibration());
  RotorTracker tracker(belief, 1000.0);
  tracker.track(first.observations);
  tracker.track(second.observations);
  Honesty honesty;
  honesty.add(Angles(tracker, second.observations), second.truth, 0);
  honesty.expect();
}

TEST(RotorTracker, GoesOnAfterAGap) {
  for (const double gap : {0.05, 1.0, 6.0}) {
    SCOPED_TRACE(gap);
    Simulated data = record(2.0 + gap, 10000, 17);
    const std::size_t begin = row_at(data, 1.0);
    erase_rows(data, begin, row_at(data, 1.0 + gap));
    const SensorBelief belief = belief_of(rows_of(data.observations, 0, begin), calibration());
    for (const double rate : {1000.0, 10000.0}) {
      RotorTracker tracker(belief, rate);
      tracker.track(data.observations);
      Honesty honesty;
      honesty.add(Angles(tracker, data.observations), data.truth, 0);
      honesty.expect();
      EXPECT_EQ(honesty.unknown, 0u);
      // A piece behind the gap alone.
      const Observations rest = rows_of(data.observations, begin, data.observations.size());
      tracker.track(rest);
      Honesty behind;
      behind.add(Angles(tracker, rest), data.truth, begin);
      EXPECT_LT(behind.worst_sigmas, 4.0);
    }
  }
}

// Rows without a direction have angles near rows with one, and none further away.
TEST(RotorTracker, TellsNothingFarFromAnyDirection) {
  Simulated data = record(2.0, 10000, 18);
  const std::size_t begin = row_at(data, 1.0), end = row_at(data, 1.2);
  for (std::size_t row = begin; row < end; ++row) data.observations.valid[row] = 0;
  const SensorBelief belief = belief_of(data.observations, calibration());
  for (const double rate : {1000.0, 10000.0}) {
    RotorTracker tracker(belief, rate);
    tracker.track(data.observations);
    const Angles found(tracker, data.observations);
    for (std::size_t row = begin; row < end; ++row) {
      const double seconds = 1e-4 * static_cast<double>(std::min(row - begin, end - row));
      if (seconds > 0.05) {
        EXPECT_TRUE(found.unknown(row));
      }
      if (seconds < 0.001) {
        EXPECT_FALSE(found.unknown(row));
      }
    }
    Honesty honesty;
    honesty.add(found, data.truth, 0);
    EXPECT_LT(honesty.worst_sigmas, 4.0);
    EXPECT_LT(honesty.unknown, end - begin);
  }
}

TEST(RotorTracker, FollowsAMirroredRecordingThatIsTurned) {
  Simulated data = record(2.5, 10000, 19);
  for (double& zenith : data.observations.zenith) zenith = kPi - zenith;
  const SensorBelief belief = belief_of(data.observations, calibration());
  ASSERT_TRUE(belief.mirrored);
  for (double& zenith : data.observations.zenith) zenith = kPi - zenith;
  const Honesty honesty = track_in_pieces(data, belief, 1000.0, 1.0, 0.1);
  honesty.expect();
}

TEST(RotorTracker, WithoutAShotThereIsNothingToFind) {
  const Simulated data = record(2.0, 10000, 20);
  const SensorBelief belief = belief_of(data.observations, calibration());
  RotorTracker tracker(belief, std::nullopt);
  Observations piece = rows_of(data.observations, 0, 500);
  for (auto& valid : piece.valid) valid = 0;
  EXPECT_THROW(tracker.track(piece), EstimationError);
  EXPECT_THROW(tracker.track({}), EstimationError);
}

}  // namespace risley::cloud::rotor_tracking_test
