#pragma once

#include <string>

namespace sqslam {

// Boxes that are found while the images are mapped.
struct DetectionOptions {
  // Name of a file in configs/detectors or a YAML file; auto: the boxes of the sequence, and where there are
  // none the first network whose weights are there; none.
  std::string network = "auto";
  // Frames from one that the network sees to the next. 0: as soon as it is free; in deterministic runs, where
  // frames wait for their boxes, every third.
  int interval = 0;
  bool follow = true;  // carry boxes through the frames between by the corners in them

  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("network", network);
    visit("interval", interval, 0, 90);  // farther, nothing is carried
    visit("follow", follow);
  }
};

}  // namespace sqslam
