#pragma once

#include <exception>
#include <opencv2/core.hpp>
#include <thread>

#include "slam/util/bounded_queue.h"
#include "render/video/video.h"
#include "render/video/video_layout.h"

namespace sqslam {

// Puts the pages of a growth video together on a thread of its own, while the next view is drawn and the last
// page encoded.
class PageComposer {
 public:
  PageComposer(GrowthPage page, FrameWriter& writer);
  ~PageComposer();
  PageComposer(const PageComposer&) = delete;
  PageComposer& operator=(const PageComposer&) = delete;

  // Waits while the composer is behind. Throws what stopped it.
  void Add(cv::Mat view, MapSnapshotPtr map, int number);

  // Waits until all pages are with the writer. Throws what stopped it.
  void Finish();

 private:
  struct Job {
    cv::Mat view;
    MapSnapshotPtr map;
    int number;
  };

  void Work();

  static constexpr std::size_t kQueue = 3;  // views that wait

  GrowthPage page_;
  FrameWriter& writer_;
  BoundedQueue<Job> queue_{kQueue};
  std::exception_ptr failure_;  // written by the thread, read after it was joined
  std::thread thread_;
};

}  // namespace sqslam
