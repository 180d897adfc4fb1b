// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "tables/confined_process.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <new>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include "risley/io/fork_lock.hpp"

namespace risley::tables {
namespace {

/// Exit status of a child that ran out of memory.
constexpr int kOutOfMemory = 3;
/// Exit status of a child after its service threw another exception.
constexpr int kThrew = 4;

/// @return whether all bytes were moved
bool send_all(int socket, const void* bytes, std::size_t size) {
  const auto* at = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t sent = ::send(socket, at, size, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    at += sent;
    size -= static_cast<std::size_t>(sent);
  }
  return true;
}
bool receive_all(int socket, void* bytes, std::size_t size) {
  auto* at = static_cast<char*>(bytes);
  while (size > 0) {
    const ssize_t got = ::recv(socket, at, size, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

bool send_message(int socket, std::string_view message) {
  const std::uint64_t size = message.size();
  return send_all(socket, &size, sizeof size) && send_all(socket, message.data(), message.size());
}

void limit(int resource, rlim_t most) {
  rlimit own{};
  if (::getrlimit(static_cast<__rlimit_resource_t>(resource), &own) != 0) return;
  own.rlim_cur = own.rlim_max == RLIM_INFINITY ? most : std::min(most, own.rlim_max);
  ::setrlimit(static_cast<__rlimit_resource_t>(resource), &own);
}

/// Memory already mapped by this process.
std::size_t mapped_bytes() {
  std::size_t pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
    if (std::fscanf(file, "%zu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

/// The clock of the processor time limit for one request; 0 stops it.
void set_clock(int seconds) {
  itimerval time{};
  time.it_value.tv_sec = seconds;
  ::setitimer(ITIMER_PROF, &time, nullptr);
}

/// Closes files that the parent has open: their locks would outlast its closing them.
void close_all_but(int socket) {
  constexpr unsigned kFirst = 3;  // behind the standard streams
  const auto own = static_cast<unsigned>(socket);
  if (own > kFirst) ::close_range(kFirst, own - 1, 0);
  ::close_range(own + 1, ~0U, 0);
}

/// Runs in the child on a copy of its owner's stack; no exception may reach the frames of that
/// stack.
[[noreturn]] void serve(int socket, const ConfinedProcess::Service& service) noexcept {
  close_all_but(socket);
  if (!send_message(socket, {})) ::_exit(0);
  // The owner ends this process; it receives signals itself.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) std::signal(signal, SIG_IGN);
  std::signal(SIGPROF, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  limit(RLIMIT_CORE, 0);
  if (const std::size_t mapped = mapped_bytes(); mapped > 0 && kMemoryIsLimited) {
    limit(RLIMIT_AS, mapped + ConfinedProcess::kMostBytes);
  }
  std::uint64_t size = 0;
  std::string request;
  while (receive_all(socket, &size, sizeof size)) {
    try {
      request.resize(size);
      if (!receive_all(socket, request.data(), size)) break;
      set_clock(ConfinedProcess::kMostSeconds);
      const std::string answer = service(request);
      set_clock(0);
      if (!send_message(socket, answer)) break;
    } catch (const std::bad_alloc&) {
      ::_exit(kOutOfMemory);
    } catch (...) {
      ::_exit(kThrew);
    }
  }
  ::_exit(0);
}

}  // namespace

ConfinedProcess::ConfinedProcess(const Service& service, const Progress& progress)
    : progress_(progress.silent()) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    throw ProcessEnded(
        fmt::format("no connection to the process that reads the file: {}", std::strerror(errno)));
  }
  int problem = 0;
  {
    const auto alone = io::ForkLock::instance().alone();
    child_ = ::fork();
    problem = errno;
  }
  if (child_ == 0) serve(ends[1], service);
  ::close(ends[1]);
  socket_ = ends[0];
  if (child_ < 0) {
    ::close(socket_);
    throw ProcessEnded(fmt::format("the process that reads the file could not be started: {}",
                                   std::strerror(problem)));
  }
  try {
    receive();  // it has released our files
  } catch (const Cancelled&) {
    end();
    throw;
  }
}

ConfinedProcess::~ConfinedProcess() { end(); }

void ConfinedProcess::end() {
  if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  if (child_ <= 0) return;
  ::kill(child_, SIGKILL);
  while (::waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
  }
  child_ = -1;
}

std::string ConfinedProcess::ask(std::string_view request) {
  if (child_ <= 0) throw ProcessEnded("the library's process has ended");
  if (!send_message(socket_, request)) fail();
  return receive();
}

std::string ConfinedProcess::receive() {
  constexpr int kLookSeldom_ms = 200;
  pollfd ready{socket_, POLLIN, 0};
  for (int looks_left = 1000 * kMostWaitSeconds / kLookSeldom_ms;;) {
    const int events = ::poll(&ready, 1, kLookSeldom_ms);
    if (events > 0) break;
    progress_.check();
    if (events < 0 && errno == EINTR) continue;
    if (events == 0 && --looks_left > 0) continue;
    waited_too_long_ = events == 0;
    fail();
  }
  std::uint64_t size = 0;
  if (!receive_all(socket_, &size, sizeof size) || size > kMostAnswerBytes) fail();
  std::string answer(size, '\0');
  if (!receive_all(socket_, answer.data(), size)) fail();
  return answer;
}

void ConfinedProcess::fail() {
  if (waited_too_long_) {
    end();
    throw ProcessEnded(fmt::format("the library did not answer within {} s", kMostWaitSeconds));
  }
  ::kill(child_, SIGKILL);  // no effect on a process that has ended
  int status = 0;
  pid_t ended = -1;
  do {
    ended = ::waitpid(child_, &status, 0);
  } while (ended < 0 && errno == EINTR);
  child_ = -1;
  ::close(std::exchange(socket_, -1));
  if (ended > 0 && WIFSIGNALED(status)) {
    if (WTERMSIG(status) == SIGPROF) {
      throw ProcessEnded(
          fmt::format("the library took more than {} s of processor time", kMostSeconds));
    }
    throw ProcessEnded(fmt::format("the library failed: {}", ::strsignal(WTERMSIG(status))));
  }
  if (ended > 0 && WIFEXITED(status) && WEXITSTATUS(status) == kOutOfMemory) {
    throw ProcessEnded(
        fmt::format("the library needed more than {} MiB of memory", kMostBytes >> 20));
  }
  if (ended > 0 && WIFEXITED(status) && WEXITSTATUS(status) == kThrew) {
    throw ProcessEnded("the library failed: it threw an exception");
  }
  throw ProcessEnded("the library's process ended without an answer");
}

}  // namespace risley::tables
