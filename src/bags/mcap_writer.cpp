// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// MCAP, version 0: messages in chunks that are not packed, each with its checksum and with an index
// behind it, and a summary that finds all of them. A topic is described before its first message
// and again in the summary.
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <zlib.h>

#include "risley/bags/bag_writer.hpp"
#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/io/output_file.hpp"

#include "bags/bag_kinds.hpp"
#include "bags/mcap_format.hpp"

namespace risley::bags {
namespace {

constexpr std::size_t kChunkBytes = std::size_t{1} << 20;  ///< after which a chunk is written

/// Bytes that grow at their end.
class Record {
 public:
  template <class T>
  Record& put(std::type_identity_t<T> value) {
    bytes_.resize(bytes_.size() + sizeof(T));
    io::store<T>(bytes_.data() + bytes_.size() - sizeof(T), value);
    return *this;
  }
  Record& text(std::string_view value) {
    put<std::uint32_t>(static_cast<std::uint32_t>(value.size()));
    return raw({reinterpret_cast<const std::uint8_t*>(value.data()), value.size()});
  }
  Record& raw(std::span<const std::uint8_t> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  /// Appends a complete record of that type.
  Record& record(McapOp op, const Record& content) {
    return put<std::uint8_t>(op).put<std::uint64_t>(content.size()).raw(content.bytes_);
  }
  std::span<const std::uint8_t> bytes() const { return bytes_; }
  std::size_t size() const { return bytes_.size(); }
  void clear() { bytes_.clear(); }

 private:
  std::vector<std::uint8_t> bytes_;
};

std::uint32_t checksum(std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint32_t>(
      crc32(crc32(0, nullptr, 0), bytes.data(), static_cast<uInt>(bytes.size())));
}

class McapWriter final : public BagWriter {
 public:
  explicit McapWriter(const std::string& path)
      : output_(path), stream_(output_.temporary_path(), std::ios::binary) {
    append({reinterpret_cast<const std::uint8_t*>(kMcapMagic.data()), kMcapMagic.size()});
  }

  std::size_t add(const Topic& topic) override {
    if (topics_.size() == std::numeric_limits<std::uint16_t>::max()) {
      throw InvalidArgument(fmt::format("{}: {} topics, allowed in MCAP up to {}", output_.path(),
                                        topics_.size() + 1, topics_.size()));
    }
    topics_.push_back({topic, schema_of(topic), 0});
    return topics_.size() - 1;
  }

  void write(std::size_t topic, const Message& message) override {
    if (!begun_) begin();
    TopicState& state = topics_[topic];
    if (state.messages == 0) {
      if (state.schema != 0 && !schemas_[state.schema - 1].written) {
        schemas_[state.schema - 1].written = true;
        chunk_.record(kSchemaOp, schemas_[state.schema - 1].content);
      }
      chunk_.record(kChannelOp, channel(topic));
    }
    indices_[channel_id(topic)].emplace_back(message.time_ns, chunk_.size());
    chunk_.put<std::uint8_t>(kMessageOp)
        .put<std::uint64_t>(kMcapMessageHead + message.bytes.size())
        .put<std::uint16_t>(channel_id(topic))
        .put<std::uint32_t>(static_cast<std::uint32_t>(state.messages))
        .put<std::uint64_t>(message.time_ns)
        .put<std::uint64_t>(message.publish_time_ns)
        .raw(message.bytes);
    ++state.messages;
    chunk_times_.add(message.time_ns);
    times_.add(message.time_ns);
    if (chunk_.size() >= kChunkBytes) end_chunk();
  }

  void close() override {
    if (!begun_) begin();
    end_chunk();
    Record end;
    end.record(kDataEndOp, Record().put<std::uint32_t>(0));  // no checksum of all data
    append(end.bytes());
    append(summary().bytes());
    append({reinterpret_cast<const std::uint8_t*>(kMcapMagic.data()), kMcapMagic.size()});
    stream_.close();
    check();
    output_.commit();
  }

 private:
  struct Times {
    std::uint64_t first = 0, last = 0, count = 0;

    void add(std::uint64_t time) {
      first = count == 0 ? time : std::min(first, time);
      last = std::max(last, time);
      ++count;
    }
  };
  struct Schema {
    std::string name, encoding, definition;
    Record content;
    bool written = false;
  };
  struct TopicState {
    Topic topic;
    std::uint16_t schema = 0;  ///< number, from 1; 0: none
    std::uint64_t messages = 0;
  };
  /// A chunk as the summary finds it.
  struct ChunkPlace {
    std::uint64_t offset = 0, bytes = 0, index_bytes = 0, records = 0;
    Times times;
    std::vector<std::pair<std::uint16_t, std::uint64_t>> indices;  ///< by channel: offset
  };

  static std::uint16_t channel_id(std::size_t topic) { return static_cast<std::uint16_t>(topic); }

  /// The number of a topic's schema, which topics of one type share.
  std::uint16_t schema_of(const Topic& topic) {
    const StoredTopic& stored = topic.stored;
    if (stored.type.empty()) return 0;
    const auto found = std::ranges::find_if(schemas_, [&stored](const Schema& schema) {
      return schema.name == stored.type && schema.encoding == stored.definition_format &&
             schema.definition == stored.definition;
    });
    if (found != schemas_.end()) {
      return static_cast<std::uint16_t>(found - schemas_.begin() + 1);
    }
    Schema& schema = schemas_.emplace_back();
    schema.name = stored.type;
    schema.encoding = stored.definition_format;
    schema.definition = stored.definition;
    const auto id = static_cast<std::uint16_t>(schemas_.size());
    schema.content.put<std::uint16_t>(id)
        .text(schema.name)
        .text(schema.encoding)
        .text(schema.definition);
    return id;
  }

  Record channel(std::size_t topic) const {
    const TopicState& state = topics_[topic];
    const bool ros1 = state.topic.serialisation == Serialisation::ros1;
    const StoredTopic& stored = state.topic.stored;
    Record details;
    if (!stored.md5.empty() && ros1) details.text("md5sum").text(stored.md5);
    for (const auto& [name, value] : stored.details) details.text(name).text(value);
    Record content;
    content.put<std::uint16_t>(channel_id(topic))
        .put<std::uint16_t>(state.schema)
        .text(state.topic.name)
        .text(!stored.encoding.empty() ? stored.encoding
              : ros1                   ? "ros1"
                                       : "cdr")
        .put<std::uint32_t>(static_cast<std::uint32_t>(details.size()))
        .raw(details.bytes());
    return content;
  }

  /// The header is delayed until the first topics, which determine its profile.
  void begin() {
    begun_ = true;
    const bool ros1 = !topics_.empty() && std::ranges::all_of(topics_, [](const TopicState& one) {
      return one.topic.serialisation == Serialisation::ros1;
    });
    Record header;
    header.record(kHeaderOp, Record().text(ros1 ? "ros1" : "ros2").text("risley"));
    append(header.bytes());
  }

  void end_chunk() {
    if (chunk_.size() == 0) return;
    ChunkPlace place;
    place.offset = offset_;
    place.records = chunk_.size();
    place.times = chunk_times_;
    Record head;
    head.put<std::uint64_t>(chunk_times_.first)
        .put<std::uint64_t>(chunk_times_.last)
        .put<std::uint64_t>(chunk_.size())
        .put<std::uint32_t>(checksum(chunk_.bytes()))
        .text("")  // not packed
        .put<std::uint64_t>(chunk_.size());
    Record front;
    front.put<std::uint8_t>(kChunkOp).put<std::uint64_t>(head.size() + chunk_.size());
    append(front.bytes());
    append(head.bytes());
    append(chunk_.bytes());
    place.bytes = offset_ - place.offset;
    for (auto& [id, entries] : indices_) {
      Record content;
      content.put<std::uint16_t>(id).put<std::uint32_t>(
          static_cast<std::uint32_t>(entries.size() * 2 * sizeof(std::uint64_t)));
      for (const auto& [time, at] : entries) {
        content.put<std::uint64_t>(time).put<std::uint64_t>(at);
      }
      place.indices.emplace_back(id, offset_);
      Record index;
      append(index.record(kMessageIndexOp, content).bytes());
    }
    place.index_bytes = offset_ - place.offset - place.bytes;
    chunks_.push_back(std::move(place));
    chunk_.clear();
    chunk_times_ = {};
    indices_.clear();
  }

  static Record index_of(const ChunkPlace& place) {
    Record offsets;
    for (const auto& [id, offset] : place.indices) {
      offsets.put<std::uint16_t>(id).put<std::uint64_t>(offset);
    }
    Record content;
    content.put<std::uint64_t>(place.times.first)
        .put<std::uint64_t>(place.times.last)
        .put<std::uint64_t>(place.offset)
        .put<std::uint64_t>(place.bytes)
        .put<std::uint32_t>(static_cast<std::uint32_t>(offsets.size()))
        .raw(offsets.bytes())
        .put<std::uint64_t>(place.index_bytes)
        .text("")
        .put<std::uint64_t>(place.records)
        .put<std::uint64_t>(place.records);
    return content;
  }

  Record statistics() const {
    Record counts;
    std::uint32_t channels = 0;
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      counts.put<std::uint16_t>(channel_id(i)).put<std::uint64_t>(topics_[i].messages);
      ++channels;
    }
    Record content;
    content.put<std::uint64_t>(times_.count)
        .put<std::uint16_t>(static_cast<std::uint16_t>(schemas_.size()))
        .put<std::uint32_t>(channels)
        .put<std::uint32_t>(0)  // attachments
        .put<std::uint32_t>(0)  // metadata
        .put<std::uint32_t>(static_cast<std::uint32_t>(chunks_.size()))
        .put<std::uint64_t>(times_.first)
        .put<std::uint64_t>(times_.last)
        .put<std::uint32_t>(static_cast<std::uint32_t>(counts.size()))
        .raw(counts.bytes());
    return content;
  }

  /// All behind the data, the footer included.
  Record summary() const {
    Record all, offsets;
    const auto group = [&](McapOp op, const auto& fill) {
      const std::uint64_t begin = offset_ + all.size();
      fill();
      const std::uint64_t bytes = offset_ + all.size() - begin;
      if (bytes == 0) return;
      offsets.record(
          kSummaryOffsetOp,
          Record().put<std::uint8_t>(op).put<std::uint64_t>(begin).put<std::uint64_t>(bytes));
    };
    group(kSchemaOp, [&] {
      for (const Schema& schema : schemas_) all.record(kSchemaOp, schema.content);
    });
    group(kChannelOp, [&] {
      for (std::size_t i = 0; i < topics_.size(); ++i) all.record(kChannelOp, channel(i));
    });
    group(kStatisticsOp, [&] { all.record(kStatisticsOp, statistics()); });
    group(kChunkIndexOp, [&] {
      for (const ChunkPlace& place : chunks_) all.record(kChunkIndexOp, index_of(place));
    });
    const std::uint64_t offsets_begin = offset_ + all.size();
    all.raw(offsets.bytes());
    constexpr std::uint64_t kFooterBytes = 20;
    all.put<std::uint8_t>(kFooterOp)
        .put<std::uint64_t>(kFooterBytes)
        .put<std::uint64_t>(offset_)
        .put<std::uint64_t>(offsets_begin);
    return all.put<std::uint32_t>(checksum(all.bytes()));
  }

  void append(std::span<const std::uint8_t> bytes) {
    stream_.write(reinterpret_cast<const char*>(bytes.data()),
                  static_cast<std::streamsize>(bytes.size()));
    check();
    offset_ += bytes.size();
  }
  void check() const {
    if (stream_) return;
    throw FileError(output_.path(), {}, fmt::format("cannot be written: {}", std::strerror(errno)));
  }

  io::OutputFile output_;
  std::ofstream stream_;
  std::uint64_t offset_ = 0;  ///< bytes written
  bool begun_ = false;
  std::vector<TopicState> topics_;
  std::vector<Schema> schemas_;  ///< by number - 1
  Record chunk_;                 ///< records of the one that grows
  Times chunk_times_, times_;
  /// By channel: times and places of the messages in the chunk.
  std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> indices_;
  std::vector<ChunkPlace> chunks_;
};

}  // namespace

std::unique_ptr<BagWriter> create_mcap_bag(const std::string& path) {
  return std::make_unique<McapWriter>(path);
}

}  // namespace risley::bags
