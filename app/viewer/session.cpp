#include "app/viewer/session.h"

#include <fmt/format.h>

#include <utility>

#include "app/result/map_input.h"
#include "app/terminal/terminal.h"
#include "app/viewer/state/scene_view.h"
#include "render/picture/picture.h"

namespace sqslam::viewer {
namespace fs = std::filesystem;

void Session::Open(const fs::path& path) {
  if (run_) {
    state_.messages.AddError("A run is in progress; end it before you open something else.");
    return;
  }
  Close();
  state_.playback = {};
  state_.selection = {};
  state_.view.preset = "";
  Read(path);
}

// Starts reading a recording; the screen keeps its content until the recording is there.
void Session::Read(const fs::path& path) {
  requested_.reset();
  state_.document.loading = true;
  state_.document.SetFile(app::MapFile(path));
  replay_ = std::make_unique<Replay>(state_.document.file);
}

void Session::Close() {
  state_.document = {};
  state_.selection.selected.reset();
  state_.layers = {};  // they belonged to another map
}

void Session::Watch(std::unique_ptr<LiveRun> run, const RunRequest& request) {
  run_ = std::move(run);
  Document& document = state_.document;
  document = {};
  document.SetFile(request.output / "map.sqmap");
  document.info.sequence_path = request.IsLive() ? "" : fs::absolute(request.sequence.path).string();
  document.run = LiveRun::News().status;
}

void Session::Control(const RunControl& control) {
  if (run_) {
    run_->Control(control);
  }
}

// Updates framing and scale only if the map has changed notably, so that the view does not jitter.
void Session::Frame(const MapSnapshotPtr& map) {
  Document& document = state_.document;
  const SceneFocus focus = FindFocus(*map);
  if (document.frame) {
    const SceneFocus& before = state_.view.focus;
    const double growth = focus.radius / before.radius;
    if (growth > 0.85 && growth < 1.18 && (focus.center - before.center).norm() < 0.15 * focus.radius &&
        focus.up.dot(before.up) > 0.99) {
      return;
    }
  }
  document.frame = map;
  state_.view.focus = focus;
  IncludeLayers(framed_layers_, state_.view.focus);
}

void Session::FrameLayers() {
  // The mesh and the points of a recording cover the same space: one of them is enough.
  const SceneLayers& drawn = state_.layers.drawn;
  const SceneLayers layers{{}, drawn.dense_cloud, drawn.dense_cloud ? nullptr : drawn.dense_mesh};
  if (layers == framed_layers_) {
    return;
  }
  framed_layers_ = layers;
  SceneView& view = state_.view;
  if (const MapSnapshotPtr& map = state_.document.frame) {
    view.focus = FindFocus(*map);
    IncludeLayers(framed_layers_, view.focus);
    if (view.automatic && view.mode == CameraMode::kFree && view.size.area() > 0) {
      view.LookFrom(view.preset);
    }
  }
}

void Session::TakeRunNews() {
  run_->DrawPending();
  LiveRun::News news = run_->Poll();
  state_.document.run = news.status;
  Timeline& timeline = state_.document.timeline;
  timeline.moments.insert(timeline.moments.end(), news.moments.begin(), news.moments.end());
  if (news.map) {
    timeline.series = std::move(news.series);
    state_.document.recorded_last = news.map;
    Frame(news.map);
  }
  if (news.frame) {
    state_.document.recorded = std::move(news.frame);
  }
  if (news.finished) {
    FinishRun(news);
  }
}

void Session::FinishRun(const LiveRun::News& news) {
  exit_code_ = news.exit_code;
  state_.document.run = {};
  run_.reset();
  if (!news.error.empty()) {  // on the terminal too: the window may close before it is read
    app::PrintNotice(fmt::format("sqslam-viewer: {}", news.error));
  }
  if (news.result.empty()) {
    Close();
    state_.document.failure = news.error.empty() ? "The run ended without a map." : news.error;
    return;
  }
  if (!news.error.empty()) {
    state_.messages.AddError(news.error);
  }
  state_.messages.AddNotice(fmt::format("The map is saved in {}", news.result.string()));
  finished_run_ = true;
  Read(news.result);
}

void Session::TakeOpened(const OpenedRecording& opened) {
  Document& document = state_.document;
  document.info = opened.info;
  document.recorded_last = opened.last;
  document.frame = nullptr;
  Frame(opened.last);
  document.timeline = {};
  document.loading = false;
  auto shown = std::make_shared<ShownFrame>();
  shown->frame_index = opened.last->frame_index;
  shown->timestamp = opened.last->timestamp;
  shown->map = opened.last;
  shown->detections = opened.last->detections;
  shown->no_image = "It is being read.";
  document.recorded = std::move(shown);
}

bool Session::TakeNews() {
  if (run_) {
    TakeRunNews();
  }
  if (!replay_) {
    return false;
  }
  Replay::News news = replay_->Poll();
  Document& document = state_.document;
  if (news.opened) {
    TakeOpened(*news.opened);
  }
  if (news.timeline) {
    const bool first = document.timeline.Empty();
    document.timeline = std::move(*news.timeline);
    if (first) {
      state_.playback.time = document.timeline.End();
    }
  }
  document.progress = news.progress;
  document.histories = news.histories ? news.histories : document.histories;
  const bool other_frame = news.frame != nullptr;
  if (other_frame) {
    document.recorded = std::move(news.frame);
  }
  if (!news.error.empty()) {
    state_.messages.AddError(news.error);
    if (document.loading) {
      replay_.reset();
      Close();
    }
  }
  return other_frame;
}

bool Session::RequestFrame(double seconds) {
  const Timeline& timeline = state_.document.timeline;
  if (!replay_ || timeline.Empty()) {
    return false;
  }
  state_.playback.Advance(seconds, timeline);
  const Moment& moment = timeline.MomentAt(state_.playback.time);
  const bool other = !requested_ || requested_->frame_index != moment.frame_index;
  if (other) {
    requested_ = moment;
    replay_->Request(moment);
  }
  return other;
}

void Session::MoveCamera() {
  SceneView& view = state_.view;
  const Document& document = state_.document;
  const MapSnapshot* map = document.Map();
  if (map == nullptr || !document.frame) {
    return;
  }
  if (framed_ != document.frame && view.size.area() > 0) {
    const bool first = framed_ == nullptr || !document.run.active;
    framed_ = document.frame;
    if (first && !(finished_run_ && !view.automatic)) {
      view.LookFrom(view.preset);
    }
    finished_run_ = false;
  }
  if (view.automatic && view.mode == CameraMode::kFree && document.run.active) {
    // A growing map is followed smoothly.
    const ViewCamera target = view.Named(view.preset);
    const double away = (view.camera.position - target.position).norm() / target.Distance();
    if (away > 1e-9) {
      view.camera =
          away < 0.01 ? target : Between(view.camera, target, std::min(1.0, 4.0 * state_.window.seconds));
    }
  }
  if (view.mode == CameraMode::kFree) {
    view.camera.pinhole.reset();  // the view is no longer the input camera's
  } else if (view.mode == CameraMode::kFollow && map->T_map_camera) {
    view.camera = Behind(*map->T_map_camera, view.focus.up, 0.6 * view.focus.radius);
  } else if (view.mode == CameraMode::kFirstPerson && map->T_map_camera) {
    view.camera = LookThrough(*map->T_map_camera, map->camera, view.size, view.focus.radius);
  }
}

}  // namespace sqslam::viewer
