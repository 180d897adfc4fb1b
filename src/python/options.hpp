// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "risley/core/error.hpp"
#include "risley/jobs/cloud_of_recording.hpp"
#include "risley/jobs/given.hpp"
#include "risley/jobs/moving_platform.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/jobs/simulation_settings.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/trajectories/trajectory.hpp"

#include "python/bind.hpp"

namespace risley::python {

/// Keyword arguments of a job by name. None, and missing ones, leave a default unchanged. Requires
/// the interpreter's lock, which the threads of jobs do not have: reading without it is a bug that
/// some versions of Python tolerate.
class Options {
 public:
  explicit Options(py::dict values) : values_(std::move(values)) {}

  bool has(const char* name) const {
    if (PyGILState_Check() == 0) throw std::logic_error("options read without Python's lock");
    return values_.contains(name) && !values_[name].is_none();
  }

  template <class T>
  bool is(const char* name) const {
    return has(name) && py::isinstance<T>(values_[name]);
  }

  /// @throws TypeError naming the option
  template <class T>
  void take(const char* name, T& to) const {
    if (!has(name)) return;
    try {
      to = values_[name].cast<T>();
    } catch (const py::cast_error&) {
      throw wrong_type(name, values_[name]);
    }
  }
  /// An object in memory, or a path.
  template <class T>
  void take(const char* name, jobs::Given<T>& to) const {
    if (!has(name)) return;
    to = given<T>(values_[name], name);
  }
  /// Several of them.
  template <class T>
  void take(const char* name, std::vector<jobs::Given<T>>& to) const {
    if (!has(name)) return;
    for (const py::handle one : values_[name]) {
      to.push_back(given<T>(one, fmt::format("result {}", to.size() + 1).c_str()));
    }
  }
  template <class T>
  void take(const char* name, std::optional<T>& to) const {
    if (has(name)) take(name, to.emplace());
  }

  /// A word among those allowed. @return its place; `usual` if it is missing
  std::size_t choice(const char* name, const std::vector<std::string>& allowed,
                     std::size_t usual = 0) const;

 private:
  template <class T>
  jobs::Given<T> given(const py::handle& value, const char* name) const {
    if (py::isinstance<T>(value)) {
      return {std::make_shared<const T>(value.cast<const T&>()), fmt::format("{} in memory", name)};
    }
    if (py::isinstance<py::str>(value)) return value.cast<std::string>();
    throw wrong_type(name, value);
  }
  static py::type_error wrong_type(const char* name, const py::handle& value);

  py::dict values_;
};

/// A recording by its path, or a Recording.
recordings::Source recording_source(const Options& options, const char* name);
/// A list of them.
std::vector<recordings::Source> recording_sources(const Options& options, const char* name);
/// shot_rate, Hz, extrinsics, yaw, pitch, roll in rad, and device.
recordings::ReadOptions read_options(const Options& options);
/// fix: [(name, value or None)], by either name of a parameter.
jobs::HeldParameters held_parameters(const Options& options);
/// A list of names, by either name of a parameter.
std::vector<std::string> parameter_names(const Options& options, const char* name);
/// [(name, value)], by either name of a parameter.
jobs::ParameterValues parameter_values(const Options& options, const char* name);
/// trajectory, topic, mount, accuracy, trajectory_errors, crs, datum: paths and names.
jobs::PlatformFiles platform_files(const Options& options);
/// Common options of `simulate` and `emulate`: sensor, set, reported, reported_nominal,
/// noise_angle, noise_range, quantize, beam_origin, rotor, start_angles, scene, station, seed.
jobs::SimulationOptions simulation_options(const Options& options, int threads);
/// rate: shots per second to use, Hz, or 'full' for all.
void take_rate(const Options& options, std::optional<double>& rate);
/// How points become messages of bags.
void take_messages(const Options& options, bags::LidarTopicOptions& messages);
/// Common options of `cloud` and `points`: all but the output.
jobs::CloudOfRecordingOptions cloud_options(const Options& options);
/// output: the folder of results; states: knots, all or none.
jobs::ResultFiles result_files(const Options& options, const char* job);
/// Name and version of the program for files.
jobs::Provenance provenance_of(const char* job);

}  // namespace risley::python
