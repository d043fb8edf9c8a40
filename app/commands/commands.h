#pragma once

#include <CLI/CLI.hpp>

namespace sqslam::app {

// Each registers one subcommand with its options and --help text (with examples). The subcommand's callback
// does the work and throws InputError, UsageError, NoMapError (slam/util/error.h), which main() turns into
// one line and an exit code; a callback that ends with another exit code stores it in `exit_code`.
void AddRunCommand(CLI::App& app, int& exit_code);
void AddDemoCommand(CLI::App& app, int& exit_code);
void AddCalibrateCommand(CLI::App& app, int& exit_code);
void AddDetectCommand(CLI::App& app, int& exit_code);
void AddEvalCommand(CLI::App& app, int& exit_code);
void AddExperimentCommand(CLI::App& app, int& exit_code);
void AddRenderCommand(CLI::App& app, int& exit_code);
void AddFigureCommand(CLI::App& app, int& exit_code);
void AddSynthCommand(CLI::App& app, int& exit_code);
void AddVocabularyCommand(CLI::App& app, int& exit_code);
void AddFitCommand(CLI::App& app, int& exit_code);
void AddExportCommand(CLI::App& app, int& exit_code);
void AddInfoCommand(CLI::App& app, int& exit_code);

}  // namespace sqslam::app
