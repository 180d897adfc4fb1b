// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/emitter_comparison.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/algebra/products.hpp"
#include "risley/estimation/smoother.hpp"

#include "estimation/bound.hpp"

namespace risley::estimation {
namespace {

/// Ratio of two sigmas that is worth reporting.
constexpr double kNotable = 2.0;

bool is_beam(int place, int prisms) { return place::emitter(place, prisms) >= 0; }

/// Every parameter of a single prism and every beam: each place of the flat vector that data
/// determine.
std::vector<FreeParameter> single_parameters(TrainShape shape) {
  std::vector<std::string> names;
  for (const ParameterInfo& info : parameter_list(shape)) {
    const bool all_prisms = info.name == "refractive_index" || info.name == "wedge_angle_deg";
    if (info.kind == ParameterKind::train && !all_prisms && info.name != "refractive_index_air") {
      names.push_back(info.name);
    }
  }
  return free_parameters(names, shape);
}

/// The shots of one emitter, of the same knots.
void keep_emitter(AngleSeries& series, RotorTrajectory& knots, std::uint8_t beam) {
  AngleSeries own;
  for (std::size_t knot = 0; knot < knots.size(); ++knot) {
    const std::size_t first = own.size();
    for (std::size_t i = knots.first_shot[knot]; i < knots.last_shot[knot]; ++i) {
      if (series.beam[i] == beam) own.append(series, i);
    }
    knots.first_shot[knot] = first;
    knots.last_shot[knot] = own.size();
  }
  series = std::move(own);
}

/// Information of the data on single parameters, rotors eliminated.
class SingleInformation {
 public:
  SingleInformation(const AngleSeries& series, const RotorTrajectory& knots,
                    const PrismTrain& train, std::span<const RotorProcess> process,
                    const std::vector<FreeParameter>& all, const ShotWeights& weights,
                    double factor)
      : all_(all) {
    NormalEquations equations;
    accumulate(series, knots, train, all, weights, equations);
    equations.scale(factor);
    const auto n = static_cast<Eigen::Index>(all.size());
    ParameterPrior prior{Eigen::VectorXd(n), Eigen::VectorXd::Zero(n)};
    for (Eigen::Index i = 0; i < n; ++i) {
      prior.information[i] = std::pow(all[static_cast<std::size_t>(i)].prior_sigma, -2);
    }
    information_ = smooth(equations, knots, process, prior, false).parameter_information;
  }

  /// Bound of one parameter, freed with others, which may be of several prisms together.
  double sigma(std::size_t parameter, std::vector<FreeParameter> free) const {
    const bool among = std::any_of(free.begin(), free.end(), [&](const FreeParameter& one) {
      return one.places == all_[parameter].places;
    });
    if (!among) free.push_back(all_[parameter]);
    const Eigen::MatrixXd columns = jacobian(free);
    Eigen::VectorXd scale(columns.cols());
    for (Eigen::Index j = 0; j < scale.size(); ++j) {
      scale[j] = free[static_cast<std::size_t>(j)].prior_sigma;
    }
    return bound_sigma(algebra::pulled_back(columns, information_), scale,
                       columns.row(static_cast<Eigen::Index>(parameter)));
  }

  /// Undetermined combinations of a set of free parameters.
  std::vector<WeakDirection> untold(const std::vector<FreeParameter>& free) const {
    return weak_directions(algebra::pulled_back(jacobian(free), information_), free, 1.0);
  }

 private:
  /// Of the single parameters with respect to free ones.
  Eigen::MatrixXd jacobian(const std::vector<FreeParameter>& free) const {
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(all_.size()),
                                                   static_cast<Eigen::Index>(free.size()));
    for (Eigen::Index i = 0; i < result.rows(); ++i) {
      const int place = all_[static_cast<std::size_t>(i)].places.front();
      for (Eigen::Index j = 0; j < result.cols(); ++j) {
        const auto& places = free[static_cast<std::size_t>(j)].places;
        if (std::find(places.begin(), places.end(), place) != places.end()) result(i, j) = 1.0;
      }
    }
    return result;
  }

  const std::vector<FreeParameter>& all_;
  Eigen::MatrixXd information_;
};

/// "refractive_index_a (58 times)"
std::string times_text(const std::string& name, double ratio) {
  return fmt::format("{} ({:.{}f} times)", name, ratio, ratio < 10 ? 1 : 0);
}

}  // namespace

EmitterComparison compare_emitters(const AngleSeries& series, const RotorTrajectory& knots,
                                   const PrismTrain& train, std::span<const RotorProcess> process,
                                   const std::vector<FreeParameter>& free,
                                   const ShotWeights& weights, double factor,
                                   const Progress& progress) {
  EmitterComparison result;
  if (train.emitters() < 2 || series.beam.empty()) return result;
  const int prisms = train.prisms();
  std::array<std::size_t, kMaxEmitters> shots{};
  for (std::size_t knot = 0; knot < knots.size(); ++knot) {
    for (std::size_t i = knots.first_shot[knot]; i < knots.last_shot[knot]; ++i) {
      ++shots[series.beam[i]];
    }
  }
  std::size_t total = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (int emitter = 0; emitter < train.emitters(); ++emitter) {
    const std::size_t own = shots[static_cast<std::size_t>(emitter)];
    if (own == 0) continue;
    ++result.emitters;
    total += own;
    const double off_axis = std::hypot(train[place::incident_beam_horizontal(emitter, prisms)],
                                       train[place::incident_beam_vertical(emitter, prisms)]);
    if (off_axis < nearest) {
      nearest = off_axis;
      result.alone = emitter;
    }
  }
  if (result.emitters < 2) return result;

  const std::vector<FreeParameter> all = single_parameters(train.shape());
  const SingleInformation together(series, knots, train, process, all, weights, factor);
  progress.check();
  AngleSeries own = series;
  RotorTrajectory own_knots = knots;
  keep_emitter(own, own_knots, static_cast<std::uint8_t>(result.alone));
  const double own_factor = factor * static_cast<double>(total) / static_cast<double>(own.size());
  const SingleInformation single(own, own_knots, train, process, all, weights, own_factor);

  progress.check();
  std::vector<FreeParameter> known, alone;
  const std::vector<std::string> usual = default_free_names(train.shape());
  const std::vector<std::string> usual_of_one = default_free_names({prisms});
  const auto within = [](const std::string& name, const std::vector<std::string>& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  for (const FreeParameter& one : free) {
    const int place = one.places.front();
    const bool beam = is_beam(place, prisms);
    if (!beam) known.push_back(one);
    if (beam ? place::emitter(place, prisms) == result.alone
             : !within(one.name, usual) || within(one.name, usual_of_one)) {
      alone.push_back(one);
    }
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (is_beam(all[i].places.front(), prisms)) continue;
    result.bounds.push_back(
        {all[i].name, together.sigma(i, free), together.sigma(i, known), single.sigma(i, alone)});
  }
  result.untold_alone = single.untold(alone);
  return result;
}

std::vector<std::string> emitter_words(const EmitterComparison& comparison) {
  std::vector<std::string> untold, better, costly;
  for (const EmitterBounds& bounds : comparison.bounds) {
    if (!std::isfinite(bounds.all)) continue;
    const double gain = bounds.alone / bounds.all, cost = bounds.all / bounds.known;
    if (!std::isfinite(gain)) {
      untold.push_back(bounds.name);
    } else if (gain >= kNotable) {
      better.push_back(times_text(bounds.name, gain));
    }
    if (cost >= kNotable) costly.push_back(times_text(bounds.name, cost));
  }
  std::vector<std::string> words;
  if (!untold.empty()) {
    words.push_back(
        fmt::format("only the {} emitters together determine {}: emitter {} alone never does",
                    comparison.emitters, fmt::join(untold, ", "), comparison.alone + 1));
  }
  if (!better.empty()) {
    words.push_back(
        fmt::format("the {} emitters together determine better than as many shots of emitter "
                    "{} alone: {}",
                    comparison.emitters, comparison.alone + 1, fmt::join(better, ", ")));
  }
  if (!costly.empty()) {
    words.push_back(
        fmt::format("free directions of the emitters act like other parameters; if they "
                    "were known, these would be known better: {}",
                    fmt::join(costly, ", ")));
  }
  return words;
}

}  // namespace risley::estimation
