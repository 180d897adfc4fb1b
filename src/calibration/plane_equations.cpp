// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/plane_equations.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/parallel/parallel.hpp"

#include "calibration/entry_checks.hpp"
#include "calibration/plane_equations_kernel.hpp"

namespace risley::calibration {
namespace {

/// Shots summed by one task: fixed, so that sums do not depend on the number of threads.
constexpr std::size_t kChunkShots = 8192;

void check(const RangedShots& shots, const PlaneView& view, const ResidualColumns& columns) {
  const std::span<const std::uint32_t> cell_begin = view.cell_begin;
  if (!cell_begin.empty() && (cell_begin.front() != 0 || cell_begin.back() != shots.size() ||
                              !std::ranges::is_sorted(cell_begin))) {
    throw InvalidArgument("cell_begin does not divide the shots");
  }
  require_shots(shots, view.train);
  require_length_or_none("residual", columns.residual.size(), shots.size());
  require_length_or_none("variance", columns.variance.size(), shots.size());
  const auto all_places = static_cast<std::size_t>(parameter_count(view.train.shape()));
  if (view.places.size() > all_places) {
    throw InvalidArgument(fmt::format("{} places given, a train of {} prisms has {}",
                                      view.places.size(), view.train.prisms(), all_places));
  }
  for (const int place : view.places) {
    if (place < 0 || static_cast<std::size_t>(place) >= all_places) {
      throw InvalidArgument(fmt::format("place = {}, allowed 0 to {}", place, all_places - 1));
    }
  }
  require_length("range_terms", shots.range_terms.size(), view.range_terms.size());
  if (view.range_terms.size() > kMostRangeTerms || view.sizes.size() > kMostSizes) {
    throw InvalidArgument(fmt::format("{} range terms and {} sizes, allowed {} and {}",
                                      view.range_terms.size(), view.sizes.size(), kMostRangeTerms,
                                      kMostSizes));
  }
  for (const auto& column : shots.range_terms) {
    require_length("a range term", column.size(), shots.size());
  }
  for (const double term : view.range_terms) require_finite("range term", term);
  require_finite("range offset", view.range_offset, "m");
  require_above("range variance", view.range_variance, 0, "m^2");
  require_finite("distance", view.plane.distance, "m");
}

/// Shots summed by one task.
struct Chunk {
  std::size_t begin = 0, end = 0, first_cell = 0;
};

/// Of about equal numbers of shots, divided at the ends of cells if there are any.
std::vector<Chunk> chunks_of(std::size_t shots, std::span<const std::uint32_t> cell_begin) {
  std::vector<Chunk> chunks;
  if (cell_begin.empty()) {
    for (std::size_t begin = 0; begin < shots; begin += kChunkShots) {
      chunks.push_back({begin, std::min(begin + kChunkShots, shots), 0});
    }
    return chunks;
  }
  Chunk next;
  for (std::size_t cell = 0; cell + 1 < cell_begin.size(); ++cell) {
    next.end = cell_begin[cell + 1];
    if (next.end - next.begin < kChunkShots && next.end != shots) continue;
    chunks.push_back(next);
    if (next.end == shots) break;
    next = {next.end, next.end, cell + 1};
  }
  return chunks;
}

void copy(const Vector3<double>& from, double* to) {
  to[0] = from.x;
  to[1] = from.y;
  to[2] = from.z;
}

}  // namespace

PlaneEquations plane_equations(const RangedShots& shots, const PlaneView& view,
                               const ResidualColumns& columns, InstructionSet set) {
  check(shots, view, columns);
  const std::span<const std::uint32_t> cell_begin = view.cell_begin;
  const PlaneColumns layout(view);
  const std::vector<double> face_position = face_positions(view.train.face_order(), view.geometry);
  std::vector<const double*> rotation_angle;
  std::vector<const float*> angle_covariance;
  for (const auto& column : shots.rotation_angle) rotation_angle.push_back(column.data());
  for (const auto& column : shots.angle_covariance) angle_covariance.push_back(column.data());

  PlaneArguments all;
  all.parameters = view.train.parameters().data();
  all.face_order = view.train.face_order().data();
  all.prisms = view.train.layout();
  all.emitters = view.train.emitters();
  if (!shots.beam.empty()) all.beam = shots.beam.data();
  all.face_position = face_position.data();
  all.places = view.places.data();
  all.place_count = layout.places;
  std::vector<double> size_rates;
  for (const PrismSize& size : view.sizes) {
    const auto rate = face_positions(view.train.face_order(), size.rate);
    size_rates.insert(size_rates.end(), rate.begin(), rate.end());
  }
  std::vector<const float*> range_terms;
  for (const auto& column : shots.range_terms) range_terms.push_back(column.data());
  all.size_rates = size_rates.data();
  all.size_count = layout.sizes;
  all.term_values = view.range_terms.data();
  all.term_count = layout.terms;
  all.range_terms = range_terms.data();
  all.range_offset = view.range_offset;
  all.range_variance = view.range_variance;
  copy(view.plane.normal, all.normal);
  all.distance = view.plane.distance;
  copy(view.tangent_1, all.tangent[0]);
  copy(view.tangent_2, all.tangent[1]);
  all.rotation_angle = rotation_angle.data();
  all.angle_covariance = angle_covariance.data();
  all.range = shots.range.data();
  if (!columns.residual.empty()) all.residual = columns.residual.data();
  if (!columns.variance.empty()) all.variance = columns.variance.data();

  const auto& kernel = RISLEY_KERNEL_COPIES(accumulate_plane).at(set);
  const int size = layout.size();
  const auto triangle = static_cast<std::size_t>((size + 1) * (size + 2) / 2);
  const std::vector<Chunk> all_chunks = chunks_of(shots.size(), cell_begin);
  const std::size_t chunks = all_chunks.size();
  std::vector<double> products(chunks * triangle);
  std::vector<std::size_t> lost(chunks);
  PlaneEquations equations;
  if (!cell_begin.empty()) {
    equations.cells.setZero(3 * (std::ssize(cell_begin) - 1), size + 1);
    all.cell_begin = cell_begin.data();
    all.cell_products = equations.cells.data();
  }
  parallel::for_each(chunks, [&](std::size_t chunk) {
    PlaneArguments mine = all;
    mine.begin = all_chunks[chunk].begin;
    mine.end = all_chunks[chunk].end;
    mine.first_cell = all_chunks[chunk].first_cell;
    mine.products = products.data() + chunk * triangle;
    lost[chunk] = kernel(mine);
  });

  equations.hessian = Eigen::MatrixXd::Zero(size, size);
  equations.gradient = Eigen::VectorXd::Zero(size);
  const double* entry = products.data();
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    for (int i = 0; i < size; ++i) {
      for (int j = i; j < size; ++j) equations.hessian(i, j) += *entry++;
      equations.gradient[i] += *entry++;
    }
    equations.cost += *entry++;
    equations.lost += lost[chunk];
  }
  equations.hessian.triangularView<Eigen::StrictlyLower>() = equations.hessian.transpose();
  equations.shots = shots.size() - equations.lost;
  return equations;
}

}  // namespace risley::calibration
