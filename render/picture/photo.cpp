#include "render/picture/photo.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "render/picture/cloud_occlusion.h"
#include "render/picture/label_layout.h"
#include "render/picture/picture_overlay.h"
#include "slam/geometry/silhouette.h"
#include "slam/util/error.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kSamples = 4;  // per side of a pixel, for smooth edges of any width

// Coverage of each pixel by an outline's line and by its interior, in a part of the image.
struct Masks {
  cv::Rect area;
  cv::Mat line;
  cv::Mat inside;
};

std::vector<cv::Point> Supersampled(const std::vector<cv::Point2d>& polygon, cv::Point origin) {
  std::vector<cv::Point> points;
  const auto fixed = [](double x) {
    return static_cast<int>(std::lround(((x + 0.5) * kSamples - 0.5) * (1 << kFractionalBits)));
  };
  for (const cv::Point2d& p : polygon) {
    points.emplace_back(fixed(p.x - origin.x), fixed(p.y - origin.y));
  }
  return points;
}

Masks MasksOf(const ObjectOutline& outline, cv::Size image, double width) {
  cv::Point2d low = outline.polygon.front();
  cv::Point2d high = low;
  for (const cv::Point2d& p : outline.polygon) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  Masks masks{PixelsAround(low, high, width + 2.0) & cv::Rect(cv::Point(), image), {}, {}};
  if (masks.area.empty()) {
    return masks;
  }
  const std::vector<std::vector<cv::Point>> polygons = {Supersampled(outline.polygon, masks.area.tl())};
  cv::Mat fine = cv::Mat::zeros(masks.area.size() * kSamples, CV_8UC1);
  cv::fillPoly(fine, polygons, cv::Scalar(255), cv::LINE_8, kFractionalBits);
  cv::resize(fine, masks.inside, masks.area.size(), 0.0, 0.0, cv::INTER_AREA);
  fine.setTo(0);
  cv::polylines(fine, polygons, true, cv::Scalar(255),
                std::max(1, static_cast<int>(std::lround(kSamples * width))), cv::LINE_8, kFractionalBits);
  cv::resize(fine, masks.line, masks.area.size(), 0.0, 0.0, cv::INTER_AREA);
  return masks;
}

// Extends a mask of hidden pixels by a line around it, and by the pixels that the mask leaves out as noise.
cv::Mat Widened(const cv::Mat1b& mask, double width) {
  const int side = 2 * static_cast<int>(std::ceil(width) + 2) + 1;
  cv::Mat wide;
  cv::dilate(mask, wide, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  return wide;
}

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

ImagePlacement PlaceImage(const Camera& camera, const cv::Rect& part) {
  const double scale = std::min(static_cast<double>(part.width) / camera.width,
                                static_cast<double>(part.height) / camera.height);
  ImagePlacement place;
  place.area = {part.x + 0.5 * (part.width - scale * camera.width),
                part.y + 0.5 * (part.height - scale * camera.height), scale * camera.width,
                scale * camera.height};
  place.camera = camera;
  place.camera.width = part.br().x;
  place.camera.height = part.br().y;
  place.camera.fx *= scale;
  place.camera.fy *= scale;
  // Pixel centres are half a pixel from their edges at either scale.
  place.camera.cx = place.area.x + scale * (camera.cx + 0.5) - 0.5;
  place.camera.cy = place.area.y + scale * (camera.cy + 0.5) - 0.5;
  return place;
}

std::vector<ObjectOutline> OutlinesOf(const std::vector<SnapshotObject>& objects, const Camera& camera,
                                      const Rigid3d& T_map_camera) {
  return OutlinesOf(objects, SolidOrder(ToVector(objects, &SnapshotObject::superquadric)), camera,
                    T_map_camera);
}

std::vector<ObjectOutline> OutlinesOf(const std::vector<SnapshotObject>& objects, const SolidOrder& solids,
                                      const Camera& camera, const Rigid3d& T_map_camera) {
  std::vector<std::size_t> order = solids.BackToFront(T_map_camera.translation);
  std::ranges::reverse(order);
  std::vector<ObjectOutline> outlines;
  for (const std::size_t index : order) {
    const SnapshotObject& object = objects[index];
    std::vector<Eigen::Vector2d> silhouette = Silhouette(object.superquadric, camera, T_map_camera);
    if (camera.HasDistortion()) {
      silhouette = DistortedOutline(silhouette, camera);
    }
    if (silhouette.empty()) {
      continue;
    }
    ObjectOutline& outline = outlines.emplace_back();
    outline.object = &object;
    for (const Eigen::Vector2d& p : silhouette) {
      outline.polygon.emplace_back(p.x(), p.y());
    }
  }
  return outlines;
}

void DrawOutlines(cv::Mat& image, std::vector<ObjectOutline>& outlines, const LabelColors& colors,
                  const OverlayStyle& style, double scale) {
  const double width = std::max(1.0, style.width * scale);
  cv::Mat covered = cv::Mat::zeros(image.size(), CV_8UC1);  // by nearer objects
  std::vector<Masks> all;
  for (ObjectOutline& outline : outlines) {
    Masks masks = MasksOf(outline, image.size(), width);
    if (!masks.area.empty()) {
      cv::Mat nearer = covered(masks.area);
      cv::Mat hidden = nearer.clone();  // these parts become faint
      if (!outline.hidden.empty()) {
        const cv::Mat around = Widened(outline.hidden, width)(masks.area);
        cv::max(hidden, around, hidden);
        masks.inside.setTo(0, outline.hidden(masks.area) | (around & (masks.inside < 255)));
      }
      cv::Mat strength;
      const double whole = IsReliable(*outline.object) ? 1.0 : style.hidden;
      hidden.convertTo(strength, CV_32F, (style.hidden - whole) / 255.0, whole);
      cv::Mat line;
      masks.line.convertTo(line, CV_32F);
      cv::multiply(line, strength, line);
      line.convertTo(masks.line, CV_8U);
      const double before = cv::sum(nearer)[0];
      cv::max(nearer, masks.inside, nearer);
      outline.visible = (cv::sum(nearer)[0] - before) / 255.0;
      outline.inside = cv::sum(masks.inside)[0] / 255.0;
    }
    all.push_back(std::move(masks));
  }
  for (std::size_t i = all.size(); i-- > 0;) {
    if (!all[i].area.empty()) {
      const Eigen::Vector3d color = colors(outlines[i].object->label);
      if (IsReliable(*outlines[i].object)) {
        Blend(image, all[i].inside, all[i].area.tl(), color, style.fill);
      }
      Blend(image, all[i].line, all[i].area.tl(), color);
    }
  }
}

cv::Size TagSize(const std::string& label, const TextPainter& text, double size) {
  return {text.Width(ReadableLabel(label), size) + static_cast<int>(0.8 * size),
          static_cast<int>(1.5 * size)};
}

void DrawTag(cv::Mat& image, const std::string& label, cv::Point top_left, const Eigen::Vector3d& color,
             const TextPainter& text, double size) {
  const cv::Rect tag(top_left, TagSize(label, text, size));
  DrawPanel(image, tag, 0.2 * size, color, 0.9);
  const bool light = Lightness(color) > 0.5;
  text.Draw(image, ReadableLabel(label), {tag.x + tag.width / 2, tag.y + tag.height / 2}, size,
            Eigen::Vector3d::Constant(light ? 0.05 : 1.0), TextPainter::Align::kCenter);
}

namespace {

// Draws a coloured tag with the name at the visible part of each object.
void DrawTags(cv::Mat& image, const std::vector<SnapshotObject>& objects, const SeenSolids& seen,
              const Rigid3d& T_map_camera, const LabelColors& colors, const TextPainter& text, double size) {
  std::vector<LabelRequest> requests;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    requests.push_back({seen.parts[i], TagSize(ShownName(objects[i]), text, size),
                        (objects[i].superquadric.T_map_object.translation - T_map_camera.translation).norm(),
                        static_cast<int>(i)});
  }
  const std::vector<LabelPlace> places = PlaceLabels(requests, seen.number, {});
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (places[i].leader) {
      const Eigen::Vector3d color = colors(objects[i].label);
      const double width = 0.14 * size;
      const auto side = static_cast<int>(std::lround(4.0 * width));
      const cv::Point2d end = places[i].anchor;
      DrawLine(image, LeaderStart(places[i]), end, 2.0 * width, Eigen::Vector3d::Ones(), 0.7);
      DrawLine(image, LeaderStart(places[i]), end, width, color);
      DrawPanel(image, {places[i].anchor - cv::Point(side / 2, side / 2), cv::Size(side, side)}, 0.5 * side,
                color);
    }
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (!places[i].area.empty()) {
      DrawTag(image, ShownName(objects[i]), places[i].area.tl(), colors(objects[i].label), text, size);
    }
  }
}

// Returns the depth of the cloud in a view; empty without a cloud.
cv::Mat1f DepthOf(const CloudLayerPtr& cloud, const MapSnapshot& map, const Camera& camera,
                  const Rigid3d& T_map_camera) {
  return cloud ? CloudDepth(*cloud, camera, T_map_camera, map.frame_index) : cv::Mat1f();
}

cv::Mat1b HiddenPixels(const cv::Mat1f& cloud_depth, std::span<const PosedSuperquadric> solids,
                       const Camera& camera, const Rigid3d& T_map_camera) {
  return cloud_depth.empty()
             ? cv::Mat1b()
             : HiddenBehind(cloud_depth, RasterizeSolids(solids, camera, T_map_camera), solids);
}

}  // namespace

cv::Mat RenderOverPhoto(const MapSnapshot& map, const cv::Mat& photo, const Rigid3d& T_map_camera,
                        const PictureOptions& options) {
  CheckStyle(options.style);
  const SceneStyle& style = options.style;
  const auto [picture, area] =
      PlacePhoto(photo, map.camera, {options.width, options.height}, ParseColor(style.background));
  cv::Mat part = picture(area);

  // Outlines are cut off at the edges of the photograph.
  Camera camera = map.camera;
  camera = camera.WithoutDistortion();
  const Camera seen = PlaceImage(camera, {cv::Point(), part.size()}).camera;
  const LabelColors colors = LabelColors(style.objects.colors);
  const double scale = PictureScale({options.width, options.height});
  std::vector<ObjectOutline> outlines = OutlinesOf(map.objects, seen, T_map_camera);
  const cv::Mat1f cloud_depth = DepthOf(options.layers.dense_cloud, map, seen, T_map_camera);
  for (ObjectOutline& outline : outlines) {
    outline.hidden = HiddenPixels(cloud_depth, {&outline.object->superquadric, 1}, seen, T_map_camera);
  }
  if (style.overlay.points) {
    DrawPoints(part, map, seen, T_map_camera, colors, std::max(1.5, style.overlay.point_size * scale));
  }
  DrawOutlines(part, outlines, colors, style.overlay, scale);
  if (style.overlay.labels) {
    const auto solids = ToVector(map.objects, &SnapshotObject::superquadric);
    const SeenSolids parts =
        SeeSolids(ToVector(solids, [](const PosedSuperquadric& solid) { return NamedSolid{solid}; }), false,
                  seen, T_map_camera, HiddenPixels(cloud_depth, solids, seen, T_map_camera));
    DrawTags(part, map.objects, parts, T_map_camera, colors, TextPainter(),
             std::max(9.0, style.text.size * scale));
  }
  return picture;
}

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
  style.dense_cloud.show = style.grid.show = style.text.scale = false;
  style.cameras.trajectory = style.cameras.keyframes = style.cameras.current = false;
  style.objects.look = style.objects.look == ObjectLook::kAuto ? ObjectLook::kGlass : style.objects.look;
  return style;
}

namespace {

// Blends a picture with straight alpha over another, but not where it is `hidden`.
void BlendOver(const cv::Mat& scene, const cv::Mat1b& hidden, cv::Mat& picture) {
  picture.forEach<cv::Vec3b>([&](cv::Vec3b& pixel, const int* at) {
    const auto& over = scene.at<cv::Vec4b>(at);
    const double shown = hidden.empty() ? 1.0 : 1.0 - hidden(at[0], at[1]) / 255.0;
    for (int i = 0; i < 3; ++i) {
      pixel[i] = cv::saturate_cast<std::uint8_t>(pixel[i] + shown * over[3] / 255.0 * (over[i] - pixel[i]));
    }
  });
}

// Returns true if the cloud hides nearly all of the solid that the picture contains.
bool IsHidden(const cv::Mat1f& cloud_depth, const PosedSuperquadric& solid, const Camera& camera,
              const Rigid3d& T_map_camera) {
  constexpr double kMaxVisible = 0.05;  // share of its pixels
  const SolidImage alone = RasterizeSolids({&solid, 1}, camera, T_map_camera);
  const int all = cv::countNonZero(alone.number == 0);
  return all > 0 &&
         cv::countNonZero(HiddenBehind(cloud_depth, alone, {&solid, 1})) > (1.0 - kMaxVisible) * all;
}

}  // namespace

cv::Mat RenderOnPhoto(const MapSnapshot& framed, const MapSnapshot& map, const cv::Mat& photo,
                      const Rigid3d& T_map_camera, PictureOptions options) {
  const cv::Size size(options.width, options.height);
  cv::Mat picture = PlacePhoto(photo, map.camera, size, ParseColor(options.style.background)).picture;
  const Camera seen = PlaceImage(map.camera, {cv::Point(), size}).camera.WithoutDistortion();
  MapSnapshot shown = map;
  cv::Mat1b hidden;
  if (const cv::Mat1f depth = DepthOf(options.layers.dense_cloud, map, seen, T_map_camera); !depth.empty()) {
    std::erase_if(shown.objects, [&](const SnapshotObject& object) {
      return IsHidden(depth, object.superquadric, seen, T_map_camera);
    });
    const auto solids = ToVector(shown.objects, &SnapshotObject::superquadric);
    const SolidImage image = RasterizeSolids(solids, seen, T_map_camera);
    hidden = HiddenBehind(depth, image, solids);
    const double line = options.style.objects.line_width * PictureScale(size);
    cv::max(hidden, Widened(hidden, line) & (image.number < 0), hidden);  // the lines around them too
  }
  const SceneStyle style = StyleOverPhoto(options.style);
  options.transparent = true;
  options.style = style;
  options.style.text.legend = options.style.objects.labels =
      false;  // the texts come last, over the photograph
  PictureRenderer renderer(options);
  renderer.SetMap(framed);
  renderer.SetMapKeepingFrame(shown);
  const ViewCamera view = ThroughCamera(T_map_camera, seen);
  BlendOver(renderer.Render(view), hidden, picture);
  PictureCaptions captions(style, shown, options.layers, renderer.Focus(), renderer.Colors(), view);
  captions.hidden = hidden;
  DrawTexts(picture, shown, view, captions, style, TextPainter());
  return picture;
}

}  // namespace sqslam
