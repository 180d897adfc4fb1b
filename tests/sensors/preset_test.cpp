// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/preset.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/text.hpp"
#include "risley/io/text_file.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"
#include "source_tree.hpp"

namespace risley::sensors::preset_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string preset_file(const std::string& name) {
  return io::read_text_file(in_source_tree("presets/") + name + ".yaml");
}

/// The text with its first occurrence of a piece replaced.
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

/// Line of the first occurrence, from 1.
std::uint64_t line_of(const std::string& text, const std::string& piece) {
  const auto at = text.find(piece);
  EXPECT_NE(at, std::string::npos) << piece;
  return 1 + static_cast<std::uint64_t>(std::count(text.begin(), text.begin() + at, '\n'));
}

void expect_same_knowledge(const Sensor& a, const Sensor& b) {
  ASSERT_EQ(a.knowledge.size(), b.knowledge.size());
  for (const Knowledge& entry : a.knowledge) {
    SCOPED_TRACE(entry.name);
    const Knowledge* other = b.find_knowledge(entry.name);
    ASSERT_NE(other, nullptr);
    EXPECT_EQ(entry.sigma, other->sigma);
    EXPECT_EQ(entry.source, other->source);
  }
}

/// Every member, bit by bit.
void expect_same(const Sensor& a, const Sensor& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.manufacturer, b.manufacturer);
  EXPECT_EQ(a.model, b.model);
  EXPECT_EQ(a.serial, b.serial);
  EXPECT_EQ(a.train.face_order(), b.train.face_order());
  EXPECT_EQ(a.train.parameters(), b.train.parameters());
  EXPECT_EQ(a.angular_velocity, b.angular_velocity);
  EXPECT_EQ(a.combination, b.combination);
  ASSERT_EQ(a.sequence.has_value(), b.sequence.has_value());
  if (a.sequence) {
    EXPECT_EQ(a.sequence->rotation_angle, b.sequence->rotation_angle);
    EXPECT_EQ(a.sequence->first_shot, b.sequence->first_shot);
    EXPECT_EQ(a.sequence->firing, b.sequence->firing);
  }
  expect_same_knowledge(a, b);
  EXPECT_EQ(a.covariance_names, b.covariance_names);
  EXPECT_EQ(a.covariance, b.covariance);
  for (const auto member :
       {&Sensor::angle_noise, &Sensor::range_noise, &Sensor::angle_resolution,
        &Sensor::range_resolution, &Sensor::range_minimum, &Sensor::range_maximum,
        &Sensor::field_of_view, &Sensor::pointing_tolerance, &Sensor::shot_rate,
        &Sensor::beam_divergence_horizontal, &Sensor::beam_divergence_vertical}) {
    EXPECT_EQ(a.*member, b.*member);
  }
  EXPECT_EQ(a.device_type, b.device_type);
  EXPECT_EQ(a.provenance, b.provenance);
}

/// A calibrated unit with values that no short decimal has.
Sensor calibrated_unit() {
  Sensor sensor = load_sensor("mid-40");
  sensor.serial = "0TFDG3B006H2Z11";
  double value = 0.00123456789;
  for (const ParameterInfo& info : parameter_list({2})) {
    if (info.kind != ParameterKind::train || info.unit != "deg" || info.places.size() > 1) continue;
    sensor.set(info.name, value);
    value = std::nextafter(1.0173 * value, 1.0);
  }
  sensor.set("refractive_index_a", 1.5087654321098765);
  sensor.set("angular_velocity_b_deg_per_s", 763.8282828282828);
  sensor.set_knowledge({"refractive_index_a", 1.2345e-5, "a \"fit\",\n\\ with: odd # text"});
  sensor.covariance_names = {"refractive_index_a", "prism_tilt_a_vertical_deg",
                             "angular_velocity_a_deg_per_s"};
  sensor.covariance.resize(3, 3);
  sensor.covariance << 1e-9, 2e-10, 3e-9, 2e-10, 1.0 / 3e8, -1e-9, 3e-9, -1e-9, 1.0 / 7;
  sensor.provenance = {{"command", "risley estimate \"a b.lvx\" -o out"}, {"seed", "0"}};
  return sensor;
}

TEST(Preset, Mid40HoldsThePapersNominalValues) {
  const Sensor sensor = load_sensor("mid-40");
  EXPECT_EQ(to_string(sensor.train.face_order()), "PA-AP");
  EXPECT_EQ(sensor.combination, 1);
  // Eq. (30)
  EXPECT_EQ(sensor.get("refractive_index_air"), 1.0);
  EXPECT_EQ(sensor.get("refractive_index"), 1.51);
  EXPECT_NEAR(degrees_from_radians(sensor.get("wedge_angle_deg")), 18.0, 1e-13);
  EXPECT_NEAR(degrees_from_radians(sensor.get("angular_velocity_a_deg_per_s")), -27984.0, 1e-10);
  EXPECT_NEAR(degrees_from_radians(sensor.get("angular_velocity_b_deg_per_s")), 43764.0, 1e-10);
  EXPECT_EQ(sensor.train.parameters(), sensor.train.without_errors().parameters());
  // Table 1
  EXPECT_EQ(sensor.shot_rate, 100000.0);
  EXPECT_EQ(sensor.range_maximum, 260.0);
  EXPECT_EQ(sensor.range_noise, 0.02);
  EXPECT_NEAR(degrees_from_radians(sensor.field_of_view), 38.4, 1e-13);
  EXPECT_NEAR(degrees_from_radians(sensor.pointing_tolerance), 0.1, 1e-15);  // section 1
  EXPECT_NEAR(degrees_from_radians(sensor.beam_divergence_horizontal), 0.03, 1e-15);
  EXPECT_NEAR(degrees_from_radians(sensor.beam_divergence_vertical), 0.28, 1e-15);
  // Sections 2.3 and 3.1, Appendix A
  EXPECT_NEAR(degrees_from_radians(sensor.angle_resolution), 0.01, 1e-16);
  EXPECT_NEAR(degrees_from_radians(sensor.angle_noise), 0.004, 1e-16);
  EXPECT_EQ(sensor.geometry, (PrismGeometry{{0.007}, {0.030}}));
  EXPECT_EQ(sensor.device_type, 1);
  EXPECT_TRUE(sensor.covariance_names.empty());
}

TEST(Preset, Table3HoldsTheUnitOfThePaper) {
  const Sensor sensor = load_sensor("mid-40-table3");
  EXPECT_EQ(sensor.combination, 2);
  EXPECT_EQ(sensor.get("refractive_index"), 1.5090);
  const std::vector<std::pair<std::string, double>> table{
      {"angular_velocity_a_deg_per_s", -43789.8}, {"angular_velocity_b_deg_per_s", 27997.8},
      {"incident_beam_horizontal_deg", 0.071},    {"incident_beam_vertical_deg", -0.385},
      {"bearing_tilt_a_horizontal_deg", 0.011},   {"bearing_tilt_a_vertical_deg", 0.008},
      {"prism_tilt_a_horizontal_deg", 0.0},       {"prism_tilt_a_vertical_deg", 0.090},
      {"prism_tilt_b_horizontal_deg", 0.120},     {"prism_tilt_b_vertical_deg", -0.383}};
  for (const auto& [name, value_deg] : table) {
    const double tolerance = 1e-15 * std::max(1.0, std::abs(value_deg));
    EXPECT_NEAR(sensor.get(name), radians_from_degrees(value_deg), tolerance) << name;
  }
}

TEST(Preset, ReversedIsTheOtherCombinationOfTheSameType) {
  const Sensor reversed = load_sensor("mid-40-reversed");
  const Sensor computed = with_combination(load_sensor("mid-40"), 2);
  EXPECT_EQ(reversed.combination, computed.combination);
  EXPECT_EQ(reversed.angular_velocity, computed.angular_velocity);
  EXPECT_EQ(reversed.train.parameters(), computed.train.parameters());
  for (const Knowledge& entry : computed.knowledge) {
    ASSERT_NE(reversed.find_knowledge(entry.name), nullptr) << entry.name;
    EXPECT_EQ(reversed.find_knowledge(entry.name)->sigma, entry.sigma) << entry.name;
  }
}

TEST(Preset, EveryBuiltInOneSaysWhereEachValueComesFrom) {
  ASSERT_THAT(builtin_preset_names(),
              ::testing::IsSupersetOf({"mid-40", "mid-40-reversed", "mid-40-table3"}));
  for (const std::string& name : builtin_preset_names()) {
    SCOPED_TRACE(name);
    const Sensor sensor = load_sensor(name);
    EXPECT_EQ(sensor.name, name);
    const auto& list = parameter_list(sensor.shape());
    for (int place = 0; place < parameter_count(sensor.shape()); ++place) {
      bool has_name = false, known = false;
      for (const ParameterInfo& info : list) {
        if (info.kind != ParameterKind::train ||
            std::find(info.places.begin(), info.places.end(), place) == info.places.end()) {
          continue;
        }
        has_name = true;
        known = known || sensor.find_knowledge(info.name) != nullptr;
      }
      EXPECT_EQ(has_name, known) << "place " << place;
    }
    for (const char* field : {"angle_noise_deg", "range_maximum_m", "shot_rate_hz",
                              "beam_divergence_vertical_deg", "prism_spacing_m"}) {
      EXPECT_NE(sensor.find_knowledge(field), nullptr) << field;
    }
    for (const Knowledge& entry : sensor.knowledge) EXPECT_FALSE(entry.source.empty());
  }
}

// Recordings are read with the preset of their sensor's type, whatever other presets there are.
TEST(Preset, EveryModelHasOneThatIsTheTypes) {
  for (const std::string& name : builtin_preset_names()) {
    const Sensor sensor = load_sensor(name);
    EXPECT_EQ(load_sensor(lower_case(sensor.model)).device_type, sensor.device_type) << name;
  }
}

TEST(Preset, TextRoundTripKeepsEveryBit) {
  std::vector<Sensor> sensors{calibrated_unit()};
  for (const std::string& name : builtin_preset_names()) sensors.push_back(load_sensor(name));
  for (const Sensor& sensor : sensors) {
    SCOPED_TRACE(sensor.name);
    const std::string text = preset_text(sensor);
    const Sensor again = parse_preset(text, "round trip");
    expect_same(sensor, again);
    EXPECT_EQ(preset_text(again), text);
  }
}

TEST(Preset, NumbersStayAsShortAsTheyWere) {
  const std::string text = preset_text(load_sensor("mid-40-table3"));
  for (const char* piece :
       {"value: 1.509,", "value: -43789.8,", "value: 27997.8,", "value: -0.385,", "value: 0.09,",
        "value: 18,", "sigma: 0.002,", "value: 0.004,", "value: 38.4,", "value: 260,"}) {
    EXPECT_THAT(text, HasSubstr(piece));
  }
}

TEST(Preset, ThreePrismsWithOwnGlass) {
  Sensor sensor = load_sensor("mid-40");
  sensor.train = PrismTrain(parse_face_order("PA-AP-AP"));
  sensor.angular_velocity = {1.0, 2.0, -3.0};
  sensor.combination.reset();
  sensor.knowledge.clear();
  sensor.train.set("wedge_angle_c_deg", 0.1);
  const Sensor again = parse_preset(preset_text(sensor), "three");
  expect_same(sensor, again);
  EXPECT_EQ(again.get("wedge_angle_c_deg"), 0.1);
  EXPECT_EQ(again.get("angular_velocity_c_deg_per_s"), -3.0);
}

TEST(Preset, FileWithAPathIsRead) {
  const io::TestFolder folder;
  const std::string path = folder.file("unit.yaml");
  io::write_text_file(path, preset_text(calibrated_unit()));
  expect_same(load_sensor(path), calibrated_unit());
  std::filesystem::remove(path);
  EXPECT_THROW(load_sensor(path), FileError);
}

TEST(Preset, UnknownNameListsTheKnownOnes) {
  try {
    load_sensor("mid-4o");
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), NamesField("avia, avia-sequence, horizon"));
  }
  EXPECT_THROW(load_sensor("velodyne"), InvalidArgument);
}

TEST(Preset, ACopyKeepsTheCommentsAndHasItsOwnName) {
  const std::string original = builtin_preset_text("horizon");
  EXPECT_EQ(original, preset_file("horizon"));
  const std::string copy = copied_preset_text("horizon", "number-17");
  EXPECT_EQ(copy, replaced(original, "\nname: horizon\n", "\nname: \"number-17\"\n"));
  Sensor sensor = parse_preset(copy, "copy");
  EXPECT_EQ(sensor.name, "number-17");
  sensor.name = "horizon";
  expect_same(sensor, load_sensor("horizon"));
  for (const char* name : {"", "a b", "a/b", "x:y"}) {
    EXPECT_THROW(copied_preset_text("horizon", name), InvalidArgument) << name;
  }
  EXPECT_THROW(copied_preset_text("horizont", "a"), InvalidArgument);
  EXPECT_THROW(builtin_preset_text("mid40"), InvalidArgument);
}

TEST(Preset, ASequenceIsRefusedWithItsLine) {
  const std::string good = builtin_preset_text("avia");
  const auto refused = [&](const std::string& from, const std::string& to,
                           const std::string& says) {
    const std::string bad = replaced(good, from, to);
    EXPECT_THAT(refusal<FileError>([&] { parse_preset(bad, "bad.yaml"); }), HasSubstr(says));
  };
  refused("firing: in_turn", "firing: at_once",
          "sequence.firing = \"at_once\", allowed in_turn, together");
  refused("first_shot: 0", "first_shot: 2", "sequence.first_shot");
  refused("firing: in_turn", "firing: in_turn\n  phase: 3", "unknown field sequence.phase");
  refused("rotation_angle_b_deg: {value: 270", "rotation_angle_b_deg: {value: 1000",
          "sequence.rotation_angle_b_deg = 1000 deg, allowed -360 to 360");
}

TEST(Preset, ASensorThatCannotBeWrittenIsRefused) {
  Sensor sensor = load_sensor("mid-40");
  sensor.range_noise = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(preset_text(sensor), InvalidArgument);
  sensor = calibrated_unit();
  sensor.covariance.resize(2, 2);
  EXPECT_THROW(preset_text(sensor), InvalidArgument);
}

struct Mistake {
  const char* name;
  const char* from;  ///< piece of presets/mid-40.yaml
  const char* to;
  const char* found_at;  ///< piece of the changed text on the line that must be named
  std::vector<const char*> message;
};

class PresetMistake : public ::testing::TestWithParam<Mistake> {};

TEST_P(PresetMistake, IsNamedWithItsLine) {
  const Mistake& mistake = GetParam();
  const std::string text = replaced(preset_file("mid-40"), mistake.from, mistake.to);
  try {
    parse_preset(text, "some.yaml");
    FAIL() << "was accepted";
  } catch (const FileError& error) {
    EXPECT_EQ(error.path(), "some.yaml");
    ASSERT_TRUE(error.place().line.has_value()) << error.what();
    EXPECT_EQ(*error.place().line, line_of(text, mistake.found_at)) << error.what();
    for (const char* piece : mistake.message) EXPECT_THAT(error.problem(), HasSubstr(piece));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Schema, PresetMistake,
    ::testing::Values(
        Mistake{"Version",
                "risley_preset: 1",
                "risley_preset: 2",
                "risley_preset",
                {"risley_preset = 2", "1"}},
        Mistake{"NoPreset", "risley_preset: 1", "recipe: 1", "recipe", {"is not a sensor preset"}},
        Mistake{"NotYaml", "model: Mid-40", "model: [Mid-40", "face_order", {"YAML"}},
        Mistake{"UnknownKey",
                "model: Mid-40",
                "model: Mid-40\ncolour: grey",
                "colour",
                {"unknown field colour"}},
        Mistake{"KeyTwice",
                "model: Mid-40",
                "model: Mid-40\nmodel: Mid-70",
                "model: Mid-70",
                {"model appears twice"}},
        Mistake{"MissingKey",
                "manufacturer: Livox\n",
                "",
                "risley_preset",
                {"manufacturer is missing"}},
        Mistake{"MissingParameter",
                "  incident_beam_horizontal_deg",
                "  #",
                "refractive_index_air",
                {"parameters.incident_beam_horizontal_deg is missing"}},
        Mistake{"MissingSpeed",
                "  angular_velocity_b_deg_per_s",
                "  #",
                "refractive_index_air",
                {"parameters.angular_velocity_b_deg_per_s is missing"}},
        Mistake{"MissingSection", "rates:", "beats:", "beats", {"unknown field beats"}},
        Mistake{"WrongUnit",
                "{value: 18, unit: \"deg\"",
                "{value: 18, unit: \"rad\"",
                "wedge_angle_deg",
                {"wedge_angle_deg.unit = \"rad\"", "\"deg\""}},
        Mistake{"OutOfBounds",
                "{value: 18,",
                "{value: 95,",
                "wedge_angle_deg",
                {"wedge_angle_deg = 95 deg", "0 to 60"}},
        Mistake{"NegativeSigma",
                "sigma: 0.002",
                "sigma: -0.002",
                "refractive_index:",
                {"refractive_index.sigma = -0.002", "allowed 0"}},
        Mistake{"NaN",
                "{value: 1.51,",
                "{value: .nan,",
                "refractive_index:",
                {"refractive_index.value", "finite number", ".nan"}},
        Mistake{"NaNWord", "{value: 1.51,", "{value: nan,", "refractive_index:", {"finite number"}},
        Mistake{
            "Infinite", "{value: 1.51,", "{value: inf,", "refractive_index:", {"finite number"}},
        Mistake{"NoNumber",
                "{value: 1.51,",
                "{value: 1.51x,",
                "refractive_index:",
                {"finite number", "1.51x"}},
        Mistake{"NoSource",
                "sigma: 0.002, source:",
                "sigma: 0.002, from:",
                "refractive_index:",
                {"unknown field parameters.refractive_index.from"}},
        Mistake{"UnknownParameter",
                "  prism_tilt_b_vertical_deg",
                "  prism_tilt_c_vertical_deg",
                "prism_tilt_c_vertical_deg",
                {"prism_tilt_c_vertical_deg", "2 prisms"}},
        Mistake{"OtherPrismCount",
                "face_order: PA-AP",
                "face_order: PA-AP-AP",
                "combination:",
                {"2 prisms", "3"}},
        Mistake{"FaceOrder", "face_order: PA-AP", "face_order: PA-XX", "face_order", {"PA-XX"}},
        Mistake{"RotationAngle",
                "  wedge_angle_deg",
                "  rotation_angle_a_deg",
                "rotation_angle_a_deg",
                {"unknown parameter"}},
        Mistake{"SaidTwice",
                "  incident_beam_horizontal_deg",
                "  refractive_index_b: {value: 1.5, unit: \"1\"}\n  incident_beam_horizontal_deg",
                "refractive_index_b",
                {"refractive_index_b repeats refractive_index"}},
        Mistake{"Combination",
                "combination: 1",
                "combination: 3",
                "combination: 3",
                {"combination = 3", "1 to 2"}},
        Mistake{"LimitsCrossed",
                "range_minimum_m: {value: 0.3",
                "range_minimum_m: {value: 300",
                "limits:",
                {"range_minimum_m = 300 m", "260"}},
        Mistake{"RateZero",
                "{value: 100000,",
                "{value: 0,",
                "shot_rate_hz",
                {"rates.shot_rate_hz = 0 Hz", "allowed"}},
        Mistake{"CovarianceName",
                "noise:",
                "covariance: {names: [wobble], matrix: [[1]]}\nnoise:",
                "covariance",
                {"covariance.names", "wobble"}},
        Mistake{"CovarianceShape",
                "noise:",
                "covariance: {names: [refractive_index], matrix: [[1, 2]]}\nnoise:",
                "covariance",
                {"covariance.matrix[0]", "1 numbers"}},
        Mistake{"CovarianceAsymmetric",
                "noise:",
                "covariance:\n  names: [refractive_index, wedge_angle_deg]\n  matrix:\n"
                "    - [2, 0.5]\n    - [0.4, 1]\nnoise:",
                "- [0.4",
                {"not symmetric", "[1][0]"}},
        Mistake{"CovarianceNegative",
                "noise:",
                "covariance:\n  names: [refractive_index, wedge_angle_deg]\n  matrix:\n"
                "    - [2, 0.5]\n    - [0.5, -1]\nnoise:",
                "- [0.5, -1",
                {"matrix[1][1]", "above 0"}},
        Mistake{"CovarianceIndefinite",
                "noise:",
                "covariance:\n  names: [refractive_index, wedge_angle_deg]\n  matrix:\n"
                "    - [1, 2]\n    - [2, 1]\nnoise:",
                "matrix:",
                {"not positive", "-1"}}),
    [](const auto& each) { return std::string(each.param.name); });

// What newer presets may say and older ones do not.
TEST(PresetFile, OptionalFieldsTravelAndAreAbsentWhereNothingIsSaid) {
  const Sensor plain = load_sensor("mid-40");
  EXPECT_EQ(plain.range_offset, 0.0);
  EXPECT_EQ(plain.reference, CalibrationReference::none);
  for (const char* name : {"range_noise_per_range", "range_noise_incidence_m",
                           "range_noise_weak_return_m", "range_offset_m", "calibrated_against"}) {
    EXPECT_THAT(preset_text(plain), ::testing::Not(HasSubstr(name)));
  }
  Sensor stated = plain;
  stated.range_noise_per_range = 2e-4;
  stated.range_noise_incidence = 0.003;
  stated.range_noise_weak_return = 0.05;
  stated.range_offset = -0.0125;
  stated.set_knowledge({"range_offset_m", 0.002, "walls"});
  stated.reference = CalibrationReference::planes;
  stated.covariance_names = {"incident_beam_vertical_deg", "range_offset_m"};
  stated.covariance = (Eigen::MatrixXd(2, 2) << 1e-8, -1e-8, -1e-8, 4e-6).finished();
  const Sensor back = parse_preset(preset_text(stated), "stated.yaml");
  EXPECT_EQ(back.range_noise_per_range, 2e-4);
  EXPECT_EQ(back.range_noise_incidence, 0.003);
  EXPECT_EQ(back.range_noise_weak_return, 0.05);
  EXPECT_EQ(back.range_offset, -0.0125);
  EXPECT_EQ(back.reference, CalibrationReference::planes);
  EXPECT_EQ(back.covariance_names, stated.covariance_names);
  EXPECT_EQ(back.covariance, stated.covariance);
  expect_same(stated, back);
  EXPECT_EQ(preset_text(back), preset_text(stated));
}

TEST(PresetFile, RefusesAnUnknownReference) {
  Sensor stated = load_sensor("mid-40");
  stated.reference = CalibrationReference::directions;
  const std::string text =
      replaced(preset_text(stated), "calibrated_against: directions", "calibrated_against: walls");
  try {
    parse_preset(text, "stated.yaml");
    FAIL();
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), NamesField("directions, planes"));
    EXPECT_EQ(error.place().line, line_of(text, "calibrated_against"));
  }
}

TEST(SensorRangeVariance, AddsItsParts) {
  Sensor sensor = load_sensor("mid-40");
  EXPECT_EQ(sensor.range_variance(50.0, 3.0, 10.0), 4e-4);
  sensor.range_noise_per_range = 1e-3;
  sensor.range_noise_incidence = 0.01;
  sensor.range_noise_weak_return = 0.03;
  EXPECT_DOUBLE_EQ(sensor.range_variance(50.0, 3.0, 9.0), 4e-4 + 25e-4 + 9e-4 + 1e-4);
  EXPECT_EQ(sensor.range_variance(0.0, 0.0, 0.0), sensor.range_variance(0.0, 0.0, 1.0));
}

}  // namespace risley::sensors::preset_test
