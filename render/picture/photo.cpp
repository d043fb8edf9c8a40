#include "render/picture/photo.h"

#include <opencv2/imgproc.hpp>

#include "render/picture/outlines.h"
#include "slam/util/throw_if.h"

namespace sqslam {

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

PlacedPhoto PlacePhoto(const cv::Mat& photo, const Camera& camera, cv::Size picture,
                       const Eigen::Vector3d& background) {
  ThrowIf<InputError>(photo.cols != camera.width || photo.rows != camera.height,
                      "the image has {}x{} pixels, expected {}x{} as the map's camera", photo.cols,
                      photo.rows, camera.width, camera.height);
  const cv::Rect2d place = PlaceImage(camera, {cv::Point(), picture}).area;
  PlacedPhoto placed{cv::Mat(picture, CV_8UC3, ToBgr(background)),
                     cv::Rect(cv::Point(cvRound(place.x), cvRound(place.y)),
                              cv::Size(cvRound(place.width), cvRound(place.height))) &
                         cv::Rect(cv::Point(), picture)};
  cv::Mat part = placed.picture(placed.area);
  cv::resize(Undistorted(photo, camera), part, part.size(), 0.0, 0.0,
             part.cols < photo.cols ? cv::INTER_AREA : cv::INTER_CUBIC);
  return placed;
}

SceneStyle StyleOverPhoto(SceneStyle style) {
  style.dense_cloud.show = false;
  style.cameras.trajectory = style.cameras.keyframes = style.cameras.current = false;
  style.objects.look = style.objects.look == ObjectLook::kAuto ? ObjectLook::kGlass : style.objects.look;
  return style;
}

cv::Mat RenderOnPhoto(const MapSnapshot& framed, const MapSnapshot& map, const cv::Mat& photo,
                      const Rigid3d& T_map_camera, PictureOptions options) {
  const cv::Size size(options.width, options.height);
  cv::Mat picture = PlacePhoto(photo, map.camera, size, ParseColor(options.style.background)).picture;
  options.transparent = true;
  options.style = StyleOverPhoto(options.style);
  PictureRenderer renderer(options);
  renderer.SetMap(framed);
  renderer.SetMapKeepingFrame(map);
  const cv::Mat scene =
      renderer.Render(ThroughCamera(T_map_camera, PlaceImage(map.camera, {cv::Point(), size}).camera));
  picture.forEach<cv::Vec3b>([&scene](cv::Vec3b& pixel, const int* at) {
    const auto& over = scene.at<cv::Vec4b>(at);
    for (int i = 0; i < 3; ++i) {
      pixel[i] = cv::saturate_cast<std::uint8_t>(pixel[i] + over[3] / 255.0 * (over[i] - pixel[i]));
    }
  });
  return picture;
}

}  // namespace sqslam
