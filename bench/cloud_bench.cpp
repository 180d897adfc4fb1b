// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// How fast do points come out, on one core? The peer reads the recording's bytes and writes as many
// bytes as the cloud has, and does nothing else.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include "risley/cloud/make_cloud.hpp"
#include "risley/core/angle.hpp"
#include "risley/recordings/writer.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/scanner.hpp"
#include "risley/trajectories/error_process.hpp"
#include "risley/trajectories/flight_plan.hpp"
#include "risley/trajectories/mount.hpp"

namespace risley {
namespace {

constexpr double kDuration = 60.0;  // s
constexpr auto kShots = static_cast<std::int64_t>(kDuration * 100000.0);

/// A file name of this process, removed at the end.
class File {
 public:
  explicit File(const std::string& ending)
      : path_((std::filesystem::temp_directory_path() /
               ("risley-bench-" + std::to_string(::getpid()) + ending))
                  .string()) {}
  ~File() { std::remove(path_.c_str()); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// A Mid-40 that is bent and believes to be perfect, before a wall at 10 m.
const std::string& recording() {
  static const File file(".lvx");
  static const bool written = [] {
    simulation::SimulationSettings settings;
    settings.truth = sensors::load_sensor("mid-40-table3");
    settings.rate = 100000.0;
    settings.duration = kDuration;
    settings.range_noise = 0.02;
    settings.angle_noise = radians_from_degrees(0.004);
    settings.rotor = simulation::RotorKind::sinusoidal;
    settings.scene = scenes::Scene{};
    scenes::ScenePlane wall;
    wall.name = "wall";
    wall.plane = {{1, 0, 0}, 10.0};
    settings.scene->planes.push_back(wall);
    simulation::Scanner scanner(settings);
    const auto writer = recordings::create_recording(file.path(), scanner.header());
    recordings::Chunk chunk;
    recordings::TruthColumns truth;
    while (scanner.read(chunk, truth)) writer->write(chunk);
    writer->close();
    return true;
  }();
  (void)written;
  return file.path();
}

/// A calibration on planes: all of its covariance matters.
sensors::Sensor calibration() {
  sensors::Sensor sensor = sensors::load_sensor("mid-40-table3");
  sensor.reference = sensors::CalibrationReference::planes;
  sensor.covariance_names = {"incident_beam_horizontal_deg",  "incident_beam_vertical_deg",
                             "bearing_tilt_a_horizontal_deg", "bearing_tilt_a_vertical_deg",
                             "prism_tilt_a_vertical_deg",     "prism_tilt_b_horizontal_deg",
                             "prism_tilt_b_vertical_deg",     "range_offset_m"};
  const double sigma = radians_from_degrees(0.005);
  sensor.covariance = Eigen::MatrixXd::Constant(8, 8, 0.3 * sigma * sigma);
  sensor.covariance.diagonal().setConstant(sigma * sigma);
  return sensor;
}

void rates(benchmark::State& state, const std::string& output) {
  state.SetItemsProcessed(state.iterations() * kShots);
  const auto bytes = std::filesystem::file_size(recording()) + std::filesystem::file_size(output);
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes));
}

void make(benchmark::State& state, bool reported) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const File output(".las");
  sensors::Sensor sensor = calibration();
  cloud::CloudOptions options;
  if (reported) {
    sensor.reference = sensors::CalibrationReference::directions;
    options.pointing.reported_directions = true;
    options.pointing.beam_origin = false;
  }
  recording();
  for (auto _ : state) {
    const auto reader = recordings::open_recording(recording());
    benchmark::DoNotOptimize(cloud::make_cloud(*reader, sensor, output.path(), options));
  }
  rates(state, output.path());
}

/// Everything: rotation angles found, directions from the calibration, beam origin.
void lvx_to_las_smoothed(benchmark::State& state) { make(state, false); }
BENCHMARK(lvx_to_las_smoothed)->Unit(benchmark::kMillisecond)->MinTime(3.0);

/// Directions as reported, from the frame's origin: no rotation angles are needed.
void lvx_to_las_reported(benchmark::State& state) { make(state, true); }
BENCHMARK(lvx_to_las_reported)->Unit(benchmark::kMillisecond)->MinTime(3.0);

/// The same of a sensor that flies: a minute over level ground, made into points as if it had
/// stood, in the trajectory's own frame, and on a map. Their rates in one run are what counts.
enum class Carrier { stands, own_frame, map };

struct Flown {
  std::shared_ptr<const trajectories::Trajectory> trajectory;
  trajectories::Mount mount;
  std::string path;
};

const Flown& flown(bool on_earth) {
  static const File local_file("-local.lvx"), earth_file("-earth.lvx");
  const auto make_flight = [](const File& file, bool earth) {
    constexpr const char* kOrigin =
        "origin: {latitude_deg: 50, longitude_deg: 8.5, ellipsoidal_height_m: 250}\n";
    const std::string plan = fmt::format(
        "risley_flight: 1\n{}rate_hz: 200\nheight_m: 80\nspeed_m_per_s: 5\nturn_duration_s: 20\n"
        "strips: [{{headings_deg: [90, 270], length_m: 160}}]\n"
        "motion: {{seed: 4, attitude: {{roll_deg: 2, pitch_deg: 2, heading_deg: 2, lowest_hz: "
        "0.15, "
        "highest_hz: 1.2, sinusoids: 6}}}}\n",
        earth ? kOrigin : "");
    Flown result;
    result.trajectory = std::make_shared<trajectories::Trajectory>(
        trajectories::fly(trajectories::parse_flight_plan(plan, "bench")).trajectory);
    result.mount.reference_point = "centre of the inertial unit";
    result.mount.nominal << 0, 0, 1, 0, -1, 0, 1, 0, 0;
    result.path = file.path();
    simulation::SimulationSettings settings;
    settings.truth = sensors::load_sensor("mid-40-table3");
    settings.rate = 100000.0;
    settings.duration = kDuration;
    settings.range_noise = 0.02;
    settings.rotor = simulation::RotorKind::sinusoidal;
    settings.scene = scenes::parse_scene(
        fmt::format("terrain:\n  {}  ground: {{height_m: 0}}\n", earth ? kOrigin : ""), "bench");
    settings.platform.emplace();
    settings.platform->trajectory = result.trajectory;
    settings.platform->mount = result.mount;
    simulation::Scanner scanner(settings);
    const auto writer = recordings::create_recording(file.path(), scanner.header());
    recordings::Chunk chunk;
    recordings::TruthColumns truth;
    while (scanner.read(chunk, truth)) writer->write(chunk);
    writer->close();
    return result;
  };
  static const Flown local = make_flight(local_file, false), earth = make_flight(earth_file, true);
  return on_earth ? earth : local;
}

void fly(benchmark::State& state, Carrier carrier) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const File output(".las");
  const Flown& flight = flown(carrier == Carrier::map);
  cloud::CloudOptions options;
  if (carrier != Carrier::stands) {
    options.platform.emplace();
    options.platform->trajectory = *flight.trajectory;
    options.platform->mount = flight.mount;
    options.platform->errors = trajectories::assumed_error_model();
    for (std::size_t k = 0; k < 6; ++k)
      options.platform->errors->terms[k].sigma = k < 3 ? 0.02 : 5e-4;
    if (carrier == Carrier::map) options.platform->crs = "EPSG:32632";
  }
  const sensors::Sensor sensor = calibration();
  for (auto _ : state) {
    const auto reader = recordings::open_recording(flight.path);
    benchmark::DoNotOptimize(cloud::make_cloud(*reader, sensor, output.path(), options));
  }
  state.SetItemsProcessed(state.iterations() * kShots);
}
BENCHMARK_CAPTURE(fly, as_if_standing, Carrier::stands)
    ->Unit(benchmark::kMillisecond)
    ->MinTime(3.0);
BENCHMARK_CAPTURE(fly, own_frame, Carrier::own_frame)->Unit(benchmark::kMillisecond)->MinTime(3.0);
BENCHMARK_CAPTURE(fly, on_a_map, Carrier::map)->Unit(benchmark::kMillisecond)->MinTime(3.0);

void bytes_only(benchmark::State& state) {
  const File output(".las");
  const File copy(".copy");
  {
    const auto reader = recordings::open_recording(recording());
    cloud::make_cloud(*reader, calibration(), output.path(), {});
  }
  const auto size = static_cast<std::size_t>(std::filesystem::file_size(output.path()));
  std::vector<char> buffer(1 << 20);
  for (auto _ : state) {
    std::ifstream in(recording(), std::ios::binary);
    while (in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()))) {
      benchmark::ClobberMemory();
    }
    std::remove(copy.path().c_str());
    std::ofstream out(copy.path(), std::ios::binary);
    for (std::size_t done = 0; done < size; done += buffer.size()) {
      out.write(buffer.data(), static_cast<std::streamsize>(std::min(buffer.size(), size - done)));
    }
  }
  rates(state, output.path());
}
BENCHMARK(bytes_only)->Unit(benchmark::kMillisecond)->MinTime(2.0);

/// The points alone: one block over and over.
void points(benchmark::State& state, bool covariance) {
  cloud::SensorBelief belief;
  belief.sensor = sensors::load_sensor("mid-40-table3");
  belief.free = estimation::free_parameters({"refractive_index"}, {2});
  belief.covariance = Eigen::MatrixXd::Constant(1, 1, 1e-12);
  belief.angle_sensitivity = Eigen::MatrixXd::Ones(2, 1);
  belief.angle_noise = radians_from_degrees(0.004);
  belief.sensor.train = belief.sensor.train.without_errors();
  const cloud::PointingModel model = cloud::pointing_model(calibration(), belief, {});
  constexpr std::size_t kBlock = 4096;
  cloud::PointedShots shots;
  shots.resize(2, kBlock);
  for (std::size_t i = 0; i < kBlock; ++i) {
    shots.rotation_angle[0][i] = -0.00488 * static_cast<double>(i);
    shots.rotation_angle[1][i] = 0.00764 * static_cast<double>(i);
    shots.angle_covariance[0][i] = shots.angle_covariance[2][i] = 1e-10;
    shots.azimuth[i] = 0.1;
    shots.zenith[i] = 1.5;
    shots.range[i] = 10.0;
    for (auto& column : shots.surface_normal) column[i] = 0.57;
  }
  cloud::CloudHeader header;
  header.has_covariance = covariance;
  cloud::Points made;
  header.resize(made, kBlock);
  for (auto _ : state) {
    cloud::compute_points(model, header, shots, made);
    benchmark::DoNotOptimize(made.x.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kBlock));
}
BENCHMARK_CAPTURE(points, with_covariance, true)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(points, without_covariance, false)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace risley
