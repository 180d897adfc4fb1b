// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "python/options.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <variant>

#include <fmt/ranges.h>

#include "python/call.hpp"
#include "python/names.hpp"
#include "python/reading.hpp"

namespace risley::python {
namespace {

/// The name in files of a parameter of any train; an unknown name unchanged, for the job to reject.
std::string file_name_of(const NamedParameter& parameter, const std::string& name) {
  return parameter.info != nullptr ? parameter.info->name : name;
}

recordings::Source in_memory(std::shared_ptr<const recordings::Recording> recording,
                             std::string name) {
  return unlocked([&] { return recordings::Source(std::move(recording), std::move(name)); });
}

}  // namespace

std::size_t Options::choice(const char* name, const std::vector<std::string>& allowed,
                            std::size_t usual) const {
  if (!has(name)) return usual;
  std::string word;
  take(name, word);
  const auto found = std::find(allowed.begin(), allowed.end(), word);
  if (found == allowed.end()) {
    throw InvalidArgument(
        fmt::format("{} = '{}', allowed {}", name, word, fmt::join(allowed, ", ")));
  }
  return static_cast<std::size_t>(found - allowed.begin());
}

py::type_error Options::wrong_type(const char* name, const py::handle& value) {
  return py::type_error(fmt::format("{} = {} has a type that is not accepted here", name,
                                    py::repr(value).cast<std::string>()));
}

recordings::Source recording_source(const Options& options, const char* name) {
  if (options.is<recordings::Recording>(name)) {
    std::shared_ptr<recordings::Recording> recording;
    options.take(name, recording);
    return in_memory(std::move(recording), "recording in memory");
  }
  std::string path;
  options.take(name, path);
  return path;
}

std::vector<recordings::Source> recording_sources(const Options& options, const char* name) {
  std::vector<std::variant<std::shared_ptr<recordings::Recording>, std::string>> given;
  options.take(name, given);
  std::vector<recordings::Source> sources;
  for (auto& one : given) {
    if (auto* recording = std::get_if<std::shared_ptr<recordings::Recording>>(&one)) {
      sources.push_back(in_memory(std::move(*recording),
                                  fmt::format("recording {} in memory", sources.size() + 1)));
    } else {
      sources.emplace_back(std::get<std::string>(std::move(one)));
    }
  }
  return sources;
}

void take_messages(const Options& options, bags::LidarTopicOptions& messages) {
  options.take("topic", messages.topic);
  options.take("frame_id", messages.frame_id);
  options.take("frame_rate", messages.frame_rate);
  if (options.has("message")) {
    constexpr std::array kMessages = {bags::WrittenMessage::cloud,
                                      bags::WrittenMessage::custom_driver,
                                      bags::WrittenMessage::custom_driver2};
    messages.message = kMessages.at(options.choice("message", {"points", "custom", "custom2"}));
  }
}

recordings::ReadOptions read_options(const Options& options) {
  std::optional<double> shot_rate;
  YawPitchRoll extrinsics;
  options.take("shot_rate", shot_rate);
  options.take("extrinsics", extrinsics);
  std::string device;
  options.take("device", device);
  return read_options(shot_rate, extrinsics, std::move(device));
}

jobs::HeldParameters held_parameters(const Options& options) {
  std::vector<std::pair<std::string, std::optional<double>>> fixed;
  options.take("fix", fixed);
  for (auto& [name, value] : fixed) {
    const NamedParameter parameter = parameter_of_any_train(name);
    if (value) *value *= parameter.si_per_unit;
    name = file_name_of(parameter, name);
  }
  return fixed;
}

std::vector<std::string> parameter_names(const Options& options, const char* name) {
  std::vector<std::string> names;
  options.take(name, names);
  for (std::string& one : names) one = file_name_of(parameter_of_any_train(one), one);
  return names;
}

jobs::ParameterValues parameter_values(const Options& options, const char* name) {
  jobs::ParameterValues values;
  options.take(name, values);
  for (auto& [one, value] : values) {
    const NamedParameter parameter = parameter_of_any_train(one);
    value *= parameter.si_per_unit;
    one = file_name_of(parameter, one);
  }
  return values;
}

jobs::PlatformFiles platform_files(const Options& options) {
  jobs::PlatformFiles files;
  options.take("trajectory", files.trajectory);
  options.take("trajectory_topic", files.topic);
  options.take("mount", files.mount);
  options.take("accuracy", files.accuracy);
  options.take("trajectory_errors", files.errors);
  options.take("crs", files.crs);
  options.take("datum", files.datum);
  return files;
}

jobs::SimulationOptions simulation_options(const Options& options, int threads) {
  jobs::SimulationOptions simulation;
  options.take("sensor", simulation.sensor);
  simulation.set = parameter_values(options, "set");
  options.take("reported_nominal", simulation.reported_nominal);
  simulation.reported = parameter_values(options, "reported");
  options.take("noise_angle", simulation.angle_noise);
  options.take("noise_range", simulation.range_noise);
  options.take("quantize", simulation.quantize);
  options.take("beam_origin", simulation.beam_origin);
  std::string rotor = to_string(simulation.rotor);
  options.take("rotor", rotor);
  simulation.rotor = simulation::rotor_kind_from(rotor);
  options.take("start_angles", simulation.start_angles);
  options.take("scene", simulation.scene);
  options.take("station", simulation.station);
  options.take("seed", simulation.seed);
  simulation.threads = threads;
  return simulation;
}

jobs::Provenance provenance_of(const char* job) {
  return {{"command", fmt::format("risley.{} of Python", job)}, {"version", RISLEY_VERSION}};
}

jobs::ResultFiles result_files(const Options& options, const char* job) {
  jobs::ResultFiles files;
  options.take("output", files.folder);
  constexpr std::array kRows = {jobs::StatesRows::knots, jobs::StatesRows::all,
                                jobs::StatesRows::none};
  files.states = kRows.at(options.choice("states", {"knots", "all", "none"}));
  files.provenance = provenance_of(job);
  std::uint64_t seed = 0;
  options.take("seed", seed);
  files.provenance.emplace_back("seed", std::to_string(seed));
  return files;
}

void take_rate(const Options& options, std::optional<double>& rate) {
  if (options.is<py::str>("rate")) {
    options.choice("rate", {"full"});
    rate.reset();
    return;
  }
  options.take("rate", rate);
}

jobs::CloudOfRecordingOptions cloud_options(const Options& options) {
  jobs::CloudOfRecordingOptions job;
  job.recording = recording_source(options, "recording");
  job.reading = read_options(options);
  options.take("calibration", job.calibration);
  options.take("output", job.output);
  options.take("replace", job.replace);
  job.platform = platform_files(options);
  cloud::CloudOptions& settings = job.cloud;
  settings.pointing.reported_directions =
      options.choice("directions", {"smoothed", "reported"}) == 1;
  options.take("beam_origin", settings.pointing.beam_origin);
  options.take("beam_divergence", settings.pointing.beam_divergence);
  options.take("covariance", settings.pointing.covariance);
  options.take("common_factors", settings.loadings);
  settings.rate = cloud::kTrackingRate;
  take_rate(options, settings.rate);
  options.take("noise_angle", settings.angle_noise);
  options.take("las_scale", settings.writer.las_scale);
  options.take("format", settings.writer.format);
  take_messages(options, settings.writer.messages);
  settings.writer.gps_time = options.choice("time", {"gps", "recording"}) == 0;
  bool distribution = false;
  options.take("distribution", distribution);
  if (distribution) settings.distribution.emplace();
  job.provenance = provenance_of("cloud");
  return job;
}

}  // namespace risley::python
