#pragma once

#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "slam/geometry/camera.h"
#include "slam/io/frame_source.h"

namespace sqslam {

// Waits for the next live image (8UC3); returns false if none came.
using FrameGrabber = std::function<bool(cv::Mat& bgr)>;

// Opens a local camera (OpenCV) and requests the calibration's image size and rate. Throws InputError if it
// cannot be opened.
FrameGrabber OpenCamera(int index, const Camera& camera);

// Returns a clock: seconds since 1970 that never run backwards while the program runs.
std::function<double()> LiveClock();

// Live images until the camera ends or range.count frames have come. A thread takes every image at once; a
// slow consumer gets the newest one, and older ones count as dropped. A frame's timestamp is the arrival
// time of its image, its index counts all images (dropped ones too); range.start and range.stride
// skip images.
class LiveSource : public FrameStream {
 public:
  // Waits for the first image. `name`: for messages ("camera 0"). `stopped`: ends the wait for a hanging
  // camera. Throws InputError if no image comes or its size is not the calibration's.
  LiveSource(FrameGrabber grabber, const Camera& camera, std::string name, const FrameRange& range = {},
             std::function<double()> now = LiveClock(), std::function<bool()> stopped = {});
  ~LiveSource() override;

  std::optional<Frame> Next() override;  // waits for a new image; empty at the end
  int Skipped() const override;          // unusable images so far
  int Dropped() const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Returns true for addresses of network streams: rtsp://..., http://... and the like.
bool IsStreamAddress(const std::string& text);

// Returns the address without user, password and query (often a key): for messages, names and files.
std::string PublicAddress(const std::string& address);

struct StreamOptions {
  double open_seconds = 10.0;     // time limit for opening an address
  double silence_seconds = 5.0;   // time without an image after which the connection counts as lost
  double retry_seconds = 30.0;    // time limit for reopening a lost connection
  double retry_interval = 1.0;    // seconds between two attempts
  std::function<bool()> stopped;  // ends the waiting; may be empty
};

// Live images over the network, by OpenCV's FFmpeg. A lost connection is reopened; a film of finite length is
// played at its own rate. Used by one thread at a time.
class NetworkStream {
 public:
  // Throws InputError if the address cannot be opened or delivers no images.
  explicit NetworkStream(const std::string& address, StreamOptions options = {});
  ~NetworkStream();

  cv::Size ImageSize() const;
  double Fps() const;  // 0: unknown

  // Waits for the next image (8UC3); returns false at the end of a film, or if the connection stays lost.
  bool Read(cv::Mat& bgr);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
