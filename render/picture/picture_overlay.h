#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <vector>

#include "render/camera/camera_path.h"
#include "render/picture/picture_text.h"
#include "render/scene/clip_plane.h"
#include "render/scene/style.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// A point of the map as it is seen, in pixels (top-left origin); depth <= 0 behind the camera.
struct SeenPoint {
  cv::Point2d pixel;
  double depth = 0.0;
};
SeenPoint Project(const ViewCamera& camera, cv::Size image, const Eigen::Vector3d& p_map);

// Pixels of a picture of this size for one of the style's.
double PictureScale(cv::Size picture);

// Contents of the texts of a picture besides what is in the map.
struct PictureCaptions {
  PictureCaptions(const SceneStyle& style, const MapSnapshot& map, const SceneLayers& layers,
                  const SceneFocus& focus, const LabelColors& label_colors, const ViewCamera& camera);

  LabelColors colors;
  double grid_cell = 1.0;         // of the map's unit
  std::optional<ClipPlane> clip;  // objects that it cuts away are not named
  bool covisibility = false;      // the picture holds such lines
  bool true_path = false;         // and the true path of the camera
  bool panel = false;  // behind the legend also where there is no background: something else lies there
};

// Returns the areas that the legend and the axes cover in a picture of this size.
std::vector<cv::Rect> CaptionAreas(cv::Size picture, const MapSnapshot& map, const PictureCaptions& captions,
                                   const SceneStyle& style, const TextPainter& text);

// Legend, axes and names over a picture of the map (8UC3, or 8UC4 with straight alpha), as the style asks for
// them.
void DrawTexts(cv::Mat& image, const MapSnapshot& map, const ViewCamera& camera,
               const PictureCaptions& captions, const SceneStyle& style, const TextPainter& text);

// A name that is to stand beside what it names, pixels.
struct LabelRequest {
  cv::Rect bounds;     // of what is named, in the picture
  cv::Size size;       // of the text
  double depth = 0.0;  // nearer things get their place first
};

// The place of a text; empty where there was no room. `leader`: so far away that a line should join the two.
struct LabelPlace {
  cv::Rect area;
  bool leader = false;
};

// Places texts above, below or beside their things, or further up, so that no two overlap, none covers
// `taken` and all lie inside the picture. In the order of the requests.
std::vector<LabelPlace> PlaceLabels(std::span<const LabelRequest> requests, cv::Size picture,
                                    std::span<const cv::Rect> taken);

}  // namespace sqslam
