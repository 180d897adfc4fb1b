// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Sensors with six emitters from an LVX file to an estimate, a calibration and a cloud, over
// random units: are the parameters as good as the stated covariances say?
#include <filesystem>
#include <ostream>
#include <string>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>
#include <unistd.h>

#include "risley/core/angle.hpp"
#include "risley/core/random.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/jobs/calibrate_recordings.hpp"
#include "risley/jobs/cloud_of_recording.hpp"
#include "risley/jobs/estimate_recording.hpp"
#include "risley/simulation/truth_file.hpp"

#include "parameter_name.hpp"
#include "source_tree.hpp"
#include "statistics/simulated_walls.hpp"

namespace risley::six_emitters_test {

namespace fs = std::filesystem;

/// A sensor that is bent as units are: glass 3e-4, tilts 0.3 degree, beams 0.1 degree.
sensors::Sensor random_unit(const std::string& preset, std::uint64_t seed) {
  sensors::Sensor unit = sensors::load_sensor(preset);
  const RandomStream random(seed, 77);
  std::uint64_t draw = 0;
  const auto names =
      estimation::default_free_names(unit.shape(), estimation::one_glass(unit.train));
  for (const auto& free : estimation::free_parameters(names, unit.shape())) {
    const double sigma = free.name.starts_with("refractive_index") ? 3e-4
                         : free.name.starts_with("incident_beam")  ? radians_from_degrees(0.1)
                                                                   : radians_from_degrees(0.3);
    const double change = sigma * random.normal(draw++);
    for (const int place : free.places) {
      unit.train.set_place(place, unit.train[place] + change);
    }
  }
  return unit;
}

/// Errors of parameters against their covariances, summed over units.
struct Nees {
  double sum = 0, count = 0, largest_over_sigma = 0;

  void add(const sensors::Sensor& truth, const std::vector<estimation::FreeParameter>& free,
           const Eigen::VectorXd& parameters, const Eigen::MatrixXd& covariance) {
    // Scaled, since some combinations of parameters are known a thousand times better than others.
    const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
    Eigen::VectorXd error(parameters.size());
    for (Eigen::Index j = 0; j < error.size(); ++j) {
      const auto& one = free[static_cast<std::size_t>(j)];
      error[j] = scale[j] * (parameters[j] - truth.train[one.places.front()]);
      EXPECT_LT(std::abs(error[j]), 4.5) << one.name;
      largest_over_sigma = std::max(largest_over_sigma, std::abs(error[j]));
    }
    const Eigen::MatrixXd correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
    sum += error.dot(correlation.ldlt().solve(error));
    count += static_cast<double>(error.size());
  }
  double per_parameter() const { return sum / count; }
  /// Half the width of the band around 1 that holds it in 999 of 1000 cases.
  double band() const { return 3.3 * std::sqrt(2.0 / count); }
};

/// A preset, the number of its parameters that are free, and of units that are drawn.
struct Type {
  const char* preset;
  std::size_t free;
  int seeds;
};

std::ostream& operator<<(std::ostream& out, const Type& type) { return out << type.preset; }

class SixEmitters : public ::testing::TestWithParam<Type> {};

TEST_P(SixEmitters, FromAFileToACloudEveryParameterIsAsGoodAsItsSigma) {
  const int seeds = testing::seeds_or(GetParam().seeds);
  const fs::path folder =
      fs::temp_directory_path() / ("risley-six-emitters-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const std::string recording = (folder / "unit.lvx").string();
  Nees estimated, calibrated;
  double azimuth = 0, zenith = 0, expected = 0, largest_total = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    simulation::SimulationSettings settings;
    settings.truth = random_unit(GetParam().preset, static_cast<std::uint64_t>(seed));
    settings.scene = scenes::load_scene(in_source_tree("data/hall.yaml"));
    settings.duration = 1.5;
    settings.angle_noise = radians_from_degrees(0.004);
    settings.rotor = simulation::RotorKind::hunting;
    settings.seed = static_cast<std::uint64_t>(seed);
    simulation::simulate_to_file(settings, recording, {});

    jobs::EstimateRecordingOptions estimation;
    estimation.recording = recording;
    estimation.files.folder = (folder / "estimate").string();
    const auto estimate = jobs::estimate_recording(estimation).estimate;
    ASSERT_TRUE(estimate.converged) << estimate.reason;
    EXPECT_EQ(estimate.free.size(), GetParam().free);
    estimated.add(settings.truth, estimate.free, estimate.parameters, estimate.covariance);
    azimuth += estimate.azimuth_moments.rms / seeds;
    zenith += estimate.zenith_moments.rms / seeds;
    expected += estimate.expected_residual / seeds;

    jobs::CalibrateRecordingsOptions calibration;
    calibration.recordings = {recording};
    calibration.truths = {recording + ".truth.yaml"};
    calibration.files.folder = (folder / "calibration").string();
    calibration.force = true;  // whether it is better or not
    const jobs::CalibratedRecordings result = jobs::calibrate_recordings(calibration);
    ASSERT_TRUE(result.calibration.converged) << result.calibration.reason;
    calibrated.add(settings.truth, result.calibration.free, result.calibration.parameters,
                   result.calibration.covariance);
    largest_total = std::max(largest_total, result.truth->after.total);

    jobs::CloudOfRecordingOptions cloud;
    cloud.recording = recording;
    cloud.calibration = (folder / "calibration/calibration.yaml").string();
    cloud.output = (folder / "cloud.nc").string();
    const cloud::CloudSummary points = jobs::cloud_of_recording(cloud).summary;
    EXPECT_GT(points.points, 340'000u);
    EXPECT_FALSE(points.damage);
  }
  fs::remove_all(folder);
  RecordProperty("estimate_nees", std::to_string(estimated.per_parameter()));
  RecordProperty("calibration_nees", std::to_string(calibrated.per_parameter()));
  RecordProperty("estimate_largest_over_sigma", std::to_string(estimated.largest_over_sigma));
  RecordProperty("calibration_largest_over_sigma", std::to_string(calibrated.largest_over_sigma));
  RecordProperty("azimuth_rms_deg", std::to_string(degrees_from_radians(azimuth)));
  RecordProperty("zenith_rms_deg", std::to_string(degrees_from_radians(zenith)));
  EXPECT_NEAR(estimated.per_parameter(), 1.0, estimated.band());
  EXPECT_NEAR(calibrated.per_parameter(), 1.0, calibrated.band());
  EXPECT_NEAR(zenith / expected, 1.0, 0.03);
  RecordProperty("largest_total_deg", std::to_string(degrees_from_radians(largest_total)));
  EXPECT_LT(degrees_from_radians(largest_total), 0.05);
}

INSTANTIATE_TEST_SUITE_P(Presets, SixEmitters,
                         ::testing::Values(Type{"horizon", 25, 6}, Type{"avia", 19, 3},
                                           Type{"tele-15", 19, 3}),
                         [](const auto& type) { return parameter_name(type.param.preset); });

}  // namespace risley::six_emitters_test
