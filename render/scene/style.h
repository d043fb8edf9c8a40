#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/scene/cloud_layer.h"
#include "render/surface/surface_mesh.h"

namespace sqslam {

// Style of a map over a photograph. Widths and sizes are pixels of a picture 720 pixels high.
struct OverlayStyle {
  double width = 2.6;     // of the outlines, pixels
  double fill = 0.14;     // opacity of the surfaces, 0: outlines only
  double hidden = 0.35;   // opacity of outlines behind nearer objects
  bool labels = true;     // names beside the outlines
  bool points = false;    // map points
  double point_size = 3;  // diameter, pixels
  bool operator==(const OverlayStyle&) const = default;
  void VisitFields(auto&& visit) {
    visit("width", width, 0.5, 50.0);
    visit("fill", fill, 0.0, 1.0);
    visit("hidden", hidden, 0.0, 1.0);
    visit("labels", labels);
    visit("points", points);
    visit("point_size", point_size, 0.5, 50.0);
  }
};

// Four samples a pixel; edges that are smoothed afterwards, which is faster; none.
enum class AntiAliasing { kSsaa, kFxaa, kNone };
constexpr auto EnumNames(AntiAliasing) { return std::array{"ssaa", "fxaa", "none"}; }

// Drawing of objects that are more likely wrong than right (IsReliable): as thin lines, like the others,
// or not at all.
enum class UncertainObjects { kOutline, kSolid, kHide };
constexpr auto EnumNames(UncertainObjects) { return std::array{"outline", "solid", "hide"}; }

// Surfaces with light on them, panes that show what is in them, or lines alone; auto: glass where there is a
// dense cloud to be seen, solid elsewhere.
enum class ObjectLook { kAuto, kSolid, kGlass, kOutline };
constexpr auto EnumNames(ObjectLook) { return std::array{"auto", "solid", "glass", "outline"}; }

// The form that a densified map is drawn in: the points of its depth maps, or the surface fused from them.
enum class DenseLook { kPoints, kMesh };
constexpr auto EnumNames(DenseLook) { return std::array{"points", "mesh"}; }

// Along the map's axes, or towards the camera.
enum class ClipAxis { kNone, kX, kY, kZ, kView };
constexpr auto EnumNames(ClipAxis) { return std::array{"none", "x", "y", "z", "view"}; }

// Style of a map. Colours are "#rrggbb"; sizes and widths are pixels of a picture 720 pixels high and
// grow with it; lengths are relative to what the picture frames.
struct SceneStyle {
  struct Objects {
    bool show = true;
    ObjectLook look = ObjectLook::kAuto;
    double opacity = 0.85;    // of solid surfaces, 1 draws them opaque
    double glass = 0.22;      // opacity of surfaces of glass
    double line = 0.9;        // opacity of the lines of glass and outlines
    double line_width = 3.0;  // pixels
    bool labels = false;      // names beside the objects
    double roughness = 0.5;   // of the surfaces: 0 a mirror, 1 chalk
    double metallic = 0.0;    // 0 paint, 1 metal
    UncertainObjects uncertain = UncertainObjects::kOutline;
    int segments = 128;  // at most so many steps of longitude for a superquadric; small ones get fewer
    bool operator==(const Objects&) const = default;
    void VisitFields(auto&& visit) {
      visit("show", show);
      visit("look", look);
      visit("opacity", opacity, 0.0, 1.0);
      visit("glass", glass, 0.0, 1.0);
      visit("line", line, 0.0, 1.0);
      visit("line_width", line_width, 0.1, 50.0);
      visit("labels", labels);
      visit("roughness", roughness, 0.0, 1.0);
      visit("metallic", metallic, 0.0, 1.0);
      visit("uncertain", uncertain);
      visit("segments", segments, 16, 512);
    }
  };
  struct Points {
    bool show = true;
    double size = 2.2;           // diameter, pixels
    double object_size = 3.4;    // diameter of points that belong to objects, pixels
    double min_contrast = 0.28;  // least difference in lightness to the background, in [0, 1]
    bool operator==(const Points&) const = default;
    void VisitFields(auto&& visit) {
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
    bool operator==(const Cameras&) const = default;
    void VisitFields(auto&& visit) {
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
  // Lines between keyframes that see the same map points.
  struct Covisibility {
    bool show = false;
    int min_points = 100;  // that two keyframes must share for a line
    std::string color = "#2a8f6d";
    double width = 1.0;    // pixels
    double opacity = 0.5;  // 0 to 1
    bool operator==(const Covisibility&) const = default;
    void VisitFields(auto&& visit) {
      visit("show", show);
      visit("min_points", min_points, 1, 100000);
      visit("color", color);
      visit("width", width, 0.1, 50.0);
      visit("opacity", opacity, 0.0, 1.0);
    }
  };
  // The true path of the camera, where a picture is given one.
  struct GroundTruth {
    bool show = true;
    std::string color = "#c2185b";
    double width = 2.0;  // pixels
    bool operator==(const GroundTruth&) const = default;
    void VisitFields(auto&& visit) {
      visit("show", show);
      visit("color", color);
      visit("width", width, 0.1, 50.0);
    }
  };
  // The dense cloud of points of a densified map, or one that a picture is given.
  struct DenseCloud {
    bool show = true;
    DenseLook look = DenseLook::kPoints;
    bool points = false;            // the map's points beside it
    double size = 1.5;              // diameter of its points over the distance between them
    double detail = 2.0;            // least distance between points of the finished picture, its own pixels
    std::string color = "#8a929b";  // of a cloud without colours of its own
    bool operator==(const DenseCloud&) const = default;
    void VisitFields(auto&& visit) {
      visit("show", show);
      visit("look", look);
      visit("points", points);
      visit("size", size, 0.1, 20.0);
      visit("detail", detail, 0.1, 100.0);
      visit("color", color);
    }
  };
  // A plane that cuts away one side of points, dense cloud and objects: what is above it along the axis.
  struct Clip {
    ClipAxis axis = ClipAxis::kNone;
    double offset = 0.0;  // of the plane from the middle of what the picture frames, of its radius
    bool flip = false;    // the other side goes
    bool operator==(const Clip&) const = default;
    void VisitFields(auto&& visit) {
      visit("axis", axis);
      visit("offset", offset, -10.0, 10.0);
      visit("flip", flip);
    }
  };
  struct Grid {
    bool show = true;
    std::string color = "#b4b9bf";
    double width = 1.0;    // pixels
    double opacity = 0.8;  // at its centre; it fades outwards
    double radius = 2.0;   // of the radius that the picture frames
    bool operator==(const Grid&) const = default;
    void VisitFields(auto&& visit) {
      visit("show", show);
      visit("color", color);
      visit("width", width, 0.1, 50.0);
      visit("opacity", opacity, 0.0, 1.0);
      visit("radius", radius, 0.1, 20.0);
    }
  };
  struct Light {
    double shadow = 0.32;            // darkness of the solids' shadow on the ground, 0: none
    double ambient_occlusion = 0.7;  // how dark corners and gaps are, 0: not at all
    double occlusion_radius = 0.12;  // its reach, of the radius that the picture frames
    double outline = 0.35;           // strength of the line around each solid, 0: none
    double outline_width = 1.2;      // pixels
    std::string outline_color = "#101418";
    double eye_dome = 0.5;  // how much points stand out against points behind them, 0: not at all
    bool operator==(const Light&) const = default;
    void VisitFields(auto&& visit) {
      visit("shadow", shadow, 0.0, 1.0);
      visit("ambient_occlusion", ambient_occlusion, 0.0, 1.0);
      visit("occlusion_radius", occlusion_radius, 0.001, 2.0);
      visit("outline", outline, 0.0, 1.0);
      visit("outline_width", outline_width, 0.1, 50.0);
      visit("outline_color", outline_color);
      visit("eye_dome", eye_dome, 0.0, 1.0);
    }
  };
  struct Lens {
    double aperture = 0.0;  // radius, of the distance to the focal point; 0: everything is sharp
    int samples = 32;       // pictures that are averaged for one with depth of field
    bool operator==(const Lens&) const = default;
    void VisitFields(auto&& visit) {
      visit("aperture", aperture, 0.0, 0.5);
      visit("samples", samples, 2, 1024);
    }
  };
  struct Text {
    bool legend = true;  // classes, colours and counts
    bool scale = true;   // axes and what a cell of the grid measures
    double size = 15.0;  // height of the letters, pixels
    std::string color = "#222222";
    bool operator==(const Text&) const = default;
    void VisitFields(auto&& visit) {
      visit("legend", legend);
      visit("scale", scale);
      visit("size", size, 4.0, 200.0);
      visit("color", color);
    }
  };

  std::string background = "#ffffff";
  AntiAliasing anti_aliasing = AntiAliasing::kSsaa;
  AntiAliasing video_anti_aliasing = AntiAliasing::kFxaa;  // of videos, where the coding hides the difference
  Objects objects;
  Points points;
  Cameras cameras;
  Covisibility covisibility;
  GroundTruth ground_truth;
  DenseCloud dense_cloud;
  Clip clip;
  Grid grid;
  Light light;
  Lens lens;
  Text text;
  OverlayStyle overlay;  // of maps over photographs
  bool operator==(const SceneStyle&) const = default;

  void VisitFields(auto&& visit) {
    visit("background", background);
    visit("anti_aliasing", anti_aliasing);
    visit("video_anti_aliasing", video_anti_aliasing);
    visit("objects", objects);
    visit("points", points);
    visit("cameras", cameras);
    visit("covisibility", covisibility);
    visit("ground_truth", ground_truth);
    visit("dense_cloud", dense_cloud);
    visit("clip", clip);
    visit("grid", grid);
    visit("light", light);
    visit("lens", lens);
    visit("text", text);
    visit("overlay", overlay);
  }
};

// Drawn with a map without being part of it, in its frame. A value; cloud and mesh are shared.
struct SceneLayers {
  std::vector<std::vector<Eigen::Vector3d>> true_path;  // of the camera, in pieces
  CloudLayerPtr dense_cloud;                            // or null
  SurfaceMeshPtr dense_mesh;  // or null; in place of the cloud where the style wants it

  bool operator==(const SceneLayers&) const = default;
};

// A style by name (configs/styles/NAME.yaml) or from a file that ends in .yaml. Throws UsageError that names
// the styles there are, or file and line of what is wrong.
SceneStyle LoadStyle(const std::string& name_or_file);

// Throws UsageError on values out of range and colours that are none.
void CheckStyle(const SceneStyle& style);

// "#rrggbb" to red, green, blue in [0, 1] and back. Parsing throws UsageError on anything else.
Eigen::Vector3d ParseColor(std::string_view text);
std::string FormatColor(const Eigen::Vector3d& color);

// Relative luminance of a colour, [0, 1].
inline double Lightness(const Eigen::Vector3d& color) {
  return color.dot(Eigen::Vector3d(0.2126, 0.7152, 0.0722));
}

// The colour made darker on a light background, lighter on a dark one, until their lightness differs by so
// much.
Eigen::Vector3d ReadableOn(const Eigen::Vector3d& background, const Eigen::Vector3d& color,
                           double min_contrast);

// Colours of classes that people with any colour vision tell apart (Okabe and Ito), at further lightness
// levels where there are more classes than colours. A label keeps its colour from map to map unless two
// labels of one map want the same.
class LabelColors {
 public:
  LabelColors() = default;
  // `fixed` goes before the palette: one map's colours for others.
  explicit LabelColors(std::span<const std::string> labels,
                       std::map<std::string, Eigen::Vector3d> fixed = {});

  // The colours of all objects that have a `label`.
  static LabelColors Of(const auto& objects, std::map<std::string, Eigen::Vector3d> fixed = {}) {
    std::vector<std::string> labels;
    for (const auto& object : objects) {
      labels.push_back(object.label);
    }
    return LabelColors(labels, std::move(fixed));
  }

  Eigen::Vector3d operator()(const std::string& label) const;  // red, green, blue in [0, 1]

 private:
  std::map<std::string, int> slots_;
  std::map<std::string, Eigen::Vector3d> fixed_;
};

}  // namespace sqslam
