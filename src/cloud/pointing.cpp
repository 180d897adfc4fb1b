// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/pointing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/parameter_agreement.hpp"

#include "cloud/pointing_kernel.hpp"

namespace risley::cloud {
namespace {

using Eigen::Index;
constexpr const char* kRangeOffset = "range_offset_m";

/// Lower triangle L with L L^T = C. A quantity that the ones before determine gets a zero column.
Eigen::MatrixXd lower_factor(const Eigen::MatrixXd& c) {
  const Index n = c.rows();
  Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(n, n);
  for (Index j = 0; j < n; ++j) {
    const double pivot = c(j, j) - factor.row(j).head(j).squaredNorm();
    if (!(pivot > 1e-12 * c(j, j))) continue;
    factor(j, j) = std::sqrt(pivot);
    for (Index i = j + 1; i < n; ++i) {
      factor(i, j) = (c(i, j) - factor.row(i).head(j).dot(factor.row(j).head(j))) / factor(j, j);
    }
  }
  return factor;
}

/// Some quantities with a joint covariance.
struct Uncertain {
  std::vector<std::string> names;
  Eigen::MatrixXd covariance;
};

/// Those of a calibration that a point depends on: not its speeds and rotation angles.
Uncertain calibrated(const sensors::Sensor& sensor) {
  Uncertain result;
  std::vector<Index> rows;
  for (std::size_t i = 0; i < sensor.covariance_names.size(); ++i) {
    const std::string& name = sensor.covariance_names[i];
    if (name != kRangeOffset && find_parameter(name, sensor.shape()).kind != ParameterKind::train) {
      continue;
    }
    result.names.push_back(name);
    rows.push_back(static_cast<Index>(i));
  }
  result.covariance = sensor.covariance(rows, rows);
  return result;
}

Uncertain believed(const SensorBelief& belief) {
  Uncertain result;
  for (const auto& free : belief.free) result.names.push_back(free.name);
  result.covariance = belief.covariance;
  return result;
}

/// What a sensor that was not calibrated says of the parameters that a belief has.
Uncertain assumed(const sensors::Sensor& sensor, const SensorBelief& belief) {
  Uncertain result = believed(belief);
  result.covariance.setZero();
  for (std::size_t j = 0; j < belief.free.size(); ++j) {
    const sensors::Knowledge* known = sensor.find_knowledge(belief.free[j].name);
    const auto at = static_cast<Index>(j);
    if (known != nullptr) result.covariance(at, at) = known->sigma * known->sigma;
  }
  return result;
}

/// What a calibration's parameters mean. Those of a sensor that was not calibrated are as good as
/// their sigmas: where the reported directions agree with them these are the better knowledge,
/// otherwise the sensor reports directions that it does not have.
sensors::CalibrationReference meaning_of(const sensors::Sensor& calibration,
                                         const SensorBelief& belief) {
  using sensors::CalibrationReference;
  if (calibration.reference != CalibrationReference::none) return calibration.reference;
  const auto n = static_cast<Index>(belief.free.size());
  if (n == 0) return CalibrationReference::directions;
  Eigen::VectorXd off(n);
  for (Index j = 0; j < n; ++j) {
    const int place = belief.free[static_cast<std::size_t>(j)].places.front();
    off[j] = belief.sensor.train[place] - calibration.train[place];
  }
  const Eigen::MatrixXd covariance = belief.covariance + assumed(calibration, belief).covariance;
  return estimation::disagreement(off, covariance).same_sensor() ? CalibrationReference::directions
                                                                 : CalibrationReference::planes;
}

/// Builds the common factors of a model.
class Factors {
 public:
  Factors(PointingModel& model, const SensorBelief& belief) : model_(model), belief_(belief) {
    for (int place = 0; place < all_places(); ++place) model_.places.push_back(place);
  }

  /// @param moves_beam    errors of the parameters move the beam at given rotation angles
  /// @param moves_angles  they also move the rotation angles that were found
  void add(const Uncertain& uncertain, bool moves_beam, bool moves_angles) {
    const Eigen::MatrixXd factor = lower_factor(uncertain.covariance);
    for (Index j = 0; j < factor.cols(); ++j) {
      CommonFactor common = nothing(uncertain.names[static_cast<std::size_t>(j)]);
      for (Index i = j; i < factor.rows(); ++i) {
        const std::string& name = uncertain.names[static_cast<std::size_t>(i)];
        if (name == kRangeOffset) {
          common.range_offset = factor(i, j);
          continue;
        }
        if (moves_beam) {
          for (const int place : find_parameter(name, model_.train.shape()).places) {
            common.weights[place] += factor(i, j);
          }
        }
        if (moves_angles) move_angles(name, factor(i, j), common);
      }
      keep(std::move(common));
    }
  }

  /// What errors of the believed parameters do to the rotation angles, as one factor per prism.
  void add_angles(const Uncertain& uncertain) {
    const Eigen::MatrixXd factor = lower_factor(belief_.angle_sensitivity * uncertain.covariance *
                                                belief_.angle_sensitivity.transpose());
    for (int j = 0; j < prisms(); ++j) {
      CommonFactor common = nothing(fmt::format("rotation_angle_{}_deg", prism_letter(j)));
      common.weights.segment(all_places(), prisms()) = factor.col(j);
      keep(std::move(common));
    }
  }

  void add_geometry(const sensors::Sensor& sensor) {
    const auto sigma = [&sensor](const std::string& name) {
      const sensors::Knowledge* known = sensor.find_knowledge(name);
      return known == nullptr ? 0.0 : known->sigma;
    };
    if (model_.options.beam_origin) {
      Index row = all_places() + prisms();
      for (const PrismSize& size : model_.sizes) {
        CommonFactor common = nothing(size.name);
        common.weights[row++] = sigma(size.name);
        keep(std::move(common));
      }
    }
    const auto& names = sensor.covariance_names;
    if (std::find(names.begin(), names.end(), kRangeOffset) != names.end()) return;
    CommonFactor common = nothing(kRangeOffset);
    common.range_offset = sigma(kRangeOffset);
    keep(std::move(common));
  }

  /// Leaves only the places that some factor has.
  void finish() {
    std::vector<Index> rows;
    std::vector<int> places;
    for (const int place : model_.places) {
      const bool used = std::any_of(model_.factors.begin(), model_.factors.end(),
                                    [place](const auto& f) { return f.weights[place] != 0; });
      if (!used) continue;
      rows.push_back(place);
      places.push_back(place);
    }
    const Index others = prisms() + static_cast<Index>(model_.sizes.size());
    for (Index i = 0; i < others; ++i) rows.push_back(all_places() + i);
    for (CommonFactor& factor : model_.factors) {
      factor.weights = Eigen::VectorXd(factor.weights(rows));
    }
    model_.places = std::move(places);
  }

 private:
  int prisms() const { return model_.train.prisms(); }
  /// Length of the flat parameter vector.
  int all_places() const { return parameter_count(model_.train.shape()); }

  CommonFactor nothing(std::string name) const {
    return {
        std::move(name),
        Eigen::VectorXd::Zero(all_places() + prisms() + static_cast<Index>(model_.sizes.size())),
        0.0};
  }

  void move_angles(const std::string& name, double value, CommonFactor& common) const {
    for (std::size_t j = 0; j < belief_.free.size(); ++j) {
      if (belief_.free[j].name != name) continue;
      for (int k = 0; k < prisms(); ++k) {
        common.weights[all_places() + k] +=
            belief_.angle_sensitivity(k, static_cast<Index>(j)) * value;
      }
    }
  }

  void keep(CommonFactor common) {
    if (common.range_offset == 0 && common.weights.isZero(0.0)) return;
    model_.factors.push_back(std::move(common));
  }

  PointingModel& model_;
  const SensorBelief& belief_;
};

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
  }
  for (std::size_t k = 0; k < from.loading.size(); ++k) {
    for (std::size_t i = 0; i < 3; ++i) function(from.loading[k][i], to.loading[k][i]);
  }
}

/// Pointers to the columns of some shots and points.
class Columns {
 public:
  Columns(const CloudHeader& header, const PointedShots& shots, Points& points, PointArguments& a) {
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
    a.point[0] = points.x.data();
    a.point[1] = points.y.data();
    a.point[2] = points.z.data();
    if (header.has_covariance) {
      for (std::size_t i = 0; i < kCovarianceTerms; ++i) {
        a.covariance[i] = points.covariance[i].data();
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

PointingModel pointing_model(const sensors::Sensor& calibration, const SensorBelief& belief,
                             const PointingOptions& options) {
  using sensors::CalibrationReference;
  PointingModel model;
  if (calibration.train.face_order() != belief.sensor.train.face_order()) {
    throw InvalidArgument(fmt::format(
        "a calibration of another sensor: its face order is {}, the "
        "recording's {}",
        to_string(calibration.train.face_order()), to_string(belief.sensor.train.face_order())));
  }
  model.reference = meaning_of(calibration, belief);
  const bool type = calibration.reference == CalibrationReference::none;
  const bool planes = model.reference == CalibrationReference::planes;
  model.sensor = calibration;
  model.options = options;
  model.believed = belief.sensor.train;
  model.train = planes ? calibration.train : belief.sensor.train;
  if (options.beam_origin) model.geometry = calibration.geometry;
  model.range_offset = calibration.range_offset;
  model.angle_noise = belief.angle_noise;
  for (const PrismSize& size : own_prism_sizes(calibration.prisms())) {
    if (calibration.find_knowledge(size.name) != nullptr) model.sizes.push_back(size);
  }
  Factors factors(model, belief);
  if (planes) {
    factors.add(type ? assumed(calibration, belief) : calibrated(calibration), true, false);
    factors.add_angles(believed(belief));
  } else {
    const bool smoothed = !options.reported_directions;
    factors.add(type ? believed(belief) : calibrated(calibration), smoothed, smoothed);
  }
  factors.add_geometry(calibration);
  factors.finish();
  if (model.factors.size() > static_cast<std::size_t>(kMostFactors)) {
    throw InvalidArgument(fmt::format("the calibration's covariance has {} quantities, allowed {}",
                                      model.factors.size(), kMostFactors));
  }
  return model;
}

bool needs_rotation_angles(const sensors::Sensor& calibration, const PointingOptions& options) {
  return !options.reported_directions || options.beam_origin ||
         calibration.reference == sensors::CalibrationReference::planes;
}

PointingModel reported_pointing_model(const sensors::Sensor& calibration,
                                      const PointingOptions& options,
                                      std::optional<double> angle_noise) {
  if (needs_rotation_angles(calibration, options)) {
    throw InvalidArgument(
        "points of reported directions need rotation angles for the beam's origin "
        "and for a calibration against planes");
  }
  SensorBelief belief;
  belief.sensor = calibration;
  belief.covariance.resize(0, 0);
  belief.angle_noise = angle_noise.value_or(calibration.angle_noise);
  return pointing_model(calibration, belief, options);
}

void PointedShots::resize(int prisms, std::size_t shots) {
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
                    const PointedShots& shots, Points& points, InstructionSet set) {
  const Faces faces(model);
  const int prisms = model.train.prisms();
  if (model.sizes.size() > static_cast<std::size_t>(kMostSizes)) {
    throw InvalidArgument(
        fmt::format("{} sizes of prisms, allowed {}", model.sizes.size(), kMostSizes));
  }
  if (model.believed.shape() != model.train.shape()) {
    throw InvalidArgument(fmt::format(
        "believed train: {} prisms and {} emitters, expected {} and {} as the true one",
        model.believed.prisms(), model.believed.emitters(), prisms, model.train.emitters()));
  }
  check_beams(model.train, shots.beam, shots.size());
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
  const std::size_t factors = model.factors.size();
  const std::size_t rows =
      model.places.size() + static_cast<std::size_t>(prisms) + model.sizes.size();
  std::vector<int> factor_begin{0}, factor_row;
  std::vector<double> factor_weight, range_factor(factors);
  for (std::size_t j = 0; j < factors; ++j) {
    range_factor[j] = model.factors[j].range_offset;
    for (std::size_t i = 0; i < rows; ++i) {
      const double weight = model.factors[j].weights[static_cast<Index>(i)];
      if (weight == 0) continue;
      factor_row.push_back(static_cast<int>(i));
      factor_weight.push_back(weight);
    }
    factor_begin.push_back(static_cast<int>(factor_row.size()));
  }
  a.places = model.places.data();
  a.place_count = static_cast<int>(model.places.size());
  a.factors = static_cast<int>(factors);
  a.factor_begin = factor_begin.data();
  a.factor_row = factor_row.data();
  a.factor_weight = factor_weight.data();
  a.range_factor = range_factor.data();

  const std::size_t whole = shots.size() / kPointPadding * kPointPadding;
  {
    const Columns columns(header, shots, points, a);
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
    const Columns columns(header, last_shots, last_points, a);
    a.shots = kPointPadding;
    kernel(a);
    for_each_computed_column(last_points, points,
                             [&](const auto& from, auto& to) { copy(from, 0, rest, to, whole); });
  }
  for (std::size_t k = 0; k < points.rotation_angle.size(); ++k) {
    for (std::size_t i = 0; i < shots.size(); ++i) {
      const double angle = shots.rotation_angle[k][i];
      const double wrapped = angle - kTwoPi * std::floor(angle / kTwoPi);
      points.rotation_angle[k][i] = wrapped >= kTwoPi ? 0.0 : wrapped;  // NaN stays
    }
  }
}

}  // namespace risley::cloud
