#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sqslam {

// Finds a file that comes with the program, e.g. "assets/scenes/desk.yaml" or "configs/default.yaml": below
// the folder of SetDataFolder, below PREFIX/share/sqslam of an installed program, or in the source tree if it
// runs from build/PRESET/bin. Throws InputError if it is in none.
std::filesystem::path DataPath(const std::filesystem::path& name);

// Returns the absolute path, ending in the name of the file or folder even for "kitchen/" and ".".
std::filesystem::path AbsolutePath(const std::filesystem::path& path);

// Sets the data folder of a program that is not installed beside it. The targets of find_package(sqslam) call
// it for the programs that link them.
void SetDataFolder(const std::filesystem::path& folder);

// Returns the sorted NAMEs of all NAME.yaml in a folder like "configs/styles".
std::vector<std::string> ConfigNames(const std::filesystem::path& folder);

// Returns these names in one line, "dark, paper"; empty if the folder does not exist.
std::string ConfigNameList(const std::filesystem::path& folder);

// Returns the file for NAME or FILE.yaml: one that ends in .yaml as it is, otherwise folder/NAME.yaml. Throws
// UsageError that lists all names and the nearest one if the name is unknown. `what`: its kind ("style").
std::filesystem::path ConfigFile(const std::filesystem::path& folder, const std::string& what,
                                 const std::string& name_or_file);

}  // namespace sqslam
