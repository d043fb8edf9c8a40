#pragma once

#include <filesystem>
#include <string_view>

namespace sqslam {

// Writes the file whole or not at all: under a temporary name in the same folder, then renamed. An existing
// file is replaced. Throws InputError that says why (disk full, no permission, ...), and leaves no temporary
// file behind.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view contents);

// A path for files that a library writes, or for a folder: write to Path() (same folder and extension), then
// Commit() renames it to its real name. Without Commit the temporary file or folder is removed; one that a
// killed program has left for the same path is removed by the next to write there.
class AtomicPath {
 public:
  explicit AtomicPath(std::filesystem::path path);
  ~AtomicPath();
  AtomicPath(const AtomicPath&) = delete;
  AtomicPath& operator=(const AtomicPath&) = delete;

  const std::filesystem::path& Path() const { return temporary_; }
  void Commit();  // throws InputError where nothing was written or the rename fails

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;
};

// Removes what killed programs have left of an AtomicPath or a file in this folder. Nobody may be writing
// there.
void RemoveDrafts(const std::filesystem::path& folder);

// Makes an empty folder for results, parents included. Throws UsageError where it exists and is not empty
// (results are never overwritten), InputError where it cannot be made.
void CreateResultFolder(const std::filesystem::path& path);

// parent/name, or parent/name-2, parent/name-3, ...: the first that is free.
std::filesystem::path FreeResultFolder(const std::filesystem::path& parent, std::string_view name);

}  // namespace sqslam
