// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <pybind11/numpy.h>

#include "risley/core/angle.hpp"
#include "risley/core/setting.hpp"

#include "python/bind.hpp"

PYBIND11_MODULE(_risley, module) {
  using namespace risley::python;
  risley::write_settings_as(risley::SettingStyle::keyword);
  py::options options;
  options.disable_function_signatures();  // docs begin with them: "name(self, ...)\n--\n\n"
  module.doc() = "The libraries of risley; use the package risley, which documents them.";
  module.attr("__version__") = RISLEY_VERSION;
  module.def("radians", &risley::radians_from_degrees, py::arg("degrees"),
             "An angle in degrees as the libraries convert it, rad.");
  // pybind11 imports numpy once, for its first array; two threads creating their first arrays at
  // the same time would deadlock. Without numpy everything works that creates no arrays.
  try {
    py::dtype::of<double>();
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_ImportError)) throw;
  }
  bind_errors(module);
  bind_calls(module);
  bind_recordings(module);
  bind_optics(module);
  bind_sensors(module);
  bind_trajectories(module);
  bind_rotors(module);
  bind_points(module);
  bind_jobs(module);
  bind_network(module);
}
