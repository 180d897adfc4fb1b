// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "risley/jobs/emulate_sensor.hpp"
#include "risley/jobs/live_bags.hpp"
#include "risley/jobs/record_sensors.hpp"
#include "risley/json/results.hpp"

#include "python/call.hpp"
#include "python/json.hpp"
#include "python/options.hpp"

namespace risley::python {
namespace {

/// Set by the user to end a recording or a virtual sensor: both run until then.
using Stop = std::shared_ptr<CancelFlag>;

/// Passes messages of a running job to Python.
/// @param note  callable(words, is_wrong)
void pass_words(const py::object& note, const std::string& words, bool is_wrong) {
  const py::gil_scoped_acquire lock;
  try {
    note(words, is_wrong);
  } catch (py::error_already_set& error) {
    error.discard_as_unraisable("risley");  // losing a message must not end a recording
  }
}

jobs::RecordOptions record_options(const Options& options) {
  jobs::RecordOptions job;
  options.take("interface", job.interface);
  options.take("serial", job.serials);
  options.take("find", job.find_time);
  options.take("passive", job.passive);
  options.take("data_port", job.data_port);
  options.take("duration", job.duration);
  if (options.has("coordinates")) {
    const std::size_t coordinates =
        options.choice("coordinates", {"spherical", "cartesian", "as-is"});
    job.spherical = coordinates == 2 ? std::nullopt : std::optional(coordinates == 0);
  }
  if (options.has("return_mode")) {
    constexpr std::array kModes = {wire::ReturnMode::first, wire::ReturnMode::strongest,
                                   wire::ReturnMode::dual, wire::ReturnMode::triple};
    const std::size_t mode =
        options.choice("return_mode", {"first", "strongest", "dual", "triple", "as-is"});
    if (mode < kModes.size()) job.return_mode = kModes.at(mode);
  }
  options.take("imu", job.imu);
  options.take("output", job.output);
  jobs::GivenSensor optics;
  options.take("optics", optics);
  job.watch_optics = !optics.empty();
  if (optics.path() != "own") job.optics_reference = optics;
  if (options.has("publish")) {
    jobs::LivePointsOptions& points = job.publish.emplace();
    options.take("calibration", points.calibration);
    take_messages(options, points.messages);
  }
  return job;
}

py::object find_sensors(const py::dict& values, const py::object& on_progress) {
  const jobs::RecordOptions job = record_options(Options(values));
  std::vector<jobs::FoundSensor> found;
  run_job(on_progress, 0,
          [&](const Progress& progress) { found = jobs::find_sensors(job, progress); });
  return dict_of(json::of(found));
}

py::object record(const py::dict& values, const py::object& note, const Stop& stop,
                  const py::object& on_progress) {
  const Options options(values);
  jobs::RecordOptions job = record_options(options);
  std::unique_ptr<jobs::LiveBag> points;
  if (job.publish) {
    std::string destination;
    options.take("publish", destination);
    points = jobs::open_live_bag(destination);
    job.publish->bag = points.get();
    pass_words(note, "points at " + points->place(), false);
  }
  jobs::RecordedSensors recorded;
  run_job(
      on_progress, 0,
      [&](const Progress& progress) {
        recorded = jobs::record_sensors(
            job,
            [&](const std::string& words, bool is_wrong) { pass_words(note, words, is_wrong); },
            progress);
        if (points) points->close();
      },
      stop.get());
  if (points) recorded.viewers = points->viewers();
  return dict_of(json::of(recorded));
}

jobs::EmulatedFaults faults_of(const Options& options) {
  jobs::EmulatedFaults faults;
  options.take("loss", faults.loss);
  options.take("duplication", faults.duplication);
  options.take("disorder", faults.disorder);
  options.take("disorder_packets", faults.farthest);
  options.take("delay", faults.delay);
  options.take("wrong_checksums", faults.wrong_checksums);
  options.take("heartbeat_dies", faults.heartbeat_dies);
  options.take("restart", faults.restart);
  options.take("restart_takes", faults.restart_time);
  faults.bend = parameter_values(options, "bend");
  options.take("bend_s", faults.bend_time);
  return faults;
}

jobs::EmulatedClock clock_of(const Options& options) {
  using recordings::TimeReference;
  constexpr std::array kSources = {TimeReference::power_on, TimeReference::ptp, TimeReference::pps};
  jobs::EmulatedClock clock;
  clock.source = kSources.at(options.choice("time", {"power-on", "ptp", "pps"}));
  options.take("time_from", clock.source_from);
  double drift = 0;
  options.take("clock_drift", drift);
  clock.drift_ppm = 1e6 * drift;
  options.take("clock_jump", clock.jump);
  options.take("clock_jump_by", clock.jump_by);
  return clock;
}

py::object emulate(const py::dict& values, int threads, const py::object& note, const Stop& stop,
                   const py::object& on_progress) {
  const Options options(values);
  jobs::EmulateOptions job;
  options.take("interface", job.interface);
  options.take("serial", job.serial);
  job.simulation = simulation_options(options, threads);
  options.take("recording", job.recording);
  options.take("speed", job.speed);
  options.take("duration", job.duration);
  job.clock = clock_of(options);
  job.faults = faults_of(options);
  jobs::EmulatedSensor truth;
  run_job(
      on_progress, threads,
      [&](const Progress& progress) {
        truth = jobs::emulate_sensor(
            job, [&](const std::string& words) { pass_words(note, words, false); }, progress);
      },
      stop.get());
  return dict_of(json::of(truth));
}

}  // namespace

void bind_network(py::module_& module) {
  py::class_<CancelFlag, Stop>(module, "Stop",
                               "Ends a recording or a virtual sensor from another thread.\n\n"
                               "Pass it as ``stop`` and call `set`; it cannot be used again.")
      .def(py::init<>())
      .def("set", &CancelFlag::set,
           "set(self)\n--\n\nEnd the recording or virtual sensor that has this ``stop``, within a "
           "second.")
      .def("is_set", &CancelFlag::is_set, "is_set(self)\n--\n\nWhether `set` was called.");
  const auto options = py::arg("options");
  const auto note = py::arg("note");
  const auto stop = py::arg("stop").none(true);
  const auto on_progress = py::arg("on_progress");
  module.def("find_sensors", &find_sensors, options, on_progress);
  module.def("record", &record, options, note, stop, on_progress);
  module.def("emulate", &emulate, options, py::arg("threads"), note, stop, on_progress);
}

}  // namespace risley::python
