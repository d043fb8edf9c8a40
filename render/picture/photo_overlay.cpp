#include "render/picture/photo_overlay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "render/picture/outlines.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

void DrawPoints(cv::Mat& image, const MapSnapshot& map, const Camera& camera, const Rigid3d& T_map_camera,
                const LabelColors& colors, double size) {
  std::map<int, Eigen::Vector3d> of_object;
  for (const SnapshotObject& object : map.objects) {
    of_object[object.id] = colors(object.label);
  }
  const Rigid3d T_camera_map = T_map_camera.Inverse();
  for (const SnapshotPoint& point : map.points) {
    const Eigen::Vector3d p = T_camera_map * point.p_map.cast<double>();
    if (p.z() <= 0.0) {
      continue;
    }
    const Eigen::Vector2d pixel = camera.Project(p);
    if (pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() > image.cols - 1.0 || pixel.y() > image.rows - 1.0) {
      continue;
    }
    const auto found = of_object.find(point.object_id);
    const bool owned = found != of_object.end();
    const int reach = static_cast<int>(std::ceil(size)) + 1;
    const cv::Point origin(cvRound(pixel.x()) - reach, cvRound(pixel.y()) - reach);
    cv::Mat dot(2 * reach + 1, 2 * reach + 1, CV_8UC1);
    for (int y = 0; y < dot.rows; ++y) {
      for (int x = 0; x < dot.cols; ++x) {
        const double away = std::hypot(origin.x + x - pixel.x(), origin.y + y - pixel.y());
        dot.at<std::uint8_t>(y, x) =
            cv::saturate_cast<std::uint8_t>(255.0 * std::clamp(0.5 * size - away + 0.5, 0.0, 1.0));
      }
    }
    Blend(image, dot, origin, owned ? found->second : Eigen::Vector3d::Constant(0.95), owned ? 0.95 : 0.6);
  }
}

}  // namespace

cv::Mat Undistorted(const cv::Mat& image, const Camera& camera) {
  if (!camera.HasDistortion()) {
    return image;
  }
  cv::Mat from(image.size(), CV_32FC2);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const Eigen::Vector2d pixel = camera.ProjectDistorted(camera.Unproject(Eigen::Vector2d(x, y)));
      from.at<cv::Vec2f>(y, x) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
    }
  }
  cv::Mat straight;
  cv::remap(image, straight, from, cv::noArray(), cv::INTER_LINEAR);
  return straight;
}

cv::Mat RenderOverPhoto(const MapSnapshot& map, const cv::Mat& photo, const Rigid3d& T_map_camera,
                        const PictureOptions& options) {
  CheckStyle(options.style);
  if (photo.cols != map.camera.width || photo.rows != map.camera.height) {
    throw InputError(fmt::format("the image has {}x{} pixels, expected {}x{} as the map's camera", photo.cols,
                                 photo.rows, map.camera.width, map.camera.height));
  }
  const SceneStyle& style = options.style;
  const Eigen::Vector3d paper = 255.0 * ParseColor(style.background);
  cv::Mat picture(options.height, options.width, CV_8UC3, cv::Scalar(paper.z(), paper.y(), paper.x()));
  Camera camera = map.camera;
  camera.distortion = {};
  const ImagePlacement place = PlaceImage(camera, {0, 0, options.width, options.height});
  const cv::Rect area(cv::Point(cvRound(place.area.x), cvRound(place.area.y)),
                      cv::Size(cvRound(place.area.width), cvRound(place.area.height)));
  cv::Mat part = picture(area & cv::Rect(cv::Point(), picture.size()));
  cv::resize(Undistorted(photo, map.camera), part, part.size(), 0.0, 0.0,
             part.cols < photo.cols ? cv::INTER_AREA : cv::INTER_CUBIC);

  // What follows is cut off at the edges of the photograph.
  const Camera seen = PlaceImage(camera, {cv::Point(), part.size()}).camera;
  std::vector<std::string> labels;
  for (const SnapshotObject& object : map.objects) {
    labels.push_back(object.label);
  }
  const LabelColors colors(labels);
  const double scale = std::min(options.height / 720.0, options.width / 960.0);
  std::vector<ObjectOutline> outlines = OutlinesOf(map.objects, seen, T_map_camera);
  if (style.overlay.points) {
    DrawPoints(part, map, seen, T_map_camera, colors, std::max(1.5, style.overlay.point_size * scale));
  }
  DrawOutlines(part, outlines, colors, style.overlay, scale);
  if (style.overlay.labels) {
    DrawOutlineLabels(part, outlines, colors, TextPainter(), std::max(9.0, style.text.size * scale));
  }
  return picture;
}

}  // namespace sqslam
