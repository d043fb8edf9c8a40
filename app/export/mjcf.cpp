#include "app/export/mjcf.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "app/export/map_export.h"
#include "app/export/object_mass.h"
#include "render/scene/style.h"
#include "slam/geometry/solid_iou.h"
#include "slam/scene/labelled_scene.h"
#include "slam/scene/settled_scene.h"
#include "slam/util/atomic_file.h"
#include "slam/util/markup.h"
#include "slam/util/thinned.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr double kClearance = 0.002;  // between things side by side, metres
constexpr double kRollingShare =
    0.05;  // of the half width: a solid with a round foot stands for a thing with a flat one

std::string Numbers(const auto& vector) { return fmt::format("{:.6g}", fmt::join(vector, " ")); }

std::string Quaternion(const Eigen::Quaterniond& q) {
  return Numbers(std::array{q.w(), q.x(), q.y(), q.z()});
}

// Returns the primitive that the exponents say, within twice their standard deviation; empty: none.
std::optional<SolidKind> PrimitiveOf(const SnapshotObject& object) {
  constexpr double kSharp = 0.3, kRound = 0.15;  // exponents of a box, and tolerance of those of round things
  const Superquadric& shape = object.superquadric.shape;
  const auto sigma = [&](int i) { return std::sqrt(std::max(0.0, object.fit.covariance(i, i))); };
  const auto is_sharp = [&](double e, int i) {
    return e <= std::max(kSharp, kMinShapeExponent + 2.0 * sigma(i));
  };
  const auto is_round = [&](double e, int i) {
    return std::abs(e - 1.0) <= std::max(kRound, 2.0 * sigma(i));
  };
  constexpr int kE1 = 7, kE2 = 8;
  if (is_sharp(shape.e1, kE1) && is_sharp(shape.e2, kE2)) {
    return SolidKind::kCuboid;
  }
  const double width = shape.half_size.head<2>().maxCoeff(), depth = shape.half_size.head<2>().minCoeff();
  if (is_sharp(shape.e1, kE1) && is_round(shape.e2, kE2) &&
      width - depth <= std::max(0.1 * width, 2.0 * std::hypot(sigma(3), sigma(4)))) {
    return SolidKind::kCylinder;
  }
  return is_round(shape.e1, kE1) && is_round(shape.e2, kE2) ? std::optional(SolidKind::kEllipsoid)
                                                            : std::nullopt;
}

// Gives the objects the exact shape of their bodies, so that bodies stand clear of each other: edges are
// sharp, a cylinder is round, furniture with legs or a seat consists of boxes. `kinds`: of the objects.
MapSnapshot WithBodyShapes(MapSnapshot map, const std::vector<std::optional<SolidKind>>& kinds) {
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    Superquadric& shape = map.objects[i].superquadric.shape;
    if (kinds[i]) {
      SetExponents(*kinds[i], shape.e1, shape.e2, 0.0);
    }
    if (kinds[i] == SolidKind::kCylinder) {
      shape.half_size.head<2>().setConstant(shape.half_size.head<2>().mean());
    }
  }
  return map;
}

std::vector<std::optional<SolidKind>> KindsOf(const MapSnapshot& map, const ClassTable& classes) {
  return ToVector(map.objects, [&](const SnapshotObject& object) {
    const ObjectClass& traits = classes.Of(object.label);
    return traits.legs || traits.back ? SolidKind::kCuboid : PrimitiveOf(object);
  });
}

class MjcfWriter {
 public:
  MjcfWriter(const fs::path& path, const MapSnapshot& map, const SceneGraph& graph)
      : path_(path),
        graph_(graph),
        classes_(ClassTable::Named("default")),
        kinds_(KindsOf(map, classes_)),
        map_(WithBodyShapes(map, kinds_)),
        scene_(Settle(map_, graph, classes_, kClearance)) {}

  MjcfSummary Write() {
    fmt::format_to(Out(), "<mujoco model=\"{}\">\n", EscapeMarkup(path_.stem().string()));
    fmt::format_to(Out(), "  <compiler angle=\"radian\" meshdir=\"{}\"/>\n",
                   EscapeMarkup(MeshFolder().filename().string()));
    fmt::format_to(Out(),
                   "  <option gravity=\"0 0 -9.81\" timestep=\"0.002\" cone=\"elliptic\" impratio=\"10\">"
                   "<flag multiccd=\"enable\"/></option>\n  <size njmax=\"8000\" nconmax=\"2000\"/>\n");
    fmt::format_to(Out(), "  <default><geom condim=\"6\" solref=\"0.005 1\"/></default>\n");
    const std::string head = std::exchange(text_, "");
    AddMeshes();
    fmt::format_to(Out(), "  <worldbody>\n    <light pos=\"0 0 10\" dir=\"0 0 -1\" directional=\"true\"/>\n");
    AddRoom();
    for (int i = 0; i < Count(); ++i) {
      if (!IsInside(i)) {
        AddBody(i, std::nullopt, "    ");
      }
    }
    AddCameras();
    fmt::format_to(Out(), "  </worldbody>\n  <contact>\n");
    AddExclusions();
    fmt::format_to(Out(), "  </contact>\n</mujoco>\n");
    WriteFileAtomically(path_, head + "  <asset>\n" + assets_ + "  </asset>\n" + text_);
    AddNotes();
    return std::move(summary_);
  }

 private:
  std::back_insert_iterator<std::string> Out() { return std::back_inserter(text_); }
  int Count() const { return static_cast<int>(scene_.objects.size()); }
  const SettledObject& Settled(int i) const { return scene_.objects[static_cast<std::size_t>(i)]; }
  const SnapshotObject& Object(int i) const { return map_.objects[static_cast<std::size_t>(i)]; }
  const ObjectClass& Traits(int i) const { return classes_.Of(Object(i).label); }
  bool IsObject(int node) const { return node >= 0 && node < Count(); }
  bool IsInside(int i) const { return Settled(i).inside && IsObject(Settled(i).place); }
  std::string Name(int i) const { return EscapeMarkup(fmt::format("{} {}", Object(i).id, Object(i).label)); }
  fs::path MeshFolder() const { return path_.parent_path() / (path_.stem().string() + "-meshes"); }
  bool IsHull(int i) const { return !Traits(i).legs && !Traits(i).back; }

  // Returns false for a seat on which something lies: the seat is then where that thing is.
  bool ShowsParts(int i) const { return !Object(i).parts.empty() && (!Traits(i).back || !IsUsed(i)); }
  bool IsUsed(int i) const {
    return std::ranges::any_of(scene_.objects, [i](const SettledObject& thing) { return thing.place == i; });
  }

  // Returns the attributes of a box on which other things stand: a mesh of its corners, as the contacts of
  // box on box are wrong in MuJoCo 2.2. The mesh is added to the assets.
  std::string Slab(const Eigen::Vector3d& half) {
    const std::string name = fmt::format("slab {}", ++slabs_);
    fmt::format_to(
        std::back_inserter(assets_),
        "    <mesh name=\"{}\" vertex=\"-1 -1 -1 1 -1 -1 -1 1 -1 1 1 -1 -1 -1 1 1 -1 1 -1 1 1 1 1 1\" "
        "scale=\"{}\"/>\n",
        name, Numbers(half));
    return fmt::format("type=\"mesh\" mesh=\"{}\"", name);
  }

  void AddMeshes() {
    for (int i = 0; i < Count(); ++i) {
      if (!kinds_[static_cast<std::size_t>(i)] && !ShowsParts(i)) {
        SnapshotObject centred = Object(i);
        centred.superquadric.T_map_object = {};
        fs::create_directories(MeshFolder());
        const std::string file = fmt::format("object_{}.obj", Object(i).id);
        WriteObjectMeshes(MeshFolder() / file, {centred}, {});
        fmt::format_to(std::back_inserter(assets_), "    <mesh name=\"mesh {0}\" file=\"{1}\"/>\n",
                       Object(i).id, file);
      }
    }
  }

  void AddRoom() {
    constexpr double kMargin = 0.05, kThickness = 0.005;  // metres
    for (int node = Count(); node < static_cast<int>(graph_.nodes.size()); ++node) {
      const SceneNode& room = graph_.nodes[static_cast<std::size_t>(node)];
      if (room.kind == SceneNodeKind::kFloor) {
        fmt::format_to(Out(),
                       "    <geom name=\"floor\" type=\"plane\" size=\"0 0 1\" pos=\"0 0 {:.6g}\" rgba=\".8 "
                       ".8 .8 1\"/>\n",
                       room.height);
      }
      Eigen::AlignedBox2d extent;
      for (int i = 0; i < Count(); ++i) {
        if (Settled(i).place == node) {
          const double reach = Settled(i).solid.shape.half_size.head<2>().norm();
          const Eigen::Vector2d centre = Settled(i).solid.T_map_object.translation.head<2>();
          extent.extend(centre + Eigen::Vector2d::Constant(reach + kMargin));
          extent.extend(centre - Eigen::Vector2d::Constant(reach + kMargin));
        }
      }
      if (room.kind == SceneNodeKind::kSurface && !extent.isEmpty()) {
        fmt::format_to(Out(),
                       "    <body name=\"surface {}\" pos=\"{:.6g} {:.6g} {:.6g}\"><geom {} "
                       "rgba=\".7 .6 .5 1\"/></body>\n",
                       room.id, extent.center().x(), extent.center().y(), room.height - kThickness,
                       Slab({0.5 * extent.sizes().x(), 0.5 * extent.sizes().y(), kThickness}));
      }
    }
  }

  // Adds a body with everything that stands in it. `outer`: the pose of the body that holds it.
  void AddBody(int i, const std::optional<Rigid3d>& outer, const std::string& indent) {
    const Rigid3d& T_map_object = Settled(i).solid.T_map_object;
    const Rigid3d pose = outer ? outer->Inverse() * T_map_object : T_map_object;
    fmt::format_to(Out(), "{}<body name=\"{}\" pos=\"{}\" quat=\"{}\">\n", indent, Name(i),
                   Numbers(pose.translation), Quaternion(pose.rotation));
    const bool is_free = !Settled(i).fixed && !outer;
    if (is_free) {
      fmt::format_to(Out(), "{}  <freejoint/>\n", indent);
    }
    (is_free ? summary_.free : summary_.fixed) += 1;
    AddGeoms(i, indent + "  ");
    for (int j = 0; j < Count(); ++j) {
      if (IsInside(j) && Settled(j).place == i) {
        AddBody(j, T_map_object, indent + "  ");
      }
    }
    fmt::format_to(Out(), "{}</body>\n", indent);
  }

  double MassOf(int i) const { return app::MassOf(Traits(i), Object(i).superquadric.shape); }

  void AddGeom(int i, const std::string& indent, const std::string& shape, double mass) {
    const double rolling = kRollingShare * Object(i).superquadric.shape.half_size.head<2>().minCoeff();
    const Eigen::Vector3d color = colors_(Object(i).label);
    fmt::format_to(Out(), "{}<geom {} mass=\"{:.6g}\" friction=\"{:.3g} 0.005 {:.3g}\" rgba=\"{} 1\"/>\n",
                   indent, shape, mass, Traits(i).friction, rolling, Numbers(color));
  }

  void AddGeoms(int i, const std::string& indent) {
    const Superquadric& shape = Object(i).superquadric.shape;
    if (ShowsParts(i)) {
      AddParts(i, indent);
      return;
    }
    if (!IsHull(i)) {
      AddFurniture(i, indent);
      return;
    }
    const std::optional<SolidKind> kind = kinds_[static_cast<std::size_t>(i)];
    std::string geom = fmt::format("type=\"mesh\" mesh=\"mesh {}\"", Object(i).id);
    if (kind == SolidKind::kCylinder) {
      geom =
          fmt::format("type=\"cylinder\" size=\"{:.6g} {:.6g}\"", shape.half_size.x(), shape.half_size.z());
    } else if (kind == SolidKind::kCuboid && IsUsed(i)) {
      geom = Slab(shape.half_size);
    } else if (kind) {
      geom = fmt::format("type=\"{}\" size=\"{}\"", kind == SolidKind::kCuboid ? "box" : "ellipsoid",
                         Numbers(shape.half_size));
    }
    AddGeom(i, indent, geom, MassOf(i));
  }

  // Adds a box, cylinder or ellipsoid for each part, with a share of the mass by its volume.
  void AddParts(int i, const std::string& indent) {
    SnapshotObject centred = Object(i);
    centred.superquadric.T_map_object = {};
    const std::vector<PosedSuperquadric> solids = SolidsOf(centred);
    double volume = 0.0;
    for (const PosedSuperquadric& solid : solids) {
      volume += solid.shape.Volume();
    }
    for (const auto& [shape, T_object_part] : solids) {
      const Eigen::Vector3d& half = shape.half_size;
      const SolidKind kind = NearestPrimitive(shape.e1, shape.e2);
      const std::string geom =
          kind == SolidKind::kCuboid ? Slab(half)
          : kind == SolidKind::kCylinder
              ? fmt::format("type=\"cylinder\" size=\"{:.6g} {:.6g}\"", half.head<2>().mean(), half.z())
              : fmt::format("type=\"ellipsoid\" size=\"{}\"", Numbers(half));
      AddGeom(i, indent, fmt::format("{} pos=\"{}\"", geom, Numbers(T_object_part.translation)),
              MassOf(i) * shape.Volume() / volume);
    }
  }

  // Adds the top and legs of a table, or the seat of a chair: boxes, or a round top.
  void AddFurniture(int i, const std::string& indent) {
    constexpr double kLeg = 0.05;  // half width of a leg, share of the table's
    const Superquadric& shape = Object(i).superquadric.shape;
    const SolidSpan span = SolidSpanOf(scene_, i, Traits(i));
    const double centre = Settled(i).solid.T_map_object.translation.z();
    const Eigen::Vector3d half(shape.half_size.x(), shape.half_size.y(), 0.5 * (span.top - span.bottom));
    const double z = 0.5 * (span.top + span.bottom) - centre;
    const double mass = MassOf(i);
    const auto box = [&](const Eigen::Vector3d& place, const Eigen::Vector3d& size, double share) {
      AddGeom(i, indent, fmt::format("{} pos=\"{}\"", Slab(size), Numbers(place)), share * mass);
    };
    box({0.0, 0.0, z}, half, Traits(i).legs ? 0.6 : 1.0);
    if (Traits(i).legs) {
      const double leg = kLeg * half.head<2>().minCoeff();
      const double height = 0.5 * (span.bottom - centre + shape.half_size.z());
      for (const auto& [x, y] : {std::pair(1.0, 1.0), {1.0, -1.0}, {-1.0, 1.0}, {-1.0, -1.0}}) {
        box({x * (half.x() - leg), y * (half.y() - leg), height - shape.half_size.z()}, {leg, leg, height},
            0.1);
      }
    }
  }

  void AddCameras() {
    constexpr std::size_t kCameras = 50;
    const double fovy = 2.0 * std::atan(0.5 * map_.camera.height / map_.camera.fy);
    for (const SnapshotKeyframe& keyframe : Thinned(map_.keyframes, kCameras)) {
      // A camera of MuJoCo looks along -z with y up.
      const Eigen::Quaterniond turned =
          keyframe.T_map_camera.rotation * Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0);
      fmt::format_to(Out(), "    <camera name=\"keyframe {}\" pos=\"{}\" quat=\"{}\" fovy=\"{:.6g}\"/>\n",
                     keyframe.id, Numbers(keyframe.T_map_camera.translation), Quaternion(turned), fovy);
    }
  }

  // Bodies whose outlines overlap at one height although nothing could separate them, and surfaces that would
  // cut through what stands elsewhere.
  void AddExclusions() {
    std::vector<PlacedSolid> solids;
    for (int i = 0; i < Count(); ++i) {
      solids.emplace_back(Settled(i).solid, Traits(i));
    }
    for (int i = 0; i < Count(); ++i) {
      const SolidSpan a = SolidSpanOf(scene_, i, Traits(i));
      for (int j = i + 1; j < Count(); ++j) {
        const SolidSpan b = SolidSpanOf(scene_, j, Traits(j));
        const double height = std::min(a.top, b.top) - std::max(a.bottom, b.bottom);
        const double width = -Gap(solids[static_cast<std::size_t>(i)], solids[static_cast<std::size_t>(j)]);
        const bool held =
            Settled(i).place == j || Settled(j).place == i || (Settled(i).fixed && Settled(j).fixed);
        if (!held && std::min(height, width) > kMaxDepth) {
          Exclude(Name(i), Name(j));
          summary_.notes.push_back(fmt::format("{} and {} overlap by {:.1f} cm; they do not collide", Name(i),
                                               Name(j), 100.0 * std::min(height, width)));
        }
      }
      for (std::size_t node = static_cast<std::size_t>(Count()); node < graph_.nodes.size(); ++node) {
        const SceneNode& room = graph_.nodes[node];
        const bool used = std::ranges::any_of(scene_.objects, [&](const SettledObject& object) {
          return object.place == static_cast<int>(node);
        });
        if (room.kind == SceneNodeKind::kSurface && used && Settled(i).place != static_cast<int>(node) &&
            !Settled(i).fixed && !IsInside(i)) {
          Exclude(fmt::format("surface {}", room.id), Name(i));
        }
      }
    }
  }
  void Exclude(const std::string& a, const std::string& b) {
    fmt::format_to(Out(), "    <exclude body1=\"{}\" body2=\"{}\"/>\n", a, b);
  }

  void AddNotes() {
    constexpr double kMaxSigmas = 3.0, kMinShift = 0.005;
    for (int i = 0; i < Count(); ++i) {
      if (Settled(i).sigmas > kMaxSigmas && Settled(i).shift > kMinShift) {
        summary_.notes.push_back(fmt::format(
            "{} was moved by {:.1f} cm, {:.0f} standard deviations, to touch nothing but its support",
            Name(i), 100.0 * Settled(i).shift, Settled(i).sigmas));
      }
      if (Settled(i).place < 0 && !Traits(i).on_floor) {
        summary_.notes.push_back(fmt::format("{} is fixed: nothing was found below it", Name(i)));
      }
    }
  }

  static constexpr double kMaxDepth = 1e-3;  // metres, of a contact that a simulator resolves softly

  fs::path path_;
  const SceneGraph& graph_;
  ClassTable classes_;
  std::vector<std::optional<SolidKind>> kinds_;  // of the objects; empty: a mesh
  MapSnapshot map_;
  SettledScene scene_;
  LabelColors colors_;
  std::string text_;
  std::string assets_;
  int slabs_ = 0;
  MjcfSummary summary_;
};

}  // namespace

MjcfSummary WriteMjcf(const fs::path& path, const MapSnapshot& map, const SceneGraph& graph) {
  ThrowIf<InputError>(!map.gravity_known, "{}: the map is not aligned with gravity, expected one with z up",
                      path.string());
  ThrowIf<InputError>(!map.metric,
                      "{}: the map has no scale, expected sqslam scale before, or --scale METRES",
                      path.string());
  ThrowIf<InputError>(map.objects.empty(), "{}: the map has no reliable objects", path.string());
  return MjcfWriter(path, map, graph).Write();
}

}  // namespace sqslam::app
