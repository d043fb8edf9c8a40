#pragma once

#include <vtkActor.h>
#include <vtkPlaneCollection.h>
#include <vtkSmartPointer.h>

#include <Eigen/Core>
#include <map>
#include <vector>

#include "render/camera/camera_path.h"
#include "render/scene/solid_meshes.h"
#include "render/scene/studio_light.h"
#include "render/scene/style.h"
#include "render/solids/scene_order.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// The superquadrics of a map as VTK actors, in the order and with the detail that a view asks for. For the
// sources of render/ only.
class SolidActors {
 public:
  // `clip`: planes that cut the solids, as they are when a picture is drawn.
  SolidActors(const SceneStyle::Objects& style, vtkPlaneCollection* clip) : style_(style), clip_(clip) {}

  // `look` is not kAuto.
  void Show(const std::vector<SnapshotObject>& objects, const LabelColors& colors, ObjectLook look);

  // The surroundings that solids are seen in.
  struct Surroundings {
    Studio studio;
    // Translucent solids. Distances are handed on to the picture's effects as
    // log2(distance / range.x) * range.y, 0 to 1 in eight bits; range.z: how much nearer still counts as
    // behind.
    Eigen::Vector3f range = Eigen::Vector3f::Ones();
    float nearer = 0.0F;  // subtracted from the depth in clip space: points on a solid then lie in it
  };

  // The actors for this view, farthest first. `pixels` is the height of the picture in samples: the grid of
  // a solid is as fine as its size in the picture asks for.
  std::vector<vtkActor*> Arrange(const ViewCamera& camera, double pixels, const Surroundings& around);

  // By number.
  std::vector<Eigen::Vector3d> Colors() const;

 private:
  // One superquadric: its far side and its near side, so that both blend in the right order.
  struct Solid {
    PosedSuperquadric posed;
    Eigen::Vector3d color = Eigen::Vector3d::Zero();
    int segments = 0;  // of the mesh that the actors show, 0: none yet
    vtkSmartPointer<vtkActor> back;
    vtkSmartPointer<vtkActor> front;
  };
  // Solids that reach into one another, as one surface whose triangles are put in order for each view.
  struct Group {
    vtkSmartPointer<vtkActor> actor;
    GroupedSurface surface;
  };

  bool SeeThrough() const { return look_ != ObjectLook::kSolid; }
  Solid MakeSolid(int number) const;
  std::vector<vtkActor*> InOrder(const ViewCamera& camera, double pixels);
  int SegmentsFor(const PosedSuperquadric& solid, const ViewCamera& camera, double pixels) const;
  void SetDetail(Solid& solid, int segments);
  Group& GroupOf(const std::vector<int>& members);

  SceneStyle::Objects style_;
  ObjectLook look_ = ObjectLook::kSolid;
  vtkSmartPointer<vtkPlaneCollection> clip_;
  std::vector<Solid> solids_;
  std::map<std::vector<int>, Group> groups_;
  SolidOrder order_;
};

}  // namespace sqslam
