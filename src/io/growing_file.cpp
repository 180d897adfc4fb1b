// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/growing_file.hpp"

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "risley/core/error.hpp"

#include "io/file_target.hpp"

namespace risley::io {
namespace {

constexpr std::uint64_t kBeginBytes = std::uint64_t{8} << 20U;
/// Bytes that may be in transit to the disk: a second of three sensors at ten times their speed.
constexpr std::uint64_t kMostOnTheWay = std::uint64_t{64} << 20U;

FileTarget target_of(const std::string& path) {
  try {
    FileTarget target = find_target(path);
    if (target.copied) {
      throw FileError(path, {}, "is not a regular file, expected the name of a file");
    }
    return target;
  } catch (const std::system_error& error) {
    throw FileError(path, {}, fmt::format("cannot be written: {}", error.code().message()));
  }
}

int create(const std::string& path, const FileTarget& target, const std::string& unfinished) {
  const int file = whole([&] {
    return ::open(unfinished.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC,
                  target.mode);
  });
  if (file >= 0) return file;
  if (errno != EEXIST) refuse(path, errno);
  throw FileError(unfinished, {},
                  "was not finished, and can be read; move it away, or write under another name");
}

}  // namespace

GrowingFile::GrowingFile(const std::string& path) : GrowingFile(path, target_of(path)) {}

GrowingFile::GrowingFile(const std::string& path, const FileTarget& target)
    : path_(path),
      target_(target.path),
      unfinished_path_(target_ + kUnfinished),
      file_(create(path, target, unfinished_path_)) {
  try {
    thread_ = std::thread([this] { write_what_comes(); });
  } catch (...) {
    discard();
    throw;
  }
}

GrowingFile::~GrowingFile() { end_thread(); }

void GrowingFile::end_thread() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void GrowingFile::write_what_comes() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return ending_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const std::vector<std::uint8_t>& bytes = waiting_.front();  // stays where it is
    std::exception_ptr failure;
    lock.unlock();
    try {
      write(bytes);
    } catch (const FileError&) {
      failure = std::current_exception();
    }
    lock.lock();
    if (failure) {  // later data have no place any more
      failure_ = failure;
      waiting_.clear();
      waiting_bytes_ = 0;
    } else {
      waiting_bytes_ -= waiting_.front().size();
      spare_ = std::move(waiting_.front());
      spare_.clear();
      waiting_.pop_front();
    }
    changed_.notify_all();
    if (failure) return;
  }
}

std::vector<std::uint8_t> GrowingFile::append(std::vector<std::uint8_t> bytes) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return failure_ || waiting_bytes_ <= kMostWaiting; });
  if (failure_) std::rethrow_exception(failure_);
  size_ += bytes.size();
  waiting_bytes_ += bytes.size();
  waiting_.push_back(std::move(bytes));
  changed_.notify_all();
  return std::exchange(spare_, {});
}

void GrowingFile::settle() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return failure_ || waiting_.empty(); });
  if (failure_) std::rethrow_exception(failure_);
}

void GrowingFile::write(const std::vector<std::uint8_t>& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = whole([&] {
      return ::pwrite(file_.get(), bytes.data() + done, bytes.size() - done,
                      static_cast<off_t>(written_ + done));
    });
    if (count <= 0) {
      const int error = count < 0 ? errno : ENOSPC;
      // Partial data are removed; if even that fails, readers stop there.
      const bool taken_back = ::ftruncate(file_.get(), static_cast<off_t>(written_)) == 0;
      throw FileError(unfinished_path_, {written_, {}},
                      fmt::format("cannot be written: {}{}", std::strerror(error),
                                  taken_back ? "; it contains the data recorded so far" : ""));
    }
    done += static_cast<std::size_t>(count);
  }
  written_ += bytes.size();
  if (written_ - begun_ >= kBeginBytes) hand_to_disk();
}

/// Writing to disk begins immediately: bytes cached by the system are lost when the machine dies,
/// and later it makes writers wait until they are on disk. Written data leave the cache: a file
/// that fills memory makes the system search for pages while packets wait.
void GrowingFile::hand_to_disk() {
  const auto sync = [&](std::uint64_t from, std::uint64_t to, unsigned how) {
    return ::sync_file_range(file_.get(), static_cast<off_t>(from), static_cast<off_t>(to - from),
                             how);
  };
  sync(begun_, written_, SYNC_FILE_RANGE_WRITE);
  begun_ = written_;
  if (begun_ - on_disk_ <= kMostOnTheWay) return;
  const std::uint64_t settled = begun_ - kMostOnTheWay;
  // A failed write is reported once; a later commit() does not repeat it.
  if (sync(on_disk_, settled,
           SYNC_FILE_RANGE_WAIT_BEFORE | SYNC_FILE_RANGE_WRITE | SYNC_FILE_RANGE_WAIT_AFTER) != 0 &&
      (errno == EIO || errno == ENOSPC || errno == EDQUOT)) {
    throw FileError(unfinished_path_, {on_disk_, {}},
                    fmt::format("cannot be written: {}", std::strerror(errno)));
  }
  ::posix_fadvise(file_.get(), static_cast<off_t>(on_disk_), static_cast<off_t>(settled - on_disk_),
                  POSIX_FADV_DONTNEED);
  on_disk_ = settled;
}

void GrowingFile::commit() {
  settle();
  const FileTarget target{target_, false, 0};
  try {
    sync_output(target, path_, file_.get(), unfinished_path_);
    replace_target(target, path_, unfinished_path_);
  } catch (const FileError& error) {
    throw FileError(error.path(), error.place(),
                    fmt::format("{}; it is whole in {}", error.problem(),
                                unfinished_path_.empty() ? path_ : unfinished_path_));
  }
}

void GrowingFile::discard() {
  end_thread();
  if (!unfinished_path_.empty() && is_named(file_.get(), unfinished_path_)) {
    ::unlink(unfinished_path_.c_str());
  }
  unfinished_path_.clear();
}

}  // namespace risley::io
