#include <fmt/format.h>
#include <imgui.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "app/commands/run_arguments.h"
#include "app/result/map_input.h"
#include "app/viewer/automation.h"
#include "app/viewer/desktop_window.h"
#include "app/viewer/viewer.h"
#include "app/viewer/widgets/widgets.h"
#include "render/picture/picture.h"
#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "slam/util/host.h"
#include "slam/util/options.h"
#include "slam/util/throw_if.h"

namespace sqslam::viewer {
namespace {

constexpr const char* kNotes = R"(
Examples:
  sqslam-viewer out/kitchen                the result folder of a run
  sqslam-viewer out/kitchen/map.sqmap
  sqslam-viewer                            an empty window; drop a result folder on it
  sqslam-viewer run data/kitchen --output out/kitchen   map while you watch; options of `sqslam run`
  sqslam-viewer out/kitchen --ground-truth auto --dense-cloud room.ply --dense-cloud-frame world
  sqslam-viewer out/kitchen --play-events open.txt

Press H for the keys and mouse controls. Exit codes: 0 success, 1 internal error, 2 wrong usage, 3 no display or
unusable input; with `run` those of `sqslam run`.
)";

struct Arguments {
  std::string map;
  std::optional<std::array<int, 2>> resolution;  // empty: as in the last session
  std::string play;
  std::string record;
  app::LayerArguments layers;
  std::string style;  // empty: as in the last session
  std::vector<std::string> settings;
  bool timing = false;
};

// Requests the layers that the options name; they are read once the map is there.
void RequestLayers(const app::LayerArguments& wanted, Layers& layers) {
  layers.true_path = !wanted.ground_truth.empty();
  layers.sequence = wanted.ground_truth == "auto" ? "" : wanted.ground_truth;
  layers.cloud_file = wanted.dense_cloud;
  layers.cloud_in_world = wanted.dense_cloud_frame == "world";
}

// Records the events of each frame as a script that replays them.
class EventLog {
 public:
  explicit EventLog(std::string path) : path_(std::move(path)) {
    if (!path_.empty()) {
      file_.open(path_);
      CheckFile();
    }
  }
  void Add(const std::vector<InputEvent>& events) {
    if (!file_.is_open()) {
      return;
    }
    for (const InputEvent& event : events) {
      const std::string line = FormatEvent(event);
      if (!line.empty() && frames_ > 0) {
        file_ << "frames " << std::exchange(frames_, 0) << '\n';
      }
      file_ << line;
    }
    ++frames_;
  }
  void Finish() {  // throws InputError if events are lost, for example on a full disk
    if (file_.is_open()) {
      file_.close();
      CheckFile();
    }
  }

 private:
  void CheckFile() const {
    ThrowIf<InputError>(!file_, "{}: cannot be written, expected a writable file for the events", path_);
  }

  std::string path_;
  std::ofstream file_;
  int frames_ = 0;
};

// The main loop: takes events, draws a frame, and sleeps while nothing changes.
class Loop {
 public:
  // `run`: the run to watch, or null.
  Loop(const Arguments& arguments, std::unique_ptr<LiveRun> run, const RunRequest& request)
      : live_(run != nullptr),
        timed_(arguments.timing),
        style_of_command_(arguments.style),
        start_(arguments.play.empty() ? KeptWindowState(warnings_) : WindowState()),
        window_("sqslam", arguments.resolution
                              ? cv::Size((*arguments.resolution)[0], (*arguments.resolution)[1])
                              : cv::Size(start_.memory.window_width, start_.memory.window_height)),
        viewer_(window_.Size(),
                start_.settings.font_size / ViewerSettings().font_size * window_.ContentScale()),
        event_log_(arguments.record) {
    if (!arguments.play.empty()) {
      player_.emplace(ReadScript(arguments.play), arguments.play,
                      [this](const std::string& file) { WriteWindow(file); });
    }
    ViewerState& state = viewer_.State();
    state.window.settings = start_.settings;
    state.window.memory = start_.memory;
    state.view.settings = arguments.settings;
    state.messages.Try(
        [&] { state.view.UseStyle(arguments.style.empty() ? start_.settings.style : arguments.style); });
    for (const std::string& warning : warnings_) {
      state.messages.AddError(warning);
    }
    if (run) {
      viewer_.Watch(std::move(run), request);
    } else if (!arguments.map.empty()) {
      viewer_.Open(arguments.map);
    }
    RequestLayers(arguments.layers, state.layers);
  }

  // Returns the program's exit code.
  int Run() {
    auto last = Clock::now();
    while (!viewer_.WantsToClose()) {
      std::vector<InputEvent> events = window_.Events(Rest(last));
      if (viewer_.State().document.run.active) {
        std::this_thread::sleep_until(last + std::chrono::milliseconds(33));  // at most 30 Hz on mouse moves
      }
      const double seconds = std::chrono::duration<double>(Clock::now() - last).count();
      last = Clock::now();
      Play(events, seconds);
      event_log_.Add(events);
      for (const InputEvent& event : events) {
        viewer_.Handle(event);
      }
      Draw(player_ && !live_ ? 1.0 / 60.0 : seconds);
    }
    Remember();
    if (timed_) {
      fmt::print("{}", timing_.Text());
    }
    event_log_.Finish();
    return viewer_.ExitCode();
  }

 private:
  using Clock = std::chrono::steady_clock;

  // Returns the seconds until something has to be drawn. During a run the window leaves the CPU to the run
  // and is drawn just often enough to show motion.
  double Rest(Clock::time_point last) const {
    constexpr double kRunInterval = 1.0 / 12.0;
    if (viewer_.State().document.run.active) {
      return std::max(0.0, kRunInterval - std::chrono::duration<double>(Clock::now() - last).count());
    }
    return player_ || viewer_.Busy() ? 0.0 : 0.25;
  }

  // Saves settings and memory for the next session.
  void Remember() {
    ViewerState& state = viewer_.State();
    ViewerMemory& memory = state.window.memory;
    if (state.view.style_name != style_of_command_) {
      state.window.settings.style = state.view.style_name;
    }
    if (const cv::Size size = window_.Size(); size.area() > 0) {
      memory.window_width = static_cast<int>(size.width / window_.ContentScale());
      memory.window_height = static_cast<int>(size.height / window_.ContentScale());
    }
    state.messages.Try([&] {
      Save(state.window.settings);
      Save(memory);
    });
  }

  void Play(std::vector<InputEvent>& events, double seconds) {
    if (!player_) {
      return;
    }
    // A script is not disturbed by the mouse; only resizes that it caused come back from the window.
    std::erase_if(events, [](const InputEvent& event) { return event.kind != InputEvent::Kind::kResize; });
    for (InputEvent& event : player_->Next(viewer_, seconds)) {
      if (event.kind == InputEvent::Kind::kResize) {
        window_.Resize({static_cast<int>(event.x), static_cast<int>(event.y)});
      }
      events.push_back(std::move(event));
    }
    if (player_->Done() && !viewer_.WantsToClose()) {
      viewer_.State().editing.discard = true;  // no user to ask
      events.push_back({.kind = InputEvent::Kind::kClose});
    }
  }

  void Draw(double seconds) {
    const Clock::time_point start = Clock::now();
    const bool drawn = viewer_.Frame(seconds);
    if (drawn) {
      window_.ShowCursor(ImGui::GetMouseCursor());
      if (!player_ || !player_->Done()) {
        window_.Show();
      }
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // leaves the CPU to the thread that reads
    }
    const double taken = std::chrono::duration<double>(Clock::now() - start).count();
    timing_.Add(viewer_.State(), drawn ? std::optional(taken) : std::nullopt);
    if (const auto text = viewer_.TakeClipboard()) {
      window_.SetClipboard(*text);
    }
    const std::string& title = viewer_.State().document.title;
    if (title != title_) {
      title_ = title;
      window_.SetTitle(title.empty() ? "sqslam" : title + " - sqslam");
    }
  }

  void WriteWindow(const std::string& file) {
    constexpr int kMaxAttempts = 200;  // to get past a frame that is being read
    int attempts = 0;
    while (!viewer_.Frame(0.0)) {  // the buffer on screen cannot be read back
      ThrowIf<InputError>(++attempts == kMaxAttempts,
                          "{}: the window is minimised, expected a visible one to write", file);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    WritePicture(file, ReadFramebuffer(window_.Size()));
  }

  bool live_;                     // a run is or was watched
  bool timed_;                    // --timing
  std::string style_of_command_;  // --style; not remembered
  FrameTiming timing_;
  std::vector<std::string> warnings_;  // about settings that cannot be read
  WindowState start_;                  // as of the last session; defaults for a script
  DesktopWindow window_;
  Viewer viewer_;
  EventLog event_log_;
  std::optional<ScriptPlayer> player_;
  std::string title_;
};

// Throws InputError if there is no display, naming the command that works without one.
void CheckDisplay(const std::string& instead) {
  const char* display = std::getenv("DISPLAY");
  ThrowIf<InputError>(display == nullptr || *display == '\0', "no display; `{}` works without one", instead);
}

// The run starts its threads before the window's thread lowers its own priority; the threads of a software
// OpenGL driver start later and inherit the lower priority.
int WatchRun(const Arguments& arguments, const app::RunArguments& run_arguments) {
  if (run_arguments.dump_config) {
    fmt::print("{}", DumpOptions(run_arguments.Options()));
    return 0;
  }
  const RunRequest request = run_arguments.Request();
  CheckDisplay(run_arguments.input.empty()
                   ? fmt::format("sqslam run --camera-index {}", *run_arguments.camera_index)
                   : fmt::format("sqslam run {}", run_arguments.input));
  if (!arguments.play.empty()) {
    ReadScript(arguments.play);  // reports errors before the run begins
  }
  auto run = std::make_unique<LiveRun>(request, run_arguments.Pictures());
  run->Start();
  constexpr int kNiceness = 6;
  setpriority(PRIO_PROCESS, 0, kNiceness);
  return Loop(arguments, std::move(run), request).Run();
}

int ParseAndRun(const std::vector<std::string>& words) {
  Arguments arguments;
  app::RunArguments run_arguments;
  app::Command program("sqslam-viewer", "View and edit sqslam maps, and replay how they grew");
  program.Group("Input");
  program.Positional("MAP", arguments.map, "map.sqmap, or the result folder that holds it");
  app::AddLayerOptions(program, arguments.layers);
  program.Group("Style");
  program.Option("--style NAME", arguments.style,
                 "FILE.yaml, or one of configs/styles (" + ConfigNameList("configs/styles") +
                     "); default: the last one");
  program.Option("--set KEY=VALUE", arguments.settings,
                 "Override one value of all styles, such as objects.colors.cup=#0072b2; may be repeated");
  program.Group("Window");
  program.Option("--resolution W,H", arguments.resolution, "Size of the window; default: the last size")
      .Range(200, 8192);
  program.Option("--play-events FILE", arguments.play, "Play a script of events, then close");
  program.Option("--record-events FILE", arguments.record, "Record all events as such a script");
  program.Flag("--timing", arguments.timing, "Print frame times at the end");
  program.Notes(kNotes);
  program.OnRun([&] {
    CheckDisplay(
        fmt::format("sqslam render {} --output map.png", arguments.map.empty() ? "RESULT" : arguments.map));
    return Loop(arguments, nullptr, {}).Run();
  });
  program.Group("Commands");
  app::Command& run = program.AddCommand("run", "Map an image sequence in the window, like `sqslam run`");
  run_arguments.AddTo(run);
  run.OnRun([&] { return WatchRun(arguments, run_arguments); });
  return program.Run(words);
}

}  // namespace
}  // namespace sqslam::viewer

int main(int argc, char** argv) {
  sqslam::ReturnFreedMemory();
  return sqslam::app::RunProgram("sqslam-viewer", [&] {
    return sqslam::viewer::ParseAndRun({argv + 1, argv + argc});
  });
}
