#pragma once

#include "render/gl/picture_pass.h"
#include "render/gl/screen_program.h"
#include "render/gl/screen_tiles.h"

namespace sqslam {

// Finds out where the solids and lines of a picture are seen, with a margin around them. Pixels. For the
// sources of render/gl only.
ScreenTiles SeenTiles(const PictureLayers& layers, const Lens& lens, cv::Size picture, double margin);

}  // namespace sqslam
