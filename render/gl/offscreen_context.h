#pragma once

#include <array>
#include <memory>
#include <string>

#include "slam/util/enum_names.h"

namespace sqslam {

// Libraries that draw without a display.
enum class RenderBackend {
  kAuto,     // OSMesa, or EGL if OSMesa cannot make a context
  kOsmesa,   // Mesa in memory
  kEgl,      // EGL without a surface
  kCurrent,  // the context that is current when the renderer is made, such as a window's
};
constexpr auto EnumNames(RenderBackend) { return std::array{"auto", "osmesa", "egl", "current"}; }

// An OpenGL 3.3 core context that needs neither a display nor a window. It belongs to the thread that last
// called MakeCurrent(); VTK draws into framebuffers of its own, so the context has no size.
//
// Programs that use it must carry render/gl/loader_overrides.cpp; linking sqslam_render does that. Programs
// with a window link sqslam_render_window and use kCurrent.
class OffscreenContext {
 public:
  // Creates the context and makes it current. Throws std::runtime_error with the back end and the reason.
  explicit OffscreenContext(RenderBackend backend);
  ~OffscreenContext();
  OffscreenContext(OffscreenContext&&) noexcept;
  OffscreenContext& operator=(OffscreenContext&&) noexcept;

  void MakeCurrent();
  RenderBackend Backend() const;    // never kAuto
  std::string Description() const;  // "OSMesa, Mesa 22.3.6, llvmpipe (...)"; makes the context current

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
