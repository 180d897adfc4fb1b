// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "risley/core/error.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/require.hpp"
#include "risley/io/text_file.hpp"
#include "risley/jobs/estimate_recording.hpp"
#include "risley/report/estimate_report.hpp"
#include "risley/report/html.hpp"
#include "risley/report/report_facts.hpp"
#include "risley/report/report_file.hpp"

#include "python/arrays.hpp"
#include "python/bind.hpp"
#include "python/call.hpp"
#include "python/names.hpp"
#include "python/reading.hpp"

namespace risley::python {
namespace {

using jobs::EstimatedRecording;
using SharedEstimate = std::shared_ptr<EstimatedRecording>;
using Held = std::vector<std::pair<std::string, std::optional<double>>>;

/// The name in files of a parameter of any train; an unknown name as it is, for the job to refuse.
std::string file_name_of(const NamedParameter& parameter, const std::string& name) {
  return parameter.info != nullptr ? parameter.info->name : name;
}

jobs::HeldParameters held_parameters(const Held& fixed) {
  jobs::HeldParameters held;
  for (const auto& [name, value] : fixed) {
    const NamedParameter parameter = parameter_of_any_train(name);
    std::optional<double> si = value;
    if (si) *si *= parameter.si_per_unit;
    held.emplace_back(file_name_of(parameter, name), si);
  }
  return held;
}

std::vector<std::string> freed_parameters(const std::vector<std::string>& names) {
  std::vector<std::string> freed;
  freed.reserve(names.size());
  for (const std::string& name : names) {
    freed.push_back(file_name_of(parameter_of_any_train(name), name));
  }
  return freed;
}

std::vector<std::string> names_of(const std::vector<estimation::EstimatedValue>& values) {
  std::vector<std::string> names;
  names.reserve(values.size());
  for (const auto& value : values) names.push_back(si_name(value.name));
  return names;
}

/// One number of every value.
py::array_t<double> column_of(const std::vector<estimation::EstimatedValue>& values,
                              double estimation::EstimatedValue::*number) {
  std::vector<double> column;
  column.reserve(values.size());
  for (const auto& value : values) column.push_back(value.*number);
  return array_of(std::move(column));
}

void write_page(const EstimatedRecording& outcome, const std::string& path,
                const py::object& tell) {
  run_job(tell, 0, [&](const Progress& progress) {
    const jobs::EstimateDetails details =
        jobs::estimate_details(outcome.estimate, outcome.nominal, outcome.head, outcome.evaluation,
                               progress.stage("judging"));
    io::write_text_file(
        path, report::report_page(report::estimate_report(
                  {outcome.estimate, outcome.nominal, outcome.evaluation, outcome.head, details,
                   report::reported(outcome.recording), outcome.provenance, outcome.warnings})));
  });
}

/// The verdict and a table of what was found.
std::string html_of(const EstimatedRecording& outcome) {
  const estimation::Estimate& e = outcome.estimate;
  std::string html = fmt::format(
      "<p><b>{}</b>: {}</p><table><tr><th>parameter</th><th>value</th>"
      "<th>&plusmn; sigma</th><th>unit</th></tr>",
      estimation::to_string(e.verdict.code), report::escape_html(e.verdict.words));
  for (const estimation::EstimatedValue& value : e.values) {
    const ParameterInfo& info = find_parameter(value.name, e.sensor.shape());
    const NumberText text =
        number_text(value.value / info.si_per_unit, value.sigma / info.si_per_unit);
    html += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>", value.name,
                        text.value, text.sigma, info.unit);
  }
  return html + "</table>";
}

SharedEstimate estimate(const std::string& recording, const std::string& sensor,
                        const std::string& method, const py::object& rate,
                        std::optional<double> angle_noise, const Held& fixed,
                        const std::vector<std::string>& freed, std::optional<bool> mirrored,
                        const std::string& truth, std::optional<double> shot_rate,
                        const YawPitchRoll& extrinsics, int threads, const py::object& tell) {
  jobs::EstimateRecordingOptions job;
  job.recording = recording;
  job.reading = read_options(shot_rate, extrinsics);
  job.sensor = sensor;
  if (method != "map" && method != "ekf") {
    throw InvalidArgument(fmt::format("method = '{}', allowed map and ekf", method));
  }
  job.method = method == "ekf" ? estimation::Method::ekf : estimation::Method::map;
  if (rate.is_none()) {
    job.rate = jobs::usual_rate(job.method);
  } else if (!py::isinstance<py::str>(rate)) {
    job.rate = rate.cast<double>();
    require_above("rate", *job.rate, 0, "Hz");
  } else if (rate.cast<std::string>() != "full") {
    throw InvalidArgument(
        fmt::format("rate = '{}', expected a number or 'full'", rate.cast<std::string>()));
  }
  if (angle_noise) require_above("angle_noise", *angle_noise, 0, "rad");
  job.angle_noise = angle_noise;
  job.fixed = held_parameters(fixed);
  job.additional = freed_parameters(freed);
  job.mirrored = mirrored;
  job.truth = truth;
  SharedEstimate result;
  run_job(tell, threads, [&](const Progress& progress) {
    result = std::make_shared<EstimatedRecording>(jobs::estimate_recording(job, progress));
  });
  return result;
}

}  // namespace

void bind_jobs(py::module_& module) {
  py::class_<EstimatedRecording, SharedEstimate>(
      module, "Estimate",
      "What `estimate` found. Numbers are in SI units, names without a unit; texts and tables\n"
      "for people are in degrees.")
      .def_property_readonly(
          "converged", [](const EstimatedRecording& r) { return r.estimate.converged; },
          "Whether the numbers can be used.")
      .def_property_readonly(
          "reason", [](const EstimatedRecording& r) { return r.estimate.reason; },
          "Why they cannot; empty otherwise.")
      .def_property_readonly(
          "verdict",
          [](const EstimatedRecording& r) {
            const estimation::EstimateVerdict& verdict = r.estimate.verdict;
            return py::make_tuple(estimation::to_string(verdict.code), verdict.words,
                                  verdict.to_do);
          },
          "Stable code, what was found, and what follows from it.")
      .def_property_readonly(
          "sensor", [](const EstimatedRecording& r) { return r.estimate.sensor; },
          "The sensor with the estimated parameters and their covariance.")
      .def_property_readonly(
          "names", [](const EstimatedRecording& r) { return names_of(r.estimate.values); },
          "What was estimated: parameters, mean speeds, first rotation angles.")
      .def_property_readonly(
          "units",
          [](const EstimatedRecording& r) {
            std::vector<std::string> units;
            for (const auto& value : r.estimate.values) {
              units.push_back(si_unit(find_parameter(value.name, r.estimate.sensor.shape())));
            }
            return units;
          },
          "Their units: 1, rad or rad/s.")
      .def_property_readonly(
          "values",
          [](const EstimatedRecording& r) {
            return column_of(r.estimate.values, &estimation::EstimatedValue::value);
          },
          "Their values, shape (n,).")
      .def_property_readonly(
          "sigmas",
          [](const EstimatedRecording& r) {
            return column_of(r.estimate.values, &estimation::EstimatedValue::sigma);
          },
          "One standard deviation each, with what held parameters may be off by, shape (n,).")
      .def_property_readonly(
          "free",
          [](const EstimatedRecording& r) {
            std::vector<std::string> names;
            for (const auto& free : r.estimate.free) names.push_back(si_name(free.name));
            return names;
          },
          "What the covariance is of.")
      .def_property_readonly(
          "covariance", [](const EstimatedRecording& r) { return array_of(r.estimate.covariance); },
          "Of the free parameters if those held are exact, shape (free, free).")
      .def_property_readonly(
          "warnings",
          [](const EstimatedRecording& r) {
            std::vector<std::string> warnings = r.warnings;
            warnings.insert(warnings.end(), r.estimate.warnings.begin(), r.estimate.warnings.end());
            return warnings;
          },
          "What else there is to know, in sentences.")
      .def_property_readonly(
          "azimuth_residual",
          [](const SharedEstimate& r) {
            return view_of<double, EstimatedRecording>(r->estimate.azimuth_residual, r);
          },
          "Observed less estimated azimuth of every used shot, rad; a view.")
      .def_property_readonly(
          "zenith_residual",
          [](const SharedEstimate& r) {
            return view_of<double, EstimatedRecording>(r->estimate.zenith_residual, r);
          },
          "Observed less estimated zenith of every used shot, rad; a view.")
      .def("_repr_html_", &html_of)
      .def("__repr__", [](const EstimatedRecording& r) {
        return fmt::format("<risley.Estimate {}: {} values, {}>", r.estimate.sensor.name,
                           r.estimate.values.size(),
                           estimation::to_string(r.estimate.verdict.code));
      });
  module.def("write_page", &write_page, py::arg("estimate"), py::arg("path"), py::arg("tell"));
  module.def("estimate", &estimate, py::arg("recording"), py::arg("sensor"), py::arg("method"),
             py::arg("rate"), py::arg("angle_noise"), py::arg("fixed"), py::arg("free"),
             py::arg("mirrored"), py::arg("truth"), py::arg("shot_rate"), py::arg("extrinsics"),
             py::arg("threads"), py::arg("tell"));
}

}  // namespace risley::python
