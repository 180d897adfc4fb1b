// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netcdf.h>

#include "recordings/format_tests.hpp"

namespace risley::recordings::netcdf_test {

using namespace format_tests;
using ::testing::AllOf;

RecordingHeader rich_header() {
  RecordingHeader header;
  header.format = "lvx-1.1";
  Device device;
  device.serial = "0TFDG3B006H2Z11";
  device.hub_serial = "13UUG1R00400170";
  device.index = 7;
  device.type = 6;
  device.extrinsic_enabled = true;
  device.roll_pitch_yaw_deg = {0.1F, -2.5F, 179.9F};
  device.translation_m = {1.0F, 2.0F, -3.5F};
  header.devices = {Device{}, device};
  header.time_reference = TimeReference::ptp;
  header.has_intensity = false;
  header.cartesian = true;
  header.returns_per_shot = 2;
  header.frame_duration_ms = 100;
  header.details = {{"decimals", "5"}, {"a name with blanks", ""}, {"bytes", {"a\0b\n", 4}}};
  return header;
}

/// Rows whose every bit matters: NaN, negative zero and numbers with full mantissas.
void append_rows(Chunk& chunk, std::size_t count) {
  auto& rows = chunk.observations;
  const std::size_t first = rows.size();
  rows.resize(first + count);
  for (std::size_t i = first; i < rows.size(); ++i) {
    const double x = static_cast<double>(i);
    rows.time_ns[i] = 1'600'000'000'000'000'000 + static_cast<std::int64_t>(i) * 4167;
    rows.azimuth[i] = i % 7 == 3 ? -0.0 : std::sin(x);
    rows.zenith[i] = std::sqrt(x);
    rows.range[i] = i % 5 == 2 ? std::numeric_limits<double>::quiet_NaN() : x / 3.0;
    rows.azimuth_resolution[i] = 0.01F * static_cast<float>(i);
    rows.zenith_resolution[i] = 1.0F / (1.0F + static_cast<float>(i));
    rows.range_resolution[i] = 1e-3F;
    rows.intensity[i] = static_cast<std::uint8_t>(i);
    rows.return_number[i] = static_cast<std::uint8_t>(i % 2 + 1);
    rows.tag[i] = static_cast<std::uint8_t>(255 - i % 256);
    rows.beam[i] = static_cast<std::uint8_t>(i % 6);
    rows.device[i] = i % 3 == 0;
    rows.valid[i] = i % 5 != 2;
  }
}

/// Packets of 96 rows, and after every third one an inertial sample.
Chunk packet_chunk(std::size_t packets) {
  Chunk chunk;
  for (std::size_t k = 0; k < packets; ++k) {
    Packet packet;
    packet.rows = 96;
    packet.frame = k / 50 + (std::uint64_t{1} << 40);
    packet.device_index = 7;
    packet.slot = 3;
    packet.lidar_id = 2;
    packet.reserved = 9;
    packet.status = 0xC0008200U + static_cast<std::uint32_t>(k);
    packet.timestamp_type = 1;
    packet.data_type = 2;
    for (std::size_t byte = 0; byte < 8; ++byte) {
      packet.timestamp[byte] = static_cast<std::uint8_t>(k >> byte);
    }
    append_rows(chunk, packet.rows);
    chunk.packets.push_back(packet);
    if (k % 3 == 2) {
      packet.rows = 0;
      packet.data_type = 6;
      chunk.packets.push_back(packet);
      const auto value = static_cast<float>(k);
      chunk.imu.push_back({static_cast<std::int64_t>(k) * 5'000'000,
                           1,
                           {value, -value, 0.5F},
                           {0.0F, 1.0F, value / 3}});
    }
  }
  return chunk;
}

bool same(const Packet& a, const Packet& b) {
  return a.rows == b.rows && a.frame == b.frame && a.device_index == b.device_index &&
         a.version == b.version && a.slot == b.slot && a.lidar_id == b.lidar_id &&
         a.reserved == b.reserved && a.status == b.status && a.timestamp_type == b.timestamp_type &&
         a.data_type == b.data_type && a.timestamp == b.timestamp;
}

bool same(const ImuSample& a, const ImuSample& b) {
  return a.time_ns == b.time_ns && a.device == b.device &&
         a.angular_velocity == b.angular_velocity && a.acceleration_g == b.acceleration_g;
}

template <class T>
bool is_prefix_of(const std::vector<T>& part, const std::vector<T>& whole) {
  return part.size() <= whole.size() &&
         std::equal(part.begin(), part.end(), whole.begin(),
                    [](const T& a, const T& b) { return same(a, b); });
}

TEST(Netcdf, HoldsEverything) {
  const TestFolder folder;
  const std::string path = folder.file("recording.nc");
  const Chunk chunk = packet_chunk(20);
  const RecordingHeader header = rich_header();
  write_all(kNetcdfFormat, path, header, chunk);
  EXPECT_TRUE(kNetcdfFormat.recognises(get_bytes(path)));
  const Outcome outcome = read_all(kNetcdfFormat, path, 200);
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  EXPECT_TRUE(is_same(outcome.rows(), chunk.observations));
  const auto& read = outcome.recording;
  ASSERT_EQ(read.data.packets.size(), chunk.packets.size());
  EXPECT_TRUE(is_prefix_of(read.data.packets, chunk.packets));
  ASSERT_EQ(read.data.imu.size(), chunk.imu.size());
  EXPECT_TRUE(is_prefix_of(read.data.imu, chunk.imu));
  EXPECT_EQ(read.header.format, "netcdf");
  EXPECT_EQ(source_format(read.header), "lvx-1.1");
  EXPECT_EQ(read.header.time_reference, header.time_reference);
  EXPECT_EQ(read.header.has_range, header.has_range);
  EXPECT_EQ(read.header.has_intensity, header.has_intensity);
  EXPECT_EQ(read.header.cartesian, header.cartesian);
  EXPECT_EQ(read.header.returns_per_shot, header.returns_per_shot);
  EXPECT_EQ(read.header.frame_duration_ms, header.frame_duration_ms);
  auto details = header.details;
  details.emplace_back("source_format", "lvx-1.1");
  EXPECT_EQ(read.header.details, details);
  ASSERT_EQ(read.header.devices.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const Device &a = read.header.devices[i], &b = header.devices[i];
    EXPECT_EQ(a.serial, b.serial);
    EXPECT_EQ(a.hub_serial, b.hub_serial);
    EXPECT_EQ(a.index, b.index);
    EXPECT_EQ(a.type, b.type);
    EXPECT_EQ(a.extrinsic_enabled, b.extrinsic_enabled);
    EXPECT_EQ(a.roll_pitch_yaw_deg, b.roll_pitch_yaw_deg);
    EXPECT_EQ(a.translation_m, b.translation_m);
  }
}

TEST(Netcdf, ChunksHoldWholePackets) {
  const TestFolder folder;
  const std::string path = folder.file("recording.nc");
  write_all(kNetcdfFormat, path, rich_header(), packet_chunk(30));
  auto reader = kNetcdfFormat.open(path, {});
  Chunk chunk;
  std::size_t chunks = 0;
  for (; reader->read(chunk, 100); ++chunks) {
    std::size_t rows = 0, samples = 0;
    for (const auto& packet : chunk.packets) {
      rows += packet.rows;
      samples += packet.data_type == 6;
    }
    ASSERT_EQ(rows, chunk.observations.size());
    ASSERT_EQ(samples, chunk.imu.size());
    ASSERT_LE(rows, 200U);
  }
  EXPECT_GT(chunks, 10U);
}

TEST(Netcdf, TheSameRecordingGivesTheSameBytes) {
  const TestFolder folder;
  // More than one block of rows and of packets, so that their order in the file matters.
  for (const std::size_t packets : {0, 1, 20, 1500}) {
    for (const bool with_packets : {true, false}) {
      SCOPED_TRACE(packets);
      Chunk chunk = packet_chunk(packets);
      if (!with_packets) chunk.packets.clear();
      const std::string path = folder.file("first.nc");
      write_all(kNetcdfFormat, path, rich_header(), chunk);
      const std::string bytes = get_bytes(path);
      write_all(kNetcdfFormat, folder.file("again, with a longer name.nc"), rich_header(), chunk);
      EXPECT_TRUE(get_bytes(folder.file("again, with a longer name.nc")) == bytes);
      for (const std::size_t chunk_rows : {std::size_t{1000}, std::size_t{40'000}}) {
        EXPECT_TRUE(copy_of(kNetcdfFormat, path, chunk_rows) == bytes) << chunk_rows;
      }
    }
  }
}

TEST(Netcdf, KeepsTheDetailsOfTextFormats) {
  const TestFolder folder;
  const std::string text =
      "Time/s,Azimuth/deg,Zenith/deg\n0.00001,19.1724,90.030\n0.00002,-19.1712,90.060\n";
  const std::string table = folder.file("sequence.csv"), copy = folder.file("sequence.nc");
  put_bytes(table, text);
  put_bytes(copy, copy_of(kScanSequenceCsvFormat, table, 1, &kNetcdfFormat));
  EXPECT_EQ(copy_of(kNetcdfFormat, copy, 1, &kScanSequenceCsvFormat), text);
}

TEST(Netcdf, ACutNeverCrashesNorInvents) {
  const TestFolder folder;
  const std::string path = folder.file("whole.nc"), cut_path = folder.file("cut.nc");
  const Chunk chunk = packet_chunk(4);
  write_all(kNetcdfFormat, path, rich_header(), chunk);
  const std::string bytes = get_bytes(path);
  // Every byte at both ends, where the structures are densest, and a sample between; all of them,
  // which takes minutes, when RISLEY_EVERY_CUT is set.
  constexpr std::size_t kEnd = 64;
  const std::size_t step = std::getenv("RISLEY_EVERY_CUT") != nullptr ? 1 : 211;
  for (std::size_t length = 0; length < bytes.size();
       length += length < kEnd || length + kEnd > bytes.size() ? 1 : step) {
    SCOPED_TRACE(fmt::format("cut behind byte {} of {}", length, bytes.size()));
    put_bytes(cut_path, std::string_view(bytes).substr(0, length));
    const Outcome cut = read_all(kNetcdfFormat, cut_path);
    ASSERT_TRUE(cut.error);
    ASSERT_TRUE(is_prefix(cut.rows(), chunk.observations));
    ASSERT_TRUE(is_prefix_of(cut.recording.data.packets, chunk.packets));
    ASSERT_TRUE(is_prefix_of(cut.recording.data.imu, chunk.imu));
  }
}

TEST(Netcdf, ADamagedBlockCostsOnlyWhatFollows) {
  const TestFolder folder;
  const std::string path = folder.file("whole.nc");
  const Chunk chunk = packet_chunk(1000);  // almost three blocks of rows
  for (const bool with_packets : {true, false}) {
    Chunk rows = chunk;
    if (!with_packets) {
      rows.packets.clear();
      rows.imu.clear();
    }
    write_all(kNetcdfFormat, path, rich_header(), rows);
    std::string bytes = get_bytes(path);
    // Some of these bytes belong to the blocks' own numbers, others to the tables that find them.
    std::size_t found_late = 0;
    for (std::size_t part = 1; part < 40; ++part) {
      std::string damaged = bytes;
      const std::size_t at = bytes.size() * part / 40;
      damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
      const std::string damaged_path = folder.file("damaged.nc");
      put_bytes(damaged_path, damaged);
      const Outcome outcome = read_all(kNetcdfFormat, damaged_path, 10'000);
      ASSERT_TRUE(is_prefix(outcome.rows(), chunk.observations)) << "byte " << at;
      ASSERT_TRUE(is_prefix_of(outcome.recording.data.packets, rows.packets)) << "byte " << at;
      std::size_t packet_rows = 0;
      for (const auto& packet : outcome.recording.data.packets) packet_rows += packet.rows;
      if (with_packets) {
        ASSERT_EQ(packet_rows, outcome.rows().size());
      }
      if (outcome.error && outcome.rows().size() > 0) ++found_late;
      if (!outcome.error) {
        ASSERT_EQ(outcome.rows().size(), chunk.observations.size());
      }
    }
    EXPECT_GT(found_late, 0U);
  }
}

TEST(Netcdf, RefusesForeignFiles) {
  const TestFolder folder;
  const std::string path = folder.file("foreign.nc");
  int id = 0, dimension = 0, variable = 0;
  ASSERT_EQ(nc_create(path.c_str(), NC_NETCDF4, &id), NC_NOERR);
  ASSERT_EQ(nc_def_dim(id, "row", 3, &dimension), NC_NOERR);
  ASSERT_EQ(nc_def_var(id, "time", NC_DOUBLE, 1, &dimension, &variable), NC_NOERR);
  ASSERT_EQ(nc_close(id), NC_NOERR);
  EXPECT_TRUE(kNetcdfFormat.recognises(get_bytes(path)));
  expect_damage(read_all(kNetcdfFormat, path), NamesField("risley_recording"));
  ASSERT_EQ(nc_open(path.c_str(), NC_WRITE, &id), NC_NOERR);
  const unsigned int version = 2;
  ASSERT_EQ(nc_put_att_uint(id, NC_GLOBAL, "risley_recording", NC_UINT, 1, &version), NC_NOERR);
  ASSERT_EQ(nc_close(id), NC_NOERR);
  expect_damage(read_all(kNetcdfFormat, path), NamesField("found 2"));
  ASSERT_EQ(nc_open(path.c_str(), NC_WRITE, &id), NC_NOERR);
  const unsigned int known = 1;
  ASSERT_EQ(nc_put_att_uint(id, NC_GLOBAL, "risley_recording", NC_UINT, 1, &known), NC_NOERR);
  ASSERT_EQ(nc_close(id), NC_NOERR);
  expect_damage(read_all(kNetcdfFormat, path), NamesField("time_reference"));

  EXPECT_FALSE(kNetcdfFormat.recognises("CDF\1"));
  EXPECT_TRUE(read_text(kNetcdfFormat, "\x89HDF\r\n\x1a\nnothing else").error);
  EXPECT_THROW(kNetcdfFormat.open(folder.file("missing.nc"), {}), FileError);
}

/// A sound recording that another program spoilt.
class SpoiltRecording {
 public:
  SpoiltRecording() : path_(folder_.file("spoilt.nc")) {
    write_all(kNetcdfFormat, path_, rich_header(), packet_chunk(6));
    EXPECT_EQ(nc_open(path_.c_str(), NC_WRITE, &id_), NC_NOERR);
  }
  int id() const { return id_; }
  int variable(const char* name) const {
    int variable = 0;
    EXPECT_EQ(nc_inq_varid(id_, name, &variable), NC_NOERR) << name;
    return variable;
  }
  /// Gives a dimension's name to a new one, along which nothing runs.
  void replace_dimension(const char* name, std::size_t length) const {
    int dimension = 0;
    EXPECT_EQ(nc_redef(id_), NC_NOERR);
    EXPECT_EQ(nc_inq_dimid(id_, name, &dimension), NC_NOERR);
    EXPECT_EQ(nc_rename_dim(id_, dimension, "renamed"), NC_NOERR);
    EXPECT_EQ(nc_def_dim(id_, name, length, &dimension), NC_NOERR);
  }
  /// What reading it ends with.
  std::string problem() {
    EXPECT_EQ(nc_close(id_), NC_NOERR);
    const Outcome outcome = read_all(kNetcdfFormat, path_);
    return outcome.error ? outcome.error->problem() : "none";
  }

 private:
  const TestFolder folder_;
  std::string path_;
  int id_ = 0;
};

TEST(HostileNetcdf, DevicesThatAreNotThere) {
  SpoiltRecording none;
  none.replace_dimension("device_entry", NC_UNLIMITED);
  EXPECT_THAT(none.problem(), AllOf(NamesField("device_entry"), NamesField("0, allowed 1 to 256")));
  SpoiltRecording many;
  many.replace_dimension("device_entry", 257);
  EXPECT_THAT(many.problem(), AllOf(NamesField("device_entry"), NamesField("257")));
  SpoiltRecording other;
  other.replace_dimension("device_entry", 2);
  EXPECT_THAT(other.problem(), AllOf(NamesField("device_serial"), NamesField("device_entry")));
  const std::size_t place = 3;
  const unsigned char third = 2;
  SpoiltRecording rows;
  ASSERT_EQ(nc_put_var1_uchar(rows.id(), rows.variable("device"), &place, &third), NC_NOERR);
  EXPECT_EQ(rows.problem(), "entry 3 of variable device is 2, allowed below device_entry = 2");
  const std::size_t sample = 1;
  SpoiltRecording samples;
  ASSERT_EQ(nc_put_var1_uchar(samples.id(), samples.variable("imu_device"), &sample, &third),
            NC_NOERR);
  EXPECT_EQ(samples.problem(),
            "entry 1 of variable imu_device is 2, allowed below device_entry = 2");
}

TEST(HostileNetcdf, NumbersThatCannotBe) {
  const unsigned int zero = 0, most = 4294967295U;
  for (const unsigned int returns : {zero, most}) {
    SpoiltRecording recording;
    ASSERT_EQ(nc_put_att_uint(recording.id(), NC_GLOBAL, "returns_per_shot", NC_UINT, 1, &returns),
              NC_NOERR);
    EXPECT_THAT(recording.problem(), NamesField("returns_per_shot"));
  }
  const std::size_t place = 2;
  SpoiltRecording packets;
  ASSERT_EQ(nc_put_var1_uint(packets.id(), packets.variable("packet_rows"), &place, &most),
            NC_NOERR);
  EXPECT_THAT(packets.problem(), NamesField("packets"));
  SpoiltRecording serials;
  serials.replace_dimension("serial_length", std::size_t{1} << 50);
  EXPECT_THAT(serials.problem(), NamesField("serial_length"));
  SpoiltRecording axes;
  axes.replace_dimension("axis", 4);
  EXPECT_THAT(axes.problem(), AllOf(NamesField("axis"), NamesField("4, expected 3")));
}

TEST(HostileNetcdf, VariablesThatAreNotThere) {
  for (const char* name : {"time", "device", "packet_rows", "imu_time", "device_serial"}) {
    SpoiltRecording recording;
    ASSERT_EQ(nc_redef(recording.id()), NC_NOERR);
    ASSERT_EQ(nc_rename_var(recording.id(), recording.variable(name), "renamed"), NC_NOERR);
    EXPECT_THAT(recording.problem(), NamesField(fmt::format("variable {}", name)));
  }
}

TEST(Netcdf, RefusesPacketsThatDoNotFit) {
  const TestFolder folder;
  Chunk short_packet = packet_chunk(2);
  short_packet.packets[0].rows = 95;
  EXPECT_THROW(kNetcdfFormat.create(folder.file("x.nc"), rich_header(), {})->write(short_packet),
               InvalidArgument);
  Chunk no_sample = packet_chunk(3);
  no_sample.imu.clear();
  EXPECT_THROW(kNetcdfFormat.create(folder.file("x.nc"), rich_header(), {})->write(no_sample),
               InvalidArgument);
  auto writer = kNetcdfFormat.create(folder.file("x.nc"), rich_header(), {});
  writer->write(packet_chunk(1));
  Chunk loose;
  append_rows(loose, 5);
  EXPECT_THROW(writer->write(loose), InvalidArgument);
  writer.reset();
  RecordingHeader no_device = rich_header();
  no_device.devices.clear();
  EXPECT_THROW(kNetcdfFormat.create(folder.file("x.nc"), no_device, {}), InvalidArgument);
  EXPECT_EQ(folder.names().size(), 0U) << "an unfinished writer must leave nothing";
  EXPECT_THROW(kNetcdfFormat.create(folder.file("no/such/folder.nc"), rich_header(), {}),
               FileError);
}

}  // namespace risley::recordings::netcdf_test
