#pragma once

#include <opencv2/core.hpp>

#include "render/synthetic/scene_description.h"

namespace sqslam {

// Paints a picture of `width` x `height` metres at `pixels_per_metre`. Every pattern has detail at all scales
// down to two pixels and repeats nowhere, so that corners are found and told apart. Patterns: package, book,
// ceramic, marble, wood, plaster, terrazzo, poster, page. `variation` makes another picture of the same kind,
// for another side of one body. Deterministic in its arguments. Throws InputError on an unknown pattern.
// Returns 8UC3, BGR.
cv::Mat PaintTexture(const TextureDescription& texture, double width, double height, double pixels_per_metre,
                     int variation);

}  // namespace sqslam
