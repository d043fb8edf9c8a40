#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// What the program keeps from one start to the next: settings, recent files, the size of the window and of
// its parts.
class KeptSettings {
 public:
  // `keep`: read them, and write them in the end; otherwise the defaults, and no trace (scripts).
  explicit KeptSettings(bool keep);

  cv::Size WindowSize() const;  // pixels at scale 1
  double TextScale() const;     // height of the letters over the usual one

  void Give(ViewerState& state) const;             // before the first frame; says what could not be read
  void Take(ViewerState& state, cv::Size window);  // after the last; `window` at scale 1

 private:
  bool keep_;
  ViewerSettings settings_;
  ViewerMemory memory_;
  std::vector<std::string> warnings_;
};

}  // namespace sqslam::viewer
