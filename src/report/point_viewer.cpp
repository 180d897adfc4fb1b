// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/point_viewer.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <new>
#include <utility>

#include <zlib.h>

#include "risley/core/require.hpp"
#include "risley/hashes/base64.hpp"
#include "risley/parallel/parallel.hpp"

namespace risley::report {

using json::Json;

namespace {

constexpr double kLowShare = 0.02, kHighShare = 0.98;  // where colours end
constexpr double kFinestStep = 0.0005;                 // of coordinates, m
constexpr int kMostBits = 23;                          // of a coordinate
constexpr int kKeyBits = 21;                           // of each of them in a key
constexpr int kGridBits = 7;                 // a node has a point in each of 128^3 cells at most
constexpr std::size_t kLeafPoints = 30'000;  // are not divided further
constexpr int kCompression = 6;              // of zlib, 1-9
constexpr double kLastCode = 254;

using Place = std::array<std::uint32_t, 3>;

/// Coordinates as whole steps from the corner of a cube.
struct Lattice {
  std::array<double, 3> corner;  ///< m
  double step;                   ///< m
  int bits;                      ///< the cube is 2^bits steps wide

  explicit Lattice(const PointsToView& view) : corner(), step(kFinestStep), bits(0) {
    double widest = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto [least, greatest] = std::ranges::minmax(column(view, axis));
      corner[axis] = least;
      widest = std::max(widest, static_cast<double>(greatest) - least);
    }
    step = std::max(step, widest / ((1 << kMostBits) - 2));
    bits = std::bit_width(static_cast<std::uint32_t>(widest / step) + 1);
  }

  static std::span<const float> column(const PointsToView& view, std::size_t axis) {
    return axis == 0 ? view.x : axis == 1 ? view.y : view.z;
  }

  Place place(const PointsToView& view, std::size_t point) const {
    Place result;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = column(view, axis)[point];
      result[axis] = static_cast<std::uint32_t>(std::lround((value - corner[axis]) / step));
    }
    return result;
  }
};

/// Bits with two zeros after each.
std::uint64_t spread(std::uint64_t bits) {
  bits &= 0x1fffff;
  bits = (bits | bits << 32) & 0x1f00000000ffff;
  bits = (bits | bits << 16) & 0x1f0000ff0000ff;
  bits = (bits | bits << 8) & 0x100f00f00f00f00f;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3;
  return (bits | bits << 2) & 0x1249249249249249;
}

struct Entry {
  std::uint64_t key;  ///< the bits of x, y and z in turn, the highest first
  std::uint32_t point;
};

struct Node {
  std::size_t parent = 0;
  unsigned octant = 0;  ///< within the parent: 4 for x, 2 for y, 1 for z
  int level = 0;
  std::vector<std::uint32_t> points;
};

/// The nodes of points in the order of their keys, parents before children.
class Octree {
 public:
  Octree(std::vector<Entry> entries, int key_bits)
      : entries_(std::move(entries)), key_bits_(key_bits) {
    std::vector<Range> next{{0, entries_.size()}};
    nodes.emplace_back();
    for (std::size_t number = 0; number < nodes.size(); ++number) {
      divide(number, next[number], next);
    }
  }

  std::vector<Node> nodes;

 private:
  struct Range {
    std::size_t begin, end;
  };

  /// Gives a node its points, and the rest to its children.
  void divide(std::size_t number, const Range range, std::vector<Range>& next) {
    const int level = nodes[number].level, cell_shift = 3 * (key_bits_ - level - kGridBits);
    std::vector<std::uint32_t> points;
    if (range.end - range.begin <= kLeafPoints || cell_shift <= 0) {
      for (std::size_t i = range.begin; i < range.end; ++i) points.push_back(entries_[i].point);
      nodes[number].points = std::move(points);
      return;
    }
    std::size_t rest = range.begin;
    for (std::size_t i = range.begin; i < range.end;) {
      std::size_t end = i + 1;
      const std::uint64_t cell = entries_[i].key >> cell_shift;
      while (end < range.end && entries_[end].key >> cell_shift == cell) ++end;
      const std::size_t chosen = i + lot(cell) % (end - i);
      points.push_back(entries_[chosen].point);
      for (; i < end; ++i) {
        if (i != chosen) entries_[rest++] = entries_[i];
      }
    }
    nodes[number].points = std::move(points);
    const int octant_shift = 3 * (key_bits_ - level - 1);
    for (std::size_t i = range.begin; i < rest;) {
      std::size_t end = i + 1;
      const std::uint64_t octant = entries_[i].key >> octant_shift;
      while (end < rest && entries_[end].key >> octant_shift == octant) ++end;
      nodes.push_back({number, static_cast<unsigned>(octant & 7), level + 1, {}});
      next.push_back({i, end});
      i = end;
    }
  }

  /// A pseudo-random number, always the same for a cell [Steele, Lea, Flood 2014: SplitMix64].
  static std::uint64_t lot(std::uint64_t cell) {
    cell += 0x9e3779b97f4a7c15;
    cell = (cell ^ cell >> 30) * 0xbf58476d1ce4e5b9;
    cell = (cell ^ cell >> 27) * 0x94d049bb133111eb;
    return cell ^ cell >> 31;
  }

  std::vector<Entry> entries_;
  int key_bits_;
};

Octree octree_of(const PointsToView& view, const Lattice& lattice) {
  const int key_bits = std::min(lattice.bits, kKeyBits), shift = lattice.bits - key_bits;
  std::vector<Entry> entries(view.x.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Place at = lattice.place(view, i);
    entries[i] = {
        spread(at[0] >> shift) << 2 | spread(at[1] >> shift) << 1 | spread(at[2] >> shift),
        static_cast<std::uint32_t>(i)};
  }
  std::ranges::sort(entries, {}, [](const Entry& one) { return std::pair{one.key, one.point}; });
  return {std::move(entries), key_bits};
}

std::string compressed(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), kCompression) != Z_OK) {
    throw std::bad_alloc();  // there is no other reason
  }
  result.resize(size);
  return result;
}

std::string packed(const PointsToView& view, const Lattice& lattice, const Place& corner,
                   const std::vector<std::uint32_t>& points) {
  const std::size_t n = points.size();
  std::string bytes((9 + view.colourings.size()) * n, '\0');
  Place before = corner;
  for (std::size_t i = 0; i < n; ++i) {
    const Place at = lattice.place(view, points[i]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto step = static_cast<std::int32_t>(at[axis] - before[axis]);
      const auto zigzag =
          static_cast<std::uint32_t>(step) << 1 ^ static_cast<std::uint32_t>(step >> 31);
      for (std::size_t k = 0; k < 3; ++k) {
        bytes[(3 * axis + k) * n + i] = static_cast<char>(zigzag >> 8 * k & 0xff);
      }
    }
    before = at;
  }
  for (std::size_t k = 0; k < view.colourings.size(); ++k) {
    unsigned last = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const unsigned code = view.colourings[k].code[points[i]];
      bytes[(9 + k) * n + i] = static_cast<char>((code - last) & 0xff);
      last = code;
    }
  }
  return hashes::base64(compressed(bytes));
}

/// Range of most values, of those that are known.
std::optional<std::pair<double, double>> usual_range(std::span<const float> values) {
  std::vector<float> known;
  std::ranges::copy_if(values, std::back_inserter(known), [](float v) { return std::isfinite(v); });
  if (known.empty()) return std::nullopt;
  const auto at = [&](double share) {
    const auto place =
        known.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(known.size() - 1));
    std::ranges::nth_element(known, place);
    return static_cast<double>(*place);
  };
  const double low = at(kLowShare), high = at(kHighShare);
  return std::pair{low, high > low ? high : low + 1};
}

Json colouring_json(const PointColouring& one) {
  return {{"label", one.label},
          {"range", one.range},
          {"unknown", std::ranges::count(one.code, PointColouring::kUnknownCode)},
          {"palette", one.palette == Palette::diverging ? "diverging" : "sequential"}};
}

}  // namespace

PointColouring colouring_between(std::string label, std::span<const float> value,
                                 std::pair<double, double> range, Palette palette) {
  PointColouring result{std::move(label), range, std::vector<std::uint8_t>(value.size()), palette};
  std::ranges::transform(value, result.code.begin(), [&](float one) {
    if (std::isnan(one)) return PointColouring::kUnknownCode;
    const double share = (one - range.first) / (range.second - range.first);
    return static_cast<std::uint8_t>(std::lround(std::clamp(kLastCode * share, 0.0, kLastCode)));
  });
  return result;
}

std::optional<PointColouring> usual_colouring(std::string label, std::span<const float> value) {
  const auto range = usual_range(value);
  if (!range) return std::nullopt;
  return colouring_between(std::move(label), value, *range);
}

PointViewer::PointViewer(const PointsToView& view) {
  const std::size_t n = view.x.size();
  require_above("points to view", static_cast<double>(n), 0, "");
  require_length("y", view.y.size(), n);
  require_length("z", view.z.size(), n);
  for (const PointColouring& one : view.colourings) require_length(one.label, one.code.size(), n);

  const Lattice lattice(view);
  const Octree tree = octree_of(view, lattice);
  std::vector<Place> corners(tree.nodes.size());
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const Node& node = tree.nodes[i];
    corners[i] = corners[node.parent];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      corners[i][axis] += (node.octant >> (2 - axis) & 1) << (lattice.bits - node.level);
    }
  }
  nodes_.resize(tree.nodes.size());
  parallel::for_each(nodes_.size(), [&](std::size_t i) {
    nodes_[i] = packed(view, lattice, corners[i], tree.nodes[i].points);
  });

  Json colourings = Json::array(), parents = Json::array(), octants = Json::array(),
       counts = Json::array(), middle = Json::array();
  for (const PointColouring& one : view.colourings) colourings.push_back(colouring_json(one));
  for (const Node& node : tree.nodes) {
    parents.push_back(node.parent);
    octants.push_back(node.octant);
    counts.push_back(node.points.size());
  }
  double radius = 0;
  std::pair<double, double> height;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    height = usual_range(Lattice::column(view, axis)).value();  // the last one stays
    middle.push_back((height.first + height.second) / 2);
    radius = std::hypot(radius, (height.second - height.first) / 2);
  }
  height.first += view.offset[2];
  height.second += view.offset[2];
  json_ = json_in_script(
      {{"axes", view.axes},
       {"offset_m", view.offset},
       {"corner_m", lattice.corner},
       {"step_m", lattice.step},
       {"bits", lattice.bits},
       {"grid", 1 << kGridBits},
       {"points", n},
       {"colourings", colourings},
       {"height_at", view.height_at},
       {"height", {{"label", view.axes[2] + ", m"}, {"range", height}, {"palette", "sequential"}}},
       {"middle_m", middle},
       {"radius_m", radius},
       {"dot_m", view.dot},
       {"words", view.words},
       {"note", view.note},
       {"parents", parents},
       {"octants", octants},
       {"counts", counts}});
}

}  // namespace risley::report
