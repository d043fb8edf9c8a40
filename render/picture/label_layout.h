#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <vector>

#include "render/solids/solid_image.h"

// Names beside the objects that they belong to.
namespace sqslam {

// The part of a solid that a picture shows.
struct VisiblePart {
  cv::Rect bounds;   // of its visible pixels; empty: nothing of it is visible
  cv::Point anchor;  // the visible pixel farthest from its edge
};

// Returns the part that the mask's pixels (8UC1, not 0) form.
VisiblePart VisiblePartOf(const cv::Mat1b& mask);

// A solid to be named.
struct NamedSolid {
  PosedSuperquadric solid;
  bool opaque = true;  // hides others; false: drawn as lines
};

// The objects in a picture.
struct SeenSolids {
  cv::Mat1i number;                // index of the nearest opaque solid at each pixel; -1: none
  std::vector<VisiblePart> parts;  // in the order of the solids
};

// `see_through`: solids hide nothing, so that each is seen whole. `hidden`: pixels at which other content
// hides the nearest solid; empty: none.
SeenSolids SeeSolids(std::span<const NamedSolid> solids, bool see_through, const Camera& camera,
                     const Rigid3d& T_map_camera, const cv::Mat1b& hidden = {},
                     const std::function<bool(const Eigen::Vector3d&)>& keeps = nullptr);

// A name to place, pixels.
struct LabelRequest {
  VisiblePart part;                    // of the object
  cv::Size size;                       // of the text
  double depth = 0.0;                  // nearer objects are placed first
  int number = -1;                     // of the object in the image of numbers
  std::optional<cv::Rect> first = {};  // place that is tried first
};

// The place of a name; an empty area if there is no room in the picture.
struct LabelPlace {
  cv::Rect area;
  bool leader = false;  // a line to the anchor says to what it belongs
  cv::Point anchor;     // a visible pixel of the object: the end of the line, or one beside the text
};

// Places texts so that they do not overlap, do not cover `taken` and lie inside the picture: beside their
// object where no other one is near, otherwise as near as there is room, with a leader. `number`: as in
// SeenSolids. Returns the places in the order of the requests.
std::vector<LabelPlace> PlaceLabels(std::span<const LabelRequest> requests, const cv::Mat1i& number,
                                    std::span<const cv::Rect> taken);

// Returns the end of the leader at the text: the point of its area nearest to the anchor.
cv::Point LeaderStart(const LabelPlace& place);

}  // namespace sqslam
