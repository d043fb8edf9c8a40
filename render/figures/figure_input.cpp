#include "render/figures/figure_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <set>

#include "render/camera/scene_framing.h"
#include "slam/evaluation/comparison.h"
#include "slam/geometry/span_in_box.h"
#include "slam/io/result_files.h"
#include "slam/util/text_lines.h"
#include "slam/util/thinned.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

// Returns begin and size of an interval of `length` around `center`, moved and cut to lie in [0, limit).
std::pair<int, int> Within(double center, double length, int limit) {
  const int size = std::clamp(static_cast<int>(std::ceil(length)), 2, limit);
  const int begin = std::clamp(static_cast<int>(std::floor(center - 0.5 * size)), 0, limit - size);
  return {begin, size};
}

}  // namespace

std::vector<std::string> ResultNames(const FigureRequest& request) {
  if (request.names.empty()) {
    return ShortNames({request.results.begin(), request.results.end()});
  }
  ThrowIf<UsageError>(request.names.size() != request.results.size(),
                      "--name: {} for {}, expected one for each result in their order", request.names.size(),
                      request.results.size());
  return request.names;
}

std::vector<double> ParseNumberList(const std::string& option, const std::string& text) {
  std::vector<double> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const auto number = ParseNumber<double>(std::string_view(text).substr(begin, end - begin));
    ThrowIf<UsageError>(!number, "{} {}: expected numbers with commas between them, such as 0.1,1", option,
                        text);
    numbers.push_back(*number);
    begin = end + 1;
  }
  return numbers;
}

RecordedMap OpenMap(const FigureRequest& request, const std::string& result) {
  auto reader = std::make_unique<RecordingReader>(request.open_map(ResultFile(result, "map.sqmap")));
  MapSnapshotPtr last = reader->Last();
  auto images = std::make_shared<InputImages>(*reader);
  return {std::move(reader), std::move(last), std::move(images)};
}

RecordedMap OpenObjectMap(const FigureRequest& request, const std::string& result) {
  RecordedMap map = OpenMap(request, result);
  ThrowIf<InputError>(map.last->objects.empty(), "{}: holds no object, expected a map with objects", result);
  return map;
}

SystemOptions ConfigOf(const RecordingReader& reader) {
  SystemOptions options;
  try {
    ParseOptions(reader.Info().config, "map.sqmap", options);
  } catch (const UsageError&) {
    return {};
  }
  return options;
}

const SnapshotObject& ObjectById(const MapSnapshot& map, int id, const std::string& result) {
  std::vector<std::string> known;
  for (const SnapshotObject& object : map.objects) {
    if (object.id == id) {
      return object;
    }
    known.push_back(fmt::format("{} {}", object.id, object.label));
  }
  throw InputError("{}: has no object {}, expected one of {}", result, id, fmt::join(known, ", "));
}

std::vector<const SnapshotObject*> ReliableObjects(const MapSnapshot& map) {
  const bool any = std::ranges::any_of(map.objects, IsReliable);
  std::vector<const SnapshotObject*> objects;
  for (const SnapshotObject& object : map.objects) {
    if (!any || IsReliable(object)) {
      objects.push_back(&object);
    }
  }
  return objects;
}

std::map<int, std::vector<ObjectView>> ObjectViews(const RecordedMap& map, bool all) {
  constexpr std::size_t kMaxRead = 300;  // snapshots
  std::map<std::int64_t, Rigid3d> poses;
  for (const SnapshotKeyframe& keyframe : map.last->keyframes) {
    poses[keyframe.frame_index] = keyframe.T_map_camera;
  }
  std::vector<int> of_keyframes;  // snapshot indices
  std::set<std::int64_t> seen;
  for (int i = 0; i < map.reader->Size(); ++i) {
    if (poses.contains(map.reader->FrameIndex(i)) && seen.insert(map.reader->FrameIndex(i)).second) {
      of_keyframes.push_back(i);
    }
  }
  std::map<int, std::vector<ObjectView>> views;
  for (const int i : Thinned(of_keyframes, all ? of_keyframes.size() : kMaxRead)) {
    const MapSnapshotPtr moment = map.reader->Read(i);
    const bool has_image = map.images->Has(*moment);
    for (const SnapshotDetection& box : moment->detections) {
      if (has_image && box.object_id >= 0) {
        views[box.object_id].push_back({moment, poses.at(moment->frame_index), box.detection.box});
      }
    }
  }
  return views;
}

std::vector<ObjectView> ViewsOfFrame(const std::map<int, std::vector<ObjectView>>& all_views, int id,
                                     const FigureRequest& request, const std::string& what) {
  const auto found = all_views.find(id);
  ThrowIf<InputError>(
      found == all_views.end(),
      "{}: no keyframe with its image and a box of it, expected a map made from images that are still there",
      what);
  const std::vector<ObjectView>& views = found->second;
  if (request.frames.empty()) {
    return views;
  }
  std::vector<ObjectView> chosen;
  std::vector<std::string> known;
  for (const ObjectView& view : views) {
    if (view.moment->frame_index == request.frames.front()) {
      chosen.push_back(view);
    }
    known.push_back(std::to_string(view.moment->frame_index));
  }
  ThrowIf<InputError>(chosen.empty(), "{}: not in a keyframe {}, expected one of {}", what,
                      request.frames.front(), fmt::join(known, ", "));
  return chosen;
}

cv::Mat ImageOf(const ObjectView& view, const RecordedMap& map) {
  const Camera& camera = map.last->camera;
  cv::Mat image = map.images->Read(*view.moment);
  ThrowIf<InputError>(image.cols != camera.width || image.rows != camera.height,
                      "frame {}: its image has {}x{} pixels, expected {}x{} ({})", view.moment->frame_index,
                      image.cols, image.rows, camera.width, camera.height, map.images->WhyNot());
  return image;
}

int UprightTurns(const ObjectView& view, const MapSnapshot& map) {
  constexpr double kMinUpright = 0.35;  // sine of the angle between line of sight and up
  const Eigen::Vector3d up = view.T_map_camera.RotationMatrix().transpose() * Eigen::Vector3d::UnitZ();
  if (!map.gravity_known || up.head<2>().norm() < kMinUpright) {
    return 0;
  }
  const double clockwise = std::atan2(up.x(), -up.y());  // angle of up in the image
  return (4 - static_cast<int>(std::lround(clockwise / (0.5 * std::numbers::pi)))) % 4;
}

ViewCamera EyeOn(const MapSnapshot& map, const std::vector<PosedSuperquadric>& solids,
                 const std::vector<Eigen::Vector3d>& points, double reach, double aspect) {
  std::vector<Eigen::Vector3d> outline;
  for (const PosedSuperquadric& solid : solids) {
    const std::array<Eigen::Vector3d, 8> corners = BoxCorners(solid);
    outline.insert(outline.end(), corners.begin(), corners.end());
  }
  const PosedSuperquadric& first = solids.front();
  std::ranges::copy_if(points, std::back_inserter(outline), [&](const Eigen::Vector3d& p) {
    return (p - first.T_map_object.translation).norm() < reach * first.shape.half_size.norm();
  });
  return FitOutline(FrameScene(FindFocus(map), aspect), outline, aspect, WithinMargin(0.06));
}

void DrawNoImage(FigureSheet& sheet, const FigureRect& area) {
  const FigureTheme& theme = sheet.theme;
  sheet.page.Rect(area, theme.faint);
  sheet.page.Text("no image", area.Center(), theme.small, theme.muted, TextAlign::kCenter);
}

ImageCrop::ImageCrop(const cv::Mat& image, const Box2d& region, int quarter_turns, const FigureRect& panel) {
  const bool across = quarter_turns % 2 != 0;
  const double aspect = across ? panel.height / panel.width : panel.width / panel.height;
  const double width = std::max(region.width, region.height * aspect);
  const auto [x, columns] = Within(region.Center().x(), width, image.cols);
  const auto [y, rows] = Within(region.Center().y(), width / aspect, image.rows);
  image_ = image(cv::Rect(x, y, columns, rows)).clone();
  // Fractions of the cut-out from its corner; pixel centres lie at whole numbers.
  Eigen::Affine2d fractions(Eigen::Scaling(1.0 / columns, 1.0 / rows) *
                            Eigen::Translation2d(0.5 - x, 0.5 - y));
  for (int i = 0; i < quarter_turns; ++i) {
    cv::rotate(image_.clone(), image_, cv::ROTATE_90_CLOCKWISE);
    fractions = Eigen::Translation2d(1.0, 0.0) * Eigen::Rotation2Dd(0.5 * std::numbers::pi) * fractions;
  }
  area_ = panel.Fitted(image_.cols, image_.rows);
  page_from_pixel_ =
      Eigen::Translation2d(area_.x, area_.y) * Eigen::Scaling(area_.width, area_.height) * fractions;
}

bool ImageCrop::Contains(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d at = ToPage(pixel);
  return area_.Contains({at.x(), at.y(), 0.0, 0.0});
}

void ImageCrop::DrawLine(FigurePage& page, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                         const FigureStroke& stroke) const {
  const Eigen::Vector2d start = ToPage(from);
  const Eigen::Vector2d way = ToPage(to) - start;
  const Eigen::Vector2d low(area_.x, area_.y);
  const Eigen::Vector2d high(area_.Right(), area_.Bottom());
  if (const auto span = SpanInBox(start, way, low, high, 1.0)) {
    page.Line(start + span->begin * way, start + span->end * way, stroke);
  }
}

}  // namespace sqslam
