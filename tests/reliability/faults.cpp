// A disk that fails, and a moment at which everything ends: preloaded before a tool (LD_PRELOAD), steered by the environment.
//
//   MOCAPKIT_FAULT=OPERATION:N[+]:WHAT   the N-th OPERATION of the process fails; with + every one from there on, as on a disk that is full.
//     OPERATION  write (write, writev, pwrite), fsync, rename (rename, renameat2, link), close, truncate: of regular files, standard error left out; or any: all of them but close.
//     WHAT       an error number (5: EIO, 28: ENOSPC); short: a write of half the bytes, then ENOSPC; kill, term, usr1, int: that signal before the call, which is made then
//   MOCAPKIT_FAULT_HIT=FILE    is made when the fault happens: a run without it had fewer such calls.
//   MOCAPKIT_FAULT_SEEN=FILE   at an ordinary exit: how many such calls there were.
//   MOCAPKIT_TRACE=FILE        a line for every file that is opened for reading ("r PATH") or writing ("w PATH") and every socket made ("s FAMILY").
//   MOCAPKIT_LOCALE=1          setlocale(LC_ALL, "") before main() and again when the first file is opened for writing, as a library may do that a tool knows nothing of.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <clocale>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

struct Plan {
  std::string operation, hit;
  long at = 0;
  bool onwards = false, half = false;
  int error = 0, signal = 0;
  std::atomic<long> seen{0};

  Plan() {
    if (std::getenv("MOCAPKIT_LOCALE")) std::setlocale(LC_ALL, "");
    if (const char* path = std::getenv("MOCAPKIT_FAULT_HIT")) hit = path;
    const char* text = std::getenv("MOCAPKIT_FAULT");
    if (!text) return;
    const std::string all(text);
    const auto a = all.find(':'), b = all.find(':', a + 1);
    if (a == std::string::npos || b == std::string::npos) std::abort();
    operation = all.substr(0, a);
    at = std::strtol(all.c_str() + a + 1, nullptr, 10);
    onwards = all[b - 1] == '+';
    const std::string what = all.substr(b + 1);
    signal = what == "kill" ? SIGKILL : what == "term" ? SIGTERM : what == "usr1" ? SIGUSR1 : what == "int" ? SIGINT : 0;
    half = what == "short";
    error = half ? ENOSPC : signal ? 0 : std::atoi(what.c_str());
    if (at <= 0 || (!signal && error == 0)) std::abort();
  }
};

// Never destroyed: exit handlers write files too.
Plan& plan() {
  static Plan* const p = new Plan;
  return *p;
}
[[maybe_unused]] Plan& loaded = plan();

bool regular(int fd) {
  struct stat info {};
  return fd != STDERR_FILENO && ::fstat(fd, &info) == 0 && S_ISREG(info.st_mode) && (::fcntl(fd, F_GETFL) & O_ACCMODE) != O_RDONLY;
}

// Whether this call is to fail; errno is set then.
bool fails(const char* operation) {
  Plan& p = plan();
  if (p.operation != operation && !(p.operation == "any" && std::strcmp(operation, "close") != 0)) return false;
  const long n = ++p.seen;
  if (n < p.at || (n > p.at && !p.onwards)) return false;
  if (!p.hit.empty()) ::syscall(SYS_close, ::syscall(SYS_openat, AT_FDCWD, p.hit.c_str(), O_CREAT | O_WRONLY, 0666));
  if (p.signal) ::syscall(SYS_kill, ::getpid(), p.signal);
  errno = p.error;
  return p.signal == 0;
}

template <class F>
F* original(const char* name) {
  return reinterpret_cast<F*>(::dlsym(RTLD_NEXT, name));
}

void note(char kind, const std::string& what) {
  static const bool german = std::getenv("MOCAPKIT_LOCALE") != nullptr;
  static std::atomic<bool> set{false};
  if (german && kind == 'w' && !set.exchange(true)) std::setlocale(LC_ALL, "");
  static const char* const path = std::getenv("MOCAPKIT_TRACE");
  if (!path) return;
  const int before = errno;
  const long fd = ::syscall(SYS_openat, AT_FDCWD, path, O_CREAT | O_WRONLY | O_APPEND, 0666);
  const std::string line = std::string(1, kind) + " " + what + "\n";
  ::syscall(SYS_write, fd, line.data(), line.size());
  ::syscall(SYS_close, fd);
  errno = before;
}

void note_open(const char* path, int flags) { note((flags & O_ACCMODE) == O_RDONLY ? 'r' : 'w', path); }
void note_stream(const char* path, const char* mode) { note(std::strpbrk(mode, "wa+") ? 'w' : 'r', path); }

mode_t mode_of(int flags, va_list rest) { return (flags & (O_CREAT | O_TMPFILE)) ? static_cast<mode_t>(va_arg(rest, int)) : 0; }

// What a short write leaves on the disk before it fails.
bool half() { return plan().half; }

}  // namespace

extern "C" {

__attribute__((destructor)) void tell_seen() {
  if (const char* path = std::getenv("MOCAPKIT_FAULT_SEEN")) {
    const long fd = ::syscall(SYS_openat, AT_FDCWD, path, O_CREAT | O_WRONLY | O_TRUNC, 0666);
    const std::string text = std::to_string(plan().seen.load());
    ::syscall(SYS_write, fd, text.data(), text.size());
    ::syscall(SYS_close, fd);
  }
}

ssize_t write(int fd, const void* bytes, size_t count) {
  static const auto call = original<ssize_t(int, const void*, size_t)>("write");
  if (regular(fd) && fails("write")) {
    if (half()) {
      call(fd, bytes, count / 2);
      errno = plan().error;
    }
    return -1;
  }
  return call(fd, bytes, count);
}
ssize_t writev(int fd, const iovec* parts, int count) {
  static const auto call = original<ssize_t(int, const iovec*, int)>("writev");
  if (regular(fd) && fails("write")) return -1;
  return call(fd, parts, count);
}
ssize_t pwrite(int fd, const void* bytes, size_t count, off_t at) {
  static const auto call = original<ssize_t(int, const void*, size_t, off_t)>("pwrite");
  if (regular(fd) && fails("write")) {
    if (half()) {
      call(fd, bytes, count / 2, at);
      errno = plan().error;
    }
    return -1;
  }
  return call(fd, bytes, count, at);
}
ssize_t pwrite64(int fd, const void* bytes, size_t count, off64_t at) { return pwrite(fd, bytes, count, at); }
int fsync(int fd) {
  static const auto call = original<int(int)>("fsync");
  return fails("fsync") ? -1 : call(fd);
}
int fdatasync(int fd) {
  static const auto call = original<int(int)>("fdatasync");
  return fails("fsync") ? -1 : call(fd);
}
int ftruncate(int fd, off_t size) {
  static const auto call = original<int(int, off_t)>("ftruncate");
  return fails("truncate") ? -1 : call(fd, size);
}
int ftruncate64(int fd, off64_t size) { return ftruncate(fd, size); }
int rename(const char* from, const char* to) {
  static const auto call = original<int(const char*, const char*)>("rename");
  return fails("rename") ? -1 : call(from, to);
}
int renameat2(int a, const char* from, int b, const char* to, unsigned flags) {
  static const auto call = original<int(int, const char*, int, const char*, unsigned)>("renameat2");
  return fails("rename") ? -1 : call(a, from, b, to, flags);
}
int link(const char* from, const char* to) {
  static const auto call = original<int(const char*, const char*)>("link");
  return fails("rename") ? -1 : call(from, to);
}
// A failing close(2) has closed the descriptor all the same.
int close(int fd) {
  static const auto call = original<int(int)>("close");
  const bool failing = regular(fd) && fails("close");
  const int error = errno, status = call(fd);
  if (!failing) return status;
  errno = error;
  return -1;
}

int open(const char* path, int flags, ...) {
  static const auto call = original<int(const char*, int, ...)>("open");
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = mode_of(flags, rest);
  va_end(rest);
  note_open(path, flags);
  return call(path, flags, mode);
}
int open64(const char* path, int flags, ...) __attribute__((alias("open")));
int mkostemp(char* pattern, int flags) {
  static const auto call = original<int(char*, int)>("mkostemp");
  const int fd = call(pattern, flags);
  note('w', pattern);
  return fd;
}
int mkostemp64(char* pattern, int flags) { return mkostemp(pattern, flags); }
FILE* fopen(const char* path, const char* mode) {
  static const auto call = original<FILE*(const char*, const char*)>("fopen");
  note_stream(path, mode);
  return call(path, mode);
}
FILE* fopen64(const char* path, const char* mode) __attribute__((alias("fopen")));
int socket(int family, int type, int protocol) {
  static const auto call = original<int(int, int, int)>("socket");
  note('s', std::to_string(family));
  return call(family, type, protocol);
}

}  // extern "C"
