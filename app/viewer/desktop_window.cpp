#include "app/viewer/desktop_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>
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

// GLFW from the first window to the last.
class Library {
 public:
  Library() {
    if (glfwInit() != GLFW_TRUE) {
      throw InputError(fmt::format("no display: {}", LastError()));
    }
  }
  ~Library() { glfwTerminate(); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
};

}  // namespace

struct DesktopWindow::Impl {
  Impl(const std::string& title, cv::Size size);
  ~Impl() { glfwDestroyWindow(window); }

  void Add(InputEvent event) { events.push_back(std::move(event)); }
  // Mouse positions come in the window's own units, which are pixels of the framebuffer but on some systems.
  double PixelsPerUnit() const {
    int width = 0;
    int height = 0;
    glfwGetWindowSize(window, &width, &height);
    int pixels = 0;
    glfwGetFramebufferSize(window, &pixels, &height);
    return width > 0 ? static_cast<double>(pixels) / width : 1.0;
  }

  Library library;
  GLFWwindow* window = nullptr;
  std::vector<InputEvent> events;
  std::array<GLFWcursor*, ImGuiMouseCursor_COUNT> cursors{};
};

namespace {

DesktopWindow::Impl& Of(GLFWwindow* window) {
  return *static_cast<DesktopWindow::Impl*>(glfwGetWindowUserPointer(window));
}

void SetCallbacks(GLFWwindow* window) {
  glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) {
    const double scale = Of(w).PixelsPerUnit();
    Of(w).Add({.kind = Kind::kMove, .x = x * scale, .y = y * scale});
  });
  glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int) {
    if (button <= GLFW_MOUSE_BUTTON_MIDDLE) {
      Of(w).Add({.kind = action == GLFW_PRESS ? Kind::kPress : Kind::kRelease, .code = button});
    }
  });
  glfwSetScrollCallback(
      window, [](GLFWwindow* w, double x, double y) { Of(w).Add({.kind = Kind::kWheel, .x = x, .y = y}); });
  glfwSetKeyCallback(window, [](GLFWwindow* w, int code, int, int action, int) {
    if (code > 0 && action != GLFW_REPEAT) {
      Of(w).Add({.kind = action == GLFW_PRESS ? Kind::kKeyDown : Kind::kKeyUp, .code = code});
    }
  });
  glfwSetCharCallback(window,
                      [](GLFWwindow* w, unsigned c) { Of(w).Add({.kind = Kind::kText, .text = Utf8(c)}); });
  glfwSetFramebufferSizeCallback(window, [](GLFWwindow* w, int width, int height) {
    Of(w).Add({.kind = Kind::kResize, .x = static_cast<double>(width), .y = static_cast<double>(height)});
  });
  glfwSetWindowIconifyCallback(window, [](GLFWwindow* w, int minimised) {
    int width = 0;
    int height = 0;
    if (minimised == GLFW_FALSE) {
      glfwGetFramebufferSize(w, &width, &height);
    }
    Of(w).Add({.kind = Kind::kResize, .x = static_cast<double>(width), .y = static_cast<double>(height)});
  });
  glfwSetWindowFocusCallback(window,
                             [](GLFWwindow* w, int won) { Of(w).Add({.kind = Kind::kFocus, .code = won}); });
  glfwSetDropCallback(window, [](GLFWwindow* w, int count, const char** paths) {
    if (count > 0) {
      Of(w).Add({.kind = Kind::kDrop, .text = paths[0]});
    }
  });
  glfwSetWindowCloseCallback(window, [](GLFWwindow* w) {
    glfwSetWindowShouldClose(w, GLFW_FALSE);  // the viewer decides
    Of(w).Add({.kind = Kind::kClose});
  });
}

}  // namespace

DesktopWindow::Impl::Impl(const std::string& title, cv::Size size) {
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  window = glfwCreateWindow(size.width, size.height, title.c_str(), nullptr, nullptr);
  if (window == nullptr) {
    throw InputError(fmt::format("no window with OpenGL 3.3: {}", LastError()));
  }
  glfwMakeContextCurrent(window);
  glfwSwapInterval(1);
  glfwSetWindowUserPointer(window, this);
  SetCallbacks(window);
  cursors[ImGuiMouseCursor_TextInput] = glfwCreateStandardCursor(GLFW_IBEAM_CURSOR);
  cursors[ImGuiMouseCursor_ResizeNS] = glfwCreateStandardCursor(GLFW_VRESIZE_CURSOR);
  cursors[ImGuiMouseCursor_ResizeEW] = glfwCreateStandardCursor(GLFW_HRESIZE_CURSOR);
  cursors[ImGuiMouseCursor_Hand] = glfwCreateStandardCursor(GLFW_HAND_CURSOR);
}

DesktopWindow::DesktopWindow(const std::string& title, cv::Size size)
    : impl_(std::make_unique<Impl>(title, size)) {}
DesktopWindow::~DesktopWindow() = default;

std::vector<InputEvent> DesktopWindow::Events(double wait_seconds) {
  if (wait_seconds > 0.0) {
    glfwWaitEventsTimeout(wait_seconds);
  } else {
    glfwPollEvents();
  }
  return std::exchange(impl_->events, {});
}

cv::Size DesktopWindow::Size() const {
  if (glfwGetWindowAttrib(impl_->window, GLFW_ICONIFIED) == GLFW_TRUE) {
    return {};
  }
  int width = 0;
  int height = 0;
  glfwGetFramebufferSize(impl_->window, &width, &height);
  return {width, height};
}

double DesktopWindow::ContentScale() const {
  float x = 1.0F;
  float y = 1.0F;
  glfwGetWindowContentScale(impl_->window, &x, &y);
  return std::clamp(static_cast<double>(std::max(x, y)), 1.0, 4.0);
}

void DesktopWindow::Resize(cv::Size size) {
  if (size.area() == 0) {
    glfwIconifyWindow(impl_->window);
    return;
  }
  glfwRestoreWindow(impl_->window);
  const double scale = impl_->PixelsPerUnit();
  glfwSetWindowSize(impl_->window, static_cast<int>(size.width / scale),
                    static_cast<int>(size.height / scale));
}

void DesktopWindow::SetTitle(const std::string& title) { glfwSetWindowTitle(impl_->window, title.c_str()); }
void DesktopWindow::SetClipboard(const std::string& text) {
  glfwSetClipboardString(impl_->window, text.c_str());
}

void DesktopWindow::ShowCursor(int ui_cursor) {
  const bool known = ui_cursor >= 0 && ui_cursor < ImGuiMouseCursor_COUNT;
  glfwSetCursor(impl_->window, known ? impl_->cursors[static_cast<std::size_t>(ui_cursor)] : nullptr);
}

void DesktopWindow::Show() { glfwSwapBuffers(impl_->window); }

}  // namespace sqslam::viewer
