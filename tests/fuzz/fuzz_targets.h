#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace sqslam::testing {

// One kind of file that a stranger can hand to the programs, and its reader.
struct FuzzTarget {
  std::string_view name;
  std::string_view file;                            // name of the file that the reader looks for
  void (*read)(const std::filesystem::path& file);  // as the programs read it
  std::string (*seed)();                            // a valid file, small
  // Makes a file of arbitrary bytes, so that checksums and compression do not keep them from the reader.
  std::string (*wrap)(std::string_view bytes) = [](std::string_view bytes) { return std::string(bytes); };
};

// All targets, sorted by name.
std::span<const FuzzTarget> FuzzTargets();

// Throws std::out_of_range for an unknown name.
const FuzzTarget& FindFuzzTarget(std::string_view name);

// Reads the bytes as a file of the target in the folder. Returns the message of the error that a user would
// see, empty where the file was accepted. Any other exception is a mistake of the reader, and passes.
std::string ReadFuzzed(const FuzzTarget& target, const std::filesystem::path& folder, std::string_view bytes);

}  // namespace sqslam::testing
