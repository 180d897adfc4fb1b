// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/pointing.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
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
  require_length_or_none("emitter of range_errors", errors.emitter.size(),
                         static_cast<std::size_t>(emitters));
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
    require_place("place", static_cast<std::size_t>(place), all_places);
  }
  const std::size_t rows =
      model.places.size() + static_cast<std::size_t>(model.train.prisms()) + model.sizes.size();
  for (const CommonFactor& factor : model.factors) {
    require_length("weights of a factor", static_cast<std::size_t>(factor.weights.size()), rows);
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
    const auto rotors = static_cast<std::size_t>(prisms);
    require_length("rotation_angle", shots.rotation_angle.size(), rotors);
    require_length("angle_covariance", shots.angle_covariance.size(), rotors * (rotors + 1) / 2);
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

/// Face positions and their derivatives as the kernel wants them.
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

/// Calls function(from column, to column) for every column of shots.
template <class Function>
void for_each_column(const PointedShots& from, PointedShots& to, const Function& function) {
  for (std::size_t k = 0; k < from.rotation_angle.size(); ++k) {
    function(from.rotation_angle[k], to.rotation_angle[k]);
  }
  for (std::size_t k = 0; k < from.angle_covariance.size(); ++k) {
    function(from.angle_covariance[k], to.angle_covariance[k]);
  }
  for (std::size_t k = 0; k < 3; ++k) function(from.surface_normal[k], to.surface_normal[k]);
  for (const auto column :
       {&PointedShots::azimuth, &PointedShots::zenith, &PointedShots::azimuth_rounding,
        &PointedShots::zenith_rounding, &PointedShots::range_rounding, &PointedShots::range,
        &PointedShots::intensity}) {
    function(from.*column, to.*column);
  }
  function(from.beam, to.beam);
}

/// The same for the columns of points that the kernel fills.
template <class Function>
void for_each_computed_column(const Points& from, Points& to, const Function& function) {
  for (const auto column : {&Points::x, &Points::y, &Points::z, &Points::range, &Points::incidence,
                            &Points::azimuth_residual, &Points::zenith_residual}) {
    function(from.*column, to.*column);
  }
  for (std::size_t k = 0; k < kCovarianceTerms; ++k) {
    function(from.covariance[k], to.covariance[k]);
    function(from.own_covariance[k], to.own_covariance[k]);
  }
  for (std::size_t k = 0; k < from.loading.size(); ++k) {
    for (std::size_t i = 0; i < 3; ++i) function(from.loading[k][i], to.loading[k][i]);
  }
}

/// Those numbers of rows that are not zero.
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

/// Pointers to the columns of some shots and points.
class Columns {
 public:
  Columns(const CloudHeader& header, const PointedShots& shots, const SensorPoses& poses,
          Points& points, PointArguments& a) {
    for (const auto& column : shots.rotation_angle) angle_.push_back(column.data());
    for (const auto& column : shots.angle_covariance) covariance_.push_back(column.data());
    for (std::size_t i = 0; i < 3; ++i) normal_[i] = shots.surface_normal[i].data();
    if (header.has_rotation_angles) a.rotation_angle = angle_.data();
    a.angle_covariance = covariance_.data();
    a.surface_normal = normal_.data();
    a.azimuth = shots.azimuth.data();
    a.zenith = shots.zenith.data();
    a.azimuth_variance = shots.azimuth_rounding.data();
    a.zenith_variance = shots.zenith_rounding.data();
    a.range = shots.range.data();
    a.rounding_variance = shots.range_rounding.data();
    a.intensity = shots.intensity.data();
    a.beam = shots.beam.data();
    for (std::size_t i = 0; i < 3; ++i) {
      a.velocity[i] = poses.velocity[i].data();
      a.rate[i] = poses.rate[i].data();
    }
    a.point[0] = points.x.data();
    a.point[1] = points.y.data();
    a.point[2] = points.z.data();
    if (header.has_covariance) {
      for (std::size_t i = 0; i < kCovarianceTerms; ++i) {
        a.covariance[i] = points.covariance[i].data();
        if (header.has_own_covariance) a.own_covariance[i] = points.own_covariance[i].data();
      }
    }
    a.corrected_range = points.range.data();
    a.incidence = points.incidence.data();
    if (header.has_rotation_angles) {
      a.azimuth_residual = points.azimuth_residual.data();
      a.zenith_residual = points.zenith_residual.data();
    }
    if (header.factors.empty()) return;
    for (auto& factor : points.loading) {
      for (auto& column : factor) loading_.push_back(column.data());
    }
    a.loading = loading_.data();
  }

 private:
  std::vector<const double*> angle_, covariance_;
  std::array<const double*, 3> normal_{};
  std::vector<double*> loading_;
};

}  // namespace

void PointedShots::resize(int prisms, std::size_t shots) {
  require_between("number of prisms", prisms, 1, kMaxPrisms);
  const auto n = static_cast<std::size_t>(prisms);
  rotation_angle.resize(n);
  angle_covariance.resize(n * (n + 1) / 2);
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
  require_poses(poses, model.moves ? shots.size() : 0);
  require_computed_columns(points, header, shots.size());
  const Faces faces(model);
  const int prisms = model.train.prisms();
  const auto& kernel = RISLEY_KERNEL_COPIES(compute_points).at(set);
  const auto square = [](double x) { return x * x; };
  PointArguments a;
  a.prisms = prisms;
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
  range_emitter.resize(static_cast<std::size_t>(a.emitters), 0.0);
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
  if (model.moves) {
    a.mount_begin = of_mount.begin.data();
    a.mount_row = of_mount.column.data();
    a.mount_weight = of_mount.weight.data();
  }

  const std::size_t whole = shots.size() / kPointPadding * kPointPadding;
  {
    const Columns columns(header, shots, poses, points, a);
    a.shots = whole;
    kernel(a);
  }
  if (whole < shots.size()) {  // the last group, filled up
    const std::size_t rest = shots.size() - whole;
    PointedShots last_shots;
    last_shots.resize(prisms, kPointPadding);
    Points last_points;
    header.resize(last_points, kPointPadding);
    const auto copy = [](const auto& from, std::size_t first, std::size_t count, auto& to,
                         std::size_t at) {
      if (from.empty()) return;
      std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(first), count,
                  to.begin() + static_cast<std::ptrdiff_t>(at));
    };
    for_each_column(shots, last_shots,
                    [&](const auto& from, auto& to) { copy(from, whole, rest, to, 0); });
    SensorPoses last_poses;
    last_poses.resize(kPointPadding);
    for (std::size_t k = 0; k < 3; ++k) {
      copy(poses.velocity[k], whole, rest, last_poses.velocity[k], 0);
      copy(poses.rate[k], whole, rest, last_poses.rate[k], 0);
    }
    const Columns columns(header, last_shots, last_poses, last_points, a);
    a.shots = kPointPadding;
    kernel(a);
    for_each_computed_column(last_points, points,
                             [&](const auto& from, auto& to) { copy(from, 0, rest, to, whole); });
  }
  for (std::size_t k = 0; k < points.rotation_angle.size(); ++k) {
    for (std::size_t i = 0; i < shots.size(); ++i) {
      points.rotation_angle[k][i] = wrap_to_two_pi(shots.rotation_angle[k][i]);  // NaN stays
    }
  }
}

}  // namespace risley::cloud
