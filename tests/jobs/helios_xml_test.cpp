// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The scanner files for HELIOS++, read and run by a deflector that was written from its conventions
// alone: x right, y forward, z up; thin edges up at time 0, turning from up to the right where the
// speed is positive; the sign of an angle chooses the face; time advances before it is used.
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <random>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "risley/core/angle.hpp"
#include "risley/jobs/write_pattern.hpp"
#include "risley/sensors/preset.hpp"

#include "refusal.hpp"
#include "source_tree.hpp"

namespace risley::jobs::helios_xml_test {

using ::testing::HasSubstr;
using Three = std::array<double, 3>;

Three times(double s, const Three& a) { return {s * a[0], s * a[1], s * a[2]}; }
Three plus(const Three& a, const Three& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
double product(const Three& a, const Three& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// A file's scanner.
struct Deflector {
  struct Prism {
    double frequency, angle, index;
  };
  std::vector<Prism> prisms;
  double air = 1, pulse_frequency = 0;
  std::vector<Three> beams{{0, 1, 0}};
  std::vector<std::pair<char, double>> turns;  ///< axis and angle, one after another, fixed axes

  explicit Deflector(const std::string& xml) {
    const std::regex attribute("(\\w+)\\s*=\\s*\"([^\"]*)\"");
    const auto attributes = [&](const std::string& element) {
      std::map<std::string, std::string> found;
      for (std::sregex_iterator i(element.begin(), element.end(), attribute), end; i != end; ++i) {
        found[(*i)[1]] = (*i)[2];
      }
      return found;
    };
    const auto elements = [&](const std::string& name) {
      std::vector<std::map<std::string, std::string>> found;
      const std::regex element("<" + name + "\\s([^>]*)>");
      for (std::sregex_iterator i(xml.begin(), xml.end(), element), end; i != end; ++i) {
        found.push_back(attributes((*i)[1]));
      }
      return found;
    };
    auto scanner = elements("scanner").at(0);
    EXPECT_EQ(scanner.at("optics"), "risley");
    for (const char* k : {"1", "2", "3"}) {
      if (!scanner.contains(std::string("angle") + k + "_deg")) break;
      prisms.push_back(
          {std::stod(scanner.at(std::string("rotorFreq") + k + "_Hz")),
           radians_from_degrees(std::stod(scanner.at(std::string("angle") + k + "_deg"))),
           std::stod(scanner.at(std::string("refrIndex") + k))});
    }
    air = std::stod(scanner.at("refrIndex_air"));
    pulse_frequency = std::stoi(scanner.at("pulseFreqs_Hz"));
    EXPECT_EQ(elements("scannerSettings").at(0).at("pulseFreq_hz"), scanner.at("pulseFreqs_Hz"));
    const auto channels = elements("incidentBeam");
    if (!channels.empty()) beams.clear();
    for (const auto& beam : channels) {
      beams.push_back({std::stod(beam.at("x")), std::stod(beam.at("y")), std::stod(beam.at("z"))});
    }
    for (const auto& turn : elements("rot")) {
      turns.emplace_back(turn.at("axis").at(0),
                         radians_from_degrees(std::stod(turn.at("angle_deg"))));
    }
  }

  /// Snell's law for the part of the beam that runs along the face.
  static Three refracted(const Three& beam, const Three& forward_normal, double before,
                         double behind) {
    const Three along = plus(beam, times(-product(beam, forward_normal), forward_normal));
    const Three bent = times(before / behind, along);
    return plus(bent, times(std::sqrt(1 - product(bent, bent)), forward_normal));
  }

  Three direction(double time, std::size_t channel) const {
    Three beam = times(1 / std::sqrt(product(beams[channel], beams[channel])), beams[channel]);
    for (const Prism& prism : prisms) {
      const double turned = kTwoPi * std::fmod(prism.frequency * time, 1.0);
      const Three thin_edge{std::sin(turned), 0, std::cos(turned)};
      const double wedge = std::abs(prism.angle);
      const Three flat{0, 1, 0};
      // The thinner the glass, the farther forward the first face, or the farther back the second.
      const Three first = plus(times(std::cos(wedge), flat), times(-std::sin(wedge), thin_edge));
      const Three second = plus(times(std::cos(wedge), flat), times(std::sin(wedge), thin_edge));
      const bool first_inclined = prism.angle > 0;
      beam = refracted(beam, first_inclined ? first : flat, air, prism.index);
      beam = refracted(beam, first_inclined ? flat : second, prism.index, air);
    }
    for (const auto& [axis, angle] : turns) {
      const std::size_t k = axis == 'x' ? 0 : axis == 'y' ? 1 : 2;
      const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
      const double x = beam[a], y = beam[b];
      beam[a] = std::cos(angle) * x - std::sin(angle) * y;
      beam[b] = std::sin(angle) * x + std::cos(angle) * y;
    }
    return beam;
  }
};

double degrees_between(const Three& a, const Three& b) {
  const Three apart = plus(a, times(-1, b));
  return degrees_from_radians(2 * std::asin(0.5 * std::sqrt(product(apart, apart))));
}

struct Written {
  WrittenPattern result;
  Deflector deflector;
  std::string xml;
};

Written written(const std::string& sensor, const sensors::ScanPatternOptions& scan,
                double duration = 0.2) {
  std::ostringstream stream;
  WritePatternOptions options;
  options.sensor = sensor;
  options.format = "helios-xml";
  options.duration = duration;
  options.scan = scan;
  const WrittenPattern result = write_pattern(options, stream);
  return {result, Deflector(stream.str()), stream.str()};
}

/// Root mean square and greatest angle between the file and the pattern, deg, shots of a group at
/// the time of the group.
struct Difference {
  double rms = 0, worst = 0;
  std::size_t shots = 0;
};

Difference difference(const std::string& name, const Written& file,
                      const sensors::ScanPatternOptions& scan, bool by_pulses) {
  const sensors::Sensor sensor = sensors::load_sensor(name);
  const sensors::ScanPattern pattern = sensors::scan_pattern(sensor, 0, 6'000, scan);
  const std::size_t emitters = file.deflector.beams.size();
  const double step = 1 / file.deflector.pulse_frequency;
  const sensors::ScanSequence sequence = sensor.sequence.value_or(sensors::ScanSequence{});
  const bool in_turn = scan.firing.value_or(sequence.firing) == sensors::Firing::in_turn;
  const double rate = scan.shot_rate.value_or(sensor.shot_rate);
  std::vector<double> pulse_times;  // as a loop counts them
  double time = 0;
  for (std::size_t p = 0; p < pattern.size() / emitters + 2; ++p) {
    time += step;
    pulse_times.push_back(time);
  }
  Difference result;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    const double group =
        in_turn ? (static_cast<double>(i / emitters * emitters) + sequence.first_shot) / rate
                : (static_cast<double>(i / emitters) + sequence.first_shot) * step;
    double at = group + file.result.helios->time_lag;
    if (by_pulses) {
      const long pulse = std::lround(at / step) - 1;
      if (pulse < 0) continue;  // HELIOS++ has no pulse at time 0
      EXPECT_NEAR(pulse_times.at(static_cast<std::size_t>(pulse)), at, 1e-12);
      at = pulse_times.at(static_cast<std::size_t>(pulse));
    }
    const double azimuth = pattern.azimuth[i], zenith = pattern.zenith[i];
    const Three ours{-std::sin(zenith) * std::sin(azimuth), std::sin(zenith) * std::cos(azimuth),
                     std::cos(zenith)};
    const double apart = degrees_between(ours, file.deflector.direction(at, i % emitters));
    result.rms += apart * apart;
    result.worst = std::max(result.worst, apart);
    ++result.shots;
  }
  result.rms = std::sqrt(result.rms / static_cast<double>(result.shots));
  return result;
}

sensors::ScanPatternOptions together() {
  sensors::ScanPatternOptions scan;
  scan.firing = sensors::Firing::together;
  return scan;
}

TEST(HeliosXml, IsThePatternWhereNothingIsLost) {
  for (const char* name : {"mid-40-sequence", "mid-70", "avia", "avia-sequence", "tele-15",
                           "tele-15-sequence", "horizon", "horizon-sequence"}) {
    SCOPED_TRACE(name);
    const Written file = written(name, together());
    const Difference found = difference(name, file, together(), true);
    EXPECT_GT(found.shots, 5'900U);
    EXPECT_LT(found.worst, 1e-6);
    EXPECT_LT(degrees_from_radians(file.result.helios->worst), 1e-6);
    EXPECT_EQ(file.result.not_carried.size(), 1U);  // the shape of the beam
    EXPECT_THAT(file.xml, HasSubstr("beam divergence of 0.0"));
  }
}

/// A preset with other values, as a file that goes with it.
class Altered {
 public:
  Altered(const std::string& preset, const std::map<std::string, double>& values) {
    std::ifstream in(in_source_tree("presets/") + preset + ".yaml");
    std::string text((std::istreambuf_iterator<char>(in)), {});
    for (const auto& [name, value] : values) {
      const std::string before = text;
      text = std::regex_replace(text, std::regex(name + ": \\{value: [^,]+,"),
                                fmt::format("{}: {{value: {:.17g},", name, value));
      EXPECT_NE(text, before) << name;
    }
    static int count = 0;
    path_ = (std::filesystem::temp_directory_path() /
             fmt::format("risley-helios-{}-{}.yaml", ::getpid(), count++))
                .string();
    std::ofstream(path_) << text;
  }
  ~Altered() { std::filesystem::remove(path_); }
  Altered(const Altered&) = delete;
  Altered& operator=(const Altered&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Rotors that start anywhere are a turn and a lag, in a train of any two prisms.
TEST(HeliosXml, AnyTwoPrismsAndAnyStart) {
  std::mt19937 random(5);
  const auto within = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int i = 0; i < 8; ++i) {
    SCOPED_TRACE(i);
    const bool six = i % 2 == 0;
    std::map<std::string, double> values;
    values["refractive_index"] = within(1.45, 1.9);
    values["wedge_angle_deg"] = within(5, 18);
    values["refractive_index_air"] = i % 3 == 0 ? 1.0003 : 1.0;
    values["angular_velocity_a_deg_per_s"] = within(-60000, 60000);
    values["angular_velocity_b_deg_per_s"] = within(-60000, 60000);
    values[six ? "incident_beam_3_horizontal_deg" : "incident_beam_vertical_deg"] = within(-1, 1);
    const Altered preset(six ? "avia" : "mid-40-sequence", values);
    sensors::ScanPatternOptions scan = together();
    scan.rotation_angle = {within(-7, 7), within(-7, 7)};
    const Written file = written(preset.path(), scan);
    EXPECT_LT(difference(preset.path(), file, scan, false).worst, 1e-6);
    EXPECT_LT(degrees_from_radians(file.result.helios->worst), 1e-6);
    EXPECT_GE(file.result.helios->time_lag, 0);
  }
}

// What cannot be carried costs what is said, by the deflector of this file too.
TEST(HeliosXml, SaysWhatItCosts) {
  sensors::ScanPatternOptions scan;
  const Written avia = written("avia", scan, 0.025);
  ASSERT_EQ(avia.result.rows, 6'000U);
  const Difference turn = difference("avia", avia, scan, false);
  EXPECT_NEAR(turn.rms, degrees_from_radians(avia.result.helios->rms), 1e-6);
  EXPECT_NEAR(turn.worst, degrees_from_radians(avia.result.helios->worst), 1e-6);
  EXPECT_GT(turn.rms, 0.05);
  EXPECT_THAT(avia.xml, HasSubstr("fire one after another"));

  // Tilts of half a degree: rotated as fits best, and no other turn fits better.
  scan.rotation_angle = {1.0, 2.0};
  Written tilted = written("mid-40-table3", scan, 0.06);
  const Difference bent = difference("mid-40-table3", tilted, scan, false);
  EXPECT_NEAR(bent.rms, degrees_from_radians(tilted.result.helios->rms), 1e-6);
  EXPECT_GT(bent.rms, 0.01);
  EXPECT_THAT(tilted.xml, HasSubstr("Tilts of prisms"));
  for (auto& [axis, angle] : tilted.deflector.turns) {
    const double best = angle;
    for (const double more : {-0.002, 0.002}) {
      angle = best + more;
      EXPECT_GT(difference("mid-40-table3", tilted, scan, false).rms, bent.rms) << axis;
    }
    angle = best;
  }

  // Three rotors that start anywhere are only nearly a turn and a lag.
  sensors::ScanPatternOptions three = together();
  three.rotation_angle = {0.3, 2.0, 4.0};
  const Written horizon = written("horizon-sequence", three);
  const Difference left = difference("horizon-sequence", horizon, three, false);
  EXPECT_NEAR(left.rms, degrees_from_radians(horizon.result.helios->rms), 0.05 * left.rms);
  EXPECT_LT(left.worst, 0.1);
  EXPECT_THAT(horizon.xml, HasSubstr("The rotation angle of prism"));
}

TEST(HeliosXml, RefusesWhatItCannotBe) {
  sensors::ScanPatternOptions scan;
  scan.every = 40;
  EXPECT_EQ(refusal([&] { written("avia", scan); }),
            "every = 40, allowed 1: a scanner of HELIOS++ has prisms instead of rows");
}

}  // namespace risley::jobs::helios_xml_test
