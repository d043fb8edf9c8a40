#include "app/version.h"

#include <ceres/version.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <yaml-cpp/yaml.h>
#include <zlib.h>

#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <opencv2/core/version.hpp>

namespace sqslam::app {

std::string VersionText() {
  return fmt::format(
      "sqslam {}\n"
      "build      {}, {} {}\n"
      "libraries  OpenCV {}, Ceres {}, Eigen {}.{}.{}, VTK {}, SQLite {}, zlib {}, fmt {}.{}.{}, JSON "
      "{}.{}.{}, "
      "CLI11 {}\n"
      "rendering  {}",
      SQSLAM_VERSION, SQSLAM_BUILD_TYPE, SQSLAM_COMPILER, __VERSION__, CV_VERSION, CERES_VERSION_STRING,
      EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION, SQSLAM_VTK_VERSION, sqlite3_libversion(),
      zlibVersion(), FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100,
      NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH, CLI11_VERSION,
      SQSLAM_BACK_ENDS);
}

}  // namespace sqslam::app
