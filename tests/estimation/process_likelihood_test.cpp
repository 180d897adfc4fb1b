// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/process_likelihood.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/QR>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/sensors/preset.hpp"

#include "estimation/knot_model.hpp"

namespace risley::estimation::process_likelihood_test {

using Real = long double;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

/// How shots come: so that windows are as long as they shall be.
struct Layout {
  std::size_t knots_per_window;
  std::int64_t knot_step_ns;
  std::size_t shots_per_knot;
};

/// Shots of random slopes and residuals at linearisation states that follow no motion.
struct Problem {
  Layout layout;
  RotorTrajectory at;
  NormalEquations equations;
  Matrix rows;  ///< [2 shots][knots d], in sigmas
  Vector residuals;

  Problem(int prisms, const Layout& how, std::vector<std::size_t> stretch_windows, unsigned seed)
      : layout(how) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    at.prisms = equations.prisms = prisms;
    std::int64_t time = 0;
    for (const std::size_t windows : stretch_windows) {
      at.stretch_begin.push_back(at.size());
      time += 10'000'000'000;
      for (std::size_t i = 0; i < windows * how.knots_per_window; ++i, time += how.knot_step_ns) {
        at.time_ns.push_back(time);
        at.first_shot.push_back(at.first_shot.size() * how.shots_per_knot);
        at.last_shot.push_back(at.first_shot.back() + how.shots_per_knot);
        for (int k = 0; k < prisms; ++k) {
          at.state.push_back(1.0 + 1e-4 * normal(generator));
          at.state.push_back(0.02 * normal(generator));
          at.state.push_back(1.0 * normal(generator));
        }
      }
    }
    const auto knots = static_cast<Eigen::Index>(at.size());
    const auto shots = static_cast<Eigen::Index>(how.shots_per_knot);
    const Eigen::Index d = at.states();
    rows = Matrix::Zero(2 * knots * shots, knots * d);
    residuals.resize(rows.rows());
    for (Eigen::Index row = 0; row < rows.rows(); ++row) {
      const Eigen::Index knot = row / (2 * shots);
      const double share = static_cast<double>(row / 2 % shots) / static_cast<double>(shots);
      const double t = 1e-9 * static_cast<double>(how.knot_step_ns) * (share - 0.45);
      for (Eigen::Index k = 0; k < prisms; ++k) {
        const double slope = 1e5 * normal(generator);
        rows.row(row).segment<3>(knot * d + 3 * k) << slope, slope * t, 0.5 * slope * t * t;
      }
      residuals[row] = 2.0 * normal(generator);
    }
    const Vector gradient = rows.transpose() * residuals;
    for (const Real value : gradient) equations.gradient.push_back(static_cast<double>(value));
    for (Eigen::Index knot = 0; knot < knots; ++knot) {
      const Matrix block = rows.middleCols(knot * d, d);
      const Matrix h = block.transpose() * block;
      for (Eigen::Index k = 0; k < prisms; ++k) {
        for (Eigen::Index l = k; l < prisms; ++l) {
          const auto entry = [&](int i, int j) { return h(3 * k + i, 3 * l + j); };
          for (const Real power :
               {entry(0, 0), entry(0, 1), entry(1, 1), 2 * entry(1, 2), 4 * entry(2, 2)}) {
            equations.curvature.push_back(static_cast<double>(power));
          }
        }
      }
    }
  }
};

Matrix transition(Real dt) {
  Matrix f = Matrix::Identity(3, 3);
  f(0, 1) = f(1, 2) = dt;
  f(0, 2) = dt * dt / 2;
  return f;
}

/// Logarithm of the density of all residuals, but for a constant: one dense adjustment in long
/// double with the first states and the noise of one rotor, in their own sigmas, as unknowns; the
/// other rotors move freely from window to window.
double dense_log_likelihood(const Problem& p, int rotor, const RotorProcess& process) {
  const Eigen::Index d = p.at.states();
  const auto per_window = static_cast<Eigen::Index>(p.layout.knots_per_window);
  const Eigen::Index windows = static_cast<Eigen::Index>(p.at.size()) / per_window;
  // States of the knots as motion * unknowns + offset, as deviations from the linearisation.
  Matrix motion = Matrix::Zero(static_cast<Eigen::Index>(p.at.size()) * d, windows * d);
  Vector offset = Vector::Zero(motion.rows());
  std::size_t stretch = 0;
  Matrix window_motion = Matrix::Zero(3, windows * d);
  Vector window_state = Vector::Zero(3);  // expected
  std::size_t before = 0;
  for (Eigen::Index w = 0; w < windows; ++w) {
    const auto first_knot = static_cast<std::size_t>(w * per_window);
    const std::size_t middle = first_knot + p.layout.knots_per_window / 2;
    for (Eigen::Index k = 0; k < p.at.prisms; ++k) {
      const auto linearised = [&](std::size_t knot) {
        return Eigen::Map<const Eigen::Vector3d>(p.at.state.data() +
                                                 static_cast<Eigen::Index>(knot) * d + 3 * k)
            .cast<Real>();
      };
      const Eigen::Index own = w * d + 3 * k;
      Matrix here = Matrix::Zero(3, windows * d);
      Vector state = linearised(middle);
      if (k != rotor) {
        here.block(0, own, 3, 3) = Eigen::Matrix<Real, 3, 1>(10, 1e4, 1e7).asDiagonal();
      } else {
        if (stretch < p.at.stretch_begin.size() && p.at.stretch_begin[stretch] == first_knot) {
          ++stretch;
          here.block(0, own, 3, 3) = Eigen::Matrix<Real, 3, 1>(kFirstAngleSigma, kFirstSpeedSigma,
                                                               first_acceleration_sigma(process))
                                         .asDiagonal();
          if (process.jerk == 0) state[2] = 0;
        } else {
          const double dt = 1e-9 * static_cast<double>(p.at.time_ns[middle] - p.at.time_ns[before]);
          here = transition(dt) * window_motion;
          Matrix noise = step_noise(process, dt).cast<Real>();
          for (Eigen::Index j = 0; j < 3 && noise(j, j) > 0; ++j) {  // its Cholesky factor
            const Vector column = noise.col(j) / std::sqrt(noise(j, j));
            here.col(own + j).tail(3 - j) = column.tail(3 - j);
            noise -= column * column.transpose();
          }
          state = transition(dt) * window_state;
        }
        window_motion = here;
        window_state = state;
        before = middle;
      }
      for (std::size_t knot = first_knot; knot < first_knot + p.layout.knots_per_window; ++knot) {
        const Real dt = Real(1e-9) * static_cast<Real>(p.at.time_ns[knot] - p.at.time_ns[middle]);
        const Eigen::Index row = static_cast<Eigen::Index>(knot) * d + 3 * k;
        motion.middleRows(row, 3) = transition(dt) * here;
        offset.segment(row, 3) = transition(dt) * state - linearised(knot);
      }
    }
  }
  const Eigen::Index shots = p.rows.rows(), unknowns = motion.cols();
  Matrix rows = Matrix::Zero(shots + unknowns, unknowns);
  rows << p.rows * motion, Matrix::Identity(unknowns, unknowns);
  Vector right = Vector::Zero(rows.rows());
  right.head(shots) = p.residuals - p.rows * offset;
  const Eigen::HouseholderQR<Matrix> solver(rows);
  const Vector rest = right - rows * solver.solve(right);
  const Real log_root = solver.matrixQR().diagonal().cwiseAbs().array().log().sum();
  return static_cast<double>(-rest.squaredNorm() / 2 - log_root);
}

const std::vector<Layout>& layouts() {
  static const std::vector<Layout> all{
      {1, 10'000'000, 8},  // a knot is long enough
      {5, 2'000'000, 4},   // five make 10 ms
      {3, 10'000'000, 3},  // three have eight shots
  };
  return all;
}

const std::vector<RotorProcess>& processes() {
  static const std::vector<RotorProcess> all{
      {radians_from_degrees(1.5), 0.0, 0.0},
      {radians_from_degrees(0.01), 0.0, 0.0},
      {radians_from_degrees(200.0), 0.0, 0.0},
      {0.0, 0.0, radians_from_degrees(100.0)},
      {0.0, 0.0, radians_from_degrees(1e4)},
      {radians_from_degrees(3.0), 1e-5, radians_from_degrees(30.0)}};
  return all;
}

TEST(RotorWindows, LikelihoodsDifferAsThoseOfTheDenseAdjustment) {
  for (const int prisms : {1, 2, 3}) {
    // Other rotors are eliminated first, and are there not entirely free.
    const double tolerance = prisms == 1 ? 1e-8 : 3e-3;
    for (const Layout& layout : layouts()) {
      const Problem p(prisms, layout, {4, 1, 3}, 3);
      for (int rotor = 0; rotor < prisms; ++rotor) {
        SCOPED_TRACE(::testing::Message() << "rotor " << rotor << " of " << prisms
                                          << ", windows of " << layout.knots_per_window);
        const RotorWindows windows(p.equations, p.at, rotor);
        const double found = windows.log_likelihood(processes()[0]);
        const double dense = dense_log_likelihood(p, rotor, processes()[0]);
        for (const RotorProcess& process : processes()) {
          EXPECT_NEAR(windows.log_likelihood(process) - found,
                      dense_log_likelihood(p, rotor, process) - dense, tolerance)
              << process.acceleration << " " << process.jerk;
        }
      }
    }
  }
}

TEST(RotorWindows, AnswerForTheFirstWindowsAlone) {
  const Problem all(2, layouts()[1], {4, 3}, 5);
  Problem some = all;
  some.at.stretch_begin.pop_back();
  some.at.time_ns.resize(4 * layouts()[1].knots_per_window);
  const RotorWindows first(all.equations, all.at, 1, 4), same(some.equations, some.at, 1);
  const RotorWindows every(all.equations, all.at, 1);
  for (const RotorProcess& process : processes()) {
    EXPECT_EQ(first.log_likelihood(process), same.log_likelihood(process));
    EXPECT_NE(first.log_likelihood(process), every.log_likelihood(process));
  }
}

/// What a Mid-40 sees at 1 kHz while its rotors move, and their true motion at the knots.
struct Simulation {
  AngleSeries series;
  RotorTrajectory truth;
  NormalEquations equations;

  Simulation(const std::vector<RotorProcess>& process, double duration, unsigned seed) {
    constexpr std::int64_t kStep = 50'000, kShotSteps = 20;  // ns, steps per shot
    constexpr double kNoise = radians_from_degrees(0.01);
    const auto sensor = sensors::load_sensor("mid-40-table3");
    const auto train =
        prepare<double, 2>(parameter_array<2>(sensor.train), face_order_array<2>(sensor.train));
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    const auto steps = std::llround(duration * 1e9) / kStep;
    const double h = 1e-9 * kStep;
    std::array<double, 2> angle{0.5, 2.5}, speed{}, acceleration{};
    std::vector<double> history;
    for (std::int64_t i = 0; i < steps; ++i) {
      for (std::size_t k = 0; k < 2; ++k) {
        const double total = sensor.angular_velocity[k] + speed[k];
        history.insert(history.end(), {angle[k], total, acceleration[k]});
        const double faster =
            h * acceleration[k] + process[k].acceleration * std::sqrt(h) * normal(generator);
        angle[k] += h * (total + 0.5 * faster);
        speed[k] += faster;
        acceleration[k] += process[k].jerk * std::sqrt(h) * normal(generator);
      }
      if (i % kShotSteps != 0) continue;
      const double* now = history.data() + 6 * i;
      const auto shot = angles_from_direction(trace(train, {now[0], now[3]}).direction);
      const double azimuth = shot.azimuth + kNoise * normal(generator);
      series.append(i * kStep, azimuth, shot.zenith + kNoise * normal(generator));
    }
    const ShotRange all{0, series.size()};
    truth = make_knots(series, {&all, 1}, 2);
    for (std::size_t knot = 0; knot < truth.size(); ++knot) {
      std::copy_n(history.begin() + 6 * (truth.time_ns[knot] / kStep), 6,
                  truth.state_of(knot).begin());
    }
    accumulate(series, truth, sensor.train, {}, {equal_noise(kNoise)}, equations);
  }
};

constexpr double degrees(double value) { return radians_from_degrees(value); }

TEST(LikeliestProcess, FindsTheRandomWalkOfTheSpeeds) {
  const std::vector<RotorProcess> truth{{degrees(1.5), 0.0, 0.0}, {degrees(6.0), 0.0, 0.0}};
  const Simulation simulation(truth, 20.0, 1);
  const auto found = likeliest_process(simulation.equations, simulation.truth);
  ASSERT_EQ(found.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_LT(found[k].acceleration, 1.5 * truth[k].acceleration);
    EXPECT_GT(found[k].acceleration, truth[k].acceleration / 1.5);
    EXPECT_EQ(found[k].jerk, 0.0);
    EXPECT_EQ(found[k].angle_walk, 0.0);
  }
}

TEST(LikeliestProcess, FindsTheJerkOfRotorsThatSwingSmoothly) {
  const std::vector<RotorProcess> truth{{0.0, 0.0, degrees(100.0)}, {0.0, 0.0, degrees(400.0)}};
  const Simulation simulation(truth, 20.0, 2);
  const auto found = likeliest_process(simulation.equations, simulation.truth);
  ASSERT_EQ(found.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_LT(found[k].jerk, 2.0 * truth[k].jerk);
    EXPECT_GT(found[k].jerk, truth[k].jerk / 2.0);
    EXPECT_EQ(found[k].acceleration, 0.0);
  }
}

TEST(LikeliestProcess, IsLikelierThanItsTenthAndItsTenfold) {
  const std::vector<RotorProcess> truth{{degrees(1.5), 0.0, 0.0}, {0.0, 0.0, degrees(200.0)}};
  const Simulation simulation(truth, 10.0, 3);
  const auto found = likeliest_process(simulation.equations, simulation.truth);
  for (std::size_t k = 0; k < 2; ++k) {
    const RotorWindows windows(simulation.equations, simulation.truth, static_cast<int>(k));
    const double best = windows.log_likelihood(truth[k]);
    for (const double factor : {0.1, 10.0}) {
      const RotorProcess other{factor * truth[k].acceleration, 0.0, factor * truth[k].jerk};
      EXPECT_GT(best, windows.log_likelihood(other) + 10.0) << "rotor " << k << " x " << factor;
    }
    EXPECT_GT(windows.log_likelihood(found[k]), best - 0.5);
  }
}

// One sweep over walk and jerk ends beside the maximum: 10 to 30 below the truth, which has both.
TEST(LikeliestProcess, FindsWalkAndJerkTogether) {
  const std::vector<RotorProcess> truth{{degrees(6.0), 0.0, degrees(50.0)},
                                        {degrees(6.0), 0.0, degrees(50.0)}};
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Simulation simulation(truth, 20.0, seed);
    const auto found = likeliest_process(simulation.equations, simulation.truth);
    for (std::size_t k = 0; k < 2; ++k) {
      const RotorWindows windows(simulation.equations, simulation.truth, static_cast<int>(k));
      EXPECT_GT(windows.log_likelihood(found[k]), windows.log_likelihood(truth[k]) - 3.0);
    }
  }
}

}  // namespace risley::estimation::process_likelihood_test
