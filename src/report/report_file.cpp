// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/report_file.hpp"

#include <optional>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/json_text.hpp"
#include "risley/io/text_file.hpp"
#include "risley/report/calibration_page.hpp"
#include "risley/report/estimate_page.hpp"
#include "risley/report/flight_page.hpp"

#include "report/chart_fields.hpp"
#include "report/check_report.hpp"
#include "report/json_archive.hpp"

namespace risley {

template <class Archive, report::FieldsOf<Vector3<double>> T>
void fields(Archive& archive, T& vector) {
  archive("x", vector.x);
  archive("y", vector.y);
  archive("z", vector.z);
}

namespace recordings {

template <class Archive, report::FieldsOf<ValueRange> T>
void fields(Archive& archive, T& range) {
  archive("min", range.min);
  archive("max", range.max);
}

template <class Archive, report::FieldsOf<TimeGaps> T>
void fields(Archive& archive, T& gaps) {
  archive("count", gaps.count);
  archive("total_s", gaps.total_s);
  archive("largest_s", gaps.largest_s);
  archive("largest_after_ns", gaps.largest_after_ns);
  archive("largest_at_row", gaps.largest_at_row);
}

/// Without the counts by return, tag, device and packet, which reports do not show.
template <class Archive, report::FieldsOf<TimeAuditResult> T>
void fields(Archive& archive, T& audit) {
  archive("observations", audit.observations);
  archive("shots", audit.shots);
  archive("no_return", audit.no_return);
  archive("first_time_ns", audit.first_time_ns);
  archive("last_time_ns", audit.last_time_ns);
  archive("duration_s", audit.duration_s);
  archive("nominal_step_s", audit.nominal_step_s);
  archive("rate_hz", audit.rate_hz);
  archive("gaps", audit.gaps);
  archive("time_resets", audit.time_resets);
  archive("non_monotonic_packets", audit.non_monotonic_packets);
  archive("pps_wraps", audit.pps_wraps);
  archive("azimuth_rad", audit.azimuth);
  archive("zenith_rad", audit.zenith);
  archive("range_m", audit.range);
}

}  // namespace recordings

namespace estimation {

template <class Archive, report::FieldsOf<Moments> T>
void fields(Archive& archive, T& moments) {
  archive("count", moments.count);
  archive("mean", moments.mean);
  archive("std", moments.std);
  archive("rms", moments.rms);
  archive("skewness", moments.skewness);
  archive("kurtosis", moments.kurtosis);
}

template <class Archive, report::FieldsOf<WeakDirection> T>
void fields(Archive& archive, T& weak) {
  archive("weights", weak.weights);
  archive("ratio", weak.ratio);
  archive("sigma", weak.sigma);
}

}  // namespace estimation

namespace calibration {

std::span<const char* const> enum_names(CalibrationMethod) {
  static constexpr const char* kNames[] = {"adjustment", "paper"};
  return kNames;
}

std::span<const char* const> enum_names(DatumKind) {
  static constexpr const char* kNames[] = {"none", "planes", "stations", "both"};
  return kNames;
}

template <class Archive, report::FieldsOf<DirectionErrors> T>
void fields(Archive& archive, T& errors) {
  archive("azimuth_rmse", errors.azimuth_rmse);
  archive("zenith_rmse", errors.zenith_rmse);
  archive("azimuth_bias", errors.azimuth_bias);
  archive("zenith_bias", errors.zenith_bias);
  archive("total", errors.total);
  archive("gauge", errors.gauge);
  archive("shape", errors.shape);
  archive("rotation", errors.rotation);
}

template <class Archive, report::FieldsOf<FormalDatum> T>
void fields(Archive& archive, T& datum) {
  archive("sigma_roll", datum.sigma_roll);
  archive("sigma_pitch", datum.sigma_pitch);
  archive("sigma_yaw", datum.sigma_yaw);
  archive("gauge", datum.gauge);
  archive("shape", datum.shape);
  archive("total", datum.total);
}

template <class Archive, report::FieldsOf<PointingError> T>
void fields(Archive& archive, T& pointing) {
  archive("errors", pointing.errors);
  archive("total_sigma", pointing.total_sigma);
  archive("gauge_sigma", pointing.gauge_sigma);
  archive("shape_sigma", pointing.shape_sigma);
  archive("worst_shape", pointing.worst_shape);
  archive("worst_shape_sigma", pointing.worst_shape_sigma);
}

template <class Archive, report::FieldsOf<PriorTest> T>
void fields(Archive& archive, T& test) {
  archive("name", test.name);
  archive("station", test.station);
  archive("misfit", test.misfit);
  archive("chi2", test.chi2);
  archive("degrees_of_freedom", test.degrees_of_freedom);
  archive("critical", test.critical);
}

template <class Archive, report::FieldsOf<CalibratedPlane> T>
void fields(Archive& archive, T& plane) {
  archive("name", plane.name);
  archive("recording", plane.recording);
  archive("normal", plane.normal);
  archive("distance_m", plane.distance);
  archive("points", plane.points);
  archive("outliers", plane.outliers);
  archive("rms_m", plane.rms);
  archive("rms_before_m", plane.rms_before);
  archive("range_sigma_m", plane.range_sigma);
}

template <class Archive, report::FieldsOf<CalibratedNumber> T>
void fields(Archive& archive, T& number) {
  archive("name", number.name);
  archive("value", number.value);
  archive("prior", number.prior);
  archive("prior_sigma", number.prior_sigma);
  archive("sigma", number.sigma);
  archive("total_sigma", number.total_sigma);
}

template <class Archive, report::FieldsOf<ShapeParameters> T>
void fields(Archive& archive, T& shape) {
  archive("sigma_m", shape.sigma);
  archive("length_m", shape.length);
  archive("white_m", shape.white);
}

template <class Archive, report::FieldsOf<SurfaceStep> T>
void fields(Archive& archive, T& step) {
  archive("recording", step.recording);
  archive("plane", step.plane);
  archive("height_m", step.height);
  archive("azimuth", step.azimuth);
  archive("zenith", step.zenith);
  archive("size", step.size);
  archive("points", step.points);
}

template <class Archive, report::FieldsOf<FlightUnknown> T>
void fields(Archive& archive, T& unknown) {
  archive("name", unknown.name);
  archive("start", unknown.start);
  archive("value", unknown.value);
  archive("sigma", unknown.sigma);
  archive("prior_sigma", unknown.prior_sigma);
  archive("held", unknown.held);
  archive("prior_share", unknown.prior_share);
  archive("twin", unknown.twin);
  archive("twin_correlation", unknown.twin_correlation);
}

template <class Archive, report::FieldsOf<FlightDatum> T>
void fields(Archive& archive, T& datum) {
  archive("sigma_x", datum.sigma_x);
  archive("sigma_y", datum.sigma_y);
  archive("sigma_z", datum.sigma_z);
  archive("rotation", datum.rotation);
  archive("shape", datum.shape);
  archive("total", datum.total);
  archive("height_m", datum.height);
}

template <class Archive, report::FieldsOf<NotTold> T>
void fields(Archive& archive, T& combination) {
  archive("words", combination.words);
  archive("sigma", combination.sigma);
}

template <class Archive, report::FieldsOf<SeenControl> T>
void fields(Archive& archive, T& seen) {
  archive("name", seen.name);
  archive("shots", seen.shots);
  archive("used", seen.used);
  archive("off_m", seen.off);
  archive("sigma_m", seen.sigma);
  archive("significant", seen.significant);
}

template <class Archive, report::FieldsOf<StripPair> T>
void fields(Archive& archive, T& pair) {
  archive("first", pair.first);
  archive("second", pair.second);
  archive("cells", pair.cells);
  archive("mean_m", pair.mean);
  archive("rms_m", pair.rms);
  archive("shift_m", pair.shift);
  archive("shift_sigma_m", pair.sigma);
}

}  // namespace calibration

namespace report {

/// East, north, up.
template <class Archive, FieldsOf<Eigen::Vector3d> T>
void fields(Archive& archive, T& vector) {
  archive("east", vector.x());
  archive("north", vector.y());
  archive("up", vector.z());
}

namespace {

constexpr const char* kFormat = "risley report";
constexpr int kFormatVersion = 1;
/// What a calibration was made on, where a file says so: walls otherwise.
constexpr const char* kFlight = "flight";

/// What read_report() found.
template <class AnyReport>
AnyReport checked_report(FieldReader& reader) {
  AnyReport report;
  fields(reader, report);
  check_report(report);
  return report;
}

}  // namespace

template <class Archive, FieldsOf<ReportedVerdict> T>
void fields(Archive& archive, T& verdict) {
  archive("code", verdict.code);
  archive("words", verdict.words);
  archive("to_do", verdict.to_do);
}

template <class Archive, FieldsOf<ReportedParameter> T>
void fields(Archive& archive, T& row) {
  archive("name", row.name);
  archive("value", row.value);
  archive("sigma", row.sigma);
  archive("sigma_given_held", row.sigma_given_held);
  archive("nominal", row.nominal);
  archive("believed", row.believed);
  archive("truth", row.truth);
  archive("error", row.error);
  archive("error_over_sigma", row.error_over_sigma);
}

template <class Archive, FieldsOf<ReportedRecording> T>
void fields(Archive& archive, T& recording) {
  archive("name", recording.name);
  archive("format", recording.format);
  archive("time_from", recording.time_from);
  archive("audit", recording.audit);
}

template <class Archive, FieldsOf<EstimateReport::Noise> T>
void fields(Archive& archive, T& noise) {
  archive("held", noise.held);
  archive("azimuth", noise.azimuth);
  archive("azimuth_sigma", noise.azimuth_sigma);
  archive("zenith", noise.zenith);
  archive("zenith_sigma", noise.zenith_sigma);
  archive("usual", noise.usual);
}

template <class Archive, FieldsOf<EstimateReport::Frame> T>
void fields(Archive& archive, T& frame) {
  archive("yaw", frame.yaw);
  archive("yaw_sigma", frame.yaw_sigma);
  archive("pitch", frame.pitch);
  archive("pitch_sigma", frame.pitch_sigma);
}

template <class Archive, FieldsOf<EstimateReport::Variance> T>
void fields(Archive& archive, T& variance) {
  archive("unit_variance", variance.unit_variance);
  archive("autocorrelation_factor", variance.autocorrelation_factor);
  archive("variance_factor", variance.variance_factor);
}

template <class Archive, FieldsOf<EstimateReport::Truth> T>
void fields(Archive& archive, T& truth) {
  archive("rotation_angle_rmse", truth.rotation_angle_rmse);
  archive("nees_parameters", truth.nees_parameters);
  archive("nees_rotation_angles", truth.nees_rotation_angles);
}

template <class Archive, FieldsOf<EstimateReport::Pieces> T>
void fields(Archive& archive, T& pieces) {
  archive("count", pieces.count);
  archive("failed", pieces.failed);
  archive("duration_s", pieces.duration);
  archive("chi2_per_degree_of_freedom", pieces.chi2);
  archive("degrees_of_freedom", pieces.degrees_of_freedom);
}

template <class Archive, FieldsOf<EstimateReport> T>
void fields(Archive& archive, T& report) {
  archive("recording", report.recording);
  archive("sensor", report.sensor);
  archive("prisms", report.prisms);
  archive("emitters", report.emitters);
  archive("combination", report.combination);
  archive("mirrored", report.mirrored);
  archive("method", report.method);
  archive("converged", report.converged);
  archive("reason", report.reason);
  archive("verdict", report.verdict);
  archive("warnings", report.warnings);
  archive("shots", report.shots);
  archive("outliers", report.outliers);
  archive("parameters", report.parameters);
  archive("free", report.free);
  archive("covariance", report.covariance);
  archive("unobservable", report.unobservable);
  archive("advice", report.advice);
  archive("azimuth_residuals", report.azimuth_residuals);
  archive("zenith_residuals", report.zenith_residuals);
  archive("expected_residual", report.expected_residual);
  archive("noise", report.noise);
  archive("frame", report.frame);
  archive("variance", report.variance);
  archive("residuals_over_angle_chi2_per_bin", report.unevenness);
  archive("truth", report.truth);
  archive("pieces", report.pieces);
  archive("parameter_charts", report.parameter_charts);
  archive("rotor_charts", report.rotor_charts);
  archive("residual_charts", report.residual_charts);
  archive("pattern_charts", report.pattern_charts);
  archive("provenance", report.provenance);
}

template <class Archive, FieldsOf<CalibrationReport::Truth> T>
void fields(Archive& archive, T& truth) {
  archive("before", truth.before);
  archive("after", truth.after);
}

template <class Archive, FieldsOf<CalibrationReport> T>
void fields(Archive& archive, T& report) {
  archive("recordings", report.recordings);
  archive("observations", report.observations);
  archive("sensor", report.sensor);
  archive("serial", report.serial);
  archive("preset", report.preset);
  archive("prisms", report.prisms);
  archive("emitters", report.emitters);
  archive("method", report.method);
  archive("converged", report.converged);
  archive("reason", report.reason);
  archive("verdict", report.verdict);
  archive("warnings", report.warnings);
  archive("points", report.points);
  archive("parameters", report.parameters);
  archive("numbers", report.numbers);
  archive("free", report.free);
  archive("covariance", report.covariance);
  archive("unobservable", report.unobservable);
  archive("datum_kind", report.datum_kind);
  archive("datum", report.datum);
  archive("datum_without_common", report.datum_without_common);
  archive("pointing_error", report.pointing_error);
  archive("prior_tests", report.prior_tests);
  archive("planes", report.planes);
  archive("steps", report.steps);
  archive("rms_before_m", report.rms_before);
  archive("rms_after_m", report.rms_after);
  archive("sigma0", report.sigma0);
  archive("wall_shape", report.wall_shape);
  archive("truth", report.truth);
  archive("truth_charts", report.truth_charts);
  archive("pointing_charts", report.pointing_charts);
  archive("thickness_charts", report.thickness_charts);
  archive("wall_charts", report.wall_charts);
  archive("view_charts", report.view_charts);
  archive("provenance", report.provenance);
}

template <class Archive, FieldsOf<FlightReport::Truth> T>
void fields(Archive& archive, T& truth) {
  archive("before", truth.before);
  archive("after", truth.after);
  archive("values", truth.values);
}

template <class Archive, FieldsOf<FlightReport::Strip> T>
void fields(Archive& archive, T& strip) {
  archive("strip", strip.strip);
  archive("begin_s", strip.begin);
  archive("duration_s", strip.duration);
  archive("course", strip.course);
  archive("sway", strip.sway);
  archive("speed_m_per_s", strip.speed);
  archive("range_m", strip.range);
}

template <class Archive, FieldsOf<FlightReport> T>
void fields(Archive& archive, T& report) {
  archive("recordings", report.recordings);
  archive("observations", report.observations);
  archive("sensor", report.sensor);
  archive("serial", report.serial);
  archive("preset", report.preset);
  archive("prisms", report.prisms);
  archive("emitters", report.emitters);
  archive("mount", report.mount);
  archive("reference_point", report.reference_point);
  archive("body_from_sensor", report.body_from_sensor);
  archive("converged", report.converged);
  archive("reason", report.reason);
  archive("verdict", report.verdict);
  archive("warnings", report.warnings);
  archive("shots", report.shots);
  archive("without_pose", report.without_pose);
  archive("used", report.used);
  archive("outliers", report.outliers);
  archive("cells", report.cells);
  archive("rough_cells", report.rough_cells);
  archive("unknowns", report.unknowns);
  archive("nominal", report.nominal);
  archive("covariance", report.covariance);
  archive("datum", report.datum);
  archive("not_told", report.not_told);
  archive("control", report.control);
  archive("pair_count", report.pair_count);
  archive("pairs_before", report.pairs_before);
  archive("pairs_after", report.pairs_after);
  archive("rms_before_m", report.rms_before);
  archive("rms_after_m", report.rms_after);
  archive("sigma0", report.sigma0);
  archive("range_sigma_m", report.range_sigma);
  archive("roughness_m", report.roughness);
  archive("attitude_delay_s", report.attitude_delay);
  archive("attitude_delay_sigma_s", report.attitude_delay_sigma);
  archive("strip_count", report.strip_count);
  archive("strips", report.strips);
  archive("knots", report.knots);
  archive("knot_spacing_s", report.knot_spacing);
  archive("truth", report.truth);
  archive("strip_charts", report.strip_charts);
  archive("difference_charts", report.difference_charts);
  archive("ground_charts", report.ground_charts);
  archive("residual_charts", report.residual_charts);
  archive("correction_charts", report.correction_charts);
  archive("provenance", report.provenance);
}

const char* verb_of(const Report& report) {
  return std::holds_alternative<EstimateReport>(report) ? "estimate" : "calibrate";
}

std::string report_text(const Report& report) {
  const Json body = std::visit([](const auto& one) { return to_json(one); }, report);
  Json object = {
      {"format", kFormat}, {"format_version", kFormatVersion}, {"verb", verb_of(report)}};
  if (std::holds_alternative<FlightReport>(report)) object["calibrated_on"] = kFlight;
  object.update(body);
  return object.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

void write_report(const std::string& path, const Report& report) {
  io::write_text_file(path, report_text(report));
}

Report read_report(const std::string& path) { return parse_report(io::read_text_file(path), path); }

Report parse_report(const std::string& text, const std::string& path) {
  io::require_shallow_json(path, text);
  Json object;
  try {
    object = Json::parse(text);
  } catch (const Json::parse_error& error) {
    throw FileError(path, {error.byte, {}}, "from here on, the text is not JSON");
  } catch (const Json::exception& error) {  // a number beyond all that can be stored
    throw FileError(path, {}, fmt::format("the JSON cannot be read: {}", error.what()));
  }
  try {
    archive::expect(object.is_object(), "the file", "an object", object);
    std::string format, verb;
    int version = 0;
    FieldReader reader(object, "");
    reader("format", format);
    if (format != kFormat) {
      throw FieldError(fmt::format("format: expected '{}', found '{}'", kFormat, format));
    }
    reader("format_version", version);
    if (version != kFormatVersion) {
      throw FieldError(
          fmt::format("format_version: expected {}, found {}", kFormatVersion, version));
    }
    reader("verb", verb);
    if (verb == "estimate") return checked_report<EstimateReport>(reader);
    if (verb == "calibrate") {
      std::optional<std::string> calibrated_on;
      reader("calibrated_on", calibrated_on);
      if (!calibrated_on) return checked_report<CalibrationReport>(reader);
      if (*calibrated_on == kFlight) return checked_report<FlightReport>(reader);
      throw FieldError(
          fmt::format("calibrated_on: expected {}, found '{}'", kFlight, *calibrated_on));
    }
    throw FieldError(fmt::format("verb: expected estimate or calibrate, found '{}'", verb));
  } catch (const FieldError& error) {
    throw FileError(path, {}, error.what());
  }
}

std::string report_page(const Report& report) {
  if (const auto* estimate = std::get_if<EstimateReport>(&report)) return estimate_page(*estimate);
  if (const auto* flight = std::get_if<FlightReport>(&report)) return flight_page(*flight);
  return calibration_page(std::get<CalibrationReport>(report));
}

}  // namespace report
}  // namespace risley
