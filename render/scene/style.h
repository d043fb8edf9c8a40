#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "render/scene/class_colors.h"
#include "render/scene/cloud_layer.h"
#include "render/scene/map_truth.h"
#include "render/surface/surface_mesh.h"

namespace sqslam {

// Style of a map over a photograph. Widths and sizes are pixels in a picture 720 pixels high.
struct OverlayStyle {
  double width = 2.6;     // of the outlines, pixels
  double fill = 0.14;     // opacity of the surfaces; 0: outlines only
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

// Four samples per pixel; edges smoothed afterwards, which is faster; none.
enum class AntiAliasing { kSsaa, kFxaa, kNone };
constexpr auto EnumNames(AntiAliasing) { return std::array{"ssaa", "fxaa", "none"}; }

// Look of objects that are more likely wrong than right (IsReliable): as thin lines, like the others, or
// not at all.
enum class UncertainObjects { kOutline, kSolid, kHide };
constexpr auto EnumNames(UncertainObjects) { return std::array{"outline", "solid", "hide"}; }

// Shaded surfaces, transparent surfaces that show their content, or lines only, all of hulls. auto: the parts
// of objects that have any; glass if there is a visible dense cloud or a hull of a hollow class, else solid.
// parts: as auto without a dense cloud (LookOf).
enum class ObjectLook { kAuto, kSolid, kGlass, kOutline, kParts };
constexpr auto EnumNames(ObjectLook) { return std::array{"auto", "solid", "glass", "outline", "parts"}; }

// Look of a densified map: as points of its depth maps, or as the surface fused from them.
enum class DenseLook { kPoints, kMesh };
constexpr auto EnumNames(DenseLook) { return std::array{"points", "mesh"}; }

// Normal of the clip plane: an axis of the map, or towards the camera.
enum class ClipAxis { kNone, kX, kY, kZ, kView };
constexpr auto EnumNames(ClipAxis) { return std::array{"none", "x", "y", "z", "view"}; }

// Style of a map. Colours are "#rrggbb"; sizes and widths are pixels in a picture 720 pixels high and scale
// with it; lengths are relative to the framed scene.
struct SceneStyle {
  struct Objects {
    bool show = true;
    ObjectLook look = ObjectLook::kAuto;
    double opacity = 0.85;    // of solid surfaces; 1: opaque
    double glass = 0.22;      // opacity of glass surfaces
    double line = 0.9;        // opacity of lines with glass and outline
    double line_width = 3.0;  // pixels
    bool labels = false;      // names beside the objects
    double roughness = 0.5;   // 0: mirror, 1: chalk
    double metallic = 0.0;    // 0: paint, 1: metal
    UncertainObjects uncertain = UncertainObjects::kOutline;
    int segments = 128;  // maximum steps of longitude per superquadric; small ones get fewer
    ClassColors colors;  // of classes that shall not have their built-in colour
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
      visit("colors", colors);
    }
  };
  struct Points {
    bool show = true;
    double size = 2.2;           // diameter, pixels
    double object_size = 3.4;    // diameter of points that belong to objects, pixels
    double min_contrast = 0.28;  // minimum difference in lightness to the background, in [0, 1]
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
    std::string color = "#5b6b7a";  // of the trajectory and the keyframes
    std::string current_color = "#d1495b";
    double width = 1.6;           // of the trajectory, pixels
    double keyframe_width = 1.0;  // of the frusta, pixels
    double size = 0.035;          // half the height of a frustum, relative to the framed radius
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
    int min_points = 100;  // minimum number of shared map points for a line
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
  // The camera's true path, if the picture has one.
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
  // The dense cloud of a densified map, or one given for the picture.
  struct DenseCloud {
    bool show = true;
    DenseLook look = DenseLook::kPoints;
    bool points = false;            // also draw the map's points
    double size = 1.5;              // diameter of its points relative to their distance
    double detail = 2.0;            // minimum distance of points in the finished picture, its own pixels
    std::string color = "#8a929b";  // if the cloud has no colours of its own
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
  // A plane that cuts away the part of points, dense cloud and objects above it along the axis.
  struct Clip {
    ClipAxis axis = ClipAxis::kNone;
    double offset = 0.0;  // from the centre of the framed scene, relative to its radius
    bool flip = false;    // cut away the other side
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
    double opacity = 0.8;  // at the centre; fades outwards
    double radius = 2.0;   // relative to the framed radius
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
    double shadow = 0.32;            // darkness of the solids' shadow on the ground; 0: none
    double ambient_occlusion = 0.7;  // darkness of corners and gaps; 0: none
    double occlusion_radius = 0.12;  // its reach, relative to the framed radius
    double outline = 0.35;           // strength of the line around each solid; 0: none
    double outline_width = 1.2;      // pixels
    std::string outline_color = "#101418";
    double eye_dome = 0.5;  // how much points stand out against points behind them; 0: not at all
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
    double aperture = 0.0;  // radius, relative to the distance to the focal point; 0: everything is sharp
    int samples = 32;       // pictures averaged for depth of field
    bool operator==(const Lens&) const = default;
    void VisitFields(auto&& visit) {
      visit("aperture", aperture, 0.0, 0.5);
      visit("samples", samples, 2, 1024);
    }
  };
  struct Text {
    bool legend = true;  // classes, colours and counts
    bool scale = true;   // axes and the cell size of the grid
    double size = 15.0;  // font size, pixels
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
  AntiAliasing video_anti_aliasing = AntiAliasing::kFxaa;  // of videos: compression hides the difference
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
  OverlayStyle overlay;  // for maps over photographs
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

// Content drawn with a map that is not part of it, in the map frame. A value; cloud and mesh are shared.
struct SceneLayers {
  std::vector<std::vector<Eigen::Vector3d>> true_path;  // of the camera, split at gaps
  CloudLayerPtr dense_cloud;                            // may be null
  SurfaceMeshPtr dense_mesh;  // may be null; replaces the cloud if the style asks for it
  std::shared_ptr<const MapTruth> truth = nullptr;  // whose errors colour the map; null: classes do

  bool operator==(const SceneLayers&) const = default;
};

// Returns true if solids hide nothing: glass or outlines, as by default with a dense cloud.
inline bool SolidsAreSeeThrough(const SceneStyle& style, const SceneLayers& layers) {
  const bool dense = style.dense_cloud.show && (layers.dense_cloud || layers.dense_mesh);
  return style.objects.look == ObjectLook::kAuto
             ? dense
             : style.objects.look == ObjectLook::kGlass || style.objects.look == ObjectLook::kOutline;
}

// Loads a style by name (configs/styles/NAME.yaml) or from a .yaml file. Throws UsageError that lists the
// available styles, or names file and line of an error.
SceneStyle LoadStyle(const std::string& name_or_file);

// Applies assignments "a.b=value" of --set. Colours need no quotes: objects.colors.cup=#0072b2. Throws
// UsageError; the style may then be partly changed.
void SetStyle(const std::vector<std::string>& assignments, SceneStyle& style);

// Throws UsageError on values out of range and invalid colours.
void CheckStyle(const SceneStyle& style);

// Convert "#rrggbb" to RGB in [0, 1] and back. Parsing throws UsageError on anything else.
Eigen::Vector3d ParseColor(std::string_view text);
std::string FormatColor(const Eigen::Vector3d& color);

// Returns the relative luminance of a colour, in [0, 1].
inline double Lightness(const Eigen::Vector3d& color) {
  return color.dot(Eigen::Vector3d(0.2126, 0.7152, 0.0722));
}

// Makes a colour darker on a light background, or lighter on a dark one, until the lightness differs by
// `min_contrast`.
Eigen::Vector3d ReadableOn(const Eigen::Vector3d& background, const Eigen::Vector3d& color,
                           double min_contrast);

}  // namespace sqslam
