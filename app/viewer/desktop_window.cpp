#include "app/viewer/desktop_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <array>
#include <utility>

#include "slam/util/error.h"

namespace sqslam::viewer {
namespace {

using Kind = InputEvent::Kind;

std::string Utf8(unsigned code_point) {
  std::array<char, 5> text{};
  return ImTextCharToUtf8(text.data(), code_point);
}

std::string LastError() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "unknown reason";
}

cv::Size FramebufferSize(GLFWwindow* window) {
  cv::Size size;
  glfwGetFramebufferSize(window, &size.width, &size.height);
  return size;
}

// Returns the queue of the events of a window.
std::vector<InputEvent>& Of(GLFWwindow* window) {
  return *static_cast<std::vector<InputEvent>*>(glfwGetWindowUserPointer(window));
}

// GLFW reports mouse positions in window units, which on some systems are not framebuffer pixels.
double PixelsPerUnit(GLFWwindow* window) {
  int width = 0;
  int height = 0;
  glfwGetWindowSize(window, &width, &height);
  return width > 0 ? static_cast<double>(FramebufferSize(window).width) / width : 1.0;
}

InputEvent Resized(cv::Size size) {
  return {.kind = Kind::kResize, .x = static_cast<double>(size.width), .y = static_cast<double>(size.height)};
}

void SetCallbacks(GLFWwindow* window) {
  glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) {
    const double scale = PixelsPerUnit(w);
    Of(w).push_back({.kind = Kind::kMove, .x = x * scale, .y = y * scale});
  });
  glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int) {
    if (button <= GLFW_MOUSE_BUTTON_MIDDLE) {
      Of(w).push_back({.kind = action == GLFW_PRESS ? Kind::kPress : Kind::kRelease, .code = button});
    }
  });
  glfwSetScrollCallback(window, [](GLFWwindow* w, double x, double y) {
    Of(w).push_back({.kind = Kind::kWheel, .x = x, .y = y});
  });
  glfwSetKeyCallback(window, [](GLFWwindow* w, int code, int, int action, int) {
    if (code > 0 && action != GLFW_REPEAT) {
      Of(w).push_back({.kind = action == GLFW_PRESS ? Kind::kKeyDown : Kind::kKeyUp, .code = code});
    }
  });
  glfwSetCharCallback(
      window, [](GLFWwindow* w, unsigned c) { Of(w).push_back({.kind = Kind::kText, .text = Utf8(c)}); });
  glfwSetFramebufferSizeCallback(window, [](GLFWwindow* w, int width, int height) {
    Of(w).push_back(Resized({width, height}));
  });
  glfwSetWindowIconifyCallback(window, [](GLFWwindow* w, int minimised) {
    Of(w).push_back(Resized(minimised == GLFW_FALSE ? FramebufferSize(w) : cv::Size()));
  });
  glfwSetWindowFocusCallback(
      window, [](GLFWwindow* w, int won) { Of(w).push_back({.kind = Kind::kFocus, .code = won}); });
  glfwSetDropCallback(window, [](GLFWwindow* w, int count, const char** paths) {
    if (count > 0) {
      Of(w).push_back({.kind = Kind::kDrop, .text = paths[0]});
    }
  });
  glfwSetWindowCloseCallback(window, [](GLFWwindow* w) {
    glfwSetWindowShouldClose(w, GLFW_FALSE);  // the viewer decides
    Of(w).push_back({.kind = Kind::kClose});
  });
}

}  // namespace

DesktopWindow::Library::Library() {
  if (glfwInit() != GLFW_TRUE) {
    throw InputError("no display: {}", LastError());
  }
}
DesktopWindow::Library::~Library() { glfwTerminate(); }
void DesktopWindow::Destroy::operator()(GLFWwindow* window) const { glfwDestroyWindow(window); }

DesktopWindow::DesktopWindow(const std::string& title, cv::Size size) {
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  window_.reset(glfwCreateWindow(size.width, size.height, title.c_str(), nullptr, nullptr));
  if (window_ == nullptr) {
    throw InputError("no window with OpenGL 3.3: {}", LastError());
  }
  glfwMakeContextCurrent(window_.get());
  glfwSwapInterval(1);
  glfwSetWindowUserPointer(window_.get(), &events_);
  SetCallbacks(window_.get());
  for (const auto& [ui, shape] : {std::pair(ImGuiMouseCursor_TextInput, GLFW_IBEAM_CURSOR),
                                  {ImGuiMouseCursor_ResizeNS, GLFW_VRESIZE_CURSOR},
                                  {ImGuiMouseCursor_ResizeEW, GLFW_HRESIZE_CURSOR},
                                  {ImGuiMouseCursor_Hand, GLFW_HAND_CURSOR}}) {
    cursors_[ui] = glfwCreateStandardCursor(shape);
  }
}

std::vector<InputEvent> DesktopWindow::Events(double wait_seconds) {
  if (wait_seconds > 0.0) {
    glfwWaitEventsTimeout(wait_seconds);
  } else {
    glfwPollEvents();
  }
  return std::exchange(events_, {});
}

cv::Size DesktopWindow::Size() const {
  if (glfwGetWindowAttrib(window_.get(), GLFW_ICONIFIED) == GLFW_TRUE) {
    return {};
  }
  return FramebufferSize(window_.get());
}

double DesktopWindow::ContentScale() const {
  float x = 1.0F;
  float y = 1.0F;
  glfwGetWindowContentScale(window_.get(), &x, &y);
  return std::clamp(static_cast<double>(std::max(x, y)), 1.0, 4.0);
}

void DesktopWindow::Resize(cv::Size size) {
  if (size.area() == 0) {
    glfwIconifyWindow(window_.get());
    return;
  }
  glfwRestoreWindow(window_.get());
  const double scale = PixelsPerUnit(window_.get());
  glfwSetWindowSize(window_.get(), static_cast<int>(size.width / scale),
                    static_cast<int>(size.height / scale));
}

void DesktopWindow::SetTitle(const std::string& title) { glfwSetWindowTitle(window_.get(), title.c_str()); }
void DesktopWindow::SetClipboard(const std::string& text) {
  glfwSetClipboardString(window_.get(), text.c_str());
}

void DesktopWindow::ShowCursor(int ui_cursor) {
  const auto known = cursors_.find(ui_cursor);
  glfwSetCursor(window_.get(), known != cursors_.end() ? known->second : nullptr);
}

void DesktopWindow::Show() { glfwSwapBuffers(window_.get()); }

}  // namespace sqslam::viewer
