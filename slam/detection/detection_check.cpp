#include "slam/detection/detection_check.h"

#include <algorithm>
#include <set>

#include "slam/io/coco.h"
#include "slam/io/text_lines.h"

namespace sqslam {

DetectionReport CheckDetections(const std::filesystem::path& path, const Camera& camera,
                                const std::vector<double>& frame_timestamps) {
  constexpr const char* kExpected = "'timestamp label score x y w h [object_id [visible_fraction]]'";
  constexpr double kSlack = 2.0;  // pixels out of the image that pass for rounding
  double tolerance = 1e-4;        // as ReadDetections: a tenth of a frame
  if (frame_timestamps.size() > 1) {
    tolerance = std::max(tolerance, 0.1 * (frame_timestamps.back() - frame_timestamps.front()) /
                                        static_cast<double>(frame_timestamps.size() - 1));
  }
  DetectionReport report;
  std::set<std::size_t> with_boxes;
  for (const TextLine& line : ReadTextLines(path, "a boxes.txt")) {
    if (line.words.size() < 7 || line.words.size() > 9) {
      ThrowBadLine(path, line, kExpected);
    }
    const double time = NumberAt(path, line, 0, kExpected);
    const double x = NumberAt(path, line, 3, kExpected);
    const double y = NumberAt(path, line, 4, kExpected);
    const double width = NumberAt(path, line, 5, kExpected);
    const double height = NumberAt(path, line, 6, kExpected);
    ++report.boxes;
    ++report.labels[line.words[1]];
    if (!IsKnownLabel(line.words[1])) {
      ++report.unknown_labels[line.words[1]];
    }
    if (x < -kSlack || y < -kSlack || x + width > camera.width + kSlack ||
        y + height > camera.height + kSlack || width <= 0.0 || height <= 0.0) {
      report.outside.push_back(line.number);
    }
    const auto frame = std::lower_bound(frame_timestamps.begin(), frame_timestamps.end(), time - tolerance);
    if (frame == frame_timestamps.end() || *frame > time + tolerance) {
      report.no_frame.push_back(line.number);
    } else {
      with_boxes.insert(static_cast<std::size_t>(frame - frame_timestamps.begin()));
    }
  }
  report.frames_with_boxes = static_cast<int>(with_boxes.size());
  for (std::size_t i = 0; i < frame_timestamps.size(); ++i) {
    if (!with_boxes.contains(i)) {
      report.frames_without.push_back(frame_timestamps[i]);
    }
  }
  return report;
}

}  // namespace sqslam
