// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/io/text_file.hpp"
#include "risley/trajectories/mount.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "python/arrays.hpp"
#include "python/call.hpp"

namespace risley::python {
namespace {

using trajectories::Mount;
using trajectories::StatedValue;
using trajectories::Trajectory;
using SharedTrajectory = std::shared_ptr<Trajectory>;

std::vector<double> numbers_of(const std::array<StatedValue, 3>& stated,
                               double StatedValue::*which) {
  return {stated[0].*which, stated[1].*which, stated[2].*which};
}

/// Vectors of Eigen, or quaternions, as an array [rows, numbers].
template <class Row>
py::array_t<double> array_of_rows(const std::vector<Row>& rows, py::ssize_t numbers) {
  py::array_t<double> array({static_cast<py::ssize_t>(rows.size()), numbers});
  double* to = array.mutable_data();
  for (const Row& row : rows) {
    if constexpr (requires { row.coeffs(); }) {
      for (const double one : {row.w(), row.x(), row.y(), row.z()}) *to++ = one;
    } else {
      for (py::ssize_t i = 0; i < numbers; ++i) *to++ = row[i];
    }
  }
  return array;
}

Numbers columns_from(const py::handle& values, const char* name, std::size_t rows,
                     py::ssize_t numbers) {
  Numbers array = numbers_from(values, name);
  const Shape wanted{static_cast<py::ssize_t>(rows), numbers};
  if (shape_of(array) != wanted) {
    throw InvalidArgument(fmt::format("{} has the shape {}, expected {}", name, shape_text(array),
                                      shape_text(wanted)));
  }
  return array;
}

SharedTrajectory trajectory_from_arrays(const py::object& time_ns, const py::object& position,
                                        const py::object& attitude) {
  auto trajectory = std::make_shared<Trajectory>();
  const Times times = times_from(time_ns, "time_ns");
  const auto rows = static_cast<std::size_t>(times.size());
  const Numbers places = columns_from(position, "position", rows, 3);
  const Numbers turns = columns_from(attitude, "attitude", rows, 4);
  trajectory->time_ns.assign(times.data(), times.data() + rows);
  for (std::size_t i = 0; i < rows; ++i) {
    const double *at = places.data() + 3 * i, *q = turns.data() + 4 * i;
    trajectory->position.emplace_back(at[0], at[1], at[2]);
    trajectory->attitude.emplace_back(q[0], q[1], q[2], q[3]);
  }
  trajectories::require_trajectory(*trajectory);
  return trajectory;
}

/// State for copies of a trajectory: the text that keeps every digit does not record how it was
/// read.
py::tuple trajectory_state(const Trajectory& t) {
  py::list accuracy;
  for (const trajectories::PoseAccuracy& one : t.accuracy) {
    accuracy.append(py::make_tuple(one.position[0], one.position[1], one.position[2], one.roll,
                                   one.pitch, one.heading));
  }
  return py::make_tuple(t.format, t.source, static_cast<int>(t.time_scale), t.gps_week,
                        static_cast<int>(t.frame), t.time_ns, array_of_rows(t.position, 3),
                        array_of_rows(t.attitude, 4), array_of_rows(t.velocity, 3), accuracy);
}

SharedTrajectory trajectory_from(const py::tuple& state) {
  auto t = trajectory_from_arrays(py::array(py::cast(state[5].cast<std::vector<std::int64_t>>())),
                                  state[6], state[7]);
  t->format = state[0].cast<std::string>();
  t->source = state[1].cast<std::string>();
  t->time_scale = static_cast<trajectories::TimeScale>(state[2].cast<int>());
  t->gps_week = state[3].cast<std::optional<int>>();
  t->frame = static_cast<trajectories::Frame>(state[4].cast<int>());
  const auto velocity = state[8].cast<Numbers>();
  for (py::ssize_t i = 0; i + 2 < velocity.size(); i += 3) {
    t->velocity.emplace_back(velocity.data()[i], velocity.data()[i + 1], velocity.data()[i + 2]);
  }
  for (const auto& one : state[9].cast<std::vector<std::array<double, 6>>>()) {
    t->accuracy.push_back({{one[0], one[1], one[2]}, one[3], one[4], one[5]});
  }
  return t;
}

void bind_mount(py::module_& module) {
  py::class_<Mount>(
      module, "Mount",
      "Mounting of a sensor on a moving platform: axes, lever arm, boresight, clock.\n\n"
      "`load_mount` reads one; the calibration of a flight has one.")
      .def_static(
          "from_text",
          [](const std::string& text) { return trajectories::parse_mount(text, "the text"); },
          py::arg("text"), "from_text(text)\n--\n\nA mount from the text of its file (YAML).")
      .def("to_text", &trajectories::mount_text,
           "to_text(self)\n--\n\nThe text of its file (YAML), which `from_text` reads with every "
           "digit.")
      .def(
          "write",
          [](const Mount& mount, const std::filesystem::path& path) {
            io::write_text_file(path.string(), trajectories::mount_text(mount));
          },
          py::arg("path"), "write(self, path)\n--\n\nWrites its file.")
      .def_readonly("name", &Mount::name, "Name of the platform or the flight.")
      .def_property_readonly(
          "nominal", [](const Mount& mount) { return array_of(Eigen::MatrixXd(mount.nominal)); },
          "Rotation from the sensor's axes to the body's as designed; shape (3, 3).")
      .def_property_readonly(
          "boresight",
          [](const Mount& mount) {
            return array_of(numbers_of(mount.boresight, &StatedValue::value));
          },
          "Correction of the real rotation: a vector along the sensor's axes, rad; shape (3,).")
      .def_property_readonly(
          "boresight_sigma",
          [](const Mount& mount) {
            return array_of(numbers_of(mount.boresight, &StatedValue::sigma));
          },
          "Its standard deviations, rad; shape (3,).")
      .def_property_readonly(
          "lever_arm",
          [](const Mount& mount) {
            return array_of(numbers_of(mount.lever_arm, &StatedValue::value));
          },
          "From the reference point to the sensor's origin, axes of the body, m; shape (3,).")
      .def_property_readonly(
          "lever_arm_sigma",
          [](const Mount& mount) {
            return array_of(numbers_of(mount.lever_arm, &StatedValue::sigma));
          },
          "Its standard deviations, m; shape (3,).")
      .def_property_readonly(
          "clock_offset", [](const Mount& mount) { return mount.clock_offset.value; },
          "Offset added to the recording's clock to get the trajectory's time, s.")
      .def_property_readonly(
          "clock_offset_sigma", [](const Mount& mount) { return mount.clock_offset.sigma; },
          "Its standard deviation, s.")
      .def("__eq__",
           [](const Mount& mount, const py::object& other) {
             return py::isinstance<Mount>(other) &&
                    trajectories::mount_text(mount) ==
                        trajectories::mount_text(other.cast<const Mount&>());
           })
      .def("__repr__",
           [](const Mount& mount) {
             return fmt::format("<risley.Mount {}: lever arm {:g}, {:g}, {:g} m>",
                                mount.name.empty() ? "without a name" : mount.name,
                                mount.lever_arm[0].value, mount.lever_arm[1].value,
                                mount.lever_arm[2].value);
           })
      .def(py::pickle(&trajectories::mount_text,
                      [](const std::string& text) {
                        return trajectories::parse_mount(text, "the pickle of a mount");
                      }))
      .attr("__hash__") = py::none();
  module.def(
      "load_mount",
      [](const std::string& path) {
        return unlocked([&] { return trajectories::load_mount(path); });
      },
      py::arg("path"));
}

}  // namespace

void bind_trajectories(py::module_& module) {
  bind_mount(module);
  py::class_<Trajectory, SharedTrajectory>(
      module, "Trajectory",
      "The poses of a moving platform as columns, ordered by time.\n\n"
      "`load_trajectory` reads one, `from_arrays` makes one from numbers, and the calibration of a "
      "flight has one.")
      .def_static(
          "from_arrays", &trajectory_from_arrays, py::arg("time_ns"), py::arg("position"),
          py::arg("attitude"),
          "from_arrays(time_ns, position, attitude)\n--\n\nPoses in a local map frame: x east, y "
          "north, z up.\n\n"
          "Parameters\n----------\ntime_ns : array_like of int, shape (rows,)\n    Ascending "
          "times, ns.\nposition : array_like, shape (rows, 3)\n    Of the reference point, "
          "m.\nattitude : array_like, shape (rows, 4)\n    Quaternions w, x, y, z from the "
          "body (x forward, y right, z down) to the map.")
      .def("__len__", &Trajectory::size)
      .def_readonly("format", &Trajectory::format, "Short name of its format.")
      .def_property_readonly(
          "frame", [](const Trajectory& t) { return to_string(t.frame); },
          "'geocentric' or 'local'.")
      .def_property_readonly(
          "time_scale", [](const Trajectory& t) { return to_string(t.time_scale); },
          "What its times count from.")
      .def_property_readonly(
          "time_ns",
          [](const SharedTrajectory& t) {
            return view_of<std::int64_t, Trajectory>(t->time_ns, t);
          },
          "Times, ns; shape (rows,).")
      .def_property_readonly(
          "position", [](const Trajectory& t) { return array_of_rows(t.position, 3); },
          "Of the reference point, in the frame, m; shape (rows, 3).")
      .def_property_readonly(
          "attitude", [](const Trajectory& t) { return array_of_rows(t.attitude, 4); },
          "Quaternions w, x, y, z from the body to the frame; shape (rows, 4).")
      .def_property_readonly(
          "velocity", [](const Trajectory& t) { return array_of_rows(t.velocity, 3); },
          "Along the axes of the frame, m/s; shape (rows, 3), or (0, 3) without velocities.")
      .def(
          "write",
          [](const Trajectory& t, const std::filesystem::path& path, const std::string& format) {
            return unlocked(
                [&] { return trajectories::write_trajectory(path.string(), t, format); });
          },
          py::arg("path"), py::arg("format") = "",
          "write(self, path, format='')\n--\n\nWrites the trajectory; the ending chooses the "
          "format unless `format` is given.\n\nReturns "
          "descriptions of the data that the format cannot hold.")
      .def("__repr__",
           [](const Trajectory& t) {
             return fmt::format("<risley.Trajectory {}: {} poses over {:.1f} s>",
                                t.format.empty() ? to_string(t.frame) : t.format, t.size(),
                                1e-9 * static_cast<double>(t.time_ns.back() - t.time_ns.front()));
           })
      .def(py::pickle(&trajectory_state, &trajectory_from));
  module.def(
      "load_trajectory",
      [](const std::string& path, const std::string& topic, const py::object& on_progress) {
        auto trajectory = std::make_shared<Trajectory>();
        run_job(on_progress, 0, [&](const Progress& progress) {
          *trajectory = trajectories::load_trajectory(path, progress.stage("reading"), topic);
        });
        return trajectory;
      },
      py::arg("path"), py::arg("topic"), py::arg("on_progress"));
}

}  // namespace risley::python
