// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/sensors/sensor.hpp"

#include "python/arrays.hpp"
#include "python/bind.hpp"
#include "python/call.hpp"
#include "python/names.hpp"

namespace risley::python {
namespace {

using sensors::Knowledge;
using sensors::Sensor;

/// Rejects parameters that change from shot to shot. @return the name in files
NamedParameter constant_parameter(const std::string& name, const Sensor& sensor) {
  const NamedParameter parameter = named_parameter(name, sensor.shape());
  if (parameter.info->kind == ParameterKind::rotation_angle) {
    throw InvalidArgument(fmt::format("{} is not a constant of a sensor", name));
  }
  return parameter;
}

py::dict values_of(const Sensor& sensor) {
  py::dict values;
  for (const ParameterInfo& info : parameter_list(sensor.shape())) {
    if (info.kind == ParameterKind::rotation_angle) continue;
    values[py::str(si_name(info.name))] = sensor.get(info.name);
  }
  return values;
}

std::vector<std::string> covariance_names(const Sensor& sensor) {
  std::vector<std::string> names;
  for (const std::string& name : sensor.covariance_names) names.push_back(si_name(name));
  return names;
}

std::optional<double> sigma_of(const Sensor& sensor, const std::string& name) {
  const NamedParameter parameter = constant_parameter(name, sensor);
  const Knowledge* known = sensor.find_knowledge(parameter.info->name);
  if (known == nullptr) return std::nullopt;
  return std::max(known->sigma, known->total_sigma) / parameter.si_per_unit;
}

std::string source_of(const Sensor& sensor, const std::string& name) {
  const Knowledge* known = sensor.find_knowledge(constant_parameter(name, sensor).info->name);
  return known == nullptr ? std::string() : known->source;
}

void write_sensor(const Sensor& sensor, const std::filesystem::path& path) {
  io::write_text_file(path.string(), sensors::preset_text(sensor));
}

}  // namespace

void bind_sensors(py::module_& module) {
  py::class_<Sensor> type(
      module, "Sensor",
      "A sensor: its optics, rotors, noise and limits, and how well each is known.\n\n"
      "`load_sensor` gives the built-in ones and those of files; a calibration is a sensor with a\n"
      "covariance. Parameters and speeds are read and set by name, ``sensor['wedge_angle_a']`` in\n"
      "SI units and ``sensor['wedge_angle_a_deg']`` in degrees.");
  type.def_static(
          "from_text",
          [](const std::string& text) { return sensors::parse_preset(text, "the text"); },
          py::arg("text"),
          "from_text(text)\n--\n\nA sensor from the text of a preset (YAML).\n\n"
          "Raises\n------\nFileError\n    With the line, where the text breaks the schema.")
      .def("to_text", &sensors::preset_text,
           "to_text(self)\n--\n\nThe text of its preset (YAML), which `from_text` reads with every "
           "digit.")
      .def("write", &write_sensor, py::arg("path"),
           "write(self, path)\n--\n\nWrites its preset, which every command and `load_sensor` "
           "accept.\n\n"
           "Raises\n------\nFileError\n    When the file cannot be written.")
      .def_readwrite("name", &Sensor::name, "Name of the preset.")
      .def_readonly("manufacturer", &Sensor::manufacturer, "Its maker.")
      .def_readonly("model", &Sensor::model, "Commercial name.")
      .def_readonly("device_type", &Sensor::device_type, "Livox number of its type.")
      .def_readwrite("serial", &Sensor::serial, "Serial number; empty for a type.")
      .def_property_readonly(
          "train", [](const Sensor& sensor) { return sensor.train; }, "A copy of its optics.")
      .def_property_readonly(
          "angular_velocity",
          [](const Sensor& sensor) { return array_of(sensor.angular_velocity); },
          "Speeds of the rotors, rad/s; shape (prisms,).")
      .def_readonly("combination", &Sensor::combination,
                    "Number of its speed combination, from 1; None if it has only one.")
      .def("with_combination", &sensors::with_combination, py::arg("combination"),
           "with_combination(self, combination)\n--\n\nThe same sensor in another speed "
           "combination.\n\n"
           "Raises\n------\nValueError\n    If there is no combination with that number.")
      .def_property_readonly("parameters", &values_of,
                             "All parameters and speeds by name, SI units.")
      .def("sigma", &sigma_of, py::arg("name"),
           "sigma(self, name)\n--\n\nOne standard deviation of a parameter, in the unit of the "
           "name; None if it is "
           "not known.")
      .def("source", &source_of, py::arg("name"),
           "source(self, name)\n--\n\nThe source of a parameter's value.")
      .def_property_readonly(
          "reference", [](const Sensor& sensor) { return sensors::to_string(sensor.reference); },
          "Reference of its calibration: none, directions or planes.")
      .def_property_readonly(
          "covariance_names", &covariance_names,
          "Names of the values that the covariance belongs to; empty for a sensor type.")
      .def_property_readonly(
          "covariance", [](const Sensor& sensor) { return array_of(sensor.covariance); },
          "Covariance of the values in ``covariance_names``, SI units; shape (n, n).")
      .def_readonly("angle_noise", &Sensor::angle_noise,
                    "1 sigma of azimuth and zenith before rounding, rad.")
      .def_readonly("range_noise", &Sensor::range_noise, "1 sigma of a range, m.")
      .def_readonly("range_offset", &Sensor::range_offset,
                    "Offset that the sensor adds to the true range, m.")
      .def_readonly("angle_resolution", &Sensor::angle_resolution, "Rounding step of angles, rad.")
      .def_readonly("range_resolution", &Sensor::range_resolution, "Rounding step of ranges, m.")
      .def_readonly("range_minimum", &Sensor::range_minimum, "No return below, m.")
      .def_readonly("range_maximum", &Sensor::range_maximum, "No return beyond, m.")
      .def_readonly("field_of_view", &Sensor::field_of_view, "Full cone, rad.")
      .def_readonly("pointing_tolerance", &Sensor::pointing_tolerance,
                    "Root mean square error of directions that the manufacturer allows, rad; 0: "
                    "not stated.")
      .def_readonly("shot_rate", &Sensor::shot_rate, "Shots per second.")
      .def_property_readonly(
          "prism_thickness", [](const Sensor& sensor) { return sensor.geometry.thickness; },
          "Thickness of the prisms on the axis, m.")
      .def_property_readonly(
          "prism_spacing", [](const Sensor& sensor) { return sensor.geometry.spacing; },
          "Spacing of the prisms, m.")
      .def_readonly("provenance", &Sensor::provenance,
                    "Name and value pairs that record how it was computed.")
      .def("__getitem__",
           [](const Sensor& sensor, const std::string& name) {
             const NamedParameter parameter = constant_parameter(name, sensor);
             return sensor.get(parameter.info->name) / parameter.si_per_unit;
           })
      .def("__setitem__",
           [](Sensor& sensor, const std::string& name, double value) {
             const NamedParameter parameter = constant_parameter(name, sensor);
             sensor.set(parameter.info->name, value * parameter.si_per_unit);
           })
      .def("__copy__", [](const Sensor& sensor) { return sensor; })
      .def("__deepcopy__", [](const Sensor& sensor, const py::dict&) { return sensor; })
      .def("__eq__",
           [](const Sensor& a, const py::object& other) {
             return py::isinstance<Sensor>(other) &&
                    sensors::preset_text(a) == sensors::preset_text(other.cast<const Sensor&>());
           })
      .def("__repr__",
           [](const Sensor& sensor) {
             return fmt::format("<risley.Sensor {}{}{}>", sensor.name,
                                sensor.serial.empty() ? "" : " ", sensor.serial);
           })
      .def(py::pickle([](const Sensor& sensor) { return sensors::preset_text(sensor); },
                      [](const std::string& text) {
                        return sensors::parse_preset(text, "the pickle of a sensor");
                      }));
  type.attr("__hash__") = py::none();
  module.def("preset_names", &sensors::builtin_preset_names);
  module.def(
      "load_sensor",
      [](const std::string& name_or_path) {
        return unlocked([&] { return jobs::load_result(name_or_path); });
      },
      py::arg("name_or_path"));
}

}  // namespace risley::python
