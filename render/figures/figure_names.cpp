#include "render/figures/figure_names.h"

#include "render/page/page.h"

namespace sqslam {

cv::Size FigureNames::SizeOf(const std::string& name) const {
  return {cvCeil(scale_ * (TextWidth(name, letters_) + 2.0)), cvCeil(scale_ * 1.15 * letters_)};
}

void FigureNames::Draw(const std::vector<std::string>& names, const std::vector<Eigen::Vector3d>& inks,
                       const std::vector<LabelRequest>& requests, const cv::Mat1i& number) {
  const std::vector<LabelPlace> places = PlaceLabels(requests, number, {});
  for (const LabelPlace& place : places) {  // below all names
    if (place.leader) {
      DrawLeader(place);
    }
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (const cv::Rect& at = places[i].area; !at.empty()) {
      sheet_.page.Text({names[i], OnPage(at.x + 0.5 * at.width, at.y + 0.5 * at.height), letters_, inks[i],
                        TextAlign::kCenter, false, 0.0, sheet_.theme.background});
    }
  }
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

}  // namespace sqslam
