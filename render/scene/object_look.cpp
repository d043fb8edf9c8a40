#include "render/scene/object_look.h"

#include "slam/objects/class_priors.h"

namespace sqslam {

ObjectLook LookOf(const std::string& label, const SceneStyle::Objects& style, bool dense) {
  if (style.look != ObjectLook::kAuto) {
    return style.look;
  }
  static const ClassPriors kClasses = ClassPriors::Named("default");
  return dense || kClasses.Of(label).hollow ? ObjectLook::kGlass : ObjectLook::kSolid;
}

bool HidesOthers(const SnapshotObject& object, const SceneStyle::Objects& style, bool see_through) {
  const bool certain = style.uncertain == UncertainObjects::kSolid || IsReliable(object);
  return certain && (see_through || LookOf(object.label, style, false) == ObjectLook::kSolid);
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
