#pragma once

#include <Eigen/Core>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sqslam {

// How a map is drawn. Colours are "#rrggbb"; sizes and widths are pixels of a picture 720 pixels high and
// grow with it; lengths are relative to what the picture frames.
struct SceneStyle {
  struct Objects {
    bool show = true;
    double opacity = 0.85;  // of the surfaces, 1 draws them solid
    bool labels = false;    // names beside the objects
    double gloss = 0.15;    // strength of the highlight, in [0, 1]
    int segments = 64;      // steps of longitude of a superquadric, a multiple of 4
    template <typename Visitor>
    void VisitFields(Visitor&& visit) {
      visit("show", show);
      visit("opacity", opacity, 0.0, 1.0);
      visit("labels", labels);
      visit("gloss", gloss, 0.0, 1.0);
      visit("segments", segments, 8, 512);
    }
  };
  struct Points {
    bool show = true;
    double size = 2.2;           // diameter, pixels
    double object_size = 3.4;    // diameter of points that belong to objects, pixels
    double min_contrast = 0.28;  // least difference in lightness to the background, in [0, 1]
    template <typename Visitor>
    void VisitFields(Visitor&& visit) {
      visit("show", show);
      visit("size", size, 0.5, 50.0);
      visit("object_size", object_size, 0.5, 50.0);
      visit("min_contrast", min_contrast, 0.0, 1.0);
    }
  };
  struct Cameras {
    bool trajectory = true;         // line through the keyframes
    bool keyframes = true;          // their frusta
    bool current = true;            // the camera of the snapshot
    std::string color = "#5b6b7a";  // of trajectory and keyframes
    std::string current_color = "#d1495b";
    double width = 1.6;           // of the trajectory, pixels
    double keyframe_width = 1.0;  // of the frusta, pixels
    double size = 0.035;          // half the height of a frustum, of the radius that the picture frames
    template <typename Visitor>
    void VisitFields(Visitor&& visit) {
      visit("trajectory", trajectory);
      visit("keyframes", keyframes);
      visit("current", current);
      visit("color", color);
      visit("current_color", current_color);
      visit("width", width, 0.1, 50.0);
      visit("keyframe_width", keyframe_width, 0.1, 50.0);
      visit("size", size, 0.001, 1.0);
    }
  };
  struct Grid {
    bool show = true;
    std::string color = "#b4b9bf";
    double width = 1.0;    // pixels
    double opacity = 0.8;  // at its centre; it fades outwards
    double radius = 2.0;   // of the radius that the picture frames
    template <typename Visitor>
    void VisitFields(Visitor&& visit) {
      visit("show", show);
      visit("color", color);
      visit("width", width, 0.1, 50.0);
      visit("opacity", opacity, 0.0, 1.0);
      visit("radius", radius, 0.1, 20.0);
    }
  };
  struct Text {
    bool legend = true;  // classes, colours and counts
    bool scale = true;   // axes and what a cell of the grid measures
    double size = 15.0;  // height of the letters, pixels
    std::string color = "#222222";
    template <typename Visitor>
    void VisitFields(Visitor&& visit) {
      visit("legend", legend);
      visit("scale", scale);
      visit("size", size, 4.0, 200.0);
      visit("color", color);
    }
  };

  std::string background = "#ffffff";
  std::string anti_aliasing = "ssaa";  // ssaa: four samples a pixel; fxaa: smoothed edges, faster; none
  Objects objects;
  Points points;
  Cameras cameras;
  Grid grid;
  Text text;

  template <typename Visitor>
  void VisitFields(Visitor&& visit) {
    visit("background", background);
    visit("anti_aliasing", anti_aliasing, {"ssaa", "fxaa", "none"});
    visit("objects", objects);
    visit("points", points);
    visit("cameras", cameras);
    visit("grid", grid);
    visit("text", text);
  }
};

// A style by name (configs/styles/NAME.yaml) or from a file that ends in .yaml. Throws UsageError that names
// the styles there are, or file and line of what is wrong.
SceneStyle LoadStyle(const std::string& name_or_file);

// Throws UsageError on values out of range and colours that are none.
void CheckStyle(const SceneStyle& style);

// "#rrggbb" to red, green, blue in [0, 1]. Throws UsageError on anything else.
Eigen::Vector3d ParseColor(std::string_view text);

// Colours of classes that people with any colour vision tell apart (Okabe and Ito), at further lightness
// levels where there are more classes than colours. A label keeps its colour from map to map unless two
// labels of one map want the same.
class LabelColors {
 public:
  LabelColors() = default;
  explicit LabelColors(std::span<const std::string> labels);

  Eigen::Vector3d operator()(const std::string& label) const;  // red, green, blue in [0, 1]

 private:
  std::map<std::string, int> slots_;
};

}  // namespace sqslam
