// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/running_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include <fmt/format.h>

#include "risley/algebra/named_covariance.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/batch_map.hpp"
#include "risley/estimation/estimate.hpp"

#include "estimation/frame_prior.hpp"
#include "estimation/optics_change.hpp"

namespace risley::estimation {
namespace {

using Eigen::Index;

constexpr std::size_t kFewestRunningShots = 2000;  // of a piece
/// A shorter part of a piece, before a gap, is dropped.
constexpr double kLeastPieceFilled = 0.5;
/// Longest gap over which rotors are followed, ns: they hunt.
constexpr std::int64_t kLongestRunningGap = 100'000'000;
/// Pieces that are pooled and compared with the beginning.
constexpr std::size_t kWindows[] = {1, 2, 4, 8};
constexpr std::size_t kMostPooled = 8;
/// Pieces of the longest reference period: half a minute.
constexpr std::size_t kMostBeginning = 60;
/// Consecutive checks that must agree before there is an alarm.
constexpr int kLooksThatAgree = 2;
/// A piece with a larger share of rejected shots, or this many times the usual noise, does not fit
/// the model.
constexpr double kMostOutliers = 0.3, kMostNoise = 3;
constexpr double kSecondsPerHour = 3600;

double seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

/// Mean speeds over a piece: the angle between its ends, which are far apart and so independent.
std::vector<RunningSpeed> speeds_of(const RotorTrajectory& knots) {
  std::vector<RunningSpeed> result;
  const std::size_t last = knots.size() - 1;
  const double time = seconds(knots.time_ns[last] - knots.time_ns[0]);
  for (std::size_t k = 0; k < static_cast<std::size_t>(knots.prisms); ++k) {
    result.push_back(
        {(knots.angle(last, k, 0) - knots.angle(0, k, 0)) / time,
         std::sqrt(knots.angle_covariance(0, k, k, 0) + knots.angle_covariance(last, k, k, 0)) /
             time});
  }
  return result;
}

}  // namespace

const char* to_string(OpticsAlarmKind kind) {
  return kind == OpticsAlarmKind::changed ? "changed" : "unlike";
}

const char* to_string(RunningState::Phase phase) {
  switch (phase) {
    case RunningState::Phase::waiting:
      return "waiting";
    case RunningState::Phase::beginning:
      return "beginning";
    case RunningState::Phase::watching:
      break;
  }
  return "watching";
}

/// Pieces of a recording in progress.
class RunningEstimate::Watcher {
 public:
  explicit Watcher(RunningOptions options)
      : options_(std::move(options)), ticks_(options_.most_rate) {
    require_between("option piece", options_.piece, 0.1, 60, "s");
    require_between("option most_rate", options_.most_rate, 1000, 1e6, "Hz");
    require_between("option false_alarms_per_hour", options_.false_alarms_per_hour, 1e-9, 10);
    require_at_least("option beginning", static_cast<long long>(options_.beginning), 1);
    const double looks = kSecondsPerHour / options_.piece;
    const double tests = static_cast<double>(std::size(kWindows)) * (options_.is_sensor ? 2 : 1);
    state_.alarm_p_value = options_.false_alarms_per_hour / (looks * tests);
  }

  bool add(const recordings::Observations& rows, const Progress& progress);

  const RunningState& state() const { return state_; }
  const RunningOptions& options() const { return options_; }

 private:
  bool end_piece(const Progress& progress);
  void begin_series();
  void estimate_piece(AngleSeries& series, const Progress& progress);
  Estimate estimate_first(const AngleSeries& series, const Progress& progress) const;
  Solution solve(const AngleSeries& series, const Start& start, const Progress& progress) const;
  Start go_on_from_last(std::int64_t time_ns) const;
  void prepare(const Estimate& first);
  std::string unfit_reason(const Solution& solution, std::size_t shots) const;
  void take(const Solution& solution);
  void lengthen_beginning();
  void look();
  void describe();
  ConstantsEstimate scaled(const Solution& solution) const;

  RunningOptions options_;
  TickSampler ticks_;
  RunningState state_;
  AngleSeries series_;  // of the current piece
  std::optional<std::int64_t> last_ns_;
  double looked_at_ = 0;  // s of shots

  // From the first piece that could be estimated.
  std::optional<Start> start_;
  std::vector<FreeParameter> free_;
  bool toward_zero_ = false;
  double usual_noise_ = 0;
  Eigen::VectorXd scale_, held_sigma_;  // [free]: prior sigmas; contribution of held values, SI
                                        // units
  Eigen::MatrixXd sensor_covariance_;   // of the sensor's own values, as pieces see them, scaled

  Solution last_;
  std::deque<ConstantsEstimate> pieces_;  // the last ones
  std::deque<double> durations_;
  std::optional<ConstantsEstimate> beginning_;
  std::size_t beginning_pieces_ = 0;
  PieceScatter scatter_;
  int agreeing_ = 0;
};

void RunningEstimate::Watcher::begin_series() {
  series_ = {};
  last_ns_.reset();
}

bool RunningEstimate::Watcher::add(const recordings::Observations& rows, const Progress& progress) {
  const auto piece_ns = static_cast<std::int64_t>(1e9 * options_.piece);
  const auto variance = [](float step) { return step * step / 12.0F; };
  bool any = false;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows.valid[i] == 0 || !std::isfinite(rows.azimuth[i]) || !std::isfinite(rows.zenith[i])) {
      continue;
    }
    const std::int64_t time_ns = rows.time_ns[i];
    if (last_ns_) {
      const std::int64_t step = time_ns - *last_ns_;
      if (step == 0) continue;  // a further return
      if (step < 0 && step >= -static_cast<std::int64_t>(1e9 * kClockReset)) continue;
      const bool broken = step < 0 || step > kLongestRunningGap;
      if (broken || (series_.size() > 0 && time_ns - series_.time_ns.front() >= piece_ns)) {
        any = end_piece(progress) || any;
      }
      if (broken) begin_series();
    }
    if (!last_ns_) ticks_.restart(time_ns);
    last_ns_ = time_ns;
    ++state_.shots;
    if (!ticks_.take(time_ns, rows.beam[i])) continue;
    series_.append(time_ns, rows.azimuth[i], rows.zenith[i], rows.beam[i],
                   variance(rows.azimuth_resolution[i]), variance(rows.zenith_resolution[i]));
    series_.range.push_back(rows.range[i]);
    series_.intensity.push_back(rows.intensity[i]);
  }
  return any;
}

/// @return whether the piece was used
bool RunningEstimate::Watcher::end_piece(const Progress& progress) {
  AngleSeries series = std::exchange(series_, {});
  if (series.size() < kFewestRunningShots ||
      series.duration() < kLeastPieceFilled * options_.piece) {
    ++state_.short_pieces;
    return false;
  }
  looked_at_ += series.duration();
  state_.time_ns = series.time_ns.back();
  try {
    estimate_piece(series, progress);
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {  // such as no start, or a beam that the sensor does not have
    state_.reason = error.what();
  }
  if (state_.reason.empty()) {
    state_.unfit_in_a_row = 0;
  } else {
    ++state_.unfit_pieces;
    ++state_.unfit_in_a_row;
  }
  return true;
}

Estimate RunningEstimate::Watcher::estimate_first(const AngleSeries& series,
                                                  const Progress& progress) const {
  EstimateOptions options;
  options.sensor = options_.sensor;
  options.cartesian = options_.cartesian;
  Estimate first = estimate(Method::map, series, series, options, progress.silent());
  if (first.verdict.code == EstimateCode::inconsistent || !first.settled) {
    throw EstimationError(first.reason);
  }
  return first;
}

/// Keeps the data that later pieces share with the first.
void RunningEstimate::Watcher::prepare(const Estimate& first) {
  start_ = first.start;
  if (first.frame_turn) start_->frame = first.frame_turn->turn;
  free_ = first.free;
  toward_zero_ = first.coordinates == CoordinateRounding::toward_zero;
  usual_noise_ = std::max(first.noise.value.rms(), options_.sensor.angle_noise);
  const auto n = static_cast<Index>(free_.size());
  scale_.resize(n);
  std::vector<std::string> names;
  for (Index i = 0; i < n; ++i) {
    const FreeParameter& parameter = free_[static_cast<std::size_t>(i)];
    scale_[i] = parameter.prior_sigma;
    names.push_back(parameter.name);
  }
  const HeldChanges& changes = first.held_changes;
  held_sigma_ = changes.values.topRows(n).rowwise().norm();
  // A piece that holds the sensor's values h differs from the result at the true ones by G (h -
  // true). If the sensor's covariance includes them, it has their correlation with the others.
  const auto held = static_cast<Index>(changes.held.size());
  Eigen::MatrixXd from(n, n + held);
  from.leftCols(n).setIdentity();
  for (Index j = 0; j < held; ++j) {
    const FreeParameter& one = changes.held[static_cast<std::size_t>(j)];
    from.col(n + j) = -changes.values.col(j).head(n) / one.prior_sigma;
    names.push_back(one.name);
  }
  algebra::NamedCovariance known{options_.sensor.covariance_names, options_.sensor.covariance};
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(n + held, n + held);
  for (Index i = 0; i < n + held; ++i) {
    const Index row = known.find(names[static_cast<std::size_t>(i)]);
    if (row >= 0) {
      for (Index j = 0; j < n + held; ++j) {
        const Index column = known.find(names[static_cast<std::size_t>(j)]);
        if (column >= 0) own(i, j) = known.matrix(row, column);
      }
    } else if (known.empty()) {
      const sensors::Knowledge* knowledge =
          options_.sensor.find_knowledge(names[static_cast<std::size_t>(i)]);
      if (knowledge != nullptr) own(i, i) = knowledge->sigma * knowledge->sigma;
    }
  }
  sensor_covariance_ = scale_.cwiseInverse().asDiagonal() * (from * own * from.transpose()) *
                       scale_.cwiseInverse().asDiagonal();
}

Start RunningEstimate::Watcher::go_on_from_last(std::int64_t time_ns) const {
  Start start = *start_;
  const RotorTrajectory& knots = last_.trajectory;
  const std::size_t knot = knots.size() - 1;
  const double later = seconds(time_ns - knots.time_ns[knot]);
  start.time_ns = time_ns;
  start.train = last_.train;
  for (std::size_t k = 0; k < start.rotation_angle.size(); ++k) {
    start.rotation_angle[k] = knots.angle(knot, k, later);
    start.angular_velocity[k] = knots.speed(knot, k, later);
  }
  return start;
}

Solution RunningEstimate::Watcher::solve(const AngleSeries& series, const Start& start,
                                         const Progress& progress) const {
  BatchMapOptions options;
  options.free = free_;
  if (start_->frame) options.frame_sigma = kFrameSigma;
  return run_batch_map(series, start, options_.sensor, options, progress.silent());
}

std::string RunningEstimate::Watcher::unfit_reason(const Solution& solution,
                                                   std::size_t shots) const {
  if (!solution.settled) return "the estimate did not settle";
  const double outliers =
      static_cast<double>(solution.outliers + solution.unused_shots) / static_cast<double>(shots);
  if (outliers > kMostOutliers) {
    return fmt::format("{:.0f} % of the shots do not fit the model", 100 * outliers);
  }
  if (solution.noise.value.rms() > kMostNoise * usual_noise_) {
    return fmt::format("the directions are {:.2g} times as noisy as in the beginning",
                       solution.noise.value.rms() / usual_noise_);
  }
  return {};
}

void RunningEstimate::Watcher::estimate_piece(AngleSeries& series, const Progress& progress) {
  state_.reason.clear();
  const double duration = series.duration();
  if (!start_) {
    const Estimate first = estimate_first(series, progress);
    prepare(first);
    state_.combination = first.start.combination;
    last_ = first;
  } else {
    prepare_shots(series, *start_);
    if (toward_zero_) {
      add_half_steps(series, recording_from_sensor(start_->frame.value_or(FrameTurn{})));
    }
    std::optional<Solution> found;
    const std::int64_t since = series.time_ns.front() - last_.trajectory.time_ns.back();
    if (since > 0 && since < kLongestRunningGap) {
      try {
        found = solve(series, go_on_from_last(series.time_ns.front()), progress);
        if (!unfit_reason(*found, series.size()).empty()) found.reset();
      } catch (const EstimationError&) {  // the rotors are elsewhere
      }
    }
    if (!found) {
      sensors::Sensor known = options_.sensor;
      known.train = last_.train;
      const Start start = find_start(series, known, {free_, usual_noise_, false, false});
      if (start.combination != start_->combination) {
        throw EstimationError("the rotors run in the other speed combination");
      }
      found = solve(series, start, progress);
      state_.reason = unfit_reason(*found, series.size());
      if (!state_.reason.empty()) return;
    }
    last_ = *std::move(found);
  }
  ++state_.pieces;
  durations_.push_back(duration);
  take(last_);
}

/// In units of the priors, whose mean is the sensor.
ConstantsEstimate RunningEstimate::Watcher::scaled(const Solution& solution) const {
  const Eigen::VectorXd nominal = free_values(options_.sensor.train, free_);
  const Eigen::VectorXd inverse = scale_.cwiseInverse();
  return {inverse.cwiseProduct(solution.parameters - nominal),
          inverse.asDiagonal() * solution.covariance * inverse.asDiagonal()};
}

void RunningEstimate::Watcher::take(const Solution& solution) {
  state_.speeds = speeds_of(solution.trajectory);
  state_.angle_noise = solution.noise.value.rms();
  pieces_.push_back(scaled(solution));
  const std::size_t most = beginning_ ? kMostPooled : std::max(kMostPooled, options_.beginning);
  while (pieces_.size() > most) {
    if (beginning_) lengthen_beginning();
    pieces_.pop_front();
    durations_.pop_front();
  }
  if (beginning_) {
    look();
  } else if (pieces_.size() >= options_.beginning) {
    beginning_ = pooled(pieces_, pieces_.size());
    beginning_pieces_ = pieces_.size();
    scatter_ = piece_scatter(pieces_);
    state_.scatter_variance_factor = scatter_.variance_factor;
    // The newest pieces must differ from those of the reference.
    pieces_.clear();
    durations_.clear();
    state_.phase = RunningState::Phase::watching;
  } else {
    state_.phase = RunningState::Phase::beginning;
  }
  describe();
}

/// The oldest piece is no longer compared: it joins the reference, up to a fixed number, so that
/// slow changes are not followed.
void RunningEstimate::Watcher::lengthen_beginning() {
  if (beginning_pieces_ >= kMostBeginning || agreeing_ > 0 || state_.alarm) return;
  beginning_ = pooled({*beginning_, pieces_.front()}, 2);
  ++beginning_pieces_;
}

/// Compares the last pieces with the beginning, and with the sensor.
void RunningEstimate::Watcher::look() {
  const Index n = scale_.size();
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(n, n);
  const ConstantsEstimate sensor{Eigen::VectorXd::Zero(n), none};
  const auto change_of = [&](const ConstantsEstimate& recent) {
    return difference_of(*beginning_, recent, none, scatter_);
  };
  const auto unlike_of = [&](const ConstantsEstimate& recent) {
    return difference_of(sensor, recent, sensor_covariance_, scatter_);
  };
  ConstantsDifference change, unlike;
  const auto keep_least = [](const ConstantsDifference& one, ConstantsDifference& least) {
    if (one.p_value < least.p_value) least = one;
  };
  for (const std::size_t window : kWindows) {
    if (window > pieces_.size()) break;
    const ConstantsEstimate recent = pooled(pieces_, window);
    keep_least(change_of(recent), change);
    if (options_.is_sensor) keep_least(unlike_of(recent), unlike);
  }
  state_.change_p_value = change.p_value;
  state_.unlike_p_value = unlike.p_value;
  const bool changed = change.p_value <= unlike.p_value;
  const ConstantsDifference& most = changed ? change : unlike;
  agreeing_ = most.p_value < state_.alarm_p_value ? std::min(agreeing_ + 1, kLooksThatAgree) : 0;
  const bool alarmed = agreeing_ == kLooksThatAgree;
  if (alarmed && !state_.alarmed) ++state_.alarms;
  state_.alarmed = alarmed;
  if (!alarmed || state_.alarm) return;
  // The change may lie within the longer windows; the last piece is after it.
  const ConstantsEstimate last = pooled(pieces_, 1);
  const ConstantsDifference now = changed ? change_of(last) : unlike_of(last);
  const Index worst = most.constant.value();
  const ConstantsDifference& shown = std::isfinite(now.change[worst]) ? now : most;
  state_.alarm = {changed ? OpticsAlarmKind::changed : OpticsAlarmKind::unlike,
                  state_.time_ns,
                  looked_at_,
                  most.p_value,
                  free_[static_cast<std::size_t>(worst)].name,
                  scale_[worst] * shown.change[worst],
                  scale_[worst] * shown.change_sigma[worst]};
}

/// Parameters over the last pieces.
void RunningEstimate::Watcher::describe() {
  if (pieces_.empty()) return;  // those of the beginning stay until there are others
  const ConstantsEstimate recent = pooled(pieces_, kMostPooled);
  const double factor = scatter_.variance_factor;
  state_.window = 0;
  for (std::size_t i = pieces_.size() - std::min(pieces_.size(), kMostPooled); i < pieces_.size();
       ++i) {
    state_.window += durations_[i];
  }
  const Eigen::VectorXd nominal = free_values(options_.sensor.train, free_);
  state_.parameters.clear();
  for (Index i = 0; i < scale_.size(); ++i) {
    const double variance = factor * recent.covariance(i, i);
    RunningParameter one;
    one.name = free_[static_cast<std::size_t>(i)].name;
    one.off_sensor = scale_[i] * recent.mean[i];
    one.value = nominal[i] + one.off_sensor;
    one.sigma_given_held = scale_[i] * std::sqrt(variance);
    one.sigma = std::hypot(one.sigma_given_held, held_sigma_[i]);
    one.off_sensor_sigma = scale_[i] * std::sqrt(variance + sensor_covariance_(i, i));
    if (beginning_) {
      one.change = scale_[i] * (recent.mean[i] - beginning_->mean[i]);
      one.change_sigma = scale_[i] * std::sqrt(variance + factor * beginning_->covariance(i, i));
    }
    state_.parameters.push_back(std::move(one));
  }
}

RunningEstimate::RunningEstimate(RunningOptions options)
    : watcher_(std::make_unique<Watcher>(std::move(options))) {}
RunningEstimate::~RunningEstimate() = default;
RunningEstimate::RunningEstimate(RunningEstimate&&) noexcept = default;
RunningEstimate& RunningEstimate::operator=(RunningEstimate&&) noexcept = default;

bool RunningEstimate::add(const recordings::Observations& rows, const Progress& progress) {
  return watcher_->add(rows, progress);
}
const RunningState& RunningEstimate::state() const { return watcher_->state(); }
const RunningOptions& RunningEstimate::options() const { return watcher_->options(); }

}  // namespace risley::estimation
