// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Tables that Livox Viewer exports: one point per row, each with the header of its packet. All
// points of a packet have the packet's time, so that a point's own time follows from its place
// among the rows of equal time.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <optional>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/recordings/livox/packet.hpp"

#include "recordings/formats/cartesian.hpp"
#include "recordings/formats/format.hpp"
#include "recordings/formats/text_table.hpp"

namespace risley::recordings {

using namespace livox;

namespace {

using io::store;

constexpr std::string_view kViewerCsv = "livox-viewer-csv";
constexpr std::string_view kViewerHeader =  // without blanks, as returned by normalized_header()
    "Version,SlotID,LiDARIndex,Rsvd,ErrorCode,TimestampType,DataType,Timestamp,X,Y,Z,Reflectivity,"
    "Tag,Ori_x,Ori_y,Ori_z,Ori_radius,Ori_theta,Ori_phi";
constexpr std::size_t kColumnCount = 19;
constexpr std::size_t kViewerRowsLookedAt = 16384;
constexpr std::size_t kMostSensors = 256;  // as Observations::device can number
constexpr std::uint8_t kGpsTimestamp = 3, kPtpTimestamp = 1;

/// One row as it stands.
struct Row {
  int slot = 0, lidar = 0;
  std::uint8_t timestamp_type = 0, data_type = 0, intensity = 0, tag = 0;
  std::int64_t timestamp_ns = 0;
  const RecordLayout* layout = nullptr;
  Vector3<double> point;  ///< m
  double range = 0.0;     ///< m
  int zenith_centideg = 0, azimuth_centideg = 0;
};

void require_status(std::string_view field) {
  const bool prefixed = field.starts_with("0x") || field.starts_with("0X");
  const std::string_view digits = prefixed ? field.substr(2) : std::string_view();
  std::uint32_t status = 0;
  const auto result = std::from_chars(digits.data(), digits.data() + digits.size(), status, 16);
  if (digits.empty() || result.ec != std::errc() || result.ptr != digits.data() + digits.size()) {
    throw BadRow{
        fmt::format("expected a hexadecimal number in column Error Code, found \"{}\"", field)};
  }
}

Row parse(std::span<const std::string_view> fields) {
  constexpr std::int64_t kCoordinate = INT32_MAX;
  Row row;
  integer_field(fields[0], "Version", kPacketVersion, kPacketVersion);
  row.slot = static_cast<int>(integer_field(fields[1], "Slot ID", 0, 255));
  row.lidar = static_cast<int>(integer_field(fields[2], "LiDAR Index", 0, 255));
  require_status(fields[4]);
  row.timestamp_type = static_cast<std::uint8_t>(integer_field(fields[5], "Timestamp Type", 0, 5));
  row.data_type = static_cast<std::uint8_t>(integer_field(fields[6], "Data Type", 0, 8));
  row.layout = record_layout(row.data_type);
  if (row.layout->returns == 0) {
    throw BadRow{fmt::format("expected a data type that holds points, found {}", row.data_type)};
  }
  row.timestamp_ns = integer_field(fields[7], "Timestamp", 0, INT64_MAX / 2);
  row.intensity = static_cast<std::uint8_t>(integer_field(fields[11], "Reflectivity", 0, 255));
  row.tag = static_cast<std::uint8_t>(integer_field(fields[12], "Tag", 0, 255));
  if (row.layout->cartesian) {
    const std::array<std::string_view, 3> names = {"Ori_x", "Ori_y", "Ori_z"};
    std::array<double, 3> coordinates{};
    bool has_integers = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto steps =
          integer_field(fields[13 + axis], names[axis], -kCoordinate - 1, kCoordinate);
      coordinates[axis] = static_cast<double>(steps) * kMillimetre;
      has_integers = has_integers || steps != 0;
    }
    constexpr std::array<std::string_view, 3> kMetres = {"X", "Y", "Z"};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double metres = decimal_field(fields[8 + axis], kMetres[axis]).value;
      if (!has_integers) coordinates[axis] = metres;  // only metres were exported
    }
    row.point = {coordinates[0], coordinates[1], coordinates[2]};
  } else {
    row.range =
        static_cast<double>(integer_field(fields[16], "Ori_radius", 0, UINT32_MAX)) * kMillimetre;
    row.zenith_centideg = static_cast<int>(integer_field(fields[17], "Ori_theta", 0, 18'000));
    row.azimuth_centideg = static_cast<int>(integer_field(fields[18], "Ori_phi", 0, 36'000));
  }
  return row;
}

/// Position of the reader in the packets of one sensor.
struct Sensor {
  int slot = 0, lidar = 0;
  ShotGrid grid = kGrid100kHz;
  PacketClock clock;
  std::int64_t timestamp_ns = -1, packet_time_ns = 0;
  std::size_t rows = 0;  ///< of the current packet, so far
  std::size_t rows_expected = 0;
};

class ViewerCsvReader final : public TextTableReader {
 public:
  explicit ViewerCsvReader(const io::InputFile& file)
      : TextTableReader(file, std::string(kViewerCsv)) {
    if (table_header() != kViewerHeader) refuse_header("of a Livox Viewer table (19 columns)");
    set_column_count(kColumnCount);
    header_.devices.clear();
    learn_sensors();
    if (header_.devices.empty()) header_.devices.resize(1);
  }

 private:
  /// Finds the sensors and, from the time between packets, their type.
  void learn_sensors() {
    struct Seen {
      int slot, lidar;
      std::uint8_t data_type;
      std::int64_t timestamp_ns, shortest_period_ns;
    };
    std::vector<Seen> seen;
    bool first = true;
    look_ahead(kViewerRowsLookedAt, [&](Fields fields) {
      const Row row = parse(fields);
      if (first) {
        header_.time_reference = time_reference_of(row.timestamp_type);
        header_.cartesian = row.layout->cartesian;
        header_.returns_per_shot = row.layout->returns;
        header_.packet_shots = row.layout->records;
        first = false;
      }
      const auto found = std::find_if(seen.begin(), seen.end(), [&](const Seen& s) {
        return s.slot == row.slot && s.lidar == row.lidar;
      });
      if (found == seen.end()) {
        if (seen.size() == kMostSensors)
          return false;  // read() rejects the next one when it gets there
        seen.push_back({row.slot, row.lidar, row.data_type, row.timestamp_ns, INT64_MAX});
      } else if (row.timestamp_ns > found->timestamp_ns) {
        found->shortest_period_ns =
            std::min(found->shortest_period_ns, row.timestamp_ns - found->timestamp_ns);
        found->timestamp_ns = row.timestamp_ns;
      }
      return true;
    });
    for (const auto& s : seen) {
      add_sensor(s.slot, s.lidar, device_type(s.data_type, s.shortest_period_ns), s.data_type);
    }
  }

  static std::uint8_t device_type(std::uint8_t data_type, std::int64_t packet_period_ns) {
    if (data_type < 2) return kMid40;
    if (data_type > kImuDataType) return kAvia;
    const double shot_period_ns =
        static_cast<double>(packet_period_ns) / record_layout(data_type)->records;
    return std::abs(shot_period_ns / 10'000.0 - 1.0) < 0.05 ? kMid70 : kUnknownDeviceType;
  }

  std::size_t add_sensor(int slot, int lidar, std::uint8_t type, std::uint8_t data_type) {
    const std::size_t device = sensors_.size();
    if (device == kMostSensors) {
      throw BadRow{fmt::format("expected at most {} sensors, found more", kMostSensors)};
    }
    Sensor sensor;
    sensor.slot = slot;
    sensor.lidar = lidar;
    // All but the Mid-40 and Mid-70 fire at 240 kHz.
    sensor.grid = shot_grid(type, data_type).value_or(kGrid240kHz);
    sensors_.push_back(sensor);
    Device entry;
    entry.index = static_cast<std::uint8_t>(device);
    entry.type = type;
    entry.type_inferred = true;
    header_.devices.resize(device);
    header_.devices.push_back(entry);
    return device;
  }

  std::size_t device_of(const Row& row) {
    for (std::size_t i = 0; i < sensors_.size(); ++i) {
      if (sensors_[i].slot == row.slot && sensors_[i].lidar == row.lidar) return i;
    }
    const std::uint8_t type = device_type(row.data_type, INT64_MAX);
    return add_sensor(row.slot, row.lidar, type, row.data_type);
  }

  void start_packet(Sensor& sensor, const Row& row, Chunk& chunk) {
    chunk.packet_begins.push_back(chunk.observations.size());
    if (sensor.rows < sensor.rows_expected && !short_packet_reported_) {
      short_packet_reported_ = true;
      warnings_.push_back(
          {kWarning.packets_incomplete,
           fmt::format("the previous packet has {} of {} points; where points are missing in a "
                       "packet, the times of those after them are too early",
                       sensor.rows, sensor.rows_expected),
           {{}, line_number()},
           sensor.rows_expected - sensor.rows});
    }
    Packet packet;
    // The table has nanoseconds even if the packet had a date.
    packet.timestamp_type =
        row.timestamp_type == kGpsTimestamp ? kPtpTimestamp : row.timestamp_type;
    store<std::uint64_t>(packet.timestamp.data(), static_cast<std::uint64_t>(row.timestamp_ns));
    const auto time_ns = sensor.clock.time_ns(packet);
    if (!time_ns) {
      throw BadRow{fmt::format("expected a time in column Timestamp, found {}", row.timestamp_ns)};
    }
    sensor.packet_time_ns = *time_ns;
    sensor.timestamp_ns = row.timestamp_ns;
    sensor.rows = 0;
    sensor.rows_expected = row.layout->rows();
  }

  void append_row(Fields fields, Chunk& chunk) override {
    const Row row = parse(fields);
    const std::size_t device = device_of(row);
    Sensor& sensor = sensors_[device];
    if (row.timestamp_ns != sensor.timestamp_ns || sensor.rows >= sensor.rows_expected) {
      start_packet(sensor, row, chunk);
    }
    const auto shot = static_cast<std::uint32_t>(sensor.rows / row.layout->returns);
    const auto return_number = sensor.rows % row.layout->returns + 1;
    ++sensor.rows;
    auto& rows = chunk.observations;
    const auto i = append_observation(rows, sensor.packet_time_ns + sensor.grid.offset_ns(shot));
    if (row.layout->cartesian) {
      set_cartesian(rows, i, row.point, kMillimetre);
    } else {
      set_spherical(rows, i, azimuth_from_degrees(row.azimuth_centideg / 100.0),
                    std::min(radians_from_degrees(row.zenith_centideg / 100.0), kPi), row.range);
    }
    rows.intensity[i] = row.intensity;
    rows.return_number[i] = static_cast<std::uint8_t>(return_number);
    rows.tag[i] = row.tag;
    rows.beam[i] = static_cast<std::uint8_t>(shot % sensor.grid.beams);
    rows.device[i] = static_cast<std::uint8_t>(device);
  }

  std::vector<Sensor> sensors_;
  bool short_packet_reported_ = false;
};

}  // namespace

const Format kViewerCsvFormat = {
    kViewerCsv,
    "",
    "Livox Viewer table: points with the headers of their packets (read only)",
    [](std::string_view head) { return normalized_header(head) == kViewerHeader; },
    open_with<ViewerCsvReader>,
};

}  // namespace risley::recordings
