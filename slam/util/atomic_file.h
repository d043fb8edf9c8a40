#pragma once

#include <filesystem>
#include <string_view>

namespace sqslam {

// Writes a file atomically: under a temporary name in the same folder, then renamed. Replaces an existing
// file. Throws InputError with the reason (disk full, no permission, ...), and leaves no temporary file
// behind.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view contents);

// A path for a folder, or for files that a library writes: write to Path() (same folder and extension), then
// Commit() renames it to its real name. Without Commit the temporary file or folder is removed. The next
// writer of the same path removes the leftovers of killed programs.
class AtomicPath {
 public:
  explicit AtomicPath(std::filesystem::path path);
  ~AtomicPath();
  AtomicPath(const AtomicPath&) = delete;
  AtomicPath& operator=(const AtomicPath&) = delete;

  const std::filesystem::path& Path() const { return temporary_; }
  void Commit();  // throws InputError if nothing was written or the rename fails

  // Same for a new file: throws InputError if another program has created it meanwhile.
  void CommitNew();

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;
};

// Removes temporary files that killed programs left in this folder. Nobody may be writing there.
void RemoveTemporaryFiles(const std::filesystem::path& folder);

// Creates an empty folder for results, with its parents. Throws UsageError if it exists and is not empty
// (results are never overwritten), and InputError if it cannot be created.
void CreateResultFolder(const std::filesystem::path& path);

// Returns the first free one of parent/name, parent/name-2, parent/name-3, ...
std::filesystem::path UnusedResultFolder(const std::filesystem::path& parent, std::string_view name);

}  // namespace sqslam
