#include <fmt/format.h>

#include <utility>

#include "app/viewer/panels/edit_menu.h"
#include "app/viewer/state/screenshot.h"
#include "app/viewer/viewer_impl.h"
#include "app/viewer/widgets/gl_texture.h"
#include "slam/util/atomic_file.h"

// What panels ask for.
namespace sqslam::viewer {
namespace fs = std::filesystem;

void Viewer::Impl::Save(const ScreenshotRequest& wanted) {
  try {
    const fs::path file = wanted.file.empty() ? FreeName(fs::current_path(), Stem(), ".png") : wanted.file;
    const cv::Size size = wanted.width > 0 ? cv::Size(wanted.width, wanted.height) : state.scene_size;
    WriteScreenshot(state, size, wanted.transparent, file);
    state.Say(fmt::format("{} x {} pixels are in {}", size.width, size.height, file.string()));
  } catch (const std::exception& error) {
    state.Complain(error.what());
  }
}

std::string Viewer::Impl::Stem() const {
  return state.document.title.empty() ? "map" : fs::path(state.document.title).stem().string();
}

void Viewer::Impl::Film(bool on) {
  try {
    if (on && !film) {
      film = std::make_unique<VideoRecorder>(FreeName(fs::current_path(), Stem(), ".mp4"), state.scene_size);
    } else if (!on && film) {
      const std::unique_ptr<VideoRecorder> ended = std::move(film);
      ended->Finish();
      state.Say(fmt::format("The video is in {}", ended->File().string()));
    }
  } catch (const std::exception& error) {
    film.reset();
    state.Complain(error.what());
  }
  state.filming = film != nullptr;
}

// What was drawn last, into the video.
void Viewer::Impl::FilmFrame() {
  if (!film || state.scene_size.area() == 0) {
    return;
  }
  try {
    film->Add(ReadFramebuffer(window, {state.scene_corner, state.scene_size}), state.seconds);
  } catch (const std::exception& error) {
    film.reset();
    state.filming = false;
    state.Complain(error.what());
  }
}

void Viewer::Impl::SaveText(const SaveTextRequest& wanted) {
  try {
    const fs::path file = FreeName(fs::current_path(), wanted.name, wanted.extension);
    WriteFileAtomically(file, wanted.text);
    state.Say(fmt::format("Saved as {}", file.string()));
  } catch (const std::exception& error) {
    state.Complain(error.what());
  }
}

void Viewer::Impl::CarryOut() {
  Requests requests = std::exchange(state.requests, {});
  if (requests.open && IsCloudFile(requests.open->path) && state.Map() != nullptr) {
    ShowCloud(state, requests.open->path);
    requests.open.reset();
  }
  if (requests.open && !Postpone(state, {.quit = false, .open = requests.open->path})) {
    Open(requests.open->path);
  }
  if (requests.copy) {
    clipboard = requests.copy->text;
    state.Say(requests.copy->notice);
  }
  for (const ScreenshotRequest& wanted : requests.screenshots) {
    Save(wanted);
  }
  if (requests.save) {
    SaveText(*requests.save);
  }
  if (requests.film || (requests.quit && film)) {
    Film(requests.film && requests.film->on && !requests.quit);
  }
  if (requests.run) {
    Control(requests.run->what);
  }
  if (requests.quit && !Postpone(state, {.quit = true, .open = {}})) {
    closing = true;
    Control(RunRequestChange::What::kEnd);
  }
}

}  // namespace sqslam::viewer
