#include "app/viewer/model/object_history.h"

#include <cmath>
#include <numbers>

namespace sqslam::viewer {
namespace {

// yaw plus as many half turns as bring it nearest to `reference`.
double NearestYaw(double yaw, double reference) {
  return yaw + std::numbers::pi * std::round((reference - yaw) / std::numbers::pi);
}

}  // namespace

void ObjectHistories::Add(int snapshot, const MapSnapshot& map) {
  for (const SnapshotObject& object : map.objects) {
    const Superquadric& shape = object.superquadric.shape;
    ObjectHistory& history = histories_[object.id];
    history.label = object.label;
    ObjectSample sample;
    sample.snapshot = snapshot;
    sample.frame_index = map.frame_index;
    sample.observations = object.observations;
    sample.points = object.points;
    sample.yaw = history.samples.empty() ? object.yaw : NearestYaw(object.yaw, history.samples.back().yaw);
    sample.half_size = shape.half_size;
    sample.e1 = shape.e1;
    sample.e2 = shape.e2;
    sample.residual = object.fit.point_rms;
    history.samples.push_back(sample);
  }
}

ObjectHistories ReadObjectHistories(const RecordingReader& recording, const PassProgress& progress) {
  ObjectHistories histories;
  for (int i = 0; i < recording.Size(); ++i) {
    histories.Add(i, *recording.Read(i));
    if (progress && !progress(i + 1, recording.Size())) {
      break;
    }
  }
  return histories;
}

}  // namespace sqslam::viewer
