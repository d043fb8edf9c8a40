#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sqslam {

// Finds a file that comes with the program, e.g. "assets/scenes/desk.yaml" or "configs/default.yaml":
// below the folder of SetDataFolder, below PREFIX/share/sqslam of an installed program, or in the source tree
// of one that runs from build/PRESET/bin. Throws InputError where it is in none.
std::filesystem::path DataPath(const std::filesystem::path& name);

// Says where the data lie for a program that is not installed beside them. The targets of
// find_package(sqslam) do it for whoever links them.
void SetDataFolder(const std::filesystem::path& folder);

// Names of the NAME.yaml in such a folder ("configs/styles"), sorted.
std::vector<std::string> ConfigNames(const std::filesystem::path& folder);

// The same in one line for texts: "dark, paper"; empty where there is no such folder.
std::string ConfigNameList(const std::filesystem::path& folder);

// The file that NAME or FILE.yaml means: one that ends in .yaml as it is, otherwise folder/NAME.yaml. Throws
// UsageError for an unknown name, with those there are and the nearest; `what` says its kind ("style").
std::filesystem::path ConfigFile(const std::filesystem::path& folder, const std::string& what,
                                 const std::string& name_or_file);

}  // namespace sqslam
