#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <vector>

namespace sqslam {

// A name that is to stand beside what it names, pixels.
struct LabelRequest {
  cv::Rect bounds;     // of what is named, in the picture
  cv::Size size;       // of the text
  double depth = 0.0;  // nearer things get their place first
};

// Where the text goes; empty where there was no room. `leader`: so far away that a line should join the two.
struct LabelPlace {
  cv::Rect area;
  bool leader = false;
};

// Places texts above, below or beside their things, or further up, so that no two overlap, none covers
// `taken` and all lie inside the picture. In the order of the requests.
std::vector<LabelPlace> PlaceLabels(std::span<const LabelRequest> requests, cv::Size picture,
                                    std::span<const cv::Rect> taken);

}  // namespace sqslam
