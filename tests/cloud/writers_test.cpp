// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What all formats of a cloud promise.
#include <filesystem>
#include <memory>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"

#include "cloud/cloud_samples.hpp"
#include "cloud/file_size_limit.hpp"
#include "parameter_name.hpp"

namespace risley::cloud::writers_test {

namespace fs = std::filesystem;

class CloudWriters : public ::testing::TestWithParam<std::string> {
 protected:
  CloudWriters() {
    for (const CloudCase& one : cloud_cases()) {
      if (one.name == "many_points") many_ = one;
    }
    points_ = make_points(many_);
    options_.format = GetParam();
    path_ = folder_.file("cloud." + GetParam());
  }

  TestFolder folder_;
  CloudCase many_;
  Points points_;
  CloudWriterOptions options_;
  std::string path_;
};

std::vector<std::string> formats_of_this_test() {
  std::vector<std::string> formats;
  for (const CloudFormat& format : cloud_formats()) {
    // LAS and LAZ have a test of their own.
    if (format.ending != ".las" && format.ending != ".laz") formats.push_back(format.name);
  }
  return formats;
}

INSTANTIATE_TEST_SUITE_P(Formats, CloudWriters, ::testing::ValuesIn(formats_of_this_test()),
                         kByItself);

TEST_P(CloudWriters, GiveTheFileItsNameAtTheEnd) {
  const auto writer = create_cloud(path_, many_.header, options_);
  writer->write(points_);
  EXPECT_FALSE(fs::exists(path_));
  writer->close();
  EXPECT_TRUE(fs::exists(path_));
}

TEST_P(CloudWriters, LeaveNothingWhenNotClosed) {
  {
    const auto writer = create_cloud(path_, many_.header, options_);
    writer->write(points_);
    EXPECT_FALSE(folder_.names().empty());
  }
  EXPECT_TRUE(folder_.names().empty());
}

/// The file of points, in the folder that a bag of ROS 2 is.
std::string file_of(const std::string& path) {
  return fs::is_directory(path) ? (fs::path(path) / "cloud_0.db3").string() : path;
}

TEST_P(CloudWriters, GiveTheSameBytesInWhateverPieces) {
  {
    const auto writer = create_cloud(path_, many_.header, options_);
    writer->write(points_);
    writer->close();
  }
  const std::string whole = io::read_text_file(file_of(path_));
  write_uneven(path_, options_.format, many_.header, points_);
  EXPECT_TRUE(whole == io::read_text_file(file_of(path_)));
}

TEST_P(CloudWriters, RefuseAFolderThatIsNotThere) {
  EXPECT_THROW(create_cloud(folder_.file("none/cloud"), many_.header, options_), FileError);
}

TEST_P(CloudWriters, SayWhenTheDiskRefuses) {
  many_.points = 50'000;
  points_ = make_points(many_);
  for (const rlim_t bytes : {1'000'000, 3'000'000}) {
    std::unique_ptr<CloudWriter> writer;
    {
      const FileSizeLimit limit(bytes);
      EXPECT_THROW(
          {
            writer = create_cloud(path_, many_.header, options_);
            writer->write(points_);
            writer->close();
          },
          FileError);
    }
    // HDF5 cannot close a file that must not grow even then: its fault would be at exit.
    writer.reset();
    EXPECT_TRUE(folder_.names().empty()) << bytes;
  }
}

}  // namespace risley::cloud::writers_test
