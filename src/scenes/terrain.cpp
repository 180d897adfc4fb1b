// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/scenes/terrain.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/core/require.hpp"

#include "scenes/ray.hpp"
#include "scenes/terrain_limits.hpp"

namespace risley::scenes {
namespace {

/// Margin of the boxes of the grid, far above the rounding of coordinates, m.
constexpr double kBoxMargin = 1e-6;
constexpr double kMostCells = 1e6;
/// Walls are not lower, m.
constexpr double kLowestWall = 0.01;
/// Mean cosine of incidence on leaves of all directions.
constexpr double kLeafCosine = 0.5;
/// Number of the random stream; simulations use others.
constexpr std::uint64_t kVillageRoofs = 200, kVillageBushes = 201;

double wave_number(double wavelength) { return kTwoPi / wavelength; }

/// A point on the map from its place along and across a heading.
Vector3<double> on_map(const std::array<double, 2>& center, double heading, double along,
                       double right, double z) {
  const double s = std::sin(heading), c = std::cos(heading);
  return {center[0] + along * s + right * c, center[1] + along * c - right * s, z};
}

void require_within(std::string_view name, double value, const Limits& limits,
                    std::string_view unit) {
  require_between(name, value, static_cast<double>(limits.lowest),
                  static_cast<double>(limits.highest), unit);
}

void require_center(const std::string& of, const std::array<double, 2>& center) {
  require_within(of + ".center[0]", center[0], kPlaceLimits, "m");
  require_within(of + ".center[1]", center[1], kPlaceLimits, "m");
}

void require_heading(const std::string& of, double heading) {
  require_between(of + ".heading", heading, -kTwoPi, kTwoPi, "rad");
}

void require_ground(const Ground& ground) {
  require_within("ground.height", ground.height, kHeightLimits, "m");
  require_between("ground.relief and ground.waves",
                  static_cast<double>(ground.relief.size() + ground.waves.size()), 0, kMostSines,
                  "entries");
  for (const Relief& each : ground.relief) {
    require_within("relief.amplitude", each.amplitude, kAmplitudeLimits, "m");
    require_within("relief.wavelength_x", each.wavelength_x, kWavelengthLimits, "m");
    require_within("relief.wavelength_y", each.wavelength_y, kWavelengthLimits, "m");
  }
  for (const Waves& each : ground.waves) {
    require_within("waves.amplitude", each.amplitude, kAmplitudeLimits, "m");
    require_within("waves.wavelength", each.wavelength, kWavelengthLimits, "m");
    require_heading("waves", each.heading);
  }
}

void require_roof(const GableRoof& roof) {
  require_center(roof.name, roof.center);
  require_within(roof.name + ".length", roof.length, kSizeLimits, "m");
  require_within(roof.name + ".face_width", roof.face_width, kSizeLimits, "m");
  require_between(roof.name + ".pitch", roof.pitch,
                  radians_from_degrees(static_cast<double>(kPitchLimits_deg.lowest)),
                  radians_from_degrees(static_cast<double>(kPitchLimits_deg.highest)), "rad");
  require_within(roof.name + ".ridge_height", roof.ridge_height, kSizeLimits, "m");
  require_heading(roof.name, roof.heading);
  const double eaves = roof.ridge_height - roof.face_width * std::sin(roof.pitch);
  if (eaves < 0) {
    throw InvalidArgument(
        fmt::format("{}: its eaves are {:.3g} m below the ground; raise ridge_height, or make "
                    "face_width or pitch smaller",
                    roof.name, -eaves));
  }
}

void require_village(const VillageSettings& s) {
  require_center("village", s.center);
  require_within("village.half_extent", s.half_extent, kSizeLimits, "m");
  require_between("village.roofs", s.roofs, 0, kMostVillageRoofs);
  require_between("village.bushes", s.bushes, 0, kMostVillageRoofs);
  require_between("village.minimum_distance", s.minimum_distance, 0,
                  static_cast<double>(kSizeLimits.highest), "m");
  const auto require_range = [](std::string_view name, const std::array<double, 2>& range,
                                const Limits& limits, std::string_view unit) {
    require_between(fmt::format("village.{}[0]", name), range[0],
                    static_cast<double>(limits.lowest), static_cast<double>(limits.highest), unit);
    require_between(fmt::format("village.{}[1]", name), range[1], range[0],
                    static_cast<double>(limits.highest), unit);
  };
  if (s.roofs > 0) {
    require_within("village.length", s.length, kSizeLimits, "m");
    require_within("village.face_width", s.face_width, kSizeLimits, "m");
    require_range("pitch", s.pitch,
                  {radians_from_degrees(static_cast<double>(kPitchLimits_deg.lowest)),
                   radians_from_degrees(static_cast<double>(kPitchLimits_deg.highest))},
                  "rad");
    require_range("ridge_height", s.ridge_height, kSizeLimits, "m");
  }
  if (s.bushes > 0) {
    require_range("bush_radius", s.bush_radius, kSizeLimits, "m");
    require_range("bush_height", s.bush_height, kSizeLimits, "m");
  }
}

}  // namespace

double Ground::height_at(double x, double y) const {
  double z = height;
  for (const Relief& each : relief) {
    z += each.amplitude * std::sin(wave_number(each.wavelength_x) * x) *
         std::cos(wave_number(each.wavelength_y) * y);
  }
  for (const Waves& each : waves) {
    const double along = x * std::sin(each.heading) + y * std::cos(each.heading);
    z += each.amplitude * std::sin(wave_number(each.wavelength) * along);
  }
  return z;
}

void add_village(const VillageSettings& settings, TerrainParts& parts) {
  require_village(settings);
  const auto between = [](const std::array<double, 2>& range, double part) {
    return range[0] + part * (range[1] - range[0]);
  };
  const std::array<double, 2> extent{-settings.half_extent, settings.half_extent};
  // Centres by squares of the minimum distance: only those of nine squares can be too near.
  std::multimap<std::pair<long long, long long>, std::array<double, 2>> placed;
  const auto square_of = [&](const std::array<double, 2>& at) {
    const double side = std::max(settings.minimum_distance, 1e-3);
    return std::pair{static_cast<long long>(std::floor(at[0] / side)),
                     static_cast<long long>(std::floor(at[1] / side))};
  };
  const auto is_free = [&](const std::array<double, 2>& at) {
    if (settings.minimum_distance == 0.0) return true;
    const auto [column, row] = square_of(at);
    for (long long c = column - 1; c <= column + 1; ++c) {
      for (long long r = row - 1; r <= row + 1; ++r) {
        const auto [begin, end] = placed.equal_range({c, r});
        for (auto it = begin; it != end; ++it) {
          if (std::hypot(it->second[0] - at[0], it->second[1] - at[1]) <
              settings.minimum_distance) {
            return false;
          }
        }
      }
    }
    return true;
  };
  const RandomStream random(settings.seed, kVillageRoofs);
  constexpr std::uint64_t kDrawsPerTry = 8;
  constexpr int kTries = 300;
  std::uint64_t attempt = 0;
  for (int i = 0; i < settings.roofs; ++i) {
    std::array<double, 2> at{};
    bool found = false;
    for (int tries = 0; tries < kTries && !found; ++tries, ++attempt) {
      at = {settings.center[0] + between(extent, random.uniform(attempt * kDrawsPerTry)),
            settings.center[1] + between(extent, random.uniform(attempt * kDrawsPerTry + 1))};
      found = is_free(at);
    }
    if (!found) {
      throw InvalidArgument(fmt::format(
          "village: only {} of {} roofs fit within +-{:g} m at {:g} m from one another; "
          "ask for fewer, or for a smaller distance",
          i, settings.roofs, settings.half_extent, settings.minimum_distance));
    }
    placed.emplace(square_of(at), at);
    const std::uint64_t draw = (attempt - 1) * kDrawsPerTry;
    GableRoof roof;
    roof.name = fmt::format("village roof {}", i + 1);
    roof.center = at;
    roof.length = settings.length;
    roof.face_width = settings.face_width;
    roof.pitch = between(settings.pitch, random.uniform(draw + 2));
    roof.ridge_height = between(settings.ridge_height, random.uniform(draw + 3));
    roof.heading = kPi * random.uniform(draw + 4);
    roof.walls = settings.walls;
    parts.roofs.push_back(std::move(roof));
  }
  const RandomStream bushes(settings.seed, kVillageBushes);
  for (int i = 0; i < settings.bushes; ++i) {
    const std::uint64_t draw = static_cast<std::uint64_t>(i) * kDrawsPerTry;
    Bush bush;
    bush.name = fmt::format("village bush {}", i + 1);
    bush.center = {settings.center[0] + between(extent, bushes.uniform(draw)),
                   settings.center[1] + between(extent, bushes.uniform(draw + 1))};
    bush.radius = between(settings.bush_radius, bushes.uniform(draw + 2));
    bush.height = between(settings.bush_height, bushes.uniform(draw + 3));
    parts.bushes.push_back(std::move(bush));
  }
}

Terrain::Terrain(TerrainParts parts) : parts_(std::move(parts)) {
  if (parts_.origin) {
    require_between("origin.latitude", parts_.origin->latitude, -kPi / 2, kPi / 2, "rad");
    require_between("origin.longitude", parts_.origin->longitude, -kTwoPi, kTwoPi, "rad");
    require_within("origin.height", parts_.origin->height, kHeightLimits, "m");
  }
  if (parts_.ground) require_ground(*parts_.ground);
  for (const GableRoof& roof : parts_.roofs) require_roof(roof);
  for (const Building& each : parts_.buildings) {
    require_center(each.name, each.center);
    require_within(each.name + ".size[0]", each.size[0], kSizeLimits, "m");
    require_within(each.name + ".size[1]", each.size[1], kSizeLimits, "m");
    require_within(each.name + ".height", each.height, kSizeLimits, "m");
    require_heading(each.name, each.heading);
  }
  for (const Bush& bush : parts_.bushes) {
    require_center(bush.name, bush.center);
    require_within(bush.name + ".radius", bush.radius, kSizeLimits, "m");
    require_within(bush.name + ".height", bush.height, kSizeLimits, "m");
  }
  const Ground ground = parts_.ground.value_or(Ground{});
  for (const Relief& each : ground.relief) {  // sin a cos b = (sin(a + b) + sin(a - b)) / 2
    const double x = wave_number(each.wavelength_x), y = wave_number(each.wavelength_y);
    sines_.push_back({0.5 * each.amplitude, x, y});
    sines_.push_back({0.5 * each.amplitude, x, -y});
  }
  for (const Waves& each : ground.waves) {
    const double wave = wave_number(each.wavelength);
    sines_.push_back(
        {each.amplitude, wave * std::sin(each.heading), wave * std::cos(each.heading)});
  }
  std::erase_if(sines_, [](const Sine& sine) { return sine.amplitude == 0.0; });
  for (const Sine& sine : sines_) swing_ += sine.amplitude;
  const double lowest = ground.height - swing_;
  for (const GableRoof& roof : parts_.roofs) add_roof(roof, lowest);
  for (const Building& building : parts_.buildings) add_building(building, lowest);
  for (const Bush& bush : parts_.bushes) {
    const double floor = ground.height_at(bush.center[0], bush.center[1]);
    bush_floor_.push_back(floor);
    boxes_.push_back(
        {{bush.center[0] - bush.radius, bush.center[1] - bush.radius, floor},
         {bush.center[0] + bush.radius, bush.center[1] + bush.radius, floor + bush.height}});
  }
  if (surfaces() == 0) {
    throw InvalidArgument("a terrain needs ground, roofs, buildings or bushes");
  }
  fill_grid();
}

void Terrain::add_face(std::string name, std::vector<Vector3<double>> corners) {
  Face face;
  face.name = std::move(name);
  face.corners = std::move(corners);
  const auto& at = face.corners;
  face.normal = normalized(cross(at[1] - at[0], at[2] - at[0]));
  Slab slab{face.normal, dot(face.normal, at[0]), edges_.size(), edges_.size() + at.size()};
  Box box{at[0], at[0]};
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Vector3<double> inside = normalized(cross(face.normal, at[(i + 1) % at.size()] - at[i]));
    edges_.push_back({inside, dot(inside, at[i]) - kSeam});
    box.low = {std::min(box.low.x, at[i].x), std::min(box.low.y, at[i].y),
               std::min(box.low.z, at[i].z)};
    box.high = {std::max(box.high.x, at[i].x), std::max(box.high.y, at[i].y),
                std::max(box.high.z, at[i].z)};
  }
  slabs_.push_back(slab);
  boxes_.push_back(box);
  faces_.push_back(std::move(face));
}

void Terrain::add_roof(const GableRoof& roof, double lowest) {
  const double ridge = parts_.ground.value_or(Ground{}).height_at(roof.center[0], roof.center[1]) +
                       roof.ridge_height;
  const double half_length = 0.5 * roof.length;
  const double span = roof.face_width * std::cos(roof.pitch);
  const double eaves = ridge - roof.face_width * std::sin(roof.pitch);
  const auto at = [&](double along, double right, double z) {
    return on_map(roof.center, roof.heading, along * half_length, right * span, z);
  };
  add_face(roof.name + ", right face",
           {at(1, 0, ridge), at(-1, 0, ridge), at(-1, 1, eaves), at(1, 1, eaves)});
  add_face(roof.name + ", left face",
           {at(-1, 0, ridge), at(1, 0, ridge), at(1, -1, eaves), at(-1, -1, eaves)});
  const double foot = std::min(lowest, eaves - kLowestWall);
  if (!roof.walls) return;
  add_face(roof.name + ", right wall",
           {at(1, 1, eaves), at(-1, 1, eaves), at(-1, 1, foot), at(1, 1, foot)});
  add_face(roof.name + ", left wall",
           {at(-1, -1, eaves), at(1, -1, eaves), at(1, -1, foot), at(-1, -1, foot)});
  add_face(roof.name + ", front wall",
           {at(1, -1, foot), at(1, -1, eaves), at(1, 0, ridge), at(1, 1, eaves), at(1, 1, foot)});
  add_face(roof.name + ", rear wall", {at(-1, 1, foot), at(-1, 1, eaves), at(-1, 0, ridge),
                                       at(-1, -1, eaves), at(-1, -1, foot)});
}

void Terrain::add_building(const Building& building, double lowest) {
  const double top =
      parts_.ground.value_or(Ground{}).height_at(building.center[0], building.center[1]) +
      building.height;
  const double foot = std::min(lowest, top - kLowestWall);
  const auto at = [&](double along, double right, double z) {
    return on_map(building.center, building.heading, along * 0.5 * building.size[0],
                  right * 0.5 * building.size[1], z);
  };
  add_face(building.name + ", top",
           {at(1, 1, top), at(1, -1, top), at(-1, -1, top), at(-1, 1, top)});
  add_face(building.name + ", right wall",
           {at(1, 1, top), at(-1, 1, top), at(-1, 1, foot), at(1, 1, foot)});
  add_face(building.name + ", left wall",
           {at(-1, -1, top), at(1, -1, top), at(1, -1, foot), at(-1, -1, foot)});
  add_face(building.name + ", front wall",
           {at(1, -1, top), at(1, 1, top), at(1, 1, foot), at(1, -1, foot)});
  add_face(building.name + ", rear wall",
           {at(-1, 1, top), at(-1, -1, top), at(-1, -1, foot), at(-1, 1, foot)});
}

void Terrain::fill_grid() {
  if (boxes_.empty()) return;
  for (Box& box : boxes_) {
    const Vector3<double> margin{kBoxMargin, kBoxMargin, kBoxMargin};
    box = {box.low - margin, box.high + margin};
  }
  around_ = boxes_.front();
  for (const Box& box : boxes_) {
    around_.low = {std::min(around_.low.x, box.low.x), std::min(around_.low.y, box.low.y),
                   std::min(around_.low.z, box.low.z)};
    around_.high = {std::max(around_.high.x, box.high.x), std::max(around_.high.y, box.high.y),
                    std::max(around_.high.z, box.high.z)};
  }
  const double width = around_.high.x - around_.low.x, depth = around_.high.y - around_.low.y;
  const auto items = static_cast<double>(boxes_.size());
  cell_ = std::max(std::sqrt(width * depth / std::min(2.0 * items, kMostCells)),
                   std::max(width, depth) / std::sqrt(kMostCells));
  const auto cell_of = [&](double place, double low, std::size_t count) {
    const double cell = std::floor((place - low) / cell_);
    return static_cast<std::size_t>(std::clamp(cell, 0.0, static_cast<double>(count - 1)));
  };
  const auto for_each_cell = [&](const Box& box, auto&& visit) {
    const std::size_t end_column = cell_of(box.high.x, around_.low.x, columns_) + 1;
    const std::size_t end_row = cell_of(box.high.y, around_.low.y, rows_) + 1;
    for (std::size_t row = cell_of(box.low.y, around_.low.y, rows_); row < end_row; ++row) {
      for (std::size_t column = cell_of(box.low.x, around_.low.x, columns_); column < end_column;
           ++column) {
        visit(column + row * columns_);
      }
    }
  };
  while (true) {  // large faces among many small ones make cells larger
    columns_ = static_cast<std::size_t>(std::floor(width / cell_)) + 1;
    rows_ = static_cast<std::size_t>(std::floor(depth / cell_)) + 1;
    double entries = 0;
    for (const Box& box : boxes_) {
      entries += (std::floor((box.high.x - box.low.x) / cell_) + 2) *
                 (std::floor((box.high.y - box.low.y) / cell_) + 2);
    }
    if (entries <= 64.0 * items + 1024.0 || columns_ * rows_ == 1) break;
    cell_ *= 2.0;
  }
  first_.assign(columns_ * rows_ + 1, 0);
  for (const Box& box : boxes_) for_each_cell(box, [&](std::size_t cell) { ++first_[cell + 1]; });
  for (std::size_t cell = 0; cell + 1 < first_.size(); ++cell) first_[cell + 1] += first_[cell];
  items_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t item = 0; item < boxes_.size(); ++item) {
    for_each_cell(boxes_[item], [&](std::size_t cell) {
      items_[next[cell]++] = static_cast<std::uint32_t>(item);
    });
  }
}

std::size_t Terrain::surfaces() const {
  return faces_.size() + parts_.bushes.size() + (parts_.ground ? 1 : 0);
}

std::string Terrain::surface_name(std::size_t surface) const {
  require_place("surface", surface, surfaces());
  if (surface < faces_.size()) return faces_[surface].name;
  const std::size_t bush = surface - faces_.size();
  return bush < parts_.bushes.size() ? parts_.bushes[bush].name : "ground";
}

void Terrain::meet_face(std::size_t face, const Vector3<double>& origin,
                        const Vector3<double>& direction, std::optional<Hit>& nearest,
                        double farthest) const {
  const Slab& slab = slabs_[face];
  const double approach = dot(slab.normal, direction);
  if (approach == 0.0) return;
  const double range = (slab.offset - dot(slab.normal, origin)) / approach;
  if (!(range > 0.0 && range <= farthest) || (nearest && range >= nearest->range)) return;
  const Vector3<double> point = origin + range * direction;
  for (std::size_t edge = slab.first_edge; edge < slab.end_edge; ++edge) {
    if (dot(edges_[edge].normal, point) < edges_[edge].offset) return;
  }
  nearest = Hit{range, std::min(1.0, std::abs(approach)), face, slab.normal};
}

void Terrain::meet_bush(std::size_t bush, const Vector3<double>& origin,
                        const Vector3<double>& direction, double penetration,
                        std::optional<Hit>& nearest, double farthest) const {
  const Bush& each = parts_.bushes[bush];
  const double across = 1.0 / each.radius, up = 2.0 / each.height;
  const Vector3<double> from{(origin.x - each.center[0]) * across,
                             (origin.y - each.center[1]) * across,
                             (origin.z - bush_floor_[bush]) * up - 1.0};
  const Vector3<double> along{direction.x * across, direction.y * across, direction.z * up};
  // |from + t along| = 1, from the point of the ray that is nearest to the centre.
  const double square = dot(along, along);
  const double middle = -dot(from, along) / square;
  const Vector3<double> at = from + middle * along;
  const double rest = 1.0 - dot(at, at);
  if (!(rest > 0.0)) return;
  const double half = std::sqrt(rest / square);
  const double enter = std::max(0.0, middle - half), leave = middle + half;
  if (leave <= 0.0) return;
  const double range = enter + penetration * (leave - enter);
  if (!(range > 0.0 && range <= farthest) || (nearest && range >= nearest->range)) return;
  nearest = Hit{range, kLeafCosine, faces_.size() + bush, -direction};
}

void Terrain::meet_ground(const Vector3<double>& origin, const Vector3<double>& direction,
                          std::optional<Hit>& nearest, double farthest) const {
  const double mean = parts_.ground->height;
  const double end = nearest ? std::min(nearest->range, farthest) : farthest;
  const std::size_t surface = surfaces() - 1;
  if (sines_.empty()) {
    if (direction.z == 0.0) return;
    const double range = (mean - origin.z) / direction.z;
    if (range > 0.0 && range < end) {
      nearest = Hit{range, std::abs(direction.z), surface, {0.0, 0.0, 1.0}};
    }
    return;
  }
  double enter = 0.0, leave = std::min(end, kFarthestGround);
  clip(origin.z, direction.z, mean - swing_ - kSeam, mean + swing_ + kSeam, enter, leave);
  if (enter > leave) return;

  // f(t) = height of the ray above the ground. |f''| <= bend and |f'| <= slope everywhere.
  double bend = 0.0, slope = std::abs(direction.z);
  for (const Sine& sine : sines_) {
    const double wave = sine.wave_x * direction.x + sine.wave_y * direction.y;
    bend += sine.amplitude * wave * wave;
    slope += std::abs(sine.amplitude * wave);
  }
  double gradient_x = 0, gradient_y = 0, height = 0, rise = 0;
  const auto look = [&](double t) {
    const Vector3<double> at = origin + t * direction;
    height = at.z - mean;
    gradient_x = gradient_y = 0;
    for (const Sine& sine : sines_) {
      const double phase = sine.wave_x * at.x + sine.wave_y * at.y;
      height -= sine.amplitude * std::sin(phase);
      const double change = sine.amplitude * std::cos(phase);
      gradient_x += sine.wave_x * change;
      gradient_y += sine.wave_y * change;
    }
    rise = direction.z - gradient_x * direction.x - gradient_y * direction.y;
  };
  double t = enter;
  look(t);
  double side = height < 0.0 ? -1.0 : 1.0;
  if (t == 0.0 && std::abs(height) < kSeam) {  // begins on the ground: it leaves it before it ends
    if (rise == 0.0 || bend == 0.0) return;
    side = rise < 0.0 ? -1.0 : 1.0;
    t = std::abs(rise) / bend;
    look(t);
  }
  while (t <= leave) {
    // As long as f + f' s - bend s^2 / 2 > 0 or f - slope s > 0 the ray does not meet the ground.
    const double gap = side * height, away = side * rise;
    if (!(gap > 0.0)) break;
    const double root = std::sqrt(away * away + 2.0 * bend * gap);
    const double bent =
        away < 0.0 ? 2.0 * gap / (root - away) : (bend > 0.0 ? (away + root) / bend : kInfinite);
    const double step = std::max(bent, gap / slope);
    if (step <= 4e-16 * t) break;
    t += step;
    if (t <= leave) look(t);
  }
  if (!(t > 0.0 && t <= leave) || t >= end) return;
  const double length = std::sqrt(1.0 + gradient_x * gradient_x + gradient_y * gradient_y);
  nearest = Hit{t, std::min(1.0, std::abs(rise) / length), surface,
                (1.0 / length) * Vector3<double>{-gradient_x, -gradient_y, 1.0}};
}

std::optional<Hit> Terrain::nearest_hit(const Vector3<double>& origin,
                                        const Vector3<double>& direction, double farthest,
                                        double penetration) const {
  std::optional<Hit> nearest;
  double enter = 0.0, leave = farthest;
  if (!boxes_.empty()) {
    clip(origin.x, direction.x, around_.low.x, around_.high.x, enter, leave);
    clip(origin.y, direction.y, around_.low.y, around_.high.y, enter, leave);
    clip(origin.z, direction.z, around_.low.z, around_.high.z, enter, leave);
  } else {
    leave = -kInfinite;
  }
  if (enter <= leave) {
    const auto cell_at = [&](double place, double low, std::size_t count) {
      const double cell = std::floor((place - low) / cell_);
      return static_cast<std::ptrdiff_t>(std::clamp(cell, 0.0, static_cast<double>(count - 1)));
    };
    std::ptrdiff_t column = cell_at(origin.x + enter * direction.x, around_.low.x, columns_);
    std::ptrdiff_t row = cell_at(origin.y + enter * direction.y, around_.low.y, rows_);
    const auto edge_at = [&](std::ptrdiff_t cell, double from, double low, double towards) {
      if (towards == 0.0) return kInfinite;
      const double edge = low + static_cast<double>(cell + (towards > 0.0 ? 1 : 0)) * cell_;
      return (edge - from) / towards;
    };
    while (true) {
      const auto cell = static_cast<std::size_t>(column) + static_cast<std::size_t>(row) * columns_;
      for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
        const std::size_t item = items_[i];
        if (item < faces_.size()) {
          meet_face(item, origin, direction, nearest, farthest);
        } else {
          meet_bush(item - faces_.size(), origin, direction, penetration, nearest, farthest);
        }
      }
      const double next_column = edge_at(column, origin.x, around_.low.x, direction.x);
      const double next_row = edge_at(row, origin.y, around_.low.y, direction.y);
      const double next = std::min(next_column, next_row);
      if (next > leave || (nearest && nearest->range <= next)) break;
      if (next_column <= next_row) {
        column += direction.x > 0.0 ? 1 : -1;
        if (column < 0 || column >= static_cast<std::ptrdiff_t>(columns_)) break;
      } else {
        row += direction.y > 0.0 ? 1 : -1;
        if (row < 0 || row >= static_cast<std::ptrdiff_t>(rows_)) break;
      }
    }
  }
  if (parts_.ground) meet_ground(origin, direction, nearest, farthest);
  return nearest;
}

}  // namespace risley::scenes
