#include "render/picture/interactive_scene.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "render/gl/offscreen_window.h"
#include "render/picture/picture.h"
#include "render/picture/picture_overlay.h"
#include "render/scene/scene.h"

namespace sqslam {

bool SameView(const ViewCamera& a, const ViewCamera& b) {
  const auto lens = [](const std::optional<Camera>& c) {
    return c ? std::array<double, 6>{double(c->width), double(c->height), c->fx, c->fy, c->cx, c->cy}
             : std::array<double, 6>{};
  };
  return a.position == b.position && a.focal_point == b.focal_point && a.view_up == b.view_up &&
         a.view_angle == b.view_angle && a.projection == b.projection && lens(a.pinhole) == lens(b.pinhole);
}

namespace {

using Detail = InteractiveScene::Detail;

Scene::Quality QualityOf(const SceneStyle& style, Detail detail, cv::Size size, bool transparent) {
  const bool fine = detail == Detail::kFine;
  return {.pixel_scale = PictureScale(size),
          .samples = fine && style.anti_aliasing == AntiAliasing::kSsaa ? 2 : 1,
          .fxaa = fine && !transparent && style.anti_aliasing == AntiAliasing::kFxaa,  // it ignores alpha
          .transparent = transparent,
          .draft = !fine};
}

SceneStyle StyleFor(SceneStyle style, Detail detail) {
  if (detail == Detail::kDraft) {
    style.light.ambient_occlusion = style.light.outline = style.light.eye_dome = 0.0;
    style.dense_cloud.detail *= 2.0;
    style.objects.segments = std::min(style.objects.segments, 32);
  }
  return style;
}

// A scene at one level of detail and one size: line widths grow with the picture.
struct DetailCanvas {
  DetailCanvas(const SceneStyle& style, Detail detail, cv::Size wanted, bool transparent)
      : size(wanted),
        window({.width = size.width,
                .height = size.height,
                .alpha = transparent,
                .backend = RenderBackend::kCurrent}),
        scene(StyleFor(style, detail), QualityOf(style, detail, size, transparent)) {
    window.AddRenderer(scene.Renderer());
  }

  cv::Size size;
  OffscreenWindow window;  // before the scene, whose destructor needs its context
  Scene scene;
  bool map_is_new = true;
  bool layers_are_new = true;
  std::optional<ViewCamera> drawn;  // view of the texture
  unsigned texture = 0;
};

}  // namespace

struct InteractiveScene::Impl {
  std::optional<DetailCanvas>& CanvasOf(Detail detail) { return canvases[detail == Detail::kFine ? 1 : 0]; }
  void ForEachCanvas(const auto& change) {
    for (std::optional<DetailCanvas>& canvas : canvases) {
      if (canvas) {
        change(*canvas);
      }
    }
  }
  void Outdate() {
    ForEachCanvas([](DetailCanvas& canvas) { canvas.map_is_new = true; });
  }

  SceneStyle style;
  SceneLayers layers;
  SceneFocus focus;
  LabelColors colors;
  MapSnapshotPtr map = std::make_shared<const MapSnapshot>();
  TextPainter text;
  bool transparent = false;
  std::array<std::optional<DetailCanvas>, 2> canvases;
};

InteractiveScene::InteractiveScene() : impl_(std::make_unique<Impl>()) {}
InteractiveScene::~InteractiveScene() = default;

void InteractiveScene::SetStyle(const SceneStyle& style) {
  CheckStyle(style);
  impl_->style = style;
  impl_->colors = LabelColors(style.objects.colors);
  for (std::optional<DetailCanvas>& canvas : impl_->canvases) {
    canvas.reset();
  }
}

void InteractiveScene::SetFrame(const MapSnapshot& map) {
  impl_->focus = FindFocus(map);
  impl_->Outdate();
}

void InteractiveScene::Show(MapSnapshotPtr map) {
  impl_->map = map ? std::move(map) : std::make_shared<const MapSnapshot>();
  impl_->Outdate();
}

void InteractiveScene::SetLayers(const SceneLayers& layers) {
  impl_->layers = layers;
  impl_->ForEachCanvas([](DetailCanvas& canvas) { canvas.layers_are_new = true; });
}

void InteractiveScene::SetClip(const SceneStyle::Clip& clip) {
  if (impl_->style.clip == clip) {
    return;
  }
  impl_->style.clip = clip;
  impl_->ForEachCanvas([&](DetailCanvas& canvas) {
    canvas.scene.SetClip(clip);
    canvas.drawn.reset();
  });
}

void InteractiveScene::SetTransparent(bool transparent) {
  if (std::exchange(impl_->transparent, transparent) != transparent) {
    for (std::optional<DetailCanvas>& canvas : impl_->canvases) {
      canvas.reset();
    }
  }
}

unsigned InteractiveScene::Draw(const ViewCamera& camera, cv::Size size, Detail detail) {
  if (size.width < 1 || size.height < 1 || size.width > kMaxPictureSide || size.height > kMaxPictureSide) {
    return 0;
  }
  Impl& s = *impl_;
  std::optional<DetailCanvas>& canvas = s.CanvasOf(detail);
  if (!canvas || canvas->size != size) {
    canvas.reset();
    canvas.emplace(s.style, detail, size, s.transparent);
  }
  if (std::exchange(canvas->layers_are_new, false)) {
    canvas->scene.SetLayers(s.layers);
    canvas->map_is_new = true;  // its colours depend on the truth
  }
  if (std::exchange(canvas->map_is_new, false)) {
    canvas->scene.Show(*s.map, s.focus, s.colors);
    canvas->drawn.reset();
  }
  if (!canvas->drawn || !SameView(*canvas->drawn, camera)) {
    canvas->scene.LookFrom(camera, size);
    canvas->texture = canvas->window.Draw();
    canvas->drawn = camera;
  }
  return canvas->texture;
}

cv::Mat InteractiveScene::Texts(const ViewCamera& camera, cv::Size size) const {
  cv::Mat image(size, CV_8UC4, cv::Scalar::all(0));
  const Impl& s = *impl_;
  PictureCaptions captions(s.style, *s.map, s.layers, s.focus, s.colors, camera);
  captions.panel = true;
  DrawTexts(image, *s.map, camera, captions, s.style, s.text);
  return image;
}

}  // namespace sqslam
