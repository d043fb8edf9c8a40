#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace sqslam::viewer {

bool IsCloudFile(const std::filesystem::path& file);  // by its name

// Something in a folder that can be opened or entered, in the order in which they are listed.
struct FolderEntry {
  enum class Kind { kResult, kFolder, kFile };  // result: a folder with a map.sqmap; file: a map or a cloud
  Kind kind = Kind::kFolder;
  std::filesystem::path path;
  std::string name;  // for people
};

// Returns how a path is listed; empty where it can be neither opened nor entered.
std::optional<FolderEntry::Kind> KindOf(const std::filesystem::path& path);

// Returns what is in a folder: results first, then folders, then files, each by name; hidden ones are left
// out, and all where the folder cannot be read.
std::vector<FolderEntry> ListFolder(const std::filesystem::path& folder);

}  // namespace sqslam::viewer
