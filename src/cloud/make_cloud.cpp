// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/make_cloud.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/require.hpp"
#include "risley/core/saturating.hpp"
#include "risley/core/square.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/trajectories/clock.hpp"

#include "cloud/keep_rows.hpp"
#include "cloud/piece_overlap.hpp"
#include "cloud/shot_surfaces.hpp"

namespace risley::cloud {
namespace {

using recordings::Observations;

/// Rows at the beginning used for the sensor's belief: ten seconds of a Mid-40, see
/// docs/theory/cloud.md.
constexpr std::size_t kBeginningRows = std::size_t{1} << 20;
/// Enough shots of it: the believed parameters move points by far less than the calibration.
constexpr std::size_t kBeliefShots = std::size_t{1} << 18;
/// Rows processed together: some seconds, so that the start of each piece costs little.
constexpr std::size_t kPieceRows = std::size_t{1} << 18;
/// The same if no rotation angles are needed: enough for a surface.
constexpr std::size_t kReportedRows = std::size_t{1} << 16;
/// For a running sensor: duration of the analysis before there are points, and time before a chunk
/// for which the rotors are followed, ns.
constexpr std::int64_t kLiveBeginningNs = 1'000'000'000, kLiveOverlapNs = 3 * kOverlapNs;
/// Rows of one task: the sixty columns of a moving sensor are 1 MB.
constexpr std::size_t kBlockRows = 2048;
/// Directions beyond are damaged records: the rotors' motion is found without them, too.
const double kOutlierChi2 = estimation::BatchMapOptions{}.outlier_chi2;

/// Rows of a piece being processed.
struct RowBlock {
  std::vector<std::size_t> rows;
  std::vector<std::uint8_t> returns;  ///< of each row's shot
  PointedShots shots;
  Points points;
  SensorPoses poses;  ///< of the rows, of a moving sensor
  std::uint64_t outliers = 0, without_rotation_angle = 0, without_pose = 0;
  double azimuth_squares = 0, zenith_squares = 0;
};

/// All returns of a shot are adjacent.
bool same_shot(const Observations& o, std::size_t a, std::size_t b) {
  return o.time_ns[a] == o.time_ns[b] && o.return_number[a] != o.return_number[b];
}

/// Observations processed together.
struct Piece {
  Observations rows;
  std::size_t done = 0, end = 0;  ///< rows [done, end) become points, the others are context for
                                  ///< them
  std::uint64_t first_row = 0;    ///< number of the first observation
  bool more = false;              ///< the recording goes on
  std::unique_ptr<RotorTracker> tracker;  ///< where rotation angles are needed
  std::optional<std::string> failure;     ///< why there are none
};

}  // namespace

class CloudMaker::Work {
 public:
  Work(recordings::Reader& reader, const sensors::Sensor& calibration, CloudSink sink,
       const CloudOptions& options, const Progress& progress)
      : reader_(reader),
        calibration_(calibration),
        sink_(std::move(sink)),
        options_(options),
        progress_(progress),
        rotors_(needs_rotation_angles(calibration, options.pointing)) {
    check_sensor();
    summary_.slips = reader_.header().slips;
  }

  bool next() {
    if (finished_) return false;
    if (!writer_) {
      piece_ = first_piece();
    } else if (options_.live) {
      std::unique_ptr<Piece> next;
      if (piece_->more) next = piece_after(*piece_);
      spare_ = std::move(piece_->rows);
      piece_ = std::move(next);
    }
    if (!piece_) {
      finish();
      finished_ = true;
      return false;
    }
    if (options_.live) {  // there is no time for the next rows
      emit();
      writer_->end_message();
      return true;
    }
    // While the points of one piece are made and written, the next is read and its rotors tracked.
    std::unique_ptr<Piece> next;
    parallel::TaskGroup ahead;
    if (piece_->more) ahead.run([&] { next = piece_after(*piece_); });
    emit();
    ahead.wait();
    spare_ = std::move(piece_->rows);
    piece_ = std::move(next);
    return true;
  }

  const CloudSummary& summary() const { return summary_; }

 private:
  void check_sensor() const {
    recordings::require_one_device(reader_.header(), "the recording");
    const auto& devices = reader_.header().devices;
    const std::string& serial = devices.front().serial;
    if (!serial.empty() && !calibration_.serial.empty() && serial != calibration_.serial) {
      throw InvalidArgument(fmt::format(
          "a calibration of another sensor: its serial number is {}, the recording's {}",
          calibration_.serial, serial));
    }
    if (!reader_.header().has_range) {
      throw InvalidArgument("the recording has no ranges, so it has no points");
    }
    recordings::require_times(reader_.header());
  }

  /// @return nothing if the recording is empty
  std::unique_ptr<Piece> first_piece() {
    auto piece = std::make_unique<Piece>();
    // Growing at the end would copy everything: the last chunk may hold more than requested,
    // packets stay complete.
    piece->rows.reserve((rotors_ ? kBeginningRows : kReportedRows) +
                        2 * recordings::kDefaultChunkRows);
    fill(*piece);
    if (piece->rows.size() == 0) return nullptr;
    set_up(*piece);
    prepare(*piece);
    return piece;
  }

  /// @return nothing where nothing is left
  std::unique_ptr<Piece> piece_after(const Piece& before) {
    auto piece = std::make_unique<Piece>();
    piece->rows = std::move(spare_);
    const std::size_t keep =
        rotors_ || options_.live
            ? overlap_begin(before.rows.time_ns, std::max(before.end, std::size_t{1}),
                            options_.live ? kLiveOverlapNs : kOverlapNs)
            : before.end;
    piece->rows.clear();
    piece->rows.append(before.rows, keep, before.rows.size());
    piece->done = before.end - keep;
    piece->first_row = before.first_row + keep;
    if (before.tracker) piece->tracker = std::make_unique<RotorTracker>(*before.tracker);
    fill(*piece);
    if (piece->rows.size() == piece->done) return nullptr;
    prepare(*piece);
    return piece;
  }

  /// Reads until a piece is full.
  void fill(Piece& piece) {
    recordings::Chunk chunk;
    piece.more = true;
    while (!is_full(piece)) {
      try {
        piece.more = reader_.read(chunk);
      } catch (const FileError& error) {
        summary_.damage = error;  // the undamaged part is worth keeping
        piece.more = false;
      }
      if (!piece.more) return;
      if (belief_ && belief_->mirrored) mirror(chunk.observations);
      piece.rows.append(chunk.observations);
      summary_.observations += chunk.observations.size();
      progress_.report(reader_.fraction_read());
    }
  }

  bool is_full(const Piece& piece) const {
    const std::size_t rows = piece.rows.size() - piece.done;
    if (!options_.live) {
      return rows >= (!rotors_ ? kReportedRows : (belief_ ? kPieceRows : kBeginningRows));
    }
    if (!rotors_ || belief_) return rows > 0;
    const auto& times = piece.rows.time_ns;
    return rows > 0 && saturating_difference(times.back(), times.front()) >= kLiveBeginningNs;
  }

  /// Determines which rows of a piece become points, and the rotation angles.
  void prepare(Piece& piece) {
    const std::vector<std::int64_t>& time_ns = piece.rows.time_ns;
    const bool overlaps = piece.more && rotors_ && !options_.live;
    piece.end = overlaps ? overlap_begin(time_ns, time_ns.size()) : time_ns.size();
    if (piece.end <= piece.done) piece.end = time_ns.size();  // times that make no sense
    last_time_ns_ = time_ns[piece.end - 1];
    if (!rotors_ || piece.end <= piece.done) return;
    try {
      piece.tracker->track(piece.rows);
    } catch (const EstimationError& error) {
      piece.failure = error.what();
    }
  }

  void mirror(Observations& rows) const {
    estimation::mirror(rows.azimuth, rows.zenith, calibration_.train.layout().axis_up);
  }

  /// Number of directions a second of the beginning for the belief; empty for all.
  static std::optional<double> beginning_rate(const Observations& rows) {
    if (rows.size() <= kBeliefShots) return std::nullopt;
    const double seconds =
        1e-9 * static_cast<double>(std::llabs(rows.time_ns.back() - rows.time_ns.front()));
    if (seconds == 0) return std::nullopt;
    return static_cast<double>(kBeliefShots) / seconds;
  }

  std::optional<trajectories::Mount> mount() const {
    return options_.platform ? std::optional(options_.platform->mount) : std::nullopt;
  }

  /// Everything that needs the beginning of the recording.
  void set_up(Piece& piece) {
    if (rotors_) {
      estimation::ShotSelector selector({beginning_rate(piece.rows)});
      selector.add(piece.rows);
      belief_ = sensor_belief(selector.series(), selector.head(), calibration_,
                              options_.angle_noise, progress_.silent());
      if (belief_->mirrored) mirror(piece.rows);
      summary_.mirrored = belief_->mirrored;
      summary_.warnings = belief_->warnings;
      model_ = pointing_model(calibration_, *belief_, options_.pointing, mount());
      if (calibration_.reference != model_.reference &&
          model_.reference == sensors::CalibrationReference::planes) {
        warn(summary_.warnings, kWarning.calibration_doubtful,
             "the recording's own directions disagree with this sensor's parameters beyond their "
             "sigmas: points use the directions that the parameters give");
      }
      piece.tracker = std::make_unique<RotorTracker>(*belief_, options_.rate);
    } else {
      model_ =
          reported_pointing_model(calibration_, options_.pointing, options_.angle_noise, mount());
    }
    if (options_.standing) header_.factors_of_source = stand(model_, options_.standing->pose);
    for (const CommonFactor& factor : model_.factors) summary_.factors.push_back(factor.name);
    if (model_.mount_of_another) {
      warn(summary_.warnings, kWarning.taken_as_exact,
           "the mount was adjusted together with a different calibration: their common errors are "
           "unknown, and the covariances assume that there are none");
    }
    if (options_.platform) {
      georeference_ = std::make_unique<Georeference>(
          *options_.platform, reader_.header().time_reference, piece.rows.time_ns.front());
      first_time_ns_ = last_time_ns_ = piece.rows.time_ns.front();
    } else if (options_.standing) {
      georeference_ = std::make_unique<Georeference>(*options_.standing);
    }
    has_intensity_ = reader_.header().has_intensity;
    if (!has_intensity_ && calibration_.range_errors.per_decade != 0) {
      warn(summary_.warnings, kWarning.ranges_uncorrected,
           "the recording has no intensities: ranges are not corrected by the {:.1f} mm by which "
           "they grow with each tenth of the intensity",
           1e3 * calibration_.range_errors.per_decade);
    }
    surfaces_ = std::make_unique<ShotSurfaces>(calibration_, model_.angle_noise, has_intensity_,
                                               options_.platform ? georeference_.get() : nullptr);
    const recordings::Device& device = reader_.header().devices.front();
    if (device.extrinsic_enabled) {
      warn(summary_.warnings, kWarning.pose_unused,
           "the recording's extrinsics are not applied: points are in the sensor's frame");
    }
    header_.sensor = fmt::format("{} {}", calibration_.manufacturer, calibration_.model);
    header_.serial = device.serial;
    if (header_.serial.empty()) header_.serial = calibration_.serial;
    header_.time_reference = reader_.header().time_reference;
    header_.prisms = calibration_.prisms();
    header_.has_rotation_angles = rotors_;
    header_.has_covariance = options_.pointing.covariance;
    header_.has_own_covariance = options_.own_covariance && header_.has_covariance;
    header_.has_row = options_.rows;
    if (options_.loadings && header_.has_covariance) {
      header_.factors = summary_.factors;
    } else {
      header_.factors_of_source = 0;
    }
    if (georeference_) {
      georeference_->announce(header_);
      summary_.strips = georeference_->strips();
      if (options_.distribution) begin_distribution();
    }
    summary_.frame = header_.frame.text;
    if (options_.sample) sampler_.emplace(header_.frame, *options_.sample);
    if (options_.provenance) header_.provenance = options_.provenance();
    writer_ = sink_(header_);
  }

  /// Turns the piece into points.
  void emit() {
    if (piece_->failure) {
      leave_out();
      return;
    }
    if (rotors_ && piece_->end > piece_->done && !repointing_known_) find_repointing();
    for (std::size_t begin = piece_->done; begin < piece_->end;) {
      std::size_t surface_end = begin;
      if (options_.live) {  // a single chunk has too few shots
        surface_end = surfaces_->find(piece_->rows, 0, piece_->end);
      }
      if (surface_end <= begin) surface_end = surfaces_->find(piece_->rows, begin, piece_->end);
      write_rows(begin, surface_end);
      begin = surface_end;
    }
  }

  /// Counts the rows of a piece without rotation angles.
  void leave_out() {
    for (std::size_t row = piece_->done; row < piece_->end; ++row) {
      ++(has_return(piece_->rows, row) ? summary_.without_rotation_angle : summary_.no_return);
    }
    if (options_.live) return;  // memory must not grow
    warn(summary_.warnings, kWarning.points_missing, "no points from observations {} to {}: {}",
         piece_->first_row + piece_->done, piece_->first_row + piece_->end - 1, *piece_->failure);
  }

  /// Looks up the pose of the sensor at every row of a block, and removes rows without one.
  void find_poses(RowBlock& block) const {
    std::vector<std::size_t> known;
    georeference_->find_poses(times_of(piece_->rows, block.rows), block.poses, known);
    block.without_pose = block.rows.size() - known.size();
    if (block.without_pose == 0) return;
    keep_rows(block.rows, known);
    keep_rows(block.returns, known);
  }

  /// Blocks are computed in parallel and written in order. There are no more of them in progress
  /// than slots, and they finish in order, so each slot is free again when its turn comes.
  void write_rows(std::size_t begin, std::size_t end) {
    const std::size_t threads = parallel::thread_count();
    blocks_.resize(threads > 1 ? 2 * threads : 1);
    std::size_t next = begin;
    const auto choose = [&](std::size_t slot) {
      if (next == end) return false;
      next = choose_rows(next, end, blocks_[slot]);
      return true;
    };
    using Order = parallel::Stage::Order;
    parallel::run_pipeline(
        blocks_.size(), choose,
        {{Order::as_they_come, [this](std::size_t slot) { compute(blocks_[slot]); }},
         {Order::in_turn, [this](std::size_t slot) { write(blocks_[slot]); }}});
  }

  /// Takes up to kBlockRows rows that have a return. @return where the next block begins
  std::size_t choose_rows(std::size_t begin, std::size_t end, RowBlock& block) {
    block.rows.clear();
    block.returns.clear();
    std::size_t row = begin;
    while (row < end && block.rows.size() < kBlockRows) {
      std::size_t shot_end = row + 1;
      while (shot_end < end && same_shot(piece_->rows, row, shot_end)) ++shot_end;
      std::size_t returns = 0, last = 0;
      for (std::size_t i = row; i < shot_end; ++i) {
        if (!has_return(piece_->rows, i)) continue;
        ++returns;
        last = std::max<std::size_t>(last, piece_->rows.return_number[i]);
      }
      // Equal in all rows of a shot, and no less than any of their numbers.
      const auto number_of_returns = static_cast<std::uint8_t>(std::max(returns, last));
      for (std::size_t i = row; i < shot_end; ++i) {
        if (!has_return(piece_->rows, i)) {
          ++summary_.no_return;
          continue;
        }
        block.rows.push_back(i);
        block.returns.push_back(number_of_returns);
      }
      row = shot_end;
    }
    return row;
  }

  void compute(RowBlock& block) const {
    block.without_pose = 0;
    if (georeference_) find_poses(block);
    const std::size_t n = block.rows.size();
    PointedShots& shots = block.shots;
    Points& points = block.points;
    shots.resize(header_.prisms, n);
    header_.resize(points, n);
    if (rotors_) {
      piece_->tracker->angles(piece_->rows, block.rows, shots.rotation_angle,
                              shots.angle_covariance);
    }
    // Usually every row has a return, and columns can be copied directly.
    const bool whole = n > 0 && block.rows.back() - block.rows.front() + 1 == n;
    const auto take = [&](const auto& from, auto& to, const auto& change) {
      if (whole) {
        const auto first = from.begin() + block.rows.front();
        std::transform(first, first + n, to.begin(), change);
      } else {
        std::ranges::transform(block.rows, to.begin(),
                               [&](std::size_t row) { return change(from[row]); });
      }
    };
    const auto same = [](auto value) { return value; };
    const auto variance = [](float step) {
      return static_cast<double>(step) * static_cast<double>(step) / 12.0;
    };
    take(piece_->rows.time_ns, points.time_ns, same);
    take(piece_->rows.intensity, points.intensity, same);
    take(piece_->rows.return_number, points.return_number, same);
    points.number_of_returns = block.returns;
    if (header_.has_row) {
      std::ranges::transform(block.rows, points.row.begin(), [this](std::size_t row) {
        return static_cast<std::int64_t>(piece_->first_row + row);
      });
    }
    take(piece_->rows.tag, points.tag, same);
    take(piece_->rows.beam, points.beam, same);
    take(piece_->rows.beam, shots.beam, same);
    take(piece_->rows.azimuth, shots.azimuth, same);
    take(piece_->rows.zenith, shots.zenith, same);
    take(piece_->rows.range, shots.range, same);
    take(piece_->rows.intensity, shots.intensity,
         [this](std::uint8_t value) { return has_intensity_ ? static_cast<double>(value) : -1.0; });
    take(piece_->rows.azimuth_resolution, shots.azimuth_rounding, variance);
    take(piece_->rows.zenith_resolution, shots.zenith_rounding, variance);
    take(piece_->rows.range_resolution, shots.range_rounding, variance);
    surfaces_->find_normals(piece_->rows, block.rows, block.poses, block.shots);
    compute_points(model_, header_, shots, points, block.poses);
    block.outliers = block.without_rotation_angle = 0;
    block.azimuth_squares = block.zenith_squares = 0;
    if (rotors_) keep_sound(block);
    if (georeference_) georeference_->apply(points, block.poses);
  }

  /// Removes rows without a point from a block.
  void keep_sound(RowBlock& block) const {
    Points& points = block.points;
    const double noise = square(model_.angle_noise);
    const double limit = kOutlierChi2 * belief_->residual_variance_factor;
    std::vector<std::size_t> sound;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!std::isfinite(points.x[i])) {
        ++block.without_rotation_angle;
        continue;
      }
      const double azimuth = square(points.azimuth_residual[i]);
      const double zenith = square(points.zenith_residual[i]);
      if (!(azimuth / (noise + block.shots.azimuth_rounding[i]) +
                zenith / (noise + block.shots.zenith_rounding[i]) <=
            limit)) {
        ++block.outliers;
        continue;
      }
      block.azimuth_squares += azimuth;
      block.zenith_squares += zenith;
      sound.push_back(i);
    }
    if (sound.size() == points.size()) return;
    points.keep(sound);
    if (!georeference_) return;
    block.poses.keep(sound);
  }

  void begin_distribution() {
    try {
      std::vector<StripLine> lines = georeference_->strip_lines();
      if (lines.empty()) {
        no_distribution("no strips were found in the trajectory");
        return;
      }
      distribution_.emplace(std::move(lines), swath_reach(calibration_, options_.platform->mount),
                            *options_.distribution);
    } catch (const InvalidArgument& error) {
      no_distribution(error.what());
    }
  }

  void no_distribution(std::string_view why) {
    distribution_.reset();
    warn(summary_.warnings, kWarning.distribution_unknown,
         "how points lie on the ground is not reported: {}", why);
  }

  void count_on_ground(const Points& points) {
    std::array<std::vector<double>, 3> first;
    std::vector<std::uint16_t> strip;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points.return_number[i] > 1) continue;
      first[0].push_back(points.x[i]);
      first[1].push_back(points.y[i]);
      first[2].push_back(points.z[i]);
      strip.push_back(points.point_source[i]);
    }
    try {
      distribution_->add(first[0], first[1], first[2], strip);
    } catch (const InvalidArgument& error) {
      no_distribution(error.what());
    }
  }

  void write(const RowBlock& block) {
    writer_->write(block.points);
    if (distribution_) count_on_ground(block.points);
    if (sampler_) sampler_->add(block.points);
    summary_.points += block.points.size();
    summary_.outliers += block.outliers;
    summary_.without_rotation_angle += block.without_rotation_angle;
    summary_.without_pose += block.without_pose;
    summary_.azimuth_residual_rms += block.azimuth_squares;
    summary_.zenith_residual_rms += block.zenith_squares;
  }

  /// Shift of the beams by the calibration, together and relative to each other, for shots of the
  /// first piece.
  void find_repointing() {
    constexpr std::size_t kBeams = 2000;  // give a root mean square to 2 %, 1 / sqrt(2 * 2000)
    std::vector<std::size_t> rows;
    const std::size_t stride = std::max<std::size_t>(1, piece_->rows.size() / kBeams);
    for (std::size_t row = 0; row < piece_->rows.size(); row += stride) rows.push_back(row);
    PointedShots shots;
    shots.resize(header_.prisms, rows.size());
    piece_->tracker->angles(piece_->rows, rows, shots.rotation_angle, shots.angle_covariance);
    double squares = 0, count = 0;
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();  // of the rotation common to all beams
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    std::vector<double> angles(shots.rotation_angle.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t k = 0; k < angles.size(); ++k) angles[k] = shots.rotation_angle[k][i];
      const Observation to = observe(model_.train, angles, piece_->rows.beam[rows[i]]);
      const Observation from = observe(model_.believed, angles, piece_->rows.beam[rows[i]]);
      if (!to.valid || !from.valid) continue;
      const Vector3<double> moved = to.direction - from.direction;
      squares += square(norm(moved));
      const Eigen::Vector3d d(from.direction.x, from.direction.y, from.direction.z);
      normal += Eigen::Matrix3d::Identity() - d * d.transpose();
      moment += d.cross(Eigen::Vector3d(moved.x, moved.y, moved.z));
      count += 1;
    }
    if (count == 0) return;
    summary_.repointing_rms = std::sqrt(squares / count);
    const double shared = moment.dot(normal.ldlt().solve(moment));
    surfaces_->expect_distortion(std::sqrt(std::max(squares - shared, 0.0) / count));
    repointing_known_ = true;
  }

  void finish() {
    if (!writer_) {
      if (summary_.damage) throw FileError(*summary_.damage);
      throw EstimationError("the recording holds no valid shot");
    }
    if (georeference_) append(summary_.warnings, georeference_->warnings());
    if (summary_.points == 0 && summary_.without_pose > 0) {
      const std::int64_t shift = georeference_->clock_shift_ns();
      throw EstimationError(trajectories::no_overlap_words(
          options_.platform->trajectory, first_time_ns_ + shift, last_time_ns_ + shift,
          reader_.header().stamps_after_times_ns));
    }
    if (summary_.points == 0) {
      throw EstimationError(summary_.warnings.empty() ? std::string("no shot has a point")
                                                      : summary_.warnings.back().message);
    }
    const auto n = static_cast<double>(summary_.points);
    summary_.azimuth_residual_rms = std::sqrt(summary_.azimuth_residual_rms / n);
    summary_.zenith_residual_rms = std::sqrt(summary_.zenith_residual_rms / n);
    if (distribution_) summary_.distribution = distribution_->summary();
    if (sampler_) summary_.sample = sampler_->take();
    writer_->close();
  }

  recordings::Reader& reader_;
  const sensors::Sensor& calibration_;
  CloudSink sink_;
  const CloudOptions& options_;
  Progress progress_;
  CloudSummary summary_;
  std::optional<SensorBelief> belief_;
  PointingModel model_;
  bool rotors_;  ///< points depend on the rotation angles
  bool has_intensity_ = true;
  std::unique_ptr<Georeference> georeference_;  ///< of a moving sensor
  std::unique_ptr<ShotSurfaces> surfaces_;
  std::int64_t first_time_ns_ = 0, last_time_ns_ = 0;  ///< of the recording
  std::optional<PointDistribution> distribution_;
  std::optional<PointSampler> sampler_;
  CloudHeader header_;
  std::unique_ptr<CloudWriter> writer_;
  std::vector<RowBlock> blocks_;
  std::unique_ptr<Piece> piece_;  ///< that is being written
  Observations spare_;            ///< memory of the previous one, for the next one
  bool repointing_known_ = false, finished_ = false;
};

CloudMaker::CloudMaker(recordings::Reader& reader, const sensors::Sensor& calibration,
                       CloudSink sink, const CloudOptions& options, const Progress& progress) {
  if (options.distribution && !options.platform) {
    throw InvalidArgument(
        "the distribution of points on the ground needs a moving sensor: a trajectory is missing");
  }
  if (options.standing && options.platform) {
    throw InvalidArgument("a sensor cannot stand on a station and move along a trajectory");
  }
  if (options.rate) require_above("rate", *options.rate, 0, "Hz");
  if (options.angle_noise) require_above("angle noise", *options.angle_noise, 0, "rad");
  work_ = std::make_unique<Work>(reader, calibration, std::move(sink), options, progress);
}
CloudMaker::~CloudMaker() = default;

bool CloudMaker::next() { return work_->next(); }

const CloudSummary& CloudMaker::summary() const { return work_->summary(); }

CloudSummary make_cloud(recordings::Reader& reader, const sensors::Sensor& calibration,
                        const std::string& path, const CloudOptions& options,
                        const Progress& progress) {
  const std::string format = find_cloud_format(path, options.writer.format).name;
  CloudWriterOptions writer = options.writer;
  if (writer.messages.message) {
    const auto type = static_cast<std::uint8_t>(calibration.device_type);
    writer.messages.message =
        bags::of_generation(*writer.messages.message, recordings::is_second_generation(type));
  }
  const auto sink = [&](const CloudHeader& header) { return create_cloud(path, header, writer); };
  CloudMaker maker(reader, calibration, sink, options, progress);
  while (maker.next()) {
  }
  CloudSummary summary = maker.summary();
  summary.format = format;
  return summary;
}

}  // namespace risley::cloud
