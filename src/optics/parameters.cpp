// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/parameters.hpp"

#include <array>
#include <cmath>
#include <mutex>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/optics/prism.hpp"

namespace risley {
namespace {

// Bounds are those of physics and of a Risley sensor in one piece, not of a preset: air to water
// around the prisms, any optical glass, and errors that still let the beam through.
constexpr double kLargestError = radians_from_degrees(10.0);
constexpr double kLargestWedge = radians_from_degrees(60.0);
constexpr double kLargestFace = radians_from_degrees(80.0);
constexpr double kFastest = radians_from_degrees(1e6);

/// The letter in symbols of an angle between two faces or of a face from the axis.
struct ShapeAngle {
  const char* name;   ///< before the element's letter
  const char* words;  ///< before "of prism A"
  const char* symbol;
};

/// Meaning of place::wedge_angle() for an element.
ShapeAngle shape_angle(ElementKind kind) {
  switch (kind) {
    case ElementKind::wedge:
      return {"exit_face", "angle from the axis of the second face", "β"};
    case ElementKind::reflector:
      return {"mirror_face", "angle from the axis of the mirror", "μ"};
    case ElementKind::prism:
      break;
  }
  return {"wedge_angle", "wedge angle", "α"};
}

std::vector<ParameterInfo> build_list(TrainShape shape) {
  const int prisms = shape.prisms;
  std::vector<ParameterInfo> list;
  const auto add = [&](std::string name, std::string words, std::string symbol, const char* unit,
                       double si, double lower, double upper, std::vector<int> places) {
    list.push_back({std::move(name), std::move(words), std::move(symbol), unit,
                    ParameterKind::train, si, lower, upper, std::move(places)});
  };
  const auto add_error = [&](const std::string& name, const std::string& words,
                             const std::string& symbol, int at) {
    add(name + "_deg", words, symbol, "deg", kRadiansPerDegree, -kLargestError, kLargestError,
        {at});
  };
  std::vector<int> every_index, every_wedge;
  for (int i = 0; i < prisms; ++i) {
    every_index.push_back(place::refractive_index(i));
    every_wedge.push_back(place::wedge_angle(i));
  }
  add("refractive_index_air", "refractive index around the prisms", "n_air", "1", 1.0, 0.9, 1.5,
      {place::refractive_index_air()});
  add("refractive_index", "refractive index of all prisms", "n_prism", "1", 1.0, 1.0, 4.0,
      every_index);
  if (same_layout(shape.prisms, TrainLayout(prisms))) {
    add("wedge_angle_deg", "wedge angle of all prisms", "α", "deg", kRadiansPerDegree, 0.0,
        kLargestWedge, every_wedge);
  }
  if (shape.emitters == 1) {
    add_error("incident_beam_horizontal", "horizontal incident beam direction error", "Δφ_L0",
              place::incident_beam_horizontal());
    add_error("incident_beam_vertical", "vertical incident beam direction error", "Δθ_L0",
              place::incident_beam_vertical());
  } else {
    for (int i = 0; i < shape.emitters; ++i) {
      add_error(fmt::format("incident_beam_{}_horizontal", i + 1),
                fmt::format("horizontal beam direction of emitter {}", i + 1),
                fmt::format("φ_L{}", i + 1), place::incident_beam_horizontal(i, prisms));
      add_error(fmt::format("incident_beam_{}_vertical", i + 1),
                fmt::format("vertical beam direction of emitter {}", i + 1),
                fmt::format("θ_L{}", i + 1), place::incident_beam_vertical(i, prisms));
    }
  }
  for (int i = 0; i < prisms; ++i) {
    const char letter = prism_letter(i);
    const char capital = static_cast<char>(letter - 'a' + 'A');
    if (shape.prisms.has_bearing(static_cast<std::size_t>(i))) {
      add_error(fmt::format("bearing_tilt_{}_horizontal", letter),
                fmt::format("horizontal bearing tilt of prism {}", capital),
                fmt::format("Δφ_R{}", capital), place::bearing_tilt_horizontal(i));
      add_error(fmt::format("bearing_tilt_{}_vertical", letter),
                fmt::format("vertical bearing tilt of prism {}", capital),
                fmt::format("Δθ_R{}", capital), place::bearing_tilt_vertical(i));
    }
    add_error(fmt::format("prism_tilt_{}_horizontal", letter),
              fmt::format("horizontal tilt of prism {}", capital), fmt::format("Δφ_{}", capital),
              place::prism_tilt_horizontal(i));
    const ElementKind kind = shape.prisms.kind[i];
    if (kind == ElementKind::wedge) {
      add(fmt::format("entrance_face_{}_deg", letter),
          fmt::format("angle from the axis of the first face of prism {}", capital),
          fmt::format("ε_{}", capital), "deg", kRadiansPerDegree, -kLargestFace, kLargestFace,
          {place::prism_tilt_vertical(i)});
    } else {
      add_error(fmt::format("prism_tilt_{}_vertical", letter),
                fmt::format("vertical tilt of prism {}", capital), fmt::format("Δθ_{}", capital),
                place::prism_tilt_vertical(i));
    }
    add(fmt::format("refractive_index_{}", letter),
        fmt::format("refractive index of prism {}", capital), fmt::format("n_{}", capital), "1",
        1.0, 1.0, 4.0, {place::refractive_index(i)});
    const ShapeAngle angle = shape_angle(kind);
    add(fmt::format("{}_{}_deg", angle.name, letter),
        fmt::format("{} of prism {}", angle.words, capital),
        fmt::format("{}_{}", angle.symbol, capital), "deg", kRadiansPerDegree,
        kind == ElementKind::wedge ? -kLargestFace : 0.0,
        kind == ElementKind::prism ? kLargestWedge : kLargestFace, {place::wedge_angle(i)});
  }
  for (int i = 0; i < prisms; ++i) {
    const char letter = prism_letter(i);
    const char capital = static_cast<char>(letter - 'a' + 'A');
    list.push_back({fmt::format("angular_velocity_{}_deg_per_s", letter),
                    fmt::format("angular velocity of prism {}", capital),
                    fmt::format("ω_{}", capital),
                    "deg/s",
                    ParameterKind::angular_velocity,
                    kRadiansPerDegree,
                    -kFastest,
                    kFastest,
                    {i}});
  }
  for (int i = 0; i < prisms; ++i) {
    const char letter = prism_letter(i);
    const char capital = static_cast<char>(letter - 'a' + 'A');
    list.push_back(
        {fmt::format("rotation_angle_{}_deg", letter),
         fmt::format("rotation angle of prism {} at the first used observation", capital),
         fmt::format("Ω_{}", capital),
         "deg",
         ParameterKind::rotation_angle,
         kRadiansPerDegree,
         -1e9,
         1e9,
         {i}});
  }
  return list;
}

}  // namespace

void check_shape(TrainShape shape) {
  if (shape.prisms < 1 || shape.prisms > kMaxPrisms) refuse_layout(shape.prisms);
  if (shape.emitters < 1 || shape.emitters > kMaxEmitters) {
    throw InvalidArgument(
        fmt::format("number of emitters = {}, allowed 1 to {}", shape.emitters, kMaxEmitters));
  }
}

const std::vector<ParameterInfo>& parameter_list(TrainShape shape) {
  struct Entry {
    std::once_flag built;
    std::vector<ParameterInfo> list;
  };
  // One row for each layout, that of an upright axis before the others.
  static std::array<std::array<Entry, kMaxEmitters>, kMaxPrisms + 1> entries;
  check_shape(shape);
  Entry& entry = entries[static_cast<std::size_t>(shape.prisms.axis_up ? 0 : int{shape.prisms})]
                        [static_cast<std::size_t>(shape.emitters - 1)];
  std::call_once(entry.built, [&] { entry.list = build_list(shape); });
  return entry.list;
}

const ParameterInfo& find_parameter(std::string_view name, TrainShape shape) {
  const auto& list = parameter_list(shape);
  for (const auto& parameter : list) {
    if (parameter.name == name) return parameter;
  }
  std::vector<std::string> names;
  names.reserve(list.size());
  for (const auto& parameter : list) names.push_back(parameter.name);
  throw InvalidArgument(fmt::format("unknown parameter \"{}\"{}, known: {}", name,
                                    did_you_mean(name, names), fmt::join(names, ", ")));
}

double in_file_unit(std::string_view name, double value, TrainShape shape) {
  return value / find_parameter(name, shape).si_per_unit;
}

const ParameterInfo* find_parameter_of_any_train(std::string_view name) {
  // A single emitter has no number, and faces have their own names.
  for (const TrainShape shape :
       {TrainShape{kMaxPrisms, 1}, {kMaxPrisms, kMaxEmitters}, {kWedgeAndReflector, 1}}) {
    for (const ParameterInfo& parameter : parameter_list(shape)) {
      if (parameter.name == name) return &parameter;
    }
  }
  return nullptr;
}

void check_bounds(const ParameterInfo& parameter, double value) {
  if (std::isfinite(value) && value >= parameter.lower && value <= parameter.upper) return;
  throw InvalidArgument(fmt::format("{} = {:.10g} {}, allowed {:.10g} to {:.10g}", parameter.name,
                                    value / parameter.si_per_unit, parameter.unit,
                                    parameter.lower / parameter.si_per_unit,
                                    parameter.upper / parameter.si_per_unit));
}

}  // namespace risley
