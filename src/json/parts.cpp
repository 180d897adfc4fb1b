// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "json/parts.hpp"

#include <cmath>
#include <utility>

#include "risley/core/angle.hpp"
#include "risley/jobs/recording_input.hpp"

namespace risley::json {

Json choice_json(const jobs::SensorChoice& choice) {
  Json misfits = Json::array();
  for (const jobs::PresetMisfit& one : choice.misfits) {
    misfits.push_back({{"preset", one.preset}, {"misfit_deg", number_or_null(deg(one.misfit))}});
  }
  return {{"sensor", jobs::sensor_name(choice)},
          {"preset", choice.sensor.name},
          {"sensor_chosen_by", to_string(choice.chosen_by)},
          {"sensor_choice",
           {{"words", choice.words},
            {"fits", choice.fits ? Json(*choice.fits) : Json()},
            {"misfits", misfits},
            {"warnings", of(choice.warnings)}}}};
}

Json value_json(double value, double sigma) {
  return {{"value", deg(value)}, {"sigma", deg(sigma)}};
}

Json turn_json(bool axis_up, Json yaw, Json about_first, Json about_second) {
  const auto [first, second] = estimation::turn_names(axis_up);
  Json json{{"yaw_deg", std::move(yaw)}};
  json[first + "_deg"] = std::move(about_first);
  json[second + "_deg"] = std::move(about_second);
  return json;
}

Json vector_json(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

Json frame_json(const std::optional<estimation::FrameEstimate>& turn, bool axis_up) {
  const estimation::FrameEstimate frame = turn.value_or(estimation::FrameEstimate{});
  Json json = turn_json(axis_up, value_json(0, 0),
                        value_json(frame.turn.yaw, std::sqrt(frame.covariance(0, 0))),
                        value_json(frame.turn.pitch, std::sqrt(frame.covariance(1, 1))));
  json["estimated"] = turn.has_value();
  return json;
}

Json slips_json(const std::vector<recordings::ShotSlip>& slips) {
  Json list = Json::array();
  for (const recordings::ShotSlip& slip : slips) {
    list.push_back({{"row", slip.row}, {"shots", nullptr}});
    if (slip.counted) list.back()["shots"] = slip.shots;
  }
  return list;
}

Json of(const std::vector<Warning>& warnings) {
  Json list = Json::array();
  for (const Warning& warning : warnings) {
    list.push_back({{"code", warning.code.name}, {"message", warning_text(warning)}});
    const auto add = [&](const char* key, std::uint64_t value) { list.back()[key] = value; };
    if (warning.place.byte_offset) add("byte_offset", *warning.place.byte_offset);
    if (warning.place.line) add("line", *warning.place.line);
    if (warning.lost_records > 0) add("lost_records", warning.lost_records);
  }
  return list;
}

Json weak_direction_json(const estimation::WeakDirection& direction) {
  Json weights = Json::object();
  for (const auto& [name, weight] : direction.weights) weights[name] = weight;
  return {{"direction", weights}, {"ratio", direction.ratio}, {"sigma", direction.sigma}};
}

Json all_warnings(std::vector<Warning> of_job, const std::vector<Warning>& own) {
  append(of_job, own);
  return of(of_job);
}

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

namespace {

/// That all beams share.
Json rotation_json(const calibration::DirectionErrors& errors) {
  return {{"roll", deg(errors.rotation.x)},
          {"pitch", deg(errors.rotation.y)},
          {"yaw", deg(errors.rotation.z)}};
}

}  // namespace

Json pointing_json(const calibration::PointingError& pointing) {
  const calibration::DirectionErrors& errors = pointing.errors;
  const auto known = [](double value, double sigma) {
    return Json{{"value", deg(value)}, {"sigma", number_or_null(deg(sigma))}};
  };
  return {{"total_deg", known(errors.total, pointing.total_sigma)},
          {"shared_deg", known(errors.gauge, pointing.gauge_sigma)},
          {"shape_deg", known(errors.shape, pointing.shape_sigma)},
          {"worst_deg", known(pointing.worst_shape, pointing.worst_shape_sigma)},
          {"rotation_deg", rotation_json(errors)}};
}

Json tolerance_json(double tolerance) { return tolerance > 0 ? Json(deg(tolerance)) : Json(); }

Json errors_json(const calibration::DirectionErrors& e) {
  return {{"azimuth_rmse_deg", deg(e.azimuth_rmse)},
          {"zenith_rmse_deg", deg(e.zenith_rmse)},
          {"azimuth_bias_deg", deg(e.azimuth_bias)},
          {"zenith_bias_deg", deg(e.zenith_bias)},
          {"total_deg", deg(e.total)},
          {"gauge_deg", deg(e.gauge)},
          {"shape_deg", deg(e.shape)},
          {"rotation_deg", rotation_json(e)}};
}

Json slips_of_all(const std::vector<jobs::ReadRecording>& recordings) {
  Json all = Json::array();
  for (const jobs::ReadRecording& recording : recordings) {
    for (Json& slip : slips_json(recording.header.slips)) {
      slip["recording"] = recording.path;
      all.push_back(std::move(slip));
    }
  }
  return all;
}

Json plan_head(const std::string& sensor) {
  return {{"serial", nullptr},
          {"sensor", sensor},
          {"verdict",
           {{"code", "undecided"},
            {"words", "this is a plan: nothing was measured"},
            {"to_do", "record as planned, and calibrate from that"}}}};
}

}  // namespace risley::json
