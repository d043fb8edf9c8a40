#include "render/figures/figure_names.h"

#include "render/page/page.h"
#include "render/scene/object_look.h"
#include "slam/util/markup.h"

namespace sqslam {

cv::Size FigureNames::SizeOf(const std::string& name) const {
  return {cvCeil(scale_ * (TextWidth(name, letters_) + 2.0)), cvCeil(scale_ * 1.15 * letters_)};
}

std::vector<std::size_t> FigureNames::Draw(const std::vector<std::string>& names,
                                           const std::vector<Eigen::Vector3d>& inks,
                                           const std::vector<LabelRequest>& requests,
                                           const cv::Mat1i& number) {
  const std::vector<LabelPlace> places = PlaceLabels(requests, number, taken_);
  for (const LabelPlace& place : places) {  // below all names
    if (place.leader) {
      DrawLeader(place);
    }
  }
  constexpr double kMaxLeader = 2.5;  // lines
  std::vector<std::size_t> far;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double leader = places[i].leader ? cv::norm(LeaderStart(places[i]) - places[i].anchor) : 0.0;
    if (!requests[i].part.bounds.empty() &&
        (places[i].area.empty() || leader > kMaxLeader * places[i].area.height)) {
      far.push_back(i);
    }
    if (const cv::Rect& at = places[i].area; !at.empty()) {
      sheet_.page.Text({names[i], OnPage(at.x + 0.5 * at.width, at.y + 0.5 * at.height), letters_, inks[i],
                        TextAlign::kCenter, false, 0.0, sheet_.theme.background});
    }
  }
  return far;
}

void FigureNames::KeepFree(const FigureRect& taken) {
  taken_.emplace_back(cvFloor(scale_ * (taken.x - area_.x)), cvFloor(scale_ * (taken.y - area_.y)),
                      cvCeil(scale_ * taken.width), cvCeil(scale_ * taken.height));
}

void FigureNames::DrawLeader(const LabelPlace& place) {
  const cv::Point start = LeaderStart(place);
  const Eigen::Vector2d from = OnPage(start.x, start.y);
  const Eigen::Vector2d to = OnPage(place.anchor.x + 0.5, place.anchor.y + 0.5);
  const FigureTheme& theme = sheet_.theme;
  sheet_.page.Line(from, to, {theme.background, 1.2, {}});
  sheet_.page.Polygon(to, 16, 1.2, theme.background);
  sheet_.page.Line(from, to, {theme.ink, 0.4, {}});
  sheet_.page.Polygon(to, 16, 0.8, theme.ink);
}

void DrawObjectNames(FigureSheet& sheet, const std::vector<SnapshotObject>& objects, const SceneStyle& style,
                     bool see_through, const ViewCamera& camera, const cv::Size& pixels,
                     const FigureRect& area, const FigureRect& taken) {
  const UncertainObjects uncertain = style.objects.uncertain;
  std::vector<NamedSolid> solids;
  std::vector<std::string> names;
  std::vector<Eigen::Vector3d> inks;
  std::vector<LabelRequest> requests;
  FigureNames writer(sheet, area, pixels, 0.85 * sheet.theme.small);
  writer.KeepFree(taken);
  for (const SnapshotObject& object : objects) {
    const bool certain = uncertain == UncertainObjects::kSolid || IsReliable(object);
    if (certain || uncertain == UncertainObjects::kOutline) {
      names.push_back(ReadableLabel(ShownName(object)));
      inks.push_back(certain ? sheet.theme.ink : sheet.theme.muted);
      requests.push_back({{},
                          writer.SizeOf(names.back()),
                          (object.superquadric.T_map_object.translation - camera.position).norm(),
                          static_cast<int>(solids.size())});
      solids.push_back({object.superquadric, HidesOthers(object, style.objects, see_through)});
    }
  }
  const SeenSolids seen = SeeSolids(solids, see_through, PinholeOf(camera, pixels), PoseOf(camera));
  for (std::size_t i = 0; i < requests.size(); ++i) {
    requests[i].part = seen.parts[i];
  }
  writer.Draw(names, inks, requests, seen.number);
}

}  // namespace sqslam
