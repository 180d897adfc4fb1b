// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The scanner definition for HELIOS++: attributes and elements as in its documentation
// (https://github.com/3dgeo-heidelberg/helios, "Scanners and platforms").
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"

#include "jobs/pattern_formats.hpp"

namespace risley::jobs {
namespace {

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

/// Text within a comment, where two consecutive hyphens are not allowed.
std::string commented(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at)) {
    text.replace(at, 2, "- -");
  }
  return text;
}

/// Fifteen digits, and zero for values negligible beside 1.
std::string number(double value) {
  return fmt::format("{:.15g}", std::abs(value) < 1e-15 ? 0.0 : value);
}

std::string comment_of(const sensors::HeliosScanner& scanner, const sensors::Sensor& sensor) {
  std::string text = fmt::format(
      "<!-- The scan pattern of {} by risley. Axes: x right, y forward, z up. The sign of an angle "
      "chooses the face\n       that is inclined: positive the first, negative the second. "
      "Deviation from "
      "the pattern itself: {:.3g} degree (root\n       mean square), {:.3g} at most, over {} "
      "shots; a shot of the pattern at time t is at t {} {:.10g} s here.\n",
      commented(sensor.name), degrees_from_radians(scanner.rms),
      degrees_from_radians(scanner.worst), scanner.compared, scanner.time_lag < 0 ? '-' : '+',
      std::abs(scanner.time_lag));
  if (scanner.incident_beam.size() > 1) {
    text += "       Needs a HELIOS++ that knows the element incidentBeam of channels.\n";
  }
  text += scanner.not_carried.empty() ? "       Nothing is lost.\n" : "       Not carried:\n";
  for (const std::string& one : scanner.not_carried) {
    text += fmt::format("       * {}\n", commented(one));
  }
  return text + "  -->\n";
}

}  // namespace

void put_helios_xml(PatternStream& out) {
  const sensors::Sensor& sensor = out.sensor();
  sensors::HeliosScanner scanner =
      sensors::helios_scanner(sensor, out.result().rows, out.options().scan, out.progress());
  if (sensor.beam_divergence_horizontal != sensor.beam_divergence_vertical) {
    scanner.not_carried.push_back(
        fmt::format("A beam divergence of {:.4g} x {:.4g} degree: the smaller value is written.",
                    degrees_from_radians(sensor.beam_divergence_horizontal),
                    degrees_from_radians(sensor.beam_divergence_vertical)));
  }
  std::string attributes;
  const auto attribute = [&](const std::string& name, const std::string& value) {
    attributes += fmt::format("\n           {:<20} = \"{}\"", name, escaped(value));
  };
  std::string id = sensor.name;
  std::replace_if(
      id.begin(), id.end(), [](char c) { return c == '#' || c == ' ' || c == '"'; }, '_');
  attribute("id", id);
  attribute("name", sensor.model.empty() ? sensor.name
                                         : fmt::format("{} {}", sensor.manufacturer, sensor.model));
  attribute("optics", "risley");
  attribute("accuracy_m", fmt::format("{}", sensor.range_noise));
  if (sensor.beam_divergence_horizontal > 0 && sensor.beam_divergence_vertical > 0) {
    attribute("beamDivergence_rad",
              fmt::format("{:.6g}", std::min(sensor.beam_divergence_horizontal,
                                             sensor.beam_divergence_vertical)));
  }
  attribute("pulseFreqs_Hz", fmt::format("{}", scanner.pulse_frequency));
  attribute("rangeMin_m", fmt::format("{}", sensor.range_minimum));
  attribute("rangeMax_m", fmt::format("{}", sensor.range_maximum));
  attribute("wavelength_nm", fmt::format("{}", kWavelengthNm));
  for (std::size_t k = 0; k < scanner.angle.size(); ++k) {
    attribute(fmt::format("rotorFreq{}_Hz", k + 1), number(scanner.rotor_frequency[k]));
    attribute(fmt::format("angle{}_deg", k + 1), number(degrees_from_radians(scanner.angle[k])));
    attribute(fmt::format("refrIndex{}", k + 1), number(scanner.refractive_index[k]));
  }
  attribute("refrIndex_air", number(scanner.refractive_index_air));

  std::string turns;
  for (const auto& [axis, angle] :
       {std::pair{'y', scanner.turn[0]}, std::pair{'x', scanner.turn[1]},
        std::pair{'z', scanner.turn[2]}}) {
    turns += fmt::format("      <rot axis=\"{}\" angle_deg=\"{}\"/>\n", axis,
                         number(degrees_from_radians(angle)));
  }
  std::string channels;
  const auto is_forward = [](const Vector3<double>& beam) {
    return std::hypot(beam.x, beam.z) < 1e-15;
  };
  if (scanner.incident_beam.size() > 1 || !is_forward(scanner.incident_beam.front())) {
    channels = "    <channels>\n";
    for (std::size_t i = 0; i < scanner.incident_beam.size(); ++i) {
      const Vector3<double>& beam = scanner.incident_beam[i];
      channels += fmt::format(
          "      <channel id=\"{}\">\n        <incidentBeam x=\"{}\" y=\"{}\" z=\"{}\"/>\n"
          "      </channel>\n",
          i, number(beam.x), number(beam.y), number(beam.z));
    }
    channels += "    </channels>\n";
  }
  out.put(fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<document>\n  {}  <scanner{}>\n"
      "    <FWFSettings beamSampleQuality=\"3\"/>\n    <beamOrigin x=\"0\" y=\"0\" z=\"0\">\n{}"
      "    </beamOrigin>\n    <headRotateAxis x=\"0\" y=\"0\" z=\"1\"/>\n{}  </scanner>\n"
      "  <scannerSettings id=\"{}_settings\" active=\"true\" pulseFreq_hz=\"{}\"/>\n</document>\n",
      comment_of(scanner, sensor), attributes, turns, channels, escaped(id),
      scanner.pulse_frequency));
  out.result().not_carried = scanner.not_carried;
  out.result().helios = std::move(scanner);
}

}  // namespace risley::jobs
