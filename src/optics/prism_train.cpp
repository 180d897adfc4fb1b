// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/prism_train.hpp"

#include <fmt/format.h>

#include "risley/core/angle.hpp"

namespace risley {
namespace {

const ParameterInfo& find_train_parameter(std::string_view name, int prisms) {
  const ParameterInfo& parameter = find_parameter(name, prisms);
  if (parameter.kind != ParameterKind::train) {
    throw InvalidArgument(fmt::format("{} is not a parameter of the prisms", name));
  }
  return parameter;
}

}  // namespace

PrismTrain::PrismTrain(std::vector<FaceOrder> face_order) : face_order_(std::move(face_order)) {
  parameter_list(prisms());  // checks the number of prisms
  parameters_.assign(static_cast<std::size_t>(parameter_count(prisms())), 0.0);
  set("refractive_index_air", 1.0);
  set("refractive_index", 1.51);
  set("wedge_angle_deg", radians_from_degrees(18.0));
}

double PrismTrain::get(std::string_view name) const {
  return (*this)[find_train_parameter(name, prisms()).places.front()];
}

void PrismTrain::set(std::string_view name, double value) {
  const ParameterInfo& parameter = find_train_parameter(name, prisms());
  check_bounds(parameter, value);
  for (const int at : parameter.places) set_place(at, value);
}

PrismTrain PrismTrain::without_errors() const {
  PrismTrain ideal(face_order_);
  ideal.set_place(place::refractive_index_air(), (*this)[place::refractive_index_air()]);
  for (int i = 0; i < prisms(); ++i) {
    ideal.set_place(place::refractive_index(i), (*this)[place::refractive_index(i)]);
    ideal.set_place(place::wedge_angle(i), (*this)[place::wedge_angle(i)]);
  }
  return ideal;
}

}  // namespace risley
