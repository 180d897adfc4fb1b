// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/flight_plan.hpp"

#include <cmath>
#include <string_view>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/core/require.hpp"
#include "risley/core/text.hpp"
#include "risley/io/text_file.hpp"
#include "risley/io/yaml_map.hpp"
#include "risley/io/yaml_output.hpp"

namespace risley::trajectories {
namespace {

using io::fail_at;
using io::YamlMap;

constexpr int kFlightVersion = 1, kStripsVersion = 1;
/// Numbers of the random streams; scenes and simulations use others.
constexpr std::uint64_t kAttitudeMotion = 300, kVelocityMotion = 301;

constexpr double kFarthestPlace = 1e5;                  // m from the map's origin
constexpr double kLongestStrip = 1e5;                   // m
constexpr double kHighestFlight = 1e5;                  // m
constexpr double kHighestSpeed = 1000;                  // m/s
constexpr double kLowestRate = 1, kHighestRate = 5000;  // Hz
constexpr double kLongestTurn = 3600;                   // s
constexpr double kLargestStart = 1e10;                  // s
constexpr double kLargestSwing_deg = 30, kLargestVelocity = 100;
constexpr double kHighestFrequency = 1000;  // Hz
// In extended precision, as files are read: a file may contain 0.1 if 0.1 and more is allowed.
constexpr long double kLowestSpeed = 0.01L, kLowestFrequency = 1e-3L, kShortestTurn = 0.1L;
constexpr int kMostSinusoids = 1000, kMostStrips = 10'000;

constexpr TimeScale kTimeScales[] = {TimeScale::unknown,           TimeScale::gps_second_of_week,
                                     TimeScale::utc_second_of_day, TimeScale::gps,
                                     TimeScale::adjusted_gps,      TimeScale::utc_unix};

/// One axis of a motion: the sum of amplitude cos(frequency t + phase).
class AxisMotion {
 public:
  /// @param axis  0 to 2, which selects the random numbers
  AxisMotion(const SinusoidMotion& motion, std::size_t axis, const RandomStream& random) {
    const auto count = static_cast<std::size_t>(motion.sinusoids);
    if (motion.rms[axis] == 0.0) return;
    const double amplitude = motion.rms[axis] * std::sqrt(2.0 / motion.sinusoids);
    const double part = (motion.highest_frequency - motion.lowest_frequency) / motion.sinusoids;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint64_t draw = 2 * (axis * kMostSinusoids + i);
      const double frequency =
          motion.lowest_frequency + (static_cast<double>(i) + random.uniform(draw)) * part;
      sines_.push_back({amplitude, kTwoPi * frequency, kTwoPi * random.uniform(draw + 1)});
    }
  }

  double value(double t) const {
    double sum = 0;
    for (const Sine& each : sines_)
      sum += each.amplitude * std::cos(each.frequency * t + each.phase);
    return sum;
  }
  /// Of the value, 0 on average.
  double integral(double t) const {
    double sum = 0;
    for (const Sine& each : sines_) {
      sum += each.amplitude / each.frequency * std::sin(each.frequency * t + each.phase);
    }
    return sum;
  }

 private:
  struct Sine {
    double amplitude, frequency, phase;
  };
  std::vector<Sine> sines_;
};

std::array<AxisMotion, 3> axes_of(const SinusoidMotion& motion, std::uint64_t seed,
                                  std::uint64_t stream) {
  const RandomStream random(seed, stream);
  return {AxisMotion(motion, 0, random), AxisMotion(motion, 1, random),
          AxisMotion(motion, 2, random)};
}

Eigen::Vector3d direction_of(double heading) { return {std::sin(heading), std::cos(heading), 0.0}; }

/// Position of the platform without motion.
struct Planned {
  Eigen::Vector3d position, velocity;
  double heading = 0;
};

/// A strip with its times, s since the beginning of the flight.
struct TimedStrip {
  const Strip* strip;
  double begin = 0, end = 0;

  Planned at(double t) const {
    const Eigen::Vector3d along = direction_of(strip->heading);
    const Eigen::Vector3d middle{strip->center[0], strip->center[1], strip->height};
    return {middle + (strip->speed * (t - begin) - 0.5 * strip->length) * along,
            strip->speed * along, strip->heading};
  }
};

/// The polynomial of the fifth degree in u = 0 ... 1 with 0 and 1 at the ends and no slope and no
/// bend there, and its derivative.
double smooth_step(double u) { return u * u * u * (10.0 + u * (-15.0 + 6.0 * u)); }
double smooth_step_slope(double u) { return 30.0 * u * u * (1.0 - u) * (1.0 - u); }

/// Between two strips: both lines extended, blended.
Planned turning(const TimedStrip& last, const TimedStrip& next, double t) {
  const double duration = next.begin - last.end;
  const double u = (t - last.end) / duration;
  const Planned from = last.at(last.end), to = next.at(next.begin);
  // A quintic with given ends, velocities there and no acceleration there: the velocities' parts
  // are Hermite's.
  const double u2 = u * u, u3 = u2 * u, u4 = u3 * u, u5 = u4 * u;
  const double go = u - 6 * u3 + 8 * u4 - 3 * u5, come = -4 * u3 + 7 * u4 - 3 * u5;
  const double go_slope = 1 - 18 * u2 + 32 * u3 - 15 * u4;
  const double come_slope = -12 * u2 + 28 * u3 - 15 * u4;
  Planned planned;
  const double step = smooth_step(u), slope = smooth_step_slope(u);
  planned.position = from.position + step * (to.position - from.position) +
                     duration * (go * from.velocity + come * to.velocity);
  planned.velocity = slope / duration * (to.position - from.position) + go_slope * from.velocity +
                     come_slope * to.velocity;
  double turn = wrap_to_pi(to.heading - from.heading);
  if (turn < -kPi + 1e-9) turn += kTwoPi;  // to the right
  planned.heading = from.heading + step * turn;
  return planned;
}

std::vector<TimedStrip> timed(const FlightPlan& plan) {
  std::vector<TimedStrip> strips;
  double t = plan.lead;
  for (const Strip& strip : plan.strips) {
    strips.push_back({&strip, t, t + strip.length / strip.speed});
    t = strips.back().end + plan.turn_duration;
  }
  return strips;
}

double records_of(const FlightPlan& plan) {
  return std::ceil((timed(plan).back().end + plan.lead) * plan.rate - 1e-6) + 1;
}

void require_motion(std::string_view name, const SinusoidMotion& motion, double limit,
                    std::string_view unit, double scale) {
  const auto field = [&](std::string_view part) { return fmt::format("{} {}", name, part); };
  for (const double rms : motion.rms) {
    require_between(field("rms"), rms / scale, 0, limit, unit);
  }
  require_between(field("lowest_frequency"), motion.lowest_frequency,
                  static_cast<double>(kLowestFrequency), kHighestFrequency, "Hz");
  require_between(field("highest_frequency"), motion.highest_frequency, motion.lowest_frequency,
                  kHighestFrequency, "Hz");
  require_between(field("sinusoids"), motion.sinusoids, 1, kMostSinusoids);
}

// The file.

void read_strips(const YamlMap& map, const Strip& usual, std::vector<Strip>& strips) {
  map.allow_only({"name", "headings_deg", "heading_deg", "count", "spacing_m", "center_m",
                  "length_m", "height_m", "speed_m_per_s"});
  Strip strip = usual;
  strip.length = map.real("length_m", 1, kLongestStrip, "m");
  strip.height = map.real("height_m", -kHighestFlight, kHighestFlight, "m", usual.height);
  strip.speed = map.real("speed_m_per_s", kLowestSpeed, kHighestSpeed, "m/s", usual.speed);
  if (map.find("center_m") != nullptr) {
    const auto center = map.reals("center_m", 0, -kFarthestPlace, kFarthestPlace, "m");
    if (center.size() != 2) {
      fail_at(map.path(), map.at("center_m").line,
              fmt::format("{}: expected [x, y] in m", map.field("center_m")));
    }
    strip.center = {center[0], center[1]};
  }
  const bool several = map.find("headings_deg") != nullptr;
  if (several == (map.find("heading_deg") != nullptr)) {
    fail_at(map.path(), map.line(),
            fmt::format("expected either {}, for strips through one place, or {} with count and "
                        "spacing_m, for parallel strips; found {}",
                        map.field("headings_deg"), map.field("heading_deg"),
                        several ? "both" : "neither"));
  }
  if (several && map.find("count") != nullptr) {
    fail_at(map.path(), map.at("count").line,
            fmt::format("{} is for parallel strips, with {}", map.field("count"),
                        map.field("heading_deg")));
  }
  if ((map.find("spacing_m") != nullptr) != (map.find("count") != nullptr)) {
    fail_at(map.path(), map.line(),
            fmt::format("{} and {} need each other", map.field("count"), map.field("spacing_m")));
  }
  const std::size_t first = strips.size();
  if (several) {
    for (const double heading_deg : map.reals("headings_deg", 0, -360, 360, "deg")) {
      strip.heading = radians_from_degrees(heading_deg);
      strips.push_back(strip);
    }
  } else {
    const double heading = radians_from_degrees(map.real("heading_deg", -360, 360, "deg"));
    const bool parallel = map.find("count") != nullptr;
    const int count = parallel ? map.integer("count", 1, kMostStrips) : 1;
    const double spacing = parallel ? map.real("spacing_m", 0, kFarthestPlace, "m") : 0.0;
    const std::array<double, 2> center = strip.center;
    for (int i = 0; i < count; ++i) {
      const double right = spacing * (i - 0.5 * (count - 1));
      strip.center = {center[0] + right * std::cos(heading), center[1] - right * std::sin(heading)};
      strip.heading = i % 2 == 0 ? heading : heading + kPi;
      strips.push_back(strip);
    }
  }
  if (strips.size() > kMostStrips) {
    fail_at(map.path(), map.line(), fmt::format("more than {} strips", kMostStrips));
  }
  const std::string own = map.find("name") == nullptr ? std::string() : map.text("name");
  for (std::size_t i = first; i < strips.size(); ++i) {
    strips[i].name = own.empty()                  ? fmt::format("strip {}", i + 1)
                     : strips.size() - first == 1 ? own
                                                  : fmt::format("{} {}", own, i - first + 1);
    for (std::size_t j = 0; j < first; ++j) {
      if (strips[j].name != strips[i].name) continue;
      fail_at(map.path(), map.line(),
              fmt::format("two strips have the name \"{}\"", strips[i].name));
    }
  }
}

SinusoidMotion read_motion(const YamlMap& map, const std::array<std::string, 3>& axes, double limit,
                           std::string_view unit) {
  map.allow_only({axes[0], axes[1], axes[2], "lowest_hz", "highest_hz", "sinusoids"});
  SinusoidMotion motion;
  for (std::size_t i = 0; i < 3; ++i) motion.rms[i] = map.real(axes[i], 0, limit, unit);
  motion.lowest_frequency = map.real("lowest_hz", kLowestFrequency, kHighestFrequency, "Hz");
  motion.highest_frequency =
      map.real("highest_hz", motion.lowest_frequency, kHighestFrequency, "Hz");
  motion.sinusoids = map.integer("sinusoids", 1, kMostSinusoids);
  return motion;
}

void read_start(const YamlMap& map, FlightPlan& plan) {
  map.allow_only({"scale", "time_s", "gps_week"});
  const std::string word = map.text("scale");
  std::vector<std::string> known;
  bool found = false;
  for (const TimeScale scale : kTimeScales) {
    known.push_back(to_string(scale));
    if (known.back() != word) continue;
    plan.time_scale = scale;
    found = true;
  }
  if (!found) {
    fail_at(map.path(), map.at("scale").line,
            fmt::format("{} = \"{}\"{}, allowed {}", map.field("scale"), word,
                        did_you_mean(word, known), fmt::join(known, ", ")));
  }
  plan.start = map.real("time_s", -kLargestStart, kLargestStart, "s");
  if (map.find("gps_week") == nullptr) return;
  if (plan.time_scale != TimeScale::gps_second_of_week) {
    fail_at(map.path(), map.at("gps_week").line,
            fmt::format("{} belongs to the scale {}", map.field("gps_week"),
                        to_string(TimeScale::gps_second_of_week)));
  }
  plan.gps_week = map.integer("gps_week", 0, 100'000);
}

}  // namespace

void require_flight_plan(const FlightPlan& plan) {
  require_between("strips of the flight", static_cast<double>(plan.strips.size()), 1, kMostStrips);
  for (const Strip& strip : plan.strips) {
    const auto field = [&](std::string_view part) {
      return fmt::format("{} of strip \"{}\"", part, strip.name);
    };
    require_between(field("center[0]"), strip.center[0], -2 * kFarthestPlace, 2 * kFarthestPlace,
                    "m");
    require_between(field("center[1]"), strip.center[1], -2 * kFarthestPlace, 2 * kFarthestPlace,
                    "m");
    require_finite(field("heading"), strip.heading, "rad");
    require_between(field("length"), strip.length, 1, kLongestStrip, "m");
    require_between(field("height"), strip.height, -kHighestFlight, kHighestFlight, "m");
    require_between(field("speed"), strip.speed, static_cast<double>(kLowestSpeed), kHighestSpeed,
                    "m/s");
  }
  if (plan.origin) geocentric_from_geodetic(*plan.origin);  // refuses what is no place
  require_between("start", plan.start, -kLargestStart, kLargestStart, "s");
  require_between("rate", plan.rate, kLowestRate, kHighestRate, "Hz");
  require_between("turn_duration", plan.turn_duration, static_cast<double>(kShortestTurn),
                  kLongestTurn, "s");
  require_between("lead", plan.lead, 0, kLongestTurn, "s");
  require_motion("attitude motion", plan.attitude, kLargestSwing_deg, "deg", kRadiansPerDegree);
  require_motion("velocity motion", plan.velocity, kLargestVelocity, "m/s", 1);
  require_between("records of the flight", records_of(plan), 1,
                  static_cast<double>(kMostFlightRecords));
}

Flight fly(const FlightPlan& plan) {
  require_flight_plan(plan);
  const std::vector<TimedStrip> strips = timed(plan);
  const auto attitude = axes_of(plan.attitude, plan.seed, kAttitudeMotion);
  const auto velocity = axes_of(plan.velocity, plan.seed, kVelocityMotion);
  const auto start_ns =
      static_cast<std::int64_t>(std::llround(static_cast<long double>(plan.start) * 1e9L));
  const auto since_start_ns = [](long double t) {
    return static_cast<std::int64_t>(std::llround(t * 1e9L));
  };

  Flight flight;
  for (const TimedStrip& each : strips) {
    flight.strips.push_back({each.strip->name,
                             start_ns + since_start_ns(static_cast<long double>(each.begin)),
                             start_ns + since_start_ns(static_cast<long double>(each.end))});
  }
  Trajectory& trajectory = flight.trajectory;
  trajectory.time_scale = plan.time_scale;
  trajectory.gps_week = plan.gps_week;
  trajectory.frame = plan.origin ? Frame::geocentric : Frame::local;

  // Axes east, north, up of the map among those of the frame, and the place of its origin.
  Eigen::Matrix3d frame_from_map = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Matrix3d map_from_ned;
  map_from_ned << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  if (plan.origin) {
    origin = geocentric_from_geodetic(*plan.origin);
    frame_from_map = geocentric_from_ned(*plan.origin) * map_from_ned.transpose();
  }
  const Eigen::Quaterniond frame_from_ned(Eigen::Matrix3d(frame_from_map * map_from_ned));

  const auto records = static_cast<std::size_t>(records_of(plan));
  trajectory.time_ns.reserve(records);
  trajectory.position.reserve(records);
  trajectory.attitude.reserve(records);
  trajectory.velocity.reserve(records);
  std::size_t current = 0;  // the current strip, or the one before the turn
  for (std::size_t i = 0; i < records; ++i) {
    const std::int64_t time_ns =
        since_start_ns(static_cast<long double>(i) / static_cast<long double>(plan.rate));
    const double t = 1e-9 * static_cast<double>(time_ns);
    while (current + 1 < strips.size() && t >= strips[current + 1].begin) ++current;
    const bool in_turn = current + 1 < strips.size() && t > strips[current].end;
    const Planned planned =
        in_turn ? turning(strips[current], strips[current + 1], t) : strips[current].at(t);
    const Eigen::Vector3d sway{velocity[0].integral(t), velocity[1].integral(t),
                               velocity[2].integral(t)};
    const Eigen::Vector3d sway_velocity{velocity[0].value(t), velocity[1].value(t),
                                        velocity[2].value(t)};
    trajectory.time_ns.push_back(start_ns + time_ns);
    trajectory.position.push_back(origin + frame_from_map * (planned.position + sway));
    trajectory.velocity.push_back(frame_from_map * (planned.velocity + sway_velocity));
    const Eigen::Quaterniond ned =
        ned_from_body({attitude[0].value(t), attitude[1].value(t),
                       wrap_to_two_pi(planned.heading + attitude[2].value(t))});
    trajectory.attitude.push_back((frame_from_ned * ned).normalized());
  }
  return flight;
}

std::string strip_times_text(const std::vector<StripTimes>& strips, TimeScale scale) {
  std::string text = fmt::format(
      "# When strips are flown, in the time of their trajectory.\n"
      "risley_strips: {}\ntime_scale: {}\nstrips:{}\n",
      kStripsVersion, to_string(scale), strips.empty() ? " []" : "");
  for (const StripTimes& strip : strips) {
    text += fmt::format("  - {{name: {}, begin_ns: {}, end_ns: {}}}\n", io::yaml_quoted(strip.name),
                        strip.begin_ns, strip.end_ns);
  }
  return text;
}

FlightPlan parse_flight_plan(const std::string& text, const std::string& path) {
  const YamlMap root(io::parse_yaml(text, path), path, "");
  root.allow_only({"risley_flight", "name", "origin", "start", "rate_hz", "height_m",
                   "speed_m_per_s", "turn_duration_s", "lead_s", "strips", "motion"});
  root.integer("risley_flight", kFlightVersion, kFlightVersion);
  FlightPlan plan;
  if (root.find("name") != nullptr) plan.name = root.text("name");
  if (root.find("origin") != nullptr) {
    const YamlMap map = root.section("origin");
    map.allow_only({"latitude_deg", "longitude_deg", "ellipsoidal_height_m"});
    plan.origin = Geodetic{radians_from_degrees(map.real("latitude_deg", -90, 90, "deg")),
                           radians_from_degrees(map.real("longitude_deg", -360, 360, "deg")),
                           map.real("ellipsoidal_height_m", -1e4, 1e4, "m")};
  }
  if (root.find("start") != nullptr) read_start(root.section("start"), plan);
  plan.rate = root.real("rate_hz", kLowestRate, kHighestRate, "Hz");
  plan.turn_duration = root.real("turn_duration_s", kShortestTurn, kLongestTurn, "s");
  plan.lead = root.real("lead_s", 0, kLongestTurn, "s", plan.lead);
  Strip usual;
  usual.height = root.real("height_m", -kHighestFlight, kHighestFlight, "m");
  usual.speed = root.real("speed_m_per_s", kLowestSpeed, kHighestSpeed, "m/s");
  const YamlMap::Entry& strips = root.at("strips");
  if (!strips.value.is_list() || strips.value.items.empty()) {
    fail_at(path, strips.line, "strips: expected a list of strips");
  }
  for (const YamlMap& map : root.maps("strips")) read_strips(map, usual, plan.strips);
  if (root.find("motion") != nullptr) {
    const YamlMap map = root.section("motion");
    map.allow_only({"seed", "attitude", "velocity"});
    plan.seed = static_cast<std::uint64_t>(map.integer("seed", 0, 2'147'483'647));
    if (map.find("attitude") != nullptr) {
      plan.attitude = read_motion(map.section("attitude"), {"roll_deg", "pitch_deg", "heading_deg"},
                                  kLargestSwing_deg, "deg");
      for (double& rms : plan.attitude.rms) rms = radians_from_degrees(rms);
    }
    if (map.find("velocity") != nullptr) {
      plan.velocity = read_motion(map.section("velocity"), {"x_m_per_s", "y_m_per_s", "z_m_per_s"},
                                  kLargestVelocity, "m/s");
    }
  }
  try {
    require_flight_plan(plan);
  } catch (const InvalidArgument& error) {  // what no single field shows
    fail_at(path, root.line(), error.what());
  }
  return plan;
}

FlightPlan load_flight_plan(const std::string& path) {
  return parse_flight_plan(io::read_text_file(path), path);
}

}  // namespace risley::trajectories
