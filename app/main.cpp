#include <ceres/version.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <zlib.h>
#include <zstd.h>

#include <opencv2/core/version.hpp>
#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/terminal/terminal.h"
#include "render/gl/offscreen_context.h"
#include "slam/detection/network.h"
#include "slam/util/host.h"

namespace sqslam::app {
namespace {

constexpr const char* kNotes = R"(
Examples:
  sqslam demo                       a first map, without any input
  sqslam run data/kitchen           map a sequence; the result goes to out/kitchen
  sqslam info out/kitchen           list the contents of the map
  sqslam export out/kitchen -o kitchen.obj
  sqslam fit cloud.ply              fit a superquadric to a point cloud
  sqslam help run                   options of a command, with examples

Exit codes:
  0    success
  1    internal error
  2    wrong usage
  3    unusable input, or an output that cannot be written
  4    no map could be built
  5    a picture differs from its reference, or a map from another (diff --fail-on-change)
  130  interrupted by Ctrl-C
)";

// The back end's own description on this machine, or why it is not there.
std::string BackEnd(RenderBackend backend) {
  try {
    return OffscreenContext(backend).Description();
  } catch (const std::exception& e) {
    return fmt::format("{} is not available: {}", NameOf(backend), e.what());
  }
}

// Several lines: the program's version, how it was built, the libraries, the rendering back ends.
std::string VersionText() {
  const std::string onnx_runtime = OnnxRuntimeVersion();
  return fmt::format(
      "sqslam {}\n"
      "build      {}, {} {}\n"
      "libraries  OpenCV {}, Ceres {}, Eigen {}.{}.{}, VTK {}, SQLite {}, zlib {}, Zstandard {}, fmt "
      "{}.{}.{}, JSON {}.{}.{}, ONNX Runtime {}\n"
      "rendering  {}\n           {}",
      SQSLAM_VERSION, SQSLAM_BUILD_TYPE, SQSLAM_COMPILER, __VERSION__, CV_VERSION, CERES_VERSION_STRING,
      EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION, SQSLAM_VTK_VERSION, sqlite3_libversion(),
      zlibVersion(), ZSTD_versionString(), FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100,
      NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH,
      onnx_runtime.empty() ? "none" : onnx_runtime, BackEnd(RenderBackend::kOsmesa),
      BackEnd(RenderBackend::kEgl));
}

int ParseAndRun(const std::vector<std::string>& words) {
  Command program("sqslam", "Monocular object SLAM: maps of superquadrics from video");
  program.OnVersion(VersionText);
  program.Group("Mapping");
  AddDemoCommand(program);
  AddRunCommand(program);
  AddLocalizeCommand(program);
  AddMergeCommand(program);
  AddDensifyCommand(program);
  AddDetectCommand(program);
  AddDoctorCommand(program);
  AddCalibrateCommand(program);
  program.Group("Results");
  AddInfoCommand(program);
  AddScaleCommand(program);
  AddQueryCommand(program);
  AddDiffCommand(program);
  AddEvalCommand(program);
  AddRenderCommand(program);
  AddFigureCommand(program);
  AddReportCommand(program);
  AddExportCommand(program);
  program.Group("Experiments and tools");
  AddExperimentCommand(program);
  AddSynthCommand(program);
  AddFitCommand(program);
  AddVocabularyCommand(program);
  program.Notes(kNotes);
  return program.Run(words);
}

}  // namespace
}  // namespace sqslam::app

int main(int argc, char** argv) {
  sqslam::ReturnFreedMemory();
  return sqslam::app::RunProgram("sqslam", [&] { return sqslam::app::ParseAndRun({argv + 1, argv + argc}); });
}
