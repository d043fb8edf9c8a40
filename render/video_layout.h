#pragma once

#include <opencv2/core.hpp>

#include "render/picture_text.h"
#include "render/style.h"
#include "slam/map/snapshot.h"

namespace sqslam {

// Where the parts of a frame of a growth video lie, in pixels. All sides are even.
struct GrowthLayout {
  cv::Size frame;
  cv::Rect image;  // the input image; empty where it is not shown
  cv::Rect view;   // the map
  cv::Rect timeline;
  double scale = 1.0;  // pixels for one of the style's
};
GrowthLayout LayOut(cv::Size frame, bool show_image, const Camera& camera);

struct GrowthMoment {
  double progress = 0.0;  // in [0, 1]
  double seconds = 0.0;   // since the first snapshot
};

// Puts a frame together: the view of the map, the input image with its boxes, time line and counts.
class GrowthPage {
 public:
  GrowthPage(const GrowthLayout& layout, const SceneStyle& style, const LabelColors& colors);

  cv::Mat Compose(const cv::Mat& view, const MapSnapshot& map, const GrowthMoment& moment) const;

 private:
  void DrawImage(cv::Mat& page, const MapSnapshot& map) const;
  void DrawTimeline(cv::Mat& page, const MapSnapshot& map, const GrowthMoment& moment) const;

  GrowthLayout layout_;
  SceneStyle style_;
  LabelColors colors_;
  TextPainter text_;
};

}  // namespace sqslam
