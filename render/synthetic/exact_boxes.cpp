#include "render/synthetic/exact_boxes.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "render/solids/tessellation.h"

namespace sqslam {
namespace {

// Clips to the range of pixel centres, [0, width - 1] x [0, height - 1].
Box2d ClippedBox(double left, double top, double right, double bottom, const Camera& camera) {
  left = std::clamp(left, 0.0, camera.width - 1.0);
  right = std::clamp(right, 0.0, camera.width - 1.0);
  top = std::clamp(top, 0.0, camera.height - 1.0);
  bottom = std::clamp(bottom, 0.0, camera.height - 1.0);
  return {left, top, right - left, bottom - top};
}

// Returns the area of an object's whole silhouette in square pixels; 0 if a part of it is behind the camera.
// Superquadrics with exponents up to 2 are convex, so the silhouette is the convex hull of the projected
// surface, also through a fisheye lens to within what it bends.
double SilhouetteArea(const PosedSuperquadric& superquadric, const Camera& camera,
                      const Rigid3d& T_world_camera) {
  const Rigid3d T_camera_object = T_world_camera.Inverse() * superquadric.T_map_object;
  std::vector<cv::Point2f> pixels;
  for (const Eigen::Vector3f& vertex : Tessellate(superquadric.shape).vertices) {
    const Eigen::Vector3d p_camera = T_camera_object * vertex.cast<double>();
    if (p_camera.z() < 0.01) {
      return 0.0;
    }
    const Eigen::Vector2d pixel = camera.ProjectDistorted(p_camera);
    pixels.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
  }
  std::vector<cv::Point2f> hull;
  cv::convexHull(pixels, hull);
  return cv::contourArea(hull);
}

}  // namespace

std::vector<ExactBox> FindExactBoxes(const SceneDescription& scene, const Rigid3d& T_world_camera,
                                     const cv::Mat& ids, int supersampling) {
  constexpr double kMinVisible = 0.3;    // of the object
  constexpr double kMinOfImage = 0.001;  // visible area, relative to the image
  const double s = supersampling;
  std::vector<ExactBox> boxes;
  for (const SceneBody& body : scene.bodies) {
    if (body.id <= 0) {
      continue;
    }
    const cv::Mat mask = ids == body.id;
    const double visible = cv::countNonZero(mask) / (s * s);
    if (visible < kMinOfImage * scene.camera.width * scene.camera.height) {
      continue;
    }
    const double whole = SilhouetteArea(body.superquadric, scene.camera, T_world_camera);
    const double fraction = whole > 0.0 ? std::min(1.0, visible / whole) : 0.0;
    if (fraction < kMinVisible) {
      continue;
    }
    const cv::Rect seen = cv::boundingRect(mask);
    const Box2d box = ClippedBox(seen.x / s - 0.5, seen.y / s - 0.5, seen.br().x / s - 0.5,
                                 seen.br().y / s - 0.5, scene.camera);
    boxes.push_back({{body.label, 1.0, box}, body.id, fraction});
  }
  return boxes;
}

DetectorNoise::DetectorNoise(std::uint64_t seed, std::vector<std::string> labels)
    : random_(seed + 1), labels_(std::move(labels)) {}

std::vector<Detection> DetectorNoise::Apply(const std::vector<ExactBox>& boxes, const Camera& camera) {
  constexpr double kEdgeError = 0.03;
  constexpr double kMissed = 0.1;
  constexpr double kWrongLabel = 0.03;
  std::vector<Detection> detections;
  for (const ExactBox& exact : boxes) {
    // All random numbers are drawn for every box, so that one decision does not affect the next.
    const Box2d& box = exact.detection.box;
    const double left = box.x + random_.gaussian(kEdgeError * box.width);
    const double right = box.x + box.width + random_.gaussian(kEdgeError * box.width);
    const double top = box.y + random_.gaussian(kEdgeError * box.height);
    const double bottom = box.y + box.height + random_.gaussian(kEdgeError * box.height);
    const double score = random_.uniform(0.4, 0.95);
    const bool wrong = random_.uniform(0.0, 1.0) < kWrongLabel;
    const auto other = static_cast<std::size_t>(random_.uniform(0, static_cast<int>(labels_.size())));
    if (random_.uniform(0.0, 1.0) < kMissed) {
      continue;
    }
    detections.push_back(
        {wrong ? labels_[other] : exact.detection.label, score,
         ClippedBox(left, top, std::max(left + 1.0, right), std::max(top + 1.0, bottom), camera)});
  }
  return detections;
}

}  // namespace sqslam
