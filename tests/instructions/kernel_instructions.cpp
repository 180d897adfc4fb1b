// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// One call of each kernel with AVX2, on one core, for callgrind to count: it collects within the
// functions counted_*() alone (kernel_instructions_test.py). Prints the number of shots of each.
// Exit status 77: this processor, or the binary, has no AVX2.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <random>
#include <span>
#include <vector>

#include <tbb/global_control.h>

#include "risley/calibration/plane_equations.hpp"
#include "risley/core/angle.hpp"
#include "risley/estimation/ekf.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/optics/batch.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/sensors/preset.hpp"

namespace risley {
namespace {

constexpr InstructionSet kSet = InstructionSet::avx2;
constexpr std::size_t kShots = 1 << 14;
constexpr std::size_t kFilteredShots = 1000;
constexpr double kShotInterval = 1e-5;  // s
constexpr double kAngleNoise = radians_from_degrees(0.01);
constexpr double kRangeNoise = 0.02;  // m
constexpr std::array<double, 2> kStartAngle{0.3, 1.7};

/// Shots of Table 3's unit at constant speeds, their directions with noise and ranges to a wall.
struct Workload {
  sensors::Sensor sensor = sensors::load_sensor("mid-40-table3");
  std::array<std::vector<double>, 2> angle;
  std::vector<double> azimuth, zenith;
  std::array<std::vector<std::vector<double>>, 2> gradient;
  estimation::AngleSeries series;
  std::vector<estimation::FreeParameter> free =
      estimation::free_parameters(estimation::default_free_names({2}), {2});
  estimation::RotorTrajectory knots;
  calibration::RangedShots ranged;
  calibration::PlaneView view;

  Workload() : azimuth(kShots), zenith(kShots) {
    for (auto& column : angle) column.resize(kShots);
    turn();
    make_gradients();
    std::mt19937_64 generator(1);
    make_series(generator);
    make_knots();
    make_wall(generator);
  }

  std::vector<std::span<const double>> angles() const { return {angle[0], angle[1]}; }

  /// Rotation angles at constant speeds.
  void turn() {
    for (std::size_t i = 0; i < kShots; ++i) {
      const double time = kShotInterval * static_cast<double>(i);
      for (std::size_t k = 0; k < 2; ++k) {
        angle[k][i] = rotation_angle_at(kStartAngle[k], sensor.angular_velocity[k], time);
      }
    }
  }

  LinearisationColumns gradients() {
    return {azimuth,
            zenith,
            {gradient[0].begin(), gradient[0].end()},
            {gradient[1].begin(), gradient[1].end()}};
  }

 private:
  /// Columns of nine errors of the train and both rotation angles.
  void make_gradients() {
    const auto train = static_cast<std::size_t>(parameter_count(2));
    for (auto& columns : gradient) {
      columns.resize(train + 2);
      for (const int at :
           {place::incident_beam_horizontal(), place::incident_beam_vertical(),
            place::bearing_tilt_horizontal(0), place::bearing_tilt_vertical(0),
            place::prism_tilt_horizontal(0), place::prism_tilt_vertical(0),
            place::prism_tilt_horizontal(1), place::prism_tilt_vertical(1),
            place::refractive_index_air(), parameter_count(2), parameter_count(2) + 1}) {
        columns[static_cast<std::size_t>(at)].resize(kShots);
      }
    }
  }

  void make_series(std::mt19937_64& generator) {
    std::normal_distribution<double> noise(0.0, kAngleNoise);
    observe_batch(sensor.train, angles(), {{}, {}, {}, azimuth, zenith}, {}, kSet);
    for (std::size_t i = 0; i < kShots; ++i) {
      series.time_ns.push_back(static_cast<std::int64_t>(10000 * i));
      series.azimuth.push_back(azimuth[i] + noise(generator));
      series.zenith.push_back(zenith[i] + noise(generator));
    }
    series.beam.resize(kShots);
    series.azimuth_rounding_variance.resize(kShots);
    series.zenith_rounding_variance.resize(kShots);
  }

  void make_knots() {
    const estimation::ShotRange all{0, kShots};
    knots = estimation::make_knots(series, std::span(&all, 1), 2);
    for (std::size_t knot = 0; knot < knots.size(); ++knot) {
      const double time = 1e-9 * static_cast<double>(knots.time_ns[knot]);
      for (std::size_t k = 0; k < 2; ++k) {
        const double speed = sensor.angular_velocity[k];
        const auto state = knots.state_of(knot).subspan(estimation::kStatesPerRotor * k);
        state[0] = kStartAngle[k] + speed * time;
        state[1] = speed;
      }
    }
  }

  void make_wall(std::mt19937_64& generator) {
    std::normal_distribution<double> noise(0.0, kRangeNoise);
    view.train = sensor.train;
    view.geometry = sensor.geometry;
    for (const auto& parameter : free) {
      if (parameter.name != "refractive_index") view.places.push_back(parameter.places.front());
    }
    view.range_variance = kRangeNoise * kRangeNoise;
    view.plane = {{1, 0, 0}, 30.0};
    view.tangent_1 = {0, 1, 0};
    view.tangent_2 = {0, 0, 1};
    ranged.resize(2, kShots);
    for (std::size_t i = 0; i < kShots; ++i) {
      const std::array<double, 2> both{angle[0][i], angle[1][i]};
      const Ray ray = emergent_ray(sensor.train, sensor.geometry, both);
      for (std::size_t k = 0; k < 2; ++k) ranged.rotation_angle[k][i] = wrap_to_pi(both[k]);
      ranged.range[i] = hit_distance(view.plane, ray.origin, ray.direction) + noise(generator);
    }
  }
};

void demand(bool right, const char* what) {
  if (right) return;
  std::fprintf(stderr, "kernel_instructions: %s\n", what);
  std::exit(1);
}

}  // namespace
}  // namespace risley

// What callgrind collects in; it knows them by these names.
extern "C" {

[[gnu::noinline]] void counted_directions(risley::Workload& w) {
  observe_batch(w.sensor.train, w.angles(), {{}, {}, {}, w.azimuth, w.zenith}, {}, risley::kSet);
}

[[gnu::noinline]] void counted_sequence(risley::Workload& w) {
  w.turn();
  observe_batch(w.sensor.train, w.angles(), {{}, {}, {}, w.azimuth, w.zenith}, {}, risley::kSet);
}

[[gnu::noinline]] void counted_jacobian(risley::Workload& w) {
  linearise_batch(w.sensor.train, w.angles(), w.gradients(), {}, risley::kSet);
}

[[gnu::noinline]] void counted_accumulate(risley::Workload& w,
                                          risley::estimation::NormalEquations& equations) {
  const risley::estimation::ShotWeights weights{
      risley::estimation::equal_noise(risley::kAngleNoise), 0.0, 20.0};
  accumulate(w.series, w.knots, w.sensor.train, w.free, weights, equations, {}, risley::kSet);
}

[[gnu::noinline]] void counted_wall(risley::Workload& w,
                                    risley::calibration::PlaneEquations& equations) {
  equations = plane_equations(w.ranged, w.view, {}, risley::kSet);
}

[[gnu::noinline]] void counted_filter(const risley::estimation::AngleSeries& series,
                                      const risley::estimation::Start& start,
                                      const risley::estimation::EkfOptions& options,
                                      risley::estimation::Solution& solution) {
  solution = run_ekf(series, start, options);
}

}  // extern "C"

int main() {
  using namespace risley;
  const auto& sets = available_instruction_sets();
  if (std::find(sets.begin(), sets.end(), kSet) == sets.end()) return 77;
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  Workload w;
  counted_directions(w);
  demand(std::abs(w.zenith[0] - w.series.zenith[0]) < 10 * kAngleNoise, "directions are off");
  counted_sequence(w);
  counted_jacobian(w);

  estimation::NormalEquations equations;
  counted_accumulate(w, equations);
  demand(equations.shots == kShots && equations.outliers < kShots / 100, "shots do not fit");

  calibration::PlaneEquations wall;
  counted_wall(w, wall);
  demand(wall.shots == kShots && std::abs(wall.cost / kShots - 1.0) < 0.1, "ranges do not fit");

  const estimation::AngleSeries few = estimation::rows_of(w.series, 0, kFilteredShots);
  estimation::Start start;
  start.reach = 1.0;
  start.rotation_angle.assign(kStartAngle.begin(), kStartAngle.end());
  start.angular_velocity = w.sensor.angular_velocity;
  start.train = w.sensor.train;
  estimation::EkfOptions options;
  options.angle_noise = kAngleNoise;
  options.free = w.free;
  options.rotor_process.assign(2, {radians_from_degrees(1.0), 0.0, 0.0});
  options.passes = 1;
  estimation::Solution solution;
  counted_filter(few, start, options, solution);
  demand(solution.outliers < kFilteredShots / 50, "the filter lost its shots");

  for (const char* name : {"directions", "sequence", "jacobian", "accumulate", "wall"}) {
    std::printf("%s %zu\n", name, kShots);
  }
  std::printf("filter %zu\n", kFilteredShots);
  return 0;
}
