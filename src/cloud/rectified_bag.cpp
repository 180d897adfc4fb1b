// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/rectified_bag.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <vector>

#include <fmt/format.h>

#include "risley/bags/bag_writer.hpp"
#include "risley/bags/messages.hpp"
#include "risley/core/vector3.hpp"

namespace risley::cloud {
namespace {

/// No point is moved further from its position in the message: beyond this it is another point.
constexpr double kFarthest = 0.3, kFarthestAngle = 0.05;  // m and rad

struct RowPoint {
  std::int64_t row = 0;
  std::array<double, 3> xyz{};
};

bool is_return(const std::array<double, 3>& p) {
  const double square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
  return std::isfinite(square) && square > 0;
}

}  // namespace

class RectifiedBag::Work {
 public:
  Work(const std::string& input, std::string topic, const std::string& output, bags::BagKind kind,
       const Progress& progress)
      : bag_(bags::open_bag(input, progress)),
        writer_(bags::create_bag(output, kind)),
        topic_(std::move(topic)) {
    for (const bags::Topic& one : bag_->topics()) {
      writer_->add(one);
      const bool is_lidar = one.name == topic_ && (one.kind == bags::MessageKind::points ||
                                                   one.kind == bags::MessageKind::cloud);
      is_lidar_.push_back(is_lidar);
    }
    if (std::ranges::count(is_lidar_, true) != 1) {
      throw InvalidArgument(fmt::format("{}: expected one topic {} of lidar points, found {}",
                                        input, topic_, bags::words_of(bag_->topics())));
    }
    bag_->rewind(std::vector<bool>(bag_->topics().size(), true));
    find_lidar_message();
  }

  void add(const Points& points) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::int64_t row = points.row[i];
      while (held_ && row >= end_row_) put_lidar_message();
      points_.push_back({row, {points.x[i], points.y[i], points.z[i]}});
    }
  }

  void close() {
    while (held_) put_lidar_message();
    writer_->close();
  }

  const std::optional<FileError>& damage() const { return damage_; }

 private:
  /// Copies messages up to the next one of the lidar, which is held until its points are there.
  void find_lidar_message() {
    held_ = false;
    while (sound([this] { return bag_->next(message_); })) {
      if (is_lidar_[message_.topic]) {
        held_ = sound([this] { return hold(); });
        return;
      }
      writer_->write(message_.topic, message_);
    }
  }

  /// Reads something from the old bag. @return false also at damage, which ends it
  template <class Take>
  bool sound(const Take& take) {
    try {
      return take();
    } catch (const FileError& error) {
      damage_ = error;
      return false;
    }
  }

  bool hold() {
    const bags::Topic& topic = bag_->topics()[message_.topic];
    bytes_.assign(message_.bytes.begin(), message_.bytes.end());
    try {
      places_ = bags::point_places(*topic.kind, topic.serialisation, bytes_);
    } catch (const bags::BadMessage& bad) {
      bag_->fail(message_, bad.what());
    }
    if (lidar_id_ && places_.lidar_id != *lidar_id_ && places_.count > 0) {
      throw InvalidArgument(fmt::format(
          "{}: several lidars share the topic {} (numbers {} and {}), and one is needed here",
          bag_->path(), topic_, *lidar_id_, places_.lidar_id));
    }
    lidar_id_ = places_.lidar_id;
    first_row_ = end_row_;
    end_row_ += static_cast<std::int64_t>(places_.count);
    return true;
  }

  void put_lidar_message() {
    for (std::int64_t row = first_row_; row < end_row_; ++row) {
      const auto place = static_cast<std::size_t>(row - first_row_);
      const std::array<double, 3> before = bags::load_point(places_, place, bytes_);
      std::array<double, 3> after{};
      if (!points_.empty() && points_.front().row == row) {
        after = points_.front().xyz;
        points_.pop_front();
        require_near(before, after, row);
      } else if (!is_return(before)) {
        continue;
      }
      bags::store_point(places_, place, after, bytes_);
    }
    message_.bytes = bytes_;
    writer_->write(message_.topic, message_);
    find_lidar_message();
  }

  void require_near(const std::array<double, 3>& before, const std::array<double, 3>& after,
                    std::int64_t row) const {
    const double distance =
        std::hypot(after[0] - before[0], after[1] - before[1], after[2] - before[2]);
    const double range = std::hypot(before[0], before[1], before[2]);
    if (distance <= kFarthest + kFarthestAngle * range) return;
    throw InvalidArgument(fmt::format(
        "{}: point {} of topic {} would be moved by {:.3g} m at a range of {:.3g} m, allowed up to "
        "{} m and {} rad: it does not match the calibrated point, because the points are not in "
        "firing order or were moved or mirrored; write a cloud without replacing the topic",
        bag_->path(), row, topic_, distance, range, kFarthest, kFarthestAngle));
  }

  std::unique_ptr<bags::Bag> bag_;
  std::unique_ptr<bags::BagWriter> writer_;
  std::string topic_;
  std::vector<bool> is_lidar_;  ///< by topic
  std::deque<RowPoint> points_;
  bool held_ = false;  ///< a message of the lidar waits for its points
  bags::Message message_;
  std::vector<std::uint8_t> bytes_;  ///< of it
  bags::PointPlaces places_;
  std::int64_t first_row_ = 0, end_row_ = 0;  ///< of it
  std::optional<std::uint8_t> lidar_id_;
  std::optional<FileError> damage_;
};

RectifiedBag::RectifiedBag(const std::string& input, const std::string& topic,
                           const std::string& output, bags::BagKind kind, const Progress& progress)
    : work_(std::make_unique<Work>(input, topic, output, kind, progress)) {}
RectifiedBag::~RectifiedBag() = default;

void RectifiedBag::write(const Points& points) { work_->add(points); }

void RectifiedBag::close() { work_->close(); }

const std::optional<FileError>& RectifiedBag::damage() const { return work_->damage(); }

}  // namespace risley::cloud
