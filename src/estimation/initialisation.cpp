// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/initialisation.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/estimation/spectral_lines.hpp"
#include "risley/optics/batch.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/sensors/scan_pattern.hpp"

#include "estimation/field_of_view.hpp"
#include "estimation/frame_prior.hpp"
#include "estimation/knot_model.hpp"

namespace risley::estimation {
namespace {

/// Slowest change of a speed allowed by a fit over the first shots, rad/s^2.
constexpr double kAccelerationSigma = radians_from_degrees(200.0);
/// Number of shots fitted by a start, at first and when solutions must be distinguished.
constexpr std::size_t kEnoughShots = 1000, kManyShots = 20000;
/// Speeds of a sensor whose clock or rotors are further off than usual are found among all pairs,
/// within this share of the sensor's.
constexpr double kFarthestShare = 0.2;
/// A pair of lines that leaves this many times as much as the best need not be tried, unless its
/// remainder is within the error of two lines as a model, as a mean square.
constexpr double kHopeless = 4.0, kSecondOrder = 3e-5;
/// Residual of a fit below which no other pair of speeds is tried, rad: wandering rotors and noise
/// of any usual size leave less, a wrong pair more.
constexpr double kGoodResidual = radians_from_degrees(0.08);
/// Two solutions are distinct if their chi2 differ by this.
constexpr double kDecisive = 25.0;
/// A turn that leaves all shots in the field of view is accepted from this angle on, rad, if it
/// removes this share of the residuals. If the last axis may lean, that explains a turn as well:
/// then only a turn larger than any unit's lean is accepted, which may remove the second share.
constexpr double kLeastTurn = radians_from_degrees(0.3), kMostLean = radians_from_degrees(0.6);
constexpr double kTurnGain = 0.1, kTurnLoss = 0.02;

/// A fit of parameters and one parabola per rotor to a few shots.
struct WindowFit {
  PrismTrain train;
  RotorTrajectory knot;                                 // a single one
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();  // of the shots, from the sensor's
  double rms = std::numeric_limits<double>::infinity();
  double prior_chi2 = 0;  // of the parameters: how unusual the sensor would be
};

/// The greatest acceleration of a swing, rad/s^2.
double swing_acceleration(const sensors::Sensor& sensor) {
  const double frequency = sensors::swing_angular_frequency(sensor);
  double greatest = 0;
  if (frequency > 0) {
    for (const double swing : sensor.sequence->swing) {
      greatest = std::max(greatest, std::abs(swing) * frequency);
    }
  }
  return greatest;
}

/// A swing is nearly a parabola within an eighth of its period.
FirstMotion first_motion(const sensors::Sensor& sensor) {
  FirstMotion motion;
  const double acceleration = swing_acceleration(sensor);
  if (!(acceleration > 0)) return motion;
  motion.window = std::min(motion.window, kTwoPi / sensors::swing_angular_frequency(sensor) / 8);
  motion.process.acceleration =
      std::max(motion.process.acceleration, acceleration * std::sqrt(motion.window));
  return motion;
}

/// Robust least squares with Levenberg's damping: first the motion, then the parameters too.
class WindowFitter {
 public:
  /// @param frame  the frame's parameters if its turn is free
  WindowFitter(const AngleSeries& shots, const PrismTrain& nominal,
               const std::vector<FreeParameter>& free, const std::vector<FreeParameter>& frame,
               double noise, double acceleration_sigma)
      : shots_(shots), free_(free), acceleration_sigma_(acceleration_sigma) {
    if (!frame.empty()) hold_last_bearing(nominal.layout(), free_);
    prior_ = free_values(nominal, free_);
    all_ = free_;
    all_.insert(all_.end(), frame.begin(), frame.end());
    weights_.angle_noise = equal_noise(noise);
    azimuth_.resize(shots.size());
    zenith_.resize(shots.size());
  }

  /// Moves the rotation angles to the best of a grid over whole turns, with the fit's speeds and
  /// parameters: for shots in a corner of the field, which hardly determine the lines' phases.
  void look_around(WindowFit& fit) {
    constexpr int kSteps = 24;
    constexpr double kMiss = radians_from_degrees(2.0);  // of a grid's angles
    weights_.softening = softening_at(kMiss / weights_.angle_noise.azimuth);
    WindowFit best = fit, trial = fit;
    double least = std::numeric_limits<double>::infinity();
    const auto choose = [&](const auto& self, int rotor) -> void {
      if (rotor < fit.knot.prisms) {
        for (int step = 0; step < kSteps; ++step) {
          trial.knot.state[static_cast<std::size_t>(3 * rotor)] = kTwoPi * step / kSteps;
          self(self, rotor + 1);
        }
        return;
      }
      const double cost = evaluate(trial);
      if (cost >= least) return;
      least = cost;
      best = trial;
    };
    choose(choose, 0);
    fit = std::move(best);
  }

  void run(WindowFit& fit) {
    const auto n = static_cast<Eigen::Index>(all_.size());
    const Eigen::Index d = 3 * fit.knot.prisms;
    evaluate(fit);
    for (const bool move_parameters : {false, true}) {
      double damping = 1e-4;
      for (int iteration = 0; iteration < 25; ++iteration) {
        weights_.softening = softening_at(
            std::max(1.0, robust_level(shots_, weights_.angle_noise, azimuth_, zenith_)));
        const double cost = evaluate(fit);
        const auto [normal, gradient] = normal_equations(fit);
        bool moved = false, done = false;
        while (!moved && damping < 1e6) {
          Eigen::MatrixXd damped = normal;
          damped.diagonal() *= 1.0 + damping;
          if (!move_parameters) damped.diagonal().tail(n).array() *= 1e12;
          WindowFit trial = stepped(fit, algebra::SymmetricSolver(damped).solve(gradient), d);
          const double trial_cost = evaluate(trial);
          if (trial_cost < cost) {
            done = cost - trial_cost < 1e-6 * cost;
            fit = std::move(trial);
            damping = std::max(damping / 10.0, 1e-9);
            moved = true;
          } else {
            damping = std::max(10.0 * damping, 1e-3);
          }
        }
        if (!moved || done) break;
      }
      evaluate(fit);
    }
    fit.rms = robust_scale(azimuth_, zenith_);
    if (!std::isfinite(fit.rms)) fit.rms = std::numeric_limits<double>::infinity();
    fit.prior_chi2 = prior_chi2(fit);
  }

 private:
  bool turns() const { return all_.size() > free_.size(); }

  /// Offsets of the free values from their priors, the frame's turn last.
  Eigen::VectorXd offsets(const WindowFit& fit) const {
    Eigen::VectorXd offset(static_cast<Eigen::Index>(all_.size()));
    offset.head(prior_.size()) = free_values(fit.train, free_) - prior_;
    if (turns()) {
      const FrameTurn turn = turn_of(fit.frame, fit.train.layout().axis_up);
      offset.tail(2) = Eigen::Vector2d(turn.yaw, turn.pitch);
    }
    return offset;
  }

  double prior_chi2(const WindowFit& fit) const {
    return estimation::prior_chi2(all_, offsets(fit));
  }

  double evaluate(const WindowFit& fit) {
    const AngleSeries* series = &shots_;
    if (turns()) {
      turned_ = shots_;
      turn(turned_, fit.frame.transpose());
      series = &turned_;
    }
    accumulate(*series, fit.knot, fit.train, all_, weights_, equations_, {azimuth_, zenith_, {}});
    double cost = equations_.cost + prior_chi2(fit);
    for (int k = 0; k < fit.knot.prisms; ++k) {
      cost +=
          std::pow(fit.knot.state[static_cast<std::size_t>(3 * k + 2)] / acceleration_sigma_, 2);
    }
    return cost;
  }

  std::pair<Eigen::MatrixXd, Eigen::VectorXd> normal_equations(const WindowFit& fit) const {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const auto n = static_cast<Eigen::Index>(all_.size());
    const Eigen::Index d = 3 * fit.knot.prisms;
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(d + n, d + n);
    Eigen::VectorXd gradient(d + n);
    normal.topLeftCorner(d, d) = knot_curvature<Eigen::Dynamic>(equations_, 0);
    normal.topRightCorner(d, n) = Eigen::Map<const RowMajor>(equations_.coupling.data(), d, n);
    normal.bottomLeftCorner(n, d) = normal.topRightCorner(d, n).transpose();
    normal.bottomRightCorner(n, n) = equations_.static_hessian;
    gradient.head(d) = Eigen::Map<const Eigen::VectorXd>(equations_.gradient.data(), d);
    gradient.tail(n) = equations_.static_gradient;
    const Eigen::VectorXd offset = offsets(fit);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double sigma = all_[static_cast<std::size_t>(i)].prior_sigma;
      normal(d + i, d + i) += 1.0 / (sigma * sigma);
      gradient[d + i] -= offset[i] / (sigma * sigma);
    }
    for (Eigen::Index k = 0; k < fit.knot.prisms; ++k) {
      const double weight = 1.0 / (acceleration_sigma_ * acceleration_sigma_);
      normal(3 * k + 2, 3 * k + 2) += weight;
      gradient[3 * k + 2] -= weight * fit.knot.state[static_cast<std::size_t>(3 * k + 2)];
    }
    return {std::move(normal), std::move(gradient)};
  }

  WindowFit stepped(const WindowFit& fit, const Eigen::VectorXd& step, Eigen::Index d) const {
    WindowFit next = fit;
    next.train = with_free_values(fit.train, free_,
                                  free_values(fit.train, free_) + step.segment(d, prior_.size()));
    for (Eigen::Index i = 0; i < d; ++i) next.knot.state[static_cast<std::size_t>(i)] += step[i];
    if (turns()) next.frame = turned_further(fit.frame, step.tail(2), fit.train.layout().axis_up);
    return next;
  }

  const AngleSeries& shots_;
  std::vector<FreeParameter> free_, all_;
  Eigen::VectorXd prior_;
  double acceleration_sigma_;
  ShotWeights weights_;
  NormalEquations equations_;
  AngleSeries turned_;
  std::vector<double> azimuth_, zenith_;
};

/// One hypothesis on how the recording was made.
struct Hypothesis {
  bool mirrored = false;
  sensors::Sensor sensor;  // in one of its speed combinations

  /// Speeds of the lines of y + iz of the train's frame as recorded: a mirror image turns the other
  /// way.
  std::vector<double> recorded_speeds() const {
    std::vector<double> speeds = sensor.angular_velocity;
    if (mirrored) std::transform(speeds.begin(), speeds.end(), speeds.begin(), std::negate<>());
    return speeds;
  }
  std::string words() const {
    return fmt::format("{}{}",
                       sensor.combination ? fmt::format("speed combination {}", *sensor.combination)
                                          : std::string("the sensor's speeds"),
                       mirrored ? " mirrored" : " as recorded");
  }
};

std::vector<Hypothesis> hypotheses_of(const sensors::Sensor& sensor, std::optional<bool> mirrored) {
  std::vector<Hypothesis> all;
  for (const bool image : {false, true}) {
    if (mirrored && image != *mirrored) continue;
    for (const sensors::Sensor& candidate : in_all_combinations(sensor)) {
      all.push_back({image, candidate});
    }
  }
  return all;
}

/// Lines that may belong to a hypothesis's rotors: in beam order, as recorded.
struct Trial {
  const Hypothesis* hypothesis = nullptr;
  RotorLines lines;
};

/// A trial and its result.
struct Answer {
  Trial trial;
  WindowFit fit;
  bool frame_is_free = false;
};

/// The shots of a window, prepared for a fit under any hypothesis.
class StartWindow {
 public:
  /// @param frame  of the recording, from the sensor's, roughly
  /// @param found  about the head
  StartWindow(const AngleSeries& head, const sensors::Sensor& sensor, const StartOptions& options,
              const Eigen::Matrix3d& frame, StartFindings& found)
      : options_(options),
        found_(found),
        frame_(frame),
        axis_up_(sensor.train.layout().axis_up),
        swings_(swing_acceleration(sensor) > 0),
        motion_(first_motion(sensor)),
        turned_(frame.isIdentity() ? AngleSeries() : head),
        series_(frame.isIdentity() ? head : turned_),
        noise_(least_noise(options)),
        frame_parameters_(frame_parameters(sensor.train.layout(), kFrameSigma)) {
    if (!frame.isIdentity()) turn(turned_, frame.transpose());
    if (axis_up_) {  // lines are those of rotation about X
      AngleSeries about_x = series_;
      turn(about_x, sensor_from_train(true).transpose());
      search_ = std::make_shared<const LineSearch>(about_x);
    } else if (frame.isIdentity()) {
      if (!found.lines) found.lines = std::make_shared<const LineSearch>(head);
      search_ = found.lines;
    } else {
      search_ = std::make_shared<const LineSearch>(turned_);
    }
  }
  StartWindow(const StartWindow&) = delete;
  StartWindow& operator=(const StartWindow&) = delete;

  const LineSearch& search() const { return *search_; }
  /// The lines near a hypothesis's speeds.
  std::vector<RotorLines> near(const std::vector<double>& speeds) const {
    if (search_ != found_.lines) return search_->near(speeds, kUsualShare, kMostMinima, axis_up_);
    const auto [known, is_new] = found_.near.try_emplace(speeds);
    if (is_new) known->second = search_->near(speeds, kUsualShare, kMostMinima);
    return known->second;
  }

  /// @param most           shots to take part
  /// @param frame_is_free  whether the frame's turn is fitted too
  Answer answer(const Trial& trial, std::size_t most, bool frame_is_free) const {
    const Hypothesis& h = *trial.hypothesis;
    const AngleSeries shots = chosen(h.mirrored, most);
    const ShotRange all{0, shots.size()};
    WindowFit fit{h.sensor.train, make_knots(shots, {&all, 1}, h.sensor.prisms(), 1e9)};
    fit.knot.time_ns[0] = search_->time_ns();
    const double sign = h.mirrored ? -1.0 : 1.0;
    for (std::size_t k = 0; k < h.sensor.angular_velocity.size(); ++k) {
      const SpectralLine& line = trial.lines.lines[k];
      // At rotation angle zero the beam leans to -Z, so a line's phase is the angle less 90
      // degrees.
      fit.knot.state[3 * k] = sign * line.phase + kPi / 2;
      fit.knot.state[3 * k + 1] = sign * line.angular_velocity;
    }
    const std::vector<FreeParameter> frame =
        frame_is_free ? frame_parameters_ : std::vector<FreeParameter>();
    const WindowFit from_lines = fit;
    const double acceleration = std::max(kAccelerationSigma, swing_acceleration(h.sensor));
    WindowFitter fitter(shots, h.sensor.train, options_.free, frame, noise_, acceleration);
    fitter.run(fit);
    // If the lines explain hardly more than others would, or leave much, their phases are
    // meaningless.
    if (!(fit.rms < kGoodResidual) &&
        (axis_up_ || trial.lines.unexplained < kSecondOrder || !std::isfinite(fit.rms))) {
      constexpr std::size_t kGridShots = 150;
      const AngleSeries few = chosen(h.mirrored, kGridShots);
      WindowFit around = from_lines;
      around.knot.last_shot[0] = few.size();
      WindowFitter(few, h.sensor.train, {}, {}, noise_, acceleration).look_around(around);
      around.knot.last_shot[0] = shots.size();
      fitter.run(around);
      if (around.rms < fit.rms) fit = std::move(around);
    }
    return {trial, std::move(fit), frame_is_free};
  }

  std::size_t size(std::size_t most) const { return chosen(false, most).size(); }

  Start start_of(const Answer& answer) const {
    const Hypothesis& h = *answer.trial.hypothesis;
    const ShotRange rows = fitted_rows();
    Start start;
    start.time_ns = search_->time_ns();
    start.reach =
        1e-9 * static_cast<double>(std::max(start.time_ns - series_.time_ns[rows.begin],
                                            series_.time_ns[rows.end - 1] - start.time_ns));
    start.train = answer.fit.train;
    start.combination = h.sensor.combination;
    start.mirrored = h.mirrored;
    start.residual_rms = answer.fit.rms;
    start.motion = motion_;
    for (std::size_t k = 0; k < h.sensor.angular_velocity.size(); ++k) {
      start.rotation_angle.push_back(wrap_to_pi(answer.fit.knot.state[3 * k]));
      start.angular_velocity.push_back(answer.fit.knot.state[3 * k + 1]);
    }
    if (!answer.frame_is_free) return start;
    // The mirror image of the mirrored recording: its frame turns the other way in the mirror
    // image.
    Eigen::Matrix3d total = frame_;
    if (h.mirrored) {
      const Eigen::DiagonalMatrix<double, 3> mirror(1.0, axis_up_ ? -1.0 : 1.0,
                                                    axis_up_ ? 1.0 : -1.0);
      total = (mirror * frame_ * mirror).eval();
    }
    start.frame = turn_of(total * answer.fit.frame, axis_up_);
    return start;
  }

 private:
  static double least_noise(const StartOptions& options) {
    return std::max(options.angle_noise, radians_from_degrees(1e-4));
  }

  /// The shots of the lines; if speeds swing, those about their middle that a parabola fits.
  ShotRange fitted_rows() const {
    ShotRange rows = search_->shots();
    if (!swings_) return rows;
    const auto half = static_cast<std::int64_t>(0.5e9 * motion_.window);
    while (series_.time_ns[rows.begin] < search_->time_ns() - half) ++rows.begin;
    while (series_.time_ns[rows.end - 1] > search_->time_ns() + half) --rows.end;
    return rows;
  }

  AngleSeries chosen(bool mirrored, std::size_t most) const {
    AngleSeries shots;
    const ShotRange rows = fitted_rows();
    const std::size_t stride = thinning_stride(series_, rows, most);
    for (std::size_t i = rows.begin; i < rows.end; i += stride) shots.append(series_, i);
    if (mirrored) mirror(shots, axis_up_);
    return shots;
  }

  const StartOptions& options_;
  StartFindings& found_;
  Eigen::Matrix3d frame_;
  bool axis_up_, swings_;
  FirstMotion motion_;
  AngleSeries turned_;
  const AngleSeries& series_;
  double noise_;
  std::shared_ptr<const LineSearch> search_;
  std::vector<FreeParameter> frame_parameters_;
};

/// Whether speeds of lines are those of a hypothesis, in the order given.
bool speeds_fit(const Hypothesis& hypothesis, const RotorLines& lines, double share) {
  const std::vector<double> speeds = hypothesis.recorded_speeds();
  for (std::size_t k = 0; k < speeds.size(); ++k) {
    if (!(std::abs(lines.lines[k].angular_velocity - speeds[k]) < share * std::abs(speeds[k]))) {
      return false;
    }
  }
  return true;
}

/// The lines found for speeds `from`, in the order of `to`; none if these are not the same speeds.
std::optional<RotorLines> reordered(const RotorLines& lines, const std::vector<double>& from,
                                    const std::vector<double>& to) {
  RotorLines result = lines;
  std::vector<bool> taken(from.size(), false);
  for (std::size_t k = 0; k < to.size(); ++k) {
    std::size_t at = 0;
    while (at < from.size() && (taken[at] || from[at] != to[k])) ++at;
    if (at == from.size()) return std::nullopt;
    taken[at] = true;
    result.lines[k] = lines.lines[at];
  }
  return result;
}

std::string speeds_text(const std::vector<double>& speeds) {
  std::string text;
  for (std::size_t k = 0; k < speeds.size(); ++k) {
    const char* before = k == 0 ? "" : k + 1 == speeds.size() ? " and " : ", ";
    text += fmt::format("{}{:.0f}", before, degrees_from_radians(speeds[k]));
  }
  return text;
}

/// Twice the log likelihood ratio of a solution and a rival: residuals of unknown noise, two per
/// shot, and parameters about the sensor's.
double chi2_lead(const Answer& answer, const Answer& rival, std::size_t shots) {
  return 4.0 * static_cast<double>(shots) * std::log(rival.fit.rms / answer.fit.rms) +
         rival.fit.prior_chi2 - answer.fit.prior_chi2;
}

void sort_by_likelihood(std::vector<Answer>& answers, std::size_t shots) {
  std::erase_if(answers, [](const Answer& answer) { return !std::isfinite(answer.fit.rms); });
  std::stable_sort(answers.begin(), answers.end(), [shots](const Answer& a, const Answer& b) {
    return chi2_lead(a, b, shots) > 0;
  });
}

/// Best solutions of all trials, best first; solutions that differ only in the last digits once.
std::vector<Answer> answers_of(const StartWindow& window, const std::vector<Trial>& trials,
                               bool frame_is_free) {
  double least = std::numeric_limits<double>::infinity();
  for (const Trial& trial : trials) least = std::min(least, trial.lines.unexplained);
  std::vector<Answer> answers;
  for (const Trial& trial : trials) {
    if (trial.lines.unexplained > std::max(kHopeless * least, kSecondOrder)) continue;
    answers.emplace_back().trial = trial;
  }
  parallel::for_each(answers.size(), [&](std::size_t i) {
    answers[i] = window.answer(answers[i].trial, kEnoughShots, frame_is_free);
  });
  sort_by_likelihood(answers, window.size(kEnoughShots));
  return answers;
}

/// Whether two solutions agree in rotors and image.
bool same_answer(const Answer& a, const Answer& b, double resolved) {
  if (a.trial.hypothesis != b.trial.hypothesis) return false;
  for (std::size_t k = 0; k < a.trial.hypothesis->sensor.angular_velocity.size(); ++k) {
    if (std::abs(a.fit.knot.state[3 * k + 1] - b.fit.knot.state[3 * k + 1]) > resolved) {
      return false;
    }
  }
  return true;
}

int turning_rotors(const sensors::Sensor& sensor) {
  return static_cast<int>(std::count_if(sensor.angular_velocity.begin(),
                                        sensor.angular_velocity.end(),
                                        [](double speed) { return speed != 0; }));
}

/// States that lines are not a combination of the sensor's speeds.
[[noreturn]] void refuse_speeds(const RotorLines& found, const sensors::Sensor& sensor,
                                const std::vector<Hypothesis>& hypotheses) {
  std::vector<double> speeds;
  for (const SpectralLine& line : found.lines) speeds.push_back(line.angular_velocity);
  const std::string words =
      fmt::format("the beam turns at {} deg/s, and no combination of {}'s {} deg/s gives that",
                  speeds_text(speeds), sensor.name, speeds_text(sensor.angular_velocity));
  for (const Hypothesis& hypothesis : hypotheses) {
    const std::vector<double> expected = hypothesis.recorded_speeds();
    std::vector<std::size_t> order(speeds.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    do {
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (std::size_t k = 0; k < order.size(); ++k) {
        const double ratio = speeds[order[k]] / expected[k];
        low = std::min(low, ratio);
        high = std::max(high, ratio);
      }
      if (low > 0 && high < 1.01 * low) {
        throw WrongClock(fmt::format(
            "{}: {} are {:.4g} times as fast, so the time stamps are in another unit or the "
            "clock was wrong",
            words, speeds.size() == 2 ? "both" : "all", low));
      }
    } while (std::next_permutation(order.begin(), order.end()));
  }
  throw EstimationError(words +
                        ": the sensor is another one, or it moved, or the recording is mirrored");
}

/// Searches the best solution in one window.
Answer find_in_window(const StartWindow& window, const sensors::Sensor& sensor,
                      const std::vector<Hypothesis>& hypotheses, bool frame_is_free) {
  const LineSearch& search = window.search();
  std::vector<Trial> trials;
  for (const Hypothesis& h : hypotheses) {
    const std::vector<double> speeds = h.recorded_speeds();
    // A combination and the mirror image of the other have the same lines, the other way round.
    std::vector<Trial> twins;
    const Hypothesis* twin = nullptr;
    for (const Trial& trial : trials) {
      if (twin != nullptr && trial.hypothesis != twin) continue;
      auto lines = reordered(trial.lines, trial.hypothesis->recorded_speeds(), speeds);
      if (!lines) continue;
      twin = trial.hypothesis;
      twins.push_back({&h, *std::move(lines)});
    }
    trials.insert(trials.end(), twins.begin(), twins.end());
    if (twin != nullptr) continue;
    for (const RotorLines& lines : window.near(speeds)) trials.push_back({&h, lines});
  }
  std::vector<Answer> answers = answers_of(window, trials, frame_is_free);
  if (answers.empty() || answers.front().fit.rms > kGoodResidual) {
    double fastest = 0;
    for (const double speed : sensor.angular_velocity) fastest = std::max(fastest, std::abs(speed));
    std::vector<RotorLines> everywhere;
    if (turning_rotors(sensor) == 2 && sensor.prisms() == 2 && !sensor.train.layout().reflects()) {
      everywhere = search.anywhere(2.1 * fastest, kMostMinima);
    }
    std::vector<Trial> farther;
    for (const RotorLines& lines : everywhere) {
      RotorLines exchanged = lines;
      std::swap(exchanged.lines[0], exchanged.lines[1]);
      for (const Hypothesis& h : hypotheses) {
        for (const RotorLines& order : {lines, exchanged}) {
          if (speeds_fit(h, order, kFarthestShare)) farther.push_back({&h, order});
        }
      }
    }
    const std::vector<Answer> more = answers_of(window, farther, frame_is_free);
    answers.insert(answers.end(), more.begin(), more.end());
    sort_by_likelihood(answers, window.size(kEnoughShots));
    const bool better_elsewhere =
        !everywhere.empty() &&
        (answers.empty() ||
         everywhere.front().unexplained < 0.25 * answers.front().trial.lines.unexplained);
    if (better_elsewhere) refuse_speeds(everywhere.front(), sensor, hypotheses);
    if (answers.empty()) {
      throw EstimationError(
          fmt::format("no {} spectral lines near the speeds of {}, {} deg/s, describe the "
                      "directions of the beam",
                      turning_rotors(sensor), sensor.name, speeds_text(sensor.angular_velocity)));
    }
  }
  // The best solution against the best different one; more shots if it is close.
  const double resolved = kTwoPi / (2.0 * std::max(1e-3, window.start_of(answers.front()).reach));
  const auto rival = std::find_if(answers.begin() + 1, answers.end(), [&](const Answer& other) {
    return !same_answer(answers.front(), other, resolved);
  });
  if (rival != answers.end() &&
      chi2_lead(answers.front(), *rival, window.size(kEnoughShots)) < kDecisive) {
    Answer one = window.answer(answers.front().trial, kManyShots, frame_is_free);
    Answer other = window.answer(rival->trial, kManyShots, frame_is_free);
    if (chi2_lead(one, other, window.size(kManyShots)) < 0) std::swap(one, other);
    if (!same_answer(one, other, resolved)) {
      if (chi2_lead(one, other, window.size(kManyShots)) < kDecisive) {
        throw EstimationError(fmt::format(
            "undecided: {} with residuals of {:.3g} deg and {} with {:.3g} deg describe the shots "
            "equally well; more of the field of view or a longer recording would decide",
            one.trial.hypothesis->words(), degrees_from_radians(one.fit.rms),
            other.trial.hypothesis->words(), degrees_from_radians(other.fit.rms)));
      }
    }
    return one;
  }
  return answers.front();
}

Eigen::Vector3d mean_direction(const AngleSeries& series) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < series.size(); ++i) {
    const auto v = direction_from_angles<double>({series.azimuth[i], series.zenith[i]});
    sum += Eigen::Vector3d(v.x, v.y, v.z);
  }
  return sum.norm() > 0 ? sum.normalized() : Eigen::Vector3d::UnitX();
}

/// The frame whose X axis the lines turn about, to a degree or so: the constant of the fit gives
/// the offset from the axis.
Eigen::Matrix3d turned_frame(const AngleSeries& head, const sensors::Sensor& sensor,
                             const StartOptions& options, StartFindings& found) {
  const Eigen::Vector3d middle = mean_direction(head);
  const Eigen::Matrix3d train_from_sensor =
      sensor_from_train(sensor.train.layout().axis_up).transpose();
  Eigen::Matrix3d frame =  // of the train
      recording_from_sensor({std::atan2(middle.y(), middle.x()),
                             std::atan2(-middle.z(), std::hypot(middle.x(), middle.y()))});
  constexpr int kRounds = 6;
  for (int round = 0; round < kRounds; ++round) {
    const StartWindow window(head, sensor, options, frame * train_from_sensor, found);
    std::optional<RotorLines> best;
    for (const Hypothesis& h : hypotheses_of(sensor, options.mirrored)) {
      for (const RotorLines& lines : window.search().near(h.recorded_speeds(), kUsualShare, 1,
                                                          sensor.train.layout().axis_up)) {
        if (!best || lines.unexplained < best->unexplained) best = lines;
      }
    }
    if (!best) break;
    const Complex c = best->constant;
    const double size = std::abs(c);
    if (size > 0.5) break;  // no axis: the shots do not determine it
    const Eigen::Vector3d axis =
        frame * Eigen::Vector3d(std::sqrt(1.0 - size * size), c.real(), c.imag());
    frame = recording_from_sensor(
        {std::atan2(axis.y(), axis.x()), std::atan2(-axis.z(), std::hypot(axis.x(), axis.y()))});
    if (size < radians_from_degrees(0.05)) break;
  }
  return frame * train_from_sensor;
}

/// Whether a start of one is a start of the other.
bool turn_alike(const sensors::Sensor& a, const sensors::Sensor& b) {
  return a.train.face_order() == b.train.face_order() && a.train.emitters() == b.train.emitters() &&
         a.train.parameters() == b.train.parameters() && a.angular_velocity == b.angular_velocity &&
         a.combination == b.combination && a.combinations == b.combinations &&
         a.field_of_view == b.field_of_view;
}

Start new_start(const AngleSeries& head, const sensors::Sensor& sensor, const StartOptions& options,
                StartFindings& found) {
  if (turning_rotors(sensor) == 0) {
    throw InvalidArgument(fmt::format(
        "{}: the speeds of all rotors are 0 deg/s, at least one must turn", sensor.name));
  }
  check_beams(sensor.train, head.beam, head.size());
  if (head.size() > 1) {
    const double step = 1e-9 * static_cast<double>(median_step_ns(head.time_ns));
    double fastest = 0;
    for (const double speed : sensor.angular_velocity) fastest = std::max(fastest, std::abs(speed));
    if (step * fastest > 0.9 * kPi) {
      throw EstimationError(fmt::format(
          "{:.0f} shots per second are too few to follow rotors of {:.0f} deg/s, at least {:.0f} "
          "are needed",
          1.0 / step, degrees_from_radians(fastest), fastest / (0.9 * kPi)));
    }
  }
  const bool turned =
      options.turned.value_or(share_outside(head, sensor.field_of_view) > kFewOutside);
  const std::vector<Hypothesis> hypotheses = hypotheses_of(sensor, options.mirrored);
  const StartWindow window(head, sensor, options,
                           turned ? turned_frame(head, sensor, options, found)
                                  : Eigen::Matrix3d(Eigen::Matrix3d::Identity()),
                           found);
  const Answer answer = find_in_window(window, sensor, hypotheses, turned);
  Start start = window.start_of(answer);
  if (turned || options.turned || options.free.empty()) return start;
  // A small turn leaves the shots in the field of view and shows only in the residuals.
  Start free = window.start_of(window.answer(answer.trial, kEnoughShots, true));
  const TrainLayout layout = sensor.train.layout();
  const bool leans = layout.has_bearing(static_cast<std::size_t>(layout.elements) - 1);
  const double turn = std::hypot(free.frame->yaw, free.frame->pitch);
  const bool far = turn > (leans ? kMostLean : kLeastTurn);
  const double allowed = leans ? 1.0 + kTurnLoss : 1.0 - kTurnGain;
  if (far && free.residual_rms < allowed * start.residual_rms) return free;
  return start;
}

}  // namespace

Start find_start(const AngleSeries& head, const sensors::Sensor& sensor,
                 const StartOptions& options, StartFindings* found) {
  StartFindings own;
  if (found == nullptr) found = &own;
  for (const StartFindings::Known& known : found->starts) {
    if (known.options == options && turn_alike(known.sensor, sensor)) return known.start;
  }
  Start start = new_start(head, sensor, options, *found);
  found->starts.push_back({sensor, options, start});
  return start;
}

void prepare_shots(AngleSeries& series, const Start& start) {
  if (start.mirrored) mirror(series, start.train.layout().axis_up);
  if (start.frame) turn(series, recording_from_sensor(*start.frame).transpose());
}

}  // namespace risley::estimation
