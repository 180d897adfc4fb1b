// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"

#include "cloud/cloud_samples.hpp"
#include "refusal.hpp"

namespace risley::cloud::rosbag_cloud_test {

/// A PointCloud2 message, and when the bag has it.
struct Message {
  std::uint64_t time = 0;   ///< of the bag, ns
  std::uint64_t stamp = 0;  ///< of the header, ns
  std::uint32_t sequence = 0;
  std::string frame;
  std::uint32_t height = 0, width = 0;
  TestTable fields;
  std::vector<std::uint32_t> offsets;
  std::uint32_t point_step = 0, row_step = 0;
  bool big_endian = false, dense = false;
  std::string data;
};

/// Takes numbers and texts off a serialized message.
class Deserializer {
 public:
  explicit Deserializer(std::string bytes) : bytes_(std::move(bytes)) {}

  template <class T>
  T number() {
    T value{};
    if (at_ + sizeof value > bytes_.size()) throw std::out_of_range("message is too short");
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  std::string text() {
    const auto length = number<std::uint32_t>();
    if (at_ + length > bytes_.size()) throw std::out_of_range("message is too short");
    at_ += length;
    return bytes_.substr(at_ - length, length);
  }
  bool at_end() const { return at_ == bytes_.size(); }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

constexpr std::uint64_t kSecond = 1'000'000'000;

char type_of(std::uint32_t datatype) {
  return datatype == 2   ? 'u'
         : datatype == 6 ? 'i'
         : datatype == 7 ? 'f'
         : datatype == 8 ? 'd'
                         : '?';
}

Message parse(const std::string& bytes) {
  Deserializer from(bytes);
  Message message;
  message.sequence = from.number<std::uint32_t>();
  message.stamp = kSecond * from.number<std::uint32_t>();
  message.stamp += from.number<std::uint32_t>();
  message.frame = from.text();
  message.height = from.number<std::uint32_t>();
  message.width = from.number<std::uint32_t>();
  const auto fields = from.number<std::uint32_t>();
  for (std::uint32_t k = 0; k < fields; ++k) {
    const std::string name = from.text();
    message.offsets.push_back(from.number<std::uint32_t>());
    message.fields.push_back({name, type_of(from.number<std::uint8_t>()), {}});
    EXPECT_EQ(from.number<std::uint32_t>(), 1U) << name;
  }
  message.big_endian = from.number<std::uint8_t>() != 0;
  message.point_step = from.number<std::uint32_t>();
  message.row_step = from.number<std::uint32_t>();
  message.data = from.text();
  message.dense = from.number<std::uint8_t>() != 0;
  EXPECT_TRUE(from.at_end());
  return message;
}

std::vector<Message> read_bag(const std::string& path) {
  rosbag::Bag bag(path);
  EXPECT_EQ(bag.getCompression(), rosbag::compression::Uncompressed);
  std::vector<Message> messages;
  rosbag::View view(bag);
  for (const rosbag::MessageInstance& one : view) {
    EXPECT_EQ(one.getTopic(), "/risley/points");
    EXPECT_EQ(one.getDataType(), "sensor_msgs/PointCloud2");
    EXPECT_EQ(one.getMD5Sum(), "1158d486dd51d683ce2f1be655c3c181");
    std::string bytes(one.size(), '\0');
    ros::serialization::OStream stream(reinterpret_cast<std::uint8_t*>(bytes.data()), one.size());
    one.write(stream);
    messages.push_back(parse(bytes));
    messages.back().time = one.getTime().toNSec();
  }
  return messages;
}

/// All points of all messages.
TestTable join(const std::vector<Message>& messages) {
  TestTable table = messages.front().fields;
  std::string bytes;
  for (const Message& message : messages) bytes += message.data;
  read_records(bytes, table);
  return table;
}

class RosbagCloud : public ::testing::TestWithParam<CloudCase> {
 protected:
  std::string write() {
    std::string path = folder_.file("cloud.bag");
    write_uneven(path, "ros1-bag", GetParam().header, points_);
    return path;
  }

  TestFolder folder_;
  Points points_ = make_points(GetParam());
  TestTable expected_ = [this] {
    TestTable all = expected_table(GetParam().header, points_);
    use_pcl_names(all);
    TestColumn stamps{"timestamp", 'd', {}}, offsets{"offset_time", 'i', {}};
    std::int64_t begin = 0;
    for (const std::int64_t time : points_.time_ns) {
      if (offsets.values.empty() || time - begin >= 100'000'000) begin = time;
      offsets.values.push_back(static_cast<double>(time - begin));
      stamps.values.push_back(static_cast<double>(time));
    }
    TestTable table;
    for (const char* name : {"x", "y", "z", "intensity", "Tag", "Beam"}) {
      table.push_back(column(all, name));
      std::erase_if(all, [name](const TestColumn& one) { return one.name == name; });
    }
    table[4].name = "tag";
    table[5].name = "line";
    table.push_back(stamps);
    table.push_back(offsets);
    if (!GetParam().header.has_covariance) return table;
    for (const TestColumn& one : all) {
      if (one.name != "time") table.push_back(one);
    }
    return table;
  }();
};

INSTANTIATE_TEST_SUITE_P(Clouds, RosbagCloud, ::testing::ValuesIn(cloud_cases()),
                         [](const auto& one) { return one.param.name; });

TEST_P(RosbagCloud, HoldsEveryField) {
  const std::vector<Message> messages = read_bag(write());
  ASSERT_EQ(messages.empty(), points_.size() == 0);
  if (messages.empty()) return;
  expect_same(join(messages), expected_);
  std::size_t first = 0;
  for (const Message& message : messages) {
    EXPECT_EQ(message.sequence, static_cast<std::uint32_t>(&message - messages.data()));
    EXPECT_EQ(message.frame, "livox_frame");
    EXPECT_EQ(message.height, 1U);
    EXPECT_FALSE(message.big_endian);
    EXPECT_TRUE(message.dense);
    EXPECT_EQ(message.point_step, record_bytes(expected_));
    EXPECT_EQ(message.row_step, message.width * message.point_step);
    EXPECT_EQ(message.data.size(), message.row_step);
    std::uint32_t offset = 0;
    for (std::size_t k = 0; k < message.fields.size(); ++k) {
      EXPECT_EQ(message.offsets[k], offset);
      offset += message.fields[k].type == 'u' ? 1 : message.fields[k].type == 'd' ? 8 : 4;
    }
    const auto start = static_cast<std::uint64_t>(points_.time_ns.at(first));
    EXPECT_EQ(message.stamp, start);
    EXPECT_EQ(message.time, start);
    for (std::size_t i = first; i < first + message.width; ++i) {
      ASSERT_LT(static_cast<std::uint64_t>(points_.time_ns[i]) - start, kSecond / 10);
    }
    first += message.width;
    if (first < points_.size()) {
      EXPECT_GE(static_cast<std::uint64_t>(points_.time_ns[first]) - start, kSecond / 10);
    }
  }
  EXPECT_EQ(first, points_.size());
}

TEST_P(RosbagCloud, IsReadByPython) {
  const std::string python = find_python("rosbag");
  if (python.empty()) GTEST_SKIP() << "no Python with rosbag";
  const std::string path = write(), script = folder_.file("read.py"),
                    answer = folder_.file("answer");
  // The classes of the messages come from the definition in the bag, so that is read too.
  io::write_text_file(script, R"(
import sys
import rosbag
with rosbag.Bag(sys.argv[1]) as bag, open(sys.argv[2], 'wb') as answer:
    for topic, message, time in bag.read_messages():
        assert topic == '/risley/points', topic
        assert message._type == 'sensor_msgs/PointCloud2', message._type
        assert message._md5sum == '1158d486dd51d683ce2f1be655c3c181', message._md5sum
        assert message.header.stamp.to_nsec() == time.to_nsec()
        assert message.header.frame_id == 'livox_frame' and message.height == 1
        assert message.is_dense and not message.is_bigendian
        assert message.fields[0].FLOAT32 == 7 and message.fields[0].FLOAT64 == 8
        assert message.row_step == message.width * message.point_step == len(message.data)
        for field in message.fields:
            assert field.count == 1
            answer.write(f'{field.name} {field.datatype} '.encode())
        answer.write(f'\n{time.to_nsec()} {len(message.data)}\n'.encode())
        answer.write(message.data)
)");
  const std::string call = python + " '" + script + "' '" + path + "' '" + answer + "'";
  ASSERT_EQ(std::system(call.c_str()), 0);
  std::vector<Message> messages;
  std::ifstream stream(answer, std::ios::binary);
  for (std::string line; std::getline(stream, line);) {
    Message& message = messages.emplace_back();
    std::istringstream words(line);
    std::string name;
    std::uint32_t datatype = 0;
    while (words >> name >> datatype) message.fields.push_back({name, type_of(datatype), {}});
    std::size_t bytes = 0;
    ASSERT_TRUE(std::getline(stream, line));
    ASSERT_TRUE(std::istringstream(line) >> message.time >> bytes);
    message.data.resize(bytes);
    ASSERT_TRUE(stream.read(message.data.data(), static_cast<std::streamsize>(bytes)));
  }
  ASSERT_EQ(messages.empty(), points_.size() == 0);
  if (!messages.empty()) expect_same(join(messages), expected_);
}

/// Stamps of a cloud of one point per time.
std::vector<std::uint64_t> stamps_of(const std::vector<std::int64_t>& times) {
  const TestFolder folder;
  CloudCase one = cloud_cases().at(1);
  one.points = times.size();
  Points points = make_points(one);
  points.time_ns = times;
  write_uneven(folder.file("cloud.bag"), "ros1-bag", one.header, points);
  std::vector<Message> messages = read_bag(folder.file("cloud.bag"));
  std::ranges::sort(messages,
                    [](const Message& a, const Message& b) { return a.sequence < b.sequence; });
  std::vector<std::uint64_t> stamps;
  for (const Message& message : messages) {
    EXPECT_EQ(message.time, message.stamp);
    stamps.push_back(message.stamp);
  }
  TestTable table = join(messages);
  EXPECT_EQ(column(table, "timestamp").values, std::vector<double>(times.begin(), times.end()));
  return stamps;
}

TEST(RosbagClouds, BeginAMessageEveryTenthOfASecond) {
  using Stamps = std::vector<std::uint64_t>;
  EXPECT_EQ(stamps_of({5, 100'000'004, 100'000'005, 300'000'000}),
            (Stamps{5, 100'000'005, 300'000'000}));
  // A clock that goes back begins a message too.
  EXPECT_EQ(stamps_of({1'000, 1'001, 10, 11}), (Stamps{1'000, 10}));
}

TEST(RosbagClouds, MoveTimesThatBagsCannotHold) {
  using Stamps = std::vector<std::uint64_t>;
  constexpr std::int64_t kStep = 200'000'000;
  EXPECT_EQ(stamps_of({0, kStep}), (Stamps{1, 1 + kStep}));
  EXPECT_EQ(stamps_of({-kStep, 0, kStep}), (Stamps{1, 1 + kStep, 1 + 2 * kStep}));
  // The first point decides.
  EXPECT_EQ(stamps_of({7, -kStep, kStep}), (Stamps{7, 1, kStep}));
  EXPECT_EQ(stamps_of({-5, -kStep, kStep}), (Stamps{1, 1, kStep + 6}));
}

TEST(RosbagClouds, RefuseTimesAfterTheLast) {
  const TestFolder folder;
  CloudCase one = cloud_cases().at(1);
  Points points = make_points(one);
  CloudWriterOptions options;
  options.format = "ros1-bag";
  const auto writer = create_cloud(folder.file("cloud.bag"), one.header, options);
  points.time_ns[0] = 4'294'967'295'999'999'999;
  writer->write(points);
  ++points.time_ns[0];
  writer->write(points);  // of the message that has begun
  points.time_ns[0] += 200'000'000;
  EXPECT_NE(refusal([&] { writer->write(points); }).find("time of a point = 4294967296"),
            std::string::npos);
  EXPECT_THROW(writer->close(), FileError);
}

TEST(RosbagClouds, DivideLongMessages) {
  const TestFolder folder;
  CloudCase one = cloud_cases().at(1);
  one.points = 400'000;
  Points points = make_points(one);
  std::ranges::fill(points.time_ns, 1);
  write_uneven(folder.file("cloud.bag"), "ros1-bag", one.header, points);
  const std::vector<Message> messages = read_bag(folder.file("cloud.bag"));
  EXPECT_GT(messages.size(), 1U);
  std::size_t found = 0;
  for (const Message& message : messages) {
    EXPECT_LE(message.data.size(), std::size_t{1} << 24);
    found += message.width;
  }
  EXPECT_EQ(found, one.points);
}

}  // namespace risley::cloud::rosbag_cloud_test
