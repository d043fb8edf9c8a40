#include "render/picture/picture.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "render/gl/offscreen_window.h"
#include "render/picture/picture_overlay.h"
#include "render/picture/png_density.h"
#include "render/scene/scene.h"
#include "slam/geometry/angles.h"
#include "slam/io/image_files.h"
#include "slam/util/atomic_file.h"
#include "slam/util/limits.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// FXAA does not support alpha, so pictures without a background are supersampled instead. Very large pictures
// are not: four times as many pixels would not fit into memory.
int SamplesOf(const PictureOptions& options) {
  const bool large = static_cast<double>(options.width) * options.height > 16e6;
  const bool smooth = options.style.anti_aliasing == AntiAliasing::kSsaa ||
                      (options.transparent && options.style.anti_aliasing == AntiAliasing::kFxaa);
  return smooth && !large ? 2 : 1;
}

const PictureOptions& Checked(const PictureOptions& options) {
  CheckStyle(options.style);
  CheckCamera(options.camera);
  ThrowIf<UsageError>(options.width < 16 || options.height < 16 || options.width > kMaxPictureSide ||
                          options.height > kMaxPictureSide,
                      "resolution {},{}: expected sides from 16 to {} pixels", options.width, options.height,
                      kMaxPictureSide);
  return options;
}

// Converts premultiplied to straight alpha.
void ToStraightAlpha(cv::Mat& bgra) {
  bgra.forEach<cv::Vec4b>([](cv::Vec4b& pixel, const int*) {
    if (pixel[3] > 0 && pixel[3] < 255) {
      for (int c = 0; c < 3; ++c) {
        pixel[c] = cv::saturate_cast<std::uint8_t>(255.0 * pixel[c] / pixel[3]);
      }
    }
  });
}

// Samples the dense cloud or mesh of the layers evenly.
std::vector<Eigen::Vector3d> SampleOf(const SceneLayers& layers) {
  constexpr std::size_t kMaxFramingPoints = 4000;  // enough to frame a room
  std::vector<Eigen::Vector3d> sample;
  if (layers.dense_cloud) {
    sample = EvenSample(*layers.dense_cloud, kMaxFramingPoints);
  } else if (layers.dense_mesh) {
    const std::vector<Eigen::Vector3f>& vertices = layers.dense_mesh->vertices;
    for (std::size_t i = 0; i < vertices.size(); i += vertices.size() / kMaxFramingPoints + 1) {
      sample.push_back(vertices[i].cast<double>());
    }
  }
  return sample;
}

// A drawn cloud stands for the points, from which it was made.
FramedParts PartsDrawn(const SceneStyle& style, const SceneLayers& layers) {
  const bool dense = style.dense_cloud.show && (layers.dense_cloud || layers.dense_mesh);
  return {.objects = style.objects.show,
          .uncertain_objects = style.objects.uncertain != UncertainObjects::kHide,
          .points = style.points.show || dense,
          .path = style.cameras.trajectory || style.cameras.keyframes};
}

}  // namespace

void IncludeLayers(const SceneLayers& layers, SceneFocus& focus) { IncludeCloud(SampleOf(layers), focus); }

ViewCamera CameraOverrides::ApplyTo(ViewCamera camera) const {
  camera.position = position.value_or(camera.position);
  camera.focal_point = focal_point.value_or(camera.focal_point);
  camera.view_up = view_up.value_or(camera.view_up);
  camera.view_angle = view_angle.value_or(camera.view_angle);
  camera.projection = projection;
  return Zoom(Elevation(Azimuth(camera, azimuth), elevation), zoom);
}

void CheckCamera(const CameraOverrides& camera) {
  for (const auto& [name, vector] :
       {std::pair("position", &camera.position), std::pair("focal point", &camera.focal_point),
        std::pair("view up", &camera.view_up)}) {
    ThrowIf<UsageError>(*vector && !((*vector)->array().abs() <= kMaxMapUnits).all(),
                        "camera {}: expected coordinates from {:g} to {:g}", name, -kMaxMapUnits,
                        kMaxMapUnits);
  }
  ThrowIf<UsageError>(camera.view_up && camera.view_up->norm() < 1e-9,
                      "camera view up: expected a direction, not zero");
  const double angle = camera.view_angle.value_or(30.0);
  ThrowIf<UsageError>(!(angle > 0.0 && angle < 180.0),
                      "camera view angle {}: expected more than 0 and less than 180 degrees", angle);
  ThrowIf<UsageError>(!std::isfinite(camera.azimuth) || !std::isfinite(camera.elevation),
                      "camera azimuth {}, elevation {}: expected degrees", camera.azimuth, camera.elevation);
  ThrowIf<UsageError>(!(camera.zoom >= 0.01 && camera.zoom <= 100.0),
                      "camera zoom {}: expected a factor from 0.01 to 100", camera.zoom);
}

struct PictureRenderer::Impl {
  explicit Impl(const PictureOptions& wanted)
      : options(Checked(wanted)),
        colors(options.style.objects.colors),
        window({.width = options.width,
                .height = options.height,
                .alpha = options.transparent,
                .backend = options.backend}),
        scene(options.style,
              {.pixel_scale = PictureScale({options.width, options.height}),
               .samples = SamplesOf(options),
               .fxaa = !options.transparent && options.style.anti_aliasing == AntiAliasing::kFxaa,
               .transparent = options.transparent}) {
    window.AddRenderer(scene.Renderer());
    scene.SetLayers(options.layers);
  }
  ~Impl() { window.Context().MakeCurrent(); }  // the scene frees its resources in this context

  cv::Mat RenderSharp(const ViewCamera& view) {
    scene.LookFrom(view, {options.width, options.height});
    return window.Render();
  }

  // Renders depth of field: the mean of views from points spread over the lens.
  cv::Mat RenderThroughLens(const ViewCamera& view) {
    const SceneStyle::Lens& lens = options.style.lens;
    const ViewAxes axes = AxesOf(view);
    const double distance = view.Distance();
    const double focal = view.FocalLength(options.height);  // pixels
    const Camera pinhole{
        options.width, options.height, focal, focal, 0.5 * (options.width - 1), 0.5 * (options.height - 1)};
    cv::Mat sum;
    for (int i = 0; i < lens.samples; ++i) {
      const double radius = lens.aperture * distance * std::sqrt((i + 0.5) / lens.samples);
      const double angle = kGoldenAngle * i;
      const Eigen::Vector2d offset = radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));  // right, up
      const Eigen::Vector3d shift = offset.x() * axes.right + offset.y() * axes.up;
      ViewCamera moved = view;
      moved.position += shift;
      moved.focal_point += shift;
      // Shifts the principal point, so that the plane of the focal point stays in place.
      moved.pinhole = pinhole;
      moved.pinhole->cx += focal * offset.x() / distance;
      moved.pinhole->cy -= focal * offset.y() / distance;
      cv::Mat image;
      RenderSharp(moved).convertTo(image, CV_32F, 1.0 / lens.samples);
      sum = sum.empty() ? image : cv::Mat(sum + image);
    }
    sum.convertTo(sum, CV_8U);
    return sum;
  }

  cv::Mat Render(const ViewCamera& view) {
    window.Context().MakeCurrent();
    // Views through an input camera and from infinity stay sharp.
    const bool blurred = options.style.lens.aperture > 0.0 && !view.pinhole && !view.IsOrthographic();
    cv::Mat image = blurred ? RenderThroughLens(view) : RenderSharp(view);
    if (options.transparent) {
      ToStraightAlpha(image);
    }
    const PictureCaptions captions(options.style, map, options.layers, focus, colors, view);
    DrawTexts(image, map, view, captions, options.style, text);
    return image;
  }

  // Returns the parts of the picture that legend and axes cover.
  std::vector<PicturePart> CaptionedParts(const ViewCamera& view) const {
    const cv::Size size(options.width, options.height);
    const PictureCaptions captions(options.style, map, options.layers, focus, colors, view);
    const auto share = [&](const cv::Point& pixel) {
      return Eigen::Vector2d(double(pixel.x) / size.width, double(pixel.y) / size.height);
    };
    return ToVector(CaptionAreas(size, map, captions, options.style, text),
                    [&](const cv::Rect& area) { return PicturePart(share(area.tl()), share(area.br())); });
  }

  PictureOptions options;
  LabelColors colors;
  OffscreenWindow window;  // before the scene, whose destructor needs its context
  Scene scene;
  TextPainter text;
  MapSnapshot map;  // without points, for the overlay
  SceneFocus focus;
  ViewCamera camera;
};

PictureRenderer::PictureRenderer(const PictureOptions& options) : impl_(std::make_unique<Impl>(options)) {}
PictureRenderer::~PictureRenderer() = default;
PictureRenderer::PictureRenderer(PictureRenderer&&) noexcept = default;

void PictureRenderer::SetMap(const MapSnapshot& map) {
  Impl& s = *impl_;
  const SceneStyle& style = s.options.style;
  s.focus = FindFocus(map, PartsDrawn(style, s.options.layers));
  if (style.cameras.current && map.T_map_camera) {
    std::ranges::copy(
        FrustumCorners(*map.T_map_camera, map.camera, CurrentFrustumHeight(s.focus, style.cameras.size)),
        std::back_inserter(s.focus.outline));
  }
  if (style.dense_cloud.show) {
    IncludeLayers(s.options.layers, s.focus);
  }
  if (s.options.camera.projection == Projection::kOrthographic) {
    s.focus.main_direction = MainDirectionOf(map, SampleOf(s.options.layers), s.focus);
  }
  SetMapKeepingFrame(map);
  s.camera = ViewOf(s.options.camera);
}

ViewCamera PictureRenderer::ViewOf(const CameraOverrides& overrides, bool beside_captions) const {
  const SceneFocus& focus = impl_->focus;
  const double aspect = static_cast<double>(impl_->options.width) / impl_->options.height;
  const double angle = overrides.view_angle.value_or(30.0);
  const ViewCamera framed = overrides.view.empty()
                                ? FrameScene(focus, aspect, angle, overrides.projection)
                                : PresetView(overrides.view, focus, aspect, angle, overrides.projection);
  if (overrides.position || overrides.focal_point || focus.outline.empty()) {
    return overrides.ApplyTo(framed);
  }
  CameraOverrides turn = overrides;
  turn.zoom = 1.0;
  const ViewCamera view = turn.ApplyTo(framed);
  const std::vector<PicturePart> written =
      beside_captions ? impl_->CaptionedParts(view) : std::vector<PicturePart>();
  const bool turned = overrides.azimuth != 0.0 || overrides.elevation != 0.0 || overrides.view_up;
  return Zoom(turned || !written.empty() ? FitBeside(view, focus.outline, aspect, written) : framed,
              overrides.zoom);
}

void PictureRenderer::SetLayers(const SceneLayers& layers) {
  impl_->window.Context().MakeCurrent();
  impl_->options.layers = layers;
  impl_->scene.SetLayers(layers);
}

void PictureRenderer::SetMapKeepingFrame(const MapSnapshot& map) {
  Impl& s = *impl_;
  s.window.Context().MakeCurrent();
  s.scene.Show(map, s.focus, s.colors);
  s.map.objects = map.objects;
  s.map.keyframes = map.keyframes;
  s.map.covisibility = map.covisibility;
  s.map.metric = map.metric;
}

ViewCamera PictureRenderer::DefaultCamera() const { return impl_->camera; }
const SceneFocus& PictureRenderer::Focus() const { return impl_->focus; }
const LabelColors& PictureRenderer::Colors() const { return impl_->colors; }
cv::Mat PictureRenderer::Render(const ViewCamera& camera) { return impl_->Render(camera); }

cv::Mat RenderPicture(const MapSnapshot& map, const PictureOptions& options) {
  PictureRenderer renderer(options);
  renderer.SetMap(map);
  return renderer.Render();
}

void WritePicture(const std::filesystem::path& path, const cv::Mat& picture) {
  WriteFileAtomically(path, WithDensity(EncodedImage(".png", picture)));
}

}  // namespace sqslam
