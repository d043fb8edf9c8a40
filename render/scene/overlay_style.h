#pragma once

namespace sqslam {

// How a map is drawn over a photograph. Widths and sizes are pixels of a picture 720 pixels high.
struct OverlayStyle {
  double width = 2.6;     // of the outlines, pixels
  double fill = 0.14;     // opacity of the surfaces, 0: outlines only
  double hidden = 0.35;   // opacity of outlines behind nearer objects
  bool labels = true;     // names beside the outlines
  bool points = false;    // map points
  double point_size = 3;  // diameter, pixels
  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("width", width, 0.5, 50.0);
    visit("fill", fill, 0.0, 1.0);
    visit("hidden", hidden, 0.0, 1.0);
    visit("labels", labels);
    visit("points", points);
    visit("point_size", point_size, 0.5, 50.0);
  }
};

}  // namespace sqslam
