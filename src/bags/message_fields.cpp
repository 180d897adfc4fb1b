// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/bags/message_fields.hpp"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/exceptions/Exception.h>
#if __has_include(<fastcdr/config.h>)
#include <fastcdr/config.h>
#endif

namespace risley::bags {
namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
constexpr std::int64_t kLatestTime = 230LL * 31'557'600 * kNanosecondsPerSecond;  // the year 2200

}  // namespace

void require_room(std::string_view what, std::uint64_t count, std::size_t bytes_each,
                  std::size_t bytes_left) {
  if (count <= bytes_left / bytes_each) return;
  throw BadMessage{fmt::format("expected {} {} of at least {} bytes each, found {} bytes", count,
                               what, bytes_each, bytes_left)};
}

/// The two major versions of Fast-CDR differ in names.
struct CdrFields::State {
  explicit State(std::span<const std::uint8_t> message)
      : bytes(message),
        // Reading changes nothing, but the buffer's type is of writable bytes.
        buffer(reinterpret_cast<char*>(const_cast<std::uint8_t*>(bytes.data())), bytes.size()),
#if defined(FASTCDR_VERSION_MAJOR) && FASTCDR_VERSION_MAJOR >= 2
        cdr(buffer, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::CdrVersion::DDS_CDR)
#else
        cdr(buffer, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR)
#endif
  {
  }

  /// Calls a function of Fast-CDR. @throws BadMessage for what that throws
  template <class Function>
  void guarded(Function&& function) {
    try {
      function();
    } catch (const eprosima::fastcdr::exception::Exception& error) {
      throw BadMessage{fmt::format("expected a longer message than its {} bytes of CDR ({})",
                                   bytes.size(), error.what())};
    }
  }

  std::span<const std::uint8_t> bytes;
  eprosima::fastcdr::FastBuffer buffer;
  eprosima::fastcdr::Cdr cdr;
};

CdrFields::CdrFields(std::span<const std::uint8_t> bytes) : state_(std::make_unique<State>(bytes)) {
  constexpr std::size_t kEncapsulationBytes = 4;
  // Plain CDR, big- or little-endian.
  if (bytes.size() < kEncapsulationBytes || bytes[0] != 0 || bytes[1] > 1) {
    throw BadMessage{"expected a message that begins with 00 00 or 00 01, as plain CDR does"};
  }
  state_->guarded([&] { state_->cdr.read_encapsulation(); });
}

CdrFields::~CdrFields() = default;

std::size_t CdrFields::left() const {
#if defined(FASTCDR_VERSION_MAJOR) && FASTCDR_VERSION_MAJOR >= 2
  return state_->bytes.size() - state_->cdr.get_serialized_data_length();
#else
  return state_->bytes.size() - state_->cdr.getSerializedDataLength();
#endif
}

template <class T>
T CdrFields::number(std::string_view) {
  T value{};
  state_->guarded([&] { state_->cdr >> value; });
  return value;
}
template std::uint8_t CdrFields::number(std::string_view);
template std::int32_t CdrFields::number(std::string_view);
template std::uint32_t CdrFields::number(std::string_view);
template std::uint64_t CdrFields::number(std::string_view);
template float CdrFields::number(std::string_view);
template double CdrFields::number(std::string_view);

std::string CdrFields::text(std::string_view) {
  std::string value;
  state_->guarded([&] { state_->cdr >> value; });
  return value;
}

std::uint32_t CdrFields::length(std::string_view what, std::size_t bytes_each) {
  const auto count = number<std::uint32_t>();
  require_room(what, count, bytes_each, left());
  return count;
}

bool CdrFields::big_endian() const { return state_->bytes[1] == 0; }

std::span<const std::uint8_t> CdrFields::take(std::size_t count, std::string_view what) {
  require_room(what, count, 1, left());
  const auto bytes = state_->bytes.subspan(state_->bytes.size() - left(), count);
  state_->guarded([&] { state_->cdr.jump(count); });
  return bytes;
}

Header take_header(Ros1Fields& fields) {
  Header header;
  header.sequence = fields.number<std::uint32_t>("the sequence number");
  header.seconds = fields.number<std::uint32_t>("the stamp");
  header.nanoseconds = fields.number<std::uint32_t>("the stamp");
  header.frame = fields.text("characters of the frame name");
  return header;
}

Header take_header(CdrFields& fields) {
  Header header;
  header.seconds = fields.number<std::int32_t>();
  header.nanoseconds = fields.number<std::uint32_t>();
  header.frame = fields.text();
  return header;
}

std::int64_t message_time(std::uint64_t time_ns) {
  if (time_ns > static_cast<std::uint64_t>(kLatestTime)) {
    throw BadMessage{fmt::format("expected a time before the year 2200, found {} ns", time_ns)};
  }
  return static_cast<std::int64_t>(time_ns);
}

std::int64_t message_time(std::int64_t seconds, std::uint32_t nanoseconds) {
  if (seconds < 0) {
    throw BadMessage{fmt::format("expected a time of 0 or later, found {} s", seconds)};
  }
  return message_time(static_cast<std::uint64_t>(seconds) * kNanosecondsPerSecond + nanoseconds);
}

std::int64_t message_time(const Header& header) {
  return message_time(header.seconds, header.nanoseconds);
}

}  // namespace risley::bags
