// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// One constant that is estimated.
struct FreeParameter {
  std::string name;         ///< as in parameter_list()
  std::vector<int> places;  ///< of the flat parameter vector with its value
  double prior_sigma = 0;   ///< SI units
  bool of_frame = false;    ///< a turn of the recording's frame, in a place of the last bearing

  friend bool operator==(const FreeParameter&, const FreeParameter&) = default;
};

/// Whether all prisms of a train are of one glass.
bool one_glass(const PrismTrain& train);

/// The paper's choice for any number of prisms: the refractive index, all incident beams, every
/// bearing tilt, the vertical tilt of every prism and the horizontal tilt of the last. Air, wedge
/// angles and the other horizontal tilts cannot be separated from the rest and stay fixed.
/// [B21 section 2.3] Several emitters do determine the other horizontal tilts: they are free then.
/// @param one_glass  one index for all prisms; otherwise each has its own
std::vector<std::string> default_free_names(TrainShape shape, bool one_glass = true);

/// Free parameters by name. The priors are wide on purpose (1 degree, 0.01 in the index): they keep
/// the first updates inside the range of the linearisation and weigh nothing against a recording.
/// @throws InvalidArgument for a name that is unknown, not a train parameter, or given twice (also
///         as shared and own, such as refractive_index with refractive_index_a)
std::vector<FreeParameter> free_parameters(const std::vector<std::string>& names, TrainShape shape);

/// Whether one of the parameters sets a place of the flat vector.
bool takes_place(const std::vector<FreeParameter>& parameters, int place);

/// Parameters of the train with a stated sigma that share no place with the free ones: held ones
/// that may be off. Their prior sigma is the stated one.
std::vector<FreeParameter> uncertain_held(const sensors::Sensor& sensor,
                                          const std::vector<FreeParameter>& free);

/// Values of free parameters in a train [free], SI units.
Eigen::VectorXd free_values(const PrismTrain& train, const std::vector<FreeParameter>& free);
/// A train with the free parameters replaced. @param values  [free], SI units
PrismTrain with_free_values(PrismTrain train, const std::vector<FreeParameter>& free,
                            const Eigen::VectorXd& values);

/// Sum of the squared distances of values from their prior means, in prior sigmas.
/// @param offset  [free], SI units
double prior_chi2(const std::vector<FreeParameter>& free, const Eigen::VectorXd& offset);

}  // namespace risley::estimation
