// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/json/many_results.hpp"

#include <filesystem>
#include <new>
#include <string_view>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/cloud/cloud_writer.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"
#include "risley/jobs/convert_recording.hpp"
#include "risley/jobs/convert_trajectory.hpp"
#include "risley/jobs/inspect_recording.hpp"
#include "risley/jobs/inspect_trajectory.hpp"
#include "risley/json/result_columns.hpp"
#include "risley/recordings/writer.hpp"
#include "risley/tables/table_file.hpp"
#include "risley/trajectories/trajectory_file.hpp"
#include "risley/wire/udp_socket.hpp"

namespace risley::json {
namespace {

using jobs::InputJob;
using jobs::InputOutcome;
using jobs::InputResult;
using jobs::InputWork;

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

InputOutcome failed(const InputJob& job, const std::string& verb) {
  const Failure failure = current_failure();
  Json json = {{"input", job.input},
               {"status", static_cast<int>(failure.status)},
               {"message", failure.message}};
  if (failure.details.is_object()) json.update(failure.details);
  if (verb == "estimate" || verb == "calibrate") json.update(undecided(failure.message));
  std::string_view words = failure.message;
  if (words.starts_with(job.input + ": ")) words.remove_prefix(job.input.size() + 2);
  return {failure.status, text_of(json), fmt::format("{}: failed: {}", job.input, words)};
}

InputWork work_of(std::string verb, std::string label) {
  InputWork work;
  work.verb = std::move(verb);
  work.label = std::move(label);
  work.failed = [verb = work.verb](const InputJob& job) { return failed(job, verb); };
  return work;
}

void note_all(const Note& note, const std::string& file, const std::vector<Warning>& warnings) {
  for (const Warning& warning : warnings) {
    note(warning_text(of_file(file, warning)), false);
  }
}

recordings::ReadOptions reading_of(recordings::ReadOptions reading, const InputJob& job) {
  if (!job.device.empty()) reading.device = job.device;
  return reading;
}

/// Files of a folder of results.
std::vector<std::string> result_files_of(const InputJob& job) {
  std::vector<std::string> names;
  if (job.output.empty()) return names;
  for (const char* name : {"calibration.yaml", "states.nc", "report.json", "report.html"}) {
    names.push_back((std::filesystem::path(job.output) / name).string());
  }
  return names;
}

/// Checked before an hour of computation; some rotor states are not written.
void require_own_results(const InputJob& job) {
  for (const std::string& file : result_files_of(job)) {
    if (!file.ends_with(".nc")) jobs::require_own_result(file);
  }
}

/// The outcome of a job whose numbers have a verdict, after its warnings.
/// @param solution  of what was found @param words  its source
template <class Found, class Solution>
InputOutcome judged(const InputJob& job, const Found& found, const Solution& solution,
                    const Note& note, const std::string& words) {
  note_all(note, job.input, found.warnings);
  note_all(note, job.input, solution.warnings);
  Json json = of(found);
  const std::string reason = solution.converged ? "" : solution.reason;
  json["input"] = job.input;
  if (!job.output.empty()) json["output"] = job.output;
  json["message"] = reason;
  std::string text = fmt::format("{}: {}", job.input, to_string(solution.verdict.code));
  if (!solution.converged) text += fmt::format(", not converged: {}", reason);
  return {solution.converged ? jobs::kDone : jobs::kNumbersFailed, text_of(json),
          fmt::format("{}; {}", text, words)};
}

/// A verb that writes a folder of results for every input.
/// @param solve  called with the job, its own options and the progress
template <class Options, class Solve>
InputWork work_into_folders(std::string verb, std::string label, Options options, Solve solve) {
  jobs::check(options);
  InputWork work = work_of(std::move(verb), std::move(label));
  work.into_folders = true;
  work.files = result_files_of;
  work.run = [options = std::move(options), solve = std::move(solve)](const InputJob& job,
                                                                      const Progress& progress) {
    Options own = options;
    own.reading = reading_of(own.reading, job);
    own.files.folder = job.output;
    own.details = own.details && !job.output.empty();
    require_own_results(job);
    return solve(job, own, progress);
  };
  return work;
}

bool is_trajectory(const InspectEachOptions& options, const InputJob& job,
                   const Progress& progress) {
  return jobs::is_trajectory({job.input, options.accuracy, options.topic}, options.reading,
                             progress);
}

InputOutcome inspect_poses(const InputJob& job, const InspectEachOptions& options, const Note& note,
                           const Progress& progress) {
  const jobs::InspectedTrajectory found =
      jobs::inspect_trajectory({job.input, options.accuracy, options.topic}, progress);
  note_all(note, job.input, found.warnings);
  Json json = of(found);
  json["input"] = job.input;
  return {jobs::kDone, text_of(json),
          fmt::format("{}: {}, {} records", job.input, json.value("format", ""),
                      grouped(json.value("records", std::uint64_t{0})))};
}

InputOutcome inspect(const InputJob& job, const InspectEachOptions& options, const Note& note,
                     const Progress& progress) {
  if (is_trajectory(options, job, progress)) return inspect_poses(job, options, note, progress);
  const jobs::InspectedRecording found =
      jobs::inspect_recording({job.input, reading_of(options.reading, job), {}, {}}, progress);
  note_all(note, job.input, found.warnings);
  Json json = with_status(of(found), found.damage);
  json["input"] = job.input;
  std::string text =
      fmt::format("{}: {}, {}, {} observations", job.input, found.header.format,
                  found.choice ? jobs::sensor_name(*found.choice) : jobs::sensor_name(found.header),
                  grouped(found.audit.observations));
  if (found.header.has_times) text += fmt::format(" in {:.6g} s", found.audit.duration_s);
  if (found.audit.gaps.count > 0) text += fmt::format(", {} gaps", grouped(found.audit.gaps.count));
  if (found.damage) text += fmt::format("; damaged: {}", found.damage->what());
  return {found.damage ? jobs::kBadFile : jobs::kDone, text_of(json), std::move(text)};
}

InputOutcome convert_poses(const InputJob& job, const ConvertEachOptions& options, const Note& note,
                           const Progress& progress) {
  if (options.sensor_type) {
    throw InvalidArgument(fmt::format("{} is for recordings, and {} is a trajectory",
                                      name_of(kSetting.sensor_type), job.input));
  }
  const jobs::ConvertedTrajectory done = jobs::convert_trajectory(
      {job.input, job.output, options.format, options.accuracy, options.topic}, progress);
  note_all(note, job.input, done.warnings);
  for (const std::string& one : done.left_out) {
    note(fmt::format("{}: {}", job.output, one), false);
  }
  Json json = of(done);
  json.update({{"input", job.input}, {"output", job.output}});
  return {jobs::kDone, text_of(json),
          fmt::format("{}: {} records", job.output, grouped(done.records))};
}

InputOutcome convert(const InputJob& job, const ConvertEachOptions& options, const Note& note,
                     const Progress& progress) {
  if (is_trajectory(options, job, progress)) return convert_poses(job, options, note, progress);
  const jobs::ConvertedRecording done =
      jobs::convert_recording({job.input, reading_of(options.reading, job), job.output,
                               options.format, options.sensor_type, options.writing},
                              progress);
  note_all(note, job.input, done.warnings);
  const std::uint64_t written = done.observations - done.left_out;
  if (done.left_out > 0) {
    note(fmt::format("{}: {} of {} observations do not fit this format and were dropped",
                     job.output, done.left_out, done.observations),
         false);
  }
  Json json = with_status(of(done), done.damage);
  json.update({{"input", job.input}, {"output", job.output}});
  if (done.damage) {
    note(fmt::format("{}; the {} observations before it are saved in {}", done.damage->what(),
                     written, job.output),
         true);
  }
  return {done.damage ? jobs::kBadFile : jobs::kDone, text_of(json),
          fmt::format("{}: {} observations", job.output, grouped(written)),
          json.value("observations", std::uint64_t{0})};
}

/// Ending of a format's files in a folder; empty for none.
std::string ending_of(const std::string& format) {
  for (const auto& known : recordings::writable_formats()) {
    if (known.name == format) return known.ending;
  }
  for (const auto& known : trajectories::writable_trajectories()) {
    if (known.name == format) return known.ending;
  }
  return {};
}

/// The source of the points' directions.
std::string calibration_text(const jobs::RecordingCloud& made) {
  using sensors::CalibrationReference;
  return fmt::format("{} ({})", made.calibration,
                     made.calibrated_against == CalibrationReference::none ? "a preset"
                     : made.calibrated_against == CalibrationReference::directions
                         ? "an estimate; only walls show whether it is true"
                         : "a calibration");
}

InputOutcome make_cloud(const InputJob& job, jobs::CloudOfRecordingOptions options,
                        const CloudPages& pages, const Note& note, const Progress& progress) {
  options.recording = job.input;
  options.reading = reading_of(options.reading, job);
  options.output = job.output;
  const jobs::RecordingCloud made = jobs::cloud_of_recording(options, progress);
  const cloud::CloudSummary& s = made.summary;
  note_all(note, job.input, s.warnings);
  if (s.damage) {
    note(fmt::format("{}; the {} points before it are saved in {}", s.damage->what(), s.points,
                     job.output),
         true);
  }
  Json json = with_status(of(made), s.damage);
  if (pages) pages(made, json);
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
  return {s.damage ? jobs::kBadFile : jobs::kDone, text_of(json),
          fmt::format("{}; beams by {}", text, calibration_text(made)), s.points};
}

Json row_of(const InputJob& job, const InputResult& result, const std::string& version) {
  Json row = one_of_several(job, result);
  if (!result.hashes.empty()) row["sha256"] = fmt::format("{}", fmt::join(result.hashes, " "));
  row["elapsed_s"] = result.elapsed;
  row["version"] = version;
  return row;
}

/// The columns of all results.
ResultColumns columns_of(const jobs::InputRun& run, const std::string& version) {
  ResultColumns columns;
  run.for_each([&](const InputJob& job, const InputResult& result) {
    columns.note(row_of(job, result, version));
  });
  return columns;
}

}  // namespace

Failure current_failure() {
  using namespace jobs;
  try {
    throw;
  } catch (const InvalidArgument& error) {
    return {kWrongUsage, error.what(), {}};
  } catch (const FileError& error) {
    return {kBadFile, error.what(), of(error)};
  } catch (const wire::NetworkError& error) {
    return {kBadFile, error.what(), {}};
  } catch (const EstimationError& error) {
    return {kNumbersFailed, error.what(), {{"converged", false}, {"reason", error.what()}}};
  } catch (const Cancelled&) {
    return {kInterrupted, "interrupted", {}};
  } catch (const std::bad_alloc&) {
    return {kFault, "there is not enough memory", {}};
  } catch (const std::exception& error) {  // a bug: nothing the user did
    return {kFault, fmt::format("internal error: {}", error.what()), {}};
  } catch (...) {
    return {kFault, "internal error of an unknown kind", {}};
  }
}

Json undecided(const std::string& message) {
  return {{"serial", nullptr},
          {"sensor", nullptr},
          {"verdict",
           {{"code", "undecided"},
            {"words", message},
            {"to_do", "fix the named error, or record again"}}}};
}

Json with_status(Json result, const std::optional<FileError>& damage) {
  if (damage) result["exit_status"] = static_cast<int>(jobs::kBadFile);
  return result;
}

InputWork estimate_each(jobs::EstimateRecordingOptions options, const Note& note) {
  return work_into_folders(
      "estimate", "estimating", std::move(options),
      [note](const InputJob& job, jobs::EstimateRecordingOptions& own, const Progress& progress) {
        own.recording = job.input;
        const jobs::EstimatedRecording found = jobs::estimate_recording(own, progress);
        const estimation::Estimate& e = found.estimate;
        return judged(
            job, found, e, note,
            fmt::format("{}, {} shots, {} of them outliers", jobs::sensor_name(found.choice),
                        grouped(e.series.size()), grouped(e.outliers)));
      });
}

InputWork calibrate_each(jobs::CalibrateRecordingsOptions options, const Note& note) {
  options.recordings.assign(1, recordings::Source("each recording"));
  return work_into_folders(
      "calibrate", "calibrating", std::move(options),
      [note](const InputJob& job, jobs::CalibrateRecordingsOptions& own, const Progress& progress) {
        own.recordings = {job.input};
        const jobs::CalibratedRecordings found = jobs::calibrate_recordings(own, progress);
        const calibration::Calibration& c = found.calibration;
        return judged(job, found, c, note,
                      fmt::format("{}, {} points on {} planes", jobs::sensor_name(found.choice),
                                  grouped(c.points), c.planes.size()));
      });
}

InputWork cloud_each(jobs::CloudOfRecordingOptions options, const CloudPages& pages,
                     const Note& note) {
  InputWork work = work_of("cloud", "making points");
  work.counted = "points";
  const std::string& format = options.cloud.writer.format;
  work.ending =
      cloud::find_cloud_format("", format.empty() ? cloud::cloud_formats().front().name : format)
          .ending;
  work.run = [options = std::move(options), pages, note](const InputJob& job,
                                                         const Progress& progress) {
    return make_cloud(job, options, pages, note, progress);
  };
  return work;
}

InputWork inspect_each(InspectEachOptions options, const Note& note) {
  InputWork work = work_of("info", "reading");
  work.run = [options = std::move(options), note](const InputJob& job, const Progress& progress) {
    return inspect(job, options, note, progress);
  };
  return work;
}

InputWork convert_each(ConvertEachOptions options, const Note& note) {
  InputWork work = work_of("convert", "converting");
  work.counted = "observations";
  work.ending = ending_of(options.format);
  work.run = [options = std::move(options), note](const InputJob& job, const Progress& progress) {
    return convert(job, options, note, progress);
  };
  return work;
}

Json one_of_several(const InputJob& job, const InputResult& result) {
  Json json = Json::parse(result.outcome.json);
  json["input"] = job.input;
  if (json.contains("output") && !job.output.empty()) json["output"] = job.output;
  json["status"] = static_cast<int>(result.outcome.status);
  if (!json.contains("message")) json["message"] = json.value("error", "");
  json.erase("error");
  json.erase("exit_status");
  if (result.skipped) json["skipped"] = true;
  return json;
}

Json counts_of(const jobs::InputRun& run, const InputWork& work) {
  Json counts = Json::object();
  const auto& [done, skipped, failed, counted, status] = run.counts();
  if (!work.counted.empty()) counts[work.counted] = counted;
  counts.update({{"done", done}, {"failed", failed}, {"skipped", skipped}});
  return counts;
}

void write_table(const std::string& path, const jobs::InputRun& run,
                 const jobs::Provenance& about) {
  std::string version;
  for (const auto& [name, value] : about) {
    if (name == "version") version = value;
  }
  const ResultColumns columns = columns_of(run, version);
  tables::TableFile table(path, columns.columns(), about);
  run.for_each([&](const InputJob& job, const InputResult& result) {
    table.add(columns.cells(row_of(job, result, version)));
  });
  table.close();
}

Json rows_of(const jobs::InputRun& run, const std::string& version) {
  const ResultColumns columns = columns_of(run, version);
  const std::vector<tables::TableColumn> shown = columns.columns();
  Json rows = Json::array();
  run.for_each([&](const InputJob& job, const InputResult& result) {
    const std::vector<tables::TableCell> cells = columns.cells(row_of(job, result, version));
    Json row;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      Json& value = row[shown[i].name];
      if (const auto* text = std::get_if<std::string>(&cells[i])) value = *text;
      if (const auto* whole = std::get_if<std::int64_t>(&cells[i])) value = *whole;
      if (const auto* real = std::get_if<double>(&cells[i])) value = *real;
    }
    rows.push_back(std::move(row));
  });
  return rows;
}

}  // namespace risley::json
