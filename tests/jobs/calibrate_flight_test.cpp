// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/calibrate_flight.hpp"

#include <filesystem>
#include <set>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "risley/cloud/map_projection.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/scenes/scene.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/truth_file.hpp"
#include "risley/trajectories/flight_plan.hpp"
#include "risley/trajectories/geodesy.hpp"
#include "risley/trajectories/mount.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "refusal.hpp"

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
    io::write_text_file(file("village.yaml"), kVillage);
    io::write_text_file(file("plan.yaml"), kPlan);
    io::write_text_file(file("mount.yaml"), kMount);
    sensors::Sensor reported = sensors::load_sensor("mid-40-table3");
    reported.train = reported.train.without_errors();
    record(reported, "flight.nc");
  }

  /// Flies the unit of Table 3, whose stored calibration is `reported`.
  static void record(const sensors::Sensor& reported, const std::string& name,
                     const std::string& plan = "plan.yaml",
                     const std::string& scene = "village.yaml") {
    simulation::SimulationSettings settings;
    settings.truth = sensors::load_sensor("mid-40-table3");
    settings.reported = reported;
    settings.rate = 1500;
    settings.rotor = simulation::RotorKind::hunting;
    settings.scene = scenes::load_scene(file(scene));
    const trajectories::Flight flight =
        trajectories::fly(trajectories::load_flight_plan(file(plan)));
    simulation::Platform platform;
    platform.trajectory = std::make_shared<trajectories::Trajectory>(flight.trajectory);
    platform.mount = trajectories::load_mount(file("mount.yaml"));
    platform.mount.boresight[1].value = 0.02;
    settings.platform = platform;
    settings.duration = 1e-9 * static_cast<double>(flight.trajectory.time_ns.back() -
                                                   flight.trajectory.time_ns.front()) -
                        0.1;
    simulation::simulate_to_file(settings, file(name), {});
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

  static CalibrateFlightOptions options(const std::string& recording = "flight.nc") {
    io::write_text_file(file("errors.yaml"), R"(risley_trajectory_errors: 1
north_m: {sigma: 0.001, correlation_time_s: 100, source: simulated}
east_m: {sigma: 0.001, correlation_time_s: 100, source: simulated}
up_m: {sigma: 0.001, correlation_time_s: 100, source: simulated}
tilt_north_deg: {sigma: 0.001, correlation_time_s: 100, source: simulated}
tilt_east_deg: {sigma: 0.001, correlation_time_s: 100, source: simulated}
heading_deg: {sigma: 0.001, correlation_time_s: 100, source: simulated}
)");
    CalibrateFlightOptions options;
    options.recordings = {file(recording)};
    options.platform.trajectory = file(recording + ".trajectory.csv");
    options.platform.mount = file("mount.yaml");
    options.platform.errors = file("errors.yaml");
    options.truths = {file(recording + ".truth.yaml")};
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
  ASSERT_EQ(found.calibration.held.size(), 1U);
  EXPECT_FALSE(found.calibration.held.front().significant);
  // What lies in the folder is what was found.
  const trajectories::Mount mount = trajectories::load_mount(file("out/mount.yaml"));
  EXPECT_EQ(mount.boresight[1].value, found.calibration.mount.boresight[1].value);
  const sensors::Sensor sensor = sensors::load_sensor(file("out/calibration.yaml"));
  EXPECT_EQ(sensor.train.parameters(), found.calibration.sensor.train.parameters());
  EXPECT_EQ(trajectories::load_trajectory(file("out/trajectory.csv")).size(),
            found.calibration.trajectory.size());
  fs::remove_all(file("out"));
}

// A recording shows what a sensor believes of its glass. If the glass is another, strips show that.
TEST_F(CalibrateFlightTest, ContradictsAnIndexThatIsHeld) {
  record(sensors::load_sensor("mid-40"), "other-index.nc");
  CalibrateFlightOptions wanted = options("other-index.nc");
  wanted.details = false;
  wanted.files = {};
  const CalibratedFlight held = calibrate_flight(wanted);
  ASSERT_EQ(held.calibration.held.size(), 1U);
  const calibration::HeldParameter& index = held.calibration.held.front();
  EXPECT_EQ(index.name, "refractive_index");
  EXPECT_NEAR(index.held, 1.51, 1e-5);
  EXPECT_NEAR(index.from_flight, 1.509, 5 * index.sigma);
  EXPECT_TRUE(index.significant);
  EXPECT_EQ(held.calibration.verdict.code, calibration::CalibrationCode::undecided);
  EXPECT_THAT(held.calibration.verdict.words, NamesField("refractive_index"));

  wanted.additional = {"refractive_index"};
  const CalibratedFlight found = calibrate_flight(wanted);
  EXPECT_TRUE(found.calibration.held.empty());
  EXPECT_EQ(found.calibration.verdict.code, calibration::CalibrationCode::bent);
  EXPECT_LT(found.truth->after.total, 4 * found.calibration.datum.total);
}

/// A flight on the Earth, and ground of it that is known on a map.
TEST_F(CalibrateFlightTest, IsFixedOnGroundOfAMap) {
  const std::string on_earth =
      "origin: {latitude_deg: 50, longitude_deg: 8.5, ellipsoidal_height_m: 250}\n";
  std::string plan = kPlan, village = kVillage;
  plan.insert(plan.find("rate_hz"), on_earth);
  village.insert(village.find("  ground"), "  " + on_earth);
  io::write_text_file(file("earth.yaml"), plan);
  io::write_text_file(file("village-on-earth.yaml"), village);
  record(sensors::load_sensor("mid-40-table3"), "earth.nc", "earth.yaml", "village-on-earth.yaml");
  const trajectories::Geodetic origin{radians_from_degrees(50), radians_from_degrees(8.5), 250};
  const Eigen::Vector3d place = trajectories::geocentric_from_geodetic(origin) +
                                trajectories::geocentric_from_ned(origin) *
                                    Eigen::Vector3d(2, 38, 0);  // to the east of all houses
  const Eigen::Vector3d on_map = cloud::MapProjection("EPSG:25832", "EPSG:4937").project(place);
  const auto control = [&](double height) {
    return fmt::format(
        "risley_control: 1\ncrs: EPSG:25832\ndatum: EPSG:4937\nground:\n  - {{name: mark, place_m: "
        "[{:.4f}, {:.4f}, {:.4f}], sigma_m: 0.005, radius_m: 2, normal_azimuth_deg: 0, "
        "normal_zenith_deg: 0, "
        "normal_sigma_deg: 0.1}}\n",
        on_map.x(), on_map.y(), on_map.z() + height);
  };
  io::write_text_file(file("control.yaml"), control(0));
  CalibrateFlightOptions wanted = options("earth.nc");
  wanted.details = false;
  wanted.control = file("control.yaml");
  const CalibratedFlight found = calibrate_flight(wanted);
  ASSERT_EQ(found.calibration.control.size(), 1U);
  EXPECT_TRUE(found.calibration.control.front().used);
  EXPECT_GT(found.calibration.control.front().shots, 8U);
  EXPECT_LT(std::abs(found.calibration.control.front().off), 0.01);
  EXPECT_TRUE(std::any_of(found.provenance.begin(), found.provenance.end(),
                          [&](const auto& fact) { return fact.second == file("control.yaml"); }));
  fs::remove_all(file("out"));
  io::write_text_file(file("control.yaml"), control(0.2));
  wanted.files = {};
  EXPECT_TRUE(calibrate_flight(wanted).calibration.control.front().significant);

  const auto refused = [&](const std::string& recording, const std::string& text) {
    io::write_text_file(file("control.yaml"), text);
    CalibrateFlightOptions wrong = options(recording);
    wrong.control = file("control.yaml");
    try {
      calibrate_flight(wrong);
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  std::string no_map = control(0);
  no_map.replace(no_map.find("crs"), no_map.find("ground") - no_map.find("crs"), "");
  EXPECT_THAT(refused("earth.nc", no_map), NamesField("crs"));
  EXPECT_THAT(refused("flight.nc", control(0)), NamesField("local frame"));
}

TEST_F(CalibrateFlightTest, LeavesNothingWhenCancelled) {
  CalibrateFlightOptions wanted = options();
  std::size_t calls = 0;
  calibrate_flight(wanted, [&](double) { ++calls; });
  fs::remove_all(file("out"));
  const std::set<std::string> before = names();
  ASSERT_GT(calls, 10U);
  for (std::size_t moment = 0; moment < 5; ++moment) {
    const std::size_t stop_at = 1 + (2 * moment + 1) * calls / 10;
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
  EXPECT_NE(refused([](auto& o) { o.platform.trajectory = {}; }), "");
  EXPECT_NE(refused([](auto& o) { o.platform.mount = {}; }), "");
  EXPECT_NE(refused([](auto& o) { o.platform.errors.clear(); }), "");
  EXPECT_NE(refused([](auto& o) { o.platform.crs = "EPSG:25832"; }), "");
  EXPECT_NE(refused([](auto& o) { o.truths.clear(), o.truths.resize(2); }), "");
  EXPECT_NE(refused([](auto& o) { o.knot_spacing = 0; }), "");
  EXPECT_NE(refused([](auto& o) { o.cell_size = -1; }), "");
  EXPECT_NE(refused([](auto& o) { o.range_noise = 0; }), "");
  EXPECT_FALSE(fs::exists(file("out")));
}

}  // namespace risley::jobs::calibrate_flight_test
