#pragma once

#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

namespace sqslam {

// True for addresses that images come from over the network: rtsp://..., http://... and the like.
bool IsStreamAddress(const std::string& text);

// The address without user, password and what follows a '?' (often a key): for messages, names and files.
std::string PublicAddress(const std::string& address);

struct StreamOptions {
  double open_seconds = 10.0;     // an address that has not answered by then cannot be opened
  double silence_seconds = 5.0;   // without an image the connection counts as lost
  double retry_seconds = 30.0;    // for so long a lost one is opened anew
  double retry_interval = 1.0;    // seconds between two attempts
  std::function<bool()> stopped;  // ends the waiting; may be empty
};

// Live images over the network, by OpenCV's FFmpeg. A connection that is lost is opened again; a film that
// has an end is played at its own rate and ends there. Used by one thread at a time.
class NetworkStream {
 public:
  // Throws InputError where the address cannot be opened or gives no images.
  explicit NetworkStream(const std::string& address, StreamOptions options = {});
  ~NetworkStream();

  cv::Size ImageSize() const;
  double Fps() const;  // 0: the stream does not say

  // Waits for the next image (8UC3); false at the end of a film, and where the connection stays lost.
  bool Read(cv::Mat& bgr);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
