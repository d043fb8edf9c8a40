// Part of every program that links sqslam::slam or sqslam::render (cmake/sqslamConfig.cmake.in): tells the
// library where the tree that it was found in keeps its data.

#include "slam/util/data_path.h"

namespace {

[[maybe_unused]] const bool kDataFolderIsSet = (sqslam::SetDataFolder(SQSLAM_DATA_FOLDER), true);

}  // namespace
