#include "render/video/page_composer.h"

#include <optional>
#include <utility>

namespace sqslam {

PageComposer::PageComposer(GrowthPage page, FrameWriter& writer)
    : page_(std::move(page)), writer_(writer), thread_([this] { Work(); }) {}

PageComposer::~PageComposer() {
  queue_.Close();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void PageComposer::Add(cv::Mat view, MapSnapshotPtr map, int number) {
  if (!queue_.Push({std::move(view), std::move(map), number})) {
    Finish();
  }
}

void PageComposer::Finish() {
  queue_.Close();
  if (thread_.joinable()) {
    thread_.join();
  }
  if (failure_) {
    std::rethrow_exception(failure_);
  }
}

void PageComposer::Work() {
  try {
    while (const std::optional<Job> job = queue_.Pop()) {
      writer_.Add(page_.Compose(job->view, job->map), job->number);
    }
  } catch (...) {
    failure_ = std::current_exception();
    queue_.Close();
  }
}

}  // namespace sqslam
