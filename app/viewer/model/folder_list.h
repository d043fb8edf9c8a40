#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace sqslam::viewer {

bool IsCloudFile(const std::filesystem::path& file);  // by its name

// An entry of a folder that can be opened or entered; kinds in the order in which they are listed.
struct FolderEntry {
  enum class Kind { kResult, kFolder, kFile };  // result: a folder with a map.sqmap; file: a map or a cloud
  Kind kind = Kind::kFolder;
  std::filesystem::path path;
  std::string name;
};

// Returns the kind of a path; empty if it can be neither opened nor entered.
std::optional<FolderEntry::Kind> KindOf(const std::filesystem::path& path);

// Returns the entries of a folder: results, then folders, then files, each by name, without hidden ones;
// empty if the folder cannot be read.
std::vector<FolderEntry> ListFolder(const std::filesystem::path& folder);

}  // namespace sqslam::viewer
