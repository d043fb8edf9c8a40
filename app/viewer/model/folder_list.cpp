#include "app/viewer/model/folder_list.h"

#include <algorithm>
#include <optional>
#include <system_error>
#include <tuple>

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

std::optional<FolderEntry::Kind> KindOf(const fs::path& path) {
  std::error_code unreadable;
  if (fs::is_directory(path, unreadable)) {
    return fs::is_regular_file(path / "map.sqmap", unreadable) ? FolderEntry::Kind::kResult
                                                               : FolderEntry::Kind::kFolder;
  }
  const fs::path extension = path.extension();
  const bool opens = extension == ".sqmap" || extension == ".ply" || extension == ".PLY";
  return opens ? std::optional(FolderEntry::Kind::kFile) : std::nullopt;
}

}  // namespace

std::vector<FolderEntry> ListFolder(const fs::path& folder) {
  std::vector<FolderEntry> entries;
  std::error_code unreadable;
  for (fs::directory_iterator at(folder, unreadable), end; !unreadable && at != end;
       at.increment(unreadable)) {
    const std::string name = at->path().filename().string();
    const auto kind = KindOf(at->path());
    if (kind && !name.starts_with('.')) {
      entries.push_back({*kind, at->path(), name});
    }
  }
  const auto rank = [](const FolderEntry& entry) {
    return std::tuple(entry.kind == FolderEntry::Kind::kResult   ? 0
                      : entry.kind == FolderEntry::Kind::kFolder ? 1
                                                                 : 2,
                      entry.name);
  };
  std::ranges::sort(entries, {}, rank);
  return entries;
}

}  // namespace sqslam::viewer
