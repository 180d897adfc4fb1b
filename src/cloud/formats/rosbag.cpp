// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// ROS 1 bag: one message sensor_msgs/PointCloud2 per 100 ms of the recording. A message is stamped
// with the time of its first point on the recording's clock. Bags hold no time before 1 ns: when
// the first point of a cloud is earlier, all stamps are moved by what brings that point to 1 ns,
// and a later message that would still be earlier is stamped 1 ns. The field "time", s, is never
// moved; "offset_time", ns after the first point of the message, is what doubles of today's times
// are too coarse for.
#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>

#include <fmt/format.h>
#include <rosbag/bag.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/io/output_file.hpp"
#include "risley/io/rosbag_lock.hpp"

#include "cloud/formats/cloud_format.hpp"
#include "cloud/formats/record_file.hpp"

namespace risley::cloud {
namespace {

constexpr const char* kTopic = "/risley/points";
constexpr std::string_view kFrame = "livox_frame";
constexpr std::string_view kOffsetField = "offset_time";     ///< as in Livox's own messages
constexpr std::uint8_t kUint32 = 6;                          ///< datatype of a PointField
constexpr std::int64_t kMessageDuration = 100'000'000;       ///< ns
constexpr std::size_t kMessageBytes = std::size_t{1} << 24;  ///< of points in one message, at most
constexpr std::int64_t kNanoseconds = 1'000'000'000;         ///< in a second
constexpr std::int64_t kEarliest = 1;                        ///< ros::TIME_MIN, ns

constexpr const char* kType = "sensor_msgs/PointCloud2";
/// ROS's checksum of the definition below.
constexpr const char* kChecksum = "1158d486dd51d683ce2f1be655c3c181";
constexpr const char* kDefinition =
    R"(Header header
uint32 height
uint32 width
PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense

================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id

================================================================================
MSG: sensor_msgs/PointField
uint8 INT8=1
uint8 UINT8=2
uint8 INT16=3
uint8 UINT16=4
uint8 INT32=5
uint8 UINT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 datatype
uint32 count
)";

/// A message as it stands in the bag, in two parts.
struct PointCloudMessage {
  std::vector<std::uint8_t> head;    ///< all before the points
  std::vector<std::uint8_t> points;  ///< the points and is_dense

  void add(std::uint32_t number) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&number);
    head.insert(head.end(), bytes, bytes + sizeof number);
  }
  void add(std::uint8_t number) { head.push_back(number); }
  void add(std::string_view text) {
    add(static_cast<std::uint32_t>(text.size()));
    head.insert(head.end(), text.begin(), text.end());
  }
};

}  // namespace
}  // namespace risley::cloud

namespace ros {
namespace message_traits {
template <>
struct MD5Sum<risley::cloud::PointCloudMessage> {
  static const char* value() { return risley::cloud::kChecksum; }
  static const char* value(const risley::cloud::PointCloudMessage&) { return value(); }
};
template <>
struct DataType<risley::cloud::PointCloudMessage> {
  static const char* value() { return risley::cloud::kType; }
  static const char* value(const risley::cloud::PointCloudMessage&) { return value(); }
};
template <>
struct Definition<risley::cloud::PointCloudMessage> {
  static const char* value() { return risley::cloud::kDefinition; }
  static const char* value(const risley::cloud::PointCloudMessage&) { return value(); }
};
}  // namespace message_traits
namespace serialization {
template <>
struct Serializer<risley::cloud::PointCloudMessage> {
  template <class Stream>
  static void write(Stream& stream, const risley::cloud::PointCloudMessage& message) {
    for (const auto* part : {&message.head, &message.points}) {
      const auto bytes = static_cast<std::uint32_t>(part->size());
      std::memcpy(stream.advance(bytes), part->data(), bytes);
    }
  }
  // NOLINTNEXTLINE(readability-identifier-naming): the name that ROS calls
  static std::uint32_t serializedLength(const risley::cloud::PointCloudMessage& message) {
    return static_cast<std::uint32_t>(message.head.size() + message.points.size());
  }
};
}  // namespace serialization
}  // namespace ros

namespace risley::cloud {
namespace {

class RosbagWriter final : public CloudWriter {
 public:
  RosbagWriter(const std::string& path, const CloudHeader& header)
      : packer_(pcl_fields(header)), output_(path) {
    call([this] {
      bag_ = std::make_unique<rosbag::Bag>();
      bag_->open(output_.temporary_path(), rosbag::bagmode::Write);
    });
  }

  ~RosbagWriter() override {
    if (!bag_) return;
    try {
      call([this] {
        bag_->close();
        bag_.reset();
      });
    } catch (const FileError&) {
      // The file is going to be removed.
    }
  }

  void write(const Points& points) override {
    const std::size_t step = point_bytes();
    records_.resize(points.size() * step);
    packer_.pack(points, 0, points.size(), records_.data(), step);
    const std::size_t most = std::max<std::size_t>(kMessageBytes / step, 1) * step;
    std::size_t first = 0;  // of those not in message_ yet
    const auto take = [&](std::size_t end) {
      message_.points.insert(message_.points.end(), records_.begin() + (first * step),
                             records_.begin() + (end * step));
      first = end;
    };
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::int64_t time = points.time_ns[i];
      const bool full = message_.points.size() + (i - first) * step >= most;
      if (!begin_ || full || time < *begin_ || since(*begin_, time) >= kMessageDuration) {
        take(i);
        put_message();
        begin_ = time;
        if (!shift_) shift_ = time < kEarliest ? since(time, kEarliest) : 0;
        require_in_range(time, points_ + i);
      }
      io::store<std::uint32_t>(records_.data() + i * step + packer_.record_bytes(),
                               static_cast<std::uint32_t>(since(*begin_, time)));
    }
    take(points.size());
    points_ += points.size();
  }

  void close() override {
    put_message();
    call([this] { bag_->close(); });
    output_.commit();
  }

 private:
  /// The packed fields and the offset of the time.
  std::size_t point_bytes() const { return packer_.record_bytes() + sizeof(std::uint32_t); }

  /// From one time to a later one, ns.
  static std::uint64_t since(std::int64_t earlier, std::int64_t later) {
    return static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier);
  }

  /// Time of a message on the bag's clock, ns.
  std::uint64_t stamp_of(std::int64_t time) const {
    const auto moved = static_cast<std::uint64_t>(time) + *shift_;
    const bool early = time < 0 ? since(time, 0) >= *shift_ : moved < kEarliest;
    return early ? static_cast<std::uint64_t>(kEarliest) : moved;
  }

  void require_in_range(std::int64_t time, std::uint64_t point) const {
    constexpr std::uint64_t kLast = std::numeric_limits<std::uint32_t>::max();
    if (stamp_of(time) / kNanoseconds <= kLast) return;
    throw InvalidArgument(
        fmt::format("{}: time of point {} = {} s, allowed in a ROS 1 bag up to {} s after {} s",
                    output_.path(), point, time / kNanoseconds, kLast,
                    -static_cast<double>(*shift_) / static_cast<double>(kNanoseconds)));
  }

  void put_message() {
    if (!begin_) return;
    const auto bytes = static_cast<std::uint32_t>(message_.points.size());
    const auto step = static_cast<std::uint32_t>(point_bytes());
    const std::uint64_t stamp = stamp_of(*begin_);
    const auto seconds = static_cast<std::uint32_t>(stamp / kNanoseconds);
    const auto nanoseconds = static_cast<std::uint32_t>(stamp % kNanoseconds);
    message_.head.clear();
    message_.add(messages_++);
    message_.add(seconds);
    message_.add(nanoseconds);
    message_.add(kFrame);
    message_.add(std::uint32_t{1});  // height
    message_.add(bytes / step);
    message_.add(static_cast<std::uint32_t>(packer_.fields().size() + 1));
    for (std::size_t k = 0; k < packer_.fields().size(); ++k) {
      message_.add(packer_.fields()[k].name);
      message_.add(static_cast<std::uint32_t>(packer_.offset(k)));
      message_.add(names_of(packer_.fields()[k].type).ros);
      message_.add(std::uint32_t{1});
    }
    message_.add(kOffsetField);
    message_.add(static_cast<std::uint32_t>(packer_.record_bytes()));
    message_.add(kUint32);
    message_.add(std::uint32_t{1});
    message_.add(std::uint8_t{0});  // is_bigendian
    message_.add(step);
    message_.add(bytes);
    message_.add(bytes);
    message_.points.push_back(1);  // is_dense
    call([&] { bag_->write(kTopic, ros::Time(seconds, nanoseconds), message_); });
    message_.points.clear();
    begin_.reset();
  }

  /// Calls the library and gives its errors ours. A bag that failed cannot be closed any more (its
  /// destructor would try and end the process), so it is kept, and its file open, to the end.
  template <class Function>
  void call(Function&& function) {
    const auto lock = io::lock_rosbag();
    try {
      function();
    } catch (const std::exception& error) {
      static auto& abandoned = *new std::vector<rosbag::Bag*>;
      abandoned.push_back(bag_.release());
      throw FileError(output_.path(), {}, fmt::format("cannot be written: {}", error.what()));
    }
  }

  RecordPacker packer_;
  io::OutputFile output_;
  std::unique_ptr<rosbag::Bag> bag_;
  std::vector<std::uint8_t> records_;
  PointCloudMessage message_;
  std::optional<std::int64_t> begin_;   ///< time of the first point of message_, ns
  std::optional<std::uint64_t> shift_;  ///< from the recording's clock to the bag's, ns
  std::uint64_t points_ = 0;
  std::uint32_t messages_ = 0;
};

}  // namespace

const CloudWriterFormat kRosbagFormat = {
    "ros1-bag", ".bag", "ROS 1 bag of PointCloud2 messages, one per 100 ms",
    [](const std::string& path, const CloudHeader& header, const CloudWriterOptions&)
        -> std::unique_ptr<CloudWriter> { return std::make_unique<RosbagWriter>(path, header); }};

}  // namespace risley::cloud
