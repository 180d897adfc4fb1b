// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/binary_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

namespace risley::recordings {
namespace {

using io::load;

template <class T>
Decimal cell_of(const std::uint8_t* bytes) {
  const T number = load<T>(bytes);
  if constexpr (std::is_floating_point_v<T>) {
    if (!std::isfinite(number)) return {.value = std::numeric_limits<double>::quiet_NaN()};
    return {.value = static_cast<double>(number)};
  } else {
    Decimal cell{.value = static_cast<double>(number)};
    if (std::in_range<std::int64_t>(number)) {
      cell.digits = static_cast<std::int64_t>(+number);
      cell.decimals = 0;
    }
    return cell;
  }
}

}  // namespace

CellType NumberType::cell_type() const {
  if (kind != Kind::floating) return CellType::integer;
  return bytes == 4 ? CellType::float32 : CellType::float64;
}

Decimal NumberType::cell(const std::uint8_t* stored) const {
  std::array<std::uint8_t, 8> swapped{};
  if (big_endian) {
    std::reverse_copy(stored, stored + bytes, swapped.begin());
    stored = swapped.data();
  }
  if (kind == Kind::floating) {
    return bytes == 4 ? cell_of<float>(stored) : cell_of<double>(stored);
  }
  const bool with_sign = kind == Kind::signed_integer;
  switch (bytes) {
    case 1:
      return with_sign ? cell_of<std::int8_t>(stored) : cell_of<std::uint8_t>(stored);
    case 2:
      return with_sign ? cell_of<std::int16_t>(stored) : cell_of<std::uint16_t>(stored);
    case 4:
      return with_sign ? cell_of<std::int32_t>(stored) : cell_of<std::uint32_t>(stored);
    default:
      return with_sign ? cell_of<std::int64_t>(stored) : cell_of<std::uint64_t>(stored);
  }
}

std::optional<NumberType> number_type(char kind, std::uint64_t bytes, bool big_endian) {
  const bool wide = bytes == 4 || bytes == 8;
  const bool known = wide || bytes == 1 || bytes == 2;
  const auto type = [&](NumberType::Kind found) {
    return NumberType{found, static_cast<std::size_t>(bytes), big_endian};
  };
  switch (kind) {
    case 'i':
    case 'I':
      if (known) return type(NumberType::Kind::signed_integer);
      break;
    case 'u':
    case 'U':
      if (known) return type(NumberType::Kind::unsigned_integer);
      break;
    case 'f':
    case 'F':
      if (wide) return type(NumberType::Kind::floating);
      break;
    default:
      break;
  }
  return std::nullopt;
}

BinaryTableReader::BinaryTableReader(std::string path, std::string_view format, BinaryTable table)
    : path_(std::move(path)), table_(std::move(table)), columns_(find_columns()) {
  header_.format = format;
  for (const TableLane& lane : table_.lanes) {
    if (lane.record_bytes > 0 && lane.record_bytes <= kMostRecordBytes) continue;
    throw FileError(path_, {table_.columns_offset, {}},
                    fmt::format("expected points of 1 to {} bytes, found {} bytes",
                                kMostRecordBytes, lane.record_bytes));
  }
  for (const std::size_t column : columns_.wanted()) {
    used_lanes_.push_back(table_.columns[column].lane);
  }
  std::sort(used_lanes_.begin(), used_lanes_.end());
  used_lanes_.erase(std::unique(used_lanes_.begin(), used_lanes_.end()), used_lanes_.end());
  for (const std::size_t lane : used_lanes_) {
    rows_per_block_ = std::clamp<std::size_t>(
        io::BlockInput::kBlockBytes / table_.lanes[lane].record_bytes, 1, rows_per_block_);
  }
  cells_.resize(columns_.wanted().size());
  look_ahead();
  try {
    columns_.settle(header_, table_.warnings);
  } catch (const BadColumns& bad) {
    throw FileError(path_, {table_.columns_offset, {}}, bad.what());
  }
  for (Warning& warning : table_.warnings) {
    warning.place.byte_offset = table_.columns_offset;
    warnings_.push_back(std::move(warning));
  }
  open_lanes();
}

NamedColumns BinaryTableReader::find_columns() const {
  std::vector<NamedColumn> columns;
  for (const TableColumn& column : table_.columns) {
    columns.push_back({column.name, column.type.cell_type()});
  }
  try {
    return NamedColumns(std::move(columns));
  } catch (const BadColumns& bad) {
    throw FileError(path_, {table_.columns_offset, {}}, bad.what());
  }
}

void BinaryTableReader::open_lanes() {
  lanes_.clear();
  lanes_.resize(table_.lanes.size());
  for (const std::size_t i : used_lanes_) {
    lanes_[i].source = table_.lanes[i].open();
    lanes_[i].record_bytes = table_.lanes[i].record_bytes;
    lanes_[i].block.resize(lanes_[i].record_bytes * rows_per_block_);
  }
  rows_taken_ = block_rows_ = next_ = 0;
  damage_.reset();
}

void BinaryTableReader::look_ahead() {
  open_lanes();
  std::size_t looked_at = 0;
  while (looked_at < kNamedRowsLookedAt && fill_block()) {
    for (std::size_t row = 0; row < block_rows_; ++row, ++looked_at) {
      read_cells(row);
      columns_.look_at(cells_);
    }
  }
}

FileError BinaryTableReader::end_error(const Lane& lane, std::uint64_t missing) const {
  const std::string& problem = lane.source->problem();
  return {path_,
          {lane.source->file_offset(), {}},
          fmt::format("expected {} more points of {} bytes, {}", missing, lane.record_bytes,
                      problem.empty() ? "found the end of the file" : problem)};
}

bool BinaryTableReader::fill_block() {
  next_ = block_rows_ = 0;
  if (damage_) return false;
  const std::uint64_t rows_left = table_.rows - rows_taken_;
  const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(rows_left, rows_per_block_));
  block_rows_ = wanted;
  for (const std::size_t i : used_lanes_) {
    Lane& lane = lanes_[i];
    lane.block_offset = lane.source->file_offset();
    const std::size_t bytes = lane.source->read(lane.block.data(), wanted * lane.record_bytes);
    const std::size_t rows = bytes / lane.record_bytes;
    if (rows < block_rows_) {
      block_rows_ = rows;
      damage_.emplace(end_error(lane, rows_left - rows));
    }
  }
  rows_taken_ += block_rows_;
  if (!damage_ && rows_taken_ == table_.rows) {
    // A decompressor may detect damage only after the last byte.
    for (const std::size_t i : used_lanes_) {
      std::uint8_t byte = 0;
      const bool more = lanes_[i].source->read(&byte, 1) > 0;
      if (!more && !lanes_[i].source->problem().empty()) {
        damage_.emplace(path_, FilePlace{lanes_[i].source->file_offset(), {}},
                        lanes_[i].source->problem());
      }
    }
  }
  return block_rows_ > 0;
}

void BinaryTableReader::read_cells(std::size_t row) {
  const auto& wanted = columns_.wanted();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const TableColumn& column = table_.columns[wanted[i]];
    const Lane& lane = lanes_[column.lane];
    cells_[i] = column.type.cell(lane.block.data() + row * lane.record_bytes + column.offset);
  }
}

bool BinaryTableReader::read(Chunk& chunk, std::size_t max_rows) {
  chunk.clear();
  if (pending_) throw FileError(*pending_);
  Observations& rows = chunk.observations;
  while (rows.size() < max_rows && !pending_) {
    if (next_ == block_rows_ && !fill_block()) {
      pending_ = damage_;
      break;
    }
    read_cells(next_);
    try {
      columns_.append(cells_, rows);
    } catch (const BadRow& bad) {
      const std::uint64_t number = rows_taken_ - block_rows_ + next_;
      const Lane& lane = lanes_[used_lanes_.front()];
      const std::size_t into_block = lane.source->is_plain() ? next_ * lane.record_bytes : 0;
      pending_.emplace(path_, FilePlace{lane.block_offset + into_block, {}},
                       fmt::format("point {}: {}", number + 1, bad.what()));
      break;
    }
    ++next_;
  }
  if (rows.size() == 0 && pending_) throw FileError(*pending_);
  return rows.size() > 0;
}

double BinaryTableReader::fraction_read() const {
  if (table_.rows == 0) return 1.0;
  return static_cast<double>(rows_taken_ - block_rows_ + next_) / static_cast<double>(table_.rows);
}

}  // namespace risley::recordings
