#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <utility>

namespace sqslam {

// A lock on a file that all programs respect which ask for it, also those of other machines where the shared
// file system knows flock. It goes with its holder, however that ends; the file stays. Children that are
// started meanwhile hold it too: what a killed program has left at work still keeps others out.
class FileLock {
 public:
  // Empty where somebody else holds it. A file system without locks keeps nobody out: what is written under a
  // lock must also be renamed into place. Throws InputError where the file cannot be opened.
  static std::optional<FileLock> Try(const std::filesystem::path& path);
  // Waits for it; empty where `stop` said so before.
  static std::optional<FileLock> Wait(const std::filesystem::path& path, const std::function<bool()>& stop);

  FileLock(FileLock&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
  FileLock& operator=(FileLock&& other) = delete;
  ~FileLock();

 private:
  explicit FileLock(int file) : file_(file) {}

  int file_;
};

}  // namespace sqslam
