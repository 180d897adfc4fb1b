// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/prism_train.hpp"

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

namespace risley {
namespace {

const ParameterInfo& find_train_parameter(std::string_view name, TrainShape shape) {
  const ParameterInfo& parameter = find_parameter(name, shape);
  if (parameter.kind != ParameterKind::train) {
    throw InvalidArgument(fmt::format("{} is not a parameter of the prisms", name));
  }
  return parameter;
}

}  // namespace

PrismTrain::PrismTrain(std::vector<FaceOrder> face_order, int emitters)
    : face_order_(std::move(face_order)), layout_(layout_of(face_order_)), emitters_(emitters) {
  check_shape(shape());
  parameters_.assign(static_cast<std::size_t>(parameter_count(shape())), 0.0);
  set("refractive_index_air", 1.0);
  if (layout_.reflects()) {
    set("refractive_index", 1.9682);
    set("entrance_face_a_deg", radians_from_degrees(10.0));
    set("exit_face_a_deg", radians_from_degrees(29.0));
    set("mirror_face_b_deg", radians_from_degrees(50.0));
  } else {
    set("refractive_index", 1.51);
    set("wedge_angle_deg", radians_from_degrees(18.0));
  }
}

double PrismTrain::get(std::string_view name) const {
  return (*this)[find_train_parameter(name, shape()).places.front()];
}

void PrismTrain::set(std::string_view name, double value) {
  const ParameterInfo& parameter = find_train_parameter(name, shape());
  check_bounds(parameter, value);
  for (const int at : parameter.places) set_place(at, value);
}

PrismTrain PrismTrain::without_errors() const {
  PrismTrain ideal(face_order_, emitters_);
  ideal.set_place(place::refractive_index_air(), (*this)[place::refractive_index_air()]);
  for (int i = 0; i < prisms(); ++i) {
    ideal.set_place(place::refractive_index(i), (*this)[place::refractive_index(i)]);
    ideal.set_place(place::wedge_angle(i), (*this)[place::wedge_angle(i)]);
    if (layout_.kind[i] == ElementKind::wedge) {
      ideal.set_place(place::prism_tilt_vertical(i), (*this)[place::prism_tilt_vertical(i)]);
    }
  }
  if (emitters_ > 1) {
    for (int i = 0; i < emitters_; ++i) {
      for (const int at : {place::incident_beam_horizontal(i, prisms()),
                           place::incident_beam_vertical(i, prisms())}) {
        ideal.set_place(at, (*this)[at]);
      }
    }
  }
  return ideal;
}

void PrismTrain::refuse_place(int place) const {
  check_shape(shape());
  throw InvalidArgument(fmt::format("place = {}, allowed 0 to {}", place, parameters_.size() - 1));
}

void check_beam(const PrismTrain& train, int beam) {
  if (beam >= 0 && beam < train.emitters()) return;
  throw InvalidArgument(fmt::format("beam = {}, allowed 0 to {}", beam, train.emitters() - 1));
}

}  // namespace risley
