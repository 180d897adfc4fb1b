// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "risley/bags/bag_writer.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"
#include "risley/jobs/beam_origins.hpp"
#include "risley/jobs/cloud_of_recording.hpp"
#include "risley/jobs/cloud_of_stations.hpp"
#include "risley/report/beam_origin_page.hpp"
#include "risley/report/cloud_page.hpp"
#include "risley/report/distribution_page.hpp"
#include "risley/sensors/preset.hpp"

#include "command.hpp"
#include "distribution_text.hpp"
#include "many_files.hpp"
#include "message_options.hpp"
#include "platform_options.hpp"
#include "reading_options.hpp"
#include "result_folder.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

struct CloudCommandOptions {
  jobs::ManyInputsOptions many;
  std::string calibration, stations, format, beam_origin_map, distribution, report;
  std::string directions = "smoothed", beam_origin = "yes", beam_divergence = "yes", covariance,
              common_factors = "no", time = "gps";
  std::string rate_hz = fmt::format("{:.0f}", cloud::kTrackingRate);
  std::optional<double> noise_angle_deg;
  double las_scale_m = cloud::CloudWriterOptions{}.las_scale;
  ReadingWishes reading;
  MessageWishes messages;
  bool replace = false;
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

/// Whether the points go into a bag, whose readers usually expect only the drivers' fields.
bool writes_bag(const CloudCommandOptions& options) {
  if (options.format.empty()) return bags::bag_kind_of_name(options.many.output).has_value();
  return options.format == "mcap" || options.format == "ros1-bag" || options.format == "ros2-bag";
}

cloud::CloudOptions cloud_options(const CloudCommandOptions& options) {
  cloud::CloudOptions result;
  result.pointing.reported_directions = options.directions == "reported";
  result.pointing.beam_origin = options.beam_origin == "yes";
  result.pointing.beam_divergence = options.beam_divergence == "yes";
  result.pointing.covariance = options.covariance.empty()
                                   ? options.common_factors == "yes" || !writes_bag(options)
                                   : options.covariance == "yes";
  result.loadings = options.common_factors == "yes";
  result.rate = rate_from(options.rate_hz);
  result.angle_noise = noise_angle(options.noise_angle_deg);
  require_positive(kSetting.las_scale, options.las_scale_m);
  result.writer.las_scale = options.las_scale_m;
  result.writer.gps_time = options.time == "gps";
  result.writer.messages = message_options(options.messages);
  if (!options.distribution.empty()) result.distribution.emplace();
  if (!options.report.empty()) result.sample = report::kCloudPagePoints;
  return result;
}

/// The maps of the beams' origins.
ExitStatus write_beam_origin_map(const CloudCommandOptions& options, const CommonOptions& common) {
  if (options.calibration.empty()) throw InvalidArgument("--calibration is missing");
  const sensors::Sensor calibration = sensors::load_sensor(options.calibration);
  const jobs::BeamOrigins found = jobs::beam_origins(calibration);
  write_page_file(options.beam_origin_map,
                  report::beam_origin_page(found.map, calibration, provenance_of(common)));
  if (common.json) {
    Json json = {{"html", options.beam_origin_map}};
    json.update(json::of(found));
    print_json(common, json);
  } else {
    say("{}: beams start {:.1f} to {:.1f} mm from the origin in Y, {:.1f} to {:.1f} mm in Z\n",
        options.beam_origin_map, 1e3 * found.least_y, 1e3 * found.greatest_y, 1e3 * found.least_z,
        1e3 * found.greatest_z);
  }
  return kDone;
}

/// The files in the folder of a calibration in flight. @return whether it is one
bool add_flight_files(const std::string& folder, std::vector<std::string>& files) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored)) return false;
  for (const char* name : {"calibration.yaml", "mount.yaml", "trajectory.csv"}) {
    const std::filesystem::path file = std::filesystem::path(folder) / name;
    if (std::filesystem::is_regular_file(file, ignored)) files.push_back(file.string());
  }
  return true;
}

/// Requested pages on the points of one recording.
json::CloudPages pages_of(const CloudCommandOptions& options, const jobs::Provenance& provenance) {
  return [&options, provenance](const jobs::RecordingCloud& made, Json& json) {
    const cloud::CloudSummary& s = made.summary;
    if (s.distribution) {
      write_page_file(options.distribution,
                      report::distribution_page(*s.distribution, made.recording, provenance));
    }
    if (!s.sample) return;
    write_page_file(options.report, report::cloud_page(s, made.recording, provenance));
    json["html"] = options.report;
  };
}

void print_stations(const jobs::CloudOfStations& made) {
  Table table({"station", "points", "x m", "y m", "z m", "+- mm", "roll deg", "pitch deg",
               "heading deg", "+- deg", "targets", "p"});
  for (const jobs::StationCloud& one : made.stations) {
    const auto& [place, geographic, sigma, angles, angle_sigma] = one.pose;
    table.add(
        {one.name, grouped(one.cloud.summary.points), fmt::format("{:.3f}", place.x()),
         fmt::format("{:.3f}", place.y()), fmt::format("{:.3f}", place.z()),
         fmt::format("{:.1f}", 1e3 * sigma.norm()),
         fmt::format("{:.4f}", degrees_from_radians(angles.roll)),
         fmt::format("{:.4f}", degrees_from_radians(angles.pitch)),
         fmt::format("{:.4f}", degrees_from_radians(angles.heading)),
         fmt::format("{:.4f}", degrees_from_radians(std::max(
                                   {angle_sigma.roll, angle_sigma.pitch, angle_sigma.heading}))),
         one.adjusted ? std::to_string(one.targets.size()) : "-",
         one.adjusted ? fmt::format("{:.2g}", one.adjusted->p_value) : "-"});
  }
  table.print();
  say("\n{}: {} points, {}\n", made.output, grouped(made.points()), made.frame);
}

/// Points of all stations into one file.
ExitStatus run_stations(CloudCommandOptions& options, cloud::CloudOptions settings,
                        const CommonOptions& common) {
  CommonOptions told = with_recordings_found(options.many, common);
  told.files.push_back(options.stations);
  require_apart(told, {options.many.output, options.report});
  if (!options.distribution.empty()) {
    throw InvalidArgument("--distribution is for a flight, and --station for a stationary sensor");
  }
  settings.writer.format = options.format;
  jobs::CloudOfStationsOptions job{{options.many.names.begin(), options.many.names.end()},
                                   read_options(options.reading),
                                   options.calibration,
                                   options.stations,
                                   options.platform.crs,
                                   options.platform.datum,
                                   options.many.output,
                                   settings,
                                   provenance_of(common)};
  jobs::CloudOfStations made;
  {
    ProgressBar bar("making points", common);
    made = jobs::cloud_of_stations(job, bar.progress());
  }
  Json json = json::of(made);
  ExitStatus status = kDone;
  for (const jobs::StationCloud& one : made.stations) {
    const cloud::CloudSummary& s = one.cloud.summary;
    for (const Warning& warning : s.warnings) {
      log_words(warning_text(of_file(one.cloud.recording, warning)), false);
    }
    if (s.damage) {
      log_words(fmt::format("{}; the {} points before it are saved in {}", s.damage->what(),
                            s.points, made.output),
                true);
      status = kBadFile;
    }
    if (!s.sample) continue;
    write_page_file(options.report,
                    report::cloud_page(s, one.cloud.recording, provenance_of(told)));
    json["html"] = options.report;
  }
  common.json ? print_json(told, json) : print_stations(made);
  return status;
}

}  // namespace

Run declare_cloud(CLI::App& verb) {
  const auto options = std::make_shared<CloudCommandOptions>();
  CloudCommandOptions& o = *options;
  const auto yes_no = [&verb](const char* name, std::string& value, const char* description) {
    add_choice(verb, name, value, {"yes", "no"}, description);
  };
  auto* inputs = add_many_options(verb, o.many, "Recordings with ranges");
  verb.add_option(
      "--calibration", o.calibration,
      "calibration.yaml of estimate or calibrate, the folder that holds it (of a calibration in "
      "flight with its mount and trajectory), or a preset by name (default: the preset of the "
      "sensor, and directions as reported)");
  auto* output =
      verb.add_option("-o,--output", o.many.output,
                      "Cloud to write, or a folder for several, which is created if missing and "
                      "mirrors the layout of the inputs; the ending chooses the format:" +
                          cloud_endings());
  verb.add_option(
          "--format", o.format,
          "Format to write, whatever the ending (default: by the ending, las-1.4 in a folder)")
      ->check(CLI::IsMember(cloud_format_names()));
  add_choice(verb, "--directions", o.directions, {"smoothed", "reported"},
             "Directions of the points: 'smoothed', from the calibration at the smoothed rotation "
             "angles; 'reported', as the sensor reports them");
  yes_no("--beam-origin", o.beam_origin,
         "Let beams start where they leave the last prism; 'no': at the sensor's origin");
  verb.add_option("--covariance", o.covariance,
                  "Write the covariance of every point; in bags together with all further fields "
                  "of clouds (default: yes, in bags no)")
      ->check(CLI::IsMember({"yes", "no"}));
  yes_no("--beam-divergence", o.beam_divergence,
         "Include the size of the beam's footprint in the covariance");
  yes_no(
      "--common-factors", o.common_factors,
      "Write every point's loadings of the common error factors, for covariances between points");
  add_reading_options(verb, o.reading);
  add_every_device(verb, o.reading);
  add_platform_options(verb, o.platform);
  verb.add_option("--station", o.stations,
                  "Stations of a tripod (YAML), one per recording and in the same order: poses on "
                  "the map, or targets to determine them; all points go into one file")
      ->excludes("--trajectory", "--mount", "--table", "--resume");
  verb.add_option("--crs", o.platform.crs,
                  "Coordinate reference system of the points, such as EPSG:25832, or "
                  "EPSG:25832+7837 with a height system (default: that of the stations, or UTM on "
                  "WGS 84 with ellipsoidal heights)");
  verb.add_option("--datum", o.platform.datum,
                  "Datum of a trajectory or of stations: EPSG:4979 is WGS 84, EPSG:4937 is ETRS89 "
                  "(default: EPSG:4979)");
  verb.add_option(
          "--distribution", o.distribution,
          "Page (HTML) to write about the density and gaps of one flight's points on the ground")
      ->needs("--trajectory");
  verb.add_option(
      "--report", o.report,
      "Page (HTML) to write that shows the points of one recording in three dimensions, coloured "
      "by uncertainty, height, intensity or angle of incidence");
  verb.add_option(
          "--rate-hz", o.rate_hz,
          "Directions per second, Hz, used to find the rotation angles; 'full': all of them")
      ->capture_default_str();
  verb.add_option(
      "--noise-angle-deg", o.noise_angle_deg,
      "1 sigma of azimuth and zenith before rounding, deg (default: the calibration's)");
  add_message_options(verb, o.messages, "points");
  verb.add_flag("--replace", o.replace,
                "Rewrite the bag of the recording with calibrated points, in the sensor's own "
                "frame; all other topics are copied unchanged");
  verb.add_option("--las-scale-m", o.las_scale_m, "Resolution of the coordinates in LAS files, m")
      ->capture_default_str();
  add_choice(verb, "--time", o.time, {"gps", "recording"},
             "Times in LAS files: 'gps', GPS time where the recording's clock is UTC; "
             "'recording', the recording's clock as it is");
  verb.add_option("--beam-origin-map", o.beam_origin_map,
                  "Page (HTML) to write with maps of the beams' origins; no cloud is made")
      ->excludes(inputs, output);
  return [options, &verb](const CommonOptions& common) {
    cloud::CloudOptions settings = cloud_options(*options);
    if (!options->beam_origin_map.empty()) {
      require_apart(common, {options->beam_origin_map});
      return write_beam_origin_map(*options, common);
    }
    jobs::ManyInputsOptions& many = options->many;
    CommonOptions told = common;
    if (add_flight_files(options->calibration, told.files) && many.resume) {
      throw InvalidArgument(
          "--resume checks by files whether a result is up to date: name the calibration, --mount "
          "and --trajectory instead of the folder that holds them");
    }
    if (many.output.empty()) throw InvalidArgument("--output is missing");
    if (!options->stations.empty()) return run_stations(*options, settings, told);
    many.into_folder = output_is_folder(many);
    settings.writer.format = options->format;
    const jobs::Provenance provenance = provenance_of(common);
    jobs::InputWork work = json::cloud_each({{},
                                             read_options(options->reading),
                                             options->calibration,
                                             {},
                                             options->replace,
                                             options->platform,
                                             settings,
                                             provenance},
                                            pages_of(*options, provenance), log_words);
    jobs::InputPlan plan = jobs::plan_inputs(many, work, cancellable());
    split_by_device(options->reading, plan);
    for (const auto& [name, page] : {std::pair{"--distribution", options->distribution},
                                     std::pair{"--report", options->report}}) {
      if (page.empty() || plan.jobs.size() == 1) continue;
      throw InvalidArgument(
          fmt::format("{} is for one recording, and there are {}", name, plan.jobs.size()));
    }
    work.files = [&](const jobs::InputJob& job) {
      std::vector<std::string> names = {job.output};
      for (const std::string& page : {options->distribution, options->report}) {
        if (!page.empty()) names.push_back(page);
      }
      return names;
    };
    return run_inputs(plan, work, many, verb, told);
  };
}

}  // namespace risley::app
