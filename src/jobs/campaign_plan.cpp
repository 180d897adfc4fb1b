// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/campaign_plan.hpp"

#include <algorithm>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/io/text_file.hpp"
#include "risley/io/yaml_map.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/jobs/simulation_settings.hpp"
#include "risley/recordings/writer.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::jobs {
namespace {

namespace fs = std::filesystem;
using io::fail_at;
using io::YamlMap;
using io::YamlNode;

constexpr std::uint64_t kMostSettings = 1000, kLargestSeed = std::uint64_t{1} << 62U;
constexpr int kMostSeeds = 100'000'000;
constexpr long double kMostDuration = 86'400, kMostRate = 1e7L;  // s, Hz
constexpr long double kMostAngle_deg = 10, kMostDistance = 100;  // deg, m

/// The text of a value, maps in the order of their keys.
std::string canonical(const YamlNode& node) {
  if (node.kind == YamlNode::Kind::nothing) return "~";
  if (node.kind == YamlNode::Kind::scalar) {
    std::ostringstream text;
    text << std::quoted(node.scalar);
    return text.str();
  }
  std::vector<std::string> parts;
  if (node.is_list()) {
    for (const YamlNode& item : node.items) parts.push_back(canonical(item));
    return fmt::format("[{}]", fmt::join(parts, ","));
  }
  for (std::size_t i = 0; i + 1 < node.items.size(); i += 2) {
    parts.push_back(canonical(node.items[i]) + ":" + canonical(node.items[i + 1]));
  }
  std::sort(parts.begin(), parts.end());
  return fmt::format("{{{}}}", fmt::join(parts, ","));
}

/// A value as text: unchanged.
std::string shown(const YamlNode& node) {
  return node.kind == YamlNode::Kind::scalar ? node.scalar : canonical(node);
}

/// Sets a value at a name such as simulate.set.wedge_angle_deg, replacing the previous one.
void put(YamlNode& node, std::string_view name, const YamlNode& value, const std::string& path,
         std::size_t line) {
  if (name.empty()) {
    node = value;
    return;
  }
  if (node.kind == YamlNode::Kind::nothing) node.kind = YamlNode::Kind::map;
  if (node.kind != YamlNode::Kind::map) {
    fail_at(path, line, fmt::format("grid: {} is below a value that is not a map", name));
  }
  const std::size_t dot = name.find('.');
  const std::string_view key = name.substr(0, dot);
  const std::string_view rest = dot == std::string_view::npos ? "" : name.substr(dot + 1);
  for (std::size_t i = 0; i + 1 < node.items.size(); i += 2) {
    if (node.items[i].scalar == key) return put(node.items[i + 1], rest, value, path, line);
  }
  YamlNode added;
  added.kind = YamlNode::Kind::scalar;
  added.scalar = key;
  added.line = line;
  node.items.push_back(std::move(added));
  node.items.emplace_back();
  put(node.items.back(), rest, value, path, line);
}

/// Reads the maps of one plan.
class PlanReader {
 public:
  explicit PlanReader(const std::string& path)
      : path_(path), folder_(fs::path(path).parent_path()) {}

  CampaignSetting setting(const YamlNode& root) {
    const YamlMap map(root, path_, "");
    CampaignSetting result;
    const YamlMap simulate = section(map, "simulate");
    std::vector<std::string> stations;
    const SimulationOptions simulation = simulation_of(simulate, stations);
    result.format = format_of(simulate);
    for (const std::string& station : stations) {
      SimulationOptions one = simulation;
      one.station = station;
      result.simulations.push_back(simulation_settings(one));
      // Values that a simulation rejects are rejected now. A short one: rotors take time to turn.
      simulation::SimulationSettings begin = result.simulations.back();
      begin.duration = std::min(begin.duration, 1.0);
      const simulation::Scanner can_be_simulated(std::move(begin));
    }
    if (map.find("estimate") != nullptr) {
      if (stations.size() > 1) {
        fail_at(path_, simulate.at("stations").line,
                "simulate.stations: several stations go with calibrate; estimate takes one "
                "recording");
      }
      result.job = estimate_of(section(map, "estimate"), simulation);
    } else {
      if (simulation.scene.empty()) {
        fail_at(path_, simulate.line(),
                "simulate.scene is missing: a file with the walls to calibrate on");
      }
      result.job = calibrate_of(section(map, "calibrate"), simulation, stations);
    }
    return result;
  }

  /// Files named in the plan, with their paths.
  const std::map<std::string, std::string>& files() const { return files_; }

 private:
  YamlMap section(const YamlMap& map, const std::string& name) const {
    const YamlMap::Entry& entry = map.at(name);
    if (entry.value.kind == YamlNode::Kind::nothing) {
      YamlNode none;
      none.kind = YamlNode::Kind::map;
      none.line = entry.line;
      return {none, path_, name};
    }
    return {entry.value, path_, name};
  }

  std::optional<double> number(const YamlMap& map, std::string_view key, long double most,
                               std::string_view unit, double si_per_unit = 1) const {
    if (map.find(key) == nullptr) return std::nullopt;
    return static_cast<double>(map.number(key, 0, most, unit)) * si_per_unit;
  }

  std::string choice(const YamlMap& map, std::string_view key,
                     const std::vector<std::string>& known) const {
    if (map.find(key) == nullptr) return known.front();
    std::string text = map.text(key);
    if (std::find(known.begin(), known.end(), text) == known.end()) {
      fail_at(path_, map.at(key).line,
              fmt::format("{} = \"{}\"{}, allowed: {}", map.field(key), text,
                          did_you_mean(text, known), fmt::join(known, ", ")));
    }
    return text;
  }

  /// A file beside the plan, or an absolute one.
  std::string file(const std::string& name) {
    std::string path = (folder_ / name).lexically_normal().string();
    files_.emplace(name, path);
    return path;
  }
  /// A preset by name, or a file.
  std::string sensor(const YamlMap& map, const std::string& usual) {
    if (map.find("sensor") == nullptr) return usual;
    const std::string name = map.text("sensor");
    std::error_code ignored;
    return fs::is_regular_file(folder_ / name, ignored) ? file(name) : name;
  }

  ParameterValues parameters(const YamlNode& node, const std::string& field) const {
    const YamlMap map(node, path_, field);
    ParameterValues values;
    for (const YamlMap::Entry& entry : map.entries()) {
      const double value =
          static_cast<double>(io::yaml_number(entry.value, path_, map.field(entry.key)));
      values.emplace_back(entry.key, value);
    }
    return values;
  }
  /// Values of a sensor's parameters, in SI units.
  ParameterValues values(const YamlNode& node, const std::string& field, TrainShape shape) const {
    ParameterValues result = parameters(node, field);
    for (auto& [name, value] : result) value *= find_parameter(name, shape).si_per_unit;
    return result;
  }

  SimulationOptions simulation_of(const YamlMap& map, std::vector<std::string>& stations) {
    map.allow_only({"sensor", "duration_s", "rate_hz", "noise_angle_deg", "noise_range_m",
                    "quantize", "beam_origin", "rotor", "set", "reported", "scene", "station",
                    "stations", "format"});
    SimulationOptions options;
    options.sensor = sensor(map, kUsualSensor);
    options.duration = number(map, "duration_s", kMostDuration, "s");
    options.rate = number(map, "rate_hz", kMostRate, "Hz");
    options.angle_noise = number(map, "noise_angle_deg", kMostAngle_deg, "deg", kRadiansPerDegree);
    options.range_noise = number(map, "noise_range_m", kMostDistance, "m");
    options.quantize = map.yes("quantize", true);
    options.beam_origin = map.yes("beam_origin", true);
    if (map.find("rotor") != nullptr) {
      options.rotor =
          simulation::rotor_kind_from(choice(map, "rotor", simulation::rotor_kind_names()));
    }
    const TrainShape shape = load_result(options.sensor).shape();
    if (const auto* set = map.find("set")) options.set = values(set->value, "simulate.set", shape);
    if (const auto* reported = map.find("reported")) {
      if (reported->value.scalar == "nominal") {
        options.reported_nominal = true;
      } else {
        options.reported = values(reported->value, "simulate.reported", shape);
      }
    }
    if (map.find("scene") != nullptr) options.scene = file(map.text("scene"));
    if (const auto* several = map.find("stations")) {
      if (!several->value.is_list() || several->value.items.empty()) {
        fail_at(path_, several->line, "simulate.stations: expected a list of names");
      }
      for (const YamlNode& item : several->value.items) {
        stations.push_back(io::yaml_text(item, path_, "a name in simulate.stations"));
      }
    } else {
      stations.push_back(map.find("station") == nullptr ? "" : map.text("station"));
    }
    options.threads = 1;
    return options;
  }

  std::string format_of(const YamlMap& map) const {
    std::vector<std::string> endings = {".nc"};  // without loss
    for (const recordings::WritableFormat& format : recordings::writable_formats()) {
      if (std::find(endings.begin(), endings.end(), format.ending) == endings.end()) {
        endings.push_back(format.ending);
      }
    }
    for (std::string& ending : endings) ending.erase(0, 1);
    return "." + choice(map, "format", endings);
  }

  /// What the two jobs share.
  template <class Job>
  void take_common(const YamlMap& map, const SimulationOptions& simulation, Job& job) {
    job.sensor = sensor(map, "");
    const sensors::Sensor believed =
        load_result(job.sensor.empty() ? simulation.sensor : job.sensor);
    const TrainShape shape = believed.shape();
    if (const auto* fix = map.find("fix")) {
      const std::string field = map.field("fix");
      if (fix->value.is_list()) {
        for (const YamlNode& item : fix->value.items) {
          job.fixed.emplace_back(io::yaml_text(item, path_, "a name in " + field), std::nullopt);
        }
      } else {
        for (auto& [name, value] : values(fix->value, field, shape)) {
          job.fixed.emplace_back(name, value);
        }
      }
    }
    if (const auto* free = map.find("free")) {
      if (!free->value.is_list()) {
        fail_at(path_, free->line, fmt::format("{}: expected a list of names", map.field("free")));
      }
      for (const YamlNode& item : free->value.items) {
        job.additional.push_back(io::yaml_text(item, path_, "a name in " + map.field("free")));
      }
    }
    // Unknown names and values out of bounds are rejected before the first cell.
    sensors::Sensor held = believed;
    hold(job.fixed, held);
    estimation::free_parameters(job.additional, shape);
    job.angle_noise = number(map, "noise_angle_deg", kMostAngle_deg, "deg", kRadiansPerDegree);
    job.rate = number(map, "rate_hz", kMostRate, "Hz");
  }

  EstimateRecordingOptions estimate_of(const YamlMap& map, const SimulationOptions& simulation) {
    map.allow_only({"method", "rate_hz", "sensor", "noise_angle_deg", "fix", "free"});
    EstimateRecordingOptions job;
    take_common(map, simulation, job);
    if (choice(map, "method", {"map", "ekf"}) == "ekf") job.method = estimation::Method::ekf;
    if (!job.rate) job.rate = usual_rate(job.method);
    return job;
  }

  CalibrateRecordingsOptions calibrate_of(const YamlMap& map, const SimulationOptions& simulation,
                                          const std::vector<std::string>& stations) {
    map.allow_only({"method", "rate_hz", "sensor", "noise_angle_deg", "noise_range_m",
                    "beam_origin", "planes", "known_stations", "prior_sigma_deg", "tolerance_deg",
                    "fix", "free"});
    CalibrateRecordingsOptions job;
    take_common(map, simulation, job);
    if (choice(map, "method", {"adjustment", "paper"}) == "paper") {
      job.method = calibration::CalibrationMethod::paper;
    }
    job.range_noise = number(map, "noise_range_m", kMostDistance, "m");
    job.prior_sigma = number(map, "prior_sigma_deg", kMostAngle_deg, "deg", kRadiansPerDegree);
    job.tolerance = number(map, "tolerance_deg", kMostAngle_deg, "deg", kRadiansPerDegree);
    job.beam_origin = map.yes("beam_origin", true);
    if (map.find("planes") != nullptr) job.planes = scenes::load_scene(file(map.text("planes")));
    if (map.yes("known_stations")) {
      job.stations = stations_of(simulation.scene, stations, stations.size());
    }
    return job;
  }

  const std::string& path_;
  fs::path folder_;
  std::map<std::string, std::string> files_;
};

/// A name of the grid with its values.
struct GridAxis {
  std::string name;
  std::size_t line = 0;
  std::vector<YamlNode> values;
};

std::vector<GridAxis> grid_of(const YamlMap& map) {
  std::vector<GridAxis> axes;
  const YamlMap::Entry* entry = map.find("grid");
  if (entry == nullptr) return axes;
  const YamlMap grid(entry->value, map.path(), "grid");
  for (const YamlMap::Entry& axis : grid.entries()) {
    const std::string section = axis.key.substr(0, axis.key.find('.'));
    if (section == axis.key || map.find(section) == nullptr || section == "grid" ||
        section == "seeds") {
      fail_at(map.path(), axis.line,
              fmt::format("{}: expected a name below simulate, estimate or calibrate, such as "
                          "simulate.noise_angle_deg",
                          grid.field(axis.key)));
    }
    if (!axis.value.is_list() || axis.value.items.empty()) {
      fail_at(map.path(), axis.line,
              fmt::format("{}: expected a list of values", grid.field(axis.key)));
    }
    axes.push_back({axis.key, axis.line, axis.value.items});
  }
  return axes;
}

std::uint64_t count_of(const std::vector<GridAxis>& axes, const std::string& path) {
  std::uint64_t count = 1;
  for (const GridAxis& axis : axes) {
    count *= axis.values.size();
    if (count > kMostSettings) {
      fail_at(
          path, axis.line,
          fmt::format("grid: more than {} combinations, which is the most allowed", kMostSettings));
    }
  }
  return count;
}

}  // namespace

std::string grid_words(const GridPoint& grid) {
  std::vector<std::string> parts;
  for (const auto& [name, value] : grid) parts.push_back(fmt::format("{} {}", name, value));
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string CampaignPlan::about(const CampaignSetting& setting, const std::string& message) const {
  const std::string words = grid_words(setting.grid);
  return fmt::format("{}: {}{}{}", path, words, words.empty() ? "" : ": ", message);
}

CampaignCell CampaignPlan::cell(std::uint64_t number) const {
  return {number, static_cast<std::size_t>(number % settings.size()),
          first_seed + number / settings.size()};
}

CampaignPlan load_campaign_plan(const std::string& path, std::uint64_t seed) {
  return parse_campaign_plan(io::read_text_file(path), path, seed);
}

CampaignPlan parse_campaign_plan(const std::string& text, const std::string& path,
                                 std::uint64_t seed) {
  if (seed > kLargestSeed) {
    throw InvalidArgument(
        fmt::format("{} = {}, allowed: 0 to {}", name_of(kSetting.seed), seed, kLargestSeed));
  }
  const YamlNode root = io::parse_yaml(text, path);
  const YamlMap map(root, path, "");
  map.allow_only({"simulate", "estimate", "calibrate", "grid", "seeds"});
  map.at("simulate");
  if ((map.find("estimate") == nullptr) == (map.find("calibrate") == nullptr)) {
    fail_at(path, map.line(),
            "expected either estimate or calibrate: how to process the simulations");
  }
  CampaignPlan plan;
  plan.path = path;
  const YamlMap seeds(map.at("seeds").value, path, "seeds");
  seeds.allow_only({"first", "count"});
  if (seeds.find("first") != nullptr) {
    plan.first_seed =
        static_cast<std::uint64_t>(seeds.integer("first", 0, std::numeric_limits<int>::max()));
  }
  plan.first_seed += seed;
  plan.seeds = static_cast<std::uint64_t>(seeds.integer("count", 1, kMostSeeds));
  const std::vector<GridAxis> axes = grid_of(map);
  const std::uint64_t count = count_of(axes, path);
  PlanReader reader(path);
  std::vector<std::string> work = {fmt::format("seeds {} {}", plan.first_seed, plan.seeds)};
  for (std::uint64_t number = 0; number < count; ++number) {
    YamlNode node = root;
    GridPoint grid;
    std::uint64_t rest = number;
    for (auto axis = axes.rbegin(); axis != axes.rend(); ++axis) {
      const YamlNode& value = axis->values[static_cast<std::size_t>(rest % axis->values.size())];
      rest /= axis->values.size();
      put(node, axis->name, value, path, axis->line);
      grid.emplace(grid.begin(), axis->name, shown(value));
    }
    CampaignSetting setting;
    try {
      setting = reader.setting(node);
    } catch (const InvalidArgument& error) {
      setting.grid = grid;
      throw InvalidArgument(plan.about(setting, error.what()));
    }
    setting.grid = std::move(grid);
    plan.settings.push_back(std::move(setting));
    for (const char* section : {"simulate", "estimate", "calibrate"}) {
      const YamlMap whole(node, path, "");
      if (const auto* entry = whole.find(section)) {
        work.push_back(fmt::format("{} {}", section, canonical(entry->value)));
      }
    }
  }
  for (const auto& [name, file] : reader.files()) {
    plan.files.push_back(file);
    work.push_back(fmt::format("{} {}", name, hashes::sha256_of_file(file)));
  }
  plan.work = hashes::sha256(fmt::format("{}", fmt::join(work, "\n")));
  return plan;
}

}  // namespace risley::jobs
