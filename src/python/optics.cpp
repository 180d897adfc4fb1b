// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <array>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/batch.hpp"
#include "risley/optics/inverse.hpp"
#include "risley/optics/prism_train.hpp"

#include "python/arrays.hpp"
#include "python/bind.hpp"
#include "python/call.hpp"
#include "python/names.hpp"

namespace risley::python {
namespace {

/// Rotation angles of all prisms and the emitter of every shot, of one shape.
class Shots {
 public:
  Shots(const PrismTrain& train, const py::object& angles, const py::object& beam) {
    std::vector<std::pair<std::string, py::array>> arrays;
    std::size_t prism = 0;
    for (const py::handle one : py::iter(angles)) {
      const std::string name = fmt::format("angles[{}]", prism++);
      arrays.emplace_back(name, numbers_from(one, name));
    }
    require_length("angles", arrays.size(), static_cast<std::size_t>(train.prisms()));
    if (!beam.is_none()) arrays.emplace_back("beam", bytes_from(beam, "beam"));
    shape_ = broadcast_shape(arrays);
    for (prism = 0; prism < static_cast<std::size_t>(train.prisms()); ++prism) {
      angles_.emplace_back(broadcast_to(arrays[prism].second, shape_));
      columns_.push_back(span_of(angles_.back()));
    }
    if (!beam.is_none()) beam_ = Bytes(broadcast_to(arrays.back().second, shape_));
  }

  const Shape& shape() const { return shape_; }
  std::size_t count() const { return columns_.front().size(); }
  std::span<const std::span<const double>> columns() const { return columns_; }
  std::span<const std::uint8_t> beam() const {
    return {beam_.data(), static_cast<std::size_t>(beam_.size())};
  }

 private:
  Shape shape_;
  std::vector<Numbers> angles_;
  Bytes beam_;
  std::vector<std::span<const double>> columns_;
};

std::span<double> span_of(Numbers& array) {
  return {array.mutable_data(), static_cast<std::size_t>(array.size())};
}

/// An array for results: a given one, or a new one.
Numbers result_array(const py::object& given, std::string_view name, const Shape& shape) {
  if (given.is_none()) return Numbers(shape);
  if (!py::isinstance<Numbers>(given)) {
    throw py::type_error(fmt::format("{} is not a float64 array in C order", name));
  }
  Numbers array(given);
  if (shape_of(array) != shape) {
    throw InvalidArgument(fmt::format("{} has the shape {}, expected {}", name, shape_text(array),
                                      shape_text(shape)));
  }
  if (!array.writeable()) throw InvalidArgument(fmt::format("{} cannot be written to", name));
  return array;
}

/// Results of shape () as numbers, as numpy's own functions return them.
py::object result_of(const py::array& array) {
  return array.ndim() == 0 ? array[py::tuple()] : py::object(array);
}

py::tuple observe_shots(const PrismTrain& train, const py::object& angles, const py::object& beam,
                        const py::object& azimuth_out, const py::object& zenith_out) {
  const RunningCall call;
  const Shots shots(train, angles, beam);
  Numbers azimuth = result_array(azimuth_out, "out[0]", shots.shape());
  Numbers zenith = result_array(zenith_out, "out[1]", shots.shape());
  DirectionColumns out;
  out.azimuth = span_of(azimuth);
  out.zenith = span_of(zenith);
  if (shots.count() > 0) {
    unlocked([&] { return observe_batch(train, shots.columns(), out, shots.beam()); });
  }
  return py::make_tuple(result_of(azimuth), result_of(zenith));
}

py::tuple rays_of_shots(const PrismTrain& train, const py::object& angles, const py::object& beam,
                        const std::vector<double>& thickness, const std::vector<double>& spacing) {
  const RunningCall call;
  const Shots shots(train, angles, beam);
  std::array<Numbers, 6> columns;
  for (Numbers& column : columns) column = Numbers(shots.shape());
  auto& [x, y, z, origin_x, origin_y, origin_z] = columns;
  DirectionColumns out{
      span_of(x),        span_of(y),        span_of(z),          {}, {}, span_of(origin_x),
      span_of(origin_y), span_of(origin_z), {thickness, spacing}};
  if (shots.count() > 0) {
    unlocked([&] { return observe_batch(train, shots.columns(), out, shots.beam()); });
  }
  const auto three = [](const py::array& a, const py::array& b, const py::array& c) {
    return py::make_tuple(result_of(a), result_of(b), result_of(c));
  };
  return py::make_tuple(three(origin_x, origin_y, origin_z), three(x, y, z));
}

py::tuple linearise_shots(const PrismTrain& train, const py::object& angles,
                          const py::object& beam) {
  const RunningCall call;
  const Shots shots(train, angles, beam);
  Numbers azimuth(shots.shape()), zenith(shots.shape());
  Shape shape = shots.shape();
  const py::ssize_t columns = parameter_count(train.shape()) + train.prisms();
  shape.insert(shape.begin(), columns);
  Numbers d_azimuth(shape), d_zenith(shape);
  LinearisationColumns out{span_of(azimuth), span_of(zenith), {}, {}};
  const std::size_t count = shots.count();
  for (std::size_t i = 0; i < static_cast<std::size_t>(columns); ++i) {
    out.d_azimuth.push_back(span_of(d_azimuth).subspan(i * count, count));
    out.d_zenith.push_back(span_of(d_zenith).subspan(i * count, count));
  }
  if (count > 0) {
    unlocked([&] { return linearise_batch(train, shots.columns(), out, shots.beam()); });
  }
  return py::make_tuple(result_of(azimuth), result_of(zenith), d_azimuth, d_zenith);
}

py::tuple invert(const PrismTrain& train, const py::object& azimuth, const py::object& zenith,
                 const std::vector<double>& fixed_angles, const py::object& beam) {
  const RunningCall call;
  std::vector<std::pair<std::string, py::array>> arrays;
  arrays.emplace_back("azimuth", numbers_from(azimuth, "azimuth"));
  arrays.emplace_back("zenith", numbers_from(zenith, "zenith"));
  arrays.emplace_back("beam", bytes_from(beam, "beam"));
  Shape shape = broadcast_shape(arrays);
  const Numbers azimuths(broadcast_to(arrays[0].second, shape));
  const Numbers zeniths(broadcast_to(arrays[1].second, shape));
  const Bytes beams(broadcast_to(arrays[2].second, shape));
  py::array_t<std::int64_t, py::array::c_style> count(shape);
  py::array_t<bool, py::array::c_style> continuum(shape);
  shape.push_back(kMostRotationPairs);
  Numbers first(shape), second(shape);
  const auto solve = [&, count = count.mutable_data(), continuum = continuum.mutable_data(),
                      first = first.mutable_data(), second = second.mutable_data(),
                      azimuths = azimuths.data(), zeniths = zeniths.data(), beams = beams.data(),
                      shots = azimuths.size()](const Progress& progress) {
    constexpr py::ssize_t kLook = 4096;
    std::fill_n(first, kMostRotationPairs * shots, std::numeric_limits<double>::quiet_NaN());
    std::fill_n(second, kMostRotationPairs * shots, std::numeric_limits<double>::quiet_NaN());
    for (py::ssize_t i = 0; i < shots; ++i) {
      if (i % kLook == 0) progress.report(static_cast<double>(i) / static_cast<double>(shots));
      count[i] = 0;
      continuum[i] = false;
      if (std::isnan(azimuths[i]) || std::isnan(zeniths[i])) continue;
      const InverseSolution solution = rotation_angles_for(
          train, direction_from_angles<double>({azimuths[i], zeniths[i]}), fixed_angles, beams[i]);
      for (const RotationPair& pair : solution.pairs) {
        if (count[i] == kMostRotationPairs) break;
        first[kMostRotationPairs * i + count[i]] = pair.first;
        second[kMostRotationPairs * i + count[i]] = pair.second;
        ++count[i];
      }
      continuum[i] = solution.continuum;
    }
  };
  run_job(py::none(), 0, solve);
  return py::make_tuple(first, second, result_of(count), result_of(continuum));
}

PrismTrain train_from(const std::string& face_order, int emitters,
                      const std::vector<double>& parameters) {
  PrismTrain train(parse_face_order(face_order), emitters);
  require_length("parameters", parameters.size(), train.parameters().size());
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    train.set_place(static_cast<int>(i), parameters[i]);
  }
  return train;
}

}  // namespace

void bind_optics(py::module_& module) {
  py::class_<PrismTrain>(
      module, "PrismTrain",
      "Prisms in beam order, the emitters in front of them, and all their parameters.\n\n"
      "Parameters\n----------\nface_order : str, default 'PA-AP'\n    First face in beam order, of "
      "every prism: PA the one perpendicular to the axis,\n"
      "    AP the angled one.\n"
      "emitters : int, default 1\n    Number of emitters.\n\n"
      "Notes\n-----\n"
      "A new train is ideal: no errors, air 1, glass 1.51, wedges of 18 degrees. Parameters are\n"
      "read and set by name, ``train['wedge_angle_a']`` in SI units and\n"
      "``train['wedge_angle_a_deg']`` in degrees.\n\n"
      "Raises\n------\nValueError\n    For an unsupported number of prisms or emitters.")
      .def(py::init([](const std::string& face_order, int emitters) {
             return PrismTrain(parse_face_order(face_order), emitters);
           }),
           py::arg("face_order") = "PA-AP", py::arg("emitters") = 1)
      .def_property_readonly("prisms", &PrismTrain::prisms, "Number of prisms.")
      .def_property_readonly("emitters", &PrismTrain::emitters, "Number of emitters.")
      .def_property_readonly(
          "face_order", [](const PrismTrain& train) { return to_string(train.face_order()); },
          "First face in beam order, of every prism, such as 'PA-AP'.")
      .def_property_readonly(
          "parameters", [](const PrismTrain& train) { return array_of(train.parameters()); },
          "The flat vector of all parameters, SI units; shape (n,).")
      .def_property_readonly(
          "names",
          [](const PrismTrain& train) {
            std::vector<std::string> names;
            for (const ParameterInfo& info : parameter_list(train.shape())) {
              if (info.kind == ParameterKind::train) names.push_back(si_name(info.name));
            }
            return names;
          },
          "Names of the parameters, common ones first.")
      .def("__getitem__",
           [](const PrismTrain& train, const std::string& name) {
             const NamedParameter parameter = named_parameter(name, train.shape());
             return train.get(parameter.info->name) / parameter.si_per_unit;
           })
      .def("__setitem__",
           [](PrismTrain& train, const std::string& name, double value) {
             const NamedParameter parameter = named_parameter(name, train.shape());
             train.set(parameter.info->name, value * parameter.si_per_unit);
           })
      .def("without_errors", &PrismTrain::without_errors,
           "without_errors(self)\n--\n\nThe same glass and wedges with every error 0.")
      .def("__copy__", [](const PrismTrain& train) { return train; })
      .def("__deepcopy__", [](const PrismTrain& train, const py::dict&) { return train; })
      .def("__eq__",
           [](const PrismTrain& a, const py::object& other) {
             if (!py::isinstance<PrismTrain>(other)) return false;
             const auto& b = other.cast<const PrismTrain&>();
             return a.face_order() == b.face_order() && a.emitters() == b.emitters() &&
                    a.parameters() == b.parameters();
           })
      .def("__repr__",
           [](const PrismTrain& train) {
             return fmt::format("<risley.PrismTrain {}, {} emitter{}>",
                                to_string(train.face_order()), train.emitters(),
                                train.emitters() == 1 ? "" : "s");
           })
      .def(py::pickle(
          [](const PrismTrain& train) {
            return py::make_tuple(to_string(train.face_order()), train.emitters(),
                                  train.parameters());
          },
          [](const py::tuple& state) {
            return train_from(state[0].cast<std::string>(), state[1].cast<int>(),
                              state[2].cast<std::vector<double>>());
          }));
  module.def("observe", &observe_shots, py::arg("train"), py::arg("angles"), py::arg("beam"),
             py::arg("azimuth_out"), py::arg("zenith_out"));
  module.def("rays", &rays_of_shots, py::arg("train"), py::arg("angles"), py::arg("beam"),
             py::arg("thickness"), py::arg("spacing"));
  module.def("linearise", &linearise_shots, py::arg("train"), py::arg("angles"), py::arg("beam"));
  module.def("invert", &invert, py::arg("train"), py::arg("azimuth"), py::arg("zenith"),
             py::arg("fixed_angles"), py::arg("beam"));
}

}  // namespace risley::python
