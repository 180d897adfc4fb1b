// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "cloud/pointing_kernel.hpp"

#include <array>

#include "risley/core/simd.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/optics/emitter_lanes.hpp"
#include "risley/optics/observation_adjoint.hpp"
#include "risley/sensors/range_errors.hpp"

namespace risley::cloud::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
using Lanes = xsimd::batch_bool<double>;
constexpr std::size_t kLanes = Batch::size;
static_assert(kPointPadding % kLanes == 0);

/// Shots that take each step of the model together: points with covariance take 22 % less time than
/// group by group with AVX-512 (Zen 4), and no less with more.
constexpr std::size_t kBlock = 16, kGroups = kBlock / kLanes;

constexpr double kPi = 3.14159265358979323846;

Batch load(const double* column, std::size_t at) { return Batch::load_unaligned(column + at); }

/// Two unit vectors perpendicular to a direction and to each other, smooth everywhere except for
/// the sign where the beam points backwards.
std::array<Vector3<Batch>, 2> vectors_across(const Vector3<Batch>& d) {
  const Batch one(1.0);
  const Batch sign = xsimd::select(d.x >= Batch(0.0), one, Batch(-1.0));
  const Batch a = Batch(-1.0) / (sign + d.x);
  const Batch b = d.y * d.z * a;
  return {Vector3<Batch>{-sign * d.y, one + sign * d.y * d.y * a, sign * b},
          Vector3<Batch>{-d.z, b, sign + d.z * d.z * a}};
}

/// A symmetric matrix in the frame of the beam: along the two vectors across it, and along it.
struct BeamCovariance {
  Batch uu, uv, vv, ud, vd, dd;
};

/// The part without the prisms.
class Points {
 public:
  explicit Points(const PointArguments& a) : a_(a) {}

  /// Shots [at, at + kLanes) without known rotation angles: directions as reported, beams from the
  /// frame's origin, a footprint along azimuth and zenith. Of the common factors those of the range
  /// remain.
  [[gnu::flatten]] void compute_reported(std::size_t at) const {
    const Sines azimuth = sines(a_.azimuth, at), zenith = sines(a_.zenith, at);
    const Batch zero(0.0);
    Ray ray{{zero, zero, zero}, {}, {}};
    set_reported(azimuth, zenith, ray);
    RangeShares shares;
    const Batch range = corrected_range(at, ray, shares);
    const Batch cosine = store_point(at, ray, range);
    if (!a_.covariance[0]) return;
    BeamCovariance own{zero, zero, zero, zero, zero, range_noise(at, range, cosine)};
    add_angle_noise(at, zenith, range, own);
    const Batch range2 = range * range;
    own.uu = xsimd::fma(range2, Batch(a_.divergence_variance_horizontal), own.uu);
    own.vv = xsimd::fma(range2, Batch(a_.divergence_variance_vertical), own.vv);
    if (a_.own_covariance[0]) store_covariance(at, ray, own, a_.own_covariance);
    const MountEffects effects = mount_effects(at, ray, range);
    for (int factor = 0; factor < a_.factors; ++factor) {
      add_factor(at, factor, zero, zero, effects, shares, ray, own);
    }
    store_covariance(at, ray, own, a_.covariance);
  }

 protected:
  /// Sine and cosine of one reported angle.
  struct Sines {
    Batch sine, cosine;
  };
  /// A beam and two directions across it.
  struct Ray {
    Vector3<Batch> origin, direction;
    std::array<Vector3<Batch>, 2> across;
  };

  static Sines sines(const double* column, std::size_t at) {
    const auto [sine, cosine] = sin_cos(load(column, at));
    return {sine, cosine};
  }

  static void set_reported(const Sines& azimuth, const Sines& zenith, Ray& ray) {
    ray.direction = {zenith.sine * azimuth.cosine, zenith.sine * azimuth.sine, zenith.cosine};
    ray.across = {
        Vector3<Batch>{-azimuth.sine, azimuth.cosine, Batch(0.0)},
        Vector3<Batch>{zenith.cosine * azimuth.cosine, zenith.cosine * azimuth.sine, -zenith.sine}};
  }

  /// Effect of a unit of each range error on a range, see RangeShare.
  using RangeShares = std::array<Batch, kEmitterShares + kMaxEmitters>;

  Vector3<Batch> surface_normal(std::size_t at) const {
    return {load(a_.surface_normal[0], at), load(a_.surface_normal[1], at),
            load(a_.surface_normal[2], at)};
  }

  /// True range from the reported one. @param shares  filled if there are range errors
  Batch corrected_range(std::size_t at, const Ray& ray, RangeShares& shares) const {
    const Batch without_offset = load(a_.range, at) - Batch(a_.range_offset);
    if (!a_.range_errors) return without_offset;
    return without_range_errors(at, ray, without_offset, shares);
  }

  /// Not inlined: it would cost registers in the path without such errors.
  [[gnu::noinline]] Batch without_range_errors(std::size_t at, const Ray& ray,
                                               const Batch& without_offset,
                                               RangeShares& shares) const {
    const Batch zero(0.0), intensity = load(a_.intensity, at);
    const Batch decades =
        xsimd::log10(Batch(sensors::kWalkIntensity) / xsimd::max(intensity, Batch(1.0)));
    shares[kDecadeShare] = xsimd::select(intensity >= zero, decades, zero);
    Batch measured = without_offset - Batch(a_.range_per_decade) * shares[kDecadeShare];
    for (int emitter = 0; emitter < a_.emitters; ++emitter) {
      alignas(64) double fired[kLanes];
      for (std::size_t i = 0; i < kLanes; ++i) {
        fired[i] = (a_.beam ? a_.beam[at + i] : 0) == emitter ? 1.0 : 0.0;
      }
      const Batch share = Batch::load_aligned(fired);
      measured = measured - Batch(a_.range_emitter[emitter]) * share;
      shares[static_cast<std::size_t>(kEmitterShares + emitter)] = share;
    }
    // Those that depend on the true range by two steps of Newton's method: the first is off by less
    // than the square of the error, of some centimetres, over kNearDecay.
    const Batch depth = depth_per_range(at, ray);
    const Batch near(a_.range_near), incidence(a_.range_incidence), decay(sensors::kNearDecay);
    Batch range = measured;
    for (int step = 0; step < 2; ++step) {
      const Batch share = xsimd::exp((Batch(1.0) - range) / decay);
      const Batch off = range + near * share + incidence * depth * range - measured;
      range = range - off / (Batch(1.0) - near * share / decay + incidence * depth);
    }
    shares[kNearShare] = xsimd::exp((Batch(1.0) - range) / decay);
    shares[kIncidenceShare] = depth * range;
    return range;
  }

  /// sensors::footprint_depth() of a range of 1 m on the surface, 0 where it is not known.
  Batch depth_per_range(std::size_t at, const Ray& ray) const {
    const Vector3<Batch>& d = ray.direction;
    const Batch zero(0.0), one(1.0), level = xsimd::sqrt(d.x * d.x + d.y * d.y);
    const Lanes upright = level == zero;  // as sensors::footprint_axes() says
    const Batch over = one / xsimd::select(upright, one, level);
    const Vector3<Batch> horizontal{-d.y * over, xsimd::select(upright, one, d.x * over), zero};
    const Vector3<Batch> vertical = cross(d, horizontal);
    const Vector3<Batch> normal = surface_normal(at);
    const Lanes known = normal.x == normal.x;
    const Batch cosine = xsimd::max(xsimd::abs(dot(normal, d)), Batch(kLeastCosine));
    const Batch h = dot(normal, horizontal) * Batch(a_.divergence_horizontal) / cosine;
    const Batch v = dot(normal, vertical) * Batch(a_.divergence_vertical) / cosine;
    return xsimd::select(known, Batch(0.5) * xsimd::sqrt(h * h + v * v), zero);
  }

  /// @return cosine of the angle of incidence, NaN if no surface is known
  Batch store_point(std::size_t at, const Ray& ray, const Batch& range) const {
    const Vector3<Batch> point = ray.origin + range * ray.direction;
    point.x.store_unaligned(a_.point[0] + at);
    point.y.store_unaligned(a_.point[1] + at);
    point.z.store_unaligned(a_.point[2] + at);
    range.store_unaligned(a_.corrected_range + at);
    const Vector3<Batch> normal = surface_normal(at);
    const Batch nan(__builtin_nan(""));
    const Lanes known = normal.x == normal.x;  // min and acos need not propagate NaN
    const Batch cosine =
        xsimd::select(known, xsimd::min(xsimd::abs(dot(normal, ray.direction)), Batch(1.0)), nan);
    xsimd::select(known, xsimd::acos(cosine), nan).store_unaligned(a_.incidence + at);
    return cosine;
  }

  /// Effect of mount errors on points of a moving sensor: each unit of its seven quantities gives a
  /// shift across the beam, in both directions, and along it.
  using MountEffects = std::array<Vector3<Batch>, kMountEffects>;

  MountEffects mount_effects(std::size_t at, const Ray& ray, const Batch& range) const {
    MountEffects effects;
    if (!a_.mount_begin) return effects;
    const auto vector = [at](const double* const(&columns)[3]) {
      return Vector3<Batch>{load(columns[0], at), load(columns[1], at), load(columns[2], at)};
    };
    const Vector3<Batch> point = ray.origin + range * ray.direction;
    const Vector3<Batch> velocity = vector(a_.velocity) + cross(vector(a_.rate), point);
    const std::array<const Vector3<Batch>*, 3> axes{&ray.across[0], &ray.across[1], &ray.direction};
    const std::array<Batch Vector3<Batch>::*, 3> of{&Vector3<Batch>::x, &Vector3<Batch>::y,
                                                    &Vector3<Batch>::z};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3<Batch>& axis = *axes[k];
      const Vector3<Batch> turned = cross(point, axis);  // axis . (e x point) = e . (point x axis)
      effects[0].*of[k] = turned.x;
      effects[1].*of[k] = turned.y;
      effects[2].*of[k] = turned.z;
      effects[3].*of[k] = axis.x;
      effects[4].*of[k] = axis.y;
      effects[5].*of[k] = axis.z;
      effects[6].*of[k] = dot(axis, velocity);
    }
    return effects;
  }

  /// Adds the effect of one common factor, beam and mount together, and stores its loading.
  /// @param fu, fv  its effect across the beam, m
  void add_factor(std::size_t at, int factor, const Batch& fu, const Batch& fv,
                  const MountEffects& effects, const RangeShares& shares, const Ray& ray,
                  BeamCovariance& c) const {
    const Vector3<Batch>&u = ray.across[0], &v = ray.across[1], &d = ray.direction;
    Vector3<Batch> f{fu, fv, Batch(-a_.range_factor[factor])};  // the offset is subtracted from the
                                                                // range
    if (a_.range_errors) {
      for (int entry = a_.range_begin[factor]; entry < a_.range_begin[factor + 1]; ++entry) {
        f.z = f.z -
              Batch(a_.range_weight[entry]) * shares[static_cast<std::size_t>(a_.range_row[entry])];
      }
    }
    if (a_.mount_begin) {
      for (int entry = a_.mount_begin[factor]; entry < a_.mount_begin[factor + 1]; ++entry) {
        f = f +
            Batch(a_.mount_weight[entry]) * effects[static_cast<std::size_t>(a_.mount_row[entry])];
      }
    }
    c.uu = xsimd::fma(f.x, f.x, c.uu);
    c.uv = xsimd::fma(f.x, f.y, c.uv);
    c.vv = xsimd::fma(f.y, f.y, c.vv);
    c.ud = xsimd::fma(f.x, f.z, c.ud);
    c.vd = xsimd::fma(f.y, f.z, c.vd);
    c.dd = xsimd::fma(f.z, f.z, c.dd);
    if (!a_.loading) return;
    const Vector3<Batch> loading = f.x * u + f.y * v + f.z * d;
    double* const* columns = a_.loading + 3 * factor;
    loading.x.store_unaligned(columns[0] + at);
    loading.y.store_unaligned(columns[1] + at);
    loading.z.store_unaligned(columns[2] + at);
  }

  void add_angle_noise(std::size_t at, const Sines& zenith, const Batch& range,
                       BeamCovariance& c) const {
    const Batch noise(a_.angle_noise_variance);
    const Batch across = range * zenith.sine;
    c.uu = c.uu + across * across * (noise + load(a_.azimuth_variance, at));
    c.vv = c.vv + range * range * (noise + load(a_.zenith_variance, at));
  }

  Batch range_noise(std::size_t at, const Batch& range, const Batch& cosine) const {
    Batch variance = Batch(a_.range_variance) + load(a_.rounding_variance, at) +
                     range * range * Batch(a_.range_variance_per_range2);
    if (a_.range_variance_incidence != 0) {
      const Batch squared = cosine * cosine;
      const Batch part = (Batch(1.0) - squared) / squared * Batch(a_.range_variance_incidence);
      variance = variance + xsimd::select(part == part, part, Batch(0.0));
    }
    if (a_.range_variance_weak_return != 0) {
      variance = variance + Batch(a_.range_variance_weak_return) /
                                xsimd::max(load(a_.intensity, at), Batch(1.0));
    }
    return variance;
  }

  /// From the frame of the beam into that of the sensor.
  void store_covariance(std::size_t at, const Ray& ray, const BeamCovariance& c,
                        double* const* columns) const {
    const Vector3<Batch>&u = ray.across[0], &v = ray.across[1], &d = ray.direction;
    const Vector3<Batch> cu = c.uu * u + c.uv * v + c.ud * d;
    const Vector3<Batch> cv = c.uv * u + c.vv * v + c.vd * d;
    const Vector3<Batch> cd = c.ud * u + c.vd * v + c.dd * d;
    const auto entry = [&](const Batch& ui, const Batch& vi, const Batch& di, const Batch& uj,
                           const Batch& vj,
                           const Batch& dj) { return uj * ui + vj * vi + dj * di; };
    entry(u.x, v.x, d.x, cu.x, cv.x, cd.x).store_unaligned(columns[0] + at);
    entry(u.x, v.x, d.x, cu.y, cv.y, cd.y).store_unaligned(columns[1] + at);
    entry(u.x, v.x, d.x, cu.z, cv.z, cd.z).store_unaligned(columns[2] + at);
    entry(u.y, v.y, d.y, cu.y, cv.y, cd.y).store_unaligned(columns[3] + at);
    entry(u.y, v.y, d.y, cu.z, cv.z, cd.z).store_unaligned(columns[4] + at);
    entry(u.z, v.z, d.z, cu.z, cv.z, cd.z).store_unaligned(columns[5] + at);
  }

  const PointArguments& a_;
};

/// Everything of a call that is the same for all shots, except for the emitters of a group.
template <TrainLayout N>
class Kernel : public Points {
 public:
  static constexpr std::size_t kFaces = 2 * N;

  explicit Kernel(const PointArguments& a)
      : Points(a),
        emitters_(a.parameters, a.emitters, a.beam),
        believed_emitters_(a.believed_parameters, a.emitters, a.beam) {
    train_ = prepared_train<Batch, N>(a.parameters, a.face_order);
    believed_ = prepared_train<Batch, N>(a.believed_parameters, a.face_order);
    derivatives_ = prepared_derivatives<Batch, N>(a.parameters, a.face_order, [&a](int place) {
      for (int i = 0; i < a.place_count; ++i) {
        if (a.places[i] == place) return true;
      }
      return false;
    });
    for (int i = 0; i < parameter_count(TrainShape{N, a.emitters}); ++i) {
      same_ = same_ && a.parameters[i] == a.believed_parameters[i];
    }
    for (std::size_t i = 0; i < kFaces; ++i) face_position_[i] = Batch(a.face_position[i]);
  }

  /// The groups of shots [at, end), which take each step of the model together: see
  /// AngleLinearisations. @param end  at most kBlock later
  [[gnu::flatten]] void compute(std::size_t at, std::size_t end) {
    const std::size_t groups = (end - at) / kLanes;
    for (std::size_t g = 0; g < groups; ++g) {
      turn_to(at + g * kLanes);
      trace_[g].beam[0] = train_.incident;
      believed_trace_[g].beam[0] = believed_.incident;
    }
    for (std::size_t k = 0; k < N; ++k) {
      for (std::size_t g = 0; g < groups; ++g) {
        turn_prism(load(a_.rotation_angle[k], at + g * kLanes), k, trace_[g]);
      }
    }
#pragma GCC unroll 4  // gcc 12 keeps batches in registers only where indices are constants
    for (std::size_t k = 0; k < kElements<N>; ++k) {
      for (std::size_t g = 0; g < groups; ++g) {
        pass_prism(train_, k, trace_[g]);
        set_inside(train_, k, trace_[g]);
      }
    }
    for (std::size_t g = 0; g < groups; ++g) find_point(at + g * kLanes, g);
    if (a_.azimuth_residual) {
      if (!same_) trace_again(groups);
      for (std::size_t g = 0; g < groups; ++g) store_residuals(at + g * kLanes, g);
    }
    if (!a_.covariance[0]) return;

    for (std::size_t g = 0; g < groups; ++g) turn_back(g);
#pragma GCC unroll 4
    for (std::size_t k = 0; k < kElements<N>; ++k) {
      for (std::size_t g = 0; g < groups; ++g) {
        reverse_prism(train_, derivatives_, trace_[g], N - 1 - k, pass_[g],
                      [&origin = origin_[g]](std::size_t face, std::size_t r, Vector3<Batch>& beam,
                                             Vector3<Batch>& normal) {
                        beam = beam + origin[r].incident[face];
                        normal = normal + origin[r].normal[face];
                      });
      }
    }
    for (std::size_t g = 0; g < groups; ++g) store_covariances(at + g * kLanes, g);
  }

 private:
  /// The emitters of shots [at, at + kLanes).
  void turn_to(std::size_t at) {
    emitters_.select(at, a_.shots);
    emitters_.apply(train_);
    emitters_.apply(derivatives_);
    if (same_) return;
    believed_emitters_.select(at, a_.shots);
    believed_emitters_.apply(believed_);
  }

  /// Point and directions across the beam of a group.
  void find_point(std::size_t at, std::size_t g) {
    path_[g] = beam_path(trace_[g], face_position_);
    azimuth_[g] = sines(a_.azimuth, at);
    zenith_[g] = sines(a_.zenith, at);
    Ray& ray = ray_[g];
    ray.origin = path_[g].origin();
    ray.direction = trace_[g].direction();
    if (a_.reported_directions) {
      set_reported(azimuth_[g], zenith_[g], ray);
      // The last face can stop a beam that has an origin.
      ray.direction =
          xsimd::select(trace_[g].valid(), Batch(1.0), Batch(__builtin_nan(""))) * ray.direction;
    } else {
      ray.across = vectors_across(ray.direction);
    }
    range_[g] = corrected_range(at, ray, shares_[g]);
    cosine_[g] = store_point(at, ray, range_[g]);
  }

  /// Derivatives of a group's point components across the beam by the faces and the direction: the
  /// start of the reverse pass.
  void turn_back(std::size_t g) {
    const std::array<Vector3<Batch>, 2>& across = ray_[g].across;
    for (std::size_t r = 0; r < 2; ++r) {
      origin_[g][r] = beam_path_adjoint(trace_[g], path_[g], face_position_, across[r]);
    }
    pass_[g] = begin_reverse<N>(
        trace_[g].direction(),
        std::array<Vector3<Batch>, 2>{range_[g] * across[0], range_[g] * across[1]});
  }

  void store_covariances(std::size_t at, std::size_t g) {
    if (emitters_.several()) turn_to(at);
    end_reverse(derivatives_, pass_[g]);
    BeamCovariance c = own_covariance(at, g);
    c.dd = c.dd + range_noise(at, range_[g], cosine_[g]);
    if (a_.own_covariance[0]) store_covariance(at, ray_[g], c, a_.own_covariance);
    add_factors(at, g, c);
    store_covariance(at, ray_[g], c, a_.covariance);
  }

  /// Reported direction minus that of the believed parameters. The series of the two angles are
  /// exact to 1e-8 of them up to 0.1 rad; larger ones only have to be large.
  void store_residuals(std::size_t at, std::size_t g) const {
    const Sines &azimuth = azimuth_[g], &zenith = zenith_[g];
    const Vector3<Batch> d = (same_ ? trace_ : believed_trace_)[g].direction();
    const Batch horizontal = xsimd::sqrt(d.x * d.x + d.y * d.y);
    const Batch across = azimuth.sine * d.x - azimuth.cosine * d.y;
    const Batch along = azimuth.cosine * d.x + azimuth.sine * d.y;
    const Batch t = across / along, t2 = t * t;
    const Batch atan =
        t * (Batch(1.0) + t2 * (Batch(-1.0 / 3.0) + t2 * (Batch(0.2) + t2 * Batch(-1.0 / 7.0))));
    // Neither near nor far if the beam is NaN.
    const Lanes far = t2 >= Batch(0.25) || along <= Batch(0.0);
    xsimd::select(far, Batch(kPi / 2), atan).store_unaligned(a_.azimuth_residual + at);
    const Batch s = zenith.sine * d.z - zenith.cosine * horizontal, s2 = s * s;
    const Batch asin =
        s * (Batch(1.0) +
             s2 * (Batch(1.0 / 6.0) + s2 * (Batch(3.0 / 40.0) + s2 * Batch(15.0 / 336.0))));
    asin.store_unaligned(a_.zenith_residual + at);
  }

  /// The same rotation angles through the believed train.
  void trace_again(std::size_t groups) {
    for (std::size_t g = 0; g < groups; ++g) {
      believed_trace_[g].sine = trace_[g].sine;
      believed_trace_[g].cosine = trace_[g].cosine;
    }
#pragma GCC unroll 4
    for (std::size_t k = 0; k < kElements<N>; ++k) {
      for (std::size_t g = 0; g < groups; ++g) pass_prism(believed_, k, believed_trace_[g]);
    }
  }

  /// Errors that are independent from shot to shot, except for the range's noise.
  BeamCovariance own_covariance(std::size_t at, std::size_t g) const {
    const Batch zero(0.0);
    BeamCovariance c{zero, zero, zero, zero, zero, zero};
    const Gradient<Batch, N>&u = pass_[g].gradients[0], &v = pass_[g].gradients[1];
    if (a_.reported_directions) {
      add_angle_noise(at, zenith_[g], range_[g], c);
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
    // The footprint is the beam's spread before the prisms, transformed to that after them.
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

  /// Adds the common factors' covariance and stores their loadings.
  void add_factors(std::size_t at, std::size_t g, BeamCovariance& c) const {
    constexpr std::size_t kPlaces = EmitterLanes<Batch, N>::kPlaces;
    constexpr std::size_t kMostRows = kPlaces + N + kMostSizes;
    Batch u[kMostRows], v[kMostRows];
    std::size_t rows = 0;
    Batch u_storage[kPlaces], v_storage[kPlaces];
    const Gradient<Batch, N>&by_u = pass_[g].gradients[0], &by_v = pass_[g].gradients[1];
    const Batch* u_by_place = emitters_.by_place(by_u, u_storage);
    const Batch* v_by_place = emitters_.by_place(by_v, v_storage);
    for (int i = 0; i < a_.place_count; ++i, ++rows) {
      u[rows] = u_by_place[a_.places[i]];
      v[rows] = v_by_place[a_.places[i]];
    }
    for (std::size_t k = 0; k < N; ++k, ++rows) {
      u[rows] = by_u.rotation_angles[k];
      v[rows] = by_v.rotation_angles[k];
    }
    for (int size = 0; size < a_.sizes; ++size) {
      const double* over = a_.face_over_size + static_cast<std::size_t>(size) * kFaces;
      u[rows] = v[rows] = Batch(0.0);
      for (std::size_t i = 0; i < kFaces; ++i) {
        u[rows] = u[rows] + origin_[g][0].face_position[i] * Batch(over[i]);
        v[rows] = v[rows] + origin_[g][1].face_position[i] * Batch(over[i]);
      }
      ++rows;
    }
    const MountEffects effects = mount_effects(at, ray_[g], range_[g]);
    for (int factor = 0; factor < a_.factors; ++factor) {
      Batch fu(0.0), fv(0.0);
      for (int entry = a_.factor_begin[factor]; entry < a_.factor_begin[factor + 1]; ++entry) {
        const Batch w(a_.factor_weight[entry]);
        const auto row = static_cast<std::size_t>(a_.factor_row[entry]);
        fu = xsimd::fma(u[row], w, fu);
        fv = xsimd::fma(v[row], w, fv);
      }
      add_factor(at, factor, fu, fv, effects, shares_[g], ray_[g], c);
    }
  }

  EmitterLanes<Batch, N> emitters_, believed_emitters_;
  PreparedTrain<Batch, N> train_, believed_;
  PreparedDerivatives<Batch, N> derivatives_;
  std::array<Batch, kFaces> face_position_;
  bool same_ = true;

  // Of the groups of a block.
  Trace<Batch, N> trace_[kGroups], believed_trace_[kGroups];
  BeamPath<Batch, N> path_[kGroups];
  Sines azimuth_[kGroups], zenith_[kGroups];
  Ray ray_[kGroups];
  Batch range_[kGroups], cosine_[kGroups];
  RangeShares shares_[kGroups];
  ReversePass<Batch, N, 2> pass_[kGroups];
  BeamPathAdjoint<Batch, N> origin_[kGroups][2];
};

}  // namespace

void compute_points(const PointArguments& a) {
  if (!a.rotation_angle) {
    const Points points(a);
    for (std::size_t at = 0; at < a.shots; at += kLanes) points.compute_reported(at);
    return;
  }
  with_layout(a.prisms, [&]<TrainLayout N>() {
    Kernel<N> kernel(a);
    for (std::size_t at = 0; at < a.shots; at += kBlock) {
      kernel.compute(at, a.shots - at < kBlock ? a.shots : at + kBlock);
    }
  });
}

}  // namespace risley::cloud::RISLEY_KERNEL_NAMESPACE
