// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/plan_flight.hpp"

#include <algorithm>
#include <string>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

#include "refusal.hpp"
#include "source_tree.hpp"
#include "warning_codes.hpp"

namespace risley::jobs::plan_flight_test {

/// Two opposite strips, low and short, over level ground.
PlanFlightOptions small_flight() {
  PlanFlightOptions options;
  const std::string data = in_source_tree("data/");
  options.mount = trajectories::load_mount(data + "mount-as-built.yaml");
  options.errors = trajectories::load_error_model(data + "trajectory-errors.yaml");
  for (const double heading_deg : {90.0, 270.0}) {
    trajectories::Strip strip;
    strip.heading = radians_from_degrees(heading_deg);
    strip.length = 30;
    strip.height = 20;
    strip.speed = 10;
    options.plan.strips.push_back(strip);
  }
  options.plan.attitude = {{0.03, 0.03, 0.03}, 0.15, 1.2, 6};
  options.rate = 2000;
  options.knot_spacing = 2;
  return options;
}

TEST(PlanFlight, TellsAccuracyAndPoints) {
  const PlannedFlightResult planned = plan_flight(small_flight());
  EXPECT_EQ(planned.sensor.name, "mid-40");
  EXPECT_THAT(codes_of(planned.warnings), ::testing::ElementsAre("terrain_assumed"));
  ASSERT_TRUE(planned.distribution.has_value());
  ASSERT_EQ(planned.distribution->strips.size(), 2U);
  EXPECT_NEAR(planned.distribution->strips[0].density, 100'000 / (2 * 20 * 0.3485 * 10), 40);
  // The index counts as determined by a recording and does not hide what strips determine.
  EXPECT_LT(planned.forecast.datum.total, radians_from_degrees(0.1));
  const auto& unknowns = planned.forecast.unknowns;
  const auto index = std::find_if(unknowns.begin(), unknowns.end(), [](const auto& unknown) {
    return unknown.name == "refractive_index";
  });
  ASSERT_NE(index, unknowns.end());
  EXPECT_TRUE(index->held);
  EXPECT_EQ(index->prior_sigma, 1e-5);
}

TEST(PlanFlight, HasNoDistributionWhereTheSensorDoesNotLookDown) {
  PlanFlightOptions options = small_flight();
  // Forward and down by 25 degrees: the field of view ends 6 degrees below the horizon.
  const Eigen::AngleAxisd raised(radians_from_degrees(-65), Eigen::Vector3d::UnitY());
  options.mount.nominal = options.mount.nominal * raised.toRotationMatrix();
  options.plan.strips[1].heading = options.plan.strips[0].heading;
  const PlannedFlightResult planned = plan_flight(options);
  EXPECT_FALSE(planned.distribution.has_value());
  EXPECT_EQ(planned.warnings.back().code, kWarning.distribution_unknown);
}

TEST(PlanFlight, RefusesWhatMakesNoSense) {
  const auto refused = [](const auto& spoil) {
    PlanFlightOptions options = small_flight();
    spoil(options);
    return refusal([&] { plan_flight(options); });
  };
  EXPECT_THAT(refused([](auto& o) { o.rate = 0; }), NamesField("rate"));
  EXPECT_THAT(refused([](auto& o) { o.range_noise = -1; }), NamesField("noise_range"));
  EXPECT_THAT(refused([](auto& o) { o.prior_sigma = 0; }), NamesField("prior_sigma"));
  EXPECT_THAT(refused([](auto& o) { o.range_offset_sigma = -1; }),
              NamesField("range_offset_sigma"));
  EXPECT_THAT(refused([](auto& o) { o.knot_spacing = 0; }), NamesField("knot_spacing"));
  EXPECT_THAT(refused([](auto& o) { o.cell_size = 0; }), NamesField("cell_size"));
  EXPECT_THAT(refused([](auto& o) { o.errors.terms[2].sigma.reset(); }), NamesField("sigma"));
  EXPECT_THAT(refused([](auto& o) { o.plan.strips[0].length = -3; }), NamesField("length"));
  EXPECT_THAT(refused([](auto& o) { o.additional = {"nonsense"}; }), NamesField("nonsense"));
}

}  // namespace risley::jobs::plan_flight_test
