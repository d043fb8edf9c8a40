#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "render/picture/picture_text.h"
#include "render/scene/style.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Places of the parts of a frame of a growth video, pixels. All sides are even.
struct GrowthLayout {
  cv::Size frame;
  cv::Rect image;  // the input image; empty where it is not shown
  cv::Rect view;   // the map
  cv::Rect timeline;
  double scale = 1.0;  // pixels for one of the style's
};
GrowthLayout LayOut(cv::Size frame, bool show_image, const Camera& camera);

// The times that the time line shows, in seconds of the run.
struct GrowthTimes {
  double start = 0.0;             // of the first snapshot
  double end = 0.0;               // of the last
  std::vector<double> keyframes;  // of the finished map
};

// Puts a frame together: the view of the map, the input image with its boxes and the outlines of the objects,
// time line and counts. Belongs to one thread; keeps what stays the same from frame to frame.
class GrowthPage {
 public:
  GrowthPage(const GrowthLayout& layout, const SceneStyle& style, const LabelColors& colors,
             GrowthTimes times);

  cv::Mat Compose(const cv::Mat& view, const MapSnapshotPtr& map);

 private:
  cv::Mat DrawImage(const MapSnapshot& map) const;
  void DrawObjects(cv::Mat& part, const cv::Mat& image, const MapSnapshot& map) const;
  void DrawBoxes(cv::Mat& part, const cv::Mat& image, const MapSnapshot& map) const;
  void DrawTimeline(cv::Mat& page, const MapSnapshot& map) const;

  GrowthLayout layout_;
  SceneStyle style_;
  LabelColors colors_;
  GrowthTimes times_;
  TextPainter text_;
  MapSnapshotPtr shown_;  // the map whose image was drawn last
  cv::Mat image_;
};

}  // namespace sqslam
