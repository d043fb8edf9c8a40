#include "app/viewer/model/folder_list.h"

#include <algorithm>
#include <optional>
#include <system_error>
#include <tuple>

namespace sqslam::viewer {
namespace fs = std::filesystem;

bool IsCloudFile(const fs::path& file) { return file.extension() == ".ply" || file.extension() == ".PLY"; }

std::optional<FolderEntry::Kind> KindOf(const fs::path& path) {
  std::error_code unreadable;
  if (fs::is_directory(path, unreadable)) {
    return fs::is_regular_file(path / "map.sqmap", unreadable) ? FolderEntry::Kind::kResult
                                                               : FolderEntry::Kind::kFolder;
  }
  const bool opens = path.extension() == ".sqmap" || IsCloudFile(path);
  return opens ? std::optional(FolderEntry::Kind::kFile) : std::nullopt;
}

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
  std::ranges::sort(entries, {}, [](const FolderEntry& entry) { return std::tie(entry.kind, entry.name); });
  return entries;
}

}  // namespace sqslam::viewer
