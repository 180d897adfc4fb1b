// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "risley/core/progress.hpp"

struct sqlite3_stmt;

namespace risley::tables {

class SqliteInput;

/// The answer to a query, row by row. It must not outlive its database.
class SqliteQuery {
 public:
  /// Moves to the next row, initially to the first one.
  /// @param what  the action, for messages: "give its topics"
  /// @return false at the end
  /// @throws FileError; Cancelled
  bool next(const char* what);
  /// Moves back before the first row.
  void rewind();

  // Values of the row, by place from 0; SQLite converts those of another kind.
  std::int64_t integer(int column) const;                 ///< whole number
  std::string text(int column) const;                     ///< as stored, UTF-8 or not
  std::span<const std::uint8_t> bytes(int column) const;  ///< valid until next() or rewind()

 private:
  friend class SqliteInput;
  struct Finish {
    void operator()(sqlite3_stmt* statement) const;
  };
  SqliteQuery(const SqliteInput& database, sqlite3_stmt* statement)
      : database_(&database), statement_(statement) {}

  const SqliteInput* database_;
  std::unique_ptr<sqlite3_stmt, Finish> statement_;
};

/// An SQLite database for reading. It may come from anywhere: no code in it is run, only stored
/// tables are read, and no step may take longer than a table of the file's size can need. Nothing
/// is written beside it, unless SQLite's own files there hold a part of it.
class SqliteInput {
 public:
  /// @param kind  expected kind, for messages: "a ROS 2 bag"
  /// @throws FileError, also for a file that is cut off
  SqliteInput(const std::string& path, std::string kind, const Progress& progress = {});
  ~SqliteInput();
  SqliteInput(const SqliteInput&) = delete;
  SqliteInput& operator=(const SqliteInput&) = delete;

  std::uint64_t file_bytes() const;  ///< of the database, its journal included

  /// Rejects views, virtual tables and computed columns, which could expand the file's contents. A
  /// missing table is left to the query. @throws FileError; Cancelled
  void require_plain_table(const std::string& name) const;
  /// @param sql  of one statement. @throws FileError; Cancelled
  SqliteQuery query(const std::string& sql) const;

  /// Refuses the database. @throws FileError, always
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  friend class SqliteQuery;
  class Database;
  std::unique_ptr<Database> database_;
};

}  // namespace risley::tables
