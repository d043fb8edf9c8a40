#include "slam/objects/object_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "flat_surface.h"
#include "slam/objects/object_mapper.h"
#include "synthetic_desk.h"

namespace sqslam {
namespace {

using testing::FlatSurface;
using testing::SyntheticDesk;

// Squares with sharp edges all over the image.
cv::Mat Tiles(const Camera& camera) {
  cv::Mat image(camera.height, camera.width, CV_8U, cv::Scalar(40));
  for (int y = 0; y < image.rows; y += 32) {
    for (int x = 0; x < image.cols; x += 32) {
      cv::rectangle(image, {x, y}, {x + 23, y + 23}, cv::Scalar(220), cv::FILLED);
    }
  }
  return image;
}

TEST(ObjectTracker, ReportsPointsOutsideByItsOption) {
  const SyntheticDesk desk(1, 0.12);
  const auto outside_points = [&](ReprojectionVotes reprojection) {
    ObjectOptions options;
    options.outliers.reprojection = reprojection;
    ObjectTracker tracker(options);
    ObjectMapper mapper(options, 1);
    mapper.SetUpright(true, FlatSurface(0.0));
    const PointLookup lookup = [&](std::int64_t& id) { return desk.Position(id); };
    std::size_t count = 0;
    for (int i = 0; i < 40; ++i) {
      const std::vector<ObjectObservation> observations = tracker.Track(desk.Frame(i), *mapper.View());
      for (const ObjectObservation& observation : observations) {
        count += observation.reprojected_outside.size();
      }
      mapper.AddObservations(observations);
      if (i % 10 == 9) {
        mapper.Update(lookup, desk.Camera());
      }
    }
    return count;
  };
  const std::size_t all = outside_points(ReprojectionVotes::kAll);
  const std::size_t observed = outside_points(ReprojectionVotes::kObserved);
  EXPECT_EQ(outside_points(ReprojectionVotes::kNone), 0u);
  EXPECT_GT(observed, 0u);
  EXPECT_GT(all, observed);
}

TEST(ObjectTracker, SearchesLinesWithinItsBudgetButAlwaysInNewObjects) {
  const SyntheticDesk desk(1, 0.12);
  const auto looks = [&](int line_pixels, int line_views) {
    ObjectOptions options;
    options.yaw.line_interval = 1;
    options.yaw.line_pixels = line_pixels;
    options.yaw.line_views = line_views;
    ObjectTracker tracker(options);
    std::map<int, int> views_with_lines;  // by object
    for (int i = 0; i < 20; ++i) {
      ObjectFrame frame = desk.Frame(i);
      frame.gray = Tiles(frame.camera);
      for (const ObjectObservation& observation : tracker.Track(frame, ObjectMapView())) {
        views_with_lines[observation.object_id] += observation.lines.empty() ? 0 : 1;
      }
    }
    return views_with_lines;
  };
  const auto most = [](const std::map<int, int>& views) {
    return std::ranges::max_element(views, {}, [](const auto& v) { return v.second; })->second;
  };
  const auto sum = [](const std::map<int, int>& views) {
    return std::accumulate(views.begin(), views.end(), 0, [](int n, const auto& v) { return n + v.second; });
  };
  EXPECT_EQ(sum(looks(1, 0)), 1);  // the first box is a debt for ever
  const auto few = looks(1, 3);
  EXPECT_EQ(most(few), 3);
  EXPECT_GE(sum(few), 2 * static_cast<int>(few.size()));
  EXPECT_GT(most(looks(0, 0)), 10);
}

TEST(ObjectTracker, SearchesLinesOfCrowdedNewObjectsInTurn) {
  const SyntheticDesk desk(1);
  ObjectFrame frame = desk.Frame(0);
  frame.gray = Tiles(frame.camera);
  const auto with_lines = [&](int objects) {
    frame.detections.clear();
    for (int i = 0; i < objects; ++i) {
      frame.detections.push_back({"cup", 0.9, {34.0 + 64.0 * (i % 8), 34.0 + 64.0 * (i / 8), 40.0, 40.0}});
    }
    ObjectOptions options;
    options.yaw.line_interval = 1;
    const auto seen = ObjectTracker(options).Track(frame, ObjectMapView());
    EXPECT_EQ(seen.size(), static_cast<std::size_t>(objects));
    return std::ranges::count_if(seen, [](const ObjectObservation& o) { return !o.lines.empty(); });
  };
  EXPECT_EQ(with_lines(32), 32);
  EXPECT_LT(with_lines(40), 8);
}

// Returns the number of boxes that belong to a landmark.
std::ptrdiff_t Associated(const std::vector<ObjectObservation>& observations) {
  return std::ranges::count_if(observations, [](const ObjectObservation& o) { return o.object_id >= 0; });
}

// But not a second time where it is known, or where something else is expected.
TEST(ObjectTracker, StartsNothingFromBareBoxWhereAnObjectIsExpected) {
  const SyntheticDesk desk(1);
  ObjectTracker tracker((ObjectOptions()));
  ObjectFrame frame = desk.Frame(0);
  frame.points = {{1, {20.0, 20.0}, {0.0, 0.0, 0.0}}};
  frame.detections = {{"cup", 0.9, {200.0, 200.0, 60.0, 60.0}}};
  EXPECT_EQ(Associated(tracker.Track(frame, ObjectMapView())), 1);
  ++frame.frame_index;
  frame.detections = {{"bowl", 0.9, {230.0, 210.0, 60.0, 60.0}}};
  const std::vector<ObjectObservation> left = tracker.Track(frame, ObjectMapView());
  ASSERT_EQ(left.size(), 1U) << "for the association at the end";
  EXPECT_EQ(left.front().object_id, -1);
  frame.detections = {{"bowl", 0.9, {400.0, 210.0, 60.0, 60.0}}};
  EXPECT_EQ(Associated(tracker.Track(frame, ObjectMapView())), 1);
  ObjectOptions paper;
  paper.method = ObjectMethod::kPaper;
  EXPECT_EQ(Associated(ObjectTracker(paper).Track(frame, ObjectMapView())), 0) << "the paper needs points";
}

TEST(ObjectTracker, StartsNothingFromPartOfABoxedObject) {
  const SyntheticDesk desk(1);
  ObjectFrame frame = desk.Frame(0);
  frame.points.clear();
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector2d pixel(205.0 + 10.0 * (i % 6), 105.0 + 20.0 * (i / 6));
    frame.points.push_back({i, pixel, frame.T_map_camera * (2.0 * frame.camera.Unproject(pixel))});
  }
  const auto count = [&](ObjectMethod method, const char* label, const Box2d& second) {
    ObjectOptions options;
    options.method = method;
    frame.detections = {{"chair", 0.9, {200.0, 100.0, 70.0, 200.0}}, {label, 0.8, second}};
    return Associated(ObjectTracker(options).Track(frame, ObjectMapView()));
  };
  const Box2d back(200.0, 100.0, 70.0, 85.0);
  EXPECT_EQ(count(ObjectMethod::kRefined, "chair", back), 1);
  EXPECT_EQ(count(ObjectMethod::kRefined, "book", back), 2) << "leans on the chair";
  EXPECT_EQ(count(ObjectMethod::kRefined, "chair", {180.0, 100.0, 70.0, 85.0}), 2) << "reaches beyond";
  EXPECT_EQ(count(ObjectMethod::kRefined, "chair", {210.0, 100.0, 30.0, 60.0}), 2) << "far behind it";
  EXPECT_EQ(count(ObjectMethod::kRefined, "chair", {215.0, 130.0, 45.0, 140.0}), 2) << "lies on top of it";
  EXPECT_EQ(count(ObjectMethod::kPaper, "chair", back), 2);
}

TEST(ObjectTracker, IgnoresFramesWithoutPointsOrBoxes) {
  const SyntheticDesk desk(1);
  ObjectTracker tracker((ObjectOptions()));
  ObjectFrame frame = desk.Frame(0);
  frame.points.clear();
  EXPECT_TRUE(tracker.Track(frame, ObjectMapView()).empty());
  frame = desk.Frame(1);
  frame.detections.clear();
  EXPECT_TRUE(tracker.Track(frame, ObjectMapView()).empty());
}

}  // namespace
}  // namespace sqslam
