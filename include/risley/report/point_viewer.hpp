// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "risley/report/chart.hpp"

namespace risley::report {

/// A colouring of points: 0 to 254 are evenly spaced between the values at the ends of the colours,
/// which also represent values beyond; kUnknownCode: not known.
struct PointColouring {
  static constexpr std::uint8_t kUnknownCode = 255;  ///< of a value that is not known

  std::string label;                ///< with its unit: "angle of incidence, deg"
  std::pair<double, double> range;  ///< values at the ends of the colours
  std::vector<std::uint8_t> code;   ///< [points]
  Palette palette = Palette::sequential;
};

/// Colours between two values. @param value  [points], NaN where not known
PointColouring colouring_between(std::string label, std::span<const float> value,
                                 std::pair<double, double> range,
                                 Palette palette = Palette::sequential);
/// Colours for the range of most values; nothing when none is known. @param value  as above
std::optional<PointColouring> usual_colouring(std::string label, std::span<const float> value);

/// Points for the viewer, columns of one length.
struct PointsToView {
  std::array<std::string, 3> axes;              ///< of the coordinates: "east", "north", "up"
  std::array<double, 3> offset{};               ///< of the coordinates, m
  std::span<const float> x, y, z;               ///< from the offset on, m
  std::vector<PointColouring> colourings = {};  ///< in the order of the choice, the first is shown
  std::size_t height_at = 0;  ///< position of the height, which is offered too, in the choice
  double dot = 0;             ///< width of the area that a point represents, m; 0: only itself
  std::string words = {};     ///< text of the page, a sentence or two
  std::string note = {};      ///< which points are shown
};

/// A viewer of points in three dimensions that fills the window, for page_html(): viewer.js draws
/// it with three.js. The points stand in an octree. Each node has evenly spread points, its
/// children those between them, so that a view needs only nodes that are large on the screen. A
/// node is unpacked when a view needs it. docs/decisions/0006-pages-of-results.md
class PointViewer {
 public:
  /// @throws InvalidArgument for no points and for columns of different lengths
  explicit PointViewer(const PointsToView& view);

  /// The packing of points, and the location of each node, as JSON.
  const std::string& json() const { return json_; }
  /// The points of each node, parents before their children: base64 of zlib's stream of, for each
  /// axis, the low, middle and high bytes of the steps from point to point (zigzag, the first from
  /// the node's corner), then for each colouring the differences of the codes.
  const std::vector<std::string>& nodes() const { return nodes_; }

 private:
  std::string json_;
  std::vector<std::string> nodes_;
};

}  // namespace risley::report
