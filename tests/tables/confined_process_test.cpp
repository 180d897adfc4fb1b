// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "tables/confined_process.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <unistd.h>

#include "risley/hashes/sha256.hpp"

namespace risley::tables::confined_process_test {

using ::testing::HasSubstr;

/// What is said where a request has this end.
std::string end_of(ConfinedProcess& process, std::string_view request) {
  try {
    process.ask(request);
  } catch (const ProcessEnded& error) {
    return error.what();
  }
  return "answered";
}

TEST(ConfinedProcess, AnswersRequestAfterRequest) {
  int asked = 0;  // of the child's copy
  ConfinedProcess process([&](std::string_view request) {
    return std::to_string(++asked) + ": " + std::string(request);
  });
  EXPECT_EQ(process.ask("one"), "1: one");
  EXPECT_EQ(process.ask(""), "2: ");
  std::string long_one(3'000'001, 'x');  // more than a socket holds
  std::iota(long_one.begin(), long_one.end(), '\0');
  EXPECT_EQ(process.ask(long_one), "3: " + long_one);
  EXPECT_EQ(asked, 0);
}

TEST(ConfinedProcess, UsesOpenSslWhateverOtherThreadsDidWithItWhenItWasForked) {
  if (!kMemoryIsLimited) GTEST_SKIP() << "a sanitizer's allocator has locks that outlast a fork";
  std::atomic<bool> done{false};
  std::vector<std::jthread> hashing;
  for (int i = 0; i < 2; ++i) {
    hashing.emplace_back([&] {
      while (!done) hashes::sha256("some text");
    });
  }
  for (int i = 0; i < 100; ++i) {
    // As NetCDF's library does, not by ours.
    ConfinedProcess process([](std::string_view request) {
      std::string digest(EVP_MAX_MD_SIZE, '\0');
      unsigned int length = 0;
      EVP_Digest(request.data(), request.size(), reinterpret_cast<unsigned char*>(digest.data()),
                 &length, EVP_sha256(), nullptr);
      return digest.substr(0, length);
    });
    ASSERT_THAT(process.ask("abc"), ::testing::StartsWith("\xba\x78\x16\xbf")) << i;
  }
  done = true;
}

TEST(ConfinedProcess, ACrashEndsTheChildAlone) {
  ConfinedProcess process([](std::string_view) -> std::string {
    std::signal(SIGSEGV, SIG_DFL);  // sanitizers have their own way
    ::raise(SIGSEGV);
    return {};
  });
  EXPECT_THAT(end_of(process, "crash"), HasSubstr("Segmentation fault"));
  EXPECT_THAT(end_of(process, "again"), HasSubstr("has ended"));
}

// The child's stack holds the frames of the test, too, which an exception must not reach.
TEST(ConfinedProcess, AnExceptionEndsTheChild) {
  ConfinedProcess process(
      [](std::string_view) -> std::string { throw std::runtime_error("of a library"); });
  EXPECT_THAT(end_of(process, "throw"), HasSubstr("the library failed"));
}

TEST(ConfinedProcess, AnEndlessLoopIsEnded) {
  ConfinedProcess process([](std::string_view) -> std::string {
    volatile bool endless = true;  // a loop of nothing else may be removed by the compiler
    while (endless) {
    }
    return {};
  });
  EXPECT_THAT(end_of(process, "loop"), HasSubstr("2 s of processor time"));
}

TEST(ConfinedProcess, MemoryIsLimited) {
  if (!kMemoryIsLimited) GTEST_SKIP() << "sanitizers reserve terabytes";
  ConfinedProcess process([](std::string_view) { return std::string(std::size_t{3} << 30, 'x'); });
  EXPECT_THAT(end_of(process, "much"), HasSubstr("1024 MiB"));
}

TEST(ConfinedProcess, WaitingForAnAnswerCanBeCancelled) {
  CancelFlag flag;
  ConfinedProcess process(
      [](std::string_view) -> std::string {
        for (;;) ::pause();  // takes no processor time
      },
      Progress([](double) {}, &flag));
  std::thread user([&flag] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    flag.set();
  });
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THROW(process.ask("anything"), Cancelled);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(1));
  user.join();
}

TEST(ConfinedProcess, AnEndBetweenRequestsIsSeen) {
  ConfinedProcess process([](std::string_view) { return std::to_string(::getpid()); });
  ::kill(std::stoi(process.ask("who")), SIGKILL);
  EXPECT_THAT(end_of(process, "there?"), HasSubstr("Killed"));
}

}  // namespace risley::tables::confined_process_test
