#include <fmt/format.h>

#include <set>

#include "app/viewer/state/camera_control.h"
#include "app/viewer/viewer_impl.h"

// What is open: recordings, runs, and the camera before them.
namespace sqslam::viewer {
namespace fs = std::filesystem;

void Viewer::Impl::Open(const fs::path& path) {
  if (run) {
    state.Complain("A run goes on; end it before something else is opened.");
    return;
  }
  state.shown = nullptr;
  state.playback = {};
  state.selected.reset();
  state.measurement = {};
  state.run = {};
  state.view.preset = "";
  state.document = {};
  ForgetLayers();
  editing.Forget();
  Read(path);
}

// Begins to read a recording; what is on the screen stays until it is there.
void Viewer::Impl::Read(const fs::path& path) {
  requested.reset();
  state.document.kind = Document::Kind::kRecording;
  state.document.loading = true;
  state.document.file = path;
  state.document.title = fs::absolute(path).lexically_normal().filename().string();
  replay = std::make_unique<Replay>(path);
}

void Viewer::Impl::Watch(std::unique_ptr<LiveRun> new_run, const app::RunRequest& request) {
  run = std::move(new_run);
  state.document = {};
  state.document.kind = Document::Kind::kRun;
  state.document.file = request.output / "map.sqmap";
  state.document.title = request.output.filename().string();
  state.document.info.sequence_path = fs::absolute(request.sequence.path).string();
  state.run.active = true;
  state.run.state = "starting";
}

// Framing, scale and colours of a growing map: taken anew only when it has become another one, so that
// nothing trembles.
void Viewer::Impl::Frame(const MapSnapshotPtr& map) {
  Document& document = state.document;
  document.last = map;
  const auto labels = [](const MapSnapshot& of) {
    std::set<std::string> names;
    for (const SnapshotObject& object : of.objects) {
      names.insert(object.label);
    }
    return names;
  };
  if (document.frame) {
    const SceneFocus focus = FindFocus(*map);
    const double growth = focus.radius / state.focus.radius;
    const bool same = growth > 0.85 && growth < 1.18 &&
                      (focus.center - state.focus.center).norm() < 0.15 * focus.radius &&
                      focus.up.dot(state.focus.up) > 0.99 && labels(*map) == labels(*document.frame);
    if (same) {
      return;
    }
  }
  document.frame = map;
}

void Viewer::Impl::Control(RunRequestChange::What what) {
  if (!run) {
    return;
  }
  switch (what) {
    case RunRequestChange::What::kPause:
      return run->Pause();
    case RunRequestChange::What::kContinue:
      return run->Continue();
    case RunRequestChange::What::kStep:
      return run->Step();
    case RunRequestChange::What::kEnd:
      return run->End();
  }
}

void Viewer::Impl::TakeRunNews() {
  if (!run) {
    return;
  }
  run->DrawPending();
  if (max_rate != state.run.max_rate) {
    max_rate = state.run.max_rate;
    run->SetMaxRate(max_rate);
  }
  LiveRun::News news = run->Poll();
  RunStatus& status = state.run;
  status.paused = news.paused;
  status.ending = news.ending;
  status.state = news.state.empty() ? status.state : news.state;
  status.frames = news.frames;
  status.total = news.total;
  Timeline& timeline = state.document.timeline;
  timeline.moments.insert(timeline.moments.end(), news.moments.begin(), news.moments.end());
  if (news.map) {
    timeline.series = run->Series();
    Frame(news.map);
  }
  const bool other_frame = news.frame != nullptr;
  if (other_frame) {
    state.shown = std::move(news.frame);
  }
  if (news.finished) {
    FinishRun(news);
  }
}

void Viewer::Impl::FinishRun(const LiveRun::News& news) {
  exit_code = news.exit_code;
  state.run = {};
  run.reset();
  if (!news.error.empty()) {
    state.Complain(news.error);
  }
  if (news.result.empty()) {
    state.shown = nullptr;
    state.selected.reset();
    state.document = {};
    ForgetLayers();
    return;
  }
  state.Say(fmt::format("The map is saved in {}", news.result.string()));
  finished_run = true;
  Read(news.result);
}

// They belonged to another map.
void Viewer::Impl::ForgetLayers() {
  const int version = state.layers.version + 1;
  state.layers = {};
  state.layers.version = version;
}

void Viewer::Impl::TakeOpened(const OpenedRecording& opened) {
  Document& document = state.document;
  document.file = opened.file;
  const fs::path folder = fs::absolute(opened.file).lexically_normal().parent_path();
  document.title =
      opened.file.filename() == "map.sqmap" ? folder.filename().string() : opened.file.filename().string();
  document.info = opened.info;
  document.stats = opened.stats;
  document.last = document.frame = opened.last;
  document.timeline = {};
  document.loading = false;
  auto shown = std::make_shared<ShownFrame>();
  shown->frame_index = opened.last->frame_index;
  shown->timestamp = opened.last->timestamp;
  shown->map = opened.last;
  shown->detections = opened.last->detections;
  shown->no_image = "It is being read.";
  state.shown = std::move(shown);
}

// Whether another frame is shown from now on.
bool Viewer::Impl::TakeNews() {
  if (!replay) {
    return false;
  }
  Replay::News news = replay->Poll();
  if (news.opened) {
    TakeOpened(*news.opened);
  }
  if (news.timeline) {
    const bool first = state.document.timeline.Empty();
    state.document.timeline = std::move(*news.timeline);
    if (first) {
      state.playback.time = state.document.timeline.End();
    }
  }
  state.document.progress = news.progress;
  const bool other_frame = news.frame != nullptr;
  if (other_frame) {
    state.shown = std::move(news.frame);
  }
  if (!news.error.empty()) {
    state.Complain(news.error);
    if (state.document.loading) {
      replay.reset();
      state.shown = nullptr;
      state.selected.reset();
      state.document = {};
      ForgetLayers();
    }
  }
  return other_frame;
}

// Moves on by so many seconds and asks for the frame there; whether that is another one than before.
bool Viewer::Impl::RequestFrame(double seconds) {
  const Timeline& timeline = state.document.timeline;
  if (!replay || timeline.Empty()) {
    return false;
  }
  state.playback.Advance(seconds, timeline);
  const Moment& moment = timeline.moments[static_cast<std::size_t>(timeline.At(state.playback.time))];
  const bool other = !requested || requested->frame_index != moment.frame_index;
  if (other) {
    requested = moment;
    replay->Request(moment);
  }
  return other;
}

// Whether to leave the window as it is until the frame that was asked for is there, since drawing the old one
// would only delay it. Not for long: a slow file must not make the window look dead.
bool Viewer::Impl::Holds(bool asked, bool news) {
  const auto now = std::chrono::steady_clock::now();
  const bool reading = replay && !replay->Idle() && !replay->HasNews();
  const bool holds = !film && !news && (held ? reading && now - *held < kHoldAtMost : asked);
  if (holds) {
    held = held.value_or(now);
  } else {
    held.reset();
  }
  return holds;
}

// Where the camera goes by itself.
void Viewer::Impl::MoveCamera() {
  const MapSnapshot* map = state.Map();
  if (map == nullptr || !state.document.frame) {
    return;
  }
  if (framed != state.document.frame && state.scene_size.area() > 0) {
    const bool first = framed == nullptr || state.document.kind == Document::Kind::kRecording;
    framed = state.document.frame;
    state.focus = FindFocus(*framed);
    if (first && !(finished_run && !state.view.automatic)) {
      LookFrom(state, state.view.preset);
    }
    finished_run = false;
  }
  if (state.view.automatic && state.view.mode == CameraMode::kFree && state.run.active) {
    // A growing map is followed smoothly.
    const ViewCamera target = NamedView(state, state.view.preset);
    const double away = (state.view.camera.position - target.position).norm() / target.Distance();
    if (away > 1e-9) {
      state.view.camera =
          away < 0.01 ? target : Between(state.view.camera, target, std::min(1.0, 4.0 * state.seconds));
    }
  }
  if (state.view.mode == CameraMode::kFree || !map->T_map_camera) {
    return;
  }
  if (state.view.mode == CameraMode::kFollow) {
    state.view.camera = Behind(*map->T_map_camera, state.focus.up, 0.6 * state.focus.radius);
  } else {
    state.view.camera = FirstPerson(*map->T_map_camera, map->camera, state.focus.radius);
  }
}

}  // namespace sqslam::viewer
