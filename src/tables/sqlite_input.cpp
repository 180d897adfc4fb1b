// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/tables/sqlite_input.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sqlite3.h>

#include "risley/core/error.hpp"

namespace risley::tables {
namespace {

/// A file's path as an SQLite URI declaring that the file does not change.
std::string immutable_uri(const std::string& path) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const bool is_special = c == '%' || c == '?' || c == '#';
    uri += is_special ? fmt::format("%{:02X}", static_cast<unsigned>(c)) : std::string(1, c);
  }
  return uri + "?immutable=1";
}

/// Whether SQLite left a part of the database in a file beside it.
bool has_journal(const std::string& path) {
  for (const char* ending : {"-wal", "-journal"}) {
    std::error_code code;
    if (const auto bytes = std::filesystem::file_size(path + ending, code); !code && bytes > 0) {
      return true;
    }
  }
  return false;
}

/// Size of a database according to its header: that of its pages, if stated.
std::uint64_t bytes_by_header(const std::string& path, std::uint64_t file_bytes) {
  constexpr std::size_t kPageBytesAt = 16, kChangesAt = 24, kPagesAt = 28, kPagesValidForAt = 92;
  std::array<unsigned char, 100> head{};
  std::ifstream stream(path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
  if (!stream) return head.size();
  const auto number = [&head](std::size_t at, std::size_t bytes) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8U | head[at + i];
    return value;
  };
  const std::uint64_t stored = number(kPageBytesAt, 2);
  const std::uint64_t page_bytes = stored == 1 ? 65'536 : std::max<std::uint64_t>(stored, 1);
  if (number(kChangesAt, 4) == number(kPagesValidForAt, 4)) return number(kPagesAt, 4) * page_bytes;
  return (file_bytes + page_bytes - 1) / page_bytes * page_bytes;
}

constexpr int kInstructionsPerLook = 10'000;  // of SQLite's machine

/// A name in SQL: in quotes.
std::string sql_name(const std::string& name) {
  std::string text = "\"";
  for (const char c : name) text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return text + "\"";
}

}  // namespace

/// The open database, and the limits of one step.
class SqliteInput::Database {
 public:
  Database(std::string path, std::string kind, const Progress& progress)
      : path_(std::move(path)), kind_(std::move(kind)), progress_(progress.silent()) {
    open();
    restrict();
  }
  ~Database() { sqlite3_close(database_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  std::uint64_t file_bytes() const { return file_bytes_; }

  sqlite3_stmt* prepare(const std::string& sql) {
    looks_ = 0;
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_, sql.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
      fail_library(fmt::format("be read as {}", kind_));
    }
    return statement;
  }

  bool step(sqlite3_stmt* statement, const char* what) {
    looks_ = 0;
    const int result = sqlite3_step(statement);
    if (result == SQLITE_ROW) return true;
    if (result == SQLITE_INTERRUPT) {
      progress_.check();
      fail(fmt::format(
          "the database cannot {}: it takes more steps than a database of its size needs", what));
    }
    if (result != SQLITE_DONE) fail_library(what);
    return false;
  }

  [[noreturn]] void fail(const std::string& problem) const { throw FileError(path_, {}, problem); }

 private:
  [[noreturn]] void fail_library(const std::string& what) const {
    progress_.check();
    fail(fmt::format("the database cannot {}: {}", what,
                     database_ != nullptr ? sqlite3_errmsg(database_) : "no memory"));
  }

  void open() {
    const bool as_it_is = has_journal(path_);
    const std::string name = as_it_is ? path_ : immutable_uri(path_);
    const int flags = SQLITE_OPEN_READONLY | (as_it_is ? 0 : SQLITE_OPEN_URI);
    try {
      if (sqlite3_open_v2(name.c_str(), &database_, flags, nullptr) != SQLITE_OK) {
        fail_library("be opened");
      }
      if (!as_it_is) require_all_pages();
    } catch (...) {
      sqlite3_close(database_);
      throw;
    }
  }

  /// SQLite reads missing data at the end as zeros, which would become values.
  void require_all_pages() const {
    std::error_code code;
    const std::uint64_t found = std::filesystem::file_size(path_, code);
    if (code) fail(fmt::format("cannot be read: {}", code.message()));
    const std::uint64_t expected = bytes_by_header(path_, found);
    if (found >= expected) return;
    throw FileError(path_, {found, {}},
                    fmt::format("the database is cut off: expected {} bytes, found {}; the command "
                                "`.recover` of sqlite3 rescues what is left",
                                expected, found));
  }

  void restrict() {
    for (const auto& [setting, value] : {std::pair{SQLITE_DBCONFIG_DEFENSIVE, 1},
                                         {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                         {SQLITE_DBCONFIG_ENABLE_VIEW, 0},
                                         {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0}}) {
      sqlite3_db_config(database_, setting, value, nullptr);
    }
    for (const auto& [limit, value] : {std::pair{SQLITE_LIMIT_LENGTH, 1 << 28},  // bytes of a row
                                       {SQLITE_LIMIT_SQL_LENGTH, 1 << 16},
                                       {SQLITE_LIMIT_COLUMN, 1000},
                                       {SQLITE_LIMIT_EXPR_DEPTH, 20},
                                       {SQLITE_LIMIT_COMPOUND_SELECT, 2},
                                       {SQLITE_LIMIT_VDBE_OP, 10'000},
                                       {SQLITE_LIMIT_FUNCTION_ARG, 8},
                                       {SQLITE_LIMIT_ATTACHED, 0},
                                       {SQLITE_LIMIT_TRIGGER_DEPTH, 1},
                                       {SQLITE_LIMIT_WORKER_THREADS, 0}}) {
      sqlite3_limit(database_, limit, value);
    }
    sqlite3_exec(database_, "PRAGMA cell_size_check=ON; PRAGMA mmap_size=0", nullptr, nullptr,
                 nullptr);
    for (const char* ending : {"", "-wal"}) {
      std::error_code code;
      const std::uint64_t bytes = std::filesystem::file_size(path_ + ending, code);
      if (!code) file_bytes_ += bytes;
    }
    // A row of a table takes some ten instructions of SQLite and at least five bytes.
    constexpr std::uint64_t kLooksWithoutFile = 100;
    most_looks_ = kLooksWithoutFile + 4 * file_bytes_ / kInstructionsPerLook;
    sqlite3_progress_handler(
        database_, kInstructionsPerLook,
        [](void* reader) {
          auto* const self = static_cast<Database*>(reader);
          return self->progress_.cancelled() || ++self->looks_ > self->most_looks_ ? 1 : 0;
        },
        this);
  }

  std::string path_, kind_;
  Progress progress_;  ///< asked whether to go on
  sqlite3* database_ = nullptr;
  std::uint64_t looks_ = 0;  ///< of SQLite's progress, in this step
  std::uint64_t most_looks_ = 0;
  std::uint64_t file_bytes_ = 0;
};

void SqliteQuery::Finish::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

bool SqliteQuery::next(const char* what) {
  return database_->database_->step(statement_.get(), what);
}

void SqliteQuery::rewind() {
  sqlite3_reset(statement_.get());  // returns the last error again, which was reported
}

std::int64_t SqliteQuery::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::string SqliteQuery::text(int column) const {
  const unsigned char* text = sqlite3_column_text(statement_.get(), column);
  const auto bytes = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return text == nullptr ? std::string() : std::string(text, text + bytes);
}

std::span<const std::uint8_t> SqliteQuery::bytes(int column) const {
  const void* blob = sqlite3_column_blob(statement_.get(), column);
  const auto bytes = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return {static_cast<const std::uint8_t*>(blob), blob == nullptr ? 0 : bytes};
}

SqliteInput::SqliteInput(const std::string& path, std::string kind, const Progress& progress)
    : database_(std::make_unique<Database>(path, std::move(kind), progress)) {}

SqliteInput::~SqliteInput() = default;

std::uint64_t SqliteInput::file_bytes() const { return database_->file_bytes(); }

void SqliteInput::require_plain_table(const std::string& name) const {
  SqliteQuery table = query(fmt::format(
      "SELECT type, rootpage FROM sqlite_master WHERE lower(name) = lower('{}')", name));
  while (table.next("give its tables")) {
    const std::string type = table.text(0);
    if (type == "table" && table.integer(1) > 0) continue;
    fail(fmt::format("expected a table {} in the database, found a {}", name,
                     type == "table" ? "virtual table" : type));
  }
  constexpr int kNameColumn = 1, kHiddenColumn = 6;
  SqliteQuery columns = query(fmt::format("PRAGMA table_xinfo({})", sql_name(name)));
  while (columns.next("give its columns")) {
    if (columns.integer(kHiddenColumn) == 0) continue;
    fail(fmt::format("the column {} of the table {} is computed, expected a stored one",
                     columns.text(kNameColumn), name));
  }
}

SqliteQuery SqliteInput::query(const std::string& sql) const {
  return {*this, database_->prepare(sql)};
}

void SqliteInput::fail(const std::string& problem) const { database_->fail(problem); }

}  // namespace risley::tables
