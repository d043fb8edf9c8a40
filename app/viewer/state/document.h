#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "app/viewer/frames/timeline.h"
#include "slam/snapshot/recording.h"

namespace sqslam::viewer {

// The open recording or run, and its frame on the screen. Session maintains it, except for the edited maps,
// which EditingSession makes of the recorded ones. All others only read it.
struct Document {
  std::filesystem::path file;  // map.sqmap, absolute
  std::string title;           // name of its folder
  RecordingInfo info;
  MapSnapshotPtr frame;  // the map that framing and scale are based on
  Timeline timeline;
  std::shared_ptr<const ObjectHistories> histories;  // null until the recording is read completely
  double progress = 0.0;                             // share of the recording read so far, [0, 1]
  bool loading = false;                              // nothing can be shown yet
  MapSnapshotPtr recorded_last;                      // the finished map; during a run the newest
  ShownFramePtr recorded;                            // the frame on the screen; null: nothing yet
  MapSnapshotPtr last;                               // both as edited
  ShownFramePtr shown;
  RunStatus run;
  std::string failure;  // why the run left no map; empty: no failure

  void SetFile(const std::filesystem::path& map) {
    file = std::filesystem::absolute(map).lexically_normal();  // the working folder may go away later
    title = (file.filename() == "map.sqmap" ? file.parent_path() : file).filename().string();
  }

  const MapSnapshot* Map() const { return MapOf(shown); }

  // Return the object with this id in the map on the screen, or in its unedited map; null if there is none.
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

// The user's selection in the map, in any panel.
struct Selection {
  std::optional<int> selected;           // id of an object
  std::optional<int> hovered;            // the object under the mouse
  std::optional<int> pointed;            // set by panels while drawing; becomes `hovered` in the next frame
  std::optional<std::set<int>> answers;  // to the question in the search field: all others fade

  bool measuring = false;                 // clicks pick points
  std::vector<Eigen::Vector3d> measured;  // at most two, map frame; their distance is shown
  bool missed = false;                    // the last click while measuring met nothing

  void SetMeasuring(bool on) {
    measuring = on;
    missed = false;
    measured.clear();
  }
  // Takes a point to measure from; empty: the click met nothing.
  void Measure(const std::optional<Eigen::Vector3d>& p_map) {
    missed = !p_map;
    if (p_map) {
      if (measured.size() >= 2) {
        measured.clear();
      }
      measured.push_back(*p_map);
    }
  }
  // Returns what the view waits for; empty unless it is measuring.
  std::string Hint() const {
    return !measuring             ? ""
           : missed               ? "Nothing there: click on an object or on a point"
           : measured.empty()     ? "Click the first point, on an object or on a point of the map"
           : measured.size() == 1 ? "Click the second point"
                                  : "The next click measures anew; M or Escape ends";
  }
};

// Requests of panels and keys to the viewer, which handles them before the next frame.
struct OpenRequest {
  std::filesystem::path path;
};
struct ScreenshotRequest {
  int width = 0;  // 0: size of the view on the screen
  int height = 0;
  bool transparent = false;
};
struct CopyCommandRequest {};  // copies the command for the present picture
struct FilmRequest {
  bool on = false;  // true starts, false ends a video of the screen
};
struct SaveTextRequest {
  std::string name;  // of the file in the working folder, without number and extension
  std::string extension;
  std::string text;
};
struct QuitRequest {};

using Request = std::variant<OpenRequest, ScreenshotRequest, CopyCommandRequest, FilmRequest, SaveTextRequest,
                             RunControl, QuitRequest>;

struct Notice {
  std::string text;
  bool error = false;         // stays until a click or Escape
  double seconds_left = 5.0;  // of others
};

// Messages in the window.
struct Messages {
  std::vector<Notice> notices;

  void AddNotice(std::string text) { notices.push_back({std::move(text)}); }
  // An error that is still there is not added again.
  void AddError(std::string text) {
    std::erase_if(notices, [&](const Notice& notice) { return notice.error && notice.text == text; });
    notices.push_back({std::move(text), true});
  }
  // Removes all errors; returns true if there were any.
  bool CloseErrors() { return std::erase_if(notices, &Notice::error) > 0; }

  // Runs `action`; an exception becomes a message. Returns false then.
  bool Try(auto&& action) {
    try {
      action();
      return true;
    } catch (const std::exception& error) {
      AddError(error.what());
      return false;
    }
  }
};

}  // namespace sqslam::viewer
