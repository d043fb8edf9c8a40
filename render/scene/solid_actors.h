#pragma once

#include <vtkActor.h>
#include <vtkPlaneCollection.h>
#include <vtkSmartPointer.h>

#include <Eigen/Core>
#include <vector>

#include "render/camera/camera_path.h"
#include "render/scene/object_look.h"
#include "render/scene/studio_light.h"
#include "render/scene/style.h"
#include "render/solids/scene_order.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// The superquadrics of a map as VTK actors, in the order and with the detail that a view needs. For the
// sources of render/ only.
class SolidActors {
 public:
  // `clip`: planes that cut the solids; read whenever a picture is drawn.
  SolidActors(const SceneStyle::Objects& style, vtkPlaneCollection* clip) : style_(style), clip_(clip) {}

  // `dense`: among a dense cloud or mesh (LookOf).
  void Show(const std::vector<SnapshotObject>& objects, const ObjectColor& color_of, bool dense);

  // True if all solids are glass or outlines and write no depth. Single solids of glass among others do.
  bool SeeThrough() const { return see_through_; }

  struct Surroundings {
    Studio studio;
    // For translucent solids. The picture's effects get distances as log2(distance / range.x) * range.y, 0 to
    // 1 in eight bits. Surfaces farther than range.z times the distance count as behind.
    Eigen::Vector3f range = Eigen::Vector3f::Ones();
    float nearer = 0.0F;    // subtracted from clip-space depth, so that points on a solid lie inside it
    bool parallel = false;  // orthographic: all rays to the eye are parallel
  };

  // Returns the actors for this view, farthest first. `pixels`: height of the picture in samples, from which
  // the fineness of each solid's grid follows.
  std::vector<vtkActor*> Arrange(const ViewCamera& camera, double pixels, const Surroundings& around);

  // Returns colours and looks in the order of the solids' numbers.
  std::vector<std::pair<Eigen::Vector3d, ObjectLook>> Looks() const;

 private:
  // One superquadric, with actors for its far and its near side, so that they blend in the right order.
  struct Solid {
    PosedSuperquadric posed;
    Eigen::Vector3d color = Eigen::Vector3d::Zero();
    ObjectLook look = ObjectLook::kSolid;
    double opacity = 1.0;
    int segments = 0;  // of the actors' mesh; 0: none yet
    vtkSmartPointer<vtkActor> back;
    vtkSmartPointer<vtkActor> front;
  };
  double OpacityOf(ObjectLook look) const;
  Solid MakeSolid(int number) const;
  void Place(const PosedSuperquadric& posed, Solid& solid) const;
  std::vector<vtkActor*> InOrder(const ViewCamera& camera, double pixels);
  int SegmentsFor(const PosedSuperquadric& solid, const ViewCamera& camera, double pixels) const;
  void SetDetail(Solid& solid, int segments);

  SceneStyle::Objects style_;
  bool see_through_ = false;
  vtkSmartPointer<vtkPlaneCollection> clip_;
  std::vector<Solid> solids_;
  bool translucent_ = false;  // any of them
  SolidOrder order_;
};

}  // namespace sqslam
