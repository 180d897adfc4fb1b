// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/io/block_file.hpp"
#include "risley/wire/address.hpp"

namespace risley::wire {

/// The network fails, or no answer comes. The message names the address and the remedy.
class NetworkError : public Error {
 public:
  using Error::Error;
};

/// An interface of this machine with an IPv4 address.
struct Interface {
  std::string name;  ///< "eth0"
  Address address;
  std::optional<Address> broadcast;  ///< of its network
  bool is_loopback = false;
};

/// All interfaces that are up, one entry per address. @throws NetworkError
std::vector<Interface> interfaces();
/// The interface of an address of this machine; loopback has all of 127.0.0.0/8.
/// @param address  "192.168.1.5"; empty: the only one that is not loopback
/// @throws InvalidArgument for an invalid address, or one of no interface here; if there are
/// several to choose from, the message lists them
Interface interface_of(const std::string& address);

/// A UDP socket that never blocks.
class UdpSocket {
 public:
  /// @param local  address and port to bind; port 0: any free one
  /// @param receive_buffer  requested bytes, beyond the system's general limit if this user is
  /// allowed; 0: the default
  /// @param device receives only what arrives at this interface; empty: everything for the address.
  /// For broadcast addresses, which several programs may share.
  /// @throws NetworkError
  explicit UdpSocket(const Endpoint& local, std::size_t receive_buffer = 0,
                     const std::string& device = {});

  const Endpoint& local() const { return local_; }  ///< with the port that it got
  int descriptor() const { return socket_.get(); }  ///< still owned by this

  /// @return whether the system accepted the datagram
  bool send(const Endpoint& to, std::span<const std::uint8_t> bytes) const;

  /// A datagram that arrived.
  struct Datagram {
    Endpoint from;
    std::span<const std::uint8_t> bytes;  ///< until the next call; truncated at kMostBytes
    std::int64_t kernel_ns = 0;           ///< when the kernel received it, ns since 1970
  };
  /// Returns received datagrams, at most kBatch. @return how many @throws NetworkError
  std::size_t receive(const std::function<void(const Datagram&)>& take);

  /// Datagrams dropped by the kernel, as far as received ones show.
  std::uint64_t kernel_drops() const { return kernel_drops_; }
  /// Granted bytes of the receive buffer; 0 if none were requested.
  std::size_t receive_buffer() const { return receive_buffer_; }

  /// Datagrams of one call.
  static constexpr std::size_t kBatch = 64;
  /// More than any datagram of the protocol.
  static constexpr std::size_t kMostBytes = 2048;

 private:
  struct Batch;
  struct DeleteBatch {
    void operator()(Batch* batch) const;
  };

  io::FileDescriptor socket_;
  Endpoint local_;
  std::size_t receive_buffer_ = 0;
  std::uint64_t kernel_drops_ = 0;
  std::unique_ptr<Batch, DeleteBatch> batch_;
};

/// Waits until one of the sockets has data, a signal comes, or the time is over.
void wait_for(std::span<const UdpSocket* const> sockets, std::int64_t timeout_ns);

}  // namespace risley::wire
