#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "slam/snapshot/snapshot.h"
#include "slam/tracking/frame_view.h"

namespace sqslam::viewer {

// All that the window shows of one frame of a run. A value: made by the thread that reads or maps, never
// changed afterwards.
struct ShownFrame {
  std::int64_t frame_index = 0;
  double timestamp = 0.0;                     // seconds
  MapSnapshotPtr map;                         // the newest at this frame, its camera that of the frame
  cv::Mat image;                              // 8UC3 as recorded; empty where there is none
  std::string no_image;                       // why, where it is empty
  std::vector<SnapshotDetection> detections;  // boxes of the frame, pixels of the image
  std::vector<FrameView::Feature> features;   // of a run that goes on; empty for recordings, which keep none
};

using ShownFramePtr = std::shared_ptr<const ShownFrame>;

}  // namespace sqslam::viewer
