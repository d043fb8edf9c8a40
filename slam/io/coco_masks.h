#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "slam/geometry/box2.h"

namespace sqslam {

// Returns the bounds of an annotation's `segmentation` in COCO's JSON, pixels: polygons [[x, y, x, y, ...],
// ...], or run lengths {"size": [height, width], "counts": list or text}. Without area if nothing is in the
// mask. Throws nlohmann::json::exception for other types, InputError that begins with `place` for impossible
// values.
Box2d BoundsOfMask(const nlohmann::ordered_json& segmentation, const std::string& place);

}  // namespace sqslam
