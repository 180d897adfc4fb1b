// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/campaign.hpp"

#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include <Eigen/Core>
#include <fmt/format.h>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/io/folder.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/simulation/truth_file.hpp"

#include "jobs/campaign_chunk.hpp"

namespace risley::jobs {
namespace {

namespace fs = std::filesystem;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint64_t kUsualCells = 100;

std::string with_letter(const char* name, std::size_t prism) {
  return fmt::format("{}_{}", name, static_cast<char>('a' + prism));
}

/// Whether an estimate or a calibration succeeded, and its verdict.
template <class Found>
bool take_answer(const Found& found, CellOutcome& outcome) {
  outcome.answered = found.converged;
  outcome.verdict = to_string(found.verdict.code);
  outcome.message = found.reason;  // empty where it converged
  outcome.degrees_of_freedom = found.converged ? found.free.size() : 0;
  return found.converged;
}

void take(const EstimatedRecording& found, CellOutcome& outcome) {
  const estimation::Estimate& e = found.estimate;
  if (!take_answer(e, outcome)) return;
  const estimation::Evaluation& judged = *found.evaluation;
  for (std::size_t i = 0; i < e.values.size(); ++i) {
    const estimation::TruthComparison& one = judged.parameters[i];
    outcome.parameters.push_back(
        {one.name, one.truth, one.error, e.values[i].sigma, e.values[i].sigma_given_held});
  }
  outcome.nees = judged.nees_parameters;
  outcome.nees_rotation_angles = judged.nees_rotation_angles;
  const auto add = [&](const char* name, const std::vector<double>& rms,
                       const std::vector<double>& over_sigma) {
    for (std::size_t k = 0; k < rms.size(); ++k) {
      outcome.errors.push_back({with_letter(name, k), rms[k], rms[k] / over_sigma[k]});
    }
  };
  add("rotation_angle", judged.rotation_angle_rmse, judged.rotation_angle_rmse_over_sigma);
  add("angular_velocity", judged.angular_velocity_rmse, judged.angular_velocity_rmse_over_sigma);
}

void take(const CalibratedRecordings& found, CellOutcome& outcome) {
  const calibration::Calibration& c = found.calibration;
  if (!take_answer(c, outcome)) return;
  const auto count = static_cast<Eigen::Index>(c.free.size());
  Eigen::VectorXd error(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto place = static_cast<std::size_t>(i);
    const double truth = found.truth->truth.train[c.free[place].places.front()];
    error[i] = c.parameters[i] - truth;
    outcome.parameters.push_back(
        {c.free[place].name, truth, error[i], c.total_sigma(place), std::sqrt(c.covariance(i, i))});
  }
  outcome.nees = algebra::SymmetricSolver(c.covariance).chi2(error) / static_cast<double>(count);
  outcome.errors = {{"directions", found.truth->after.total, c.datum_given_held.total},
                    {"shape", found.truth->after.shape, c.datum_given_held.shape},
                    {"directions_reported", found.truth->before.total, kUnknown}};
}

/// A message belongs to the cell, not to the folder of its recording.
std::string without_folder(std::string message, const std::string& folder) {
  const std::string prefix = folder + "/";
  for (std::size_t at = message.find(prefix); at != std::string::npos; at = message.find(prefix)) {
    message.erase(at, prefix.size());
  }
  return message;
}

/// Of the recordings of a cell with their truth.
double bytes_of(const CampaignSetting& setting) {
  constexpr double kBytesPerShot = 200.0;
  double bytes = 0;
  for (const simulation::SimulationSettings& one : setting.simulations) {
    bytes += kBytesPerShot * one.duration * one.rate.value_or(one.truth.shot_rate);
  }
  return bytes;
}

CampaignChunk range_of(const CampaignPlan& plan, const ChunkNumber& which) {
  if (which.count < 1 || which.number < 1 || which.number > which.count) {
    throw InvalidArgument(fmt::format("{} = {}/{}, wanted I/N with I from 1 to N",
                                      name_of(kSetting.chunk), which.number, which.count));
  }
  const std::uint64_t cells = plan.cells();
  if (which.count > cells) {
    throw InvalidArgument(fmt::format("{} = {}/{}: the plan has {} cells, so N is at most {}",
                                      name_of(kSetting.chunk), which.number, which.count, cells,
                                      cells));
  }
  CampaignChunk chunk;
  // Products of two 64-bit numbers: in two steps, so that they cannot overflow.
  const auto begin = [&](std::uint64_t number) {
    return cells / which.count * number + cells % which.count * number / which.count;
  };
  chunk.first = begin(which.number - 1);
  chunk.cells = begin(which.number) - chunk.first;
  return chunk;
}

bool is_done(const std::string& file, const ChunkHead& head, const Progress& progress) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return false;
  try {
    return read_chunk(file, progress) == head;
  } catch (const FileError&) {  // made again
    return false;
  }
}

/// @param folder  for the recordings
CellOutcome outcome_in(const std::string& folder, const CampaignSetting& setting,
                       const CampaignCell& cell, const Progress& progress) {
  CellOutcome outcome;
  outcome.cell = cell;
  outcome.nees = outcome.nees_rotation_angles = kUnknown;
  std::vector<std::string> recordings, truths;
  for (std::size_t i = 0; i < setting.simulations.size(); ++i) {
    simulation::SimulationSettings settings = setting.simulations[i];
    settings.seed = cell.seed;
    // Stations are recorded one after the other, while the rotors continue to turn.
    if (i > 0) settings.seed += i * (std::uint64_t{1} << 32U);
    recordings.push_back((fs::path(folder) / fmt::format("{}{}", i + 1, setting.format)).string());
    simulation::simulate_to_file(settings, recordings.back(), {}, progress);
    truths.push_back(simulation::truth_preset_path(recordings.back()));
  }
  try {
    if (const auto* estimate = std::get_if<EstimateRecordingOptions>(&setting.job)) {
      EstimateRecordingOptions job = *estimate;
      job.recording = recordings.front();
      job.truth = truths.front();
      take(estimate_recording(job, progress), outcome);
    } else {
      CalibrateRecordingsOptions job = std::get<CalibrateRecordingsOptions>(setting.job);
      job.recordings.assign(recordings.begin(), recordings.end());
      job.truths = truths;
      job.seed = cell.seed;
      take(calibrate_recordings(job, progress), outcome);
    }
  } catch (const EstimationError& error) {
    outcome.message = error.what();
  }
  return outcome;
}

}  // namespace

CellOutcome run_cell(const CampaignPlan& plan, std::uint64_t number, const Progress& progress) {
  const CampaignCell cell = plan.cell(number);
  const CampaignSetting& setting = plan.settings[cell.setting];
  const io::TemporaryFolder folder(bytes_of(setting));
  try {
    CellOutcome outcome = outcome_in(folder.path(), setting, cell, progress.silent());
    outcome.message = without_folder(std::move(outcome.message), folder.path());
    return outcome;
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(plan.about(setting, without_folder(error.what(), folder.path())));
  }
}

CampaignChunk run_chunk(const CampaignPlan& plan, const ChunkNumber& which,
                        const CampaignOptions& options, const Progress& progress) {
  CampaignChunk chunk = range_of(plan, which);
  const std::string folder = chunk_folder(options.folder);
  chunk.file =
      (fs::path(folder) / fmt::format("chunk-{}-of-{}.jsonl", which.number, which.count)).string();
  const ChunkHead head{plan.work, options.program, chunk.first, chunk.cells};
  chunk.made_before = is_done(chunk.file, head, progress);
  if (chunk.made_before) return chunk;
  io::make_folder(folder);
  std::vector<CellOutcome> outcomes(chunk.cells);
  parallel::for_each_job(
      chunk.cells, [&](std::size_t i) { outcomes[i] = run_cell(plan, chunk.first + i, progress); },
      progress);
  save_chunk(chunk.file, head, outcomes);
  return chunk;
}

CampaignResult run_campaign(const CampaignPlan& plan, const std::string& table,
                            const CampaignOptions& options, const Progress& progress) {
  const std::uint64_t chunks = (plan.cells() + kUsualCells - 1) / kUsualCells;
  const auto share = [&](std::uint64_t done) {
    return static_cast<double>(done) / static_cast<double>(chunks);
  };
  for (std::uint64_t i = 1; i <= chunks; ++i) {
    run_chunk(plan, {i, chunks}, options, progress.part(share(i - 1), share(i)));
  }
  return merge_chunks(plan, table, options, progress.silent());
}

}  // namespace risley::jobs
