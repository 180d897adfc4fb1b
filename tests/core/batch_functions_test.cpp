// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The batches' own sine, cosine and angles, in every instruction set of this processor, against the
// C library's in long double.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/vector3.hpp"

#include "kernels/batch_functions_kernel.hpp"

namespace risley::batch_functions_test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Sines {
  std::vector<double> sine, cosine;
};

Sines sines_of(std::vector<double> angle, InstructionSet set) {
  const std::size_t count = angle.size();
  angle.resize((count + kMostLanes - 1) / kMostLanes * kMostLanes, 0.5);
  Sines out{std::vector<double>(angle.size()), std::vector<double>(angle.size())};
  RISLEY_KERNEL_COPIES(sines).at(set)(angle.data(), angle.size(), out.sine.data(),
                                      out.cosine.data());
  out.sine.resize(count);
  out.cosine.resize(count);
  return out;
}

struct Angles {
  std::vector<double> azimuth, zenith;
};

Angles angles_of(const std::vector<Vector3<double>>& directions, InstructionSet set) {
  const std::size_t count = (directions.size() + kMostLanes - 1) / kMostLanes * kMostLanes;
  std::array<std::vector<double>, 3> column;
  for (auto& values : column) values.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3<double>& v = directions[std::min(i, directions.size() - 1)];
    column[0][i] = v.x;
    column[1][i] = v.y;
    column[2][i] = v.z;
  }
  Angles out{std::vector<double>(count), std::vector<double>(count)};
  RISLEY_KERNEL_COPIES(angles).at(set)(column[0].data(), column[1].data(), column[2].data(), count,
                                       out.azimuth.data(), out.zenith.data());
  out.azimuth.resize(directions.size());
  out.zenith.resize(directions.size());
  return out;
}

/// Angles of every size up to `most`, and beside every border of the reduction.
std::vector<double> angles_up_to(double most) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0), exponent(-300.0, std::log10(most));
  std::vector<double> angles;
  for (int i = 0; i < 40000; ++i) {
    angles.push_back(7.0 * uniform(generator));
    angles.push_back(most * uniform(generator));
    angles.push_back(std::copysign(std::pow(10.0, exponent(generator)), uniform(generator)));
  }
  for (int i = 0; i < 40000; ++i) {  // eighths of a turn: quadrants, and where they are exchanged
    const double eighths = i < 4000 ? i : std::floor(std::abs(uniform(generator)) * 4 * most / kPi);
    const double border = eighths * (kPi / 4);
    if (border > most) continue;
    for (const double sign : {1.0, -1.0}) {
      angles.push_back(sign * border);
      angles.push_back(sign * std::nextafter(border, kInfinity));
      angles.push_back(sign * std::nextafter(border, 0.0));
    }
  }
  return angles;
}

/// Largest error of both functions.
double worst_sine(const std::vector<double>& angles, InstructionSet set) {
  const Sines found = sines_of(angles, set);
  double worst = 0;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const long double angle = angles[i];
    const long double sine = std::abs(std::sin(angle) - static_cast<long double>(found.sine[i]));
    const long double cosine =
        std::abs(std::cos(angle) - static_cast<long double>(found.cosine[i]));
    EXPECT_FALSE(std::isnan(found.sine[i]) || std::isnan(found.cosine[i])) << angles[i];
    worst = std::max({worst, static_cast<double>(sine), static_cast<double>(cosine)});
  }
  return worst;
}

TEST(BatchFunctions, SinesAreAccurateAtEveryAngle) {
  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    EXPECT_LT(worst_sine(angles_up_to(1e6), set), 2.5e-16);   // the polynomials
    EXPECT_LT(worst_sine(angles_up_to(1e15), set), 2.5e-16);  // mostly xsimd's
    const std::vector<double> limit{1e6, std::nextafter(1e6, 0.0), std::nextafter(1e6, 2e6), -1e6};
    EXPECT_LT(worst_sine(limit, set), 2.5e-16);
  }
}

// A lane that takes the long way takes all with it, and none of them changes.
TEST(BatchFunctions, SinesOfWhatIsNoAngleAreNoNumberAndSpoilNoNeighbour) {
  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    for (const double odd : {kNan, kInfinity, -kInfinity}) {
      for (std::size_t lane = 0; lane < kMostLanes; ++lane) {
        std::vector<double> angles{0.1, -2.0, 3.0, 7.0, -40.0, 500.0, 1.5, 0.7};
        const Sines expected = sines_of(angles, set);
        angles[lane] = odd;
        const Sines found = sines_of(angles, set);
        for (std::size_t i = 0; i < kMostLanes; ++i) {
          if (i == lane) {
            EXPECT_TRUE(std::isnan(found.sine[i]) && std::isnan(found.cosine[i])) << odd;
          } else {
            EXPECT_NEAR(found.sine[i], expected.sine[i], 2.5e-16);
            EXPECT_NEAR(found.cosine[i], expected.cosine[i], 2.5e-16);
          }
        }
      }
    }
  }
}

TEST(BatchFunctions, ZeroKeepsItsSign) {
  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    const Sines found = sines_of({0.0, -0.0}, set);
    EXPECT_EQ(found.sine[0], 0.0);
    EXPECT_EQ(found.sine[1], 0.0);
    EXPECT_FALSE(std::signbit(found.sine[0]));
    EXPECT_TRUE(std::signbit(found.sine[1]));
    EXPECT_EQ(found.cosine[0], 1.0);
    EXPECT_EQ(found.cosine[1], 1.0);
    const Angles level = angles_of({{1.0, 0.0, 0.0}, {1.0, -0.0, -0.0}}, set);
    EXPECT_FALSE(std::signbit(level.azimuth[0]));
    EXPECT_TRUE(std::signbit(level.azimuth[1]));
    EXPECT_EQ(level.azimuth[1], 0.0);
    EXPECT_EQ(level.zenith[0], kPi / 2);
    EXPECT_EQ(level.zenith[1], kPi / 2);
  }
}

/// Unit vectors over the whole sphere, in the cone of a sensor and at the borders of the
/// polynomials' ranges.
std::vector<Vector3<double>> many_directions() {
  std::mt19937_64 generator(2);
  std::normal_distribution<double> normal;
  std::vector<Vector3<double>> directions;
  for (int i = 0; i < 40000; ++i) {
    const double x = normal(generator), y = normal(generator), z = normal(generator);
    directions.push_back(normalized(Vector3<double>{x, y, z}));
    directions.push_back(normalized(Vector3<double>{5.0, y, z}));
    const double side = std::copysign(0.4142 + 1e-9 * z, y);
    directions.push_back(normalized(Vector3<double>{1.0, side, 0.2 * z}));
    const double height = std::copysign(0.42 + 1e-9 * y, z);
    const double flat = std::sqrt(1.0 - height * height), azimuth = 0.2 * x;
    directions.push_back({flat * std::cos(azimuth), flat * std::sin(azimuth), height});
  }
  return directions;
}

TEST(BatchFunctions, AnglesAreAccurateInEveryDirection) {
  const auto directions = many_directions();
  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    const Angles found = angles_of(directions, set);
    double worst = 0;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const long double x = directions[i].x, y = directions[i].y, z = directions[i].z;
      const auto azimuth = std::abs(std::atan2(y, x) - static_cast<long double>(found.azimuth[i]));
      const auto zenith = std::abs(std::atan2(std::sqrt(x * x + y * y), z) -
                                   static_cast<long double>(found.zenith[i]));
      EXPECT_FALSE(std::isnan(found.azimuth[i]) || std::isnan(found.zenith[i])) << i;
      worst = std::max({worst, static_cast<double>(azimuth), static_cast<double>(zenith)});
    }
    EXPECT_LT(worst, 1e-15);
  }
}

// Every lane in turn, because one such lane decides for its neighbours.
TEST(BatchFunctions, AxesQuadrantsAndLostShotsHaveTheirAngles) {
  struct Case {
    Vector3<double> direction;
    double azimuth, zenith;
  };
  const std::vector<Case> cases{
      {{1.0, 0.0, 0.0}, 0.0, kPi / 2},       {{0.0, 1.0, 0.0}, kPi / 2, kPi / 2},
      {{0.0, -1.0, 0.0}, -kPi / 2, kPi / 2}, {{-1.0, 0.0, 0.0}, kPi, kPi / 2},
      {{-1.0, -0.0, 0.0}, -kPi, kPi / 2},    {{0.0, 0.0, 1.0}, 0.0, 0.0},
      {{0.0, 0.0, -1.0}, 0.0, kPi},          {{-0.6, 0.8, 0.0}, std::atan2(0.8, -0.6), kPi / 2},
      {{kNan, kNan, kNan}, kNan, kNan}};
  const Vector3<double> neighbour = normalized(Vector3<double>{1.0, 0.2, -0.1});
  for (const InstructionSet set : available_instruction_sets()) {
    SCOPED_TRACE(to_string(set));
    for (const Case& one : cases) {
      for (std::size_t lane = 0; lane < kMostLanes; ++lane) {
        std::vector<Vector3<double>> directions(kMostLanes, neighbour);
        directions[lane] = one.direction;
        const Angles found = angles_of(directions, set);
        for (std::size_t i = 0; i < kMostLanes; ++i) {
          const double azimuth = i == lane ? one.azimuth : std::atan2(0.2, 1.0);
          const double zenith = i == lane ? one.zenith : std::acos(neighbour.z);
          if (std::isnan(azimuth)) {
            EXPECT_TRUE(std::isnan(found.azimuth[i]) && std::isnan(found.zenith[i]));
          } else {
            EXPECT_NEAR(found.azimuth[i], azimuth, 1e-15);
            EXPECT_NEAR(found.zenith[i], zenith, 1e-15);
          }
        }
      }
    }
  }
}

// A shot's direction does not depend on the shots that happen to be computed with it.
TEST(BatchFunctions, OfALaneDoNotDependOnTheOthers) {
  const std::vector<double> angles = {0.3, 12.5, -400.0, 1e5};
  const std::vector<Vector3<double>> directions = {
      {0.98, 0.019, 0.198}, {0.9, 0.3, 0.316}, {0.99, -0.1, 0.09}, {0.97, 0.2, -0.13}};
  for (const InstructionSet set : available_instruction_sets()) {
    for (std::size_t lane = 0; lane < angles.size(); ++lane) {
      const Sines alone = sines_of(std::vector<double>(kMostLanes, angles[lane]), set);
      const Angles alone_at =
          angles_of(std::vector<Vector3<double>>(kMostLanes, directions[lane]), set);
      for (std::size_t other = 0; other < kMostLanes; ++other) {
        if (other == lane) continue;
        for (const double strange : {1e9, kNan, kInfinity}) {
          std::vector<double> beside(kMostLanes, angles[lane]);
          beside[other] = strange;
          const Sines found = sines_of(beside, set);
          EXPECT_EQ(found.sine[lane], alone.sine[lane]);
          EXPECT_EQ(found.cosine[lane], alone.cosine[lane]);
        }
        for (const Vector3<double>& strange :
             {Vector3<double>{0, 0, 1}, {-1, 0, 0}, {0.6, 0.8, 0}, {kNan, kNan, kNan}}) {
          std::vector<Vector3<double>> beside(kMostLanes, directions[lane]);
          beside[other] = strange;
          const Angles found = angles_of(beside, set);
          EXPECT_EQ(found.azimuth[lane], alone_at.azimuth[lane]);
          EXPECT_EQ(found.zenith[lane], alone_at.zenith[lane]);
        }
      }
    }
  }
}

}  // namespace
}  // namespace risley::batch_functions_test
