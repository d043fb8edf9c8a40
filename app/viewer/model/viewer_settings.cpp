#include "app/viewer/model/viewer_settings.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstdlib>

#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/options.h"
#include "slam/util/throw_if.h"

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
  recent_files.resize(std::min(recent_files.size(), kMaxRecentFiles));
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
Values Load(const fs::path& file, std::vector<std::string>& warnings) {
  Values values;
  std::error_code error;
  if (file.empty() || !fs::exists(file, error)) {
    values.kept_in = file;
    return values;
  }
  YAML::Node root;
  try {
    root = YAML::LoadFile(file.string());
    ThrowIf<UsageError>(!root.IsMap() && !root.IsNull(), "{}: expected lines 'name: value'", file.string());
  } catch (const YAML::Exception& e) {
    warnings.push_back(fmt::format("{}:{}: invalid YAML; the defaults are used", file.string(),
                                   std::max(0, e.mark.line) + 1));
  } catch (const UsageError& e) {
    warnings.push_back(fmt::format("{}; the defaults are used", e.what()));
  }
  // Value by value, so that an invalid one does not affect the others.
  for (std::size_t i = 0; root.IsMap() && i < OptionFields(values).size(); ++i) {
    Values changed = values;
    const OptionField field = OptionFields(changed)[i];
    try {
      if (const YAML::Node node = root[field.key]) {
        AssignOption(node, field, fmt::format("{}:{}", file.string(), node.Mark().line + 1));
        values = changed;
      }
    } catch (const UsageError& e) {
      warnings.push_back(fmt::format("{}; the default is used", e.what()));
    }
  }
  values.kept_in = file;
  return values;
}

void Save(const auto& values) {
  if (!values.kept_in.empty()) {
    std::error_code error;
    fs::create_directories(values.kept_in.parent_path(), error);  // if this fails, writing reports why
    WriteFileAtomically(values.kept_in, DumpOptions(values));
  }
}

template ViewerSettings Load(const fs::path& file, std::vector<std::string>& warnings);
template ViewerMemory Load(const fs::path& file, std::vector<std::string>& warnings);
template void Save(const ViewerSettings& settings);
template void Save(const ViewerMemory& memory);

}  // namespace sqslam::viewer
