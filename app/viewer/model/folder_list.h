#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sqslam::viewer {

// Something in a folder that can be opened or entered.
struct FolderEntry {
  enum class Kind { kFolder, kResult, kFile };  // result: a folder with a map.sqmap; file: a map or a cloud
  Kind kind = Kind::kFolder;
  std::filesystem::path path;
  std::string name;  // for people
};

// Results first, then folders, then files, each by name; hidden ones are left out, and all where the folder
// cannot be read.
std::vector<FolderEntry> ListFolder(const std::filesystem::path& folder);

}  // namespace sqslam::viewer
