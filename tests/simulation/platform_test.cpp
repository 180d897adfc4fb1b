// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/simulation/platform.hpp"

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/scanner.hpp"

#include "refusal.hpp"

namespace risley::simulation::platform_test {

using ::testing::AllOf;

using Real = long double;
using Vector = std::array<Real, 3>;
using Matrix = std::array<Vector, 3>;  // rows

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) c[i][j] += a[i][k] * b[k][j];
    }
  }
  return c;
}

Vector product(const Matrix& a, const Vector& v) {
  Vector c{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) c[i] += a[i][k] * v[k];
  }
  return c;
}

Vector sum(const Vector& a, const Vector& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

Vector of(const Vector3<double>& v) {
  return {static_cast<Real>(v.x), static_cast<Real>(v.y), static_cast<Real>(v.z)};
}

/// A platform whose place and attitude are formulas, so that they are known between records.
Vector place(Real t) {
  return {5 * t - 10, 3 * std::sin(0.7L * t), 80 + 0.5L * std::sin(1.1L * t)};
}

/// Rz(heading) Ry(pitch) Rx(roll), body to north, east, down.
Matrix attitude(Real t) {
  const Real roll = 0.04L * std::sin(4.4L * t), pitch = -0.03L * std::cos(3.1L * t);
  const Real heading = 1.4L + 0.05L * std::sin(2.3L * t);
  const Real cr = std::cos(roll), sr = std::sin(roll), cp = std::cos(pitch), sp = std::sin(pitch);
  const Real ch = std::cos(heading), sh = std::sin(heading);
  return {{{ch * cp, ch * sp * sr - sh * cr, ch * sp * cr + sh * sr},
           {sh * cp, sh * sp * sr + ch * cr, sh * sp * cr - ch * sr},
           {-sp, cp * sr, cp * cr}}};
}

const Matrix kMapFromNed{{{0, 1, 0}, {1, 0, 0}, {0, 0, -1}}};

/// Axes east, north, up at a place of the Earth and its geocentric coordinates.
struct OnEarth {
  Real latitude = 0.9L, longitude = 0.2L, height = 150;
  Matrix axes{};  // columns east, north, up
  Vector origin{};

  OnEarth() {
    const Real a = 6378137, f = 1 / 298.257223563L, e2 = f * (2 - f);
    const Real slat = std::sin(latitude), clat = std::cos(latitude);
    const Real slon = std::sin(longitude), clon = std::cos(longitude);
    const Real n = a / std::sqrt(1 - e2 * slat * slat);
    origin = {(n + height) * clat * clon, (n + height) * clat * slon,
              (n * (1 - e2) + height) * slat};
    axes = {
        {{-slon, -slat * clon, clat * clon}, {clon, -slat * slon, clat * slon}, {0, clat, slat}}};
  }
};

std::shared_ptr<trajectories::Trajectory> flown(double duration, const OnEarth* earth = nullptr) {
  auto flight = std::make_shared<trajectories::Trajectory>();
  flight->frame = earth != nullptr ? trajectories::Frame::geocentric : trajectories::Frame::local;
  for (int i = 0; i <= 200 * duration; ++i) {
    flight->time_ns.push_back(7'000'000'000 + i * 5'000'000LL);
    const Real t = static_cast<Real>(i) / 200;
    Vector r = place(t);
    Matrix rotation = product(kMapFromNed, attitude(t));
    if (earth != nullptr) {
      r = sum(earth->origin, product(earth->axes, r));
      rotation = product(earth->axes, rotation);
    }
    flight->position.emplace_back(static_cast<double>(r[0]), static_cast<double>(r[1]),
                                  static_cast<double>(r[2]));
    Eigen::Matrix3d matrix;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        matrix(row, column) = static_cast<double>(rotation[row][column]);
      }
    }
    flight->attitude.emplace_back(Eigen::Quaterniond(matrix).normalized());
  }
  return flight;
}

const std::string kScene = R"(
terrain:
  ground: {relief: [{amplitude_m: 3, wavelength_x_m: 80, wavelength_y_m: 100}]}
  roofs:
    - {name: barn, center_m: [2, -3], length_m: 12, face_width_m: 9, pitch_deg: 35, ridge_height_m: 12, heading_deg: 30}
)";

trajectories::Mount mount() {
  trajectories::Mount m;
  m.reference_point = "centre of the IMU";
  m.nominal << 0, 0, 1, 0, -1, 0, 1, 0, 0;  // X down, Y left, Z forward
  m.nominal_source = "test";
  const double boresight[] = {0.01, -0.02, 0.015}, lever[] = {0.10, 0.05, 0.12};
  for (std::size_t i = 0; i < 3; ++i) {
    m.boresight[i] = {boresight[i], 0, "test"};
    m.lever_arm[i] = {lever[i], 0, "test"};
  }
  m.clock_offset = {0.0123, 0, "test"};
  return m;
}

SimulationSettings moving(double duration = 3.0) {
  SimulationSettings s;
  s.truth = sensors::load_sensor("mid-40-table3");
  s.angle_noise = 0.0;
  s.range_noise = 0.0;
  s.quantize = false;
  s.rate = 5000.0;
  s.duration = duration;
  s.truth.range_offset = 0;
  s.rotor = RotorKind::sinusoidal;
  s.seed = 3;
  s.scene = scenes::parse_scene(kScene, "scene.yaml");
  Platform platform;
  platform.trajectory = flown(4.0);
  platform.mount = mount();
  platform.clock_drift = 20e-6;
  s.platform = platform;
  return s;
}

struct Scanned {
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  recordings::RecordingHeader header;
};

Scanned scan(const SimulationSettings& settings) {
  Scanner scanner(settings);
  Scanned whole;
  scanner.read(whole.chunk, whole.truth, scanner.shots());
  whole.header = scanner.header();
  return whole;
}

/// x = r(t) + R(t) (l + M B (o + rho d)) in long double, all of it written out here, on the map.
Vector georeferenced(const SimulationSettings& settings, const recordings::TruthColumns& truth,
                     std::size_t row) {
  const std::array<double, 2> angles{truth.rotation_angle[0][row], truth.rotation_angle[1][row]};
  const Ray ray = emergent_ray(settings.truth.train, settings.truth.geometry, angles);
  const Real rho = static_cast<Real>(truth.range[row]);
  Vector p = of(ray.origin);
  for (std::size_t i = 0; i < 3; ++i) p[i] += rho * of(ray.direction)[i];
  const trajectories::Mount& m = settings.platform->mount;
  // Rodrigues' formula for the boresight.
  const Vector b{static_cast<Real>(m.boresight[0].value), static_cast<Real>(m.boresight[1].value),
                 static_cast<Real>(m.boresight[2].value)};
  const Real size = std::sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
  const Matrix skew{{{0, -b[2], b[1]}, {b[2], 0, -b[0]}, {-b[1], b[0], 0}}};
  const Matrix square = product(skew, skew);
  Matrix boresight{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      boresight[i][j] = (i == j ? 1 : 0) + skew[i][j] * std::sin(size) / size +
                        square[i][j] * (1 - std::cos(size)) / (size * size);
    }
  }
  const Matrix nominal{{{0, 0, 1}, {0, -1, 0}, {1, 0, 0}}};
  Vector body = product(nominal, product(boresight, p));
  for (std::size_t i = 0; i < 3; ++i) body[i] += static_cast<Real>(m.lever_arm[i].value);
  const Real clock = static_cast<Real>(truth.time_ns[row]) * 1e-9L;
  const Real first = static_cast<Real>(truth.time_ns[0]) * 1e-9L;
  const Real t = clock + static_cast<Real>(m.clock_offset.value) +
                 static_cast<Real>(settings.platform->clock_drift) * (clock - first) - 7;
  return sum(place(t), product(kMapFromNed, product(attitude(t), body)));
}

/// Distance, m, of a point from the surface of kScene that a shot may have met.
Real distance_from_scene(const Vector& x, bool& on_roof) {
  const Real pi = 3.14159265358979323846264338327950288L;
  const auto ground = [&](Real px, Real py) {
    return 3 * std::sin(2 * pi * px / 80) * std::cos(2 * pi * py / 100);
  };
  const Real heading = pi / 6, pitch = 35 * pi / 180;
  const Real dx = x[0] - 2, dy = x[1] + 3;
  const Real along = dx * std::sin(heading) + dy * std::cos(heading);
  const Real across = dx * std::cos(heading) - dy * std::sin(heading);
  on_roof = std::abs(along) <= 6 && std::abs(across) <= 9 * std::cos(pitch) && x[2] > 5;
  return on_roof
             ? (x[2] - (ground(2, -3) + 12 - std::abs(across) * std::tan(pitch))) * std::cos(pitch)
             : x[2] - ground(x[0], x[1]);
}

void expect_on_scene(const SimulationSettings& settings, double tolerance) {
  const Scanned scanned = scan(settings);
  std::size_t roofs = 0;
  for (std::size_t row = 0; row < scanned.truth.size(); ++row) {
    ASSERT_EQ(scanned.chunk.observations.time_ns[row], scanned.truth.time_ns[row]);
    ASSERT_EQ(scanned.chunk.observations.range[row], scanned.truth.range[row]);
    bool on_roof = false;
    const Vector x = georeferenced(settings, scanned.truth, row);
    ASSERT_LT(std::abs(static_cast<double>(distance_from_scene(x, on_roof))), tolerance)
        << row << ' ' << static_cast<double>(x[0]) << ' ' << static_cast<double>(x[1]) << ' '
        << static_cast<double>(x[2]);
    roofs += on_roof ? 1 : 0;
  }
  EXPECT_GT(roofs, 100u);
  EXPECT_LT(roofs, scanned.truth.size() / 2);
}

TEST(Platform, PointsLieOnTheSceneWhereTheTruthPutsThem) { expect_on_scene(moving(), 1e-8); }

TEST(Platform, OnTheEarthToo) {
  const OnEarth earth;
  SimulationSettings s = moving();
  s.platform->trajectory = flown(4.0, &earth);
  s.platform->map_origin = trajectories::Geodetic{static_cast<double>(earth.latitude),
                                                  static_cast<double>(earth.longitude),
                                                  static_cast<double>(earth.height)};
  expect_on_scene(s, 2e-8);
  // The same where the scene itself says where it lies.
  s.platform->map_origin.reset();
  s.scene = scenes::parse_scene(
      "terrain:\n  origin: {latitude_deg: 51.566201561774094, longitude_deg: 11.459155902616464, "
      "ellipsoidal_height_m: 150}" +
          kScene.substr(kScene.find("terrain:") + 8),
      "scene.yaml");
  expect_on_scene(s, 2e-8);
}

TEST(Platform, TheRecordingKeepsItsOwnClock) {
  SimulationSettings s = moving(1.0);
  const Scanned scanned = scan(s);
  // 7 s - 0.0123 s, up to the next millisecond.
  EXPECT_EQ(scanned.truth.time_ns.front(), 6'988'000'000);
  EXPECT_EQ(first_clock_reading_ns(*s.platform), 6'988'000'000);
  EXPECT_EQ(scanned.truth.time_ns[5], 6'989'000'000);
  EXPECT_EQ(scanned.header.time_reference, recordings::TimeReference::power_on);
  EXPECT_NEAR(longest_duration(*s.platform), (4.0 - 0.0003) / (1 + 20e-6), 1e-9);
  s.platform->begin_ns = 8'500'000'000;
  EXPECT_EQ(scan(s).truth.time_ns.front(), 8'488'000'000);
  // A clock does not begin before 0, whatever its offset.
  s.platform->begin_ns.reset();
  s.platform->mount.clock_offset.value = 7.5;
  EXPECT_EQ(scan(s).truth.time_ns.front(), 0);
  auto unix_time = std::make_shared<trajectories::Trajectory>(*s.platform->trajectory);
  unix_time->time_scale = trajectories::TimeScale::utc_unix;
  s.platform->trajectory = unix_time;
  EXPECT_EQ(scan(s).header.time_reference, recordings::TimeReference::utc);
}

TEST(Platform, AWrongClockMovesPointsAsThePlatformMoves) {
  // 20 ms late at 5 m/s: half a metre off where the drift, the offset or their signs are ignored.
  SimulationSettings s = moving(0.5);
  SimulationSettings shifted = s;
  shifted.platform->mount.clock_offset.value += 0.020;
  shifted.platform->begin_ns = 7'020'000'000;
  s.platform->begin_ns = 7'000'000'000;
  const Scanned a = scan(s), b = scan(shifted);
  EXPECT_EQ(a.truth.time_ns, b.truth.time_ns);
  EXPECT_NE(a.truth.range, b.truth.range);
}

TEST(Platform, TheSameShotsForAnyThreadsAndPieces) {
  SimulationSettings s = moving(1.5);
  s.range_noise = 0.02;
  s.scene = scenes::parse_scene(
      kScene + "  bushes: [{center_m: [-5, 6], radius_m: 4, height_m: 6}]\n", "scene.yaml");
  s.threads = 1;
  const Scanned one = scan(s);
  for (const int threads : {2, 4}) {
    s.threads = threads;
    const Scanned more = scan(s);
    EXPECT_EQ(more.truth.range, one.truth.range);
    EXPECT_EQ(more.chunk.observations.range, one.chunk.observations.range);
    EXPECT_EQ(more.chunk.observations.time_ns, one.chunk.observations.time_ns);
  }
  Scanner pieces(s);
  recordings::Chunk chunk;
  recordings::TruthColumns truth, all;
  while (pieces.read(chunk, truth, 777)) all.append(truth);
  EXPECT_EQ(all.range, one.truth.range);
  s.seed += 1;
  EXPECT_NE(scan(s).truth.range, one.truth.range);
}

TEST(Platform, ShotsThatGetIntoABushEndAtRandomDepths) {
  SimulationSettings s = moving(2.0);
  s.scene = scenes::parse_scene(
      "terrain: {ground: {height_m: 0}, bushes: [{center_m: [-5, 0], radius_m: 8, height_m: 10}]}",
      "bush.yaml");
  const Scanned scanned = scan(s);
  std::size_t inside = 0, low = 0;
  for (std::size_t row = 0; row < scanned.truth.size(); ++row) {
    const Vector x = georeferenced(s, scanned.truth, row);
    if (x[2] < 1e-6L) continue;
    const Real u = (x[0] + 5) / 8, v = x[1] / 8, w = (x[2] - 5) / 5;
    ASSERT_LT(u * u + v * v + w * w, 1 + 1e-9L);
    ++inside;
    low += x[2] < 5 ? 1 : 0;
  }
  EXPECT_GT(inside, 300u);
  EXPECT_NEAR(static_cast<double>(low) / static_cast<double>(inside), 0.5, 0.1);
}

TEST(Platform, TheSkyGivesNoReturn) {
  SimulationSettings s = moving(0.2);
  s.platform->mount.nominal << 0, 0, -1, 0, -1, 0, -1, 0, 0;  // X up
  const Scanned scanned = scan(s);
  for (std::size_t row = 0; row < scanned.truth.size(); ++row) {
    ASSERT_TRUE(std::isnan(scanned.truth.range[row]));
    ASSERT_EQ(scanned.chunk.observations.range[row], 0.0);
    ASSERT_EQ(scanned.chunk.observations.valid[row], 0);
    ASSERT_FALSE(std::isnan(scanned.chunk.observations.azimuth[row]));
  }
}

TEST(Platform, RefusesWhatItHasNoPosesFor) {
  const auto refused = [](auto&& change) {
    SimulationSettings s = moving();
    change(s);
    return refusal([&] { Scanner scanner(s); });
  };
  EXPECT_EQ(refused([](auto&) {}), "");
  EXPECT_THAT(refused([](auto& s) { s.duration = 5; }),
              AllOf(NamesField("12.000200 s"), NamesField("11.000000 s")));
  EXPECT_THAT(refused([](auto& s) { s.platform->begin_ns = 6'000'000'000; }),
              NamesField("6.000300 s"));
  EXPECT_THAT(refused([](auto& s) {
                auto holed = std::make_shared<trajectories::Trajectory>(*s.platform->trajectory);
                const auto cut = [](auto& column) {
                  column.erase(column.begin() + 300, column.begin() + 340);
                };
                cut(holed->time_ns);
                cut(holed->position);
                cut(holed->attitude);
                s.platform->trajectory = holed;
              }),
              NamesField("8.495000 s to 8.700000 s"));
  EXPECT_THAT(refused([](auto& s) {
                const OnEarth earth;
                s.platform->trajectory = flown(4.0, &earth);
              }),
              NamesField("origin"));
  EXPECT_THAT(refused([](auto& s) { s.platform->trajectory = nullptr; }), NamesField("trajectory"));
  EXPECT_THAT(refused([](auto& s) { s.platform->clock_drift = 0.5; }), NamesField("clock_drift"));
  EXPECT_THAT(refused([](auto& s) { s.platform->mount.nominal.setZero(); }), NamesField("nominal"));
  EXPECT_THAT(refused([](auto& s) { s.scene.reset(); }), NamesField("scene"));
  EXPECT_THAT(refused([](auto& s) {
                s.scene->stations.push_back({"roof", {0, 0, 0}});
                s.station = "roof";
              }),
              NamesField("\"roof\""));
}

}  // namespace risley::simulation::platform_test
