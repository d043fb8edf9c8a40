#pragma once

#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

namespace sqslam {

// Returns true for addresses of network streams: rtsp://..., http://... and the like.
bool IsStreamAddress(const std::string& text);

// Returns the address without user, password and query (often a key): for messages, names and files.
std::string PublicAddress(const std::string& address);

struct StreamOptions {
  double open_seconds = 10.0;     // after which an unanswered address cannot be opened
  double silence_seconds = 5.0;   // without an image, after which the connection counts as lost
  double retry_seconds = 30.0;    // for which a lost connection is reopened
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
