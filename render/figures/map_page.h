#pragma once

#include "render/page/page.h"
#include "render/picture/picture.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Returns the picture of a map that PictureRenderer draws, as a page as wide as the text of a paper. Objects
// are their exact silhouettes, farthest first; they, the path, names, legend and scale are vector graphics.
// Points, dense cloud, grid and frusta are one embedded picture in print resolution. `framed`: the map that
// determines the view; `map`: what is drawn. The options' size gives the proportions. Throws as
// PictureRenderer does.
FigurePage DrawMapPage(const MapSnapshot& framed, const MapSnapshot& map, const PictureOptions& options);

}  // namespace sqslam
