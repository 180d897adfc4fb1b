// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Recordings that rosbag2 split into several files of a folder.
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bags/written_mcap.hpp"
#include "recordings/format_tests.hpp"
#include "recordings/ros2_messages.hpp"
#include "refusal.hpp"

namespace risley::recordings::bag_folder_test {

using namespace ros2_messages;
using namespace format_tests;
using ::testing::AllOf;
using ::testing::ElementsAre;

/// The small bag in three files of a folder; inertial samples stand in the second and third alone.
class BagFolder {
 public:
  explicit BagFolder(bool mcap) : mcap_(mcap) {
    std::filesystem::create_directories(path());
    const Ros2BagFile whole = small_ros2_bag();
    for (std::size_t part = 0; part < 3; ++part) {
      Ros2BagFile bag;
      bag.topics = whole.topics;
      if (part == 0) bag.topics.resize(1);
      bag.messages.assign(whole.messages.begin() + static_cast<std::ptrdiff_t>(6 * part),
                          whole.messages.begin() + static_cast<std::ptrdiff_t>(6 * part + 6));
      if (part == 0) std::erase_if(bag.messages, [](const auto& one) { return one.first != 0; });
      if (mcap) {
        McapFile(bag).write(file(name(part)));
      } else {
        bag.write(file(name(part))).reset();
      }
    }
    write_metadata({name(0), name(1), name(2)});
  }

  std::string path() const { return folder_.file("bag"); }
  std::string file(const std::string& name) const { return path() + "/" + name; }
  std::string name(std::size_t part) const {
    return fmt::format("bag_{}.{}", part, mcap_ ? "mcap" : "db3");
  }
  void write_metadata(const std::vector<std::string>& names, int version = 5,
                      const std::string& mode = "") const {
    std::string text = fmt::format(
        "rosbag2_bagfile_information:\n  version: {}\n  storage_identifier: sqlite3\n"
        "  duration:\n    nanoseconds: 180000000\n  relative_file_paths:\n",
        version);
    for (const std::string& one : names) text += fmt::format("    - {}\n", one);
    text += fmt::format("  compression_format: \"\"\n  compression_mode: \"{}\"\n", mode);
    put_bytes(file("metadata.yaml"), text);
  }
  std::string refused() const {
    try {
      load_recording(path());
    } catch (const FileError& error) {
      return error.what();
    }
    return "";
  }

 private:
  TestFolder folder_;
  bool mcap_;
};

/// All rows of a folder, up to its damage.
struct Read {
  Observations rows;
  std::size_t samples = 0;
  std::vector<Warning> warnings;
  std::string format, error;
};

Read read_folder(const BagFolder& folder) {
  Read all;
  const auto reader = open_recording(folder.path());
  all.format = reader->header().format;
  try {
    Chunk chunk;
    double fraction = 0;
    while (reader->read(chunk, 10)) {
      all.rows.append(chunk.observations);
      all.samples += chunk.imu.size();
      EXPECT_GE(reader->fraction_read(), fraction);
      fraction = reader->fraction_read();
      EXPECT_LE(fraction, 1.0);
    }
  } catch (const FileError& error) {
    all.error = error.what();
  }
  all.warnings = reader->warnings();
  return all;
}

TEST(BagFolder, FilesThatRosbag2CompressedAreReadOnceTheyAreUnpacked) {
  for (const bool mcap : {false, true}) {
    const BagFolder folder(mcap);
    const std::string first = folder.name(0);
    folder.write_metadata({first + ".zstd"}, 5, "FILE");
    EXPECT_EQ(folder.refused(), "") << "unpacked beside it";
    std::filesystem::rename(folder.file(first), folder.file(first + ".zstd"));
    EXPECT_THAT(folder.refused(), AllOf(NamesField("metadata.yaml: line 7"), NamesField(first)));
  }
}

TEST(BagFolder, MessagesThatRosbag2CompressedAreRead) {
  const TestFolder folder;
  const Ros2BagFile plain = small_ros2_bag();
  Ros2BagFile packed = plain;
  for (auto& [topic, bytes] : packed.messages) bytes = mcap_packed(bytes, "zstd");
  plain.write(folder.file("plain.db3")).reset();
  packed.write(folder.file("packed.db3")).reset();
  McapFile(packed).write(folder.file("packed.mcap"));
  const Recording wanted = load_recording(folder.file("plain.db3"));
  for (const char* name : {"packed.db3", "packed.mcap"}) {
    SCOPED_TRACE(name);
    const Recording read = load_recording(folder.file(name));
    EXPECT_TRUE(is_same(read.data.observations, wanted.data.observations));
    EXPECT_EQ(read.data.imu.size(), wanted.data.imu.size());
  }
  // A message that claims more than its bytes can hold, and one that is cut off.
  for (const bool cut : {false, true}) {
    Ros2BagFile damaged = packed;
    std::string& bytes = damaged.messages[1].second;
    if (cut) {
      bytes.resize(bytes.size() / 2);
    } else {
      bytes = std::string("\x28\xB5\x2F\xFD\xE0", 5) + std::string(8, '\x7F') + "x";
    }
    const std::string path = folder.file(cut ? "cut.db3" : "claims.db3");
    damaged.write(path).reset();
    EXPECT_THROW(load_recording(path), FileError);
  }
}

TEST(BagFolder, ItsFilesAreReadInOrder) {
  const TestFolder other;
  small_ros2_bag().write(other.file("whole.db3")).reset();
  const Recording wanted = load_recording(other.file("whole.db3"));
  for (const bool mcap : {false, true}) {
    const BagFolder folder(mcap);
    Read read = read_folder(folder);
    EXPECT_EQ(read.error, "");
    EXPECT_EQ(read.format, mcap ? "mcap" : "ros2-bag");
    EXPECT_TRUE(is_same(read.rows, wanted.data.observations));
    EXPECT_EQ(read.samples, 4U);
    EXPECT_TRUE(read.warnings.empty());
    // The order is that of the list, whatever the names.
    folder.write_metadata({folder.name(1), folder.name(2), folder.name(0)});
    read = read_folder(folder);
    ASSERT_EQ(read.rows.size(), 120U);
    EXPECT_EQ(read.rows.time_ns[0], wanted.data.observations.time_ns[40]);
    // Up to version 3 the folder's name stands before.
    folder.write_metadata({"anything/" + folder.name(0)}, 3);
    EXPECT_EQ(read_folder(folder).rows.size(), 40U);
  }
}

TEST(BagFolder, WhatIsWrongWithTheListIsSaid) {
  const BagFolder folder(true);
  const std::string first = folder.name(0);
  const auto refused = [&](const std::vector<std::string>& names, int version = 5,
                           const std::string& mode = "") {
    folder.write_metadata(names, version, mode);
    return folder.refused();
  };
  EXPECT_THAT(refused({first, "gone_1.mcap", "gone_2.mcap"}),
              AllOf(NamesField("metadata.yaml: line 8"), NamesField("gone_1.mcap, gone_2.mcap")));
  for (const char* name : {"../x.mcap", "/etc/passwd", "sub/x.mcap", "..", "''"}) {
    EXPECT_THAT(refused({first, name}), NamesField("relative_file_paths", 8)) << name;
  }
  EXPECT_THAT(refused({"../x/y.mcap"}, 3), NamesField("../x/y.mcap"));
  EXPECT_THAT(refused({"../x.mcap"}, 3), NamesField(": x.mcap"));
  EXPECT_THAT(refused({first, first}), NamesField("bag_0.mcap appears twice"));
  EXPECT_EQ(refused({first}, 5, "FILE"), "");  // unpacked since
  EXPECT_EQ(refused({first}, 5, "NONE"), "");
  EXPECT_THAT(refused({}), NamesField("relative_file_paths"));
  EXPECT_THAT(refused({"metadata.yaml"}), NamesField("metadata.yaml"));
  put_bytes(folder.file("metadata.yaml"), "other: 1\n");
  EXPECT_THAT(folder.refused(), NamesField("rosbag2_bagfile_information"));
  std::filesystem::remove(folder.file("metadata.yaml"));
  EXPECT_THAT(folder.refused(),
              AllOf(NamesField("bag_0.mcap, bag_1.mcap, bag_2.mcap"), NamesField("metadata.yaml")));
  for (std::size_t part = 0; part < 3; ++part)
    std::filesystem::remove(folder.file(folder.name(part)));
  EXPECT_THAT(folder.refused(), NamesField("folder"));
}

TEST(BagFolder, DamageInAFileKeepsTheFilesBefore) {
  for (const bool mcap : {false, true}) {
    const BagFolder folder(mcap);
    put_bytes(folder.file(folder.name(1)), "no bag");
    Read read = read_folder(folder);
    EXPECT_EQ(read.rows.size(), 40U);
    EXPECT_THAT(read.error, NamesField(folder.name(1) + ": byte 0"));
  }
  const BagFolder folder(true);
  std::string bytes = get_bytes(folder.file(folder.name(1)));
  put_bytes(folder.file(folder.name(1)), std::string_view(bytes).substr(0, bytes.size() - 50));
  Read read = read_folder(folder);
  EXPECT_EQ(read.error, "");
  EXPECT_EQ(read.rows.size(), 120U);
  EXPECT_THAT(read.warnings, ElementsAre(Warns(kWarning.cut_off, {"bag_1.mcap"})));
  // A damaged message is reported with its file.
  McapFile part(small_ros2_bag());
  part.messages[1].second = "no CDR";
  part.write(folder.file(folder.name(2)));
  read = read_folder(folder);
  EXPECT_THAT(read.error,
              AllOf(NamesField("bag_2.mcap: byte"), NamesField("message 1 of topic /livox/lidar")));
  EXPECT_EQ(read.rows.size(), 80U);
}

TEST(BagFolder, CanBeCancelled) {
  const BagFolder folder(true);
  CancelFlag flag;
  const Progress progress([](double) {}, &flag);
  const auto reader = open_recording(folder.path(), {}, progress);
  flag.set();
  Chunk chunk;
  EXPECT_THROW(reader->read(chunk), Cancelled);
  EXPECT_THROW(open_recording(folder.path(), {}, progress), Cancelled);
}

}  // namespace risley::recordings::bag_folder_test
