// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/text_table.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/io/seconds.hpp"

namespace risley::io {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::size_t kReadBlock = std::size_t{1} << 18;
constexpr std::size_t kLongestLine = std::size_t{1} << 16;
constexpr std::int64_t kLargestExactDouble = std::int64_t{1} << 53;

constexpr std::array<std::int64_t, 19> kPowersOfTen = [] {
  std::array<std::int64_t, 19> powers{};
  std::int64_t power = 1;
  for (auto& entry : powers) {
    entry = power;
    power = power <= INT64_MAX / 10 ? power * 10 : power;
  }
  return powers;
}();

bool is_blank(char c) { return c == ' ' || c == '\t'; }

std::string_view without_blanks_in_front(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  return text;
}

template <class Function>
void for_each_field(std::string_view line, char delimiter, Function&& function) {
  if (delimiter == kBlanks) {
    for (line = without_blanks_in_front(line); !line.empty();
         line = without_blanks_in_front(line)) {
      const auto end = std::find_if(line.begin(), line.end(), is_blank);
      const auto length = static_cast<std::size_t>(end - line.begin());
      function(line.substr(0, length));
      line.remove_prefix(length);
    }
    return;
  }
  while (true) {
    const auto end = line.find(delimiter);
    function(trimmed(line.substr(0, end)));
    if (end == std::string_view::npos) return;
    line.remove_prefix(end + 1);
  }
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  text = without_blanks_in_front(text);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string printable(std::string_view text) {
  constexpr std::size_t kLongest = 80;
  std::string result;
  for (const char c : text.substr(0, kLongest)) {
    const auto byte = static_cast<unsigned char>(c);
    result += byte < 0x20 || byte >= 0x7F ? fmt::format("\\x{:02x}", byte) : std::string(1, c);
  }
  return text.size() > kLongest ? result + "..." : result;
}

std::vector<std::string_view> fields_of(std::string_view line, char delimiter) {
  std::vector<std::string_view> fields;
  for_each_field(line, delimiter, [&](std::string_view field) { fields.push_back(field); });
  return fields;
}

std::size_t split_fields(std::string_view line, char delimiter,
                         std::span<std::string_view> fields) {
  std::size_t count = 0;
  for_each_field(line, delimiter, [&](std::string_view field) {
    if (count < fields.size()) fields[count] = field;
    ++count;
  });
  return count;
}

std::int64_t power_of_ten(int exponent) {
  require_between("exponent", exponent, 0, 18);
  return kPowersOfTen[static_cast<std::size_t>(exponent)];
}

std::string normalized_header(std::string_view text) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  text = text.substr(0, text.find('\n'));
  std::string header(text);
  std::erase_if(header, [](char c) { return is_blank(c) || c == '\r'; });
  return header;
}

LineReader::LineReader(InputFile file, LinesOf lines_of)
    : file_(std::move(file)), buffer_(kReadBlock) {
  refill();
  const TextEncoding encoding = encoding_of({buffer_.data(), end_});
  if (encoding != TextEncoding::utf8) {
    decoder_.emplace(encoding);
    decoder_->append({buffer_.data(), end_}, decoded_);
    buffer_.resize(std::max(buffer_.size(), decoded_.size()));
    std::copy(decoded_.begin(), decoded_.end(), buffer_.begin());
    end_ = decoded_.size();
  }
  if (lines_of == LinesOf::table) dialect_ = dialect_of({buffer_.data(), end_});
}

double LineReader::fraction_read() const {
  if (file_.size() == 0) return at_end_ ? 1.0 : 0.0;
  const double consumed = static_cast<double>(bytes_read_) - static_cast<double>(end_ - begin_);
  return std::clamp(consumed / static_cast<double>(file_.size()), 0.0, 1.0);
}

void LineReader::require_length(std::size_t length) const {
  if (length <= kLongestLine) return;
  throw FileError(
      file_.path(), {.byte_offset = {}, .line = line_number_ + 1},
      fmt::format("expected a line of at most {} bytes, found a longer one", kLongestLine));
}

std::size_t LineReader::read_bytes(char* to, std::size_t most) {
  const std::size_t count = file_.read(bytes_read_, to, most);
  at_end_ = count == 0;
  bytes_read_ += count;
  return count;
}

void LineReader::refill() {
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  if (!decoder_) {
    end_ += read_bytes(buffer_.data() + end_, buffer_.size() - end_);
    return;
  }
  raw_.resize((buffer_.size() - end_) / 2);  // two bytes become three at most
  raw_.resize(read_bytes(raw_.data(), raw_.size()));
  decoded_.clear();
  decoder_->append(raw_, decoded_);
  std::copy(decoded_.begin(), decoded_.end(), buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
  end_ += decoded_.size();
}

bool LineReader::next(std::string_view& line) {
  std::size_t searched = 0;
  const char* newline = nullptr;
  while (true) {
    const std::size_t unread = end_ - begin_;
    newline = static_cast<const char*>(
        std::memchr(buffer_.data() + begin_ + searched, '\n', unread - searched));
    if (newline != nullptr || at_end_) break;
    require_length(unread);
    searched = unread;
    refill();
  }
  if (newline == nullptr && begin_ == end_) return false;
  const char* const start = buffer_.data() + begin_;
  const char* const stop = newline != nullptr ? newline : buffer_.data() + end_;
  require_length(static_cast<std::size_t>(stop - start));
  has_line_end_ = newline != nullptr;
  begin_ = static_cast<std::size_t>(stop - buffer_.data()) + (has_line_end_ ? 1 : 0);
  line = std::string_view(start, static_cast<std::size_t>(stop - start));
  if (!line.empty() && line.back() == '\r') {
    line.remove_suffix(1);
    has_line_end_ = true;  // only the line feed was cut off
  }
  if (line_number_++ == 0 && line.starts_with(kByteOrderMark)) {
    line.remove_prefix(kByteOrderMark.size());
  }
  line = dialect_.plain(line, plain_);
  return true;
}

Decimal decimal_field(std::string_view field, std::string_view column) {
  constexpr std::size_t kMostDigits = 19;
  constexpr std::int64_t kRoomForOneMore = INT64_MAX / 10 - 1;
  Decimal number;
  const char* c = field.data();
  const char* const end = c + field.size();
  const bool negative = c != end && *c == '-';
  if (negative) ++c;
  std::size_t digit_count = 0;
  const char* point = nullptr;
  for (; c != end; ++c) {
    if (*c >= '0' && *c <= '9' && digit_count < kMostDigits && number.digits <= kRoomForOneMore) {
      number.digits = number.digits * 10 + (*c - '0');
      ++digit_count;
    } else if (*c == '.' && point == nullptr) {
      point = c;
    } else {
      break;
    }
  }
  const std::ptrdiff_t decimals = point != nullptr ? end - point - 1 : 0;
  if (c == end && digit_count > 0 && decimals < std::ssize(kPowersOfTen)) {
    number.decimals = static_cast<int>(decimals);
    if (number.digits < kLargestExactDouble) {
      // Both are exact doubles, so the quotient is the nearest double.
      number.value = static_cast<double>(number.digits) /
                     static_cast<double>(kPowersOfTen[static_cast<std::size_t>(number.decimals)]);
      if (negative) number.value = -number.value;
    } else {
      std::from_chars(field.data(), end, number.value);
    }
    if (negative) number.digits = -number.digits;
    return number;
  }
  number = {};
  const auto result = std::from_chars(field.data(), end, number.value);
  if (field.empty() || result.ec != std::errc() || result.ptr != end ||
      !std::isfinite(number.value)) {
    throw BadRow{fmt::format("expected a finite number in column {}, found \"{}\"", column,
                             printable(field))};
  }
  return number;
}

Decimal number_or_nan(std::string_view field, std::string_view column) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  if (field.empty()) return {.value = kNaN};
  if (field.front() == '+') field.remove_prefix(1);
  const auto first = field.find_first_not_of('-');
  if (first != field.npos && std::string_view("nNiI").find(field[first]) != field.npos) {
    double value = 0.0;
    const auto result = std::from_chars(field.data(), field.data() + field.size(), value);
    const bool whole = result.ec == std::errc() && result.ptr == field.data() + field.size();
    if (whole && !std::isfinite(value)) return {.value = kNaN};
  }
  return decimal_field(field, column);
}

std::int64_t integer_field(std::string_view field, std::string_view column, std::int64_t low,
                           std::int64_t high) {
  std::int64_t value = 0;
  const auto result = std::from_chars(field.data(), field.data() + field.size(), value);
  if (field.empty() || result.ec != std::errc() || result.ptr != field.data() + field.size() ||
      value < low || value > high) {
    throw BadRow{fmt::format("expected a whole number in [{}, {}] in column {}, found \"{}\"", low,
                             high, column, printable(field))};
  }
  return value;
}

std::int64_t nanoseconds_of(const Decimal& seconds, std::string_view column) {
  std::int64_t time_ns = 0;
  if (seconds.decimals >= 0 && seconds.decimals <= 9) {
    const auto scale = kPowersOfTen[static_cast<std::size_t>(9 - seconds.decimals)];
    if (!__builtin_mul_overflow(seconds.digits, scale, &time_ns)) return time_ns;
  } else if (seconds.decimals > 9) {
    const auto scale = kPowersOfTen[static_cast<std::size_t>(seconds.decimals - 9)];
    const std::int64_t rest = seconds.digits % scale, half = scale / 2;
    return seconds.digits / scale + (rest >= half ? 1 : 0) - (rest <= -half ? 1 : 0);
  } else if (const auto rounded = nanoseconds_from_seconds(seconds.value)) {
    return *rounded;
  }
  throw BadRow{fmt::format("expected a time within +-9.2e9 s in column {}, found {}", column,
                           seconds.value)};
}

std::int64_t nanoseconds_field(std::string_view field, std::string_view column) {
  return nanoseconds_of(decimal_field(field, column), column);
}

TextOutput::TextOutput(const std::string& path)
    : output_(path), file_(std::fopen(output_.temporary_path().c_str(), "wb"), &std::fclose) {
  if (!file_) fail();
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);
}

void TextOutput::fail() const {
  throw FileError(output_.path(), {}, fmt::format("cannot be written: {}", std::strerror(errno)));
}

void TextOutput::flush() {
  if (std::fwrite(buffer_.data(), 1, buffer_.size(), file_.get()) != buffer_.size()) fail();
  buffer_.clear();
}

void TextOutput::close() {
  flush();
  if (std::fclose(file_.release()) != 0) fail();
  output_.commit();
}

void TextOutput::append_digits(std::uint64_t digits, int decimals, bool negative) {
  require_between("decimals", decimals, 0, 18);
  std::array<char, 32> text{};
  char* const end = text.data() + text.size();
  char* c = end;
  int written = 0;
  do {
    *--c = static_cast<char>('0' + digits % 10);
    digits /= 10;
    if (++written == decimals) *--c = '.';
  } while (digits > 0 || written <= decimals);
  if (negative) *--c = '-';
  buffer_.append(c, end);
}

void TextOutput::append_fixed(double value, int decimals) {
  const double scaled =
      std::nearbyint(std::abs(value) * static_cast<double>(power_of_ten(decimals)));
  if (scaled < static_cast<double>(kLargestExactDouble)) {
    append_digits(static_cast<std::uint64_t>(scaled), decimals, std::signbit(value));
  } else {
    fmt::format_to(fmt::appender(buffer_), "{:.{}f}", value, decimals);
  }
}

void TextOutput::append_decimal(std::int64_t digits, int decimals) {
  const auto magnitude = static_cast<std::uint64_t>(digits);
  append_digits(digits < 0 ? 0 - magnitude : magnitude, decimals, digits < 0);
}

}  // namespace risley::io
