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

}  // namespace sqslam
