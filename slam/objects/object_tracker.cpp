#include "slam/objects/object_tracker.h"

namespace sqslam {

struct ObjectTracker::Impl {
  ObjectOptions options;
};

ObjectTracker::ObjectTracker(const ObjectOptions& options, std::uint64_t) : impl_(new Impl{options}) {}
ObjectTracker::~ObjectTracker() = default;
ObjectTracker::ObjectTracker(ObjectTracker&&) noexcept = default;
ObjectTracker& ObjectTracker::operator=(ObjectTracker&&) noexcept = default;
std::vector<ObjectObservation> ObjectTracker::Track(const ObjectFrame&, const ObjectMapView&) { return {}; }
void ObjectTracker::Transform(const Rigid3d&) {}
void ObjectTracker::Transform(const Sim3d&) {}

}  // namespace sqslam
