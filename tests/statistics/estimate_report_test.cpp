// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What a report says of an estimation whose truth is known: pieces of the recording alone, maps of
// residuals, and the page.
#include <algorithm>
#include <cmath>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/estimation/piecewise.hpp"
#include "risley/estimation/residual_maps.hpp"
#include "risley/report/report_file.hpp"

#include "statistics/simulated.hpp"

namespace risley::estimate_report_test {

using estimation::Estimate;
using estimation::Method;
using ::testing::HasSubstr;
using testing::table3_settings;

struct Case {
  testing::Simulated data;
  simulation::SimulationSettings settings;
  Estimate estimate;
  estimation::AngleSeries head;
};

Case make_case(std::uint64_t seed, Method method = Method::map,
               const std::vector<std::string>& fixed = {}) {
  Case one{{}, table3_settings(seed), {}, {}};
  one.data = testing::simulate(one.settings);
  estimation::ShotSelector selector({});
  selector.add(one.data.observations);
  estimation::EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-40");
  options.angle_noise = radians_from_degrees(0.01);
  options.fixed = fixed;
  one.head = selector.head();
  one.estimate = estimation::estimate(method, selector.take_series(), one.head, options);
  return one;
}

TEST(PiecewiseEstimate, ScattersAsItsSigmasSay) {
  // 20 pieces of 8 parameters, 6 recordings: 912 degrees of freedom, 1 +- 0.047.
  double chi2 = 0;
  constexpr int kSeeds = 6;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const Case one = make_case(static_cast<std::uint64_t>(seed));
    const auto pieces =
        estimation::estimate_piecewise(one.estimate, sensors::load_sensor("mid-40"), 20);
    EXPECT_EQ(pieces.size(), 20u);
    EXPECT_EQ(pieces.failed, 0u);
    EXPECT_EQ(pieces.degrees_of_freedom, 152);
    EXPECT_NEAR(pieces.duration, 1.5, 0.01);
    EXPECT_TRUE(std::is_sorted(pieces.time.begin(), pieces.time.end()));
    chi2 += pieces.chi2 / kSeeds;
  }
  EXPECT_NEAR(chi2, 1.0, 0.19);  // four standard deviations
}

TEST(PiecewiseEstimate, ADriftShows) {
  // A prism that tilts by 0.1 degree in the middle of the recording: two recordings one after the
  // other, which no constant describes.
  auto settings = table3_settings(3);
  settings.duration = 15.0;
  auto data = testing::simulate(settings);
  simulation::SimulationSettings later = settings;
  later.truth.set("prism_tilt_b_vertical_deg",
                  settings.truth.get("prism_tilt_b_vertical_deg") + radians_from_degrees(0.1));
  later.duration = 30.0;
  const auto rest = testing::simulate(later);
  const std::size_t half = data.observations.size();
  estimation::ShotSelector selector({});
  recordings::Observations all = data.observations;
  const auto take = [&](auto& to, const auto& from) {
    to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(half), from.end());
  };
  take(all.time_ns, rest.observations.time_ns);
  take(all.azimuth, rest.observations.azimuth);
  take(all.zenith, rest.observations.zenith);
  recordings::Observations joined;
  joined.append(rest.observations);
  for (std::size_t i = 0; i < half; ++i) {
    joined.azimuth[i] = all.azimuth[i];
    joined.zenith[i] = all.zenith[i];
  }
  selector.add(joined);
  estimation::EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-40");
  options.angle_noise = radians_from_degrees(0.01);
  const auto estimate =
      estimation::estimate(Method::map, selector.take_series(), selector.head(), options);
  const auto pieces = estimation::estimate_piecewise(estimate, sensors::load_sensor("mid-40"), 20);
  EXPECT_GT(pieces.chi2, 2.0);
}

TEST(PiecewiseEstimate, RefusesWhatHasNoPieces) {
  const auto sensor = sensors::load_sensor("mid-40");
  const Case one = make_case(1);
  EXPECT_THROW(estimation::estimate_piecewise(one.estimate, sensor, 0), InvalidArgument);
  // Too short for an estimate: counted, not invented.
  const auto tiny = estimation::estimate_piecewise(one.estimate, sensor, 100);
  EXPECT_EQ(tiny.size(), 0u);
  EXPECT_EQ(tiny.failed, 100u);
  EXPECT_TRUE(std::isnan(tiny.chi2));
}

/// Mean square of the cells' means over what noise gives them.
double unevenness(const estimation::ResidualMap& map) {
  double sum = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto n = static_cast<double>(map.count[i]);
    sum += 0.5 * n *
           (std::pow(map.mean_azimuth[i] / map.sigma_azimuth, 2) +
            std::pow(map.mean_zenith[i] / map.sigma_zenith, 2));
  }
  return sum / static_cast<double>(map.size());
}

TEST(ResidualMaps, AreNoiseForASensorThatTheModelDescribes) {
  for (const Method method : {Method::map, Method::ekf}) {
    const Case one = make_case(2, method);
    const auto field = estimation::residuals_over_field(one.estimate, radians_from_degrees(1.0));
    const auto angles =
        estimation::residuals_over_angles(one.estimate, 0, 1, radians_from_degrees(10.0));
    EXPECT_EQ(field.shots, one.estimate.series.size() - one.estimate.outliers);
    EXPECT_EQ(angles.shots, field.shots);
    EXPECT_EQ(angles.size(), 36u * 36u);
    EXPECT_EQ(std::accumulate(angles.count.begin(), angles.count.end(), std::uint64_t{0}),
              angles.shots);
    for (std::size_t i = 0; i < angles.size(); ++i) {
      EXPECT_GT(angles.x[i], 0);
      EXPECT_LT(angles.x[i], kTwoPi);
      EXPECT_LT(angles.y[i], kTwoPi);
    }
    // Over 1,000 cells and two axes: 1 +- 0.03.
    EXPECT_NEAR(unevenness(field), 1.0, 0.15);
    EXPECT_NEAR(unevenness(angles), 1.0, 0.15);
  }
}

TEST(ResidualMaps, HavePatchesForASensorThatIsBentOtherwise) {
  const Case one = make_case(1, Method::map, {"prism_tilt_b_vertical_deg"});  // true: -0.383
  EXPECT_GT(unevenness(estimation::residuals_over_field(one.estimate, radians_from_degrees(2.0))),
            1.3);
  EXPECT_GT(
      unevenness(estimation::residuals_over_angles(one.estimate, 0, 1, radians_from_degrees(20.0))),
      1.5);
}

TEST(ResidualMaps, RefuseWhatMakesNoSense) {
  const Case one = make_case(1);
  EXPECT_THROW(estimation::residuals_over_field(one.estimate, 0), InvalidArgument);
  EXPECT_THROW(estimation::residuals_over_angles(one.estimate, 0, 2, 0.1), InvalidArgument);
  EXPECT_THROW(estimation::residuals_over_angles(one.estimate, -1, 1, 0.1), InvalidArgument);
}

report::Report report_of(const Case& one, bool truth = true) {
  jobs::EstimatedRecording found;
  found.recording.path = "unit <1>.lvx";
  found.recording.header.devices.emplace_back();
  found.choice.sensor = found.nominal = sensors::load_sensor("mid-40");
  found.choice.words = "the file says so";
  found.estimate = one.estimate;
  if (truth) {
    found.evaluation = estimation::evaluate(one.estimate, one.settings.truth, one.data.truth);
  }
  found.head = one.head;
  found.details = jobs::estimate_details(one.estimate, found.nominal, found.head, found.evaluation);
  found.provenance = {{"command", "risley estimate"}, {"seed", "5"}};
  found.warnings = {{kWarning.shots_lost, "a gap"}};
  return report::report_of(found);
}

TEST(EstimateReport, ItsFileMakesTheSamePage) {
  const report::Report report = report_of(make_case(5));
  EXPECT_EQ(report::report_page(report::parse_report(report::report_text(report), "f")),
            report::report_page(report));
}

TEST(EstimateReport, DrawsEveryDistributionOfThePaper) {
  const json::Json charts = report_of(make_case(5)).json["charts"];
  EXPECT_EQ(charts["parameters"].size(), 8u);  // Fig. 7
  EXPECT_EQ(charts["rotors"].size(), 8u);      // Figs. 8, 9, 11
  EXPECT_EQ(charts["residuals"].size(), 10u);  // Fig. 10 and over time, field and angles
  EXPECT_EQ(charts["pattern"].size(), 2u);     // Fig. 2
  for (const json::Json& some : charts) {
    for (const json::Json& chart : some) {
      for (const json::Json& series : chart["series"]) {
        EXPECT_FALSE(series["x"].empty()) << chart["title"];
        EXPECT_EQ(series["x"].size(), series["y"].size()) << chart["title"];
      }
    }
  }
  // Thinned to what a page can hold, and said so.
  const json::Json& first = charts["residuals"][0];
  EXPECT_LE(first["series"][0]["x"].size(), 4000u);
  EXPECT_THAT(first["note"].get<std::string>(),
              HasSubstr("One in 8 of the 30\u202f000 shots is drawn."));
  // The density counts every shot of its half second.
  const json::Json& density = charts["pattern"][1]["series"][0];
  double shots = 0;
  for (const json::Json& value : density["value"]) {
    shots += value.get<double>() * density["cell_width"].get<double>() *
             density["cell_height"].get<double>();
  }
  EXPECT_NEAR(shots, 501, 1e-3);
}

TEST(EstimateReport, SpeedsAreDrawnAboutTheirMean) {
  const json::Json chart = report_of(make_case(5)).json["charts"]["rotors"][0];
  EXPECT_THAT(chart["y_label"].get<std::string>(), HasSubstr("angular velocity minus -437"));
  const auto y = chart["series"][0]["y"].get<std::vector<double>>();
  for (const double change : y) EXPECT_LT(std::abs(change), 6.0);  // sqrt(2) 2.2
  const auto [least, greatest] = std::minmax_element(y.begin(), y.end());
  EXPECT_NEAR(*greatest - *least, 2 * std::sqrt(2.0) * 2.2, 0.8);
}

TEST(EstimateReport, WithoutTruthHasNoErrors) {
  const report::Report r = report_of(make_case(5), false);
  EXPECT_FALSE(r.json.contains("truth"));
  EXPECT_EQ(r.json["charts"]["rotors"].size(), 4u);
}

TEST(EstimateReport, TheFiltersPageTellsTheSameThings) {
  const report::Report r = report_of(make_case(5, Method::ekf));
  EXPECT_EQ(r.json["method"], "ekf");
  const json::Json& page = r.json["page"];
  EXPECT_EQ(page["pieces"]["failed"], 0);
  EXPECT_LT(page["pieces"]["chi2_per_degree_of_freedom"].get<double>(), 1.5);
  EXPECT_EQ(r.json["charts"]["parameters"].size(), page["correlation"]["names"].size());
  EXPECT_FALSE(page["advice"].empty());
}

}  // namespace risley::estimate_report_test
