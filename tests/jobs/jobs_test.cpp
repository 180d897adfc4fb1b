// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Everything from a recording to a cloud through the jobs alone, as another front end would do it,
// and what cancelling them leaves behind: nothing.
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <unistd.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/jobs/calibrate_recordings.hpp"
#include "risley/jobs/cloud_of_recording.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/jobs/convert_recording.hpp"
#include "risley/jobs/estimate_recording.hpp"
#include "risley/jobs/identify_recording.hpp"
#include "risley/jobs/inspect_recording.hpp"
#include "risley/jobs/observability.hpp"
#include "risley/jobs/plan_calibration.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/truth.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/truth_file.hpp"

#include "source_tree.hpp"
#include "warning_codes.hpp"

namespace risley::jobs::jobs_test {

namespace fs = std::filesystem;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

/// One recording of a hall for all tests, and a folder of each test's own.
class JobsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    root_ = fs::temp_directory_path() / ("risley-jobs-" + std::to_string(::getpid()));
    fs::create_directories(root_);
    simulation::SimulationSettings settings;
    settings.truth = sensors::load_sensor("mid-40-table3");
    settings.reported = settings.truth;
    settings.reported->train = settings.reported->train.without_errors();
    settings.scene = scenes::load_scene(in_source_tree("data/hall.yaml"));
    settings.duration = 2.0;
    settings.rate = 50000.0;
    settings.seed = 7;
    simulation::simulate_to_file(settings, hall(), {});
  }
  static void TearDownTestSuite() { fs::remove_all(root_); }

  void SetUp() override {
    folder_ = root_ / ::testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::create_directories(folder_);
  }

  static std::string hall() { return (root_ / "hall.nc").string(); }
  static std::string truth() { return hall() + ".truth.yaml"; }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  /// Every file and folder below the test's.
  std::set<std::string> names() const {
    std::set<std::string> result;
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      result.insert(fs::relative(entry.path(), folder_).string());
    }
    return result;
  }

  EstimateRecordingOptions estimation() const {
    EstimateRecordingOptions options;
    options.recording = hall();
    options.truth = truth();
    options.details = true;
    options.files = {path("estimate"), StatesRows::all, {{"command", "test"}}};
    return options;
  }
  CalibrateRecordingsOptions calibration() const {
    CalibrateRecordingsOptions options;
    options.recordings = {hall()};
    options.truths = {truth()};
    options.details = true;
    options.files = {path("calibration"), StatesRows::knots, {{"command", "test"}}};
    return options;
  }
  CloudOfRecordingOptions cloud(const std::string& calibrated) const {
    CloudOfRecordingOptions options;
    options.recording = hall();
    options.calibration = calibrated;
    options.output = path("cloud.las");
    return options;
  }

  fs::path folder_;
  static inline fs::path root_;
};

std::size_t open_files() {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator()));
}

std::size_t threads() {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator("/proc/self/task"), fs::directory_iterator()));
}

TEST_F(JobsTest, LeadFromARecordingToACloud) {
  std::set<std::string> stages;
  const Progress progress = [&](double fraction, std::string_view stage) {
    stages.insert(std::string(stage));
    EXPECT_GE(fraction, 0.0);
    EXPECT_LE(fraction, 1.0);
  };
  const EstimatedRecording estimated = estimate_recording(estimation(), progress);
  EXPECT_TRUE(estimated.estimate.converged) << estimated.estimate.reason;
  EXPECT_EQ(estimated.recording.audit.shots, 100000u);
  EXPECT_EQ(estimated.nominal.name, "mid-40");
  ASSERT_TRUE(estimated.details && estimated.details->pieces);
  EXPECT_EQ(estimated.details->pieces->size() + estimated.details->pieces->failed, 20u);
  EXPECT_EQ(estimated.details->speeds.size(), 2u);
  EXPECT_EQ(estimated.details->residuals_over_angles.size(), 1u);
  EXPECT_FALSE(estimated.details->advice.empty());

  const CalibratedRecordings calibrated = calibrate_recordings(calibration(), progress);
  EXPECT_TRUE(calibrated.calibration.converged) << calibrated.calibration.reason;
  ASSERT_TRUE(calibrated.truth && calibrated.details && calibrated.details->field);
  EXPECT_LT(calibrated.truth->after.total, 0.1 * calibrated.truth->before.total);
  EXPECT_EQ(calibrated.details->walls.size(), 1u);

  const cloud::CloudSummary made =
      cloud_of_recording(cloud(path("calibration/calibration.yaml")), progress).summary;
  EXPECT_GT(made.points, 90000u);
  EXPECT_FALSE(made.damage);

  EXPECT_EQ(stages, (std::set<std::string>{"", "calibrating", "estimating", "judging", "reading",
                                           "rotation angles 1/1"}));
  EXPECT_EQ(names(), (std::set<std::string>{"calibration", "calibration/calibration.yaml",
                                            "calibration/states.nc", "cloud.las", "estimate",
                                            "estimate/calibration.yaml", "estimate/states.nc"}));
  const sensors::Sensor written = sensors::load_sensor(path("calibration/calibration.yaml"));
  EXPECT_EQ(written.provenance.front(), (std::pair<std::string, std::string>{"command", "test"}));
}

/// Counts how often anybody opens a file, in child processes too.
class OpenCounter {
 public:
  explicit OpenCounter(const std::string& path) : events_(::inotify_init1(IN_CLOEXEC)) {
    // What lies between keeps the kernel from taking two in a row for one.
    ::inotify_add_watch(events_, path.c_str(), IN_OPEN | IN_ACCESS | IN_CLOSE);
    ::fcntl(events_, F_SETFL, O_NONBLOCK);
  }
  ~OpenCounter() { ::close(events_); }
  int opens() const {
    int count = 0;
    alignas(inotify_event) std::array<char, 4096> bytes;
    for (ssize_t got = 0; (got = ::read(events_, bytes.data(), bytes.size())) > 0;) {
      for (ssize_t at = 0; at < got;) {
        const auto* event = reinterpret_cast<const inotify_event*>(bytes.data() + at);
        count += (event->mask & IN_OPEN) != 0 ? 1 : 0;
        at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
      }
    }
    return count;
  }

 private:
  int events_;
};

TEST_F(JobsTest, OpenTheirInputOnce) {
  const std::string lvx = path("hall.lvx"), csv = path("hall.csv");
  const auto convert = [](const std::string& input, const std::string& output) {
    ConvertRecordingOptions options;
    options.recording = input;
    options.output = output;
    convert_recording(options);
  };
  convert(hall(), lvx);
  convert(hall(), csv);
  auto estimate = estimation();
  estimate.truth.clear();
  estimate.details = false;
  estimate_recording(estimate);
  const std::string calibrated = path("estimate/calibration.yaml");
  const std::vector<std::pair<const char*, std::function<void(const std::string&)>>> jobs = {
      {"info",
       [](const std::string& input) {
         InspectRecordingOptions options;
         options.recording = input;
         inspect_recording(options);
       }},
      {"estimate",
       [&](const std::string& input) {
         estimate.recording = input;
         estimate_recording(estimate);
       }},
      {"observability",
       [](const std::string& input) {
         ObservabilityOptions options;
         options.recording = input;
         judge_observability(options);
       }},
      {"identify",
       [&](const std::string& input) {
         IdentifyRecordingOptions options;
         options.recording = input;
         options.output = path("identified.yaml");
         identify_recording(options);
       }},
      {"convert", [&](const std::string& input) { convert(input, path("converted.nc")); }},
      {"calibrate",
       [&](const std::string& input) {
         auto options = calibration();
         options.recordings = {input};
         options.truths.clear();
         options.details = false;
         calibrate_recordings(options);
       }},
      {"cloud",
       [&](const std::string& input) {
         auto options = cloud(calibrated);
         options.recording = input;
         cloud_of_recording(options);
       }},
  };
  for (const auto& [name, job] : jobs) {
    for (const std::string& input : {lvx, csv}) {
      const OpenCounter counter(input);
      job(input);
      EXPECT_EQ(counter.opens(), 1) << name << ' ' << input;
    }
    // The process that reads NetCDF gets the open file; its libraries open that by its number: one
    // looks for links that lead out of it, the other reads.
    const OpenCounter counter(hall());
    job(hall());
    EXPECT_LE(counter.opens(), 1 + 5) << name;
  }
}

TEST_F(JobsTest, TextsAppearWithTheOtherFilesAndOlderOnesStepAside) {
  EstimateRecordingOptions options = estimation();
  options.details = false;
  options.texts = [this](const EstimatedRecording& result) {
    EXPECT_TRUE(names().contains("estimate"));
    EXPECT_FALSE(names().contains("estimate/calibration.yaml"));  // not before the texts are made
    return std::vector<NamedText>{{"report.json", "risley " + result.estimate.sensor.name}};
  };
  EXPECT_THAT(codes_of(estimate_recording(options).warnings),
              Not(::testing::Contains("results_renamed")));
  EXPECT_EQ(io::read_text_file(path("estimate/report.json")), "risley mid-40");
  // Of the next run without texts and states none may pass for its own.
  options.texts = nullptr;
  options.files.states = StatesRows::none;
  const EstimatedRecording again = estimate_recording(options);
  EXPECT_THAT(codes_of(again.warnings), ::testing::Contains("results_renamed").Times(2));
  EXPECT_EQ(names(),
            (std::set<std::string>{"estimate", "estimate/calibration.yaml",
                                   "estimate/report.earlier.json", "estimate/states.earlier.nc"}));
}

TEST_F(JobsTest, AStoppedExchangeLeavesItsMark) {
  EstimateRecordingOptions options = estimation();
  options.details = false;
  options.files.states = StatesRows::none;
  options.texts = [this](const EstimatedRecording&) {
    // Somebody makes a folder of the name that a file is to get.
    fs::create_directories(path("estimate/calibration.yaml"));
    return std::vector<NamedText>{};
  };
  EXPECT_THROW(estimate_recording(options), FileError);
  EXPECT_TRUE(names().contains(std::string("estimate/") + kIncomplete));
  fs::remove(path("estimate/calibration.yaml"));
  options.texts = nullptr;
  estimate_recording(options);
  EXPECT_EQ(names(), (std::set<std::string>{"estimate", "estimate/calibration.yaml"}));
}

TEST_F(JobsTest, RotationAnglesAreThoseOfTheFirstShot) {
  EstimateRecordingOptions options = estimation();
  options.details = false;
  options.files = {};
  const EstimatedRecording found = estimate_recording(options);
  const estimation::Estimate& estimate = found.estimate;
  const std::int64_t first_ns = estimate.series.time_ns(0);
  ASSERT_LT(first_ns, estimate.states.time_ns.front()) << "the first knot comes later";
  const auto truth = recordings::load_truth(hall() + ".truth.nc", std::vector{first_ns});
  ASSERT_EQ(truth.time_ns.size(), 1U);
  for (std::size_t k = 0; k < 2; ++k) {
    const estimation::EstimatedValue& angle = estimate.values[estimate.values.size() - 2 + k];
    EXPECT_LT(std::abs(wrap_to_pi(angle.value - truth.rotation_angle[k][0])), 5 * angle.sigma)
        << angle.name;
    ASSERT_LT(angle.sigma, radians_from_degrees(0.1));
  }
}

TEST_F(JobsTest, WhatSomebodyElseWroteStays) {
  EstimateRecordingOptions options = estimation();
  options.details = false;
  fs::create_directories(path("estimate"));
  for (const char* name : {"states_1.nc", "trajectory.csv", "report.html"}) {
    io::write_text_file(path(std::string("estimate/") + name), "mine");
  }
  estimate_recording(options);
  for (const char* name : {"states_1.nc", "trajectory.csv", "report.html"}) {
    EXPECT_EQ(io::read_text_file(path(std::string("estimate/") + name)), "mine") << name;
  }
  io::write_text_file(path("estimate/calibration.yaml"), "mine");
  EXPECT_THROW(estimate_recording(options), FileError);
  EXPECT_EQ(io::read_text_file(path("estimate/calibration.yaml")), "mine");
}

TEST_F(JobsTest, AResultIsTakenOnlyWhenItIsWhole) {
  EstimateRecordingOptions options = estimation();
  options.details = false;
  estimate_recording(options);
  EXPECT_NO_THROW(load_result(path("estimate")));
  EXPECT_NO_THROW(load_result(path("estimate/calibration.yaml")));
  io::write_text_file(path("estimate/INCOMPLETE"), "as a killed run leaves it");
  EXPECT_THROW(load_result(path("estimate")), FileError);
  EXPECT_THROW(load_result(path("estimate/calibration.yaml")), FileError);
}

TEST_F(JobsTest, WriteNothingThatNoOptionNames) {
  EstimateRecordingOptions options = estimation();
  options.files = {};
  EXPECT_TRUE(estimate_recording(options).provenance.empty());
  CalibrateRecordingsOptions calibrate = calibration();
  calibrate.files = {};
  calibrate_recordings(calibrate);
  EXPECT_TRUE(names().empty());
}

/// Cancels `job` at ten moments, half of them by throwing and half by the flag, and expects that
/// nothing is left of it.
void cancel_at_ten_moments(const std::function<void(const Progress&)>& job,
                           const std::function<std::set<std::string>()>& names) {
  std::size_t calls = 0;
  const std::set<std::string> before = names();
  {
    CancelFlag never;
    job({[&](double) { ++calls; }, &never});
  }
  const std::set<std::string> whole = names();
  ASSERT_GE(calls, 10u);
  for (std::size_t moment = 0; moment < 10; ++moment) {
    for (const std::string& name : whole) {
      if (!before.contains(name)) fs::remove_all(name);
    }
    ASSERT_EQ(names(), before);
    const std::size_t files = open_files(), most_threads = threads();
    const std::size_t stop_at = 1 + moment * calls / 10;
    CancelFlag flag;
    std::size_t call = 0;
    const Progress progress(
        [&](double) {
          if (++call != stop_at) return;
          if (moment % 2 == 0) throw Cancelled();
          flag.set();
        },
        &flag);
    if (moment % 2 == 1 && stop_at == calls) continue;  // nothing looks at the flag any more
    EXPECT_THROW(job(progress), Cancelled) << moment;
    EXPECT_LE(call, stop_at + std::thread::hardware_concurrency()) << "it went on";
    EXPECT_EQ(names(), before) << moment;
    EXPECT_EQ(open_files(), files) << moment;
    EXPECT_LE(threads(), most_threads) << moment;
  }
}

TEST_F(JobsTest, ACancelledEstimateLeavesNothing) {
  const auto here = [this] {
    std::set<std::string> result;
    for (const std::string& name : names()) result.insert(path(name));
    return result;
  };
  cancel_at_ten_moments(
      [this](const Progress& progress) { estimate_recording(estimation(), progress); }, here);
}

TEST_F(JobsTest, ACancelledCalibrationLeavesNothing) {
  const auto here = [this] {
    std::set<std::string> result;
    for (const std::string& name : names()) result.insert(path(name));
    return result;
  };
  cancel_at_ten_moments(
      [this](const Progress& progress) { calibrate_recordings(calibration(), progress); }, here);
}

TEST_F(JobsTest, ACancelledCloudLeavesNothing) {
  // Two pieces of reading make few calls: the recording is read as often as it takes.
  const auto here = [this] {
    std::set<std::string> result;
    for (const std::string& name : names()) result.insert(path(name));
    return result;
  };
  std::size_t calls = 0;
  cloud_of_recording(cloud("mid-40-table3"), [&](double) { ++calls; });
  fs::remove(path("cloud.las"));
  ASSERT_GT(calls, 0u);
  for (std::size_t stop_at = 1; stop_at <= calls; ++stop_at) {
    const std::size_t files = open_files();
    std::size_t call = 0;
    EXPECT_THROW(cloud_of_recording(cloud("mid-40-table3"),
                                    [&](double) {
                                      if (++call == stop_at) throw Cancelled();
                                    }),
                 Cancelled);
    EXPECT_TRUE(here().empty());
    EXPECT_EQ(open_files(), files);
  }
}

TEST_F(JobsTest, ASetFlagStopsWhatTellsNothing) {
  // No callback at all: a flag that another thread or a signal handler sets is enough.
  CancelFlag flag;
  const Progress silent(Progress::Callback(), &flag);
  flag.set();
  EXPECT_THROW(estimate_recording(estimation(), silent), Cancelled);
  EXPECT_THROW(calibrate_recordings(calibration(), silent), Cancelled);
  EXPECT_THROW(cloud_of_recording(cloud("mid-40"), silent), Cancelled);
  EXPECT_THROW(inspect_recording({hall(), {}, {}, {}}, silent), Cancelled);
  EXPECT_THROW(convert_recording({hall(), {}, path("again.nc"), {}, {}}, silent), Cancelled);
  EXPECT_THROW(judge_observability({}, silent), Cancelled);
  PlanCalibrationOptions plan;
  plan.scene = scenes::load_scene(in_source_tree("data/hall.yaml"));
  EXPECT_THROW(plan_calibration(plan, silent), Cancelled);
  EXPECT_TRUE(names().empty());
}

TEST_F(JobsTest, AnotherThreadStopsAnEstimate) {
  CancelFlag flag;
  std::thread other([&flag] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    flag.set();
  });
  const auto estimate_for_ever = [&] {
    for (;;) estimate_recording(estimation(), {Progress::Callback(), &flag});
  };
  EXPECT_THROW(estimate_for_ever(), Cancelled);
  other.join();
}

TEST_F(JobsTest, FailedNumbersSetAnOlderCalibrationAside) {
  fs::create_directories(path("estimate"));
  std::ofstream(path("estimate/calibration.yaml")) << "risley, older";
  EstimateRecordingOptions options = estimation();
  options.truth.clear();
  options.additional = {"refractive_index_air", "wedge_angle_deg"};  // no data separate them
  const EstimatedRecording estimated = estimate_recording(options);
  EXPECT_FALSE(estimated.estimate.converged);
  EXPECT_EQ(names(), (std::set<std::string>{"estimate", "estimate/calibration.earlier.yaml",
                                            "estimate/states.nc"}));
  EXPECT_TRUE(estimated.details->advice.empty());
}

TEST_F(JobsTest, SayWhichOptionIsWrongByItsField) {
  const auto message = [](const auto& job) {
    try {
      job();
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  };
  std::vector<std::string> messages;
  const auto refused = [&](auto options, const auto& spoil, const auto& job) {
    spoil(options);
    messages.push_back(message([&] { job(options); }));
  };
  const auto estimate = [](const auto& o) { estimate_recording(o); };
  refused(
      estimation(), [](auto& o) { o.rate = 0.0; }, estimate);
  refused(
      estimation(), [](auto& o) { o.angle_noise = -1.0; }, estimate);
  refused(
      estimation(), [](auto& o) { o.truth = "truth.nc"; }, estimate);
  refused(
      estimation(),
      [](auto& o) {
        o.method = estimation::Method::ekf;
        o.rate = 1000.0;
      },
      estimate);
  refused(
      estimation(),
      [](auto& o) {
        o.fixed = {{"angular_velocity_a_deg_per_s", 1.0}};
      },
      estimate);
  const auto calibrate = [](const auto& o) { calibrate_recordings(o); };
  refused(
      calibration(), [](auto& o) { o.range_offset_sigma = -1.0; }, calibrate);
  refused(
      calibration(), [](auto& o) { o.truths.push_back(o.truths.front()); }, calibrate);
  refused(
      calibration(),
      [](auto& o) {
        o.method = calibration::CalibrationMethod::paper;
        o.prior_sigma = 0.1;
      },
      calibrate);
  refused(
      cloud("mid-40"), [](auto& o) { o.cloud.rate = -1.0; },
      [](const auto& o) { cloud_of_recording(o); });
  EXPECT_THAT(messages, Each(HasSubstr("option ")));
  EXPECT_THAT(messages, Each(Not(HasSubstr("--"))));
  EXPECT_TRUE(names().empty());
}

TEST_F(JobsTest, RefuseRangesThatTheSensorCannotHaveMeasured) {
  const auto calibrate = [this](double factor) {
    std::ofstream csv(path("ranges.csv"));
    csv << "time_s,azimuth_deg,zenith_deg,range_m\n";
    const recordings::Observations shots = recordings::load_recording(hall()).data.observations;
    for (std::size_t i = 0; i < 20000; ++i) {
      csv << 1e-9 * static_cast<double>(shots.time_ns[i] - shots.time_ns[0]) << ','
          << degrees_from_radians(shots.azimuth[i]) << ',' << degrees_from_radians(shots.zenith[i])
          << ',' << factor * shots.range[i] << '\n';
    }
    csv.close();
    CalibrateRecordingsOptions options = calibration();
    options.recordings = {path("ranges.csv")};
    options.truths.clear();
    options.files = {};
    return calibrate_recordings(options);
  };
  EXPECT_THROW(calibrate(1000.0), EstimationError);
  EXPECT_THROW(calibrate(0.01), EstimationError);
}

TEST_F(JobsTest, RefuseTheSameRecordingTwice) {
  CalibrateRecordingsOptions options = calibration();
  options.recordings = {hall(), hall()};
  options.truths.clear();
  EXPECT_THROW(calibrate_recordings(options), InvalidArgument);
  options.recordings.clear();
  EXPECT_THROW(calibrate_recordings(options), InvalidArgument);
}

}  // namespace risley::jobs::jobs_test
