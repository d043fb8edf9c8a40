#include "app/export/map_view.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <span>

#include "app/export/map_export.h"
#include "render/camera/scene_framing.h"
#include "render/picture/picture.h"
#include "render/scene/object_look.h"
#include "render/scene/style.h"
#include "slam/io/image_files.h"
#include "slam/io/input_images.h"
#include "slam/io/trajectory.h"
#include "slam/scene/labelled_scene.h"
#include "slam/scene/query.h"
#include "slam/scene/question.h"
#include "slam/scene/scene_graph.h"
#include "slam/util/data_path.h"
#include "slam/util/thinned.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

using ViewJson = nlohmann::ordered_json;

// Rounds to five significant digits: finer than any map's accuracy, at half the file size.
double Short(double value) {
  if (value == 0.0 || !std::isfinite(value)) {
    return 0.0;
  }
  const double unit = std::pow(10.0, 4.0 - std::floor(std::log10(std::abs(value))));
  return std::round(value * unit) / unit;
}

void Append(ViewJson& list, const auto& vector) {
  for (Eigen::Index i = 0; i < vector.size(); ++i) {
    list.push_back(Short(vector[i]));
  }
}

ViewJson ListOf(const auto& vector) {
  ViewJson list = ViewJson::array();
  Append(list, vector);
  return list;
}

ViewJson PoseOf(const Rigid3d& pose) {
  ViewJson list = ListOf(pose.translation);
  Append(list, pose.rotation.coeffs());  // x y z w
  return list;
}

constexpr std::size_t kBestViews = 3;  // at most, per object

// Returns the words of questions and what they ask for: see assets/view/ask.js.
ViewJson QuestionData(const MapSnapshot& map, const SceneGraph& graph) {
  const ClassTable classes = ClassTable::Named("default");
  ViewJson data = {
      {"terms", ViewJson::object()},
      {"classes", ViewJson::array()},
      {"nodes", ToVector(graph.nodes, [](const SceneNode& node) { return std::string(NameOf(node.kind)); })},
      {"relations", ViewJson::array()},
      {"extents", ViewJson::array()},
      {"distances", ViewJson::array()}};
  for (const auto& [phrase, term] : question::Terms()) {
    data["terms"][phrase] = {NameOf(term.role), term.value};
  }
  for (const auto& [label, traits] : classes.All()) {
    data["classes"].push_back({label, traits.legs ? 1 : 0, traits.synonyms});
  }
  for (const SceneRelation& relation : graph.relations) {
    data["relations"].push_back(
        {NameOf(relation.kind), relation.subject, relation.other, Short(relation.probability)});
  }
  for (const SnapshotObject& object : map.objects) {
    const PlacedSolid placed(object.superquadric, classes.Of(object.label));
    data["extents"].push_back({Short(placed.solid.shape.Volume()), Short(placed.bottom), Short(placed.top)});
  }
  const std::vector<std::vector<double>> distances = DistancesToNodes(map, graph, classes);
  for (std::size_t a = 0; a < distances.size(); ++a) {  // symmetric: to the nodes after it
    data["distances"].push_back(ToVector(std::span(distances[a]).subspan(a + 1), Short));
  }
  return data;
}

class MapViewWriter {
 public:
  MapViewWriter(const RecordingReader& reader, const ViewHistory& history, const fs::path& recording,
                const MapViewExtras& extras, const MapViewOptions& options)
      : reader_(reader),
        recording_(recording),
        extras_(extras),
        options_(options),
        map_(*reader.Last()),
        history_(history),
        cloud_(ReadCloudLayer(recording)) {
    std::ranges::sort(map_.keyframes, {}, &SnapshotKeyframe::timestamp);
    colors_ = LabelColors(extras_.style.objects.colors);
    start_ = map_.keyframes.empty() ? 0.0 : map_.keyframes.front().timestamp;
  }

  MapView Write() {
    outlines_ = FindOutlines(map_, history_, options_.outline_tolerance);
    AddImages();
    scene_["title"] = extras_.title;
    scene_["program"] = "sqslam " SQSLAM_VERSION;
    std::vector<std::string> command = {"sqslam", "render", AbsolutePath(recording_).string()};
    command.insert(command.end(), extras_.render_options.begin(), extras_.render_options.end());
    scene_["command"] = command;
    scene_["metres"] = Short(extras_.metres > 0.0 ? extras_.metres : map_.metric ? 1.0 : 0.0);
    scene_["upright"] = map_.gravity_known;
    AddLook();
    AddObjects();
    AddRelations();
    AddKeyframes();
    AddPath();
    AddGeometry();
    view_.scene = scene_.dump(-1, ' ', false, ViewJson::error_handler_t::replace);
    return std::move(view_);
  }

 private:
  double Since(double timestamp) const { return std::max(0.0, std::round(1e3 * (timestamp - start_)) / 1e3); }

  // Selects the keyframes to show for an object: those that see it large and whole, from different sides.
  std::vector<std::size_t> BestViews(std::size_t object) const {
    std::vector<std::pair<double, std::size_t>> ranked;
    for (const SeenOutline& outline : outlines_) {
      if (outline.object == object && outline.share > 0.0) {
        const double rank =
            std::sqrt(outline.share) * (outline.whole ? 1.0 : 0.4) * (outline.detected ? 1.0 : 0.1);
        ranked.emplace_back(rank, outline.keyframe);
      }
    }
    std::ranges::sort(ranked, std::greater());
    constexpr double kMaxCosine = 0.94;  // cosine of 20 degrees
    const Eigen::Vector3d center = map_.objects[object].superquadric.T_map_object.translation;
    const auto direction = [&](std::size_t k) {
      return Eigen::Vector3d((map_.keyframes[k].T_map_camera.translation - center).normalized());
    };
    std::vector<std::size_t> best;
    for (const auto& [rank, k] : ranked) {
      if (best.size() < kBestViews && std::ranges::all_of(best, [&, k = k](std::size_t other) {
            return direction(k).dot(direction(other)) < kMaxCosine;
          })) {
        best.push_back(k);
      }
    }
    return best;
  }

  // Selects the keyframes that get an image: the objects' best views, ranked first for every object before
  // ranked second for any, then an even sample of all keyframes.
  std::set<std::size_t> ChooseImages() {
    const auto most = static_cast<std::size_t>(options_.images);
    std::set<std::size_t> wanted;
    for (std::size_t i = 0; i < map_.objects.size(); ++i) {
      best_views_.push_back(BestViews(i));
    }
    for (std::size_t rank = 0; rank < kBestViews; ++rank) {
      for (const std::vector<std::size_t>& views : best_views_) {
        if (rank < views.size() && wanted.size() < most) {
          wanted.insert(views[rank]);
        }
      }
    }
    const std::size_t count = map_.keyframes.size();
    const std::size_t room = most - wanted.size();
    for (std::size_t i = 0; i < std::min(room, count); ++i) {
      wanted.insert(i * count / std::min(room, count));
    }
    return wanted;
  }

  void AddImages() {
    const std::set<std::size_t> wanted = ChooseImages();
    image_of_.assign(map_.keyframes.size(), -1);
    InputImages images(reader_);
    for (const std::size_t k : wanted) {
      const cv::Mat image = images.Read(history_.image_files, map_.keyframes[k].frame_index);
      if (image.empty()) {  // no longer available: the keyframe stays without an image
        continue;
      }
      const int height = cvRound(static_cast<double>(options_.image_width) * image.rows / image.cols);
      image_of_[k] = static_cast<int>(view_.images.size());
      view_.images.push_back(EncodedImage(".jpg", Resized(image, {options_.image_width, height}),
                                          {cv::IMWRITE_JPEG_QUALITY, options_.image_quality}));
    }
  }

  void AddLook() {
    SceneFocus focus = FindFocus(map_);
    IncludeLayers({{}, cloud_, nullptr}, focus);
    const ViewCamera eye = FrameScene(focus, 16.0 / 9.0);
    scene_["look"] = {{"eye", ListOf(eye.position)},    {"at", ListOf(eye.focal_point)},
                      {"angle", eye.view_angle},        {"center", ListOf(focus.center)},
                      {"radius", Short(focus.radius)},  {"ground", Short(focus.ground_height)},
                      {"cell", Short(GridCell(focus))}, {"up", ListOf(focus.up)}};
    const Camera& camera = map_.camera;
    scene_["lens"] = {{"width", camera.width},
                      {"height", camera.height},
                      {"fx", Short(camera.fx)},
                      {"fy", Short(camera.fy)},
                      {"cx", Short(camera.cx)},
                      {"cy", Short(camera.cy)},
                      {"size", Short(extras_.style.cameras.size * focus.radius)}};
  }

  // Adds to each object its likely relations in words, [["on", "dining table 1"], ...], and to the page what
  // it needs to answer questions.
  void AddRelations() {
    const SceneGraph graph = SceneGraphOf(map_, recording_.parent_path());
    scene_["questions"] = QuestionData(map_, graph);
    for (const SceneRelation& relation : graph.relations) {
      const auto add = [&](int of, int to) {
        if (static_cast<std::size_t>(of) < map_.objects.size()) {
          scene_["objects"][static_cast<std::size_t>(of)]["relations"].push_back(
              {NameOf(relation.kind), TitleOf(graph.nodes[static_cast<std::size_t>(to)])});
        }
      };
      if (relation.IsLikely()) {
        add(relation.subject, relation.other);
        if (relation.kind == RelationKind::kNextTo) {
          add(relation.other, relation.subject);
        }
      }
    }
  }

  void AddObjects() {
    scene_["objects"] = ViewJson::array();
    for (std::size_t i = 0; i < map_.objects.size(); ++i) {
      const SnapshotObject& object = map_.objects[i];
      const Superquadric& shape = object.superquadric.shape;
      const auto first = history_.first_seen.find(object.id);
      scene_["objects"].push_back({{"id", object.id},
                                   {"name", ReadableLabel(ShownName(object))},
                                   {"label", ReadableLabel(object.label)},
                                   {"color", FormatColor(colors_(object.label))},
                                   {"score", Short(object.score)},
                                   {"seen", object.observations},
                                   {"points", object.points},
                                   {"reliability", Short(object.fit.reliability)},
                                   {"uncertain", !IsReliable(object)},
                                   {"hollow", LookOf(object, {}, false) == ObjectLook::kGlass},
                                   {"size", ListOf(Eigen::Vector3d(2.0 * shape.half_size))},
                                   {"shape", {Short(shape.e1), Short(shape.e2)}},
                                   {"yaw", Short(object.yaw)},
                                   {"pose", PoseOf(object.superquadric.T_map_object)},
                                   {"first", first == history_.first_seen.end() ? 0.0 : Since(first->second)},
                                   {"views", best_views_[i]}});
      if (extras_.truth && extras_.truth->iou.contains(object.id)) {
        scene_["objects"].back()["iou"] = Short(extras_.truth->iou.at(object.id));
      }
    }
  }

  void AddKeyframes() {
    ViewJson& list = scene_["keyframes"] = ViewJson::array();
    for (std::size_t k = 0; k < map_.keyframes.size(); ++k) {
      const SnapshotKeyframe& keyframe = map_.keyframes[k];
      list.push_back({{"id", keyframe.id},
                      {"frame", keyframe.frame_index},
                      {"time", Since(keyframe.timestamp)},
                      {"pose", PoseOf(keyframe.T_map_camera)},
                      {"image", image_of_[k]},
                      {"outlines", ViewJson::array()}});
    }
    for (const SeenOutline& outline : outlines_) {  // nearest first
      if (image_of_[outline.keyframe] >= 0) {
        ViewJson polygon = ViewJson::array();
        for (const cv::Point& p : outline.polygon) {
          polygon.push_back(p.x);
          polygon.push_back(p.y);
        }
        list[outline.keyframe]["outlines"].push_back(
            {outline.object, outline.detected ? 1 : 0, std::move(polygon)});
      }
    }
  }

  // Adds the camera poses of all tracked frames (subsampled if there are many) and the true path.
  void AddPath() {
    constexpr std::size_t kPoses = 3000;
    ViewJson times = ViewJson::array();
    ViewJson poses = ViewJson::array();
    for (const TimedPose& pose : Thinned(TrackedPoses(recording_, map_), kPoses)) {
      times.push_back(Since(pose.timestamp));
      for (const ViewJson& value : PoseOf(pose.T_map_camera)) {
        poses.push_back(value);
      }
    }
    scene_["path"] = {{"times", std::move(times)}, {"poses", std::move(poses)}};
    scene_["truth"] = ViewJson::array();
    for (const std::vector<Eigen::Vector3d>& piece : extras_.true_path) {
      ViewJson list = ViewJson::array();
      for (const Eigen::Vector3d& p : Thinned(piece, kPoses)) {
        Append(list, p);
      }
      scene_["truth"].push_back(std::move(list));
    }
  }

  // Rounds to a grid far finer than the points' accuracy: trailing zero bits compress well.
  Eigen::Vector3f Snapped(const Eigen::Vector3f& p, float step) const {
    return (p / step).array().round().matrix() * step;
  }

  // Sorts the points by the keyframe that first sees them; returns how many each has seen with all before.
  template <typename Point>
  ViewJson SortByFirstView(std::vector<Point>& points) const {
    const std::vector<std::size_t> first = FirstViews(map_, ToVector(points, &Point::p_map));
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return first[i]; });
    std::vector<Point> sorted;
    std::vector<int> counts(std::max<std::size_t>(1, map_.keyframes.size()), 0);
    for (const std::size_t i : order) {
      sorted.push_back(points[i]);
      ++counts[first[i]];
    }
    points = std::move(sorted);
    std::partial_sum(counts.begin(), counts.end(), counts.begin());
    return counts;
  }

  void AddGeometry() {
    const double radius = std::max(1e-6, scene_["look"]["radius"].get<double>());
    const auto step = static_cast<float>(std::exp2(std::floor(std::log2(radius / 4096.0))));
    MapSnapshot drawn = map_;
    drawn.points = Thinned(drawn.points, std::max<std::size_t>(1, options_.points));
    scene_["points"] = SortByFirstView(drawn.points);
    for (SnapshotPoint& point : drawn.points) {
      point.p_map = Snapped(point.p_map, step);
    }
    std::vector<CloudPoint> cloud;
    if (cloud_) {
      int rank = 0;
      while (std::ranges::count_if(cloud_->points, [&](const CloudPoint& p) { return p.rank >= rank; }) >
                 static_cast<std::ptrdiff_t>(options_.cloud) &&
             rank < CloudLayer::kRanks) {
        ++rank;
      }
      std::ranges::copy_if(cloud_->points, std::back_inserter(cloud),
                           [&](const CloudPoint& p) { return p.rank >= rank; });
      scene_["cloud_spacing"] = Short(cloud_->spacing * std::exp2(0.5 * rank));
    }
    scene_["cloud"] = SortByFirstView(cloud);
    for (CloudPoint& point : cloud) {
      point.p_map = Snapped(point.p_map, step);
    }
    view_.glb = ViewGlb(drawn, cloud, options_.segments, "sqslam " SQSLAM_VERSION, extras_.style);
  }

  const RecordingReader& reader_;
  fs::path recording_;
  const MapViewExtras& extras_;
  MapViewOptions options_;
  MapSnapshot map_;
  const ViewHistory& history_;
  LabelColors colors_;
  CloudLayerPtr cloud_;  // may be null
  double start_ = 0.0;   // seconds
  std::vector<SeenOutline> outlines_;
  std::vector<std::vector<std::size_t>> best_views_;  // of each object: keyframes
  std::vector<int> image_of_;                         // of each keyframe; -1: none
  ViewJson scene_;
  MapView view_;
};

}  // namespace

MapView ReadMapView(const RecordingReader& reader, const ViewHistory& history, const fs::path& recording,
                    const MapViewExtras& extras, const MapViewOptions& options) {
  return MapViewWriter(reader, history, recording, extras, options).Write();
}

}  // namespace sqslam::app
