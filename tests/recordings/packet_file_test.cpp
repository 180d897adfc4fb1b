// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/packet_file.hpp"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/recordings/livox/packet_encoder.hpp"
#include "risley/recordings/reader.hpp"

#include "io/test_folder.hpp"

namespace risley::recordings::packet_file_test {

namespace fs = std::filesystem;
using livox::PacketFile;

std::vector<std::uint8_t> packet(std::int64_t number) {
  Packet header;
  header.timestamp = livox::encode_timestamp(0, number * 1'000'000);
  std::vector<std::uint8_t> bytes(livox::kPacketHeaderBytes + livox::record_layout(1)->bytes());
  livox::encode_packet_header(header, bytes.data());
  bytes[livox::kPacketHeaderBytes] = static_cast<std::uint8_t>(number);  // depth of a first point
  return bytes;
}

std::vector<Device> devices(int count) {
  std::vector<Device> list(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    list[static_cast<std::size_t>(i)].serial = "SENSOR" + std::to_string(i);
    list[static_cast<std::size_t>(i)].index = static_cast<std::uint8_t>(i);
  }
  return list;
}

class PacketFileTest : public ::testing::Test {
 protected:
  io::TestFolder folder_;
  std::string path_ = folder_.file("a.lvx");
  std::string unfinished_ = path_ + ".unfinished";
};

TEST_F(PacketFileTest, SeveralSensorsInOneFile) {
  PacketFile file(path_, devices(3));
  for (int i = 1; i < 100; ++i) {
    file.add(static_cast<std::uint8_t>(i % 3), packet(i));
    if (i % 10 == 0) file.end_frame();
  }
  EXPECT_FALSE(fs::exists(path_));
  file.close();
  EXPECT_FALSE(fs::exists(unfinished_));
  const Recording read = load_recording(path_);
  EXPECT_TRUE(read.warnings.empty());
  EXPECT_EQ(read.header.devices.size(), 3U);
  EXPECT_EQ(read.header.devices[2].serial, "SENSOR2");
  ASSERT_EQ(read.data.observations.size(), 9900U);
  for (std::size_t i = 0; i < 99; ++i) {
    EXPECT_EQ(read.data.observations.time_ns[100 * i], std::int64_t(i + 1) * 1'000'000);
    EXPECT_EQ(read.data.observations.device[100 * i], (i + 1) % 3);
  }
}

// What a program that was killed leaves: every frame that was written, whole.
TEST_F(PacketFileTest, AFileThatWasNotClosedStays) {
  {
    PacketFile file(path_, devices(1));
    for (int i = 1; i < 26; ++i) {
      file.add(0, packet(i));
      if (i % 10 == 0) file.settle();
    }
    const Recording growing = load_recording(unfinished_);
    EXPECT_EQ(growing.data.observations.size(), 2000U);
    EXPECT_TRUE(growing.warnings.empty());
  }
  EXPECT_EQ(load_recording(unfinished_).data.observations.size(), 2000U);
  EXPECT_FALSE(fs::exists(path_));
  // Nobody writes over it.
  try {
    PacketFile again(path_, devices(1));
    FAIL();
  } catch (const FileError& error) {
    EXPECT_EQ(error.path(), unfinished_);
  }
  EXPECT_EQ(load_recording(unfinished_).data.observations.size(), 2000U);
  // However many bytes of it are there, it can be read up to the last whole packet.
  const auto size = fs::file_size(unfinished_);
  for (const std::uintmax_t cut : {size - 1, size - 500, size - 1000, size / 2}) {
    fs::resize_file(unfinished_, cut);
    EXPECT_EQ(load_recording(unfinished_).data.observations.size() % 100, 0U);
  }
}

TEST_F(PacketFileTest, WithoutPacketsNothingIsLeft) {
  { PacketFile file(path_, devices(1)); }
  EXPECT_TRUE(fs::is_empty(fs::path(path_).parent_path()));
}

TEST_F(PacketFileTest, AnOlderFileIsReplacedAtTheEnd) {
  std::ofstream(path_) << "older";
  PacketFile file(path_, devices(1));
  file.add(0, packet(1));
  file.end_frame();
  EXPECT_EQ(fs::file_size(path_), 5U);
  file.close();
  EXPECT_EQ(load_recording(path_).data.observations.size(), 100U);
}

TEST_F(PacketFileTest, WhatCannotBeWritten) {
  EXPECT_THROW(PacketFile(folder_.file("no/a.lvx"), devices(1)), FileError);
  EXPECT_THROW(PacketFile(path_, devices(0)), InvalidArgument);
  EXPECT_THROW(PacketFile(path_, devices(256)), InvalidArgument);
  fs::create_directory(folder_.file("folder.lvx"));
  EXPECT_THROW(PacketFile(folder_.file("folder.lvx"), devices(1)), FileError);
  EXPECT_FALSE(fs::exists(unfinished_));
}

}  // namespace risley::recordings::packet_file_test
