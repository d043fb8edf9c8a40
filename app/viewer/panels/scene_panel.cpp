#include <GL/gl.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "app/viewer/input/keys.h"
#include "app/viewer/panels/panels.h"
#include "app/viewer/panels/scene_marks.h"
#include "app/viewer/panels/scene_overlay.h"
#include "app/viewer/state/camera_control.h"
#include "app/viewer/state/picking.h"
#include "app/viewer/widgets/gl_texture.h"
#include "app/viewer/widgets/widgets.h"
#include "render/picture/interactive_scene.h"

namespace sqslam::viewer {
namespace {

ImTextureID TextureId(unsigned name) {
  return reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(name));  // NOLINT: ImGui's convention
}

// OpenGL on the processor, as of Mesa without a graphics card.
bool IsSoftware() {
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));  // NOLINT: OpenGL's characters
  const std::string_view renderer = name != nullptr ? name : "";
  return renderer.find("llvmpipe") != renderer.npos || renderer.find("softpipe") != renderer.npos;
}

Eigen::Vector2d ToEigen(ImVec2 v) { return {v.x, v.y}; }

class ScenePanel : public Panel {
 public:
  Place Where() const override { return Place::kScene; }
  std::string Title() const override { return "Map"; }
  bool Busy() const override { return !settled_; }

  void Draw(ViewerState& state) override {
    const ImVec2 available = ImGui::GetContentRegionAvail();
    origin_ = ImGui::GetCursorScreenPos();
    state.scene_size = {static_cast<int>(available.x), static_cast<int>(available.y)};
    state.scene_corner = {static_cast<int>(origin_.x), static_cast<int>(origin_.y)};
    if (state.scene_size.width < 1 || state.scene_size.height < 1) {
      return;  // minimised
    }
    Synchronize(state);
    ImGui::InvisibleButton("scene", available,
                           ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight |
                               ImGuiButtonFlags_MouseButtonMiddle);
    hovered_ = ImGui::IsItemHovered();
    if (state.Map() != nullptr) {
      if (!AnnotateWithMouse(state, origin_, hovered_)) {
        HandleMouse(state);
      }
      HandleKeys(state);
    }
    DrawScene(state);
    DrawMarks(state);
  }

 private:
  // Brings what is drawn up to what the state says.
  void Synchronize(ViewerState& state) {
    if (style_version_ != state.view.style_version || live_ != state.run.active) {
      style_version_ = state.view.style_version;
      live_ = state.run.active;
      SceneStyle style = state.view.style;
      style.cameras.current = style.cameras.current && !live_;  // DrawCamera() does that
      scene_.SetStyle(style);
      Stir();
    }
    if (!(clip_ == state.view.style.clip)) {
      clip_ = state.view.style.clip;
      scene_.SetClip(clip_);
      Stir();
    }
    if (layers_version_ != state.layers.version) {
      layers_version_ = state.layers.version;
      scene_.SetLayers(state.layers.drawn);
      Stir();
    }
    if (frame_map_ != state.document.frame) {
      frame_map_ = state.document.frame;
      scene_.SetFrame(frame_map_ ? *frame_map_ : MapSnapshot());
      state.focus = scene_.Focus();
      state.colors = scene_.Colors();
      Stir();
    }
    const MapSnapshotPtr map = state.shown ? state.shown->map : nullptr;
    // Of a run that goes on the map is drawn anew only where it is another one: the camera moves all the
    // time.
    const Editing& editing = state.editing;
    const bool same_edits =
        edits_ == editing.document.Current().edits && representation_ == editing.representation;
    const bool same_state =
        live_ && map_ && map && same_edits && map_->sequence_number == map->sequence_number;
    if (map_ != map && !same_state) {
      map_ = map;
      edits_ = editing.document.Current().edits;
      representation_ = editing.representation;
      scene_.Show(map);
      Stir();
    }
  }

  void Stir() { stirred_ = true; }

  void Move(ViewerState& state, const ViewCamera& camera) {
    state.view.camera = camera;
    state.view.preset = "";
    state.view.automatic = false;
    state.view.mode = CameraMode::kFree;
  }

  void HandleMouse(ViewerState& state) {
    const ImGuiIO& io = ImGui::GetIO();
    const cv::Size window = state.scene_size;
    const Eigen::Vector2d mouse = ToEigen(io.MousePos) - ToEigen(origin_);
    const Eigen::Vector2d moved = ToEigen(io.MouseDelta);
    if (hovered_ && io.MouseWheel != 0.0F) {
      Move(state, ZoomTo(state.view.camera, std::pow(1.15, io.MouseWheel), mouse, window));
    }
    const auto dragged = [&](ImGuiMouseButton button) {
      return ImGui::IsItemActive() && ImGui::IsMouseDragging(button, 3.0F) && moved.norm() > 0.0;
    };
    if (dragged(ImGuiMouseButton_Middle) || (dragged(ImGuiMouseButton_Left) && io.KeyShift)) {
      Move(state, Pan(state.view.camera, moved, window));
    } else if (dragged(ImGuiMouseButton_Left)) {
      Move(state, Orbit(state.view.camera, moved, window, state.focus.up));
    } else if (dragged(ImGuiMouseButton_Right)) {
      Move(state, LookAround(state.view.camera, moved, window, state.focus.up));
    }
    const Ray ray = RayOf(state.view.camera, mouse, window);
    if (hovered_ && !ImGui::IsAnyMouseDown()) {
      state.pointed = PickObject(ray, state.Map()->objects, CutOf(state));
    }
    const ImVec2 drag = io.MouseClickedPos[0];
    const bool still = std::hypot(io.MousePos.x - drag.x, io.MousePos.y - drag.y) < 3.0F;
    if (hovered_ && ImGui::IsMouseReleased(ImGuiMouseButton_Left) && still) {
      Click(state, mouse, ray);
    }
    if (hovered_ && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) {
      LookAt(state, mouse);
    }
  }

  void Click(ViewerState& state, const Eigen::Vector2d& mouse, const Ray& ray) {
    if (!state.measurement.active) {
      state.selected = PickObject(ray, state.Map()->objects, CutOf(state));
      return;
    }
    if (const auto point = PointAt(state, mouse)) {
      auto& points = state.measurement.points;
      if (points.size() >= 2) {
        points.clear();
      }
      points.push_back(*point);
    }
  }

  static std::optional<Eigen::Vector3d> PointAt(const ViewerState& state, const Eigen::Vector2d& mouse) {
    return PickPoint(state.view.camera, mouse, state.scene_size, *state.Map(), CutOf(state),
                     state.layers.drawn.dense_cloud.get());
  }

  // What lies there comes to the middle.
  void LookAt(ViewerState& state, const Eigen::Vector2d& mouse) {
    if (const auto point = PointAt(state, mouse)) {
      ViewCamera camera = state.view.camera;
      camera.position += *point - camera.focal_point;
      camera.focal_point = *point;
      camera.pinhole.reset();
      Move(state, camera);
    }
  }

  void HandleKeys(ViewerState& state) {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantTextInput || io.KeyCtrl || io.KeyAlt) {
      return;
    }
    const auto axis = [&](int plus, int minus) {
      return (ImGui::IsKeyDown(plus) ? 1.0 : 0.0) - (ImGui::IsKeyDown(minus) ? 1.0 : 0.0);
    };
    const Eigen::Vector3d way(axis('D', 'A'), axis('E', 'Q'), axis('W', 'S'));
    if (way.norm() > 0.0) {
      const double speed = (io.KeyShift ? 1.6 : 0.5) * state.focus.radius;  // map units a second
      Move(state, Fly(state.view.camera, std::min(state.seconds, 0.1) * speed * way));
    }
  }

  void DrawScene(ViewerState& state) {
    using Detail = InteractiveScene::Detail;
    const ViewCamera& camera = state.view.camera;
    const bool changed = !drawn_ || drawn_->position != camera.position ||
                         drawn_->focal_point != camera.focal_point || drawn_->view_up != camera.view_up ||
                         drawn_->pinhole.has_value() != camera.pinhole.has_value() ||
                         size_ != state.scene_size;
    const bool dirty = std::exchange(stirred_, false) || changed;
    still_ = dirty ? 0.0 : still_ + state.seconds;
    constexpr double kRest = 0.15;                 // seconds after which the fine picture is drawn
    const bool busy = live_ && !state.run.paused;  // the processor is the run's
    settled_ = !software_ || (still_ >= kRest && !busy);
    drawn_ = camera;
    size_ = state.scene_size;
    const unsigned texture = scene_.Draw(camera, size_, settled_ ? Detail::kFine : Detail::kDraft);
    ImDrawList* list = ImGui::GetWindowDrawList();
    const ImVec2 end(origin_.x + static_cast<float>(size_.width),
                     origin_.y + static_cast<float>(size_.height));
    list->AddImage(TextureId(texture), origin_, end, ImVec2(0.0F, 1.0F), ImVec2(1.0F, 0.0F));
    if (dirty) {
      TakeTexts(state.Map() != nullptr ? scene_.Texts(camera, size_) : cv::Mat());
    }
    DrawTexts();
  }

  // Most of that image is empty, and blending costs time: only cells that hold something are drawn.
  void DrawTexts() const {
    if (texts_.Name() == 0) {
      return;
    }
    const cv::Size size = texts_.Size();
    const auto corner = [&](cv::Point p) {
      return ImVec2(origin_.x + static_cast<float>(p.x), origin_.y + static_cast<float>(p.y));
    };
    const auto share = [&](cv::Point p) {
      return ImVec2(static_cast<float>(p.x) / static_cast<float>(size.width),
                    static_cast<float>(p.y) / static_cast<float>(size.height));
    };
    for (const cv::Rect& cell : text_cells_) {
      ImGui::GetWindowDrawList()->AddImage(TextureId(texts_.Name()), corner(cell.tl()), corner(cell.br()),
                                           share(cell.tl()), share(cell.br()));
    }
  }

  void TakeTexts(const cv::Mat& image) {
    texts_.Upload(image);
    text_cells_.clear();
    constexpr int kSide = 64;  // pixels
    for (int y = 0; y < image.rows; y += kSide) {
      for (int x = 0; x < image.cols; x += kSide) {
        const cv::Rect cell = cv::Rect(x, y, kSide, kSide) & cv::Rect(cv::Point(), image.size());
        if (cv::norm(image(cell), cv::NORM_INF) > 0.0) {
          text_cells_.push_back(cell);
        }
      }
    }
  }

  void DrawMarks(ViewerState& state) {
    ImDrawList* list = ImGui::GetWindowDrawList();
    const ImVec2 end(origin_.x + static_cast<float>(size_.width),
                     origin_.y + static_cast<float>(size_.height));
    list->PushClipRect(origin_, end, true);
    const Palette& palette = PaletteOf(state.theme);
    const auto scale = static_cast<float>(state.ui_scale);
    const SceneOverlay overlay(state, origin_, size_);
    if (state.hovered != state.selected) {
      overlay.Outline(state.Object(state.hovered), palette.text, 1.2F * scale);
    }
    overlay.Outline(state.Object(state.selected), palette.accent, 3.0F * scale);
    if (live_ && state.view.style.cameras.current) {
      overlay.InputCamera();
    }
    overlay.Name(state.Object(state.hovered ? state.hovered : state.selected));
    overlay.Measurement();
    DrawSceneMarks(state, origin_);
    list->PopClipRect();
  }

  InteractiveScene scene_;
  GlTexture texts_;
  std::vector<cv::Rect> text_cells_;  // of it, where there is something
  int style_version_ = -1;
  SceneStyle::Clip clip_;
  int layers_version_ = 0;
  bool live_ = false;  // a run goes on
  MapSnapshotPtr frame_map_;
  MapSnapshotPtr map_;
  ObjectEdits edits_;  // with which it was made
  Representation representation_ = Representation::kSuperquadric;
  std::optional<ViewCamera> drawn_;
  cv::Size size_;
  ImVec2 origin_;
  bool stirred_ = true;
  double still_ = 0.0;  // seconds since something moved
  bool settled_ = false;
  bool software_ = IsSoftware();  // fine pictures take too long while something moves
  bool hovered_ = false;
};

}  // namespace

PanelPtr MakeScenePanel() { return std::make_unique<ScenePanel>(); }

}  // namespace sqslam::viewer
