#include <gtest/gtest.h>

#include "render/figures/figures.h"
#include "render/page/page.h"
#include "render/picture/picture_overlay.h"

namespace sqslam {
namespace {

TEST(LabelLayoutTest, PlacesSingleNameAboveItsObject) {
  const std::vector<LabelRequest> requests = {{{100, 100, 40, 30}, {60, 12}, 1.0}};
  const LabelPlace place = PlaceLabels(requests, {300, 200}, {})[0];
  EXPECT_EQ(place.area.br().y, 97);
  EXPECT_EQ(place.area.x + place.area.width / 2, 120);
  EXPECT_FALSE(place.leader);
}

TEST(LabelLayoutTest, KeepsCrowdedNamesApart) {
  std::vector<LabelRequest> requests;
  for (int i = 0; i < 12; ++i) {
    requests.push_back({{130 + 5 * i, 150 - 3 * i, 30, 40}, {70, 12}, 1.0 + i});
  }
  const std::vector<cv::Rect> taken = {{200, 0, 120, 100}};
  const std::vector<LabelPlace> places = PlaceLabels(requests, {320, 300}, taken);
  int placed = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const cv::Rect& area = places[i].area;
    placed += area.empty() ? 0 : 1;
    EXPECT_EQ(area & cv::Rect(0, 0, 320, 300), area);
    EXPECT_TRUE((area & taken[0]).empty());
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_TRUE((area & places[j].area).empty());
    }
  }
  EXPECT_GE(placed, 10);
}

TEST(LabelLayoutTest, GivesNearestObjectTheBestPlace) {
  const std::vector<LabelRequest> requests = {{{100, 100, 40, 30}, {60, 12}, 5.0},
                                              {{102, 101, 40, 30}, {60, 12}, 2.0}};
  const std::vector<LabelPlace> places = PlaceLabels(requests, {300, 200}, {});
  EXPECT_EQ(places[1].area.br().y, 98);
  EXPECT_NE(places[0].area.br().y, 97);
}

TEST(LabelLayoutTest, OmitsNameWithoutRoom) {
  const std::vector<LabelRequest> requests = {{{0, 0, 50, 20}, {60, 12}, 1.0}};
  EXPECT_TRUE(PlaceLabels(requests, {50, 20}, {})[0].area.empty());
}

TEST(LabelLayoutTest, StacksNamesOfAThousandObjectsInOnePlace) {
  const TrajectoryFigure::Footprint cup{"cup", {1, 0, 0}, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, false};
  TrajectoryFigure figure;
  figure.objects.assign(1000, cup);  // once took hours
  std::vector<double> heights;
  for (const FigureElement& element : DrawTrajectories(figure, {}).elements) {
    const auto* text = std::get_if<FigureText>(&element);
    if (text != nullptr && text->text == "cup") {
      heights.push_back(text->anchor.y());
    }
  }
  ASSERT_EQ(heights.size(), 1000u);
  for (std::size_t i = 1; i < heights.size(); ++i) {
    EXPECT_GT(heights[i], heights[i - 1] + 5.0);
  }
}

}  // namespace
}  // namespace sqslam
