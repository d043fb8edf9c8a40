#pragma once

#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "app/viewer/input/input_events.h"

struct GLFWcursor;
struct GLFWwindow;

namespace sqslam::viewer {

// The window on the desktop, with an OpenGL 3.3 core context that is current for the thread that made it.
class DesktopWindow {
 public:
  // Throws InputError, one line without a hint, where there is no display or no OpenGL.
  DesktopWindow(const std::string& title, cv::Size size);
  DesktopWindow(const DesktopWindow&) = delete;
  DesktopWindow& operator=(const DesktopWindow&) = delete;

  // Events since the last call; waits up to so many seconds for something to come.
  std::vector<InputEvent> Events(double wait_seconds);

  cv::Size Size() const;        // of the framebuffer, pixels; 0 x 0 while minimised
  double ContentScale() const;  // 2 on a display of twice the usual density
  void Resize(cv::Size size);   // 0 x 0 minimises, any other size restores
  void SetTitle(const std::string& title);
  void SetClipboard(const std::string& text);
  void ShowCursor(int ui_cursor);  // ImGuiMouseCursor_...
  void Show();                     // what was drawn

 private:
  struct Destroy {
    void operator()(GLFWwindow* window) const;
  };
  struct Library {  // GLFW from the first window to the last
    Library();
    ~Library();
  } library_;
  std::vector<InputEvent> events_;  // outlives the window, which may tell of its own end
  std::unique_ptr<GLFWwindow, Destroy> window_;
  std::map<int, GLFWcursor*> cursors_;  // by ImGui's
};

}  // namespace sqslam::viewer
