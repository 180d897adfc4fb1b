// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/cartesian.hpp"

#include "recordings/cartesian_kernel.hpp"

namespace risley::recordings {

void set_cartesian(Observations& rows, std::size_t row, std::size_t points, const double* x,
                   const double* y, const double* z, double step) {
  static const auto& kernel = RISLEY_KERNEL_COPIES(set_cartesian_points).at(best_instruction_set());
  CartesianArguments a;
  a.points = points;
  a.step = step;
  a.x = x;
  a.y = y;
  a.z = z;
  a.azimuth = rows.azimuth.data() + row;
  a.zenith = rows.zenith.data() + row;
  a.range = rows.range.data() + row;
  a.azimuth_resolution = rows.azimuth_resolution.data() + row;
  a.zenith_resolution = rows.zenith_resolution.data() + row;
  a.range_resolution = rows.range_resolution.data() + row;
  a.valid = rows.valid.data() + row;
  kernel(a);
}

}  // namespace risley::recordings
