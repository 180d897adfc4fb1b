// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Preloaded, it lets one call of the C library fail: RISLEY_FAULT="KIND NUMBER" names the call from
// the beginning of main on, and a file named by RISLEY_FAULT_FIRED appears when it happened. Kinds:
//   write   nothing is written, the disk is full
//   sync    fsync and fdatasync
//   rename  in every form, link included
//   create  a file that is opened for writing
//   close   of a file with bytes that were not synced, whose loss only close would report; it is
//           closed all the same, as Linux does
//   memory  malloc and its like; not in a build with sanitizers, which bring their own
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
}

namespace {

enum Kind { none, write_call, sync_call, rename_call, create_call, close_call, memory_call };

std::atomic<bool> in_main{false};
std::atomic<long> left{0};  // calls until the one that fails
Kind wanted = none;
const char* fired = nullptr;

void choose() {
  const char* wish = std::getenv("RISLEY_FAULT");
  fired = std::getenv("RISLEY_FAULT_FIRED");
  if (wish == nullptr) return;
  constexpr const char* kNames[] = {"none", "write", "sync", "rename", "create", "close", "memory"};
  for (int kind = write_call; kind <= memory_call; ++kind) {
    const std::size_t length = std::strlen(kNames[kind]);
    if (std::strncmp(wish, kNames[kind], length) == 0 && wish[length] == ' ') {
      left = std::atol(wish + length + 1);
      wanted = static_cast<Kind>(kind);
    }
  }
}

/// Whether this call is the one.
bool fails(Kind kind) {
  if (kind != wanted || !in_main.load(std::memory_order_relaxed) || --left != 0) return false;
  if (fired != nullptr) {
    const long file = ::syscall(SYS_openat, AT_FDCWD, fired, O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
    if (file >= 0) ::syscall(SYS_close, file);
  }
  return true;
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

/// Files with bytes that were written and not synced since, by inode.
class Unsynced {
 public:
  void note(int file, bool written) {
    if (wanted != close_call) return;
    struct stat facts {};
    if (::fstat(file, &facts) != 0 || !S_ISREG(facts.st_mode)) return;
    if (Entry* entry = of(facts.st_ino)) *entry = written ? facts.st_ino : 0;
  }
  bool has(int file) {
    struct stat facts {};
    if (::fstat(file, &facts) != 0) return false;
    const Entry* entry = of(facts.st_ino);
    return entry != nullptr && *entry == facts.st_ino;
  }

 private:
  using Entry = std::atomic<ino_t>;
  /// The file's entry, or an empty one.
  Entry* of(ino_t inode) {
    for (Entry& entry : entries_) {
      if (entry == inode) return &entry;
    }
    for (Entry& entry : entries_) {
      if (entry == 0) return &entry;
    }
    return nullptr;
  }
  Entry entries_[64] = {};
};
Unsynced unsynced;

using Main = int (*)(int, char**, char**);
Main real_main = nullptr;

int counted_main(int count, char** arguments, char** environment) {
  choose();
  in_main = true;
  return real_main(count, arguments, environment);
}

int no_space() {
  errno = ENOSPC;
  return -1;
}

}  // namespace

extern "C" {

int __libc_start_main(Main main, int count, char** arguments, void (*init)(), void (*fini)(),
                      void (*loader)(), void* stack) {
  using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);
  real_main = main;
  return next<Start>("__libc_start_main")(counted_main, count, arguments, init, fini, loader,
                                          stack);
}

ssize_t write(int file, const void* bytes, std::size_t count) {
  if (file != STDERR_FILENO && fails(write_call)) return no_space();
  unsynced.note(file, true);
  return ::syscall(SYS_write, file, bytes, count);
}
ssize_t pwrite(int file, const void* bytes, std::size_t count, off_t offset) {
  if (fails(write_call)) return no_space();
  unsynced.note(file, true);
  return ::syscall(SYS_pwrite64, file, bytes, count, offset);
}
ssize_t pwrite64(int file, const void* bytes, std::size_t count, off64_t offset) {
  return pwrite(file, bytes, count, offset);
}
ssize_t writev(int file, const iovec* parts, int count) {
  if (file != STDERR_FILENO && fails(write_call)) return no_space();
  unsynced.note(file, true);
  return ::syscall(SYS_writev, file, parts, count);
}
int fsync(int file) {
  if (fails(sync_call)) return errno = EIO, -1;
  unsynced.note(file, false);
  return static_cast<int>(::syscall(SYS_fsync, file));
}
int fdatasync(int file) {
  if (fails(sync_call)) return errno = EIO, -1;
  unsynced.note(file, false);
  return static_cast<int>(::syscall(SYS_fdatasync, file));
}
int rename(const char* from, const char* to) {
  if (fails(rename_call)) return no_space();
  return static_cast<int>(::syscall(SYS_rename, from, to));
}
int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  if (fails(rename_call)) return no_space();
  return static_cast<int>(::syscall(SYS_renameat2, from_folder, from, to_folder, to, 0));
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) {
  if (fails(rename_call)) return no_space();
  return static_cast<int>(::syscall(SYS_renameat2, from_folder, from, to_folder, to, flags));
}
int link(const char* from, const char* to) {
  if (fails(rename_call)) return no_space();
  return static_cast<int>(::syscall(SYS_linkat, AT_FDCWD, from, AT_FDCWD, to, 0));
}
int openat(int folder, const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & (O_CREAT | __O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  if ((flags & O_ACCMODE) != O_RDONLY && fails(create_call)) return no_space();
  return static_cast<int>(::syscall(SYS_openat, folder, path, flags, mode));
}
int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & (O_CREAT | __O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return openat(AT_FDCWD, path, flags, mode);
}
int open64(const char* path, int flags, ...) __attribute__((alias("open")));
int close(int file) {
  const bool counts = wanted == close_call && file > STDERR_FILENO && unsynced.has(file);
  const auto result = static_cast<int>(::syscall(SYS_close, file));
  if (counts && fails(close_call)) return errno = EIO, -1;
  return result;
}

#ifndef RISLEY_SANITIZED
void* malloc(std::size_t count) {
  if (fails(memory_call)) return errno = ENOMEM, nullptr;
  return __libc_malloc(count);
}
void* calloc(std::size_t count, std::size_t each) {
  if (fails(memory_call)) return errno = ENOMEM, nullptr;
  return __libc_calloc(count, each);
}
void* realloc(void* bytes, std::size_t count) {
  if (fails(memory_call)) return errno = ENOMEM, nullptr;
  return __libc_realloc(bytes, count);
}
void* aligned_alloc(std::size_t alignment, std::size_t count) {
  if (fails(memory_call)) return errno = ENOMEM, nullptr;
  return __libc_memalign(alignment, count);
}
int posix_memalign(void** bytes, std::size_t alignment, std::size_t count) {
  if (fails(memory_call)) return ENOMEM;
  *bytes = __libc_memalign(alignment, count);
  return *bytes == nullptr ? ENOMEM : 0;
}
#endif

}  // extern "C"
