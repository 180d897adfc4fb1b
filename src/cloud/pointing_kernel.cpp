// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set with RISLEY_KERNEL = baseline, avx2, avx512, under the rules of
// optics/batch_kernel.cpp.
#include "cloud/pointing_kernel.hpp"

#include <array>

#include "risley/core/simd.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/optics/observation_adjoint.hpp"

#define RISLEY_JOIN2(a, b) a##b
#define RISLEY_JOIN(a, b) RISLEY_JOIN2(a, b)
#define RISLEY_KERNEL_NAMESPACE RISLEY_JOIN(kernel_, RISLEY_KERNEL)

namespace risley::cloud::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
using Lanes = xsimd::batch_bool<double>;
constexpr std::size_t kLanes = Batch::size;
static_assert(kPointPadding % kLanes == 0);

constexpr double kPi = 3.14159265358979323846;

Batch load(const double* column, std::size_t at) { return Batch::load_unaligned(column + at); }

/// Two unit vectors that are perpendicular to a direction and to each other, smooth everywhere but
/// for the sign where the beam points backwards.
std::array<Vector3<Batch>, 2> vectors_across(const Vector3<Batch>& d) {
  const Batch one(1.0);
  const Batch sign = xsimd::select(d.x >= Batch(0.0), one, Batch(-1.0));
  const Batch a = Batch(-1.0) / (sign + d.x);
  const Batch b = d.y * d.z * a;
  return {Vector3<Batch>{-sign * d.y, one + sign * d.y * d.y * a, sign * b},
          Vector3<Batch>{-d.z, b, sign + d.z * d.z * a}};
}

template <int N>
PreparedTrain<Batch, N> prepared(const double* parameters, const std::array<FaceOrder, N>& order,
                                 PreparedDerivatives<Batch, N>* derivatives) {
  std::array<Batch, parameter_count(N)> batch;
  for (std::size_t i = 0; i < parameter_count(N); ++i) batch[i] = Batch(parameters[i]);
  if (derivatives) *derivatives = prepare_derivatives<Batch, N>(batch, order);
  return prepare<Batch, N>(batch, order);
}

/// A symmetric matrix in the frame of the beam: along the two vectors across it, and along it.
struct BeamCovariance {
  Batch uu, uv, vv, ud, vd, dd;
};

/// Everything of a call that is the same for all shots.
template <int N>
class Kernel {
 public:
  static constexpr std::size_t kFaces = 2 * N;

  explicit Kernel(const PointArguments& a) : a_(a) {
    std::array<FaceOrder, N> order;
    __builtin_memcpy(&order, a.face_order, sizeof(order));
    train_ = prepared<N>(a.parameters, order, &derivatives_);
    believed_ = prepared<N>(a.believed_parameters, order, nullptr);
    for (std::size_t i = 0; i < parameter_count(N); ++i) {
      same_ = same_ && a.parameters[i] == a.believed_parameters[i];
    }
    for (std::size_t i = 0; i < kFaces; ++i) face_position_[i] = Batch(a.face_position[i]);
  }

  /// Shots [at, at + kLanes).
  void compute(std::size_t at) const {
    std::array<Batch, N> angles;
    for (std::size_t k = 0; k < N; ++k) angles[k] = load(a_.rotation_angle[k], at);
    const auto forward = trace_forward(train_, angles);
    const auto path = beam_path(forward, face_position_);
    const Batch azimuth = load(a_.azimuth, at), zenith = load(a_.zenith, at);

    Vector3<Batch> direction = forward.direction();
    std::array<Vector3<Batch>, 2> across;
    if (a_.reported_directions) {
      const auto [sin_a, cos_a] = sin_cos(azimuth);
      const auto [sin_z, cos_z] = sin_cos(zenith);
      direction = {sin_z * cos_a, sin_z * sin_a, cos_z};
      across = {Vector3<Batch>{-sin_a, cos_a, Batch(0.0)},
                Vector3<Batch>{cos_z * cos_a, cos_z * sin_a, -sin_z}};
    } else {
      across = vectors_across(direction);
    }
    const Batch range = load(a_.range, at) - Batch(a_.range_offset);
    const Vector3<Batch> point = path.origin() + range * direction;
    point.x.store_unaligned(a_.point[0] + at);
    point.y.store_unaligned(a_.point[1] + at);
    point.z.store_unaligned(a_.point[2] + at);
    range.store_unaligned(a_.corrected_range + at);

    const Vector3<Batch> normal{load(a_.surface_normal[0], at), load(a_.surface_normal[1], at),
                                load(a_.surface_normal[2], at)};
    const Batch cosine = xsimd::min(xsimd::abs(dot(normal, direction)), Batch(1.0));
    const Batch sine = xsimd::sqrt(Batch(1.0) - cosine * cosine);
    if (a_.incidence) {
      const Batch incidence = xsimd::atan2(sine, cosine);
      // The comparison is false for NaN, which atan2 need not hand on.
      xsimd::select(normal.x == normal.x, incidence, Batch(__builtin_nan("")))
          .store_unaligned(a_.incidence + at);
    }
    if (a_.azimuth_residual) store_residuals(at, angles, forward.direction(), azimuth, zenith);
    if (!a_.covariance[0]) return;

    const auto jacobian =
        linearise_point(train_, derivatives_, forward, path, face_position_, across, range);
    BeamCovariance own = own_covariance(at, jacobian, range);
    own.dd = own.dd + range_noise(at, range, cosine, sine);
    add_factors(at, jacobian, across, direction, own);
    store_covariance(at, across, direction, own);
  }

 private:
  void store_residuals(std::size_t at, const std::array<Batch, N>& angles,
                       const Vector3<Batch>& direction, const Batch& azimuth,
                       const Batch& zenith) const {
    const Vector3<Batch> believed = same_ ? direction : trace(believed_, angles).direction;
    const auto modelled = angles_from_direction(believed);
    const Batch turn(2.0 * kPi), half(kPi);
    Batch difference = azimuth - modelled.azimuth;
    difference = xsimd::select(difference > half, difference - turn, difference);
    difference = xsimd::select(difference < -half, difference + turn, difference);
    difference.store_unaligned(a_.azimuth_residual + at);
    (zenith - modelled.zenith).store_unaligned(a_.zenith_residual + at);
  }

  /// What is independent from shot to shot, the range's noise aside.
  BeamCovariance own_covariance(std::size_t at, const PointLinearisation<Batch, N>& jacobian,
                                const Batch& range) const {
    const Batch zero(0.0);
    BeamCovariance c{zero, zero, zero, zero, zero, zero};
    const auto& u = jacobian.across[0];
    const auto& v = jacobian.across[1];
    if (a_.reported_directions) {
      const auto [sin_z, cos_z] = sin_cos(load(a_.zenith, at));
      const Batch across = range * sin_z;
      const Batch noise(a_.angle_noise_variance);
      c.uu = across * across * (noise + load(a_.azimuth_variance, at));
      c.vv = range * range * (noise + load(a_.zenith_variance, at));
    } else {
      std::size_t pair = 0;
      for (std::size_t k = 0; k < N; ++k) {
        for (std::size_t l = k; l < N; ++l) {
          const Batch covariance = load(a_.angle_covariance[pair++], at);
          const Batch &uk = u.rotation_angles[k], &ul = u.rotation_angles[l];
          const Batch &vk = v.rotation_angles[k], &vl = v.rotation_angles[l];
          const Batch twice = k == l ? covariance : covariance + covariance;
          c.uu = xsimd::fma(uk * ul, twice, c.uu);
          c.vv = xsimd::fma(vk * vl, twice, c.vv);
          const Batch mixed = k == l ? uk * vk : uk * vl + ul * vk;
          c.uv = xsimd::fma(mixed, covariance, c.uv);
        }
      }
    }
    // The footprint is what the beam's spread before the prisms becomes behind them.
    const Batch h(a_.divergence_variance_horizontal), w(a_.divergence_variance_vertical);
    const Batch uh = u.parameters[place::incident_beam_horizontal()];
    const Batch uw = u.parameters[place::incident_beam_vertical()];
    const Batch vh = v.parameters[place::incident_beam_horizontal()];
    const Batch vw = v.parameters[place::incident_beam_vertical()];
    c.uu = c.uu + uh * uh * h + uw * uw * w;
    c.uv = c.uv + uh * vh * h + uw * vw * w;
    c.vv = c.vv + vh * vh * h + vw * vw * w;
    return c;
  }

  Batch range_noise(std::size_t at, const Batch& range, const Batch& cosine,
                    const Batch& sine) const {
    Batch variance = Batch(a_.range_variance) + load(a_.rounding_variance, at) +
                     range * range * Batch(a_.range_variance_per_range2);
    if (a_.range_variance_incidence != 0) {
      const Batch tangent = sine / cosine;
      const Batch part = tangent * tangent * Batch(a_.range_variance_incidence);
      variance = variance + xsimd::select(part == part, part, Batch(0.0));
    }
    if (a_.range_variance_weak_return != 0) {
      variance = variance + Batch(a_.range_variance_weak_return) /
                                xsimd::max(load(a_.intensity, at), Batch(1.0));
    }
    return variance;
  }

  /// Adds the common factors' covariance and stores their loadings.
  void add_factors(std::size_t at, const PointLinearisation<Batch, N>& jacobian,
                   const std::array<Vector3<Batch>, 2>& across, const Vector3<Batch>& direction,
                   BeamCovariance& c) const {
    constexpr std::size_t kMostRows = parameter_count(N) + N + 2;
    Batch u[kMostRows], v[kMostRows];
    std::size_t rows = 0;
    for (int i = 0; i < a_.place_count; ++i, ++rows) {
      u[rows] = jacobian.across[0].parameters[static_cast<std::size_t>(a_.places[i])];
      v[rows] = jacobian.across[1].parameters[static_cast<std::size_t>(a_.places[i])];
    }
    for (std::size_t k = 0; k < N; ++k, ++rows) {
      u[rows] = jacobian.across[0].rotation_angles[k];
      v[rows] = jacobian.across[1].rotation_angles[k];
    }
    for (const double* over : {a_.face_over_thickness, a_.face_over_spacing}) {
      u[rows] = v[rows] = Batch(0.0);
      for (std::size_t i = 0; i < kFaces; ++i) {
        u[rows] = u[rows] + jacobian.face_position[0][i] * Batch(over[i]);
        v[rows] = v[rows] + jacobian.face_position[1][i] * Batch(over[i]);
      }
      ++rows;
    }
    for (int factor = 0; factor < a_.factors; ++factor) {
      Batch fu(0.0), fv(0.0);
      const double* weight = a_.factor + factor;
      for (std::size_t row = 0; row < rows; ++row, weight += a_.factors) {
        const Batch w(*weight);
        fu = xsimd::fma(u[row], w, fu);
        fv = xsimd::fma(v[row], w, fv);
      }
      const Batch fd(-a_.range_factor[factor]);  // the offset is taken off the range
      c.uu = xsimd::fma(fu, fu, c.uu);
      c.uv = xsimd::fma(fu, fv, c.uv);
      c.vv = xsimd::fma(fv, fv, c.vv);
      c.ud = xsimd::fma(fu, fd, c.ud);
      c.vd = xsimd::fma(fv, fd, c.vd);
      c.dd = xsimd::fma(fd, fd, c.dd);
      if (a_.loading) {
        const Vector3<Batch> moved = fu * across[0] + fv * across[1] + fd * direction;
        double* const* columns = a_.loading + 3 * factor;
        moved.x.store_unaligned(columns[0] + at);
        moved.y.store_unaligned(columns[1] + at);
        moved.z.store_unaligned(columns[2] + at);
      }
    }
  }

  /// From the frame of the beam into that of the sensor.
  void store_covariance(std::size_t at, const std::array<Vector3<Batch>, 2>& across,
                        const Vector3<Batch>& d, const BeamCovariance& c) const {
    const Vector3<Batch>&u = across[0], &v = across[1];
    const Vector3<Batch> cu = c.uu * u + c.uv * v + c.ud * d;
    const Vector3<Batch> cv = c.uv * u + c.vv * v + c.vd * d;
    const Vector3<Batch> cd = c.ud * u + c.vd * v + c.dd * d;
    const auto entry = [&](const Batch& ui, const Batch& vi, const Batch& di, const Batch& uj,
                           const Batch& vj,
                           const Batch& dj) { return uj * ui + vj * vi + dj * di; };
    entry(u.x, v.x, d.x, cu.x, cv.x, cd.x).store_unaligned(a_.covariance[0] + at);
    entry(u.x, v.x, d.x, cu.y, cv.y, cd.y).store_unaligned(a_.covariance[1] + at);
    entry(u.x, v.x, d.x, cu.z, cv.z, cd.z).store_unaligned(a_.covariance[2] + at);
    entry(u.y, v.y, d.y, cu.y, cv.y, cd.y).store_unaligned(a_.covariance[3] + at);
    entry(u.y, v.y, d.y, cu.z, cv.z, cd.z).store_unaligned(a_.covariance[4] + at);
    entry(u.z, v.z, d.z, cu.z, cv.z, cd.z).store_unaligned(a_.covariance[5] + at);
  }

  const PointArguments& a_;
  PreparedTrain<Batch, N> train_, believed_;
  PreparedDerivatives<Batch, N> derivatives_;
  std::array<Batch, kFaces> face_position_;
  bool same_ = true;
};

template <int N>
void compute_all(const PointArguments& a) {
  const Kernel<N> kernel(a);
  for (std::size_t at = 0; at < a.shots; at += kLanes) kernel.compute(at);
}

}  // namespace

void compute_points(const PointArguments& a) {
  switch (a.prisms) {
    case 1:
      return compute_all<1>(a);
    case 2:
      return compute_all<2>(a);
    case 3:
      return compute_all<3>(a);
    default:
      return compute_all<4>(a);
  }
}

}  // namespace risley::cloud::RISLEY_KERNEL_NAMESPACE
