#include "app/commands/version.h"

#include <ceres/version.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <yaml-cpp/yaml.h>
#include <zlib.h>

#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <opencv2/core/version.hpp>

#include "render/gl/offscreen_context.h"

namespace sqslam::app {
namespace {

// What the back end says of itself on this machine, or why it is not there.
std::string BackEnd(RenderBackend backend) {
  try {
    return OffscreenContext(backend).Description();
  } catch (const std::exception& e) {
    return fmt::format("{} is not available: {}", RenderBackendName(backend), e.what());
  }
}

}  // namespace

std::string VersionText() {
  return fmt::format(
      "sqslam {}\n"
      "build      {}, {} {}\n"
      "libraries  OpenCV {}, Ceres {}, Eigen {}.{}.{}, VTK {}, SQLite {}, zlib {}, fmt {}.{}.{}, JSON "
      "{}.{}.{}, "
      "CLI11 {}\n"
      "rendering  {}\n           {}",
      SQSLAM_VERSION, SQSLAM_BUILD_TYPE, SQSLAM_COMPILER, __VERSION__, CV_VERSION, CERES_VERSION_STRING,
      EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION, SQSLAM_VTK_VERSION, sqlite3_libversion(),
      zlibVersion(), FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100,
      NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH, CLI11_VERSION,
      BackEnd(RenderBackend::kOsmesa), BackEnd(RenderBackend::kEgl));
}

}  // namespace sqslam::app
