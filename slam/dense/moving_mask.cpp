#include "slam/dense/moving_mask.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "slam/io/detections.h"
#include "slam/io/image_files.h"
#include "slam/io/video_index.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// Boxes refer to the images in the files, which may be larger than the frames were.
cv::Size FileSize(const Sequence& sequence) {
  if (!sequence.video_path.empty()) {
    const VideoIndex video = IndexVideo(sequence.video_path);
    return video.quarter_turns % 2 == 0 ? cv::Size(video.width, video.height)
                                        : cv::Size(video.height, video.width);
  }
  const cv::Mat first = ReadImageInSize(sequence.frames.front().image_path.string(), {});
  return first.empty() ? cv::Size(sequence.camera.width, sequence.camera.height) : first.size();
}

}  // namespace

MovingMask::MovingMask(const fs::path& result, const Sequence& sequence,
                       const std::vector<std::string>& labels) {
  const fs::path found = result / "boxes.txt";
  const fs::path given = sequence.path / "boxes.txt";
  const fs::path file = fs::exists(found) ? found : given;
  if (labels.empty() || !fs::exists(file)) {
    return;
  }
  Camera camera = sequence.camera;
  const cv::Size size = FileSize(sequence);
  camera.width = size.width;
  camera.height = size.height;
  const CheckedDetections detections =
      CheckDetections(file, camera, Timestamps(sequence), ImageNames(sequence));
  for (std::size_t i = 0; i < detections.frames.size(); ++i) {
    for (const Detection& detection : detections.frames[i]) {
      if (std::ranges::find(labels, detection.label) != labels.end()) {
        const Box2d& box = detection.box;
        boxes_[static_cast<std::int64_t>(i)].push_back(
            {box.x / size.width, box.y / size.height, box.width / size.width, box.height / size.height});
      }
    }
  }
}

void MovingMask::Apply(DepthMap& map) const {
  const auto boxes = boxes_.find(map.frame_index);
  if (boxes == boxes_.end()) {
    return;
  }
  for (const Box2d& box : boxes->second) {
    const cv::Point first(static_cast<int>(std::floor(box.x * map.depth.cols)),
                          static_cast<int>(std::floor(box.y * map.depth.rows)));
    const cv::Point end(static_cast<int>(std::ceil((box.x + box.width) * map.depth.cols)),
                        static_cast<int>(std::ceil((box.y + box.height) * map.depth.rows)));
    map.depth(cv::Rect(first, end) & cv::Rect({0, 0}, map.depth.size())).setTo(0.0F);
  }
}

}  // namespace sqslam
