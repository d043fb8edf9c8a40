#include "slam/util/atomic_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
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
  std::FILE* file = std::fopen(temporary.Path().c_str(), "wbe");
  bool written = file != nullptr &&
                 std::fwrite(contents.data(), 1, contents.size(), file) == contents.size() &&
                 std::fflush(file) == 0 && ::fsync(::fileno(file)) == 0;
  int reason = errno;
  if (file != nullptr && std::fclose(file) != 0 && written) {  // a full disk may show only there
    written = false;
    reason = errno;
  }
  if (!written) {
    ThrowCannotWrite(path, std::strerror(reason));
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
