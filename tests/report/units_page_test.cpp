// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/units_page.hpp"

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"

#include "report/comparison_example.hpp"
#include "report/page_reading.hpp"

namespace risley::report::units_page_test {

using jobs::ComparedUnits;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kFalseAlarm = 0.01;

double deg(double degrees) { return radians_from_degrees(degrees); }

/// What a result says if a prism of its unit is tilted by so much.
std::vector<testing::KnownValue> result(double tilt_deg) {
  return {{"refractive_index", 1.51 + 1e-5 * tilt_deg, 2e-5},
          {"wedge_angle_deg", deg(18), 0},
          {"prism_tilt_b_vertical_deg", deg(tilt_deg), deg(0.003)},
          {"range_offset_m", 0.001, 0.002}};
}

/// A pair of results. @param p_value  of its differences
jobs::ComparedPair pair(std::size_t a, std::size_t b, double tilt_a, double tilt_b,
                        double p_value) {
  jobs::ComparedPair own;
  own.a = a;
  own.b = b;
  own.comparison = testing::compared(result(tilt_a), result(tilt_b), std::abs(tilt_b - tilt_a));
  own.comparison.change = {20, 3, p_value};
  own.changed = p_value < kFalseAlarm / 3;
  return own;
}

/// Takes away all that is known of the errors of two results.
void without_sigmas(jobs::ResultComparison& comparison) {
  for (jobs::ParameterDifference& one : comparison.parameters) {
    one.sigma_a = one.sigma_b = one.sigma = 0;
  }
  calibration::PointingError& beams = comparison.beams;
  beams.total_sigma = beams.gauge_sigma = beams.shape_sigma = beams.worst_shape_sigma = 0;
  comparison.change = {};
}

/// One unit on three days, bent before the last. @param p_value  of the last result's differences
ComparedUnits series(double last_tilt = 0.06, double p_value = 1e-5) {
  ComparedUnits compared;
  compared.results = {"march", "june", "<november>"};
  compared.units = {{"1PQD&7", "mid-40", {0, 1, 2}, true}};
  compared.pairs = {pair(0, 1, 0.020, 0.021, 0.53), pair(1, 2, 0.021, last_tilt, p_value),
                    pair(0, 2, 0.020, last_tilt, p_value)};
  compared.is_one_series = true;
  compared.false_alarm = kFalseAlarm;
  compared.least_p_value = kFalseAlarm / 3;
  return compared;
}

/// Six units, of which one is bent.
ComparedUnits fleet() {
  constexpr std::size_t kUnits = 6, kBent = 4;
  ComparedUnits compared;
  compared.false_alarm = compared.least_p_value = kFalseAlarm;
  jobs::ComparedFleet one;
  one.fleet.shape = {2};
  one.fleet.parameters = {{"refractive_index", 1.51, 2e-5},
                          {"prism_tilt_b_vertical_deg", deg(0.02), deg(0.01)}};
  one.fleet.combinations = Eigen::MatrixXd::Identity(2, 2);
  for (std::size_t i = 0; i < kUnits; ++i) {
    const std::string number = std::to_string(i + 1);
    compared.results.push_back("checked/" + number);
    compared.units.push_back({"1PQD&" + number, "mid-40", {i}, false});
    one.units.push_back(i);
    jobs::FleetUnit unit;
    unit.tested = true;
    unit.outlier = i == kBent;
    unit.robust_z = {0.1 * static_cast<double>(i), unit.outlier ? 28.5 : -0.6};
    unit.robust_z_combined = {0.2, i == 1 ? 1.2 : 0.3};
    unit.worst = 1;
    unit.worst_is_combined = i == 1;
    unit.worst_z = unit.worst_is_combined ? 1.2 : unit.robust_z[1];
    unit.p_value = unit.outlier ? 1e-4 : 1;
    unit.beams = testing::pointing_error(unit.outlier ? 0.3 : 0.01);
    one.fleet.units.push_back(unit);
  }
  compared.fleets = {one};
  return compared;
}

std::string page(const ComparedUnits& compared) {
  return units_page(compared, {{"command", "risley compare"}});
}

/// A golden text of such pages, with its variants.
class GoldenUnits {
 public:
  GoldenUnits(const std::string& name, ComparedUnits compared)
      : compared_(std::move(compared)), golden_(name, page(compared_)) {}

  void differs(const std::string& when, const std::function<void(ComparedUnits&)>& change) {
    ComparedUnits other = compared_;
    change(other);
    golden_.differs(when, page(other));
  }

 private:
  ComparedUnits compared_;
  testing::GoldenPage golden_;
};

TEST(UnitsPage, OfASeriesMatchesItsGoldenText) {
  GoldenUnits golden("units_series", series());
  golden.differs("no change", [](ComparedUnits& compared) { compared = series(0.022, 0.6); });
  golden.differs("one changed pair", [](ComparedUnits& compared) {
    compared.pairs[1].comparison.change.p_value = 0.0034;
    compared.pairs[1].changed = false;
  });
  golden.differs("two results", [](ComparedUnits& compared) {
    compared.results = {"june", "november"};
    compared.pairs = {pair(0, 1, 0.021, 0.06, 1e-5)};
  });
  golden.differs("no sigmas", [](ComparedUnits& compared) {
    for (jobs::ComparedPair& own : compared.pairs) {
      without_sigmas(own.comparison);
      own.changed = false;
    }
  });
  golden.differs("results of two units", [](ComparedUnits& compared) {
    compared.units = {{"1PQD&7", "mid-40", {0, 1}, false}, {"2QRE<8>", "mid-40", {2}, false}};
    for (jobs::ComparedPair& own : compared.pairs) {
      own.changed = false;
      if (own.b == 2) testing::of_two_units(own.comparison);
    }
  });
  golden.differs("results of two units, one of which changed", [](ComparedUnits& compared) {
    compared.pairs = {pair(0, 1, 0.02, 0.05, 1e-5), pair(1, 2, 0.05, 0.3, 1)};
    testing::of_two_units(compared.pairs[1].comparison);
  });
  golden.differs("the last one is unlike the others", [](ComparedUnits& compared) {
    compared.pairs.resize(1);
    compared.left_out = {{"june and <november>", "one is a calibration, the other an estimate"}};
  });
  const auto in_a_table = [](std::size_t pairs) {
    return [pairs](ComparedUnits& compared) {
      compared.is_one_series = false;
      compared.pairs.resize(pairs);
      compared.pairs[0].changed = false;
      testing::of_two_units(compared.pairs[0].comparison);
    };
  };
  golden.differs("two units of a table", in_a_table(1));
  golden.differs("two units of a table, one with two results", in_a_table(2));
  golden.differs("two units of a table, one with three results", in_a_table(3));
}

TEST(UnitsPage, OfAFleetMatchesItsGoldenText) {
  GoldenUnits golden("units_fleet", fleet());
  golden.differs("two outliers and a result that is none", [](ComparedUnits& compared) {
    compared.fleets[0].fleet.units[1].outlier = true;
    compared.left_out = {{"<cut>.lvx", "is cut off", true}};
  });
  golden.differs("none stands out", [](ComparedUnits& compared) {
    jobs::FleetUnit& unit = compared.fleets[0].fleet.units[4];
    unit.outlier = false;
    unit.worst_z = unit.robust_z[1] = 3.1;
    unit.p_value = 0.2;
  });
  golden.differs("no sigmas", [](ComparedUnits& compared) {
    jobs::Fleet& own = compared.fleets[0].fleet;
    own.parameters.clear();
    own.combinations.resize(0, 0);
    for (jobs::FleetUnit& unit : own.units) {
      unit = {};
      unit.beams.errors.total = unit.beams.errors.shape = deg(0.01);
    }
  });
  golden.differs("a unit without sigmas, and one that changed", [](ComparedUnits& compared) {
    jobs::FleetUnit& untested = compared.fleets[0].fleet.units[0];
    untested.tested = false;
    untested.robust_z = untested.robust_z_combined = {kNaN, kNaN};
    compared.results.push_back("checked/again");
    compared.units[1].results.push_back(6);
    compared.pairs = {pair(1, 6, 0.02, 0.06, 1e-5)};
  });
}

TEST(UnitsPage, StaysSmallForManyPairs) {
  ComparedUnits compared = fleet();
  compared.pairs.assign(501, pair(1, 2, 0.02, 0.021, 0.5));
  EXPECT_THAT(page(compared), ::testing::HasSubstr("Of 501 pairs, these 500 are the ones least"));
}

TEST(UnitsPage, DrawsFirstWhatCanChangeMost) {
  ComparedUnits compared = series();
  const auto drawn = testing::data(page(compared));
  EXPECT_EQ(drawn.at(0).at("title"), "prism_tilt_b_vertical_deg");
  EXPECT_EQ(drawn.at(0).at("series").at(0).at("x"), (nlohmann::json{1, 2, 3}));
  EXPECT_EQ(drawn.back().at("title"), "refractive_index");
  compared.written_ms = {1'700'000'000'000, 1'710'000'000'000, 1'720'000'000'000};
  const auto dated = testing::data(page(compared)).at(0);
  EXPECT_EQ(dated.at("dates"), true);
  EXPECT_EQ(dated.at("series").at(0).at("x").at(2), 1'720'000'000'000);
}

}  // namespace risley::report::units_page_test
