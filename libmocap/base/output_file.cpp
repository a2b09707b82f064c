#include "libmocap/base/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <utility>

#include "libmocap/base/error.hpp"

namespace mocap {
namespace {

std::string folder_of(const std::string& path) {
  const auto slash = path.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

void write_all(int fd, std::string_view bytes, const std::string& name) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw Error(Exit::io, {name, 0, {}}, std::string("write failed: ") + std::strerror(errno));
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
}

// umask(2) can only be read by setting it: one thread at a time, or they would restore each other's 0.
mode_t process_umask() {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return mask;
}

std::string read_all(int fd, const std::string& name, std::size_t limit) {
  std::string bytes;
  struct stat info {};
  if (::fstat(fd, &info) == 0 && S_ISREG(info.st_mode)) {
    const auto size = static_cast<std::size_t>(info.st_size);
    if (size > limit) refuse({name, 0, {}}, std::to_string(size) + " bytes, expected at most " + std::to_string(limit));
    bytes.reserve(size + 1);
  }
  std::string block(1 << 18, '\0');
  while (true) {
    const ssize_t n = ::read(fd, block.data(), block.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) refuse({name, 0, {}}, std::string("cannot be read: ") + std::strerror(errno));
    if (n == 0) return bytes;
    bytes.append(block.data(), static_cast<std::size_t>(n));
    if (bytes.size() > limit) refuse({name, 0, {}}, "larger than the limit of " + std::to_string(limit) + " bytes");
  }
}

std::string gunzip(const std::string& packed, const std::string& name, std::size_t limit) {
  z_stream z{};
  if (inflateInit2(&z, 15 + 16) != Z_OK) throw Error(Exit::internal, {}, "cannot start zlib");
  std::string out, block(1 << 18, '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  std::size_t left = packed.size();
  int status = Z_OK;
  while (true) {
    if (z.avail_in == 0) {
      z.avail_in = static_cast<uInt>(std::min<std::size_t>(left, 1u << 30));
      left -= z.avail_in;
    }
    z.next_out = reinterpret_cast<Bytef*>(block.data());
    z.avail_out = static_cast<uInt>(block.size());
    status = inflate(&z, Z_NO_FLUSH);
    out.append(block.data(), block.size() - z.avail_out);
    if (out.size() > limit) break;
    if (status == Z_STREAM_END && z.avail_in + left > 0 && inflateReset(&z) == Z_OK) continue;  // members in a row
    if (status != Z_OK || (z.avail_in == 0 && left == 0 && z.avail_out != 0)) break;
  }
  inflateEnd(&z);
  if (out.size() > limit) refuse({name, 0, {}}, "expands to more than the limit of " + std::to_string(limit) + " bytes");
  if (status != Z_STREAM_END) refuse({name, 0, {}}, "a damaged or truncated gzip file");
  return out;
}

}  // namespace

void check_output(const std::string& path, Overwrite mode) {
  if (path == "-") {
    if (::isatty(STDOUT_FILENO)) throw Error(Exit::usage, {"-o -", 0, {}}, "refusing to write binary data to a terminal", "redirect standard output or use -o FILE");
    return;
  }
  if (path.empty()) throw Error(Exit::usage, {}, "an empty output path");
  struct stat info {};
  if (::stat(path.c_str(), &info) == 0) {
    if (S_ISDIR(info.st_mode)) throw Error(Exit::io, {path, 0, {}}, "is a folder, expected a file");
    // Renaming over a device would replace it for everybody.
    if (!S_ISREG(info.st_mode)) throw Error(Exit::io, {path, 0, {}}, "is a device or pipe, expected a regular file", "-o - writes standard output");
    if (mode == Overwrite::refuse) throw Error(Exit::io, {path, 0, {}}, "exists already", "use -f to replace it");
  }
  if (::access(folder_of(path).c_str(), W_OK | X_OK) != 0)
    throw Error(Exit::io, {path, 0, {}}, "cannot be created in " + folder_of(path) + ": " + std::strerror(errno));
}

OutputFile::OutputFile(std::string path, Overwrite mode) : path_(std::move(path)), mode_(mode) {
  check_output(path_, mode_);
  if (path_ == "-") {
    part_ = temporary_file("mocapkit-stdout");
    fd_ = ::open(part_.c_str(), O_RDWR | O_CLOEXEC);
  } else {
    part_ = path_ + ".part-XXXXXX";
    fd_ = ::mkostemp(part_.data(), O_CLOEXEC);
  }
  if (fd_ < 0) {
    part_.clear();
    fail("create");
  }
}

OutputFile::~OutputFile() {
  if (fd_ >= 0) ::close(fd_);
  if (!part_.empty()) ::unlink(part_.c_str());
}

void OutputFile::write(std::string_view bytes) { write_all(fd_, bytes, path_ == "-" ? "<stdout>" : path_); }

void OutputFile::commit() {
  if (path_ == "-") {
    if (::lseek(fd_, 0, SEEK_SET) < 0) fail("seek");
    std::string block(1 << 18, '\0');
    while (true) {
      const ssize_t n = ::read(fd_, block.data(), block.size());
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) fail("read back");
      if (n == 0) break;
      write_stdout({block.data(), static_cast<std::size_t>(n)});
    }
    ::close(std::exchange(fd_, -1));
    ::unlink(part_.c_str());
    part_.clear();
    return;
  }
  const mode_t mask = process_umask();
  if (::fchmod(fd_, 0666 & ~mask) != 0) fail("chmod");
  if (::fsync(fd_) != 0) fail("fsync");
  if (::close(std::exchange(fd_, -1)) != 0) fail("close");
  if (mode_ == Overwrite::refuse) {
    // link(2) fails where PATH appeared meanwhile; rename(2) would replace it.
    if (::link(part_.c_str(), path_.c_str()) == 0) {
      ::unlink(part_.c_str());
    } else if (errno == EEXIST || (errno != EPERM && errno != ENOTSUP && errno != ENOSYS)) {
      fail("publish");
    } else if (::renameat2(AT_FDCWD, part_.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE) != 0) {
      fail("publish");  // a file system without hard links
    }
  } else if (::rename(part_.c_str(), path_.c_str()) != 0) {
    fail("rename");
  }
  part_.clear();
  if (const int d = ::open(folder_of(path_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); d >= 0) {
    const int status = ::fsync(d), error = errno;
    ::close(d);
    errno = error;
    // The file is whole but may be gone after a power cut. Some file systems know no fsync of folders.
    if (status != 0 && error != EINVAL && error != ENOTSUP && error != EROFS) fail("fsync of the folder");
  }
}

void OutputFile::fail(const char* operation) const {
  const int e = errno;
  throw Error(Exit::io, {path_ == "-" ? "<stdout>" : path_, 0, {}}, std::string(operation) + " failed: " + std::strerror(e));
}

void write_file(const std::string& path, std::string_view bytes, Overwrite mode) {
  OutputFile out(path, mode);
  out.write(bytes);
  out.commit();
}

std::string read_file(const std::string& path, std::size_t limit, Digest* digest) {
  const std::string name = path == "-" ? "<stdin>" : path;
  std::string bytes;
  if (path == "-") {
    bytes = read_all(STDIN_FILENO, name, limit);
  } else {
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) refuse({name, 0, {}}, std::string("cannot be opened: ") + std::strerror(errno));
    struct stat info {};
    if (::fstat(fd, &info) == 0 && S_ISDIR(info.st_mode)) {
      ::close(fd);
      refuse({name, 0, {}}, "is a folder, expected a file");
    }
    try {
      bytes = read_all(fd, name, limit);
    } catch (...) {
      ::close(fd);
      throw;
    }
    ::close(fd);
  }
  if (digest) *digest = sha256(bytes);
  if (bytes.size() >= 2 && bytes[0] == '\x1f' && bytes[1] == '\x8b') return gunzip(bytes, name, limit);
  return bytes;
}

void write_stdout(std::string_view bytes) { write_all(STDOUT_FILENO, bytes, "<stdout>"); }

std::string temporary_file(const std::string& stem) {
  const char* folder = std::getenv("TMPDIR");
  std::string path = std::string(folder && *folder ? folder : "/tmp") + "/" + stem + "-XXXXXX";
  const int fd = ::mkostemp(path.data(), O_CLOEXEC);
  if (fd < 0) throw Error(Exit::io, {path, 0, {}}, std::string("create failed: ") + std::strerror(errno));
  ::close(fd);
  return path;
}

}  // namespace mocap
