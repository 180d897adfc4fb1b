// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/point_viewer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

#include "risley/core/error.hpp"
#include "risley/core/random.hpp"

namespace risley::report::point_viewer_test {

using ::testing::HasSubstr;
using Json = nlohmann::json;

constexpr float kUnknownValue = std::numeric_limits<float>::quiet_NaN();

std::string from_base64(std::string_view text) {
  constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned held = 0;
  int bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    held = held << 6 | static_cast<unsigned>(kLetters.find(c));
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(held >> bits & 0xff);
  }
  return bytes;
}

struct Unpacked {
  std::array<std::int64_t, 3> at;  ///< steps from the corner of the whole
  std::vector<std::uint8_t> codes;
};

/// The points of every node, read as PointViewer::nodes() says.
std::vector<std::vector<Unpacked>> unpacked(const PointViewer& viewer) {
  const Json json = Json::parse(viewer.json());
  const std::size_t channels = json["colourings"].size();
  std::vector<std::array<std::int64_t, 3>> corners(viewer.nodes().size());
  std::vector<int> levels(corners.size());
  std::vector<std::vector<Unpacked>> result;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i > 0) {
      const auto parent = json["parents"][i].get<std::size_t>();
      EXPECT_LT(parent, i);
      levels[i] = levels[parent] + 1;
      for (int axis = 0; axis < 3; ++axis) {
        const int half = json["octants"][i].get<int>() >> (2 - axis) & 1;
        corners[i][axis] =
            corners[parent][axis] + (std::int64_t{half} << (json["bits"].get<int>() - levels[i]));
      }
    }
    const auto n = json["counts"][i].get<std::size_t>();
    const std::string packed = from_base64(viewer.nodes()[i]);
    std::string bytes((9 + channels) * n, '\0');
    uLongf size = bytes.size();
    EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(bytes.data()), &size,
                         reinterpret_cast<const Bytef*>(packed.data()), packed.size()),
              Z_OK);
    EXPECT_EQ(size, bytes.size());
    const auto byte = [&](std::size_t plane, std::size_t k) {
      return static_cast<std::uint8_t>(bytes[plane * n + k]);
    };
    std::vector<Unpacked> points(n);
    Unpacked now{corners[i], std::vector<std::uint8_t>(channels)};
    for (std::size_t k = 0; k < n; ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int zigzag =
            byte(3 * axis, k) | byte(3 * axis + 1, k) << 8 | byte(3 * axis + 2, k) << 16;
        now.at[axis] += zigzag >> 1 ^ -(zigzag & 1);
      }
      for (std::size_t c = 0; c < channels; ++c) now.codes[c] += byte(9 + c, k);
      points[k] = now;
    }
    result.push_back(std::move(points));
  }
  return result;
}

/// Points on two walls, and one far away.
struct Scene {
  std::vector<float> x, y, z, value;

  explicit Scene(std::size_t points) {
    const RandomStream lots(1, 2);
    for (std::size_t i = 0; i < points; ++i) {
      const auto any = [&](std::size_t k) { return static_cast<float>(lots.uniform(4 * i + k)); };
      x.push_back(i % 2 == 0 ? 20 * any(0) : 3);
      y.push_back(i % 2 == 0 ? 5 : -10 * any(1));
      z.push_back(4 * any(2));
      value.push_back(i % 10 == 0 ? kUnknownValue : 100 * any(3));
    }
    x[0] = 200;
  }
  PointsToView view() const {
    PointsToView result{{"east", "north", "up"}, {1000, 2000, 300}, x, y, z};
    result.colourings.push_back(colouring_between("value, mm", value, {20, 80}));
    return result;
  }
};

TEST(PointViewer, HasEveryPointOnceToHalfAStep) {
  const Scene scene(200'000);
  const PointViewer viewer(scene.view());
  const Json json = Json::parse(viewer.json());
  const double step = json["step_m"];
  EXPECT_EQ(step, 0.0005);
  std::map<std::array<std::int64_t, 3>, std::vector<std::uint8_t>> expected, found;
  const std::vector<std::uint8_t> codes = scene.view().colourings[0].code;
  for (std::size_t i = 0; i < scene.x.size(); ++i) {
    const double at[] = {scene.x[i], scene.y[i], scene.z[i]};
    std::array<std::int64_t, 3> place;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      place[axis] = std::llround((at[axis] - json["corner_m"][axis].get<double>()) / step);
    }
    expected[place].push_back(codes[i]);
  }
  for (const auto& node : unpacked(viewer)) {
    for (const Unpacked& point : node) found[point.at].push_back(point.codes[0]);
  }
  for (auto* places : {&expected, &found}) {
    for (auto& [place, all] : *places) std::ranges::sort(all);
  }
  EXPECT_EQ(found, expected);
}

// So a view from afar has no more points than pixels, and no holes.
TEST(PointViewer, SpreadsThePointsOfANodeThatHasChildren) {
  const PointViewer viewer(Scene(200'000).view());
  const Json json = Json::parse(viewer.json());
  const auto nodes = unpacked(viewer);
  ASSERT_GT(nodes.size(), 5U);
  const std::int64_t cell = (std::int64_t{1} << json["bits"].get<int>()) / json["grid"].get<int>();
  std::map<std::array<std::int64_t, 3>, int> cells;
  for (const Unpacked& point : nodes[0]) {
    ++cells[{point.at[0] / cell, point.at[1] / cell, point.at[2] / cell}];
  }
  EXPECT_GT(cells.size(), 30U);
  for (const auto& [place, count] : cells) EXPECT_EQ(count, 1);
}

TEST(PointViewer, TakesPointsAtOnePlaceAndPointsFarApart) {
  std::vector<float> x(50'000, 7), y(50'000, 8), z(50'000, 9);
  std::size_t count = 0;
  for (const auto& node : unpacked(PointViewer({{"x", "y", "z"}, {}, x, y, z})))
    count += node.size();
  EXPECT_EQ(count, x.size());
  x[0] = 20'000;  // m
  const PointViewer wide({{"x", "y", "z"}, {}, x, y, z});
  const double step = Json::parse(wide.json())["step_m"];
  EXPECT_LT(step, 0.003);
  std::int64_t farthest = 0;
  for (const auto& node : unpacked(wide)) {
    for (const Unpacked& point : node) farthest = std::max(farthest, point.at[0]);
  }
  EXPECT_NEAR(static_cast<double>(farthest) * step, 20'000 - 7, step);
}

TEST(PointColouring, ClampsBeyondItsEndsAndKnowsWhatIsUnknown) {
  const std::vector<float> value{19, 20, 50, 80, 99, kUnknownValue};
  const PointColouring one = colouring_between("a", value, {20, 80});
  EXPECT_EQ(one.code, (std::vector<std::uint8_t>{0, 0, 127, 254, 254, 255}));
  std::vector<float> values(1000);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i);
  values.push_back(kUnknownValue);
  const auto usual = usual_colouring("b", values);
  ASSERT_TRUE(usual);
  EXPECT_NEAR(usual->range.first, 20, 1);
  EXPECT_NEAR(usual->range.second, 979, 1);
  EXPECT_FALSE(usual_colouring("c", std::vector<float>{kUnknownValue}));
}

TEST(PointViewer, WritesNoTextThatEndsItsElement) {
  const std::vector<float> one{1};
  PointsToView view{{"</script>", "y", "z"}, {}, one, one, one};
  EXPECT_THAT(PointViewer(view).json(), HasSubstr("\\u003c/script>"));
}

TEST(PointViewer, RefusesColumnsOfOtherLengths) {
  const std::vector<float> one{1}, two{1, 2};
  EXPECT_THROW(PointViewer({{}, {}, one, two, one}), InvalidArgument);
  EXPECT_THROW(PointViewer({{}, {}, {}, {}, {}}), InvalidArgument);
  PointsToView view{{}, {}, one, one, one};
  view.colourings.push_back(colouring_between("a", two, {0, 1}));
  EXPECT_THROW(PointViewer{view}, InvalidArgument);
}

}  // namespace risley::report::point_viewer_test
