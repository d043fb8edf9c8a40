// Compiled into every program that links sqslam::slam or sqslam::render (cmake/sqslamConfig.cmake.in): sets
// the data folder of the installation that find_package found.

#include "slam/util/data_path.h"

namespace {

[[maybe_unused]] const bool kDataFolderIsSet = (sqslam::SetDataFolder(SQSLAM_DATA_FOLDER), true);

}  // namespace
