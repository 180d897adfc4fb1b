// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Times are checked before use: whether the rows are in order, whether times are valid beyond a
// message, and how they are rounded.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "risley/core/saturating.hpp"
#include "risley/core/setting.hpp"

#include "recordings/reader_decorators.hpp"
#include "recordings/time_grid.hpp"
#include "recordings/time_order.hpp"

namespace risley::recordings {
namespace {

/// Number of rows judged: a second of the fastest sensor, and more.
constexpr std::size_t kRowsJudged = 1 << 18;
/// Packets have their own grid.
constexpr std::size_t kRowsOfPacketsJudged = 1 << 15;
/// Rows put on a grid together; as many are held back, so that no part is a short one.
constexpr std::size_t kRowsTogether = 1 << 17;

/// Rows of each device, in file order.
std::vector<std::vector<std::size_t>> rows_by_device(const Observations& rows) {
  std::vector<std::vector<std::size_t>> which;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (rows.device[row] >= which.size()) which.resize(rows.device[row] + std::size_t{1});
    which[rows.device[row]].push_back(row);
  }
  return which;
}

/// Corrections of one device's times.
struct DeviceTimes {
  OrderJudgement order;
  std::int64_t window_ns = 0;  ///< within which rows are mixed
  std::optional<TimeGrid> grid;
};

}  // namespace

struct TimesJudgement {
  std::vector<DeviceTimes> devices;
  bool counted = false, in_packets = false;
  bool changes = false;  ///< there is something to correct or to report
  bool none = false;     ///< all times are the same
  double counted_rate = 0;
  std::size_t rows = 0;  ///< that were judged
};

namespace {

/// Judges the first rows.
class TimesJudge {
 public:
  TimesJudge(Reader& reader, bool counted) : reader_(reader) { result_.counted = counted; }

  TimesJudgement judge(const Progress& progress) {
    const RecordingHeader& header = reader_.header();
    if (!header.has_times || header.packet_shots > 0) return {};
    Observations rows;
    look_ahead(rows, progress);
    if (result_.counted && result_.in_packets) return {};
    result_.rows = rows.size();
    std::vector<std::vector<std::size_t>> which = rows_by_device(rows);
    result_.devices.resize(std::max(header.devices.size(), which.size()));
    for (std::size_t i = 0; i < which.size(); ++i) {
      judge(rows, std::move(which[i]), result_.devices[i]);
    }
    return std::move(result_);
  }

 private:
  void look_ahead(Observations& rows, const Progress& progress) {
    Chunk chunk;
    while (rows.size() < (result_.in_packets ? kRowsOfPacketsJudged : kRowsJudged)) {
      ended_ = !reader_.read_sound(chunk);
      if (ended_) return;
      result_.in_packets = result_.in_packets || !chunk.packets.empty();
      rows.append(chunk.observations);
      progress.check();
    }
  }

  void judge(const Observations& rows, std::vector<std::size_t> which, DeviceTimes& device) {
    if (result_.in_packets) {  // writers pad packets with records without a return
      std::erase_if(which, [&rows](std::size_t row) { return rows.valid[row] == 0; });
    }
    device.order = judge_order(rows, which, result_.in_packets);
    switch (device.order.order) {
      case RowOrder::mixed: {
        const auto [first, last] = std::minmax_element(
            which.begin(), which.end(),
            [&rows](std::size_t a, std::size_t b) { return rows.time_ns[a] < rows.time_ns[b]; });
        const std::int64_t span = saturating_difference(rows.time_ns[*last], rows.time_ns[*first]);
        constexpr std::int64_t kShare = 8;
        const bool near = !ended_ && device.order.depth_ns < span / kShare;
        device.window_ns =
            near ? 2 * device.order.depth_ns : std::numeric_limits<std::int64_t>::max();
        order_by_time(rows, which);
        result_.changes = true;
        break;
      }
      case RowOrder::begins_anew:
      case RowOrder::constant:
        if (result_.counted) return;
        result_.changes = true;
        if (device.order.order == RowOrder::constant) result_.none = true;
        if (!result_.none) result_.counted_rate = 1e9 / device.order.step_ns;
        return;
      case RowOrder::overlapping:
        result_.changes = true;  // it is reported
        break;
      case RowOrder::ascending:
        break;
    }
    if (result_.in_packets || result_.counted) return;
    device.grid.emplace(rows, which);
    result_.changes = result_.changes || device.grid->warning().has_value();
  }

  Reader& reader_;
  TimesJudgement result_;
  bool ended_ = false;
};

/// Reads a recording with corrected times.
class JudgedReader final : public Reader {
 public:
  JudgedReader(std::unique_ptr<Reader> inner, std::shared_ptr<const TimesJudgement> judgement)
      : inner_(std::move(inner)),
        judgement_(std::move(judgement)),
        devices_(judgement_->devices.begin(), judgement_->devices.end()) {
    header_ = inner_->header();
    if (judgement_->none) {
      header_.has_times = false;
      header_.all_times_equal = true;
    }
    if (judgement_->counted_rate > 0) header_.counted_rate = judgement_->counted_rate;
    if (judgement_->none || judgement_->counted_rate > 0) {
      header_.time_reference = TimeReference::relative;
    }
    Chunk chunk;
    for (std::size_t rows = 0; rows < judgement_->rows && next(chunk);) {
      rows += chunk.observations.size();
      take(std::move(chunk));
    }
    settle();
    describe();
  }

  bool read(Chunk& chunk, std::size_t max_rows) override {
    chunk.clear();
    Chunk more;
    while (ready_at_ == ready_.size() && imu_.empty() && !is_at_end()) {
      if (next(more)) take(std::move(more));
      settle();
    }
    const std::size_t rows = std::min(max_rows, ready_.size() - ready_at_);
    chunk.observations.append(ready_, ready_at_, ready_at_ + rows);
    ready_at_ += rows;
    chunk.imu = std::exchange(imu_, {});
    describe();
    if (rows > 0 || !chunk.imu.empty()) return true;
    if (failure_) throw FileError(*failure_);
    return false;
  }

  double fraction_read() const override {
    const bool all_given = ready_at_ == ready_.size() && held_.size() + ordered_.size() == 0;
    return all_given ? inner_->fraction_read() : 0.5 * inner_->fraction_read();
  }

 private:
  struct Device : DeviceTimes {
    explicit Device(const DeviceTimes& judged) : DeviceTimes(judged) {}
    std::optional<std::int64_t> latest_ns;  ///< time that was read
    // Of times that begin anew:
    std::int64_t run_begin_ns = 0, last_ns = 0, run_shot = 0, last_shot = -1;
  };

  bool is_at_end() const { return ended_ || failure_; }

  /// One chunk of the inner reader. @return whether there was one
  bool next(Chunk& chunk) {
    if (is_at_end()) return false;
    try {
      if (inner_->read(chunk)) return true;
      ended_ = true;
    } catch (const FileError& error) {
      failure_.emplace(error);
    }
    return false;
  }

  /// Takes over rows of the inner reader.
  void take(Chunk&& chunk) {
    for (std::size_t row = 0; row < chunk.observations.size(); ++row) {
      Device& device = devices_[chunk.observations.device[row]];
      const std::int64_t time_ns = chunk.observations.time_ns[row];
      if (device.latest_ns && time_ns < *device.latest_ns &&
          device.order.order == RowOrder::mixed) {
        ++mixed_rows_;
      }
      device.latest_ns = std::max(device.latest_ns.value_or(time_ns), time_ns);
      if (!judgement_->counted) count(chunk.observations, row, device);
    }
    const bool anew = header_.counted_rate > 0 || !header_.has_times;
    if (anew) lost_samples_ += chunk.imu.size();
    if (!anew) imu_.insert(imu_.end(), chunk.imu.begin(), chunk.imu.end());
    held_.append(chunk.observations);
  }

  void settle() {
    order();
    put_on_grid();
  }

  /// Counts a shot whose time is uninformative.
  void count(Observations& rows, std::size_t row, Device& device) const {
    std::int64_t& time_ns = rows.time_ns[row];
    const RowOrder order = device.order.order;
    if (order != RowOrder::begins_anew && order != RowOrder::constant) {
      if (!header_.has_times) time_ns = ++device.last_shot;
      return;
    }
    const bool first = device.last_shot < 0;
    const bool further = !first && time_ns == device.last_ns && rows.return_number[row] > 1;
    if (order == RowOrder::constant || !header_.has_times) {
      if (!further) ++device.last_shot;
      device.last_ns = time_ns;
      time_ns = device.last_shot;
      return;
    }
    if (first || time_ns < device.last_ns) {
      device.run_begin_ns = time_ns;
      device.run_shot = device.last_shot + 1;
    }
    device.last_ns = time_ns;
    if (!further) {
      const auto since = static_cast<double>(saturating_difference(time_ns, device.run_begin_ns));
      device.last_shot = device.run_shot + std::llround(since / device.order.step_ns);
    }
    time_ns = std::llround(static_cast<double>(device.last_shot) * device.order.step_ns);
  }

  /// Releases rows before which no other can come.
  void order() {
    const bool all = is_at_end();
    std::vector<std::size_t> kept;
    const auto which = rows_by_device(held_);
    for (std::size_t i = 0; i < which.size(); ++i) {
      const Device& device = devices_[i];
      if (device.order.order != RowOrder::mixed) {
        ordered_.append(held_, which[i]);
        continue;
      }
      const std::int64_t until = saturating_difference(*device.latest_ns, device.window_ns);
      std::vector<std::size_t> given;
      for (const std::size_t row : which[i]) {
        (all || held_.time_ns[row] <= until ? given : kept).push_back(row);
      }
      order_by_time(held_, given);
      ordered_.append(held_, given);
    }
    if (kept.empty()) {
      held_.clear();
      return;
    }
    std::sort(kept.begin(), kept.end());
    Observations rest;
    rest.append(held_, kept);
    held_ = std::move(rest);
  }

  void put_on_grid() {
    const bool all = is_at_end();
    const bool any = std::any_of(devices_.begin(), devices_.end(), [](const Device& device) {
      return device.grid && device.grid->is_needed();
    });
    std::size_t done = ordered_.size();
    if (any && !all) {
      if (ordered_.size() < 2 * kRowsTogether) return;
      done -= kRowsTogether;
    }
    Observations rows;
    rows.append(ordered_, 0, done);
    ordered_.drop_front(done);
    const auto which = rows_by_device(rows);
    for (std::size_t i = 0; i < which.size(); ++i) {
      if (devices_[i].grid) off_grid_ += devices_[i].grid->apply(rows, which[i]);
    }
    ready_.drop_front(ready_at_);
    ready_at_ = 0;
    ready_.append(rows);
  }

  /// Warnings of the inner reader, and those added here.
  void describe() {
    warnings_ = inner_->warnings();
    clock_wraps_ = inner_->clock_wraps();
    if (mixed_rows_ > 0) {
      warn(kWarning.rows_sorted,
           "{} rows are earlier than one before them: the rows are not in firing order, and were "
           "sorted by their times",
           mixed_rows_);
    }
    for (const Device& device : devices_) {
      if (device.order.order == RowOrder::begins_anew && !judgement_->counted) {
        warn(kWarning.times_corrected,
             "times restart with every message or packet and are valid only within one: shots were "
             "counted in the order of the file, at the {:.6g} shots per second within messages; {} "
             "names another rate",
             1e9 / device.order.step_ns, name_of(kSetting.shot_rate));
      } else if (device.order.order == RowOrder::constant && !judgement_->counted) {
        warn(kWarning.no_shot_times,
             "all times are the same and carry no information: shots are numbered in the order of "
             "the "
             "file; {} counts their times",
             name_of(kSetting.shot_rate));
      } else if (device.order.order == RowOrder::overlapping) {
        warn(kWarning.devices_unclear,
             "pieces of the recording begin within the time of those before them: several sensors "
             "seem to share one stream, and nothing in the file distinguishes them");
      } else if (device.grid) {
        if (auto warning = device.grid->warning()) warnings_.push_back(std::move(*warning));
      }
    }
    if (off_grid_ > 0) {
      warn(kWarning.times_corrected,
           "{} shots are not on that grid, and their times were left unchanged", off_grid_);
    }
    if (judgement_->in_packets) {
      warn(kWarning.content_left_out,
           "packet headers hold the uncorrected times, and were dropped");
    }
    if (lost_samples_ > 0) {
      warn(kWarning.content_left_out,
           "inertial samples were dropped: their times cannot be compared with those of counted "
           "shots")
          .lost_records = lost_samples_;
    }
  }

  std::unique_ptr<Reader> inner_;
  std::shared_ptr<const TimesJudgement> judgement_;
  bool ended_ = false;
  std::optional<FileError> failure_;
  std::vector<Device> devices_;
  Observations held_, ordered_, ready_;  ///< as read; in order; on the grid
  std::vector<ImuSample> imu_;
  std::size_t ready_at_ = 0;  ///< of these given
  std::uint64_t mixed_rows_ = 0, off_grid_ = 0, lost_samples_ = 0;
};

}  // namespace

std::shared_ptr<const TimesJudgement> judge_times(Reader& reader, bool counted,
                                                  const Progress& progress) {
  return std::make_shared<const TimesJudgement>(TimesJudge(reader, counted).judge(progress));
}

std::unique_ptr<Reader> with_judged_times(const std::function<std::unique_ptr<Reader>()>& open,
                                          std::shared_ptr<const TimesJudgement> judgement) {
  if (!judgement->changes) return open();
  return std::make_unique<JudgedReader>(open(), std::move(judgement));
}

}  // namespace risley::recordings
