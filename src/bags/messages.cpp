// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/bags/messages.hpp"

#include <algorithm>
#include <concepts>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "risley/core/text.hpp"
#include "risley/io/little_endian.hpp"

#include "bags/bag_kinds.hpp"

namespace risley::bags {
namespace {

using Bytes = std::span<const std::uint8_t>;

template <class T>
concept Described = requires {
  T::kType;
};

/// A number whose bytes may be in reverse order.
template <class T>
T load_number(const std::uint8_t* bytes, bool swapped) {
  if (!swapped) return io::load<T>(bytes);
  std::array<std::uint8_t, sizeof(T)> turned;
  std::reverse_copy(bytes, bytes + sizeof(T), turned.begin());
  return io::load<T>(turned.data());
}

template <class T>
void store_number(std::uint8_t* bytes, T value, bool swapped) {
  io::store<T>(bytes, value);
  if (swapped) std::reverse(bytes, bytes + sizeof(T));
}

/// Reads the fields of a message from its bytes.
template <class Fields>
class Taking {
 public:
  explicit Taking(Fields& fields) : fields_(fields) {}

  template <class T>
  requires std::is_arithmetic_v<T>
  void operator()(std::string_view name, T& value) { value = fields_.template number<T>(name); }
  void operator()(std::string_view name, bool& value) {
    value = fields_.template number<std::uint8_t>(name) != 0;
  }
  void operator()(std::string_view name, std::string& value) {
    value = fields_.text(fmt::format("characters of the {}", name));
  }
  void operator()(std::string_view, Header& value) { value = take_header(fields_); }
  template <class T, std::size_t Count>
  void operator()(std::string_view name, std::array<T, Count>& values) {
    for (T& value : values) (*this)(name, value);
  }
  template <Described T>
  void operator()(std::string_view, T& value) {
    T::describe(value, *this);
  }
  template <Described T>
  void operator()(std::string_view name, std::vector<T>& values) {
    values.assign(fields_.length(name, T::kLeastBytes), {});
    for (T& value : values) T::describe(value, *this);
  }
  void operator()(std::string_view name, Bytes& value) {
    const std::string what = fmt::format("values of {}", name);
    value = fields_.take(fields_.length(what, 1), what);
  }
  void operator()(std::string_view name, CustomPoints& points) {
    points.count = fields_.length(name, CustomPoint::kBytes);
    points.stride = fields_.step(CustomPoint::kBytes, sizeof(std::uint32_t));
    points.big_endian = fields_.big_endian();
    const std::size_t bytes =
        points.count == 0 ? 0 : (points.count - 1) * points.stride + CustomPoint::kBytes;
    points.bytes = fields_.take(bytes, "bytes of points");
  }

 private:
  Fields& fields_;
};

/// Writes the fields of a message one after the other.
class Putting {
 public:
  Putting(Serialisation serialisation, std::vector<std::uint8_t>& bytes)
      : bytes_(bytes), cdr_(serialisation == Serialisation::cdr) {
    bytes_.clear();
    if (cdr_) bytes_ = {0, 1, 0, 0};  // plain CDR, little-endian
  }

  template <class T>
  requires std::is_arithmetic_v<T>
  void operator()(std::string_view, T value) {
    align(sizeof(T));
    bytes_.resize(bytes_.size() + sizeof(T));
    io::store<T>(bytes_.data() + bytes_.size() - sizeof(T), value);
  }
  void operator()(std::string_view name, bool value) {
    (*this)(name, static_cast<std::uint8_t>(value ? 1 : 0));
  }
  void operator()(std::string_view, const std::string& text) {
    length(text.size() + (cdr_ ? 1 : 0));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    if (cdr_) bytes_.push_back(0);
  }
  void operator()(std::string_view name, const Header& header) {
    if (!cdr_) (*this)(name, header.sequence);
    (*this)(name, static_cast<std::uint32_t>(header.seconds));  // of ROS 2 signed, and as wide
    (*this)(name, header.nanoseconds);
    (*this)(name, header.frame);
  }
  template <class T, std::size_t Count>
  void operator()(std::string_view name, const std::array<T, Count>& values) {
    for (const T& value : values) (*this)(name, value);
  }
  template <Described T>
  void operator()(std::string_view, const T& value) {
    T::describe(value, *this);
  }
  template <Described T>
  void operator()(std::string_view, const std::vector<T>& values) {
    length(values.size());
    for (const T& value : values) T::describe(value, *this);
  }
  void operator()(std::string_view, const Bytes& value) {
    length(value.size());
    bytes_.insert(bytes_.end(), value.begin(), value.end());
  }
  void operator()(std::string_view, const CustomPoints& points) {
    length(points.count);
    for (std::size_t i = 0; i < points.count; ++i) {
      if (cdr_) align(sizeof(std::uint32_t));
      const auto point = points.bytes.subspan(i * points.stride, CustomPoint::kBytes);
      bytes_.insert(bytes_.end(), point.begin(), point.end());
    }
  }

 private:
  void length(std::size_t count) { (*this)("", static_cast<std::uint32_t>(count)); }

  /// Numbers of CDR are aligned at multiples of their size, counted from the end of its mark.
  void align(std::size_t size) {
    constexpr std::size_t kMark = 4;
    while (cdr_ && (bytes_.size() - kMark) % size != 0) bytes_.push_back(0);
  }

  std::vector<std::uint8_t>& bytes_;
  bool cdr_;
};

/// Writes the definition of a message as .msg files have it, with those that it needs behind it.
class Defining {
 public:
  Defining(Serialisation serialisation, std::string package)
      : package_(std::move(package)), cdr_(serialisation == Serialisation::cdr) {}

  template <Described Message>
  std::string text_of() {
    add_fields<Message>();
    return text_ + behind_;
  }

  template <class T>
  requires std::is_arithmetic_v<T>
  void operator()(std::string_view name, T&) { add(name, name_of_number<T>()); }
  void operator()(std::string_view name, std::string&) { add(name, "string"); }
  void operator()(std::string_view name, Header&) {
    add(name, "std_msgs/Header");
    if (cdr_) {
      add_behind("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n");
      add_behind("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
    } else {
      add_behind("std_msgs/Header", "uint32 seq\ntime stamp\nstring frame_id\n");
    }
  }
  template <class T, std::size_t Count>
  void operator()(std::string_view name, std::array<T, Count>&) {
    add(name, fmt::format("{}[{}]", name_of_number<T>(), Count));
  }
  template <Described T>
  void operator()(std::string_view name, T&) {
    add_struct<T>(name, "");
  }
  template <Described T>
  void operator()(std::string_view name, std::vector<T>&) {
    add_struct<T>(name, "[]");
  }
  void operator()(std::string_view name, Bytes&) { add(name, "uint8[]"); }
  void operator()(std::string_view name, CustomPoints&) { add_struct<CustomPoint>(name, "[]"); }

 private:
  template <class T>
  static constexpr std::string_view name_of_number() {
    if constexpr (std::same_as<T, bool>) return "bool";
    if constexpr (std::same_as<T, std::uint8_t>) return "uint8";
    if constexpr (std::same_as<T, std::uint32_t>) return "uint32";
    if constexpr (std::same_as<T, std::uint64_t>) return "uint64";
    if constexpr (std::same_as<T, float>) return "float32";
    if constexpr (std::same_as<T, double>) return "float64";
  }

  void add(std::string_view name, std::string_view type) {
    text_ += fmt::format("{} {}\n", type, name);
  }

  template <class T>
  void add_fields() {
    if constexpr (requires { T::kConstants; }) text_ += T::kConstants;
    T value;
    T::describe(value, *this);
  }

  template <class T>
  void add_struct(std::string_view name, std::string_view list) {
    std::string type(T::kType);
    if (type.find('/') == std::string::npos) type = fmt::format("{}/{}", package_, type);
    add(name, type + std::string(list));
    Defining of_it(cdr_ ? Serialisation::cdr : Serialisation::ros1, package_);
    of_it.add_fields<T>();
    add_behind(type, of_it.text_);
  }

  void add_behind(std::string_view type, std::string_view fields) {
    const std::string head = fmt::format("{:=>80}\nMSG: {}\n", "", type);
    if (behind_.find(head) == std::string::npos) behind_ += fmt::format("{}{}", head, fields);
  }

  std::string package_, text_, behind_;
  bool cdr_;
};

template <class Message>
Topic described_topic(std::string name, std::string type, std::string md5,
                      Serialisation serialisation) {
  Topic topic{std::move(name), std::move(type), std::nullopt, serialisation, {}};
  topic.stored.type = topic.type;
  topic.stored.md5 = std::move(md5);
  topic.stored.definition_format = serialisation == Serialisation::ros1 ? "ros1msg" : "ros2msg";
  topic.stored.definition =
      Defining(serialisation, topic.type.substr(0, topic.type.find('/'))).text_of<Message>();
  return topic;
}

const KnownType& known_type(MessageKind kind) {
  return *std::ranges::find(kKnownTypes, kind, &KnownType::kind);
}

}  // namespace

CustomPoint CustomPoints::operator[](std::size_t index) const {
  const std::uint8_t* at = bytes.data() + index * stride;
  return {load_number<std::uint32_t>(at, big_endian),
          load_number<float>(at + 4, big_endian),
          load_number<float>(at + 8, big_endian),
          load_number<float>(at + 12, big_endian),
          at[16],
          at[17],
          at[18]};
}

template <class Message>
void decode(Serialisation serialisation, Bytes bytes, Message& message) {
  const auto take = [&message](auto&& fields) {
    Taking taking(fields);
    Message::describe(message, taking);
    fields.require_end();
  };
  if (serialisation == Serialisation::ros1) {
    take(Ros1Fields(bytes));
  } else {
    take(CdrFields(bytes));
  }
}
template void decode(Serialisation, Bytes, PointCloud2&);
template void decode(Serialisation, Bytes, CustomMessage&);
template void decode(Serialisation, Bytes, ImuMessage&);

template <class Message>
void encode(Serialisation serialisation, const Message& message, std::vector<std::uint8_t>& bytes) {
  Putting putting(serialisation, bytes);
  Message::describe(message, putting);
}
template void encode(Serialisation, const PointCloud2&, std::vector<std::uint8_t>&);
template void encode(Serialisation, const CustomMessage&, std::vector<std::uint8_t>&);
template void encode(Serialisation, const ImuMessage&, std::vector<std::uint8_t>&);

WrittenMessage of_generation(WrittenMessage message, bool second) {
  return message == WrittenMessage::custom_driver && second ? WrittenMessage::custom_driver2
                                                            : message;
}

Topic topic_of(std::string name, WrittenMessage message, Serialisation serialisation) {
  const bool ros1 = serialisation == Serialisation::ros1;
  const auto type_of = [ros1](const KnownType& known) {
    return std::string(ros1 ? known.ros1_name : known.ros2_name);
  };
  const KnownType& cloud = known_type(MessageKind::cloud);
  const KnownType& imu = known_type(MessageKind::imu);
  const std::string md5_of_points(known_type(MessageKind::points).md5);
  switch (message) {
    case WrittenMessage::cloud:
      return described_topic<PointCloud2>(std::move(name), type_of(cloud), std::string(cloud.md5),
                                          serialisation);
    case WrittenMessage::imu:
      return described_topic<ImuMessage>(std::move(name), type_of(imu), std::string(imu.md5),
                                         serialisation);
    case WrittenMessage::custom_driver:
      return described_topic<CustomMessage>(
          std::move(name), ros1 ? "livox_ros_driver/CustomMsg" : "livox_interfaces/msg/CustomMsg",
          md5_of_points, serialisation);
    case WrittenMessage::custom_driver2:
      break;
  }
  return described_topic<CustomMessage>(
      std::move(name), ros1 ? "livox_ros_driver2/CustomMsg" : "livox_ros_driver2/msg/CustomMsg",
      md5_of_points, serialisation);
}

std::size_t count_points(const PointCloud2& cloud) {
  if (cloud.width == 0 || cloud.height == 0) return 0;
  const std::uint64_t row_bytes = std::uint64_t{cloud.width} * cloud.point_step;
  if (cloud.height > 1 && cloud.row_step < row_bytes) {
    throw BadMessage{fmt::format("expected rows of at least {} bytes in the point cloud, found {}",
                                 row_bytes, cloud.row_step)};
  }
  const std::uint64_t rows_before_last = std::uint64_t{cloud.height - 1} * cloud.row_step;
  if (row_bytes > cloud.data.size() || rows_before_last > cloud.data.size() - row_bytes) {
    throw BadMessage{fmt::format("expected {} x {} points of {} bytes, found {} bytes",
                                 cloud.height, cloud.width, cloud.point_step, cloud.data.size())};
  }
  return std::size_t{cloud.height} * cloud.width;
}

PointPlaces point_places(MessageKind kind, Serialisation serialisation, Bytes bytes) {
  PointPlaces places;
  if (kind == MessageKind::points) {
    CustomMessage message;
    decode(serialisation, bytes, message);
    places.count = places.row_points = message.points.count;
    places.first = static_cast<std::size_t>(message.points.bytes.data() - bytes.data());
    places.stride = message.points.stride;
    places.coordinate = {4, 8, 12};
    places.big_endian = message.points.big_endian;
    places.lidar_id = message.lidar_id;
    return places;
  }
  PointCloud2 cloud;
  decode(serialisation, bytes, cloud);
  places.count = count_points(cloud);
  places.first = static_cast<std::size_t>(cloud.data.data() - bytes.data());
  places.stride = cloud.point_step;
  places.row_stride = cloud.row_step;
  places.row_points = cloud.width;
  places.big_endian = cloud.big_endian;
  constexpr std::array<std::string_view, 3> kNames{"x", "y", "z"};
  std::array<std::uint8_t, 3> datatype{};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const auto field = std::ranges::find_if(cloud.fields, [&](const PointFieldEntry& one) {
      return lower_case(one.name) == kNames[i];
    });
    if (field == cloud.fields.end()) {
      throw BadMessage{fmt::format("expected a field {} in the point cloud", kNames[i])};
    }
    places.coordinate[i] = field->offset;
    datatype[i] = field->datatype;
  }
  places.is_double = datatype[0] == kFloat64Field;
  const std::size_t size = places.is_double ? sizeof(double) : sizeof(float);
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if ((datatype[i] != kFloat32Field && datatype[i] != kFloat64Field) ||
        datatype[i] != datatype[0] || places.coordinate[i] + size > places.stride) {
      throw BadMessage{
          fmt::format("expected x, y and z of one floating-point type within the {} bytes of a "
                      "point, found the field {} of datatype {} at byte {}",
                      places.stride, kNames[i], datatype[i], places.coordinate[i])};
    }
  }
  return places;
}

void store_point(const PointPlaces& places, std::size_t point, const std::array<double, 3>& xyz,
                 std::span<std::uint8_t> bytes) {
  std::uint8_t* at = bytes.data() + places.place(point);
  for (std::size_t i = 0; i < xyz.size(); ++i) {
    if (places.is_double) {
      store_number<double>(at + places.coordinate[i], xyz[i], places.big_endian);
    } else {
      store_number<float>(at + places.coordinate[i], static_cast<float>(xyz[i]), places.big_endian);
    }
  }
}

std::array<double, 3> load_point(const PointPlaces& places, std::size_t point, Bytes bytes) {
  const std::uint8_t* at = bytes.data() + places.place(point);
  std::array<double, 3> xyz{};
  for (std::size_t i = 0; i < xyz.size(); ++i) {
    const std::uint8_t* number = at + places.coordinate[i];
    xyz[i] = places.is_double ? load_number<double>(number, places.big_endian)
                              : static_cast<double>(load_number<float>(number, places.big_endian));
  }
  return xyz;
}

}  // namespace risley::bags
