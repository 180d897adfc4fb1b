// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/slip_follower.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

#include <Eigen/Core>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/normal_equations.hpp"

#include "estimation/knot_model.hpp"

namespace risley::estimation {
namespace {

/// Shots that are predicted and tested together.
constexpr std::size_t kTestedShots = 96;
/// Further blocks that may be needed to explain a suspicious one.
constexpr std::size_t kMostBlocksAhead = 8;
/// Time over which a prediction is compared with shots, s: rotors hardly bend in it.
constexpr double kLongestTest = 0.012;
/// Numbers of shots that may be repeated, and of missing ones that are tried first, and otherwise.
constexpr std::int64_t kDoubledShots = 96, kUsualSlip = 120, kNearSlip = 200, kFarSlip = 2000;
/// A slip, and its size, are accepted from this difference of chi2 on.
constexpr double kSure = 30.0;
/// Largest factor by which correlated residuals lose weight.
constexpr double kMostCorrelation = 10.0;
/// Losses of single shots saturate at 1 / softening: mean losses near it mean that nothing fits.
constexpr double kSoftening = softening_at(1.0);
constexpr double kLostLoss = 0.5 / kSoftening;
/// With residuals of this many steps from shot to shot that no number of missing shots explains,
/// the rotors are lost.
constexpr double kLostSteps = 8.0;
/// A prediction less certain than this cannot test single shots, in shots.
constexpr double kLooseShots = 0.15;
/// Uncertainty of the start.
constexpr double kAnchorAngleSigma = radians_from_degrees(0.5), kAnchorSpeedShare = 1e-3;
/// Shots in packets of the formats. Recorders lose some at their borders: this many slips, and this
/// share of them, reveal the positions of the borders.
constexpr std::int64_t kPacketShots[] = {96, 100};
constexpr std::size_t kFewestAtBorders = 5;
constexpr double kShareAtBorders = 0.7;

/// Follows the rotors from a start in one direction. Places are steps from the start.
class Follower : private BlockFit {
 public:
  /// @param noise  of the shots about the fit of the start, rad
  /// @param typical  step from shot to shot, rad
  Follower(const NumberedShots& shots, const PrismTrain& train, double noise, double step,
           std::ptrdiff_t direction, std::size_t first, std::size_t count)
      : BlockFit(train, kSoftening),
        shots_(shots),
        direction_(direction),
        first_(first),
        count_(count),
        step_(step) {
    weights_.angle_noise = equal_noise(std::max(noise, kLeastNoiseSteps * step));
  }

  /// Fits a state to all places, as if they were free of slips.
  /// @param from  initial noise: initial error of the directions, rad
  /// @return scale of the residuals, rad
  double settle(RotorState& state, double from) {
    load(0, count_, 0);
    predict(state, middle());
    const RotorState loose = state;
    const double noise = weights_.angle_noise.azimuth;
    for (double level = from;; level = std::max(0.3 * level, noise)) {
      weights_.angle_noise = equal_noise(level);
      for (int round = 0; round < 3; ++round) improve(state, loose);
      if (level <= noise) break;
    }
    evaluate(state);
    return robust_scale(azimuth_, zenith_);
  }

  /// @return processed places; slips and noise are then known
  std::size_t run(RotorState state) {
    Checkpoint last{0, state};
    std::size_t place = 0, quiet_until = 0;
    while (place < count_) {
      const std::size_t end = block_end(place);
      load(place, end, lag_);
      RotorState predicted = state;
      predict(predicted, middle());
      const Test test = tested(predicted);
      if (place >= quiet_until && suspicious(test, predicted)) {
        const Checkpoint from =
            last.place < place && !is_loose(predicted) ? last : Checkpoint{place, state};
        const Verdict verdict = examine(from, end);
        if (verdict.kind == Verdict::lost) return place;
        if (verdict.kind == Verdict::slip) {
          state = from.state;
          for (place = from.place; place < verdict.place;) {
            const std::size_t stop = std::min(block_end(place), verdict.place);
            load(place, stop, lag_);
            take(state);
            place = stop;
          }
          slips_.push_back({place, verdict.change});
          lag_ += verdict.change;
          last = {place, state};
          last_slip_ = place;
          continue;
        }
        quiet_until = verdict.sure_until;
        // The optics are less accurate here.
        weights_.angle_noise = equal_noise(
            std::max(weights_.angle_noise.azimuth, std::min(test.scale, kLostSteps * step_)));
        load(place, end, lag_);
      } else if (test.loss < kLostLoss) {
        learn(test);
      }
      missed_ += std::min(test.scale, kLostSteps * step_) * static_cast<double>(end - place);
      last = {place, state};
      state = predicted;
      const int rounds = is_loose(predicted) ? 3 : 1;
      for (int round = 0; round < rounds; ++round) improve(state, predicted);
      place = end;
    }
    return place;
  }

  struct Change {
    std::size_t place = 0;    // first with the new lag
    std::int64_t change = 0;  // of the lag
  };
  const std::vector<Change>& slips() const { return slips_; }
  /// Sum of the predictions' errors over all shots, rad.
  double missed() const { return missed_; }

  std::size_t shot_at(std::size_t place) const {
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(first_) +
                                    direction_ * static_cast<std::ptrdiff_t>(place));
  }

 private:
  struct Checkpoint {
    std::size_t place = 0;
    RotorState state;  // before the shots from there on were used
  };
  /// How shots agree with a prediction.
  struct Test {
    double loss = 0;                          // mean of the shots
    double scale = 0;                         // of the residuals, rad
    double delay = 0, delay_information = 0;  // s, s^-2: common delay of all rotors
    double delay_chi2() const { return delay * delay * delay_information; }
  };
  struct Verdict {
    enum Kind { none, slip, lost } kind = none;
    std::size_t place = 0;
    std::int64_t change = 0;
    std::size_t sure_until = 0;
  };

  /// End of the block that begins at a place.
  std::size_t block_end(std::size_t place) const {
    const std::int64_t begin = shots_.number[shot_at(place)];
    std::size_t end = place + 1;
    while (end < count_ && end - place < kTestedShots &&
           std::abs(shots_.number[shot_at(end)] - begin) <
               static_cast<std::int64_t>(kTestedShots)) {
      ++end;
    }
    return end;
  }

  void load(std::size_t begin, std::size_t end, std::int64_t lag) {
    block_.clear();
    for (std::size_t place = begin; place < end; ++place) {
      shots_.append_to(block_, shot_at(place), lag);
    }
  }
  /// The loaded shots with another lag.
  void reload(std::size_t begin, std::int64_t lag) {
    for (std::size_t i = 0; i < block_.size(); ++i) {
      const std::size_t shot = shot_at(begin + i);
      block_.time_ns[i] = shots_.time_ns(shot, lag);
      block_.beam[i] = shots_.beam(shot, lag);
    }
  }
  std::int64_t middle() const {
    return block_.time_ns.front() + (block_.time_ns.back() - block_.time_ns.front()) / 2;
  }

  Test tested(const RotorState& state) {
    evaluate(state);
    Test test;
    test.loss = equations_.cost / static_cast<double>(block_.size());
    test.scale = robust_scale(azimuth_, zenith_);
    const KnotSquare<Eigen::Dynamic> curvature = knot_curvature<Eigen::Dynamic>(equations_, 0);
    double slope = 0, information = 0;
    for (Eigen::Index k = 0; k < state.mean.size(); k += 3) {
      slope += state.mean[k + 1] * equations_.gradient[static_cast<std::size_t>(k)];
      for (Eigen::Index l = 0; l < state.mean.size(); l += 3) {
        information += state.mean[k + 1] * state.mean[l + 1] * curvature(k, l);
      }
    }
    test.delay_information = information;
    test.delay = information > 0 ? slope / information : 0.0;
    return test;
  }

  bool suspicious(const Test& test, const RotorState& predicted) const {
    const auto shots = static_cast<double>(block_.size());
    if (test.loss > 1.6 * usual_loss_ + 0.4 + 8.0 / std::sqrt(shots)) return true;
    return !is_loose(predicted) && std::abs(test.delay) * shots_.rate > 0.3 &&
           test.delay_chi2() > penalty();
  }

  /// Whether shots may be missing undetected.
  bool is_loose(const RotorState& state) const {
    double least = std::numeric_limits<double>::infinity();
    for (Eigen::Index k = 0; k < state.mean.size(); k += 3) {
      if (state.mean[k + 1] == 0) continue;
      least = std::min(least, std::sqrt(state.covariance(k, k)) / std::abs(state.mean[k + 1]));
    }
    return least * shots_.rate > kLooseShots;
  }

  /// Updates noise, usual losses and their correlation.
  void learn(const Test& test) {
    constexpr double kShare = 0.03;
    const auto toward = [](double value, double next) { return value + kShare * (next - value); };
    usual_loss_ = std::clamp(toward(usual_loss_, test.loss), 1.0, 3.0);
    correlation_ = std::max(1.0, toward(correlation_, std::min(test.delay_chi2(), 200.0)));
    if (block_.size() < kTestedShots / 4) return;
    const double noise = weights_.angle_noise.azimuth;
    weights_.angle_noise = equal_noise(std::max(
        kLeastNoiseSteps * step_,
        std::sqrt(toward(noise * noise, std::min(test.scale * test.scale, 4.0 * noise * noise)))));
  }

  /// Squared distance of a state from a prediction, in sigmas of that.
  static double distance(const RotorState& state, const RotorState& predicted) {
    const Eigen::VectorXd off = state.mean - predicted.mean;
    return off.dot(algebra::SymmetricSolver(predicted.covariance).solve(off));
  }

  void take(RotorState& state) {
    predict(state, middle());
    const RotorState predicted = state;
    improve(state, predicted);
  }

  /// Scale of the residuals of the loaded shots with a lag, rad.
  double scale_of(std::size_t begin, std::int64_t lag, const RotorState& state) {
    reload(begin, lag);
    evaluate(state);
    return robust_scale(azimuth_, zenith_);
  }

  /// Loss of every loaded shot under the evaluated state.
  void losses(std::vector<double>& loss) const {
    loss.resize(block_.size());
    const double variance = std::pow(weights_.angle_noise.azimuth, 2);
    for (std::size_t i = 0; i < block_.size(); ++i) {
      const double chi2 =
          azimuth_[i] * azimuth_[i] /
              (variance + static_cast<double>(block_.azimuth_rounding_variance[i])) +
          zenith_[i] * zenith_[i] /
              (variance + static_cast<double>(block_.zenith_rounding_variance[i]));
      const double one = chi2 / (1.0 + kSoftening * chi2);
      loss[i] = std::isfinite(one) ? one : 1.0 / kSoftening;
    }
  }

  /// Losses of the loaded shots for every candidate change of the lag.
  struct LossTable {
    std::vector<std::int64_t> change;       // the first is 0
    std::vector<std::vector<double>> loss;  // [changes][shots]
    std::vector<double> pull;               // squared distance from the prediction, in sigmas
    double total(std::size_t row) const {
      double sum = pull[row];
      for (const double one : loss[row]) sum += one;
      return sum;
    }
  };
  /// The likeliest sequence of the lag: every change has a penalty.
  struct Course {
    double loss = 0;  // of all shots, without penalties
    struct Stretch {
      std::size_t begin = 0, end = 0, row = 0;  // row of the table
    };
    std::vector<Stretch> stretches;  // the first one is without a change, possibly empty
  };

  /// @param from  first shot with a possible change
  static Course likeliest_course(const LossTable& table, std::size_t from, double penalty) {
    const std::size_t rows = table.change.size(), shots = table.loss.front().size();
    std::vector<double> cost(rows, std::numeric_limits<double>::infinity());
    std::vector<std::uint8_t> switched(rows * shots, 0);
    std::vector<std::size_t> best_before(shots, 0);
    cost[0] = 0;
    for (std::size_t i = 0; i < shots; ++i) {
      const auto least = std::min_element(cost.begin(), cost.end());
      best_before[i] = static_cast<std::size_t>(least - cost.begin());
      const double entry = i < from ? std::numeric_limits<double>::infinity() : *least + penalty;
      for (std::size_t row = 0; row < rows; ++row) {
        if (entry < cost[row]) {
          cost[row] = entry;
          switched[row * shots + i] = 1;
        }
        cost[row] += table.loss[row][i];
      }
    }
    Course course;
    auto row = static_cast<std::size_t>(std::min_element(cost.begin(), cost.end()) - cost.begin());
    std::size_t end = shots;
    for (std::size_t i = shots; i-- > 0;) {
      course.loss += table.loss[row][i];
      if (switched[row * shots + i] == 0) continue;
      course.stretches.push_back({i, end, row});
      end = i;
      row = best_before[i];
    }
    course.stretches.push_back({0, end, 0});
    std::reverse(course.stretches.begin(), course.stretches.end());
    return course;
  }

  /// Changes of the lag by frequency: whole rounds of the emitters, such as a truncated packet; any
  /// within a packet; whole packets.
  enum class Tier { usual, near, far };

  std::vector<std::int64_t> changes_of(Tier tier) const {
    const auto round =
        static_cast<std::int64_t>(std::max<std::size_t>(1, shots_.firing_order.size()));
    std::vector<std::int64_t> changes;
    for (std::int64_t missing = -kDoubledShots; missing <= kFarSlip; ++missing) {
      const bool is_usual = missing <= kUsualSlip && missing % round == 0;
      const Tier its = is_usual ? Tier::usual : missing <= kNearSlip ? Tier::near : Tier::far;
      if (missing != 0 && its == tier) changes.push_back(direction_ > 0 ? missing : -missing);
    }
    return changes;
  }

  double penalty() const { return kSure * std::min(correlation_, kMostCorrelation); }

  /// Explanation of a block that does not fit, from the last checkpoint to its end.
  Verdict examine(const Checkpoint& from, std::size_t end) {
    constexpr std::size_t kFewestBehind = 12;
    Verdict verdict;
    verdict.sure_until = end;
    std::size_t window = end, blocks = 0;
    for (bool last = false; !last; blocks = std::max<std::size_t>(1, 2 * blocks)) {
      for (std::size_t i = 0; i < blocks && window < count_; ++i) {
        const std::size_t next = block_end(window);
        const std::int64_t span =
            std::abs(shots_.number[shot_at(next - 1)] - shots_.number[shot_at(from.place)]);
        last = static_cast<double>(span) > kLongestTest * shots_.rate;
        if (last) break;
        window = next;
      }
      last = last || window >= count_ || blocks >= kMostBlocksAhead;
      load(from.place, window, lag_);
      RotorState predicted = from.state;
      predict(predicted, middle());
      const bool loose = is_loose(predicted);
      const std::size_t shots = block_.size();
      const double fair = 2.0 * usual_loss_ + 0.5 + 8.0 / std::sqrt(static_cast<double>(shots));
      LossTable table;
      const auto try_change = [&](std::int64_t change) {
        reload(from.place, lag_ + change);
        RotorState state = predicted;
        for (int round = 0; loose && round < 2; ++round) improve(state, predicted);
        evaluate(state);
        table.change.push_back(change);
        losses(table.loss.emplace_back());
        table.pull.push_back(loose ? distance(state, predicted) : 0.0);
        double mean = 0;
        for (const double one : table.loss.back()) mean += one / static_cast<double>(shots);
        return mean;
      };
      const bool none_fits = try_change(0) < fair;
      if (loose && none_fits) return verdict;
      Course course;
      for (const Tier tier : {Tier::usual, Tier::near, Tier::far}) {
        // Packets are tried only if almost nothing fits.
        if (tier == Tier::far &&
            (blocks != 1 || loose || course.loss < 0.5 * kLostLoss * static_cast<double>(shots))) {
          break;
        }
        for (const std::int64_t change : changes_of(tier)) try_change(change);
        if (loose) {  // each change was fitted separately, and lies in the gap before these shots
          std::size_t best = 0, second = 1;
          for (std::size_t row = 1; row < table.change.size(); ++row) {
            if (table.total(row) < table.total(best)) {
              second = std::exchange(best, row);
            } else if (second == best || table.total(row) < table.total(second)) {
              second = row;
            }
          }
          course.loss = table.total(best) - table.pull[best];
          if (course.loss > fair * static_cast<double>(shots)) continue;
          if (best != 0 && from.place != last_slip_ &&
              table.total(second) - table.total(best) > kSure) {
            verdict.kind = Verdict::slip;
            verdict.place = from.place;
            verdict.change = table.change[best];
            return verdict;
          }
          if (last && best != 0) verdict.kind = Verdict::lost;
          break;
        }
        course = likeliest_course(table, from.place == last_slip_ ? 1 : 0, penalty());
        if (course.stretches.size() == 1) {
          if (!none_fits) continue;
          verdict.sure_until = window;
          return verdict;
        }
        const auto& behind = course.stretches[1];
        const auto loss_of = [&](std::size_t row) {
          double sum = 0;
          for (std::size_t i = behind.begin; i < behind.end; ++i) sum += table.loss[row][i];
          return sum;
        };
        const auto count = static_cast<double>(behind.end - behind.begin);
        const double fitted = loss_of(behind.row);
        double second = std::numeric_limits<double>::infinity();
        for (std::size_t row = 0; row < table.change.size(); ++row) {
          if (row != behind.row) second = std::min(second, loss_of(row));
        }
        const bool sized = second - fitted > penalty();
        const bool fits = fitted < (2.0 * usual_loss_ + 0.5) * count + 8.0 * std::sqrt(count);
        const bool enough = behind.end - behind.begin >= kFewestBehind || window >= count_;
        if (fits && sized && enough) {
          verdict.kind = Verdict::slip;
          verdict.place = from.place + behind.begin;
          verdict.change = table.change[behind.row];
          return verdict;
        }
        if (!fits) continue;
        if (last && enough && !none_fits) verdict.kind = Verdict::lost;  // of unknown size
        break;
      }
      if (last && course.loss > kLostLoss * static_cast<double>(shots) &&
          scale_of(from.place, lag_, predicted) > kLostSteps * step_) {
        verdict.kind = Verdict::lost;
      }
    }
    return verdict;
  }

  const NumberedShots& shots_;
  std::ptrdiff_t direction_;
  std::size_t first_, count_;
  double step_;  // rad
  std::int64_t lag_ = 0;
  std::size_t last_slip_ = std::numeric_limits<std::size_t>::max();  // place
  std::vector<Change> slips_;
  double missed_ = 0;
  double usual_loss_ = 1.7, correlation_ = 4.0;
};

/// Moves slips to the borders of packets if most are there: at some rotation angles
/// counter-rotating rotors leave their position open by some dozens of shots.
void move_to_borders(const NumberedShots& shots, ShotRange range, std::vector<FoundSlip>& slips) {
  if (slips.size() < kFewestAtBorders) return;
  const auto past = [](std::int64_t number, std::int64_t border, std::int64_t packet) {
    return ((number - border) % packet + packet) % packet;  // shots behind the last border
  };
  std::size_t most = 0;
  std::int64_t border = 0, packet = 0;
  for (const std::int64_t size : kPacketShots) {
    for (std::int64_t place = 0; place < size; ++place) {
      const auto at = std::count_if(slips.begin(), slips.end(), [&](const FoundSlip& slip) {
        const std::int64_t after = shots.number[slip.after];
        return past(after, place, size) < after - shots.number[slip.before];
      });
      if (static_cast<std::size_t>(at) <= most) continue;
      most = static_cast<std::size_t>(at);
      border = place;
      packet = size;
    }
  }
  if (static_cast<double>(most) < kShareAtBorders * static_cast<double>(slips.size())) return;
  for (FoundSlip& slip : slips) {
    const std::int64_t after = shots.number[slip.after], behind = past(after, border, packet);
    if (behind < after - shots.number[slip.before]) continue;
    const std::int64_t to = after - behind + (2 * behind > packet ? packet : 0);
    const auto first = shots.number.begin() + static_cast<std::ptrdiff_t>(range.begin);
    const auto last = shots.number.begin() + static_cast<std::ptrdiff_t>(range.end);
    const auto found = std::lower_bound(first, last, to);
    if (found == first || found == last) continue;
    slip.after = static_cast<std::size_t>(found - shots.number.begin());
    slip.before = slip.after - 1;
  }
}

}  // namespace

double settle(const NumberedShots& shots, ShotRange rows, const Start& start, double noise,
              double from, RotorState& state) {
  return Follower(shots, start.train, noise, usual_step(start, shots.rate), 1, rows.begin,
                  rows.size())
      .settle(state, from);
}

Followed follow(const NumberedShots& shots, const Anchor& anchor, ShotRange range) {
  constexpr std::size_t kSettled = 150;  // shots on either side
  const double step = usual_step(anchor.start, shots.rate);
  const auto follower = [&](std::ptrdiff_t direction, std::size_t first, std::size_t count) {
    return Follower(shots, anchor.start.train, anchor.start.residual_rms, step, direction, first,
                    count);
  };
  RotorState state = loose_state(anchor.start, kAnchorAngleSigma, kAnchorSpeedShare);
  const std::size_t near = anchor.shot - std::min(kSettled, anchor.shot - range.begin);
  const std::size_t far = std::min(range.end, anchor.shot + kSettled);
  settle(shots, {near, far}, anchor.start, anchor.start.residual_rms, radians_from_degrees(0.1),
         state);
  state.covariance *= 4.0;
  Follower ahead = follower(1, anchor.shot, range.end - anchor.shot);
  Follower back = follower(-1, anchor.shot, anchor.shot - range.begin + 1);
  Followed result;
  result.end = anchor.shot + ahead.run(state);
  result.begin = anchor.shot + 1 - back.run(state);
  for (const Follower::Change& change : ahead.slips()) {
    const std::size_t after = ahead.shot_at(change.place);
    result.slips.push_back({after - 1, after, change.change});
  }
  for (const Follower::Change& change : back.slips()) {
    const std::size_t before = back.shot_at(change.place);
    result.slips.push_back({before, before + 1, -change.change});
  }
  std::sort(result.slips.begin(), result.slips.end(),
            [](const FoundSlip& a, const FoundSlip& b) { return a.after < b.after; });
  // A slip that was found in two steps.
  constexpr std::size_t kOnePlace = 6;
  for (std::size_t i = 1; i < result.slips.size();) {
    if (result.slips[i].after - result.slips[i - 1].after < kOnePlace) {
      result.slips[i - 1].shots += result.slips[i].shots;
      result.slips.erase(result.slips.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
  std::erase_if(result.slips, [](const FoundSlip& slip) { return slip.shots == 0; });
  move_to_borders(shots, {result.begin, result.end}, result.slips);
  result.residual_rms = (ahead.missed() + back.missed()) /
                        static_cast<double>(std::max<std::size_t>(1, result.end - result.begin));
  return result;
}

}  // namespace risley::estimation
