// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/simulation/trajectory_noise.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "risley/algebra/rotation_vector.hpp"
#include "risley/core/random.hpp"

#include "simulation/streams.hpp"

namespace risley::simulation {
namespace {

using trajectories::kPoseErrors;

/// A Gauss-Markov process of sigma 1 at the records' times, exact for any steps.
std::vector<double> markov_process(const std::vector<std::int64_t>& time_ns,
                                   double correlation_time, const RandomStream& random) {
  std::vector<double> values(time_ns.size());
  random.fill_normal(0, values);
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double steps = 1e-9 * static_cast<double>(time_ns[i] - time_ns[i - 1]) / correlation_time;
    values[i] = std::exp(-steps) * values[i - 1] + std::sqrt(-std::expm1(-2 * steps)) * values[i];
  }
  return values;
}

}  // namespace

trajectories::Trajectory with_errors(const trajectories::Trajectory& truth,
                                     const trajectories::ErrorModel& model, std::uint64_t seed) {
  const trajectories::ErrorProcess process(model, truth);
  std::array<std::vector<double>, kPoseErrors> markov;
  std::vector<RandomStream> white;
  for (std::size_t i = 0; i < kPoseErrors; ++i) {
    markov[i] = markov_process(truth.time_ns, process.correlation_times()[static_cast<int>(i)],
                               RandomStream(seed, stream::trajectory_error(i)));
    white.emplace_back(seed, stream::trajectory_white_error(i));
  }
  trajectories::Trajectory noisy = truth;
  noisy.accuracy.resize(truth.size());
  for (std::size_t row = 0; row < truth.size(); ++row) {
    const std::int64_t time_ns = truth.time_ns[row];
    const trajectories::PoseErrorVector sigmas = process.sigmas(time_ns);
    const auto sample = static_cast<std::uint64_t>(process.sample(time_ns));
    trajectories::PoseErrorVector error;
    for (std::size_t i = 0; i < kPoseErrors; ++i) {
      const auto at = static_cast<int>(i);
      error[at] = sigmas[at] * markov[i][row];
      if (process.white()[at] != 0.0) error[at] += process.white()[at] * white[i].normal(sample);
    }
    const Eigen::Matrix3d ned = trajectories::ned_axes(truth.frame, truth.position[row]);
    noisy.position[row] += ned * Eigen::Vector3d(error[0], error[1], -error[2]);
    noisy.attitude[row] = (Eigen::Quaterniond(algebra::rotation_by(
                               ned * Eigen::Vector3d(error[3], error[4], error[5]))) *
                           truth.attitude[row])
                              .normalized();

    const trajectories::PoseErrorVector variance = sigmas.cwiseAbs2() + process.white().cwiseAbs2();
    const double heading =
        trajectories::roll_pitch_heading(truth.frame, truth.position[row], truth.attitude[row])
            .heading;
    const double c2 = std::cos(heading) * std::cos(heading), s2 = 1 - c2;
    trajectories::PoseAccuracy& accuracy = noisy.accuracy[row];
    accuracy.position = variance.head<3>().cwiseSqrt();
    accuracy.roll = std::sqrt(c2 * variance[3] + s2 * variance[4]);
    accuracy.pitch = std::sqrt(s2 * variance[3] + c2 * variance[4]);
    accuracy.heading = std::sqrt(variance[5]);
  }
  return noisy;
}

}  // namespace risley::simulation
