#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <cstdlib>
#include <opencv2/core/utils/logger.hpp>
#include <string>

#include "app/commands/commands.h"
#include "app/commands/version.h"
#include "slam/util/error.h"

namespace {

constexpr const char* kExamples = R"(
Examples:
  sqslam run data/kitchen          map a sequence; the result is in out/kitchen
  sqslam info out/kitchen          what is in the map
  sqslam export out/kitchen --output kitchen.obj
  sqslam fit cloud.ply             the superquadric of a point cloud
  sqslam COMMAND --help            options of a command, with examples

Exit codes: 0 done, 1 internal error, 2 wrong usage, 3 input that cannot be used, 4 no map could be built,
5 a picture differs from its reference, 130 after Ctrl-C.
)";

// Warnings go to stderr as one line each. Libraries that print by themselves are silenced: what they find
// comes back to the reader, which says it with file and frame.
void SetUpLogging() {
  auto logger = spdlog::stderr_color_mt("sqslam");
  logger->set_pattern("sqslam: %^%l%$: %v");
  spdlog::set_default_logger(logger);
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
}

int Fail(int exit_code, const char* message) {
  fmt::print(stderr, "sqslam: {}\n", message);
  return exit_code;
}

int ParseAndRun(int argc, char** argv) {
  int exit_code = 0;
  CLI::App app("Object SLAM from one camera: a map of superquadrics, with pictures", "sqslam");
  app.footer(kExamples);
  app.set_version_flag("--version", [] { return sqslam::app::VersionText(); });
  app.require_subcommand(1);
  app.get_formatter()->column_width(36);
  sqslam::app::AddDemoCommand(app, exit_code);
  sqslam::app::AddRunCommand(app, exit_code);
  sqslam::app::AddCalibrateCommand(app, exit_code);
  sqslam::app::AddDetectCommand(app, exit_code);
  sqslam::app::AddEvalCommand(app, exit_code);
  sqslam::app::AddExperimentCommand(app, exit_code);
  sqslam::app::AddRenderCommand(app, exit_code);
  sqslam::app::AddFigureCommand(app, exit_code);
  sqslam::app::AddSynthCommand(app, exit_code);
  sqslam::app::AddVocabularyCommand(app, exit_code);
  sqslam::app::AddFitCommand(app, exit_code);
  sqslam::app::AddExportCommand(app, exit_code);
  sqslam::app::AddInfoCommand(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) {
      return app.exit(e);  // --help, --version
    }
    std::string used;  // the command, and its own where it has some
    for (auto commands = app.get_subcommands(); !commands.empty();
         commands = commands.front()->get_subcommands()) {
      used += commands.front()->get_name() + " ";
    }
    fmt::print(stderr, "sqslam: {} (see sqslam {}--help)\n", e.what(), used);
    return 2;
  }
  return exit_code;
}

}  // namespace

// The one place where errors become exit codes.
int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file size limit is then reported like a full disk
  SetUpLogging();
  try {
    return ParseAndRun(argc, argv);
  } catch (const sqslam::UsageError& e) {
    return Fail(2, e.what());
  } catch (const sqslam::InputError& e) {
    return Fail(3, e.what());
  } catch (const sqslam::NoMapError& e) {
    return Fail(4, e.what());
  } catch (const std::exception& e) {
    return Fail(1, fmt::format("internal error: {}", e.what()).c_str());
  }
}
