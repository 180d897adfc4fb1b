// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Units against each other: the ones that are not like the others are named, and no more than
// chance allows.
#include "risley/jobs/fleet.hpp"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/sensors/preset.hpp"

#include "seeds.hpp"

namespace risley::jobs::fleet_test {

const std::vector<std::string> kFree = {
    "incident_beam_horizontal_deg", "incident_beam_vertical_deg", "prism_tilt_a_vertical_deg",
    "prism_tilt_b_horizontal_deg",  "prism_tilt_b_vertical_deg",  kRangeOffset};

/// What units of a fleet have in common.
struct FleetSettings {
  std::size_t units = 8;
  double spread = 0;    ///< among them, rad and m
  double sigma = 1e-5;  ///< of a result; of every second unit five times as much
  std::uint64_t seed = 0;
};

std::vector<sensors::Sensor> made(const FleetSettings& settings) {
  std::vector<sensors::Sensor> units;
  const sensors::Sensor preset = sensors::load_sensor("mid-40");
  for (std::size_t i = 0; i < settings.units; ++i) {
    const RandomStream stream(settings.seed, i);
    sensors::Sensor unit = preset;
    unit.serial = "unit " + std::to_string(i);
    const double sigma = i % 2 == 0 ? settings.sigma : 5 * settings.sigma;
    unit.covariance_names = kFree;
    const auto n = static_cast<Eigen::Index>(kFree.size());
    unit.covariance = sigma * sigma * Eigen::MatrixXd::Identity(n, n);
    for (std::size_t k = 0; k < kFree.size(); ++k) {
      const double off = std::hypot(settings.spread, sigma) * stream.normal(k);
      if (kFree[k] == kRangeOffset) {
        unit.range_offset += off;
      } else {
        unit.set(kFree[k], preset.get(kFree[k]) + off);
      }
      unit.set_knowledge({kFree[k], sigma, "calibrated", sigma});
    }
    units.push_back(unit);
  }
  return units;
}

int outliers_of(const Fleet& fleet) {
  int count = 0;
  for (const FleetUnit& unit : fleet.units) count += unit.outlier ? 1 : 0;
  return count;
}

TEST(Fleet, NamesTheUnitThatIsNotLikeTheOthers) {
  FleetSettings settings;
  settings.units = 20;
  settings.spread = radians_from_degrees(0.02);
  std::vector<sensors::Sensor> units = made(settings);
  const double bend = radians_from_degrees(0.5);
  units[3].set("prism_tilt_b_vertical_deg", units[3].get("prism_tilt_b_vertical_deg") + bend);
  const Fleet fleet = fleet_of(units, 0.01);
  ASSERT_EQ(fleet.units.size(), 20U);
  ASSERT_EQ(fleet.parameters.size(), kFree.size());
  for (std::size_t i = 0; i < fleet.units.size(); ++i) {
    const FleetUnit& unit = fleet.units[i];
    SCOPED_TRACE(i);
    EXPECT_TRUE(unit.tested);
    EXPECT_EQ(unit.outlier, i == 3);
    EXPECT_EQ(answer_words(unit), i == 3 ? "outlier" : "like the others");
  }
  const FleetUnit& bent = fleet.units[3];
  EXPECT_EQ(fleet.parameters[bent.worst].name, "prism_tilt_b_vertical_deg");
  EXPECT_GT(bent.robust_z[bent.worst], 10);
  EXPECT_GT(std::abs(bent.worst_z), 10);
  EXPECT_LT(bent.p_value, 0.01);
  EXPECT_GT(bent.beams.errors.shape, 2 * fleet.units[4].beams.errors.shape);
  EXPECT_GT(bent.beams.total_sigma, 0);
}

// A sum that all results know well, of two parameters that none knows.
TEST(Fleet, SeesWhatNoParameterShowsAlone) {
  FleetSettings settings;
  settings.units = 12;
  settings.sigma = 1e-6;
  std::vector<sensors::Sensor> units = made(settings);
  const char* const one = "incident_beam_vertical_deg";
  const char* const other = "prism_tilt_a_vertical_deg";
  constexpr double kUnknown = 1e-3;
  for (std::size_t i = 0; i < units.size(); ++i) {
    sensors::Sensor& unit = units[i];
    const double common = kUnknown * RandomStream(9, i).normal(0);
    unit.set(one, unit.get(one) + common);
    unit.set(other, unit.get(other) - common);
    Eigen::VectorXd along = Eigen::VectorXd::Zero(unit.covariance.rows());
    along[1] = kUnknown;
    along[2] = -kUnknown;
    unit.covariance += along * along.transpose();
    for (const char* name : {one, other})
      unit.set_knowledge({name, kUnknown, "calibrated", kUnknown});
  }
  EXPECT_EQ(outliers_of(fleet_of(units, 0.01)), 0);
  units[7].set(other, units[7].get(other) + 5e-4);
  const Fleet fleet = fleet_of(units, 0.01);
  EXPECT_EQ(outliers_of(fleet), 1);
  const FleetUnit& bent = fleet.units[7];
  EXPECT_TRUE(bent.outlier);
  EXPECT_TRUE(bent.worst_is_combined);
  EXPECT_LT(std::abs(bent.robust_z[1]), 4);
  EXPECT_LT(std::abs(bent.robust_z[2]), 4);
  EXPECT_THAT(worst_words(bent, fleet), ::testing::HasSubstr("vertical_deg and others"));
}

// Of five units, robust z follow Student's distribution of two degrees of freedom.
TEST(Fleet, PValuesCountEveryParameterAndEverySum) {
  FleetSettings settings;
  settings.units = 5;
  std::vector<sensors::Sensor> units = made(settings);
  units[2].set(kFree[1], units[2].get(kFree[1]) + 5e-2);
  const Fleet fleet = fleet_of(units, 0.01);
  const double tests = 5.0 * static_cast<double>(kFree.size() + kFree.size());
  ASSERT_EQ(fleet.combinations.cols(), static_cast<Eigen::Index>(kFree.size()));
  const FleetUnit& bent = fleet.units[2];
  const double z = std::abs(bent.worst_z);
  const double beyond = 1 - z / std::sqrt(2 + z * z);
  ASSERT_LT(tests * beyond, 0.5);
  EXPECT_NEAR(bent.p_value / (tests * beyond), 1, 1e-6);
}

TEST(Fleet, OfUnitsThatAreAlikeHasNoOutlier) {
  FleetSettings settings;
  settings.units = 5;
  const Fleet fleet = fleet_of(made(settings), 0.01);
  EXPECT_EQ(outliers_of(fleet), 0);
  const sensors::Sensor preset = sensors::load_sensor("mid-40");
  for (const FleetParameter& one : fleet.parameters) {
    const double true_value = one.name == kRangeOffset ? preset.range_offset : preset.get(one.name);
    EXPECT_NEAR(one.middle, true_value, 5 * settings.sigma) << one.name;
    EXPECT_LT(one.spread, 10 * settings.sigma) << one.name;
  }
}

// RISLEY_SEEDS=20000 makes so many fleets of each kind. The distance of the median in a small fleet
// makes false alarms rarer than asked for, never more frequent.
TEST(Fleet, IsRarelyCalledToHaveAnOutlier) {
  const int fleets = testing::seeds_or(30);
  constexpr double kFalseAlarm = 0.05;
  for (const std::size_t units : {5U, 8U, 20U}) {
    for (const double spread : {0.0, 3e-5, 1e-3}) {
      SCOPED_TRACE(::testing::Message() << units << " units, spread " << spread);
      int wrong = 0;
      for (int seed = 0; seed < fleets; ++seed) {
        FleetSettings settings;
        settings.units = units;
        settings.spread = spread;
        settings.seed = static_cast<std::uint64_t>(seed);
        wrong += outliers_of(fleet_of(made(settings), kFalseAlarm)) > 0 ? 1 : 0;
      }
      RecordProperty("false_alarms_" + std::to_string(units) + "_" + std::to_string(spread), wrong);
      const double expected = kFalseAlarm * fleets;
      EXPECT_LE(wrong, expected + 3.3 * std::sqrt(expected));
    }
  }
}

TEST(Fleet, LeavesOutWhatAUnitDoesNotKnow) {
  FleetSettings settings;
  settings.units = 7;
  std::vector<sensors::Sensor> units = made(settings);
  units[2].covariance_names.clear();
  units[2].covariance.resize(0, 0);
  const Fleet fleet = fleet_of(units, 0.01);
  EXPECT_FALSE(fleet.units[2].tested);
  EXPECT_FALSE(fleet.units[2].outlier);
  EXPECT_EQ(answer_words(fleet.units[2]), "no sigmas to test with");
  EXPECT_TRUE(std::isnan(fleet.units[2].robust_z.front()));
  EXPECT_EQ(fleet.parameters.size(), kFree.size());
  for (sensors::Sensor& unit : units) unit.covariance_names.clear();
  for (sensors::Sensor& unit : units) unit.covariance.resize(0, 0);
  EXPECT_TRUE(fleet_of(units, 0.01).parameters.empty());
}

TEST(Fleet, RefusesWhatIsNone) {
  FleetSettings settings;
  settings.units = 4;
  EXPECT_THROW(fleet_of(made(settings), 0.01), InvalidArgument);
  settings.units = 5;
  std::vector<sensors::Sensor> units = made(settings);
  EXPECT_THROW(fleet_of(units, 1.5), InvalidArgument);
  units[4] = sensors::load_sensor("horizon");
  EXPECT_THROW(fleet_of(units, 0.01), InvalidArgument);
}

}  // namespace risley::jobs::fleet_test
