// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/cloud_writer.hpp"

#include <algorithm>
#include <filesystem>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"

#include "refusal.hpp"

namespace risley::cloud::cloud_writer_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(CloudFormats, HaveNamesEndingsAndDescriptions) {
  std::set<std::string> names;
  for (const CloudFormat& format : cloud_formats()) {
    EXPECT_TRUE(names.insert(format.name).second) << format.name;
    EXPECT_TRUE(format.ending.starts_with('.')) << format.name;
    EXPECT_FALSE(format.description.empty()) << format.name;
  }
  EXPECT_TRUE(names.contains("las-1.4"));
}

TEST(CloudFormats, AreFoundByEnding) {
  EXPECT_EQ(find_cloud_format("folder/cloud.las", "").name, "las-1.4");
  EXPECT_EQ(find_cloud_format("CLOUD.LAS", "").name, "las-1.4");
  EXPECT_EQ(find_cloud_format("cloud.tar.las", "").name, "las-1.4");
}

TEST(CloudFormats, AreFoundByNameWhateverTheEnding) {
  EXPECT_EQ(find_cloud_format("cloud", "las-1.4").name, "las-1.4");
  for (const CloudFormat& format : cloud_formats()) {
    EXPECT_EQ(find_cloud_format("cloud.anything", format.name).ending, format.ending);
  }
}

TEST(CloudFormats, EveryEndingHasADefault) {
  for (const CloudFormat& format : cloud_formats()) {
    EXPECT_EQ(find_cloud_format("cloud" + format.ending, "").ending, format.ending);
  }
}

TEST(CloudFormats, UnknownEndingsAreRefusedWithTheKnownOnes) {
  for (const char* path : {"cloud.docx", "cloud", "las", ""}) {
    EXPECT_THAT([path] { find_cloud_format(path, ""); },
                ThrowsMessage<InvalidArgument>(AllOf(NamesField(path), NamesField(".las"))));
  }
}

TEST(CloudFormats, UnknownFormatsAreRefusedWithTheKnownOnes) {
  EXPECT_THAT([] { find_cloud_format("cloud.las", "las-1.3"); },
              ThrowsMessage<InvalidArgument>(AllOf(NamesField("format"), NamesField("las-1.4"))));
  EXPECT_THAT([] { find_cloud_format("cloud.las", "LAS-1.4"); },
              ThrowsMessage<InvalidArgument>(NamesField("format")));
}

TEST(CloudFormats, LazNeedsLaszip) {
  const auto& formats = cloud_formats();
  const bool has_laz =
      std::ranges::any_of(formats, [](const auto& format) { return format.name == "laz"; });
  if (has_laz) {
    EXPECT_EQ(find_cloud_format("cloud.laz", "").name, "laz");
    return;
  }
  EXPECT_THAT([] { find_cloud_format("cloud.laz", ""); },
              ThrowsMessage<InvalidArgument>(AllOf(NamesField("LASzip"), NamesField(".las"))));
  EXPECT_THROW(find_cloud_format("cloud.las", "laz"), InvalidArgument);
}

}  // namespace risley::cloud::cloud_writer_test
