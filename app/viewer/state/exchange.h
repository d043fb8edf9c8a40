#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "app/viewer/frames/timeline.h"

// The ways in which any part of the viewer speaks to the rest of it: requests and messages.
namespace sqslam::viewer {

// Things that a panel or a key asks of the viewer, which does them before the next frame.
struct OpenRequest {
  std::filesystem::path path;
};
struct ScreenshotRequest {
  int width = 0;  // 0: as the view on the screen
  int height = 0;
  bool transparent = false;
};
struct CopyCommandRequest {};  // the command of the present picture on the clipboard
struct FilmRequest {
  bool on = false;  // film what is on the screen, or end that
};
struct SaveTextRequest {
  std::string name;  // of the file, in the working folder, without number and extension
  std::string extension;
  std::string text;
};
struct QuitRequest {};

using Request = std::variant<OpenRequest, ScreenshotRequest, CopyCommandRequest, FilmRequest, SaveTextRequest,
                             RunControl, QuitRequest>;

class Requests {
 public:
  void Ask(Request request) { waiting_.push_back(std::move(request)); }
  bool Empty() const { return waiting_.empty(); }
  std::vector<Request> Take() { return std::exchange(waiting_, {}); }

 private:
  std::vector<Request> waiting_;
};

struct Notice {
  std::string text;
  bool error = false;
  double seconds_left = 6.0;
};

// Messages in the window.
struct Messages {
  std::vector<Notice> notices;

  void Say(std::string text) { notices.push_back({std::move(text), false, 5.0}); }
  void Complain(std::string text) { notices.push_back({std::move(text), true, 12.0}); }

  // Does something; what it throws becomes a message. False then.
  template <typename Action>
  bool Try(Action&& action) {
    try {
      action();
      return true;
    } catch (const std::exception& error) {
      Complain(error.what());
      return false;
    }
  }
};

}  // namespace sqslam::viewer
