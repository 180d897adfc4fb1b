// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// How long does the batch estimator take for all shots of a recording, on one core? The peer is a
// forward extended Kalman filter written plainly with Eigen and automatic differentiation. The
// column error_over_bound says how good each result is: about 1 is as good as the data allow.
// Compare rows of one run; the argument is the recording's length in seconds, so that
// --benchmark_filter=/3/ is the short way. `ratio` measures both back to back; cpu_ratio is the one
// to read on a machine that does other work too.
// The peer (filter_peer.cpp) is compiled for this processor; the library chooses its instruction
// set when it runs.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <tbb/global_control.h>

#include "risley/core/angle.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/scanner.hpp"

#include "estimation/filter.hpp"
#include "filter_peer.hpp"
#include "in_turn.hpp"

namespace risley {
namespace {

/// Everything here runs on one core.
const tbb::global_control one_core(tbb::global_control::max_allowed_parallelism, 1);

constexpr double kAngleNoise = radians_from_degrees(0.01);

/// The eight constants that are estimated, with the smallest standard deviation that 30 s at 100
/// kHz allow (Cramer-Rao); it falls with the root of the time.
struct Bound {
  const char* name;
  double bound;  // index, or deg
};
constexpr std::array<Bound, 8> kBounds{{{"refractive_index", 4.3e-7},
                                        {"incident_beam_horizontal_deg", 1.05e-5},
                                        {"incident_beam_vertical_deg", 1.05e-5},
                                        {"bearing_tilt_a_horizontal_deg", 2.0e-4},
                                        {"bearing_tilt_a_vertical_deg", 2.0e-4},
                                        {"prism_tilt_a_vertical_deg", 1.9e-4},
                                        {"prism_tilt_b_horizontal_deg", 2.4e-4},
                                        {"prism_tilt_b_vertical_deg", 2.3e-4}}};

/// Root mean square of error over bound.
double error_over_bound(const Eigen::VectorXd& parameters, int seconds) {
  const sensors::Sensor truth = sensors::load_sensor("mid-40-table3");
  double sum = 0;
  for (std::size_t i = 0; i < kBounds.size(); ++i) {
    const ParameterInfo& info = find_parameter(kBounds[i].name, {2});
    const double bound = kBounds[i].bound * info.si_per_unit * std::sqrt(30.0 / seconds);
    const double error = parameters[static_cast<Eigen::Index>(i)] - truth.get(kBounds[i].name);
    sum += error * error / (bound * bound);
  }
  return std::sqrt(sum / static_cast<double>(kBounds.size()));
}

/// What both estimators get: every shot, and those of the first second for the start.
struct Recording {
  estimation::AngleSeries series, head;
};

/// Table 3's unit at 100 kHz, simulated once per length.
const Recording& recording(int seconds) {
  static std::map<int, Recording> simulated;
  const auto known = simulated.find(seconds);
  if (known != simulated.end()) return known->second;
  simulation::SimulationSettings settings;
  settings.truth = sensors::load_sensor("mid-40-table3");
  settings.duration = seconds;
  settings.rate = 100000.0;
  settings.angle_noise = kAngleNoise;
  settings.quantize = false;
  settings.rotor = simulation::RotorKind::sinusoidal;
  settings.seed = 1;
  simulation::Scanner scanner(settings);
  estimation::ShotSelector selector({});
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  while (scanner.read(chunk, truth)) selector.add(chunk.observations);
  Recording result;
  result.head = selector.head();
  result.series = selector.take_series();
  return simulated.emplace(seconds, std::move(result)).first->second;
}

/// As the command calls it: from the nominal Mid-40, everything else found from the data.
estimation::EstimateOptions map_options() {
  estimation::EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-40");
  options.angle_noise = kAngleNoise;
  return options;
}

peers::PlainFilter peer_filter(const estimation::Start& start, std::int64_t time_ns) {
  const double ahead = 1e-9 * static_cast<double>(time_ns - start.time_ns);
  std::array<double, 2> angle{}, speed{};
  for (std::size_t k = 0; k < 2; ++k) {
    speed[k] = start.angular_velocity[k];
    angle[k] = start.rotation_angle[k] + ahead * speed[k];
  }
  return {start.train, angle, speed, time_ns, kAngleNoise};
}

/// One run of an estimator.
struct Run {
  Eigen::VectorXd parameters;
  double seconds = 0;      // of the wall clock
  double cpu_seconds = 0;  // of this process, which a busy machine changes least
};

class Stopwatch {
 public:
  void stop(Run& run) const {
    const auto now = std::chrono::steady_clock::now();
    run.seconds = std::chrono::duration<double>(now - wall_).count();
    run.cpu_seconds = static_cast<double>(std::clock() - cpu_) / CLOCKS_PER_SEC;
  }

 private:
  std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
  std::clock_t cpu_ = std::clock();
};

/// The whole call that the command's `solve` measures, start, covariances and states included.
Run run_map(const Recording& data) {
  const estimation::EstimateOptions options = map_options();
  estimation::AngleSeries series = data.series;
  Run run;
  const Stopwatch stopwatch;
  const auto estimate =
      estimation::estimate(estimation::Method::map, std::move(series), data.head, options);
  stopwatch.stop(run);
  if (!estimate.converged) throw std::runtime_error("not converged: " + estimate.reason);
  run.parameters = estimate.parameters;
  return run;
}

/// Forwards through all shots, not back and without outputs; the time of the start does not count.
Run run_peer(const Recording& data) {
  const estimation::EstimateOptions options = map_options();
  const auto free = estimation::free_parameters(estimation::default_free_names({2}), {2});
  const estimation::Start start = estimation::find_start(
      data.head, options.sensor, {free, kAngleNoise, options.mirrored, options.turned});
  const estimation::AngleSeries& series = data.series;
  Run run;
  const Stopwatch stopwatch;
  peers::PlainFilter filter = peer_filter(start, series.time_ns[0]);
  for (std::size_t i = 0; i < series.size(); ++i) {
    filter.predict(series.time_ns[i]);
    filter.update(series.azimuth[i], series.zenith[i]);
  }
  stopwatch.stop(run);
  const auto mean = filter.mean();
  run.parameters = Eigen::Map<const Eigen::VectorXd>(mean.data(), peers::PlainFilter::kConstants);
  return run;
}

template <class Estimator>
void run_estimator(benchmark::State& state, Estimator estimator) {
  const auto seconds = static_cast<int>(state.range(0));
  const Recording& data = recording(seconds);
  for (auto _ : state) {
    const Run run = estimator(data);
    state.SetIterationTime(run.seconds);
    const double millions = 1e-6 * static_cast<double>(data.series.size());
    state.counters["s_per_Mshot"] = run.seconds / millions;
    state.counters["cpu_s_per_Mshot"] = run.cpu_seconds / millions;
    state.counters["error_over_bound"] = error_over_bound(run.parameters, seconds);
  }
}

void batch_map(benchmark::State& state) { run_estimator(state, run_map); }
void plain_ekf(benchmark::State& state) { run_estimator(state, run_peer); }

/// Both back to back: the share of the peer's time that the batch estimator takes.
void ratio(benchmark::State& state) {
  const Recording& data = recording(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    const Run map = run_map(data), peer = run_peer(data);
    state.SetIterationTime(map.seconds + peer.seconds);
    state.counters["map_s"] = map.seconds;
    state.counters["peer_s"] = peer.seconds;
    state.counters["ratio"] = map.seconds / peer.seconds;
    state.counters["cpu_ratio"] = map.cpu_seconds / peer.cpu_seconds;
  }
}

/// Prediction and update by one observation: the library's own filter and the peer in turn, from
/// the same start. difference_in_sigmas is the largest of the states after the last shot.
void filter_step(benchmark::State& state, InstructionSet set) {
  constexpr std::size_t kSteps = 2000, kStride = 100;
  const Recording& data = recording(3);
  estimation::AngleSeries series;
  for (std::size_t i = 0; i < kSteps; ++i) series.append(data.series, i * kStride);
  const estimation::EstimateOptions options = map_options();
  estimation::EkfOptions ekf;
  ekf.angle_noise = kAngleNoise;
  ekf.free = estimation::free_parameters(estimation::default_free_names({2}), {2});
  const estimation::Start start = estimation::find_start(
      data.head, options.sensor, {ekf.free, kAngleNoise, options.mirrored, options.turned});
  const std::vector<estimation::RotorProcess> process(
      2, {peers::PlainFilter::kAcceleration, 0.0, 0.0});
  const estimation::Filter filter(series, start.train, ekf, process, nullptr);
  const std::vector<unsigned char> outlier(kSteps);
  estimation::FilterRun all;
  all.count = kSteps;
  all.gate = std::numeric_limits<double>::infinity();
  all.outlier = outlier.data();
  const estimation::FilterState first = first_state(filter, series, start, ekf.free);
  estimation::FilterState ours;
  peers::PlainFilter peer = peer_filter(start, series.time_ns[0]);
  bench::run_in_turn(
      state, kSteps,
      [&] {
        ours = first;
        filter.run(ours, all, set);
      },
      kSteps,
      [&] {
        peer = peer_filter(start, series.time_ns[0]);
        for (std::size_t i = 0; i < kSteps; ++i) {
          peer.predict(series.time_ns[i]);
          peer.update(series.azimuth[i], series.zenith[i]);
        }
      });
  double difference = 0;
  const auto mean = peer.mean(), sigma = peer.sigma();
  for (std::size_t i = 0; i < mean.size(); ++i) {
    double apart = ours.mean[static_cast<Eigen::Index>(i)] - mean[i];
    if (i == 8 || i == 10) apart = wrap_to_pi(apart);
    difference = std::max(difference, std::abs(apart) / sigma[i]);
  }
  state.counters["difference_in_sigmas"] = difference;
}

/// The step of the batch estimator that sees every shot, at its answer.
/// @param parameters  how many of the free ones, the first
void accumulate(benchmark::State& state, InstructionSet set, std::size_t parameters) {
  const Recording& data = recording(3);
  static const auto answer =
      estimation::estimate(estimation::Method::map, data.series, data.head, map_options());
  const std::vector<estimation::FreeParameter> free(
      answer.free.begin(), answer.free.begin() + static_cast<std::ptrdiff_t>(parameters));
  const std::size_t shots = data.series.size();
  std::vector<double> azimuth(shots), zenith(shots);
  std::vector<unsigned char> outlier(shots);
  const estimation::ShotWeights weights{estimation::equal_noise(kAngleNoise), 0.0, 20.0};
  estimation::NormalEquations equations;
  for (auto _ : state) {
    estimation::accumulate(data.series, answer.trajectory, answer.train, free, weights, equations,
                           {azimuth, zenith, outlier}, set);
    benchmark::ClobberMemory();
  }
  state.counters["per_shot"] =
      benchmark::Counter(static_cast<double>(shots), benchmark::Counter::kIsIterationInvariantRate |
                                                         benchmark::Counter::kInvert);
}

const bool registered = [] {
  const auto once = [](const char* name, void (*function)(benchmark::State&)) {
    benchmark::RegisterBenchmark(name, function)
        ->Arg(3)
        ->Arg(30)
        ->Iterations(1)
        ->UseManualTime()
        ->Unit(benchmark::kSecond);
  };
  once("batch_map", batch_map);
  once("plain_ekf", plain_ekf);
  once("ratio", ratio);
  for (const InstructionSet set : available_instruction_sets()) {
    benchmark::RegisterBenchmark(("accumulate/" + to_string(set)).c_str(), accumulate, set,
                                 kBounds.size())
        ->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark(("filter_step/" + to_string(set)).c_str(), filter_step, set)
        ->Iterations(101)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  }
  for (std::size_t parameters = 1; parameters <= kBounds.size(); ++parameters) {
    benchmark::RegisterBenchmark(fmt::format("accumulate_parameters/{}", parameters).c_str(),
                                 accumulate, best_instruction_set(), parameters)
        ->Unit(benchmark::kMillisecond);
  }
  return true;
}();

}  // namespace
}  // namespace risley
