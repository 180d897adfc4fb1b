// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "recordings/format_tests.hpp"
#include "recordings/ros2_messages.hpp"

namespace risley::recordings::ros2_bag_test {

using namespace ros2_messages;
using namespace format_tests;
using ::testing::AllOf;
using ::testing::ElementsAre;

struct Bag : Ros2BagFile {
  std::string bytes() const {
    const TestFolder folder;
    write(folder.file("bag")).reset();
    return get_bytes(folder.file("bag"));
  }
  Outcome read(std::size_t chunk_rows = kDefaultChunkRows) const {
    return read_text(kRos2BagFormat, bytes(), chunk_rows);
  }
};

Bag small_bag() { return {small_ros2_bag()}; }

TEST(Ros2Bag, ReadsEveryColumn) {
  for (const bool big_endian : {false, true}) {
    for (const char* type : {kCustomType, "livox_interfaces/msg/CustomMsg"}) {
      Bag bag;
      const std::size_t lidar = bag.topic(kTopic, type);
      bag.add(lidar, custom(kUtc, kFirstPoints, 0, big_endian));
      bag.add(lidar, custom(kUtc + 30'000, kNextPoints, 0, big_endian));
      expect_those_points(bag.read(), "ros2-bag");
    }
  }
}

TEST(Ros2Bag, Clouds) {
  Bag bag;
  const std::size_t lidar = bag.topic("/points", kCloudType);
  for (std::uint64_t i = 0; i < 3; ++i) bag.add(lidar, cloud(kUtc + i * 1'000'000, 240));
  const Outcome outcome = bag.read();
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  ASSERT_EQ(outcome.rows().size(), 720U);
  EXPECT_TRUE(outcome.recording.header.has_intensity);
  for (std::size_t i = 0; i < 720; ++i) {
    ASSERT_EQ(outcome.rows().range[i], 5.0);
    ASSERT_EQ(outcome.rows().intensity[i], i % 240);
    ASSERT_EQ(outcome.rows().tag[i], 0);
    ASSERT_EQ(outcome.rows().time_ns[i],
              static_cast<std::int64_t>(kUtc) + std::llround(static_cast<double>(i) * 12'500 / 3));
  }
  EXPECT_EQ(outcome.recording.warnings.size(), 1U);
}

TEST(Ros2Bag, InertialSamplesAndMessagesStayWhole) {
  const TestFolder folder;
  const std::string path = folder.file("input.db3");
  small_bag().write(path).reset();
  const auto reader = open_recording(path);
  Chunk chunk;
  std::vector<ImuSample> samples;
  std::size_t rows = 0;
  double fraction = 0.0;
  while (reader->read(chunk, 30)) {
    EXPECT_EQ(chunk.observations.size() % 20, 0U);
    EXPECT_LE(chunk.observations.size(), 49U);
    EXPECT_GE(reader->fraction_read(), fraction);
    fraction = reader->fraction_read();
    rows += chunk.observations.size();
    samples.insert(samples.end(), chunk.imu.begin(), chunk.imu.end());
  }
  EXPECT_FALSE(reader->read(chunk, 30));
  EXPECT_EQ(rows, 120U);
  EXPECT_EQ(fraction, 1.0);
  ASSERT_EQ(samples.size(), 6U);
  EXPECT_EQ(samples[1].time_ns, static_cast<std::int64_t>(kPowerOn) + 200'000);
  EXPECT_THAT(samples[1].angular_velocity, ElementsAre(0.25F, -0.5F, 0.125F));
  EXPECT_THAT(samples[1].acceleration_g, ElementsAre(0.0625F, -0.03125F, 1.0F));
  EXPECT_EQ(folder.names().size(), 1U);  // nothing was written beside it
}

TEST(Ros2Bag, ReadsWhatIsStillInTheJournal) {
  const TestFolder folder;
  const std::string path = folder.file("a b?c#d%41.db3");
  Bag bag = small_bag();
  bag.pragma = "PRAGMA journal_mode=WAL;";
  auto database = bag.write(path);
  EXPECT_EQ(read_all(kRos2BagFormat, path).rows().size(), 120U);
  database.reset();
  EXPECT_EQ(folder.names().size(), 1U);
  EXPECT_EQ(read_all(kRos2BagFormat, path).rows().size(), 120U);
  EXPECT_EQ(folder.names().size(), 1U);
}

TEST(Ros2Bag, WithoutLidarMessages) {
  expect_damage(Bag().read(), NamesField("topic"));

  Bag bag;
  bag.topic("/imu", kImuType);
  bag.topic(kTopic, kCustomType, "protobuf");
  const Outcome other = bag.read();
  ASSERT_TRUE(other.error);
  EXPECT_FALSE(other.opened);
  EXPECT_THAT(other.error->problem(), NamesField("/imu (sensor_msgs/msg/Imu)"));
  EXPECT_THAT(other.error->problem(), NamesField("\"protobuf\""));

  bag.topic("/points", kCloudType);
  const Outcome no_message = bag.read();
  EXPECT_FALSE(no_message.error);
  EXPECT_EQ(no_message.rows().size(), 0U);
}

TEST(Ros2Bag, OtherDatabasesAreRefused) {
  const TestFolder folder;
  const std::string path = folder.file("other.db3");
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  sqlite3_exec(database, "CREATE TABLE topics(id, title)", nullptr, nullptr, nullptr);
  sqlite3_close(database);
  const Outcome outcome = read_all(kRos2BagFormat, path);
  expect_damage(outcome, NamesField("ROS 2 bag"));
}

TEST(Ros2Bag, DamagedMessagesAreNamed) {
  struct Case {
    const char* name;
    std::string message;
    const char* named;
  };
  const std::string sound = custom(kPowerOn, shots(4));
  std::vector<Case> cases;
  cases.push_back({"count", custom(kPowerOn, shots(4), 1), "5 points of at least 19"});
  cases.push_back({"huge", custom(kPowerOn, shots(4), 4'294'967'000), "4294967004 points"});
  cases.push_back({"time", custom(~std::uint64_t{0}, shots(4)), "2200"});
  cases.push_back({"nan", custom(kPowerOn, {{0, std::nanf(""), 0.0F, 0.0F}}), "point 1"});
  cases.push_back({"nothing", "", "CDR"});
  cases.push_back({"mark", sound, "CDR"});
  cases.back().message[1] = '\7';
  for (std::size_t length = 4; length + 3 < sound.size(); length += 3) {
    cases.push_back({"cut", sound.substr(0, length), "expected"});
  }
  for (const Case& c : cases) {
    for (const std::size_t chunk_rows : {std::size_t{1}, kDefaultChunkRows}) {
      SCOPED_TRACE(c.name);
      Bag bag;
      const std::size_t lidar = bag.topic(kTopic, kCustomType);
      bag.add(lidar, sound);
      bag.add(lidar, c.message);
      bag.add(lidar, sound);
      const Outcome outcome = bag.read(chunk_rows);
      expect_damage(outcome,
                    AllOf(NamesField("message row 2 of topic /livox/lidar"), NamesField(c.named)),
                    4);
    }
  }
  Bag bag;
  const std::size_t lidar = bag.topic(kTopic, kCloudType);
  bag.add(lidar, cloud(kPowerOn, 4, 4000));
  expect_damage(bag.read(), AllOf(NamesField("message row 1"), NamesField("4000 values")));
}

TEST(Ros2Bag, CutAnywhere) {
  const std::string bytes = small_bag().bytes();
  for (std::size_t length = 0; length < bytes.size(); length += 97) {
    SCOPED_TRACE(length);
    expect_damage(read_text(kRos2BagFormat, std::string_view(bytes).substr(0, length)),
                  NamesField("cut off"), 0, length);
  }
}

TEST(Ros2Bag, SurvivesAnyChangedByte) {
  const std::string bytes = small_bag().bytes();
  for (std::size_t at = 16; at < bytes.size(); at += 13) {
    SCOPED_TRACE(at);
    std::string changed = bytes;
    changed[at] = static_cast<char>(changed[at] ^ (1 << (at % 8)));
    ASSERT_LE(read_text(kRos2BagFormat, changed).rows().size(), 1000U);
  }
}

/// A bag whose tables are changed by hand before it is read.
Outcome read_changed(const std::string& sql, const Bag& bag = small_bag()) {
  const TestFolder folder;
  const std::string path = folder.file("input.db3");
  const auto database = bag.write(path);
  char* message = nullptr;
  EXPECT_EQ(sqlite3_exec(database.get(), sql.c_str(), nullptr, nullptr, &message), SQLITE_OK)
      << message;
  return read_all(kRos2BagFormat, path);
}

/// Expects a bag whose tables were changed to be given up at once when that is asked for.
void expect_cancelled(const std::string& sql, bool while_opened) {
  const TestFolder folder;
  const std::string path = folder.file("input.db3");
  const auto database = small_bag().write(path);
  ASSERT_EQ(sqlite3_exec(database.get(), sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
  CancelFlag flag;
  const Progress progress([](double) {}, &flag);
  if (while_opened) {
    flag.set();
    EXPECT_THROW(open_recording(path, {}, progress), Cancelled);
    return;
  }
  const auto reader = open_recording(path, {}, progress);
  flag.set();
  Chunk chunk;
  EXPECT_THROW(reader->read(chunk), Cancelled);
}

TEST(Ros2Bag, CanBeCancelledWithinSqlite) {
  const std::string many =
      "WITH RECURSIVE c(n) AS (SELECT 1000 UNION ALL SELECT n + 1 FROM c WHERE n < 60000)"
      " INSERT INTO messages(id, topic_id, timestamp, data) SELECT n, 99, n, x'00' FROM c;";
  expect_cancelled(many, false);  // messages of others
  // Numbers that are no key have to be looked for in the whole table.
  expect_cancelled(
      "ALTER TABLE messages RENAME TO m; CREATE TABLE messages(id, topic_id, timestamp, data);" +
          many,
      true);
}

TEST(Ros2Bag, OnlyStoredTablesAreRead) {
  const Outcome endless = read_changed(
      "ALTER TABLE messages RENAME TO m;"
      "CREATE VIEW messages AS WITH RECURSIVE c(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM c)"
      " SELECT id, 10 AS topic_id, 0 AS timestamp, (SELECT data FROM m WHERE m.id = 2) AS data"
      " FROM c");
  ASSERT_TRUE(endless.error);
  EXPECT_FALSE(endless.opened);
  EXPECT_THAT(endless.error->problem(), NamesField("table messages"));
  EXPECT_THAT(endless.error->problem(), NamesField("view"));

  const Outcome topics =
      read_changed("ALTER TABLE topics RENAME TO t; CREATE VIEW Topics AS SELECT * FROM t");
  expect_damage(topics, NamesField("table topics"));

  const Outcome computed = read_changed(
      "ALTER TABLE messages RENAME TO m; CREATE TABLE messages(id INTEGER PRIMARY KEY,"
      " topic_id INTEGER, data BLOB AS (zeroblob(1000000)) VIRTUAL);"
      "INSERT INTO messages(topic_id) SELECT topic_id FROM m");
  expect_damage(computed, NamesField("column data of the table messages"));
}

TEST(Ros2Bag, MessagesOutOfOrderAreDamage) {
  // Numbers that are no key can stand twice, as those of a page that stands twice in its table do.
  const Outcome outcome = read_changed(
      "ALTER TABLE messages RENAME TO m; CREATE TABLE messages(id, topic_id, timestamp, data);"
      "INSERT INTO messages SELECT * FROM m; INSERT INTO messages SELECT * FROM m WHERE id > 4");
  expect_damage(outcome, NamesField("message row 5"), 40);
}

}  // namespace risley::recordings::ros2_bag_test
