// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// How fast do recordings go through? The peer is reading the same bytes and doing nothing.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <vector>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include "risley/core/angle.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/time_audit.hpp"
#include "risley/recordings/writer.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/scanner.hpp"

namespace risley {
namespace {

constexpr std::int64_t kShots = 2'000'000;

/// A simulated recording, written once per format and removed at the end.
class Recording {
 public:
  explicit Recording(const std::string& ending)
      : path_((std::filesystem::temp_directory_path() /
               ("risley-bench-" + std::to_string(::getpid()) + ending))
                  .string()) {
    simulation::SimulationSettings settings;
    const bool all_around = ending == ".lvx2";
    settings.truth = sensors::load_sensor(all_around ? "mid-360" : "mid-40");
    settings.rate = settings.truth.shot_rate;
    settings.duration = static_cast<double>(kShots) / *settings.rate;
    settings.scene = scenes::Scene{};
    for (const Vector3<double>& normal : {Vector3<double>{1, 0, 0}, Vector3<double>{-1, 0, 0},
                                          Vector3<double>{0, 1, 0}, Vector3<double>{0, -1, 0}}) {
      scenes::ScenePlane wall;
      wall.name = "wall";
      wall.plane = {normal, 10.0};
      settings.scene->planes.push_back(wall);
      if (!all_around) break;
    }
    simulation::Scanner scanner(settings);
    const auto writer = recordings::create_recording(path_, scanner.header());
    recordings::Chunk chunk;
    recordings::TruthColumns truth;
    while (scanner.read(chunk, truth)) writer->write(chunk);
    writer->close();
  }
  ~Recording() { std::remove(path_.c_str()); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

void rates(benchmark::State& state, const Recording& recording) {
  state.SetItemsProcessed(state.iterations() * kShots);
  state.SetBytesProcessed(state.iterations() *
                          static_cast<std::int64_t>(std::filesystem::file_size(recording.path())));
}

void bytes_only(benchmark::State& state, const char* ending) {
  const Recording recording(ending);
  std::vector<char> buffer(1 << 20);
  for (auto _ : state) {
    std::ifstream file(recording.path(), std::ios::binary);
    while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size()))) {
      benchmark::ClobberMemory();
    }
  }
  rates(state, recording);
}
BENCHMARK_CAPTURE(bytes_only, lvx, ".lvx")->Unit(benchmark::kMillisecond);

void read(benchmark::State& state, const char* ending) {
  const Recording recording(ending);
  recordings::Chunk chunk;
  for (auto _ : state) {
    const auto reader = recordings::open_recording(recording.path());
    while (reader->read(chunk)) benchmark::DoNotOptimize(chunk.observations.azimuth.data());
  }
  rates(state, recording);
}
BENCHMARK_CAPTURE(read, lvx, ".lvx")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read, lvx2, ".lvx2")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read, netcdf, ".nc")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(read, sequence_csv, ".sequence.csv")->Unit(benchmark::kMillisecond);

void audit(benchmark::State& state, const char* ending) {
  const Recording recording(ending);
  for (auto _ : state) {
    const auto reader = recordings::open_recording(recording.path());
    benchmark::DoNotOptimize(recordings::audit_recording(*reader));
  }
  rates(state, recording);
}
BENCHMARK_CAPTURE(audit, lvx, ".lvx")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace risley
