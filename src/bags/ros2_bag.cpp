// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Bags of ROS 2 as rosbag2 stores them by default: a SQLite database whose messages are in CDR.
// Messages come in the order of their ids, which is that of recording. The database is opened so
// that nothing is written beside it, unless SQLite's own files there hold a part of it. It comes
// from anywhere: only plain tables are read, and no step may take longer than a table of the file's
// size can need.
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sqlite3.h>

#include "risley/bags/bag.hpp"
#include "risley/core/error.hpp"

#include "bags/bag_kinds.hpp"

namespace risley::bags {
namespace {

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};
struct FinishStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Database = std::unique_ptr<sqlite3, CloseDatabase>;
using Statement = std::unique_ptr<sqlite3_stmt, FinishStatement>;

/// A file's path as a URI of SQLite that promises that the file does not change.
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

/// Bytes that a database should have by its header: those of its pages, as far as it says.
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

class Ros2Bag final : public Bag {
 public:
  Ros2Bag(const std::string& path, const Progress& progress) : Bag(BagKind::ros2, path, progress) {
    open_database();
    restrict_database();
    require_plain_table("topics");
    require_plain_table("messages");
    find_topics();
    find_ids();
    messages_ = prepare("SELECT id, topic_id, data FROM messages ORDER BY id");
  }

  void rewind(const std::vector<bool>& wanted) override {
    require_topics(wanted);
    wanted_ = wanted;
    sqlite3_reset(messages_.get());  // returns the last error again, which was reported
    id_ = first_id_;
    any_read_ = false;
    blob_bytes_ = 0;
    ended_ = false;
  }

  bool next(Message& message) override {
    if (ended_) return false;  // stepping again would begin anew
    while (step(messages_.get(), "be read to its end")) {
      progress_.check();
      const sqlite3_int64 id = sqlite3_column_int64(messages_.get(), 0);
      if (any_read_ && id <= id_) {  // pages that stand in the table again and again
        fail(fmt::format("message row {} follows row {}, expected ascending numbers", id, id_));
      }
      id_ = id;
      any_read_ = true;
      const auto topic = topic_of(sqlite3_column_int64(messages_.get(), 1));
      if (!topic) continue;
      message.topic = *topic;
      const void* blob = sqlite3_column_blob(messages_.get(), 2);
      const auto bytes = static_cast<std::size_t>(sqlite3_column_bytes(messages_.get(), 2));
      blob_bytes_ += bytes;
      if (blob_bytes_ > file_bytes_) {  // pages that stand in several messages
        fail(fmt::format("the messages up to row {} have {} bytes, but the database only {}", id_,
                         blob_bytes_, file_bytes_));
      }
      message.number = id;
      message.bytes = {static_cast<const std::uint8_t*>(blob), blob == nullptr ? 0 : bytes};
      return true;
    }
    ended_ = true;
    return false;
  }

  double fraction_read() const override {
    if (ended_ || last_id_ <= first_id_) return ended_ ? 1.0 : 0.0;
    const double part = (static_cast<double>(id_) - static_cast<double>(first_id_)) /
                        (static_cast<double>(last_id_) - static_cast<double>(first_id_));
    return std::min(std::max(part, 0.0), 1.0);
  }

 private:
  [[noreturn]] void fail_database(const char* what) const {
    progress_.check();
    fail(fmt::format("the database cannot {}: {}", what,
                     database_ ? sqlite3_errmsg(database_.get()) : "no memory"));
  }

  void open_database() {
    const bool as_it_is = has_journal(path_);
    const std::string name = as_it_is ? path_ : immutable_uri(path_);
    sqlite3* database = nullptr;
    const int flags = SQLITE_OPEN_READONLY | (as_it_is ? 0 : SQLITE_OPEN_URI);
    const int result = sqlite3_open_v2(name.c_str(), &database, flags, nullptr);
    database_.reset(database);
    if (result != SQLITE_OK) fail_database("be opened");
    if (!as_it_is) require_all_pages();
  }

  /// SQLite reads what is missing at the end as zeros, which would make points of them.
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

  /// Nothing that the file brings along is run, and nothing takes more than a bag needs.
  void restrict_database() {
    sqlite3* const database = database_.get();
    for (const auto& [setting, value] : {std::pair{SQLITE_DBCONFIG_DEFENSIVE, 1},
                                         {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                         {SQLITE_DBCONFIG_ENABLE_VIEW, 0},
                                         {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0}}) {
      sqlite3_db_config(database, setting, value, nullptr);
    }
    for (const auto& [limit, value] :
         {std::pair{SQLITE_LIMIT_LENGTH, 1 << 28},  // bytes of a message
          {SQLITE_LIMIT_SQL_LENGTH, 1 << 16},
          {SQLITE_LIMIT_COLUMN, 100},
          {SQLITE_LIMIT_EXPR_DEPTH, 20},
          {SQLITE_LIMIT_COMPOUND_SELECT, 2},
          {SQLITE_LIMIT_VDBE_OP, 10'000},
          {SQLITE_LIMIT_FUNCTION_ARG, 8},
          {SQLITE_LIMIT_ATTACHED, 0},
          {SQLITE_LIMIT_TRIGGER_DEPTH, 1},
          {SQLITE_LIMIT_WORKER_THREADS, 0}}) {
      sqlite3_limit(database, limit, value);
    }
    sqlite3_exec(database, "PRAGMA cell_size_check=ON; PRAGMA mmap_size=0", nullptr, nullptr,
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
        database, kInstructionsPerLook,
        [](void* reader) {
          auto* const self = static_cast<Ros2Bag*>(reader);
          return self->progress_.cancelled() || ++self->looks_ > self->most_looks_ ? 1 : 0;
        },
        this);
  }

  /// A view, a virtual table or a generated column could make more of the file than it holds.
  void require_plain_table(const char* name) const {
    const Statement table = prepare(
        fmt::format("SELECT type, rootpage FROM sqlite_master WHERE lower(name) = '{}'", name));
    while (step(table.get(), "give its tables")) {
      const std::string type = text_column(table.get(), 0);
      if (type == "table" && sqlite3_column_int64(table.get(), 1) > 0) continue;
      fail(fmt::format("expected a table {} in the database, found a {}", name,
                       type == "table" ? "virtual table" : type));
    }
    constexpr int kNameColumn = 1, kHiddenColumn = 6;
    const Statement columns = prepare(fmt::format("PRAGMA table_xinfo({})", name));
    while (step(columns.get(), "give its columns")) {
      if (sqlite3_column_int(columns.get(), kHiddenColumn) == 0) continue;
      fail(fmt::format("the column {} of the table {} is computed, expected a stored one",
                       text_column(columns.get(), kNameColumn), name));
    }
  }

  Statement prepare(const std::string& query) const {
    looks_ = 0;
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), query.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
      fail_database("be read as a ROS 2 bag");
    }
    return Statement(statement);
  }

  bool step(sqlite3_stmt* statement, const char* what) const {
    looks_ = 0;
    const int result = sqlite3_step(statement);
    if (result == SQLITE_ROW) return true;
    if (result == SQLITE_INTERRUPT) {
      progress_.check();
      fail(fmt::format("the database cannot {}: it takes more steps than a bag of its size needs",
                       what));
    }
    if (result != SQLITE_DONE) fail_database(what);
    return false;
  }

  static std::string text_column(sqlite3_stmt* statement, int column) {
    const unsigned char* text = sqlite3_column_text(statement, column);
    const auto bytes = static_cast<std::size_t>(sqlite3_column_bytes(statement, column));
    return text == nullptr ? std::string() : std::string(text, text + bytes);
  }

  void find_topics() {
    const Statement query =
        prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY name, id");
    while (step(query.get(), "give its topics")) {
      Topic topic;
      topic.name = text_column(query.get(), 1);
      topic.type = text_column(query.get(), 2);
      topic.kind = ros2_kind(topic.type);
      topic.serialisation = Serialisation::cdr;
      const std::string serialization = text_column(query.get(), 3);
      if (topic.kind && serialization != "cdr") {
        topic.kind.reset();
        topic.type += fmt::format(", stored as \"{}\" instead of cdr", serialization);
      }
      ids_.push_back(sqlite3_column_int64(query.get(), 0));
      topics_.push_back(std::move(topic));
    }
  }

  void find_ids() {
    // Each alone is found at one end of the table.
    const Statement first = prepare("SELECT MIN(id) FROM messages");
    const Statement last = prepare("SELECT MAX(id) FROM messages");
    // A damaged end is no reason to keep back what stands in front of it.
    looks_ = 0;
    if (sqlite3_step(first.get()) == SQLITE_ROW) first_id_ = sqlite3_column_int64(first.get(), 0);
    if (sqlite3_step(last.get()) == SQLITE_ROW) last_id_ = sqlite3_column_int64(last.get(), 0);
    progress_.check();
    id_ = first_id_;
  }

  std::optional<std::size_t> topic_of(sqlite3_int64 id) const {
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      if (ids_[i] == id && wanted_[i]) return i;
    }
    return std::nullopt;
  }

  static constexpr int kInstructionsPerLook = 10'000;  ///< of SQLite's machine

  Database database_;
  mutable std::uint64_t looks_ = 0;  ///< of SQLite's progress, in this step
  std::uint64_t most_looks_ = 0;
  std::uint64_t file_bytes_ = 0;
  std::uint64_t blob_bytes_ = 0;    ///< of the messages read so far
  bool any_read_ = false;           ///< and id_ is that of the last message
  std::vector<sqlite3_int64> ids_;  ///< by topic
  std::vector<bool> wanted_;        ///< by topic
  sqlite3_int64 first_id_ = 0, last_id_ = 0, id_ = 0;
  bool ended_ = false;
  Statement messages_;  // after database_: finished before it is closed
};

}  // namespace

std::unique_ptr<Bag> open_ros2_bag(const std::string& path, const Progress& progress) {
  return std::make_unique<Ros2Bag>(path, progress);
}

}  // namespace risley::bags
