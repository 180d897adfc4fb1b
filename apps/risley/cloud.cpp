// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/jobs/beam_origins.hpp"
#include "risley/jobs/cloud_of_recording.hpp"
#include "risley/jobs/recording_input.hpp"
#include "risley/report/beam_origin_page.hpp"
#include "risley/report/cloud_page.hpp"
#include "risley/report/distribution_page.hpp"
#include "risley/sensors/preset.hpp"

#include "command.hpp"
#include "distribution_text.hpp"
#include "many_files.hpp"
#include "option_names.hpp"
#include "platform_options.hpp"
#include "reading_options.hpp"
#include "recording_text.hpp"
#include "result_folder.hpp"

namespace risley::app {
namespace {

struct CloudCommandOptions {
  ManyWishes many;
  std::string output, calibration, format, beam_origin_map, distribution, report;
  std::string directions = "smoothed", beam_origin = "yes", beam_divergence = "yes",
              covariance = "yes", common_factors = "no", time = "gps";
  std::string rate_hz = fmt::format("{:.0f}", cloud::kTrackingRate);
  std::optional<double> noise_angle_deg;
  double las_scale_m = cloud::CloudWriterOptions{}.las_scale;
  ReadingWishes reading;
  jobs::PlatformFiles platform;
};

std::string cloud_endings() {
  std::string text;
  for (const cloud::CloudFormat& format : cloud::cloud_formats()) {
    text += fmt::format("\n  {:<8} {} ({})", format.ending, format.description, format.name);
  }
  return text;
}

std::set<std::string> cloud_format_names() {
  std::set<std::string> names;
  for (const auto& format : cloud::cloud_formats()) names.insert(format.name);
  return names;
}

cloud::CloudOptions cloud_options(const CloudCommandOptions& options) {
  cloud::CloudOptions result;
  result.pointing.reported_directions = options.directions == "reported";
  result.pointing.beam_origin = options.beam_origin == "yes";
  result.pointing.beam_divergence = options.beam_divergence == "yes";
  result.pointing.covariance = options.covariance == "yes";
  result.loadings = options.common_factors == "yes";
  result.rate.reset();
  if (options.rate_hz != "full") {
    result.rate = positive_number(options.rate_hz, "--rate-hz", "Hz");
  }
  result.angle_noise = noise_angle(options.noise_angle_deg);
  check_positive(options.las_scale_m, "--las-scale-m", "m");
  result.writer.las_scale = options.las_scale_m;
  result.writer.gps_time = options.time == "gps";
  if (!options.distribution.empty()) result.distribution.emplace();
  if (!options.report.empty()) result.sample = report::kCloudPagePoints;
  return result;
}

/// What sent the beams where the points are.
std::string calibration_text(const jobs::RecordingCloud& made) {
  using sensors::CalibrationReference;
  return fmt::format("{} ({})", made.calibration,
                     made.calibrated_against == CalibrationReference::none ? "a preset"
                     : made.calibrated_against == CalibrationReference::directions
                         ? "an estimate; only walls tell whether it is true"
                         : "a calibration");
}

/// The maps of where beams start.
ExitStatus write_beam_origin_map(const CloudCommandOptions& options, const CommonOptions& common) {
  const sensors::Sensor calibration = sensors::load_sensor(options.calibration);
  const jobs::BeamOrigins found = jobs::beam_origins(calibration);
  write_page_file(options.beam_origin_map,
                  report::beam_origin_page(found.map, calibration, provenance_of(common)));
  if (common.json) {
    Json json = {{"html", options.beam_origin_map}};
    json.update(json::of(found));
    print_json(common, json);
  } else {
    say("{}: beams start {:.1f} to {:.1f} mm beside the origin in Y, {:.1f} to {:.1f} mm in Z\n",
        options.beam_origin_map, 1e3 * found.least_y, 1e3 * found.greatest_y, 1e3 * found.least_z,
        1e3 * found.greatest_z);
  }
  return kDone;
}

FileOutcome make_one(const FileJob& job, const CloudCommandOptions& options,
                     const cloud::CloudOptions& settings, const jobs::Provenance& provenance,
                     const Progress& progress) {
  jobs::RecordingCloud made =
      jobs::cloud_of_recording({job.input, read_options(options.reading, job), options.calibration,
                                job.output, options.platform, settings, provenance},
                               progress);
  cloud::CloudSummary& s = made.summary;
  put_flags(s.warnings);
  log_warnings(job.input, s.read_warnings);
  for (const std::string& warning : s.warnings) spdlog::warn("{}: {}", job.input, warning);
  if (s.damage) {
    spdlog::error("{}; the {} points before it are saved in {}", s.damage->what(), s.points,
                  job.output);
  }
  if (s.distribution) {
    write_page_file(options.distribution,
                    report::distribution_page(*s.distribution, job.input, provenance));
  }
  if (s.sample) {
    write_page_file(options.report, report::cloud_page(s, job.input, provenance));
  }
  std::string text = fmt::format("{}: {} points", job.output, grouped(s.points));
  if (s.no_return > 0) text += fmt::format(", {} shots without return", grouped(s.no_return));
  if (s.outliers > 0) {
    text += fmt::format(", {} outlier{} left out", grouped(s.outliers), s.outliers == 1 ? "" : "s");
  }
  if (s.without_rotation_angle > 0) {
    text += fmt::format(", {} without rotation angles", grouped(s.without_rotation_angle));
  }
  if (s.without_pose > 0) {
    text += fmt::format(", {} outside the trajectory left out", grouped(s.without_pose));
  }
  text += fmt::format("; beams by {}", calibration_text(made));
  Json json = with_status(json::of(made), s.damage);
  if (s.sample) json["html"] = options.report;
  return {s.damage ? kBadFile : kDone, std::move(json), text};
}

}  // namespace

Run declare_cloud(CLI::App& verb) {
  const auto options = std::make_shared<CloudCommandOptions>();
  CloudCommandOptions& o = *options;
  const auto yes_no = [&verb](const char* name, std::string& value, const char* description) {
    verb.add_option(name, value, description)
        ->check(CLI::IsMember({"yes", "no"}))
        ->capture_default_str();
  };
  auto* inputs = add_many_options(verb, o.many, "Recordings with ranges");
  verb.add_option(
          "--calibration", o.calibration,
          "calibration.yaml of estimate or calibrate, the folder that holds it, or a preset by "
          "name")
      ->required();
  auto* output = verb.add_option("-o,--output", o.output,
                                 "Cloud to write, or a folder for several, which is made where it "
                                 "is missing and in which they "
                                 "are placed as the inputs are; the ending chooses the format:" +
                                     cloud_endings());
  verb.add_option(
          "--format", o.format,
          "Format to write, whatever the ending (default: by the ending, las-1.4 in a folder)")
      ->check(CLI::IsMember(cloud_format_names()));
  verb.add_option(
          "--directions", o.directions,
          "Directions of the points: 'smoothed', where the calibration sends the beam at the "
          "smoothed rotation angles; 'reported', as the sensor reports them")
      ->check(CLI::IsMember({"smoothed", "reported"}))
      ->capture_default_str();
  yes_no("--beam-origin", o.beam_origin,
         "Let beams start where they leave the last prism; 'no': at the sensor's origin");
  yes_no("--covariance", o.covariance, "Write the covariance of every point");
  yes_no("--beam-divergence", o.beam_divergence,
         "Include the size of the beam's footprint in the covariance");
  yes_no("--common-factors", o.common_factors,
         "Write, for every point, the loadings of the errors that all points share, from which "
         "covariances between points follow");
  add_reading_options(verb, o.reading);
  add_every_device(verb, o.reading);
  add_platform_options(verb, o.platform);
  verb.add_option(
      "--crs", o.platform.crs,
      "Coordinate reference system of a moving sensor's points, such as EPSG:25832, or "
      "EPSG:25832+7837 with a height system (default: UTM on WGS 84, ellipsoidal heights)");
  verb.add_option("--datum", o.platform.datum,
                  "Datum of the trajectory: EPSG:4979 is WGS 84, EPSG:4937 is ETRS89 (default: "
                  "EPSG:4979)");
  verb.add_option(
          "--distribution", o.distribution,
          "Page (HTML) to write about how the points of one flight lie on the ground; --json has "
          "its numbers")
      ->needs("--trajectory");
  verb.add_option(
      "--report", o.report,
      "Page (HTML) to write that shows the points of one recording in three dimensions, coloured "
      "by uncertainty, height, intensity or angle of incidence");
  verb.add_option(
          "--rate-hz", o.rate_hz,
          "Directions per second, Hz, to find the rotation angles from; 'full': all of them")
      ->capture_default_str();
  verb.add_option(
      "--noise-angle-deg", o.noise_angle_deg,
      "1 sigma of azimuth and zenith before rounding, deg (default: the calibration's)");
  verb.add_option("--las-scale-m", o.las_scale_m, "Resolution of the coordinates in LAS files, m")
      ->capture_default_str();
  verb.add_option("--time", o.time,
                  "Times in LAS files: 'gps', GPS time where the recording's clock is UTC; "
                  "'recording', the recording's clock as it is")
      ->check(CLI::IsMember({"gps", "recording"}))
      ->capture_default_str();
  verb.add_option(
          "--beam-origin-map", o.beam_origin_map,
          "Page (HTML) to write with maps of where the calibration's beams start; no cloud is made")
      ->excludes(inputs, output);
  return [options, &verb](const CommonOptions& common) {
    cloud::CloudOptions settings = cloud_options(*options);
    if (!options->beam_origin_map.empty()) {
      require_apart(common, {options->beam_origin_map});
      return write_beam_origin_map(*options, common);
    }
    if (options->many.inputs.empty() && options->many.list.empty()) {
      throw InvalidArgument("INPUT is missing: a recording, or --list");
    }
    if (options->output.empty()) throw InvalidArgument("--output is missing");
    std::string ending;
    const bool folder = output_is_folder(options->many, options->output);
    if (folder) {
      if (options->format.empty()) options->format = cloud::cloud_formats().front().name;
      ending = cloud::find_cloud_format("", options->format).ending;
    }
    FileJobs files = file_jobs(options->many, options->output, folder, ending);
    read_options(options->reading);  // wrong options are told before anything is read
    split_by_device(options->reading, files);
    for (const auto& [name, page] : {std::pair{"--distribution", options->distribution},
                                     std::pair{"--report", options->report}}) {
      if (page.empty() || files.jobs.size() == 1) continue;
      throw InvalidArgument(
          fmt::format("{} is of one recording, and there are {}", name, files.jobs.size()));
    }
    settings.writer.format = options->format;
    FileWork work;
    work.label = "making points";
    work.counted = "points";
    work.files = [&](const FileJob& job) {
      std::vector<std::string> names = {job.output};
      for (const std::string& page : {options->distribution, options->report}) {
        if (!page.empty()) names.push_back(page);
      }
      return names;
    };
    work.run = [&](const FileJob& job, const Progress& progress) {
      return make_one(job, *options, settings, provenance_of(common), progress);
    };
    return run_file_jobs(files, work, options->many, verb, common);
  };
}

}  // namespace risley::app
