// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "calibration/flight_equations_kernel.hpp"

#include <array>

#include "risley/calibration/shot_pose.hpp"
#include "risley/core/column_products.hpp"
#include "risley/core/matrix3.hpp"
#include "risley/core/simd.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/optics/emitter_lanes.hpp"
#include "risley/optics/observation_adjoint.hpp"

namespace risley::calibration::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
using Lanes = xsimd::batch_bool<double>;
using Vector = Vector3<Batch>;
using Matrix = Matrix3<Batch>;
constexpr std::size_t kLanes = Batch::size;
constexpr double kLargest = __DBL_MAX__;
/// A beam that meets the ground at a flatter angle, as the cosine of the angle of incidence, counts
/// as parallel to it.
constexpr double kLeastFlightApproach = 0.02;
constexpr std::size_t kGroups = 16;
constexpr std::size_t kKnot = 6;

/// Rotation of a quaternion that has nearly length 1.
Matrix rotation(const Batch& w, const Batch& x, const Batch& y, const Batch& z) {
  const Batch one(1.0), s = Batch(2.0) / (w * w + x * x + y * y + z * z);
  const Batch xs = s * x, ys = s * y, zs = s * z;
  const Batch wx = w * xs, wy = w * ys, wz = w * zs, xx = x * xs, xy = x * ys, xz = x * zs;
  const Batch yy = y * ys, yz = y * zs, zz = z * zs;
  return {{{one - (yy + zz), xy + wz, xz - wy},
           {xy - wz, one - (xx + zz), yz + wx},
           {xz + wy, yz - wx, one - (xx + yy)}}};
}

Vector broadcast(const double* v) { return {Batch(v[0]), Batch(v[1]), Batch(v[2])}; }

/// One group of shots, gathered: a lane each. Lanes behind the last one repeat it.
template <TrainLayout N>
struct Gathered {
  std::array<Batch, N> rotation_angle;
  Batch range, knot_weight;  ///< of the knot behind
  Vector position, velocity, angular_velocity;
  Batch quaternion[4];
  std::uint8_t beam[kLanes];

  Gathered(const FlightArguments& a, const std::uint32_t* rows, std::size_t count) {
    alignas(64) double lanes[N + 15][kLanes];
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::size_t shot = rows[i < count ? i : count - 1];
      const ShotPose& pose = a.pose[shot];
      for (std::size_t k = 0; k < N; ++k) lanes[15 + k][i] = a.rotation_angle[k][shot];
      lanes[0][i] = a.range[shot];
      lanes[1][i] = static_cast<double>(a.time_ns[shot] - a.begin_ns) * a.per_ns;
      for (std::size_t k = 0; k < 3; ++k) {
        lanes[2 + k][i] = pose.position[k];
        lanes[5 + k][i] = static_cast<double>(pose.velocity[k]);
        lanes[8 + k][i] = static_cast<double>(pose.angular_velocity[k]);
      }
      for (std::size_t k = 0; k < 4; ++k) lanes[11 + k][i] = pose.attitude[k];
      beam[i] = a.beam == nullptr ? std::uint8_t{0} : a.beam[shot];
    }
    const auto load = [&](std::size_t column) { return Batch::load_aligned(lanes[column]); };
    for (std::size_t k = 0; k < N; ++k) rotation_angle[k] = load(15 + k);
    range = load(0);
    knot_weight = load(1);
    position = {load(2), load(3), load(4)};
    velocity = {load(5), load(6), load(7)};
    angular_velocity = {load(8), load(9), load(10)};
    for (std::size_t k = 0; k < 4; ++k) quaternion[k] = load(11 + k);
  }
};

/// Everything of a call that is the same for all shots.
template <TrainLayout N>
struct FlightConstants {
  std::uint8_t beam[kLanes] = {};
  EmitterLanes<Batch, N> emitters;
  PreparedTrain<Batch, N> train;
  PreparedDerivatives<Batch, N> derivatives;
  std::array<Batch, 2 * N> face_position;
  Matrix body_from_sensor;
  Vector lever_arm;
  Vector position_before, position_change, turn_before, turn_change;  ///< corrections
  std::size_t main, stride;  ///< columns of the products, residual included; room of a row

  explicit FlightConstants(const FlightArguments& a)
      : emitters(a.parameters, a.emitters, beam),
        lever_arm(broadcast(a.lever_arm)),
        position_before(broadcast(a.corrections[0])),
        position_change(broadcast(a.corrections[1]) - position_before),
        turn_before(broadcast(a.corrections[0] + 3)),
        turn_change(broadcast(a.corrections[1] + 3) - turn_before),
        main(static_cast<std::size_t>(a.global_count()) + 2 * kKnot + 1) {
    train = prepared_train<Batch, N>(a.parameters, a.face_order);
    derivatives = prepare_derivatives<Batch, N>(parameter_batches<Batch, N>(a.parameters),
                                                face_orders<Batch, N>(a.face_order));
    for (std::size_t i = 0; i < 2 * N; ++i) face_position[i] = Batch(a.face_position[i]);
    body_from_sensor = Matrix::from_columns(a.body_from_sensor);
  }
};

template <TrainLayout N>
constexpr std::size_t most_columns() {
  return kMountColumns + EmitterLanes<Batch, N>::kPlaces + 2 + 2 * kKnot + 1;
}

/// Lane by lane, [shots][columns].
class RowWriter {
 public:
  RowWriter(double* out, std::size_t columns, std::size_t count)
      : out_(out), columns_(columns), count_(count) {}
  void add(const Batch& value) {
    if (out_ == nullptr) return;
    alignas(64) double lanes[kLanes];
    value.store_aligned(lanes);
    for (std::size_t i = 0; i < count_; ++i) out_[i * columns_ + column_] = lanes[i];
    ++column_;
  }
  void add(const Vector& value) {
    add(value.x);
    add(value.y);
    add(value.z);
  }

 private:
  double* out_;
  std::size_t columns_, count_, column_ = 0;
};

/// Writes the row of one group: the columns of the products, padding, the plane's columns.
/// @return which lanes are unusable, and why
template <TrainLayout N>
FlightCounts fill_flight_row(const FlightArguments& a, FlightConstants<N>& c,
                             const FlightPlane& plane, const std::uint32_t* shots,
                             std::size_t count, Batch* row, Batch* plane_row, double* rows_out) {
  const Batch zero(0.0), one(1.0), half(0.5);
  const Gathered<N> shot(a, shots, count);
  if (c.emitters.several()) {
    for (std::size_t i = 0; i < kLanes; ++i) c.beam[i] = shot.beam[i];
    c.emitters.select(0, kLanes);
    c.emitters.apply(c.train);
    c.emitters.apply(c.derivatives);
  }
  const auto forward = trace_forward(c.train, shot.rotation_angle);
  const Vector& beam = forward.direction();
  const Vector origin = beam_origin(forward, c.face_position);

  // The pose: as interpolated, at the shot's own clock, corrected.
  const Batch clock_step(a.clock_step);
  const Vector position_correction = c.position_before + shot.knot_weight * c.position_change;
  const Vector turn =
      c.turn_before + shot.knot_weight * c.turn_change + clock_step * shot.angular_velocity;
  const Vector position = shot.position + position_correction + clock_step * shot.velocity;
  // exp(turn) to the fourth power of its angle, times the attitude.
  const Batch angle2 = dot(turn, turn);
  const Batch tw = one - Batch(0.125) * angle2 * (one - angle2 * Batch(1.0 / 48));
  const Vector tv = Batch(half * (one - angle2 * Batch(1.0 / 24))) * turn;
  const Batch* q = shot.quaternion;
  const Vector qv{q[1], q[2], q[3]};
  const Vector v = tw * qv + q[0] * tv + cross(tv, qv);
  const Matrix local_from_body = rotation(tw * q[0] - dot(tv, qv), v.x, v.y, v.z);

  const Vector normal = broadcast(plane.normal), centre = broadcast(plane.centre);
  const Vector arm = c.lever_arm + c.body_from_sensor * origin;  // body
  const Vector start = position + local_from_body * arm;
  const Vector direction = local_from_body * (c.body_from_sensor * beam);
  const Batch approach = dot(normal, direction);
  const Batch over_approach = one / approach;
  const Vector to_centre = centre - start;
  const Batch range = dot(normal, to_centre) * over_approach;
  const Batch residual = shot.range - Batch(a.range_offset) - range;

  // d range / d displacement of the point, map, body and sensor axes.
  const Vector by_point = Batch(-over_approach) * normal;
  const Vector by_point_body = transposed_product(local_from_body, by_point);
  const Vector by_point_sensor = transposed_product(c.body_from_sensor, by_point_body);
  const auto gradients = trace_adjoint(c.train, c.derivatives, forward,
                                       std::array<Vector, 1>{range * by_point_sensor});
  const Gradient<Batch, N>& gradient = gradients[0];
  const Vector point_sensor = origin + range * beam;
  const Vector seen = start + range * direction - position;  // the point from the body
  const Vector by_turn = cross(seen, by_point);
  const Vector by_boresight = cross(point_sensor, by_point_sensor);
  const Batch by_clock = dot(by_point, shot.velocity + cross(shot.angular_velocity, seen));

  Batch angles = zero;
  for (std::size_t k = 0; k < N; ++k) {
    angles = xsimd::fma(gradient.rotation_angles[k], gradient.rotation_angles[k], angles);
  }
  const Batch own_variance = Batch(a.range_variance) + Batch(a.rotation_angle_variance) * angles;
  const auto squared = [](const Vector& by) {
    return Vector{by.x * by.x, by.y * by.y, by.z * by.z};
  };
  const Batch variance = own_variance + dot(broadcast(a.white_variance), squared(by_point)) +
                         dot(broadcast(a.white_variance + 3), squared(by_turn));
  const Lanes met = (xsimd::abs(approach) > Batch(kLeastFlightApproach)) & (range > zero) &
                    (xsimd::abs(residual) <= Batch(kLargest)) & (variance > zero) &
                    (variance <= Batch(kLargest));
  Batch weight = one / variance;
  Lanes good = met;
  if (a.gate > 0) {
    good = good & (residual * residual <= Batch(a.gate * a.gate) * variance);
  }
  if (a.cauchy_scale > 0) {
    const Batch part = residual * Batch(1 / a.cauchy_scale);
    weight = weight / (one + part * part);
  }
  alignas(64) double used[kLanes];
  for (std::size_t i = 0; i < kLanes; ++i) used[i] = i < count ? 1.0 : 0.0;
  const Lanes present = Batch::load_aligned(used) > half;
  weight = xsimd::select(good & present, weight, zero);

  // A lost row may hold NaN: zero it separately.
  const bool all_good = xsimd::all(good);
  const Batch scale = xsimd::sqrt(weight);
  const auto put = [&](Batch*& column, const Batch& value) {
    *column++ = all_good ? scale * value : xsimd::select(good, scale * value, zero);
  };
  Batch storage[EmitterLanes<Batch, N>::kPlaces];
  const Batch* by_place = c.emitters.by_place(gradient, storage);
  RowWriter out(rows_out, static_cast<std::size_t>(a.global_count()) + kKnot + kPlaneColumns + 3,
                count);
  Batch* column = row;
  const auto put_vector = [&](const Vector& value) {
    put(column, value.x);
    put(column, value.y);
    put(column, value.z);
    out.add(value);
  };
  put_vector(by_boresight);
  put_vector(by_point_body);
  put(column, one);
  out.add(one);
  put(column, by_clock);
  out.add(by_clock);
  for (int j = 0; j < a.free_count; ++j) {
    Batch sum = by_place[a.places[a.place_begin[j]]];
    for (int i = a.place_begin[j] + 1; i < a.place_begin[j + 1]; ++i) {
      sum = sum + by_place[a.places[i]];
    }
    put(column, sum);
    out.add(sum);
  }
  if (a.drift) {
    const Batch by_drift = by_clock * (shot.knot_weight * Batch(1e-9 / a.per_ns) + Batch(a.since));
    put(column, by_drift);
    out.add(by_drift);
  }
  if (a.delay) {
    const Batch by_delay = dot(by_turn, shot.angular_velocity);
    put(column, by_delay);
    out.add(by_delay);
  }
  out.add(by_point);
  out.add(by_turn);
  const Batch knots[2] = {one - shot.knot_weight, shot.knot_weight};
  for (const Batch& knot : knots) {
    for (const Vector* part : {&by_point, &by_turn}) {
      put(column, knot * part->x);
      put(column, knot * part->y);
      put(column, knot * part->z);
    }
  }
  put(column, residual);
  const Vector from_centre = range * direction - to_centre;
  const Batch own[kPlaneColumns] = {-over_approach * dot(broadcast(plane.tangent[0]), from_centre),
                                    -over_approach * dot(broadcast(plane.tangent[1]), from_centre),
                                    over_approach};
  for (const Batch& value : own) {
    put(plane_row, value);
    out.add(value);
  }
  const Batch nan(__builtin_nan(""));
  out.add(xsimd::select(met, residual, nan));
  out.add(own_variance);
  out.add(weight);

  FlightCounts counts;
  if (!xsimd::all(met & good)) {
    const Batch mine = xsimd::select(present, one, zero);
    const double found = sum_of_lanes(xsimd::select(met, mine, zero));
    const double kept = sum_of_lanes(xsimd::select(good, mine, zero));
    counts.lost = count - static_cast<std::size_t>(found);
    counts.outliers = static_cast<std::size_t>(found - kept);
  }
  return counts;
}

/// Rows of the products and of the plane, and the sums of a plane's own.
template <TrainLayout N>
class FlightSums {
 public:
  explicit FlightSums(std::size_t main)
      : main_(main), padded_(Sums::padded(main)), stride_(padded_ + kPlaneColumns), sums_(main) {
    const Batch zero(0.0);
    for (std::size_t group = 0; group < kGroups; ++group) {
      for (std::size_t i = main; i < padded_; ++i) row(group)[i] = zero;
    }
    clear_plane();
  }

  Batch* row(std::size_t group) { return rows_ + group * stride_; }
  Batch* plane_row(std::size_t group) { return row(group) + padded_; }

  void add_main(std::size_t groups) { sums_.add(rows_, stride_, groups); }

  /// Adds the products of a plane's columns with all, of groups [begin, end).
  void add_plane(std::size_t begin, std::size_t end) {
    for (std::size_t j = 0; j < stride_; ++j) {
      if (j >= main_ && j < padded_) continue;
      Batch a = plane_[0][j], b = plane_[1][j], c = plane_[2][j];
      const Batch* at = rows_ + begin * stride_;
      for (std::size_t group = begin; group < end; ++group, at += stride_) {
        const Batch value = at[j];
        a = xsimd::fma(at[padded_], value, a);
        b = xsimd::fma(at[padded_ + 1], value, b);
        c = xsimd::fma(at[padded_ + 2], value, c);
      }
      plane_[0][j] = a;
      plane_[1][j] = b;
      plane_[2][j] = c;
    }
  }

  /// Writes [3][main + 3] and begins anew.
  void store_plane(double* out) {
    for (const auto& sums : plane_) {
      for (std::size_t j = 0; j < main_; ++j) *out++ = sum_of_lanes(sums[j]);
      for (std::size_t j = padded_; j < stride_; ++j) *out++ = sum_of_lanes(sums[j]);
    }
    clear_plane();
  }

  void store_main(double* out) const { sums_.store(out); }

 private:
  using Sums = ColumnProducts<Batch, most_columns<N>()>;
  static constexpr std::size_t kStride = Sums::padded(most_columns<N>()) + kPlaneColumns;

  void clear_plane() {
    const Batch zero(0.0);
    for (auto& sums : plane_) {
      for (std::size_t j = 0; j < stride_; ++j) sums[j] = zero;
    }
  }

  std::size_t main_, padded_, stride_;
  Sums sums_;
  Batch rows_[kGroups * kStride];
  Batch plane_[kPlaneColumns][kStride];
};

template <TrainLayout N>
FlightCounts accumulate_runs(const FlightArguments& a) {
  FlightConstants<N> constants(a);
  FlightSums<N> sums(constants.main);
  const std::size_t row_columns =
      static_cast<std::size_t>(a.global_count()) + kKnot + kPlaneColumns + 3;
  FlightCounts counts;
  std::size_t group = 0;
  double* rows = a.rows;
  for (std::size_t r = 0; r < a.run_count; ++r) {
    const FlightRun& run = a.runs[r];
    std::size_t first = group;  // of the run, of those that are not summed up yet
    for (std::size_t shot = run.begin; shot < run.end; shot += kLanes) {
      if (group == kGroups) {
        sums.add_plane(first, group);
        sums.add_main(group);
        first = group = 0;
      }
      const std::size_t count = run.end - shot < kLanes ? run.end - shot : kLanes;
      const FlightCounts own = fill_flight_row(a, constants, *run.plane, a.order + shot, count,
                                               sums.row(group), sums.plane_row(group), rows);
      counts.lost += own.lost;
      counts.outliers += own.outliers;
      if (rows != nullptr) rows += count * row_columns;
      ++group;
    }
    sums.add_plane(first, group);
    if (a.plane_products != nullptr) {
      sums.store_plane(a.plane_products + r * kPlaneColumns * (constants.main + kPlaneColumns));
    }
  }
  sums.add_main(group);
  if (a.products != nullptr) sums.store_main(a.products);
  return counts;
}

}  // namespace

FlightCounts accumulate_flight(const FlightArguments& a) {
  return with_layout(a.prisms, [&]<TrainLayout N>() { return accumulate_runs<N>(a); });
}

}  // namespace risley::calibration::RISLEY_KERNEL_NAMESPACE
