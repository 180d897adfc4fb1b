// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/preset.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/require.hpp"
#include "risley/core/text.hpp"
#include "risley/io/yaml_covariance.hpp"
#include "risley/io/yaml_map.hpp"
#include "risley/io/yaml_output.hpp"
#include "risley/sensors/prism_sizes.hpp"
#include "risley/sensors/range_values.hpp"

namespace risley::sensors {
namespace {

using io::fail_at;
using io::yaml_number;
using io::yaml_quoted;
using io::yaml_text;
using io::YamlMap;
using io::YamlNode;

constexpr int kSchemaVersion = 1;

/// SI units per file unit. Extended precision, so that a value in degrees exists for every value
/// in radians and reading what was written gives the same bits.
long double scale_of(std::string_view unit) {
  return unit.starts_with("deg") ? std::numbers::pi_v<long double> / 180.0L : 1.0L;
}

double si_from_file(long double value, long double scale) {
  return static_cast<double>(value * scale);
}

/// The shortest decimal that reads as exactly this value.
std::string file_number(double value, long double scale, std::string_view field) {
  if (!std::isfinite(value)) {
    throw InvalidArgument(fmt::format("{} = {}, expected a finite number", field, value));
  }
  return io::yaml_decimal(value, scale);
}

/// A number of a sensor that is not a parameter of the observation model.
struct Specification {
  const char* section;
  const char* name;
  const char* unit;
  double Sensor::*member;
  long double lower, upper;  ///< in the unit of the file
  /// A preset without it has 0 there.
  bool optional = false;
};

constexpr std::array kSpecifications{
    Specification{"noise", "angle_noise_deg", "deg", &Sensor::angle_noise, 0, 10},
    Specification{"noise", "range_noise_m", "m", &Sensor::range_noise, 0, 100},
    Specification{"noise", "range_noise_per_range", "1", &Sensor::range_noise_per_range, 0, 1,
                  true},
    Specification{"noise", "range_noise_incidence_m", "m", &Sensor::range_noise_incidence, 0, 100,
                  true},
    Specification{"noise", "range_noise_weak_return_m", "m", &Sensor::range_noise_weak_return, 0,
                  100, true},
    Specification{"resolution", "angle_resolution_deg", "deg", &Sensor::angle_resolution, 0, 10},
    Specification{"resolution", "range_resolution_m", "m", &Sensor::range_resolution, 0, 10},
    Specification{"limits", "range_minimum_m", "m", &Sensor::range_minimum, 0, 1e5},
    Specification{"limits", "range_maximum_m", "m", &Sensor::range_maximum, 1e-3L, 1e6},
    Specification{"limits", "field_of_view_deg", "deg", &Sensor::field_of_view, 0, 360},
    Specification{"limits", "pointing_tolerance_deg", "deg", &Sensor::pointing_tolerance, 0, 10,
                  true},
    Specification{"rates", "shot_rate_hz", "Hz", &Sensor::shot_rate, 1e-3L, 1e9},
    Specification{"beam", "beam_divergence_horizontal_deg", "deg",
                  &Sensor::beam_divergence_horizontal, 0, 90},
    Specification{"beam", "beam_divergence_vertical_deg", "deg", &Sensor::beam_divergence_vertical,
                  0, 90},
};

/// A preset with this number could not be read again.
void require_specification(const Specification& s, double value) {
  const long double scale = scale_of(s.unit);
  if (value >= si_from_file(s.lower, scale) && value <= si_from_file(s.upper, scale)) return;
  throw InvalidArgument(fmt::format("{} = {:.10g} {}, allowed {:g} to {:g}", s.name,
                                    static_cast<double>(static_cast<long double>(value) / scale),
                                    s.unit, s.lower, s.upper));
}

/// Section names in file order; the section range has a fixed place.
std::vector<std::string_view> section_names() {
  std::vector<std::string_view> names;
  for (const Specification& entry : kSpecifications) {
    if (names.empty() || names.back() != entry.section) names.emplace_back(entry.section);
  }
  return names;
}

/// Of the values that a covariance can name.
io::ScaleOfName covariance_scale(const Sensor& sensor) {
  return [shape = sensor.shape()](const std::string& name) {
    if (is_range_value(name) || find_prism_size(name, shape.prisms)) return 1.0L;
    return scale_of(find_parameter(name, shape).unit);
  };
}

constexpr long double kAnyValue = std::numeric_limits<long double>::infinity();

/// A value of the file with its line.
struct Quantity {
  long double value = 0;
  std::size_t line = 0;
};

/// Reads one {value, unit, sigma, total_sigma, source}; sigma and source come together or not at
/// all, a total sigma only with them.
/// @throws FileError also for a value beyond the limits
Quantity read_quantity(const YamlMap& parent, std::string_view name, std::string_view unit,
                       Sensor& sensor, long double lower = -kAnyValue,
                       long double upper = kAnyValue) {
  const YamlMap map = parent.section(name);
  map.allow_only({"value", "unit", "sigma", "total_sigma", "source"});
  const std::string found_unit = map.text("unit");
  if (found_unit != unit) {
    fail_at(map.path(), map.at("unit").line,
            fmt::format("{} = \"{}\", expected \"{}\"", map.field("unit"), found_unit, unit));
  }
  const YamlMap::Entry& value = map.at("value");
  if (map.find("sigma") != nullptr || map.find("source") != nullptr ||
      map.find("total_sigma") != nullptr) {
    const long double sigma = map.number("sigma", 0.0L, 1e9L, unit);
    const long double total =
        map.find("total_sigma") != nullptr ? map.number("total_sigma", sigma, 1e9L, unit) : 0.0L;
    sensor.set_knowledge({std::string(name), si_from_file(sigma, scale_of(unit)),
                          map.words("source"), si_from_file(total, scale_of(unit))});
  }
  const long double number = yaml_number(value.value, map.path(), map.field("value"));
  if (!(number >= lower && number <= upper)) {
    fail_at(map.path(), value.line,
            fmt::format("{} = {:g} {}, allowed {:g} to {:g}", parent.field(name), number, unit,
                        lower, upper));
  }
  return {number, value.line};
}

std::string rotation_angle_name(int prism) {
  return fmt::format("rotation_angle_{}_deg", prism_letter(prism));
}

void read_parameters(const YamlMap& map, Sensor& sensor) {
  const auto& list = parameter_list(sensor.shape());
  std::vector<const std::string*> owner(static_cast<std::size_t>(parameter_count(sensor.shape())),
                                        nullptr);
  std::vector<bool> has_speed(static_cast<std::size_t>(sensor.prisms()), false);
  for (const YamlMap::Entry& entry : map.entries()) {
    const auto found = std::find_if(list.begin(), list.end(), [&](const ParameterInfo& info) {
      return info.name == entry.key && info.kind != ParameterKind::rotation_angle;
    });
    if (found == list.end()) {
      std::vector<std::string> names(list.size());
      std::transform(list.begin(), list.end(), names.begin(),
                     [](const ParameterInfo& info) { return info.name; });
      fail_at(
          map.path(), entry.line,
          fmt::format("unknown parameter {} of a sensor with {} prisms (face_order {}) and {} "
                      "emitters{}",
                      map.field(entry.key), sensor.prisms(), to_string(sensor.train.face_order()),
                      sensor.train.emitters(), did_you_mean(entry.key, names)));
    }
    const Quantity quantity = read_quantity(map, entry.key, found->unit, sensor);
    double value = si_from_file(quantity.value, scale_of(found->unit));
    // A bound itself may have been rounded the other way.
    for (const double bound : {found->lower, found->upper}) {
      if (std::abs(value - bound) <= 1e-15 * std::abs(bound)) value = bound;
    }
    try {
      check_bounds(*found, value);
    } catch (const InvalidArgument& error) {
      fail_at(map.path(), quantity.line, error.what());
    }
    if (found->kind == ParameterKind::angular_velocity) {
      const auto rotor = static_cast<std::size_t>(found->places.front());
      sensor.angular_velocity[rotor] = value;
      has_speed[rotor] = true;
      continue;
    }
    for (const int place : found->places) {
      const std::string*& taken = owner[static_cast<std::size_t>(place)];
      if (taken != nullptr) {
        fail_at(map.path(), entry.line, fmt::format("{} repeats {}", map.field(entry.key), *taken));
      }
      taken = &entry.key;
      sensor.train.set_place(place, value);
    }
  }
  for (const ParameterInfo& info : list) {
    const auto at = static_cast<std::size_t>(info.places.front());
    const bool missing = (info.kind == ParameterKind::train && owner[at] == nullptr) ||
                         (info.kind == ParameterKind::angular_velocity && !has_speed[at]);
    if (missing) {
      fail_at(map.path(), map.line(), fmt::format("{} is missing", map.field(info.name)));
    }
  }
}

/// Range errors of the sensor; absent values are 0.
void read_range_values(const YamlMap& root, Sensor& sensor) {
  if (root.find("range") == nullptr) return;
  const YamlMap map = root.section("range");
  std::vector<std::string> names;
  for (const RangeValue& known : range_values(sensor.train.emitters())) {
    names.push_back(known.name);
    if (map.find(known.name) == nullptr) continue;
    const Quantity quantity =
        read_quantity(map, known.name, known.unit, sensor, known.lower, known.upper);
    set_range_value(sensor, known.name, static_cast<double>(quantity.value));
  }
  map.allow_only(names);
}

void read_specifications(const YamlMap& root, Sensor& sensor) {
  for (const std::string_view section : section_names()) {
    const YamlMap map = root.section(section);
    std::vector<std::string> names;
    for (const Specification& s : kSpecifications) {
      if (s.section == section) names.emplace_back(s.name);
    }
    map.allow_only(names);
    for (const Specification& s : kSpecifications) {
      if (s.section != section || (s.optional && map.find(s.name) == nullptr)) continue;
      const Quantity quantity = read_quantity(map, s.name, s.unit, sensor, s.lower, s.upper);
      sensor.*s.member = si_from_file(quantity.value, scale_of(s.unit));
    }
  }
  if (sensor.range_minimum >= sensor.range_maximum) {
    fail_at(root.path(), root.at("limits").line,
            fmt::format("limits.range_minimum_m = {:g} m, allowed below range_maximum_m = {:g} m",
                        sensor.range_minimum, sensor.range_maximum));
  }
}

/// Largest thickness and spacing of prisms, m, and the smallest of either: walls determine only
/// combinations of sizes, so that a single one may come out below 0.
constexpr long double kThickest = 1, kWidest = 10, kThinnest = -0.1L;

/// Sizes of the prisms, each kind under its shared name or under the prisms' own.
void read_geometry(const YamlMap& root, Sensor& sensor) {
  const YamlMap map = root.section("geometry");
  const auto own = own_prism_sizes(sensor.prisms());
  std::vector<std::string> read;
  for (const PrismSize& shared : shared_prism_sizes()) {
    const bool is_thickness = !shared.rate.thickness.empty();
    std::vector<double>& values =
        is_thickness ? sensor.geometry.thickness : sensor.geometry.spacing;
    const auto take = [&](const std::string& name) {
      const bool none = sensor.train.layout().reflects();  // beams start at the origin
      const Quantity quantity = read_quantity(map, name, "m", sensor, none ? 0 : kThinnest,
                                              none           ? 0
                                              : is_thickness ? kThickest
                                                             : kWidest);
      values.push_back(static_cast<double>(quantity.value));
      read.push_back(name);
    };
    const bool own_names =
        map.find(shared.name) == nullptr &&
        std::any_of(own.begin(), own.end(), [&](const PrismSize& size) {
          return size.rate.thickness.empty() != is_thickness && map.find(size.name) != nullptr;
        });
    if (!own_names) {
      take(shared.name);
      continue;
    }
    for (const PrismSize& size : own) {
      if (size.rate.thickness.empty() != is_thickness) take(size.name);
    }
  }
  for (const YamlMap::Entry& entry : map.entries()) {
    if (std::find(read.begin(), read.end(), entry.key) == read.end()) {
      fail_at(
          map.path(), entry.line,
          fmt::format("{}: unknown, or repeats the value for all prisms", map.field(entry.key)));
    }
  }
}

/// combination, the number of the sensor's own one, and combinations, a list of
/// {angular_velocity_deg_per_s: [one per prism], face_order}; the latter may be missing.
void read_combinations(const YamlMap& root, Sensor& sensor) {
  if (root.find("combination") == nullptr) {
    if (root.find("combinations") != nullptr) {
      fail_at(
          root.path(), root.at("combinations").line,
          "combination is missing: it must say to which of the combinations the parameters belong");
    }
    return;
  }
  if (root.find("combinations") == nullptr) {
    if (sensor.prisms() != 2) {
      fail_at(root.path(), root.at("combination").line,
              fmt::format("combination without a list of combinations is for sensors with 2 "
                          "prisms, this one has {}",
                          sensor.prisms()));
    }
    sensor.combination = root.integer("combination", 1, 2);
    return;
  }
  const YamlMap::Entry& list = root.at("combinations");
  constexpr std::size_t kMost = 16;
  if (!list.value.is_list() || list.value.items.size() < 1 || list.value.items.size() > kMost) {
    fail_at(root.path(), list.line,
            fmt::format("combinations: expected a list of 1 to {} combinations", kMost));
  }
  for (const YamlNode& node : list.value.items) {
    const std::string field = fmt::format("combinations[{}]", sensor.combinations.size());
    const YamlMap map(node, root.path(), field);
    map.allow_only({"angular_velocity_deg_per_s", "face_order"});
    const YamlMap::Entry& speeds = map.at("angular_velocity_deg_per_s");
    const auto prisms = static_cast<std::size_t>(sensor.prisms());
    if (!speeds.value.is_list() || speeds.value.items.size() != prisms) {
      fail_at(map.path(), speeds.line,
              fmt::format("{}: expected {} numbers, one per prism",
                          map.field("angular_velocity_deg_per_s"), prisms));
    }
    SpeedCombination combination;
    for (std::size_t k = 0; k < prisms; ++k) {
      const std::string name =
          fmt::format("angular_velocity_{}_deg_per_s", prism_letter(static_cast<int>(k)));
      const ParameterInfo& info = find_parameter(name, sensor.shape());
      const double speed = si_from_file(
          yaml_number(speeds.value.items[k], map.path(), map.field("angular_velocity_deg_per_s")),
          scale_of(info.unit));
      try {
        check_bounds(info, speed);
      } catch (const InvalidArgument& error) {
        fail_at(map.path(), speeds.line, fmt::format("{}: {}", field, error.what()));
      }
      combination.angular_velocity.push_back(speed);
    }
    if (map.find("face_order") != nullptr) {
      try {
        combination.face_order = parse_face_order(map.text("face_order"));
      } catch (const InvalidArgument& error) {
        fail_at(map.path(), map.at("face_order").line, fmt::format("{}: {}", field, error.what()));
      }
      if (combination.face_order.size() != prisms) {
        fail_at(map.path(), map.at("face_order").line,
                fmt::format("{}: expected {} prisms", map.field("face_order"), prisms));
      }
    }
    sensor.combinations.push_back(std::move(combination));
  }
  sensor.combination = root.integer("combination", 1, static_cast<int>(sensor.combinations.size()));
}

std::string swing_name(int prism) { return fmt::format("swing_{}_deg_per_s", prism_letter(prism)); }

constexpr int kMostSwings = 1000;

/// The start of the scan: rotation angles, swings, first_shot and firing.
void read_sequence(const YamlMap& root, Sensor& sensor) {
  const YamlMap map = root.section("sequence");
  ScanSequence sequence;
  std::vector<std::string> known{"first_shot", "firing", "swings_per_beat"};
  for (int i = 0; i < sensor.prisms(); ++i) {
    known.push_back(rotation_angle_name(i));
    const Quantity quantity = read_quantity(map, known.back(), "deg", sensor, -360, 360);
    sequence.rotation_angle.push_back(si_from_file(quantity.value, scale_of("deg")));
    known.push_back(swing_name(i));
    if (map.find(known.back()) == nullptr) continue;
    const Quantity swing = read_quantity(map, known.back(), "deg/s", sensor, -1e6, 1e6);
    sequence.swing.resize(static_cast<std::size_t>(sensor.prisms()), 0.0);
    sequence.swing[static_cast<std::size_t>(i)] = si_from_file(swing.value, scale_of("deg/s"));
  }
  map.allow_only(known);
  if (!sequence.swing.empty()) {
    sequence.swings_per_beat = map.integer("swings_per_beat", 1, kMostSwings);
  }
  sequence.first_shot = map.integer("first_shot", 0, 1);
  const std::string firing = map.text("firing");
  if (firing == to_string(Firing::together)) {
    sequence.firing = Firing::together;
  } else if (firing != to_string(Firing::in_turn)) {
    fail_at(map.path(), map.at("firing").line,
            fmt::format("sequence.firing = \"{}\", allowed in_turn, together", firing));
  }
  sensor.sequence = std::move(sequence);
}

/// Writes one quantity with its uncertainty and source.
std::string quantity_text(const Sensor& sensor, std::string_view name, double value,
                          std::string_view unit, const Knowledge* known) {
  const long double scale = scale_of(unit);
  std::string text = fmt::format("  {}: {{value: {}, unit: {}", name,
                                 file_number(value, scale, name), yaml_quoted(unit));
  if (known == nullptr) known = sensor.find_knowledge(name);
  if (known != nullptr) {
    text += fmt::format(", sigma: {}", file_number(known->sigma, scale, name));
    if (known->total_sigma > known->sigma) {
      text += fmt::format(", total_sigma: {}", file_number(known->total_sigma, scale, name));
    }
    text += fmt::format(", source: {}", yaml_quoted(known->source));
  }
  return text + "}\n";
}

std::string parameters_text(const Sensor& sensor) {
  std::string text = "parameters:\n";
  const auto& list = parameter_list(sensor.shape());
  const auto own_of = [&](const ParameterInfo& shared) {
    std::vector<const ParameterInfo*> own;
    if (shared.kind != ParameterKind::train) return own;
    for (const ParameterInfo& info : list) {
      if (&info != &shared && info.kind == ParameterKind::train && info.places.size() == 1 &&
          std::find(shared.places.begin(), shared.places.end(), info.places.front()) !=
              shared.places.end()) {
        own.push_back(&info);
      }
    }
    return own;
  };
  std::vector<std::string_view> written;
  const auto write = [&](const ParameterInfo& info, double value, const Knowledge* known) {
    text += quantity_text(sensor, info.name, value, info.unit, known);
    written.push_back(info.name);
  };
  for (const ParameterInfo& info : list) {
    if (info.kind == ParameterKind::rotation_angle) continue;
    if (std::find(written.begin(), written.end(), info.name) != written.end()) continue;
    const double value = sensor.get(info.name);
    const auto own = own_of(info);
    const bool alike = std::all_of(own.begin(), own.end(), [&](const ParameterInfo* each) {
      return sensor.get(each->name) == value && sensor.find_knowledge(each->name) == nullptr;
    });
    if (alike) {
      write(info, value, nullptr);
      for (const ParameterInfo* each : own) written.push_back(each->name);
      continue;
    }
    for (const ParameterInfo* each : own) {
      const Knowledge* known = sensor.find_knowledge(each->name);
      if (known == nullptr) known = sensor.find_knowledge(info.name);
      write(*each, sensor.get(each->name), known);
    }
  }
  return text;
}

/// The number of one of the sensor's combinations.
void require_combination(const Sensor& sensor) {
  if (!sensor.combination) {
    require_length("combinations of a sensor without combination", sensor.combinations.size(), 0);
    return;
  }
  const std::size_t count = sensor.combinations.empty() ? 2 : sensor.combinations.size();
  require_between("combination", *sensor.combination, 1, static_cast<double>(count));
}

std::string combinations_text(const Sensor& sensor) {
  std::string text = "combinations:\n";
  const long double scale = scale_of("deg/s");
  for (const SpeedCombination& combination : sensor.combinations) {
    std::vector<std::string> speeds;
    for (const double speed : combination.angular_velocity) {
      speeds.push_back(file_number(speed, scale, "combinations"));
    }
    text += fmt::format("  - {{angular_velocity_deg_per_s: [{}]", fmt::join(speeds, ", "));
    if (!combination.face_order.empty()) {
      text += fmt::format(", face_order: {}", to_string(combination.face_order));
    }
    text += "}\n";
  }
  return text;
}

std::string geometry_text(const Sensor& sensor) {
  std::string text = "geometry:\n";
  const auto own = own_prism_sizes(sensor.prisms());
  face_positions(sensor.train.face_order(), sensor.geometry);  // refuses other numbers of values
  for (const PrismSize& shared : shared_prism_sizes()) {
    const bool is_thickness = !shared.rate.thickness.empty();
    const std::vector<double>& values =
        is_thickness ? sensor.geometry.thickness : sensor.geometry.spacing;
    const bool own_known = std::any_of(own.begin(), own.end(), [&](const PrismSize& size) {
      return size.rate.thickness.empty() != is_thickness &&
             sensor.find_knowledge(size.name) != nullptr;
    });
    if (values.empty() || (values.size() == 1 && !own_known)) {
      text +=
          quantity_text(sensor, shared.name, values.empty() ? 0.0 : values.front(), "m", nullptr);
      continue;
    }
    std::size_t at = 0;
    for (const PrismSize& size : own) {
      if (size.rate.thickness.empty() == is_thickness) continue;
      text += quantity_text(sensor, size.name, values[at++], "m", nullptr);
    }
  }
  return text;
}

/// The section range, or nothing if all of it is 0 and unknown.
std::string range_text(const Sensor& sensor) {
  require_length_or_none("emitter of range_errors", sensor.range_errors.emitter.size(),
                         static_cast<std::size_t>(sensor.train.emitters()));
  std::string text;
  for (const RangeValue& known : range_values(sensor.train.emitters())) {
    const double value = get_range_value(sensor, known.name);
    if (value == 0.0 && sensor.find_knowledge(known.name) == nullptr) continue;
    require_between(known.name, value, known.lower, known.upper, known.unit);
    text += quantity_text(sensor, known.name, value, known.unit, nullptr);
  }
  return text.empty() ? text : "range:\n" + text;
}

std::string sequence_text(const Sensor& sensor, const ScanSequence& sequence) {
  require_length("rotation_angle of the sequence", sequence.rotation_angle.size(),
                 static_cast<std::size_t>(sensor.prisms()));
  require_length_or_none("swing of the sequence", sequence.swing.size(),
                         static_cast<std::size_t>(sensor.prisms()));
  require_between("first_shot", sequence.first_shot, 0, 1);
  std::string text = "sequence:\n";
  for (int i = 0; i < sensor.prisms(); ++i) {
    text += quantity_text(sensor, rotation_angle_name(i),
                          sequence.rotation_angle[static_cast<std::size_t>(i)], "deg", nullptr);
  }
  for (std::size_t i = 0; i < sequence.swing.size(); ++i) {
    text +=
        quantity_text(sensor, swing_name(static_cast<int>(i)), sequence.swing[i], "deg/s", nullptr);
  }
  if (!sequence.swing.empty()) {
    require_between("swings_per_beat", sequence.swings_per_beat, 1, kMostSwings);
    text += fmt::format("  swings_per_beat: {}\n", sequence.swings_per_beat);
  }
  return text + fmt::format("  first_shot: {}\n  firing: {}\n", sequence.first_shot,
                            to_string(sequence.firing));
}

}  // namespace

Sensor parse_preset(const std::string& text, const std::string& path) {
  const YamlMap root(io::parse_yaml(text, path), path, "");
  if (root.find("risley_preset") == nullptr) {
    fail_at(path, root.line(), "is not a sensor preset: risley_preset is missing");
  }
  root.integer("risley_preset", kSchemaVersion, kSchemaVersion);
  root.allow_only({"risley_preset", "name",        "manufacturer", "model",
                   "serial",        "face_order",  "emitters",     "combination",
                   "combinations",  "device_type", "parameters",   "noise",
                   "resolution",    "limits",      "range",        "rates",
                   "beam",          "geometry",    "sequence",     "calibrated_against",
                   "covariance",    "provenance"});
  Sensor sensor;
  sensor.name = root.text("name");
  sensor.manufacturer = root.text("manufacturer");
  sensor.model = root.text("model");
  if (root.find("serial") != nullptr) sensor.serial = root.text("serial");
  try {
    const int emitters =
        root.find("emitters") == nullptr ? 1 : root.integer("emitters", 1, kMaxEmitters);
    sensor.train = PrismTrain(parse_face_order(root.text("face_order")), emitters);
  } catch (const InvalidArgument& error) {
    fail_at(path, root.at("face_order").line, fmt::format("face_order: {}", error.what()));
  }
  sensor.angular_velocity.assign(static_cast<std::size_t>(sensor.prisms()), 0.0);
  read_combinations(root, sensor);
  sensor.device_type = root.integer("device_type", 0, 255);
  read_parameters(root.section("parameters"), sensor);
  read_specifications(root, sensor);
  read_range_values(root, sensor);
  read_geometry(root, sensor);
  if (root.find("sequence") != nullptr) read_sequence(root, sensor);
  if (root.find("calibrated_against") != nullptr) {
    const std::string against = root.text("calibrated_against");
    if (against == to_string(CalibrationReference::directions)) {
      sensor.reference = CalibrationReference::directions;
    } else if (against == to_string(CalibrationReference::planes)) {
      sensor.reference = CalibrationReference::planes;
    } else {
      fail_at(path, root.at("calibrated_against").line,
              fmt::format("calibrated_against = \"{}\", allowed directions, planes", against));
    }
  }
  if (root.find("covariance") != nullptr) {
    algebra::NamedCovariance found = io::read_covariance(root, covariance_scale(sensor));
    sensor.covariance_names = std::move(found.names);
    sensor.covariance = std::move(found.matrix);
  }
  if (root.find("provenance") != nullptr) {
    const YamlMap provenance = root.section("provenance");
    for (const YamlMap::Entry& entry : provenance.entries()) {
      sensor.provenance.emplace_back(entry.key, provenance.text(entry.key));
    }
  }
  return sensor;
}

std::string preset_text(const Sensor& sensor) {
  require_combination(sensor);
  std::string text = fmt::format("risley_preset: {}\nname: {}\nmanufacturer: {}\nmodel: {}\n",
                                 kSchemaVersion, yaml_quoted(sensor.name),
                                 yaml_quoted(sensor.manufacturer), yaml_quoted(sensor.model));
  if (!sensor.serial.empty()) text += fmt::format("serial: {}\n", yaml_quoted(sensor.serial));
  text += fmt::format("face_order: {}\n", to_string(sensor.train.face_order()));
  if (sensor.train.emitters() > 1) text += fmt::format("emitters: {}\n", sensor.train.emitters());
  if (sensor.combination) {
    text += fmt::format("combination: {}\n", *sensor.combination);
  }
  if (!sensor.combinations.empty()) text += combinations_text(sensor);
  text += fmt::format("device_type: {}\n", sensor.device_type);
  text += parameters_text(sensor);
  for (const std::string_view section : section_names()) {
    std::string fields;
    for (const Specification& s : kSpecifications) {
      if (s.section != section) continue;
      if (s.optional && sensor.*s.member == 0.0 && sensor.find_knowledge(s.name) == nullptr) {
        continue;
      }
      require_specification(s, sensor.*s.member);
      fields += quantity_text(sensor, s.name, sensor.*s.member, s.unit, nullptr);
    }
    if (!fields.empty()) text += fmt::format("{}:\n{}", section, fields);
    if (section == "noise") text += range_text(sensor);
  }
  text += geometry_text(sensor);
  if (sensor.sequence) text += sequence_text(sensor, *sensor.sequence);
  if (sensor.reference != CalibrationReference::none) {
    text += fmt::format("calibrated_against: {}\n", to_string(sensor.reference));
  }
  if (!sensor.covariance_names.empty()) {
    text +=
        io::covariance_text({sensor.covariance_names, sensor.covariance}, covariance_scale(sensor));
  }
  if (!sensor.provenance.empty()) {
    text += "provenance:\n";
    for (const auto& [key, value] : sensor.provenance) {
      text += fmt::format("  {}: {}\n", yaml_quoted(key), yaml_quoted(value));
    }
  }
  return text;
}

}  // namespace risley::sensors
