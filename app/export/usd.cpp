#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <iterator>

#include "app/export/map_export.h"
#include "render/solids/tessellation.h"
#include "slam/io/map_frame.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace {

// Writes USD's text format, whose values are tuples in lists: [(0, 1, 2), (3, 4, 5)].
class UsdWriter {
 public:
  UsdWriter(const MapSnapshot& map, const SceneStyle& style) : map_(map), colors_(style.objects.colors) {}

  std::string Write(const Trajectory& trajectory, const std::string& generator) {
    Add("#usda 1.0\n(\n    defaultPrim = \"map\"\n    doc = \"{}; {}\"\n    metersPerUnit = 1\n    upAxis = "
        "\"Z\"\n)\n\n",
        Quoted(generator), FrameOf(map_).Text());
    Add("def Xform \"map\" (\n    kind = \"assembly\"\n)\n{{\n    def Scope \"objects\"\n    {{\n");
    for (const SnapshotObject& object : map_.objects) {
      AddObject(object);
    }
    Add("    }}\n");
    AddPoints();
    AddPath(trajectory);
    Add("}}\n");
    return std::move(text_);
  }

 private:
  template <typename... Values>
  void Add(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Values>(values)...);
  }

  static std::string Tuple(const auto& vector) { return fmt::format("({:.7g})", fmt::join(vector, ", ")); }

  static std::string Quoted(std::string text) {
    std::erase_if(text, [](char c) { return c == '"' || c == '\\' || c == '\n'; });
    return text;
  }

  // Returns the name of an object as an identifier: "potted_plant_3".
  static std::string PrimName(const SnapshotObject& object) {
    std::string name = object.label;
    std::ranges::replace_if(
        name, [](unsigned char c) { return std::isalnum(c) == 0 || c > 127; }, '_');
    if (name.empty() || std::isdigit(static_cast<unsigned char>(name.front())) != 0) {
      name.insert(0, "_");
    }
    return fmt::format("{}_{}", name, object.id);
  }

  void AddObject(const SnapshotObject& object) {
    constexpr int kSegments = 48;
    const Superquadric& shape = object.superquadric.shape;
    const TriangleMesh mesh = Tessellate(shape, kSegments);
    const Eigen::Quaterniond& q = object.superquadric.T_map_object.rotation;
    Add("        def Mesh \"{}\" (\n            displayName = \"{}\"\n        )\n        {{\n",
        PrimName(object), Quoted(ReadableLabel(ShownName(object))));
    Add("            uniform token subdivisionScheme = \"none\"\n");
    Add("            float3[] extent = [{}, {}]\n", Tuple(Eigen::Vector3d(-shape.half_size)),
        Tuple(shape.half_size));
    Add("            int[] faceVertexCounts = [{}]\n",
        fmt::join(std::vector<int>(mesh.triangles.size(), 3), ", "));
    Add("            int[] faceVertexIndices = [{}]\n",
        fmt::join(
            ToVector(mesh.triangles, [](const auto& t) { return fmt::format("{}", fmt::join(t, ", ")); }),
            ", "));
    AddTuples("            point3f[] points", mesh.vertices);
    AddTuples("            normal3f[] normals", mesh.normals, "vertex");
    Add("            color3f[] primvars:displayColor = [{}]\n", Tuple(colors_(object.label)));
    Add("            custom int sqslam:id = {}\n            custom string sqslam:label = \"{}\"\n", object.id,
        Quoted(object.label));
    Add("            custom double3 sqslam:halfSize = {}\n            custom double2 sqslam:shape = ({:.7g}, "
        "{:.7g})\n",
        Tuple(shape.half_size), shape.e1, shape.e2);
    Add("            custom double sqslam:reliability = {:.4g}\n", object.fit.reliability);
    Add("            double3 xformOp:translate = {}\n", Tuple(object.superquadric.T_map_object.translation));
    Add("            quatd xformOp:orient = ({:.9g}, {:.9g}, {:.9g}, {:.9g})\n", q.w(), q.x(), q.y(), q.z());
    Add("            uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]\n        "
        "}}\n");
  }

  void AddTuples(const std::string& name, const std::vector<Eigen::Vector3f>& values,
                 const std::string& interpolation = "") {
    Add("{} = [{}]", name, fmt::join(ToVector(values, [](const auto& v) { return Tuple(v); }), ", "));
    Add("{}\n",
        interpolation.empty()
            ? ""
            : fmt::format(" (\n                interpolation = \"{}\"\n            )", interpolation));
  }

  void AddPoints() {
    if (map_.points.empty()) {
      return;
    }
    Add("    def Points \"points\"\n    {{\n");
    AddTuples("        point3f[] points", ToVector(map_.points, &SnapshotPoint::p_map));
    AddTuples(
        "        color3f[] primvars:displayColor",
        ToVector(map_.points,
                 [](const SnapshotPoint& point) {
                   return Eigen::Vector3f(Eigen::Vector3f(point.rgb[0], point.rgb[1], point.rgb[2]) / 255.0F);
                 }),
        "vertex");
    Add("        float[] widths = [0.005] (\n            interpolation = \"constant\"\n        )\n    }}\n");
  }

  void AddPath(const Trajectory& trajectory) {
    if (trajectory.size() < 2) {
      return;
    }
    Add("    def BasisCurves \"trajectory\"\n    {{\n        uniform token type = \"linear\"\n");
    Add("        int[] curveVertexCounts = [{}]\n", trajectory.size());
    AddTuples("        point3f[] points", ToVector(trajectory, [](const TimedPose& pose) -> Eigen::Vector3f {
                return pose.T_map_camera.translation.cast<float>();
              }));
    Add("        float[] widths = [0.005] (\n            interpolation = \"constant\"\n        )\n    }}\n");
  }

  const MapSnapshot& map_;
  LabelColors colors_;
  std::string text_;
};

}  // namespace

std::string MapUsd(const MapSnapshot& map, const Trajectory& trajectory, const std::string& generator,
                   const SceneStyle& style) {
  return UsdWriter(map, style).Write(trajectory, generator);
}

}  // namespace sqslam::app
