#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/camera/scene_framing.h"
#include "render/video/video.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam {
namespace {

[[noreturn]] void Fail(const CameraPathFile& file, int line, const std::string& message) {
  throw UsageError(fmt::format("{}:{}: {}", file.path.string(), line, message));
}

class Reader {
 public:
  Reader(const std::filesystem::path& path, double fps) : fps_(fps) { file_.path = path; }

  CameraPathFile Read() {
    YAML::Node root;
    try {
      root = YAML::LoadFile(file_.path.string());
    } catch (const YAML::BadFile&) {
      throw UsageError(fmt::format("{}: cannot be read, expected a camera path (YAML)", file_.path.string()));
    } catch (const YAML::Exception& error) {
      Fail(file_, error.mark.line + 1, error.msg);
    }
    CheckNames(root, {"easing", "loop", "duration", "keys"}, "camera path");
    file_.smooth =
        Word(root, "easing", {"linear", "smooth"}, "linear or smooth").value_or("smooth") == "smooth";
    file_.loop = Get<bool>(root, "loop", "true or false").value_or(false);
    file_.duration = Number(root, "duration", 1e-3, 1e5, "seconds");
    const YAML::Node keys = root["keys"];
    if (!keys || !keys.IsSequence() || keys.size() < 1) {
      FailAt(keys ? keys : root, "keys: expected a list of one key at least");
    }
    for (const YAML::Node& key : keys) {
      file_.keys.push_back(ReadKey(key));
    }
    CheckTimes();
    return file_;
  }

 private:
  [[noreturn]] void FailAt(const YAML::Node& node, const std::string& message) const {
    Fail(file_, node.Mark().line + 1, message);
  }

  // Returns the value of a key, if present.
  template <typename T>
  std::optional<T> Get(const YAML::Node& parent, const std::string& key, const std::string& expected) const {
    const YAML::Node node = parent[key];
    try {
      return node ? std::optional(node.as<T>()) : std::nullopt;
    } catch (const YAML::Exception&) {
      FailAt(node, fmt::format("{}: expected {}", key, expected));
    }
  }

  std::optional<std::string> Word(const YAML::Node& parent, const std::string& key,
                                  const std::vector<std::string>& words, const std::string& expected) const {
    const std::optional<std::string> word = Get<std::string>(parent, key, expected);
    if (word && std::find(words.begin(), words.end(), *word) == words.end()) {
      FailAt(parent[key], fmt::format("{}: {}, expected {}", key, *word, expected));
    }
    return word;
  }

  std::optional<double> Number(const YAML::Node& parent, const std::string& key, double min, double max,
                               const std::string& unit) const {
    const std::string expected = fmt::format("{} from {} to {}", unit, min, max);
    const std::optional<double> value = Get<double>(parent, key, expected);
    if (value && !(*value >= min && *value <= max)) {
      FailAt(parent[key], fmt::format("{}: {}, expected {}", key, *value, expected));
    }
    return value;
  }

  std::optional<Eigen::Vector3d> Vector(const YAML::Node& parent, const std::string& key) const {
    const auto p = Get<std::array<double, 3>>(parent, key, "three numbers [x, y, z]");
    return p ? std::optional(Eigen::Vector3d(p->data())) : std::nullopt;
  }

  void CheckNames(const YAML::Node& node, const std::vector<std::string>& names,
                  const std::string& what) const {
    const std::string all = fmt::format("{}", fmt::join(names, ", "));
    if (!node.IsMap()) {
      FailAt(node, fmt::format("expected a {} with {}", what, all));
    }
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) {
        FailAt(entry.first, fmt::format("expected a word before the colon, one of {}", all));
      }
      const auto name = entry.first.as<std::string>();
      if (std::find(names.begin(), names.end(), name) == names.end()) {
        const std::string nearest = NearestWord(name, names);
        FailAt(entry.first, fmt::format("{}: unknown, expected {}", name, nearest.empty() ? all : nearest));
      }
    }
  }

  CameraKey ReadKey(const YAML::Node& node) const {
    CheckNames(node,
               {"time", "frame", "view", "keyframe", "camera_frame", "position", "focal_point", "view_up",
                "view_angle", "azimuth", "elevation", "zoom"},
               "key");
    CameraKey key;
    key.line = node.Mark().line + 1;
    if (node["time"] && node["frame"]) {
      FailAt(node, "time and frame: expected one of them");
    }
    key.time = Number(node, "time", 0.0, 1e5, "seconds");
    if (const auto frame = Number(node, "frame", 0.0, 1e7, "a frame of the video")) {
      key.time = *frame / fps_;
    }
    std::vector<std::string> views = ViewPresetNames();
    views.emplace_back("default");
    key.view = Word(node, "view", views, fmt::format("{}", fmt::join(views, ", "))).value_or("");
    key.keyframe = Get<std::int64_t>(node, "keyframe", "the id of a keyframe");
    key.camera_frame = Get<std::int64_t>(node, "camera_frame", "a frame of the run");
    CameraOverrides& o = key.overrides;
    o.position = Vector(node, "position");
    o.focal_point = Vector(node, "focal_point");
    o.view_up = Vector(node, "view_up");
    if (o.view_up && o.view_up->norm() < 1e-9) {
      FailAt(node["view_up"], "view_up: expected a direction, not zero");
    }
    o.view_angle = Number(node, "view_angle", 1.0, 170.0, "degrees");
    o.azimuth = Number(node, "azimuth", -3600.0, 3600.0, "degrees").value_or(0.0);
    o.elevation = Number(node, "elevation", -180.0, 180.0, "degrees").value_or(0.0);
    o.zoom = Number(node, "zoom", 0.01, 100.0, "a factor").value_or(1.0);
    const int places = (key.view.empty() ? 0 : 1) + (key.keyframe ? 1 : 0) + (key.camera_frame ? 1 : 0);
    if (places > 1 || (places == 0 && !(o.position && o.focal_point))) {
      FailAt(node, "key: expected one of view, keyframe, camera_frame, or position and focal_point");
    }
    return key;
  }

  void CheckTimes() const {
    const CameraKey* last = nullptr;
    for (const CameraKey& key : file_.keys) {
      if (key.time.has_value() != file_.keys.front().time.has_value()) {
        Fail(file_, key.line, "time: expected for all keys or for none");
      }
      if (last != nullptr && key.time && *key.time <= *last->time) {
        Fail(file_, key.line,
             fmt::format("time: {:g} s, expected more than the {:g} s of the key before", *key.time,
                         *last->time));
      }
      last = &key;
    }
    if (file_.duration && last->time &&
        (*file_.duration < *last->time || (file_.loop && *file_.duration == *last->time))) {
      Fail(file_, last->line,
           fmt::format("time: {:g} s, expected less than the duration of {:g} s", *last->time,
                       *file_.duration));
    }
  }

  CameraPathFile file_;
  double fps_;
};

// A view as a vector for the splines: focal point, direction and log-distance of the camera from it, up
// vector, view angle. Between two views of one object, the camera then moves around the object, not through
// it.
using ViewVector = Eigen::Matrix<double, 11, 1>;

ViewVector ToVector(const ViewCamera& view) {
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
  return Reader(path, fps).Read();
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
    const Knot knot{key.time.value_or(even), ToVector(view)};
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
