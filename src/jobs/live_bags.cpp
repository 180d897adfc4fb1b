// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/live_bags.hpp"

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <mutex>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "risley/bags/messages.hpp"
#include "risley/core/error.hpp"
#include "risley/wire/dds_publisher.hpp"
#include "risley/wire/event_server.hpp"

namespace risley::jobs {
namespace {

constexpr std::string_view kFoxglove = "foxglove:", kDds = "dds";

/// For Foxglove-compatible viewers.
class FoxgloveBag final : public LiveBag {
 public:
  explicit FoxgloveBag(const wire::Endpoint& local) : server_(local, "risley record") {}

  std::size_t add(const bags::Topic& topic) override {
    const std::scoped_lock lock(mutex_);
    const auto [at, is_new] = numbers_.try_emplace(topic.name, 0);
    if (is_new) {
      at->second = server_.add(
          {topic.name, "cdr", topic.type, topic.stored.definition_format, topic.stored.definition});
    }
    return at->second;
  }
  void write(std::size_t topic, const bags::Message& message) override {
    server_.send(static_cast<std::uint32_t>(topic), message.time_ns, message.bytes);
  }
  void close() override { server_.close(); }
  std::string place() const override { return fmt::format("ws://{}/", to_string(server_.local())); }
  std::optional<wire::FoxgloveCounts> viewers() const override { return server_.counts(); }

 private:
  wire::FoxgloveServer server_;
  std::mutex mutex_;  // of the numbers
  std::map<std::string, std::size_t> numbers_;
};

/// For nodes of ROS 2.
class DdsBag final : public LiveBag {
 public:
  DdsBag(int domain, bool local_only) : domain_(domain), publisher_(domain, local_only) {}

  std::size_t add(const bags::Topic& topic) override {
    return publisher_.add(topic.name, topic.type);
  }
  void write(std::size_t topic, const bags::Message& message) override {
    publisher_.send(topic, message.bytes);
  }
  std::string place() const override { return fmt::format("domain {} of ROS 2", domain_); }

 private:
  int domain_;
  wire::DdsPublisher publisher_;
};

std::string_view environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

int dds_domain(std::string_view text) {
  int domain = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), domain);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw InvalidArgument(
        fmt::format("DDS domain = {}, allowed 0 to {}", text, wire::kHighestDdsDomain));
  }
  return domain;
}

}  // namespace

std::unique_ptr<LiveBag> open_live_bag(const std::string& destination) {
  const std::string_view text = destination;
  if (text.starts_with(kFoxglove)) {
    return std::make_unique<FoxgloveBag>(wire::listening_endpoint(text.substr(kFoxglove.size())));
  }
  const std::string_view usual = environment("ROS_DOMAIN_ID");
  const bool local_only = environment("ROS_LOCALHOST_ONLY") == "1";
  if (text == kDds) {
    return std::make_unique<DdsBag>(usual.empty() ? 0 : dds_domain(usual), local_only);
  }
  if (text.starts_with("dds:")) {
    return std::make_unique<DdsBag>(dds_domain(text.substr(kDds.size() + 1)), local_only);
  }
  throw InvalidArgument(
      fmt::format("points cannot be published to \"{}\", expected foxglove:PORT, "
                  "foxglove:ADDRESS:PORT, dds or dds:DOMAIN",
                  destination));
}

}  // namespace risley::jobs
