// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_forecast.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "risley/algebra/rotation_vector.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/random.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/observation_model.hpp"

#include "calibration/flight_start.hpp"
#include "calibration/judge_flight.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::uint64_t kRangeNoise = 1703;  // random stream
/// The position of the grid of cells is arbitrary; not along a strip's edge.
constexpr double kGridShift = 0.382;
/// Number of places of the ground at which points are evaluated.
constexpr std::size_t kGroundPlaces = 24;
/// A calibration subtracts twice the spurious information from noisy normals, having added it once.
constexpr double kSpuriousOfTrueNormals = 1;
constexpr double kParameterStep = 1e-6;

/// Everything needed for the equations of one flight.
struct ForecastFlight {
  FlightShots shots;
  ShotPoses poses;
  GroundCells cells;
  FlightStart start;
  FlightWeights weights;
};

/// Shots with the ranges that would be measured.
void add_noise(double variance, std::uint64_t seed, FlightShots& shots) {
  std::vector<double> noise(shots.size());
  RandomStream(seed, kRangeNoise).fill_normal(0, noise);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    shots.range[i] = std::max(shots.range[i] + std::sqrt(variance) * noise[i], 1e-3);
  }
}

void append(const FlightShots& more, FlightShots& shots) {
  const auto add = [](const auto& from, auto& to) {
    to.insert(to.end(), from.begin(), from.end());
  };
  shots.rotation_angle.resize(more.rotation_angle.size());
  for (std::size_t k = 0; k < more.rotation_angle.size(); ++k) {
    add(more.rotation_angle[k], shots.rotation_angle[k]);
  }
  add(more.beam, shots.beam);
  add(more.range, shots.range);
  add(more.time_ns, shots.time_ns);
  add(more.strip, shots.strip);
}

/// Gives cells found with noise the planes of those found without: normals that lean by chance seem
/// to determine unobservable quantities.
void take_true_planes(const GroundCells& truth, GroundCells& cells) {
  std::vector<std::vector<std::int32_t>> seen(cells.planes.size());
  for (std::size_t i = 0; i < cells.plane.size(); ++i) {
    if (cells.plane[i] == kNoPlane || truth.plane[i] == kNoPlane) continue;
    seen[cells.plane[i]].push_back(truth.plane[i]);
  }
  for (std::size_t cell = 0; cell < seen.size(); ++cell) {
    std::vector<std::int32_t>& own = seen[cell];
    if (own.empty()) continue;
    // Noise moves few points into a neighbour.
    cells.planes[cell] = truth.planes[upper_median(own)];
  }
}

/// Derivatives of a point by the unknowns of a flight: three rows of [unknowns].
struct PointRates {
  MatrixXd of_all;  ///< [3, 6 knots + globals]
  Eigen::Matrix<double, 3, kCorrections> of_pose;
  std::int64_t time_ns = 0;
};

PointRates rates_of(const ForecastFlight& work, std::size_t row) {
  const FlightModel& model = work.start.model;
  const FlightShots& shots = work.shots;
  const ShotPose& pose = work.poses.pose[row];
  const Matrix3d attitude =
      Eigen::Quaterniond(pose.attitude[0], pose.attitude[1], pose.attitude[2], pose.attitude[3])
          .toRotationMatrix();
  std::vector<double> angles;
  for (const auto& column : shots.rotation_angle) angles.push_back(column[row]);
  const int beam = shots.beam.empty() ? 0 : shots.beam[row];
  const auto direction = [&](const PrismTrain& train) {
    const Observation seen = observe(train, angles, beam);
    return Vector3d(seen.direction.x, seen.direction.y, seen.direction.z);
  };
  const Matrix3d turn = attitude * model.nominal * model.boresight;
  const Vector3d own = direction(model.train);
  const double range = shots.range[row] - model.range_offset;
  const Vector3d lever = attitude * model.lever_arm;
  const Vector3d arm = lever + turn * (range * own);  // from the reference point
  const FlightUnknowns unknowns = model.unknowns();
  const Index knots = model.knots.size();
  const Index first = kCorrections * knots;
  PointRates rates;
  rates.time_ns = shots.time_ns[row];
  rates.of_pose << Matrix3d::Identity(), -algebra::cross_matrix(arm);
  rates.of_all = MatrixXd::Zero(3, first + unknowns.size());
  // Between two knots of the strip.
  const auto behind = std::ranges::upper_bound(model.knots.time_ns, rates.time_ns);
  auto next = static_cast<std::size_t>(behind - model.knots.time_ns.begin());
  next = std::clamp<std::size_t>(next, 1, model.knots.size() - 1);
  if (model.knots.strip[next] != model.knots.strip[next - 1]) --next;  // the last shot of a strip
  next = std::max<std::size_t>(next, 1);
  const double weight =
      std::clamp(static_cast<double>(rates.time_ns - model.knots.time_ns[next - 1]) /
                     static_cast<double>(model.knots.time_ns[next] - model.knots.time_ns[next - 1]),
                 0.0, 1.0);
  const auto at = kCorrections * next;
  rates.of_all.middleCols<kCorrections>(at - kCorrections) = (1 - weight) * rates.of_pose;
  rates.of_all.middleCols<kCorrections>(at) = weight * rates.of_pose;
  auto globals = rates.of_all.rightCols(unknowns.size());
  globals.middleCols<3>(0) = -turn * algebra::cross_matrix(range * own);
  globals.middleCols<3>(3) = attitude;
  globals.col(FlightUnknowns::range_offset()) = -turn * own;
  const Vector3d velocity(static_cast<double>(pose.velocity[0]),
                          static_cast<double>(pose.velocity[1]),
                          static_cast<double>(pose.velocity[2]));
  const Vector3d spin(static_cast<double>(pose.angular_velocity[0]),
                      static_cast<double>(pose.angular_velocity[1]),
                      static_cast<double>(pose.angular_velocity[2]));
  globals.col(FlightUnknowns::clock_offset()) = velocity + spin.cross(arm);
  for (std::size_t j = 0; j < model.free.size(); ++j) {
    const auto moved = [&](double step) {
      PrismTrain train = model.train;
      for (const int place : model.free[j].places) {
        train.set_place(place, train[place] + step);
      }
      return direction(train);
    };
    globals.col(FlightUnknowns::parameter(static_cast<int>(j))) =
        turn * (range / (2 * kParameterStep) * (moved(kParameterStep) - moved(-kParameterStep)));
  }
  return rates;
}

/// Two points of one cell from different strips.
struct Place {
  std::size_t first = 0, second = 0;  // rows of the shots
};

/// Places all over the ground that several strips cover.
std::vector<Place> places_of(const ForecastFlight& work) {
  std::vector<std::vector<std::size_t>> rows(work.cells.planes.size());
  for (std::size_t i = 0; i < work.shots.size(); ++i) {
    const std::int32_t plane = work.cells.plane[i];
    if (plane == kNoPlane) continue;
    std::vector<std::size_t>& own = rows[plane];
    // The first shot of every strip in a cell.
    if (own.empty() || work.shots.strip[own.back()] != work.shots.strip[i]) own.push_back(i);
  }
  // Every cell counts equally, with its pairs of strips in turn.
  std::vector<Place> places;
  for (std::size_t k = 0; k < kGroundPlaces; ++k) {
    const std::size_t cell = (2 * k + 1) * rows.size() / (2 * kGroundPlaces);
    const std::vector<std::size_t>& own = rows[cell];
    if (own.size() < 2) continue;
    const std::size_t first = k % own.size(),
                      second = (first + 1 + k % (own.size() - 1)) % own.size();
    places.push_back({own[std::min(first, second)], own[std::max(first, second)]});
  }
  return places;
}

SharedPointErrors point_errors(const ForecastFlight& work, const FlightSystem& system) {
  SharedPointErrors result;
  const std::vector<Place> places = places_of(work);
  if (places.empty()) return result;
  std::vector<PointRates> rates;
  for (const Place& place : places) {
    rates.push_back(rates_of(work, place.first));
    rates.push_back(rates_of(work, place.second));
  }
  const Index points = rates.size();
  const Index globals = system.globals(), size = system.size();
  MatrixXd functionals(size, 3 * points);
  for (Index i = 0; i < points; ++i) {
    functionals.middleCols<3>(3 * i) = rates[i].of_all.transpose();
  }
  // Held quantities that may be wrong displace points directly and through all adjusted quantities.
  MatrixXd held_moves(3 * points, work.start.considered);
  const std::vector<bool>& held = work.start.priors.held;
  const MatrixXd changes = system.held_changes();
  Index column = 0, considered = 0;
  MatrixXd free = functionals;
  for (Index i = 0; i < globals; ++i) {
    if (!held[i]) continue;
    free.row(size - globals + i).setZero();
    if (i >= globals - static_cast<Index>(work.start.considered)) {
      held_moves.col(considered++) =
          work.start.prior_sigma[i] * (functionals.row(size - globals + i).transpose() +
                                       functionals.transpose() * changes.col(column));
    }
    ++column;
  }
  const MatrixXd after =
      flight_covariance(work.shots, work.poses, work.cells.plane, work.start.model, work.weights,
                        work.start.priors, system, free) +
      held_moves * held_moves.transpose();
  MatrixXd before(3 * points, 3 * points);
  const trajectories::ErrorProcess& process = work.start.priors.process;
  for (Index i = 0; i < points; ++i) {
    for (Index j = 0; j < points; ++j) {
      const PointRates& a = rates[i];
      const PointRates& b = rates[j];
      const VectorXd sigma_a = process.sigmas(a.time_ns), sigma_b = process.sigmas(b.time_ns);
      Eigen::Matrix<double, kCorrections, 1> common;
      for (int c = 0; c < kCorrections; ++c) {
        const auto error = static_cast<Index>(error_of(c));
        common[c] = sigma_a[error] * sigma_b[error] *
                    std::exp(-std::abs(static_cast<double>(a.time_ns - b.time_ns)) * 1e-9 /
                             process.correlation_times()[error]);
      }
      before.block<3, 3>(3 * i, 3 * j) = a.of_pose * common.asDiagonal() * b.of_pose.transpose();
    }
  }
  result.places = rates.size();
  result.pairs = places.size();
  const auto fill = [&](const MatrixXd& covariance, Vector3d& single, Vector3d& apart) {
    for (Index i = 0; i < points; ++i) single += covariance.diagonal().segment<3>(3 * i);
    for (Index i = 0; i < points; i += 2) {
      const Matrix3d difference =
          covariance.block<3, 3>(3 * i, 3 * i) + covariance.block<3, 3>(3 * i + 3, 3 * i + 3) -
          covariance.block<3, 3>(3 * i, 3 * i + 3) - covariance.block<3, 3>(3 * i + 3, 3 * i);
      apart += difference.diagonal();
    }
    single = (single / static_cast<double>(points)).cwiseMax(0).cwiseSqrt().eval();
    apart = (2 * apart / static_cast<double>(points)).cwiseMax(0).cwiseSqrt().eval();
  };
  fill(before, result.trajectory, result.strips_trajectory);
  fill(after, result.adjusted, result.strips_adjusted);
  return result;
}

}  // namespace

FlightForecast forecast(const PlannedFlight& planned, const FlightForecastOptions& options,
                        const Progress& progress) {
  const FlightCalibrationOptions& calibration = options.calibration;
  PlannedFlight own = planned;
  own.sensor = calibration.sensor;
  own.mount = calibration.mount;
  require_above("rate", options.rate, 0, "Hz");
  FlightForecast result;
  result.rate = std::min(options.rate, own.sensor.shot_rate);
  const trajectories::Flight flight = flown(own);
  result.strips = flight.strips;
  if (flight.strips.size() < 2) {
    throw EstimationError(
        "the plan has one strip: at least two that overlap are needed, and crossing ones are best");
  }
  ForecastFlight work{.shots = {},
                      .poses = {},
                      .cells = {},
                      .start = flight_start(calibration, flight.trajectory),
                      .weights = {}};
  result.strip_shots.assign(flight.strips.size(), 0);
  for_each_planned_piece(
      own, flight, {result.rate, calibration.seed},
      [&](PlannedPiece& piece) {
        result.fired += piece.fired;
        if (piece.shots.size() == 0) return;
        result.strip_shots[piece.shots.strip.front()] += piece.shots.size();
        append(piece.shots, work.shots);
      },
      progress.part(0, 0.3));
  result.shots = work.shots.size();
  if (work.shots.size() == 0) {
    throw EstimationError(
        "no shot of the plan meets the terrain within the sensor's range: do the heights of plan "
        "and terrain agree, and does the mount point the sensor the right way?");
  }
  FlightModel& model = work.start.model;
  const double variance = stated_range_variance(calibration);
  const trajectories::Interpolation local(flight.trajectory);
  work.poses = poses_of(work.shots, local, model.clock_offset);
  // Equations, and points, are made between knots.
  const auto strips = static_cast<std::size_t>(
      std::ranges::count_if(result.strip_shots, [](std::uint64_t shots) { return shots > 0; }));
  model.knots = make_knots(work.shots, calibration.knot_spacing);
  result.knot_spacing = final_knot_spacing(calibration, model.knots, strips);
  if (result.knot_spacing > calibration.knot_spacing) {
    model.knots = make_knots(work.shots, result.knot_spacing);
  }
  model.corrections = MatrixXd::Zero(kCorrections, model.knots.size());
  const ShotPoints clean = georeferenced(work.shots, work.poses, model);
  add_noise(variance, calibration.seed, work.shots);
  const ShotPoints points = georeferenced(work.shots, work.poses, model);
  GroundCellOptions cells;
  cells.size = calibration.cell_size;
  cells.shift_east = cells.shift_north = kGridShift;
  cells.most_roughness = calibration.most_roughness;
  cells.noise = ground_cells(points, work.shots.strip, cells).scatter;
  work.cells = ground_cells(points, work.shots.strip, cells);
  cells.noise = 0;
  take_true_planes(ground_cells(clean, work.shots.strip, cells), work.cells);
  result.cells = work.cells.planes.size();
  result.rough_cells = work.cells.rough;
  result.cell_size = calibration.cell_size;
  if (work.cells.planes.size() < kFewestCells) {
    throw EstimationError(
        fmt::format("only {} cells of {:g} m of ground are covered by several strips, at least {} "
                    "are needed: do the strips of the plan overlap, and are there enough shots?",
                    work.cells.planes.size(), calibration.cell_size, kFewestCells));
  }
  progress.report(0.4);
  model.planes = work.cells.planes;
  work.start.priors.held = held_globals(work.start);
  work.weights = flight_weights(calibration, work.start.priors, variance);
  work.weights.gate = kGateSigmas;
  const FlightEquations equations =
      flight_equations(work.shots, work.poses, work.cells.plane, model, work.weights);
  result.used = equations.shots - equations.lost - equations.outliers;
  progress.report(0.5);
  const FlightSystem system(equations, model, work.start.priors);
  progress.report(0.6);
  static_cast<FlightJudgement&>(result) =
      judge_flight({work.shots, work.poses, work.cells.plane, model, work.weights,
                    work.start.priors, work.start.prior_sigma, work.start.considered, system});
  progress.report(0.85);
  result.points = point_errors(work, system);
  for (std::size_t s = 0; s < result.strip_shots.size(); ++s) {
    if (result.strip_shots[s] > 0) continue;
    warn(result.warnings, kWarning.not_seen, "no shot of strip {} meets the terrain",
         result.strips[s].name);
  }
  progress.report(1);
  return result;
}

}  // namespace risley::calibration
