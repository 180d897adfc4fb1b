// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/livox_messages.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/vector3.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"
#include "risley/wire/address.hpp"

#include "recordings/formats/cartesian.hpp"
#include "recordings/formats/format.hpp"

namespace risley::recordings {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kYear2000 = 946'684'800 * kSecond;
constexpr std::size_t kMostReturns = 3;
/// Amount of data that describe() reads, of all topics together.
constexpr std::size_t kPointsLookedAt = 1'000'000, kMessagesLookedAt = 4096;
constexpr std::size_t kPointMessagesLookedAt = 24;
constexpr double kStandardGravity = 9.80665;  // m/s^2
/// Longer means of acceleration are m/s^2, shorter ones g: half way between 1 and 9.8 in ratio.
constexpr double kLongestInG = 3.13;

/// The broadcast code at the end of a topic in the driver's multi-topic mode, or nothing: 14
/// capital letters and digits, and the digit of the head.
std::string serial_of(std::string_view topic) {
  constexpr std::size_t kCodeLength = 15;
  const std::size_t underscore = topic.rfind('_');
  if (underscore == topic.npos) return {};
  const std::string_view code = topic.substr(underscore + 1);
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto is_code = [&](char c) { return is_digit(c) || (c >= 'A' && c <= 'Z'); };
  const bool fits = code.size() == kCodeLength && std::all_of(code.begin(), code.end(), is_code) &&
                    code.back() >= '1' && code.back() <= '3' &&
                    std::any_of(code.begin(), code.end() - 1, is_digit);
  return fits ? std::string(code) : std::string();
}

/// The address at the end of a topic of the second generation's driver, or nothing:
/// "/livox/lidar_192_168_1_112".
std::string address_of(std::string_view topic) {
  constexpr int kBytes = 4;
  std::string address;
  for (int i = 0; i < kBytes; ++i) {
    const std::size_t underscore = topic.rfind('_');
    if (underscore == topic.npos) return {};
    const std::string_view part = topic.substr(underscore + 1);
    address = fmt::format("{}{}{}", part, i == 0 ? "" : ".", address);
    topic = topic.substr(0, underscore);
  }
  return wire::address_from(address) ? address : std::string();
}

/// Properties of a sensor in its topic name.
std::string identity_of(std::string_view topic) {
  const std::string serial = serial_of(topic);
  return serial.empty() ? address_of(topic) : serial;
}

/// A coordinate that a driver converted from whole millimetres, m: the exact millimetres, not the
/// nearest 32-bit number.
double of_millimetres(double coordinate) {
  const double exact = std::round(coordinate / kMillimetre) * kMillimetre;
  return static_cast<float>(exact) == static_cast<float>(coordinate) ? exact : coordinate;
}

std::string_view name_space_of(std::string_view topic) {
  return topic.substr(0, topic.rfind('/') == topic.npos ? 0 : topic.rfind('/'));
}

bool is_close(double value, double expected) {
  return std::fabs(value - expected) < 0.05 * expected;
}

/// Whether two points may be returns of one shot: they have the same direction, within the accuracy
/// of whole millimetres.
bool in_one_direction(const MessagePoint& a, const MessagePoint& b) {
  const Vector3<double> one{a.x, a.y, a.z}, other{b.x, b.y, b.z};
  return norm(cross(one, other)) <= 2 * kMillimetre * (norm(one) + norm(other));
}

/// Number of points from `first` on that have its time and line.
std::size_t run_length(const std::vector<MessagePoint>& points, std::size_t first) {
  std::size_t end = first + 1;
  while (end < points.size() && points[end].offset_ns == points[first].offset_ns &&
         points[end].line == points[first].line) {
    ++end;
  }
  return end - first;
}

/// Whether so many points of one time and line are the returns of one shot.
bool is_one_shot(const std::vector<MessagePoint>& points, std::size_t first, std::size_t run) {
  if (run > kMostReturns) return false;
  for (std::size_t i = first + 1; i < first + run; ++i) {
    if (!in_one_direction(points[first], points[i])) return false;
  }
  return true;
}

}  // namespace

MessageReader::MessageReader(std::unique_ptr<bags::Bag> bag, std::string_view format)
    : bag_(std::move(bag)) {
  header_.format = format;
  choose_topics();
  find_lidars();
  choose_imu_topics();
  describe();
}

void MessageReader::rewind() {
  std::vector<bool> wanted;
  for (const auto& device : devices_) wanted.push_back(device.has_value());
  bag_->rewind(wanted);
}

bool MessageReader::next(LidarMessage& message) {
  bags::Message serialised;
  if (!bag_->next(serialised)) return false;
  message.topic = serialised.topic;
  const MessageKind kind = *topics()[serialised.topic].kind;
  try {
    decode_lidar_message(kind, topics()[serialised.topic].serialisation, serialised.bytes, message);
    if (kind == MessageKind::cloud && cloud_times_[message.topic]) set_times(message);
  } catch (const BadMessage& bad) {
    bag_->fail(serialised, bad.what());
  }
  return true;
}

void MessageReader::set_times(LidarMessage& message) const {
  auto point = message.points.begin();
  for_each_time(*cloud_times_[message.topic], message.cloud, message.time_ns,
                [&point](std::int64_t offset_ns) { point++->offset_ns = offset_ns; });
}

void MessageReader::choose_topics() {
  devices_.assign(topics().size(), std::nullopt);
  cloud_times_.assign(topics().size(), std::nullopt);
  unused_times_.assign(topics().size(), {});
  clouds_.assign(topics().size(), {});
  acceleration_units_.assign(topics().size(), 1.0);
  const auto has_kind = [this](MessageKind kind) {
    return std::any_of(topics().begin(), topics().end(),
                       [kind](const bags::Topic& topic) { return topic.kind == kind; });
  };
  // Clouds beside the driver's own messages are the same points again or of another source.
  const MessageKind wanted =
      has_kind(MessageKind::points) ? MessageKind::points : MessageKind::cloud;
  if (!has_kind(wanted)) {
    bag_->fail(
        fmt::format("holds no points of a lidar: expected a topic of type CustomMsg (Livox driver) "
                    "or sensor_msgs PointCloud2, found {}",
                    bags::words_of(topics())));
  }
  header_.devices.clear();
  for (std::size_t i = 0; i < topics().size(); ++i) {
    const bags::Topic& topic = topics()[i];
    if (topic.kind == MessageKind::cloud && wanted == MessageKind::points) {
      warn(kWarning.content_left_out,
           "the point clouds of topic {} were ignored: the Livox driver's own messages have better "
           "times",
           topic.name);
    }
    if (topic.kind != wanted) continue;
    if (header_.devices.size() > UINT8_MAX) {
      bag_->fail("holds more than 256 topics of lidar points, expected at most 256");
    }
    Device device;
    device.serial = serial_of(topic.name);
    device.address = address_of(topic.name);
    device.topic = topic.name;
    device.index = static_cast<std::uint8_t>(header_.devices.size());
    device.type = kUnknownDeviceType;
    devices_[i] = device.index;
    header_.devices.push_back(device);
  }
  lidars_.assign(topics().size(), {});
}

template <class See>
void MessageReader::look_at_first(std::size_t point_sources, const See& see) {
  std::size_t points = 0, messages = 0, point_messages = 0;
  LidarMessage message;
  rewind();
  try {
    while (points < kPointsLookedAt && messages < kMessagesLookedAt &&
           point_messages < kPointMessagesLookedAt * point_sources && next(message)) {
      ++messages;
      if (!see(message)) continue;
      ++point_messages;
      points += message.points.size();
    }
  } catch (const FileError&) {
    // Reported when the caller reaches it, after the undamaged messages.
  }
}

void MessageReader::find_lidars() {
  std::vector<std::set<std::uint8_t>> seen(topics().size());
  look_at_first(header_.devices.size(), [&](const LidarMessage& message) {
    seen[message.topic].insert(message.lidar);
    return true;
  });
  std::vector<Device> devices;
  for (std::size_t i = 0; i < topics().size(); ++i) {
    if (!devices_[i]) continue;
    Device device = header_.devices[*devices_[i]];
    devices_[i] = static_cast<std::uint8_t>(devices.size());
    const std::size_t sharing = std::max<std::size_t>(seen[i].size(), 1);
    if (devices.size() + sharing > UINT8_MAX + std::size_t{1}) {
      bag_->fail("holds the points of more than 256 lidars, expected at most 256");
    }
    if (sharing > 1) {
      lidars_[i].assign(seen[i].begin(), seen[i].end());
      warn(kWarning.devices_unclear,
           "{} lidars share the topic {}: the driver's numbers distinguish them", sharing,
           topics()[i].name);
      device.serial.clear();
      device.address.clear();
    }
    for (std::size_t lidar = 0; lidar < sharing; ++lidar) {
      device.index = static_cast<std::uint8_t>(devices.size());
      devices.push_back(device);
    }
  }
  header_.devices = std::move(devices);
  growth_from_ns_.assign(header_.devices.size(), std::nullopt);
  driver_packets_.assign(header_.devices.size(), {});
}

std::optional<std::uint8_t> MessageReader::device_of(const LidarMessage& message) const {
  const std::vector<std::uint8_t>& lidars = lidars_[message.topic];
  if (lidars.empty()) return devices_[message.topic];
  const auto found = std::find(lidars.begin(), lidars.end(), message.lidar);
  if (found == lidars.end()) return std::nullopt;
  return static_cast<std::uint8_t>(*devices_[message.topic] + (found - lidars.begin()));
}

/// An IMU belongs to the lidar with its serial number or namespace, or to the only lidar if it is
/// itself the only one.
void MessageReader::choose_imu_topics() {
  const auto imu_topics =
      std::count_if(topics().begin(), topics().end(),
                    [](const bags::Topic& topic) { return topic.kind == MessageKind::imu; });
  for (std::size_t i = 0; i < topics().size(); ++i) {
    if (topics()[i].kind != MessageKind::imu) continue;
    const std::string identity = identity_of(topics()[i].name);
    std::vector<std::uint8_t> candidates;
    for (std::size_t lidar = 0; lidar < topics().size(); ++lidar) {
      if (!devices_[lidar] || topics()[lidar].kind == MessageKind::imu) continue;
      const bool same_sensor = identity == identity_of(topics()[lidar].name) &&
                               (!identity.empty() || name_space_of(topics()[lidar].name) ==
                                                         name_space_of(topics()[i].name));
      if (same_sensor && lidars_[lidar].empty()) candidates.push_back(*devices_[lidar]);
    }
    if (candidates.size() == 1) {
      devices_[i] = candidates.front();
    } else if (imu_topics == 1 && header_.devices.size() == 1) {
      devices_[i] = std::uint8_t{0};
    } else {
      warn(kWarning.content_left_out,
           "the inertial samples of topic {} were ignored: nothing states to which lidar they "
           "belong",
           topics()[i].name);
    }
  }
}

/// Findings from the first messages of one topic.
struct MessageReader::FirstMessages {
  std::optional<std::int64_t> last_time_ns;
  std::size_t last_points = 0;
  std::vector<double> rates;      ///< of a cloud: points per second from a message to the next
  std::vector<double> intervals;  ///< between shots, ns
  std::size_t most_returns = 1;
  bool tagged = false;
  std::uint8_t last_line = 0;  ///< the greatest
  std::vector<double> accelerations;
  /// Times, stamps and earliest offsets of messages.
  std::vector<std::int64_t> times_ns, stamps_ns, offsets_ns;

  /// @param drivers  whether it is one of the driver's own messages
  /// @param timed    whether its points have times
  void add(const LidarMessage& message, bool drivers, bool timed) {
    const std::vector<MessagePoint>& points = message.points;
    if (last_time_ns && message.time_ns > *last_time_ns && last_points > 0) {
      rates.push_back(static_cast<double>(last_points) * kSecond /
                      static_cast<double>(message.time_ns - *last_time_ns));
    }
    last_time_ns = message.time_ns;
    last_points = points.size();
    if (drivers && !points.empty()) {
      times_ns.push_back(message.time_ns);
      stamps_ns.push_back(message.stamp_ns);
      offsets_ns.push_back(std::ranges::min(points, {}, &MessagePoint::offset_ns).offset_ns);
    }
    for (std::size_t i = 0; i < points.size();) {
      tagged = tagged || points[i].tag != 0;
      last_line = std::max(last_line, points[i].line);
      const std::size_t run = timed ? run_length(points, i) : 1;
      if (is_one_shot(points, i, run)) most_returns = std::max(most_returns, run);
      if (i + run < points.size() && timed && points[i + run].offset_ns > points[i].offset_ns) {
        intervals.push_back(static_cast<double>(points[i + run].offset_ns - points[i].offset_ns));
      }
      i += run;
    }
  }
};

void MessageReader::find_cloud_times() {
  const auto is_cloud = [this](std::size_t topic) {
    return devices_[topic] && topics()[topic].kind == MessageKind::cloud;
  };
  std::size_t clouds = 0;
  for (std::size_t i = 0; i < topics().size(); ++i) clouds += is_cloud(i) ? 1 : 0;
  if (clouds == 0) return;
  std::vector<CloudTimeSearch> searches(topics().size());
  look_at_first(clouds, [&](const LidarMessage& message) {
    if (!is_cloud(message.topic)) return false;
    searches[message.topic].add(message.cloud, message.time_ns);
    return true;
  });
  for (std::size_t i = 0; i < topics().size(); ++i) {
    if (!is_cloud(i)) continue;
    cloud_times_[i] = searches[i].found();
    if (!cloud_times_[i]) {
      unused_times_[i] = searches[i].problem();
    } else if (constexpr double kCoarse_ns = 100; cloud_times_[i]->step_ns >= kCoarse_ns) {
      warn(kWarning.times_coarse,
           "the times of the points of topic {} are floating-point numbers in steps of {:.0f} ns "
           "(field {})",
           topics()[i].name, cloud_times_[i]->step_ns, cloud_times_[i]->field);
    }
  }
}

void MessageReader::describe() {
  header_.cartesian = true;
  header_.has_intensity = false;
  find_cloud_times();
  std::vector<FirstMessages> first(topics().size()), lidars(header_.devices.size());
  std::optional<std::int64_t> first_time_ns;
  look_at_first(header_.devices.size(), [&](const LidarMessage& message) {
    if (topics()[message.topic].kind == MessageKind::imu) {
      const auto& a = message.acceleration;
      first[message.topic].accelerations.push_back(std::hypot(a[0], a[1], a[2]));
      return false;
    }
    const auto device = device_of(message);
    if (!device) return false;
    header_.has_intensity = header_.has_intensity || message.has_intensity;
    if (!first_time_ns) first_time_ns = message.time_ns;
    lidars[*device].add(message, topics()[message.topic].kind == MessageKind::points,
                        has_times(message.topic));
    return true;
  });
  if (!first_time_ns) header_.has_intensity = true;
  if (first_time_ns) {
    header_.time_reference =
        *first_time_ns >= kYear2000 ? TimeReference::utc : TimeReference::power_on;
  }
  for (std::size_t i = 0; i < topics().size(); ++i) {
    if (!devices_[i]) continue;
    if (topics()[i].kind == MessageKind::cloud && !has_times(i)) {
      settle_cloud_grid(i, lidars[*devices_[i]]);
    }
    if (topics()[i].kind != MessageKind::imu) {
      const std::size_t sharing = std::max<std::size_t>(lidars_[i].size(), 1);
      for (std::size_t lidar = 0; lidar < sharing; ++lidar) {
        const auto device = static_cast<std::uint8_t>(*devices_[i] + lidar);
        describe_device(i, device, lidars[device]);
        compare_clocks(device, lidars[device]);
      }
    } else if (!first[i].accelerations.empty() && median(first[i].accelerations) > kLongestInG) {
      acceleration_units_[i] = 1.0 / kStandardGravity;
      warn(kWarning.unit_guessed,
           "judging by their size, the accelerations of topic {} are in m/s^2; they were divided "
           "by {} m/s^2",
           topics()[i].name, kStandardGravity);
    }
  }
  rewind();
}

/// Determines the model if only one remains: only the Avia has three returns; 100 kHz have only the
/// Mid-40, which has no tags, and the Mid-70, which has.
void MessageReader::describe_device(std::size_t topic, std::uint8_t number, FirstMessages& first) {
  const bool is_cloud = !has_times(topic);
  const int returns = is_cloud ? clouds_[topic].returns : static_cast<int>(first.most_returns);
  header_.returns_per_shot = std::max(header_.returns_per_shot, returns);
  Device& device = header_.devices[number];
  device.type_inferred = true;
  if (returns == 3) {
    device.type = kAvia;
  } else if (!is_cloud && !first.intervals.empty() && is_close(median(first.intervals), 1e4) &&
             first.last_line == 0) {
    // Drivers and tools without tag support write 0, too.
    device.type = first.tagged || returns > 1 ? kMid70 : kMid40;
  }
  describe_numbered_device(topic, number, first);
}

/// The second generation, recognised by the steps between its shots, which the driver writes too
/// short.
void MessageReader::describe_numbered_device(std::size_t topic, std::uint8_t number,
                                             const FirstMessages& first) {
  if (!has_times(topic)) {
    const livox::ShotGrid& grid = clouds_[topic].grid;
    for (const std::uint8_t type : {kMid360, kHap}) {
      const livox::ShotGrid known = *livox::numbered_grid(type);
      if (grid.beams == known.beams && grid.interval_numerator_ns == known.interval_numerator_ns) {
        header_.devices[number].type = type;
      }
    }
    return;
  }
  if (first.intervals.empty()) return;
  // Within packets; floating-point times of clouds have coarse steps, whose mean is right.
  std::vector<double> steps = first.intervals;
  const double usual = median(steps);
  double sum = 0, count = 0;
  for (const double one : steps) {
    if (std::fabs(one - usual) > 0.5 * usual) continue;
    sum += one;
    ++count;
  }
  const double step = sum / count;
  const auto& cloud = cloud_times_[topic];
  const std::int64_t tolerance = cloud ? static_cast<std::int64_t>(std::ceil(cloud->step_ns)) : 0;
  constexpr std::int64_t kStepOfMid360 = 4947, kStepOfHap = 2189;  // ns, as the driver writes them
  for (const auto& [type, written] :
       {std::pair(kMid360, kStepOfMid360), std::pair(kHap, kStepOfHap)}) {
    const livox::ShotGrid grid = *livox::numbered_grid(type);
    constexpr double kSame = 4;  // ns
    const bool as_fired = std::fabs(step - static_cast<double>(grid.offset_ns(1))) <= kSame;
    const bool as_written = std::fabs(step - static_cast<double>(written)) <= kSame;
    if ((!as_fired && !as_written) || first.last_line >= grid.beams) continue;
    const bool names_lines = first.last_line > 0;
    header_.devices[number].type = type;
    if (as_written) {
      driver_packets_[number] = {written, tolerance, grid, names_lines};
      warn(kWarning.times_corrected,
           "the driver of topic {} divides the time of a packet by one point too many: its points "
           "were put back to when a {} fires them, every {:.6g} us{}",
           topics()[topic].name, device_type_name(type),
           1e-3 * grid.interval_numerator_ns / grid.interval_denominator,
           names_lines ? "" : "; it names no lines, so the order of points gives the emitter");
    }
  }
}

void MessageReader::mend_packets(std::uint8_t device, LidarMessage& message) const {
  constexpr std::int64_t kPoints = 96;   // of a packet
  constexpr std::int64_t kJitter = 100;  // ns, of packets
  const DriverPackets& packets = driver_packets_[device];
  if (packets.step_ns == 0) return;
  const std::int64_t period = packets.grid.offset_ns(kPoints);
  const std::int64_t tolerance = 2 * packets.tolerance_ns;
  std::int64_t begin_ns = 0;  // of the packet, after the message's time
  for (MessagePoint& point : message.points) {
    const auto place_after = [&](std::int64_t since, std::int64_t off) {
      const std::int64_t place = (since + packets.step_ns / 2) / packets.step_ns;
      const bool fits = since >= -off && place < kPoints &&
                        std::abs(since - place * packets.step_ns) <= off &&
                        (!packets.names_lines || place % packets.grid.beams == point.line);
      return fits ? std::optional(place) : std::nullopt;
    };
    const std::int64_t since = point.offset_ns - begin_ns;
    std::optional<std::int64_t> place = place_after(since, tolerance);
    if (!place) {
      // Another packet. If its first points are missing, the previous one gives its start.
      const std::int64_t later = since > 0 ? (since + kJitter + tolerance) / period * period : 0;
      place = later > 0 ? place_after(since - later, kJitter + tolerance) : std::nullopt;
      if (!place) place = packets.names_lines ? point.line : 0;
      begin_ns = point.offset_ns - *place * packets.step_ns;
    }
    point.offset_ns = begin_ns + packets.grid.offset_ns(static_cast<std::uint32_t>(*place));
    if (!packets.names_lines) point.line = static_cast<std::uint8_t>(*place % packets.grid.beams);
  }
}

void MessageReader::compare_clocks(std::uint8_t device, const FirstMessages& first) {
  const std::size_t messages = first.times_ns.size();
  if (messages == 0) return;
  if (first.times_ns.front() < kYear2000 && first.stamps_ns.front() >= kYear2000) {
    std::vector<double> later;
    for (std::size_t i = 0; i < messages; ++i) {
      later.push_back(static_cast<double>(first.stamps_ns[i] - first.times_ns[i] -
                                          first.stamps_ns[0] + first.times_ns[0]));
    }
    header_.stamps_after_times_ns =
        first.stamps_ns[0] - first.times_ns[0] + std::llround(median(later));
  }
  // Whether offsets grow by as much as the times do.
  bool grow = messages > 1;
  for (std::size_t i = 1; i < messages; ++i) {
    const std::int64_t passed = first.times_ns[i] - first.times_ns[0],
                       grown = first.offsets_ns[i] - first.offsets_ns[0];
    constexpr std::int64_t kMostApart = 2'000'000;  // ns; no message is shorter
    grow = grow && passed > kMostApart && std::abs(grown - passed) < kMostApart;
  }
  if (!grow) return;
  growth_from_ns_[device] = first.times_ns[0];
  warn(kWarning.times_corrected,
       "times are wrong: the offset times of topic {} do not restart with each message but grow as "
       "the time of the messages does; they were taken as counted from the first message",
       header_.devices[device].topic);
}

/// Finds the shots per second and the returns per shot of a cloud topic from its points per
/// second.
void MessageReader::settle_cloud_grid(std::size_t topic, FirstMessages& first) {
  struct Candidate {
    double rate_hz;  ///< points per second
    livox::ShotGrid grid;
    int returns;
  };
  static constexpr std::array<Candidate, 5> kFirstGeneration{{
      {100'000, livox::kGrid100kHz, 1},
      {200'000, livox::kGrid100kHz, 2},
      {240'000, livox::kGrid240kHz, 1},
      {480'000, livox::kGrid240kHz, 2},
      {720'000, livox::kGrid240kHz, 3},
  }};
  static const std::array<Candidate, 2> kSecondGeneration{{
      {200'000, *livox::numbered_grid(kMid360), 1},
      {452'000, *livox::numbered_grid(kHap), 1},
  }};
  const bool is_known = !first.rates.empty();
  const double rate = is_known ? median(first.rates) : first.last_line > 0 ? 240'000 : 100'000;
  // Lines of a cloud show the number of emitters; 240 kHz implies six of them, too.
  const auto is_second = [&](const Candidate& candidate) {
    return first.last_line + 1 == candidate.grid.beams && is_close(rate, candidate.rate_hz);
  };
  const auto second = std::find_if(kSecondGeneration.begin(), kSecondGeneration.end(), is_second);
  const auto distance = [rate](const Candidate& c) {
    return std::fabs(std::log(rate / c.rate_hz));
  };
  const Candidate& best = second != kSecondGeneration.end()
                              ? *second
                              : *std::min_element(kFirstGeneration.begin(), kFirstGeneration.end(),
                                                  [&](const auto& a, const auto& b) {
                                                    return distance(a) < distance(b);
                                                  });
  clouds_[topic] = {best.grid, best.returns};
  std::string message = fmt::format(
      "the points of topic {} have no times of their own: they were counted from the time of their "
      "message, at {:.5g} us per shot, with {} per shot",
      topics()[topic].name, 1e-3 * best.grid.interval_numerator_ns / best.grid.interval_denominator,
      best.returns == 1 ? "one point" : fmt::format("{} points", best.returns));
  if (!unused_times_[topic].empty()) message += fmt::format(" ({})", unused_times_[topic]);
  if (!is_known) {
    message += "; there are too few messages to check that";
  } else if (!is_close(rate, best.rate_hz)) {
    message += fmt::format(
        "; but {:.0f} points per second fit no known sensor: points may be missing, and those "
        "after them have wrong times",
        rate);
  }
  warnings_.push_back({kWarning.no_shot_times, std::move(message)});
}

bool MessageReader::read(Chunk& chunk, std::size_t max_rows) {
  chunk.clear();
  max_rows = std::max<std::size_t>(max_rows, 1);
  while (!failure_ && chunk.observations.size() + chunk.imu.size() < max_rows) {
    try {
      if (!next(message_)) {
        take_bag_warnings();
        break;
      }
    } catch (const FileError& error) {
      failure_.emplace(error);
      break;
    }
    append(message_, chunk);
  }
  if (chunk.observations.size() > 0 || !chunk.imu.empty()) return true;
  if (failure_) throw FileError(*failure_);
  return false;
}

void MessageReader::take_bag_warnings() {
  if (std::exchange(ended_, true)) return;
  risley::append(warnings_, bag_->warnings());
  if (unknown_lidar_points_ == 0) return;
  warn(kWarning.content_left_out,
       "points of lidars that are not among the first messages of their topic were ignored")
      .lost_records = unknown_lidar_points_;
}

void MessageReader::append(LidarMessage& message, Chunk& chunk) {
  const auto known = device_of(message);
  if (!known) {
    unknown_lidar_points_ += message.points.size();
    return;
  }
  const std::uint8_t device = *known;
  if (has_times(message.topic)) mend_packets(device, message);
  switch (*topics()[message.topic].kind) {
    case MessageKind::points:
      append_points(message, device, chunk.observations);
      break;
    case MessageKind::cloud:
      if (has_times(message.topic)) {
        append_points(message, device, chunk.observations);
      } else {
        append_cloud(message, device, chunk.observations);
      }
      break;
    default:
      append_imu(message, device, chunk.imu);
      break;
  }
}

namespace {

void set_row(Observations& rows, std::size_t row, const MessagePoint& point, std::int64_t time_ns,
             std::size_t return_number, std::uint8_t device) {
  rows.time_ns[row] = time_ns;
  rows.intensity[row] = point.intensity;
  rows.return_number[row] = static_cast<std::uint8_t>(return_number);
  rows.tag[row] = point.tag;
  rows.beam[row] = point.line;
  rows.device[row] = device;
}

/// Directions and ranges of a message's points, in rows from a given one on.
void set_points(Observations& rows, std::size_t first_row, const std::vector<MessagePoint>& points,
                bool whole_millimetres) {
  constexpr std::size_t kBlock = 256;
  double x[kBlock], y[kBlock], z[kBlock];
  for (std::size_t begin = 0; begin < points.size(); begin += kBlock) {
    const std::size_t count = std::min(kBlock, points.size() - begin);
    for (std::size_t i = 0; i < count; ++i) {
      const MessagePoint& point = points[begin + i];
      x[i] = whole_millimetres ? of_millimetres(point.x) : point.x;
      y[i] = whole_millimetres ? of_millimetres(point.y) : point.y;
      z[i] = whole_millimetres ? of_millimetres(point.z) : point.z;
    }
    set_cartesian(rows, first_row + begin, count, x, y, z, kMillimetre);
  }
}

}  // namespace

void MessageReader::append_points(const LidarMessage& message, std::uint8_t device,
                                  Observations& rows) {
  const std::vector<MessagePoint>& points = message.points;
  std::size_t row = rows.size();
  rows.resize(row + points.size());
  set_points(rows, row, points, is_second_generation(header_.devices[device].type));
  // Growing offsets are 32-bit numbers and wrap after 4.3 s.
  const std::int64_t grown =
      growth_from_ns_[device] ? message.time_ns - *growth_from_ns_[device] : 0;
  const auto time_of = [&](const MessagePoint& point) {
    if (grown == 0) return message.time_ns + point.offset_ns;
    return message.time_ns + std::int64_t{static_cast<std::int32_t>(
                                 static_cast<std::uint32_t>(point.offset_ns - grown))};
  };
  for (std::size_t first = 0; first < points.size();) {
    const std::size_t run = run_length(points, first);
    const bool is_shot = is_one_shot(points, first, run);
    if (run > kMostReturns && !equal_times_reported_) {
      equal_times_reported_ = true;
      warn(kWarning.times_coarse,
           "{} points of topic {} have the same time; where more than {} do, each is taken as a "
           "separate shot",
           run, topics()[message.topic].name, kMostReturns);
    }
    for (std::size_t i = 0; i < run; ++i, ++row) {
      const MessagePoint& point = points[first + i];
      set_row(rows, row, point, time_of(point), is_shot ? i + 1 : 1, device);
    }
    first += run;
  }
}

void MessageReader::append_cloud(const LidarMessage& message, std::uint8_t device,
                                 Observations& rows) const {
  const CloudGrid& cloud = clouds_[message.topic];
  const auto returns = static_cast<std::size_t>(cloud.returns);
  const std::size_t first_row = rows.size();
  rows.resize(first_row + message.points.size());
  set_points(rows, first_row, message.points, is_second_generation(header_.devices[device].type));
  for (std::size_t i = 0; i < message.points.size(); ++i) {
    const std::int64_t offset_ns = cloud.grid.offset_ns(static_cast<std::uint32_t>(i / returns));
    set_row(rows, first_row + i, message.points[i], message.time_ns + offset_ns, i % returns + 1,
            device);
  }
}

void MessageReader::append_imu(const LidarMessage& message, std::uint8_t device,
                               std::vector<ImuSample>& samples) {
  ImuSample sample;
  sample.time_ns = message.time_ns;
  sample.device = device;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sample.angular_velocity[axis] = static_cast<float>(message.angular_velocity[axis]);
    sample.acceleration_g[axis] =
        static_cast<float>(message.acceleration[axis] * acceleration_units_[message.topic]);
    if (std::isfinite(sample.angular_velocity[axis] + sample.acceleration_g[axis])) continue;
    if (!std::exchange(imu_without_numbers_reported_, true)) {
      warn(kWarning.content_left_out,
           "inertial samples of topic {} with non-finite rates or accelerations were ignored",
           topics()[message.topic].name);
    }
    return;
  }
  samples.push_back(sample);
}

}  // namespace risley::recordings
