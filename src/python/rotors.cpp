// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "python/rotors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <pybind11/stl.h>

#include "python/arrays.hpp"
#include "python/call.hpp"

namespace risley::python {
namespace {

using estimation::RotorTrajectory;

/// The nearest knot, if its parabola still describes the rotors at that distance.
std::optional<std::size_t> knot_near(const RotorTrajectory& t, std::int64_t time_ns) {
  constexpr auto kReach = static_cast<std::int64_t>(1e9 * estimation::kKnotInterval);
  for (std::size_t stretch = 0; stretch < t.stretch_begin.size(); ++stretch) {
    const auto begin = t.time_ns.begin() + static_cast<std::ptrdiff_t>(t.stretch_begin[stretch]);
    const auto end = t.time_ns.begin() + static_cast<std::ptrdiff_t>(t.stretch_end(stretch));
    if (begin == end) continue;
    auto nearest = std::lower_bound(begin, end, time_ns);
    if (nearest == end ||
        (nearest != begin && time_ns - *std::prev(nearest) < *nearest - time_ns)) {
      --nearest;
    }
    if (std::abs(time_ns - *nearest) > kReach) continue;
    return static_cast<std::size_t>(nearest - t.time_ns.begin());
  }
  return std::nullopt;
}

/// Rotation angles [times, prisms], their covariance [times, prisms, prisms], and speeds [times,
/// prisms], SI units; NaN if there is no knot. @param knot_of  of the time of a row
template <class KnotOf>
py::tuple angles_at(const RotorTrajectory& t, const std::int64_t* time_ns, std::size_t rows,
                    const KnotOf& knot_of) {
  const auto prisms = static_cast<std::size_t>(t.prisms);
  const auto n = static_cast<py::ssize_t>(rows), p = static_cast<py::ssize_t>(prisms);
  py::array_t<double> angle({n, p}), covariance({n, p, p}), speed({n, p});
  double *to_angle = angle.mutable_data(), *to_speed = speed.mutable_data(),
         *to_covariance = covariance.mutable_data();
  unlocked([&] {
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t row = 0; row < rows; ++row) {
      const std::optional<std::size_t> knot = knot_of(row);
      const double seconds =
          knot ? 1e-9 * static_cast<double>(time_ns[row] - t.time_ns[*knot]) : 0.0;
      for (std::size_t i = 0; i < prisms; ++i) {
        to_angle[row * prisms + i] = knot ? t.angle(*knot, i, seconds) : kUnknown;
        to_speed[row * prisms + i] = knot ? t.speed(*knot, i, seconds) : kUnknown;
        for (std::size_t j = i; j < prisms; ++j) {
          const double value = knot ? t.angle_covariance(*knot, i, j, seconds) : kUnknown;
          to_covariance[(row * prisms + i) * prisms + j] = value;
          to_covariance[(row * prisms + j) * prisms + i] = value;
        }
      }
    }
  });
  return py::make_tuple(angle, covariance, speed);
}

template <class T>
py::array_t<T> copy_of(const std::vector<T>& column) {
  return py::array_t<T>(static_cast<py::ssize_t>(column.size()), column.data());
}

template <class T>
std::vector<T> column_of(const py::handle& array) {
  const auto values = array.cast<py::array_t<T, py::array::c_style | py::array::forcecast>>();
  return {values.data(), values.data() + values.size()};
}

py::tuple motion_state(const RotorMotion& motion) {
  const RotorTrajectory& t = motion.trajectory;
  return py::make_tuple(t.prisms, copy_of(t.time_ns), t.first_shot, t.last_shot, t.stretch_begin,
                        copy_of(t.state), copy_of(t.covariance), copy_of(motion.shot_time_ns),
                        copy_of(motion.outlier));
}

std::shared_ptr<RotorMotion> motion_from(const py::tuple& state) {
  auto motion = std::make_shared<RotorMotion>();
  RotorTrajectory& t = motion->trajectory;
  t.prisms = state[0].cast<int>();
  t.time_ns = column_of<std::int64_t>(state[1]);
  t.first_shot = state[2].cast<std::vector<std::size_t>>();
  t.last_shot = state[3].cast<std::vector<std::size_t>>();
  t.stretch_begin = state[4].cast<std::vector<std::size_t>>();
  t.state = column_of<double>(state[5]);
  t.covariance = column_of<double>(state[6]);
  motion->shot_time_ns = column_of<std::int64_t>(state[7]);
  motion->outlier = column_of<unsigned char>(state[8]);
  return motion;
}

}  // namespace

std::shared_ptr<RotorMotion> motion_of(const estimation::Estimate& estimate) {
  auto motion = std::make_shared<RotorMotion>();
  motion->trajectory = estimate.trajectory;
  motion->outlier = estimate.outlier;
  motion->shot_time_ns.resize(estimate.series.size());
  for (std::size_t i = 0; i < motion->shot_time_ns.size(); ++i) {
    motion->shot_time_ns[i] = estimate.series.time_ns(i);
  }
  return motion;
}

void bind_rotors(py::module_& module) {
  py::class_<RotorMotion, std::shared_ptr<RotorMotion>>(module, "RotorMotion",
                                                        "How the rotors of an estimate moved.")
      .def_property_readonly("shot_time_ns",
                             [](const RotorMotion& motion) { return copy_of(motion.shot_time_ns); })
      .def_property_readonly("outlier",
                             [](const RotorMotion& motion) { return copy_of(motion.outlier); })
      .def("at_shots",
           [](const RotorMotion& motion) {
             const RotorTrajectory& t = motion.trajectory;
             return angles_at(t, motion.shot_time_ns.data(), motion.shot_time_ns.size(),
                              [&](std::size_t shot) { return t.knot_of_shot(shot); });
           })
      .def(
          "at",
          [](const RotorMotion& motion, const py::object& time_ns) {
            const Times times = times_from(time_ns, "time_ns");
            return angles_at(
                motion.trajectory, times.data(), static_cast<std::size_t>(times.size()),
                [&](std::size_t row) { return knot_near(motion.trajectory, times.data()[row]); });
          },
          py::arg("time_ns"))
      .def(py::pickle(&motion_state, &motion_from));
}

}  // namespace risley::python
