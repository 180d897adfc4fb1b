// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// How uncertain is a point, and how much of its error does it share with its neighbour? Points are
// made in memory here; jobs::cloud_of_recording() writes them to a file.
//
//   04_covariance_of_points [SCENE] [--folder FOLDER]     data/hall.yaml of the sources without one
#include <algorithm>
#include <cmath>
#include <limits>

#include <risley/cloud/pointing.hpp>
#include <risley/jobs/calibrate_recordings.hpp>
#include <risley/jobs/simulation_settings.hpp>
#include <risley/simulation/truth_file.hpp>

#include "example.hpp"

using namespace risley;

/// The returns of a recording as points with covariance and with the loadings of common factors.
cloud::Points points_of(const std::string& recording, const sensors::Sensor& calibration) {
  recordings::Observations rows;
  recordings::Chunk chunk;
  const auto reader = recordings::open_recording(recording);
  while (reader->read(chunk)) rows.append(chunk.observations);

  // What the sensor believes, and from that the rotation angles of its prisms.
  estimation::ShotSelector selector({});
  selector.add(rows);
  const auto belief = cloud::sensor_belief(selector.series(), selector.head(), calibration, {});
  cloud::RotorTracker tracker(belief, 5000.0);
  tracker.track(rows);

  std::vector<std::size_t> returns;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (rows.valid[row] != 0 && rows.range[row] > 0) returns.push_back(row);
  }
  cloud::PointedShots shots;
  shots.resize(calibration.prisms(), returns.size());
  tracker.angles(rows, returns, shots.rotation_angle, shots.angle_covariance);
  const auto rounding = [](double step) { return step * step / 12; };
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const std::size_t row = returns[i];
    shots.azimuth[i] = rows.azimuth[row];
    shots.zenith[i] = rows.zenith[row];
    shots.range[i] = rows.range[row];
    shots.intensity[i] = rows.intensity[row];
    shots.beam[i] = rows.beam[row];
    shots.azimuth_rounding[i] = rounding(rows.azimuth_resolution[row]);
    shots.zenith_rounding[i] = rounding(rows.zenith_resolution[row]);
    shots.range_rounding[i] = rounding(rows.range_resolution[row]);
    for (auto& axis : shots.surface_normal) axis[i] = std::nan("");  // not known
  }

  const cloud::PointingModel model = cloud::pointing_model(calibration, belief, {});
  cloud::CloudHeader header;
  header.prisms = calibration.prisms();
  for (const cloud::CommonFactor& factor : model.factors) header.factors.push_back(factor.name);
  cloud::Points points;
  header.resize(points, shots.size());
  cloud::compute_points(model, header, shots, points);
  return points;
}

int covariance_of_points(const Arguments& arguments) {
  jobs::SimulationOptions unit;
  unit.sensor = "mid-40-table3";
  unit.scene = arguments.value.empty() ? RISLEY_HALL : arguments.value;
  unit.duration = 1.0;
  unit.reported_nominal = true;
  unit.seed = 1;
  const std::string hall = arguments.folder / "hall.lvx";
  simulation::simulate_to_file(jobs::simulation_settings(unit), hall, {});
  jobs::CalibrateRecordingsOptions calibrating;
  calibrating.recordings = {hall};
  const auto calibration = jobs::calibrate_recordings(calibrating).calibration;
  const cloud::Points points = points_of(hall, calibration.sensor);
  fmt::print("{} points, {} common factors\n", points.size(), points.loading.size());

  // The total sigma of a point is the root of the sum of its variances.
  const auto& c = points.covariance;
  for (const auto& [low, high] : {std::pair(1, 5), {5, 10}, {10, 20}, {20, 35}}) {
    std::vector<double> total;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points.range[i] < low || points.range[i] >= high) continue;
      total.push_back(std::sqrt(c[cloud::kXX][i] + c[cloud::kYY][i] + c[cloud::kZZ][i]));
    }
    if (total.empty()) continue;
    const auto middle = total.begin() + static_cast<std::ptrdiff_t>(total.size() / 2);
    std::nth_element(total.begin(), middle, total.end());
    fmt::print("{:2} to {:2} m: total sigma {:.1f} mm, {} points\n", low, high, 1000 * *middle,
               total.size());
  }

  // A point on the end wall and the next shot: their covariance is the sum of the products of
  // their loadings.
  const auto ahead =
      std::find_if(points.x.begin(), points.x.end(), [](double x) { return x > 29.5; });
  if (points.x.end() - ahead < 2) throw EstimationError("no two points beyond 29.5 m ahead");
  const auto a = static_cast<std::size_t>(ahead - points.x.begin()), b = a + 1;
  fmt::print("{:.0f} mm apart\n",
             1000 * std::hypot(points.x[a] - points.x[b], points.y[a] - points.y[b],
                               points.z[a] - points.z[b]));
  const cloud::CovarianceTerm variance[] = {cloud::kXX, cloud::kYY, cloud::kZZ};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double shared = 0;
    for (const auto& loading : points.loading) shared += loading[axis][a] * loading[axis][b];
    const double sigma_a = std::sqrt(c[variance[axis]][a]),
                 sigma_b = std::sqrt(c[variance[axis]][b]);
    fmt::print("{}: sigma {:.2f} mm, of it shared {:.3f} mm, correlation {:.4f}\n", "XYZ"[axis],
               1000 * sigma_a, 1000 * std::sqrt(shared), shared / (sigma_a * sigma_b));
  }
  return 0;
}

int main(int argc, char** argv) { return run_example(argc, argv, covariance_of_points); }
