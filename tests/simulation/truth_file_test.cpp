// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/simulation/truth_file.hpp"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/io/text_file.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/truth.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/trajectories/error_process.hpp"
#include "risley/trajectories/flight_plan.hpp"
#include "risley/trajectories/mount.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "io/test_folder.hpp"
#include "source_tree.hpp"

namespace risley::simulation::truth_file_test {

using ::testing::Contains;
using ::testing::Pair;

namespace fs = std::filesystem;

class TruthFile : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.file(name); }

  SimulationSettings settings() const {
    SimulationSettings s;
    s.truth = sensors::load_sensor("mid-40-table3");
    s.duration = 1.5;
    s.rate = 2000;
    s.rotor = RotorKind::sinusoidal;
    s.seed = 77;
    s.scene = scenes::load_scene(in_source_tree("data/room.yaml"));
    return s;
  }

  io::TestFolder folder_;
};

TEST_F(TruthFile, RecordingAndTruthComeBack) {
  const SimulationSettings s = settings();
  const SimulationResult result = simulate_to_file(s, path("out.nc"), {{"command", "risley test"}});
  EXPECT_EQ(result.observations, 3000u);

  Scanner scanner(s);
  recordings::Chunk chunk;
  recordings::TruthColumns expected;
  ASSERT_TRUE(scanner.read(chunk, expected));
  EXPECT_EQ(result.no_return, scanner.no_return());
  const recordings::TruthColumns truth = recordings::load_truth(truth_columns_path(path("out.nc")));
  EXPECT_EQ(truth.time_ns, expected.time_ns);
  ASSERT_EQ(truth.prisms(), 2);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    for (std::size_t prism = 0; prism < 2; ++prism) {
      ASSERT_DOUBLE_EQ(truth.rotation_angle[prism][i], expected.rotation_angle[prism][i]);
      ASSERT_DOUBLE_EQ(truth.angular_velocity[prism][i], expected.angular_velocity[prism][i]);
    }
    ASSERT_DOUBLE_EQ(truth.azimuth[i], expected.azimuth[i]);
    ASSERT_DOUBLE_EQ(truth.zenith[i], expected.zenith[i]);
    ASSERT_DOUBLE_EQ(truth.range[i], expected.range[i]);
  }
  const recordings::Recording recording = recordings::load_recording(path("out.nc"));
  EXPECT_EQ(recording.data.observations.time_ns, truth.time_ns);
  EXPECT_EQ(recording.data.observations.azimuth, chunk.observations.azimuth);
  EXPECT_EQ(recording.data.observations.range, chunk.observations.range);
}

// Three prisms, six emitters in turn, packets of 96 shots at 240 kHz.
TEST_F(TruthFile, AHorizonKeepsItsBeamsAndTimesInLvx) {
  SimulationSettings s = settings();
  s.truth = sensors::load_sensor("horizon");
  s.duration = 0.02;
  s.rate.reset();
  Scanner scanner(s);
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  ASSERT_TRUE(scanner.read(chunk, truth));
  ASSERT_EQ(chunk.observations.size(), 4800u);
  ASSERT_EQ(truth.prisms(), 3);
  EXPECT_EQ(scanner.header().devices.front().type, 3);
  for (std::size_t i = 0; i < truth.size(); i += 7) {
    EXPECT_EQ(chunk.observations.beam[i], i % 6);
    std::vector<double> angles;
    for (const auto& column : truth.rotation_angle) angles.push_back(wrap_to_two_pi(column[i]));
    const Observation shot = observe(s.truth.train, angles, static_cast<int>(i % 6));
    EXPECT_NEAR(truth.azimuth[i], shot.azimuth, 1e-14);
    EXPECT_NEAR(truth.zenith[i], shot.zenith, 1e-14);
  }

  const SimulationResult result = simulate_to_file(s, path("out.lvx"), {});
  EXPECT_EQ(result.truth.train.emitters(), 6);
  const recordings::Recording read = recordings::load_recording(path("out.lvx"));
  EXPECT_EQ(read.header.devices.front().type, 3);
  EXPECT_EQ(read.data.observations.time_ns, chunk.observations.time_ns);
  EXPECT_EQ(read.data.observations.beam, chunk.observations.beam);
  EXPECT_EQ(read.data.observations.valid, chunk.observations.valid);
  EXPECT_EQ(read.data.packets.size(), 4800u / 96u);
  EXPECT_EQ(sensors::load_sensor(truth_preset_path(path("out.lvx"))).train.parameters(),
            s.truth.train.parameters());
}

TEST_F(TruthFile, PresetIsTheTrueSensorWithAllThatMakesItAgain) {
  SimulationSettings s = settings();
  s.truth.set("prism_tilt_a_vertical_deg", radians_from_degrees(0.5));
  s.reported = s.truth;
  s.reported->train = s.truth.train.without_errors();
  simulate_to_file(s, path("out.nc"), {{"command", "risley simulate --seed 77"}});
  const sensors::Sensor truth = sensors::load_sensor(truth_preset_path(path("out.nc")));
  EXPECT_EQ(truth.train.parameters(), s.truth.train.parameters());
  EXPECT_EQ(truth.angular_velocity, s.truth.angular_velocity);
  EXPECT_THAT(truth.provenance, Contains(Pair("command", "risley simulate --seed 77")));
  EXPECT_THAT(truth.provenance, Contains(Pair("seed", "77")));
  EXPECT_THAT(truth.provenance, Contains(Pair("rotor", "sinusoidal")));
  EXPECT_THAT(truth.provenance, Contains(Pair("duration_s", "1.5")));
  EXPECT_THAT(truth.provenance, Contains(Pair("rate_hz", "2000")));
  EXPECT_THAT(truth.provenance, Contains(Pair("reported prism_tilt_a_vertical_deg", "0")));
  EXPECT_THAT(truth.provenance, Contains(Pair("start_rotation_angle_b_deg", ::testing::_)));
}

TEST_F(TruthFile, SameSeedGivesTheSameBytes) {
  SimulationSettings s = settings();
  s.threads = 1;
  simulate_to_file(s, path("one.nc"), {});
  s.threads = 2;
  simulate_to_file(s, path("two.nc"), {});
  for (const char* ending : {".nc", ".nc.truth.nc", ".nc.truth.yaml"}) {
    EXPECT_EQ(hashes::sha256_of_file(path("one") + ending),
              hashes::sha256_of_file(path("two") + ending))
        << ending;
  }
  s.seed = 78;
  simulate_to_file(s, path("three.nc"), {});
  for (const char* ending : {".nc", ".nc.truth.nc", ".nc.truth.yaml"}) {
    EXPECT_NE(hashes::sha256_of_file(path("one") + ending),
              hashes::sha256_of_file(path("three") + ending));
  }
}

/// The bundled flight over the bundled village, 0.2 s of it.
SimulationSettings flying() {
  SimulationSettings s;
  s.truth = sensors::load_sensor("mid-40-table3");
  s.duration = 0.2;
  s.scene = scenes::load_scene(in_source_tree("data/village.yaml"));
  trajectories::FlightPlan plan =
      trajectories::load_flight_plan(in_source_tree("data/flight-s4.yaml"));
  plan.origin.reset();
  plan.start = 0;
  trajectories::Flight flight = trajectories::fly(plan);
  Platform platform;
  platform.trajectory = std::make_shared<trajectories::Trajectory>(std::move(flight.trajectory));
  platform.strips = std::move(flight.strips);
  platform.mount = trajectories::load_mount(in_source_tree("data/mount-nadir.yaml"));
  platform.errors = trajectories::load_error_model(in_source_tree("data/trajectory-errors.yaml"));
  platform.begin_ns = 9'000'000'000;
  s.platform = std::move(platform);
  return s;
}

TEST_F(TruthFile, AMovingSensorLeavesItsTrajectoriesAndItsMount) {
  const SimulationSettings s = flying();
  const std::string out = path("out.lvx");
  const SimulationResult result = simulate_to_file(s, out, {});
  EXPECT_THAT(result.files,
              ::testing::ElementsAre(out, out + ".truth.yaml", out + ".truth.nc",
                                     out + ".trajectory.truth.csv", out + ".trajectory.csv",
                                     out + ".mount.truth.yaml", out + ".strips.yaml"));
  for (const std::string& file : result.files) EXPECT_TRUE(fs::exists(file)) << file;
  // The true one bit by bit, the user's with errors of the stated size.
  const auto truth = trajectories::load_trajectory(truth_trajectory_path(out));
  EXPECT_EQ(truth.time_ns, s.platform->trajectory->time_ns);
  EXPECT_EQ(truth.position, s.platform->trajectory->position);
  EXPECT_TRUE(truth.accuracy.empty());
  const auto given = trajectories::load_trajectory(trajectory_path(out, ".csv"));
  ASSERT_EQ(given.size(), truth.size());
  EXPECT_EQ(given.accuracy.size(), truth.size());
  double largest = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    largest = std::max(largest, (given.position[i] - truth.position[i]).norm());
  }
  EXPECT_GT(largest, 0.005);
  EXPECT_LT(largest, 0.25);
  EXPECT_EQ(trajectories::mount_text(trajectories::load_mount(truth_mount_path(out))),
            trajectories::mount_text(s.platform->mount));
  EXPECT_EQ(io::read_text_file(strips_path(out)),
            trajectories::strip_times_text(s.platform->strips, truth.time_scale));
  // LVX keeps the sensor's clock, 1.2 ms behind the trajectory's time: 8.9988 s, and so 8.999 s.
  const recordings::Recording recording = recordings::load_recording(out);
  const auto columns = recordings::load_truth(truth_columns_path(out));
  EXPECT_EQ(recording.data.observations.time_ns.front(), 8'999'000'000);
  EXPECT_EQ(recording.data.observations.time_ns, columns.time_ns);
  const sensors::Sensor preset = sensors::load_sensor(truth_preset_path(out));
  EXPECT_THAT(preset.provenance, Contains(Pair("clock_at_first_shot_ns", "8999000000")));
  EXPECT_THAT(preset.provenance, Contains(Pair("clock_offset_s", "0.0012")));
}

TEST_F(TruthFile, FlightsOfTheSameSeedGiveTheSameBytes) {
  SimulationSettings s = flying();
  s.threads = 1;
  const auto one = simulate_to_file(s, path("one.nc"), {}).files;
  for (const int threads : {2, 4}) {
    s.threads = threads;
    const auto more = simulate_to_file(s, path("more.nc"), {}).files;
    ASSERT_EQ(more.size(), one.size());
    for (std::size_t i = 0; i < one.size(); ++i) {
      EXPECT_EQ(hashes::sha256_of_file(one[i]), hashes::sha256_of_file(more[i])) << more[i];
    }
  }
}

TEST_F(TruthFile, AFlightThatCannotBeWrittenLeavesNothing) {
  SimulationSettings s = flying();
  s.platform->trajectory_ending = ".sbet";  // of a trajectory that is not on the Earth
  EXPECT_THROW(simulate_to_file(s, path("out.nc"), {}), InvalidArgument);
  EXPECT_TRUE(fs::is_empty(folder_.path()));
  s.platform->trajectory_ending = ".csv";
  EXPECT_THROW(simulate_to_file(s, path("out.unknown"), {}), InvalidArgument);
  const Progress cancelled([](double) { throw Cancelled(); });
  EXPECT_THROW(simulate_to_file(s, path("out.nc"), {}, cancelled), Cancelled);
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(TruthFile, NothingIsLeftWhenTheOutputCannotBeWritten) {
  EXPECT_THROW(simulate_to_file(settings(), path("out.unknown"), {}), InvalidArgument);
  EXPECT_THROW(simulate_to_file(settings(), path("missing/out.nc"), {}), FileError);
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

}  // namespace risley::simulation::truth_file_test
