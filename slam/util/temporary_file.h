#pragma once

#include <cstddef>

namespace sqslam {

// A file without a name in the system's folder for temporary files: gone when the program ends, however it
// does. Made when first written.
class TemporaryFile {
 public:
  TemporaryFile() = default;
  ~TemporaryFile();
  TemporaryFile(TemporaryFile&& other) noexcept;
  TemporaryFile& operator=(TemporaryFile&& other) noexcept;

  // Returns false, from then on, if the disk does not take the bytes.
  bool Append(const void* bytes, std::size_t size);

  // Throws InputError if the disk does not give back what it took.
  void Read(std::size_t offset, void* bytes, std::size_t size) const;

 private:
  int descriptor_ = -1;
  std::size_t size_ = 0;
  bool failed_ = false;
};

}  // namespace sqslam
