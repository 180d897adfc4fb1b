// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/sensor_recognition.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <map>
#include <utility>

#include <Eigen/Core>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/spectral_lines.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/parallel/parallel.hpp"

#include "estimation/field_of_view.hpp"

namespace risley::estimation {
namespace {

constexpr int kMostFrames = 5;
/// The axis has converged when it moves by less, and is lost when by more, as a sine.
constexpr double kAxisFound = 0.01, kAxisLost = 0.5;
/// Largest remainder of the right sensor's lines, rad: lines of higher order, lost shots and times
/// that are not those of the shots.
constexpr double kMostMisfit = radians_from_degrees(4.0);
/// Lines alone decide if all others leave this many times as much.
constexpr double kFarWorse = 3.0;
/// The optics of sensors are tried whose lines leave up to this many times as much as the best.
constexpr double kWorthATrial = 3.0;
/// Emitters show the roll if the remainder of their constants is below this share of their spacing.
constexpr double kEmittersFit = 0.25;

/// The lines of a sensor's scan with its full field of view.
struct NominalLines {
  std::vector<double> amplitude;  ///< [prisms], then that of LineSearch::near()'s image
  std::vector<Complex> constant;  ///< [emitters]
};

NominalLines nominal_lines(const PrismTrain& train) {
  const int steps = train.prisms() <= 2 ? 24 : 12;
  const auto prisms = static_cast<std::size_t>(train.prisms());
  NominalLines result;
  // A line turns with these multiples of the rotors' angles.
  std::vector<std::vector<double>> turns(prisms, std::vector<double>(prisms, 0.0));
  for (std::size_t k = 0; k < prisms; ++k) turns[k][k] = 1.0;
  if (train.layout().reflects()) turns.push_back({-1.0, 2.0});
  result.amplitude.assign(turns.size(), 0.0);
  const Eigen::Matrix3d train_from_sensor = sensor_from_train(train.layout().axis_up).transpose();
  for (int beam = 0; beam < train.emitters(); ++beam) {
    std::vector<Complex> sums(turns.size());
    Complex constant = 0;
    double count = 0;
    std::vector<double> angles(prisms, 0.0);
    const auto visit = [&](const auto& self, std::size_t prism) -> void {
      if (prism < prisms) {
        for (int step = 0; step < steps; ++step) {
          angles[prism] = kTwoPi * step / steps;
          self(self, prism + 1);
        }
        return;
      }
      const Observation shot = observe(train, angles, beam);
      if (!shot.valid) return;
      const auto& [x, y, z] = shot.direction;
      const Eigen::Vector3d v = train_from_sensor * Eigen::Vector3d(x, y, z);
      const Complex value(v.y(), v.z());
      count += 1.0;
      constant += value;
      for (std::size_t k = 0; k < turns.size(); ++k) {
        double angle = 0;
        for (std::size_t rotor = 0; rotor < prisms; ++rotor) {
          angle += turns[k][rotor] * angles[rotor];
        }
        sums[k] += value * std::polar(1.0, -angle);
      }
    };
    visit(visit, 0);
    count = std::max(count, 1.0);
    for (std::size_t k = 0; k < turns.size(); ++k) {
      result.amplitude[k] += std::abs(sums[k]) / count / train.emitters();
    }
    result.constant.push_back(constant / count);
  }
  return result;
}

/// The emitter that fired the shots of a beam.
std::size_t emitter_of(std::uint8_t beam, std::size_t emitters, const FiringOrder& order) {
  const auto count = static_cast<int>(emitters);
  const int steps = order.backwards ? -(beam % count) : beam % count;
  return static_cast<std::size_t>(((order.first_emitter + steps) % count + count) % count);
}

/// Fit of the constants of a recording's beams to the emitters of a sensor.
struct EmitterFit {
  double miss = std::numeric_limits<double>::infinity();  ///< mean square
  FiringOrder order;
  double roll = 0;
};

/// The fit of one order: the mean belongs to the axis, and the rest turns with the sensor's roll.
EmitterFit fit_of(const RotorLines& found, const std::vector<Complex>& expected,
                  const FiringOrder& order) {
  const auto expected_of = [&](const EmitterConstant& one) {
    return expected[emitter_of(one.beam, expected.size(), order)];
  };
  Complex mean_found = 0, mean_expected = 0, product = 0;
  for (const EmitterConstant& one : found.emitters) {
    mean_found += one.share * one.constant;
    mean_expected += one.share * expected_of(one);
  }
  double power_found = 0, power_expected = 0;
  for (const EmitterConstant& one : found.emitters) {
    const Complex a = one.constant - mean_found, b = expected_of(one) - mean_expected;
    product += one.share * a * std::conj(b);
    power_found += one.share * std::norm(a);
    power_expected += one.share * std::norm(b);
  }
  EmitterFit fit{power_found + power_expected - 2.0 * std::abs(product), order, 0.0};
  if (fit.miss < kEmittersFit * kEmittersFit * power_expected) fit.roll = std::arg(product);
  return fit;
}

/// @param expected  [emitters], as in the recording: mirrored if it is
EmitterFit emitter_fit(const RotorLines& found, const std::vector<Complex>& expected,
                       BeamSource beams) {
  const std::size_t count = expected.size();
  EmitterFit best;
  if (beams == BeamSource::recorded) {
    const bool known = std::all_of(found.emitters.begin(), found.emitters.end(),
                                   [&](const EmitterConstant& one) { return one.beam < count; });
    return known ? fit_of(found, expected, {}) : best;
  }
  for (const bool backwards : {false, true}) {
    for (std::size_t first = 0; first < count; ++first) {
      EmitterFit fit = fit_of(found, expected, {static_cast<int>(first), backwards});
      // The other order is the same with half a turn of roll.
      if (count > 1 && std::abs(fit.roll) > 0.5 * kPi) continue;
      if (fit.miss < best.miss) best = fit;
    }
    if (count == 1) break;
  }
  return best;
}

/// The frame without roll whose X axis points so.
Eigen::Matrix3d frame_along(const Eigen::Vector3d& axis) {
  return recording_from_sensor(
      {std::atan2(axis.y(), axis.x()), std::atan2(-axis.z(), std::hypot(axis.x(), axis.y()))});
}

/// The rotation whose X axis leans by the sine of a constant: from the train's frame.
Eigen::Matrix3d frame_with_axis(const Eigen::Matrix3d& frame, Complex constant) {
  const double size = std::min(std::abs(constant), 1.0);
  const Eigen::Vector3d axis =
      frame * Eigen::Vector3d(std::sqrt(1.0 - size * size), constant.real(), constant.imag());
  return frame_along(axis);
}

Eigen::Matrix3d frame_about_mean(const AngleSeries& series) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < series.size(); ++i) {
    const auto v = direction_from_angles<double>({series.azimuth[i], series.zenith[i]});
    sum += Eigen::Vector3d(v.x, v.y, v.z);
  }
  return frame_along(sum);
}

AngleSeries in_frame(const AngleSeries& shots, const Eigen::Matrix3d& frame) {
  AngleSeries turned = shots;
  turn(turned, frame.transpose());
  return turned;
}

using LinesNear = decltype(StartFindings::near);

/// Matches lines of sensors with shots, in one frame of the recording after the other.
class LineMatcher {
 public:
  LineMatcher(std::span<const sensors::Sensor> candidates, BeamSource beams)
      : beams_(beams), matches_(candidates.size()) {
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      matches_[i].candidate = i;
      candidates_.push_back({sensors::in_all_combinations(candidates[i]),
                             nominal_lines(candidates[i].train),
                             candidates[i].train.layout().axis_up});
    }
  }

  bool any_axis_up() const {
    return std::any_of(candidates_.begin(), candidates_.end(),
                       [](const Candidate& one) { return one.axis_up; });
  }

  /// Tries candidates in a frame.
  /// @param search   in the shots, turned back by the frame
  /// @param frame    of the train, whose X is the axis of rotation
  /// @param axis_up  only sensors that turn about their Z (true) or X (false); empty: all
  /// @return the axis of the best one there
  /// @param[in,out] known  lines near some speeds
  Complex try_frame(const LineSearch& search, const Eigen::Matrix3d& frame,
                    std::optional<bool> axis_up, LinesNear& known) {
    find_lines_near(search, axis_up, known);
    double least = std::numeric_limits<double>::infinity();
    Complex axis = 0;
    for (SensorMatch& match : matches_) {
      const Candidate& candidate = candidates_[match.candidate];
      if (axis_up.value_or(candidate.axis_up) != candidate.axis_up) continue;
      for (const bool mirrored : {false, true}) {
        std::vector<Complex> emitters = candidate.lines.constant;
        if (mirrored) {
          for (Complex& one : emitters) one = std::conj(one);
        }
        for (const sensors::Sensor& sensor : candidate.combinations) {
          const ExpectedLines expected = expected_lines(sensor, candidate.lines, mirrored);
          for (const RotorLines& lines : known.at(expected.speeds)) {
            const EmitterFit fit = emitter_fit(lines, emitters, beams_);
            const double misfit =
                std::sqrt(std::max(0.0, unexplained_with(lines, expected.amplitudes) + fit.miss));
            if (misfit < least) {
              least = misfit;
              axis = lines.constant;
            }
            if (!(misfit < match.misfit)) continue;
            match.misfit = misfit;
            match.mirrored = mirrored;
            match.frame = turn_of(frame_with_axis(frame, lines.constant) *
                                      sensor_from_train(candidate.axis_up).transpose(),
                                  candidate.axis_up);
            match.order = fit.order;
            match.roll = fit.roll;
          }
        }
      }
    }
    return axis;
  }

  /// Best first.
  std::vector<SensorMatch> sorted() const {
    std::vector<SensorMatch> result = matches_;
    std::stable_sort(result.begin(), result.end(), [](const SensorMatch& a, const SensorMatch& b) {
      return a.misfit < b.misfit;
    });
    return result;
  }

 private:
  struct Candidate {
    std::vector<sensors::Sensor> combinations;
    NominalLines lines;
    bool axis_up = false;
  };
  /// By ascending speeds if there is no image, so that equivalent orders are searched once.
  struct ExpectedLines {
    std::vector<double> speeds, amplitudes;
  };

  static ExpectedLines expected_lines(const sensors::Sensor& sensor, const NominalLines& lines,
                                      bool mirrored) {
    std::vector<std::pair<double, double>> rotors;  // speed, amplitude
    for (std::size_t k = 0; k < sensor.angular_velocity.size(); ++k) {
      rotors.emplace_back(mirrored ? -sensor.angular_velocity[k] : sensor.angular_velocity[k],
                          lines.amplitude[k]);
    }
    const bool has_image = lines.amplitude.size() > rotors.size();
    if (!has_image) std::sort(rotors.begin(), rotors.end());
    ExpectedLines expected;
    for (const auto& [speed, amplitude] : rotors) {
      expected.speeds.push_back(speed);
      expected.amplitudes.push_back(amplitude);
    }
    if (has_image) expected.amplitudes.push_back(lines.amplitude.back());
    return expected;
  }

  /// Adds the lines of a recording near the candidates' speeds.
  void find_lines_near(const LineSearch& search, std::optional<bool> axis_up,
                       LinesNear& found) const {
    struct Wanted {
      LinesNear::value_type* lines;
      bool with_image;
    };
    std::vector<Wanted> wanted;
    for (const Candidate& candidate : candidates_) {
      if (axis_up.value_or(candidate.axis_up) != candidate.axis_up) continue;
      for (const sensors::Sensor& sensor : candidate.combinations) {
        for (const bool mirrored : {false, true}) {
          const auto [one, is_new] =
              found.try_emplace(expected_lines(sensor, candidate.lines, mirrored).speeds);
          if (is_new) wanted.push_back({&*one, candidate.axis_up});
        }
      }
    }
    parallel::for_each(wanted.size(), [&](std::size_t i) {
      auto& [speeds, lines] = *wanted[i].lines;
      lines = search.near(speeds, kUsualShare, kMostMinima, wanted[i].with_image);
    });
  }

  BeamSource beams_;
  std::vector<Candidate> candidates_;
  std::vector<SensorMatch> matches_;
};

bool lines_decide(const std::vector<SensorMatch>& matches) {
  return matches.front().misfit < kMostMisfit &&
         (matches.size() == 1 || matches[1].misfit > kFarWorse * matches.front().misfit);
}

}  // namespace

std::vector<std::uint8_t> emitters_in_order(const FiringOrder& order, int emitters) {
  require_between("emitters", emitters, 1, 255);
  std::vector<std::uint8_t> list;
  list.reserve(static_cast<std::size_t>(emitters));
  for (int shot = 0; shot < emitters; ++shot) {
    list.push_back(static_cast<std::uint8_t>(
        emitter_of(static_cast<std::uint8_t>(shot), static_cast<std::size_t>(emitters), order)));
  }
  return list;
}

SensorRecognition recognise_sensor(const AngleSeries& head,
                                   std::span<const sensors::Sensor> candidates, BeamSource beams,
                                   StartFindings* found) {
  SensorRecognition result;
  if (candidates.empty()) return result;
  StartFindings own;
  if (found == nullptr) found = &own;
  if (!found->lines) found->lines = std::make_shared<const LineSearch>(head);
  LineMatcher matcher(candidates, beams);
  Complex axis = matcher.try_frame(*found->lines, Eigen::Matrix3d::Identity(), false, found->near);
  result.matches = matcher.sorted();
  if (!lines_decide(result.matches) && matcher.any_axis_up()) {
    const ShotRange window = found->lines->shots();
    const Eigen::Matrix3d upright = sensor_from_train(true);
    LinesNear known;
    const Complex leaning =
        matcher.try_frame(LineSearch(in_frame(rows_of(head, window.begin, window.end), upright)),
                          upright, true, known);
    result.matches = matcher.sorted();
    if (lines_decide(result.matches)) axis = leaning;
  }
  if (!lines_decide(result.matches) || std::abs(axis) > kAxisFound) {
    const bool near = lines_decide(result.matches);
    const ShotRange window = found->lines->shots();
    const AngleSeries shots = rows_of(head, window.begin, window.end);
    const bool axis_up = result.matches.front().frame.axis_up;
    Eigen::Matrix3d frame =
        near ? frame_with_axis(sensor_from_train(axis_up), axis) : frame_about_mean(shots);
    for (int round = 0; round < kMostFrames; ++round) {
      LinesNear known;
      axis = matcher.try_frame(LineSearch(in_frame(shots, frame)), frame, std::nullopt, known);
      if (std::abs(axis) < kAxisFound || std::abs(axis) > kAxisLost) break;
      frame = frame_with_axis(frame, axis);
    }
    result.matches = matcher.sorted();
  }
  result.fits = result.matches.front().misfit < kMostMisfit;
  result.decided = lines_decide(result.matches);
  if (result.decided) return result;
  const double worth = kWorthATrial * result.matches.front().misfit;
  for (SensorMatch& match : result.matches) {
    if (!(match.misfit <= worth)) continue;
    match.residual = start_residual(head, candidates[match.candidate], match.order, beams, found);
  }
  std::stable_sort(result.matches.begin(), result.matches.end(),
                   [](const SensorMatch& a, const SensorMatch& b) {
                     constexpr double kNone = std::numeric_limits<double>::infinity();
                     return a.residual.value_or(kNone) < b.residual.value_or(kNone);
                   });
  const std::optional<double> best = result.matches.front().residual;
  if (!best) return result;
  result.fits = *best < kMostMisfit;
  result.decided = result.fits && (result.matches.size() == 1 || !result.matches[1].residual ||
                                   *result.matches[1].residual > kClearlyWorse * *best);
  return result;
}

std::optional<double> start_residual(const AngleSeries& head, const sensors::Sensor& sensor,
                                     const FiringOrder& order, BeamSource beams,
                                     StartFindings* found) {
  AngleSeries numbered;
  if (beams == BeamSource::counted) {
    numbered = head;
    number_beams(numbered, sensor, order);
    found = nullptr;
  }
  const AngleSeries& shots = beams == BeamSource::counted ? numbered : head;
  StartOptions options;
  EstimateOptions usual;
  usual.sensor = sensor;
  options.free = chosen_parameters(usual);
  options.angle_noise = sensor.angle_noise;
  options.mirrored.reset();
  try {
    const Start start = find_start(shots, sensor, options, found);
    // If times are wrong, parameters go to their bounds and are meaningless.
    constexpr double kRightTimes = radians_from_degrees(0.1);
    if (start.residual_rms > kRightTimes) return start.residual_rms;
    const double unusual = prior_chi2(options.free, free_values(start.train, options.free) -
                                                        free_values(sensor.train, options.free));
    // Residuals of unknown noise, two per shot, with the likelihood of both together. Those of
    // neighbouring shots are correlated, so that few count.
    constexpr double kIndependentShots = 100, kMostExponent = 20;
    return start.residual_rms *
           std::exp(std::min(kMostExponent, unusual / (4.0 * kIndependentShots)));
  } catch (const EstimationError&) {
    return std::nullopt;
  } catch (const InvalidArgument&) {  // beams that it has not
    return std::nullopt;
  }
}

void number_beams(AngleSeries& series, const sensors::Sensor& sensor, const FiringOrder& order) {
  const auto emitters = static_cast<std::size_t>(sensor.train.emitters());
  for (std::uint8_t& beam : series.beam) {
    beam = static_cast<std::uint8_t>(emitter_of(beam, emitters, order));
  }
}

std::optional<std::size_t> smallest_field(const AngleSeries& head,
                                          std::span<const sensors::Sensor> candidates,
                                          BeamSource beams) {
  if (head.size() == 0) return std::nullopt;
  const int last_beam =
      beams == BeamSource::counted ? 0 : *std::max_element(head.beam.begin(), head.beam.end());
  std::optional<std::size_t> best;
  for (const AngleSeries& shots : {head, in_frame(head, frame_about_mean(head))}) {
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (last_beam >= candidates[i].train.emitters()) continue;
      if (share_outside(shots, candidates[i].field_of_view) > kFewOutside) continue;
      if (!best || candidates[i].field_of_view < candidates[*best].field_of_view) best = i;
    }
    if (best) break;
  }
  return best;
}

}  // namespace risley::estimation
