// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/flown_strips.hpp"

#include <string>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/trajectories/flight_plan.hpp"

#include "refusal.hpp"
#include "source_tree.hpp"

namespace risley::trajectories::flown_strips_test {

TEST(FlownStrips, ThoseOfThePlanAreFound) {
  for (const char* name : {"flight-s4.yaml", "flight-v4.yaml"}) {
    FlightPlan plan = load_flight_plan(in_source_tree("data/") + name);
    plan.origin = Geodetic{0.87, 0.2, 300};
    const Flight flight = fly(plan);
    const Interpolation interpolation(flight.trajectory);
    const std::vector<FlownStrip> found = flown_strips(interpolation);
    ASSERT_EQ(found.size(), flight.strips.size()) << name;
    for (std::size_t i = 0; i < found.size(); ++i) {
      // The straight lead and the beginnings of turns may be taken along.
      EXPECT_LT(std::abs(found[i].begin_ns - flight.strips[i].begin_ns), 6'000'000'000) << i;
      EXPECT_LT(std::abs(found[i].end_ns - flight.strips[i].end_ns), 6'000'000'000) << i;
      EXPECT_LT(std::abs(wrap_to_pi(found[i].course - plan.strips[i].heading)),
                radians_from_degrees(5))
          << i;
      EXPECT_NEAR(found[i].length, plan.strips[i].length, 45) << i;
    }
  }
}

TEST(FlownStrips, NoneWhereNothingMoves) {
  Trajectory still;
  for (int i = 0; i < 4000; ++i) {
    still.time_ns.push_back(5'000'000LL * i);
    still.position.emplace_back(0, 0, 10);
    still.attitude.emplace_back(Eigen::Quaterniond::Identity());
  }
  const Interpolation interpolation(still);
  EXPECT_TRUE(flown_strips(interpolation).empty());
  EXPECT_NE(refusal([&] { flown_strips(interpolation, {.shortest_s = 0}); }).find("shortest_s"),
            std::string::npos);
}

}  // namespace risley::trajectories::flown_strips_test
