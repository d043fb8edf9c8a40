#include "render/gl/seen_tiles.h"

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkCellArrayIterator.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>

namespace sqslam {
namespace {

Eigen::Matrix4d ToDevice(vtkActor* actor, const Lens& lens) {
  return lens.T_device_map *
         Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(actor->GetMatrix()->GetData());
}

void MarkBounds(vtkActor* actor, const Lens& lens, cv::Size picture, double margin, TileContent content,
                ScreenTiles& tiles) {
  const double* bounds = actor->GetMapper()->GetBounds();
  const Eigen::AlignedBox3d box(Eigen::Vector3d(bounds[0], bounds[2], bounds[4]),
                                Eigen::Vector3d(bounds[1], bounds[3], bounds[5]));
  const Eigen::AlignedBox2d seen = SeenPart(box, ToDevice(actor, lens), picture);
  tiles.Mark({seen.min().array() - margin, seen.max().array() + margin}, content);
}

// Marks the part of a line, between clip coordinates, that is not before the near plane.
void MarkSegment(Eigen::Vector4d a, Eigen::Vector4d b, cv::Size picture, double margin, TileContent content,
                 ScreenTiles& tiles) {
  const double before = a.z() + a.w();  // negative before the near plane
  const double after = b.z() + b.w();
  if (before <= 0.0 && after <= 0.0) {
    return;
  }
  if (before < 0.0 || after < 0.0) {
    const Eigen::Vector4d cut = a + before / (before - after) * (b - a);
    (before < 0.0 ? a : b) = cut;
  }
  const auto pixel = [&](const Eigen::Vector4d& p) -> Eigen::Vector2d {
    return (0.5 * (p.head<2>().array() / p.w() + 1.0)) * Eigen::Array2d(picture.width, picture.height);
  };
  tiles.MarkLine(pixel(a), pixel(b), margin, content);
}

void MarkLines(vtkActor* actor, const Lens& lens, cv::Size picture, double margin, TileContent content,
               ScreenTiles& tiles) {
  vtkPolyData* data = vtkPolyDataMapper::SafeDownCast(actor->GetMapper())->GetInput();
  const Eigen::Matrix4d T_device_data = ToDevice(actor, lens);
  const double wide = margin + 0.5 * actor->GetProperty()->GetLineWidth();
  const auto place = [&](vtkIdType point) -> Eigen::Vector4d {
    return T_device_data * Eigen::Vector3d(data->GetPoint(point)).homogeneous();
  };
  const auto lines = vtk::TakeSmartPointer(data->GetLines()->NewIterator());
  for (lines->GoToFirstCell(); !lines->IsDoneWithTraversal(); lines->GoToNextCell()) {
    vtkIdType size = 0;
    const vtkIdType* points = nullptr;
    lines->GetCurrentCell(size, points);
    for (vtkIdType i = 0; i + 1 < size; ++i) {
      MarkSegment(place(points[i]), place(points[i + 1]), picture, wide, content, tiles);
    }
  }
}

}  // namespace

ScreenTiles SeenTiles(const PictureLayers& layers, const Lens& lens, cv::Size picture, double margin) {
  ScreenTiles tiles(picture);
  for (vtkActor* solid : layers.solids) {
    MarkBounds(solid, lens, picture, margin, TileContent::kNearSolid, tiles);
  }
  const auto mark = [&](vtkActor* actor, TileContent content) {
    vtkPolyData* data = vtkPolyDataMapper::SafeDownCast(actor->GetMapper())->GetInput();
    const auto mark_parts = data->GetNumberOfPolys() > 0 ? MarkBounds : MarkLines;
    mark_parts(actor, lens, picture, margin, content, tiles);
  };
  for (vtkActor* actor : layers.opaque) {
    mark(actor, TileContent::kDeep);
  }
  for (vtkActor* actor : layers.ground) {
    mark(actor, TileContent::kFlat);
  }
  return tiles;
}

}  // namespace sqslam
