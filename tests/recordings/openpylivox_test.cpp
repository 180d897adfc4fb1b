// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/io/little_endian.hpp"

#include "recordings/format_tests.hpp"

namespace risley::recordings::openpylivox_test {

using namespace format_tests;
using ::testing::_;
using ::testing::HasSubstr;

template <class T>
void append(std::string& bytes, std::type_identity_t<T> value) {
  std::uint8_t raw[sizeof(T)];
  io::store<T>(raw, value);
  bytes.append(reinterpret_cast<const char*>(raw), sizeof(T));
}

/// A capture as the program writes it: fixed records of the given layout.
std::string capture(int firmware_type, int data_type, int records) {
  std::string bytes = "OPENPYLIVOX";
  append<std::int16_t>(bytes, static_cast<std::int16_t>(firmware_type));
  append<std::int16_t>(bytes, static_cast<std::int16_t>(data_type));
  const bool paired = data_type >= 4, tagged = data_type >= 2;
  for (int k = 0; k < records; ++k) {
    const int returns = paired ? 2 : 1;
    if (data_type % 2 == 0) {
      for (int r = 0; r < returns; ++r) {
        append<std::int32_t>(bytes, 1000 + 10 * k + r);
        append<std::int32_t>(bytes, -2000 + k);
        append<std::int32_t>(bytes, 300 - 100 * k);
        append<std::uint8_t>(bytes, static_cast<std::uint8_t>(k + r));
        if (tagged) append<std::uint8_t>(bytes, static_cast<std::uint8_t>(0x10 * (r + 1)));
      }
    } else {
      const auto zenith = static_cast<std::uint16_t>(9000 + k);
      const auto azimuth = static_cast<std::uint16_t>((35'998 + k) % 36'000);
      if (!paired) append<std::uint32_t>(bytes, 5000 + k);
      append<std::uint16_t>(bytes, zenith);
      append<std::uint16_t>(bytes, azimuth);
      for (int r = 0; r < returns; ++r) {
        if (paired) append<std::uint32_t>(bytes, k == 1 && r == 1 ? 0 : 5000 + k + r);
        append<std::uint8_t>(bytes, static_cast<std::uint8_t>(k + r));
        if (tagged) append<std::uint8_t>(bytes, static_cast<std::uint8_t>(0x10 * (r + 1)));
      }
    }
    append<double>(bytes, (1'234'567'890'123 + 10'000 * (k / firmware_type)) / 1e9);
    if (firmware_type > 1) bytes += static_cast<char>('1' + k % firmware_type);
  }
  return bytes;
}

struct Layout {
  int firmware_type, data_type;
  std::size_t record_bytes;
};
const std::vector<Layout> kLayouts = {{1, 0, 21}, {1, 1, 17}, {1, 2, 22}, {1, 3, 18}, {1, 4, 36},
                                      {1, 5, 24}, {2, 0, 22}, {2, 1, 18}, {3, 0, 22}, {3, 1, 18}};

std::string imu_capture(int records) {
  std::string bytes = "OPENPYLIVOX_IMU";
  for (int k = 0; k < records; ++k) {
    for (int i = 0; i < 6; ++i) append<float>(bytes, 0.125F * static_cast<float>(i + k));
    append<double>(bytes, 0.005 * k);
  }
  return bytes;
}

TEST(OpenpylivoxBin, ReadsEveryLayout) {
  for (const auto& layout : kLayouts) {
    SCOPED_TRACE(fmt::format("firmware {}, data type {}", layout.firmware_type, layout.data_type));
    const std::string bytes = capture(layout.firmware_type, layout.data_type, 6);
    ASSERT_EQ(bytes.size(), 15 + 6 * layout.record_bytes);
    EXPECT_TRUE(kOpenpylivoxBinFormat.recognises(bytes));
    const Outcome outcome = read_text(kOpenpylivoxBinFormat, bytes, 3);
    ASSERT_FALSE(outcome.error) << outcome.error->what();
    EXPECT_TRUE(outcome.recording.warnings.empty());
    const auto& header = outcome.recording.header;
    const bool paired = layout.data_type >= 4;
    EXPECT_EQ(header.cartesian, layout.data_type % 2 == 0);
    EXPECT_EQ(header.returns_per_shot, paired ? 2 : layout.firmware_type);
    const auto& rows = outcome.rows();
    ASSERT_EQ(rows.size(), paired ? 12U : 6U);
    EXPECT_EQ(rows.time_ns[0], 1'234'567'890'123);
    EXPECT_EQ(rows.time_ns.back(), 1'234'567'890'123 + 10'000 * (5 / layout.firmware_type));
    EXPECT_EQ(rows.return_number[1], paired ? 2 : layout.firmware_type == 1 ? 1 : 2);
    EXPECT_EQ(rows.tag[0], layout.data_type >= 2 ? 0x10 : 0);
    if (header.cartesian) {
      EXPECT_NEAR(rows.azimuth[0], std::atan2(-2000.0, 1000.0), 1e-15);
      EXPECT_NEAR(rows.range[0], std::sqrt(1000.0 * 1000 + 2000.0 * 2000 + 300.0 * 300) / 1000,
                  1e-12);
      EXPECT_FLOAT_EQ(rows.range_resolution[0], 1e-3F);
      EXPECT_FLOAT_EQ(rows.zenith_resolution[0], static_cast<float>(1e-3 / rows.range[0]));
      EXPECT_FLOAT_EQ(rows.azimuth_resolution[0],
                      static_cast<float>(1e-3 / (rows.range[0] * std::sin(rows.zenith[0]))));
    } else {
      EXPECT_NEAR(rows.azimuth[0], radians_from_degrees(-0.02), 1e-15);
      EXPECT_NEAR(rows.zenith[0], radians_from_degrees(90.0), 1e-15);
      EXPECT_DOUBLE_EQ(rows.range[0], 5.0);
      EXPECT_FLOAT_EQ(rows.azimuth_resolution[0], static_cast<float>(radians_from_degrees(0.01)));
    }
  }
}

TEST(OpenpylivoxBin, ReadsInertialSamples) {
  const Outcome outcome = read_text(kOpenpylivoxBinFormat, imu_capture(5), 2);
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  const auto& imu = outcome.recording.data.imu;
  ASSERT_EQ(imu.size(), 5U);
  EXPECT_EQ(imu[4].time_ns, 20'000'000);
  EXPECT_EQ(imu[4].angular_velocity[0], 0.5F);
  EXPECT_EQ(imu[4].acceleration_g[2], 1.125F);
}

TEST(OpenpylivoxBin, CutAtEveryByte) {
  for (const auto& layout : kLayouts) {
    SCOPED_TRACE(fmt::format("firmware {}, data type {}", layout.firmware_type, layout.data_type));
    check_cuts(kOpenpylivoxBinFormat, capture(layout.firmware_type, layout.data_type, 5), 1,
               [&](std::string_view head) {
                 const std::size_t body = head.size() - 15;
                 const std::size_t rows_per_record = layout.data_type >= 4 ? 2 : 1;
                 return std::pair{body / layout.record_bytes * rows_per_record,
                                  body % layout.record_bytes != 0};
               });
  }
  check_cuts(kOpenpylivoxBinFormat, imu_capture(3), 1, [](std::string_view head) {
    return std::pair{(head.size() - 15) / 32, (head.size() - 15) % 32 != 0};
  });
}

TEST(OpenpylivoxBin, SaysWhereItIsDamaged) {
  struct Case {
    const char* name;
    std::string bytes;
    std::uint64_t offset;
    std::size_t sound_rows;
  };
  const auto with = [](std::string bytes, std::size_t offset, std::string_view change) {
    return bytes.replace(offset, change.size(), change);
  };
  const std::string nan("\0\0\0\0\0\0\xF8\x7F", 8);
  const std::vector<Case> cases = {
      {"empty", "", 0, 0},
      {"short", "OPENPYLIVOX\1", 12, 0},
      {"other", "OPENPYLIVER4567", 0, 0},
      {"firmware", with(capture(1, 0, 2), 11, "\4"), 11, 0},
      {"data type", with(capture(1, 0, 2), 13, "\6"), 13, 0},
      {"data type of special firmware", with(capture(2, 0, 2), 13, "\2"), 13, 0},
      {"time", with(capture(1, 0, 4), 15 + 2 * 21 + 13, nan), 15 + 2 * 21 + 13, 2},
      {"return digit", with(capture(2, 0, 4), 15 + 3 * 22 - 1, "3"), 15 + 3 * 22 - 1, 2},
      {"zenith", with(capture(1, 1, 4), 15 + 2 * 17 + 4, "\xFF\xFF"), 15 + 2 * 17, 2},
  };
  for (const auto& c : cases) {
    for (const std::size_t chunk_rows : {std::size_t{1}, kDefaultChunkRows}) {
      SCOPED_TRACE(c.name);
      const Outcome outcome = read_text(kOpenpylivoxBinFormat, c.bytes, chunk_rows);
      expect_damage(outcome, _, c.sound_rows, c.offset);
    }
  }
}

// ---- text ----------------------------------------------------------------------------------

const std::vector<std::string> kTables = {
    "//X,Y,Z,Inten-sity,Time\n"
    "1.234,-5.678,0.010,17,0.000010\n3.000,0.000,-0.001,255,0.000020\n",
    "//Distance,Zenith,Azimuth,Inten-sity,Time\n"
    "12.345,90.01,359.99,17,86399.999990\n1.000,0.00,0.00,0,86400.000000\n"
    "2.000,180.00,360.00,3,86400.000010\n2.000,5.00,180.00,3,86400.000020\n",
    "//X,Y,Z,Inten-sity,Time,ReturnNum\n"
    "1.234,-5.678,0.010,17,0.000010,1\n1.235,-5.680,0.010,200,0.000010,2\n",
    "//Distance,Zenith,Azimuth,Inten-sity,Time,ReturnNum\n"
    "12.345,90.01,359.99,17,0.000010,1\n12.545,90.01,359.99,200,0.000010,2\n"
    "12.745,90.01,359.99,250,0.000010,3\n",
    "//X,Y,Z,Inten-sity,Time,ReturnNum,ReturnType,sConf,iConf\n"
    "1.234,-5.678,0.010,17,0.000010,1,1,0,2\n1.235,-5.680,0.010,20,0.000010,2,3,3,3\n",
    "//Distance,Zenith,Azimuth,Inten-sity,Time,ReturnNum,ReturnType,sConf,iConf\n"
    "12.345,90.01,359.99,17,0.000010,1,0,0,1\n12.545,90.01,359.99,20,0.000014,1,2,1,0\n",
    "//gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z,time\n"
    "0.012345,-0.000001,-0.000000,0.100000,1.250000,-0.987654,1.000000\n"
    "0.500000,0.250000,7.123456,0.000000,-1.000000,0.999999,1.005000\n"};

TEST(OpenpylivoxCsv, RewritesTheSameBytes) {
  for (const auto& table : kTables) {
    SCOPED_TRACE(table);
    EXPECT_TRUE(kOpenpylivoxCsvFormat.recognises(table));
    EXPECT_FALSE(kScanSequenceCsvFormat.recognises(table));
    EXPECT_EQ(rewritten(kOpenpylivoxCsvFormat, table, 1), table);
    EXPECT_EQ(rewritten(kOpenpylivoxCsvFormat, table), table);
  }
}

TEST(OpenpylivoxCsv, ReadsTheColumns) {
  const Outcome dual = read_text(kOpenpylivoxCsvFormat, kTables[4]);
  ASSERT_FALSE(dual.error);
  EXPECT_EQ(dual.recording.header.returns_per_shot, 2);
  EXPECT_EQ(dual.rows().tag, (std::vector<std::uint8_t>{0b00'10'01'00, 0b11'11'11'00}));
  EXPECT_EQ(dual.rows().return_number, (std::vector<std::uint8_t>{1, 2}));
  EXPECT_NEAR(dual.rows().azimuth[0], std::atan2(-5.678, 1.234), 1e-15);

  const Outcome polar = read_text(kOpenpylivoxCsvFormat, kTables[1]);
  ASSERT_FALSE(polar.error);
  EXPECT_EQ(polar.rows().time_ns[0], 86'399'999'990'000);
  EXPECT_DOUBLE_EQ(polar.rows().range[0], 12.345);
  EXPECT_NEAR(polar.rows().azimuth[0], radians_from_degrees(-0.01), 1e-15);
  EXPECT_DOUBLE_EQ(polar.rows().azimuth[3], kPi);
  EXPECT_EQ(polar.rows().intensity[0], 17);
  EXPECT_EQ(polar.recording.header.devices[0].type, 1);

  const Outcome nulls =
      read_text(kOpenpylivoxCsvFormat, "//X,Y,Z,Inten-sity,Time\n0.000,0.000,0.000,0,0.000010\n");
  ASSERT_EQ(nulls.rows().size(), 1U);
  EXPECT_EQ(nulls.rows().valid[0], 0);
  EXPECT_EQ(nulls.rows().range[0], 0.0);
}

TEST(OpenpylivoxCsv, NamesTheDamagedLine) {
  struct Case {
    std::size_t table;
    const char* row;
    const char* problem;
  };
  for (const auto& c : {Case{0, "1.0,2.0,3.0,4", "found 4"},
                        {0, "nan,2.0,3.0,4,0.1", "column X"},
                        {0, "1.0,2.0,3e9,4,0.1", "expected Z"},
                        {0, "1.0,2.0,3.0,256,0.1", "[0, 255]"},
                        {0, "1.0,2.0,3.0,4.5,0.1", "Inten-sity"},
                        {1, "-1.0,90.0,0.0,4,0.1", "Distance"},
                        {1, "1.0,180.01,0.0,4,0.1", "Zenith"},
                        {1, "1.0,90.0,360.01,4,0.1", "Azimuth"},
                        {1, "1.0,90.0,inf,4,0.1", "Azimuth"},
                        {1, "1.0,90.0,0.0,4,x", "Time"},
                        {2, "1.0,2.0,3.0,4,0.1,0", "ReturnNum"},
                        {2, "1.0,2.0,3.0,4,0.1,4", "ReturnNum"},
                        {4, "1.0,2.0,3.0,4,0.1,1,4,0,0", "ReturnType"},
                        {4, "1.0,2.0,3.0,4,0.1,1,0,-1,0", "sConf"},
                        {4, "1.0,2.0,3.0,4,0.1,1,0,0,9", "iConf"},
                        {6, "0,0,0,0,0,nan,1.0", "acc_z"}}) {
    SCOPED_TRACE(c.row);
    const std::string text = kTables[c.table] + c.row + "\n" + "more\n";
    const auto rows = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) - 3;
    const Outcome outcome = read_text(kOpenpylivoxCsvFormat, text);
    expect_damage(outcome, HasSubstr(c.problem), {}, rows + 2);
    EXPECT_EQ(outcome.rows().size() + outcome.recording.data.imu.size(), rows);
  }
  for (const std::string header : {"//X,Y,Z\n", "X,Y,Z,Inten-sity,Time\n", ""}) {
    EXPECT_FALSE(kOpenpylivoxCsvFormat.recognises(header));
    EXPECT_TRUE(read_text(kOpenpylivoxCsvFormat, header).error);
  }
}

// ---- both ----------------------------------------------------------------------------------

TEST(Openpylivox, TextAndBinaryHoldTheSame) {
  for (const auto& layout : kLayouts) {
    SCOPED_TRACE(fmt::format("firmware {}, data type {}", layout.firmware_type, layout.data_type));
    const std::string bytes = capture(layout.firmware_type, layout.data_type, 6);
    const Outcome binary = read_text(kOpenpylivoxBinFormat, bytes);
    const std::string table = rewritten(kOpenpylivoxBinFormat, bytes, 3, &kOpenpylivoxCsvFormat);
    EXPECT_THAT(table, HasSubstr("ReturnNum"));  // as the program's own conversion
    const Outcome text = read_text(kOpenpylivoxCsvFormat, table);
    ASSERT_FALSE(text.error) << text.error->what();
    const bool null_dropped = layout.data_type == 5;
    ASSERT_EQ(text.rows().size(), binary.rows().size() - (null_dropped ? 1 : 0));
    EXPECT_EQ(text.rows().time_ns[0], binary.rows().time_ns[0]);
    EXPECT_EQ(text.recording.header.returns_per_shot, binary.recording.header.returns_per_shot);
  }
}

RecordingHeader foreign_header(bool cartesian, int returns, std::uint8_t device_type) {
  RecordingHeader header;
  header.format = "lvx-1.1";
  header.devices.resize(1);
  header.devices[0].type = device_type;
  header.cartesian = cartesian;
  header.returns_per_shot = returns;
  return header;
}

Chunk one_row(double range) {
  Chunk chunk;
  chunk.observations.resize(1);
  chunk.observations.range[0] = range;
  chunk.observations.zenith[0] = 1.5;
  chunk.observations.return_number[0] = 1;
  chunk.observations.valid[0] = range != 0.0;
  return chunk;
}

TEST(Openpylivox, ChoosesTheColumnsByTheHeader) {
  struct Case {
    bool cartesian;
    int returns;
    std::uint8_t device_type;
    const char* columns;
  };
  const TestFolder folder;
  for (const auto& c :
       {Case{true, 1, 1, "//X,Y,Z,Inten-sity,Time\n"},
        {false, 1, 1, "//Distance,Zenith,Azimuth,Inten-sity,Time\n"},
        {true, 2, 1, "//X,Y,Z,Inten-sity,Time,ReturnNum\n"},
        {false, 3, 1, "//Distance,Zenith,Azimuth,Inten-sity,Time,ReturnNum\n"},
        {true, 1, 6, "//X,Y,Z,Inten-sity,Time,ReturnNum,ReturnType,sConf,iConf\n"},
        {false, 2, 7,
         "//Distance,Zenith,Azimuth,Inten-sity,Time,ReturnNum,ReturnType,sConf,iConf\n"}}) {
    const std::string path = folder.file("chosen");
    const auto header = foreign_header(c.cartesian, c.returns, c.device_type);
    write_all(kOpenpylivoxCsvFormat, path, header, one_row(10.0));
    EXPECT_TRUE(get_bytes(path).starts_with(c.columns)) << get_bytes(path);
    EXPECT_EQ(read_all(kOpenpylivoxCsvFormat, path).rows().valid[0], 1);
  }
  const auto& format = kOpenpylivoxCsvFormat;
  EXPECT_THROW(format.create(folder.file("x"), foreign_header(true, 3, 7), {}), InvalidArgument);
  auto header = foreign_header(false, 1, 1);
  header.has_range = false;
  EXPECT_THROW(format.create(folder.file("x"), header, {}), InvalidArgument);
}

TEST(Openpylivox, RefusesWhatItCannotHoldAndDropsNulls) {
  const TestFolder folder;
  const auto& format = kOpenpylivoxCsvFormat;
  const std::string path = folder.file("written");
  write_all(format, path, foreign_header(false, 1, 1), one_row(0.0));
  EXPECT_EQ(read_all(format, path).rows().size(), 0U);
  const auto refuse = [&](const Chunk& chunk, bool cartesian = false) {
    EXPECT_THROW(format.create(folder.file("x"), foreign_header(cartesian, 1, 1), {})->write(chunk),
                 InvalidArgument);
  };
  for (const double range : {std::numeric_limits<double>::quiet_NaN(), -1.0,
                             std::numeric_limits<double>::infinity(), 5e6}) {
    refuse(one_row(range));
  }
  refuse(one_row(3e6), true);
  Chunk chunk = one_row(1.0);
  chunk.observations.azimuth[0] = std::numeric_limits<double>::quiet_NaN();
  refuse(chunk);
  chunk = one_row(1.0);
  chunk.observations.append(one_row(1.0).observations);
  chunk.observations.device[1] = 1;
  refuse(chunk);
  EXPECT_EQ(folder.names().size(), 1U) << "an unfinished writer must leave nothing";
}

TEST(OpenpylivoxCsv, PointsCloserThanTheStepAreCounted) {
  for (const bool cartesian : {false, true}) {
    RecordingHeader header;
    header.devices.resize(1);
    header.cartesian = cartesian;
    Chunk chunk;
    chunk.observations.resize(3);
    for (std::size_t row = 0; row < 3; ++row) {
      chunk.observations.zenith[row] = 1.5;
      chunk.observations.valid[row] = 1;
      chunk.observations.return_number[row] = 1;
    }
    chunk.observations.range = {5.0, 0.0001, 6.0};
    const TestFolder folder;
    const auto writer =
        kOpenpylivoxCsvFormat.create(folder.file("out.openpylivox.csv"), header, {});
    writer->write(chunk);
    writer->close();
    EXPECT_EQ(writer->left_out(), 1U);
    EXPECT_EQ(read_all(kOpenpylivoxCsvFormat, folder.file("out.openpylivox.csv")).rows().size(),
              2U);
  }
}

TEST(OpenpylivoxCsv, ReadsTheLastCoordinateOf32Bits) {
  const Outcome outcome = read_text(
      kOpenpylivoxCsvFormat, "//X,Y,Z,Inten-sity,Time\n-2147483.648,0.000,0.000,4,0.000010\n");
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  EXPECT_EQ(outcome.rows().size(), 1U);
  EXPECT_TRUE(read_text(kOpenpylivoxCsvFormat,
                        "//X,Y,Z,Inten-sity,Time\n2147483.648,0.000,0.000,4,0.000010\n")
                  .error);
}

}  // namespace risley::recordings::openpylivox_test
