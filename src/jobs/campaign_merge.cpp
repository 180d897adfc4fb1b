// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "risley/algebra/distributions.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/jobs/campaign.hpp"
#include "risley/optics/parameters.hpp"
#include "risley/tables/table_file.hpp"

#include "jobs/campaign_chunk.hpp"

namespace risley::jobs {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostRanges = 100;
constexpr double kTwoSided95 = 1.959963985;
constexpr double kWithinTwoSigma = 0.954499736;

BandedFigure mean_square(double value, double degrees) {
  return {value, algebra::chi_square_per_degree(degrees, -kTwoSided95),
          algebra::chi_square_per_degree(degrees, kTwoSided95)};
}

/// Sums over the cells of a setting.
class SettingSums {
 public:
  explicit SettingSums(const CampaignSetting& setting)
      : grid_(setting.grid), shape_(setting.simulations.front().truth.shape()) {}

  void add(const CellOutcome& outcome) {
    ++cells_;
    if (!outcome.answered) return;
    ++answered_;
    const auto degrees = static_cast<double>(outcome.degrees_of_freedom);
    nees_ += outcome.nees * degrees;
    degrees_ += degrees;
    nees_rotation_angles_ += outcome.nees_rotation_angles;
    for (const CellParameter& one : outcome.parameters) {
      Sums& sums = named(parameters_, one.name);
      ++sums.cells;
      sums.error += one.error;
      sums.error2 += one.error * one.error;
      sums.sigma2 += one.sigma * one.sigma;
      sums.bound2 += one.sigma_given_held * one.sigma_given_held;
      sums.within += std::abs(one.error) < 2.0 * one.sigma_given_held ? 1.0 : 0.0;
    }
    for (const CellErrors& one : outcome.errors) {
      Sums& sums = named(errors_, one.name);
      ++sums.cells;
      sums.error2 += one.rms * one.rms;
      sums.sigma2 += one.sigma * one.sigma;
    }
  }

  SettingSummary summary() const {
    SettingSummary result;
    result.grid = grid_;
    result.shape = shape_;
    result.cells = cells_;
    result.answered = answered_;
    double squares = 0, prism_parameters = 0;
    for (const auto& [name, sums] : parameters_) {
      const auto n = static_cast<double>(sums.cells);
      ParameterSummary one;
      one.name = name;
      one.of_prisms = find_parameter(name, shape_).kind == ParameterKind::train;
      one.cells = sums.cells;
      one.bias = sums.error / n;
      one.rmse = std::sqrt(sums.error2 / n);
      one.bound = std::sqrt(sums.bound2 / n);
      one.sigma = std::sqrt(sums.sigma2 / n);
      const BandedFigure square = mean_square(sums.error2 / sums.bound2, n);
      one.error_over_bound = {std::sqrt(square.value), std::sqrt(square.low),
                              std::sqrt(square.high)};
      const double half = kTwoSided95 * std::sqrt(kWithinTwoSigma * (1.0 - kWithinTwoSigma) / n);
      one.within_two_sigma = {sums.within / n, kWithinTwoSigma - half,
                              std::min(1.0, kWithinTwoSigma + half)};
      if (one.of_prisms) {
        squares += square.value;
        prism_parameters += 1.0;
      }
      result.parameters.push_back(std::move(one));
    }
    result.error_over_bound = std::sqrt(squares / prism_parameters);
    result.nees = mean_square(nees_ / degrees_, degrees_);
    result.nees_rotation_angles = nees_rotation_angles_ / static_cast<double>(answered_);
    for (const auto& [name, sums] : errors_) {
      const auto n = static_cast<double>(sums.cells);
      result.errors.push_back(
          {name, sums.cells, std::sqrt(sums.error2 / n), std::sqrt(sums.sigma2 / n)});
    }
    return result;
  }

 private:
  struct Sums {
    std::uint64_t cells = 0;
    double error = 0, error2 = 0, sigma2 = 0, bound2 = 0, within = 0;
  };
  using NamedSums = std::vector<std::pair<std::string, Sums>>;  // in the order of the cells

  static Sums& named(NamedSums& all, const std::string& name) {
    for (auto& [known, sums] : all) {
      if (known == name) return sums;
    }
    return all.emplace_back(name, Sums{}).second;
  }

  GridPoint grid_;
  TrainShape shape_;
  std::uint64_t cells_ = 0, answered_ = 0;
  double nees_ = 0, degrees_ = 0, nees_rotation_angles_ = 0;
  NamedSums parameters_, errors_;
};

/// Names in the order of first occurrence.
class Names {
 public:
  /// @return whether it is new
  bool note(const std::string& name) {
    const bool is_new = places_.emplace(name, all_.size()).second;
    if (is_new) all_.push_back(name);
    return is_new;
  }
  const std::vector<std::string>& all() const { return all_; }
  std::size_t place(const std::string& name) const { return places_.at(name); }

 private:
  std::vector<std::string> all_;
  std::map<std::string, std::size_t> places_;
};

/// The table of all cells.
class CellTable {
 public:
  explicit CellTable(const CampaignPlan& plan) : plan_(plan) {
    for (const auto& [name, value] : plan.settings.front().grid) grid_.note(name);
  }

  void note(const CellOutcome& outcome) {
    const TrainShape shape =
        plan_.settings.at(outcome.cell.setting).simulations.front().truth.shape();
    for (const CellParameter& one : outcome.parameters) {
      if (parameters_.note(one.name)) infos_.push_back(find_parameter(one.name, shape));
    }
    for (const CellErrors& one : outcome.errors) errors_.note(one.name);
  }

  std::vector<tables::TableColumn> columns() const {
    using tables::CellKind;
    std::vector<tables::TableColumn> columns = {
        {"cell", CellKind::integer, "1", "number of the cell, from 0"},
        {"setting", CellKind::integer, "1", "number of the setting, from 0"},
        {"seed", CellKind::integer, "1", "seed of the simulation"}};
    for (const std::string& name : grid_.all()) {
      columns.push_back({name, CellKind::text, "", "of the setting, as in the plan"});
    }
    columns.push_back({"answered", CellKind::integer, "1",
                       "1 where the estimate or the calibration converged, 0 otherwise"});
    columns.push_back({"verdict", CellKind::text, "", "code of the verdict"});
    columns.push_back({"message", CellKind::text, "", "why there is no answer"});
    for (const std::string& name : parameters_.all()) {
      const std::string unit = infos_[parameters_.place(name)].unit;
      columns.push_back({name + ".truth", CellKind::real, unit, "true value"});
      columns.push_back({name + ".error", CellKind::real, unit, "found minus true value"});
      columns.push_back({name + ".sigma", CellKind::real, unit,
                         "1 sigma, including possible errors of held parameters"});
      columns.push_back({name + ".sigma_given_held", CellKind::real, unit,
                         "1 sigma if all held parameters are exact"});
    }
    columns.push_back({"nees_parameters", CellKind::real, "1",
                       "squared error of the prisms' parameters, weighted by their covariance, per "
                       "degree of freedom"});
    columns.push_back({"degrees_of_freedom", CellKind::integer, "1", "of nees_parameters"});
    columns.push_back(
        {"nees_rotation_angles", CellKind::real, "1", "the same for rotation angles, mean"});
    for (const std::string& name : errors_.all()) {
      const std::string full = name_with_unit(name);
      const std::string unit = full.ends_with("_per_s") ? "deg/s" : "deg";
      columns.push_back({full + ".rmse", CellKind::real, unit, "root mean square error"});
      columns.push_back(
          {full + ".rmse_stated", CellKind::real, unit, "the same as stated by the estimate"});
    }
    return columns;
  }

  std::vector<tables::TableCell> row(const CellOutcome& outcome) const {
    const CampaignSetting& setting = plan_.settings.at(outcome.cell.setting);
    std::vector<tables::TableCell> row = {
        integer(outcome.cell.number), integer(outcome.cell.setting), integer(outcome.cell.seed)};
    for (const auto& [name, value] : setting.grid) row.emplace_back(value);
    row.emplace_back(integer(outcome.answered ? 1 : 0));
    row.emplace_back(outcome.verdict);
    row.emplace_back(outcome.message);
    const std::size_t parameters = row.size();
    row.resize(parameters + 4 * parameters_.all().size());
    for (const CellParameter& one : outcome.parameters) {
      const std::size_t place = parameters_.place(one.name);
      std::size_t at = parameters + 4 * place;
      for (const double value : {one.truth, one.error, one.sigma, one.sigma_given_held}) {
        row[at++] = value / infos_[place].si_per_unit;
      }
    }
    row.emplace_back(outcome.nees);
    row.push_back(outcome.answered ? integer(outcome.degrees_of_freedom) : tables::TableCell());
    row.emplace_back(outcome.nees_rotation_angles);
    const std::size_t errors = row.size();
    row.resize(errors + 2 * errors_.all().size());
    for (const CellErrors& one : outcome.errors) {
      const std::size_t at = errors + 2 * errors_.place(one.name);
      row[at] = one.rms * kDegreesPerRadian;
      row[at + 1] = one.sigma * kDegreesPerRadian;
    }
    return row;
  }

 private:
  static tables::TableCell integer(std::uint64_t value) { return static_cast<std::int64_t>(value); }

  const CampaignPlan& plan_;
  Names grid_, parameters_, errors_;
  std::vector<ParameterInfo> infos_;  ///< of the parameters
};

/// A file of cells that counts.
struct SoundChunk {
  std::string file;
  ChunkHead head;
};

/// All files of cells, the valid ones sorted by their first cell.
std::vector<SoundChunk> find_chunks(const CampaignPlan& plan, const CampaignOptions& options,
                                    CellTable& table, CampaignResult& result,
                                    const Progress& progress) {
  std::vector<std::string> files;
  std::error_code code;
  const std::string folder = chunk_folder(options.folder);
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code)) {
    if (at->path().extension() == ".jsonl") files.push_back(at->path().string());
  }
  if (code && code != std::errc::no_such_file_or_directory) {
    throw FileError(folder, {}, fmt::format("cannot be read: {}", code.message()));
  }
  if (files.empty()) {
    throw FileError(folder, {}, "there is no chunk of a campaign, such as chunk-1-of-40.jsonl");
  }
  std::sort(files.begin(), files.end());
  std::vector<SoundChunk> sound;
  for (const std::string& file : files) {
    progress.report(static_cast<double>(sound.size()) / static_cast<double>(files.size()));
    try {
      const auto check = [&](const ChunkHead& head) {
        if (head.work != plan.work) {
          throw FileError(file, {}, "it was made from another plan, or from other files");
        }
        if (head.program != options.program) {
          throw FileError(
              file, {},
              fmt::format("it was made by {}, this is {}", head.program, options.program));
        }
        if (head.first + head.cells > plan.cells()) {
          throw FileError(file, {}, "it has cells that the plan does not have");
        }
      };
      const ChunkHead head =
          read_chunk(file, progress, [&](const ChunkHead& its, CellOutcome&& outcome) {
            check(its);
            const CampaignCell cell = plan.cell(outcome.cell.number);
            if (outcome.cell.setting != cell.setting || outcome.cell.seed != cell.seed) {
              throw FileError(
                  file, {},
                  fmt::format("cell {} is of setting {} and seed {}, expected {} and {}",
                              cell.number, outcome.cell.setting, outcome.cell.seed, cell.setting,
                              cell.seed));
            }
            table.note(outcome);
          });
      check(head);
      sound.push_back({file, head});
    } catch (const FileError& error) {
      warn(result.warnings, kWarning.input_left_out, "{}; this chunk does not count", error.what());
    }
  }
  std::stable_sort(sound.begin(), sound.end(), [](const SoundChunk& a, const SoundChunk& b) {
    return a.head.first < b.head.first;
  });
  return sound;
}

}  // namespace

std::string name_with_unit(const std::string& errors) {
  return errors + (errors.starts_with("angular_velocity") ? "_deg_per_s" : "_deg");
}

CampaignResult merge_chunks(const CampaignPlan& plan, const std::string& table,
                            const CampaignOptions& options, const Progress& progress) {
  tables::TableFile::check_name(table);
  CampaignResult result;
  result.table = table;
  result.cells = plan.cells();
  CellTable cells(plan);
  const std::vector<SoundChunk> chunks =
      find_chunks(plan, options, cells, result, progress.part(0, 0.5));
  std::vector<SettingSums> sums(plan.settings.begin(), plan.settings.end());
  tables::TableFile file(table, cells.columns(),
                         {{"title", "cells of a Monte Carlo campaign"},
                          {"plan_sha256", plan.work},
                          {"source", options.program}});
  std::uint64_t next = 0;
  const auto pass_to = [&](std::uint64_t number) {
    if (next < number && result.missing.size() < kMostRanges) {
      result.missing.emplace_back(next, number - 1);
    }
    next = std::max(next, number);
  };
  for (const SoundChunk& chunk : chunks) {
    if (chunk.head.first + chunk.head.cells <= next) continue;  // others had them all
    read_chunk(chunk.file, progress, [&](const ChunkHead&, CellOutcome&& outcome) {
      if (outcome.cell.number < next) return;
      pass_to(outcome.cell.number);
      next = outcome.cell.number + 1;
      ++result.done;
      file.add(cells.row(outcome));
      sums.at(outcome.cell.setting).add(outcome);
    });
    progress.report(0.5 + 0.5 * static_cast<double>(next) / static_cast<double>(result.cells));
  }
  pass_to(result.cells);
  file.close();
  for (const SettingSums& one : sums) result.settings.push_back(one.summary());
  return result;
}

}  // namespace risley::jobs
