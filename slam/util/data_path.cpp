#include "slam/util/data_path.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <system_error>

#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam {
namespace fs = std::filesystem;

namespace {

fs::path& DataFolder() {
  static fs::path folder;
  return folder;
}

}  // namespace

fs::path AbsolutePath(const fs::path& path) {
  return fs::absolute(path / "").lexically_normal().parent_path();
}

void SetDataFolder(const fs::path& folder) { DataFolder() = folder; }

fs::path DataPath(const fs::path& name) {
  std::error_code error;
  const fs::path bin = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const fs::path& root : {DataFolder(), bin / ".." / "share" / "sqslam", bin / ".." / ".." / ".."}) {
    const fs::path candidate = (root / name).lexically_normal();
    if (!root.empty() && fs::exists(candidate, error)) {
      return candidate;
    }
  }
  throw InputError("{}: not found beside {}, expected below ../share/sqslam (cmake --install puts it there)",
                   name.string(), bin.string());
}

std::vector<std::string> ConfigNames(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(DataPath(folder))) {
    if (entry.path().extension() == ".yaml") {
      names.push_back(entry.path().stem().string());
    }
  }
  std::ranges::sort(names);
  return names;
}

std::string ConfigNameList(const fs::path& folder) {
  try {
    return fmt::format("{}", fmt::join(ConfigNames(folder), ", "));
  } catch (const InputError&) {
    return "";
  }
}

fs::path ConfigFile(const fs::path& folder, const std::string& what, const std::string& name_or_file) {
  if (fs::path(name_or_file).extension() == ".yaml") {
    return name_or_file;
  }
  const std::vector<std::string> names = ConfigNames(folder);
  if (std::ranges::find(names, name_or_file) == names.end()) {
    throw UsageError("{} '{}': unknown, expected a FILE.yaml or one of {}{}", what, name_or_file,
                     fmt::join(names, ", "), DidYouMean(name_or_file, names));
  }
  return DataPath(folder / (name_or_file + ".yaml"));
}

}  // namespace sqslam
