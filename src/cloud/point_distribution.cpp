// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/point_distribution.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <set>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"
#include "risley/parallel/parallel.hpp"

#include "cloud/ground_tiles.hpp"

namespace risley::cloud {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kFarthestPoint = 1e8;                           // from the map's origin, m
constexpr double kWidestFlight = 1e6;                            // m
constexpr double kHistogramBin = 0.05, kWidestHistogram = 5000;  // m
constexpr double kMiddleStripe = 1;                              // m
constexpr double kPlaceStripe = 0.02, kProfileStripe = 0.02, kProfileReach = 1.4;  // of R
constexpr double kRim = 0.05;  // of the field of view
constexpr double kVariationWithin = 0.9, kCirclesWithin = 0.97, kSpacingWithin = 0.95;
constexpr std::array<double, 2> kThirds{0.3, 0.7};  // of R
/// Radius of the empty circle in pixels. The number of pixels with their centre within it equals
/// its area to 0.6 %: 253 of 254.5.
constexpr std::int32_t kRadiusPixels = 9;
constexpr std::int32_t kBlockPixels = 1024, kHaloPixels = 16 * kRadiusPixels;

/// A rectangle along a strip's line.
struct Stretch {
  std::array<double, 2> origin{0, 0}, along{1, 0};  // m, unit vector
  double first = 0, last = 0;                       // along the line, m
  double middle = 0, half = 0;                      // to the left of it, m

  double place_along(double x, double y) const {
    return (x - origin[0]) * along[0] + (y - origin[1]) * along[1];
  }
  /// From the middle, to the left.
  double place_across(double x, double y) const {
    return (y - origin[1]) * along[0] - (x - origin[0]) * along[1] - middle;
  }
  bool holds(double x, double y) const {
    const double s = place_along(x, y);
    return s >= first && s <= last && std::abs(place_across(x, y)) <= half;
  }
  double area() const { return last > first ? 2 * half * (last - first) : 0; }
  Stretch narrowed(double share) const {
    Stretch own = *this;
    own.half *= share;
    return own;
  }
};

/// Calls visit(column, row) for the squares whose centre a stretch holds.
template <class Visit>
void for_each_square(const Stretch& stretch, double edge, Visit visit) {
  if (!(stretch.area() > 0)) return;
  std::array<std::array<double, 2>, 4> corners;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t k = 0; k < 4; ++k) {
    const double s = k == 0 || k == 3 ? stretch.first : stretch.last;
    const double y = stretch.middle + (k < 2 ? -stretch.half : stretch.half);
    corners[k] = {stretch.origin[0] + s * stretch.along[0] - y * stretch.along[1],
                  stretch.origin[1] + s * stretch.along[1] + y * stretch.along[0]};
    low = std::min(low, corners[k][1]);
    high = std::max(high, corners[k][1]);
  }
  for (std::int32_t row = cell_number(low, edge); row <= cell_number(high, edge); ++row) {
    const double y = (row + 0.5) * edge;
    double left = std::numeric_limits<double>::infinity(), right = -left;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto& a = corners[k];
      const auto& b = corners[(k + 1) % 4];
      if ((a[1] <= y) == (b[1] <= y)) continue;
      const double x = a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]);
      left = std::min(left, x);
      right = std::max(right, x);
    }
    if (!(left <= right)) continue;
    const auto begin = static_cast<std::int32_t>(std::ceil(left / edge - 0.5));
    const auto end = static_cast<std::int32_t>(std::floor(right / edge - 0.5));
    for (std::int32_t column = begin; column <= end; ++column) visit(column, row);
  }
}

/// Counts across a strip, fine enough for stripes to begin anywhere.
class AcrossHistogram {
 public:
  void add(double across) {
    if (!(std::abs(across) < kWidestHistogram)) return;
    std::vector<std::uint32_t>& side = across < 0 ? right_ : left_;
    const auto bin = static_cast<std::size_t>(std::abs(across) / kHistogramBin);
    if (bin >= side.size()) side.resize(bin + 1);
    ++side[bin];
  }
  /// Points from one distance to a greater one, to the left.
  double between(double from, double to) const { return up_to(to) - up_to(from); }

 private:
  /// Points from the line to there, negative on its right.
  double up_to(double across) const {
    const std::vector<std::uint32_t>& side = across < 0 ? right_ : left_;
    const double bins = std::abs(across) / kHistogramBin;
    const auto whole = std::min(side.size(), static_cast<std::size_t>(bins));
    double sum = 0;
    for (std::size_t i = 0; i < whole; ++i) sum += side[i];
    if (whole < side.size()) sum += (bins - static_cast<double>(whole)) * side[whole];
    return across < 0 ? -sum : sum;
  }
  std::vector<std::uint32_t> left_, right_;
};

/// Empty circles found in a piece of ground.
struct EmptyCircles {
  std::uint64_t places = 0, empty = 0;
  std::array<std::int32_t, 3> largest{};  // squared radius, pixels
};

/// Distances to the next point of the pixels of one block.
EmptyCircles circles_of_block(const TileMap<PixelTile>& pixels, std::int32_t block_column,
                              std::int32_t block_row, const Stretch& stretch, double half_swath,
                              double pixel) {
  constexpr std::int32_t kWide = kBlockPixels + 2 * kHaloPixels;
  constexpr auto kStride = static_cast<std::size_t>(kWide);
  constexpr std::uint8_t kFar = kHaloPixels;  // pixels: no point in reach
  static_assert(kHaloPixels < 256);
  const std::int32_t first_column = block_column * kBlockPixels - kHaloPixels;
  const std::int32_t first_row = block_row * kBlockPixels - kHaloPixels;
  // Distance to the next point of the same column.
  std::vector<std::uint8_t> up(kStride * kStride, kFar);
  for (std::int32_t j = divided(first_row, kTilePixels);
       j <= divided(first_row + kWide - 1, kTilePixels); ++j) {
    for (std::int32_t i = divided(first_column, kTilePixels);
         i <= divided(first_column + kWide - 1, kTilePixels); ++i) {
      const PixelTile* tile = pixels.find(i, j);
      if (tile == nullptr) continue;
      for (std::int32_t y = 0; y < kTilePixels; ++y) {
        const std::int32_t row = j * kTilePixels + y - first_row;
        if (row < 0 || row >= kWide) continue;
        for (std::uint64_t bits = (*tile)[y]; bits != 0; bits &= bits - 1) {
          const std::int32_t column = i * kTilePixels + std::countr_zero(bits) - first_column;
          if (column < 0 || column >= kWide) continue;
          up[static_cast<std::size_t>(row) * kStride + static_cast<std::size_t>(column)] = 0;
        }
      }
    }
  }
  const auto next = [](std::uint8_t value) {
    return static_cast<std::uint8_t>(std::min<int>(value + 1, kFar));
  };
  for (std::size_t at = kStride; at < up.size(); ++at) {
    up[at] = std::min(up[at], next(up[at - kStride]));
  }
  for (std::size_t at = up.size() - kStride; at-- > 0;) {
    up[at] = std::min(up[at], next(up[at + kStride]));
  }
  EmptyCircles found;
  for (std::int32_t row = kHaloPixels; row < kHaloPixels + kBlockPixels; ++row) {
    const std::uint8_t* line = up.data() + static_cast<std::size_t>(row) * kStride;
    const double y = (first_row + row + 0.5) * pixel;
    for (std::int32_t column = kHaloPixels; column < kHaloPixels + kBlockPixels; ++column) {
      const double x = (first_column + column + 0.5) * pixel;
      if (!stretch.holds(x, y)) continue;
      std::int32_t best = line[column] * line[column];
      for (std::int32_t k = 1; k <= kHaloPixels && k * k < best; ++k) {
        const std::int32_t side = std::min(line[column - k], line[column + k]);
        best = std::min(best, side * side + k * k);
      }
      ++found.places;
      found.empty += best > kRadiusPixels * kRadiusPixels ? 1 : 0;
      const double share = std::abs(stretch.place_across(x, y)) / half_swath;
      const std::size_t third = share <= kThirds[0] ? 0 : share <= kThirds[1] ? 1 : 2;
      found.largest[third] = std::max(found.largest[third], best);
    }
  }
  return found;
}

void require_options(const PointDistributionOptions& options) {
  require_between("diameter of an empty circle", options.empty_circle, 0.02, 10, "m");
  require_between("edge of a cell", options.density_cell, 0.02, 100, "m");
  require_between("most ground", options.most_ground, 1, 1e9, "m^2");
}

}  // namespace

class PointDistribution::Counts {
 public:
  Counts(std::vector<StripLine> lines, const SwathReach& reach,
         const PointDistributionOptions& options)
      : lines_(std::move(lines)), reach_(reach), options_(options) {
    require_options(options_);
    require_finite("left reach", reach_.left);
    require_finite("right reach", reach_.right);
    require_finite("reach ahead", reach_.ahead);
    require_finite("reach behind", reach_.behind);
    require_above("width of the swath per metre of height", reach_.left + reach_.right, 0);
    require_not_below("length of the field of view per metre of height",
                      reach_.ahead + reach_.behind, 0);
    for (const StripLine& line : lines_) {
      for (const auto& end : {line.begin, line.end}) {
        for (const double value : end) {
          require_between("end of a strip", value, -kFarthestPoint, kFarthestPoint, "m");
        }
      }
      require_between("height of a strip", line.height, -kFarthestPoint, kFarthestPoint, "m");
      require_above("length of a strip", length_of(line), 0, "m");
    }
    // Cells and pixels are numbered from the first strip on.
    if (!lines_.empty()) origin_ = lines_.front().begin;
    for (double& value : origin_) {
      value = std::floor(value / options_.density_cell) * options_.density_cell;
    }
    for (StripLine& line : lines_) {
      for (std::size_t k = 0; k < 2; ++k) {
        line.begin[k] -= origin_[k];
        line.end[k] -= origin_[k];
      }
    }
    pixel_ = 0.5 * options_.empty_circle / kRadiusPixels;
    most_pixel_tiles_ = static_cast<std::size_t>(
        std::ceil(options_.most_ground / std::pow(kTilePixels * pixel_, 2)));
  }

  void add(std::span<const double> x, std::span<const double> y, std::span<const double> z,
           std::span<const std::uint16_t> strip, const Progress& progress) {
    require_length("y", y.size(), x.size());
    require_length("z", z.size(), x.size());
    require_length("strip", strip.size(), x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (strip[i] == 0) {
        ++others_;
        continue;
      }
      const double own_x = x[i] - origin_[0], own_y = y[i] - origin_[1];
      if (!(std::abs(own_x) < kWidestFlight && std::abs(own_y) < kWidestFlight &&
            std::abs(z[i]) < kFarthestPoint)) {
        throw InvalidArgument(fmt::format(
            "point {} is at ({:.10g}, {:.10g}, {:g}) m, allowed within {:g} km of the first strip",
            i, x[i], y[i], z[i], 1e-3 * kWidestFlight));
      }
      if (strip[i] != current_) {
        progress.check();
        begin_strip(strip[i]);
      }
      count(own_x, own_y, z[i]);
    }
  }

  PointDistributionSummary summary(std::size_t most_squares) {
    end_strip();
    PointDistributionSummary result;
    result.empty_circle = options_.empty_circle;
    result.density_cell = options_.density_cell;
    result.strips = done_;
    result.other_points = others_;
    for (const StripDistribution& strip : done_) result.points += strip.points;
    fill_area(result);
    fill_map(result, std::max<std::size_t>(most_squares, 1));
    return result;
  }

 private:
  struct GroundCell {
    std::uint32_t points = 0;
    std::uint16_t last_strip = 0;
    std::uint8_t strips = 0, in_swath = 0;
  };

  static double length_of(const StripLine& line) {
    return std::hypot(line.end[0] - line.begin[0], line.end[1] - line.begin[1]);
  }

  Stretch line_of(std::uint16_t strip) const {
    const StripLine& line = lines_[strip - std::size_t{1}];
    Stretch own;
    own.origin = line.begin;
    own.last = length_of(line);
    for (std::size_t k = 0; k < 2; ++k) own.along[k] = (line.end[k] - line.begin[k]) / own.last;
    return own;
  }

  void begin_strip(std::uint16_t strip) {
    require_between("strip", strip, 0, static_cast<double>(lines_.size()));
    const std::uint16_t last = std::max(current_, last_done_);
    if (strip <= last) {
      throw InvalidArgument(fmt::format(
          "points of strip {} come after those of strip {}: strips must ascend", strip, last));
    }
    end_strip();
    current_ = strip;
    line_ = line_of(strip);
  }

  void count(double x, double y, double z) {
    if (points_ == 0) first_z_ = z;
    ++points_;
    z_sum_ += z - first_z_;
    across_.add(line_.place_across(x, y));
    const double along = line_.place_along(x, y);
    nearest_ = std::min(nearest_, along);
    farthest_ = std::max(farthest_, along);
    const std::int32_t column = cell_number(x, options_.density_cell);
    const std::int32_t row = cell_number(y, options_.density_cell);
    ++opened_cell(cells_, column, row, options_.density_cell);
    GroundCell& ground = opened_cell(ground_, column, row, options_.density_cell);
    ++ground.points;
    if (ground.last_strip != current_) {
      ground.last_strip = current_;
      if (ground.strips < 255) ++ground.strips;
    }
    const std::int32_t i = cell_number(x, pixel_), j = cell_number(y, pixel_);
    PixelTile* tile =
        pixels_.open(divided(i, kTilePixels), divided(j, kTilePixels), most_pixel_tiles_);
    if (tile != nullptr) {
      mark(*tile, i, j);
    } else if (!(known_until_ < std::numeric_limits<double>::infinity())) {
      known_until_ = along;
    }
  }

  void end_strip() {
    if (current_ == 0) return;
    const StripLine& line = lines_[current_ - std::size_t{1}];
    StripDistribution own;
    own.strip = current_;
    own.name = line.name;
    own.points = points_;
    own.height = line.height - (first_z_ + z_sum_ / static_cast<double>(points_));
    own.density = own.spacing = own.middle_density = own.dense_width = own.cell_variation =
        own.cells_covered = own.spacing_cells_covered = own.empty_share = kNoNumber;
    own.place_density.fill(kNoNumber);
    own.largest_empty.fill(kNoNumber);
    if (own.height > 0) keep_to_points(own.height);
    own.length = line_.last - line_.first;
    if (own.height > 0) fill(own);
    done_.push_back(std::move(own));
    last_done_ = current_;
    current_ = 0;
    points_ = 0;
    z_sum_ = 0;
    across_ = {};
    cells_.clear();
    pixels_.clear();
    known_until_ = nearest_ = std::numeric_limits<double>::infinity();
    farthest_ = -nearest_;
  }

  /// A recording may begin or end within a strip: the first and the last field of view.
  void keep_to_points(double height) {
    const double first = std::max(line_.first, nearest_ + height * reach_.behind);
    const double last = std::min(line_.last, farthest_ - height * reach_.ahead);
    if (!(last > first)) return;  // the field of view was never covered in full
    // Its rim is rarely covered: less than that is not significant.
    const double rim = kRim * height * (reach_.ahead + reach_.behind);
    if (first > line_.first + rim) line_.first = first;
    if (last < line_.last - rim) line_.last = last;
  }

  void fill(StripDistribution& own) {
    Stretch swath = line_;
    swath.half = 0.5 * own.height * (reach_.left + reach_.right);
    swath.middle = 0.5 * own.height * (reach_.left - reach_.right);
    own.width = 2 * swath.half;
    fill_profile(own, swath);
    for_each_square(swath, options_.density_cell, [&](std::int32_t column, std::int32_t row) {
      opened_cell(ground_, column, row, options_.density_cell).in_swath = 1;
    });
    Stretch whole = swath;
    whole.first += own.height * reach_.ahead;
    whole.last -= own.height * reach_.behind;
    own.whole_ground = whole.area();
    if (!(own.whole_ground > 0)) return;
    fill_cells(own, whole);
    const double known =
        known_until_ - own.height * (reach_.ahead + reach_.behind);  // nothing came here later
    whole.last = std::min(whole.last, known);
    if (!(whole.area() > 0)) return;
    fill_spacing_cells(own, whole.narrowed(kSpacingWithin));
    fill_circles(own, whole.narrowed(kCirclesWithin), swath.half);
  }

  void fill_profile(StripDistribution& own, const Stretch& swath) const {
    const double middle = swath.middle, half = swath.half;
    const auto density = [&](double from, double to) {
      return across_.between(middle + from, middle + to) / ((to - from) * own.length);
    };
    own.density = density(-half, half);
    own.spacing = own.density > 0 ? 1 / std::sqrt(own.density) : kNoNumber;
    own.middle_density = density(-0.5 * kMiddleStripe, 0.5 * kMiddleStripe);
    const double wide = 0.5 * kPlaceStripe * half;
    for (std::size_t k = 0; k < kSwathPlaces.size(); ++k) {
      const double place = kSwathPlaces[k] * half;
      own.place_density[k] =
          0.5 * (density(place - wide, place + wide) + density(-place - wide, -place + wide));
    }
    SwathProfile& profile = own.profile;
    profile.stripe = std::max(kProfileStripe * half, kHistogramBin);
    const auto stripes = static_cast<int>(std::ceil(kProfileReach * half / profile.stripe));
    for (int i = -stripes; i < stripes; ++i) {
      profile.across.push_back((i + 0.5) * profile.stripe);
      profile.density.push_back(density(i * profile.stripe, (i + 1) * profile.stripe));
    }
    // From the middle to both sides, as long as it is dense.
    own.dense_width = 0;
    for (const int side : {-1, 1}) {
      for (int i = side < 0 ? -1 : 0; i >= -stripes && i < stripes; i += side) {
        if (!(profile.density[i + stripes] >= 0.5 * own.density)) break;
        own.dense_width += profile.stripe;
      }
    }
  }

  void fill_cells(StripDistribution& own, const Stretch& whole) const {
    double cells = 0, sum = 0, squares = 0, all = 0, covered = 0;
    for_each_square(whole, options_.density_cell, [&](std::int32_t column, std::int32_t row) {
      const std::uint32_t* cell = cell_at(cells_, column, row);
      const double count = cell == nullptr ? 0 : *cell;
      ++all;
      covered += count > 0 ? 1 : 0;
      const double across = whole.place_across((column + 0.5) * options_.density_cell,
                                               (row + 0.5) * options_.density_cell);
      if (std::abs(across) > kVariationWithin * whole.half) return;
      ++cells;
      sum += count;
      squares += count * count;
    });
    if (all > 0) own.cells_covered = covered / all;
    if (!(sum > 0)) return;
    const double mean = sum / cells;
    own.cell_variation = std::sqrt(std::max(0.0, squares / cells - mean * mean)) / mean;
  }

  void fill_spacing_cells(StripDistribution& own, const Stretch& ground) const {
    const double edge = 2 * own.spacing;
    if (!(edge > 2 * pixel_)) return;  // too fine for the stored points
    TileMap<PixelTile> seen;
    const std::size_t all = std::numeric_limits<std::size_t>::max();
    pixels_.for_each([&](std::int32_t i, std::int32_t j, const PixelTile& tile) {
      for (std::int32_t y = 0; y < kTilePixels; ++y) {
        const std::int32_t row = cell_number((j * kTilePixels + y + 0.5) * pixel_, edge);
        for (std::uint64_t bits = tile[y]; bits != 0; bits &= bits - 1) {
          const std::int32_t column =
              cell_number((i * kTilePixels + std::countr_zero(bits) + 0.5) * pixel_, edge);
          mark(*seen.open(divided(column, kTilePixels), divided(row, kTilePixels), all), column,
               row);
        }
      }
    });
    double cells = 0, covered = 0;
    for_each_square(ground, edge, [&](std::int32_t column, std::int32_t row) {
      ++cells;
      covered += is_marked(seen, column, row) ? 1 : 0;
    });
    if (cells > 0) own.spacing_cells_covered = covered / cells;
  }

  void fill_circles(StripDistribution& own, const Stretch& ground, double half_swath) const {
    // Blocks that the ground touches.
    const double block = kBlockPixels * pixel_, step = block / 16;
    Stretch wider = ground;
    wider.first -= step;
    wider.last += step;
    wider.half += step;
    std::set<std::pair<std::int32_t, std::int32_t>> places;
    for_each_square(wider, step, [&](std::int32_t column, std::int32_t row) {
      places.emplace(divided(column, 16), divided(row, 16));
    });
    const std::vector<std::pair<std::int32_t, std::int32_t>> blocks(places.begin(), places.end());
    std::vector<EmptyCircles> found(blocks.size());
    parallel::for_each(blocks.size(), [&](std::size_t i) {
      found[i] =
          circles_of_block(pixels_, blocks[i].first, blocks[i].second, ground, half_swath, pixel_);
    });
    EmptyCircles sum;
    for (const EmptyCircles& part : found) {
      sum.places += part.places;
      sum.empty += part.empty;
      for (std::size_t k = 0; k < 3; ++k) {
        sum.largest[k] = std::max(sum.largest[k], part.largest[k]);
      }
    }
    if (sum.places == 0) return;
    own.circles_ground = static_cast<double>(sum.places) * pixel_ * pixel_;
    own.empty_share = static_cast<double>(sum.empty) / static_cast<double>(sum.places);
    for (std::size_t k = 0; k < 3; ++k) {
      own.largest_empty[k] = 2 * pixel_ * std::sqrt(static_cast<double>(sum.largest[k]));
    }
  }

  void fill_area(PointDistributionSummary& result) const {
    std::vector<std::uint32_t> counts;
    double points = 0, covered = 0, several = 0;
    ground_.for_each([&](std::int32_t, std::int32_t, const CellTile<GroundCell>& tile) {
      for (const GroundCell& cell : tile) {
        if (cell.in_swath == 0) continue;
        counts.push_back(cell.points);
        points += cell.points;
        covered += cell.points > 0 ? 1 : 0;
        several += cell.strips > 1 ? 1 : 0;
      }
    });
    result.density = result.spacing = result.low_density = result.median_density = result.covered =
        result.overlap = kNoNumber;
    if (counts.empty()) return;
    const auto cells = static_cast<double>(counts.size());
    const double cell_area = options_.density_cell * options_.density_cell;
    result.area = cells * cell_area;
    result.density = points / result.area;
    if (result.density > 0) result.spacing = 1 / std::sqrt(result.density);
    result.covered = covered / cells;
    result.overlap = several / cells;
    result.low_density = quantile(counts, 0.05) / cell_area;
    result.median_density = quantile(counts, 0.5) / cell_area;
  }

  void fill_map(PointDistributionSummary& result, std::size_t most_squares) const {
    struct Sum {
      double points = 0, cells = 0;
      std::uint16_t strips = 0;
    };
    std::size_t known = 0;
    const auto counts = [](const GroundCell& cell) { return cell.points > 0 || cell.in_swath > 0; };
    ground_.for_each([&](std::int32_t, std::int32_t, const CellTile<GroundCell>& tile) {
      known += static_cast<std::size_t>(std::ranges::count_if(tile, counts));
    });
    // Squares at the rim are not full, so that there may be a few more than requested.
    for (std::int32_t merged = std::max(
             1, static_cast<std::int32_t>(std::ceil(
                    std::sqrt(static_cast<double>(known) / static_cast<double>(most_squares)))));
         ; ++merged) {
      std::unordered_map<std::uint64_t, Sum> sums;
      ground_.for_each([&](std::int32_t i, std::int32_t j, const CellTile<GroundCell>& tile) {
        for (std::size_t k = 0; k < tile.size(); ++k) {
          if (!counts(tile[k])) continue;
          const auto at = static_cast<std::int32_t>(k);
          const std::int32_t column = divided(i * kTileCells + at % kTileCells, merged);
          const std::int32_t row = divided(j * kTileCells + at / kTileCells, merged);
          Sum& sum = sums[std::uint64_t{static_cast<std::uint32_t>(row)} << 32U |
                          static_cast<std::uint32_t>(column)];
          sum.points += tile[k].points;
          ++sum.cells;
          sum.strips = std::max<std::uint16_t>(sum.strips, tile[k].strips);
        }
      });
      if (sums.size() > most_squares) continue;
      result.square = merged * options_.density_cell;
      const double cell_area = options_.density_cell * options_.density_cell;
      for (const auto& [key, sum] : sums) {
        const auto column = static_cast<std::int32_t>(key & 0xffffffffU);
        const auto row = static_cast<std::int32_t>(key >> 32U);
        result.map.push_back({origin_[0] + (column + 0.5) * result.square,
                              origin_[1] + (row + 0.5) * result.square,
                              sum.points / (sum.cells * cell_area), sum.strips});
      }
      break;
    }
    std::ranges::sort(result.map, [](const DensitySquare& a, const DensitySquare& b) {
      return std::pair(a.y, a.x) < std::pair(b.y, b.x);
    });
  }

  std::vector<StripLine> lines_;
  SwathReach reach_;
  PointDistributionOptions options_;
  std::array<double, 2> origin_{0, 0};  // of everything below, and of the lines, m
  double pixel_ = 0;                    // m
  std::size_t most_pixel_tiles_ = 0;

  // Of all strips.
  TileMap<CellTile<GroundCell>> ground_;
  std::vector<StripDistribution> done_;
  std::uint64_t others_ = 0;
  std::uint16_t last_done_ = 0;

  // Of the current strip.
  std::uint16_t current_ = 0;  // 0: none
  Stretch line_;
  std::uint64_t points_ = 0;
  double first_z_ = 0, z_sum_ = 0;
  /// Of its points along the line, m.
  double nearest_ = std::numeric_limits<double>::infinity(), farthest_ = -nearest_;
  AcrossHistogram across_;
  TileMap<CellTile<std::uint32_t>> cells_;
  TileMap<PixelTile> pixels_;
  /// Along the line: the first place without room for a point, m.
  double known_until_ = std::numeric_limits<double>::infinity();
};

PointDistribution::PointDistribution(std::vector<StripLine> lines, const SwathReach& reach,
                                     const PointDistributionOptions& options)
    : counts_(std::make_unique<Counts>(std::move(lines), reach, options)) {}
PointDistribution::~PointDistribution() = default;
PointDistribution::PointDistribution(PointDistribution&&) noexcept = default;
PointDistribution& PointDistribution::operator=(PointDistribution&&) noexcept = default;

void PointDistribution::add(std::span<const double> x, std::span<const double> y,
                            std::span<const double> z, std::span<const std::uint16_t> strip,
                            const Progress& progress) {
  counts_->add(x, y, z, strip, progress);
}

PointDistributionSummary PointDistribution::summary(std::size_t most_squares) {
  return counts_->summary(most_squares);
}

}  // namespace risley::cloud
