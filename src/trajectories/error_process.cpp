// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/error_process.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/saturating.hpp"
#include "risley/io/text_file.hpp"
#include "risley/io/yaml_map.hpp"

namespace risley::trajectories {
namespace {

using io::fail_at;
using io::YamlMap;

constexpr int kErrorModelVersion = 1;

/// How a file calls an error.
struct ErrorName {
  const char* key;
  const char* unit;
  long double scale;  ///< SI units per unit of the file
};

constexpr long double kErrorDegree = std::numbers::pi_v<long double> / 180;
constexpr std::array<ErrorName, kPoseErrors> kErrorNames{{
    {"north_m", "m", 1},
    {"east_m", "m", 1},
    {"up_m", "m", 1},
    {"tilt_north_deg", "deg", kErrorDegree},
    {"tilt_east_deg", "deg", kErrorDegree},
    {"heading_deg", "deg", kErrorDegree},
}};

constexpr double kLargestErrorSigma = 1e4;                                               // m or deg
constexpr double kLongestCorrelation = 1e9, kLongestSample = 1e4, kShortestTime = 1e-6;  // s

ErrorTerm read_error_term(const YamlMap& root, const ErrorName& name) {
  const YamlMap map = root.section(name.key);
  map.allow_only({"sigma", "correlation_time_s", "white", "source"});
  const auto number = [&](std::string_view key) {
    return static_cast<double>(map.number(key, 0, kLargestErrorSigma, name.unit) * name.scale);
  };
  ErrorTerm term;
  if (map.find("sigma") != nullptr) term.sigma = number("sigma");
  if (map.find("white") != nullptr) term.white = number("white");
  term.correlation_time = map.real("correlation_time_s", kShortestTime, kLongestCorrelation, "s");
  term.source = map.words("source");
  return term;
}

bool has_white(const ErrorModel& model) {
  return std::ranges::any_of(model.terms, [](const ErrorTerm& term) { return term.white > 0; });
}

}  // namespace

ErrorModel assumed_error_model() {
  constexpr double kMinutes = 120, kHeading = 300;  // s
  ErrorModel model;
  for (std::size_t i = 0; i < kPoseErrors; ++i) {
    const bool heading = i == static_cast<std::size_t>(PoseError::heading);
    model.terms[i].correlation_time = heading ? kHeading : kMinutes;
    model.terms[i].source = "accuracies of the trajectory; correlation time assumed";
  }
  return model;
}

ErrorModel parse_error_model(const std::string& text, const std::string& path) {
  const YamlMap root(io::parse_yaml(text, path), path, "");
  if (root.find("risley_trajectory_errors") == nullptr) {
    fail_at(path, root.line(),
            "is not a file of trajectory errors: risley_trajectory_errors is missing");
  }
  root.integer("risley_trajectory_errors", kErrorModelVersion, kErrorModelVersion);
  root.allow_only({"risley_trajectory_errors", "sample_interval_s", "north_m", "east_m", "up_m",
                   "tilt_north_deg", "tilt_east_deg", "heading_deg"});
  ErrorModel model;
  for (std::size_t i = 0; i < kPoseErrors; ++i) {
    model.terms[i] = read_error_term(root, kErrorNames[i]);
  }
  if (root.find("sample_interval_s") != nullptr) {
    model.sample_interval = root.real("sample_interval_s", kShortestTime, kLongestSample, "s");
  } else if (has_white(model)) {
    fail_at(path, root.line(),
            "sample_interval_s is missing: white parts are constant within a sample");
  }
  return model;
}

ErrorModel load_error_model(const std::string& path) {
  return parse_error_model(io::read_text_file(path), path);
}

void require_error_model(const ErrorModel& model) {
  for (std::size_t i = 0; i < kPoseErrors; ++i) {
    const ErrorTerm& term = model.terms[i];
    const auto name = [&](std::string_view what) {
      return fmt::format("{} of {}", what, kErrorNames[i].key);
    };
    if (term.sigma) require_not_below(name("sigma"), *term.sigma, 0);
    require_between(name("correlation time"), term.correlation_time, kShortestTime,
                    kLongestCorrelation, "s");
    require_not_below(name("white part"), term.white, 0);
  }
  if (has_white(model)) {
    require_between("sample_interval", model.sample_interval, kShortestTime, kLongestSample, "s");
  } else {
    require_between("sample_interval", model.sample_interval, 0, kLongestSample, "s");
  }
}

ErrorProcess::ErrorProcess(const ErrorModel& model, const Trajectory& trajectory) {
  require_error_model(model);
  require_trajectory(trajectory);
  first_ns_ = trajectory.time_ns.front();
  if (has_white(model)) {
    sample_ns_ = std::max<std::int64_t>(1, std::llround(1e9 * model.sample_interval));
  }
  PoseErrorVector stated = PoseErrorVector::Zero();
  std::string lacking;
  for (std::size_t i = 0; i < kPoseErrors; ++i) {
    const ErrorTerm& term = model.terms[i];
    correlation_times_[i] = term.correlation_time;
    white_[i] = term.white;
    stated[i] = term.sigma.value_or(0);
    if (!term.sigma) {
      lacking += fmt::format("{}{}", lacking.empty() ? "" : ", ", kErrorNames[i].key);
    }
  }
  if (lacking.empty()) {
    sigmas_.push_back(stated);
    return;
  }
  if (trajectory.accuracy.empty()) {
    throw InvalidArgument(
        fmt::format("sigma of {} is not stated, and the trajectory holds no accuracies", lacking));
  }
  time_ns_ = trajectory.time_ns;
  sigmas_.reserve(time_ns_.size());
  for (std::size_t row = 0; row < trajectory.size(); ++row) {
    const PoseAccuracy& accuracy = trajectory.accuracy[row];
    const double heading =
        roll_pitch_heading(trajectory.frame, trajectory.position[row], trajectory.attitude[row])
            .heading;
    // Roll turns about the nose's direction, pitch about the right wing's.
    const double along = std::cos(heading), across = std::sin(heading);
    PoseErrorVector sigmas;
    sigmas << accuracy.position, std::hypot(along * accuracy.roll, across * accuracy.pitch),
        std::hypot(across * accuracy.roll, along * accuracy.pitch), accuracy.heading;
    for (std::size_t i = 0; i < kPoseErrors; ++i) {
      if (model.terms[i].sigma) sigmas[i] = stated[i];
    }
    sigmas_.push_back(sigmas);
  }
}

ErrorProcess ErrorProcess::scaled(const PoseErrorVector& factors) const {
  for (Eigen::Index i = 0; i < factors.size(); ++i) {
    require_above("factor of a process", factors[i], 0);
  }
  ErrorProcess result = *this;
  for (PoseErrorVector& sigmas : result.sigmas_) sigmas = sigmas.cwiseProduct(factors);
  return result;
}

PoseErrorVector ErrorProcess::sigmas(std::int64_t time_ns) const {
  if (time_ns_.empty() || time_ns <= time_ns_.front()) return sigmas_.front();
  if (time_ns >= time_ns_.back()) return sigmas_.back();
  const auto later = std::ranges::upper_bound(time_ns_, time_ns);
  const auto row = static_cast<std::size_t>(later - time_ns_.begin()) - 1;
  const double share = static_cast<double>(time_ns - time_ns_[row]) /
                       static_cast<double>(time_ns_[row + 1] - time_ns_[row]);
  return (1 - share) * sigmas_[row] + share * sigmas_[row + 1];
}

std::int64_t ErrorProcess::sample(std::int64_t time_ns) const {
  if (sample_ns_ == 0) return 0;
  const std::int64_t since = saturating_difference(time_ns, first_ns_);
  return since / sample_ns_ - (since % sample_ns_ < 0 ? 1 : 0);
}

PoseErrorMatrix ErrorProcess::covariance(std::int64_t time_ns, std::int64_t other_ns) const {
  const double apart =
      1e-9 * std::abs(static_cast<double>(saturating_difference(time_ns, other_ns)));
  PoseErrorVector diagonal = sigmas(time_ns).cwiseProduct(sigmas(other_ns));
  for (Eigen::Index i = 0; i < diagonal.size(); ++i) {
    diagonal[i] *= std::exp(-apart / correlation_times_[i]);
  }
  if (sample(time_ns) == sample(other_ns)) diagonal += white_.cwiseAbs2();
  return diagonal.asDiagonal();
}

}  // namespace risley::trajectories
