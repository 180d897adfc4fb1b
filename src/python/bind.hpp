// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/pybind11.h>

/// The module risley._risley: converts Python arguments to those of the libraries, and their
/// results to Python objects and arrays. There is one file for each layer of the libraries.
namespace risley::python {

namespace py = pybind11;

void bind_errors(py::module_& module);
void bind_calls(py::module_& module);
void bind_recordings(py::module_& module);
void bind_optics(py::module_& module);
void bind_sensors(py::module_& module);
void bind_trajectories(py::module_& module);
void bind_rotors(py::module_& module);
void bind_points(py::module_& module);
void bind_jobs(py::module_& module);
void bind_network(py::module_& module);

}  // namespace risley::python
