// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "risley/algebra/named_covariance.hpp"
#include "risley/cloud/pointing_model.hpp"
#include "risley/sensors/range_values.hpp"

namespace risley::cloud {

/// Lower triangle L with L L^T = C. A quantity determined by the previous ones gets a zero column.
Eigen::MatrixXd lower_factor(const Eigen::MatrixXd& c);

/// Builds the common factors of a model.
class Factors {
 public:
  Factors(PointingModel& model, const SensorBelief& belief);

  /// The quantities may be parameters, sizes of prisms, range errors and those of a mount.
  /// @throws InvalidArgument for another name
  /// @param moves_beam    errors of the parameters move the beam at given rotation angles
  /// @param moves_angles  they also move the estimated rotation angles
  /// @param of_recording  as CommonFactor
  void add(const algebra::NamedCovariance& uncertain, bool moves_beam, bool moves_angles,
           bool of_recording);

  /// Effect of errors of the believed parameters on the rotation angles, as one factor per prism.
  void add_angles(const algebra::NamedCovariance& uncertain);

  /// Those of the prisms' sizes and of the range errors not in the calibration's covariance.
  void add_geometry(const sensors::Sensor& sensor);

  /// Keeps only the places used by some factor.
  void finish();

 private:
  int prisms() const { return model_.train.prisms(); }
  /// Length of the flat parameter vector.
  int all_places() const { return parameter_count(model_.train.shape()); }

  /// Row of a factor's weights. @param size  row of PointingModel::sizes
  Eigen::Index size_row(Eigen::Index size) const { return all_places() + prisms() + size; }

  CommonFactor nothing(std::string name) const;
  /// The number of a factor that belongs to a range error, or nullptr for other names.
  double* range_number(std::string_view name, CommonFactor& common) const;
  void move_angles(const std::string& name, double value, CommonFactor& common) const;
  void keep(CommonFactor common);

  PointingModel& model_;
  const SensorBelief& belief_;
  std::vector<sensors::RangeValue> range_values_;
};

}  // namespace risley::cloud
