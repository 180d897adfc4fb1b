// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/calibrate_flight.hpp"

#include <filesystem>
#include <set>

#include <gtest/gtest.h>
#include <unistd.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/scenes/scene.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/truth_file.hpp"
#include "risley/trajectories/flight_plan.hpp"
#include "risley/trajectories/mount.hpp"
#include "risley/trajectories/trajectory_file.hpp"

namespace risley::jobs::calibrate_flight_test {

namespace fs = std::filesystem;

constexpr const char* kPlan = R"(risley_flight: 1
rate_hz: 200
height_m: 50
speed_m_per_s: 5
turn_duration_s: 5
strips: [{headings_deg: [90, 270, 0, 180], length_m: 55}]
motion:
  seed: 2
  attitude: {roll_deg: 2, pitch_deg: 2, heading_deg: 2, lowest_hz: 0.2, highest_hz: 1, sinusoids: 5}
)";
constexpr const char* kVillage = R"(terrain:
  ground: {height_m: 0}
  village: {seed: 2, half_extent_m: 30, roofs: 12, minimum_distance_m: 11, length_m: 8, face_width_m: 5,
            pitch_deg: [25, 40], ridge_height_m: [5, 8]}
)";
constexpr const char* kMount = R"(risley_mount: 1
reference_point: IMU
sensor_axes: {x: down, y: left, z: forward, source: drawing}
boresight:
  x_deg: {value: 0, sigma: 3, source: as built}
  y_deg: {value: 0, sigma: 3, source: as built}
  z_deg: {value: 0, sigma: 3, source: as built}
lever_arm:
  x_m: {value: 0.1, sigma: 0.01, source: tape}
  y_m: {value: 0, sigma: 0.01, source: tape}
  z_m: {value: 0, sigma: 0.01, source: tape}
clock_offset_s: {value: 0, sigma: 0.002, source: PPS}
)";

class CalibrateFlightTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    root_ = fs::temp_directory_path() / ("risley-flight-job-" + std::to_string(::getpid()));
    fs::create_directories(root_);
    simulation::SimulationSettings settings;
    settings.truth = sensors::load_sensor("mid-40-table3");
    settings.reported = sensors::load_sensor("mid-40");
    settings.rate = 1500;
    settings.rotor = simulation::RotorKind::hunting;
    io::write_text_file(file("village.yaml"), kVillage);
    io::write_text_file(file("plan.yaml"), kPlan);
    io::write_text_file(file("mount.yaml"), kMount);
    settings.scene = scenes::load_scene(file("village.yaml"));
    const trajectories::Flight flight =
        trajectories::fly(trajectories::load_flight_plan(file("plan.yaml")));
    simulation::Platform platform;
    platform.trajectory = std::make_shared<trajectories::Trajectory>(flight.trajectory);
    platform.mount = trajectories::load_mount(file("mount.yaml"));
    platform.mount.boresight[1].value = 0.02;
    settings.platform = platform;
    settings.duration = 1e-9 * static_cast<double>(flight.trajectory.time_ns.back() -
                                                   flight.trajectory.time_ns.front()) -
                        0.1;
    simulation::simulate_to_file(settings, file("flight.nc"), {});
  }
  static void TearDownTestSuite() { fs::remove_all(root_); }

  static std::string file(const std::string& name) { return (root_ / name).string(); }

  static std::set<std::string> names() {
    std::set<std::string> result;
    for (const auto& entry : fs::recursive_directory_iterator(root_)) {
      result.insert(entry.path().string());
    }
    return result;
  }

  static CalibrateFlightOptions options() {
    io::write_text_file(file("errors.yaml"), R"(risley_trajectory_errors: 1
north_m: {sigma: 0.001, correlation_time_s: 100, source: simulated}
east_m: {sigma: 0.001, correlation_time_s: 100, source: simulated}
up_m: {sigma: 0.001, correlation_time_s: 100, source: simulated}
tilt_north_deg: {sigma: 0.001, correlation_time_s: 100, source: simulated}
tilt_east_deg: {sigma: 0.001, correlation_time_s: 100, source: simulated}
heading_deg: {sigma: 0.001, correlation_time_s: 100, source: simulated}
)");
    CalibrateFlightOptions options;
    options.recordings = {file("flight.nc")};
    options.platform.trajectory = file("flight.nc.trajectory.csv");
    options.platform.mount = file("mount.yaml");
    options.platform.errors = file("errors.yaml");
    options.truths = {file("flight.nc.truth.yaml")};
    options.knot_spacing = 5;
    options.details = true;
    options.files = {file("out"), StatesRows::none, {{"command", "test"}}};
    return options;
  }

  static inline fs::path root_;
};

TEST_F(CalibrateFlightTest, LeadsFromAFlightToAMount) {
  const CalibratedFlight found = calibrate_flight(options());
  ASSERT_TRUE(found.calibration.converged) << found.calibration.reason;
  EXPECT_EQ(found.strips.size(), 4U);
  EXPECT_EQ(found.strip_rows.size(), 4U);
  EXPECT_GT(found.outside_strips, 0U);
  ASSERT_TRUE(found.truth && found.details);
  EXPECT_GT(found.truth->before.total, 0.015);
  EXPECT_LT(found.truth->after.total, 4 * found.calibration.datum.total);
  EXPECT_NEAR(found.calibration.mount.boresight[1].value, 0.02,
              4.5 * found.calibration.mount.boresight[1].sigma);
  // What lies in the folder is what was found.
  const trajectories::Mount mount = trajectories::load_mount(file("out/mount.yaml"));
  EXPECT_EQ(mount.boresight[1].value, found.calibration.mount.boresight[1].value);
  const sensors::Sensor sensor = sensors::load_sensor(file("out/calibration.yaml"));
  EXPECT_EQ(sensor.train.parameters(), found.calibration.sensor.train.parameters());
  EXPECT_EQ(trajectories::load_trajectory(file("out/trajectory.csv")).size(),
            found.calibration.trajectory.size());
  fs::remove_all(file("out"));
}

TEST_F(CalibrateFlightTest, LeavesNothingWhenCancelled) {
  CalibrateFlightOptions wanted = options();
  std::size_t calls = 0;
  calibrate_flight(wanted, [&](double) { ++calls; });
  fs::remove_all(file("out"));
  const std::set<std::string> before = names();
  ASSERT_GT(calls, 10U);
  for (std::size_t moment = 0; moment < 10; ++moment) {
    const std::size_t stop_at = 1 + moment * calls / 10;
    std::size_t call = 0;
    EXPECT_THROW(calibrate_flight(wanted,
                                  [&](double) {
                                    if (++call == stop_at) throw Cancelled();
                                  }),
                 Cancelled)
        << moment;
    EXPECT_EQ(names(), before) << moment;
  }
}

TEST_F(CalibrateFlightTest, RefusesWhatDoesNotFit) {
  const auto refused = [&](const auto& damage) {
    CalibrateFlightOptions wanted = options();
    damage(wanted);
    try {
      calibrate_flight(wanted);
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refused([](auto& o) { o.recordings.clear(); }), "");
  EXPECT_NE(refused([](auto& o) { o.recordings.push_back(o.recordings.front()); }), "");
  EXPECT_NE(refused([](auto& o) { o.platform.trajectory.clear(); }), "");
  EXPECT_NE(refused([](auto& o) { o.platform.mount.clear(); }), "");
  EXPECT_NE(refused([](auto& o) { o.platform.errors.clear(); }), "");
  EXPECT_NE(refused([](auto& o) { o.platform.crs = "EPSG:25832"; }), "");
  EXPECT_NE(refused([](auto& o) { o.truths.clear(), o.truths.resize(2); }), "");
  EXPECT_NE(refused([](auto& o) { o.knot_spacing = 0; }), "");
  EXPECT_NE(refused([](auto& o) { o.cell_size = -1; }), "");
  EXPECT_NE(refused([](auto& o) { o.range_noise = 0; }), "");
  EXPECT_FALSE(fs::exists(file("out")));
}

}  // namespace risley::jobs::calibrate_flight_test
