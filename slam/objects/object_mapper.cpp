#include "slam/objects/object_mapper.h"

namespace sqslam {

struct ObjectMapper::Impl {
  ObjectOptions options;
  std::shared_ptr<const ObjectMapView> view = std::make_shared<ObjectMapView>();
};

ObjectMapper::ObjectMapper(const ObjectOptions& options, std::uint64_t) : impl_(new Impl{options}) {}
ObjectMapper::~ObjectMapper() = default;
ObjectMapper::ObjectMapper(ObjectMapper&&) noexcept = default;
ObjectMapper& ObjectMapper::operator=(ObjectMapper&&) noexcept = default;
void ObjectMapper::AddObservations(std::span<const ObjectObservation>) {}
void ObjectMapper::SetUpright(bool, std::optional<double>) {}
void ObjectMapper::Update(const PointLookup&, const Camera&, const PoseLookup&) {}
void ObjectMapper::UpdateAll(const PointLookup&, const Camera&, const PoseLookup&) {}
void ObjectMapper::Transform(const Rigid3d&) {}
void ObjectMapper::Transform(const Sim3d&) {}
std::vector<SnapshotObject> ObjectMapper::Objects() const { return {}; }
std::shared_ptr<const ObjectMapView> ObjectMapper::View() const { return impl_->view; }
std::unordered_map<std::int64_t, int> ObjectMapper::PointObjects() const { return {}; }

}  // namespace sqslam
