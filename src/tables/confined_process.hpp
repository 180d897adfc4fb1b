// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <sys/types.h>

#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"

namespace risley::tables {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define RISLEY_SANITIZED
#elif defined(__has_feature)  // how clang says it
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define RISLEY_SANITIZED
#endif
#endif

/// Whether a child's memory is limited: not under sanitizers, which reserve terabytes.
#ifdef RISLEY_SANITIZED
inline constexpr bool kMemoryIsLimited = false;
#else
inline constexpr bool kMemoryIsLimited = true;
#endif

/// The child process of a ConfinedProcess ended, or did not answer; the message gives details.
class ProcessEnded : public Error {
 public:
  using Error::Error;
};

/// A child process for a library that hostile bytes may crash, keep busy forever or make greedy:
/// the child ends then, and the caller continues. It is a copy of this process without its other
/// threads, so the constructor must be called while no other thread is inside that library.
/// docs/decisions/0008-netcdf-in-a-child-process.md
class ConfinedProcess {
 public:
  /// What the child may use.
  static constexpr int kMostSeconds = 2;                           ///< of processor, per request
  static constexpr int kMostWaitSeconds = 120;                     ///< for an answer, disk included
  static constexpr std::size_t kMostBytes = std::size_t{1} << 30;  ///< of memory, beside ours
  static constexpr std::size_t kMostAnswerBytes = std::size_t{1} << 30;

  /// Answers one request; called in the child. Must throw nothing but std::bad_alloc.
  using Service = std::function<std::string(std::string_view request)>;

  /// @param progress  stops waiting for answers; its flag must outlive the process
  /// @throws ProcessEnded if the system cannot create a process
  explicit ConfinedProcess(const Service& service, const Progress& progress = {});
  ~ConfinedProcess();
  ConfinedProcess(const ConfinedProcess&) = delete;
  ConfinedProcess& operator=(const ConfinedProcess&) = delete;

  /// @return the service's answer. @throws ProcessEnded, Cancelled
  std::string ask(std::string_view request);

 private:
  std::string receive();
  [[noreturn]] void fail();
  void end();

  Progress progress_;
  pid_t child_ = -1;
  int socket_ = -1;
  bool waited_too_long_ = false;
};

}  // namespace risley::tables
