// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/udp_socket.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "risley/core/setting.hpp"

#include "wire/system_address.hpp"

namespace risley::wire {
namespace {

constexpr std::int64_t kNanoseconds = 1'000'000'000;

[[noreturn]] void refuse(const Endpoint& local, int error) {
  std::string remedy;
  if (error == EADDRINUSE) {
    remedy = ": another program uses this port, such as Livox Viewer or another risley; end it";
  } else if (error == EADDRNOTAVAIL) {
    remedy = ": no interface of this machine has this address; give it one, or name another";
  } else if (error == EACCES || error == EPERM) {
    remedy = ": the system does not permit it for this user";
  }
  throw NetworkError(fmt::format("{}: {}{}", to_string(local), std::strerror(error), remedy));
}

int opened(const Endpoint& local) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket < 0) refuse(local, errno);
  return socket;
}

bool is_loopback(const Address& address) { return address.bytes[0] == 127; }

std::string list_of(const std::vector<Interface>& all) {
  std::vector<std::string> words;
  words.reserve(all.size());
  for (const Interface& one : all) {
    words.push_back(fmt::format("{} ({})", to_string(one.address), one.name));
  }
  return words.empty() ? "none" : fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace

std::vector<Interface> interfaces() {
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) {
    throw NetworkError(fmt::format("interfaces of this machine: {}", std::strerror(errno)));
  }
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(first, &::freeifaddrs);
  std::vector<Interface> all;
  for (const ifaddrs* one = first; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET ||
        (one->ifa_flags & IFF_UP) == 0) {
      continue;
    }
    Interface found;
    found.name = one->ifa_name;
    found.address = address_of(*reinterpret_cast<const sockaddr_in*>(one->ifa_addr));
    found.is_loopback = (one->ifa_flags & IFF_LOOPBACK) != 0;
    if (found.is_loopback && is_loopback(found.address)) {
      found.broadcast = Address{{127, 255, 255, 255}};
    } else if ((one->ifa_flags & IFF_BROADCAST) != 0 && one->ifa_broadaddr != nullptr) {
      // Without a broadcast address the address itself appears again.
      const Address stated = address_of(*reinterpret_cast<const sockaddr_in*>(one->ifa_broadaddr));
      if (stated != found.address && stated != Address{}) found.broadcast = stated;
    }
    all.push_back(std::move(found));
  }
  return all;
}

Interface interface_of(const std::string& address) {
  std::vector<Interface> all = interfaces();
  if (address.empty()) {
    std::vector<Interface> real;
    std::ranges::copy_if(all, std::back_inserter(real),
                         [](const Interface& one) { return !one.is_loopback; });
    if (real.size() == 1) return real.front();
    throw InvalidArgument(
        fmt::format("{}: it is unclear which interface reaches the sensors: this machine has {}; "
                    "name the address of one",
                    name_of(kSetting.interface_address), list_of(real.empty() ? all : real)));
  }
  const auto wanted = address_from(address);
  if (!wanted) {
    throw InvalidArgument(fmt::format("{} = {}, expected an IPv4 address of this machine: {}",
                                      name_of(kSetting.interface_address), address, list_of(all)));
  }
  for (const Interface& one : all) {
    if (one.address == *wanted) return one;
  }
  for (const Interface& one : all) {
    if (!one.is_loopback || !is_loopback(*wanted)) continue;
    Interface found = one;
    found.address = *wanted;
    return found;
  }
  throw InvalidArgument(
      fmt::format("{} = {}: no interface of this machine has this address, there are {}",
                  name_of(kSetting.interface_address), address, list_of(all)));
}

struct UdpSocket::Batch {
  Batch() : buffers(kBatch * kMostBytes), headers(kBatch), parts(kBatch), senders(kBatch) {
    for (std::size_t i = 0; i < kBatch; ++i) {
      parts[i] = {&buffers[i * kMostBytes], kMostBytes};
      msghdr& header = headers[i].msg_hdr;
      header.msg_name = &senders[i];
      header.msg_iov = &parts[i];
      header.msg_iovlen = 1;
      header.msg_control = control[i].bytes.data();
    }
  }
  struct alignas(cmsghdr) Control {
    std::array<std::uint8_t, 128> bytes{};
  };
  std::vector<std::uint8_t> buffers;
  std::vector<mmsghdr> headers;
  std::vector<iovec> parts;
  std::vector<sockaddr_in> senders;
  std::array<Control, kBatch> control{};
};

void UdpSocket::DeleteBatch::operator()(Batch* batch) const { delete batch; }

UdpSocket::UdpSocket(const Endpoint& local, std::size_t receive_buffer, const std::string& device)
    : socket_(opened(local)), local_(local), batch_(new Batch) {
  const auto set = [&](int option, const void* value, socklen_t bytes) {
    if (::setsockopt(socket_.get(), SOL_SOCKET, option, value, bytes) != 0) refuse(local, errno);
  };
  const int on = 1;
  set(SO_BROADCAST, &on, sizeof on);
  set(SO_RXQ_OVFL, &on, sizeof on);
  set(SO_TIMESTAMPNS, &on, sizeof on);
  if (!device.empty()) {
    set(SO_REUSEADDR, &on, sizeof on);
    set(SO_BINDTODEVICE, device.c_str(), static_cast<socklen_t>(device.size() + 1));
  }
  if (receive_buffer > 0) {
    const int asked = static_cast<int>(std::min<std::size_t>(receive_buffer, 1U << 30U));
    // A network administrator may exceed the system's usual limit.
    if (::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVBUFFORCE, &asked, sizeof asked) != 0) {
      set(SO_RCVBUF, &asked, sizeof asked);
    }
    int granted = 0;
    socklen_t bytes = sizeof granted;
    if (::getsockopt(socket_.get(), SOL_SOCKET, SO_RCVBUF, &granted, &bytes) != 0) {
      refuse(local, errno);
    }
    receive_buffer_ = static_cast<std::size_t>(granted) / 2;  // Linux reports twice the granted
                                                              // size
  }
  const sockaddr_in address = system_address(local);
  if (::bind(socket_.get(), any_address(&address), sizeof address) != 0) refuse(local, errno);
  sockaddr_in bound{};
  socklen_t bytes = sizeof bound;
  if (::getsockname(socket_.get(), any_address(&bound), &bytes) != 0) refuse(local, errno);
  local_ = endpoint_of(bound);
}

bool UdpSocket::send(const Endpoint& to, std::span<const std::uint8_t> bytes) const {
  const sockaddr_in address = system_address(to);
  ssize_t sent = 0;
  do {
    sent = ::sendto(socket_.get(), bytes.data(), bytes.size(), 0, any_address(&address),
                    sizeof address);
  } while (sent < 0 && errno == EINTR);
  return sent == static_cast<ssize_t>(bytes.size());
}

std::size_t UdpSocket::receive(const std::function<void(const Datagram&)>& take) {
  for (std::size_t i = 0; i < kBatch; ++i) {
    batch_->headers[i].msg_hdr.msg_namelen = sizeof(sockaddr_in);
    batch_->headers[i].msg_hdr.msg_controllen = batch_->control[i].bytes.size();
  }
  const int count =
      ::recvmmsg(socket_.get(), batch_->headers.data(), kBatch, MSG_DONTWAIT, nullptr);
  if (count < 0) {
    // An interface that went down comes up again.
    if (errno == EAGAIN || errno == EINTR || errno == ENETDOWN || errno == ECONNREFUSED) return 0;
    throw NetworkError(fmt::format("{}: {}", to_string(local_), std::strerror(errno)));
  }
  for (int i = 0; i < count; ++i) {
    msghdr& header = batch_->headers[i].msg_hdr;
    Datagram datagram;
    datagram.from = endpoint_of(batch_->senders[i]);
    datagram.bytes = {&batch_->buffers[i * kMostBytes], batch_->headers[i].msg_len};
    for (cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr;
         part = CMSG_NXTHDR(&header, part)) {
      if (part->cmsg_level != SOL_SOCKET) continue;
      if (part->cmsg_type == SO_RXQ_OVFL) {
        std::uint32_t drops = 0;
        std::memcpy(&drops, CMSG_DATA(part), sizeof drops);
        kernel_drops_ += drops - static_cast<std::uint32_t>(kernel_drops_);  // which wraps around
      } else if (part->cmsg_type == SCM_TIMESTAMPNS) {
        timespec time{};
        std::memcpy(&time, CMSG_DATA(part), sizeof time);
        datagram.kernel_ns = std::int64_t{time.tv_sec} * kNanoseconds + time.tv_nsec;
      }
    }
    take(datagram);
  }
  return static_cast<std::size_t>(count);
}

void wait_for(std::span<const UdpSocket* const> sockets, std::int64_t timeout_ns) {
  std::vector<pollfd> waiting;
  waiting.reserve(sockets.size());
  for (const UdpSocket* socket : sockets) waiting.push_back({socket->descriptor(), POLLIN, 0});
  const std::int64_t wait_ns = std::max<std::int64_t>(timeout_ns, 0);
  const timespec time{static_cast<time_t>(wait_ns / kNanoseconds),
                      static_cast<long>(wait_ns % kNanoseconds)};
  ::ppoll(waiting.data(), waiting.size(), &time, nullptr);
}

}  // namespace risley::wire
