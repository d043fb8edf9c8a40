// The Python module. Its user documentation is in sqslam/__init__.pyi.

#include <fmt/format.h>
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <exception>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "app/export/map_view.h"
#include "app/result/map_input.h"
#include "render/picture/picture.h"
#include "slam/fitting/fitting.h"
#include "slam/geometry/solid_iou.h"
#include "slam/io/trajectory.h"
#include "slam/scene/distance_field.h"
#include "slam/scene/query.h"
#include "slam/scene/scene_graph.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/data_path.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam::python {
namespace py = pybind11;
namespace fs = std::filesystem;
namespace {
using py::literals::operator""_a;

// Copies contents of a map, which the array may outlive. Returns an array with a row of shape `columns` per
// item (empty: one number). `fill(item, row)` writes it.
template <typename Number, typename Items>
py::array_t<Number> Rows(const Items& items, std::vector<py::ssize_t> columns, const auto& fill) {
  columns.insert(columns.begin(), static_cast<py::ssize_t>(items.size()));
  py::array_t<Number> array(columns);
  const std::size_t step = items.empty() ? 0 : static_cast<std::size_t>(array.size()) / items.size();
  Number* numbers = array.mutable_data();
  for (const auto& item : items) {
    fill(item, numbers);
    numbers += step;
  }
  return array;
}

py::array_t<float> PointPositions(const MapSnapshot& map) {  // N x 3, map frame
  return Rows<float>(map.points, {3},
                     [](const SnapshotPoint& point, float* row) { std::ranges::copy(point.p_map, row); });
}

py::array_t<std::uint8_t> PointColors(const MapSnapshot& map) {  // N x 3, red green blue
  return Rows<std::uint8_t>(map.points, {3}, [](const SnapshotPoint& point, std::uint8_t* row) {
    std::ranges::copy(point.rgb, row);
  });
}

py::array_t<std::int32_t> PointObjects(const MapSnapshot& map) {  // N, -1 for none
  return Rows<std::int32_t>(map.points, {},
                            [](const SnapshotPoint& point, std::int32_t* id) { *id = point.object_id; });
}

py::array_t<double> Poses(const Trajectory& trajectory) {  // N x 4 x 4, T_map_camera
  return Rows<double>(trajectory, {4, 4}, [](const TimedPose& pose, double* matrix) {
    const Eigen::Matrix4d by_columns = pose.T_map_camera.Matrix().transpose();
    std::copy_n(by_columns.data(), 16, matrix);
  });
}

py::array_t<double> Times(const Trajectory& trajectory) {  // N, seconds
  return Rows<double>(trajectory, {}, [](const TimedPose& pose, double* time) { *time = pose.timestamp; });
}

// Converts an image (8UC3 BGR or 8UC4 BGRA) to H x W x 3 RGB or H x W x 4 RGBA.
py::array_t<std::uint8_t> Image(const cv::Mat& image) {
  const int channels = image.channels();
  py::array_t<std::uint8_t> array({image.rows, image.cols, channels});
  cv::Mat target(image.size(), image.type(), array.mutable_data());
  cv::cvtColor(image, target, channels == 4 ? cv::COLOR_BGRA2RGBA : cv::COLOR_BGR2RGB);
  return array;
}

// Reads points from an N x 3 array of any number type. Throws UsageError on any other shape.
std::vector<Eigen::Vector3d> Points(
    const py::array_t<double, py::array::c_style | py::array::forcecast>& array) {
  ThrowIf<UsageError>(array.ndim() != 2 || array.shape(1) != 3,
                      "points: an array of {} dimensions, expected N x 3", array.ndim());
  std::vector<Eigen::Vector3d> points(static_cast<std::size_t>(array.shape(0)));
  std::copy_n(array.data(), array.size(),
              reinterpret_cast<double*>(points.data()));  // NOLINT: 3 doubles each
  return points;
}

// A result of a run. States of its recording are read on demand.
class Result {
 public:
  Result(const fs::path& path, const std::string& edits, bool reliable_only)
      : file_(fs::absolute(app::MapFile(path))),  // the working folder may change
        reader_(app::OpenMap(file_, {edits, reliable_only}, HiddenObjects::kLeaveOut)),
        last_(reader_.Last()) {}

  int Size() const { return reader_.Size(); }
  const RecordingInfo& Info() const { return reader_.Info(); }
  const fs::path& File() const { return file_; }
  const RecordingReader& Reader() const { return reader_; }
  const MapSnapshotPtr& Last() const { return last_; }

  MapSnapshotPtr State(int index) const {
    const int from_start = index < 0 ? index + Size() : index;
    if (from_start < 0 || from_start >= Size()) {
      throw py::index_error(fmt::format("state {} of {}", index, Size()));
    }
    return reader_.Read(from_start);
  }

  // Returns the poses of all tracked frames, or of the keyframes if there is no trajectory.txt.
  Trajectory Tracked() const { return TrackedPoses(file_, *last_); }

  // Returns the page that `sqslam export FILE.html` writes.
  std::string Page() const { return app::MapViewPage(reader_, file_); }

  SceneGraph Relations() const { return SceneGraphOf(*last_, file_.parent_path()); }
  std::vector<SnapshotObject> Ask(const std::string& question) const {
    std::vector<SnapshotObject> objects;
    for (const QueryAnswer& answer :
         AnswerQuery(question, *last_, Relations(), ClassTable::Named("default"))) {
      objects.push_back(last_->objects[static_cast<std::size_t>(answer.object)]);
    }
    return objects;
  }

 private:
  fs::path file_;
  RecordingReader reader_;
  MapSnapshotPtr last_;
};

// Quotes a page for an HTML attribute. EscapeMarkup would not do: it turns newlines, which end script
// comments, into blanks.
std::string Quoted(const std::string& page) {
  std::string quoted;
  quoted.reserve(page.size() + page.size() / 16);
  for (const char c : page) {
    if (c == '&' || c == '"') {
      quoted += c == '&' ? "&amp;" : "&quot;";
    } else {
      quoted += c;
    }
  }
  return quoted;
}

// Returns a path as os.fsdecode() does: bytes that are no UTF-8 stay, as lone surrogates.
py::str PathText(const std::string& path) {
  const auto size = static_cast<py::ssize_t>(path.size());
  return py::reinterpret_steal<py::str>(PyUnicode_DecodeFSDefaultAndSize(path.data(), size));
}

struct State {
  MapSnapshotPtr map;
};

const MapSnapshot& MapOf(const State& state) { return *state.map; }
const MapSnapshot& MapOf(const Result& result) { return *result.Last(); }

py::array_t<std::uint8_t> Render(const std::variant<const Result*, const State*>& what, int width, int height,
                                 const std::string& style, const std::vector<std::string>& settings,
                                 const std::string& view, double azimuth, double elevation, double zoom,
                                 bool transparent) {
  cv::Mat image;
  {
    const py::gil_scoped_release others_run;
    PictureOptions options;
    options.width = width;
    options.height = height;
    options.transparent = transparent;
    options.camera = {view, {}, {}, {}, {}, azimuth, elevation, zoom};
    options.style = LoadStyle(style);
    SetStyle(settings, options.style);
    CheckStyle(options.style);
    if (const auto* result = std::get_if<const Result*>(&what)) {  // a single state has no dense cloud
      options.layers = app::ReadLayers({}, (*result)->Reader(), (*result)->File(), options.style);
    }
    image = RenderPicture(std::visit([](const auto* map) { return MapOf(*map); }, what), options);
  }
  return Image(image);
}

std::vector<SuperquadricFit> Fit(const py::array_t<double, py::array::c_style | py::array::forcecast>& cloud,
                                 bool upright, std::optional<int> clusters, bool remove_plane,
                                 const std::vector<std::string>& settings) {
  const std::vector<Eigen::Vector3d> points = Points(cloud);
  const py::gil_scoped_release others_run;
  MultiFitOptions options;
  SetOptions(settings, options);
  options.fit.upright |= upright;
  options.remove_plane |= remove_plane;
  options.clusters = clusters.value_or(0);
  CheckOptions(options);
  return FitSuperquadrics(points, options);
}

// Returns the distances (N) of points from the nearest object of a map, and their gradients (N x 3).
std::pair<py::array_t<double>, py::array_t<double>> Distances(
    const MapSnapshot& map, const py::array_t<double, py::array::c_style | py::array::forcecast>& array,
    double sigmas) {
  const std::vector<Eigen::Vector3d> points = Points(array);
  std::vector<double> distances(points.size());
  std::vector<Eigen::Vector3d> gradients(points.size());
  {
    const py::gil_scoped_release others_run;
    DistanceField(map, sigmas).At(points, distances, gradients);
  }
  return {Rows<double>(distances, {}, [](double distance, double* row) { *row = distance; }),
          Rows<double>(gradients, {3}, [](const Eigen::Vector3d& gradient, double* row) {
            std::ranges::copy(gradient, row);
          })};
}

PosedSuperquadric MakeSuperquadric(const Eigen::Vector3d& half_size, const std::array<double, 2>& shape,
                                   const Eigen::Matrix4d& T_map_object) {
  const Eigen::Matrix3d rotation = T_map_object.topLeftCorner<3, 3>();
  const bool rigid = (rotation * rotation.transpose()).isIdentity(1e-6) && rotation.determinant() > 0.0;
  ThrowIf<UsageError>(!rigid || T_map_object.row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0),
                      "T_map_object: expected a rotation and a translation");
  const PosedSuperquadric made = {
      {half_size, shape[0], shape[1]},
      {Eigen::Quaterniond(rotation).normalized(), T_map_object.topRightCorner<3, 1>()}};
  const auto in_range = [](double e) { return e >= kMinShapeExponent && e <= kMaxShapeExponent; };
  ThrowIf<UsageError>(
      !Solid::FromSuperquadric(made).IsUsable() || !in_range(made.shape.e1) || !in_range(made.shape.e2),
      "half_size, shape: expected sizes above 0 and exponents from {} to {}", kMinShapeExponent,
      kMaxShapeExponent);
  return made;
}

// Binds the properties of a type with a superquadric; `of` returns it.
template <typename T>
void BindSolid(py::class_<T>& type, const PosedSuperquadric& (*of)(const T&)) {
  type.def_property_readonly("half_size", [of](const T& t) { return of(t).shape.half_size; })
      .def_property_readonly("shape", [of](const T& t) { return std::pair(of(t).shape.e1, of(t).shape.e2); })
      .def_property_readonly("center", [of](const T& t) { return of(t).T_map_object.translation; })
      .def_property_readonly("T_map_object", [of](const T& t) { return of(t).T_map_object.Matrix(); })
      .def_property_readonly("parameters", [of](const T& t) { return ToParameters(of(t)); })
      .def_property_readonly("volume", [of](const T& t) { return of(t).shape.Volume(); });
}

void BindSolids(py::module_& m) {
  py::class_<PosedSuperquadric> solid(m, "Superquadric");
  solid.def(py::init(&MakeSuperquadric), "half_size"_a, "shape"_a,
            "T_map_object"_a = Eigen::Matrix4d::Identity());
  BindSolid<PosedSuperquadric>(solid,
                               [](const PosedSuperquadric& s) -> const PosedSuperquadric& { return s; });

  py::class_<SnapshotObject> object(m, "Object");
  BindSolid<SnapshotObject>(
      object, [](const SnapshotObject& o) -> const PosedSuperquadric& { return o.superquadric; });
  object.def_readonly("id", &SnapshotObject::id)
      .def_readonly("label", &SnapshotObject::label)
      .def_property_readonly("name", [](const SnapshotObject& o) { return ShownName(o); })
      .def_readonly("score", &SnapshotObject::score)
      .def_readonly("observations", &SnapshotObject::observations)
      .def_readonly("points", &SnapshotObject::points)
      .def_readonly("yaw", &SnapshotObject::yaw)
      .def_property_readonly("reliability", [](const SnapshotObject& o) { return o.fit.reliability; })
      .def_property_readonly("uncertain", [](const SnapshotObject& o) { return !IsReliable(o); })
      .def("__repr__", [](const SnapshotObject& o) {
        return fmt::format("<sqslam.Object {} {}, {} observations>", o.id, ShownName(o), o.observations);
      });

  py::class_<SuperquadricFit> fit(m, "Fit");
  BindSolid<SuperquadricFit>(
      fit, [](const SuperquadricFit& f) -> const PosedSuperquadric& { return f.superquadric; });
  fit.def_readonly("rms", &SuperquadricFit::rms)
      .def_readonly("noise", &SuperquadricFit::noise)
      .def_readonly("inlier_share", &SuperquadricFit::inlier_share)
      .def_property_readonly("inliers", [](const SuperquadricFit& f) {
        py::array_t<bool> inliers(static_cast<py::ssize_t>(f.inlier.size()));
        std::ranges::copy(f.inlier, inliers.mutable_data());
        return inliers;
      });

  // Objects and fits are accepted wherever a Superquadric is.
  solid.def(py::init([](const SnapshotObject& o) { return o.superquadric; }));
  solid.def(py::init([](const SuperquadricFit& f) { return f.superquadric; }));
  py::implicitly_convertible<SnapshotObject, PosedSuperquadric>();
  py::implicitly_convertible<SuperquadricFit, PosedSuperquadric>();
  m.def(
      "iou",
      [](const PosedSuperquadric& a, const PosedSuperquadric& b) {
        return IoU(Solid::FromSuperquadric(a), Solid::FromSuperquadric(b));
      },
      "a"_a, "b"_a, "3D intersection over union of two solids.", py::call_guard<py::gil_scoped_release>());
  m.def(
      "distance",
      [](const PosedSuperquadric& s,
         const py::array_t<double, py::array::c_style | py::array::forcecast>& points) {
        MapSnapshot map;
        map.objects.emplace_back().superquadric = s;
        return Distances(map, points, 0.0);
      },
      "solid"_a, "points"_a, "Signed distances of an N x 3 array from a solid, and their gradients.");
  m.def("fit", &Fit, "points"_a, py::kw_only(), "upright"_a = false, "clusters"_a = 1,
        "remove_plane"_a = false, "set"_a = std::vector<std::string>(),
        "Fits superquadrics to an N x 3 cloud.");
}

// Binds the properties of a state. A result has those of its last state.
template <typename T>
void BindMap(py::class_<T>& type) {
  type.def_property_readonly("poses", [](const T& t) { return Poses(KeyframeTrajectory(MapOf(t))); })
      .def_property_readonly("times", [](const T& t) { return Times(KeyframeTrajectory(MapOf(t))); })
      .def_property_readonly("points", [](const T& t) { return PointPositions(MapOf(t)); })
      .def_property_readonly("colors", [](const T& t) { return PointColors(MapOf(t)); })
      .def_property_readonly("point_objects", [](const T& t) { return PointObjects(MapOf(t)); })
      .def_property_readonly("objects", [](const T& t) { return MapOf(t).objects; })
      .def_property_readonly("K", [](const T& t) { return MapOf(t).camera.K(); })
      .def_property_readonly("distortion", [](const T& t) { return MapOf(t).camera.distortion; })
      .def_property_readonly("fisheye",
                             [](const T& t) { return MapOf(t).camera.lens == LensModel::kFisheye; })
      .def_property_readonly(
          "image_size", [](const T& t) { return std::pair(MapOf(t).camera.width, MapOf(t).camera.height); })
      .def_property_readonly("metric", [](const T& t) { return MapOf(t).metric; })
      .def(
          "distance",
          [](const T& t, const py::array_t<double, py::array::c_style | py::array::forcecast>& points,
             double sigmas) { return Distances(MapOf(t), points, sigmas); },
          "points"_a, "sigmas"_a = 0.0)
      .def("__repr__", [](const T& t) {
        const MapSnapshot& map = MapOf(t);
        return fmt::format("<sqslam.{}: {} keyframes, {} points, {} objects>",
                           std::is_same_v<T, State> ? "State" : "Result", map.keyframes.size(),
                           map.points.size(), map.objects.size());
      });
}

// Returns (subject, relation, object, probability): ids of objects, "floor", "surface 0", "wall 1".
py::list RelationTuples(const Result& result) {
  const SceneGraph graph = result.Relations();
  const auto node = [&graph](int index) -> py::object {
    const SceneNode& of = graph.nodes[static_cast<std::size_t>(index)];
    return of.kind == SceneNodeKind::kObject ? py::object(py::int_(of.id)) : py::object(py::str(TitleOf(of)));
  };
  py::list tuples;
  for (const SceneRelation& relation : graph.relations) {
    tuples.append(py::make_tuple(node(relation.subject), NameOf(relation.kind), node(relation.other),
                                 relation.probability));
  }
  return tuples;
}

void BindMaps(py::module_& m) {
  py::class_<State> state(m, "State");
  BindMap(state);
  state.def_property_readonly("frame", [](const State& s) { return s.map->frame_index; })
      .def_property_readonly("time", [](const State& s) { return s.map->timestamp; })
      .def_property_readonly("image", [](const State& s) { return PathText(s.map->image_path); })
      .def_property_readonly("pose", [](const State& s) {
        return s.map->T_map_camera ? std::optional(s.map->T_map_camera->Matrix()) : std::nullopt;
      });

  py::class_<Result> result(m, "Result");
  BindMap(result);
  result.def("__len__", &Result::Size)
      .def(
          "__getitem__", [](const Result& r, int index) { return State{r.State(index)}; }, "index"_a)
      .def_property_readonly("trajectory",
                             [](const Result& r) {
                               const Trajectory tracked = r.Tracked();
                               return std::pair(Times(tracked), Poses(tracked));
                             })
      .def_property_readonly("sequence", [](const Result& r) { return PathText(r.Info().sequence_path); })
      .def_property_readonly("version", [](const Result& r) { return ValidText(r.Info().program_version); })
      .def_property_readonly("relations", &RelationTuples)
      .def("query", &Result::Ask, "question"_a, py::call_guard<py::gil_scoped_release>())
      .def("page", &Result::Page, py::call_guard<py::gil_scoped_release>())
      .def("_repr_html_", [](const Result& r) {
        return fmt::format(
            "<iframe srcdoc=\"{}\" width=\"100%\" height=\"600\" style=\"border: 0\"></iframe>",
            Quoted(r.Page()));
      });

  m.def(
      "read",
      [](const fs::path& path, const std::string& edits, bool reliable_only) {
        return std::make_unique<Result>(path, edits, reliable_only);
      },
      "result"_a, py::kw_only(), "edits"_a = "", "reliable_only"_a = false,
      "Opens a result folder or its map.sqmap.", py::call_guard<py::gil_scoped_release>());
  m.def("render", &Render, "map"_a.none(false), py::kw_only(), "width"_a = 1280, "height"_a = 720,
        "style"_a = "paper", "set"_a = std::vector<std::string>(), "view"_a = "", "azimuth"_a = 0.0,
        "elevation"_a = 0.0, "zoom"_a = 1.0, "transparent"_a = false,
        "Draws a map into an H x W x 3 (or 4) array.");
}

}  // namespace
}  // namespace sqslam::python

PYBIND11_MODULE(_sqslam, m) {
  using namespace sqslam;  // NOLINT: of the whole module
  m.attr("__version__") = SQSLAM_VERSION;
  static PyObject* const input_error =
      pybind11::register_exception<InputError>(m, "InputError", PyExc_ValueError).ptr();
  static PyObject* const usage_error =
      pybind11::register_exception<UsageError>(m, "UsageError", PyExc_ValueError).ptr();
  // Asked before the translators of these two: a message may name a path that is no UTF-8.
  pybind11::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      PyErr_SetString(input_error, ValidText(error.what()).c_str());
    } catch (const UsageError& error) {
      PyErr_SetString(usage_error, ValidText(error.what()).c_str());
    }
  });
  m.def("set_data_folder", &SetDataFolder, pybind11::arg("folder"));
  python::BindSolids(m);
  python::BindMaps(m);
}
