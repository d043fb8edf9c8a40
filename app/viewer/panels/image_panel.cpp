#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "app/viewer/panels/panels.h"
#include "app/viewer/widgets/widgets.h"
#include "render/picture/photo.h"
#include "slam/util/to_vector.h"

namespace sqslam::viewer {
namespace {

// Marks over the image, in image pixels.
struct ImageMarks {
  struct Dot {
    Eigen::Vector2d pixel;
    int object_id = -1;
  };
  std::vector<ObjectOutline> outlines;  // nearest first; they refer to the frame's map
  std::vector<Dot> dots;
};

ImageMarks MarksOf(const ShownFrame& shown) {
  ImageMarks marks;
  if (!shown.map || !shown.map->T_map_camera) {
    return marks;
  }
  const MapSnapshot& map = *shown.map;
  marks.outlines = OutlinesOf(map.objects, map.camera, *map.T_map_camera);
  const Rigid3d T_camera_map = map.T_map_camera->Inverse();
  const Box2d image{0.0, 0.0, map.camera.width - 1.0, map.camera.height - 1.0};
  for (const SnapshotPoint& point : map.points) {
    const Eigen::Vector3d p = T_camera_map * point.p_map.cast<double>();
    if (p.z() > 0.0 && image.Contains(map.camera.Project(p))) {
      marks.dots.push_back({map.camera.ProjectDistorted(p), point.object_id});
    }
  }
  return marks;
}

class ImagePanel : public Panel {
 public:
  explicit ImagePanel(ViewerState& s) : Panel(Place::kTop, "Image", s) {}
  bool Wanted() const override { return window_.settings.show_image && document_.shown != nullptr; }

  void Draw() override {
    if (shown_ != document_.shown) {
      shown_ = document_.shown;
      texture_.Upload(shown_->image);
      marks_ = MarksOf(*shown_);
    }
    DrawSwitches();
    const ImVec2 room = ImGui::GetContentRegionAvail();
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    if (room.x < 8.0F || room.y < 8.0F) {
      return;
    }
    const cv::Size size = ImageSize();
    if (size.empty()) {
      DimWrapped("No image of this frame. " + shown_->no_image);
      return;
    }
    scale_ = std::min(room.x / static_cast<float>(size.width), room.y / static_cast<float>(size.height));
    const ImVec2 drawn = Vec(scale_ * size.width, scale_ * size.height);
    origin_ = ImVec2(std::floor(corner.x + 0.5F * (room.x - drawn.x)), corner.y);
    ImGui::SetCursorScreenPos(origin_);
    ImGui::InvisibleButton("image", drawn);
    const ImVec2 end = origin_ + drawn;
    ImDrawList* list = ImGui::GetWindowDrawList();
    list->PushClipRect(origin_, end, true);
    DrawImage(end);
    DrawMarks();
    DrawImageMarks(context_, window_, [this](const Eigen::Vector2d& pixel) { return At(pixel); });
    list->PopClipRect();
    HandleMouse();
  }

 private:
  cv::Size ImageSize() const {
    if (!shown_->image.empty()) {
      return shown_->image.size();
    }
    return shown_->map ? cv::Size(shown_->map->camera.width, shown_->map->camera.height) : cv::Size();
  }

  void DrawSwitches() {
    Toggle("Boxes", boxes_, "Detected boxes; a click selects the object");
    ImGui::SameLine();
    Toggle("Outlines", outlines_, "The map's objects as this camera sees them");
    ImGui::SameLine();
    Toggle("Points", points_,
           "Map points in the image, coloured by their object; during a run the tracked features");
    ImGui::SameLine();
    const std::string text = "frame " + std::to_string(shown_->frame_index);
    const float right = ImGui::GetContentRegionAvail().x - ImGui::CalcTextSize(text.c_str()).x;
    if (right > 0.0F) {
      ImGui::SetCursorPosX(ImGui::GetCursorPosX() + right);
      ImGui::AlignTextToFramePadding();
      Dim(text);
    } else {
      ImGui::NewLine();
    }
  }

  void DrawImage(ImVec2 end) const {
    ImDrawList* list = ImGui::GetWindowDrawList();
    if (texture_.Id() != nullptr) {
      list->AddImage(texture_.Id(), origin_, end);
    } else {
      list->AddRectFilled(origin_, end, ImGui::GetColorU32(ImGuiCol_FrameBg));
      const char* text = "no image";
      const ImVec2 size = ImGui::CalcTextSize(text);
      list->AddText(ImVec2(0.5F * (origin_.x + end.x - size.x), end.y - 1.6F * size.y),
                    PaletteOf(window_.settings.theme).dim_text, text);
    }
  }

  ImVec2 At(const Eigen::Vector2d& pixel) const {
    return origin_ + Vec(pixel.x() + 0.5, pixel.y() + 0.5) * scale_;
  }

  void DrawMarks() const {
    const auto scale = static_cast<float>(window_.scale);
    if (points_) {
      DrawDots(scale);
    }
    if (boxes_) {
      DrawBoxes(scale);
    }
    for (auto it = marks_.outlines.rbegin(); it != marks_.outlines.rend(); ++it) {
      const bool selected = it->object->id == selection_.selected;
      const bool pointed = it->object->id == selection_.hovered;
      if (outlines_ || selected || pointed) {
        const auto points = ToVector(it->polygon, [this](const cv::Point2d& p) { return At({p.x, p.y}); });
        Stroke(points,
               selected ? PaletteOf(window_.settings.theme).accent : Packed(view_.colors(it->object->label)),
               (selected  ? 3.0F
                : pointed ? 2.4F
                          : 1.6F) *
                   scale,
               1.6F, true, IM_COL32(0, 0, 0, 120));
      }
    }
  }

  // Draws map points in the image; during a run, the features of tracking, with and without a map point.
  void DrawDots(float scale) const {
    const auto dot = [&](const Eigen::Vector2d& pixel, float r, ImU32 color) {
      Square(At(pixel), r * scale, color);
    };
    for (const FrameView::Feature& feature : shown_->features) {
      dot(feature.pixel.cast<double>(), feature.tracked ? 1.6F : 1.0F,
          feature.tracked ? IM_COL32(60, 220, 150, 230) : IM_COL32(255, 255, 255, 110));
    }
    if (shown_->features.empty()) {
      for (const ImageMarks::Dot& mark : marks_.dots) {
        const SnapshotObject* object = mark.object_id < 0 ? nullptr : document_.Object(mark.object_id);
        dot(mark.pixel, 1.2F,
            object != nullptr ? Packed(view_.colors(object->label)) : IM_COL32(255, 255, 255, 150));
      }
    }
  }

  void DrawBoxes(float scale) const {
    ImDrawList* list = ImGui::GetWindowDrawList();
    for (const SnapshotDetection& seen : shown_->detections) {
      const Box2d& box = seen.detection.box;
      const ImVec2 a = At({box.x, box.y});
      const ImVec2 b = At({box.x + box.width, box.y + box.height});
      list->AddRect(a, b, IM_COL32(0, 0, 0, 120), 2.0F, 0, 2.6F * scale);
      list->AddRect(a, b, Packed(view_.colors(seen.detection.label)), 2.0F, 0, 1.3F * scale);
    }
  }

  // Returns the object at a pixel: the one of the smallest box around it, else of the nearest outline around
  // it.
  std::optional<int> ObjectAt(const Eigen::Vector2d& pixel) const {
    const SnapshotDetection* best = nullptr;
    for (const SnapshotDetection& seen : shown_->detections) {
      const bool smaller = best == nullptr || seen.detection.box.Area() < best->detection.box.Area();
      if (boxes_ && seen.object_id >= 0 && seen.detection.box.Contains(pixel) && smaller) {
        best = &seen;
      }
    }
    if (best != nullptr) {
      return best->object_id;
    }
    for (const ObjectOutline& outline : marks_.outlines) {
      const std::vector<cv::Point2f> contour(outline.polygon.begin(), outline.polygon.end());
      if (cv::pointPolygonTest(contour, cv::Point2d(pixel.x(), pixel.y()), false) >= 0.0) {
        return outline.object->id;
      }
    }
    return std::nullopt;
  }

  void HandleMouse() const {
    if (!ImGui::IsItemHovered()) {
      return;
    }
    const ImVec2 mouse = (ImGui::GetIO().MousePos - origin_) / scale_;
    const Eigen::Vector2d pixel(mouse.x - 0.5, mouse.y - 0.5);
    selection_.pointed = ObjectAt(pixel);
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
      selection_.selected = selection_.pointed;
    }
    if (const SnapshotObject* object = document_.Object(selection_.pointed)) {
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

PanelPtr MakeImagePanel(ViewerState& s) { return std::make_unique<ImagePanel>(s); }

}  // namespace sqslam::viewer
