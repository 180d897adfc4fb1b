// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "cloud/georeference_kernel.hpp"

#include "risley/core/matrix3.hpp"
#include "risley/core/simd.hpp"
#include "risley/core/vector3.hpp"

namespace risley::cloud::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
using Vector = Vector3<Batch>;
using Matrix = Matrix3<Batch>;
constexpr std::size_t kLanes = Batch::size;

/// The shots of one group: those from `at` on, with the last one repeated if there are fewer.
struct Group {
  std::size_t at = 0, count = kLanes;

  Batch load(const double* column) const {
    if (count == kLanes) return Batch::load_unaligned(column + at);
    alignas(64) double lanes[kLanes];
    for (std::size_t i = 0; i < kLanes; ++i) lanes[i] = column[at + (i < count ? i : count - 1)];
    return Batch::load_aligned(lanes);
  }
  Vector load(const double* const* columns) const {
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
  void store(const Vector& value, double* const* columns) const {
    store(value.x, columns[0]);
    store(value.y, columns[1]);
    store(value.z, columns[2]);
  }
  Matrix load_matrix(const double* const (&columns)[9]) const {
    Matrix result;
    for (std::size_t k = 0; k < 3; ++k) result.column[k] = load(columns + 3 * k);
    return result;
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

void follow_path(const PathArguments& a) {
  // One column at a time: all begin at nearly the same place of a page, too many for a cache's set.
  for (std::size_t k = 0; k < kPathNumbers; ++k) {
    Batch coefficients[kPathPowers];
    for (std::size_t power = 0; power < kPathPowers; ++power) {
      coefficients[power] = Batch(a.coefficients[power * kPathNumbers + k]);
    }
    const Batch origin(k < 3 ? a.origin[k] : 0.0);
    double* column = k < 3 ? a.reference[k] : a.turn[k - 3];
    for_each_group(a.shots, [&](const Group& group) {
      const Batch part = group.load(a.part);
      Batch value = coefficients[kPathPowers - 1];
      for (std::size_t power = kPathPowers - 1; power-- > 0;) {
        value = xsimd::fma(part, value, coefficients[power]);
      }
      group.store(origin + value, column);
    });
  }
}

void place_points(const PlaceArguments& a) {
  const Vector local = broadcast_vector(a.local), lever = broadcast_vector(a.poses.lever_arm);
  for_each_group(a.shots, [&](const Group& group) {
    const Matrix turn = group.load_matrix(a.poses.turn);
    const Vector arm = turn * (group.load(a.point) + lever);
    group.store(arm, a.arm);
    group.store((group.load(a.poses.reference) - local) + arm, a.place);
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

    const Matrix turn = group.load_matrix(a.poses.turn);
    const Vector x = product(a.jacobian, turn.column[0]), y = product(a.jacobian, turn.column[1]),
                 z = product(a.jacobian, turn.column[2]);
    const Vector to_map[3] = {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}};
    for (std::size_t k = 0; k < a.loadings; ++k) {
      double* const* columns = a.loading + 3 * k;
      const Vector v = group.load(columns);
      group.store(Vector{dot(to_map[0], v), dot(to_map[1], v), dot(to_map[2], v)}, columns);
    }
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
  const auto place = Matrix::from_columns(a.turn);
  const Vector reference = broadcast_vector(a.reference),
               lever = broadcast_vector(a.poses.lever_arm);
  for_each_group(a.shots, [&](const Group& group) {
    const auto [sine_azimuth, cosine_azimuth] = sin_cos(group.load(a.azimuth));
    const auto [sine_zenith, cosine_zenith] = sin_cos(group.load(a.zenith));
    const Batch range = group.load(a.range) - Batch(a.range_offset);
    const Batch across = range * sine_zenith;
    const Vector point{across * cosine_azimuth, across * sine_azimuth, range * cosine_zenith};
    const Vector from_there = group.load_matrix(a.poses.turn) * (point + lever) +
                              (group.load(a.poses.reference) - reference);
    const Vector seen = transposed_product(place, from_there) - lever;
    const Batch distance = xsimd::sqrt(dot(seen, seen));
    group.store(xsimd::atan2(seen.y, seen.x), a.stood_azimuth);
    group.store(xsimd::acos(seen.z / distance), a.stood_zenith);
    group.store(distance, a.stood_range);
  });
}

void turn_vectors(const TurnArguments& a) {
  const auto place = Matrix::from_columns(a.turn);
  for_each_group(a.shots, [&](const Group& group) {
    const Matrix turn = group.load_matrix(a.poses.turn);
    group.store(transposed_product(turn, place * group.load(a.vector)), a.vector);
  });
}

}  // namespace risley::cloud::RISLEY_KERNEL_NAMESPACE
