// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/packet_places.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/sensor_recognition.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/recordings/cut_coordinates.hpp"

#include "estimation/block_fit.hpp"
#include "estimation/evident_places.hpp"
#include "estimation/optics_fit.hpp"

namespace risley::estimation {
namespace {

using recordings::kNoPlace;

/// A shot has a place if every other one is worse by this difference of chi2.
constexpr double kSurePlace = 12.0;
/// Losses of single shots end at 36.
constexpr double kPlaceSoftening = softening_at(1.5);
/// Lower bound of the noise, as a share of the step from shot to shot.
constexpr double kLeastPlaceNoise = 0.2;
/// A packet whose noise exceeds the usual one by this factor does not fit.
constexpr double kPoorPacket = 4.0;

/// Information of one packet on the rotors.
struct PacketFit {
  RotorState state;
  std::vector<std::uint8_t> place;  // of its shots
  std::vector<double> lead;         // of each one's place over the next best, chi2
  double scale = std::numeric_limits<double>::infinity();  // of the residuals, rad
};

/// Fits rotors and places to single packets.
class PacketFitter : private BlockFit {
 public:
  /// @param series   in the sensor's frame
  /// @param evident  known places of shots, or kNoPlace
  PacketFitter(const PacketShots& shots, const AngleSeries& series,
               const std::vector<std::uint8_t>& evident, double rate, const PrismTrain& train,
               std::vector<std::uint8_t> firing_order)
      : BlockFit(train, kPlaceSoftening),
        shots_(shots),
        series_(series),
        evident_(evident),
        rate_(rate),
        firing_order_(std::move(firing_order)) {
    first_.assign(shots.packets.size() + 1, 0);
    for (const std::size_t packet : shots.packet) ++first_[packet + 1];
    for (std::size_t i = 0; i + 1 < first_.size(); ++i) first_[i + 1] += first_[i];
  }

  std::size_t begin(std::size_t packet) const { return first_[packet]; }
  std::size_t size(std::size_t packet) const { return first_[packet + 1] - first_[packet]; }
  /// Whether the place of any of its shots is evident.
  bool is_evident(std::size_t packet) const {
    return std::any_of(evident_.begin() + static_cast<std::ptrdiff_t>(begin(packet)),
                       evident_.begin() + static_cast<std::ptrdiff_t>(begin(packet + 1)),
                       [](std::uint8_t place) { return place != kNoPlace; });
  }
  std::int64_t time_ns(std::size_t packet, int place) const {
    return shots_.packets[packet].time_ns + std::llround(place * 1e9 / rate_);
  }
  RotorState predicted(RotorState state, std::size_t packet) const {
    predict(state, time_ns(packet, shots_.places / 2));
    return state;
  }

  /// @param prior   at the packet
  /// @param levels  of noise, one after the other, rad
  PacketFit fit(std::size_t packet, const RotorState& prior, std::span<const double> levels) {
    load(packet);
    PacketFit result;
    result.state = prior;
    for (const double level : levels) {
      weights_.angle_noise = equal_noise(level);
      for (int round = 0; round < 2; ++round) {
        place_shots(packet, result.state);
        improve(result.state, prior);
      }
    }
    place_shots(packet, result.state);
    evaluate(result.state);
    result.scale = robust_scale(azimuth_, zenith_);
    result.place = place_;
    result.lead = lead_;
    return result;
  }

 private:
  void load(std::size_t packet) {
    block_.clear();
    for (std::size_t i = begin(packet); i < begin(packet) + size(packet); ++i) {
      block_.append(series_, i);
    }
  }

  /// Finds the likeliest places of the loaded shots and assigns their times and emitters.
  void place_shots(std::size_t packet, const RotorState& state) {
    const auto places = static_cast<std::size_t>(shots_.places);
    const std::size_t count = block_.size();
    const std::uint8_t* before = shots_.precedent.data() + begin(packet);
    const std::size_t missing = places - shots_.packets[packet].shots;
    losses(packet, state);
    // Least losses of all shots up to one, and from one on, if it has a place.
    constexpr double kNever = std::numeric_limits<double>::infinity();
    ahead_.assign(count * places, kNever);
    behind_.assign(count * places, kNever);
    for (std::size_t i = 0; i < count; ++i) {
      double least = i == 0 ? 0.0 : kNever;
      const std::size_t step = i == 0 ? 0 : std::size_t{before[i]} - before[i - 1];
      for (std::size_t k = before[i]; k <= before[i] + missing; ++k) {
        if (i > 0) least = std::min(least, ahead_[(i - 1) * places + k - step]);
        ahead_[i * places + k] = least + loss_[i * places + k];
      }
    }
    for (std::size_t i = count; i-- > 0;) {
      double least = i + 1 == count ? 0.0 : kNever;
      const std::size_t step = i + 1 == count ? 0 : std::size_t{before[i + 1]} - before[i];
      for (std::size_t k = before[i] + missing + 1; k-- > before[i];) {
        if (i + 1 < count) least = std::min(least, behind_[(i + 1) * places + k + step]);
        behind_[i * places + k] = least + loss_[i * places + k];
      }
    }
    place_.assign(count, 0);
    lead_.assign(count, kNever);
    std::size_t lowest = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t low = std::max<std::size_t>(before[i], lowest);
      double best = kNever, second = kNever;
      std::size_t place = low;
      for (std::size_t k = before[i]; k <= before[i] + missing; ++k) {
        const double through =
            ahead_[i * places + k] + behind_[i * places + k] - loss_[i * places + k];
        if (through < best && k >= low) {
          second = std::min(second, best);
          best = through;
          place = k;
        } else {
          second = std::min(second, through);
        }
      }
      place_[i] = static_cast<std::uint8_t>(place);
      if (missing > 0) lead_[i] = second - best;
      if (i + 1 < count) lowest = place + before[i + 1] - before[i];
      block_.time_ns[i] = time_ns(packet, static_cast<int>(place));
      block_.beam[i] = firing_order_[place % firing_order_.size()];
    }
  }

  /// Of each loaded shot at each place.
  void losses(std::size_t packet, const RotorState& state) {
    const auto places = static_cast<std::size_t>(shots_.places);
    loss_.assign(block_.size() * places, 1.0 / weights_.softening);
    const double variance = std::pow(weights_.angle_noise.azimuth, 2);
    std::vector<double> angles(static_cast<std::size_t>(state.mean.size() / 3));
    for (std::size_t k = 0; k < places; ++k) {
      const double dt =
          1e-9 * static_cast<double>(time_ns(packet, static_cast<int>(k)) - state.time_ns);
      for (std::size_t rotor = 0; rotor < angles.size(); ++rotor) {
        const auto at = static_cast<Eigen::Index>(3 * rotor);
        angles[rotor] = state.mean[at] + dt * (state.mean[at + 1] + 0.5 * dt * state.mean[at + 2]);
      }
      const Observation shot = observe(train_, angles, firing_order_[k % firing_order_.size()]);
      if (!shot.valid) continue;
      for (std::size_t i = 0; i < block_.size(); ++i) {
        const double azimuth = wrap_to_pi(block_.azimuth[i] - shot.azimuth);
        const double zenith = block_.zenith[i] - shot.zenith;
        const double chi2 =
            azimuth * azimuth /
                (variance + static_cast<double>(block_.azimuth_rounding_variance[i])) +
            zenith * zenith / (variance + static_cast<double>(block_.zenith_rounding_variance[i]));
        loss_[i * places + k] = chi2 / (1.0 + weights_.softening * chi2);
      }
    }
    for (std::size_t i = 0; i < block_.size(); ++i) {
      const std::uint8_t known = evident_[begin(packet) + i];
      if (known == kNoPlace) continue;
      for (std::size_t k = 0; k < places; ++k) {
        if (k != known) loss_[i * places + k] = std::numeric_limits<double>::infinity();
      }
    }
  }

  const PacketShots& shots_;
  const AngleSeries& series_;
  const std::vector<std::uint8_t>& evident_;
  double rate_;
  std::vector<std::uint8_t> firing_order_;
  std::vector<std::size_t> first_;             // shot of each packet
  std::vector<double> loss_, ahead_, behind_;  // [shots of the packet][places]
  std::vector<std::uint8_t> place_;
  std::vector<double> lead_;
};

/// A packet with known rotors.
struct PacketAnchor {
  Start start;  // the series is in its frame; its residuals are those of packets
  std::vector<std::uint8_t> firing_order;
  std::size_t packet = 0;
  double speed_share = 2e-4;  // possible error of the speeds
};

/// The series with times and beams from places.
AngleSeries placed_series(const PacketShots& shots, const AngleSeries& series,
                          const std::vector<std::uint8_t>& place, double rate,
                          const std::vector<std::uint8_t>& firing_order) {
  AngleSeries result;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (place[i] == kNoPlace) continue;
    result.append(series, i);
    result.time_ns.back() =
        shots.packets[shots.packet[i]].time_ns + std::llround(place[i] * 1e9 / rate);
    result.beam.back() = firing_order[place[i] % firing_order.size()];
  }
  return result;
}

/// Shots of the first second.
AngleSeries head_of(const AngleSeries& series) {
  std::size_t end = 0;
  while (end < series.size() && series.time_ns[end] - series.time_ns[0] < 1'000'000'000) ++end;
  return rows_of(series, 0, end);
}

/// Speeds and angles, about as accurate as times from the middle of the possible places allow.
std::optional<Start> rough_start(const AngleSeries& head, const sensors::Sensor& sensor,
                                 bool mirrored) {
  StartOptions options;
  options.angle_noise = radians_from_degrees(0.5);
  options.mirrored = mirrored;
  try {
    return find_start(head, sensor, options);
  } catch (const EstimationError&) {
    return std::nullopt;
  }
}

/// The fullest packets near a start.
std::vector<std::size_t> fullest_packets(const PacketShots& shots, const PacketFitter& fitter,
                                         std::int64_t time_ns) {
  constexpr double kNear = 0.3;  // s
  constexpr std::size_t kMost = 4, kFewestShots = 12;
  std::vector<std::size_t> result;
  for (std::size_t packet = 0; packet < shots.packets.size(); ++packet) {
    const double off = 1e-9 * static_cast<double>(shots.packets[packet].time_ns - time_ns);
    if (std::abs(off) < kNear && fitter.size(packet) >= kFewestShots) result.push_back(packet);
  }
  std::stable_sort(result.begin(), result.end(),
                   [&](std::size_t a, std::size_t b) { return fitter.size(a) > fitter.size(b); });
  if (result.size() > kMost) result.resize(kMost);
  return result;
}

/// The order of the emitters and the mirror image that fit the fullest packets.
std::optional<PacketAnchor> find_packet_anchor(const PacketShots& shots, double rate,
                                               const sensors::Sensor& sensor,
                                               const Progress& progress) {
  constexpr double kLooseAngle = radians_from_degrees(3.0), kSpeedShare = 1e-3;
  constexpr std::array<double, 2> kCoarse = {radians_from_degrees(1.0), radians_from_degrees(0.3)};
  constexpr std::size_t kMostRefined = 4;
  constexpr int kDelays = 12;  // on either side
  const int emitters = sensor.train.emitters();
  const std::vector<std::uint8_t> none_evident(shots.series.size(), kNoPlace);
  const std::vector<std::uint8_t> in_turn = emitters_in_order({}, emitters);
  const AngleSeries rough =
      head_of(placed_series(shots, shots.series, guess_places(shots).place, rate, in_turn));
  std::vector<PacketAnchor> anchors;
  for (const bool mirrored : {false, true}) {
    const std::optional<Start> start = rough_start(rough, sensor, mirrored);
    if (!start) continue;
    AngleSeries series = shots.series;
    prepare_shots(series, *start);
    const double noise = std::max(sensor.angle_noise, kLeastPlaceNoise * usual_step(*start, rate));
    const std::array<double, 2> fine = {radians_from_degrees(0.1), noise};
    // Packets of several emitters hold whole rounds of them.
    for (const bool backwards : {false, true}) {
      if (backwards && emitters == 1) break;
      const FiringOrder order{backwards ? emitters - 1 : 0, backwards};
      PacketAnchor anchor{*start, emitters_in_order(order, emitters), 0};
      PacketFitter fitter(shots, series, none_evident, rate, start->train, anchor.firing_order);
      double sum = 0, least = std::numeric_limits<double>::infinity();
      const std::vector<std::size_t> packets = fullest_packets(shots, fitter, start->time_ns);
      if (packets.empty()) break;
      for (const std::size_t packet : packets) {
        progress.check();
        // Times known only roughly delay all rotors by a common time.
        std::vector<PacketFit> fits;
        for (int delay = -kDelays; delay <= kDelays; ++delay) {
          Start late = *start;
          const double shift = 0.5 * delay / kDelays * shots.places / rate;
          for (std::size_t k = 0; k < late.rotation_angle.size(); ++k) {
            late.rotation_angle[k] += shift * late.angular_velocity[k];
          }
          RotorState prior = fitter.predicted(loose_state(late, 0.0, 0.0), packet);
          const RotorState loose = loose_state(late, kLooseAngle, kSpeedShare);
          prior.covariance = loose.covariance;
          fits.push_back(fitter.fit(packet, prior, kCoarse));
        }
        std::stable_sort(fits.begin(), fits.end(),
                         [](const PacketFit& a, const PacketFit& b) { return a.scale < b.scale; });
        if (fits.size() > kMostRefined) fits.resize(kMostRefined);
        double best = std::numeric_limits<double>::infinity();
        for (const PacketFit& one : fits) {
          RotorState prior = one.state;
          prior.covariance = loose_state(*start, kLooseAngle, kSpeedShare).covariance;
          const PacketFit refined = fitter.fit(packet, prior, fine);
          best = std::min(best, refined.scale);
          if (refined.scale >= least) continue;
          least = refined.scale;
          anchor.packet = packet;
          set_rotors(anchor.start, refined.state);
        }
        sum += best;
      }
      anchor.start.residual_rms = sum / static_cast<double>(packets.size());
      anchors.push_back(std::move(anchor));
    }
  }
  if (anchors.empty()) return std::nullopt;
  std::stable_sort(anchors.begin(), anchors.end(),
                   [](const PacketAnchor& a, const PacketAnchor& b) {
                     return a.start.residual_rms < b.start.residual_rms;
                   });
  constexpr double kClear = 0.6, kMostSteps = 3.0;
  const PacketAnchor& best = anchors.front();
  const double residual = best.start.residual_rms;
  if (residual > kMostSteps * usual_step(best.start, rate)) return std::nullopt;
  if (anchors.size() > 1 && residual > kClear * anchors[1].start.residual_rms) return std::nullopt;
  return best;
}

/// Fits the optics to the placed shots about an anchor. @return whether that went well
bool refit(const PacketShots& shots, const AngleSeries& series,
           const std::vector<std::uint8_t>& place, double rate, const sensors::Sensor& sensor,
           PacketAnchor& anchor) {
  constexpr std::size_t kMostShots = 40000;
  const AngleSeries placed = placed_series(shots, series, place, rate, anchor.firing_order);
  const auto at = static_cast<std::size_t>(
      std::lower_bound(placed.time_ns.begin(), placed.time_ns.end(), anchor.start.time_ns) -
      placed.time_ns.begin());
  const AngleSeries near = rows_of(placed, at - std::min(at, kMostShots / 2),
                                   std::min(placed.size(), at + kMostShots / 2));
  const std::optional<Start> fitted = fit_optics(near, anchor.start, sensor, Priors::of_the_type);
  if (fitted) anchor.start = *fitted;
  return fitted.has_value();
}

/// Rotors and optics from the shots of evident places, at one of their packets.
std::optional<PacketAnchor> find_evident_anchor(const PacketShots& shots,
                                                const std::vector<std::uint8_t>& evident,
                                                double rate, const sensors::Sensor& sensor,
                                                const Progress& progress) {
  constexpr std::size_t kFewestShots = 300;
  constexpr double kClear = 0.6, kFittedSpeedShare = 5e-5;
  constexpr double kMostResidual = radians_from_degrees(0.2);
  const int emitters = sensor.train.emitters();
  EstimateOptions usual;
  usual.sensor = sensor;
  StartOptions options;
  options.free = chosen_parameters(usual);
  // Free emitters could exchange their directions.
  std::erase_if(options.free, [emitters](const FreeParameter& one) {
    return emitters > 1 && one.name.starts_with("incident_beam");
  });
  options.angle_noise = sensor.angle_noise;
  options.mirrored.reset();
  std::vector<PacketAnchor> anchors;
  for (const bool backwards : {false, true}) {
    if (backwards && emitters == 1) break;
    progress.check();
    PacketAnchor anchor;
    anchor.speed_share = kFittedSpeedShare;
    anchor.firing_order = emitters_in_order({backwards ? emitters - 1 : 0, backwards}, emitters);
    const AngleSeries placed =
        placed_series(shots, shots.series, evident, rate, anchor.firing_order);
    if (placed.size() < kFewestShots) return std::nullopt;
    try {
      anchor.start = find_start(head_of(placed), sensor, options);
    } catch (const EstimationError&) {
      continue;
    }
    if (anchor.start.residual_rms < kMostResidual) anchors.push_back(std::move(anchor));
  }
  if (anchors.empty()) return std::nullopt;
  std::stable_sort(anchors.begin(), anchors.end(),
                   [](const PacketAnchor& a, const PacketAnchor& b) {
                     return a.start.residual_rms < b.start.residual_rms;
                   });
  PacketAnchor& best = anchors.front();
  if (anchors.size() > 1 && best.start.residual_rms > kClear * anchors[1].start.residual_rms) {
    return std::nullopt;
  }
  AngleSeries series = shots.series;
  prepare_shots(series, best.start);
  if (!refit(shots, series, evident, rate, sensor, best)) return std::nullopt;
  std::int64_t nearest = std::numeric_limits<std::int64_t>::max();
  for (std::size_t i = 0; i < evident.size(); ++i) {
    const std::int64_t away = std::abs(shots.packets[shots.packet[i]].time_ns - best.start.time_ns);
    if (evident[i] == kNoPlace || away >= nearest) continue;
    nearest = away;
    best.packet = shots.packet[i];
  }
  return best;
}

/// Result of following the rotors from packet to packet.
struct FollowedPackets {
  std::vector<std::uint8_t> place;  // of each shot, or kNoPlace
  std::size_t placed = 0;
  RotorState anchor;
  std::size_t evident = 0, contradicting = 0;  // packets

  /// Whether the rotors agreed with the evident places, and placed most of the rest.
  bool is_sound() const {
    constexpr double kMostContradicting = 0.05;
    return 2 * placed > place.size() &&
           static_cast<double>(contradicting) <= kMostContradicting * static_cast<double>(evident);
  }
};

FollowedPackets follow_packets(const PacketShots& shots, const AngleSeries& series,
                               const std::vector<std::uint8_t>& evident, double rate,
                               const PacketAnchor& anchor, const Progress& progress) {
  constexpr double kAnchorAngle = radians_from_degrees(1.0);
  constexpr double kLearnedShare = 0.03;
  // For a single emitter: chi2 of one place further, and of motion that is not the rotors'.
  constexpr double kOtherPlace = 36.0, kOtherMotion = 60.0;
  constexpr std::size_t kFewestAnew = 24, kFewestJudged = 4, kFewestLearned = 24;
  const double step = usual_step(anchor.start, rate);
  const double least_noise = kLeastPlaceNoise * step;
  double leaning = 0;  // of the beam, per turn of a rotor
  for (const double speed : anchor.start.angular_velocity) {
    leaning = std::max(leaning, speed == 0 ? 0.0 : step * rate / std::abs(speed));
  }
  PacketFitter fitter(shots, series, evident, rate, anchor.start.train, anchor.firing_order);
  const bool single = anchor.firing_order.size() == 1;
  // Spacing of shots of the same emitter.
  const double spacing = step * static_cast<double>(anchor.firing_order.size());
  FollowedPackets result;
  result.place.assign(series.size(), kNoPlace);
  for (const int direction : {1, -1}) {
    double noise = std::max(least_noise, anchor.start.residual_rms);
    RotorState state =
        direction > 0 ? loose_state(anchor.start, kAnchorAngle, anchor.speed_share) : result.anchor;
    std::size_t packet = anchor.packet + (direction > 0 ? 0 : 1);
    const std::size_t end = direction > 0 ? shots.packets.size() : 0;
    while (direction > 0 ? packet < end : packet > end) {
      const std::size_t present = direction > 0 ? packet++ : --packet;
      const std::size_t count = fitter.size(present);
      if (count == 0) continue;
      progress.check();
      const RotorState prior = fitter.predicted(state, present);
      double unsure = 0;
      for (Eigen::Index k = 0; k < prior.mean.size(); k += 3) {
        unsure = std::max(unsure, leaning * std::sqrt(prior.covariance(k, k)));
      }
      const bool first = present == anchor.packet && direction > 0;
      const bool known = first || fitter.is_evident(present);
      const algebra::SymmetricSolver expected{Eigen::MatrixXd(prior.covariance)};
      if (single && !known) {  // shots of a single emitter fit as well one place further
        Eigen::VectorXd further = Eigen::VectorXd::Zero(prior.mean.size());
        for (Eigen::Index k = 0; k < further.size(); k += 3) further[k] = prior.mean[k + 1] / rate;
        if (expected.chi2(further) < kOtherPlace) continue;
      } else if (!known && 6.0 * unsure > spacing && count < kFewestAnew) {
        continue;
      }
      const std::array<double, 2> levels = {std::max(noise, std::min(unsure, spacing)), noise};
      const PacketFit fit = fitter.fit(present, prior, levels);
      const bool fits = first || count < kFewestJudged || fit.scale <= kPoorPacket * noise;
      const bool moved =
          single && !first && expected.chi2(fit.state.mean - prior.mean) > kOtherMotion;
      if (known) ++result.evident;
      if (known && (!fits || moved)) ++result.contradicting;
      if (!fits || (moved && !known)) continue;
      if (count >= kFewestLearned) {
        noise = std::clamp(
            std::sqrt(noise * noise + kLearnedShare * (fit.scale * fit.scale - noise * noise)),
            least_noise, step);
      }
      state = fit.state;
      if (first) result.anchor = state;
      for (std::size_t i = 0; i < count; ++i) {
        if (fit.lead[i] < kSurePlace) continue;
        result.place[fitter.begin(present) + i] = fit.place[i];
        ++result.placed;
      }
    }
  }
  return result;
}

/// The shots before their coordinates were truncated.
AngleSeries before_cut(AngleSeries series) {
  for (std::size_t i = 0; i < series.size(); ++i) {
    const double step = std::sqrt(12.0 * static_cast<double>(series.zenith_rounding_variance[i]));
    recordings::move_to_middle_of_cut(step, series.azimuth[i], series.zenith[i]);
  }
  return series;
}

void check_packets(const PacketShots& shots) {
  require_length("packet", shots.packet.size(), shots.series.size());
  require_length("precedent", shots.precedent.size(), shots.series.size());
  require_between("places", shots.places, 1, kNoPlace - 1);
  for (const PacketShots::OnePacket& one : shots.packets) {
    require_between("shots of a packet", one.shots, 0, shots.places);
  }
  for (std::size_t i = 0; i < shots.packet.size(); ++i) {
    require_place("packet", shots.packet[i], shots.packets.size());
    require_place("precedent", shots.precedent[i], shots.packets[shots.packet[i]].shots);
    const bool same = i > 0 && shots.packet[i] == shots.packet[i - 1];
    if (i > 0 && (same ? shots.precedent[i] <= shots.precedent[i - 1]
                       : shots.packet[i] < shots.packet[i - 1])) {
      throw InvalidArgument("shots of packets that do not ascend");
    }
  }
}

}  // namespace

double shot_rate_of(const PacketShots& shots, const sensors::Sensor& sensor) {
  constexpr double kNearPeriod = 0.02;
  constexpr std::size_t kFewestPeriods = 10;
  const double usual = 1e9 * shots.places / sensor.shot_rate;
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 1; i < shots.packets.size(); ++i) {
    const auto period =
        static_cast<double>(shots.packets[i].time_ns - shots.packets[i - 1].time_ns);
    if (std::abs(period / usual - 1.0) > kNearPeriod) continue;
    sum += period;
    ++count;
  }
  if (count < kFewestPeriods) return sensor.shot_rate;
  return 1e9 * shots.places * static_cast<double>(count) / sum;
}

GuessedPlaces guess_places(const PacketShots& shots, const std::vector<std::uint8_t>& known) {
  check_packets(shots);
  const std::size_t count = shots.series.size();
  GuessedPlaces result{known, 0};
  if (known.empty()) result.place.assign(count, kNoPlace);
  require_length("known places", result.place.size(), count);
  // Highest possible place of each shot, from the last one on.
  std::vector<int> highest(count);
  for (std::size_t i = count; i-- > 0;) {
    highest[i] = shots.precedent[i] + shots.places - shots.packets[shots.packet[i]].shots;
    if (i + 1 < count && shots.packet[i + 1] == shots.packet[i]) {
      const int steps = shots.precedent[i + 1] - shots.precedent[i];
      highest[i] = std::min(highest[i], highest[i + 1] - steps);
    }
    if (result.place[i] != kNoPlace) highest[i] = std::min<int>(highest[i], result.place[i]);
  }
  int lowest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const bool same = i > 0 && shots.packet[i] == shots.packet[i - 1];
    lowest = same ? lowest + shots.precedent[i] - shots.precedent[i - 1] : shots.precedent[i];
    if (result.place[i] != kNoPlace) {
      require_between("known place", result.place[i], lowest, highest[i]);
      lowest = result.place[i];
      continue;
    }
    const int middle = (lowest + highest[i]) / 2;
    result.most_off = std::max<double>(result.most_off, highest[i] - middle);
    result.place[i] = static_cast<std::uint8_t>(middle);
  }
  return result;
}

ShotPlaces find_places(const PacketShots& shots, double shot_rate, const sensors::Sensor& sensor,
                       const Progress& progress) {
  check_packets(shots);
  require_above("shot rate", shot_rate, 0, "Hz");
  constexpr int kMostRounds = 3;
  constexpr double kClearlyBetter = 0.95;  // residuals
  ShotPlaces result;
  result.firing_order = emitters_in_order({}, sensor.train.emitters());
  const std::vector<std::uint8_t> evident =
      evident_places(shots, shot_rate, sensor.train.emitters());
  result.place = evident;
  std::optional<PacketAnchor> anchor =
      find_evident_anchor(shots, evident, shot_rate, sensor, progress);
  // A packet of a single emitter does not show which of its places are missing.
  if (!anchor && sensor.train.emitters() > 1) {
    anchor = find_packet_anchor(shots, shot_rate, sensor, progress);
  }
  if (!anchor) return result;
  const Start frame = anchor->start;
  AngleSeries series = shots.series;
  prepare_shots(series, frame);
  anchor->start.mirrored = false;
  anchor->start.frame.reset();
  FollowedPackets followed = follow_packets(shots, series, evident, shot_rate, *anchor, progress);
  for (int round = 0; round < kMostRounds; ++round) {
    PacketAnchor refined = *anchor;
    set_rotors(refined.start, followed.anchor);
    PacketAnchor other = refined;
    if (!refit(shots, series, followed.place, shot_rate, sensor, refined)) break;
    if (round == 0 && shots.cartesian) {
      AngleSeries uncut = before_cut(shots.series);
      prepare_shots(uncut, frame);
      if (refit(shots, uncut, followed.place, shot_rate, sensor, other) &&
          other.start.residual_rms < kClearlyBetter * refined.start.residual_rms) {
        result.cut_coordinates = true;
        series = std::move(uncut);
        refined = std::move(other);
      }
    }
    *anchor = std::move(refined);
    FollowedPackets again = follow_packets(shots, series, evident, shot_rate, *anchor, progress);
    if (again.placed < followed.placed) break;
    const bool settled = again.place == followed.place;
    followed = std::move(again);
    if (settled) break;
  }
  if (!followed.is_sound()) {  // the rotors were lost
    result.cut_coordinates = false;
    return result;
  }
  result.followed = true;
  result.place = std::move(followed.place);
  result.firing_order = anchor->firing_order;
  return result;
}

}  // namespace risley::estimation
