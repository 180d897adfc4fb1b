// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation_input.hpp"

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/sensors/preset.hpp"

#include "recording_text.hpp"

namespace risley::app {
namespace {

/// Type of the sensor that is assumed where a file does not name its own.
constexpr std::uint8_t kAssumedType = 1;  // Mid-40

bool names_its_sensor(const recordings::RecordingHeader& header) {
  return header.devices.front().type != recordings::kUnknownDeviceType;
}

/// The built-in preset of the instrument that made a recording.
sensors::Sensor sensor_of_recording(const recordings::RecordingHeader& header) {
  const std::uint8_t type = names_its_sensor(header) ? header.devices.front().type : kAssumedType;
  std::optional<sensors::Sensor> found;
  for (const std::string& name : sensors::builtin_preset_names()) {
    sensors::Sensor sensor = sensors::load_sensor(name);
    // Presets of single units and of reversed rotors have longer names than that of the type.
    if (sensor.device_type == type && (!found || name.size() < found->name.size())) {
      found = std::move(sensor);
    }
  }
  if (!found) {
    throw InvalidArgument(
        fmt::format("no built-in preset for the recording's sensor ({}): say which with --sensor",
                    recordings::device_type_name(type)));
  }
  return *found;
}

/// @param wished  as EstimationWishes::sensor
sensors::Sensor chosen_sensor(const std::string& wished,
                              const recordings::RecordingHeader& header) {
  return wished.empty() ? sensor_of_recording(header) : sensors::load_sensor(wished);
}

}  // namespace

RecordingInput read_recording(const std::string& path, const ReadingWishes& reading,
                              const std::string& sensor,
                              const estimation::SelectionOptions& selection,
                              const CommonOptions& common) {
  const double started = now();
  SensorFrameInput input = open_in_sensor_frame(path, reading, [&sensor](const auto& header) {
    return chosen_sensor(sensor, header).field_of_view;
  });
  RecordingInput result{
      std::move(input.reader), {}, estimation::ShotSelector(selection), {}, false, 0};
  result.whole_steps = result.reader->header().cartesian && !input.turned_back;
  if (result.reader->header().devices.size() > 1) {
    throw InvalidArgument(
        fmt::format("{} holds {} sensors, an estimation takes the recording of one", path,
                    result.reader->header().devices.size()));
  }
  ProgressBar bar("reading", common);
  recordings::TimeAudit audit;
  recordings::Chunk chunk;
  while (result.reader->read(chunk)) {
    audit.add(chunk);
    result.selector.add(chunk.observations);
    bar.show(result.reader->fraction_read());
  }
  result.audit = audit.result();
  result.warnings = warning_texts(result.reader->warnings());
  result.warnings.insert(result.warnings.end(), input.warnings.begin(), input.warnings.end());
  if (sensor.empty() && !names_its_sensor(result.reader->header())) {
    result.warnings.push_back(
        "the file does not say which sensor recorded it: a Mid-40 was assumed; --sensor says "
        "which");
  }
  const std::uint64_t resets = result.selector.counts().clock_resets;
  if (resets > 0) {
    result.warnings.push_back(
        fmt::format("the clock of the recording jumps back {} times: the "
                    "pieces share the parameters, and their rotors are found "
                    "anew",
                    resets));
  }
  result.seconds = now() - started;
  return result;
}

estimation::EstimateOptions estimate_options(
    const EstimationWishes& wishes, const std::optional<recordings::RecordingHeader>& header) {
  estimation::EstimateOptions result;
  if (wishes.sensor.empty() && !header) throw InvalidArgument("--sensor is missing");
  result.sensor =
      header ? chosen_sensor(wishes.sensor, *header) : sensors::load_sensor(wishes.sensor);
  const TrainShape shape = result.sensor.shape();
  if (wishes.noise_angle_deg) {
    check_positive(*wishes.noise_angle_deg, "--noise-angle-deg", "deg");
    result.angle_noise = radians_from_degrees(*wishes.noise_angle_deg);
  }
  for (const std::string& text : wishes.fixed) {
    if (text.find('=') == std::string::npos) {
      find_parameter(text, shape);
      result.fixed.push_back(text);
      continue;
    }
    const auto [name, value] = parameter_assignment(text, shape);
    if (find_parameter(name, shape).kind != ParameterKind::train) {
      throw InvalidArgument(
          fmt::format("--fix {}: only parameters of the prisms can be held", name));
    }
    result.sensor.set(name, value);
    result.fixed.push_back(name);
  }
  result.additional = wishes.freed;
  return result;
}

void add_parameter_choice(CLI::App& verb, std::vector<std::string>& fixed,
                          std::vector<std::string>& freed) {
  verb.add_option("--fix", fixed, "Hold a parameter, at a value if one is given (repeatable)")
      ->type_name("NAME[=VALUE]")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  verb.add_option("--free", freed, "Estimate one more parameter (repeatable)")
      ->type_name("NAME")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
}

}  // namespace risley::app
