// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/simulation/truth_file.hpp"

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/io/text_file.hpp"
#include "risley/recordings/writer.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::simulation {

std::string truth_preset_path(const std::string& recording) { return recording + ".truth.yaml"; }
std::string truth_columns_path(const std::string& recording) { return recording + ".truth.nc"; }

sensors::Sensor truth_preset(const Scanner& scanner,
                             const std::vector<std::pair<std::string, std::string>>& provenance) {
  const SimulationSettings& settings = scanner.settings();
  sensors::Sensor truth = settings.truth;
  truth.provenance = provenance;
  const auto add = [&](std::string name, auto value) {
    truth.provenance.emplace_back(std::move(name), fmt::format("{}", value));
  };
  add("seed", settings.seed);
  add("observations", scanner.shots());
  add("duration_s", settings.duration);
  add("rate_hz", *settings.rate);
  add("noise_angle_deg", degrees_from_radians(*settings.angle_noise));
  add("noise_range_m", *settings.range_noise);
  add("quantize", settings.quantize ? "yes" : "no");
  add("rotor", to_string(settings.rotor));
  if (!settings.station.empty()) add("station", settings.station);
  for (std::size_t i = 0; i < scanner.start_angles().size(); ++i) {
    add(fmt::format("start_rotation_angle_{}_deg", prism_letter(static_cast<int>(i))),
        degrees_from_radians(scanner.start_angles()[i]));
  }
  if (settings.reported) {
    for (const ParameterInfo& info : parameter_list(truth.prisms())) {
      if (info.kind != ParameterKind::train || info.places.size() > 1) continue;
      const double reported = settings.reported->train.get(info.name);
      if (reported != truth.train.get(info.name)) {
        add("reported " + info.name, reported / info.si_per_unit);
      }
    }
  }
  return truth;
}

SimulationResult simulate_to_file(
    const SimulationSettings& settings, const std::string& path,
    const std::vector<std::pair<std::string, std::string>>& provenance, const Progress& progress) {
  Scanner scanner(settings);
  const auto recording = recordings::create_recording(path, scanner.header());
  recordings::TruthWriter truth_columns(truth_columns_path(path), settings.truth.prisms());
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  while (scanner.read(chunk, truth)) {
    recording->write(chunk);
    truth_columns.write(truth);
    report_progress(
        progress, static_cast<double>(scanner.shots_done()) / static_cast<double>(scanner.shots()));
  }
  recording->close();
  truth_columns.close();
  SimulationResult result{scanner.shots(), scanner.no_return(), truth_preset(scanner, provenance),
                          scanner.start_angles()};
  io::write_text_file(truth_preset_path(path), sensors::preset_text(result.truth));
  return result;
}

}  // namespace risley::simulation
