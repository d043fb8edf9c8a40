#include "render/scene/point_actors.h"

#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkUnsignedCharArray.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <numbers>
#include <numeric>
#include <random>
#include <span>

namespace sqslam {
namespace {

constexpr std::size_t kLargestPart = 25000;  // points
constexpr int kLevels = 7;
constexpr double kLayers = 3.0;  // points drawn over each pixel of a part, at most

// Splits at the median of the longest side until the parts are small.
void Split(std::span<vtkIdType> ids, vtkPoints* points,
           const std::function<void(std::span<vtkIdType>)>& take) {
  if (ids.size() <= kLargestPart) {
    take(ids);
    return;
  }
  Eigen::Array3d low = Eigen::Array3d::Constant(1e300);
  Eigen::Array3d high = -low;
  for (const vtkIdType id : ids) {
    const Eigen::Map<const Eigen::Array3d> p(points->GetPoint(id));
    low = low.min(p);
    high = high.max(p);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const auto middle = ids.begin() + static_cast<std::ptrdiff_t>(ids.size() / 2);
  std::nth_element(ids.begin(), middle, ids.end(), [&](vtkIdType a, vtkIdType b) {
    const double x = points->GetPoint(a)[axis];
    const double y = points->GetPoint(b)[axis];
    return x != y ? x < y : a < b;
  });
  Split(ids.first(ids.size() / 2), points, take);
  Split(ids.subspan(ids.size() / 2), points, take);
}

vtkSmartPointer<vtkActor> MakeActor(vtkPoints* points, vtkDataArray* colors, vtkIdType count,
                                    double diameter) {
  const vtkNew<vtkCellArray> vertices;
  vertices->AllocateEstimate(count, 1);
  for (vtkIdType i = 0; i < count; ++i) {
    vertices->InsertNextCell(1, &i);
  }
  const vtkNew<vtkPolyData> cloud;
  cloud->SetPoints(points);
  cloud->GetPointData()->SetScalars(colors);
  cloud->SetVerts(vertices);
  const vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(cloud);
  const auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->GetProperty()->SetLighting(false);
  actor->GetProperty()->SetPointSize(static_cast<float>(diameter));
  actor->GetProperty()->RenderPointsAsSpheresOn();
  actor->ForceOpaqueOn();
  return actor;
}

}  // namespace

void PointActors::Show(vtkPolyData* cloud) {
  parts_.clear();
  vtkPoints* all = cloud->GetPoints();
  auto* colors = vtkUnsignedCharArray::SafeDownCast(cloud->GetPointData()->GetScalars());
  if (all == nullptr || all->GetNumberOfPoints() == 0) {
    return;
  }
  std::vector<vtkIdType> ids(static_cast<std::size_t>(all->GetNumberOfPoints()));
  std::iota(ids.begin(), ids.end(), vtkIdType{0});
  const bool whole = ids.size() <= kLargestPart;
  std::mt19937 random(1);
  Split(ids, all, [&](std::span<vtkIdType> members) {
    if (!whole) {  // so that the first half of a part is spread over all of it
      for (std::size_t i = members.size() - 1; i > 0; --i) {
        std::swap(members[i], members[random() % (i + 1)]);
      }
    }
    const vtkNew<vtkPoints> points;
    points->SetDataTypeToFloat();
    const vtkNew<vtkUnsignedCharArray> part_colors;
    part_colors->SetNumberOfComponents(colors->GetNumberOfComponents());
    Eigen::AlignedBox3d box;
    for (const vtkIdType id : members) {
      const Eigen::Map<const Eigen::Vector3d> p(all->GetPoint(id));
      box.extend(p);
      points->InsertNextPoint(p.data());
      part_colors->InsertNextTuple(id, colors);
    }
    Part& part = parts_.emplace_back();
    part.center = box.center();
    part.half_size = 0.5 * box.diagonal();
    part.points = static_cast<int>(members.size());
    for (int level = 0; level < (whole ? 1 : kLevels); ++level) {
      part.levels.push_back(MakeActor(points, part_colors, std::max(1, part.points >> level), diameter_));
      part.levels.back()->GetMapper()->SetClippingPlanes(clip_);
    }
  });
}

std::vector<vtkActor*> PointActors::Arrange(const ViewCamera& camera, double pixels) const {
  const double focal = camera.FocalLength(pixels);
  std::vector<vtkActor*> actors;
  for (const Part& part : parts_) {
    const Eigen::Vector3d line = part.center - camera.position;
    const double distance = std::max(line.norm(), 1e-9);
    const double nearest = std::max(distance - part.half_size.norm(), 1e-2 * distance);
    const Eigen::Vector3d across = (line / distance).cwiseAbs();
    const Eigen::Vector3d& h = part.half_size;
    const double area = 4.0 * (h.y() * h.z() * across.x() + h.x() * h.z() * across.y() +
                               h.x() * h.y() * across.z());  // of the box as seen along the line
    const double covered = area * focal * focal / (nearest * nearest);
    const double enough = kLayers * covered / (0.25 * std::numbers::pi * diameter_ * diameter_);
    std::size_t level = 0;
    while (level + 1 < part.levels.size() && part.points >> level > enough) {
      ++level;
    }
    actors.push_back(part.levels[level]);
  }
  return actors;
}

}  // namespace sqslam
