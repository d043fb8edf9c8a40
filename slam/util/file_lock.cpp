#include "slam/util/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "slam/util/error.h"

namespace sqslam {

std::optional<FileLock> FileLock::Try(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT, 0644);  // inherited by children on purpose
  if (file < 0) {
    throw InputError("{}: cannot be written ({}), expected a writable folder", path.string(),
                     std::strerror(errno));
  }
  FileLock lock(file);
  if (::flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    return std::nullopt;
  }
  return lock;
}

std::optional<FileLock> FileLock::Wait(const std::filesystem::path& path, const std::function<bool()>& stop) {
  while (!stop()) {
    if (std::optional<FileLock> lock = Try(path)) {
      return lock;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  return std::nullopt;
}

FileLock::~FileLock() {
  if (file_ >= 0) {
    ::close(file_);
  }
}

}  // namespace sqslam
