// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Tables of binary numbers with named columns, in any layout in a file: point by point, column by
// column, packed or not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "risley/recordings/reader.hpp"

#include "recordings/formats/byte_source.hpp"
#include "recordings/formats/named_columns.hpp"

namespace risley::recordings {

/// A type of numbers: its bytes and their conversion to a cell.
struct NumberType {
  enum class Kind : std::uint8_t { signed_integer, unsigned_integer, floating } kind;
  std::size_t bytes = 0;  ///< 1, 2, 4 or 8; 4 or 8 of floating
  bool big_endian = false;

  CellType cell_type() const;
  Decimal cell(const std::uint8_t* bytes) const;
};

/// A type by its kind ('i', 'u', 'f' in any case) and bytes; empty when there is none of these.
std::optional<NumberType> number_type(char kind, std::uint64_t bytes, bool big_endian = false);

/// Consecutive records of one size; in a table stored column by column, each column is a lane.
struct TableLane {
  std::function<std::unique_ptr<ByteSource>()> open;  ///< at its first record
  std::size_t record_bytes = 0;
};

struct TableColumn {
  std::string name;
  NumberType type;
  std::size_t lane = 0, offset = 0;  ///< offset within the record
};

struct BinaryTable {
  std::uint64_t rows = 0;
  std::vector<TableLane> lanes;
  std::vector<TableColumn> columns;
  std::vector<Warning> warnings;     ///< of the part before the rows
  std::uint64_t columns_offset = 0;  ///< if the file names its columns
};

/// Longest record of a lane.
inline constexpr std::size_t kMostRecordBytes = std::size_t{1} << 16;

/// Reads the rows of a binary table. If the file has fewer than stated, FileError follows the last
/// one.
class BinaryTableReader final : public Reader {
 public:
  /// @throws FileError when the columns cannot form rows
  BinaryTableReader(std::string path, std::string_view format, BinaryTable table);

  bool read(Chunk& chunk, std::size_t max_rows) override;
  double fraction_read() const override;

 private:
  static constexpr std::size_t kMostBlockRows = 512;

  struct Lane {
    std::unique_ptr<ByteSource> source;
    std::vector<std::uint8_t> block;
    std::size_t record_bytes = 0;
    std::uint64_t block_offset = 0;  ///< of the block in the file
  };

  NamedColumns find_columns() const;
  void open_lanes();
  void look_ahead();
  /// Reads the next rows of all lanes. @return false at the end
  bool fill_block();
  void read_cells(std::size_t row);
  FileError end_error(const Lane& lane, std::uint64_t missing) const;

  std::string path_;
  BinaryTable table_;
  NamedColumns columns_;
  std::vector<std::size_t> used_lanes_;
  std::vector<Lane> lanes_;  ///< as the table's; those without a wanted column stay closed
  std::vector<Decimal> cells_;
  std::size_t block_rows_ = 0, next_ = 0, rows_per_block_ = kMostBlockRows;
  std::uint64_t rows_taken_ = 0;               ///< into blocks
  std::optional<FileError> damage_, pending_;  ///< after the block; after the last chunk
};

}  // namespace risley::recordings
