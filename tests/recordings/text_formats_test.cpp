// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/recordings/livox/packet.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/formats/text_table.hpp"

namespace risley::recordings::text_formats_test {

using namespace format_tests;
using ::testing::ElementsAre;

const std::string kHead = "Time/s,Azimuth/deg,Zenith/deg\n";
const std::string kSmall = kHead +
                           "0.00001,19.17241,90.03013\n"
                           "0.00002,-19.17124,90.06025\n"
                           "0.00003,0.00000,0.00000\n"
                           "0.00004,-0.00000,180.00000\n"
                           "0.00005,180.00000,89.99999\n"
                           "0.00006,-180.00000,12.00000\n";

/// Complete rows of a text with one header line, when the last line may count without its end.
std::pair<std::size_t, bool> lines_in(std::string_view text, std::size_t last_decimals) {
  const auto lines = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  if (lines == 0) return {0, true};
  const auto tail = text.substr(text.rfind('\n') + 1);
  if (tail.empty()) return {lines - 1, false};
  if (tail.back() == '\r') return {lines, false};
  const auto comma = tail.rfind(','), point = tail.rfind('.');
  const bool whole = std::count(tail.begin(), tail.end(), ',') == 2 && lines > 1 &&
                     point != tail.npos && point > comma &&
                     tail.size() - point - 1 == last_decimals;
  return {whole ? lines : lines - 1, !whole};
}

struct Damage {
  const char* name;
  std::string text;
  std::uint64_t line;
  std::size_t sound_rows;
  const char* named;
};

void check_damage(const Format& format, const std::vector<Damage>& cases) {
  for (const auto& damage : cases) {
    for (const std::size_t chunk_rows : {std::size_t{1}, kDefaultChunkRows}) {
      SCOPED_TRACE(damage.name);
      const Outcome outcome = read_text(format, damage.text, chunk_rows);
      expect_damage(outcome, NamesField(damage.named), damage.sound_rows, damage.line);
    }
  }
}

TEST(ScanSequence, ReadsTheColumns) {
  const Outcome outcome = read_text(kScanSequenceCsvFormat, kSmall);
  ASSERT_FALSE(outcome.error);
  const auto& rows = outcome.rows();
  ASSERT_EQ(rows.size(), 6U);
  EXPECT_FALSE(outcome.recording.header.has_range);
  EXPECT_EQ(outcome.recording.header.format, "scan-sequence-csv");
  EXPECT_EQ(rows.time_ns, (std::vector<std::int64_t>{10000, 20000, 30000, 40000, 50000, 60000}));
  EXPECT_DOUBLE_EQ(rows.azimuth[0], radians_from_degrees(19.17241));
  EXPECT_DOUBLE_EQ(rows.azimuth[1], radians_from_degrees(-19.17124));
  EXPECT_DOUBLE_EQ(rows.zenith[0], radians_from_degrees(90.03013));
  EXPECT_DOUBLE_EQ(rows.azimuth[4], kPi);
  EXPECT_GT(rows.azimuth[5], -kPi);
  EXPECT_DOUBLE_EQ(rows.zenith[3], kPi);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_TRUE(std::isnan(rows.range[i]));
    EXPECT_EQ(rows.valid[i], 1);
    EXPECT_EQ(rows.return_number[i], 1);
    EXPECT_FLOAT_EQ(rows.azimuth_resolution[i], static_cast<float>(radians_from_degrees(1e-5)));
    EXPECT_FLOAT_EQ(rows.zenith_resolution[i], static_cast<float>(radians_from_degrees(1e-5)));
  }
}

TEST(ScanSequence, RewritesTheSameBytes) {
  const std::vector<std::string> files = {
      kSmall,
      kHead,
      kHead + "0.0,19.172406,89.969872\n1.5,19.1,90.0\n",  // digits of the first rows
      kHead + "0.000004167,1.50,90.00\n0.000008333,359.99,90.01\n0.000012500,360.00,90.02\n",
      kHead + "0,359.9876,88.5\n1,0.0000,87.5\n2,12.5000,86.5\n3,180.0001,85.5\n",  // shot numbers
      kHead + "-0.00001,1.00000,2.00000\n123456789.00000,1.00000,2.00000\n",
  };
  for (const auto& bytes : files) {
    SCOPED_TRACE(bytes);
    const std::string once = rewritten(kScanSequenceCsvFormat, bytes);
    if (bytes != files[2]) {
      EXPECT_EQ(once, bytes);
    }
    EXPECT_EQ(rewritten(kScanSequenceCsvFormat, once), once);
  }
}

TEST(ScanSequence, CountsWhatItHasNoPlaceFor) {
  const Outcome whole = read_text(kScanSequenceCsvFormat, kSmall);
  Chunk chunk = whole.recording.data;
  chunk.observations.valid[2] = 0;          // a shot without a direction
  chunk.observations.return_number[4] = 2;  // a further return of the shot before
  chunk.observations.time_ns[4] = chunk.observations.time_ns[3];
  const TestFolder folder;
  const auto writer =
      kScanSequenceCsvFormat.create(folder.file("out.csv"), whole.recording.header, {});
  writer->write(chunk);
  writer->close();
  EXPECT_EQ(writer->left_out(), 2U);
  EXPECT_EQ(read_all(kScanSequenceCsvFormat, folder.file("out.csv")).rows().size(), 4U);
}

TEST(ScanSequence, CutAtEveryByte) {
  check_cuts(kScanSequenceCsvFormat, kSmall, 1,
             [](std::string_view head) { return lines_in(head, 5); });
  std::string windows;
  for (const char c : kSmall) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  check_cuts(kScanSequenceCsvFormat, windows, 1, [](std::string_view head) {
    if (head.find('\n') == head.npos && head.ends_with('\r'))
      return std::pair{std::size_t{0}, false};
    return lines_in(head, 5);
  });
}

TEST(ScanSequence, SaysWhatACutLost) {
  const Outcome outcome =
      read_text(kScanSequenceCsvFormat, std::string_view(kSmall).substr(0, kSmall.size() - 4));
  ASSERT_EQ(outcome.recording.warnings.size(), 1U);
  const auto& warning = outcome.recording.warnings.front();
  EXPECT_EQ(warning.place.line, 7U);
  EXPECT_EQ(warning.lost_records, 1U);
  EXPECT_THAT(warning, Warns(kWarning.cut_off));
  EXPECT_EQ(outcome.rows().size(), 5U);
}

TEST(ScanSequence, AcceptsVariantsOfText) {
  const Outcome plain = read_text(kScanSequenceCsvFormat, kSmall);
  std::string windows, blanks;
  for (const char c : kSmall) {
    windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
    blanks += c == ',' ? std::string(", \t") : c == '\n' ? std::string(" \n") : std::string(1, c);
  }
  const std::vector<std::string> variants = {
      windows,       "\xEF\xBB\xBF" + kSmall,  "\xEF\xBB\xBF" + windows,           blanks,
      kSmall + "\n", windows + "\r\n\r\n  \n", kSmall.substr(0, kSmall.size() - 1)};
  for (const auto& variant : variants) {
    SCOPED_TRACE(variant);
    EXPECT_TRUE(kScanSequenceCsvFormat.recognises(variant));
    const Outcome outcome = read_text(kScanSequenceCsvFormat, variant);
    EXPECT_FALSE(outcome.error);
    EXPECT_TRUE(outcome.recording.warnings.empty());
    EXPECT_TRUE(is_same(outcome.rows(), plain.rows()));
  }
}

TEST(ScanSequence, NamesTheDamagedLine) {
  const std::string row = "0.00001,19.17241,90.03013\n";
  const std::string two = kHead + row + row;
  check_damage(
      kScanSequenceCsvFormat,
      {{"too few fields", two + "0.00003,19.1\n" + row, 4, 2, "found 2"},
       {"too many fields", two + "0.00003,19.1,90.0,1\n" + row, 4, 2, "found 4"},
       {"no number", two + "0.00003,abc,90.0\n" + row, 4, 2, "column Azimuth/deg, found \"abc\""},
       {"empty field", two + "0.00003,,90.0\n" + row, 4, 2, "Azimuth/deg"},
       {"not a number", two + "0.00003,nan,90.00000\n" + row, 4, 2, "found \"nan\""},
       {"infinite", two + "0.00003,1.00000,inf\n" + row, 4, 2, "Zenith/deg"},
       {"time not a number", two + "nan,1.00000,90.00000\n" + row, 4, 2, "Time/s"},
       {"azimuth too large", two + "0.00003,360.00001,90.00000\n", 4, 2, "[-180, 360]"},
       {"azimuth too small", two + "0.00003,-180.00001,90.00000\n", 4, 2, "[-180, 360]"},
       {"zenith too large", two + "0.00003,1.00000,180.00001\n", 4, 2, "[0, 180]"},
       {"zenith negative", two + "0.00003,1.00000,-0.00001\n", 4, 2, "[0, 180]"},
       {"time too large", two + "99999999999.00000,1.00000,1.00000\n", 4, 2, "9.2e9"},
       {"trailing letters", two + "0.00003,1.00000x,90.00000\n", 4, 2, "1.00000x"},
       {"decimal comma", two + "0,00003,1,00000,90,00000\n", 4, 2, "found 6"},
       {"empty line inside", two + "\n" + row, 4, 2, "empty line"},
       {"first row", kHead + "a,b,c\n" + row, 2, 0, "Time/s"},
       {"a NUL", two + std::string("0.00003,1.0\0,90.0\n", 18), 4, 2, "\\x00"},
       {"endless line", two + std::string(100'000, '1') + "\n", 4, 2, "65536"},
       {"endless last line", two + std::string(1'000'000, '1'), 4, 2, "65536"},
       {"whole last line without end", two + "0.00003,nan,90.00000", 4, 2, "nan"}});
}

TEST(ScanSequence, RefusesOtherHeaders) {
  for (const std::string header :
       {"", "\n", "Time,Azimuth,Zenith\n", "Time/s,Zenith/deg,Azimuth/deg\n",
        "0.00001,19.17241,90.03013\n"}) {
    SCOPED_TRACE(header);
    EXPECT_FALSE(kScanSequenceCsvFormat.recognises(header));
    const Outcome outcome = read_text(kScanSequenceCsvFormat, header);
    ASSERT_TRUE(outcome.error);
    EXPECT_EQ(outcome.error->place().line, 1U);
  }
  EXPECT_THROW(kScanSequenceCsvFormat.open(std::string("/no/such/file.csv"), {}), FileError);
  EXPECT_THROW(kScanSequenceCsvFormat.open(std::string("/"), {}), FileError);
}

TEST(ScanSequence, ShotNumbersAreNoSeconds) {
  const Outcome numbers =
      read_text(kScanSequenceCsvFormat, kHead + "0,359.5,90.5\n1,0.5,90.5\n2,1.5,90.5\n");
  ASSERT_FALSE(numbers.error);
  EXPECT_EQ(numbers.rows().time_ns, (std::vector<std::int64_t>{0, 1, 2}));
  EXPECT_NEAR(numbers.rows().azimuth[0], radians_from_degrees(-0.5), 1e-15);
  EXPECT_THAT(warnings_of(numbers), ElementsAre(Warns(kWarning.no_shot_times)));

  const Outcome seconds =
      read_text(kScanSequenceCsvFormat, kHead + "0,359.5,90.5\n2,0.5,90.5\n4,1.5,90.5\n");
  EXPECT_EQ(seconds.rows().time_ns[2], 4'000'000'000);
  EXPECT_TRUE(seconds.recording.warnings.empty());
}

TEST(ScanSequence, ReadsExponents) {
  const Outcome outcome = read_text(kScanSequenceCsvFormat,
                                    kHead + "1e-05,1.917241e1,90.03013\n2e-05,-1e-6,90.06025\n");
  ASSERT_FALSE(outcome.error);
  EXPECT_EQ(outcome.rows().time_ns, (std::vector<std::int64_t>{10000, 20000}));
  EXPECT_DOUBLE_EQ(outcome.rows().azimuth[0], radians_from_degrees(19.17241));
}

TEST(ScanSequence, WritesTimesExactToTheNanosecond) {
  const TestFolder folder;
  const std::string path = folder.file("240kHz.csv");
  RecordingHeader header;
  header.devices.resize(1);
  Chunk chunk;
  auto& rows = chunk.observations;
  for (std::int64_t shot = 0; shot < 6; ++shot) {
    const auto i = append_observation(rows, shot * 12'500 / 3);
    rows.azimuth[i] = 0.1;
    rows.zenith[i] = 1.5;
    rows.valid[i] = shot != 2;  // a row without a direction is left out
  }
  write_all(kScanSequenceCsvFormat, path, header, chunk);
  const Outcome outcome = read_all(kScanSequenceCsvFormat, path);
  EXPECT_EQ(outcome.rows().time_ns, (std::vector<std::int64_t>{0, 4166, 12500, 16666, 20833}));
}

TEST(ScanSequence, WritesOneRowPerShot) {
  const TestFolder folder;
  const std::string path = folder.file("dual.csv");
  RecordingHeader header;
  header.devices.resize(1);
  Chunk chunk;
  auto& rows = chunk.observations;
  for (int i = 0; i < 6; ++i) {
    const auto row = append_observation(rows, i / 2 * 10'000);
    rows.return_number[row] = static_cast<std::uint8_t>(i % 2 + 1);
    rows.azimuth[row] = rows.zenith[row] = 1.0;
    rows.valid[row] = i != 2;  // the second shot has only its second return
  }
  write_all(kScanSequenceCsvFormat, path, header, chunk);
  EXPECT_EQ(read_all(kScanSequenceCsvFormat, path).rows().time_ns,
            (std::vector<std::int64_t>{0, 10'000, 20'000}));
}

TEST(ScanSequence, RefusesWhatItCannotHold) {
  const TestFolder folder;
  RecordingHeader header;
  header.devices.resize(2);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [azimuth, zenith] :
       {std::pair{nan, 1.0}, {1.0, nan}, {4.0, 1.0}, {1.0, -0.1}, {1.0, 3.2}}) {
    Chunk chunk;
    append_observation(chunk.observations, 0);
    chunk.observations.azimuth[0] = azimuth;
    chunk.observations.zenith[0] = zenith;
    chunk.observations.valid[0] = 1;
    auto writer = kScanSequenceCsvFormat.create(folder.file("bad.csv"), header, {});
    EXPECT_THROW(writer->write(chunk), InvalidArgument);
  }
  Chunk chunk;
  chunk.observations.resize(2);
  chunk.observations.valid = {1, 1};
  chunk.observations.device = {0, 1};
  EXPECT_THROW(kScanSequenceCsvFormat.create(folder.file("bad.csv"), header, {})->write(chunk),
               InvalidArgument);
  EXPECT_TRUE(folder.names().empty()) << "an unfinished writer must leave nothing";
  EXPECT_THROW(kScanSequenceCsvFormat.create(folder.file("no/such/folder.csv"), header, {}),
               FileError);
}

TEST(ScanSequence, MakersSequenceComesBackByteByByte) {
  const char* const folder = std::getenv("RISLEY_VENDOR_DATA");
  if (folder == nullptr) {
    GTEST_SKIP() << "SKIPPED: set RISLEY_VENDOR_DATA to the folder that holds "
                    "livox-mid-40-sequence.csv";
  }
  const std::string path = std::string(folder) + "/livox-mid-40-sequence.csv";
  const Outcome outcome = read_all(kScanSequenceCsvFormat, path);
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  ASSERT_EQ(outcome.rows().size(), 400'000U);
  EXPECT_TRUE(outcome.recording.warnings.empty());
  EXPECT_EQ(outcome.rows().time_ns[0], 10'000);
  EXPECT_DOUBLE_EQ(outcome.rows().azimuth[0], radians_from_degrees(19.17241));
  EXPECT_DOUBLE_EQ(outcome.rows().zenith[0], radians_from_degrees(90.03013));
  EXPECT_TRUE(copy_of(kScanSequenceCsvFormat, path, kDefaultChunkRows) == get_bytes(path));
}

TEST(TextOutput, PrintsFixedDecimals) {
  const TestFolder folder;
  const std::string path = folder.file("numbers");
  TextOutput output(path);
  const std::vector<std::pair<double, int>> numbers = {{0.0, 3},     {-0.0, 2},      {1.0, 0},
                                                       {-12.345, 1}, {0.00001, 5},   {9.999999, 5},
                                                       {1e17, 3},    {-0.000004, 5}, {360.0, 2}};
  for (const auto& [value, decimals] : numbers) {
    output.append_fixed(value, decimals);
    output.end_row();
  }
  output.append_decimal(INT64_MIN, 9);
  output.end_row();
  output.append_decimal(-5, 6);
  output.end_row();
  output.close();
  EXPECT_EQ(get_bytes(path),
            "0.000\n-0.00\n1\n-12.3\n0.00001\n10.00000\n100000000000000000.000\n-0.00000\n360.00\n"
            "-9223372036.854775808\n-0.000005\n");
}

TEST(DecimalField, KeepsEveryDigit) {
  EXPECT_EQ(decimal_field("90.03013", "c").digits, 9'003'013);
  EXPECT_EQ(decimal_field("90.03013", "c").decimals, 5);
  EXPECT_EQ(decimal_field("90.03013", "c").value, 90.03013);
  EXPECT_EQ(decimal_field("-0.1", "c").value, -0.1);
  EXPECT_EQ(decimal_field("5.", "c").decimals, 0);
  EXPECT_EQ(decimal_field(".5", "c").value, 0.5);
  EXPECT_EQ(decimal_field("12345678901234567.8", "c").value, 12345678901234567.8);
  EXPECT_EQ(decimal_field("0.1234567890123456789012", "c").value, 0.1234567890123456789012);
  EXPECT_EQ(nanoseconds_field("1600000000.123456789", "c"), 1'600'000'000'123'456'789);
  EXPECT_EQ(nanoseconds_field("-0.0000000015", "c"), -2);
  for (const auto* text : {"", "-", ".", "-.", "1.2.3", "+1", "1 2", "0x10", "1e", "nan", "inf"}) {
    EXPECT_THROW(decimal_field(text, "c"), BadRow) << text;
  }
}

// ---- Livox Viewer --------------------------------------------------------------------------

const std::string kViewerHead =
    "Version,Slot ID,LiDAR Index,Rsvd,Error Code,Timestamp Type,Data Type,Timestamp,X,Y,Z,"
    "Reflectivity,Tag,Ori_x,Ori_y,Ori_z,Ori_radius,Ori_theta,Ori_phi\n";

std::string viewer_packet(int lidar, int timestamp_type, int data_type, std::int64_t time_ns,
                          int rows) {
  std::string text;
  for (int i = 0; i < rows; ++i) {
    text += fmt::format("5,1,{},0,0x00008200,{},{},{},", lidar, timestamp_type, data_type, time_ns);
    text += livox::record_layout(static_cast<std::uint8_t>(data_type))->cartesian
                ? fmt::format("0.42,-1.5,{},7,16,420,-1500,{},0,0,0\n", i, 1000 * i)
                : fmt::format("0,0,0,7,16,0,0,0,{},9000,{}\n", 1000 * i, 35'000 + i);
  }
  return text;
}

TEST(ViewerCsv, GivesEveryPointItsOwnTime) {
  const Outcome outcome =
      read_text(kViewerCsvFormat,
                kViewerHead + viewer_packet(1, 0, 0, 5'000'000, 100) +
                    viewer_packet(1, 0, 0, 6'000'000, 100) + viewer_packet(1, 0, 0, 7'000'000, 30),
                7);
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  EXPECT_TRUE(outcome.recording.warnings.empty());
  const auto& rows = outcome.rows();
  ASSERT_EQ(rows.size(), 230U);
  EXPECT_TRUE(outcome.recording.header.cartesian);
  EXPECT_EQ(outcome.recording.header.time_reference, TimeReference::power_on);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ASSERT_EQ(rows.time_ns[i], 5'000'000 + static_cast<std::int64_t>(i) * 10'000);
  }
  EXPECT_NEAR(rows.range[1], std::sqrt(0.42 * 0.42 + 1.5 * 1.5 + 1.0), 1e-12);
  EXPECT_NEAR(rows.azimuth[1], std::atan2(-1.5, 0.42), 1e-15);
  EXPECT_FLOAT_EQ(rows.range_resolution[1], 1e-3F);
  EXPECT_FLOAT_EQ(rows.zenith_resolution[1], static_cast<float>(1e-3 / rows.range[1]));
  EXPECT_FLOAT_EQ(rows.azimuth_resolution[1], static_cast<float>(1e-3 / std::hypot(0.42, 1.5)));
  EXPECT_EQ(rows.tag[1], 16);
}

TEST(ViewerCsv, FindsTheShotRateFromThePackets) {
  struct Case {
    int data_type;
    std::int64_t period_ns;
    int rows, shot_of_last;
    std::int64_t last_offset_ns;
  };
  for (const auto& c : {Case{3, 400'000, 96, 95, 395'833}, Case{3, 960'000, 96, 95, 950'000},
                        Case{5, 200'000, 96, 47, 195'833}, Case{8, 125'000, 90, 29, 120'833}}) {
    SCOPED_TRACE(fmt::format("data type {}, period {}", c.data_type, c.period_ns));
    const Outcome outcome = read_text(
        kViewerCsvFormat, kViewerHead + viewer_packet(1, 1, c.data_type, 1000, c.rows) +
                              viewer_packet(1, 1, c.data_type, 1000 + c.period_ns, c.rows));
    ASSERT_FALSE(outcome.error);
    const auto last = static_cast<std::size_t>(c.rows - 1);
    EXPECT_EQ(outcome.rows().time_ns[last], 1000 + c.last_offset_ns);
    EXPECT_EQ(outcome.rows().time_ns[last + 1], 1000 + c.period_ns);
    const int returns = livox::record_layout(static_cast<std::uint8_t>(c.data_type))->returns;
    EXPECT_EQ(outcome.rows().return_number[last], returns);
    EXPECT_EQ(outcome.recording.header.returns_per_shot, returns);
    EXPECT_NEAR(outcome.rows().azimuth[1], radians_from_degrees(-9.99), 1e-15);
    EXPECT_EQ(outcome.rows().valid[0], 0);
    EXPECT_EQ(outcome.rows().range[0], 0.0);
  }
}

TEST(ViewerCsv, KeepsSensorsApartAndCountsPpsSeconds) {
  const Outcome outcome = read_text(
      kViewerCsvFormat, kViewerHead + viewer_packet(1, 4, 1, 999'000'000, 100) +
                            viewer_packet(2, 4, 1, 999'500'000, 100) +
                            viewer_packet(1, 4, 1, 0, 100) + viewer_packet(2, 4, 1, 500'000, 100));
  ASSERT_FALSE(outcome.error);
  ASSERT_EQ(outcome.recording.header.devices.size(), 2U);
  EXPECT_EQ(outcome.recording.header.time_reference, TimeReference::pps);
  EXPECT_EQ(outcome.rows().device[150], 1);
  EXPECT_EQ(outcome.rows().time_ns[200], 1'000'000'000);
  EXPECT_EQ(outcome.rows().time_ns[300], 1'000'500'000);
}

TEST(ViewerCsv, WarnsOfPacketsWithHoles) {
  const Outcome outcome = read_text(kViewerCsvFormat, kViewerHead + viewer_packet(1, 0, 0, 0, 97) +
                                                          viewer_packet(1, 0, 0, 1'000'000, 100));
  ASSERT_EQ(outcome.recording.warnings.size(), 1U);
  EXPECT_EQ(outcome.recording.warnings[0].lost_records, 3U);
  EXPECT_EQ(outcome.rows().size(), 197U);
}

TEST(ViewerCsv, CutAtEveryByte) {
  check_cuts(kViewerCsvFormat, kViewerHead + viewer_packet(1, 0, 0, 1'000'000, 4), 1,
             [](std::string_view head) {
               const auto [rows, left] = lines_in(head, 99);
               return std::pair{rows, left};
             });
}

TEST(ViewerCsv, NamesTheDamagedLine) {
  const std::string sound = kViewerHead + viewer_packet(1, 0, 0, 0, 2);
  check_damage(
      kViewerCsvFormat,
      {{"version", sound + "4,1,1,0,0x00000000,0,0,0,0,0,0,0,0,0,0,0,0,0,0\n", 4, 2, "Version"},
       {"status", sound + "5,1,1,0,12,0,0,0,0,0,0,0,0,0,0,0,0,0,0\n", 4, 2, "Error Code"},
       {"data type", sound + "5,1,1,0,0x0,0,9,0,0,0,0,0,0,0,0,0,0,0,0\n", 4, 2, "Data Type"},
       {"IMU", sound + "5,1,1,0,0x0,0,6,0,0,0,0,0,0,0,0,0,0,0,0\n", 4, 2, "points"},
       {"time", sound + "5,1,1,0,0x0,0,0,-1,0,0,0,0,0,0,0,0,0,0,0\n", 4, 2, "Timestamp"},
       {"intensity", sound + "5,1,1,0,0x0,0,0,0,0,0,0,256,0,0,0,0,0,0,0\n", 4, 2, "Reflectivity"},
       {"coordinate", sound + "5,1,1,0,0x0,0,0,0,nan,0,0,0,0,0,0,0,0,0,0\n", 4, 2, "column X"},
       {"integer", sound + "5,1,1,0,0x0,0,0,0,0,0,0,0,0,1.5,0,0,0,0,0\n", 4, 2, "Ori_x"},
       {"angle", sound + "5,1,1,0,0x0,0,1,0,0,0,0,0,0,0,0,0,5,18001,0\n", 4, 2, "Ori_theta"},
       {"fields", sound + "5,1,1,0\n", 4, 2, "found 4"}});
  EXPECT_FALSE(kViewerCsvFormat.recognises("Version,Slot ID,LiDAR Index\n"));
  EXPECT_EQ(kViewerCsvFormat.create, nullptr);
}

TEST(ViewerCsv, MoreSensorsThanCanBeNumberedAreDamage) {
  std::string text =
      "Version,Slot ID,LiDAR Index,Rsvd,Error Code,Timestamp Type,Data Type,Timestamp,X,Y,Z,"
      "Reflectivity,Tag,Ori_x,Ori_y,Ori_z,Ori_radius,Ori_theta,Ori_phi\n";
  for (int sensor = 0; sensor <= 256; ++sensor) {
    text += fmt::format("5,{},{},0,0x00000000,0,1,1000,0,0,0,7,0,0,0,0,2000,9000,0\n", sensor / 128,
                        sensor % 128);
  }
  expect_damage(read_text(kViewerCsvFormat, text), NamesField("256 sensors"), 256, 258);
}

TEST(TextTable, TimesAtTheEndOf64BitsAreRounded) {
  EXPECT_EQ(nanoseconds_field("9.223372036854775799", "t"), 9'223'372'037);
  EXPECT_EQ(nanoseconds_field("-9.223372036854775799", "t"), -9'223'372'037);
  EXPECT_EQ(nanoseconds_field("0.0000000005", "t"), 1);
  EXPECT_EQ(nanoseconds_field("0.00000000049", "t"), 0);
  EXPECT_EQ(nanoseconds_field("-0.0000000005", "t"), -1);
  EXPECT_EQ(nanoseconds_field("-0.00000000149", "t"), -1);
}

}  // namespace risley::recordings::text_formats_test
