// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The numbers that the paper prints, with half their last digit as tolerance.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/optics/inverse.hpp"
#include "risley/optics/observation_model.hpp"

#include "source_tree.hpp"

namespace risley::golden_paper_test {

/// Half a unit in the last printed digit.
double half_last_digit(const std::string& printed) {
  const auto point = printed.find('.');
  const auto decimals = point == std::string::npos ? 0 : printed.size() - point - 1;
  return 0.5 * std::pow(10.0, -static_cast<double>(decimals));
}

PrismTrain nominal() { return PrismTrain(parse_face_order("PA-AP")); }

TEST(GoldenPaper, EveryRowOfTheDirectionTable) {
  std::ifstream table(in_source_tree("tests/golden/directions.txt"));
  ASSERT_TRUE(table) << "tests/golden/directions.txt is missing";
  std::string line;
  int rows = 0;
  while (std::getline(table, line)) {
    if (line.empty() || line.front() == '#') continue;
    std::istringstream fields(line);
    std::string name, a, b, azimuth, zenith;
    fields >> name >> a >> b >> azimuth >> zenith;
    SCOPED_TRACE(line);
    const std::array angles{radians_from_degrees(std::stod(a)), radians_from_degrees(std::stod(b))};
    const Observation shot = observe(nominal(), angles);
    ASSERT_TRUE(shot.valid);
    EXPECT_NEAR(degrees_from_radians(shot.azimuth), std::stod(azimuth), half_last_digit(azimuth));
    EXPECT_NEAR(degrees_from_radians(shot.zenith), std::stod(zenith), half_last_digit(zenith));
    ++rows;
  }
  EXPECT_EQ(rows, 3);
}

TEST(GoldenPaper, InverseOfBeamOneOfTableA1GivesItsAnglesAndTheirPartner) {
  const std::array beam1{radians_from_degrees(96.667), radians_from_degrees(233.000)};
  const PrismTrain train = nominal();
  const Vector3<double> direction = observe(train, beam1).direction;
  const InverseSolution solution = rotation_angles_for(train, direction);
  ASSERT_EQ(solution.pairs.size(), 2u);
  EXPECT_FALSE(solution.continuum);
  const auto is_beam1 = [&](const RotationPair& pair) {
    return std::abs(wrap_to_pi(pair.first - beam1[0])) < 1e-10 &&
           std::abs(wrap_to_pi(pair.second - beam1[1])) < 1e-10;
  };
  EXPECT_EQ(std::count_if(solution.pairs.begin(), solution.pairs.end(), is_beam1), 1);
  for (const RotationPair& pair : solution.pairs) {
    const Observation again = observe(train, std::array{pair.first, pair.second});
    EXPECT_LT(degrees_from_radians(angle_between(again.direction, direction)), 1e-10);
  }
}

}  // namespace risley::golden_paper_test
