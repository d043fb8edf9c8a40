#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <utility>

namespace sqslam {

// An advisory lock on a file, across machines too if the shared file system supports flock. It is released
// when its holder ends, even by a crash; the file stays. Child processes inherit the lock: those of a killed
// program still keep others out.
class FileLock {
 public:
  // Returns nothing if another holder has it. A file system without locks keeps nobody out, so files
  // written under a lock must also be renamed into place. Throws InputError if the file cannot be opened.
  static std::optional<FileLock> Try(const std::filesystem::path& path);
  // Waits for the lock. Returns nothing if `stop` returned true before.
  static std::optional<FileLock> Wait(const std::filesystem::path& path, const std::function<bool()>& stop);

  FileLock(FileLock&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
  FileLock& operator=(FileLock&& other) = delete;
  ~FileLock();

 private:
  explicit FileLock(int file) : file_(file) {}

  int file_;
};

}  // namespace sqslam
