#include "slam/util/atomic_file.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "slam/util/error.h"
#include "slam/util/host.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void ThrowCannotWrite(const fs::path& path, const std::string& reason) {
  throw InputError("{}: cannot be written ({}), expected a writable folder with free space", path.string(),
                   reason);
}

// The name includes the host: programs on several machines may share a folder.
std::string Prefix(const fs::path& path) { return fmt::format(".{}.{}.", path.stem().string(), HostName()); }

fs::path TemporaryName(const fs::path& path) {
  return path.parent_path() / fmt::format("{}{}.tmp{}", Prefix(path), ::getpid(), path.extension().string());
}

// Removes temporary files of the path that ended programs on this machine left behind.
void RemoveLeftovers(const fs::path& path) {
  const std::string prefix = Prefix(path);
  const std::string suffix = ".tmp" + path.extension().string();
  std::error_code ignored;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix) || !name.ends_with(suffix)) {
      continue;
    }
    const std::optional<int> writer = ParseNumber<int>(
        std::string_view(name).substr(prefix.size(), name.size() - prefix.size() - suffix.size()));
    if (writer && *writer > 0 && ::kill(*writer, 0) != 0 && errno == ESRCH) {
      fs::remove_all(entry.path(), ignored);
    }
  }
}

}  // namespace

void RemoveTemporaryFiles(const fs::path& folder) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') && name.find(".tmp") != std::string::npos) {
      fs::remove_all(entry.path(), ignored);
    }
  }
}

AtomicPath::AtomicPath(fs::path path) : path_(std::move(path)), temporary_(TemporaryName(path_)) {
  RemoveLeftovers(path_);
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

void AtomicPath::CommitNew() {
  std::error_code error;
  fs::create_hard_link(temporary_, path_, error);  // unlike a rename, it replaces nothing
  ThrowIf<InputError>(error == std::errc::file_exists, "{}: exists already, expected a new name",
                      path_.string());
  if (error) {  // FAT and some network file systems have no hard links
    Commit();
  }
}

void WriteFileAtomically(const fs::path& path, std::string_view contents) {
  const fs::path temporary = TemporaryName(path);
  std::FILE* file = std::fopen(temporary.c_str(), "wbe");
  bool written = file != nullptr &&
                 std::fwrite(contents.data(), 1, contents.size(), file) == contents.size() &&
                 std::fflush(file) == 0 && ::fsync(::fileno(file)) == 0;
  int reason = errno;
  if (file != nullptr && std::fclose(file) != 0 && written) {  // a full disk may only be reported here
    written = false;
    reason = errno;
  }
  std::error_code error;
  if (written) {
    fs::rename(temporary, path, error);
  }
  if (!written || error) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    ThrowCannotWrite(path, written ? error.message() : std::strerror(reason));
  }
}

void CreateResultFolder(const fs::path& path) {
  std::error_code error;
  ThrowIf<UsageError>(
      fs::exists(path, error) && !(fs::is_directory(path, error) && fs::is_empty(path, error)),
      "{}: exists already, expected a new or empty folder for the results", path.string());
  fs::create_directories(path, error);
  if (error) {
    throw InputError("{}: cannot be created ({}), expected a writable place for the results", path.string(),
                     error.message());
  }
}

fs::path UnusedResultFolder(const fs::path& parent, std::string_view name) {
  fs::path path = parent / name;
  for (int number = 2; fs::exists(path) && !fs::is_empty(path); ++number) {
    path = parent / fmt::format("{}-{}", name, number);
  }
  return path;
}

}  // namespace sqslam
