// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <gmock/gmock.h>

#include "risley/recordings/excerpt.hpp"
#include "risley/recordings/livox/packet_decoder.hpp"
#include "risley/recordings/time_audit.hpp"
#include "risley/recordings/truth.hpp"
#include "risley/recordings/writer.hpp"

#include "recordings/format_tests.hpp"
#include "refusal.hpp"

namespace risley::recordings::entries_test {

using format_tests::TestFolder;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Points 10 m ahead, one every 10 us.
Observations points(std::size_t count) {
  Observations rows;
  rows.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    rows.time_ns[i] = static_cast<std::int64_t>(i) * 10'000;
    rows.zenith[i] = 1.5;
    rows.range[i] = 10;
    rows.return_number[i] = 1;
    rows.valid[i] = 1;
  }
  return rows;
}

RecordingHeader header_of_one() {
  RecordingHeader header;
  header.format = "test";
  header.devices.emplace_back();
  return header;
}

/// A recording of a few points, as NetCDF.
std::string saved(const TestFolder& folder) {
  const std::string path = folder.file("points.nc");
  const auto writer = create_recording(path, header_of_one());
  Chunk chunk;
  chunk.observations = points(5);
  writer->write(chunk);
  writer->close();
  return path;
}

TEST(Entries, EveryColumnHasTheLengthOfTheTimes) {
  const auto run = [](auto&& change) {
    Observations rows = points(4);
    change(rows);
    return refusal([&] { require_columns(rows); });
  };
  EXPECT_EQ(run([](Observations&) {}), "");
  EXPECT_EQ(run([](Observations& o) { o.time_ns.pop_back(); }), "azimuth has 4 values, expected 3");
  EXPECT_EQ(run([](Observations& o) { o.zenith.clear(); }), "zenith has 0 values, expected 4");
  EXPECT_EQ(run([](Observations& o) { o.range_resolution.pop_back(); }),
            "range_resolution has 3 values, expected 4");
  EXPECT_EQ(run([](Observations& o) { o.valid.push_back(1); }), "valid has 5 values, expected 4");
}

TEST(Entries, AnglesOfValidRowsAreRadians) {
  const auto run = [](auto&& change) {
    Observations rows = points(4);
    change(rows);
    return refusal([&] { require_angles(rows); });
  };
  EXPECT_EQ(run([](Observations&) {}), "");
  EXPECT_EQ(run([](Observations& o) { o.zenith[2] = 90; }),
            "zenith = 90 rad in row 2, allowed 0 to pi");
  EXPECT_EQ(run([](Observations& o) { o.azimuth[1] = -30; }),
            "azimuth = -30 rad in row 1, allowed -pi to pi");
  EXPECT_EQ(run([](Observations& o) { o.zenith[2] = NAN; }),
            "zenith = nan rad in row 2, allowed 0 to pi");
  EXPECT_EQ(run([](Observations& o) {
              o.zenith[2] = 90;
              o.valid[2] = 0;
            }),
            "");
}

TEST(Entries, RowsAskForColumnsOfOneLength) {
  Observations rows = points(4), uneven = points(2);
  uneven.tag.clear();
  EXPECT_EQ(refusal([&] { rows.append(uneven); }), "tag has 0 values, expected 2");
  EXPECT_EQ(rows.size(), 4U);
  EXPECT_EQ(refusal([&] { uneven.drop_front(1); }), "tag has 0 values, expected 2");
  EXPECT_EQ(refusal([&] { rows.drop_front(5); }), "rows = [0, 5), allowed within [0, 4)");
  EXPECT_EQ(refusal([&] { rows.drop_front(4); }), "");
}

TEST(Entries, EveryWriterAsksForColumnsOfOneLength) {
  const TestFolder folder;
  Chunk uneven;
  uneven.observations = points(4);
  uneven.observations.device.pop_back();
  for (const WritableFormat& format : writable_formats()) {
    RecordingHeader header = header_of_one();
    if (format.name == "lvx-2") header.devices[0].type = kMid360;
    const auto writer = create_recording(folder.file("out" + format.ending), header, format.name);
    EXPECT_EQ(refusal([&] { writer->write(uneven); }), "device has 3 values, expected 4")
        << format.name;
  }
  EXPECT_EQ(folder.names().size(), 0U);
}

TEST(Entries, AuditsAskForColumnsOfOneLength) {
  Chunk uneven;
  uneven.observations = points(4);
  uneven.observations.return_number.pop_back();
  TimeAudit audit;
  EXPECT_EQ(refusal([&] { audit.add(uneven); }), "return_number has 3 values, expected 4");
  EXPECT_EQ(audit.result().observations, 0U);
}

TEST(Entries, ReadersAskForRowsARateAndAPose) {
  const TestFolder folder;
  const std::string path = saved(folder);
  Chunk chunk;
  EXPECT_EQ(refusal([&] { open_recording(path)->read(chunk, 0); }),
            "max_rows = 0, allowed 1 or more");
  EXPECT_EQ(refusal([&] { open_recording(path, {.shot_rate = kNan}); }),
            "ReadOptions::shot_rate = nan Hz, allowed above 0");
  EXPECT_EQ(refusal([&] { open_recording(path, {.shot_rate = -1.0}); }),
            "ReadOptions::shot_rate = -1 Hz, allowed above 0");
  EXPECT_EQ(refusal([&] { open_recording(path, {.shot_rate = 1.0, .emitters = -1}); }),
            "ReadOptions::emitters = -1, allowed 0 to 255");
  Extrinsics pose;
  pose.translation.y = kInfinite;
  EXPECT_EQ(refusal([&] { open_recording(path, {.extrinsics = pose}); }),
            "extrinsics.translation.y = inf m, allowed finite");
  EXPECT_EQ(refusal([&] { return sensor_axes(pose); }), "");  // they turn and do not move
  pose.roll = kNan;
  EXPECT_EQ(refusal([&] { return sensor_axes(pose); }),
            "extrinsics.roll = nan rad, allowed finite");
}

TEST(Entries, ExcerptsAskForALengthAndShots) {
  const TestFolder folder;
  const std::string path = saved(folder);
  const auto run = [&](const ExcerptOptions& options) {
    return refusal([&] { write_excerpt(path, folder.file("excerpt.nc"), options); });
  };
  EXPECT_EQ(run({.longest = -1}), "ExcerptOptions::longest = -1 s, allowed above 0");
  EXPECT_EQ(run({.longest = kNan}), "ExcerptOptions::longest = nan s, allowed above 0");
  EXPECT_EQ(run({.most_shots = 0}), "ExcerptOptions::most_shots = 0, allowed 1 and above");
  EXPECT_EQ(run({.most_shots_without_times = 0}),
            "ExcerptOptions::most_shots_without_times = 0, allowed 1 and above");
  EXPECT_EQ(run({}), "");
}

/// Truth of a few shots of so many prisms.
TruthColumns truth_of(int prisms, std::size_t rows) {
  TruthColumns truth;
  truth.resize(prisms, rows);
  for (std::size_t i = 0; i < rows; ++i) truth.time_ns[i] = static_cast<std::int64_t>(i);
  return truth;
}

TEST(Entries, TruthAsksForPrismsAndColumnsOfOneLength) {
  const TestFolder folder;
  TruthColumns two = truth_of(2, 3);
  EXPECT_EQ(refusal([&] { two.resize(-1, 3); }), "number of prisms = -1, allowed 0 to 26");
  EXPECT_EQ(refusal([&] { TruthWriter(folder.file("truth.nc"), 0); }),
            "number of prisms = 0, allowed 1 to 26");
  EXPECT_EQ(refusal([&] { TruthWriter(folder.file("truth.nc"), 27); }),
            "number of prisms = 27, allowed 1 to 26");
  TruthWriter writer(folder.file("truth.nc"), 2);
  EXPECT_EQ(refusal([&] { writer.write(truth_of(3, 3)); }),
            "rotation_angle has 3 values, expected 2");
  EXPECT_EQ(refusal([&] { two.append(truth_of(3, 3)); }),
            "rotation_angle has 3 values, expected 2");
  TruthColumns uneven = two;
  uneven.angular_velocity[1].pop_back();
  EXPECT_EQ(refusal([&] { writer.write(uneven); }),
            "angular_velocity_b_deg_per_s has 2 values, expected 3");
  EXPECT_EQ(refusal([&] { two.append(uneven); }),
            "angular_velocity_b_deg_per_s has 2 values, expected 3");
  EXPECT_EQ(two.size(), 3U);
  uneven = two;
  uneven.range.clear();
  EXPECT_EQ(refusal([&] { writer.write(uneven); }), "range_m has 0 values, expected 3");
  uneven.angular_velocity.pop_back();
  EXPECT_EQ(refusal([&] { writer.write(uneven); }), "angular_velocity has 1 values, expected 2");
}

TEST(Entries, TruthIsAskedForAtAscendingTimes) {
  const TestFolder folder;
  const std::string path = folder.file("truth.nc");
  TruthWriter writer(path, 2);
  writer.write(truth_of(2, 5));
  writer.close();
  const std::vector<std::int64_t> good{1, 3, 3}, back{1, 3, 2};
  EXPECT_EQ(load_truth(path, good).size(), 2U);
  EXPECT_EQ(refusal([&] { return load_truth(path, back); }),
            "time_ns[2] = 2 ns, allowed ascending from 3");
}

TEST(Entries, DataTypesAskForReturns) {
  using livox::data_type_of;
  EXPECT_EQ(data_type_of(false, false, 1), 1);
  EXPECT_EQ(data_type_of(true, false, 3), 7);
  for (const bool tagged : {false, true}) {
    EXPECT_EQ(refusal([&] { return data_type_of(false, tagged, 0); }),
              "returns per shot = 0, allowed 1 to 3");
    EXPECT_EQ(refusal([&] { return data_type_of(true, tagged, 4); }),
              "returns per shot = 4, allowed 1 to 3");
  }
}

TEST(Entries, DecodersAskForAGridWithoutZeros) {
  using livox::PacketDecoder;
  using livox::ShotGrid;
  const auto run = [](const ShotGrid& grid) {
    return refusal([&] { PacketDecoder({.grid = grid}); });
  };
  EXPECT_EQ(run({1, 0, 1, 1}), "ShotGrid::interval_denominator = 0, allowed 1 or more");
  EXPECT_EQ(run({1, 1, 0, 1}), "ShotGrid::beams = 0, allowed 1 or more");
  EXPECT_EQ(run({1, 1, 1, 0}), "ShotGrid::records_per_shot = 0, allowed 1 or more");
}

TEST(Entries, DecodersAskForAllBytes) {
  const std::vector<std::uint8_t> few(17);
  const auto problem = [](auto&& call) {
    try {
      call();
    } catch (const livox::BadPacket& bad) {
      return std::string(bad.what());
    }
    return std::string();
  };
  Chunk chunk;
  EXPECT_THAT(problem([&] { livox::PacketDecoder({}).decode(few, chunk); }),
              NamesField("found 17"));
  EXPECT_THAT(problem([&] { livox::decode_packet_header(few); }), NamesField("found 17"));
  EXPECT_THAT(problem([&] { livox::decode_imu(few); }),
              NamesField("24 bytes of an inertial sample, found 17"));
  EXPECT_EQ(chunk.observations.size(), 0U);
}

TEST(Entries, RowsThatOthersFilledAreValidWhereTheyHaveADirectionAndNoEmptyRange) {
  Observations rows = points(5);
  rows.azimuth[0] = kNan;
  rows.zenith[1] = kInfinite;
  rows.range[2] = 0;
  rows.range[3] = kNan;
  rows.valid.clear();
  mark_valid(rows);
  EXPECT_THAT(rows.valid, ::testing::ElementsAre(0, 0, 0, 1, 1));
}

}  // namespace risley::recordings::entries_test
