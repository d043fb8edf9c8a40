#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "render/picture/picture.h"
#include "render/picture/picture_text.h"
#include "render/scene/style.h"
#include "render/solids/scene_order.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/snapshot/snapshot.h"

// Photographs beneath pictures of maps.
namespace sqslam {

// The place of a camera's image in a picture, with its calibration in pixels of the picture.
struct ImagePlacement {
  cv::Rect2d area;  // of the image, pixels of the picture (from pixel edges, not centres)
  Camera camera;    // its pixels start at the top-left corner of the whole picture
};

// Fits an image of the camera into a part of a picture, as large as possible and centred.
ImagePlacement PlaceImage(const Camera& camera, const cv::Rect& part);

// The silhouette of an object in an image, pixels (centres at whole numbers).
struct ObjectOutline {
  const SnapshotObject* object = nullptr;
  std::vector<cv::Point2d> polygon;
  cv::Mat1b hidden;      // pixels of the picture behind other surfaces than those of objects; empty: none
  double visible = 0.0;  // its pixels in the picture that nothing nearer covers
  double inside = 0.0;   // its pixels in the picture
};

// Returns the outlines of the objects that the camera sees, nearest first, with lens distortion. They refer
// to `objects`, which must outlive them.
std::vector<ObjectOutline> OutlinesOf(const std::vector<SnapshotObject>& objects, const Camera& camera,
                                      const Rigid3d& T_map_camera);

// The same for one of many views; `solids` are those of the objects.
std::vector<ObjectOutline> OutlinesOf(const std::vector<SnapshotObject>& objects, const SolidOrder& solids,
                                      const Camera& camera, const Rigid3d& T_map_camera);

// Draws outlines, farthest first: faint and unfilled where something nearer hides them, faint and unfilled
// for uncertain objects. `scale`: pixels per pixel of the style. Sets `visible` and `inside`.
void DrawOutlines(cv::Mat& image, std::vector<ObjectOutline>& outlines, const LabelColors& colors,
                  const OverlayStyle& style, double scale);

// A name on a panel in its class's colour, in black or white, whichever is readable.
cv::Size TagSize(const std::string& label, const TextPainter& text, double size);
void DrawTag(cv::Mat& image, const std::string& label, cv::Point top_left, const Eigen::Vector3d& color,
             const TextPainter& text, double size);

// Draws the map over a photograph: exact outlines of the objects and, if the style asks for them, names and
// map points. `photo` (8UC3) is an image of map.camera at T_map_camera with lens distortion, which is removed
// first. It is centred in a picture of the options' size. A dense cloud among the layers hides what is behind
// its surfaces. Throws InputError if `photo` does not have the camera's image size.
cv::Mat RenderOverPhoto(const MapSnapshot& map, const cv::Mat& photo, const Rigid3d& T_map_camera,
                        const PictureOptions& options);

// Removes the lens distortion, keeping the calibration; pixels that the lens did not show are black.
cv::Mat Undistorted(const cv::Mat& image, const Camera& camera);

// A picture with an undistorted photograph in its middle, as large as possible.
struct PlacedPhoto {
  cv::Mat picture;  // 8UC3
  cv::Rect area;    // of the photograph
};

// Throws InputError if `photo` (8UC3, with lens distortion) does not have the camera's image size.
PlacedPhoto PlacePhoto(const cv::Mat& photo, const Camera& camera, cv::Size picture,
                       const Eigen::Vector3d& background);

// Hides or makes transparent what would cover a photograph beneath the map.
SceneStyle StyleOverPhoto(SceneStyle style);

// Draws the map, as its camera at T_map_camera sees it, over the photograph taken there, framed as `framed`.
// A dense cloud among the layers is not drawn, but hides what is behind its surfaces.
cv::Mat RenderOnPhoto(const MapSnapshot& framed, const MapSnapshot& map, const cv::Mat& photo,
                      const Rigid3d& T_map_camera, PictureOptions options);

}  // namespace sqslam
