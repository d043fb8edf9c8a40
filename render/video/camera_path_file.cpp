#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "render/camera/scene_framing.h"
#include "render/video/video.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam {
namespace {

[[noreturn]] void Fail(const CameraPathFile& file, int line, const std::string& message) {
  throw UsageError("{}:{}: {}", file.path.string(), line, message);
}

// The values of a file and of a key. Whether one is given, the document says.
struct FileFields {
  CameraPathFile& file;
  std::string easing = "smooth";
  double duration = 1.0;

  void VisitFields(auto&& visit) {
    visit("easing", easing, {"linear", "smooth"});
    visit("loop", file.loop);
    visit("duration", duration, 1e-3, 1e5);
  }
};

struct KeyFields {
  using Numbers = std::array<double, 3>;

  double time = 0.0;
  double frame = 0.0;  // of the video
  std::string view;
  std::int64_t keyframe = 0;
  std::int64_t camera_frame = 0;
  Numbers position{}, focal_point{}, view_up{};
  double view_angle = 30.0;
  double azimuth = 0.0;
  double elevation = 0.0;
  double zoom = 1.0;

  void VisitFields(auto&& visit) {
    constexpr std::int64_t kMaxId = std::numeric_limits<std::int64_t>::max();
    constexpr double kMaxCoordinate = 1e9;
    visit("time", time, 0.0, 1e5);
    visit("frame", frame, 0.0, 1e7);
    visit("view", view);
    visit("keyframe", keyframe, 0, kMaxId);
    visit("camera_frame", camera_frame, 0, kMaxId);
    visit("position", position, -kMaxCoordinate, kMaxCoordinate);
    visit("focal_point", focal_point, -kMaxCoordinate, kMaxCoordinate);
    visit("view_up", view_up, -kMaxCoordinate, kMaxCoordinate);
    visit("view_angle", view_angle, 1.0, 170.0);
    visit("azimuth", azimuth, -3600.0, 3600.0);
    visit("elevation", elevation, -180.0, 180.0);
    visit("zoom", zoom, 0.01, 100.0);
  }
};

CameraKey ReadKey(const YAML::Node& node, const CameraPathFile& file, double fps) {
  CameraKey key;
  key.line = node.Mark().line + 1;
  if (!node.IsMap()) {
    Fail(file, key.line, "key: expected values in braces, such as {time: 0, view: front}");
  }
  KeyFields read;
  std::vector<OptionField> fields = OptionFields(read);
  std::vector<std::string>& views = std::ranges::find(fields, "view", &OptionField::key)->allowed;
  views = ViewPresetNames();
  views.emplace_back("default");
  AssignOptions(node, file.path.string(), fields);
  const auto given = [&](const char* name, const auto& value) {
    return node[name] ? std::optional(value) : std::nullopt;
  };
  const auto vector = [&](const char* name, const KeyFields::Numbers& value) {
    return given(name, Eigen::Vector3d(value.data()));
  };
  if (node["time"] && node["frame"]) {
    Fail(file, key.line, "time and frame: expected one of them");
  }
  key.time = node["frame"] ? std::optional(read.frame / fps) : given("time", read.time);
  key.view = read.view;
  key.keyframe = given("keyframe", read.keyframe);
  key.camera_frame = given("camera_frame", read.camera_frame);
  CameraOverrides& o = key.overrides;
  o.position = vector("position", read.position);
  o.focal_point = vector("focal_point", read.focal_point);
  o.view_up = vector("view_up", read.view_up);
  if (o.view_up && o.view_up->norm() < 1e-9) {
    Fail(file, key.line, "view_up: expected a direction, not zero");
  }
  o.view_angle = given("view_angle", read.view_angle);
  o.azimuth = read.azimuth;
  o.elevation = read.elevation;
  o.zoom = read.zoom;
  const int places = (key.view.empty() ? 0 : 1) + (key.keyframe ? 1 : 0) + (key.camera_frame ? 1 : 0);
  if (places > 1 || (places == 0 && !(o.position && o.focal_point))) {
    Fail(file, key.line, "key: expected one of view, keyframe, camera_frame, or position and focal_point");
  }
  return key;
}

void CheckTimes(const CameraPathFile& file) {
  const CameraKey* last = nullptr;
  for (const CameraKey& key : file.keys) {
    if (key.time.has_value() != file.keys.front().time.has_value()) {
      Fail(file, key.line, "time: expected for all keys or for none");
    }
    if (last != nullptr && key.time && *key.time <= *last->time) {
      Fail(file, key.line,
           fmt::format("time: {:g} s, expected more than the {:g} s of the key before", *key.time,
                       *last->time));
    }
    last = &key;
  }
  if (file.duration && last->time &&
      (*file.duration < *last->time || (file.loop && *file.duration == *last->time))) {
    Fail(file, last->line,
         fmt::format("time: {:g} s, expected less than the duration of {:g} s", *last->time, *file.duration));
  }
}

// A view as a vector for the splines: focal point, direction and log-distance of the camera from it, up
// vector, view angle. Between two views of one object, the camera then moves around the object, not through
// it.
using ViewVector = Eigen::Matrix<double, 11, 1>;

ViewVector VectorOf(const ViewCamera& view) {
  const Eigen::Vector3d offset = view.position - view.focal_point;
  const double distance = std::max(offset.norm(), 1e-9);
  ViewVector v;
  v << view.focal_point, offset / distance, std::log(distance), view.view_up.normalized(), view.view_angle;
  return v;
}

ViewCamera ToView(const ViewVector& v) {
  const Eigen::Vector3d focal_point = v.segment<3>(0);
  return {focal_point + std::exp(v[6]) * v.segment<3>(3).normalized(),
          focal_point,
          v.segment<3>(7).normalized(),
          v[10],
          {}};
}

struct Knot {
  double time;
  ViewVector value;
};

// Appends intermediate knots if the directions of two keys differ by more than kMaxTurn, so that the spline
// stays close to the unit sphere.
void AppendBetween(const Knot& from, const Knot& to, std::vector<Knot>& knots) {
  constexpr double kMaxTurn = std::numbers::pi / 4.0;
  const Eigen::Vector3d a = from.value.segment<3>(3);
  const Eigen::Vector3d b = to.value.segment<3>(3);
  Eigen::Vector3d axis = a.cross(b);
  const double angle = std::atan2(axis.norm(), a.dot(b));
  if (axis.norm() < 1e-3) {  // opposite directions: turn about the vertical if possible
    const Eigen::Vector3d up = from.value.segment<3>(7);
    axis = std::abs(up.dot(a)) < 0.9 ? Eigen::Vector3d(up - up.dot(a) * a) : a.unitOrthogonal();
  }
  const int pieces = static_cast<int>(std::ceil(angle / kMaxTurn));
  for (int i = 1; i < pieces; ++i) {
    const double t = static_cast<double>(i) / pieces;
    Knot knot{(1.0 - t) * from.time + t * to.time, (1.0 - t) * from.value + t * to.value};
    knot.value.segment<3>(3) = Eigen::AngleAxisd(t * angle, axis.normalized()) * a;
    knots.push_back(knot);
  }
}

// Returns the slope at a knot of the parabola through it and its neighbours.
ViewVector Slope(const Knot& before, const Knot& at, const Knot& after) {
  const double a = at.time - before.time;
  const double b = after.time - at.time;
  return (b * (at.value - before.value) / a + a * (after.value - at.value) / b) / (a + b);
}

// A cubic spline through knots with increasing times. `rest`: zero velocity at both ends. With `period` > 0,
// the spline is closed: it continues from the last knot to the first.
class Spline {
 public:
  Spline(std::vector<Knot> knots, bool rest, double period) : knots_(std::move(knots)) {
    const std::size_t n = knots_.size();
    if (period > 0.0 && n >= 2) {  // repeat knots at both ends, so that all slopes have neighbours
      const Knot last = knots_.back();
      for (const std::size_t i : {0, 1}) {
        knots_.push_back({knots_[i].time + period, knots_[i].value});
      }
      knots_.insert(knots_.begin(), {last.time - period, last.value});
    }
    for (std::size_t i = 0; i < knots_.size(); ++i) {
      const bool end = i == 0 || i + 1 == knots_.size();
      if (!end) {
        slopes_.push_back(Slope(knots_[i - 1], knots_[i], knots_[i + 1]));
      } else if (rest || knots_.size() < 2) {
        slopes_.push_back(ViewVector::Zero());
      } else {
        const std::size_t a = i == 0 ? 0 : i - 1;
        slopes_.push_back((knots_[a + 1].value - knots_[a].value) / (knots_[a + 1].time - knots_[a].time));
      }
    }
  }

  ViewVector At(double time) const {
    if (time <= knots_.front().time || knots_.size() == 1) {
      return knots_.front().value;
    }
    if (time >= knots_.back().time) {
      return knots_.back().value;
    }
    const auto next = std::upper_bound(knots_.begin(), knots_.end(), time,
                                       [](double t, const Knot& knot) { return t < knot.time; });
    const auto i = static_cast<std::size_t>(next - knots_.begin()) - 1;
    const double step = knots_[i + 1].time - knots_[i].time;
    const double t = (time - knots_[i].time) / step;
    const double u = 1.0 - t;
    return u * u * (1.0 + 2.0 * t) * knots_[i].value + t * t * (3.0 - 2.0 * t) * knots_[i + 1].value +
           step * t * u * (u * slopes_[i] - t * slopes_[i + 1]);
  }

 private:
  std::vector<Knot> knots_;
  std::vector<ViewVector> slopes_;
};

Rigid3d KeyframePose(const CameraPathFile& file, const CameraKey& key, const MapSnapshot& map) {
  std::vector<std::int64_t> ids;
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    if (keyframe.id == *key.keyframe) {
      return keyframe.T_map_camera;
    }
    ids.push_back(keyframe.id);
  }
  const std::string known = ids.empty() ? "a map with keyframes" : fmt::format("{}", fmt::join(ids, ", "));
  Fail(file, key.line, fmt::format("keyframe: {} is not in the map, expected {}", *key.keyframe, known));
}

ViewCamera ViewOf(const CameraPathFile& file, const CameraKey& key, const MapSnapshot& map,
                  const SceneFocus& focus, double aspect, const FramePoses& frame_poses) {
  const double angle = key.overrides.view_angle.value_or(30.0);
  ViewCamera base;
  base.view_up = focus.up;
  if (key.keyframe) {
    base = FirstPerson(KeyframePose(file, key, map), map.camera, focus.view_depth);
  } else if (key.camera_frame) {
    try {
      base = FirstPerson(frame_poses(*key.camera_frame), map.camera, focus.view_depth);
    } catch (const UsageError& error) {
      Fail(file, key.line, fmt::format("camera_frame: {}", error.what()));
    }
  } else if (key.view == "default") {
    base = FrameScene(focus, aspect, angle);
  } else if (!key.view.empty()) {
    base = PresetView(key.view, focus, aspect, angle);
  }
  return key.overrides.ApplyTo(base);
}

}  // namespace

std::optional<double> CameraPathFile::Length() const {
  if (duration || !keys.back().time) {
    return duration;
  }
  const double last = *keys.back().time;
  const double steps =
      static_cast<double>(keys.size()) - 1.0;  // one more in a loop, which starts at its first key
  return loop && steps > 0.0 ? (last - *keys.front().time) * (steps + 1.0) / steps : last;
}

CameraPathFile ReadCameraPath(const std::filesystem::path& path, double fps) {
  CameraPathFile file;
  file.path = path;
  YAML::Node root;
  try {
    root = YAML::LoadFile(path.string());
  } catch (const YAML::BadFile&) {
    throw UsageError("{}: cannot be read, expected a camera path (YAML)", path.string());
  } catch (const YAML::Exception& error) {
    Fail(file, error.mark.line + 1, error.msg);
  }
  if (!root.IsMap() || !root["keys"] || !root["keys"].IsSequence() || root["keys"].size() < 1) {
    Fail(file, std::max(0, root.Mark().line) + 1, "expected keys: a list of one key at least");
  }
  FileFields fields{file};
  AssignOptions(root, path.string(), OptionFields(fields), {"keys"});
  file.smooth = fields.easing == "smooth";
  file.duration = root["duration"] ? std::optional(fields.duration) : std::nullopt;
  for (const YAML::Node& key : root["keys"]) {
    file.keys.push_back(ReadKey(key, file, fps));
  }
  CheckTimes(file);
  return file;
}

std::vector<ViewCamera> ViewsAlong(const CameraPathFile& file, const MapSnapshot& map,
                                   const PictureOptions& options, const FramePoses& frame_poses, int frames,
                                   double fps) {
  const SceneFocus focus = FindFocus(map);
  const double aspect = static_cast<double>(options.width) / options.height;
  // In a loop, the frame after the last one would equal the first.
  const double video = std::max(1, file.loop ? frames : frames - 1) / fps;
  const double length = file.Length().value_or(video);
  const double gaps = static_cast<double>(file.keys.size()) - (file.loop ? 0.0 : 1.0);
  std::vector<Knot> knots;
  for (std::size_t i = 0; i < file.keys.size(); ++i) {
    const CameraKey& key = file.keys[i];
    const double even = gaps > 0.0 ? length * static_cast<double>(i) / gaps : 0.0;
    const ViewCamera view = ViewOf(file, key, map, focus, aspect, frame_poses);
    const Knot knot{key.time.value_or(even), VectorOf(view)};
    if (i > 0) {
      AppendBetween(Knot(knots.back()), knot, knots);
    }
    knots.push_back(knot);
  }
  if (file.loop) {
    AppendBetween(Knot(knots.back()), {knots.front().time + length, knots.front().value}, knots);
  }
  const double first = knots.front().time;
  const Spline spline(std::move(knots), file.smooth, file.loop ? length : 0.0);
  std::vector<ViewCamera> views;
  for (int i = 0; i < frames; ++i) {
    const double time = i / fps;
    views.push_back(ToView(spline.At(file.loop ? first + std::fmod(time, length) : time)));
  }
  return views;
}

}  // namespace sqslam
