// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/mount.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>

#include "risley/algebra/rotation_vector.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/text.hpp"
#include "risley/io/text_file.hpp"
#include "risley/io/yaml_covariance.hpp"
#include "risley/io/yaml_map.hpp"
#include "risley/io/yaml_output.hpp"

namespace risley::trajectories {
namespace {

using io::fail_at;
using io::yaml_decimal;
using io::yaml_quoted;
using io::YamlMap;

constexpr int kMountVersion = 1;
constexpr long double kDegree = std::numbers::pi_v<long double> / 180;
/// Beyond this a rotation belongs in the nominal one.
constexpr double kLargestBoresight_deg = 45;
constexpr double kLongestLeverArm = 1000;     // m
constexpr double kLargestClockOffset = 1e10;  // s: the origins of any two scales of time
constexpr double kLargestSigma = 1e10;        // in the unit of the file
constexpr std::string_view kAxisLetters = "xyz";

/// Directions of the body, in its axes.
const std::array<std::pair<std::string, Eigen::Vector3d>, 6>& body_directions() {
  static const std::array<std::pair<std::string, Eigen::Vector3d>, 6> all{{
      {"forward", {1, 0, 0}},
      {"backward", {-1, 0, 0}},
      {"right", {0, 1, 0}},
      {"left", {0, -1, 0}},
      {"down", {0, 0, 1}},
      {"up", {0, 0, -1}},
  }};
  return all;
}

/// Largest deviation from an orthonormal matrix.
double skewness_of(const Eigen::Matrix3d& matrix) {
  return (matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
}

/// Axes permuted by a matrix of whole numbers, as words; nothing for other matrices.
std::optional<std::array<std::string, 3>> axes_words(const Eigen::Matrix3d& nominal) {
  std::array<std::string, 3> words;
  for (int i = 0; i < 3; ++i) {
    for (const auto& [word, direction] : body_directions()) {
      if (nominal.col(i) == direction) words[i] = word;
    }
    if (words[i].empty()) return std::nullopt;
  }
  return words;
}

/// @param scale  SI units per unit of the file
StatedValue read_stated(const YamlMap& parent, std::string_view key, double limit,
                        std::string_view unit, long double scale) {
  const YamlMap map = parent.section(key);
  map.allow_only({"value", "sigma", "source"});
  StatedValue stated;
  stated.value = static_cast<double>(map.number("value", -limit, limit, unit) * scale);
  stated.sigma = static_cast<double>(map.number("sigma", 0, kLargestSigma, unit) * scale);
  stated.source = map.words("source");
  return stated;
}

std::array<StatedValue, 3> read_three(const YamlMap& root, std::string_view key,
                                      std::string_view suffix, double limit, long double scale) {
  const YamlMap map = root.section(key);
  std::array<std::string, 3> names;
  for (std::size_t i = 0; i < 3; ++i) names[i] = fmt::format("{}_{}", kAxisLetters[i], suffix);
  map.allow_only({names[0], names[1], names[2]});
  std::array<StatedValue, 3> values;
  for (std::size_t i = 0; i < 3; ++i) values[i] = read_stated(map, names[i], limit, suffix, scale);
  return values;
}

Eigen::Matrix3d read_axes(const YamlMap& map) {
  map.allow_only({"x", "y", "z", "source"});
  Eigen::Matrix3d nominal;
  for (int i = 0; i < 3; ++i) {
    const std::string key(1, kAxisLetters[i]);
    const std::string word = map.text(key);
    std::vector<std::string> known;
    bool found = false;
    for (const auto& [name, direction] : body_directions()) {
      known.push_back(name);
      if (name != word) continue;
      nominal.col(i) = direction;
      found = true;
    }
    if (found) continue;
    fail_at(map.path(), map.at(key).line,
            fmt::format("{} = \"{}\"{}, allowed forward, backward, right, left, down, up",
                        map.field(key), word, did_you_mean(word, known)));
  }
  if (skewness_of(nominal) != 0) {
    fail_at(map.path(), map.line(),
            map.field("x, y and z") +
                " point along the same line of the body, expected three "
                "directions at right angles");
  }
  if (nominal.determinant() < 0) {
    fail_at(map.path(), map.line(),
            fmt::format("sensor_axes are left-handed: where x points {} and y {}, z points {}",
                        map.text("x"), map.text("y"), [&] {
                          for (const auto& [name, direction] : body_directions()) {
                            if (direction == -nominal.col(2)) return name;
                          }
                          return std::string();
                        }()));
  }
  return nominal;
}

Eigen::Matrix3d read_matrix(const YamlMap& map) {
  map.allow_only({"matrix", "source"});
  const YamlMap::Entry& entry = map.at("matrix");
  const std::string field = map.field("matrix");
  const auto is_three = [](const io::YamlNode& node) {
    return node.is_list() && node.items.size() == 3;
  };
  if (!is_three(entry.value)) {
    fail_at(map.path(), entry.line, field + ": expected a list of 3 rows of 3 numbers");
  }
  Eigen::Matrix3d nominal;
  for (int row = 0; row < 3; ++row) {
    const io::YamlNode& numbers = entry.value.items[row];
    if (!is_three(numbers)) {
      fail_at(map.path(), numbers.line, field + ": expected a list of 3 rows of 3 numbers");
    }
    for (int column = 0; column < 3; ++column) {
      const std::string name = fmt::format("{}[{}][{}]", field, row, column);
      const auto value =
          static_cast<double>(io::yaml_number(numbers.items[column], map.path(), name));
      if (!(std::abs(value) <= 1.001)) {
        fail_at(map.path(), numbers.line, fmt::format("{} = {:g}, allowed -1 to 1", name, value));
      }
      nominal(row, column) = value;
    }
  }
  constexpr double kRounded = 2e-4, kExact = 1e-14;
  const double skewness = skewness_of(nominal);
  if (skewness > kRounded) {
    fail_at(map.path(), entry.line,
            fmt::format("{} is not a rotation: the lengths of its columns, or the products of two "
                        "of them, are off by {:.2g}, allowed {:g}",
                        field, skewness, kRounded));
  }
  if (nominal.determinant() < 0) {
    fail_at(map.path(), entry.line,
            field + " is a mirror image (its determinant is -1), expected a right-handed rotation");
  }
  if (skewness > kExact) {
    for (int i = 0; i < 4; ++i) {  // to the nearest rotation
      nominal = 0.5 * (nominal + Eigen::Matrix3d(nominal.inverse().transpose()));
    }
  }
  return nominal;
}

/// Of the values that a covariance can name: their names end in the unit.
long double scale_of(const std::string& name) {
  if (name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos) {
    throw InvalidArgument(fmt::format("{} is not the name of a quantity of a mount", name));
  }
  return name.ends_with("_deg") ? kDegree : 1.0L;
}

/// A covariance and the sigmas beside it come from one adjustment.
void require_own_covariance(const Mount& mount) {
  const algebra::NamedCovariance& own = mount.covariance;
  if (const auto n = std::ssize(own.names); own.matrix.rows() != n || own.matrix.cols() != n) {
    throw InvalidArgument(fmt::format("covariance is {} x {}, expected {} x {}, one row per name",
                                      own.matrix.rows(), own.matrix.cols(), n, n));
  }
  if (!own.matrix.allFinite()) throw InvalidArgument("covariance: expected finite numbers");
  if (const auto fault = algebra::covariance_fault(own.matrix)) {
    throw InvalidArgument("covariance" + fault->words);
  }
  const std::array<double, kMountQuantities> sigmas = mount_sigmas(mount);
  for (std::size_t k = 0; k < kMountQuantities; ++k) {
    const std::string& name = mount_names()[k];
    const Eigen::Index row = own.find(name);
    if (row < 0) continue;
    const auto scale = static_cast<double>(scale_of(name));
    const double sigma = std::sqrt(own.matrix(row, row));
    if (std::abs(sigma - sigmas[k]) <= 1e-9 * sigma) continue;
    throw InvalidArgument(
        fmt::format("covariance: {} has a sigma of {:g} here, and {:g} beside its value; change "
                    "both, or delete the covariance",
                    name, sigma / scale, sigmas[k] / scale));
  }
}

void require_stated(std::string_view name, const StatedValue& stated, double limit,
                    std::string_view unit) {
  require_between(name, stated.value, -limit, limit, unit);
  require_not_below(fmt::format("sigma of {}", name), stated.sigma, 0, unit);
}

std::string stated_text(const StatedValue& stated, long double scale) {
  return fmt::format("{{value: {}, sigma: {}, source: {}}}", yaml_decimal(stated.value, scale),
                     yaml_decimal(stated.sigma, scale),
                     yaml_quoted(stated.source.empty() ? "not stated" : stated.source));
}

}  // namespace

void require_mount(const Mount& mount) {
  if (!(skewness_of(mount.nominal) < 1e-9 && mount.nominal.determinant() > 0)) {
    throw InvalidArgument("nominal: expected a right-handed rotation");
  }
  // The rounding of the limits themselves is not the caller's fault.
  const double largest_boresight = radians_from_degrees(kLargestBoresight_deg) * (1 + 1e-15);
  for (std::size_t i = 0; i < 3; ++i) {
    require_stated(fmt::format("boresight[{}]", i), mount.boresight[i], largest_boresight, "rad");
    require_stated(fmt::format("lever_arm[{}]", i), mount.lever_arm[i], kLongestLeverArm, "m");
  }
  require_stated("clock_offset", mount.clock_offset, kLargestClockOffset, "s");
  require_own_covariance(mount);
}

const std::array<std::string, kMountQuantities>& mount_names() {
  static const std::array<std::string, kMountQuantities> names{
      "boresight_x_deg", "boresight_y_deg", "boresight_z_deg", "lever_arm_x_m",
      "lever_arm_y_m",   "lever_arm_z_m",   "clock_offset_s"};
  return names;
}

std::array<double, kMountQuantities> mount_sigmas(const Mount& mount) {
  return {mount.boresight[0].sigma, mount.boresight[1].sigma, mount.boresight[2].sigma,
          mount.lever_arm[0].sigma, mount.lever_arm[1].sigma, mount.lever_arm[2].sigma,
          mount.clock_offset.sigma};
}

bool found_together(const Mount& mount, const algebra::NamedCovariance& sensor) {
  const algebra::NamedCovariance own = mount.covariance.part(sensor.names);
  if (sensor.empty() || own.names != sensor.names) return false;
  const Eigen::VectorXd over_sigma = sensor.matrix.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd off =
      over_sigma.asDiagonal() * (own.matrix - sensor.matrix) * over_sigma.asDiagonal();
  return off.cwiseAbs().maxCoeff() <= 1e-9;
}

algebra::NamedCovariance joint_covariance(const algebra::NamedCovariance& sensor,
                                          const Mount& mount) {
  require_mount(mount);
  algebra::NamedCovariance joint = sensor;
  const std::array<double, kMountQuantities> sigmas = mount_sigmas(mount);
  std::vector<double> variances;
  for (std::size_t k = 0; k < kMountQuantities; ++k) {
    if (!(sigmas[k] > 0)) continue;
    joint.names.push_back(mount_names()[k]);
    variances.push_back(sigmas[k] * sigmas[k]);
  }
  const Eigen::Index known = sensor.names.size();
  const Eigen::Index all = joint.names.size();
  joint.matrix = Eigen::MatrixXd::Zero(all, all);
  joint.matrix.topLeftCorner(known, known) = sensor.matrix;
  for (Eigen::Index i = known; i < all; ++i) {
    joint.matrix(i, i) = variances[i - known];
  }
  const bool together = found_together(mount, sensor);
  const auto row_of = [&](Eigen::Index i) {
    return i < known && !together ? -1 : mount.covariance.find(joint.names[i]);
  };
  for (Eigen::Index i = known; i < all; ++i) {
    const Eigen::Index row = row_of(i);
    for (Eigen::Index j = 0; j < i; ++j) {
      const Eigen::Index column = row_of(j);
      if (row < 0 || column < 0) continue;
      joint.matrix(i, j) = joint.matrix(j, i) = mount.covariance.matrix(row, column);
    }
  }
  return joint;
}

Eigen::Matrix3d body_from_sensor(const Mount& mount) {
  require_mount(mount);
  const Eigen::Vector3d turn(mount.boresight[0].value, mount.boresight[1].value,
                             mount.boresight[2].value);
  return mount.nominal * algebra::turned_by(turn).toRotationMatrix();
}

Eigen::Vector3d lever_arm(const Mount& mount) {
  require_mount(mount);
  return {mount.lever_arm[0].value, mount.lever_arm[1].value, mount.lever_arm[2].value};
}

Mount parse_mount(const std::string& text, const std::string& path) {
  const YamlMap root(io::parse_yaml(text, path), path, "");
  if (root.find("risley_mount") == nullptr) {
    fail_at(path, root.line(), "is not a mount of a sensor: risley_mount is missing");
  }
  root.integer("risley_mount", kMountVersion, kMountVersion);
  root.allow_only({"risley_mount", "name", "reference_point", "sensor_axes", "body_from_sensor",
                   "boresight", "lever_arm", "clock_offset_s", "covariance"});
  Mount mount;
  if (root.find("name") != nullptr) mount.name = root.text("name");
  mount.reference_point = root.text("reference_point");
  if (mount.reference_point.empty()) {
    fail_at(path, root.at("reference_point").line,
            "reference_point is empty, expected words such as: centre of the IMU");
  }
  const YamlMap::Entry* const axes = root.find("sensor_axes");
  const YamlMap::Entry* const matrix = root.find("body_from_sensor");
  if (axes == nullptr && matrix == nullptr) {
    fail_at(path, root.line(), "sensor_axes is missing; body_from_sensor may be given instead");
  }
  if (axes != nullptr && matrix != nullptr) {
    fail_at(path, std::max(axes->line, matrix->line),
            "sensor_axes and body_from_sensor state the same quantity, expected only one of them");
  }
  const YamlMap rotation = root.section(axes != nullptr ? "sensor_axes" : "body_from_sensor");
  mount.nominal = axes != nullptr ? read_axes(rotation) : read_matrix(rotation);
  mount.nominal_source = rotation.words("source");
  mount.boresight = read_three(root, "boresight", "deg", kLargestBoresight_deg, kDegree);
  mount.lever_arm = read_three(root, "lever_arm", "m", kLongestLeverArm, 1);
  mount.clock_offset = read_stated(root, "clock_offset_s", kLargestClockOffset, "s", 1);
  if (const YamlMap::Entry* entry = root.find("covariance")) {
    mount.covariance = io::read_covariance(root, scale_of);
    try {
      require_own_covariance(mount);
    } catch (const InvalidArgument& error) {
      fail_at(path, entry->line, error.what());
    }
  }
  return mount;
}

Mount load_mount(const std::string& path) { return parse_mount(io::read_text_file(path), path); }

std::string mount_text(const Mount& mount) {
  require_mount(mount);
  std::string text = fmt::format("risley_mount: {}\n", kMountVersion);
  if (!mount.name.empty()) text += fmt::format("name: {}\n", yaml_quoted(mount.name));
  text += fmt::format(
      "reference_point: {}\n",
      yaml_quoted(mount.reference_point.empty() ? "not stated" : mount.reference_point));
  const std::string source =
      yaml_quoted(mount.nominal_source.empty() ? "not stated" : mount.nominal_source);
  if (const auto words = axes_words(mount.nominal)) {
    text += fmt::format("sensor_axes: {{x: {}, y: {}, z: {}, source: {}}}\n", (*words)[0],
                        (*words)[1], (*words)[2], source);
  } else {
    text += "body_from_sensor:\n  matrix:\n";
    for (int row = 0; row < 3; ++row) {
      text += fmt::format("    - [{}, {}, {}]\n", yaml_decimal(mount.nominal(row, 0)),
                          yaml_decimal(mount.nominal(row, 1)), yaml_decimal(mount.nominal(row, 2)));
    }
    text += fmt::format("  source: {}\n", source);
  }
  text += "boresight: # about the axes of the sensor\n";
  for (std::size_t i = 0; i < 3; ++i) {
    text +=
        fmt::format("  {}_deg: {}\n", kAxisLetters[i], stated_text(mount.boresight[i], kDegree));
  }
  text += "lever_arm: # from the reference point to the sensor; body: x forward, y right, z down\n";
  for (std::size_t i = 0; i < 3; ++i) {
    text += fmt::format("  {}_m: {}\n", kAxisLetters[i], stated_text(mount.lever_arm[i], 1));
  }
  text += "# added to the recording's clock to get the trajectory's time\n";
  text += fmt::format("clock_offset_s: {}\n", stated_text(mount.clock_offset, 1));
  if (!mount.covariance.empty()) {
    text +=
        "# Adjusted together with the sensor's parameters, which are in its calibration: with "
        "that\n"
        "# calibration, the covariances of points include the common errors of both.\n";
    text += io::covariance_text(mount.covariance, scale_of);
  }
  return text;
}

}  // namespace risley::trajectories
