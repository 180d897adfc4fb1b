// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "risley/wire/client_session.hpp"

namespace risley::wire {

/// A session with a sensor of the second generation. There is no handshake: the client sets the
/// destination and contents of the sensor's data, starts it, and polls its state; the answers are
/// its signs of life. A sensor that restarted, and so no longer samples, is set up again. Points
/// are set to coordinates in mm, as LVX 2 requires; changed settings are restored at the end.
class ControlClient final : public ClientSession {
 public:
  /// @param device_type  as recordings::Device::type
  ControlClient(const ClientSettings& settings, std::uint8_t device_type, std::int64_t now_ns);

 private:
  /// What a request is for.
  enum class Purpose : std::uint8_t { identify, targets, setting, start, restore, stop };
  struct Asked {
    Purpose purpose = Purpose::identify;
    ControlCommand command = ControlCommand::get;
    std::vector<std::uint8_t> data;
    const char* name = "";  ///< for the message if it is rejected
  };

  void ask_next(std::int64_t now_ns) override;
  void ask_for_the_end() override;
  std::vector<std::uint8_t> heartbeat(std::uint16_t sequence) override;
  void take(std::span<const std::uint8_t> datagram, std::int64_t now_ns) override;
  bool take_reply(const ControlFrame& frame, std::int64_t now_ns);
  void ask_to_identify();
  void set_up();
  void take_identity(std::span<const KeyValue> list);
  void note(std::span<const KeyValue> list);
  Asked set_byte(Purpose purpose, std::uint16_t key, std::uint8_t value, const char* name) const;

  std::uint8_t device_type_;
  bool all_keys_ = true;  ///< the sensor has answered for all contents of a report
  std::deque<Asked> to_ask_;
  Asked asked_;
  bool identified_ = false, is_application_ = false, told_firmware_ = false;
  std::optional<std::uint8_t> data_type_, imu_;                ///< as the sensor was
  std::optional<std::uint8_t> data_type_before_, imu_before_;  ///< that were changed
  SensorReport report_;
};

}  // namespace risley::wire
