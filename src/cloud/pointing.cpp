// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/pointing.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/square.hpp"
#include "risley/optics/batch.hpp"

#include "cloud/entry_checks.hpp"
#include "cloud/pointing_kernel.hpp"

namespace risley::cloud {
namespace {

static_assert(kMountEffects == trajectories::kMountQuantities);

void require_range_errors(const sensors::RangeErrors& errors, int emitters) {
  require_finite("near of range_errors", errors.near, "m");
  require_finite("incidence of range_errors", errors.incidence, "1");
  require_finite("per_decade of range_errors", errors.per_decade, "m");
  require_length_or_none("emitter of range_errors", errors.emitter.size(), emitters);
  for (const double error : errors.emitter) require_finite("emitter of range_errors", error, "m");
}

void require_model(const PointingModel& model) {
  require_between("number of sizes of prisms", static_cast<double>(model.sizes.size()), 0,
                  kMostSizes);
  require_between("number of common factors", static_cast<double>(model.factors.size()), 0,
                  kMostFactors);
  if (model.believed.shape() != model.train.shape()) {
    throw InvalidArgument(
        fmt::format("believed train: {} prisms and {} emitters, expected {} and {} as the true one",
                    model.believed.prisms(), model.believed.emitters(), model.train.prisms(),
                    model.train.emitters()));
  }
  require_not_below("angle noise", model.angle_noise, 0, "rad");
  require_finite("range offset", model.range_offset, "m");
  require_range_errors(model.range_errors, model.train.emitters());
  const auto all_places = static_cast<std::size_t>(parameter_count(model.train.shape()));
  for (const int place : model.places) {
    require_place("place", place, all_places);
  }
  const std::size_t rows =
      model.places.size() + static_cast<std::size_t>(model.train.prisms()) + model.sizes.size();
  for (const CommonFactor& factor : model.factors) {
    require_length("weights of a factor", factor.weights.size(), rows);
    require_range_errors(factor.range_errors, model.train.emitters());
  }
}

void require_shots(const PointingModel& model, const CloudHeader& header,
                   const PointedShots& shots) {
  const int prisms = model.train.prisms();
  require_between("number of prisms of the cloud", header.prisms, prisms, prisms);
  if (!header.factors.empty()) {
    require_length("factors of the cloud", header.factors.size(), model.factors.size());
  }
  const std::size_t n = shots.size();
  if (header.has_rotation_angles) {
    require_length("rotation_angle", shots.rotation_angle.size(), prisms);
    require_length("angle_covariance", shots.angle_covariance.size(), prisms * (prisms + 1) / 2);
    for (const auto& column : shots.rotation_angle) {
      require_length("rotation_angle of a prism", column.size(), n);
    }
    for (const auto& column : shots.angle_covariance) {
      require_length("angle_covariance of two prisms", column.size(), n);
    }
  } else if (needs_rotation_angles(model.sensor, model.options)) {
    throw InvalidArgument("the cloud has no rotation angles, which the model needs");
  }
  require_length("azimuth", shots.azimuth.size(), n);
  require_length("zenith", shots.zenith.size(), n);
  require_length("azimuth_rounding", shots.azimuth_rounding.size(), n);
  require_length("zenith_rounding", shots.zenith_rounding.size(), n);
  require_length("range_rounding", shots.range_rounding.size(), n);
  require_length("intensity", shots.intensity.size(), n);
  for (const auto& column : shots.surface_normal) {
    require_length("surface_normal", column.size(), n);
  }
  check_beams(model.train, shots.beam, n);
}

/// Face positions and their derivatives for the kernel.
struct Faces {
  std::vector<double> position, over_size;

  explicit Faces(const PointingModel& model)
      : position(face_positions(model.train.face_order(), model.geometry)) {
    for (const PrismSize& size : model.sizes) {
      const auto over = face_positions(model.train.face_order(), size.rate);
      over_size.insert(over_size.end(), over.begin(), over.end());
    }
  }
};

/// The nonzero ones of those numbers of rows.
struct SparseRows {
  std::vector<int> begin{0}, column;
  std::vector<double> weight;

  template <class Row>
  void add(const Row& row) {
    int at = 0;
    for (const double value : row) {
      if (value != 0) {
        column.push_back(at);
        weight.push_back(value);
      }
      ++at;
    }
    begin.push_back(static_cast<int>(column.size()));
  }
};

/// In the order of RangeShare; those of emitters where there are any.
std::vector<double> range_row(const sensors::RangeErrors& errors) {
  std::vector<double> row{errors.near, errors.incidence, errors.per_decade};
  row.insert(row.end(), errors.emitter.begin(), errors.emitter.end());
  return row;
}

/// Pointers to the columns of shots and points, from one row on.
class ColumnPointers {
 public:
  ColumnPointers(const CloudHeader& header, const PointedShots& shots, const SensorPoses& poses,
                 Points& points, std::size_t first, PointArguments& a) {
    const auto at = [first](auto& column) { return column.data() + first; };
    for (const auto& column : shots.rotation_angle) angle_.push_back(at(column));
    for (const auto& column : shots.angle_covariance) covariance_.push_back(at(column));
    for (std::size_t i = 0; i < 3; ++i) normal_[i] = at(shots.surface_normal[i]);
    if (header.has_rotation_angles) a.rotation_angle = angle_.data();
    a.angle_covariance = covariance_.data();
    a.surface_normal = normal_.data();
    a.azimuth = at(shots.azimuth);
    a.zenith = at(shots.zenith);
    a.azimuth_variance = at(shots.azimuth_rounding);
    a.zenith_variance = at(shots.zenith_rounding);
    a.range = at(shots.range);
    a.rounding_variance = at(shots.range_rounding);
    a.intensity = at(shots.intensity);
    if (!shots.beam.empty()) a.beam = at(shots.beam);
    for (std::size_t i = 0; i < 3 && poses.size() > 0; ++i) {
      a.velocity[i] = at(poses.velocity[i]);
      a.rate[i] = at(poses.rate[i]);
    }
    a.point[0] = at(points.x);
    a.point[1] = at(points.y);
    a.point[2] = at(points.z);
    if (header.has_covariance) {
      for (std::size_t i = 0; i < kCovarianceTerms; ++i) {
        a.covariance[i] = at(points.covariance[i]);
        if (header.has_own_covariance) a.own_covariance[i] = at(points.own_covariance[i]);
      }
    }
    a.corrected_range = at(points.range);
    a.incidence = at(points.incidence);
    if (header.has_rotation_angles) {
      a.azimuth_residual = at(points.azimuth_residual);
      a.zenith_residual = at(points.zenith_residual);
    }
    if (header.factors.empty()) return;
    for (auto& factor : points.loading) {
      for (auto& column : factor) loading_.push_back(at(column));
    }
    a.loading = loading_.data();
  }

 private:
  std::vector<const double*> angle_, covariance_;
  std::array<const double*, 3> normal_{};
  std::vector<double*> loading_;
};

/// Of fewer shots than a group: padded.
void compute_few_points(const PointingModel& model, const CloudHeader& header, PointedShots shots,
                        Points& points, SensorPoses poses, InstructionSet set) {
  const std::size_t count = shots.size();
  shots.resize(model.train.prisms(), kPointPadding);
  if (model.has_pose) poses.resize(kPointPadding);
  header.resize(points, kPointPadding);
  compute_points(model, header, shots, points, poses, set);
  header.resize(points, count);
}

}  // namespace

void PointedShots::resize(int prisms, std::size_t shots) {
  require_between("number of prisms", prisms, 1, kMaxPrisms);
  rotation_angle.resize(prisms);
  angle_covariance.resize(prisms * (prisms + 1) / 2);
  for (auto* columns : {&rotation_angle, &angle_covariance}) {
    for (auto& column : *columns) column.resize(shots);
  }
  for (auto* column : {&azimuth, &zenith, &azimuth_rounding, &zenith_rounding, &range_rounding,
                       &range, &intensity}) {
    column->resize(shots);
  }
  for (auto& column : surface_normal) column.resize(shots);
  beam.resize(shots);
}

void compute_points(const PointingModel& model, const CloudHeader& header,
                    const PointedShots& shots, Points& points, const SensorPoses& poses,
                    InstructionSet set) {
  require_model(model);
  require_shots(model, header, shots);
  require_poses(poses, model.has_pose ? shots.size() : 0);
  require_columns(points, header, shots.size());
  if (shots.size() > 0 && shots.size() < kPointPadding) {
    compute_few_points(model, header, shots, points, poses, set);
    return;
  }
  const Faces faces(model);
  const auto& kernel = RISLEY_KERNEL_COPIES(compute_points).at(set);
  PointArguments a;
  a.prisms = model.train.layout();
  a.emitters = model.train.emitters();
  a.face_order = model.train.face_order().data();
  a.parameters = model.train.parameters().data();
  a.believed_parameters = model.believed.parameters().data();
  a.face_position = faces.position.data();
  a.sizes = static_cast<int>(model.sizes.size());
  a.face_over_size = faces.over_size.data();
  a.reported_directions = model.options.reported_directions;
  a.angle_noise_variance = square(model.angle_noise);
  a.range_offset = model.range_offset;
  const sensors::Sensor& sensor = model.sensor;
  a.range_variance = square(sensor.range_noise);
  a.range_variance_per_range2 = square(sensor.range_noise_per_range);
  a.range_variance_incidence = square(sensor.range_noise_incidence);
  a.range_variance_weak_return = square(sensor.range_noise_weak_return);
  if (model.options.beam_divergence) {
    a.divergence_variance_horizontal = square(kDivergenceSigma * sensor.beam_divergence_horizontal);
    a.divergence_variance_vertical = square(kDivergenceSigma * sensor.beam_divergence_vertical);
  }
  std::vector<double> range_factor;
  SparseRows of_sensor, of_mount, of_range;
  for (const CommonFactor& factor : model.factors) {
    range_factor.push_back(factor.range_offset);
    of_sensor.add(factor.weights);
    of_mount.add(factor.mount);
    of_range.add(range_row(factor.range_errors));
  }
  std::vector<double> range_emitter = model.range_errors.emitter;
  range_emitter.resize(a.emitters, 0.0);
  a.range_errors = model.range_errors != sensors::RangeErrors{} || !of_range.column.empty();
  a.range_near = model.range_errors.near;
  a.range_incidence = model.range_errors.incidence;
  a.range_per_decade = model.range_errors.per_decade;
  a.range_emitter = range_emitter.data();
  a.divergence_horizontal = sensor.beam_divergence_horizontal;
  a.divergence_vertical = sensor.beam_divergence_vertical;
  a.range_begin = of_range.begin.data();
  a.range_row = of_range.column.data();
  a.range_weight = of_range.weight.data();
  a.places = model.places.data();
  a.place_count = static_cast<int>(model.places.size());
  a.factors = static_cast<int>(model.factors.size());
  a.factor_begin = of_sensor.begin.data();
  a.factor_row = of_sensor.column.data();
  a.factor_weight = of_sensor.weight.data();
  a.range_factor = range_factor.data();
  if (model.has_pose) {
    a.mount_begin = of_mount.begin.data();
    a.mount_row = of_mount.column.data();
    a.mount_weight = of_mount.weight.data();
  }

  const std::size_t whole = shots.size() / kPointPadding * kPointPadding;
  const auto compute = [&](std::size_t first, std::size_t count) {
    const ColumnPointers columns(header, shots, poses, points, first, a);
    a.shots = count;
    kernel(a);
  };
  compute(0, whole);
  // The last group repeats some rows.
  if (whole < shots.size()) compute(shots.size() - kPointPadding, kPointPadding);
  for (std::size_t k = 0; k < points.rotation_angle.size(); ++k) {
    for (std::size_t i = 0; i < shots.size(); ++i) {
      points.rotation_angle[k][i] = wrap_to_two_pi(shots.rotation_angle[k][i]);  // NaN stays
    }
  }
}

}  // namespace risley::cloud
