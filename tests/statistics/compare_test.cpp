// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Calibrations of one unit on different days: they differ as their covariances say.
// RISLEY_SEEDS=200 compares so many pairs.
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "risley/jobs/compare_results.hpp"
#include "risley/scenes/scene.hpp"
#include "risley/sensors/preset.hpp"

#include "seeds.hpp"
#include "source_tree.hpp"
#include "statistics/simulated_walls.hpp"

namespace risley::compare_test {

/// A unit whose held parameters are off by what its preset allows, on one of its days.
sensors::Sensor calibrated(const scenes::Scene& hall, int unit, int day) {
  auto settings = testing::wall_settings(hall, static_cast<std::uint64_t>(unit), 2000.0, 3.0);
  const sensors::Sensor preset = sensors::load_sensor("mid-40");
  const TrainShape shape = preset.shape();
  const auto free = estimation::free_parameters(estimation::default_free_names(shape), shape);
  testing::draw_unit(settings, estimation::uncertain_held(preset, free),
                     RandomStream(static_cast<std::uint64_t>(unit), 95));
  settings.seed = static_cast<std::uint64_t>(2 * unit + day);
  const testing::WallRecording walls = testing::record_walls(settings);
  return testing::calibrate_walls({&walls}, testing::wall_options()).calibration.sensor;
}

TEST(Comparison, OfOneUnitOnTwoDaysIsAsFarApartAsItsCovariancesSay) {
  const scenes::Scene hall = scenes::load_scene(in_source_tree("data/hall.yaml"));
  const int pairs = testing::seeds_or(8);
  double chi2 = 0, degrees = 0;
  int changed = 0;
  for (int unit = 0; unit < pairs; ++unit) {
    SCOPED_TRACE(unit);
    const jobs::ResultComparison found = jobs::compare_results(
        calibrated(hall, unit, 0), calibrated(hall, unit, 1), jobs::OneUnit::caller);
    EXPECT_TRUE(found.held_alike);
    // The index and eight angles: the wedge, which both held, has no part in a difference.
    EXPECT_EQ(found.change.degrees_of_freedom, 9);
    chi2 += found.change.chi2;
    degrees += found.change.degrees_of_freedom;
    changed += found.change.p_value < 0.01;
  }
  RecordProperty("pairs", pairs);
  RecordProperty("chi2_per_degree", fmt::format("{:.4g}", chi2 / degrees));
  RecordProperty("changed", changed);
  const double band = 3.3 * std::sqrt(2.0 / degrees);
  EXPECT_NEAR(chi2 / degrees, 1.0, band);
  // At 0.01 one in a hundred is called changed; so many only once in a thousand times.
  EXPECT_LE(changed, 0.01 * pairs + 3.1 * std::sqrt(0.01 * pairs) + 1);
}

}  // namespace risley::compare_test
