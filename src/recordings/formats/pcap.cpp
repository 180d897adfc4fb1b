// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Captures of what sensors sent. Packets do not name their sensor: each sender counts as one,
// identified by address and port, and behind a hub by slot and number. Broadcasts and replies in
// the capture name serial number, type and firmware. Packets are put in order, and missing ones are
// counted, as while recording from the network.
//
// Sensors of the second generation are identified only by their address, because points and
// inertial samples come from different ports. Their packets have numbers, by which they are ordered
// and counted. Replies to searches and pushes name serial number, type, firmware and field of view.
#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/io/little_endian.hpp"
#include "risley/recordings/livox/first_packets.hpp"
#include "risley/recordings/livox/numbered_order.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"
#include "risley/recordings/livox/packet_decoder.hpp"
#include "risley/recordings/livox/packet_order.hpp"
#include "risley/wire/commands.hpp"
#include "risley/wire/control_frame.hpp"

#include "recordings/formats/capture_file.hpp"
#include "recordings/formats/format.hpp"

namespace risley::recordings {

using namespace livox;

namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kMostSenders = 255;
constexpr std::int64_t kFramePeriod = 50'000'000;  // ns of the capture's clock
constexpr std::size_t kMostPending = 4096;         // packets of a frame
constexpr std::uint8_t kHub = 0;                   // Broadcast::device_type
constexpr std::uint8_t kDataTypes = 9;

/// The sender of a packet: address, port, and slot and number behind a hub. Of sensors of the
/// second generation the address, and port 0.
using Sender = std::tuple<wire::Address, std::uint16_t, std::uint8_t, std::uint8_t>;

bool is_numbered(Bytes bytes) { return !bytes.empty() && bytes[kVersionAt] == kNumberedVersion; }

Sender sender_of(const CapturedDatagram& datagram) {
  if (is_numbered(datagram.bytes)) return {datagram.from.address, 0, 0, 0};
  return {datagram.from.address, datagram.from.port, datagram.bytes[1], datagram.bytes[2]};
}

/// The layout of a datagram that may be a packet of the second generation, even if its end was not
/// captured.
std::optional<RecordLayout> numbered_layout_of(const CapturedDatagram& datagram) {
  const Bytes bytes = datagram.bytes;
  constexpr std::size_t kLengthFrom = 1, kRecordsFrom = 5, kTypeFrom = 10;
  if (!is_numbered(bytes) || bytes.size() <= kTypeFrom ||
      io::load<std::uint16_t>(&bytes[kLengthFrom]) != datagram.length) {
    return std::nullopt;
  }
  const auto layout =
      numbered_layout(bytes[kTypeFrom], io::load<std::uint16_t>(&bytes[kRecordsFrom]));
  const bool fits = layout && kNumberedHeaderBytes + layout->bytes() <= datagram.length;
  return fits ? layout : std::nullopt;
}

/// The layout of a datagram that may be a packet, even if its end was not captured; empty for
/// others.
std::optional<RecordLayout> layout_of(const CapturedDatagram& datagram) {
  const Bytes bytes = datagram.bytes;
  if (const auto numbered = numbered_layout_of(datagram)) return numbered;
  if (bytes.size() > kVersionAt && bytes[kVersionAt] != kPacketVersion) return std::nullopt;
  for (std::uint8_t type = 0; type < kDataTypes; ++type) {
    const RecordLayout* layout = record_layout(type);
    if (bytes.size() > kDataTypeAt && bytes[kDataTypeAt] != type) continue;
    if (datagram.length == kPacketHeaderBytes + layout->bytes()) return *layout;
  }
  return std::nullopt;
}

/// Rows of a complete packet of the second generation.
std::size_t numbered_rows(Bytes packet) {
  const NumberedHeader header = decode_numbered_header(packet);
  return numbered_layout(header.data_type, header.records)->rows();
}

/// Identity reported by a sensor; several may share one address.
struct Named {
  std::optional<wire::Broadcast> broadcast;
  std::string firmware;
  // Of the second generation.
  std::optional<std::uint8_t> type;
  std::string serial;
  std::array<std::optional<wire::FieldOfView>, 2> views;
  std::uint8_t views_used = 0;  ///< bits 0 and 1
};

/// The identity in a datagram, if it contains one. @tparam Whole wire::Message or wire::Reply
template <class What, class Whole, class Decode>
std::optional<What> said_in(const CapturedDatagram& datagram, const Decode& decode) {
  const auto decoded = wire::decode_frame(datagram.bytes);
  const auto* frame = std::get_if<wire::Frame>(&decoded);
  const bool replies = std::is_same_v<Whole, wire::Reply>;
  if (frame == nullptr || (frame->type == wire::FrameType::reply) != replies) return std::nullopt;
  const auto content = decode(*frame);
  const auto* whole = std::get_if<Whole>(&content);
  const auto* what = whole == nullptr ? nullptr : std::get_if<What>(whole);
  return what == nullptr ? std::nullopt : std::optional(*what);
}

std::optional<wire::Broadcast> broadcast_of(const CapturedDatagram& datagram) {
  return said_in<wire::Broadcast, wire::Message>(datagram, wire::decode_message);
}

/// Reads the identity of a sensor from a frame of the second generation's control protocol.
void take_control_frame(const wire::ControlFrame& frame, Named& named) {
  if (const auto reply = wire::search_reply_of(frame)) {
    named.type = reply->device_type;
    named.serial = reply->serial;
  }
  for (const wire::KeyValue& entry : wire::list_of(frame)) {
    if (entry.key == wire::kSerialKey) {
      named.serial.assign(entry.value.begin(),
                          std::find(entry.value.begin(), entry.value.end(), std::uint8_t{0}));
    } else if (entry.key == wire::kFirmwareKey) {
      named.firmware = wire::version_text(entry.value);
    } else if (entry.key == wire::kViewKey || entry.key == wire::kViewKey + 1) {
      named.views[entry.key - wire::kViewKey] = wire::view_of(entry.value);
    } else if (entry.key == wire::kViewSwitchKey && entry.value.size() == 1) {
      named.views_used = entry.value[0];
    }
  }
}

/// The configured field of view of a sensor, in words; empty if nothing limits it.
std::string view_words(const Named& named) {
  std::string words;
  for (std::size_t i = 0; i < named.views.size(); ++i) {
    if ((named.views_used >> i & 1U) == 0 || !named.views[i]) continue;
    const wire::FieldOfView& view = *named.views[i];
    words += fmt::format("{}azimuth {} to {} deg, elevation {} to {} deg",
                         words.empty() ? "" : "; ", view.yaw_start_deg, view.yaw_stop_deg,
                         view.pitch_start_deg, view.pitch_stop_deg);
  }
  return words;
}

/// Reads captures. The first pass over the file finds its sensors.
class PcapReader final : public Reader {
 public:
  PcapReader(const io::InputFile& file, const Progress& progress);

  bool read(Chunk& chunk, std::size_t max_rows) override;
  double fraction_read() const override { return file_.fraction_read(); }

 private:
  /// A sensor during the first pass.
  struct Seen {
    explicit Seen(Sender whose) : sender(std::move(whose)) {}

    Sender sender;
    bool numbered = false;                             ///< of the second generation
    std::uint64_t interval_sum_ns = 0, intervals = 0;  ///< of its shots
    FirstPackets first;
    PacketDecoder decoder{{.grid = kGrid100kHz}};
    std::size_t rows = 0;
    bool has_points = false;
  };
  /// A sensor while its packets are read.
  struct Live {
    std::uint8_t type;
    bool numbered;
    std::unique_ptr<PacketSequence> order;
    PacketDecoder decoder;
  };
  struct Ready {
    std::size_t device = 0;
    std::uint64_t frame = 0;
    std::vector<std::uint8_t> bytes;
  };

  void look_through(const Progress& progress);
  void look_at_packet(const CapturedDatagram& datagram, Chunk& chunk);
  void add_device(const Seen& seen);
  void add_numbered_device(const Seen& seen);
  void take(const CapturedDatagram& datagram);
  void give_frame();
  void end();
  void say_what_is_missing();
  std::string name_of(std::size_t device) const;

  CaptureFile file_;
  std::map<Sender, std::size_t> devices_;  ///< by sender: row of the header's table
  std::vector<wire::Endpoint> endpoints_;  ///< by device
  std::vector<std::optional<ShotGrid>> grids_;
  std::vector<Live> live_;
  std::deque<Ready> ready_;
  std::size_t pending_ = 0;
  std::uint64_t frames_ = 0, cut_ = 0, cut_rows_ = 0, strangers_ = 0;
  std::optional<std::int64_t> frame_begin_ns_;
  std::int64_t now_ns_ = 0;
  bool ended_ = false;
  std::optional<FileError> failure_;
  // Of the first look.
  std::vector<Seen> seen_;
  std::map<Sender, std::size_t> seen_rows_;
  std::map<wire::Address, Named> named_;
};

PcapReader::PcapReader(const io::InputFile& file, const Progress& progress) : file_(file) {
  header_.format = kPcapFormat.name;
  look_through(progress);
  for (std::size_t row = 0; row < header_.devices.size(); ++row) {
    const std::uint8_t type = header_.devices[row].type;
    const bool numbered = endpoints_[row].port == 0;
    live_.push_back({type, numbered, packet_sequence(type, numbered),
                     PacketDecoder({.device_type = type,
                                    .device = static_cast<std::uint8_t>(row),
                                    .grid = grids_[row]})});
    if (grids_[row]) live_.back().order->set_grid(*grids_[row]);
  }
  seen_.clear();
  seen_rows_.clear();
  cut_ = 0;
  file_ = CaptureFile(file);
}

void PcapReader::look_through(const Progress& progress) {
  Chunk chunk;
  std::optional<FileError> damage;
  try {
    for (std::size_t count = 0; const auto datagram = file_.next(); ++count) {
      constexpr std::size_t kSometimes = 1024;
      if (count % kSometimes == 0) progress.check();
      constexpr std::size_t kMostNames = 4096;
      const bool known = named_.size() < kMostNames || named_.contains(datagram->from.address);
      const auto control = wire::decode_control_frame(datagram->bytes);
      if (layout_of(*datagram)) {
        look_at_packet(*datagram, chunk);
      } else if (const auto* frame = std::get_if<wire::ControlFrame>(&control)) {
        // The sensor's replies and pushes repeat a host's settings.
        if (known && frame->from_sensor) {
          take_control_frame(*frame, named_[datagram->from.address]);
        }
      } else if (const auto broadcast = broadcast_of(*datagram)) {
        if (known) {
          auto& first = named_[datagram->from.address].broadcast;
          if (!first) first = *broadcast;
        }
      } else if (const auto info =
                     said_in<wire::DeviceInfo, wire::Reply>(*datagram, wire::decode_reply);
                 info && named_.contains(datagram->from.address)) {
        named_[datagram->from.address].firmware = wire::firmware_text(info->firmware);
      }
    }
  } catch (const FileError& error) {  // reading meets it again
    damage.emplace(error);
  }
  for (const Seen& seen : seen_) {
    if (seen.has_points) add_device(seen);
  }
  // Inertial samples may come from another port than points.
  for (const Seen& seen : seen_) {
    if (seen.has_points) continue;
    const auto same = std::find_if(devices_.begin(), devices_.end(), [&](const auto& one) {
      return std::get<0>(one.first) == std::get<0>(seen.sender) &&
             std::get<2>(one.first) == std::get<2>(seen.sender) &&
             std::get<3>(one.first) == std::get<3>(seen.sender);
    });
    if (same == devices_.end()) {
      add_device(seen);
    } else {
      devices_.emplace(seen.sender, same->second);
    }
  }
  if (!header_.devices.empty()) return;
  if (damage) throw FileError(*damage);
  throw FileError(file_.path(), {},
                  cut_ > 0
                      ? fmt::format("holds no whole packet of a Livox sensor: {} were cut by the "
                                    "snap length of {} bytes; capture whole packets, as tcpdump "
                                    "-s 0 does",
                                    cut_, file_.snap_length())
                      : std::string("holds no packet of a Livox sensor"));
}

void PcapReader::look_at_packet(const CapturedDatagram& datagram, Chunk& chunk) {
  if (datagram.bytes.size() < datagram.length) {
    ++cut_;
    return;
  }
  const Sender sender = sender_of(datagram);
  const auto found = seen_rows_.find(sender);
  if (found == seen_rows_.end() && seen_.size() == kMostSenders) return;
  constexpr std::size_t kEnoughRows = 20'000;
  if (found != seen_rows_.end() && seen_[found->second].rows >= kEnoughRows) return;
  Seen seen = found == seen_rows_.end() ? Seen(sender) : seen_[found->second];
  seen.numbered = is_numbered(datagram.bytes);
  chunk.clear();
  try {
    if (seen.numbered) {
      decode_numbered_packet(datagram.bytes, kUnknownDeviceType, 0, chunk);
    } else {
      seen.decoder.decode(datagram.bytes, chunk);
    }
  } catch (const BadPacket&) {
    return;
  }
  if (chunk.packets.empty()) return;
  const Packet& packet = chunk.packets.front();
  if (packet.rows > 0) {
    const RecordLayout layout =
        seen.numbered ? *numbered_layout(packet.data_type, 1) : *record_layout(packet.data_type);
    const bool is_first =
        std::none_of(seen_.begin(), seen_.end(), [](const Seen& one) { return one.has_points; });
    if (is_first) {
      header_.time_reference = seen.numbered ? numbered_time_reference(packet.timestamp_type)
                                             : time_reference_of(packet.timestamp_type);
      header_.cartesian = layout.cartesian;
      header_.returns_per_shot = layout.returns;
    }
    if (seen.numbered) {
      const NumberedHeader header = decode_numbered_header(datagram.bytes);
      constexpr std::uint64_t kUnit_ns = 100;
      seen.interval_sum_ns += header.interval * kUnit_ns;
      seen.intervals += header.records - 1U;
    } else {
      seen.first.add(packet, chunk.observations, 0);
    }
    seen.rows += packet.rows;
    seen.has_points = true;
  }
  if (found == seen_rows_.end()) {
    seen_rows_.emplace(sender, seen_.size());
    seen_.push_back(std::move(seen));
  } else {
    seen_[found->second] = std::move(seen);
  }
}

void PcapReader::add_numbered_device(const Seen& seen) {
  const std::size_t row = header_.devices.size();
  const wire::Address address = std::get<0>(seen.sender);
  const auto found = named_.find(address);
  const Named named = found == named_.end() ? Named{} : found->second;
  Device device;
  device.index = static_cast<std::uint8_t>(row);
  device.address = to_string(address);
  device.serial = named.serial;
  device.type = named.type.value_or(kUnknownDeviceType);
  if (!named.type) {
    device.type_inferred = true;
    const double interval_ns = seen.intervals == 0 ? 0.0
                                                   : static_cast<double>(seen.interval_sum_ns) /
                                                         static_cast<double>(seen.intervals);
    for (const std::uint8_t type : {kMid360, kHap}) {
      const ShotGrid grid = *numbered_grid(type);
      constexpr double kNear = 0.05;
      const double usual =
          static_cast<double>(grid.interval_numerator_ns) / grid.interval_denominator;
      if (std::abs(interval_ns / usual - 1.0) < kNear) device.type = type;
    }
  }
  const auto detail = [row](const char* name) { return fmt::format("device_{}_{}", row, name); };
  if (!named.firmware.empty()) header_.set_detail(detail("firmware"), named.firmware);
  if (const std::string view = view_words(named); !view.empty()) {
    header_.set_detail(detail("field_of_view"), view);
  }
  devices_.emplace(seen.sender, row);
  endpoints_.push_back({address, 0});
  grids_.emplace_back();
  if (device.serial.empty()) {
    warn(kWarning.devices_unclear,
         "device {} is {}: nothing in the capture names its serial "
         "number{}",
         row, device.address,
         device.type == kUnknownDeviceType ? std::string(" or its type")
         : named.type                      ? std::string()
                      : fmt::format("; by its packets it is a {}", device_type_name(device.type)));
  }
  header_.devices.push_back(std::move(device));
}

void PcapReader::add_device(const Seen& seen) {
  if (seen.numbered) return add_numbered_device(seen);
  const std::size_t row = header_.devices.size();
  const wire::Address address = std::get<0>(seen.sender);
  const std::uint16_t port = std::get<1>(seen.sender);
  Device device;
  device.index = static_cast<std::uint8_t>(row);
  const auto named = named_.find(address);
  const bool is_named = named != named_.end() && named->second.broadcast.has_value();
  if (is_named && named->second.broadcast->device_type != kHub) {
    device.serial = named->second.broadcast->code;
    device.type = named->second.broadcast->device_type;
  } else {
    if (is_named) device.hub_serial = named->second.broadcast->code;
    device.type = seen.first.device_type();
    device.type_inferred = true;
  }
  std::optional<ShotGrid> grid =
      named == named_.end() ? std::nullopt : grid_of_firmware(named->second.firmware);
  if (!grid) grid = seen.first.grid(device.type);
  if (!grid && !seen.has_points && !shot_grid(device.type, 2)) grid = kGrid240kHz;
  devices_.emplace(seen.sender, row);
  endpoints_.push_back({address, port});
  grids_.push_back(grid);
  if (grid) {
    header_.returns_per_shot = std::max<int>(header_.returns_per_shot, grid->records_per_shot);
  }
  header_.devices.push_back(device);
  if (device.serial.empty()) {
    const std::string type =
        device.type == kUnknownDeviceType
            ? fmt::format("its type is unknown, too: by its packets it measures at {} kHz",
                          grid && grid->beams == 1 ? 100 : 240)
            : fmt::format("by its packets it is a {}", device_type_name(device.type));
    warn(kWarning.devices_unclear, "device {} is {}: no broadcast names its serial number; {}", row,
         to_string(endpoints_[row]), type);
  }
}

std::string PcapReader::name_of(std::size_t device) const {
  const std::string& serial = header_.devices[device].serial;
  if (serial.empty() && live_[device].numbered) return header_.devices[device].address;
  return serial.empty() ? to_string(endpoints_[device]) : serial;
}

void PcapReader::take(const CapturedDatagram& datagram) {
  now_ns_ = datagram.time_ns;
  if (!frame_begin_ns_) frame_begin_ns_ = now_ns_;
  if (now_ns_ - *frame_begin_ns_ >= kFramePeriod || now_ns_ < *frame_begin_ns_ ||
      pending_ >= kMostPending) {
    give_frame();
  }
  if (const auto layout = layout_of(datagram)) {
    if (datagram.bytes.size() < datagram.length) {
      ++cut_;
      cut_rows_ += layout->rows();
      return;
    }
    const auto found = devices_.find(sender_of(datagram));
    if (found == devices_.end()) {
      ++strangers_;
    } else {
      live_[found->second].order->add(datagram.bytes, now_ns_);
      ++pending_;
    }
  } else if (broadcast_of(datagram)) {
    // A sensor that broadcasts has no host: its later packets are another session.
    for (std::size_t row = 0; row < live_.size(); ++row) {
      if (endpoints_[row].address == datagram.from.address) live_[row].order->flush();
    }
  }
}

void PcapReader::give_frame() {
  bool any = false;
  for (std::size_t row = 0; row < live_.size(); ++row) {
    live_[row].order->advance(now_ns_);
    for (auto& packet : live_[row].order->take()) {
      ready_.push_back({row, frames_, std::move(packet)});
      any = true;
    }
  }
  if (any) ++frames_;
  pending_ = 0;
  frame_begin_ns_ = now_ns_;
}

void PcapReader::end() {
  ended_ = true;
  for (Live& live : live_) live.order->flush();
  give_frame();
  say_what_is_missing();
}

void PcapReader::say_what_is_missing() {
  for (std::size_t row = 0; row < live_.size(); ++row) {
    const PacketCounts& counts = live_[row].order->counts();
    if (counts.lost > 0) {
      warn(kWarning.shots_lost, "{}: {} packets are missing between others", name_of(row),
           counts.lost);
    }
    if (counts.duplicates > 0) {
      warn(kWarning.content_left_out,
           "{}: {} packets were captured twice; the second ones were ignored", name_of(row),
           counts.duplicates);
    }
    if (counts.wrong_checksums > 0) {
      warn(kWarning.implausible_values, "{}: {} packets have wrong checksums; they were kept",
           name_of(row), counts.wrong_checksums);
    }
    if (counts.rejected > 0) {
      warn(kWarning.content_left_out, "{}: {} packets that no sensor sends were ignored",
           name_of(row), counts.rejected);
    }
  }
  if (cut_ > 0) {
    warn(kWarning.shots_lost,
         "{} packets were not captured whole, because only {} bytes of each were kept; capture "
         "whole packets, as tcpdump -s 0 does",
         cut_, file_.snap_length())
        .lost_records = cut_rows_;
  }
  if (file_.fragments() > 0) {
    warn(kWarning.content_left_out, "{} fragments of datagrams were ignored; sensors send none",
         file_.fragments());
  }
  if (strangers_ > 0) {
    warn(kWarning.content_left_out,
         "{} packets were ignored: of more than {} senders, or with impossible times", strangers_,
         kMostSenders);
  }
}

bool PcapReader::read(Chunk& chunk, std::size_t max_rows) {
  chunk.clear();
  for (;;) {
    if (ready_.empty()) {
      if (ended_) break;
      try {
        if (const auto datagram = file_.next()) {
          take(*datagram);
        } else {
          end();
        }
      } catch (const FileError& damage) {
        failure_ = damage;
        end();
      }
      continue;
    }
    const Ready& next = ready_.front();
    Live& live = live_[next.device];
    const std::size_t rows =
        live.numbered ? numbered_rows(next.bytes) : record_layout(next.bytes[kDataTypeAt])->rows();
    // Packets stay complete; a single one is delivered however small the chunk should be.
    if (!chunk.packets.empty() &&
        (chunk.observations.size() + rows > max_rows || chunk.packets.size() >= max_rows)) {
      return true;
    }
    PacketDecoder& decoder = live.decoder;
    const std::uint64_t wraps_before = decoder.clock_wraps();
    const std::size_t packets_before = chunk.packets.size();
    try {
      if (live.numbered) {
        decode_numbered_packet(next.bytes, live.type, static_cast<std::uint8_t>(next.device),
                               chunk);
      } else {
        decoder.decode(next.bytes, chunk);
      }
    } catch (const BadPacket&) {  // a clock whose seconds no longer fit 64 bits
      ++strangers_;
      ready_.pop_front();
      continue;
    }
    clock_wraps_ += decoder.clock_wraps() - wraps_before;
    for (std::size_t i = packets_before; i < chunk.packets.size(); ++i) {
      chunk.packets[i].device_index = header_.devices[next.device].index;
      chunk.packets[i].frame = next.frame;
    }
    ready_.pop_front();
  }
  if (!chunk.packets.empty()) return true;
  if (failure_) throw FileError(*failure_);
  return false;
}

}  // namespace

const Format kPcapFormat = {
    "pcap",
    "",
    "network capture, pcap or pcapng: packets of Livox sensors (read only)",
    is_capture,
    [](const io::InputFile& file, const Progress& progress) -> std::unique_ptr<Reader> {
      return std::make_unique<PcapReader>(file, progress);
    },
};

}  // namespace risley::recordings
