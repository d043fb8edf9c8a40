#include "render/scene/object_look.h"

#include "slam/objects/object_class.h"

namespace sqslam {

namespace {

bool ShowsParts(const SnapshotObject& object, const SceneStyle::Objects& style) {
  return !object.parts.empty() && (style.look == ObjectLook::kAuto || style.look == ObjectLook::kParts);
}

}  // namespace

std::vector<PosedSuperquadric> DrawnSolids(const SnapshotObject& object, const SceneStyle::Objects& style) {
  return ShowsParts(object, style) ? SolidsOf(object) : std::vector{object.superquadric};
}

ObjectLook LookOf(const SnapshotObject& object, const SceneStyle::Objects& style, bool dense) {
  if (style.look != ObjectLook::kAuto && style.look != ObjectLook::kParts) {
    return style.look;
  }
  static const ClassTable kClasses = ClassTable::Named("default");
  const bool hollow = kClasses.Of(object.label).hollow && !ShowsParts(object, style);
  return (dense && style.look == ObjectLook::kAuto) || hollow ? ObjectLook::kGlass : ObjectLook::kSolid;
}

bool HidesOthers(const SnapshotObject& object, const SceneStyle::Objects& style, bool see_through) {
  const bool certain = style.uncertain == UncertainObjects::kSolid || IsReliable(object);
  return certain &&
         (see_through || (LookOf(object, style, false) == ObjectLook::kSolid && !ShowsParts(object, style)));
}

MapSnapshot Highlighted(MapSnapshot map, const std::set<int>& chosen) {
  for (std::size_t i = 0; i < map.objects.size(); ++i) {
    const bool is_chosen = chosen.contains(static_cast<int>(i));
    map.objects[i].fit.reliability = is_chosen ? 1.0 : 0.0;  // those of 0 are drawn as faint outlines
    if (!is_chosen) {
      map.objects[i].name = " ";
    }
  }
  return map;
}

}  // namespace sqslam
