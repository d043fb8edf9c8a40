#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <system_error>
#include <utility>

#include "app/command_line/command.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {

// Prints the summary of a command unless `quiet`.
template <typename... Values>
void PrintSummary(bool quiet, fmt::format_string<Values...> text, Values&&... values) {
  if (!quiet) {
    fmt::print(text, std::forward<Values>(values)...);
  }
}

// Creates the folder of an output file, with those above it. Throws InputError if it cannot be created.
inline void CreateFolderOf(const std::filesystem::path& output) {
  std::error_code error;
  if (output.has_parent_path()) {
    std::filesystem::create_directories(output.parent_path(), error);
  }
  ThrowIf<InputError>(static_cast<bool>(error), "{}: its folder cannot be created ({})", output.string(),
                      error.message());
}

// Each adds one command with its options, help and examples. Commands return their exit code, or throw an
// error of slam/util/error.h, which main() turns into one line and an exit code.
void AddDemoCommand(Command& program);
void AddRunCommand(Command& program);
void AddCalibrateCommand(Command& program);
void AddDetectCommand(Command& program);
void AddDoctorCommand(Command& program);
void AddDensifyCommand(Command& program);
void AddEvalCommand(Command& program);
void AddExperimentCommand(Command& program);
void AddDiffCommand(Command& program);
void AddQueryCommand(Command& program);
void AddRenderCommand(Command& program);
void AddFigureCommand(Command& program);
void AddReportCommand(Command& program);
void AddSynthCommand(Command& program);
void AddVocabularyCommand(Command& program);
void AddFitCommand(Command& program);
void AddExportCommand(Command& program);
void AddLocalizeCommand(Command& program);
void AddMergeCommand(Command& program);
void AddScaleCommand(Command& program);
void AddInfoCommand(Command& program);

}  // namespace sqslam::app
