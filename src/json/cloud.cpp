// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "risley/jobs/cloud_of_recording.hpp"
#include "risley/jobs/cloud_of_stations.hpp"
#include "risley/json/results.hpp"

#include "json/parts.hpp"

namespace risley::json {
namespace {

using cloud::PointDistributionSummary;
using cloud::StripDistribution;

Json strip_json(const StripDistribution& s) {
  Json places = Json::object(), densities = Json::array();
  for (std::size_t k = 0; k < s.place_density.size(); ++k) {
    places[fmt::format("{:g}", cloud::kSwathPlaces[k])] = number_or_null(s.place_density[k]);
  }
  Json largest = Json::array();
  for (const double diameter : s.largest_empty) largest.push_back(number_or_null(diameter));
  return {{"strip", s.strip},
          {"name", s.name},
          {"points", s.points},
          {"length_m", s.length},
          {"height_m", number_or_null(s.height)},
          {"swath_m", s.width},
          {"dense_swath_m", number_or_null(s.dense_width)},
          {"nominal_density_per_m2", number_or_null(s.density)},
          {"nominal_spacing_m", number_or_null(s.spacing)},
          {"middle_density_per_m2", number_or_null(s.middle_density)},
          {"density_at_share_of_half_swath_per_m2", places},
          {"cell_variation", number_or_null(s.cell_variation)},
          {"cells_covered", number_or_null(s.cells_covered)},
          {"spacing_cells_covered", number_or_null(s.spacing_cells_covered)},
          {"empty_share", number_or_null(s.empty_share)},
          {"largest_empty_m", largest},
          {"seen_in_full_m2", s.whole_ground},
          {"circles_looked_for_m2", s.circles_ground},
          {"profile",
           {{"stripe_m", s.profile.stripe},
            {"across_m", s.profile.across},
            {"density_per_m2", s.profile.density}}}};
}

Json calibration_json(const jobs::RecordingCloud& made) {
  const bool is_none = made.calibrated_against == sensors::CalibrationReference::none;
  return {{"path", made.calibration},
          {"calibrated_against", is_none ? Json() : Json(to_string(made.calibrated_against))}};
}

/// One of the stations: its part of a cloud's result, and its pose.
Json station_json(const jobs::StationCloud& one) {
  Json json = of(one.cloud);
  for (const char* of_all :
       {"format", "output", "without_pose", "strips", "frame", "point_frame", "common_factors",
        "warnings", "calibration", "file", "byte_offset", "line"}) {
    json.erase(of_all);
  }
  json["name"] = one.name;
  json["position_m"] = {{"value", vector_json(one.pose.place)},
                        {"sigma", vector_json(one.pose.sigma)}};
  const auto& [roll, pitch, heading] = one.pose.angles;
  const auto& sigma = one.pose.angle_sigma;
  json["roll_deg"] = value_json(roll, sigma.roll);
  json["pitch_deg"] = value_json(pitch, sigma.pitch);
  json["heading_deg"] = value_json(heading, sigma.heading);
  if (!one.adjusted) return json;
  Json targets = Json::array();
  for (std::size_t t = 0; t < one.targets.size(); ++t) {
    targets.push_back({{"name", one.targets[t].name},
                       {"points", one.measured[t].points},
                       {"in_scan_m", vector_json(one.measured[t].at)},
                       {"residual_m", vector_json(one.adjusted->residuals[t])}});
  }
  json["targets"] = targets;
  json["fit"] = {{"chi2", one.adjusted->chi2},
                 {"degrees_of_freedom", one.adjusted->degrees_of_freedom},
                 {"p_value", one.adjusted->p_value}};
  return json;
}

}  // namespace

Json distribution_json(const PointDistributionSummary& d) {
  Json strips = Json::array();
  for (const StripDistribution& strip : d.strips) strips.push_back(strip_json(strip));
  return {{"empty_circle_m", d.empty_circle},
          {"density_cell_m", d.density_cell},
          {"points", d.points},
          {"points_of_no_strip", d.other_points},
          {"area_m2", d.area},
          {"aggregate_density_per_m2", number_or_null(d.density)},
          {"aggregate_spacing_m", number_or_null(d.spacing)},
          {"low_density_per_m2", number_or_null(d.low_density)},
          {"median_density_per_m2", number_or_null(d.median_density)},
          {"cells_covered", number_or_null(d.covered)},
          {"overlap", number_or_null(d.overlap)},
          {"strips", strips}};
}

Json of(const jobs::RecordingCloud& made) {
  const cloud::CloudSummary& s = made.summary;
  Json json = {
      {"points", s.points},
      {"format", s.format},
      {"input", made.recording},
      {"output", made.output},
      {"observations", s.observations},
      {"no_return", s.no_return},
      {"outliers", s.outliers},
      {"without_rotation_angle", s.without_rotation_angle},
      {"without_pose", s.without_pose},
      {"strips", s.strips.size()},
      {"frame", frame_json()},
      {"point_frame", s.frame},
      {"mirrored", s.mirrored},
      {"residuals",
       {{"azimuth_deg", {{"rms", deg(s.azimuth_residual_rms)}}},
        {"zenith_deg", {{"rms", deg(s.zenith_residual_rms)}}}}},
      {"repointing_deg", {{"rms", deg(s.repointing_rms)}}},
      {"common_factors", s.factors},
      {"slips", slips_json(s.slips)},
      {"warnings", of(s.warnings)},
  };
  if (s.damage) json.update(of(*s.damage));
  json["calibration"] = calibration_json(made);
  if (s.distribution) json["distribution"] = distribution_json(*s.distribution);
  return json;
}

Json of(const jobs::CloudOfStations& made) {
  Json stations = Json::array();
  std::vector<Warning> warnings;
  for (const jobs::StationCloud& one : made.stations) {
    stations.push_back(station_json(one));
    for (const Warning& warning : one.cloud.summary.warnings) {
      warnings.push_back(of_file(one.cloud.recording, warning));
    }
  }
  return {{"points", made.points()},
          {"format", made.format},
          {"output", made.output},
          {"point_frame", made.frame},
          {"common_factors", made.factors},
          {"factors_of_one_station", made.factors_of_source},
          {"calibration", calibration_json(made.stations.front().cloud)},
          {"stations", stations},
          {"warnings", of(warnings)}};
}

}  // namespace risley::json
