// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/tables/sqlite_output.hpp"

#include <map>
#include <utility>

#include <fmt/format.h>
#include <sqlite3.h>

#include "risley/core/error.hpp"
#include "risley/io/output_file.hpp"

namespace risley::tables {

class SqliteOutput::Database {
 public:
  explicit Database(const std::string& path) : output_(path) {
    // The file's name is private, and it is removed unless it is completed: neither SQLite's locks,
    // which would conflict with those of OutputFile, nor its journal are needed.
    const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
    try {
      check(sqlite3_open_v2(output_.temporary_path().c_str(), &database_, flags, "unix-none"));
      run("PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; BEGIN;");
    } catch (...) {
      sqlite3_close(database_);
      throw;
    }
  }
  ~Database() { close(); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void run(const std::string& sql) {
    check(sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr));
  }

  void insert(const std::string& sql, std::initializer_list<SqliteValue> values) {
    sqlite3_stmt*& statement = statements_[sql];
    if (statement == nullptr) {
      check(sqlite3_prepare_v2(database_, sql.c_str(), -1, &statement, nullptr));
    }
    int place = 0;
    for (const SqliteValue& value : values) {
      ++place;
      if (const auto* number = std::get_if<std::int64_t>(&value)) {
        check(sqlite3_bind_int64(statement, place, *number));
      } else if (const auto* text = std::get_if<std::string_view>(&value)) {
        check(sqlite3_bind_text64(statement, place, text->data(), text->size(), SQLITE_STATIC,
                                  SQLITE_UTF8));
      } else {
        const auto bytes = std::get<std::span<const std::uint8_t>>(value);
        // An empty value is not a missing one, which a null pointer would mean.
        const void* data = bytes.empty() ? static_cast<const void*>("") : bytes.data();
        check(sqlite3_bind_blob64(statement, place, data, bytes.size(), SQLITE_STATIC));
      }
    }
    if (sqlite3_step(statement) != SQLITE_DONE) fail();
    sqlite3_reset(statement);
    sqlite3_clear_bindings(statement);
  }

  void commit(const std::string& path) {
    run("COMMIT");
    close();
    if (!path.empty()) output_.move_to(path);
    output_.commit();
  }

 private:
  [[noreturn]] void fail() const {
    throw FileError(output_.path(), {},
                    fmt::format("cannot be written: {}",
                                database_ != nullptr ? sqlite3_errmsg(database_) : "no memory"));
  }
  void check(int result) const {
    if (result != SQLITE_OK) fail();
  }
  void close() {
    for (auto& [sql, statement] : statements_) sqlite3_finalize(statement);
    statements_.clear();
    sqlite3_close(std::exchange(database_, nullptr));
  }

  io::OutputFile output_;
  sqlite3* database_ = nullptr;
  std::map<std::string, sqlite3_stmt*> statements_;  ///< by their text
};

SqliteOutput::SqliteOutput(const std::string& path) : database_(std::make_unique<Database>(path)) {}
SqliteOutput::~SqliteOutput() = default;

void SqliteOutput::run(const std::string& sql) { database_->run(sql); }

void SqliteOutput::insert(const std::string& sql, std::initializer_list<SqliteValue> values) {
  database_->insert(sql, values);
}

void SqliteOutput::commit(const std::string& path) { database_->commit(path); }

}  // namespace risley::tables
