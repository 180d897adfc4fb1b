// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/identification/train_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/observation_adjoint.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/optics/parameters.hpp"
#include "risley/parallel/parallel.hpp"

namespace risley::identification {
namespace {

constexpr double kLowestIndex = 1.3, kHighestIndex = 2.3;
constexpr double kTiltPrior = radians_from_degrees(0.3);
/// The largest prism in any scanner deviates by less.
constexpr double kLargestDeviation = radians_from_degrees(40);

constexpr std::size_t kChunkShots = 4096;
constexpr double kOutlierSigmas = 6;

/// One constant that is fitted. For a prism the deviation stays while the glass changes; a wedge
/// with two angles and a reflector have their angles as places.
struct Unknown {
  enum class Kind { glass, deviation, place, lag, frame_yaw, frame_pitch };
  Kind kind;
  int first = 0, last = 0;  ///< prisms, both included; the place; the emitter
  double prior_sigma = 0;   ///< about 0; 0: none
};

bool is_prism(const PrismTrain& train, int element) {
  return train.layout().kind[element] == ElementKind::prism;
}
bool has_two_angles(const PrismTrain& train, int element) {
  return train.layout().kind[element] == ElementKind::wedge;
}

std::vector<Unknown> unknowns_of(const PrismTrain& train, const TrainFreedom& freedom) {
  using Kind = Unknown::Kind;
  std::vector<Unknown> unknowns;
  const int prisms = train.prisms();
  if (freedom.glass) {
    if (freedom.one_glass) {
      unknowns.push_back({Kind::glass, 0, prisms - 1});
    } else {
      for (int k = 0; k < prisms; ++k) {
        unknowns.push_back({Kind::glass, k, k});
      }
    }
    for (int k = 0; k < prisms; ++k) {
      if (is_prism(train, k)) {
        unknowns.push_back({Kind::deviation, k, k});
        continue;
      }
      if (has_two_angles(train, k)) {
        unknowns.push_back({Kind::place, place::prism_tilt_vertical(k)});
      }
      unknowns.push_back({Kind::place, place::wedge_angle(k)});
    }
  }
  if (freedom.emitters) {
    for (int j = 0; j < train.emitters(); ++j) {
      unknowns.push_back({Kind::place, place::incident_beam_horizontal(j, prisms)});
      unknowns.push_back({Kind::place, place::incident_beam_vertical(j, prisms)});
    }
  }
  if (freedom.lags) {
    for (int j = 1; j < train.emitters(); ++j) unknowns.push_back({Kind::lag, j});
  }
  if (freedom.frame) {
    unknowns.push_back({Kind::frame_yaw});
    unknowns.push_back({Kind::frame_pitch});
  }
  if (freedom.tilts) {
    for (int k = 0; k < prisms; ++k) {
      if (!has_two_angles(train, k)) {
        unknowns.push_back({Kind::place, place::prism_tilt_vertical(k), 0, kTiltPrior});
      }
      if (k + 1 < prisms) {
        unknowns.push_back({Kind::place, place::bearing_tilt_horizontal(k), 0, kTiltPrior});
        unknowns.push_back({Kind::place, place::bearing_tilt_vertical(k), 0, kTiltPrior});
      } else {
        unknowns.push_back({Kind::place, place::prism_tilt_horizontal(k), 0, kTiltPrior});
      }
    }
  }
  return unknowns;
}

double deviation(const PrismTrain& train, int prism) {
  return (train[place::refractive_index(prism)] - 1.0) * train[place::wedge_angle(prism)];
}

void set_glass(PrismTrain& train, int prism, double index, double deviation) {
  train.set_place(place::refractive_index(prism), index);
  if (is_prism(train, prism)) train.set_place(place::wedge_angle(prism), deviation / (index - 1.0));
}

/// All prisms with the mean index, their deviations unchanged.
void make_one_glass(PrismTrain& train) {
  double index = 0;
  for (int k = 0; k < train.prisms(); ++k) {
    index += train[place::refractive_index(k)] / train.prisms();
  }
  for (int k = 0; k < train.prisms(); ++k) set_glass(train, k, index, deviation(train, k));
}

/// @return whether the values stay within possible ones
bool apply(const std::vector<Unknown>& unknowns, const Eigen::VectorXd& step, TrainModel& model) {
  using Kind = Unknown::Kind;
  PrismTrain& train = model.train;
  const int prisms = train.prisms();
  std::vector<double> index, deviations;
  for (int k = 0; k < prisms; ++k) {
    index.push_back(train[place::refractive_index(k)]);
    deviations.push_back(deviation(train, k));
  }
  double yaw = 0, pitch = 0;
  for (std::size_t u = 0; u < unknowns.size(); ++u) {
    const Unknown& unknown = unknowns[u];
    const double change = step[static_cast<Eigen::Index>(u)];
    switch (unknown.kind) {
      case Kind::glass:
        for (int k = unknown.first; k <= unknown.last; ++k) {
          double& n = index[static_cast<std::size_t>(k)];
          n = std::clamp(n + change, kLowestIndex, kHighestIndex);
        }
        break;
      case Kind::deviation:
        deviations[static_cast<std::size_t>(unknown.first)] += change;
        break;
      case Kind::place:
        train.set_place(unknown.first, train[unknown.first] + change);
        break;
      case Kind::lag:
        model.lag[static_cast<std::size_t>(unknown.first)] += change;
        break;
      case Kind::frame_yaw:
        yaw = change;
        break;
      case Kind::frame_pitch:
        pitch = change;
        break;
    }
  }
  for (int k = 0; k < prisms; ++k) {
    const auto at = static_cast<std::size_t>(k);
    if (is_prism(train, k) && !(std::abs(deviations[at]) < kLargestDeviation)) return false;
    set_glass(train, k, index[at], deviations[at]);
  }
  if (yaw != 0 || pitch != 0) {
    const bool up = train.layout().axis_up;
    model.frame =
        estimation::turn_of(estimation::turned_further(
                                estimation::recording_from_sensor(model.frame), {yaw, pitch}, up),
                            up);
  }
  return true;
}

/// The normal equations of a fit: constants, then the coefficients of the first rotor's curve and
/// so on.
struct NormalEquations {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
};

class TrainEquations {
 public:
  TrainEquations(const ShotGrid& grid, const TrainModel& start, const TrainFreedom& freedom)
      : grid_(grid), unknowns_(unknowns_of(start.train, freedom)), used_(grid.size(), 1) {
    require_length("start.lag", start.lag.size(), static_cast<std::size_t>(grid.emitters));
    require_length("start.rotors.coefficient",
                   static_cast<std::size_t>(start.rotors.coefficient.rows()),
                   static_cast<std::size_t>(start.train.prisms()));
    std::size_t begin = 0;
    for (int segment = 0; segment < start.rotors.segments; ++segment) {
      const double until = start.rotors.begin + start.rotors.segment_length() * (segment + 1);
      std::size_t end = grid.size();
      if (segment + 1 < start.rotors.segments) {
        const auto next = std::lower_bound(grid.time.begin(), grid.time.end(), until);
        end = static_cast<std::size_t>(next - grid.time.begin());
      }
      for (std::size_t i = begin; i < end; i += kChunkShots) {
        chunks_.push_back({segment, i, std::min(i + kChunkShots, end)});
      }
      begin = end;
    }
  }

  const std::vector<Unknown>& unknowns() const { return unknowns_; }
  std::size_t count_used() const {
    return static_cast<std::size_t>(std::count(used_.begin(), used_.end(), 1));
  }

  /// Sum of squares of the used shots, priors included. @param[out] azimuth, zenith  residuals, if
  /// not null
  double cost(const TrainModel& model, std::vector<double>* azimuth = nullptr,
              std::vector<double>* zenith = nullptr) const {
    return with_layout(model.train.layout(),
                       [&]<TrainLayout N>() { return sweep<N>(model, nullptr, azimuth, zenith); });
  }
  double linearise(const TrainModel& model, NormalEquations& equations) const {
    return with_layout(model.train.layout(), [&]<TrainLayout N>() {
      return sweep<N>(model, &equations, nullptr, nullptr);
    });
  }
  /// Priors weigh as if the shots had this variance.
  void set_variance(double variance) { variance_ = variance; }

  /// Leaves out shots beyond a limit. @return how many
  std::size_t leave_out(const std::vector<double>& azimuth, const std::vector<double>& zenith,
                        double limit) {
    std::size_t outliers = 0;
    for (std::size_t i = 0; i < azimuth.size(); ++i) {
      used_[i] = std::max(std::abs(azimuth[i]), std::abs(zenith[i])) <= limit ? 1 : 0;
      if (used_[i] == 0) ++outliers;
    }
    return outliers;
  }

 private:
  template <TrainLayout N>
  double sweep(const TrainModel& model, NormalEquations* equations, std::vector<double>* azimuth,
               std::vector<double>* zenith) const {
    const int emitters = model.train.emitters();
    std::vector<PreparedTrain<double, N>> trains;
    std::vector<PreparedDerivatives<double, N>> derivatives;
    const auto faces = face_order_array<N>(model.train);
    for (int j = 0; j < emitters; ++j) {
      const auto parameters = parameter_array<N>(model.train, j);
      trains.push_back(prepare<double, N>(parameters, faces));
      if (equations != nullptr) {
        derivatives.push_back(prepare_derivatives<double, N>(parameters, faces));
      }
    }
    const auto constants = static_cast<Eigen::Index>(unknowns_.size());
    const RotorCurves& rotors = model.rotors;
    const Eigen::Index terms = rotors.degree + 1;
    const Eigen::Index local = constants + N * terms;
    if (azimuth != nullptr) azimuth->assign(grid_.size(), 0.0);
    if (zenith != nullptr) zenith->assign(grid_.size(), 0.0);
    const bool turned = model.frame.yaw != 0 || model.frame.pitch != 0;
    const Eigen::Matrix3d back = estimation::recording_from_sensor(model.frame).transpose();
    // The sums of the chunks are added in order: the same numbers for any number of threads.
    struct Sums {
      double squares = 0;
      Eigen::MatrixXd normal;
      Eigen::VectorXd right;
    };
    std::vector<Sums> sums(chunks_.size());
    const auto work = [&](std::size_t c) {
      const Chunk& chunk = chunks_[c];
      Sums& sum = sums[c];
      const int first = rotors.first_coefficient(chunk.segment);
      Eigen::MatrixXd rows;
      if (equations != nullptr) {
        rows.resize(local, 2);
        sum.normal = Eigen::MatrixXd::Zero(local, local);
        sum.right = Eigen::VectorXd::Zero(local);
      }
      for (std::size_t i = chunk.begin; i < chunk.end; ++i) {
        const std::size_t j = grid_.emitter[i];
        const CurveWeights weights =
            curve_weights(rotors, chunk.segment, grid_.time[i] + model.lag[j]);
        RotationAngles<double, N> angles;
        std::array<double, N> speeds;
        for (int k = 0; k < N; ++k) {
          const auto at = static_cast<std::size_t>(k);
          angles[at] = speeds[at] = 0;
          for (int m = 0; m <= rotors.degree; ++m) {
            const double coefficient = rotors.coefficient(k, first + m);
            angles[at] += weights.value[static_cast<std::size_t>(m)] * coefficient;
            speeds[at] += weights.rate[static_cast<std::size_t>(m)] * coefficient;
          }
        }
        SphericalAngles<double> seen{grid_.azimuth[i], grid_.zenith[i]};
        if (turned) {
          const auto v = direction_from_angles(seen);
          const Eigen::Vector3d u = back * Eigen::Vector3d(v.x, v.y, v.z);
          seen = angles_from_direction(Vector3<double>{u.x(), u.y(), u.z()});
        }
        Eigen::Vector2d left;
        if (equations == nullptr) {
          const Beam<double> beam = trace<double, N>(trains[j], angles);
          if (!beam.valid) {
            sum.squares = std::numeric_limits<double>::infinity();
            return;
          }
          const auto said = angles_from_direction(beam.direction);
          left = {wrap_to_pi(seen.azimuth - said.azimuth), seen.zenith - said.zenith};
        } else {
          if (used_[i] == 0) continue;
          auto shot = linearise_angles<double, N>(trains[j], derivatives[j], angles);
          if (!shot.valid) {
            sum.squares = std::numeric_limits<double>::infinity();
            return;
          }
          add_turn_derivatives(shot);
          left = {wrap_to_pi(seen.azimuth - shot.angles.azimuth), seen.zenith - shot.angles.zenith};
          const int emitter = static_cast<int>(j);
          fill<N>(shot.azimuth, model.train, emitter, speeds, weights, rotors.degree, rows.col(0));
          fill<N>(shot.zenith, model.train, emitter, speeds, weights, rotors.degree, rows.col(1));
          sum.normal.template selfadjointView<Eigen::Lower>().rankUpdate(rows);
          sum.right.noalias() += rows * left;
        }
        if (azimuth != nullptr) (*azimuth)[i] = left[0];
        if (zenith != nullptr) (*zenith)[i] = left[1];
        if (used_[i] != 0) sum.squares += left.squaredNorm();
      }
    };
    if (chunks_.size() > 1 && grid_.size() > 4 * kChunkShots) {
      parallel::for_each(chunks_.size(), work);
    } else {
      for (std::size_t c = 0; c < chunks_.size(); ++c) work(c);
    }
    double sum = 0;
    if (equations != nullptr) {
      const Eigen::Index all = constants + N * rotors.coefficients();
      equations->normal = Eigen::MatrixXd::Zero(all, all);
      equations->right = Eigen::VectorXd::Zero(all);
    }
    for (std::size_t c = 0; c < chunks_.size(); ++c) {
      sum += sums[c].squares;
      if (equations == nullptr || !std::isfinite(sums[c].squares)) continue;
      sums[c].normal.template triangularView<Eigen::StrictlyUpper>() = sums[c].normal.transpose();
      const auto place = [&](Eigen::Index block) {
        return constants + block * rotors.coefficients() +
               rotors.first_coefficient(chunks_[c].segment);
      };
      Eigen::MatrixXd& normal = equations->normal;
      normal.topLeftCorner(constants, constants) +=
          sums[c].normal.topLeftCorner(constants, constants);
      equations->right.head(constants) += sums[c].right.head(constants);
      for (Eigen::Index a = 0; a < N; ++a) {
        const Eigen::Index from = constants + a * terms;
        normal.block(place(a), 0, terms, constants) +=
            sums[c].normal.block(from, 0, terms, constants);
        normal.block(0, place(a), constants, terms) +=
            sums[c].normal.block(0, from, constants, terms);
        equations->right.segment(place(a), terms) += sums[c].right.segment(from, terms);
        for (Eigen::Index b = 0; b < N; ++b) {
          normal.block(place(a), place(b), terms, terms) +=
              sums[c].normal.block(from, constants + b * terms, terms, terms);
        }
      }
    }
    for (Eigen::Index u = 0; u < constants; ++u) {
      const Unknown& unknown = unknowns_[static_cast<std::size_t>(u)];
      if (unknown.prior_sigma <= 0) continue;
      const double weight = variance_ / (unknown.prior_sigma * unknown.prior_sigma);
      const double value = model.train[unknown.first];
      sum += weight * value * value;
      if (equations != nullptr) {
        equations->normal(u, u) += weight;
        equations->right[u] -= weight * value;
      }
    }
    return sum;
  }

  /// One row of the design matrix: derivatives of one shot's angle by constants and motion.
  template <TrainLayout N, class Column>
  void fill(const Gradient<double, N>& gradient, const PrismTrain& train, int emitter,
            const std::array<double, N>& speeds, const CurveWeights& weights, int degree,
            Column&& row) const {
    using Kind = Unknown::Kind;
    const auto by = [&](int at) { return gradient.parameters[static_cast<std::size_t>(at)]; };
    Eigen::Index u = 0;
    for (const Unknown& unknown : unknowns_) {
      double value = 0;
      switch (unknown.kind) {
        case Kind::glass:
          for (int k = unknown.first; k <= unknown.last; ++k) {
            double one = by(place::refractive_index(k));
            if (is_prism(train, k)) {
              const double over = 1.0 / (train[place::refractive_index(k)] - 1.0);
              one -= by(place::wedge_angle(k)) * train[place::wedge_angle(k)] * over;
            }
            value += one;
          }
          break;
        case Kind::deviation:
          value = by(place::wedge_angle(unknown.first)) /
                  (train[place::refractive_index(unknown.first)] - 1.0);
          break;
        case Kind::place:
          value = derivative_by<double, N>(gradient, unknown.first, emitter);
          break;
        case Kind::lag:
          if (unknown.first == emitter) {
            for (std::size_t k = 0; k < N; ++k) value += gradient.rotation_angles[k] * speeds[k];
          }
          break;
        case Kind::frame_yaw:
          value = by(place::frame_yaw(N));
          break;
        case Kind::frame_pitch:
          value = by(place::frame_pitch(N));
          break;
      }
      row[u++] = value;
    }
    for (std::size_t k = 0; k < N; ++k) {
      for (int m = 0; m <= degree; ++m) {
        row[u++] = gradient.rotation_angles[k] * weights.value[static_cast<std::size_t>(m)];
      }
    }
  }

  const ShotGrid& grid_;
  std::vector<Unknown> unknowns_;
  std::vector<unsigned char> used_;
  /// Shots of one segment.
  struct Chunk {
    int segment = 0;
    std::size_t begin = 0, end = 0;  // rows
  };
  std::vector<Chunk> chunks_;
  double variance_ = 0;
};

bool moved(const std::vector<Unknown>& unknowns, const Eigen::VectorXd& step,
           const TrainModel& from, TrainModel& to) {
  to = from;
  const auto constants = static_cast<Eigen::Index>(unknowns.size());
  if (!step.allFinite() || !apply(unknowns, step.head(constants), to)) return false;
  Eigen::MatrixXd& coefficient = to.rotors.coefficient;
  for (Eigen::Index k = 0; k < coefficient.rows(); ++k) {
    coefficient.row(k) +=
        step.segment(constants + k * coefficient.cols(), coefficient.cols()).transpose();
  }
  return true;
}

/// A wedge of opposite sign is one turned by half a turn.
void make_wedges_positive(TrainModel& model) {
  for (int k = 0; k < model.train.prisms(); ++k) {
    const int at = place::wedge_angle(k);
    if (model.train[at] >= 0) continue;
    model.train.set_place(at, -model.train[at]);
    if (has_two_angles(model.train, k)) {
      const int first = place::prism_tilt_vertical(k);
      model.train.set_place(first, -model.train[first]);
    }
    RotorCurves half_turn = model.rotors;  // weights of a smooth curve sum to one
    for (int m = 0; m < half_turn.coefficients(); ++m) {
      if (half_turn.smooth || m % (half_turn.degree + 1) == 0) {
        model.rotors.coefficient(k, m) += kPi;
      }
    }
  }
}

/// The covariance of named values from that of the unknowns.
void add_covariance(const NormalEquations& equations, const std::vector<Unknown>& unknowns,
                    double variance, TrainFit& fit) {
  using Kind = Unknown::Kind;
  const TrainModel& model = fit.model;
  const PrismTrain& train = model.train;
  const auto constants = static_cast<Eigen::Index>(unknowns.size());
  const Eigen::MatrixXd& normal = equations.normal;
  std::vector<Eigen::VectorXd> rows;
  const auto add = [&](std::string name, const Eigen::VectorXd& row) {
    fit.names.push_back(std::move(name));
    rows.push_back(row);
  };
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(normal.rows());
  std::vector<Eigen::VectorXd> by_index(static_cast<std::size_t>(train.prisms()), none);
  std::vector<Eigen::VectorXd> by_deviation = by_index;
  for (Eigen::Index u = 0; u < constants; ++u) {
    const Unknown& unknown = unknowns[static_cast<std::size_t>(u)];
    if (unknown.kind == Kind::glass) {
      for (int k = unknown.first; k <= unknown.last; ++k) {
        by_index[static_cast<std::size_t>(k)][u] = 1;
      }
    }
    if (unknown.kind == Kind::deviation)
      by_deviation[static_cast<std::size_t>(unknown.first)][u] = 1;
  }
  for (int k = 0; k < train.prisms(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    if (by_index[at].isZero()) continue;
    add(fmt::format("refractive_index_{}", prism_letter(k)), by_index[at]);
    if (!is_prism(train, k)) continue;
    const double over = 1.0 / (train[place::refractive_index(k)] - 1.0);
    add(fmt::format("wedge_angle_{}_deg", prism_letter(k)),
        over * by_deviation[at] - train[place::wedge_angle(k)] * over * by_index[at]);
  }
  const auto& list = parameter_list(train.shape());
  const auto [first_turn, second_turn] = estimation::turn_names(train.layout().axis_up);
  for (Eigen::Index u = 0; u < constants; ++u) {
    const Unknown& unknown = unknowns[static_cast<std::size_t>(u)];
    Eigen::VectorXd row = none;
    row[u] = 1;
    if (unknown.kind == Kind::place) {
      const auto info = std::find_if(list.begin(), list.end(), [&](const ParameterInfo& one) {
        return one.kind == ParameterKind::train && one.places == std::vector<int>{unknown.first};
      });
      add(info->name, row);
    } else if (unknown.kind == Kind::lag) {
      add(fmt::format("lag_{}_s", unknown.first + 1), row);
    } else if (unknown.kind == Kind::frame_yaw) {
      add("frame_" + first_turn + "_deg", row);
    } else if (unknown.kind == Kind::frame_pitch) {
      add("frame_" + second_turn + "_deg", row);
    }
  }
  const RotorCurves& rotors = model.rotors;
  const double length = rotors.end - rotors.begin;
  for (int k = 0; k < train.prisms(); ++k) {
    const auto angle_at = [&](double time) {
      Eigen::VectorXd row = none;
      const int segment = rotors.segment_of(time);
      const CurveWeights weights = curve_weights(rotors, segment, time);
      for (int m = 0; m <= rotors.degree; ++m) {
        row[constants + k * rotors.coefficients() + rotors.first_coefficient(segment) + m] =
            weights.value[static_cast<std::size_t>(m)];
      }
      return row;
    };
    const Eigen::VectorXd first = angle_at(rotors.begin), last = angle_at(rotors.end);
    add(fmt::format("rotation_angle_{}_deg", prism_letter(k)), first);
    add(fmt::format("angular_velocity_{}_deg_per_s", prism_letter(k)), (last - first) / length);
  }
  Eigen::MatrixXd to(static_cast<Eigen::Index>(rows.size()), normal.rows());
  for (std::size_t r = 0; r < rows.size(); ++r) to.row(static_cast<Eigen::Index>(r)) = rows[r];
  fit.covariance = variance * algebra::covariance_of(normal, to);
}

}  // namespace

double outlier_limit(const TrainFit& fit) {
  std::vector<double> size;
  for (std::size_t i = 0; i < fit.azimuth_residual.size(); ++i) {
    size.push_back(std::max(std::abs(fit.azimuth_residual[i]), std::abs(fit.zenith_residual[i])));
  }
  // Of the larger of two normal values the median is 1.05 and this quantile 2.24 sigmas.
  return std::max(kOutlierSigmas / 1.05 * quantile(size, 0.5),
                  kOutlierSigmas / 2.24 * quantile(size, 0.95));
}

double mean_square(const TrainFit& fit, double limit) {
  double sum = 0;
  for (const auto* residual : {&fit.azimuth_residual, &fit.zenith_residual}) {
    for (const double value : *residual) sum += std::min(value * value, limit * limit);
  }
  return sum / (2.0 * static_cast<double>(fit.azimuth_residual.size()));
}

TrainFit fit_train(const ShotGrid& grid, const TrainModel& start, const TrainFreedom& freedom,
                   const TrainFitOptions& options, const Progress& progress) {
  TrainEquations fit(grid, start, freedom);
  TrainFit result;
  result.model = start;
  if (freedom.glass && freedom.one_glass) make_one_glass(result.model.train);
  const auto angles_of = [&] { return 2.0 * static_cast<double>(fit.count_used()); };
  double cost = fit.cost(result.model);
  if (!std::isfinite(cost)) {
    result.rms = std::numeric_limits<double>::infinity();
    return result;
  }
  NormalEquations equations;
  const int rounds = options.without_outliers ? 2 : 1;
  for (int round = 0; round < rounds; ++round) {
    if (round > 0) {
      fit.cost(result.model, &result.azimuth_residual, &result.zenith_residual);
      result.outliers =
          fit.leave_out(result.azimuth_residual, result.zenith_residual, outlier_limit(result));
      if (result.outliers == 0) break;
      cost = fit.cost(result.model);
    }
    double damping = 1e-4;
    bool fresh = false;
    for (int iteration = 0; iteration < options.iterations; ++iteration) {
      progress.check();
      if (!fresh) {
        fit.set_variance(cost / angles_of());
        cost = fit.linearise(result.model, equations);
        fresh = true;
      }
      TrainModel trial;
      double trial_cost = std::numeric_limits<double>::infinity();
      const Eigen::VectorXd step =
          algebra::SymmetricSolver(equations.normal, damping).solve(equations.right);
      if (moved(fit.unknowns(), step, result.model, trial)) {
        trial_cost = fit.cost(trial);
      }
      if (!(trial_cost < cost)) {
        // If not even the smallest step helps, this is the minimum.
        if (damping > 1e6) break;
        damping *= damping < 1e-6 ? 1e3 : 10;
        continue;
      }
      const double gained = (cost - trial_cost) / cost;
      result.model = std::move(trial);
      cost = trial_cost;
      fresh = false;
      // A damped step along a narrow valley gains little too.
      const bool flat = gained < options.tolerance && damping <= 1e-8;
      damping = std::max(damping * 0.03, 1e-12);
      if (flat) break;
    }
  }
  make_wedges_positive(result.model);
  result.shots = fit.count_used();
  result.unknowns =
      fit.unknowns().size() + static_cast<std::size_t>(result.model.rotors.coefficient.size());
  cost = fit.cost(result.model, &result.azimuth_residual, &result.zenith_residual);
  result.rms = std::sqrt(cost / angles_of());
  if (options.covariance) {
    fit.linearise(result.model, equations);
    const double freedoms = std::max(1.0, angles_of() - static_cast<double>(result.unknowns));
    add_covariance(equations, fit.unknowns(), cost / freedoms, result);
  }
  return result;
}

ShotGrid predicted(const ShotGrid& grid, const TrainModel& model) {
  ShotGrid result = grid;
  const Eigen::Matrix3d turn = estimation::recording_from_sensor(model.frame);
  std::vector<double> angles(static_cast<std::size_t>(model.train.prisms()));
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const double time = grid.time[i] + model.lag[grid.emitter[i]];
    for (int k = 0; k < model.train.prisms(); ++k) {
      angles[static_cast<std::size_t>(k)] = model.rotors.angle(k, time);
    }
    const Observation shot = observe(model.train, angles, grid.emitter[i]);
    const Eigen::Vector3d v =
        turn * Eigen::Vector3d(shot.direction.x, shot.direction.y, shot.direction.z);
    const auto said = angles_from_direction(Vector3<double>{v.x(), v.y(), v.z()});
    result.azimuth[i] = said.azimuth;
    result.zenith[i] = said.zenith;
  }
  return result;
}

}  // namespace risley::identification
