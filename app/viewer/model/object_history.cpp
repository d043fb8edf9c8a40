#include "app/viewer/model/object_history.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace sqslam::viewer {
namespace {

constexpr double kQuarter = 0.5 * std::numbers::pi;

// The same solids by so many quarter turns less, x and y named accordingly.
void TurnBack(std::vector<ObjectSample>& samples, long quarters) {
  for (ObjectSample& sample : samples) {
    sample.yaw -= static_cast<double>(quarters) * kQuarter;
    if (quarters % 2 != 0) {
      std::swap(sample.half_size.x(), sample.half_size.y());
    }
  }
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
    sample.yaw = object.yaw;
    if (!history.samples.empty()) {
      TurnBack(history.samples, std::lround((history.samples.back().yaw - object.yaw) / kQuarter));
    }
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
