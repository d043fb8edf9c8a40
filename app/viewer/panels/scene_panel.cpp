#include <GL/gl.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "app/viewer/input/input_events.h"
#include "app/viewer/panels/panels.h"
#include "app/viewer/state/pictures.h"
#include "app/viewer/state/scene_view.h"
#include "app/viewer/widgets/widgets.h"
#include "render/picture/interactive_scene.h"
#include "render/picture/photo.h"
#include "render/scene/object_look.h"

namespace sqslam::viewer {
namespace {

// Returns true if OpenGL is rendered in software, as Mesa does without a graphics card.
bool IsSoftware() {
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));  // NOLINT: OpenGL's characters
  const std::string_view renderer = name != nullptr ? name : "";
  return renderer.find("llvmpipe") != renderer.npos || renderer.find("softpipe") != renderer.npos;
}

Eigen::Vector2d ToEigen(ImVec2 v) { return {v.x, v.y}; }

// The map in 3D, with the mouse and the keys that move its camera.
class ScenePanel : public Panel {
 public:
  explicit ScenePanel(ViewerState& s) : Panel(Place::kScene, "Map", s) {}
  bool Busy() const override { return !settled_; }

  void Draw() override {
    const ImVec2 available = ImGui::GetContentRegionAvail();
    origin_ = ImGui::GetCursorScreenPos();
    view_.size = {static_cast<int>(available.x), static_cast<int>(available.y)};
    view_.corner = {static_cast<int>(origin_.x), static_cast<int>(origin_.y)};
    if (view_.size.width < 1 || view_.size.height < 1) {
      return;  // minimised
    }
    Synchronize();
    ImGui::InvisibleButton("scene", available,
                           ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight |
                               ImGuiButtonFlags_MouseButtonMiddle);
    hovered_ = ImGui::IsItemHovered();
    if (document_.Map() != nullptr) {
      if (!AnnotateWithMouse(context_, window_, origin_, hovered_)) {
        HandleMouse();
      }
      HandleKeys();
    }
    DrawScene();
    ImDrawList* list = ImGui::GetWindowDrawList();
    list->PushClipRect(origin_, End(), true);
    DrawSceneMarks(context_, window_, origin_);
    list->PopClipRect();
  }

 private:
  ImVec2 End() const { return origin_ + Vec(view_.size.width, view_.size.height); }

  // Updates a value that is shown; returns true if it differed.
  template <typename Shown, typename Value>
  static bool UpdateShown(Shown& shown, const Value& value) {
    const bool other = !(shown == value);
    if (other) {
      shown = value;
    }
    return other;
  }

  // Updates the scene to the state.
  void Synchronize() {
    const bool live = document_.run.active;
    if (UpdateShown(photo_of_, BackgroundPhoto(view_, document_)) && photo_of_) {
      photo_.Upload(Undistorted(photo_of_->image, photo_of_->map->camera));
    }
    const bool asked = UpdateShown(answers_, selection_.answers);
    SceneStyle style = view_.style;
    style.text.legend = style.text.legend && !answers_;      // it would count the outlines as uncertain
    style.cameras.current = style.cameras.current && !live;  // DrawSceneMarks() draws it then
    if (photo_of_) {
      style = StyleOverPhoto(std::move(style));
    }
    scene_.SetTransparent(photo_of_ != nullptr);
    const bool restyled = UpdateShown(style_, style);
    if (restyled) {
      scene_.SetStyle(style);
    }
    if (UpdateShown(clip_, view_.clip) || restyled) {
      scene_.SetClip(clip_);
      changed_ = true;
    }
    if (UpdateShown(drawn_layers_, layers_.drawn)) {
      scene_.SetLayers(drawn_layers_);
      changed_ = true;
    }
    if (UpdateShown(frame_, document_.frame)) {
      scene_.SetFrame(frame_ ? *frame_ : MapSnapshot());
      changed_ = true;
    }
    // During a run the map is only redrawn if it has changed: the camera moves all the time.
    const MapSnapshotPtr map = document_.shown ? document_.shown->map : nullptr;
    const bool edited = UpdateShown(edits_, context_.editing.applied);
    const bool same_state =
        live && !edited && !asked && map_ && map && map_->sequence_number == map->sequence_number;
    if (!same_state && (UpdateShown(map_, map) || asked)) {
      scene_.Show(map && answers_ ? WithAnswers(*map) : map);
      changed_ = true;
    }
  }

  // Returns the map with all but the answers faded.
  MapSnapshotPtr WithAnswers(const MapSnapshot& map) const {
    std::set<int> chosen;
    for (std::size_t i = 0; i < map.objects.size(); ++i) {
      if (answers_->contains(map.objects[i].id)) {
        chosen.insert(static_cast<int>(i));
      }
    }
    return std::make_shared<MapSnapshot>(Highlighted(map, chosen));
  }

  void HandleMouse() {
    const ImGuiIO& io = ImGui::GetIO();
    const cv::Size window = view_.size;
    const Eigen::Vector2d mouse = ToEigen(io.MousePos) - ToEigen(origin_);
    const Eigen::Vector2d moved = ToEigen(io.MouseDelta);
    if (hovered_ && io.MouseWheel != 0.0F) {
      view_.MoveTo(ZoomTo(view_.camera, std::pow(1.15, io.MouseWheel), mouse, window));
    }
    const auto dragged = [&](ImGuiMouseButton button) {
      return ImGui::IsItemActive() && ImGui::IsMouseDragging(button, 3.0F) && moved.norm() > 0.0;
    };
    if (dragged(ImGuiMouseButton_Middle) || (dragged(ImGuiMouseButton_Left) && io.KeyShift)) {
      view_.MoveTo(Pan(view_.camera, moved, window));
    } else if (dragged(ImGuiMouseButton_Left)) {
      view_.MoveTo(Orbit(view_.camera, moved, window, view_.focus.up));
    } else if (dragged(ImGuiMouseButton_Right)) {
      view_.MoveTo(LookAround(view_.camera, moved, window, view_.focus.up));
    }
    const Ray ray = RayOf(view_.camera, mouse, window);
    if (hovered_ && !ImGui::IsAnyMouseDown()) {
      selection_.pointed = PickObject(ray, document_.Map()->objects, view_.Cut());
    }
    const ImVec2 drag = io.MouseClickedPos[0];
    const bool still = std::hypot(io.MousePos.x - drag.x, io.MousePos.y - drag.y) < 3.0F;
    if (hovered_ && ImGui::IsMouseReleased(ImGuiMouseButton_Left) && still) {
      Click(mouse, ray);
    }
    if (hovered_ && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) {
      LookAt(mouse);
    }
  }

  void Click(const Eigen::Vector2d& mouse, const Ray& ray) {
    if (!selection_.measuring) {
      selection_.selected = PickObject(ray, document_.Map()->objects, view_.Cut());
      return;
    }
    selection_.Measure(PointAt(mouse));
  }

  std::optional<Eigen::Vector3d> PointAt(const Eigen::Vector2d& mouse) const {
    return PickPoint(view_.camera, mouse, view_.size, *document_.Map(), view_.Cut(),
                     layers_.drawn.dense_cloud.get());
  }

  // Centres the view on the point under the mouse.
  void LookAt(const Eigen::Vector2d& mouse) {
    if (const auto point = PointAt(mouse)) {
      ViewCamera camera = view_.camera;
      camera.position += *point - camera.focal_point;
      camera.focal_point = *point;
      camera.pinhole.reset();
      view_.MoveTo(camera);
    }
  }

  void HandleKeys() {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantTextInput || io.KeyCtrl || io.KeyAlt) {
      return;
    }
    const auto axis = [&](int plus, int minus) {
      return (IsKeyDown(plus) ? 1.0 : 0.0) - (IsKeyDown(minus) ? 1.0 : 0.0);
    };
    const Eigen::Vector3d way(axis('D', 'A'), axis('E', 'Q'), axis('W', 'S'));
    if (way.norm() > 0.0) {
      const double speed = (io.KeyShift ? 1.6 : 0.5) * view_.focus.radius;  // map units a second
      view_.MoveTo(Fly(view_.camera, std::min(window_.seconds, 0.1) * speed * way));
    }
  }

  void DrawScene() {
    using Detail = InteractiveScene::Detail;
    const ViewCamera& camera = view_.camera;
    const bool changed = !drawn_ || !SameView(*drawn_, camera) || size_ != view_.size;
    const bool dirty = std::exchange(changed_, false) || changed;
    rest_seconds_ = dirty ? 0.0 : rest_seconds_ + window_.seconds;
    constexpr double kRestSeconds = 0.15;  // seconds after which the fine picture is drawn
    const bool busy = document_.run.active && !document_.run.paused;  // leaves the CPU to the run
    settled_ = !software_ || (rest_seconds_ >= kRestSeconds && !busy);
    drawn_ = camera;
    size_ = view_.size;
    const unsigned texture = scene_.Draw(camera, size_, settled_ ? Detail::kFine : Detail::kDraft);
    ImDrawList* list = ImGui::GetWindowDrawList();
    if (photo_of_) {
      DrawPhoto();
      // The colours of the scene are premultiplied by alpha.
      list->AddCallback(
          [](const ImDrawList*, const ImDrawCmd*) { glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA); }, nullptr);
    }
    list->AddImage(TextureId(texture), origin_, End(), ImVec2(0.0F, 1.0F), ImVec2(1.0F, 0.0F));
    if (photo_of_) {
      list->AddCallback(ImDrawCallback_ResetRenderState, nullptr);
    }
    if (dirty) {
      texts_.Upload(document_.Map() != nullptr ? scene_.Texts(camera, size_) : cv::Mat());
    }
    if (texts_.Id() != nullptr) {
      list->AddImage(texts_.Id(), origin_, End());
    }
  }

  void DrawPhoto() {
    const cv::Rect2d area = PlaceImage(photo_of_->map->camera, {cv::Point(), view_.size}).area;
    ImDrawList* list = ImGui::GetWindowDrawList();
    list->AddRectFilled(origin_, End(), Packed(ParseColor(view_.style.background)));
    list->AddImage(photo_.Id(), origin_ + Vec(area.x, area.y), origin_ + Vec(area.br().x, area.br().y));
  }

  InteractiveScene scene_;
  GlTexture photo_;
  ShownFramePtr photo_of_;
  GlTexture texts_;
  // State that the scene shows now.
  std::optional<SceneStyle> style_;
  SceneLayers drawn_layers_;
  AppliedEdits edits_;
  std::optional<std::set<int>> answers_;
  SceneStyle::Clip clip_;
  MapSnapshotPtr frame_;
  MapSnapshotPtr map_;
  std::optional<ViewCamera> drawn_;
  cv::Size size_;
  ImVec2 origin_;
  bool changed_ = true;
  double rest_seconds_ = 0.0;  // seconds since something moved
  bool settled_ = false;
  bool software_ = IsSoftware();  // fine pictures take too long while something moves
  bool hovered_ = false;
};

}  // namespace

PanelPtr MakeScenePanel(ViewerState& s) { return std::make_unique<ScenePanel>(s); }

}  // namespace sqslam::viewer
