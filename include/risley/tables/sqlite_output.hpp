// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace risley::tables {

/// A value of a row. Bytes are stored unchanged, and read before write() returns.
using SqliteValue = std::variant<std::int64_t, std::string_view, std::span<const std::uint8_t>>;

/// An SQLite database that is written in one go: the file appears under its name only at commit(),
/// and one destroyed before leaves nothing.
class SqliteOutput {
 public:
  /// @throws FileError
  explicit SqliteOutput(const std::string& path);
  ~SqliteOutput();
  SqliteOutput(const SqliteOutput&) = delete;
  SqliteOutput& operator=(const SqliteOutput&) = delete;

  /// @param sql  statements without values. @throws FileError
  void run(const std::string& sql);
  /// Adds a row. @param sql  an INSERT with a ? for each value, the same text for rows of one kind
  /// @throws FileError
  void insert(const std::string& sql, std::initializer_list<SqliteValue> values);
  /// @param path  its name; empty: the one with which it was created. @throws FileError
  void commit(const std::string& path = {});

 private:
  class Database;
  std::unique_ptr<Database> database_;
};

}  // namespace risley::tables
