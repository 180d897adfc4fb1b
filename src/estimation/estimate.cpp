// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/estimation/batch_map.hpp"
#include "risley/estimation/ekf.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/optics/batch.hpp"

#include "estimation/frame_prior.hpp"
#include "estimation/held_parameters.hpp"
#include "estimation/used_shots.hpp"

namespace risley::estimation {
namespace {

/// Parameters, mean speeds and first rotation angles as named values.
std::vector<EstimatedValue> named_values(const Estimate& estimate) {
  std::vector<EstimatedValue> values;
  for (std::size_t i = 0; i < estimate.free.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double sigma = std::sqrt(estimate.covariance(at, at));
    values.push_back({estimate.free[i].name, estimate.parameters[at], sigma, sigma});
  }
  const RotorStates& states = estimate.states;
  const RotorTrajectory& motion = estimate.trajectory;
  const int prisms = states.prisms();
  // Knots begin later.
  const std::size_t first_shot = first_used_shot(estimate);
  const RotorStates begin = states_of_shots(estimate, {first_shot, first_shot + 1});
  std::size_t diagonal = 0;
  std::vector<EstimatedValue> angles;
  for (int rotor = 0; rotor < prisms; ++rotor) {
    const auto k = static_cast<std::size_t>(rotor);
    const auto& angle = states.rotation_angle[k];
    const auto& variance = states.rotation_angle_covariance[diagonal];
    const double begin_sigma = std::sqrt(begin.rotation_angle_covariance[diagonal][0]);
    diagonal += static_cast<std::size_t>(prisms - rotor);
    // The mean speed is the angle turned over the time it took; the ends are far apart and so
    // independent.
    double turned = 0, time = 0, turned_variance = 0;
    for (std::size_t stretch = 0; stretch < motion.stretch_begin.size(); ++stretch) {
      const std::size_t first = motion.stretch_begin[stretch];
      const std::size_t last = motion.stretch_end(stretch) - 1;
      turned += angle[last] - angle[first];
      turned_variance += variance[first] + variance[last];
      time += 1e-9 * static_cast<double>(states.time_ns[last] - states.time_ns[first]);
    }
    EstimatedValue speed{fmt::format("angular_velocity_{}_deg_per_s", prism_letter(rotor)),
                         states.angular_velocity[k][0], states.angular_velocity_sigma[k][0], 0.0};
    if (time > 0) {
      speed.value = turned / time;
      speed.sigma = std::sqrt(turned_variance) / time;
    }
    speed.sigma_given_held = speed.sigma;
    values.push_back(speed);
    angles.push_back({fmt::format("rotation_angle_{}_deg", prism_letter(rotor)),
                      wrap_to_pi(begin.rotation_angle[k][0]), begin_sigma, begin_sigma});
  }
  values.insert(values.end(), angles.begin(), angles.end());
  return values;
}

/// The common factor of all rotors' speeds, if it is not 1.
std::optional<SpeedFactor> speed_factor(const sensors::Sensor& sensor, const Estimate& estimate) {
  // Controllers of real rotors hold their speeds to 1e-4; the paper's unit turns 5e-4 faster than
  // the type.
  constexpr double kSame = 2e-4, kOther = 1e-3;
  sensors::Sensor nominal = sensor;
  if (estimate.start.combination) nominal = with_combination(sensor, *estimate.start.combination);
  double weights = 0, sum = 0;
  std::vector<std::pair<double, double>> factors;  // and their sigmas
  for (int rotor = 0; rotor < nominal.prisms(); ++rotor) {
    const double speed = nominal.angular_velocity[static_cast<std::size_t>(rotor)];
    if (speed == 0) continue;
    const EstimatedValue& found =
        estimate.values[estimate.free.size() + static_cast<std::size_t>(rotor)];
    const double sigma = std::hypot(found.sigma_given_held / speed, 0.5 * kSame);
    factors.emplace_back(found.value / speed, sigma);
    sum += found.value / speed / (sigma * sigma);
    weights += 1.0 / (sigma * sigma);
  }
  if (factors.size() < 2) return std::nullopt;
  const SpeedFactor common{sum / weights, 1.0 / std::sqrt(weights)};
  for (const auto& [factor, sigma] : factors) {
    if (!(std::abs(factor - common.value) < std::max(kSame, 3.0 * sigma))) return std::nullopt;
  }
  if (!(std::abs(common.value - 1.0) > std::max(kOther, 3.0 * common.sigma))) return std::nullopt;
  return common;
}

/// The sensor preset equivalent to the estimate.
sensors::Sensor calibrated_sensor(const sensors::Sensor& nominal, const PrismTrain& train,
                                  const Estimate& estimate) {
  sensors::Sensor sensor = nominal;
  sensor.train = train;
  sensor.combination = estimate.start.combination;
  sensor.reference = sensors::CalibrationReference::directions;
  const auto statics = static_cast<Eigen::Index>(estimate.free.size());
  const Eigen::Index prisms = sensor.prisms();
  sensor.covariance_names.clear();
  sensor.covariance = Eigen::MatrixXd::Zero(statics + prisms, statics + prisms);
  sensor.covariance.topLeftCorner(statics, statics) = estimate.covariance;
  for (Eigen::Index i = 0; i < statics + prisms; ++i) {
    const EstimatedValue& value = estimate.values[static_cast<std::size_t>(i)];
    sensor.covariance_names.push_back(value.name);
    if (i >= statics) {
      sensor.angular_velocity[static_cast<std::size_t>(i - statics)] = value.value;
      sensor.covariance(i, i) = value.sigma_given_held * value.sigma_given_held;
    }
    sensor.set_knowledge(
        {value.name, value.sigma_given_held, "estimated from a recording", value.sigma});
  }
  return sensor;
}

/// Expected root mean square of noise and rounding together, rad.
/// @param rounding  mean variance of the rounding of both angles, rad^2
double expected_residual(const AngleNoise& noise, double rounding) {
  return std::sqrt(noise.rms() * noise.rms() + rounding);
}

/// A parameter that ended at an impossible value, as words; empty when there is none. A tilt of a
/// whole wedge angle, for example, turns a prism into one with its faces exchanged: such a fit is
/// as good as the right one, but its numbers are meaningless.
std::string implausible_parameter(const Estimate& estimate, const PrismTrain& nominal) {
  constexpr double kLargest = 5.0;  // prior sigmas
  for (std::size_t i = 0; i < estimate.free.size(); ++i) {
    const FreeParameter& parameter = estimate.free[i];
    const double change =
        estimate.parameters[static_cast<Eigen::Index>(i)] - nominal[parameter.places[0]];
    if (std::abs(change) <= kLargest * parameter.prior_sigma) continue;
    const ParameterInfo& info = find_parameter(parameter.name, nominal.shape());
    return fmt::format(
        "{} came out {:.4g}{} away from the sensor's value, more than is possible for this type: "
        "wrong face order, wrong wedge angles or another sensor",
        parameter.name, change / info.si_per_unit, info.unit == "1" ? "" : " " + info.unit);
  }
  return {};
}

/// Residuals above the stated noise, or correlated parts of them above that of a healthy unit, by
/// more than this factor mean that the model does not describe the recording.
constexpr double kFarAbove = 3.0;
/// Noise estimated above the preset's by this factor gives a warning.
constexpr double kNoisy = 2.0;
/// A parameter combination that keeps more of its prior sigma than this was not measured.
constexpr double kUnmeasured = 0.3;

/// Squared means over a prism's angle, per bin: 1 with a scatter of 0.12 (72 bins, two axes) when
/// nothing depends on the angle.
constexpr double kUneven = 1.6;
/// Residual variances above the stated one by more than this give a warning.
constexpr double kEnlarged = 1.1;
/// So do residuals above their stated sigma by this factor, if no variance was enlarged.
constexpr double kNoticed = 1.3;

/// Parameters and speeds further from the preset's than this, in its sigmas, are unusual.
constexpr double kUnusual = 3.0;

bool is_calibrated(const sensors::Sensor& sensor) {
  return sensor.reference == sensors::CalibrationReference::planes;
}

/// Values far from the preset or the calibration, as words; empty if there are none.
std::string unusual_values(const Estimate& estimate, const sensors::Sensor& nominal) {
  std::string words;
  const auto add = [&](const std::string& name, double sigmas) {
    words += fmt::format("{}{} lies {:.1f} sigma from the {}'s", words.empty() ? "" : ", ", name,
                         sigmas, is_calibrated(nominal) ? "calibration" : "preset");
  };
  for (std::size_t i = 0; i < estimate.free.size(); ++i) {
    const FreeParameter& parameter = estimate.free[i];
    const sensors::Knowledge* known = nominal.find_knowledge(parameter.name);
    const double sigma =
        known != nullptr && known->sigma > 0 ? known->sigma : parameter.prior_sigma;
    const auto at = static_cast<Eigen::Index>(i);
    const double change = estimate.parameters[at] - nominal.train[parameter.places[0]];
    const double sigmas =
        std::abs(change) / std::hypot(sigma, std::sqrt(estimate.covariance(at, at)));
    if (sigmas > kUnusual) add(parameter.name, sigmas);
  }
  for (const EstimatedValue& value : estimate.values) {
    if (!value.name.starts_with("angular_velocity")) continue;
    const sensors::Sensor turning = estimate.sensor.combination && nominal.combination
                                        ? with_combination(nominal, *estimate.sensor.combination)
                                        : nominal;
    const sensors::Knowledge* known = turning.find_knowledge(value.name);
    if (known == nullptr || !(known->sigma > 0)) continue;
    const double sigmas = std::abs(value.value - turning.get(value.name)) /
                          std::hypot(known->sigma, value.sigma_given_held);
    if (sigmas > kUnusual) add(value.name, sigmas);
  }
  return words;
}

/// Describes the turn of the recording's frame.
std::string frame_words(const Estimate& estimate) {
  const FrameEstimate& frame = *estimate.frame_turn;
  const bool has_sigma = frame.covariance(0, 0) > 0;
  const auto [first, second] = turn_names(frame.turn.axis_up);
  const auto angle = [&](double value, double variance) {
    return has_sigma ? fmt::format("{:.3f} ± {:.3f} deg", degrees_from_radians(value),
                                   degrees_from_radians(std::sqrt(variance)))
                     : fmt::format("{:.3f} deg", degrees_from_radians(value));
  };
  return fmt::format(
      "the recording's frame is not the sensor's: it is turned by {} in {} and {} in {}{}; a "
      "turn about the axis of rotation has the same effect as other zeros of the rotation angles "
      "and was taken as 0",
      angle(frame.turn.yaw, frame.covariance(0, 0)), first,
      angle(frame.turn.pitch, frame.covariance(1, 1)), second,
      has_sigma ? "" : " (held at the value found at the start)");
}

/// Completes the verdict: its code if the estimate converged, and its words.
/// @param values  those far from the preset or the calibration, a further anomaly
void say_verdict(Estimate& estimate, const sensors::Sensor& nominal,
                 std::vector<std::string> oddities, const std::string& values) {
  const bool calibrated = is_calibrated(nominal), only_values = oddities.empty();
  if (!values.empty()) {
    oddities.push_back(calibrated ? "the sensor's own optical parameters differ from its "
                                    "calibration to true directions: " +
                                        values
                                  : values);
  }
  EstimateVerdict& verdict = estimate.verdict;
  if (estimate.converged) {
    verdict.code = oddities.empty() ? EstimateCode::consistent : EstimateCode::unusual;
  }
  const double larger_rms = std::max(estimate.azimuth_moments.rms, estimate.zenith_moments.rms);
  switch (verdict.code) {
    case EstimateCode::consistent:
      verdict.words = fmt::format(
          "the directions are consistent with what the sensor believes of its optics, to {:.2g} "
          "degree ({}){}",
          degrees_from_radians(larger_rms), offset_text(larger_rms),
          calibrated ? ", and so is its calibration"
                     : "; only walls can show whether the sensor's own parameters are right");
      verdict.to_do =
          calibrated ? "nothing" : "to find out, record walls and calibrate the unit on them";
      break;
    case EstimateCode::unusual:
      verdict.words = "the model describes the directions, but " + oddities.front();
      for (std::size_t i = 1; i < oddities.size(); ++i) verdict.words += "; " + oddities[i];
      verdict.to_do = calibrated && only_values
                          ? "use the calibration and not this estimate for the unit's clouds"
                          : "compare it with an earlier recording of the unit, and calibrate it on "
                            "walls before relying on its points";
      break;
    case EstimateCode::inconsistent:
      verdict.words = estimate.reason;
      verdict.to_do = fmt::format(
          "check that sensor, times, frame and elevation are those of the recording ({}, {}, {}, "
          "{}), and that the sensor stood still",
          name_of(kSetting.sensor), name_of(kSetting.shot_rate), name_of(kSetting.extrinsics),
          name_of(kSetting.mirror));
      break;
    case EstimateCode::undecided:
      verdict.words = estimate.reason;
      verdict.to_do =
          "record longer or with more of the field of view, or hold the parameters that the data "
          "do not determine";
      break;
  }
}

/// Whether the result can be trusted.
void judge(Estimate& estimate, const sensors::Sensor& nominal) {
  const double rms = std::sqrt(0.5 * (estimate.azimuth_moments.rms * estimate.azimuth_moments.rms +
                                      estimate.zenith_moments.rms * estimate.zenith_moments.rms));
  // Rounding may differ from shot to shot; the unit variance weighs each by its own.
  const double ratio = std::sqrt(estimate.unit_variance);
  const auto shots = static_cast<double>(estimate.series.size());
  const double outlier_share = static_cast<double>(estimate.outliers) / shots;
  // The part that chance does not produce: neighbouring residuals share it.
  const double misfit = estimate.autocorrelation.rho.empty()
                            ? 0.0
                            : rms * std::sqrt(estimate.autocorrelation.rho.front());
  const std::string residuals =
      fmt::format("residuals of {:.3g} deg ({}) where noise and rounding amount to {:.3g} deg",
                  degrees_from_radians(rms), offset_text(rms),
                  degrees_from_radians(estimate.expected_residual));
  estimate.converged = true;
  std::vector<std::string> oddities;  // of the unit
  const auto fail = [&](std::string reason, EstimateCode code = EstimateCode::inconsistent) {
    estimate.converged = false;
    estimate.reason = std::move(reason);
    estimate.verdict.code = code;
  };
  if (!std::isfinite(ratio)) {
    fail("no residual could be formed", EstimateCode::undecided);
  } else if (outlier_share > 0.3) {
    fail(
        fmt::format("{:.0f} % of the shots do not fit the model: wrong sensor, speed combination "
                    "or mirror image, or a start too far from the solution",
                    100 * outlier_share));
  } else if (ratio > kFarAbove) {
    fail(residuals + ": the model does not describe these data, or their noise is larger");
  } else if (!estimate.noise_held && misfit > kFarAbove * estimate.usual_residual) {
    fail(
        fmt::format("residuals of {:.3g} deg ({}), of which neighbouring shots share {:.3g} deg, "
                    "where noise and rounding of a healthy unit amount to {:.3g} deg: the model "
                    "does not describe these data",
                    degrees_from_radians(rms), offset_text(rms), degrees_from_radians(misfit),
                    degrees_from_radians(estimate.usual_residual)));
  } else if (!estimate.unobservable.empty()) {
    const WeakDirection& worst = estimate.unobservable.front();
    fail(fmt::format(
             "the data do not determine the combination {} (in units of 1 deg, or 0.01 of an "
             "index; its sigma "
             "is {:.2g} of them): hold one of these fixed, or record longer",
             direction_text(worst), worst.sigma),
         EstimateCode::undecided);
  } else if (std::string words = implausible_parameter(estimate, nominal.train); !words.empty()) {
    fail(std::move(words));
  } else if (!estimate.settled) {
    fail("the last steps still moved parameters by more than a tenth of their sigma",
         EstimateCode::undecided);
  } else if (estimate.unit_variance > kEnlarged && estimate.variance_factor > 1.0) {
    warn(estimate.warnings, kWarning.sigmas_enlarged, "{}: the sigmas were enlarged by that factor",
         residuals);
  } else if (ratio > kNoticed) {
    warn(estimate.warnings, kWarning.sigmas_too_small,
         "{}: the sigmas are too small by about that factor", residuals);
  } else if (ratio < 0.93) {
    warn(estimate.warnings, kWarning.unusual_noise,
         "{}: the rotors' noise is set so high that they follow the noise, or the stated noise is "
         "too large",
         residuals);
  }
  if (!estimate.noise_held && estimate.noise.value.rms() > kNoisy * estimate.usual_noise) {
    warn(estimate.warnings, kWarning.unusual_noise,
         "the directions are {:.3g} times as noisy ({:.3g} deg, {}) as those of a healthy unit in "
         "the preset ({:.3g} deg)",
         estimate.noise.value.rms() / estimate.usual_noise,
         degrees_from_radians(estimate.noise.value.rms()), offset_text(estimate.noise.value.rms()),
         degrees_from_radians(estimate.usual_noise));
    oddities.push_back(estimate.warnings.back().message);
  }
  double unevenness = 1.0;
  std::size_t uneven = 0;
  for (std::size_t k = 0; k < estimate.residuals_over_angle.size(); ++k) {
    if (estimate.residuals_over_angle[k].chi2_per_bin <= unevenness) continue;
    unevenness = estimate.residuals_over_angle[k].chi2_per_bin;
    uneven = k;
  }
  if (unevenness > kUneven * estimate.autocorrelation.factor) {
    warn(estimate.warnings, kWarning.model_incomplete,
         "residuals depend on the rotation angle of prism {} ({:.3g} times what chance would "
         "give): the model lacks an effect of this sensor, or a parameter is held at a wrong "
         "value; the sigmas do not cover that",
         prism_letter(static_cast<int>(uneven)), unevenness);
    oddities.push_back(estimate.warnings.back().message);
  }
  if (estimate.autocorrelation.factor > 1.05) {
    warn(estimate.warnings, kWarning.sigmas_enlarged,
         "residuals of neighbouring shots are correlated ({:.2f} from one to the next): every "
         "variance was multiplied by {:.3g}",
         estimate.autocorrelation.rho.front(), estimate.autocorrelation.factor);
  }
  if (estimate.unused_shots > 0) {
    warn(estimate.warnings, kWarning.shots_unused,
         "{} shots lie in pieces between clock resets or long gaps that are too short to find the "
         "rotors' phases, or run in the other speed combination; they were not used",
         estimate.unused_shots);
  }
  if (estimate.converged && outlier_share > 0.02) {
    warn(estimate.warnings, kWarning.many_outliers,
         "{:.1f} % of the shots were rejected as outliers", 100 * outlier_share);
    oddities.push_back(estimate.warnings.back().message);
  }
  say_verdict(estimate, nominal, std::move(oddities), unusual_values(estimate, nominal));
}

/// Statistics of all residuals of an estimate.
struct Statistics {
  Moments azimuth, zenith;
  std::vector<AngleProfiler> over_angle;  ///< [prisms], of the used shots
  double rounding = 0;                    ///< sum of the rounding variances of both angles, rad^2
};

void add_statistics(Estimate& estimate) {
  const auto prisms = static_cast<std::size_t>(estimate.trajectory.prisms);
  std::vector<Moments> azimuth, zenith;
  Statistics all{{}, {}, std::vector<AngleProfiler>(prisms)};
  for_all_shots(
      estimate,
      [&](const SolvedShots& solved) {
        Statistics one{moments(solved.residuals.azimuth, solved.outlier),
                       moments(solved.residuals.zenith, solved.outlier),
                       std::vector<AngleProfiler>(prisms)};
        for (std::size_t i = 0; i < solved.shots.size(); ++i) {
          one.rounding += static_cast<double>(solved.shots.azimuth_rounding_variance[i]) +
                          static_cast<double>(solved.shots.zenith_rounding_variance[i]);
          if (!solved.used(i)) continue;
          for (std::size_t k = 0; k < prisms; ++k) {
            one.over_angle[k].add(solved.rotation_angle[k][i], solved.residuals.azimuth[i],
                                  solved.residuals.zenith[i]);
          }
        }
        return one;
      },
      [&](const Statistics& one) {
        azimuth.push_back(one.azimuth);
        zenith.push_back(one.zenith);
        all.rounding += one.rounding;
        for (std::size_t k = 0; k < prisms; ++k) all.over_angle[k].add(one.over_angle[k]);
      });
  estimate.azimuth_moments = moments_together(azimuth);
  estimate.zenith_moments = moments_together(zenith);
  for (const AngleProfiler& profiler : all.over_angle) {
    estimate.residuals_over_angle.push_back(profiler.result());
  }
  const double rounding = all.rounding / (2.0 * static_cast<double>(estimate.series.size()));
  estimate.expected_residual = expected_residual(estimate.noise.value, rounding);
  estimate.usual_residual = expected_residual(equal_noise(estimate.usual_noise), rounding);
}

/// Turns the shots by the estimated frame, and states the complete rotation.
void take_frame(Estimate& estimate) {
  estimate.series.change([&](AngleSeries& rows) { turn(rows, estimate.frame.transpose()); });
  FrameEstimate& whole = *estimate.frame_turn;
  whole.turn = turn_of(recording_from_sensor(whole.turn) * estimate.frame, whole.turn.axis_up);
  // Turns about the sensor's Z and Y axes; a yaw about the recording's Z moves the axis by its
  // cosine.
  const Eigen::DiagonalMatrix<double, 2> scale(1.0 / std::max(std::cos(whole.turn.pitch), 1e-9),
                                               1.0);
  whole.covariance = scale * estimate.frame_covariance * scale;
}

/// Holds the directions of emitters that fired no shot in the series: it cannot determine them.
void hold_mute_emitters(const PrismTrain& train, Estimate& estimate) {
  if (train.emitters() < 2) return;
  if (estimate.series.largest_beam() >= train.emitters()) {
    check_beams(train, estimate.series.rows().beam, estimate.series.size());
  }
  std::vector<std::size_t> shots = estimate.series.shots_of_beams();
  shots.resize(static_cast<std::size_t>(train.emitters()), 0);
  for (int emitter = 0; emitter < train.emitters(); ++emitter) {
    if (shots[static_cast<std::size_t>(emitter)] > 0) continue;
    std::erase_if(estimate.free, [&](const FreeParameter& parameter) {
      return place::emitter(parameter.places.front(), train.prisms()) == emitter;
    });
    warn(estimate.warnings, kWarning.not_seen,
         "emitter {} has no shot: its direction was held at the preset's", emitter + 1);
  }
}

BatchMapOptions map_options(const Estimate& estimate, const EstimateOptions& options) {
  BatchMapOptions settings;
  if (estimate.noise_held) settings.angle_noise = estimate.noise.value;
  settings.free = estimate.free;
  settings.rotor_process = options.rotor_process;
  if (estimate.start.frame) settings.frame_sigma = kFrameSigma;
  return settings;
}

/// Logarithm of the likelihood of residuals under their estimated noise, over the shots that
/// neither of two results rejects; correlated residuals have a reduced weight.
/// @param series  as it was estimated
double log_likelihood(const Solution& result, AngleSeries series,
                      const std::vector<unsigned char>& also_out) {
  turn(series, result.frame.transpose());
  const ShotResiduals residuals = residuals_of_shots(result, series, {0, series.size()});
  const AngleNoise noise = usable_noise(result.noise.value);
  const auto term = [](double residual, double sigma, float rounding) {
    const double variance = sigma * sigma + static_cast<double>(rounding);
    return -0.5 * (residual * residual / variance + std::log(variance));
  };
  double sum = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (result.outlier[i] != 0 || also_out[i] != 0) continue;
    sum += term(residuals.azimuth[i], noise.azimuth, series.azimuth_rounding_variance[i]) +
           term(residuals.zenith[i], noise.zenith, series.zenith_rounding_variance[i]);
  }
  return sum / result.autocorrelation.factor;
}

/// Whether the coordinates of a Cartesian recording were rounded or truncated: its beginning is
/// estimated both ways, and the likelier one is used if the decision is clear.
CoordinateRounding rounding_of(const Estimate& estimate, const EstimateOptions& options,
                               const Progress& progress) {
  constexpr std::size_t kEnoughShots = 50000;
  constexpr double kVisible = 5.0, kDecisive = 12.5;  // sigmas, and a logarithm of a likelihood
  const AngleSeries nearest =
      estimate.series.rows({0, std::min(kEnoughShots, estimate.series.size())});
  if (half_step_signal(nearest, estimate.start.residual_rms) < kVisible) {
    return CoordinateRounding::unknown;
  }
  AngleSeries cut = nearest;
  add_half_steps(cut, recording_from_sensor(estimate.start.frame.value_or(FrameTurn{})));
  const BatchMapOptions settings = map_options(estimate, options);
  try {
    const Solution rounded =
        run_batch_map(nearest, estimate.start, options.sensor, settings, progress);
    const Solution mended = run_batch_map(cut, estimate.start, options.sensor, settings, progress);
    const double lead = log_likelihood(mended, cut, rounded.outlier) -
                        log_likelihood(rounded, nearest, mended.outlier);
    if (std::abs(lead) < kDecisive) return CoordinateRounding::unknown;
    return lead > 0 ? CoordinateRounding::toward_zero : CoordinateRounding::nearest;
  } catch (const EstimationError&) {
    return CoordinateRounding::unknown;
  }
}

/// Enlarges the sigmas by the possible errors of held parameters.
void count_held_parameters(Estimate& estimate, const sensors::Sensor& nominal) {
  estimate.held_changes = changes_by_held_parameters(estimate, nominal);
  const auto count = static_cast<Eigen::Index>(estimate.values.size());
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(count);
  for (std::size_t j = 0; j < estimate.held_changes.held.size(); ++j) {
    variance += estimate.held_changes.covariance(j, count).diagonal();
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    EstimatedValue& value = estimate.values[static_cast<std::size_t>(i)];
    value.sigma = std::hypot(value.sigma_given_held, std::sqrt(variance[i]));
  }
}

Solution solve(const Estimate& estimate, const EstimateOptions& options, const Progress& progress) {
  if (estimate.method == Method::map) {
    return run_batch_map(estimate.series, estimate.start, options.sensor,
                         map_options(estimate, options), progress);
  }
  EkfOptions settings;
  settings.angle_noise = estimate.noise.value.rms();
  settings.free = estimate.free;
  settings.rotor_process = options.rotor_process;
  return run_ekf(estimate.series.rows(), estimate.start, settings, progress);
}

/// A start from the first second, or, if that holds too little, from the first place in the series
/// that has enough.
Start start_anywhere(const PackedSeries& series, const AngleSeries& head,
                     const EstimateOptions& options, const Estimate& estimate, StartFindings found,
                     const Progress& progress) {
  const auto start_of = [&](const AngleSeries& shots, StartFindings* known = nullptr) {
    progress.check();
    return find_start(shots, options.sensor,
                      {estimate.free, options.angle_noise.value_or(options.sensor.angle_noise),
                       options.mirrored, options.turned},
                      known);
  };
  try {
    return start_of(head, &found);
  } catch (const EstimationError& error) {
    std::optional<WrongClock> wrong_clock;
    if (const auto* own = dynamic_cast<const WrongClock*>(&error)) wrong_clock = *own;
    constexpr std::size_t kPlaces = 50;
    constexpr std::int64_t kLongestNs = 500'000'000;
    for (std::size_t place = 1; place < kPlaces; ++place) {
      const std::size_t begin = place * series.size() / kPlaces;
      std::size_t end = begin;
      while (end < series.size() && series.time_ns(end) >= series.time_ns(begin) &&
             series.time_ns(end) - series.time_ns(begin) < kLongestNs) {
        ++end;
      }
      try {
        return start_of(series.rows({begin, end}));
      } catch (const WrongClock& other) {
        if (wrong_clock) throw *wrong_clock;  // two consistent places are enough
        wrong_clock = other;
      } catch (const EstimationError&) {  // nor here
      }
    }
    throw;
  }
}

}  // namespace

const char* to_string(EstimateCode code) {
  switch (code) {
    case EstimateCode::consistent:
      return "consistent";
    case EstimateCode::unusual:
      return "unusual";
    case EstimateCode::inconsistent:
      return "inconsistent";
    case EstimateCode::undecided:
      break;
  }
  return "undecided";
}

const char* to_string(Method method) { return method == Method::map ? "map" : "ekf"; }

std::vector<FreeParameter> chosen_parameters(const EstimateOptions& options) {
  const TrainShape shape = options.sensor.shape();
  std::vector<std::string> names = default_free_names(shape, one_glass(options.sensor.train));
  for (const std::string& name : options.fixed) {
    find_parameter(name, shape);  // an unknown name is an error; one that is not free is ignored
    std::erase(names, name);
  }
  for (const std::string& name : options.additional) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return free_parameters(names, shape);
}

Estimate estimate(Method method, PackedSeries series, const AngleSeries& head,
                  const EstimateOptions& options, const Progress& progress, StartFindings found) {
  if (series.size() == 0) throw EstimationError("the recording holds no valid shot");
  Estimate estimate;
  estimate.method = method;
  estimate.noise_held = options.angle_noise.has_value() || method == Method::ekf;
  if (estimate.noise_held) {
    estimate.noise.value = equal_noise(options.angle_noise.value_or(options.sensor.angle_noise));
    check_noise(estimate.noise.value);
  }
  estimate.free = chosen_parameters(options);
  estimate.series = std::move(series);
  bool head_is_used = true;
  if (method == Method::ekf) {
    const auto ranges = stretches(estimate.series);
    if (ranges.size() > 1) {
      const auto longest = std::max_element(
          ranges.begin(), ranges.end(),
          [](const ShotRange& a, const ShotRange& b) { return a.size() < b.size(); });
      warn(estimate.warnings, kWarning.clock_reset,
           "the clock was reset or the recording paused {} times: the filter takes the longest "
           "piece, {} of {} shots",
           ranges.size() - 1, longest->size(), estimate.series.size());
      head_is_used = longest == ranges.begin();
      estimate.series = estimate.series.rows(*longest);
    }
  }
  hold_mute_emitters(options.sensor.train, estimate);
  constexpr std::size_t kHeadRows = 2000;
  estimate.start = start_anywhere(
      estimate.series,
      head_is_used ? head : estimate.series.rows({0, std::min(kHeadRows, estimate.series.size())}),
      options, estimate, head_is_used ? std::move(found) : StartFindings(), progress);
  estimate.mirrored = estimate.start.mirrored;
  if (estimate.start.mirrored || estimate.start.frame) {
    estimate.series.change([&](AngleSeries& rows) { prepare_shots(rows, estimate.start); });
  }
  if (estimate.start.frame) {
    estimate.frame_turn.emplace().turn = *estimate.start.frame;
    hold_last_bearing(options.sensor.train.layout(), estimate.free);
  }
  if (options.cartesian && method == Method::map) {
    estimate.coordinates = rounding_of(estimate, options, progress.silent());
    if (estimate.coordinates == CoordinateRounding::toward_zero) {
      estimate.series.change([&](AngleSeries& rows) {
        add_half_steps(rows, recording_from_sensor(estimate.start.frame.value_or(FrameTurn{})));
      });
      warn(estimate.warnings, kWarning.coordinates_cut,
           "the coordinates were truncated to whole steps, not rounded: half a step was added to "
           "each");
    }
  }
  if (estimate.mirrored) {
    warn(estimate.warnings, kWarning.mirrored,
         "the recording is a mirror image (its elevation has the opposite sign) and was flipped");
  }
  static_cast<Solution&>(estimate) = solve(estimate, options, progress);
  if (estimate.frame_turn) {
    take_frame(estimate);
    estimate.warnings.push_back({kWarning.frame_turned, frame_words(estimate)});
  }
  estimate.states = states_of_knots(estimate, estimate.series);
  estimate.usual_noise = options.sensor.angle_noise;
  add_statistics(estimate);
  if (!estimate.constants.empty()) {
    estimate.unobservable = weak_directions(estimate.information, estimate.constants, kUnmeasured);
  }
  estimate.values = named_values(estimate);
  count_held_parameters(estimate, options.sensor);
  estimate.speed_factor = speed_factor(options.sensor, estimate);
  estimate.sensor = calibrated_sensor(
      options.sensor, with_free_values(options.sensor.train, estimate.free, estimate.parameters),
      estimate);
  judge(estimate, options.sensor);
  return estimate;
}

std::size_t first_used_shot(const Estimate& estimate) {
  require_at_least("knots of the estimate", static_cast<long long>(estimate.trajectory.size()), 1);
  return estimate.trajectory.first_shot.front();
}

RotorStates states_of_shots(const Estimate& estimate, ShotRange shots) {
  return states_of_shots(estimate, estimate.series, shots);
}

ShotResiduals residuals_of_shots(const Estimate& estimate) {
  ShotResiduals all;
  for_all_shots(
      estimate, [](SolvedShots solved) { return std::move(solved.residuals); },
      [&](const ShotResiduals& some) {
        all.azimuth.insert(all.azimuth.end(), some.azimuth.begin(), some.azimuth.end());
        all.zenith.insert(all.zenith.end(), some.zenith.begin(), some.zenith.end());
      });
  return all;
}

}  // namespace risley::estimation
