// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_equations.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/calibration/planar_adjustment.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/batch.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/parallel/pool.hpp"
#include "risley/trajectories/mount.hpp"

#include "calibration/eigen_vectors.hpp"
#include "calibration/flight_equations_kernel.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;

/// Most shots of a piece: some milliseconds.
constexpr std::size_t kPieceShots = 32768;
constexpr int kTwoKnots = 2 * kCorrections;

/// Some shots of one interval, in the order of their times.
struct FlightPiece {
  std::size_t interval = 0, begin = 0, end = 0;
};

std::vector<FlightPiece> pieces_of(const TrajectoryKnots& knots) {
  std::vector<FlightPiece> pieces;
  for (std::size_t i = 0; i < knots.intervals.size(); ++i) {
    const TrajectoryKnots::Interval& interval = knots.intervals[i];
    const std::size_t shots = interval.end_shot - interval.first_shot;
    const std::size_t count = std::max<std::size_t>(1, (shots + kPieceShots - 1) / kPieceShots);
    for (std::size_t part = 0; part < count; ++part) {
      pieces.push_back({i, interval.first_shot + shots * part / count,
                        interval.first_shot + shots * (part + 1) / count});
    }
  }
  return pieces;
}

void require_columns(const FlightShots& shots, const ShotPoses& poses, const PlaneOfShot& plane,
                     const FlightModel& model) {
  check_shape(model.train.shape());
  require_length("rotation_angle", shots.rotation_angle.size(), model.train.prisms());
  for (const auto& column : shots.rotation_angle) {
    require_length("rotation_angle of a prism", column.size(), shots.size());
  }
  check_beams(model.train, shots.beam, shots.size());
  require_length("time_ns", shots.time_ns.size(), shots.size());
  require_length("strip", shots.strip.size(), shots.size());
  require_length("poses", poses.pose.size(), shots.size());
  require_length("planes of the shots", plane.size(), shots.size());
  const auto planes = static_cast<std::int64_t>(model.planes.size());
  const auto wrong = std::ranges::find_if(
      plane, [&](std::int32_t p) { return p != kNoPlane && (p < 0 || p >= planes); });
  if (wrong != plane.end()) {
    throw InvalidArgument(fmt::format("plane of shot {} = {}, allowed 0 to {} and {} for none",
                                      wrong - plane.begin(), *wrong, planes - 1, kNoPlane));
  }
}

void require_knots(const FlightShots& shots, const FlightModel& model) {
  const TrajectoryKnots& knots = model.knots;
  require_length("rows of the corrections", model.corrections.rows(), kCorrections);
  require_length("corrections", model.corrections.cols(), knots.size());
  if (!model.corrections.allFinite()) {
    throw InvalidArgument("corrections contain non-finite numbers");
  }
  std::size_t shot = 0;
  for (const TrajectoryKnots::Interval& interval : knots.intervals) {
    require_place("knot of an interval", interval.knot + 1, knots.size());
    if (interval.first_shot != shot || interval.end_shot < shot ||
        interval.end_shot > shots.size() || interval.end_ns <= interval.begin_ns) {
      throw InvalidArgument("the knots belong to other shots");
    }
    shot = interval.end_shot;
  }
  require_length("shots of the knots", shot, shots.size());
}

void require_model(const FlightModel& model, const FlightWeights& weights, double pose_clock) {
  const int places = parameter_count(model.train.shape());
  for (const estimation::FreeParameter& parameter : model.free) {
    require_at_least("places of a free parameter", parameter.places.size(), 1);
    for (const int place : parameter.places) {
      if (place < 0 || place >= places) {
        throw InvalidArgument(
            fmt::format("place of {} = {}, allowed 0 to {}", parameter.name, place, places - 1));
      }
    }
  }
  for (const Eigen::Matrix3d* turn : {&model.nominal, &model.boresight}) {
    const double skewness =
        (*turn * turn->transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (!(skewness < 1e-6)) throw InvalidArgument("nominal and boresight: expected rotations");
  }
  for (Index i = 0; i < 3; ++i) require_finite("lever arm", model.lever_arm[i], "m");
  require_finite("range offset", model.range_offset, "m");
  require_finite("clock offset", model.clock_offset, "s");
  require_finite("clock offset of the poses", pose_clock, "s");
  for (const GroundPlane& plane : model.planes) {
    require_unit_length("normal of a plane", plane.normal.norm());
    for (Index i = 0; i < 3; ++i) require_finite("centre of a plane", plane.centre[i], "m");
  }
  require_above("range variance", weights.range_variance, 0, "m^2");
  require_not_below("variance of a rotation angle", weights.rotation_angle_variance, 0, "rad^2");
  for (std::size_t i = 0; i < weights.white.size(); ++i) {
    require_not_below("white noise of the poses", weights.white[i], 0, i < 3 ? "m" : "rad");
  }
  require_above("sample interval", weights.sample_interval, 0, "s");
  require_not_below("scale of the weights", weights.cauchy_scale, 0, "m");
  require_not_below("gate", weights.gate, 0);
}

void copy(const Eigen::Vector3d& from, double* to) {
  for (Index i = 0; i < 3; ++i) to[i] = from[i];
}

/// The shots of a piece, sorted by their planes. One for each thread.
class RunSorter {
 public:
  void sort(const PlaneOfShot& plane, std::size_t planes, const FlightPiece& piece) {
    count_.resize(planes, 0);
    touched_.clear();
    for (std::size_t i = piece.begin; i < piece.end; ++i) {
      if (plane[i] == kNoPlane) continue;
      if (count_[plane[i]]++ == 0) touched_.push_back(plane[i]);
    }
    std::ranges::sort(touched_);
    begin_.clear();
    std::uint32_t sum = 0;
    for (const std::int32_t p : touched_) {
      std::uint32_t& own = count_[p];
      begin_.push_back(sum);
      sum += own;
      own = begin_.back();
    }
    begin_.push_back(sum);
    order_.resize(sum);
    for (std::size_t i = piece.begin; i < piece.end; ++i) {
      if (plane[i] == kNoPlane) continue;
      order_[count_[plane[i]]++] = static_cast<std::uint32_t>(i);
    }
    for (const std::int32_t p : touched_) count_[p] = 0;
  }

  const std::vector<std::int32_t>& planes() const { return touched_; }
  const std::vector<std::uint32_t>& order() const { return order_; }
  std::vector<FlightRun> runs(const std::vector<FlightPlane>& planes) const {
    std::vector<FlightRun> runs;
    for (std::size_t r = 0; r < touched_.size(); ++r) {
      runs.push_back({begin_[r], begin_[r + 1], &planes[touched_[r]]});
    }
    return runs;
  }

 private:
  std::vector<std::uint32_t> count_;  // [planes], 0 between calls
  std::vector<std::int32_t> touched_;
  std::vector<std::uint32_t> begin_, order_;
};

/// Arguments common to all calls of the kernel.
class FlightCalls {
 public:
  FlightCalls(const FlightShots& shots, const ShotPoses& poses, const PlaneOfShot& plane,
              const FlightModel& model, const FlightWeights& weights, InstructionSet set)
      : shots_(shots),
        plane_(plane),
        model_(model),
        weights_(weights),
        kernel_(RISLEY_KERNEL_COPIES(accumulate_flight).at(set)),
        face_position_(face_positions(model.train.face_order(), model.geometry)) {
    require_columns(shots, poses, plane, model);
    require_knots(shots, model);
    require_model(model, weights, poses.clock_offset);
    if (shots.size() > 0xffffffffU) {
      throw InvalidArgument("more than 4294967295 shots: allowed fewer");
    }
    for (const GroundPlane& ground : model.planes) {
      FlightPlane& own = planes_.emplace_back();
      const auto [first, second] = tangents_of(plain(ground.normal));
      copy(ground.normal, own.normal);
      copy(eigen(first), own.tangent[0]);
      copy(eigen(second), own.tangent[1]);
      copy(ground.centre, own.centre);
    }
    place_begin_.push_back(0);
    for (const estimation::FreeParameter& parameter : model.free) {
      places_.insert(places_.end(), parameter.places.begin(), parameter.places.end());
      place_begin_.push_back(static_cast<int>(places_.size()));
    }
    for (const auto& column : shots.rotation_angle) rotation_angle_.push_back(column.data());
    FlightArguments& a = all_;
    a.parameters = model.train.parameters().data();
    a.face_order = model.train.face_order().data();
    a.prisms = model.train.layout();
    a.emitters = model.train.emitters();
    a.face_position = face_position_.data();
    a.places = places_.data();
    a.place_begin = place_begin_.data();
    a.free_count = static_cast<int>(model.free.size());
    a.drift = model.drift_about_ns.has_value();
    a.delay = model.attitude_delay;
    const Eigen::Matrix3d mount = model.nominal * model.boresight;
    for (Index i = 0; i < 9; ++i) a.body_from_sensor[i] = mount(i % 3, i / 3);
    copy(model.lever_arm, a.lever_arm);
    a.range_offset = model.range_offset;
    a.clock_step = model.clock_offset - poses.clock_offset;
    a.range_variance = weights.range_variance;
    a.rotation_angle_variance = weights.rotation_angle_variance;
    a.cauchy_scale = weights.cauchy_scale;
    a.gate = weights.gate;
    a.rotation_angle = rotation_angle_.data();
    a.range = shots.range.data();
    if (!shots.beam.empty()) a.beam = shots.beam.data();
    a.time_ns = shots.time_ns.data();
    a.pose = poses.pose.data();
  }

  int globals() const { return model_.unknowns().size(); }

  /// @param arguments  products, plane_products and rows: requested outputs
  FlightCounts call(const FlightPiece& piece, const RunSorter& sorter,
                    const std::vector<FlightRun>& runs, FlightArguments arguments) const {
    FlightArguments a = all_;
    const TrajectoryKnots::Interval& interval = model_.knots.intervals[piece.interval];
    for (Index i = 0; i < kCorrections; ++i) {
      for (Index k = 0; k < 2; ++k) {
        a.corrections[k][i] = model_.corrections(i, static_cast<Index>(interval.knot) + k);
      }
    }
    const auto length_ns = static_cast<double>(interval.end_ns - interval.begin_ns);
    a.begin_ns = interval.begin_ns;
    a.per_ns = 1 / length_ns;
    if (a.drift) a.since = 1e-9 * static_cast<double>(interval.begin_ns - *model_.drift_about_ns);
    const double part = static_cast<double>(piece.end - piece.begin) /
                        static_cast<double>(interval.end_shot - interval.first_shot);
    const double samples = std::max(1.0, length_ns * 1e-9 * part / weights_.sample_interval);
    const double together = std::max(1.0, static_cast<double>(sorter.order().size()) / samples);
    for (std::size_t i = 0; i < weights_.white.size(); ++i) {
      a.white_variance[i] = together * weights_.white[i] * weights_.white[i];
    }
    a.order = sorter.order().data();
    a.runs = runs.data();
    a.run_count = runs.size();
    a.products = arguments.products;
    a.plane_products = arguments.plane_products;
    a.rows = arguments.rows;
    return kernel_(a);
  }

  const FlightShots& shots() const { return shots_; }
  const PlaneOfShot& plane() const { return plane_; }
  const std::vector<FlightPlane>& planes() const { return planes_; }

 private:
  const FlightShots& shots_;
  const PlaneOfShot& plane_;
  const FlightModel& model_;
  const FlightWeights& weights_;
  FlightCounts (&kernel_)(const FlightArguments&);
  std::vector<double> face_position_;
  std::vector<FlightPlane> planes_;
  std::vector<int> places_, place_begin_;
  std::vector<const double*> rotation_angle_;
  FlightArguments all_;
};

/// Sums of the kernel over one piece.
struct PieceSums {
  std::vector<double> products, plane_products;
  std::vector<std::int32_t> planes;
  FlightCounts counts;
  std::size_t shots = 0;
};

}  // namespace

std::vector<std::string> unknown_names(const FlightModel& model) {
  const auto& of_mount = trajectories::mount_names();
  std::vector<std::string> names(of_mount.begin(), of_mount.end() - 1);
  names.insert(names.end(), {"range_offset_m", of_mount.back()});
  for (const estimation::FreeParameter& parameter : model.free) names.push_back(parameter.name);
  if (model.drift_about_ns) names.emplace_back("clock_drift");
  if (model.attitude_delay) names.emplace_back("attitude_delay_s");
  return names;
}

FlightEquations flight_equations(const FlightShots& shots, const ShotPoses& poses,
                                 const PlaneOfShot& plane, const FlightModel& model,
                                 const FlightWeights& weights, InstructionSet set) {
  const FlightCalls calls(shots, poses, plane, model, weights, set);
  const std::vector<FlightPiece> pieces = pieces_of(model.knots);
  const int globals = calls.globals(), main = globals + kTwoKnots + 1;
  const auto triangle = static_cast<std::size_t>(main * (main + 1) / 2);
  const auto block = static_cast<std::size_t>(kPlaneColumns * (main + kPlaneColumns));
  std::vector<PieceSums> sums(pieces.size());
  parallel::Pool<RunSorter> sorters;
  parallel::for_each(pieces.size(), [&](std::size_t i) {
    const auto taken = sorters.take();
    RunSorter& sorter = *taken;
    sorter.sort(plane, model.planes.size(), pieces[i]);
    PieceSums& own = sums[i];
    own.planes = sorter.planes();
    own.shots = sorter.order().size();
    own.products.resize(triangle);
    own.plane_products.resize(block * own.planes.size());
    FlightArguments wanted;
    wanted.products = own.products.data();
    wanted.plane_products = own.plane_products.data();
    own.counts = calls.call(pieces[i], sorter, sorter.runs(calls.planes()), wanted);
  });

  FlightEquations equations;
  equations.globals = globals;
  equations.hessian = Eigen::MatrixXd::Zero(globals, globals);
  equations.gradient = Eigen::VectorXd::Zero(globals);
  const std::size_t intervals = model.knots.intervals.size();
  equations.knot_global.assign(intervals, Eigen::MatrixXd::Zero(kTwoKnots, globals));
  equations.knot_hessian.assign(intervals, Eigen::MatrixXd::Zero(kTwoKnots, kTwoKnots));
  equations.knot_gradient.assign(intervals, Eigen::VectorXd::Zero(kTwoKnots));
  std::size_t blocks = 0;
  for (const PieceSums& own : sums) blocks += own.planes.size();
  equations.plane_blocks.reserve(blocks);
  equations.plane_products.reserve(blocks * block);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    PieceSums& own = sums[i];
    const std::size_t interval = pieces[i].interval;
    const double* entry = own.products.data();
    for (int row = 0; row < main; ++row) {
      for (int column = row; column < main; ++column, ++entry) {
        const Index r = row - globals, c = column - globals;
        if (column < globals) {
          equations.hessian(row, column) += *entry;
        } else if (row < globals) {
          if (c < kTwoKnots) {
            equations.knot_global[interval](c, row) += *entry;
          } else {
            equations.gradient[row] += *entry;
          }
        } else if (r < kTwoKnots) {
          if (c < kTwoKnots) {
            equations.knot_hessian[interval](r, c) += *entry;
          } else {
            equations.knot_gradient[interval][r] += *entry;
          }
        } else {
          equations.cost += *entry;
        }
      }
    }
    for (std::size_t k = 0; k < own.planes.size(); ++k) {
      equations.plane_blocks.push_back({static_cast<std::uint32_t>(own.planes[k]),
                                        static_cast<std::uint32_t>(interval),
                                        equations.plane_products.size() + k * block});
    }
    equations.plane_products.insert(equations.plane_products.end(), own.plane_products.begin(),
                                    own.plane_products.end());
    equations.shots += own.shots;
    equations.lost += own.counts.lost;
    equations.outliers += own.counts.outliers;
    own = {};
  }
  equations.hessian.triangularView<Eigen::StrictlyLower>() = equations.hessian.transpose();
  for (Eigen::MatrixXd& hessian : equations.knot_hessian) {
    hessian.triangularView<Eigen::StrictlyLower>() = hessian.transpose();
  }
  return equations;
}

std::size_t flight_pieces(const FlightModel& model) { return pieces_of(model.knots).size(); }

void for_each_flight_piece(
    const FlightShots& shots, const ShotPoses& poses, const PlaneOfShot& plane,
    const FlightModel& model, const FlightWeights& weights,
    const std::function<void(std::size_t piece, const FlightRows& rows)>& function,
    InstructionSet set) {
  const FlightCalls calls(shots, poses, plane, model, weights, set);
  const std::vector<FlightPiece> pieces = pieces_of(model.knots);
  const int columns = calls.globals() + kCorrections + kPlaneColumns + 3;
  parallel::Pool<RunSorter> sorters;
  parallel::for_each(pieces.size(), [&](std::size_t i) {
    const auto taken = sorters.take();
    RunSorter& sorter = *taken;
    sorter.sort(plane, model.planes.size(), pieces[i]);
    std::vector<double> values(sorter.order().size() * static_cast<std::size_t>(columns));
    FlightArguments wanted;
    wanted.rows = values.data();
    calls.call(pieces[i], sorter, sorter.runs(calls.planes()), wanted);
    function(i,
             {pieces[i].interval, pieces[i].begin, pieces[i].end, sorter.order(), columns, values});
  });
}

}  // namespace risley::calibration
