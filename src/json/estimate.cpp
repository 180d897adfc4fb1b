// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>

#include "risley/jobs/estimate_recording.hpp"
#include "risley/json/results.hpp"

#include "json/parts.hpp"

namespace risley::json {
namespace {

Json moments_json(const estimation::Moments& moments) {
  return {{"mean", deg(moments.mean)},
          {"std", deg(moments.std)},
          {"rms", deg(moments.rms)},
          {"skewness", moments.skewness},
          {"kurtosis", moments.kurtosis}};
}

Json evaluation_json(const estimation::Evaluation& evaluation, TrainShape shape) {
  Json parameters = Json::object();
  for (const estimation::TruthComparison& one : evaluation.parameters) {
    parameters[one.name] = {{"true", in_file_unit(one.name, one.truth, shape)},
                            {"error", in_file_unit(one.name, one.error, shape)},
                            {"error_over_sigma", one.error_over_sigma}};
  }
  const auto by_prism = [](const std::vector<double>& values, double scale) {
    Json object = Json::object();
    for (std::size_t i = 0; i < values.size(); ++i) {
      object[std::string(1, prism_letter(static_cast<int>(i)))] = scale * values[i];
    }
    return object;
  };
  return {
      {"parameters", parameters},
      {"rotation_angle_rmse_deg", by_prism(evaluation.rotation_angle_rmse, kDegreesPerRadian)},
      {"rotation_angle_rmse_over_sigma", by_prism(evaluation.rotation_angle_rmse_over_sigma, 1.0)},
      {"angular_velocity_rmse_deg_per_s",
       by_prism(evaluation.angular_velocity_rmse, kDegreesPerRadian)},
      {"angular_velocity_rmse_over_sigma",
       by_prism(evaluation.angular_velocity_rmse_over_sigma, 1.0)},
      {"nees_parameters", evaluation.nees_parameters},
      {"nees_rotation_angles", evaluation.nees_rotation_angles}};
}

Json start_json(const estimation::Start& start) {
  Json angles = Json::object(), speeds = Json::object();
  for (std::size_t i = 0; i < start.rotation_angle.size(); ++i) {
    const std::string letter(1, prism_letter(static_cast<int>(i)));
    angles[letter] = deg(start.rotation_angle[i]);
    speeds[letter] = deg(start.angular_velocity[i]);
  }
  return {{"time_ns", start.time_ns},
          {"rotation_angle_deg", angles},
          {"angular_velocity_deg_per_s", speeds},
          {"residual_rms_deg", deg(start.residual_rms)}};
}

/// Conclusion from the rotors about the clock, and the shot rate with which they would turn as
/// usual.
Json shot_clock_json(const jobs::EstimatedRecording& found) {
  if (!found.estimate.speed_factor) return nullptr;
  const estimation::SpeedFactor& factor = *found.estimate.speed_factor;
  Json clock = {{"speed_factor", {{"value", factor.value}, {"sigma", factor.sigma}}},
                {"shot_rate_hz", nullptr}};
  const double rate = found.recording.header.counted_rate;
  if (rate > 0) clock["shot_rate_hz"] = rate / factor.value;
  return clock;
}

/// Parameters of the prisms that the estimation did not touch.
Json fixed_json(const estimation::Estimate& estimate) {
  std::vector<int> free_places;
  for (const estimation::FreeParameter& free : estimate.free) {
    free_places.insert(free_places.end(), free.places.begin(), free.places.end());
  }
  Json object = Json::object();
  for (const ParameterInfo& info : parameter_list(estimate.sensor.shape())) {
    if (info.kind != ParameterKind::train || info.places.size() > 1) continue;
    if (std::find(free_places.begin(), free_places.end(), info.places.front()) !=
        free_places.end()) {
      continue;
    }
    object[info.name] = estimate.sensor.get(info.name) / info.si_per_unit;
  }
  return object;
}

/// Under the names used in lidar odometry programs, in their units.
Json noise_model_json(const estimation::NoiseModel& model) {
  const auto known = [](const std::optional<double>& value, double scale) {
    return value ? Json(scale * *value) : Json(nullptr);
  };
  return {{"range_m", model.range},
          {"range_distance_m", model.range_distance},
          {"range_source", model.range_source},
          {"azimuth_deg", deg(model.azimuth)},
          {"zenith_deg", deg(model.zenith)},
          {"direction_deg", deg(model.direction)},
          {"point_variance_m2", model.point_variance()},
          {"shared",
           {{"direction_deg", known(model.shared_direction, kDegreesPerRadian)},
            {"direction_source", model.shared_direction_source},
            {"range_m", known(model.shared_range, 1)},
            {"range_source", model.shared_range_source}}},
          {"settings",
           {{"VoxelMap",
             {{"noise_model/ranging_cov", model.range},
              {"noise_model/angle_cov", deg(model.direction)}}},
            {"FAST-LIVO2", {{"lio/dept_err", model.range}, {"lio/beam_err", deg(model.direction)}}},
            {"Point-LIO", {{"mapping/lidar_meas_cov", model.point_variance()}}},
            {"FAST-LIO", {{"LASER_POINT_COV", model.point_variance()}}}}}};
}

}  // namespace

Json of(const jobs::EstimatedRecording& found) {
  const estimation::Estimate& e = found.estimate;
  const TrainShape shape = e.sensor.shape();
  Json parameters = Json::object();
  for (const estimation::EstimatedValue& value : e.values) {
    parameters[value.name] = {
        {"value", in_file_unit(value.name, value.value, shape)},
        {"sigma", in_file_unit(value.name, value.sigma, shape)},
        {"sigma_given_held", in_file_unit(value.name, value.sigma_given_held, shape)}};
  }
  Json rotors = Json::array(), jerks = Json::array(), unobservable = Json::array();
  for (const estimation::RotorProcess& process : e.rotor_process) {
    rotors.push_back(deg(process.acceleration));
    jerks.push_back(deg(process.jerk));
  }
  Json uneven = Json::object();
  for (std::size_t k = 0; k < e.residuals_over_angle.size(); ++k) {
    uneven[std::string(1, prism_letter(static_cast<int>(k)))] =
        e.residuals_over_angle[k].chi2_per_bin;
  }
  for (const estimation::WeakDirection& weak : e.unobservable) {
    unobservable.push_back(weak_direction_json(weak));
  }
  Json object = {
      {"serial", found.recording.serial()},
      {"verdict", verdict_json(e.verdict)},
      {"converged", e.converged},
      {"reason", e.reason},
      {"method", to_string(e.method)},
      {"observations_used", e.series.size() - e.unused_shots},
      {"outliers", e.outliers},
      {"combination", nullptr},
      {"mirrored", e.mirrored},
      {"parameters", parameters},
      {"fixed", fixed_json(e)},
      {"residuals",
       {{"azimuth_deg", moments_json(e.azimuth_moments)},
        {"zenith_deg", moments_json(e.zenith_moments)},
        {"expected_rms_deg", deg(e.expected_residual)}}},
      {"noise",
       {{"azimuth_deg", value_json(e.noise.value.azimuth, e.noise.sigma.azimuth)},
        {"zenith_deg", value_json(e.noise.value.zenith, e.noise.sigma.zenith)},
        {"held", e.noise_held}}},
      {"frame", frame_json(e.frame_turn, e.sensor.train.layout().axis_up)},
      {"slips", slips_json(found.recording.header.slips)},
      {"shot_clock", shot_clock_json(found)},
      {"coordinates", to_string(e.coordinates)},
      {"process_noise_deg_per_s_per_sqrt_s", rotors},
      {"process_jerk_deg_per_s2_per_sqrt_s", jerks},
      {"unobservable", unobservable},
      {"residuals_over_angle_chi2_per_bin", uneven},
      {"rotation_angle_time_ns", e.series.time_ns(estimation::first_used_shot(e))},
      {"start", start_json(e.start)},
      {"warnings", all_warnings(found.warnings, e.warnings)},
      {"seconds",
       {{"read", found.reading_time}, {"solve", found.solving_time}, {"total", found.total_time}}}};
  object.update(choice_json(found.choice));
  object["iterations"] = e.iterations;
  object["residuals"]["autocorrelation"] =
      e.autocorrelation.rho.empty() ? 0.0 : e.autocorrelation.rho.front();
  object["residuals"]["autocorrelation_factor"] = e.autocorrelation.factor;
  object["residuals"]["unit_variance"] = e.unit_variance;
  object["residuals"]["variance_factor"] = e.variance_factor;
  if (e.sensor.combination) object["combination"] = *e.sensor.combination;
  if (found.noise_model) object["noise_model"] = noise_model_json(*found.noise_model);
  if (found.evaluation) object["truth"] = evaluation_json(*found.evaluation, shape);
  return object;
}

}  // namespace risley::json
