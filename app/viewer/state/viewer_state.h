#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/frames/replay.h"
#include "app/viewer/frames/shown_frame.h"
#include "app/viewer/frames/timeline.h"
#include "app/viewer/layout.h"
#include "app/viewer/state/camera_keys.h"
#include "app/viewer/state/editing.h"
#include "app/viewer/state/layers.h"
#include "render/camera/camera_path.h"
#include "render/camera/scene_framing.h"
#include "render/scene/clip_plane.h"
#include "render/scene/style.h"

// What the window shows, as one value that all panels share: no OpenGL, no ImGui. Panels read it, change what
// is the user's to change (camera, style, selection, playback) and ask for the rest by requests, which the
// viewer carries out after the frame.
namespace sqslam::viewer {

// What is open.
struct Document {
  enum class Kind { kNone, kRecording, kRun };
  Kind kind = Kind::kNone;
  std::filesystem::path file;  // map.sqmap
  std::string title;           // for people: the folder's name
  RecordingInfo info;
  std::optional<RunStats> stats;
  MapSnapshotPtr last;   // the finished map; of a run the newest
  MapSnapshotPtr frame;  // the map from which framing, scale and colours come
  Timeline timeline;
  double progress = 0.0;  // share of the recording that the plots know, [0, 1]
  bool loading = false;   // nothing can be shown yet
};

// A run that goes on behind the window.
struct RunStatus {
  bool active = false;
  bool paused = false;
  bool ending = false;      // told to end; what is mapped is being saved
  std::string state;        // "tracking", "lost", ...
  std::int64_t frames = 0;  // done
  std::int64_t total = 0;   // 0: endless
  double max_rate = 0.0;    // frames a second at most; 0: as fast as it goes
};

// How the camera moves by itself.
enum class CameraMode {
  kFree,         // as the user puts it
  kFollow,       // behind the input camera
  kFirstPerson,  // through the input camera
};

struct View {
  ViewCamera camera;
  CameraMode mode = CameraMode::kFree;
  bool automatic = true;   // the camera frames the map by itself until somebody moves it
  std::string preset;      // name of the view (render/view_presets.h) that the camera still is, or empty
  std::string style_name;  // of configs/styles
  SceneStyle style;
  int style_version = 0;  // counted up by whoever changes the style
};

// A distance between two picked points of the map.
struct Measurement {
  bool active = false;                  // clicks pick points
  std::vector<Eigen::Vector3d> points;  // at most two, map frame
};

struct Notice {
  std::string text;
  bool error = false;
  double seconds_left = 6.0;
};

enum class Theme { kDark, kLight };

// What the viewer does for a panel.
struct OpenRequest {
  std::filesystem::path path;
};
struct ScreenshotRequest {
  std::filesystem::path file;  // empty: a free name in the working folder
  int width = 0;               // 0: as the view on the screen
  int height = 0;
  bool transparent = false;
};
struct CopyTextRequest {
  std::string text;
  std::string notice;
};
struct FilmRequest {
  bool on = false;  // film what is on the screen, or end that
};
struct SaveTextRequest {
  std::string name;  // of the file, in the working folder, without number and extension
  std::string extension;
  std::string text;
};
struct RunRequestChange {  // of the run behind the window
  enum class What { kPause, kContinue, kStep, kEnd } what = What::kPause;
};
struct QuitRequest {};

// What was asked for since the last frame; of most things only the newest counts.
struct Requests {
  std::optional<OpenRequest> open;
  std::vector<ScreenshotRequest> screenshots;
  std::optional<CopyTextRequest> copy;
  std::optional<RunRequestChange> run;
  std::optional<FilmRequest> film;
  std::optional<SaveTextRequest> save;
  std::optional<QuitRequest> quit;

  bool Empty() const { return !open && screenshots.empty() && !copy && !run && !film && !save && !quit; }
};

struct ViewerState {
  Document document;
  RunStatus run;
  ShownFramePtr shown;  // null: nothing yet
  SceneFocus focus;     // of the document's frame
  LabelColors colors;

  Playback playback;
  View view;
  std::optional<int> selected;  // id of an object
  std::optional<int> hovered;   // the object under the mouse, in whichever panel
  std::optional<int> pointed;   // where panels say so; hovered in the next frame
  Measurement measurement;
  Layers layers;
  Editing editing;
  CameraKeys camera_keys;
  bool filming = false;          // what is on the screen goes into a video
  ScreenshotRequest screenshot;  // what F12 asks for: size and background that were chosen last

  Theme theme = Theme::kDark;
  double ui_scale = 1.0;  // pixels for one of the layout's
  bool show_help = false;
  bool show_image = true;
  cv::Size scene_size;          // of the scene on the screen, pixels
  cv::Point scene_corner;       // its top-left corner in the window
  double seconds = 1.0 / 60.0;  // since the last frame of the window
  std::vector<Notice> notices;
  LayoutSettings layout;
  std::string to_front;  // title of a tab that is to be shown; empty: none
  Requests requests;

  const MapSnapshot* Map() const { return shown && shown->map ? shown->map.get() : nullptr; }
  const SnapshotObject* Object(std::optional<int> id) const;

  void Say(std::string text) { notices.push_back({std::move(text), false, 5.0}); }
  void Complain(std::string text) { notices.push_back({std::move(text), true, 12.0}); }
  void Ask(OpenRequest request) { requests.open = std::move(request); }
  void Ask(ScreenshotRequest request) { requests.screenshots.push_back(std::move(request)); }
  void Ask(CopyTextRequest request) { requests.copy = std::move(request); }
  void Ask(RunRequestChange request) { requests.run = request; }
  void Ask(FilmRequest request) { requests.film = request; }
  void Ask(SaveTextRequest request) { requests.save = std::move(request); }
  void Ask(QuitRequest request) { requests.quit = request; }
};

// The name that somebody gave it, or its label as people write it, with its number: "potted plant 3".
std::string ObjectName(const SnapshotObject& object);

// The named view of the present map, or the automatic one for an empty name.
ViewCamera NamedView(const ViewerState& state, const std::string& name);

// What cuts the scene on the screen; empty: nothing.
std::optional<ClipPlane> CutOf(const ViewerState& state);

// Cuts the scene towards the camera, or no longer.
void SwitchCut(ViewerState& state);

// A dense cloud to be read and drawn, in the map's frame unless somebody said otherwise.
void ShowCloud(ViewerState& state, const std::filesystem::path& file);

// Puts the camera there; it follows a growing map until somebody moves it.
void LookFrom(ViewerState& state, const std::string& preset);

// Asks for the command of the present picture on the clipboard.
void CopyCommand(ViewerState& state);

// Loads a style by its name; says so where that fails.
void UseStyle(ViewerState& state, const std::string& name);

}  // namespace sqslam::viewer
