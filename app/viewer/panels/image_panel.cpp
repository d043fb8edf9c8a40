#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "app/viewer/panels/panels.h"
#include "app/viewer/panels/scene_marks.h"
#include "app/viewer/widgets/gl_texture.h"
#include "app/viewer/widgets/widgets.h"
#include "render/picture/outlines.h"

namespace sqslam::viewer {
namespace {

// What is drawn over the image, in pixels of the image.
struct ImageMarks {
  struct Outline {
    int id = 0;
    std::string label;
    std::vector<cv::Point2d> polygon;
    double area = 0.0;  // px^2
  };
  struct Dot {
    Eigen::Vector2d pixel;
    int object_id = -1;
  };
  std::vector<Outline> outlines;  // nearest first
  std::vector<Dot> dots;
};

double AreaOf(const std::vector<cv::Point2d>& polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const cv::Point2d& a = polygon[i];
    const cv::Point2d& b = polygon[(i + 1) % polygon.size()];
    twice += a.x * b.y - b.x * a.y;
  }
  return std::abs(0.5 * twice);
}

ImageMarks MarksOf(const ShownFrame& shown) {
  ImageMarks marks;
  if (!shown.map || !shown.map->T_map_camera) {
    return marks;
  }
  const MapSnapshot& map = *shown.map;
  for (ObjectOutline& outline : OutlinesOf(map.objects, map.camera, *map.T_map_camera)) {
    const double area = AreaOf(outline.polygon);
    marks.outlines.push_back({outline.object->id, outline.object->label, std::move(outline.polygon), area});
  }
  const Rigid3d T_camera_map = map.T_map_camera->Inverse();
  for (const SnapshotPoint& point : map.points) {
    const Eigen::Vector3d p = T_camera_map * point.p_map.cast<double>();
    if (p.z() <= 0.0) {
      continue;
    }
    const Eigen::Vector2d straight = map.camera.Project(p);
    if (straight.x() < 0.0 || straight.y() < 0.0 || straight.x() > map.camera.width - 1.0 ||
        straight.y() > map.camera.height - 1.0) {
      continue;
    }
    marks.dots.push_back({map.camera.ProjectDistorted(p), point.object_id});
  }
  return marks;
}

bool Inside(const std::vector<cv::Point2d>& polygon, const Eigen::Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const cv::Point2d& a = polygon[i];
    const cv::Point2d& b = polygon[j];
    if ((a.y > p.y()) != (b.y > p.y()) && p.x() < (b.x - a.x) * (p.y() - a.y) / (b.y - a.y) + a.x) {
      inside = !inside;
    }
  }
  return inside;
}

class ImagePanel : public Panel {
 public:
  Place Where() const override { return Place::kTop; }
  std::string Title() const override { return "Image"; }
  bool Wanted(const ViewerState& state) const override { return state.show_image && state.shown != nullptr; }

  void Draw(ViewerState& state) override {
    if (shown_ != state.shown) {
      shown_ = state.shown;
      texture_.Upload(shown_->image);
      marks_ = MarksOf(*shown_);
    }
    DrawSwitches(state);
    const ImVec2 place = ImGui::GetContentRegionAvail();
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    if (place.x < 8.0F || place.y < 8.0F) {
      return;
    }
    const cv::Size size = ImageSize();
    if (size.empty()) {
      ImGui::PushTextWrapPos(0.0F);
      ImGui::TextDisabled("No image of this frame. %s", shown_->no_image.c_str());
      ImGui::PopTextWrapPos();
      return;
    }
    scale_ = std::min(place.x / static_cast<float>(size.width), place.y / static_cast<float>(size.height));
    const ImVec2 drawn(scale_ * static_cast<float>(size.width), scale_ * static_cast<float>(size.height));
    origin_ = ImVec2(std::floor(corner.x + 0.5F * (place.x - drawn.x)), corner.y);
    ImGui::SetCursorScreenPos(origin_);
    ImGui::InvisibleButton("image", drawn);
    const ImVec2 end(origin_.x + drawn.x, origin_.y + drawn.y);
    ImDrawList* list = ImGui::GetWindowDrawList();
    list->PushClipRect(origin_, end, true);
    DrawImage(state, end);
    DrawMarks(state);
    DrawImageMarks(state, [this](double x, double y) { return At(x, y); });
    list->PopClipRect();
    HandleMouse(state);
  }

 private:
  cv::Size ImageSize() const {
    if (!shown_->image.empty()) {
      return shown_->image.size();
    }
    return shown_->map ? cv::Size(shown_->map->camera.width, shown_->map->camera.height) : cv::Size();
  }

  void DrawSwitches(const ViewerState& state) {
    Toggle("Boxes", &boxes_, "What the detector found; a click selects the object");
    ImGui::SameLine();
    Toggle("Outlines", &outlines_, "The map's objects as this camera sees them");
    ImGui::SameLine();
    Toggle("Points", &points_,
           "Map points in the image, coloured by their object; of a run that goes on the features that are "
           "tracked");
    ImGui::SameLine();
    const std::string text = "frame " + std::to_string(state.shown->frame_index);
    const float right = ImGui::GetContentRegionAvail().x - ImGui::CalcTextSize(text.c_str()).x;
    if (right > 0.0F) {
      ImGui::SetCursorPosX(ImGui::GetCursorPosX() + right);
      ImGui::AlignTextToFramePadding();
      ImGui::TextDisabled("%s", text.c_str());
    } else {
      ImGui::NewLine();
    }
  }

  void DrawImage(const ViewerState& state, ImVec2 end) const {
    ImDrawList* list = ImGui::GetWindowDrawList();
    if (texture_.Name() != 0) {
      list->AddImage(reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(texture_.Name())),  // NOLINT
                     origin_, end);
    } else {
      list->AddRectFilled(origin_, end, ImGui::GetColorU32(ImGuiCol_FrameBg));
      const char* text = "no image";
      const ImVec2 size = ImGui::CalcTextSize(text);
      list->AddText(ImVec2(0.5F * (origin_.x + end.x - size.x), end.y - 1.6F * size.y),
                    PaletteOf(state.theme).dim_text, text);
    }
  }

  ImVec2 At(double x, double y) const {
    return {origin_.x + scale_ * static_cast<float>(x + 0.5),
            origin_.y + scale_ * static_cast<float>(y + 0.5)};
  }

  void DrawMarks(const ViewerState& state) const {
    ImDrawList* list = ImGui::GetWindowDrawList();
    const auto scale = static_cast<float>(state.ui_scale);
    if (points_) {
      DrawDots(state, list, scale);
    }
    if (boxes_) {
      DrawBoxes(state, list, scale);
    }
    for (auto it = marks_.outlines.rbegin(); it != marks_.outlines.rend(); ++it) {
      const bool selected = it->id == state.selected;
      const bool pointed = it->id == state.hovered;
      if (outlines_ || selected || pointed) {
        const ImU32 color = selected ? PaletteOf(state.theme).accent : Packed(state.colors(it->label));
        DrawPolygon(list, it->polygon, color, (selected ? 3.0F : pointed ? 2.4F : 1.6F) * scale);
      }
    }
  }

  void DrawDots(const ViewerState& state, ImDrawList* list, float scale) const {
    if (!shown_->features.empty()) {
      DrawFeatures(list, scale);
      return;
    }
    for (const ImageMarks::Dot& dot : marks_.dots) {
      const SnapshotObject* object = dot.object_id < 0 ? nullptr : state.Object(dot.object_id);
      const ImVec2 p = At(dot.pixel.x(), dot.pixel.y());
      const float r = 1.2F * scale;
      list->AddRectFilled(
          ImVec2(p.x - r, p.y - r), ImVec2(p.x + r, p.y + r),
          object != nullptr ? Packed(state.colors(object->label)) : IM_COL32(255, 255, 255, 150));
    }
  }

  // What tracking found in the image: features on map points, and those that are none.
  void DrawFeatures(ImDrawList* list, float scale) const {
    for (const FrameView::Feature& feature : shown_->features) {
      const ImVec2 p = At(feature.pixel.x(), feature.pixel.y());
      const float r = (feature.tracked ? 1.6F : 1.0F) * scale;
      list->AddRectFilled(ImVec2(p.x - r, p.y - r), ImVec2(p.x + r, p.y + r),
                          feature.tracked ? IM_COL32(60, 220, 150, 230) : IM_COL32(255, 255, 255, 110));
    }
  }

  void DrawBoxes(const ViewerState& state, ImDrawList* list, float scale) const {
    for (const SnapshotDetection& seen : shown_->detections) {
      const Box2d& box = seen.detection.box;
      const Eigen::Vector3d color = state.colors(seen.detection.label);
      const ImVec2 a = At(box.x, box.y);
      const ImVec2 b = At(box.x + box.width, box.y + box.height);
      list->AddRect(a, b, IM_COL32(0, 0, 0, 120), 2.0F, 0, 2.6F * scale);
      list->AddRect(a, b, Packed(color), 2.0F, 0, 1.3F * scale);
    }
  }

  void DrawPolygon(ImDrawList* list, const std::vector<cv::Point2d>& polygon, ImU32 color,
                   float width) const {
    std::vector<ImVec2> points;
    for (const cv::Point2d& p : polygon) {
      points.push_back(At(p.x, p.y));
    }
    const int count = static_cast<int>(points.size());
    list->AddPolyline(points.data(), count, IM_COL32(0, 0, 0, 120), ImDrawFlags_Closed, width + 1.6F);
    list->AddPolyline(points.data(), count, color, ImDrawFlags_Closed, width);
  }

  // The object that a place in the image means: of the smallest box around it, or of the nearest outline.
  std::optional<int> ObjectAt(const Eigen::Vector2d& pixel) const {
    const SnapshotDetection* best = nullptr;
    for (const SnapshotDetection& seen : shown_->detections) {
      const bool smaller = best == nullptr || seen.detection.box.Area() < best->detection.box.Area();
      if (boxes_ && seen.detection.box.Contains(pixel) && smaller) {
        best = &seen;
      }
    }
    if (best != nullptr) {
      return best->object_id >= 0 ? std::optional(best->object_id) : OutlineLike(best->detection);
    }
    for (const ImageMarks::Outline& outline : marks_.outlines) {
      if (Inside(outline.polygon, pixel)) {
        return outline.id;
      }
    }
    return std::nullopt;
  }

  // Of a frame between two states of the map nobody wrote down which box is which object: the one of the same
  // class whose outline overlaps it best.
  std::optional<int> OutlineLike(const Detection& detection) const {
    std::optional<int> id;
    double best = 0.2;
    for (const ImageMarks::Outline& outline : marks_.outlines) {
      Box2d box{1e9, 1e9, 0.0, 0.0};
      double right = -1e9;
      double bottom = -1e9;
      for (const cv::Point2d& p : outline.polygon) {
        box.x = std::min(box.x, p.x);
        box.y = std::min(box.y, p.y);
        right = std::max(right, p.x);
        bottom = std::max(bottom, p.y);
      }
      box.width = right - box.x;
      box.height = bottom - box.y;
      const double overlap = IoU(box, detection.box) + (outline.label == detection.label ? 0.2 : 0.0);
      if (overlap > best) {
        best = overlap;
        id = outline.id;
      }
    }
    return id;
  }

  void HandleMouse(ViewerState& state) const {
    if (!ImGui::IsItemHovered()) {
      return;
    }
    const ImVec2 mouse = ImGui::GetIO().MousePos;
    const Eigen::Vector2d pixel((mouse.x - origin_.x) / scale_ - 0.5, (mouse.y - origin_.y) / scale_ - 0.5);
    state.pointed = ObjectAt(pixel);
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
      state.selected = state.pointed;
    }
    if (const SnapshotObject* object = state.Object(state.pointed)) {
      Tip(ObjectName(*object).c_str());
    }
  }

  ShownFramePtr shown_;
  GlTexture texture_;
  ImageMarks marks_;
  ImVec2 origin_;
  float scale_ = 1.0F;
  bool boxes_ = true;
  bool outlines_ = true;
  bool points_ = false;
};

}  // namespace

PanelPtr MakeImagePanel() { return std::make_unique<ImagePanel>(); }

}  // namespace sqslam::viewer
