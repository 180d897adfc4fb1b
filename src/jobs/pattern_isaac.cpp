// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Lidar profiles of NVIDIA's Isaac Sim: the JSON file of its versions up to 4.5, and the OmniLidar
// prim in USD of those since. Both hold one emitter state, with one emitter for every shot, as for
// solid-state lidars.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "risley/core/angle.hpp"
#include "risley/core/require.hpp"

#include "jobs/pattern_formats.hpp"

namespace risley::jobs {
namespace {

using ValueOfShot = std::function<void(std::string&, const sensors::ScanPattern&, std::size_t)>;

struct EmitterColumn {
  const char* name;
  const char* type;  ///< in USD
  ValueOfShot append;
};

/// One value per shot. Times count from the first shot.
std::vector<EmitterColumn> emitter_columns(double first_time) {
  const auto degrees = [](std::string& text, double angle) {
    fmt::format_to(std::back_inserter(text), "{:.6f}", degrees_from_radians(angle));
  };
  return {
      {"azimuthDeg", "float[]",
       [=](std::string& text, const sensors::ScanPattern& pattern, std::size_t i) {
         degrees(text, pattern.azimuth[i]);
       }},
      {"elevationDeg", "float[]",
       [=](std::string& text, const sensors::ScanPattern& pattern, std::size_t i) {
         degrees(text, 0.5 * kPi - pattern.zenith[i]);
       }},
      {"fireTimeNs", "uint[]",
       [=](std::string& text, const sensors::ScanPattern& pattern, std::size_t i) {
         fmt::format_to(std::back_inserter(text), "{}",
                        std::llround(1e9 * (pattern.time[i] - first_time)));
       }},
      {"channelId", "uint[]",
       [](std::string& text, const sensors::ScanPattern& pattern, std::size_t i) {
         fmt::format_to(std::back_inserter(text), "{}", pattern.emitter[i] + 1);
       }},
  };
}

/// Writes the columns as arrays; blocked shots are dropped.
void put_columns(PatternStream& out, const std::function<std::string(const EmitterColumn&)>& head,
                 const std::string& tail) {
  const double first = sensors::scan_pattern(out.sensor(), 0, 1, out.options().scan).time.front();
  const std::vector<EmitterColumn> columns = emitter_columns(first);
  const int passes = static_cast<int>(columns.size());
  for (int pass = 0; pass < passes; ++pass) {
    const EmitterColumn& column = columns[static_cast<std::size_t>(pass)];
    out.put(head(column));
    bool any = false;
    out.put_rows(
        [&](const sensors::ScanPattern& pattern) {
          std::string text;
          for (std::size_t i = 0; i < pattern.size(); ++i) {
            if (std::isnan(pattern.azimuth[i])) continue;
            if (any) text += ',';
            any = true;
            column.append(text, pattern, i);
          }
          return text;
        },
        pass, passes);
    out.put(pass + 1 < passes ? tail : "]");
  }
}

/// Checks the contents of both forms, and reports what they cannot hold.
void begin(PatternStream& out, bool whole_rate) {
  const double duration = out.options().duration;
  constexpr double kLongest = 4.2;  // nanoseconds are 32-bit numbers
  require_between("duration", duration, 0, kLongest, "s of a format with nanoseconds");
  WrittenPattern& result = out.result();
  result.not_carried = {
      "What follows after the duration: Isaac Sim repeats the same scan.",
      "The sense of azimuths in other versions of Isaac Sim: here they run from X, forward, "
      "towards Y, left. Check with a wall on one side.",
  };
  const double rate = 1 / duration;
  if (whole_rate && (rate < 1 || std::abs(rate - std::round(rate)) > 1e-6 * rate)) {
    result.not_carried.push_back(
        fmt::format("A scan of {:.6g} s: the number of scans per second must be whole.", duration));
  }
}

void end(PatternStream& out) {
  if (out.result().blocked == 0) return;
  out.result().not_carried.push_back(
      fmt::format("{} shots that do not pass through the prisms.", out.result().blocked));
}

double least_echo_distance(const sensors::Sensor& sensor) {
  constexpr double kUsual = 0.4;  // m; more than rangeMin is refused
  return std::min(kUsual, sensor.range_minimum);
}

/// Name of a prim.
std::string prim_name(const std::string& text) {
  std::string name;
  for (const char c : text) {
    name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  }
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name.front())) != 0)
    name = "_" + name;
  return name;
}

}  // namespace

void put_isaac_json(PatternStream& out) {
  begin(out, false);
  const sensors::Sensor& sensor = out.sensor();
  const double rate = 1 / out.options().duration;
  const auto text = [](const std::string& value) { return nlohmann::json(value).dump(); };
  out.put(fmt::format(
      "{{\"class\":\"sensor\",\"type\":\"lidar\",\"name\":{},\"driveWorksId\":\"GENERIC\",\n"
      "\"profile\":{{\"scanType\":\"solidState\",\"intensityProcessing\":\"normalization\","
      "\"rayType\":\"IDEALIZED\",\n\"nearRangeM\":{},\"farRangeM\":{},\"rangeResolutionM\":{},"
      "\"rangeAccuracyM\":{},\"minDistBetweenEchos\":{},\n\"azimuthErrorMean\":0,"
      "\"azimuthErrorStd\":{},\"elevationErrorMean\":0,\"elevationErrorStd\":{},\n"
      "\"wavelengthNm\":{},\"maxReturns\":1,\"scanRateBaseHz\":{},\"reportRateBaseHz\":{},\n"
      "\"intensityMappingType\":\"LINEAR\",\"stateResolutionStep\":1,\"rangeCount\":1,"
      "\"ranges\":[{{\"min\":{},\"max\":{}}}],\n\"emitterStateCount\":1,\"emitterStates\":[{{\n",
      text(sensor.name), sensor.range_minimum, sensor.range_maximum, sensor.range_resolution,
      sensor.range_noise, least_echo_distance(sensor), degrees_from_radians(sensor.angle_noise),
      degrees_from_radians(sensor.angle_noise), kWavelengthNm, rate, rate, sensor.range_minimum,
      sensor.range_maximum));
  put_columns(
      out, [](const EmitterColumn& column) { return fmt::format("\"{}\":[", column.name); },
      "],\n");
  end(out);
  const std::uint64_t emitters = out.result().rows - out.result().blocked;
  nlohmann::json limits(out.result().not_carried);
  out.put(
      fmt::format("}}],\n\"numberOfEmitters\":{0},\"numberOfChannels\":{1},\"numLines\":1,"
                  "\"numRaysPerLine\":[{0}]}},\n\"_not_carried\":{2}}}\n",
                  emitters, sensor.train.emitters(), limits.dump()));
}

void put_isaac_usda(PatternStream& out) {
  begin(out, true);
  const sensors::Sensor& sensor = out.sensor();
  const std::string prim = prim_name(sensor.name);
  const double rate = std::max(1.0, std::round(1 / out.options().duration));
  constexpr const char* kCore = "omni:sensor:Core:";
  std::string doc = fmt::format("The scan pattern of {} by risley. Not carried:", sensor.name);
  for (const std::string& one : out.result().not_carried) doc += " " + one;
  std::replace(doc.begin(), doc.end(), '"', '\'');
  std::replace(doc.begin(), doc.end(), '\\', '/');
  std::string head = fmt::format(
      "#usda 1.0\n(\n    defaultPrim = \"{0}\"\n    doc = \"\"\"{1}\"\"\"\n"
      "    metersPerUnit = 1\n    upAxis = \"Z\"\n)\n\ndef OmniLidar \"{0}\" (\n"
      "    prepend apiSchemas = [\"OmniSensorGenericLidarCoreAPI\", "
      "\"OmniSensorGenericLidarCoreEmitterStateAPI:s001\"]\n)\n{{\n",
      prim, doc);
  const auto attribute = [&](const char* type, const char* name, const std::string& value) {
    head += fmt::format("    {} {}{} = {}\n", type, kCore, name, value);
  };
  const auto number = [](double value) { return fmt::format("{}", value); };
  attribute("token", "scanType", "\"SOLID_STATE\"");
  attribute("token", "elementsCoordsType", "\"CARTESIAN\"");
  attribute("uint", "scanRateBaseHz", number(rate));
  attribute("uint", "reportRateBaseHz", number(rate));
  attribute("float", "nearRangeM", number(sensor.range_minimum));
  attribute("float", "farRangeM", number(sensor.range_maximum));
  attribute("float", "minDistBetweenEchosM", number(least_echo_distance(sensor)));
  attribute("float", "rangeResolutionM", number(sensor.range_resolution));
  attribute("float", "rangeAccuracyM", number(sensor.range_noise));
  attribute("float", "azimuthErrorStd", number(degrees_from_radians(sensor.angle_noise)));
  attribute("float", "elevationErrorStd", number(degrees_from_radians(sensor.angle_noise)));
  attribute("float", "waveLengthNm", number(kWavelengthNm));
  attribute("uint", "maxReturns", "1");
  out.put(head);
  put_columns(
      out,
      [&](const EmitterColumn& column) {
        return fmt::format("    {} {}emitterState:s001:{} = [", column.type, kCore, column.name);
      },
      "]\n");
  end(out);
  const std::uint64_t emitters = out.result().rows - out.result().blocked;
  head = "\n";
  attribute("uint", "numberOfEmitters", fmt::format("{}", emitters));
  attribute("uint", "numberOfChannels", fmt::format("{}", sensor.train.emitters()));
  attribute("uint", "numLines", "1");
  attribute("uint[]", "numRaysPerLine", fmt::format("[{}]", emitters));
  out.put(head + "}\n");
}

}  // namespace risley::jobs
