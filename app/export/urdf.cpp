#include "app/export/urdf.h"

#include <fmt/format.h>

#include "app/export/map_export.h"
#include "app/export/object_mass.h"
#include "slam/util/atomic_file.h"
#include "slam/util/markup.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;

void WriteUrdf(const fs::path& path, const MapSnapshot& map) {
  ThrowIf<InputError>(!map.metric,
                      "{}: the map has no scale, expected sqslam scale before, or --scale METRES",
                      path.string());
  ThrowIf<InputError>(map.objects.size() != 1, "{}: {} objects, expected one, such as --objects 3",
                      path.string(), map.objects.size());
  SnapshotObject object = map.objects.front();
  object.superquadric.T_map_object = {};
  const Superquadric& shape = object.superquadric.shape;
  const ClassTable classes = ClassTable::Named("default");
  const ObjectClass& traits = classes.Of(object.label);
  const double mass = MassOf(traits, shape);
  const Eigen::Vector3d squares = mass * shape.MeanSquares();  // about x: those of y and z
  const fs::path mesh = fs::path(path).replace_extension(".obj");
  WriteObjectMeshes(mesh, {object}, {LabelColors(), UpAxis::kZ, "metres; object frame"});
  const Eigen::Vector3d color = LabelColors()(object.label);
  const std::string name = EscapeMarkup(fmt::format("{}_{}", object.label, object.id));
  const std::string geometry =
      fmt::format("<geometry><mesh filename=\"{}\"/></geometry>", EscapeMarkup(mesh.filename().string()));
  WriteFileAtomically(
      path,
      fmt::format(
          "<?xml version=\"1.0\"?>\n"
          "<robot name=\"{0}\">\n"
          "  <link name=\"{0}\">\n"
          "    <inertial>\n"
          "      <mass value=\"{1:.6g}\"/>\n"
          "      <inertia ixx=\"{2:.6g}\" ixy=\"0\" ixz=\"0\" iyy=\"{3:.6g}\" iyz=\"0\" izz=\"{4:.6g}\"/>\n"
          "    </inertial>\n"
          "    <visual>{5}<material name=\"{6}\"><color rgba=\"{7:.4g} {8:.4g} {9:.4g} 1\"/></material>"
          "</visual>\n"
          "    <collision>{5}</collision>\n"
          "    <contact><lateral_friction value=\"{10:.3g}\"/></contact>\n"
          "  </link>\n"
          "</robot>\n",
          name, mass, squares.y() + squares.z(), squares.x() + squares.z(), squares.x() + squares.y(),
          geometry, EscapeMarkup(object.label), color.x(), color.y(), color.z(), traits.friction));
}

}  // namespace sqslam::app
