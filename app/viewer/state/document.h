#pragma once

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/frames/timeline.h"
#include "app/viewer/model/run_history.h"
#include "render/scene/style.h"
#include "slam/snapshot/recording.h"

namespace sqslam::viewer {

// The recording or run that is open, and its frame on the screen. Kept by Session; EditingSession puts edited
// maps in the place of recorded ones. All others only read it.
struct Document {
  enum class Kind { kNone, kRecording, kRun };
  Kind kind = Kind::kNone;
  std::filesystem::path file;  // map.sqmap
  std::string title;           // for people: the folder's name
  RecordingInfo info;
  MapSnapshotPtr last;   // the finished map; of a run the newest
  MapSnapshotPtr frame;  // the map from which framing, scale and colours come
  LabelColors colors;    // of that map's classes
  Timeline timeline;
  std::shared_ptr<const ObjectHistories> histories;  // null until all of a recording is read
  double progress = 0.0;                             // share of the recording that is read, [0, 1]
  bool loading = false;                              // nothing can be shown yet
  ShownFramePtr shown;                               // null: nothing yet
  ShownFramePtr recorded;                            // the same without edits
  RunStatus run;

  const MapSnapshot* Map() const { return MapOf(shown); }

  // Objects of the map on the screen; null where there is none of that id.
  const SnapshotObject* Object(std::optional<int> id) const { return Find(Map(), id); }
  const SnapshotObject* RecordedObject(std::optional<int> id) const { return Find(MapOf(recorded), id); }

 private:
  static const MapSnapshot* MapOf(const ShownFramePtr& frame) {
    return frame && frame->map ? frame->map.get() : nullptr;
  }
  static const SnapshotObject* Find(const MapSnapshot* map, std::optional<int> id) {
    if (map == nullptr || !id) {
      return nullptr;
    }
    const auto found = std::ranges::find(map->objects, *id, &SnapshotObject::id);
    return found == map->objects.end() ? nullptr : &*found;
  }
};

// The user's choices in the map, in whichever panel.
struct Selection {
  std::optional<int> selected;  // id of an object
  std::optional<int> hovered;   // the object under the mouse
  std::optional<int> pointed;   // set by panels while they are drawn; hovered in the next frame

  bool measuring = false;                 // clicks pick points
  std::vector<Eigen::Vector3d> measured;  // at most two, map frame: their distance is shown
};

}  // namespace sqslam::viewer
