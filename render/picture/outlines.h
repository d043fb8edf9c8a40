#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "render/picture/picture.h"
#include "render/picture/picture_text.h"
#include "render/scene/style.h"
#include "slam/geometry/camera.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// The place of a camera's image on a picture: its calibration in pixels of the picture.
struct ImagePlacement {
  cv::Rect2d area;  // of the image, pixels of the picture (left and top edges, not centres of pixels)
  Camera camera;    // of a picture whose top-left pixel is that of the whole picture
};

// Fits an image of the camera into a picture (or a part of it), as large as it goes and in the middle.
ImagePlacement PlaceImage(const Camera& camera, const cv::Rect& part);

// The silhouette of an object in an image, pixels (centres at whole numbers).
struct ObjectOutline {
  const SnapshotObject* object = nullptr;
  std::vector<cv::Point2d> polygon;
  double visible = 0.0;  // pixels of it in the picture that no nearer object covers
  double inside = 0.0;   // pixels of it in the picture
};

// Outlines of those objects that the camera sees, nearest first; as its lens shows them. They refer to
// `objects`, which must outlive them.
std::vector<ObjectOutline> OutlinesOf(const std::vector<SnapshotObject>& objects, const Camera& camera,
                                      const Rigid3d& T_map_camera);

// Draws outlines, farther ones first; faint where nearer objects cover them; uncertain objects are faint all
// over, and not filled. `scale`: pixels for one of the style's. Fills in how much of each is seen.
void DrawOutlines(cv::Mat& image, std::vector<ObjectOutline>& outlines, const LabelColors& colors,
                  const OverlayStyle& style, double scale);

// A name on a panel of its class's colour, in whichever of black and white can be read there.
cv::Size TagSize(const std::string& label, const TextPainter& text, double size);
void DrawTag(cv::Mat& image, const std::string& label, cv::Point top_left, const Eigen::Vector3d& color,
             const TextPainter& text, double size);

// The image without the distortion of its lens, in the same calibration; what the lens did not show is black.
cv::Mat Undistorted(const cv::Mat& image, const Camera& camera);

// The map over a photograph of it: exact outlines of the objects, their names and, if the style asks for
// them, map points. `photo` (8UC3) is as recorded by map.camera from T_map_camera, distortion included, which
// is taken off first. The picture has the size of the options, the photograph in its middle. Throws
// InputError where the photograph has not the size of the camera's images.
cv::Mat RenderOverPhoto(const MapSnapshot& map, const cv::Mat& photo, const Rigid3d& T_map_camera,
                        const PictureOptions& options);

}  // namespace sqslam
