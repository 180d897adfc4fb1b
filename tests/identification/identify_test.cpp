// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/identification/identify.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "risley/identification/fitted_values.hpp"
#include "risley/identification/identified_sensor.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/sensors/scan_pattern.hpp"
#include "risley/simulation/scanner.hpp"

#include "identification/judge.hpp"
#include "identification/scans.hpp"
#include "refusal.hpp"

namespace risley::identification::identify_test {

void expect_glass(const Identification& found, const Scan& scan, double index, double wedge_deg) {
  const PrismTrain& train = found.best().train();
  for (int k = 0; k < train.prisms(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    EXPECT_NEAR(train[place::refractive_index(k)], scan.index[at], index) << scan.faces << k;
    EXPECT_NEAR(degrees_from_radians(train[place::wedge_angle(k)]), scan.wedge_deg[at], wedge_deg)
        << scan.faces << k;
  }
}

TEST(Identify, ExactScansOfTwoPrismsGiveTheTrain) {
  std::uint64_t seed = 1;
  for (const char* faces : {"PA-AP", "AP-PA", "PA-PA", "AP-AP"}) {
    Scan scan;
    scan.faces = faces;
    scan.index = {1.62, 1.81};
    scan.wedge_deg = {17.3, 12.1};
    scan.speed_hz = {seed % 2 == 0 ? -211.3 : 87.7, 143.9};
    scan.emitter_elevation_deg = six_emitters_deg();
    scan.duration_s = 1.5;
    scan.seed = seed++;
    const Identification found = identify(scan.series());
    ASSERT_TRUE(is(found.best(), scan)) << faces;
    EXPECT_TRUE(found.decided && found.fits);
    EXPECT_EQ(found.emitters, 6);
    EXPECT_EQ(found.timing, EmitterTiming::in_turn);
    EXPECT_EQ(found.motion.length, 0) << "constant speed";
    EXPECT_FALSE(found.freedom.one_glass || found.freedom.frame || found.freedom.tilts);
    EXPECT_LT(found.best().fit.rms, radians_from_degrees(1e-8));
    expect_glass(found, scan, 1e-6, 1e-4);
    for (int k = 0; k < 2; ++k) {
      EXPECT_NEAR(found.best().fit.model.rotors.mean_angular_velocity(k) / kTwoPi * 60,
                  60 * scan.speed_hz[static_cast<std::size_t>(k)], 1e-4);
    }
    for (int j = 0; j < 6; ++j) {
      EXPECT_NEAR(degrees_from_radians(found.best().train()[place::incident_beam_vertical(j, 2)]),
                  scan.emitter_elevation_deg[static_cast<std::size_t>(j)], 1e-6);
    }
  }
}

TEST(Identify, ThreePrismsOfWhichTwoTurnEquallyFast) {
  Scan scan;
  scan.faces = "AP-PA-AP";
  scan.index = {1.6106, 1.6106, 1.5799};
  scan.wedge_deg = {20, 20, 17.5};
  scan.speed_hz = {122.53, -122.53, 10.32};
  scan.start_deg = {10, 80, 300};
  scan.emitter_elevation_deg = six_emitters_deg();
  scan.together = true;
  scan.duration_s = 1.5;
  const Identification found = identify(scan.series());
  ASSERT_TRUE(is(found.best(), scan));
  EXPECT_TRUE(found.decided);
  EXPECT_EQ(found.timing, EmitterTiming::together);
  expect_glass(found, scan, 1e-6, 1e-4);
}

TEST(Identify, RotorsThatTurnNearlyAlikeAreToldApartInALongerWindow) {
  Scan scan;
  scan.faces = "PA-PA";
  scan.index = {1.677, 1.677};
  scan.wedge_deg = {17.333, 17.344};
  scan.speed_hz = {-158.82, -157.58};
  scan.duration_s = 3;
  const Identification found = identify(scan.series());
  EXPECT_TRUE(class_holds(found, scan));
  EXPECT_TRUE(found.decided && found.fits);
}

TEST(Identify, OfARecordingWithAPauseTheLongestStretchIsUsed) {
  Scan scan;
  scan.wedge_deg = {18, 18};
  scan.duration_s = 1.2;
  estimation::AngleSeries series = scan.series();
  const std::size_t pause = series.size() / 6;
  for (std::size_t i = pause; i < series.size(); ++i) series.time_ns[i] += 5'000'000'000;
  const Identification found = identify(series);
  EXPECT_EQ(found.rows, series.size() - pause);
  EXPECT_TRUE(is(found.best(), scan));
}

// A beam along the axis shows of the first prism only by how much it turns the beam aside.
TEST(Identify, OneEmitterLeavesTheFacesOfTheFirstPrismOpen) {
  Scan scan;
  scan.wedge_deg = {18, 18};
  scan.duration_s = 1;
  const Identification found = identify(scan.series());
  EXPECT_TRUE(is(found.best(), scan)) << "of equivalent trains, that of equal wedges comes first";
  ASSERT_EQ(found.best().equivalent_to.size(), 1U);
  const Hypothesis& other = found.hypotheses[found.best().equivalent_to.front()];
  EXPECT_EQ(to_string(other.train().face_order()), "AP-AP");
  EXPECT_NEAR(degrees_from_radians(other.train()[place::wedge_angle(0)]), 18.8119, 1e-3);
  EXPECT_TRUE(found.decided) << "equivalent trains are one answer";
  const Hypothesis& best = found.best();
  const auto total_variance = [&](const std::string& name) {
    const auto at = std::find(best.fit.names.begin(), best.fit.names.end(), name);
    const auto row = static_cast<Eigen::Index>(at - best.fit.names.begin());
    return best.total_covariance(row, row);
  };
  EXPECT_TRUE(std::isinf(total_variance("refractive_index_a"))) << "nothing determines it";
  EXPECT_TRUE(std::isinf(total_variance("wedge_angle_a_deg")));
  EXPECT_GT(total_variance("refractive_index_b"), 0);
  EXPECT_TRUE(std::isfinite(total_variance("refractive_index_b")));
}

TEST(Identify, NoisyScansOfHuntingRotors) {
  Scan two;
  two.faces = "AP-PA";
  two.index = {1.83, 1.55};
  two.wedge_deg = {9, 19};
  two.speed_hz = {-142.4, 247.7};
  two.emitter_elevation_deg = six_emitters_deg();
  Scan three;
  three.faces = "PA-AP-AP";
  three.index = {1.7, 1.7, 1.7};
  three.wedge_deg = {9.5, 14, 11};
  three.speed_hz = {188.6, -52.6, 95.2};
  three.start_deg = {0, 100, 200};
  for (Scan scan : {two, three}) {
    scan.rate_hz = 2400;
    scan.duration_s = 3;
    scan.noise_deg = 0.01;
    scan.printed_deg = 0.01;
    scan.hunting = true;
    const Identification found = identify(scan.series());
    ASSERT_TRUE(class_holds(found, scan)) << scan.faces;
    EXPECT_TRUE(found.decided);
    EXPECT_GT(found.motion.length, 0);
    EXPECT_NEAR(degrees_from_radians(found.best().fit.rms), 0.0104, 0.0006);
    if (scan.emitter_elevation_deg.size() > 1) {
      EXPECT_LT(worst_error(found, scan), 4.0);
    }
  }
}

// The face orders of weak prisms differ by 0.0016 degree: 0.15 degree of noise hide that.
TEST(Identify, UndecidedRatherThanWrong) {
  Scan scan;
  scan.faces = "AP-PA";
  scan.wedge_deg = {7.1, 7.1};
  scan.speed_hz = {-163.95, 51.45};
  scan.emitter_elevation_deg = {0.16, -0.475, 0.79};
  scan.noise_deg = 0.15;
  const Identification found = identify(scan.series());
  EXPECT_FALSE(found.decided);
  EXPECT_TRUE(found.fits);
}

TEST(Identify, AnIdentifiedSensorRepeatsTheScan) {
  for (const bool together : {false, true}) {
    Scan scan;
    scan.faces = "AP-PA";
    scan.index = {1.8144, 1.8144};
    scan.speed_hz = {-131.55, 40.8};
    scan.emitter_elevation_deg = six_emitters_deg();
    scan.together = together;
    scan.duration_s = 1;
    const estimation::AngleSeries series = scan.series();
    const Identification found = identify(series);
    const IdentifiedSensor identified =
        identified_sensor(found, "mine", sensors::load_sensor("mid-40"));
    EXPECT_EQ(identified.decimation, 1);
    // A preset as file and back.
    const sensors::Sensor sensor =
        sensors::parse_preset(sensors::preset_text(identified.sensor), "mine.yaml");
    ASSERT_TRUE(sensor.sequence);
    const sensors::ScanPattern pattern = sensors::scan_pattern(sensor, 0, series.size());
    double worst = 0;
    for (std::size_t i = 0; i < series.size(); ++i) {
      worst = std::max({worst, std::abs(pattern.azimuth[i] - series.azimuth[i]),
                        std::abs(pattern.zenith[i] - series.zenith[i])});
    }
    EXPECT_LT(worst, radians_from_degrees(1e-7)) << together;
    const auto like = likeness(found, sensors::load_sensor("avia-sequence"));
    ASSERT_TRUE(like);
    EXPECT_FALSE(like->mirrored);
    EXPECT_FALSE(likeness(found, sensors::load_sensor("mid-70")));
  }
}

/// A simulated recording of a sensor. @param emitters  whether it names them
estimation::AngleSeries recording_of(const sensors::Sensor& sensor, double duration, bool emitters,
                                     std::uint64_t seed) {
  simulation::SimulationSettings settings;
  settings.truth = sensor;
  settings.duration = duration;
  settings.rotor = simulation::RotorKind::hunting;
  settings.seed = seed;
  simulation::Scanner scanner(settings);
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  estimation::AngleSeries series;
  std::size_t row = 0;
  while (scanner.read(chunk, truth, 65'536)) {
    const recordings::Observations& rows = chunk.observations;
    for (std::size_t i = 0; i < rows.size(); ++i, ++row) {
      const auto emitter = static_cast<std::uint8_t>(emitters ? row % 4 : 0);
      series.append(rows.time_ns[i], rows.azimuth[i], rows.zenith[i], emitter);
    }
  }
  return series;
}

// A scan all around is of a wedge and a reflector, also of a unit that differs from its type, whose
// axis is not quite the Z of the recording.
TEST(Identify, AScanAllAroundIsOfAWedgeAndAReflector) {
  for (const bool named : {true, false}) {
    SCOPED_TRACE(named);
    sensors::Sensor unit = sensors::load_sensor("mid-360");
    unit.train.set("refractive_index", 1.958);
    unit.train.set("entrance_face_a_deg", radians_from_degrees(9.9));
    unit.train.set("exit_face_a_deg", radians_from_degrees(29.2));
    unit.train.set("mirror_face_b_deg", radians_from_degrees(50.1));
    estimation::AngleSeries series = recording_of(unit, 0.5, named, 3);
    const estimation::FrameTurn turn{0.02, -0.01, true};
    estimation::turn(series, estimation::recording_from_sensor(turn));
    const Identification found = identify(series);
    const Hypothesis& best = found.best();
    ASSERT_EQ(to_string(best.train().face_order()), "AA-PMU");
    EXPECT_TRUE(found.decided && found.fits);
    EXPECT_EQ(found.emitters, 4);
    EXPECT_EQ(found.emitters_named, named);
    EXPECT_EQ(found.timing, EmitterTiming::in_turn);
    EXPECT_NEAR(best.fit.model.frame.yaw, turn.yaw, 1e-4);
    EXPECT_NEAR(best.fit.model.frame.pitch, turn.pitch, 1e-4);
    EXPECT_TRUE(best.fit.model.frame.axis_up);
    int told = 0;
    for (const FittedValue& value : fitted_values(best)) {
      const ParameterInfo& info = find_parameter(value.name, unit.shape());
      if (info.kind != ParameterKind::train || !(value.sigma > 0)) continue;
      const double truth = unit.train[info.places.front()] / info.si_per_unit;
      EXPECT_LT(std::abs(value.value - truth) / value.sigma, 4.5) << value.name;
      ++told;
    }
    EXPECT_GE(told, 13);
    const auto like = likeness(found, sensors::load_sensor("mid-360"));
    ASSERT_TRUE(like);
    EXPECT_FALSE(like->mirrored);
    const IdentifiedSensor identified =
        identified_sensor(found, "mine", sensors::load_sensor("mid-360"));
    EXPECT_NEAR(identified.sensor.field_of_view, kTwoPi, 1e-12);
    sensors::parse_preset(sensors::preset_text(identified.sensor), "mine.yaml");
  }
}

// In 0.1 s the lines of rotors that turn nearly alike may be one: no answer, but no wrong one.
TEST(Identify, AShortScanAllAroundIsNotAnsweredWrongly) {
  for (const std::uint64_t seed : {0U, 1U, 2U}) {
    try {
      const Identification found =
          identify(recording_of(sensors::load_sensor("mid-360"), 0.1, true, seed));
      EXPECT_TRUE(!found.fits || to_string(found.best().train().face_order()) == "AA-PMU") << seed;
    } catch (const EstimationError&) {
    }
  }
}

TEST(Identify, RefusesWhatCannotAnswer) {
  EXPECT_NE(refusal([] { identify({}, {.fastest = 0}); }).find("fastest"), std::string::npos);
  EXPECT_NE(refusal([] { identify({}, {.most_prisms = 4}); }).find("most_prisms"),
            std::string::npos);
  EXPECT_THROW(identify({}), EstimationError);
  estimation::AngleSeries still;
  for (int i = 0; i < 2000; ++i) still.append(100'000 * i, 0.1, 1.5);
  EXPECT_THROW(identify(still), EstimationError);
  Scan scan;
  CancelFlag cancel;
  cancel.set();
  EXPECT_THROW(identify(scan.series(), {}, Progress([](double) {}, &cancel)), Cancelled);
}

}  // namespace risley::identification::identify_test
