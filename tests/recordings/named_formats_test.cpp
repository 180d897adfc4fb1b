// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Tables with named columns, as text and as PCD, PLY, NPY and NPZ, and what their columns mean.
#include <bit>
#include <cmath>
#include <cstring>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "risley/core/angle.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/formats/named_columns.hpp"
#include "refusal.hpp"

namespace risley::recordings::named_formats_test {

using namespace format_tests;
using ::testing::_;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;

/// Points on a grid of 1 mm; every fifth shot has no return.
struct Scene {
  static constexpr std::size_t kRows = 1500;  // three blocks
  std::vector<std::array<double, 3>> points;
  std::vector<int> intensity;

  Scene() {
    for (std::size_t i = 0; i < kRows; ++i) {
      const auto n = static_cast<double>(i);
      const bool none = i % 5 == 2;
      points.push_back(none ? std::array<double, 3>{}
                            : std::array{std::round(9000 + 3.7 * n) / 1000,
                                         std::round(-800 + 1.3 * n) / 1000,
                                         std::round(500 - 0.9 * n) / 1000});
      intensity.push_back(none ? 0 : static_cast<int>(i % 256));
    }
  }
};

std::string number_bytes(double value, char kind, std::size_t bytes, bool big_endian) {
  std::string out(bytes, '\0');
  const auto put = [&](auto number) { std::memcpy(out.data(), &number, sizeof number); };
  if (kind == 'f') {
    bytes == 4 ? put(static_cast<float>(value)) : put(value);
  } else {
    const auto whole = static_cast<std::int64_t>(std::llround(value));
    std::memcpy(out.data(), &whole, bytes);
  }
  if (big_endian) std::reverse(out.begin(), out.end());
  return out;
}

/// Rows of the scene, point by point or column by column.
std::string scene_bytes(const Scene& scene, bool by_column, char kind = 'f', std::size_t bytes = 4,
                        double per_m = 1.0, bool big_endian = false, bool with_intensity = true) {
  std::string out;
  const std::size_t columns = with_intensity ? 4 : 3;
  const auto add = [&](std::size_t row, std::size_t column) {
    out += column < 3 ? number_bytes(scene.points[row][column] * per_m, kind, bytes, big_endian)
                      : number_bytes(scene.intensity[row], 'u', 1, false);
  };
  for (std::size_t a = 0; a < (by_column ? columns : Scene::kRows); ++a) {
    for (std::size_t b = 0; b < (by_column ? Scene::kRows : columns); ++b) {
      by_column ? add(b, a) : add(a, b);
    }
  }
  return out;
}

void expect_scene(const Outcome& outcome, bool with_intensity = true) {
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  const Scene scene;
  const auto& rows = outcome.rows();
  EXPECT_TRUE(outcome.recording.header.cartesian);
  EXPECT_FALSE(outcome.recording.header.has_times);
  EXPECT_EQ(outcome.recording.header.has_intensity, with_intensity);
  ASSERT_EQ(rows.size(), Scene::kRows);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto& p = scene.points[i];
    const double range = std::hypot(p[0], p[1], p[2]);
    ASSERT_EQ(rows.time_ns[i], static_cast<std::int64_t>(i));
    ASSERT_EQ(rows.valid[i], range > 0 ? 1 : 0) << i;
    ASSERT_NEAR(rows.range[i], range, 2e-6);
    ASSERT_FLOAT_EQ(rows.range_resolution[i], 1e-3F);
    if (with_intensity) {
      ASSERT_EQ(rows.intensity[i], scene.intensity[i]);
    }
    if (range > 0) {
      ASSERT_NEAR(rows.azimuth[i], std::atan2(p[1], p[0]), 1e-6);
      ASSERT_NEAR(rows.zenith[i], std::acos(p[2] / range), 1e-6);
    }
  }
}

void expect_prefix_and_error(const Format& format, const std::string& bytes, std::size_t rows,
                             std::uint64_t byte_offset, const char* problem) {
  const Outcome outcome = read_text(format, bytes);
  expect_damage(outcome, NamesField(problem), rows, byte_offset);
}

std::string open_problem(const Format& format, const std::string& bytes) {
  const Outcome outcome = read_text(format, bytes);
  EXPECT_FALSE(outcome.opened);
  return outcome.error ? outcome.error->problem() : "was opened";
}

// ---- text ------------------------------------------------------------------------------------

TEST(NamedCsv, DelimitersOrdersCommentsAndUnits) {
  const std::map<std::string, std::string> files = {
      {"commas", "index,x_m,y_m,z_m\n0,3.000,4.000,0.000\n1,0,0,0\n5,3.000,0.000,4.000\n"},
      {"semicolons",
       "Z [m];\"Y (m)\";X(m);Index\n0.000;4.000;3.000;0\n0;0;0;1\n4.000;0.000;3.000;5\n"},
      {"tabs", "shot\tx_mm\ty_mm\tz_mm\n0\t3000\t4000\t0\n1\t0\t0\t0\n5\t3000\t0\t4000\n"},
      {"blanks",
       "# from a script\n#\n#  row x  y z\n0  3.000 4.000 0.000\n 1 0 0 0\n5 3.000 0.000 4.000\n"},
      {"CloudCompare", "//row X Y Z\n0 3.000 4.000 0.000\n1 0 0 0\n5 3.000 0.000 4.000\n"},
      {"ParaView",
       "\"Points:0\",\"Points:1\",\"Points:2\",shot_number\r\n3.000,4.000,0.000,0\r\n"
       "0,0,0,1\r\n3.000,0.000,4.000,5\r\n"},
      {"pandas", "\xEF\xBB\xBF,x,y,z\n0,3.000,4.000,0.000\n1,,nan,NaN\n5,3.000,0.000,4.000\n"},
      {"polar",
       "index,range_m,phi,theta\n0,5.000,53.130,90.000\n1,0.000,9.000,95.000\n5,5.000,0.000,36."
       "870\n"},
      {"elevation",
       "elevation_deg,yaw_deg,depth_mm,index\n0.000,53.130,5000,0\n-5.000,9.000,0,1\n53.130,0.000,"
       "5000,5\n"},
  };
  for (const auto& [name, bytes] : files) {
    for (const std::size_t chunk_rows : {std::size_t{1}, kDefaultChunkRows}) {
      SCOPED_TRACE(name);
      EXPECT_TRUE(kNamedCsvFormat.recognises(bytes));
      const Outcome outcome = read_text(kNamedCsvFormat, bytes, chunk_rows);
      ASSERT_FALSE(outcome.error) << outcome.error->what();
      const auto& rows = outcome.rows();
      EXPECT_EQ(rows.time_ns, (std::vector<std::int64_t>{0, 1, 5}));
      EXPECT_EQ(rows.valid, (std::vector<std::uint8_t>{1, 0, 1}));
      EXPECT_FALSE(outcome.recording.header.has_times);
      EXPECT_EQ(outcome.recording.header.cartesian, name != "polar" && name != "elevation");
      EXPECT_NEAR(rows.range[0], 5.0, 1e-12);
      EXPECT_EQ(rows.range[1], 0.0);
      EXPECT_NEAR(rows.azimuth[0], radians_from_degrees(53.13), 1e-5);
      EXPECT_NEAR(rows.zenith[2], radians_from_degrees(36.87), 1e-5);
      EXPECT_FLOAT_EQ(rows.range_resolution[0], 1e-3F);
    }
  }
}

TEST(NamedCsv, UnitsOfTimes) {
  struct Case {
    const char* name;
    std::string first, second;
    std::int64_t first_ns, second_ns;
  };
  const std::vector<Case> cases = {
      {"Time/s", "0.5", "0.50001", 500'000'000, 500'010'000},
      {"time", "0.000000", "0.000010", 0, 10'000},
      {"t_ms", "1.5", "1.51", 1'500'000, 1'510'000},
      {"time_us", "7", "17", 7'000, 17'000},
      {"timestamp [ns]", "1700000000000000000", "1700000000000010000", 1'700'000'000'000'000'000,
       1'700'000'000'000'010'000},
      {"timestamp", "1700000000000000000", "1700000000000010000", 1'700'000'000'000'000'000,
       1'700'000'000'000'010'000},
      {"timestamp", "1700000000000000", "1700000000000010", 1'700'000'000'000'000'000,
       1'700'000'000'000'010'000},
      {"offset_time", "0", "4167", 0, 4167},
      {"timestamp", "2361375827530", "2361375837530", 2'361'375'827'530, 2'361'375'837'530},
      {"time", "1e-5", "+2e-5", 10'000, 20'000},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name + (" " + c.first));
    const std::string bytes =
        fmt::format("x_m,y_m,z_m,{}\n1.5,2.5,3.5,{}\n1.5,2.5,3.5,{}\n", c.name, c.first, c.second);
    const Outcome outcome = read_text(kNamedCsvFormat, bytes);
    ASSERT_FALSE(outcome.error) << outcome.error->what();
    EXPECT_TRUE(outcome.recording.header.has_times);
    EXPECT_EQ(outcome.rows().time_ns, (std::vector<std::int64_t>{c.first_ns, c.second_ns}));
  }
  EXPECT_THAT(open_problem(kNamedCsvFormat, "x_m,y_m,z_m,time\n1,2,3,0\n1,2,3,10\n1,2,3,20\n"),
              AllOf(NamesField("column time"), NamesField("time_us")));
}

TEST(NamedCsv, TimesOfPacketsAreNoTimesOfShots) {
  for (const std::size_t shared : {96, 1'000'000}) {
    std::string bytes = "timestamp_ns,x,y,z\n";
    for (std::size_t i = 0; i < 960; ++i) {
      bytes += fmt::format("{},1.{:03},2.000,3.000\n", 1'000'000 * (i / shared), i);
    }
    const Outcome outcome = read_text(kNamedCsvFormat, bytes);
    EXPECT_FALSE(outcome.recording.header.has_times);
    EXPECT_THAT(warnings_of(outcome), Contains(Warns(kWarning.no_shot_times)));
    EXPECT_EQ(outcome.rows().time_ns[500], 500);
  }
}

TEST(NamedCsv, ReturnsShareTheirShot) {
  const Outcome outcome = read_text(
      kNamedCsvFormat,
      "x_m,y_m,z_m,return_number,ring,tag,i\n1,1,1,1,0,16,1\n2,2,2,2,0,16,2\n1,1,1,1,5,32,255\n");
  EXPECT_EQ(outcome.rows().time_ns, (std::vector<std::int64_t>{0, 0, 1}));
  EXPECT_EQ(outcome.recording.header.returns_per_shot, 2);
  EXPECT_EQ(outcome.rows().beam[2], 5);
  EXPECT_EQ(outcome.rows().tag[1], 16);
  EXPECT_EQ(outcome.rows().intensity[2], 255);
}

TEST(NamedCsv, AssumptionsAreSaid) {
  const Outcome millimetres =
      read_text(kNamedCsvFormat, "x,y,z,temperature\n3000,0,4000,1\n0,0,0,1\n");
  EXPECT_NEAR(millimetres.rows().range[0], 5.0, 1e-12);
  EXPECT_THAT(warnings_of(millimetres),
              AllOf(Contains(Warns(kWarning.unit_guessed, {"millimetres"})),
                    Contains(Warns(kWarning.columns_unused, {"temperature"}))));
  const Outcome metres = read_text(kNamedCsvFormat, "x,y,z\n300,0,400\n0,0,0\n");
  EXPECT_NEAR(metres.rows().range[0], 500.0, 1e-12);
  const Outcome parts = read_text(kNamedCsvFormat, "x_m,y_m,z_m,intensity\n1,2,3,0.5\n1,2,3,1.0\n");
  EXPECT_EQ(parts.rows().intensity[0], 128);
  const Outcome beyond = read_text(kNamedCsvFormat, "x_m,y_m,z_m,intensity\n1,2,3,4096\n");
  EXPECT_FALSE(beyond.recording.header.has_intensity);
  EXPECT_THAT(warnings_of(beyond), Contains(Warns(kWarning.columns_unused, {"[0, 255]"})));
}

TEST(NamedCsv, RefusesWhatItCannotTell) {
  EXPECT_THAT(open_problem(kNamedCsvFormat, "1.0,2.0,3.0\n4.0,5.0,6.0\n"),
              NamesField("x_m,y_m,z_m"));
  EXPECT_THAT(open_problem(kNamedCsvFormat, "azimuth,zenith\n1.0,2.0\n"),
              NamesField("azimuth_deg or azimuth_rad"));
  EXPECT_THAT(open_problem(kNamedCsvFormat, "x,y,height\n1.0,2.0,3.0\n"),
              NamesField("x, y, height"));
  EXPECT_THAT(open_problem(kNamedCsvFormat, "x (ft),y (ft),z (ft)\n1,2,3\n"), NamesField("x (ft)"));
  EXPECT_THAT(open_problem(kNamedCsvFormat, "x_m,y_mm,z_m\n1,2,3\n"), NamesField("unit"));
  EXPECT_TRUE(kNamedCsvFormat.recognises("1.0,2.0,3.0\n4.0,5.0,6.0\n"));
  EXPECT_FALSE(kNamedCsvFormat.recognises("hello, world"));
  EXPECT_FALSE(kNamedCsvFormat.recognises("Dear reader,\nthis is no table.\n"));
  EXPECT_FALSE(kNamedCsvFormat.recognises(std::string_view("x,y,z\n1,2\0,3\n", 13)));
}

TEST(NamedCsv, NamesTheDamagedLine) {
  const std::string two =
      "# c\ntime_s,azimuth_deg,zenith_deg,range_m\n0.1,1.0,90.0,5.00\n"
      "0.2,1.0,90.0,5.00\n";
  const std::vector<std::pair<std::string, const char*>> cases = {
      {"0.3,1.0,90.0\n", "4 fields"},
      {"0.3,abc,90.0,5.00\n", "azimuth_deg"},
      {"0.3,361.0,90.0,5.00\n", "[-180, 360] deg"},
      {"0.3,1.0,181.0,5.00\n", "[0, 180] deg"},
      {"0.3,1.0,90.0,-1.00\n", "range_m"},
      {"nan,1.0,90.0,1.00\n", "time_s"},
      {"1e20,1.0,90.0,1.00\n", "9.2e9 s"},
  };
  for (const auto& [row, named] : cases) {
    SCOPED_TRACE(row);
    for (const std::size_t chunk_rows : {std::size_t{1}, kDefaultChunkRows}) {
      expect_damage(read_text(kNamedCsvFormat, two + row + "0.4,1.0,90.0,5.00\n", chunk_rows),
                    NamesField(named), 2, 5);
    }
  }
}

// ---- rounding --------------------------------------------------------------------------------

TEST(Rounding, IsFoundInTheValues) {
  const auto found = [](CellType type, const std::function<double(double)>& value) {
    std::vector<Decimal> column;
    for (int i = 1; i < 200; ++i) column.push_back({.value = value(7.0 + 0.1234567891 * i)});
    const std::vector<Decimal>* const columns[] = {&column};
    return rounding_of(columns, type);
  };
  for (int decimals = 1; decimals <= 4; ++decimals) {
    const double scale = std::pow(10.0, decimals);
    const auto rounded = [scale](double v) { return std::round(v * scale) / scale; };
    const auto single = [&](double v) {
      return static_cast<double>(static_cast<float>(rounded(v)));
    };
    EXPECT_DOUBLE_EQ(found(CellType::float64, rounded).step, std::pow(10.0, -decimals));
    EXPECT_DOUBLE_EQ(found(CellType::float32, single).step, std::pow(10.0, -decimals));
    EXPECT_DOUBLE_EQ(found(CellType::float64, single).step, std::pow(10.0, -decimals));
  }
  const auto as_is = [](double v) { return static_cast<double>(static_cast<float>(v)); };
  EXPECT_EQ(found(CellType::float32, as_is).step, 0.0);
  EXPECT_DOUBLE_EQ(found(CellType::float32, as_is).step_at(-8.0), 8.0 * 0x1p-23);
  EXPECT_EQ(found(CellType::float64, [](double v) { return v; }).step_at(8.0), 0.0);
}

// ---- PCD -------------------------------------------------------------------------------------

std::string pcd_header(const std::string& data, const std::string& more = {},
                       std::size_t points = Scene::kRows) {
  return fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity{}\n"
      "WIDTH {}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA {}\n",
      more.empty() ? "\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 1" : more, points, points, data);
}

/// LZF with literals, and copies where a byte repeats the one before it.
std::string lzf(const std::string& bytes) {
  std::string out;
  for (std::size_t i = 0; i < bytes.size();) {
    std::size_t same = 0;
    while (i > 0 && i + same < bytes.size() && same < 264 && bytes[i + same] == bytes[i - 1])
      ++same;
    if (same >= 3) {
      const std::size_t length = same - 2;
      out += static_cast<char>(std::min<std::size_t>(length, 7) << 5);
      if (length >= 7) out += static_cast<char>(length - 7);
      out += '\0';
      i += same;
    } else {
      const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
      out += static_cast<char>(count - 1) + bytes.substr(i, count);
      i += count;
    }
  }
  return out;
}

std::string packed(const std::string& plain) {
  const std::string bytes = lzf(plain);
  return number_bytes(static_cast<double>(bytes.size()), 'u', 4, false) +
         number_bytes(static_cast<double>(plain.size()), 'u', 4, false) + bytes;
}

TEST(Pcd, TextBytesAndPackedBytes) {
  const Scene scene;
  std::string text = pcd_header("ascii");
  for (std::size_t i = 0; i < Scene::kRows; ++i) {
    const auto& p = scene.points[i];
    text += fmt::format("{} {} {} {}\n", p[0], p[1], p[2], scene.intensity[i]);
  }
  for (const std::string& bytes :
       {text, pcd_header("binary") + scene_bytes(scene, false),
        pcd_header("binary_compressed") + packed(scene_bytes(scene, true))}) {
    EXPECT_TRUE(kPcdFormat.recognises(bytes));
    expect_scene(read_text(kPcdFormat, bytes));
    expect_scene(read_text(kPcdFormat, bytes, 7));
  }
}

TEST(Pcd, OddFields) {
  const Scene scene;
  std::string rows;
  for (std::size_t i = 0; i < Scene::kRows; ++i) {
    rows += "abc";
    for (const double value : scene.points[i]) rows += number_bytes(value, 'f', 8, false);
    rows += number_bytes(scene.intensity[i], 'u', 2, false) + std::string(12, '\x7F');
  }
  const std::string header =
      pcd_header("binary", "\nSIZE 1 8 8 8 2 4\nTYPE U F F F U F\nCOUNT 3 1 1 1 1 3");
  std::string bytes = header;
  bytes.replace(bytes.find("x y z intensity"), 15, "_ x y z intensity normal");
  expect_scene(read_text(kPcdFormat, bytes + rows));
  std::string turned = bytes + rows + "rest";
  turned.replace(turned.find("VIEWPOINT 0 0 0 1"), 17, "VIEWPOINT 0 0 2 1");
  turned.replace(turned.find("HEIGHT 1"), 8, "HEIGHT 2");
  const Outcome outcome = read_text(kPcdFormat, turned);
  expect_scene(outcome);
  EXPECT_THAT(warnings_of(outcome), IsSupersetOf({Warns(kWarning.pose_unused),
                                                  Warns(kWarning.header_contradicted, {"POINTS"}),
                                                  Warns(kWarning.content_left_out, {"4 bytes"})}));
}

TEST(Pcd, Damage) {
  const Scene scene;
  const std::string header = pcd_header("binary"), rows = scene_bytes(scene, false);
  expect_prefix_and_error(kPcdFormat, header + rows.substr(0, 13 * 700 + 5), 700,
                          header.size() + 13 * 700 + 5, "800 more points");
  std::string many = header;
  many.replace(many.find("POINTS 1500"), 11, "POINTS 1234567890123456789");
  expect_prefix_and_error(kPcdFormat, many + rows, 1500, many.size() + rows.size(),
                          "1234567890123455289 more points");
  std::string huge = rows;
  huge.replace(13 * 1000, 4, number_bytes(3e9, 'f', 4, false));
  expect_prefix_and_error(kPcdFormat, header + huge, 1000, header.size() + 13 * 1000, "point 1001");
  const std::string packed_header = pcd_header("binary_compressed");
  const std::string all = packed(scene_bytes(scene, true));
  const Outcome cut = read_text(kPcdFormat, packed_header + all.substr(0, all.size() - 100));
  ASSERT_TRUE(cut.error);
  EXPECT_GT(cut.rows().size(), 1000U);
  EXPECT_THAT(warnings_of(cut), Contains(Warns(kWarning.cut_off)));
  std::string back = all;
  back[8] = '\x3F';  // copies from 7937 bytes before the beginning
  EXPECT_THAT(read_text(kPcdFormat, packed_header + back).error->problem(), NamesField("back"));
  EXPECT_THAT(open_problem(kPcdFormat, pcd_header("binary_compressed", {}, 1501) + all),
              NamesField("1501 points"));
  EXPECT_THAT(open_problem(kPcdFormat, pcd_header("zip")), NamesField("zip"));
  EXPECT_THAT(open_problem(kPcdFormat, pcd_header("binary", "\nSIZE 4 4")), NamesField("4 values"));
  EXPECT_THAT(
      open_problem(kPcdFormat, pcd_header("ascii",
                                          "\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 65000\n"
                                          "COUNT 60000 1 1 60000")),
      NamesField("numbers"));
  EXPECT_THAT(open_problem(kPcdFormat, header.substr(0, 60)), NamesField("end of the file"));
}

TEST(Pcd, TextThatEndsEarly) {
  std::string text = pcd_header("ascii", {}, 4) + "1.5 2.5 3.5 1\nnan nan nan 0\n1.5 2.5 3.5 3\n";
  const Outcome outcome = read_text(kPcdFormat, text);
  expect_damage(outcome, NamesField("1 more rows"), 3, 14);
  EXPECT_EQ(outcome.rows().valid[1], 0);
}

// ---- PLY -------------------------------------------------------------------------------------

std::string ply_header(const std::string& format, const std::string& type) {
  return fmt::format(
      "ply\nformat {} 1.0\ncomment by hand\nelement face 2\nproperty list uchar int "
      "vertex_indices\nproperty float area\nelement camera 1\nproperty double focus\n"
      "element vertex {}\nproperty {} x\nproperty {} y\nproperty {} z\nproperty uchar "
      "scalar_Intensity\nelement edge 1\nproperty int vertex1\nend_header\n",
      format, Scene::kRows, type, type, type);
}

TEST(Ply, TextAndBothByteOrders) {
  const Scene scene;
  std::string text = ply_header("ascii", "float") + "3 0 1 2 0.5\n0 0.5\n0.25\n";
  for (std::size_t i = 0; i < Scene::kRows; ++i) {
    const auto& p = scene.points[i];
    text += fmt::format("{:.6f} {:.6f} {:.6f} {}\n", p[0], p[1], p[2], scene.intensity[i]);
  }
  expect_scene(read_text(kPlyFormat, text + "7\n"));
  for (const bool big_endian : {false, true}) {
    const auto number = [big_endian](double value, char kind, std::size_t bytes) {
      return number_bytes(value, kind, bytes, big_endian);
    };
    const std::string before = number(3, 'u', 1) + number(0, 'i', 4) + number(1, 'i', 4) +
                               number(2, 'i', 4) + number(0.5, 'f', 4) + number(0, 'u', 1) +
                               number(0.5, 'f', 4) + number(0.25, 'f', 8);
    for (const auto& [type, bytes] : {std::pair{"float", std::size_t{4}}, {"double", 8}}) {
      const std::string header =
          ply_header(big_endian ? "binary_big_endian" : "binary_little_endian", type);
      const std::string rows = scene_bytes(scene, false, 'f', bytes, 1.0, big_endian);
      expect_scene(read_text(kPlyFormat, header + before + rows + number(7, 'i', 4)));
      const std::size_t point = 3 * bytes + 1;
      expect_prefix_and_error(kPlyFormat, header + before + rows.substr(0, 3 * point + 1), 3,
                              header.size() + before.size() + 3 * point + 1, "1497 more points");
      EXPECT_THAT(open_problem(kPlyFormat, header + number(200, 'u', 1)), NamesField("face"));
    }
  }
}

TEST(Ply, ListsOfVerticesAreSteppedOver) {
  const Scene scene;
  // A list before, between and behind what is used, of one to three numbers.
  const auto header = [](const char* format) {
    return fmt::format(
        "ply\nformat {} 1.0\nelement vertex {}\nproperty list uchar uint view\nproperty double x\n"
        "property double y\nproperty list ushort float weights\nproperty double z\n"
        "property uchar scalar_Intensity\nproperty list uchar uchar marks\nend_header\n",
        format, Scene::kRows);
  };
  std::string text = header("ascii");
  std::string little = header("binary_little_endian"), big = header("binary_big_endian");
  for (std::size_t i = 0; i < Scene::kRows; ++i) {
    const auto& p = scene.points[i];
    const std::size_t count = i % 3 + 1;
    text += i % 2 == 0 ? "2 7 8 " : "0 ";
    text += fmt::format("{:.6f} {:.6f} {}{} {:.6f} {} 1 9\n", p[0], p[1], count,
                        std::string(" 0.5 0.5 0.5").substr(0, 4 * count), p[2], scene.intensity[i]);
    for (const bool is_big : {false, true}) {
      std::string& bytes = is_big ? big : little;
      const auto add = [&](double value, char kind, std::size_t size) {
        bytes += number_bytes(value, kind, size, is_big);
      };
      add(i % 2 == 0 ? 2 : 0, 'u', 1);
      for (std::size_t k = 0; i % 2 == 0 && k < 2; ++k) add(7, 'u', 4);
      add(p[0], 'f', 8);
      add(p[1], 'f', 8);
      add(static_cast<double>(count), 'u', 2);
      for (std::size_t k = 0; k < count; ++k) add(0.5, 'f', 4);
      add(p[2], 'f', 8);
      add(scene.intensity[i], 'u', 1);
      add(1, 'u', 1);
      add(9, 'u', 1);
    }
  }
  expect_scene(read_text(kPlyFormat, text));
  expect_scene(read_text(kPlyFormat, little));
  expect_scene(read_text(kPlyFormat, big));
  const Outcome cut = read_text(kPlyFormat, little.substr(0, little.size() - 5));
  EXPECT_TRUE(cut.error);
  EXPECT_EQ(cut.rows().size(), Scene::kRows - 1);
  expect_damage(read_text(kPlyFormat, text.substr(0, text.size() - 3) + "3 9\n"), _,
                Scene::kRows - 1, Scene::kRows + 11);
}

TEST(Ply, RefusesDamagedHeaders) {
  const std::string good = ply_header("binary_little_endian", "float");
  const auto with = [&good](const std::string& from, const std::string& to) {
    std::string bytes = good;
    bytes.replace(bytes.find(from), from.size(), to);
    return open_problem(kPlyFormat, bytes);
  };
  EXPECT_THAT(with("element vertex 1500", "element vertex -1"), NamesField("\"-1\""));
  EXPECT_THAT(with("element vertex", "element points"), NamesField("vertex"));
  EXPECT_THAT(with("property float x", "property quad x"), NamesField("quad"));
  EXPECT_THAT(with("binary_little_endian", "binary"), NamesField("ascii"));
  EXPECT_THAT(with("end_header\n", "end"), NamesField("end of the file"));
  EXPECT_THAT(with("element camera 1", "element camera 9000000000000000000"),
              NamesField("found the end"));
}

// ---- NumPy -----------------------------------------------------------------------------------

std::string npy(const std::string& descr, const std::string& shape, const std::string& data,
                bool fortran = false, int version = 1) {
  std::string header = fmt::format("{{'descr': {}, 'fortran_order': {}, 'shape': {}, }}", descr,
                                   fortran ? "True" : "False", shape);
  header.resize(header.size() < 118 ? 118 : 246, ' ');
  header.back() = '\n';
  return std::string("\x93NUMPY") + static_cast<char>(version) + '\0' +
         number_bytes(static_cast<double>(header.size()), 'u', version == 1 ? 2 : 4, false) +
         header + data;
}

TEST(Npy, StructuredAndPlainArrays) {
  const Scene scene;
  const std::string fields = "[('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('intensity', '|u1')]";
  expect_scene(read_text(kNpyFormat, npy(fields, "(1500,)", scene_bytes(scene, false))));
  expect_scene(read_text(kNpyFormat, npy(fields, "(30, 50)", scene_bytes(scene, false), false, 2)));
  expect_scene(
      read_text(kNpyFormat, npy("[('x', '>f8'), ('y', '>f8'), ('z', '>f8'), ('intensity', '|u1')]",
                                "(1500,)", scene_bytes(scene, false, 'f', 8, 1.0, true))));
  expect_scene(read_text(kNpyFormat, npy("[('xyz', '<f8', (3,)), ('intensity', '|u1')]", "(1500,)",
                                         scene_bytes(scene, false, 'f', 8))));
  struct Plain {
    const char* descr;
    char kind;
    std::size_t bytes;
    double per_m;
    bool big_endian;
  };
  for (const Plain& p : {Plain{"'<f4'", 'f', 4, 1, false}, Plain{"'<f8'", 'f', 8, 1, false},
                         Plain{"'>f4'", 'f', 4, 1, true}, Plain{"'<i4'", 'i', 4, 1000, false},
                         Plain{"'<i2'", 'i', 2, 1000, false}, Plain{"'>i8'", 'i', 8, 1000, true}}) {
    for (const bool fortran : {false, true}) {
      SCOPED_TRACE(fmt::format("{} {}", p.descr, fortran));
      const Outcome outcome = read_text(
          kNpyFormat,
          npy(p.descr, "(1500, 3)",
              scene_bytes(scene, fortran, p.kind, p.bytes, p.per_m, p.big_endian, false), fortran));
      expect_scene(outcome, false);
      EXPECT_THAT(warnings_of(outcome), Contains(Warns(kWarning.columns_guessed, {"x y z"})));
    }
  }
}

TEST(Npy, TimesWithAUnitOfTheirType) {
  std::string rows;
  for (int i = 0; i < 10; ++i) {
    for (const double value : {1.5, 2.5, 3.5}) rows += number_bytes(value, 'f', 8, false);
    rows += number_bytes(1.7e15 + 10 * i, 'i', 8, false);
  }
  const Outcome outcome = read_text(
      kNpyFormat,
      npy("[('x', '<f8'), ('y', '<f8'), ('z', '<f8'), ('time', '<M8[us]')]", "(10,)", rows));
  ASSERT_FALSE(outcome.error);
  EXPECT_TRUE(outcome.recording.header.has_times);
  EXPECT_EQ(outcome.recording.header.time_reference, TimeReference::utc);
  EXPECT_EQ(outcome.rows().time_ns[3], 1'700'000'000'000'030'000);
}

TEST(Npy, Damage) {
  const Scene scene;
  const std::string rows = scene_bytes(scene, false, 'f', 4, 1.0, false, false);
  expect_prefix_and_error(kNpyFormat, npy("'<f4'", "(1500, 3)", rows.substr(0, 12 * 600 + 1)), 600,
                          128 + 12 * 600 + 1, "900 more points");
  expect_prefix_and_error(kNpyFormat, npy("'<f4'", "(100000000000, 3)", rows), 1500,
                          128 + rows.size(), "more points");
  for (const auto& [descr, shape, named] : {std::tuple{"'<f4'", "(4611686018427387904, 4)", "2^63"},
                                            {"'<f4'", "(5, 7)", "5 x 7"},
                                            {"'<f4'", "()", "element"},
                                            {"'|O'", "(5,)", "type"},
                                            {"'<U5'", "(5,)", "type"},
                                            {"'<f4", "(5,)", "'}'"},
                                            {"[('x', '<f4')]", "(5,)", "azimuth and zenith"},
                                            {"'<f4'", "(-5, 3)", "0 or more"},
                                            {"[('a', '|V99999999')]", "(5,)", "type"},
                                            {"[[[[[[[[[[", "(5,)", "'('"},
                                            {"[('x', '<f4', (70000,))]", "(5,)", "65536"}}) {
    SCOPED_TRACE(fmt::format("{} {}", descr, shape));
    EXPECT_THAT(open_problem(kNpyFormat, npy(descr, shape, rows)), NamesField(named));
  }
  EXPECT_THAT(open_problem(kNpyFormat, npy("'<f4'", "(5, 3)", "").substr(0, 50)),
              NamesField("found the end"));
}

std::string deflated(const std::string& bytes) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&stream, bytes.size()), '\0');
  std::string in = bytes;
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

std::string u(std::uint64_t value, std::size_t bytes) {
  std::string out(bytes, '\0');
  std::memcpy(out.data(), &value, bytes);
  return out;
}

/// A zip file of members, with 64-bit sizes where asked for.
std::string zip(const std::vector<std::pair<std::string, std::string>>& members, bool deflate_them,
                bool zip64 = false, std::uint64_t claimed_bytes = 0) {
  std::string file, directory;
  for (const auto& [name, bytes] : members) {
    const std::string stored = deflate_them ? deflated(bytes) : bytes;
    const auto crc =
        crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size()));
    const std::uint64_t size = claimed_bytes > 0 ? claimed_bytes : bytes.size();
    const std::uint64_t place = file.size();
    const std::string extra =
        zip64 ? u(1, 2) + u(24, 2) + u(size, 8) + u(stored.size(), 8) + u(place, 8) : "";
    const std::string common = u(deflate_them ? 8 : 0, 2) + u(0, 4) + u(crc, 4) +
                               u(zip64 ? UINT32_MAX : stored.size(), 4) +
                               u(zip64 ? UINT32_MAX : size, 4) + u(name.size(), 2);
    file += u(0x04034b50, 4) + u(45, 2) + u(0, 2) + common + u(0, 2) + name + stored;
    directory += u(0x02014b50, 4) + u(45, 2) + u(45, 2) + u(0, 2) + common + u(extra.size(), 2) +
                 u(0, 2) + u(0, 2) + u(0, 2) + u(0, 4) + u(zip64 ? UINT32_MAX : place, 4) + name +
                 extra;
  }
  const std::uint64_t begin = file.size();
  file += directory;
  if (zip64) {
    const std::uint64_t end = file.size();
    file += u(0x06064b50, 4) + u(44, 8) + u(45, 2) + u(45, 2) + u(0, 8) + u(members.size(), 8) +
            u(members.size(), 8) + u(directory.size(), 8) + u(begin, 8);
    file += u(0x07064b50, 4) + u(0, 4) + u(end, 8) + u(1, 4);
  }
  return file + u(0x06054b50, 4) + u(0, 4) +
         (zip64 ? u(0xFFFF, 2) + u(0xFFFF, 2) + u(UINT32_MAX, 4) + u(UINT32_MAX, 4)
                : u(members.size(), 2) + u(members.size(), 2) + u(directory.size(), 4) +
                      u(begin, 4)) +
         u(0, 2);
}

std::vector<std::pair<std::string, std::string>> scene_members() {
  const Scene scene;
  std::vector<std::pair<std::string, std::string>> members;
  for (std::size_t column = 0; column < 3; ++column) {
    std::string data;
    for (const auto& point : scene.points) data += number_bytes(point[column], 'f', 8, false);
    members.emplace_back(std::string(1, static_cast<char>('x' + column)) + ".npy",
                         npy("'<f8'", "(1500,)", data));
  }
  std::string intensity;
  for (const int value : scene.intensity) intensity += static_cast<char>(value);
  members.emplace_back("intensity.npy", npy("'|u1'", "(1500,)", intensity));
  members.emplace_back("about.npy", npy("'<i4'", "(2,)", std::string(8, '\1')));
  return members;
}

TEST(Npz, StoredDeflatedAndZip64) {
  for (const bool deflate_them : {false, true}) {
    for (const bool zip64 : {false, true}) {
      SCOPED_TRACE(fmt::format("{} {}", deflate_them, zip64));
      const std::string bytes = zip(scene_members(), deflate_them, zip64);
      EXPECT_TRUE(kNpzFormat.recognises(bytes));
      const Outcome outcome = read_text(kNpzFormat, bytes);
      expect_scene(outcome);
      EXPECT_THAT(warnings_of(outcome), Contains(Warns(kWarning.columns_unused, {"about"})));
      auto members = scene_members();
      const Scene scene;
      members.erase(members.begin(), members.begin() + 3);
      members.emplace_back(
          "points.npy",
          npy("'<f4'", "(1500, 3)", scene_bytes(scene, true, 'f', 4, 1.0, false, false), true));
      expect_scene(read_text(kNpzFormat, zip(members, deflate_them, zip64)));
    }
  }
}

TEST(Npz, TimesOfAnArrayOfTheirOwnAreUsed) {
  const Scene scene;
  std::string times;
  for (std::size_t i = 0; i < Scene::kRows; ++i) {
    times += number_bytes(1.6e9 + 1e-5 * static_cast<double>(i), 'f', 8, false);
  }
  for (const char* name : {"timestamps", "times", "ts", "stamps", "timestamp", "t"}) {
    SCOPED_TRACE(name);
    const Outcome outcome = read_text(
        kNpzFormat, zip({{"points.npy", npy("'<f8'", "(1500, 3)",
                                            scene_bytes(scene, false, 'f', 8, 1.0, false, false))},
                         {std::string(name) + ".npy",
                          npy("'<f8'", name[0] == 't' ? "(1500,)" : "(1500, 1)", times)},
                         {"intensities.npy", npy("'|u1'", "(1500,)", std::string(1500, '\7'))}},
                        false));
    ASSERT_FALSE(outcome.error);
    EXPECT_TRUE(outcome.recording.header.has_times);
    ASSERT_EQ(outcome.rows().size(), Scene::kRows);
    EXPECT_NEAR(static_cast<double>(outcome.rows().time_ns[1000] - outcome.rows().time_ns[0]), 1e7,
                500);
    EXPECT_EQ(outcome.rows().intensity[3], 7);
  }
}

TEST(Npz, Damage) {
  const std::string bytes = zip(scene_members(), false);
  std::string flipped = bytes;
  flipped[128 + 40 + 8 * 1000] ^= 1;
  expect_damage(read_text(kNpzFormat, flipped), NamesField("checksum"), Scene::kRows);
  EXPECT_THAT(open_problem(kNpzFormat, bytes.substr(0, bytes.size() - 30)), NamesField("cut off"));
  EXPECT_THAT(open_problem(kNpzFormat, zip({{"x.txt", "hello"}}, false)), NamesField("array"));
  EXPECT_THAT(open_problem(kNpzFormat, zip(scene_members(), true, false, 4'000'000'000)),
              NamesField("compressed bytes can hold"));
  EXPECT_THAT(open_problem(kNpzFormat, zip(scene_members(), true, true, UINT64_MAX / 2)),
              NamesField("compressed bytes can hold"));
  EXPECT_THAT(open_problem(kNpzFormat, zip(scene_members(), true, false, 20'000)),
              NamesField("12128 bytes"));
  auto unequal = scene_members();
  unequal[0].second = npy("'<f8'", "(3,)", std::string(24, '\0'));
  EXPECT_THAT(open_problem(kNpzFormat, zip(unequal, false)), NamesField("azimuth and zenith"));
  // Every byte of the directory may be damaged: never more than an error.
  const std::size_t directory = bytes.find("PK\x01\x02");
  for (std::size_t i = directory; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = '\xFF';
    read_text(kNpzFormat, damaged);
  }
}

// ---- shot rate -------------------------------------------------------------------------------

TEST(ShotRate, CountsTimes) {
  const TestFolder folder;
  const std::string path = folder.file("a.csv");
  put_bytes(path, "index,x_m,y_m,z_m\n0,1.5,2.5,3.5\n1,0,0,0\n7,1.5,2.5,3.5\n");
  EXPECT_FALSE(load_recording(path).header.has_times);
  const Recording counted = load_recording(path, {}, {.shot_rate = 240'000.0});
  EXPECT_TRUE(counted.header.has_times);
  EXPECT_EQ(counted.data.observations.time_ns, (std::vector<std::int64_t>{0, 4167, 29167}));
  // Times that the file holds are replaced; further returns belong to the shot before them.
  put_bytes(path,
            "time_s,x_m,y_m,z_m,return\n5.0,1.5,2.5,3.5,1\n5.0,1.5,2.5,4.5,2\n9.0,1,2,3,1\n"
            "9.1,0,0,0,1\n");
  EXPECT_EQ(load_recording(path).data.observations.time_ns[0], 5'000'000'000);
  EXPECT_EQ(load_recording(path, {}, {.shot_rate = 1000.0}).data.observations.time_ns,
            (std::vector<std::int64_t>{0, 0, 1'000'000, 2'000'000}));
  for (const double rate : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THROW(open_recording(path, {.shot_rate = rate}), InvalidArgument);
  }
  EXPECT_THROW(load_recording(path, {}, {.shot_rate = 1e-12}), FileError);
}

TEST(ShotRate, EmittersThatTheFileDoesNotNameFireInTurn) {
  const TestFolder folder;
  const std::string path = folder.file("a.csv");
  const ReadOptions six{.shot_rate = 240'000.0, .emitters = 6};
  put_bytes(path, "index,x_m,y_m,z_m\n0,1,2,3\n1,0,0,0\n7,1,2,3\n12,1,2,3\n");
  EXPECT_EQ(load_recording(path, {}, six).data.observations.beam,
            (std::vector<std::uint8_t>{0, 1, 1, 0}));
  EXPECT_EQ(load_recording(path, {}, {.shot_rate = 240'000.0}).data.observations.beam,
            std::vector<std::uint8_t>(4, 0));
  // They may begin with any of them and go backwards.
  ReadOptions other = six;
  other.firing_order = {4, 5, 0, 1, 2, 3};
  EXPECT_EQ(load_recording(path, {}, other).data.observations.beam,
            (std::vector<std::uint8_t>{4, 5, 5, 4}));
  other.firing_order = {4, 3, 2, 1, 0, 5};
  EXPECT_EQ(load_recording(path, {}, other).data.observations.beam,
            (std::vector<std::uint8_t>{4, 3, 3, 4}));
  // A further return is of the shot's emitter.
  put_bytes(path, "time_s,x_m,y_m,z_m,return\n5,1,2,3,1\n5,1,2,4,2\n5.1,1,2,3,1\n");
  EXPECT_EQ(load_recording(path, {}, six).data.observations.beam,
            (std::vector<std::uint8_t>{0, 0, 1}));
  // Those that it names stay.
  put_bytes(path, "index,x_m,y_m,z_m,line\n0,1,2,3,0\n1,1,2,3,4\n2,1,2,3,2\n");
  EXPECT_EQ(load_recording(path, {}, six).data.observations.beam,
            (std::vector<std::uint8_t>{0, 4, 2}));
}

TEST(ShotRate, WritersOfTimesNeedThem) {
  const TestFolder folder;
  const std::string path = folder.file("a.csv");
  put_bytes(path, "index,x_m,y_m,z_m\n3,1.500,2.500,3.500\n4,0,0,0\n9,1.500,2.500,3.500\n");
  const Recording recording = load_recording(path);
  for (const char* name : {"a.lvx", "a.openpylivox.csv"}) {
    EXPECT_THROW(create_recording(folder.file(name), recording.header), MissingTimes) << name;
  }
  const auto writer = create_recording(folder.file("a.nc"), recording.header);
  writer->write(recording.data);
  writer->close();
  const Recording copy = load_recording(folder.file("a.nc"));
  EXPECT_FALSE(copy.header.has_times);
  EXPECT_TRUE(is_same(copy.data.observations, recording.data.observations));
  const Recording counted = load_recording(folder.file("a.nc"), {}, {.shot_rate = 1e5});
  EXPECT_EQ(counted.data.observations.time_ns, (std::vector<std::int64_t>{30'000, 40'000, 90'000}));
}

TEST(ShotRate, ScanSequencesOfShotNumbers) {
  const TestFolder folder;
  const std::string path = folder.file("a.csv");
  const std::string bytes = "Time/s,Azimuth/deg,Zenith/deg\n1,19.17241,90.03013\n2,19.1,90.1\n";
  put_bytes(path, bytes);
  const Recording recording = load_recording(path);
  EXPECT_FALSE(recording.header.has_times);
  EXPECT_EQ(recording.data.observations.time_ns, (std::vector<std::int64_t>{1, 2}));
  const Recording counted = load_recording(path, {}, {.shot_rate = 1e5});
  write_all(kScanSequenceCsvFormat, folder.file("b.csv"), counted.header, counted.data);
  EXPECT_THAT(get_bytes(folder.file("b.csv")), HasSubstr("\n0.00001,19.17241,90.03013\n0.00002,"));
}

}  // namespace risley::recordings::named_formats_test
