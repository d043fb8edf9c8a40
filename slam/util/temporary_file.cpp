#include "slam/util/temporary_file.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include "slam/util/error.h"

namespace sqslam {
namespace {

// Returns a descriptor, or -1.
int OpenNameless() {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  std::string name = (folder / "sqslam-XXXXXX").string();
  const int descriptor = error ? -1 : ::mkostemp(name.data(), O_CLOEXEC);
  if (descriptor >= 0) {
    ::unlink(name.c_str());
  }
  return descriptor;
}

}  // namespace

TemporaryFile::~TemporaryFile() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
}

TemporaryFile::TemporaryFile(TemporaryFile&& other) noexcept { *this = std::move(other); }

TemporaryFile& TemporaryFile::operator=(TemporaryFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(size_, other.size_);
  std::swap(failed_, other.failed_);
  return *this;
}

bool TemporaryFile::Append(const void* bytes, std::size_t size) {
  if (descriptor_ < 0 && !failed_) {
    descriptor_ = OpenNameless();
  }
  const char* rest = static_cast<const char*>(bytes);
  std::size_t end = size_;
  failed_ = failed_ || descriptor_ < 0;
  while (!failed_ && end < size_ + size) {
    const ssize_t written = ::pwrite(descriptor_, rest, size_ + size - end, static_cast<off_t>(end));
    failed_ = written == 0 || (written < 0 && errno != EINTR);
    if (written > 0) {
      rest += written;
      end += static_cast<std::size_t>(written);
    }
  }
  size_ = failed_ ? size_ : end;
  return !failed_;
}

void TemporaryFile::Read(std::size_t offset, void* bytes, std::size_t size) const {
  char* rest = static_cast<char*>(bytes);
  while (size > 0) {
    const ssize_t got = ::pread(descriptor_, rest, size, static_cast<off_t>(offset));
    if (got == 0 || (got < 0 && errno != EINTR)) {
      throw InputError("a temporary file in {}: cannot be read back ({})",
                       std::filesystem::temp_directory_path().string(),
                       got == 0 ? "it was cut off" : std::generic_category().message(errno));
    }
    if (got > 0) {
      rest += got;
      offset += static_cast<std::size_t>(got);
      size -= static_cast<std::size_t>(got);
    }
  }
}

}  // namespace sqslam
