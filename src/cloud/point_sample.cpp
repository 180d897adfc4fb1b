// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/point_sample.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/random.hpp"
#include "risley/core/require.hpp"

#include "cloud/keep_rows.hpp"

namespace risley::cloud {
namespace {

constexpr double kClassBegin[] = {0, 2, 5, 10, 20, 50, 100, 200, 500};  // m
constexpr double kHighShare = 0.95;

RangeClass class_of(const PointSample& sample, std::span<const std::size_t> rows, double from,
                    double to) {
  RangeClass result{from, to, rows.size(), 0, 0, 0};
  std::vector<double> sigma(rows.size());
  std::ranges::transform(rows, sigma.begin(),
                         [&](std::size_t row) { return sample.total_sigma[row]; });
  result.median_sigma = quantile(sigma, 0.5);
  result.high_sigma = quantile(sigma, kHighShare);
  const auto known = std::ranges::count_if(
      rows, [&](std::size_t row) { return std::isfinite(sample.incidence[row]); });
  result.known_incidence = static_cast<double>(known) / static_cast<double>(rows.size());
  return result;
}

std::vector<std::size_t> rows_between(const PointSample& sample, double from, double to) {
  require_length("total_sigma", sample.total_sigma.size(), sample.size());
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < sample.size(); ++i) {
    if (sample.range[i] >= from && sample.range[i] < to) rows.push_back(i);
  }
  return rows;
}

}  // namespace

std::vector<RangeClass> range_classes(const PointSample& sample) {
  std::vector<RangeClass> result;
  for (const double& from : kClassBegin) {
    const bool last = &from == std::prev(std::end(kClassBegin));
    const double to = last ? std::numeric_limits<double>::infinity() : *std::next(&from);
    const std::vector<std::size_t> rows = rows_between(sample, from, to);
    if (!rows.empty()) result.push_back(class_of(sample, rows, from, to));
  }
  return result;
}

RangeClass whole_range(const PointSample& sample) {
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  const std::vector<std::size_t> rows = rows_between(sample, -kEndless, kEndless);
  if (rows.empty()) throw InvalidArgument("points of a sample = 0, allowed 1 or more");
  return class_of(sample, rows, 0, kEndless);
}

PointSampler::PointSampler(PointFrame frame, std::size_t most) : most_(most) {
  require_above("points of a sample", static_cast<double>(most), 0, "");
  sample_.frame = std::move(frame);
}

void PointSampler::add(const Points& points) {
  const RandomStream lots(0, 0);
  const auto& offset = sample_.frame.offset;
  const bool has_covariance = !points.covariance[kXX].empty();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double lot = lots.uniform(sample_.points++);
    if (!(lot <= highest_)) continue;
    const auto keep = [](std::vector<float>& column, double value) {
      column.push_back(static_cast<float>(value));
    };
    lot_.push_back(lot);
    keep(sample_.x, points.x[i] - offset[0]);
    keep(sample_.y, points.y[i] - offset[1]);
    keep(sample_.z, points.z[i] - offset[2]);
    keep(sample_.range, points.range[i]);
    keep(sample_.incidence, points.incidence[i]);
    sample_.intensity.push_back(points.intensity[i]);
    if (has_covariance) {
      keep(sample_.total_sigma, std::sqrt(points.covariance[kXX][i] + points.covariance[kYY][i] +
                                          points.covariance[kZZ][i]));
    }
    if (lot_.size() > most_ + most_ / 4) thin();  // not for every point
  }
}

PointSample PointSampler::take() {
  if (lot_.size() > most_) thin();
  return std::move(sample_);
}

/// Keeps the lowest lots.
void PointSampler::thin() {
  std::vector<double> lots = lot_;
  const auto last = lots.begin() + static_cast<std::ptrdiff_t>(most_ - 1);
  std::ranges::nth_element(lots, last);
  highest_ = *last;
  std::vector<std::size_t> kept;
  kept.reserve(most_);
  for (std::size_t i = 0; i < lot_.size(); ++i) {
    if (lot_[i] <= highest_) kept.push_back(i);
  }
  keep_rows(lot_, kept);
  for (auto* column : {&sample_.x, &sample_.y, &sample_.z, &sample_.range, &sample_.incidence,
                       &sample_.total_sigma}) {
    keep_rows(*column, kept);
  }
  keep_rows(sample_.intensity, kept);
}

}  // namespace risley::cloud
