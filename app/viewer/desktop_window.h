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

// The desktop window, with an OpenGL 3.3 core context that is current on the thread that created it.
class DesktopWindow {
 public:
  // Throws InputError (one line, no hint) if there is no display or no OpenGL.
  DesktopWindow(const std::string& title, cv::Size size);
  DesktopWindow(const DesktopWindow&) = delete;
  DesktopWindow& operator=(const DesktopWindow&) = delete;

  // Returns the events since the last call; waits up to `wait_seconds` for one.
  std::vector<InputEvent> Events(double wait_seconds);

  cv::Size Size() const;        // of the framebuffer, pixels; 0 x 0 while minimised
  double ContentScale() const;  // 2 on a display of twice the standard density
  void Resize(cv::Size size);   // 0 x 0 minimises, any other size restores
  void SetTitle(const std::string& title);
  void SetClipboard(const std::string& text);
  void ShowCursor(int ui_cursor);  // ImGuiMouseCursor_...
  void Show();                     // swaps the buffers

 private:
  struct Destroy {
    void operator()(GLFWwindow* window) const;
  };
  struct Library {  // initialises GLFW for the lifetime of the window
    Library();
    ~Library();
  } library_;
  std::vector<InputEvent> events_;  // outlives the window, whose callbacks write here
  std::unique_ptr<GLFWwindow, Destroy> window_;
  std::map<int, GLFWcursor*> cursors_;  // by ImGuiMouseCursor_...
};

}  // namespace sqslam::viewer
