#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "slam/snapshot/object_edits.h"
#include "slam/snapshot/recording.h"

namespace sqslam::app {

// --edits: edits of the map's objects that the viewer saved. Without it commands show what was mapped.
void AddEditsOption(CLI::App& command, std::string& edits);

// The file that the option means: itself, with "auto" the one beside the recording; empty where it was not
// given. Throws InputError where "auto" finds none.
std::filesystem::path EditsFile(const std::filesystem::path& recording, const std::string& edits);

// A recording whose every snapshot is edited on the way. Warns of edits of objects that the map does not
// have. Throws InputError that names the file.
RecordingReader OpenEdited(const std::filesystem::path& recording, const std::string& edits,
                           viewer::HiddenObjects hidden);

}  // namespace sqslam::app
