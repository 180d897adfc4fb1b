// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "risley/jobs/record_sensors.hpp"
#include "risley/wire/udp_socket.hpp"

namespace risley::jobs {

/// ns of a clock that never goes back.
std::int64_t steady_ns();

/// Detects sensors on one interface: by the broadcasts of the first generation, and the search
/// replies of the second.
class BroadcastListener {
 public:
  /// @throws NetworkError
  explicit BroadcastListener(const wire::Interface& interface);

  /// Searches sensors of the second generation, at most once a second.
  void search(std::int64_t now_ns);
  /// Sensors detected since the last call, at most a few hundred.
  std::vector<FoundSensor> take();
  /// Datagrams that name no sensor.
  std::uint64_t strangers() const { return strangers_; }
  void add_to(std::vector<const wire::UdpSocket*>& waiting) const;  ///< for wait_for()

 private:
  std::optional<FoundSensor> sensor_of(const wire::UdpSocket::Datagram& datagram, bool searched);

  std::vector<wire::UdpSocket> broadcasts_, answers_;  // the last one of answers_ also sends
                                                       // searches
  std::int64_t search_due_ns_ = 0;
  std::uint32_t sequence_ = 0;
  std::uint64_t strangers_ = 0;
};

/// @throws InvalidArgument for an option find_time out of its range
void require_find_time(const RecordOptions& options);

/// Listens for options.find_time, or until all of options.serials were detected. By serial number.
std::vector<FoundSensor> search_sensors(BroadcastListener& listener, const RecordOptions& options,
                                        const Progress& progress);

}  // namespace risley::jobs
