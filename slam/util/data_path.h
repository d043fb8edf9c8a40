#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sqslam {

// Finds a file that comes with the program, e.g. "assets/scenes/desk.yaml" or "configs/default.yaml": below
// the folder of SetDataFolder, below PREFIX/share/sqslam of an installed program, or in the source tree if it
// runs from build/PRESET/bin. Throws InputError if it is in none.
std::filesystem::path DataPath(const std::filesystem::path& name);

// Returns the absolute path, which ends in the name of the file or folder also for "kitchen/" and ".".
std::filesystem::path NamedPath(const std::filesystem::path& path);

// Sets the data folder for a program that is not installed beside it. The targets of find_package(sqslam) do
// so for programs that link them.
void SetDataFolder(const std::filesystem::path& folder);

// Returns the sorted names of NAME.yaml in such a folder ("configs/styles").
std::vector<std::string> ConfigNames(const std::filesystem::path& folder);

// Returns the same in one line, "dark, paper"; empty if there is no such folder.
std::string ConfigNameList(const std::filesystem::path& folder);

// Returns the file for NAME or FILE.yaml: one that ends in .yaml as it is, otherwise folder/NAME.yaml. Throws
// UsageError for an unknown name, listing all names and the nearest. `what`: its kind ("style").
std::filesystem::path ConfigFile(const std::filesystem::path& folder, const std::string& what,
                                 const std::string& name_or_file);

}  // namespace sqslam
