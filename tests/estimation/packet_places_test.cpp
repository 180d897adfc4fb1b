// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Recordings with one time for each packet are cropped as their users crop them: the places of the
// shots that are left come back, or they are said to be unknown.
#include "risley/estimation/packet_places.hpp"

#include <cmath>
#include <cstdint>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/sensor_recognition.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/sensors/preset.hpp"

#include "estimation/evident_places.hpp"
#include "parameter_name.hpp"

namespace risley::estimation::packet_places_test {

struct Cropped {
  std::string sensor;
  double width = 13.0, height = 12.0;  // of the window, deg
  bool backwards = false;              // emitters fire from the last to the first
  bool cut = true;                     // coordinates are cut off at millimetres, not rounded
  bool bent = false;                   // tilts of 0.3 degree and more, speeds off by 5e-4
};

void PrintTo(const Cropped& scan, std::ostream* stream) { *stream << scan.sensor; }

struct CroppedRecording {
  PacketShots shots;
  std::vector<std::uint8_t> truth;
};

/// The sensor of a scan.
sensors::Sensor unit_of(const Cropped& scan) {
  sensors::Sensor unit = sensors::load_sensor(scan.sensor);
  if (!scan.bent) return unit;
  double tilt = radians_from_degrees(0.3);
  for (const std::string& name : default_free_names(unit.shape(), one_glass(unit.train))) {
    const ParameterInfo& info = find_parameter(name, unit.shape());
    const bool is_tilt = name.find("tilt") != std::string::npos;
    for (const int place : info.places) {
      unit.train.set_place(place, unit.train[place] + (is_tilt ? tilt : 0.1 * tilt));
    }
    if (is_tilt) tilt = -1.1 * tilt;
  }
  for (double& speed : unit.angular_velocity) speed *= 1.0005;
  return unit;
}

/// Points of a wall in 2 m in millimetres, 0.25 s of rotors that swing by 0.1 degree, packets that
/// begin half a microsecond early or late.
CroppedRecording record_packets(const Cropped& scan, double azimuth = 1.0,
                                double elevation = -4.0) {
  const sensors::Sensor sensor = unit_of(scan);
  constexpr double kSwing = radians_from_degrees(0.1), kSwingSpeed = kTwoPi * 3.0;
  constexpr double kNoise = radians_from_degrees(0.003), kDistance = 2.0, kStep = 0.001;
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  CroppedRecording result;
  PacketShots& shots = result.shots;
  shots.cartesian = true;
  const int emitters = sensor.train.emitters();
  shots.places = emitters > 1 ? 96 : 100;
  const auto order =
      emitters_in_order({scan.backwards ? emitters - 1 : 0, scan.backwards}, emitters);
  const double period = shots.places / sensor.shot_rate;
  double begin = 100.0;  // s
  for (int packet = 0; packet * period < 0.25; ++packet) {
    begin += period + 0.5e-6 * normal(generator);
    PacketShots::OnePacket one{std::llround(begin * 1e9), 0};
    for (int place = 0; place < shots.places; ++place) {
      const double time = begin + place / sensor.shot_rate - 100.0;
      std::vector<double> angles;
      for (std::size_t k = 0; k < sensor.angular_velocity.size(); ++k) {
        const auto number = static_cast<double>(k);
        angles.push_back(1.0 + number + time * sensor.angular_velocity[k] +
                         kSwing * std::sin(kSwingSpeed * time + number));
      }
      const auto beam = order[static_cast<std::size_t>(place % emitters)];
      const Observation seen = observe(sensor.train, angles, beam);
      const double sideways = degrees_from_radians(seen.azimuth) - azimuth;
      const double upwards = 90.0 - degrees_from_radians(seen.zenith) - elevation;
      if (std::abs(sideways) > 0.5 * scan.width || std::abs(upwards) > 0.5 * scan.height) continue;
      const double zenith = seen.zenith + kNoise * normal(generator);
      const double turned = seen.azimuth + kNoise * normal(generator);
      const double range = kDistance / (std::sin(zenith) * std::cos(turned));
      const auto whole = [&](double c) {
        return kStep * (scan.cut ? std::trunc(c / kStep) : std::round(c / kStep));
      };
      const double x = whole(kDistance), y = whole(range * std::sin(zenith) * std::sin(turned)),
                   z = whole(range * std::cos(zenith));
      const auto variance = static_cast<float>(std::pow(kStep / range, 2) / 12.0);
      shots.series.append(one.time_ns, std::atan2(y, x), std::atan2(std::hypot(x, y), z), 0,
                          variance, variance);
      shots.packet.push_back(shots.packets.size());
      shots.precedent.push_back(one.shots++);
      result.truth.push_back(static_cast<std::uint8_t>(place));
    }
    if (one.shots > 0) shots.packets.push_back(one);
  }
  return result;
}

class CroppedPackets : public ::testing::TestWithParam<Cropped> {};

TEST_P(CroppedPackets, TellWhenTheirShotsWereFired) {
  const CroppedRecording recording = record_packets(GetParam());
  const sensors::Sensor sensor = sensors::load_sensor(GetParam().sensor);
  const double rate = shot_rate_of(recording.shots, sensor);
  EXPECT_NEAR(rate, sensor.shot_rate, 1e-3 * sensor.shot_rate);
  const ShotPlaces found = find_places(recording.shots, rate, sensor);
  ASSERT_TRUE(found.followed);
  EXPECT_EQ(found.cut_coordinates, GetParam().cut);
  std::size_t unknown = 0, wrong = 0;
  for (std::size_t i = 0; i < found.place.size(); ++i) {
    if (found.place[i] == recordings::kNoPlace) {
      ++unknown;
    } else if (found.place[i] != recording.truth[i]) {
      ++wrong;
    }
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_LT(unknown, found.place.size() / 100) << "of " << found.place.size();
  EXPECT_EQ(found.firing_order.front(), GetParam().backwards ? sensor.train.emitters() - 1 : 0);
}

INSTANTIATE_TEST_SUITE_P(
    Sensors, CroppedPackets,
    ::testing::Values(Cropped{"avia"}, Cropped{"avia", 20.0, 20.0, true, false},
                      Cropped{"mid-40", 20.0, 15.0}, Cropped{"mid-70", 40.0, 30.0},
                      Cropped{"tele-15", 9.0, 7.0}, Cropped{"horizon", 30.0, 15.0},
                      Cropped{"mid-40", 8.0, 8.0, false, true, true},
                      Cropped{"mid-70", 13.0, 12.0, false, true, true},
                      Cropped{"mid-70", 10.0, 8.0, false, true, true},
                      Cropped{"tele-15", 9.0, 7.0, true, true, true}),
    [](const auto& scan) {
      return fmt::format("{}{:.0f}{}{}", parameter_name(scan.param.sensor), scan.param.width,
                         scan.param.backwards ? "Backwards" : "", scan.param.bent ? "Bent" : "");
    });

TEST(PacketPlaces, OfRunsFromPacketToPacketAreEvident) {
  const Cropped scan{"mid-70", 13.0, 12.0, false, true, true};
  const CroppedRecording recording = record_packets(scan);
  const std::vector<std::uint8_t> place = evident_places(recording.shots, 100e3, 1);
  std::size_t evident = 0;
  for (std::size_t i = 0; i < place.size(); ++i) {
    EXPECT_FALSE(recording.shots.is_whole(recording.shots.packet[i]));
    if (place[i] == recordings::kNoPlace) continue;
    ++evident;
    EXPECT_EQ(place[i], recording.truth[i]);
  }
  EXPECT_GT(evident, place.size() / 3);
  // Nobody knows which of several emitters fired.
  for (const std::uint8_t one : evident_places(recording.shots, 100e3, 6)) {
    EXPECT_EQ(one, recordings::kNoPlace);
  }
}

TEST(PacketPlaces, OfASingleEmittersFewShotsStayUnknown) {
  const CroppedRecording recording = record_packets({"mid-70", 4.0, 4.0, false, true, true});
  const ShotPlaces found = find_places(recording.shots, 100e3, sensors::load_sensor("mid-70"));
  EXPECT_FALSE(found.followed);
  for (std::size_t i = 0; i < found.place.size(); ++i) {
    if (found.place[i] == recordings::kNoPlace) continue;
    EXPECT_EQ(found.place[i], recording.truth[i]);
  }
}

TEST(PacketPlaces, AreGuessedInTheOrderOfTheShotsWithinAKnownDistance) {
  const CroppedRecording recording = record_packets({"mid-70", 13.0, 12.0});
  std::vector<std::uint8_t> known(recording.truth.size(), recordings::kNoPlace);
  for (std::size_t i = 0; i < known.size(); i += 7) known[i] = recording.truth[i];
  for (const auto& some : {std::vector<std::uint8_t>(), known}) {
    const GuessedPlaces guess = guess_places(recording.shots, some);
    EXPECT_GT(guess.most_off, 1.0);
    for (std::size_t i = 0; i < known.size(); ++i) {
      EXPECT_LE(std::abs(guess.place[i] - recording.truth[i]), guess.most_off);
      const bool is_known = !some.empty() && some[i] != recordings::kNoPlace;
      EXPECT_TRUE(!is_known || guess.place[i] == some[i]);
      const bool same = i > 0 && recording.shots.packet[i] == recording.shots.packet[i - 1];
      EXPECT_TRUE(!same || guess.place[i] > guess.place[i - 1]);
    }
  }
  EXPECT_EQ(guess_places(recording.shots, recording.truth).most_off, 0.0);
  known.front() = 99;
  EXPECT_THROW(guess_places(recording.shots, known), InvalidArgument);
  known.pop_back();
  EXPECT_THROW(guess_places(recording.shots, known), InvalidArgument);
}

TEST(PacketPlaces, AreThoseOfTheirOrderInWholePackets) {
  const CroppedRecording recording = record_packets({"avia", 180.0, 180.0});
  for (std::size_t i = 0; i < recording.shots.packets.size(); ++i) {
    EXPECT_TRUE(recording.shots.is_whole(i));
  }
  EXPECT_EQ(guess_places(recording.shots).place, recording.truth);
}

TEST(PacketPlaces, OfAnotherSensorAreUnknownAndNotGuessed) {
  const CroppedRecording recording = record_packets({"avia"});
  const ShotPlaces found = find_places(recording.shots, 240e3, sensors::load_sensor("horizon"));
  EXPECT_FALSE(found.followed);
  for (std::size_t i = 0; i < found.place.size(); ++i) {
    const bool whole = recording.shots.is_whole(recording.shots.packet[i]);
    EXPECT_EQ(found.place[i], whole ? recording.truth[i] : recordings::kNoPlace);
  }
}

TEST(PacketPlaces, RefuseShotsThatDoNotAscend) {
  CroppedRecording recording = record_packets({"avia"});
  std::swap(recording.shots.packet.front(), recording.shots.packet.back());
  EXPECT_THROW(guess_places(recording.shots), InvalidArgument);
}

}  // namespace risley::estimation::packet_places_test
