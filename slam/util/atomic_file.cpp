#include "slam/util/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include "slam/util/error.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void ThrowCannotWrite(const fs::path& path, const std::string& reason) {
  throw InputError(fmt::format("{}: cannot be written ({}), expected a writable folder with free space",
                               path.string(), reason));
}

// Closes on all ways out; Close() reports what close(2) says, since a full disk may show only there.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int Get() const { return fd_; }
  bool Close() { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

bool WriteAll(int fd, std::string_view contents) {
  while (!contents.empty()) {
    const ssize_t written = ::write(fd, contents.data(), contents.size());
    if (written < 0 && errno == EINTR) {
      continue;
    }
    if (written < 0) {
      return false;
    }
    contents.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

AtomicPath::AtomicPath(fs::path path) : path_(std::move(path)) {
  temporary_ = path_.parent_path() /
               fmt::format(".{}.{}.tmp{}", path_.stem().string(), ::getpid(), path_.extension().string());
}

AtomicPath::~AtomicPath() {
  std::error_code ignored;
  fs::remove_all(temporary_, ignored);
}

void AtomicPath::Commit() {
  std::error_code error;
  fs::rename(temporary_, path_, error);
  if (error) {
    ThrowCannotWrite(path_, error.message());
  }
}

void WriteFileAtomically(const fs::path& path, std::string_view contents) {
  AtomicPath temporary(path);
  FileDescriptor file(::open(temporary.Path().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file.Get() < 0 || !WriteAll(file.Get(), contents) || ::fsync(file.Get()) != 0 || !file.Close()) {
    ThrowCannotWrite(path, std::strerror(errno));
  }
  temporary.Commit();
}

void CreateResultFolder(const fs::path& path) {
  std::error_code error;
  if (fs::exists(path, error) && !(fs::is_directory(path, error) && fs::is_empty(path, error))) {
    throw UsageError(
        fmt::format("{}: exists already, expected a new or empty folder for the results", path.string()));
  }
  fs::create_directories(path, error);
  if (error) {
    throw InputError(fmt::format("{}: cannot be made ({}), expected a place for the results", path.string(),
                                 error.message()));
  }
}

fs::path FreeResultFolder(const fs::path& parent, std::string_view name) {
  fs::path path = parent / name;
  for (int number = 2; fs::exists(path) && !fs::is_empty(path); ++number) {
    path = parent / fmt::format("{}-{}", name, number);
  }
  return path;
}

}  // namespace sqslam
