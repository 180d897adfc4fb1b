// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/sensor_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numeric>
#include <set>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/recordings/plausibility.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::jobs {
namespace {

using estimation::AngleSeries;
using estimation::BeamSource;
using estimation::SensorMatch;
using estimation::SensorRecognition;
using sensors::Sensor;

/// A variant of a sensor's optics is tried if the residuals of the original are this many times the
/// noise and the recording's rounding, and used if it leaves this share of them.
constexpr double kPoorOptics = 3.0, kBetterOptics = 0.5;
/// Times are wrong if counted shots leave this share of their residuals.
constexpr double kBetterCounted = 0.5;
/// Fewer shots do not fill a field of view.
constexpr std::size_t kFewestInField = 1000;
/// The emitters' firing order covers the rest; smaller rolls are within the emitters' tolerance. In
/// a sensor that scans all around they are a few degrees beside the axis, and shots without a
/// return shift the means used to find them: a quarter of the circle can cause up to 25 degrees.
constexpr double kLeastRoll = radians_from_degrees(20.0);
constexpr double kLeastRollAllAround = radians_from_degrees(45.0);

/// The built-in presets of the sensor types, which have the names of their models; those of single
/// units, of reversed rotors and of the manufacturer's sequences have other names.
std::vector<Sensor> type_presets() {
  std::vector<Sensor> result;
  for (const std::string& name : sensors::builtin_preset_names()) {
    Sensor sensor = sensors::load_sensor(name);
    if (name == lower_case(sensor.model)) result.push_back(std::move(sensor));
  }
  return result;
}

/// Built-in presets of the same type with other face orders.
std::vector<Sensor> variants_of(const Sensor& sensor) {
  std::vector<Sensor> result;
  for (const std::string& name : sensors::builtin_preset_names()) {
    Sensor other = sensors::load_sensor(name);
    if (other.device_type == sensor.device_type &&
        other.train.face_order() != sensor.train.face_order()) {
      result.push_back(std::move(other));
    }
  }
  return result;
}

FirstShots first_shots(const recordings::Source& source, const recordings::ReadOptions& reading,
                       std::span<const Sensor> candidates, const Progress& progress) {
  FirstShots shots;
  shots.head = first_second(source, reading, progress);
  if (!reading.shot_rate) return shots;
  const std::vector<std::uint8_t>& beam = shots.head.beam;
  if (std::any_of(beam.begin(), beam.end(), [](std::uint8_t one) { return one != 0; })) {
    return shots;
  }
  int emitters = 1;  // if every candidate's fire in turn
  for (const Sensor& sensor : candidates) emitters = std::lcm(emitters, sensor.train.emitters());
  shots.beams = BeamSource::counted;
  for (std::size_t i = 0; i < shots.head.size(); ++i) {
    const double shot = 1e-9 * static_cast<double>(shots.head.time_ns[i]) * *reading.shot_rate;
    shots.head.beam[i] = static_cast<std::uint8_t>(std::llround(shot) % emitters);
  }
  return shots;
}

/// Empty if there are too few shots.
std::optional<SensorRecognition> recognised(FirstShots& shots, std::span<const Sensor> candidates) {
  try {
    return estimation::recognise_sensor(shots.head, candidates, shots.beams, &shots.found);
  } catch (const EstimationError&) {
    return std::nullopt;
  }
}

double misfit_of(const SensorMatch& match) { return match.residual.value_or(match.misfit); }

std::string misfit_text(double misfit) {
  return std::isfinite(misfit) ? fmt::format("{:.3g} deg", degrees_from_radians(misfit))
                               : "no lines at all";
}

std::vector<PresetMisfit> best_two(const SensorRecognition& found,
                                   std::span<const Sensor> candidates) {
  std::vector<PresetMisfit> misfits;
  for (const SensorMatch& match : found.matches) {
    if (misfits.size() < 2) {
      misfits.push_back({candidates[match.candidate].name, misfit_of(match)});
    }
  }
  return misfits;
}

/// Records a recognition's best match; the caller adds the words.
void take(const SensorRecognition& found, std::span<const Sensor> candidates,
          SensorChoice& choice) {
  const SensorMatch& best = found.matches.front();
  choice.sensor = candidates[best.candidate];
  choice.fits = found.fits;
  choice.order = best.order;
  choice.frame = best.frame;
  const bool all_around = choice.sensor.train.layout().axis_up;
  if (std::abs(best.roll) > (all_around ? kLeastRollAllAround : kLeastRoll)) {
    choice.roll = best.roll;
  }
  choice.misfits = best_two(found, candidates);
}

std::string comparison(const std::vector<PresetMisfit>& misfits) {
  std::string text = fmt::format("{} leaves {}", misfits[0].preset, misfit_text(misfits[0].misfit));
  if (misfits.size() > 1) {
    text +=
        fmt::format(", the next one, {}, {}", misfits[1].preset, misfit_text(misfits[1].misfit));
  }
  return text;
}

/// Replaces the type's preset by a variant if the shots leave no doubt.
void try_variants(FirstShots& shots, SensorChoice& choice) {
  const std::vector<Sensor> variants = variants_of(choice.sensor);
  if (variants.empty()) return;
  const auto residual = [&](const Sensor& sensor) {
    return estimation::start_residual(shots.head, sensor, choice.order, shots.beams, &shots.found);
  };
  const auto own = residual(choice.sensor);
  const double rounding = std::sqrt(shots.head.zenith_rounding_variance[shots.head.size() / 2]);
  if (!own || *own < kPoorOptics * std::hypot(choice.sensor.angle_noise, rounding)) return;
  for (const Sensor& variant : variants) {
    const auto other = residual(variant);
    if (!other || !(*other < kBetterOptics * *own)) continue;
    choice.misfits = {{variant.name, *other}, {choice.sensor.name, *own}};
    choice.sensor = variant;
    choice.words = "recognised from the scan: " + comparison(choice.misfits);
    return;
  }
}

void call_it_a_guess(SensorChoice& choice, const std::string& why) {
  choice.chosen_by = ChosenBy::guess;
  choice.words = why;
  warn(choice.warnings, kWarning.sensor_guessed,
       "the file does not say which sensor recorded it: {} is a guess, {}; {} decides it",
       choice.sensor.name, why, name_of(kSetting.sensor));
}

/// Source of a calibration's values; empty for other presets.
std::string origin_of(const Sensor& sensor) {
  if (sensor.reference == sensors::CalibrationReference::none) return {};
  std::string text = sensor.reference == sensors::CalibrationReference::planes ? ", a calibration"
                                                                               : ", an estimate";
  for (const auto& [name, value] : sensor.provenance) {
    if (name == "input") text += " from " + value;
  }
  return text;
}

/// Fallback if shots did not decide: the best fit, the field of view, or the default.
void guess(const FirstShots& shots, const std::optional<SensorRecognition>& found,
           std::span<const Sensor> candidates, SensorChoice& choice) {
  if (found && found->fits) {
    take(*found, candidates, choice);
    call_it_a_guess(choice,
                    "others describe the shots nearly as well: " + comparison(choice.misfits));
    return;
  }
  std::optional<std::size_t> place;
  if (shots.head.size() >= kFewestInField) {
    place = estimation::smallest_field(shots.head, candidates, shots.beams);
  }
  if (place) {
    choice.sensor = candidates[*place];
    if (!found) {
      call_it_a_guess(choice, "by the field of view alone");
      return;
    }
  } else {
    choice.sensor = sensors::load_sensor(kUsualSensor);
    if (!found) {
      choice.fits = false;
      call_it_a_guess(choice, "because the scan does not show it");
      return;
    }
  }
  choice.chosen_by = ChosenBy::guess;
  choice.fits = false;
  choice.misfits = best_two(*found, candidates);
  choice.words = "no built-in preset describes the scan: " + comparison(choice.misfits);
  warn(choice.warnings, kWarning.sensor_unknown,
       "{}; {} is assumed. {} names the sensor, by a preset or a calibration file; identify can "
       "find the prisms of an unknown sensor",
       choice.words, choice.sensor.name, name_of(kSetting.sensor));
}

std::string span_text(double from, double to) {
  return fmt::format("{:.0f}", degrees_from_radians(to - from));
}

/// Possible sources of shots beyond the field of view of every sensor.
/// @param lines  of emitters named in the file
std::string wide_words(const recordings::DirectionSpread& spread, int lines) {
  constexpr int kMostEmitters = 6;  // of sensors with prisms
  if (lines > kMostEmitters) {
    return fmt::format("those of a spinning lidar of {} lines or more, which has no prisms to find",
                       lines);
  }
  struct Wide {
    const char* name;
    double azimuth_deg, zenith_deg;
    double least;  ///< share of the azimuths that is rarely occluded
    const char* why_not;
  };
  static constexpr std::array kWide{
      Wide{"Mid-360", 360.0, 59.0, 0.35,
           "without the traces of its rotors, which motion corrected or sorted clouds lack"},
      Wide{"HAP", 120.0, 25.0, 0.8, "for which there is no built-in preset"}};
  constexpr double kMore_deg = 3.0, kLeastZenith = 0.7;
  const double azimuth_deg = degrees_from_radians(spread.azimuth_to - spread.azimuth_from),
               zenith_deg = degrees_from_radians(spread.zenith_to - spread.zenith_from);
  for (const Wide& wide : kWide) {
    const auto fits = [](double found, double field, double least) {
      return found < field + kMore_deg && found > least * field;
    };
    if (!fits(azimuth_deg, wide.azimuth_deg, wide.least) ||
        !fits(zenith_deg, wide.zenith_deg, kLeastZenith)) {
      continue;
    }
    return fmt::format("those of a {} ({:.0f} x {:.0f} deg), {}", wide.name, wide.azimuth_deg,
                       wide.zenith_deg, wide.why_not);
  }
  return "merged clouds of several sensors: record or export each of them by itself";
}

/// Warns if most ranges are shorter than the sensor's minimum.
std::string too_near_words(const AngleSeries& shots, const Sensor& sensor) {
  std::size_t returns = 0, below = 0;
  for (const double range : shots.range) {
    if (!(range > 0)) continue;
    ++returns;
    if (range < sensor.range_minimum) ++below;
  }
  if (2 * below <= returns) return {};
  return fmt::format(
      "{:.0f} % of the ranges are shorter than the {:g} m from which a {} measures: check their "
      "unit",
      100.0 * static_cast<double>(below) / static_cast<double>(returns), sensor.range_minimum,
      sensor.name);
}

/// States why no sensor can be the source of the shots, if that is so.
/// @param lines  of emitters named in the file
std::string impossible_words(FirstShots& first, std::span<const Sensor> candidates, int lines) {
  const AngleSeries& shots = first.head;
  if (shots.size() < recordings::kFewestJudged) return {};
  const double radius = recordings::cone_radius(shots.azimuth, shots.zenith);
  if (const auto problem = recordings::not_a_scan(radius, shots.size(), shots.range)) {
    return *problem;
  }
  constexpr double kMargin = radians_from_degrees(10.0);
  std::vector<Sensor> wide_enough;
  for (const Sensor& sensor : candidates) {
    const double field = sensor.field_of_view;
    if (!(field > 0) || radius < 0.5 * field + kMargin) wide_enough.push_back(sensor);
  }
  if (candidates.size() == 1 && !wide_enough.empty()) return {};
  // A sensor that scans all around contains every scan: its rotors must show, too.
  const bool all_around =
      std::all_of(wide_enough.begin(), wide_enough.end(),
                  [](const Sensor& sensor) { return sensor.train.layout().axis_up; });
  if (!all_around) return {};
  if (!wide_enough.empty()) {
    const auto found = recognised(first, wide_enough);
    if (found && found->fits) return {};
  }
  const recordings::DirectionSpread spread =
      recordings::direction_spread(shots.azimuth, shots.zenith);
  return fmt::format(
      "directions span {} x {} deg (azimuth, zenith), more than the field of view of {}: they are "
      "probably {}",
      span_text(spread.azimuth_from, spread.azimuth_to),
      span_text(spread.zenith_from, spread.zenith_to),
      candidates.size() == 1 ? candidates.front().name
                             : "any built-in preset whose rotors show in them",
      wide_words(spread, lines));
}

/// Checks the first shots before choosing a sensor. @return whether a sensor can be the source
bool are_possible(FirstShots& shots, std::span<const Sensor> candidates, SensorChoice& choice) {
  if (shots.beams == BeamSource::recorded) {
    for (const std::uint8_t beam : shots.head.beam) choice.lines = std::max(choice.lines, beam + 1);
  }
  choice.impossible = impossible_words(shots, candidates, choice.lines);
  if (choice.impossible.empty()) return true;
  choice.chosen_by = ChosenBy::guess;
  choice.fits = false;
  choice.words = choice.impossible;
  return false;
}

/// Tries the shot rates of the presets, because the recording has no times.
SensorChoice choose_without_times(const recordings::Source& source, recordings::ReadOptions reading,
                                  std::span<const Sensor> candidates, FirstShots& shots,
                                  const Progress& progress) {
  SensorChoice choice;
  std::set<double> rates;
  for (const Sensor& sensor : candidates) rates.insert(sensor.shot_rate);
  double least = std::numeric_limits<double>::infinity();
  for (const double rate : rates) {
    std::vector<Sensor> some;
    std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(some),
                 [rate](const Sensor& sensor) { return sensor.shot_rate == rate; });
    reading.shot_rate = rate;
    shots = first_shots(source, reading, some, progress);
    if (!are_possible(shots, candidates, choice)) {
      choice.sensor = sensors::load_sensor(kUsualSensor);
      return choice;
    }
    const auto found = recognised(shots, some);
    if (!found || !found->fits || misfit_of(found->matches.front()) >= least) continue;
    least = misfit_of(found->matches.front());
    take(*found, some, choice);
    choice.words =
        fmt::format("if it fired {:.6g} shots per second: {}", rate, comparison(choice.misfits));
  }
  if (std::isfinite(least)) {
    call_it_a_guess(choice, choice.words);
  } else {
    guess(shots, std::nullopt, candidates, choice);
  }
  return choice;
}

/// Whether counting shots at a rate would give their recorded times.
bool are_as_counted(const AngleSeries& shots, double rate) {
  constexpr double kOtherRate = 0.02;
  if (shots.size() < 2) return false;
  return std::abs(static_cast<double>(shots.size() - 1) / (shots.duration() * rate) - 1.0) <
         kOtherRate;
}

/// Whether counted shots fit one of some sensors of one shot rate better than the recorded times:
/// these are wrong then.
/// @param misfit  with the recorded times, rad
/// @param count  returns the first shots as counted at that rate
template <class Count>
bool is_at_fault_by_count(std::span<const Sensor> some, double misfit, Count&& count,
                          SensorChoice& choice) {
  FirstShots counted = count();
  const auto found = recognised(counted, some);
  if (!found || !found->fits || misfit_of(found->matches.front()) > kBetterCounted * misfit) {
    return false;
  }
  take(*found, some, choice);
  choice.times_at_fault = true;
  warn(choice.warnings, kWarning.times_corrected,
       "the times of the recording are wrong: with them its scan does not match a {}, but counted "
       "at {:.6g} shots per second it does",
       choice.sensor.model, choice.sensor.shot_rate);
  return true;
}

/// The type named in a file, and whether the shots contradict it.
/// @param types  returns the presets of all types
/// @param count  returns the first shots as counted at the rate of that type
template <class Types, class Count>
SensorChoice choose_by_name(FirstShots& shots, const Sensor& named, Types&& types, Count&& count) {
  SensorChoice choice;
  choice.sensor = named;
  const auto alone = recognised(shots, {&named, 1});
  if (alone) take(*alone, {&named, 1}, choice);
  choice.chosen_by = ChosenBy::file;
  choice.words = "named by the file";
  if (!alone || !alone->fits) {
    const double misfit =
        alone ? misfit_of(alone->matches.front()) : std::numeric_limits<double>::infinity();
    if (is_at_fault_by_count({&named, 1}, misfit, count, choice)) return choice;
  }
  const bool by_lines = alone && alone->decided && !alone->matches.front().residual;
  if (!alone || by_lines) return choice;
  const std::span<const Sensor> candidates = types();
  const auto found = recognised(shots, candidates);
  if (!found || !found->decided) return choice;
  const SensorMatch& best = found->matches.front();
  if (candidates[best.candidate].name == named.name) return choice;
  if (is_at_fault_by_count({&named, 1}, misfit_of(best), count, choice)) return choice;
  choice.fits = false;
  choice.misfits = {{candidates[best.candidate].name, misfit_of(best)}};
  for (const SensorMatch& match : found->matches) {
    if (candidates[match.candidate].name != named.name) continue;
    choice.misfits.push_back({named.name, misfit_of(match)});
  }
  warn(choice.warnings, kWarning.sensor_contradicted,
       "the file names a {}, but its scan matches a {}: {}; {} decides", named.model,
       candidates[found->matches.front().candidate].model, comparison(choice.misfits),
       name_of(kSetting.sensor));
  return choice;
}

/// @param[out] shots  the first ones, where they were looked at
SensorChoice choose(const recordings::Source& source, const recordings::ReadOptions& reading,
                    const recordings::RecordingHeader& header, const std::optional<Sensor>& given,
                    FirstShots& shots, const Progress& progress) {
  SensorChoice choice;
  const bool has_times = header.has_times || reading.shot_rate;
  const bool one_sensor = header.devices.size() == 1;
  if (given) {
    choice.sensor = *given;
    choice.words = "as asked for" + origin_of(*given);
    if (!has_times || !one_sensor) return choice;
    shots = first_shots(source, reading, {&*given, 1}, progress);
    if (!are_possible(shots, {&*given, 1}, choice) || given->train.emitters() == 1) return choice;
    if (const auto found = recognised(shots, {&*given, 1})) take(*found, {&*given, 1}, choice);
    return choice;
  }
  std::vector<Sensor> all;  // takes a while to read
  const auto candidates = [&all]() -> std::span<const Sensor> {
    if (all.empty()) all = type_presets();
    return all;
  };
  const recordings::Device& device = header.devices.front();
  std::optional<Sensor> named;
  if (device.type != recordings::kUnknownDeviceType) {
    named = preset_of_type(device.type);
    if (!named) {
      throw InvalidArgument(
          fmt::format("this needs the optics of a {}, which are not known; info and convert read "
                      "its recordings without them; {} names a preset or calibration of its optics",
                      recordings::device_type_name(device.type), name_of(kSetting.sensor)));
    }
  }
  if (named && (!has_times || !one_sensor)) {
    choice.sensor = *named;
    choice.chosen_by = ChosenBy::file;
    choice.words = "named by the file";
    return choice;
  }
  if (!has_times) return choose_without_times(source, reading, candidates(), shots, progress);
  if (one_sensor) {
    // Counted beams may be those of any sensor.
    shots = first_shots(source, reading,
                        reading.shot_rate ? candidates() : std::span<const Sensor>(), progress);
  }
  const bool named_may = named && are_possible(shots, {&*named, 1}, choice);
  if (!named_may && !are_possible(shots, candidates(), choice = {})) {
    choice.sensor = named ? *named : sensors::load_sensor(kUsualSensor);
    if (named) choice.chosen_by = ChosenBy::file;
    return choice;
  }
  const auto count = [&] {
    if (reading.shot_rate || are_as_counted(shots.head, named->shot_rate)) return FirstShots{};
    recordings::ReadOptions counting = reading;
    counting.shot_rate = named->shot_rate;
    return first_shots(source, counting, {&*named, 1}, progress);
  };
  if (named && !device.type_inferred) {
    const int lines = choice.lines;
    choice = choose_by_name(shots, *named, candidates, count);
    choice.lines = lines;
    return choice;
  }
  const auto found = recognised(shots, candidates());
  const Sensor* const best =
      found && found->decided ? &candidates()[found->matches.front().candidate] : nullptr;
  if (named && best != nullptr &&
      best->shot_rate != named->shot_rate) {  // the rate within packets and messages is another one
    std::vector<Sensor> some;
    std::copy_if(all.begin(), all.end(), std::back_inserter(some),
                 [&](const Sensor& sensor) { return sensor.shot_rate == named->shot_rate; });
    choice.chosen_by = ChosenBy::scan;
    choice.words = "recognised from the scan, where shots are counted";
    if (is_at_fault_by_count(some, misfit_of(found->matches.front()), count, choice)) return choice;
  }
  if (found && found->decided) {
    take(*found, all, choice);
    choice.chosen_by = ChosenBy::scan;
    choice.words = "recognised from the scan: " + comparison(choice.misfits);
    try_variants(shots, choice);
  } else if (named) {
    choice.sensor = *named;
    choice.chosen_by = ChosenBy::file;
    choice.words = "by the rates, tags and returns of the file";
  } else {
    guess(shots, found, all, choice);
    if (choice.fits != true && one_sensor && !reading.shot_rate && header.packet_shots == 0) {
      SensorChoice counted = choose_without_times(source, reading, all, shots, progress);
      if (counted.fits != true) return choice;
      choice = std::move(counted);
      choice.times_at_fault = true;
      warn(choice.warnings, kWarning.times_corrected,
           "the times of the recording are wrong: with them no built-in preset describes its scan; "
           "counted at {:.6g} shots per second, {} does",
           choice.sensor.shot_rate, choice.sensor.name);
    }
  }
  return choice;
}

}  // namespace

std::string sensor_name(const recordings::RecordingHeader& header) {
  std::vector<std::string> names;
  for (const recordings::Device& device : header.devices) {
    const std::string name = recordings::device_type_name(device.type);
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string sensor_name(const SensorChoice& choice) {
  const bool unknown = choice.chosen_by == ChosenBy::guess && choice.fits == false;
  return unknown ? "unknown"
                 : fmt::format("{} {}", choice.sensor.manufacturer, choice.sensor.model);
}

std::string to_string(ChosenBy chosen_by) {
  switch (chosen_by) {
    case ChosenBy::option:
      return "option";
    case ChosenBy::file:
      return "file";
    case ChosenBy::scan:
      return "scan";
    case ChosenBy::guess:
      break;
  }
  return "guess";
}

AngleSeries first_second(const recordings::Source& source, const recordings::ReadOptions& options,
                         const Progress& progress) {
  // One shot per second, and all of the head.
  estimation::ShotSelector selector({.rate = 1.0, .ranges = true, .rows = false});
  const auto reader = recordings::open_recording(source, options, progress);
  recordings::Chunk chunk;
  while (selector.series().size() < 2 && reader->read_sound(chunk)) {
    selector.add(chunk.observations);
    progress.check();
  }
  return selector.head();
}

std::optional<Sensor> preset_of_type(int device_type) {
  const auto* type = recordings::livox_type(static_cast<std::uint8_t>(device_type));
  if (type == nullptr) return std::nullopt;
  // The optics of some types are unknown.
  const std::string name = lower_case(std::string(type->name));
  const auto known = sensors::builtin_preset_names();
  if (std::find(known.begin(), known.end(), name) == known.end()) return std::nullopt;
  return sensors::load_sensor(name);
}

std::optional<Sensor> given_sensor(const GivenSensor& given) {
  if (given.empty()) return std::nullopt;
  return load_result(given);
}

SensorChoice choose_sensor(const recordings::Source& source, const recordings::ReadOptions& reading,
                           const recordings::RecordingHeader& header,
                           const std::optional<Sensor>& given, const Progress& progress,
                           FirstShots* looked_at) {
  FirstShots own;
  FirstShots& shots = looked_at != nullptr ? *looked_at : own;
  SensorChoice choice = choose(source, reading, header, given, shots, progress);
  // The specified reach is for grey walls.
  constexpr double kOnBrightWalls = 1.5;
  const double reach = kOnBrightWalls * choice.sensor.range_maximum;
  if (!(reach > 0) || !choice.impossible.empty() || sensor_name(choice) == "unknown") return choice;
  choice.beyond_reach =
      recordings::beyond_reach(shots.head.range, reach, choice.sensor.name).value_or("");
  if (choice.beyond_reach.empty()) choice.beyond_reach = too_near_words(shots.head, choice.sensor);
  // The reader reports ranges beyond any sensor's reach.
  if (!choice.beyond_reach.empty() &&
      !recordings::beyond_reach(shots.head.range, recordings::kFarthestReach, "")) {
    choice.warnings.push_back({kWarning.implausible_values, choice.beyond_reach});
  }
  return choice;
}

void require_possible(const SensorChoice& choice, const std::string& recording) {
  if (!choice.impossible.empty()) throw FileError(recording, {}, choice.impossible);
  const int emitters = choice.sensor.train.emitters();
  if (choice.lines <= emitters) return;
  throw InvalidArgument(
      fmt::format("{} names {} lines of emitters, but {} ({}) has {} emitter{}: {} names the "
                  "sensor that made it",
                  recording, choice.lines, choice.sensor.name, choice.words, emitters,
                  emitters == 1 ? "" : "s", name_of(kSetting.sensor)));
}

std::vector<std::string> hold(const HeldParameters& held, Sensor& sensor) {
  std::vector<std::string> names;
  for (const auto& [name, value] : held) {
    const ParameterInfo& parameter = find_parameter(name, sensor.shape());
    if (value) {
      if (parameter.kind != ParameterKind::train) {
        throw InvalidArgument(fmt::format("{} {}: only parameters of the prisms can be held",
                                          name_of(kSetting.fix), name));
      }
      sensor.set(name, *value);
    }
    names.push_back(name);
  }
  return names;
}

}  // namespace risley::jobs
