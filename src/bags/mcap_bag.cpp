// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// MCAP, version 0, as https://mcap.dev/spec has it: records, some of them within chunks that may be
// packed. They are read from the front, so that a file without an end yields its contents; from the
// summary at the end only topics and counts are used. A chunk is used only if its checksum is
// right.
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <zlib.h>

#include "risley/bags/bag.hpp"
#include "risley/bags/message_fields.hpp"
#include "risley/core/error.hpp"
#include "risley/io/block_file.hpp"
#include "risley/io/little_endian.hpp"

#include "bags/bag_kinds.hpp"
#include "bags/mcap_format.hpp"
#include "bags/unpack.hpp"
#include "bags/untouched_bytes.hpp"

namespace risley::bags {
namespace {

using io::BlockInput;
using io::load;
using Bytes = std::span<const std::uint8_t>;

/// Of a chunk when unpacked, and of a message.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30U;

/// Where a record of the file stands.
struct McapRecord {
  std::uint8_t op = 0;
  std::uint64_t offset = 0, data = 0, end = 0;

  std::uint64_t data_bytes() const { return end - data; }
};

struct Schema {
  std::string name, encoding, definition;
};

struct Channel {
  std::uint16_t schema = 0;
  std::string topic, encoding, md5;
  std::vector<std::pair<std::string, std::string>> details;
  std::size_t index = 0;  ///< of its topic

  bool is_like(const Channel& other) const {
    return schema == other.schema && topic == other.topic && encoding == other.encoding;
  }
};

/// A channel and its number. @throws BadMessage
std::pair<std::uint16_t, Channel> take_channel(Bytes bytes) {
  Ros1Fields fields(bytes);
  const auto id = fields.number<std::uint16_t>("the channel's number");
  Channel channel;
  channel.schema = fields.number<std::uint16_t>("the channel's schema");
  channel.topic = fields.text("characters of the topic");
  channel.encoding = fields.text("characters of the encoding");
  Ros1Fields metadata(
      fields.take(fields.number<std::uint32_t>("the length of the metadata"), "bytes of metadata"));
  while (metadata.left() > 0) {
    const std::string key = metadata.text("characters of a key");
    std::string value = metadata.text("characters of a value");
    if (key == "md5sum") {  // from converted bags of ROS 1
      channel.md5 = std::move(value);
    } else if (key != "topic") {
      channel.details.emplace_back(key, std::move(value));
    }
  }
  return {id, std::move(channel)};
}

/// The topic of a channel of that schema.
Topic topic_of_channel(const Channel& channel, const Schema& schema) {
  const std::string& type = schema.name;
  StoredTopic stored{type, channel.md5, schema.encoding, schema.definition, {}, channel.details};
  if (channel.encoding == "ros1") {
    Topic topic = ros1_topic(channel.topic, type, channel.md5);
    topic.stored = std::move(stored);
    return topic;
  }
  if (channel.encoding != "cdr") stored.encoding = channel.encoding;
  Topic topic{channel.topic, type, ros2_kind(type), Serialisation::cdr, std::move(stored)};
  if (channel.encoding != "cdr" && topic.kind) {
    topic.kind.reset();
    topic.type += fmt::format(", encoded as \"{}\" instead of cdr", channel.encoding);
  }
  return topic;
}

class McapBag final : public Bag {
 public:
  McapBag(const io::InputFile& file, const Progress& progress)
      : Bag(BagKind::mcap, file.path(), progress), file_(file) {
    check_beginning();
    find_end();
    if (!take_summary()) look_for_channels();
    make_topics();
  }

  void rewind(const std::vector<bool>& wanted) override {
    require_topics(wanted);
    begin_pass();
    wanted_ = wanted;
    topic_messages_.assign(topics_.size(), 0);
  }

  bool next(Message& message) override {
    while (true) {
      progress_.check();
      if (chunk_at_ < chunk_bytes_) {
        if (take_from_chunk(message)) return true;
      } else if (ended_) {
        return false;
      } else if (take_from_file(message)) {
        return true;
      }
    }
  }

  double fraction_read() const override {
    return ended_ ? 1.0 : static_cast<double>(offset_) / static_cast<double>(file_.size());
  }

 private:
  [[noreturn]] void fail_at(std::uint64_t offset, const std::string& problem) const {
    throw FileError(path_, {offset, {}}, problem);
  }
  /// @param at  from the beginning of the chunk's records
  [[noreturn]] void fail_in_chunk(std::uint64_t at, const std::string& problem) const {
    if (chunk_is_plain_) fail_at(chunk_data_ + at, problem);
    fail_at(chunk_offset_, fmt::format("{}, at byte {} of the unpacked chunk", problem, at));
  }

  /// Calls a function that parses a record whose bytes begin at an offset of the file.
  template <class Function>
  auto guarded(std::uint64_t offset, Function&& function) const {
    try {
      return function();
    } catch (const BadMessage& bad) {
      fail_at(offset, bad.what());
    }
  }

  /// Bytes of the file, as many as one block can hold.
  Bytes some_bytes(const McapRecord& record) {
    const auto count =
        static_cast<std::size_t>(std::min<std::uint64_t>(record.data_bytes(), kBlock));
    return {count == 0 ? nullptr : file_.at(record.data, count), count};
  }

  /// Copies bytes of the file, or passes them on in pieces.
  template <class Take>
  void for_each_block(std::uint64_t begin, std::uint64_t end, Take&& take) {
    while (begin < end) {
      progress_.check();
      const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(end - begin, kBlock));
      take(file_.at(begin, count), count);
      begin += count;
    }
  }
  void copy_bytes(std::uint64_t begin, std::uint64_t end, std::uint8_t* to) {
    for_each_block(begin, end, [&to](const std::uint8_t* bytes, std::size_t count) {
      to = std::copy_n(bytes, count, to);
    });
  }
  std::uint32_t checksum(std::uint64_t begin, std::uint64_t end) {
    uLong crc = crc32(0, nullptr, 0);
    for_each_block(begin, end, [&crc](const std::uint8_t* bytes, std::size_t count) {
      crc = crc32(crc, bytes, static_cast<uInt>(count));
    });
    return static_cast<std::uint32_t>(crc);
  }

  /// The record at an offset; nothing if it does not end before the limit.
  std::optional<McapRecord> record_at(std::uint64_t offset, std::uint64_t limit) {
    if (limit - offset < kMcapRecordHead) return std::nullopt;
    const std::uint8_t* head = file_.at(offset, kMcapRecordHead);
    McapRecord record{head[0], offset, offset + kMcapRecordHead, 0};
    const auto bytes = load<std::uint64_t>(head + 1);
    if (bytes > limit - record.data) return std::nullopt;
    record.end = record.data + bytes;
    if (record.op == 0) fail_at(offset, "expected a record, found type 0, which does not exist");
    return record;
  }

  void check_beginning() {
    const std::uint64_t magic = kMcapMagic.size();
    if (file_.size() < magic + kMcapRecordHead)
      fail_at(file_.size(), "is cut off before its header");
    const std::string_view found(reinterpret_cast<const char*>(file_.at(0, magic)), magic);
    if (found != kMcapMagic) {
      fail_at(kMcapSignature.size(),
              "expected version 0 of MCAP (89 4D 43 41 50 30 0D 0A), found other bytes");
    }
    const auto header = record_at(magic, file_.size());
    if (!header) fail_at(magic, "is cut off within its header");
    if (header->op != kHeaderOp) {
      fail_at(magic, fmt::format("expected the header (type 1), found type {}", header->op));
    }
    first_ = header->end;
  }

  /// Finds whether the file was closed, and where its data end then.
  void find_end() {
    constexpr std::uint64_t kFooterBytes = 20;
    const std::uint64_t size = file_.size(), magic = kMcapMagic.size();
    data_limit_ = size;
    if (size - first_ < kMcapRecordHead + kFooterBytes + magic) return;
    const std::uint64_t footer = size - magic - kFooterBytes - kMcapRecordHead;
    const std::uint8_t* bytes = file_.at(footer, size - footer);
    const std::string_view end(
        reinterpret_cast<const char*>(bytes) + kMcapRecordHead + kFooterBytes, magic);
    if (bytes[0] != kFooterOp || load<std::uint64_t>(bytes + 1) != kFooterBytes ||
        end != kMcapMagic) {
      return;
    }
    closed_ = true;
    footer_ = data_limit_ = footer;
    summary_ = load<std::uint64_t>(bytes + kMcapRecordHead);
    const auto stated = load<std::uint32_t>(bytes + kMcapRecordHead + 16);
    if (summary_ == 0) return;
    if (summary_ < first_ || summary_ > footer) {
      summary_problem_.emplace(
          path_, FilePlace{footer, {}},
          fmt::format("the footer states that the summary begins at byte {}, allowed {} to {}",
                      summary_, first_, footer));
      summary_ = 0;
      return;
    }
    data_limit_ = summary_;
    if (stated == 0) return;
    const std::uint32_t found = checksum(summary_, footer + kMcapRecordHead + 16);
    if (found == stated) return;
    summary_problem_.emplace(
        path_, FilePlace{summary_, {}},
        fmt::format(
            "the summary that begins here has the checksum {:08X}, but the footer states {:08X}",
            found, stated));
  }

  /// Reads channels and counts from the summary. @return whether it is valid and complete
  bool take_summary() {
    if (!closed_ || summary_ == 0 || summary_problem_) return false;
    std::optional<std::uint32_t> channels;
    try {
      for (std::uint64_t offset = summary_; offset < footer_;) {
        progress_.check();
        const auto record = record_at(offset, footer_);
        if (!record) fail_at(offset, "a record of the summary does not end before the footer");
        if (record->op == kSchemaOp || record->op == kChannelOp) {
          guarded(offset, [&] { take_definition(record->op, some_bytes(*record), true); });
        } else if (record->op == kStatisticsOp) {
          guarded(offset, [&] {
            Ros1Fields fields(some_bytes(*record));
            message_count_ = fields.number<std::uint64_t>("the number of messages");
            fields.number<std::uint16_t>("the number of schemas");
            channels = fields.number<std::uint32_t>("the number of channels");
          });
        }
        offset = record->end;
      }
    } catch (const FileError& error) {
      summary_problem_ = error;
    }
    // Names of schemas may be left out of it.
    const bool complete = std::ranges::all_of(channels_, [this](const auto& one) {
      return one.second.schema == 0 || schemas_.contains(one.second.schema);
    });
    if (!summary_problem_ && complete && channels == channels_.size()) return true;
    channels_.clear();
    schemas_.clear();
    return false;
  }

  /// Reads all records for their channels, up to the first damage, which is reported later on
  /// reading.
  void look_for_channels() {
    looking_ = true;
    begin_pass();
    try {
      Message message;
      while (next(message)) {
      }
    } catch (const FileError&) {
    }
    looking_ = false;
  }

  void begin_pass() {
    offset_ = first_;
    chunk_at_ = chunk_bytes_ = 0;
    messages_ = 0;
    ended_ = data_ended_ = false;
    warnings_.clear();
  }

  /// Several channels may have one topic: one for each sender.
  void make_topics() {
    std::map<std::tuple<std::string, std::string, std::string>, std::vector<Channel*>> known;
    for (auto& [id, channel] : channels_) {
      known[{channel.topic, schema_of(channel).name, channel.encoding}].push_back(&channel);
    }
    for (const auto& [key, channels] : known) {
      for (Channel* channel : channels) channel->index = topics_.size();
      topics_.push_back(topic_of_channel(*channels.front(), schema_of(*channels.front())));
    }
  }

  Schema schema_of(const Channel& channel) const {
    return channel.schema == 0 ? Schema{} : schemas_.at(channel.schema);
  }

  /// Adds a schema or a channel, or compares it with the one of its number.
  /// @param is_new  whether it may be unknown so far
  /// @throws BadMessage
  void take_definition(std::uint8_t op, Bytes bytes, bool is_new) {
    if (op == kSchemaOp) {
      Ros1Fields fields(bytes);
      const auto id = fields.number<std::uint16_t>("the schema's number");
      Schema schema{fields.text("characters of the schema's name"), {}, {}};
      if (id == 0) return;  // which readers should ignore
      const auto known = schemas_.find(id);
      if (known != schemas_.end()) {
        if (known->second.name != schema.name) {
          throw BadMessage{fmt::format("schema {} is {} here and {} elsewhere in the file", id,
                                       schema.name, known->second.name)};
        }
        return;
      }
      if (!is_new) return;  // of no channel
      try {                 // the rest is not needed to read messages
        schema.encoding = fields.text("characters of the schema's encoding");
        schema.definition = fields.text("characters of the schema");
      } catch (const BadMessage&) {
        schema.encoding.clear();
      }
      schemas_.emplace(id, std::move(schema));
      return;
    }
    auto [id, channel] = take_channel(bytes);
    if (looking_ && channel.schema != 0 && !schemas_.contains(channel.schema)) {
      throw BadMessage{fmt::format("channel {} has the schema {}, which no earlier record holds",
                                   id, channel.schema)};
    }
    const auto known = channels_.find(id);
    if (known == channels_.end()) {
      if (!is_new) throw BadMessage{fmt::format("channel {} is not in the summary", id)};
      channels_.emplace(id, std::move(channel));
    } else if (!known->second.is_like(channel)) {
      throw BadMessage{
          fmt::format("channel {} is of topic {} here and of {} elsewhere in the file,"
                      " or of another type",
                      id, channel.topic, known->second.topic)};
    }
  }

  /// The channel of a message if it is wanted. @throws BadMessage for an unknown one
  const Channel* wanted_channel(std::uint16_t id) {
    ++messages_;
    const auto channel = channels_.find(id);
    if (channel == channels_.end()) {
      throw BadMessage{fmt::format("a message of channel {}, which no record describes", id)};
    }
    return !looking_ && wanted_[channel->second.index] ? &channel->second : nullptr;
  }

  /// The times of a message, which stand behind its channel and number.
  static void take_head(const std::uint8_t* head, Message& message) {
    message.time_ns = load<std::uint64_t>(head + 6);
    message.publish_time_ns = load<std::uint64_t>(head + 14);
  }

  bool give(const Channel& channel, Bytes bytes, std::uint64_t byte_offset, Message& message) {
    message.topic = channel.index;
    message.number = ++topic_messages_[channel.index];
    message.bytes = bytes;
    message.byte_offset = byte_offset;
    if (topics_[channel.index].serialisation == Serialisation::cdr) {
      try {
        message.bytes = unpacker_.message(bytes);
      } catch (const BadMessage& bad) {
        fail(message, bad.what());
      }
    }
    return true;
  }

  /// The next record outside of chunks. @return whether it is a wanted message
  bool take_from_file(Message& message) {
    if (offset_ == data_limit_ && closed_) {  // without a record that ends the data
      finish();
      return false;
    }
    const auto record = record_at(offset_, data_limit_);
    if (!record) {
      if (closed_)
        fail_at(offset_, fmt::format("expected a record that ends by byte {}, where the data of "
                                     "the file end, found one that ends later",
                                     data_limit_));
      finish();
      return false;
    }
    offset_ = record->end;
    require_in_place(*record);
    switch (record->op) {
      case kMessageOp:
        return take_message(*record, message);
      case kChunkOp:
        open_chunk(*record);
        break;
      case kSchemaOp:
      case kChannelOp:
        guarded(record->offset,
                [&] { take_definition(record->op, some_bytes(*record), looking_); });
        break;
      case kDataEndOp:
        end_data(*record);
        break;
      case kFooterOp:  // of a file whose last bytes are invalid
        if (file_.size() - record->end >= kMcapMagic.size()) {
          fail_at(record->end,
                  "expected the file to end with 89 4D 43 41 50 30 0D 0A after the footer, found "
                  "other bytes");
        }
        finish();
        break;
      default:
        break;
    }
    return false;
  }

  /// Data come before the record that ends them, the summary follows it.
  void require_in_place(const McapRecord& record) const {
    const bool is_data = record.op == kMessageOp || record.op == kChunkOp ||
                         record.op == kMessageIndexOp || record.op == kAttachmentOp ||
                         record.op == kMetadataOp;
    const bool is_either = record.op == kSchemaOp || record.op == kChannelOp ||
                           record.op == kDataEndOp || record.op > kLastKnownOp ||
                           (record.op == kFooterOp && !closed_);
    if (is_either || is_data != data_ended_) return;
    fail_at(record.offset, fmt::format("a record of type {} comes {} the record that ends the data",
                                       record.op, data_ended_ ? "behind" : "before"));
  }

  bool take_message(const McapRecord& record, Message& message) {
    if (record.data_bytes() < kMcapMessageHead) {
      fail_at(record.offset, fmt::format("expected a message of at least {} bytes, found {}",
                                         kMcapMessageHead, record.data_bytes()));
    }
    take_head(file_.at(record.data, kMcapMessageHead), message);
    const auto id = load<std::uint16_t>(file_.at(record.data, kMcapMessageHead));
    const Channel* channel = guarded(record.offset, [&] { return wanted_channel(id); });
    if (channel == nullptr) return false;
    const std::uint64_t begin = record.data + kMcapMessageHead, bytes = record.end - begin;
    if (bytes > kMostBytes) {
      fail_at(record.offset,
              fmt::format("expected a message of at most {} bytes, found {}", kMostBytes, bytes));
    }
    buffer_.make_room(bytes);
    copy_bytes(begin, record.end, buffer_.data());
    return give(*channel, {buffer_.data(), static_cast<std::size_t>(bytes)}, record.offset,
                message);
  }

  /// Reads and unpacks a chunk, and checks it.
  void open_chunk(const McapRecord& record) {
    constexpr std::size_t kLongestName = 64;
    chunk_at_ = chunk_bytes_ = 0;
    std::uint64_t bytes = 0, packed = 0, begin = 0;
    std::uint32_t stated = 0;
    std::string packing;
    guarded(record.offset, [&] {
      const Bytes head = some_bytes(record);
      Ros1Fields fields(head);
      fields.take(16, "bytes of the chunk's times");
      bytes = fields.number<std::uint64_t>("the chunk's size");
      stated = fields.number<std::uint32_t>("the chunk's checksum");
      packing = fields.text("characters of the chunk's compression");
      packed = fields.number<std::uint64_t>("the length of the chunk's records");
      begin = record.data + (head.size() - fields.left());
    });
    const std::uint64_t most = Unpacker::most_per_byte(packing);
    if (!packing.empty() && most == 0) {
      fail_at(record.offset,
              fmt::format("expected a chunk compressed by lz4, by zstd or not at all, found \"{}\"",
                          packing.substr(0, kLongestName)));
    }
    if (packed > record.end - begin) {
      fail_at(record.offset, fmt::format("the chunk states {} bytes of records, found {}", packed,
                                         record.end - begin));
    }
    if (bytes > kMostBytes || packed > kMostBytes + kMostBytes / 64) {
      fail_at(record.offset,
              fmt::format("expected a chunk of at most {} bytes, found {}, {} when unpacked",
                          kMostBytes, packed, bytes));
    }
    if (packing.empty() ? bytes != packed : bytes > most * packed) {
      fail_at(record.offset,
              fmt::format("the chunk states {} bytes when unpacked, its records have {}{}", bytes,
                          packed, packing.empty() ? "" : " when packed, too few to hold them"));
    }
    chunk_.make_room(bytes);
    if (packing.empty()) {
      copy_bytes(begin, begin + bytes, chunk_.data());
    } else {
      buffer_.make_room(packed);
      copy_bytes(begin, begin + packed, buffer_.data());
      guarded(record.offset, [&] {
        unpacker_.unpack(packing, {buffer_.data(), static_cast<std::size_t>(packed)},
                         {chunk_.data(), static_cast<std::size_t>(bytes)});
      });
    }
    if (stated != 0) {
      const auto found = static_cast<std::uint32_t>(
          crc32(crc32(0, nullptr, 0), chunk_.data(), static_cast<uInt>(bytes)));
      if (found != stated) {
        fail_at(
            record.offset,
            fmt::format("the chunk has the checksum {:08X}, but it states {:08X}", found, stated));
      }
    }
    chunk_offset_ = record.offset;
    chunk_data_ = begin;
    chunk_is_plain_ = packing.empty();
    chunk_bytes_ = bytes;
  }

  /// The next record of the chunk. @return whether it is a wanted message
  bool take_from_chunk(Message& message) {
    const std::uint64_t at = chunk_at_, left = chunk_bytes_ - at;
    const std::uint8_t* record = chunk_.data() + at;
    const std::uint64_t bytes = left < kMcapRecordHead ? left : load<std::uint64_t>(record + 1);
    if (left < kMcapRecordHead || bytes > left - kMcapRecordHead) {
      fail_in_chunk(at, "a record does not fit into its chunk");
    }
    chunk_at_ = at + kMcapRecordHead + bytes;
    const Bytes content{record + kMcapRecordHead, static_cast<std::size_t>(bytes)};
    try {
      switch (record[0]) {
        case kMessageOp: {
          require_room("the head of a message", 1, kMcapMessageHead, content.size());
          const Channel* channel = wanted_channel(load<std::uint16_t>(content.data()));
          take_head(content.data(), message);
          return channel != nullptr &&
                 give(*channel, content.subspan(kMcapMessageHead),
                      chunk_is_plain_ ? chunk_data_ + at : chunk_offset_, message);
        }
        case kSchemaOp:
        case kChannelOp:
          take_definition(record[0], content, looking_);
          return false;
        default:
          if (record[0] > kLastKnownOp) return false;  // of later versions, or private ones
          throw BadMessage{
              fmt::format("expected a schema, a channel or a message in a chunk, "
                          "found a record of type {}",
                          record[0])};
      }
    } catch (const BadMessage& bad) {
      fail_in_chunk(at, bad.what());
    }
  }

  /// The record that ends the data, with the checksum of all before it.
  void end_data(const McapRecord& record) {
    data_ended_ = true;
    if (closed_ && record.end != data_limit_ && (summary_ != 0 || !summary_problem_)) {
      fail_at(record.offset,
              fmt::format(
                  "the record that ends the data is here, but other records follow up to byte {}",
                  data_limit_));
    }
    const Bytes bytes = some_bytes(record);
    const auto stated = guarded(record.offset, [&] {
      return Ros1Fields(bytes).number<std::uint32_t>("the checksum of the data");
    });
    if (stated == 0 || looking_) return;
    const std::uint32_t found = checksum(0, record.offset);
    if (found == stated) return;
    fail_at(
        record.offset,
        fmt::format("the file up to here has the checksum {:08X}, but this record states {:08X}",
                    found, stated));
  }

  /// All readable data are read: reports the defect at the end.
  void finish() {
    ended_ = true;
    if (looking_) return;
    if (closed_) {
      if (summary_problem_) throw FileError(*summary_problem_);
      if (!message_count_ || *message_count_ == messages_) return;
      fail_at(footer_, fmt::format("the file has {} messages, but its summary states {}", messages_,
                                   *message_count_));
    }
    const std::string part =
        data_ended_ ? "all messages were read"
        : offset_ < file_.size()
            ? "the record that begins here is incomplete; everything before it was read"
            : "everything up to here was read";
    warnings_.push_back(
        {kWarning.cut_off,
         fmt::format(
             "the file was not closed or is cut off: it ends at byte {} without a footer; {}",
             file_.size(), part),
         {offset_, {}}});
  }

  static constexpr std::uint64_t kBlock = BlockInput::kBlockBytes;

  BlockInput file_;
  std::uint64_t first_ = 0;       ///< record behind the header
  std::uint64_t data_limit_ = 0;  ///< where the records of data end at the latest
  std::uint64_t summary_ = 0, footer_ = 0;
  bool closed_ = false;
  std::optional<FileError> summary_problem_;
  std::optional<std::uint64_t> message_count_;
  std::map<std::uint16_t, Schema> schemas_;    ///< by number
  std::map<std::uint16_t, Channel> channels_;  ///< by number

  // Of a pass through the file:
  bool looking_ = false;  ///< for channels, and nothing else
  std::vector<bool> wanted_;
  std::vector<std::int64_t> topic_messages_;
  std::uint64_t offset_ = 0, messages_ = 0;
  bool ended_ = false, data_ended_ = false;
  Unpacker unpacker_;
  UntouchedBytes buffer_;  ///< a message outside of chunks, or a packed chunk
  UntouchedBytes chunk_;
  std::uint64_t chunk_bytes_ = 0, chunk_at_ = 0;
  std::uint64_t chunk_offset_ = 0, chunk_data_ = 0;  ///< in the file: the record, its records
  bool chunk_is_plain_ = false;
};

}  // namespace

std::unique_ptr<Bag> open_mcap_bag(const io::InputFile& file, const Progress& progress) {
  return std::make_unique<McapBag>(file, progress);
}

}  // namespace risley::bags
