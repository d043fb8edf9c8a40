#pragma once

#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "slam/geometry/camera.h"
#include "slam/io/frame_source.h"

namespace sqslam {

// A source of live images: waits for the next one (8UC3); false: none came.
using FrameGrabber = std::function<bool(cv::Mat& bgr)>;

// A camera of this machine (OpenCV), asked for the calibration's image size and rate. Throws InputError where
// it cannot be opened.
FrameGrabber OpenCamera(int index, const Camera& camera);

// Seconds since 1970 that never run backwards while the program runs.
std::function<double()> LiveClock();

// Live images, endless: until the camera gives none any more, or range.count frames. A thread of its own
// takes every image at once; a slow consumer gets the newest one, and those between are counted as dropped. A
// frame's timestamp is when its image arrived, its index that of the image (dropped ones count), range.start
// leaves out the first images and range.stride those between.
class LiveSource : public FrameStream {
 public:
  // Waits for the first image. `name` is for messages ("camera 0"). Throws InputError where no image comes or
  // its size is not the calibration's. `stopped` ends it where a camera gives nothing and does not return
  // either.
  LiveSource(FrameGrabber grabber, const Camera& camera, std::string name, const FrameRange& range = {},
             std::function<double()> now = LiveClock(), std::function<bool()> stopped = {});
  ~LiveSource() override;

  std::optional<Frame> Next() override;  // waits for an image that has not been given yet; empty at the end
  int Skipped() const override;          // images that could not be used until now
  int Dropped() const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
