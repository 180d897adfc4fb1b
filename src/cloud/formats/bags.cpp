// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Bags of ROS 1 and ROS 2: messages of points as the drivers of Livox publish them. A PointCloud2
// has the drivers' fields first, and all other fields of clouds if these have covariances.
#include <algorithm>
#include <array>
#include <string_view>

#include "risley/bags/lidar_topic.hpp"

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/record_file.hpp"

namespace risley::cloud {
namespace {

constexpr const char* kTopic = "/risley/points";

/// Fields with the drivers' own names.
constexpr std::array<std::string_view, 7> kDriverFields{"x",    "y",   "z",   "intensity",
                                                        "time", "Tag", "Beam"};

/// The fields of a PointCloud2 after those of the drivers.
std::vector<PointField> further_fields(const CloudHeader& header) {
  std::vector<PointField> fields = pcl_fields(header);  // which refuses maps
  if (!header.has_covariance) return {};
  std::erase_if(fields, [](const PointField& field) {
    return std::ranges::find(kDriverFields, field.name) != kDriverFields.end();
  });
  return fields;
}

bags::LidarTopicOptions with_defaults(bags::LidarTopicOptions options) {
  if (options.topic.empty()) options.topic = kTopic;
  if (!options.message) options.message = bags::WrittenMessage::cloud;
  return options;
}

std::vector<bags::PointFieldEntry> entries_of(const RecordPacker& packer) {
  std::vector<bags::PointFieldEntry> entries;
  for (std::size_t k = 0; k < packer.fields().size(); ++k) {
    const PointField& field = packer.fields()[k];
    entries.push_back(
        {field.name, static_cast<std::uint32_t>(packer.offset(k)), names_of(field.type).ros});
  }
  return entries;
}

/// Writes points into the caller's bag.
class TopicCloudWriter final : public CloudWriter {
 public:
  TopicCloudWriter(bags::BagWriter& bag, bags::BagKind kind, const CloudHeader& header,
                   const bags::LidarTopicOptions& options)
      : packer_(further_fields(header)),
        topic_(bag, kind, with_defaults(options), entries_of(packer_), packer_.record_bytes()) {}

  void write(const Points& points) override {
    const std::size_t step = packer_.record_bytes();
    more_.resize(points.size() * step);
    if (step > 0) packer_.pack(points, 0, points.size(), more_.data(), step);
    for (std::size_t i = 0; i < points.size(); ++i) {
      topic_.add(
          {points.time_ns[i], static_cast<float>(points.x[i]), static_cast<float>(points.y[i]),
           static_cast<float>(points.z[i]), points.intensity[i], points.tag[i], points.beam[i]},
          more_.data() + i * step);
    }
  }

  void end_message() override { topic_.flush(); }
  void close() override { topic_.flush(); }

 private:
  RecordPacker packer_;  ///< of the fields after those of the drivers
  bags::LidarTopic topic_;
  std::vector<std::uint8_t> more_;
};

class BagCloudWriter final : public CloudWriter {
 public:
  BagCloudWriter(const std::string& path, bags::BagKind kind, const CloudHeader& header,
                 const CloudWriterOptions& options)
      : bag_(bags::create_bag(path, kind)), topic_(*bag_, kind, header, options.messages) {}

  void write(const Points& points) override { topic_.write(points); }
  void end_message() override { topic_.end_message(); }
  void close() override {
    topic_.close();
    bag_->close();
  }

 private:
  std::unique_ptr<bags::BagWriter> bag_;
  TopicCloudWriter topic_;
};

template <bags::BagKind Kind>
std::unique_ptr<CloudWriter> create(const std::string& path, const CloudHeader& header,
                                    const CloudWriterOptions& options) {
  return std::make_unique<BagCloudWriter>(path, Kind, header, options);
}

}  // namespace

std::unique_ptr<CloudWriter> write_cloud_into(bags::BagWriter& bag, bags::BagKind kind,
                                              const CloudHeader& header,
                                              const bags::LidarTopicOptions& options) {
  return std::make_unique<TopicCloudWriter>(bag, kind, header, options);
}

const CloudWriterFormat kRos1BagFormat = {
    "ros1-bag", ".bag", "ROS 1 bag of PointCloud2 or CustomMsg", create<bags::BagKind::ros1>};
const CloudWriterFormat kRos2BagFormat = {
    "ros2-bag", ".db3", "ROS 2 bag, a folder with a SQLite database", create<bags::BagKind::ros2>};
const CloudWriterFormat kMcapFormat = {"mcap", ".mcap", "ROS 2 bag in MCAP",
                                       create<bags::BagKind::mcap>};

}  // namespace risley::cloud
