#include "app/viewer/model/viewer_settings.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstdlib>

#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;
namespace {

// Relative paths in these variables must be ignored (XDG Base Directory Specification).
fs::path BaseFolder(const char* variable, const char* below_home) {
  const char* value = std::getenv(variable);
  if (value != nullptr && fs::path(value).is_absolute()) {
    return value;
  }
  const char* home = std::getenv("HOME");
  return home != nullptr && *home != '\0' ? fs::path(home) / below_home : fs::path();
}

fs::path FileBelow(const fs::path& base) { return base.empty() ? base : base / "sqslam" / "viewer.yaml"; }

}  // namespace

void ViewerMemory::Remember(const fs::path& file) {
  const std::string name = fs::absolute(file).lexically_normal().string();
  std::erase(recent_files, name);
  recent_files.insert(recent_files.begin(), name);
  if (recent_files.size() > kMostRecent) {
    recent_files.resize(kMostRecent);
  }
}

void ViewerMemory::ForgetMissing() {
  std::erase_if(recent_files, [](const std::string& file) {
    std::error_code error;
    return !fs::exists(file, error);
  });
}

fs::path SettingsFile() { return FileBelow(BaseFolder("XDG_CONFIG_HOME", ".config")); }
fs::path MemoryFile() { return FileBelow(BaseFolder("XDG_STATE_HOME", ".local/state")); }

template <typename Values>
Loaded<Values> Load(const fs::path& file) {
  Loaded<Values> loaded;
  std::error_code error;
  if (file.empty() || !fs::exists(file, error)) {
    return loaded;
  }
  YAML::Node root;
  try {
    root = YAML::LoadFile(file.string());
  } catch (const YAML::Exception& e) {
    loaded.warnings.push_back(fmt::format("{}:{}: no valid YAML; the defaults are used", file.string(),
                                          std::max(0, e.mark.line) + 1));
    return loaded;
  }
  if (!root.IsMap() && !root.IsNull()) {
    loaded.warnings.push_back(
        fmt::format("{}: expected lines 'name: value'; the defaults are used", file.string()));
    return loaded;
  }
  // Value by value, so that an invalid one does not affect the others.
  for (std::size_t i = 0; i < OptionFields(loaded.values).size(); ++i) {
    Values changed = loaded.values;
    const OptionField field = OptionFields(changed)[i];
    const YAML::Node node = root[field.key];
    try {
      if (node) {
        AssignOption(node, field, fmt::format("{}:{}", file.string(), node.Mark().line + 1));
        loaded.values = changed;
      }
    } catch (const UsageError& e) {
      loaded.warnings.push_back(fmt::format("{}; the default is used", e.what()));
    }
  }
  return loaded;
}

void Save(const fs::path& file, const auto& values) {
  if (file.empty()) {
    return;
  }
  std::error_code error;
  fs::create_directories(file.parent_path(), error);  // if this fails, writing reports why
  WriteFileAtomically(file, DumpOptions(values));
}

template Loaded<ViewerSettings> Load(const fs::path& file);
template Loaded<ViewerMemory> Load(const fs::path& file);
template void Save(const fs::path& file, const ViewerSettings& settings);
template void Save(const fs::path& file, const ViewerMemory& memory);

}  // namespace sqslam::viewer
