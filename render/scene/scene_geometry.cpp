#include "render/scene/scene_geometry.h"

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "render/scene/color_scale.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

using Rgba = std::array<unsigned char, 4>;

Rgba ToRgba(const Eigen::Vector3d& color, double opacity = 1.0) {
  const auto byte = [](double v) {
    return static_cast<unsigned char>(std::lround(255.0 * std::clamp(v, 0.0, 1.0)));
  };
  return {byte(color.x()), byte(color.y()), byte(color.z()), byte(opacity)};
}

// Builds lines between coloured vertices.
class MeshBuilder {
 public:
  MeshBuilder() {
    points_->SetDataTypeToFloat();
    colors_->SetNumberOfComponents(4);
  }
  vtkIdType Add(const Eigen::Vector3d& p, const Rgba& color) {
    colors_->InsertNextTypedTuple(color.data());
    return points_->InsertNextPoint(p.data());
  }
  void Line(vtkIdType a, vtkIdType b) { lines_->InsertNextCell({a, b}); }
  void Path(const std::vector<Eigen::Vector3d>& points, const Rgba& color) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const vtkIdType next = Add(points[i], color);
      if (i > 0) {
        Line(next - 1, next);
      }
    }
  }
  vtkSmartPointer<vtkPolyData> Finish() const {
    const auto mesh = vtkSmartPointer<vtkPolyData>::New();
    mesh->SetPoints(points_);
    mesh->GetPointData()->SetScalars(colors_);
    mesh->SetLines(lines_);
    return mesh;
  }

 private:
  vtkNew<vtkPoints> points_;
  vtkNew<vtkUnsignedCharArray> colors_;
  vtkNew<vtkCellArray> lines_;
};

// `height`: of the image's border.
void AddFrustum(MeshBuilder& builder, const Rigid3d& pose, const Camera& camera, double height,
                const Rgba& color) {
  const std::array<Eigen::Vector3d, 5> corners = FrustumCorners(pose, camera, height);
  std::array<vtkIdType, 5> ids{};
  std::ranges::transform(corners, ids.begin(),
                         [&](const Eigen::Vector3d& p_map) { return builder.Add(p_map, color); });
  for (std::size_t i = 1; i < 5; ++i) {
    builder.Line(ids[0], ids[i]);
    builder.Line(ids[i], ids[i % 4 + 1]);
  }
  const Eigen::Vector3d up = 0.225 * height * (pose.rotation * -Eigen::Vector3d::UnitY());
  const vtkIdType top = builder.Add(0.5 * (corners[1] + corners[2]) + up, color);  // marks the up direction
  builder.Line(ids[1], top);
  builder.Line(top, ids[2]);
}

}  // namespace

std::vector<PointSplats::Vertex> MapPoints(const MapSnapshot& map, const SceneStyle& style, double scale) {
  const Eigen::Vector3d background = ParseColor(style.background);
  std::vector<PointSplats::Vertex> vertices;
  vertices.reserve(map.points.size());
  for (const SnapshotPoint& point : map.points) {
    const Eigen::Vector3d own = Eigen::Vector3d(point.rgb[0], point.rgb[1], point.rgb[2]) / 255.0;
    const double size = point.object_id >= 0 ? style.points.object_size : style.points.size;
    vertices.push_back({point.p_map, static_cast<float>(size * scale), 0.0F,
                        ToRgba(ReadableOn(background, own, style.points.min_contrast))});
  }
  return vertices;
}

vtkSmartPointer<vtkPolyData> TrajectoryLine(const MapSnapshot& map, const MapTruth* truth,
                                            const SceneStyle& style) {
  const Rgba plain = ToRgba(ParseColor(style.cameras.color));
  const double most = truth != nullptr ? truth->MaxCameraError() : 0.0;
  MeshBuilder builder;
  std::optional<vtkIdType> last;
  const auto add = [&](const Eigen::Vector3d& center, const Rgba& color) {
    const vtkIdType next = builder.Add(center, color);
    if (last) {
      builder.Line(*last, next);
    }
    last = next;
  };
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    const bool known = most > 0.0 && truth->camera_error.contains(keyframe.id);
    add(keyframe.T_map_camera.translation,
        known ? ToRgba(Viridis(truth->camera_error.at(keyframe.id) / most)) : plain);
  }
  if (map.T_map_camera && style.cameras.current) {
    add(map.T_map_camera->translation, plain);
  }
  return builder.Finish();
}

namespace {

// Returns every other of `count` pieces of equal length of a line, and of the gaps between them.
std::vector<std::vector<Eigen::Vector3d>> Dashes(const std::vector<Eigen::Vector3d>& line, int count) {
  std::vector<double> along = {0.0};
  for (std::size_t i = 1; i < line.size(); ++i) {
    along.push_back(along.back() + (line[i] - line[i - 1]).norm());
  }
  std::vector<std::vector<Eigen::Vector3d>> dashes;
  for (int dash = 0; dash < count; ++dash) {
    const double begin = along.back() * dash / count, end = along.back() * (dash + 0.5) / count;
    std::vector<Eigen::Vector3d>& points = dashes.emplace_back();
    for (std::size_t i = 1; i < line.size(); ++i) {
      const double length = along[i] - along[i - 1];
      if (length <= 0.0 || along[i] <= begin || along[i - 1] >= end) {
        continue;
      }
      const auto at = [&](double place) -> Eigen::Vector3d {
        return line[i - 1] + std::clamp((place - along[i - 1]) / length, 0.0, 1.0) * (line[i] - line[i - 1]);
      };
      if (points.empty()) {
        points.push_back(at(begin));
      }
      points.push_back(at(end));
    }
  }
  return dashes;
}

// Adds cross-sections through the centre, and latitudes that lie on the rims if the solid has any. `dashes`:
// of each curve; 0: whole lines.
void AddOutline(const PosedSuperquadric& solid, const Rgba& color, int dashes, MeshBuilder& builder) {
  constexpr int kSteps = 96;
  const auto curve = [&](const auto& point_at) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i <= kSteps; ++i) {
      points.push_back(solid.T_map_object *
                       point_at(-std::numbers::pi + 2.0 * std::numbers::pi * i / kSteps));
    }
    if (dashes == 0) {
      builder.Path(points, color);
    }
    for (const std::vector<Eigen::Vector3d>& dash : Dashes(points, dashes)) {
      builder.Path(dash, color);
    }
  };
  const double rim = 0.25 * std::numbers::pi;
  for (const double latitude : {-rim, 0.0, rim}) {
    curve([&](double angle) { return solid.shape.PointAt(latitude, angle); });
  }
  for (const double longitude : {0.0, 0.5 * std::numbers::pi}) {
    curve([&](double angle) {
      const bool back = std::abs(angle) > 0.5 * std::numbers::pi;
      const double latitude = back ? std::copysign(std::numbers::pi, angle) - angle : angle;
      return solid.shape.PointAt(latitude, back ? longitude - std::numbers::pi : longitude);
    });
  }
}

}  // namespace

vtkSmartPointer<vtkPolyData> UncertainOutlines(const MapSnapshot& map, const ObjectColor& color_of,
                                               const SceneStyle& style) {
  constexpr double kUncertainStrength = 0.5;
  const Eigen::Vector3d background = ParseColor(style.background);
  MeshBuilder builder;
  for (const SnapshotObject& object : map.objects) {
    if (!IsReliable(object)) {
      const Eigen::Vector3d own = ReadableOn(background, color_of(object), style.points.min_contrast);
      AddOutline(object.superquadric,
                 ToRgba(kUncertainStrength * own + (1.0 - kUncertainStrength) * background), 0, builder);
    }
  }
  return builder.Finish();
}

vtkSmartPointer<vtkPolyData> TrueOutlines(const std::vector<PosedSuperquadric>& solids,
                                          const SceneStyle& style) {
  constexpr int kDashes = 24;
  MeshBuilder builder;
  for (const PosedSuperquadric& solid : solids) {
    AddOutline(solid, ToRgba(ParseColor(style.ground_truth.color)), kDashes, builder);
  }
  return builder.Finish();
}

vtkSmartPointer<vtkPolyData> KeyframeFrusta(const MapSnapshot& map, double height, const SceneStyle& style) {
  const Rgba color = ToRgba(ParseColor(style.cameras.color));
  MeshBuilder builder;
  const Rigid3d* last = nullptr;
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    const Rigid3d& pose = keyframe.T_map_camera;
    const bool crowded = last != nullptr && (pose.translation - last->translation).norm() < 1.0 * height &&
                         pose.rotation.angularDistance(last->rotation) < 0.4;
    if (!crowded) {
      AddFrustum(builder, pose, map.camera, height, color);
      last = &pose;
    }
  }
  return builder.Finish();
}

vtkSmartPointer<vtkPolyData> CurrentFrustum(const MapSnapshot& map, double height, const SceneStyle& style) {
  MeshBuilder builder;
  if (map.T_map_camera) {
    AddFrustum(builder, *map.T_map_camera, map.camera, height,
               ToRgba(ParseColor(style.cameras.current_color)));
  }
  return builder.Finish();
}

vtkSmartPointer<vtkPolyData> CovisibilityLines(const MapSnapshot& map, const SceneStyle& style) {
  const Rgba color = ToRgba(ParseColor(style.covisibility.color), style.covisibility.opacity);
  MeshBuilder builder;
  std::map<std::int64_t, vtkIdType> centers;
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    centers[keyframe.id] = builder.Add(keyframe.T_map_camera.translation, color);
  }
  for (const SnapshotCovisibility& pair : map.covisibility) {
    const auto first = centers.find(pair.first);
    const auto second = centers.find(pair.second);
    if (pair.points >= style.covisibility.min_points && first != centers.end() && second != centers.end()) {
      builder.Line(first->second, second->second);
    }
  }
  return builder.Finish();
}

vtkSmartPointer<vtkPolyData> PathLines(const std::vector<std::vector<Eigen::Vector3d>>& pieces,
                                       const Eigen::Vector3d& color) {
  MeshBuilder builder;
  for (const std::vector<Eigen::Vector3d>& piece : pieces) {
    builder.Path(piece, ToRgba(color));
  }
  return builder.Finish();
}

vtkSmartPointer<vtkPolyData> GroundGrid(const SceneFocus& focus, const SceneStyle& style) {
  const Eigen::Vector3d up = focus.up;
  const Eigen::Vector3d x = focus.main_direction       ? *focus.main_direction
                            : std::abs(up.z()) > 0.999 ? Eigen::Vector3d::UnitX()
                                                       : up.unitOrthogonal();
  const Eigen::Vector3d y = up.cross(x);
  const Eigen::Vector3d color = ParseColor(style.grid.color);
  const double cell = GridCell(focus);
  const double radius = style.grid.radius * focus.radius;
  const int reach = static_cast<int>(std::ceil(radius / cell));
  const Eigen::Vector2d middle(cell * std::round(focus.center.dot(x) / cell),
                               cell * std::round(focus.center.dot(y) / cell));
  MeshBuilder builder;
  const auto vertex = [&](double u, double v) {
    const double fade = 1.0 - std::hypot(u, v) / radius;
    const double opacity = style.grid.opacity * std::clamp(1.6 * fade, 0.0, 1.0);
    const Eigen::Vector3d p = (middle.x() + u) * x + (middle.y() + v) * y + focus.ground_height * up;
    return builder.Add(p, ToRgba(color, opacity));
  };
  constexpr int kPieces = 2;  // per cell, for fading
  for (int i = -reach; i <= reach; ++i) {
    for (int k = -reach * kPieces; k < reach * kPieces; ++k) {
      const double from = cell * k / kPieces;
      const double to = cell * (k + 1) / kPieces;
      if (std::min(std::hypot(i * cell, from), std::hypot(i * cell, to)) < radius) {
        builder.Line(vertex(i * cell, from), vertex(i * cell, to));
        builder.Line(vertex(from, i * cell), vertex(to, i * cell));
      }
    }
  }
  return builder.Finish();
}

vtkSmartPointer<vtkPolyData> ShadowQuad(const GroundShadow& shadow) {
  const vtkNew<vtkPoints> points;
  const vtkNew<vtkFloatArray> coordinates;
  coordinates->SetNumberOfComponents(2);
  const auto corner = [&](double across, double down) {
    const Eigen::Vector3d p = shadow.corner + across * shadow.across + down * shadow.down;
    coordinates->InsertNextTuple2(across, down);
    return points->InsertNextPoint(p.data());
  };
  const vtkNew<vtkCellArray> quad;
  quad->InsertNextCell({corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)});
  const auto mesh = vtkSmartPointer<vtkPolyData>::New();
  mesh->SetPoints(points);
  mesh->SetPolys(quad);
  mesh->GetPointData()->SetTCoords(coordinates);
  return mesh;
}

vtkSmartPointer<vtkTexture> ShadowTexture(const GroundShadow& shadow, double strength,
                                          const Eigen::Vector3d& background) {
  constexpr double kFloorOpacity = 0.5;  // opacity of the lit floor, relative to `strength`
  const bool lit = Lightness(background) < 0.25;
  const vtkNew<vtkImageData> image;
  image->SetDimensions(shadow.darkness.cols, shadow.darkness.rows, 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 4);
  auto* pixel = static_cast<Rgba*>(image->GetScalarPointer());
  const Rgba floor = ToRgba(0.5 * background + Eigen::Vector3d::Constant(0.5));
  for (int y = 0; y < shadow.darkness.rows; ++y) {
    for (int x = 0; x < shadow.darkness.cols; ++x) {
      const double dark = shadow.darkness.at<std::uint8_t>(y, x);
      double alpha = strength * dark;
      if (lit) {
        const double rim = std::hypot(2.0 * (x + 0.5) / shadow.darkness.cols - 1.0,
                                      2.0 * (y + 0.5) / shadow.darkness.rows - 1.0);
        alpha = kFloorOpacity * strength * std::clamp(2.0 - 2.0 * rim, 0.0, 1.0) * (255.0 - dark);
      }
      *pixel++ = {lit ? floor[0] : std::uint8_t{0}, lit ? floor[1] : std::uint8_t{0},
                  lit ? floor[2] : std::uint8_t{0}, static_cast<unsigned char>(std::lround(alpha))};
    }
  }
  const auto texture = vtkSmartPointer<vtkTexture>::New();
  texture->SetInputData(image);
  texture->SetColorModeToDirectScalars();
  texture->InterpolateOn();
  texture->EdgeClampOn();
  return texture;
}

}  // namespace sqslam
