// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "cloud/georeference_kernel.hpp"

#include "risley/core/simd.hpp"
#include "risley/core/vector3.hpp"

#include "cloud/pose_lanes.hpp"

namespace risley::cloud::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
using Vector = Vector3<Batch>;
using Matrix = LaneMatrix<Batch>;
constexpr std::size_t kLanes = Batch::size;

/// The shots of one group: those from `at` on, the last one again where there are fewer.
struct Group {
  std::size_t at = 0, count = kLanes;

  Batch load(const double* column) const {
    if (count == kLanes) return Batch::load_unaligned(column + at);
    alignas(64) double lanes[kLanes];
    for (std::size_t i = 0; i < kLanes; ++i) lanes[i] = column[at + (i < count ? i : count - 1)];
    return Batch::load_aligned(lanes);
  }
  template <class Number>  // const or not
  Vector load(Number* const (&columns)[3]) const {
    return {load(columns[0]), load(columns[1]), load(columns[2])};
  }
  void store(const Batch& value, double* column) const {
    if (count == kLanes) {
      value.store_unaligned(column + at);
      return;
    }
    alignas(64) double lanes[kLanes];
    value.store_aligned(lanes);
    for (std::size_t i = 0; i < count; ++i) column[at + i] = lanes[i];
  }
  void store(const Vector& value, double* const (&columns)[3]) const {
    store(value.x, columns[0]);
    store(value.y, columns[1]);
    store(value.z, columns[2]);
  }
  /// Numbers that stand with the poses.
  Matrix matrix(const double* first, std::size_t stride) const {
    Matrix result;
    gather(first, stride, at, count, result.m);
    return result;
  }
  Vector vector(const double* first, std::size_t stride) const {
    Batch numbers[3];
    gather(first, stride, at, count, numbers);
    return {numbers[0], numbers[1], numbers[2]};
  }
};

template <class Function>
void for_each_group(std::size_t shots, Function&& function) {
  for (std::size_t at = 0; at < shots; at += kLanes) {
    function(Group{at, shots - at < kLanes ? shots - at : kLanes});
  }
}

Vector broadcast_vector(const double (&v)[3]) { return {Batch(v[0]), Batch(v[1]), Batch(v[2])}; }

/// A number times a matrix of numbers, row by row, of three rows.
Vector product(const double (&m)[9], const Vector& v) {
  return {Batch(m[0]) * v.x + Batch(m[1]) * v.y + Batch(m[2]) * v.z,
          Batch(m[3]) * v.x + Batch(m[4]) * v.y + Batch(m[5]) * v.z,
          Batch(m[6]) * v.x + Batch(m[7]) * v.y + Batch(m[8]) * v.z};
}

/// A symmetric matrix.
struct Symmetric {
  Batch xx, xy, xz, yy, yz, zz;

  Vector operator*(const Vector& v) const {
    return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z};
  }
};

/// A C A' of the rows of A.
Symmetric turned(const Vector (&rows)[3], const Symmetric& c) {
  const Vector x = c * rows[0], y = c * rows[1], z = c * rows[2];
  return {dot(rows[0], x), dot(rows[0], y), dot(rows[0], z),
          dot(rows[1], y), dot(rows[1], z), dot(rows[2], z)};
}

Symmetric load_symmetric(const Group& group, double* const (&columns)[6]) {
  return {group.load(columns[0]), group.load(columns[1]), group.load(columns[2]),
          group.load(columns[3]), group.load(columns[4]), group.load(columns[5])};
}

void store_symmetric(const Group& group, const Symmetric& c, double* const (&columns)[6]) {
  const Batch* const terms[6] = {&c.xx, &c.xy, &c.xz, &c.yy, &c.yz, &c.zz};
  for (std::size_t k = 0; k < 6; ++k) group.store(*terms[k], columns[k]);
}

Symmetric broadcast_symmetric(const double (&c)[6]) {
  return {Batch(c[0]), Batch(c[1]), Batch(c[2]), Batch(c[3]), Batch(c[4]), Batch(c[5])};
}

}  // namespace

void place_points(const PlaceArguments& a) {
  const Vector local = broadcast_vector(a.local);
  for_each_group(a.shots, [&](const Group& group) {
    const PlainPoses& poses = a.poses;
    const Matrix turn = group.matrix(poses.turn, poses.stride);
    const Vector arm = turn * group.load(a.point) + group.vector(poses.lever, poses.stride);
    group.store(arm, a.arm);
    group.store((group.vector(poses.reference, poses.stride) - local) + arm, a.place);
  });
}

void map_points(const MapArguments& a) {
  const Vector center = broadcast_vector(a.center), value = broadcast_vector(a.value);
  for_each_group(a.shots, [&](const Group& group) {
    const Vector d = group.load(a.place) - center;
    const Vector bent{dot(d, product(a.half_hessian[0], d)), dot(d, product(a.half_hessian[1], d)),
                      dot(d, product(a.half_hessian[2], d))};
    group.store(value + (product(a.jacobian, d) + bent), a.point);
    if (!a.covariance[0]) return;

    const PlainPoses& poses = a.poses;
    const Matrix turn = group.matrix(poses.turn, poses.stride);
    const Vector x = product(a.jacobian, {turn.m[0], turn.m[1], turn.m[2]}),
                 y = product(a.jacobian, {turn.m[3], turn.m[4], turn.m[5]}),
                 z = product(a.jacobian, {turn.m[6], turn.m[7], turn.m[8]});
    const Vector to_map[3] = {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}};
    if (a.own_covariance[0]) {
      store_symmetric(group, turned(to_map, load_symmetric(group, a.own_covariance)),
                      a.own_covariance);
    }
    const Symmetric turned_sensor = turned(to_map, load_symmetric(group, a.covariance));
    const Vector reach = product(a.jacobian, group.load(a.arm));
    const Batch zero(0.0);
    const Vector crossing[3] = {
        {zero, -reach.z, reach.y}, {reach.z, zero, -reach.x}, {-reach.y, reach.x, zero}};
    const Symmetric attitude = turned(crossing, broadcast_symmetric(a.turned_by));
    const Symmetric shifted = broadcast_symmetric(a.shifted);
    store_symmetric(
        group,
        {turned_sensor.xx + shifted.xx + attitude.xx, turned_sensor.xy + shifted.xy + attitude.xy,
         turned_sensor.xz + shifted.xz + attitude.xz, turned_sensor.yy + shifted.yy + attitude.yy,
         turned_sensor.yz + shifted.yz + attitude.yz, turned_sensor.zz + shifted.zz + attitude.zz},
        a.covariance);
  });
}

void stand_shots(const StandArguments& a) {
  const Matrix place(a.turn);
  const Vector reference = broadcast_vector(a.reference), lever = broadcast_vector(a.lever);
  for_each_group(a.shots, [&](const Group& group) {
    const auto [sine_azimuth, cosine_azimuth] = xsimd::sincos(group.load(a.azimuth));
    const auto [sine_zenith, cosine_zenith] = xsimd::sincos(group.load(a.zenith));
    const Batch range = group.load(a.range) - Batch(a.range_offset);
    const Batch across = range * sine_zenith;
    const PlainPoses& poses = a.poses;
    const Matrix turn = group.matrix(poses.turn, poses.stride);
    const Vector from_there =
        turn * Vector{across * cosine_azimuth, across * sine_azimuth, range * cosine_zenith} +
        (group.vector(poses.reference, poses.stride) - reference) +
        (group.vector(poses.lever, poses.stride) - lever);
    const Vector seen = place.back(from_there);
    const Batch distance = xsimd::sqrt(dot(seen, seen));
    group.store(xsimd::atan2(seen.y, seen.x), a.stood_azimuth);
    group.store(xsimd::acos(seen.z / distance), a.stood_zenith);
    group.store(distance, a.stood_range);
  });
}

void turn_vectors(const TurnArguments& a) {
  const Matrix place(a.turn);
  for_each_group(a.shots, [&](const Group& group) {
    const Matrix turn = group.matrix(a.poses.turn, a.poses.stride);
    group.store(turn.back(place * group.load(a.vector)), a.vector);
  });
}

}  // namespace risley::cloud::RISLEY_KERNEL_NAMESPACE
