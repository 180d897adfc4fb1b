// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/text_table.hpp"

#include <algorithm>

#include "risley/core/error.hpp"

namespace risley::recordings {
namespace {

constexpr std::size_t kMostListFields = 65536;  // no line is longer

/// Digits after the point of a plain decimal fraction, 0 for anything else.
int decimals_of(std::string_view field) {
  const auto point = field.find('.');
  if (point == std::string_view::npos) return 0;
  const auto fraction = field.substr(point + 1);
  const bool plain =
      std::all_of(fraction.begin(), fraction.end(), [](char c) { return c >= '0' && c <= '9'; });
  return plain ? static_cast<int>(fraction.size()) : 0;
}

}  // namespace

TextTableReader::TextTableReader(const io::InputFile& file, std::string format)
    : path_(file.path()), lines_(file, io::LinesOf::table) {
  header_.format = std::move(format);
  header_.devices.resize(1);
  std::string_view line;
  if (!lines_.next(line)) fail(1, "expected a header line, found an empty file");
  table_header_ = normalized_header(line);
  if (!lines_.has_line_end()) {
    warn(kWarning.cut_off, "the file ends within its header line; it holds no rows").place.line = 1;
  }
}

void TextTableReader::fail(std::uint64_t line, const std::string& problem) const {
  throw FileError(path_, {{}, line}, problem);
}

void TextTableReader::refuse_header(const std::string& expected) const {
  fail(1, fmt::format("expected the header {}, found \"{}\"", expected, printable(table_header_)));
}

bool TextTableReader::split(std::string_view line, std::span<std::string_view> fields,
                            std::size_t& count) const {
  if (lists_.empty()) {
    count = io::split_fields(line, delimiter_, fields);
    return count == fields.size();
  }
  // A list counts as the field that states its length.
  const std::vector<std::string_view> all = fields_of(line, delimiter_);
  std::size_t at = 0;
  for (count = 0; count < fields.size() && at < all.size(); ++count) {
    fields[count] = all[at++];
    if (!lists_[count]) continue;
    at += static_cast<std::size_t>(
        integer_field(fields[count], "list", 0, static_cast<std::int64_t>(kMostListFields)));
  }
  if (at == all.size()) return count == fields.size();
  count = at < all.size() ? count + all.size() - at : count - 1;
  return false;
}

void TextTableReader::require_no_more_rows() {
  for (std::string_view line; lines_.next(line);) {
    if (trimmed(line).empty()) continue;
    fail(lines_.line_number(), fmt::format("expected the end of the rows that line {} counts, "
                                           "found one more: \"{}\"",
                                           all_stated_in_, printable(line)));
  }
}

void TextTableReader::begin_rows_at(std::uint64_t line) {
  std::string_view skipped;
  while (lines_.line_number() + 1 < line && lines_.next(skipped)) {
  }
  header_lines_ = lines_.line_number();
}

bool TextTableReader::read(Chunk& chunk, std::size_t max_rows) {
  chunk.clear();
  if (pending_) throw FileError(*pending_);
  const auto stop = [&](FileError error) {
    finished_ = true;
    pending_.emplace(std::move(error));
    if (chunk.observations.size() == 0 && chunk.imu.empty()) throw FileError(*pending_);
  };
  try {
    std::string_view line;
    while (!finished_ && chunk.observations.size() + chunk.imu.size() < max_rows) {
      if (rows_left_ == 0U) {
        if (all_stated_in_ > 0) require_no_more_rows();
        finished_ = true;
        break;
      }
      if (!lines_.next(line)) {
        if (rows_left_) {
          fail(lines_.line_number(),
               fmt::format("expected {} more rows, found the end of the file", *rows_left_));
        }
        finished_ = true;
        break;
      }
      if (trimmed(line).empty()) {
        if (!empty_line_) empty_line_ = lines_.line_number();
        continue;
      }
      if (empty_line_) {
        fail(*empty_line_, fmt::format("expected {} fields, found an empty line", fields_.size()));
      }
      std::size_t count = 0;
      const bool all_fields = split(line, fields_, count);
      const int decimals = all_fields ? decimals_of(fields_.back()) : 0;
      if (!lines_.has_line_end() &&
          !(all_fields && decimals > 0 && decimals == last_field_decimals_)) {
        Warning& warning =
            warn(kWarning.cut_off,
                 "the last line has no line end and may be cut off (\"{}\"); it was ignored",
                 printable(line));
        warning.place.line = lines_.line_number();
        warning.lost_records = rows_left_.value_or(1);
        finished_ = true;
        break;
      }
      if (!all_fields) {
        fail(lines_.line_number(), fmt::format("expected {} fields, found {}: \"{}\"",
                                               fields_.size(), count, printable(line)));
      }
      append_row(fields_, chunk);
      last_field_decimals_ = decimals;
      if (rows_left_) --*rows_left_;
    }
  } catch (const BadRow& bad) {
    stop(FileError(path_, {{}, lines_.line_number()}, bad.what()));
  } catch (const FileError& error) {
    stop(error);
  }
  return chunk.observations.size() + chunk.imu.size() > 0;
}

std::size_t append_observation(Observations& rows, std::int64_t time_ns) {
  const std::size_t row = rows.size();
  rows.resize(row + 1);
  rows.time_ns[row] = time_ns;
  rows.return_number[row] = 1;
  return row;
}

void TimeColumn::look_at(const std::vector<std::int64_t>& times_ns) {
  if (decided_ || times_ns.empty()) return;
  decided_ = true;
  for (const auto time_ns : times_ns) {
    if (!fits(time_ns)) {
      decimals_ = 9;
      return;
    }
  }
}

bool TimeColumn::fits(std::int64_t time_ns) const {
  return decimals_ >= 9 || time_ns % io::power_of_ten(9 - decimals_) == 0;
}

void TimeColumn::append(TextOutput& output, std::int64_t time_ns) const {
  if (decimals_ > 9) {  // a source with more digits than nanoseconds
    output.append_decimal(time_ns, 9);
    for (int i = 9; i < decimals_; ++i) output.buffer().push_back('0');
  } else if (fits(time_ns)) {
    output.append_decimal(time_ns / io::power_of_ten(9 - decimals_), decimals_);
  } else {
    output.append_decimal(time_ns, 9);
  }
}

}  // namespace risley::recordings
