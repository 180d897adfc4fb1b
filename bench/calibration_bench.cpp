// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// How long does it take to calibrate a sensor on one wall, on one core, from a million ranges? The
// peer is the same least-squares problem given to Ceres with automatic differentiation. `adjust`
// runs both in turn and fails unless they end at the same cost: peer_over_ours is the median of how
// many times longer the peer takes, and cpu_over_ours that in time of the processor, which a busy
// machine changes least.
// The library chooses its instruction set at run time, while the peer has that of the compiler's
// flags. Configure everything with CMAKE_CXX_FLAGS=-march=native to compare on equal terms.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <ceres/ceres.h>
#include <fmt/format.h>
#include <tbb/global_control.h>

#include "risley/calibration/planar_adjustment.hpp"
#include "risley/calibration/plane_equations.hpp"
#include "risley/core/angle.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::calibration {
namespace {

/// Everything here runs on one core.
const tbb::global_control one_core(tbb::global_control::max_allowed_parallelism, 1);

constexpr std::size_t kShots = 1'000'000;
constexpr double kShotInterval = 1e-5;  // s
constexpr double kRangeNoise = 0.02;    // m

/// The constants that are estimated, besides the plane.
const std::vector<std::string> kFree{"incident_beam_horizontal_deg",  "incident_beam_vertical_deg",
                                     "bearing_tilt_a_horizontal_deg", "bearing_tilt_a_vertical_deg",
                                     "prism_tilt_a_vertical_deg",     "prism_tilt_b_horizontal_deg",
                                     "prism_tilt_b_vertical_deg"};

Plane plane(double azimuth_deg, double zenith_deg, double distance) {
  const SphericalAngles<double> normal{radians_from_degrees(azimuth_deg),
                                       radians_from_degrees(zenith_deg)};
  return plane_from_angles(normal, distance);
}

/// Ranges of Table 3's unit to a wall, at exact rotation angles.
std::shared_ptr<const RangedShots> simulated_shots() {
  const sensors::Sensor truth = sensors::load_sensor("mid-40-table3");
  const Plane wall = plane(10.0, 80.0, 30.0);
  auto shots = std::make_shared<RangedShots>();
  shots->rotation_angle.assign(2, std::vector<double>(kShots));
  shots->angle_covariance.assign(3, std::vector<float>(kShots, 0.0F));
  shots->range.resize(kShots);
  std::mt19937_64 generator(1);
  std::normal_distribution<double> noise(0.0, kRangeNoise);
  for (std::size_t i = 0; i < kShots; ++i) {
    std::array<double, 2> angles;
    for (std::size_t k = 0; k < 2; ++k) {
      angles[k] = wrap_to_pi(truth.angular_velocity[k] * kShotInterval * static_cast<double>(i));
      shots->rotation_angle[k][i] = angles[k];
    }
    const Ray ray = emergent_ray(truth.train, truth.geometry, angles);
    shots->range[i] = hit_distance(wall, ray.origin, ray.direction) + noise(generator);
  }
  return shots;
}

/// What both solve: the errors of the train start at zero, the plane a little beside the true one.
const PlanarProblem& problem() {
  static const PlanarProblem posed = [] {
    const sensors::Sensor sensor = sensors::load_sensor("mid-40-table3");
    const Plane start = plane(10.3, 79.8, 30.1);
    PlanarProblem p;
    p.train = sensor.train.without_errors();
    p.geometry = sensor.geometry;
    p.free = estimation::free_parameters(kFree, {2});
    p.stations.resize(1);
    p.walls.resize(1);
    p.walls[0].normal = start.normal;
    p.views.resize(1);
    p.views[0].distance = start.distance;
    p.views[0].range_variance = kRangeNoise * kRangeNoise;
    p.views[0].shots = simulated_shots();
    return p;
  }();
  return posed;
}

/// One run of a solver.
struct Run {
  double cost = 0;  // sum of squared residuals over their variances
  int iterations = 0;
  double seconds = 0;      // of the wall clock
  double cpu_seconds = 0;  // of this process
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

Run run_adjustment(InstructionSet set) {
  AdjustmentOptions options;
  options.set = set;
  PlanarProblem posed = problem();
  Run run;
  const Stopwatch stopwatch;
  const PlanarSolution solution = adjust(std::move(posed), options);
  stopwatch.stop(run);
  run.cost = solution.converged ? solution.cost : std::nan("");
  run.iterations = solution.iterations;
  return run;
}

/// The peer's residual: the library's templates with Jets. The unknowns are seven constants, two
/// small angles of the normal and the distance.
class RangeResidual {
 public:
  static constexpr int kUnknowns = 10;

  RangeResidual(const PlanarProblem& posed, const PlaneView& view, std::size_t shot)
      : problem_(posed), view_(view), shot_(shot) {}

  template <class T>
  bool operator()(const T* unknowns, T* residual) const {
    std::array<T, parameter_count(2)> parameters;
    for (int i = 0; i < parameter_count(2); ++i) {
      parameters[static_cast<std::size_t>(i)] = T(problem_.train[i]);
    }
    const std::size_t free = problem_.free.size();
    for (std::size_t j = 0; j < free; ++j) {
      parameters[static_cast<std::size_t>(problem_.free[j].places.front())] = unknowns[j];
    }
    const auto train = prepare<T, 2>(
        parameters, {FaceOrder::perpendicular_angled, FaceOrder::angled_perpendicular});
    const RangedShots& shots = *problem_.views[0].shots;
    const std::array<T, 2> angles{T(shots.rotation_angle[0][shot_]),
                                  T(shots.rotation_angle[1][shot_])};
    const auto forward = trace_forward(train, angles);
    if (!forward.valid()) return false;
    const double thickness = problem_.geometry.thickness.front();
    const double spacing = problem_.geometry.spacing.front();
    const Vector3<T> origin =
        beam_origin(forward, {T(-spacing), T(-spacing + thickness), T(-thickness), T(0.0)});
    const Vector3<T> normal =
        normalized(lifted<T>(view_.plane.normal) + unknowns[free] * lifted<T>(view_.tangent_1) +
                   unknowns[free + 1] * lifted<T>(view_.tangent_2));
    const T range = (unknowns[free + 2] - dot(normal, origin)) / dot(normal, forward.direction());
    residual[0] = (shots.range[shot_] - range) / kRangeNoise;
    return true;
  }

 private:
  template <class T>
  static Vector3<T> lifted(const Vector3<double>& v) {
    return {T(v.x), T(v.y), T(v.z)};
  }

  const PlanarProblem& problem_;
  const PlaneView& view_;
  std::size_t shot_;
};

/// Ceres on one core, with its defaults but one: at 1e-6 it stops while the cost still falls in the
/// eighth digit, and the library goes on to the minimum. The time of setting up the problem does
/// not count.
Run run_peer() {
  const PlanarProblem& posed = problem();
  const PlaneView view = plane_view(posed, 0);
  std::array<double, RangeResidual::kUnknowns> unknowns{};
  unknowns.back() = view.plane.distance;
  ceres::Problem peer;
  for (std::size_t i = 0; i < kShots; ++i) {
    peer.AddResidualBlock(
        new ceres::AutoDiffCostFunction<RangeResidual, 1, RangeResidual::kUnknowns>(
            new RangeResidual(posed, view, i)),
        nullptr, unknowns.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.num_threads = 1;
  options.function_tolerance = 1e-9;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  Run run;
  const Stopwatch stopwatch;
  ceres::Solve(options, &peer, &summary);
  stopwatch.stop(run);
  run.cost = summary.IsSolutionUsable() ? 2.0 * summary.final_cost : std::nan("");
  run.iterations = static_cast<int>(summary.iterations.size()) - 1;
  return run;
}

double median(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void adjustment(benchmark::State& state, InstructionSet set) {
  std::vector<double> ours, peers, ratios, cpu_ratios;
  double difference = 0;  // of the costs, relative
  Run run, peer;
  for (auto _ : state) {
    peer = run_peer();
    run = run_adjustment(set);
    state.SetIterationTime(run.seconds);
    difference = std::max(difference, std::abs(run.cost - peer.cost) / peer.cost);
    if (!(std::abs(run.cost - peer.cost) < 1e-9 * peer.cost)) {
      state.SkipWithError(
          fmt::format("costs differ: {:.12g}, peer {:.12g}", run.cost, peer.cost).c_str());
      return;
    }
    ours.push_back(run.seconds);
    peers.push_back(peer.seconds);
    ratios.push_back(peer.seconds / run.seconds);
    cpu_ratios.push_back(peer.cpu_seconds / run.cpu_seconds);
  }
  state.SetLabel(fmt::format("cost {:.9g}, peer {:.9g}", run.cost, peer.cost));
  state.counters["ours_s"] = median(ours);
  state.counters["peer_s"] = median(peers);
  state.counters["peer_over_ours"] = median(ratios);
  state.counters["cpu_over_ours"] = median(cpu_ratios);
  state.counters["cpu_ratio_min"] = cpu_ratios.front();
  state.counters["cpu_ratio_max"] = cpu_ratios.back();
  state.counters["cost_difference"] = difference;
  state.counters["iterations"] = run.iterations;
  state.counters["peer_iterations"] = peer.iterations;
}

/// The step of the adjustment that sees every shot.
void equations(benchmark::State& state, InstructionSet set) {
  PlaneView view = plane_view(problem(), 0);
  for (const auto& parameter : problem().free) view.places.push_back(parameter.places.front());
  for (auto _ : state) {
    benchmark::DoNotOptimize(plane_equations(*problem().views[0].shots, view, {}, set));
  }
  state.counters["per_shot"] = benchmark::Counter(
      static_cast<double>(kShots),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

const bool registered = [] {
  for (const InstructionSet set : available_instruction_sets()) {
    benchmark::RegisterBenchmark(("equations/" + to_string(set)).c_str(), equations, set)
        ->Unit(benchmark::kMillisecond);
  }
  for (const InstructionSet set : available_instruction_sets()) {
    benchmark::RegisterBenchmark(("adjust/" + to_string(set)).c_str(), adjustment, set)
        ->Iterations(3)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  }
  return true;
}();

}  // namespace
}  // namespace risley::calibration
