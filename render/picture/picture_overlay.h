#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "render/camera/camera_path.h"
#include "render/picture/picture_text.h"
#include "render/scene/clip_plane.h"
#include "render/scene/style.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// A projected map point in pixels (top-left origin); depth <= 0: behind the camera.
struct SeenPoint {
  cv::Point2d pixel;
  double depth = 0.0;
};
SeenPoint Project(const ViewCamera& view, cv::Size image, const Eigen::Vector3d& p_map);

// Returns the pixels of a picture of this size per pixel of the style.
double PictureScale(cv::Size picture);

// Contents of a picture's texts that are not in the map.
struct PictureCaptions {
  PictureCaptions(const SceneStyle& style, const MapSnapshot& map, const SceneLayers& layers,
                  const SceneFocus& focus, const LabelColors& label_colors, const ViewCamera& camera);

  LabelColors colors;
  double grid_cell = 1.0;         // map units
  double picture_height = 0.0;    // of an orthographic picture, map units; 0: perspective, without a scale
  std::optional<ClipPlane> clip;  // objects cut away are not named
  bool covisibility = false;      // the picture shows covisibility lines
  bool true_path = false;         // and the camera's true path
  std::shared_ptr<const MapTruth> truth;  // whose errors colour the map; may be null
  bool panel = false;        // behind the legend also without a background, as other content lies below
  bool see_through = false;  // solids hide nothing
  cv::Mat1b hidden;          // pixels whose solids are behind other content; empty: none
};

// Returns the areas that the legend and the axes cover in a picture of this size.
std::vector<cv::Rect> CaptionAreas(cv::Size picture, const MapSnapshot& map, const PictureCaptions& captions,
                                   const SceneStyle& style, const TextPainter& text);

// Draws legend, axes and names, as the style asks for them, over a picture of the map (8UC3, or 8UC4 with
// straight alpha).
void DrawTexts(cv::Mat& image, const MapSnapshot& map, const ViewCamera& camera,
               const PictureCaptions& captions, const SceneStyle& style, const TextPainter& text);

}  // namespace sqslam
