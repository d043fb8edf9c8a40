#pragma once

#include <memory>

#include "render/gl/offscreen_context.h"

// The seam between contexts with and without OSMesa. A program gets one of two sources: osmesa_context.cpp
// with the target sqslam_render, without_osmesa.cpp with sqslam_render_window (render/CMakeLists.txt).
namespace sqslam {

struct OffscreenContext::Impl {
  explicit Impl(RenderBackend made_by) : backend(made_by) {}
  virtual ~Impl() = default;
  virtual void MakeCurrent() = 0;
  const RenderBackend backend;
};

// Throws std::runtime_error where there is none.
std::unique_ptr<OffscreenContext::Impl> MakeOsmesaContext();

// OSMesa and EGL do not know of each other but share one dispatch table, so whoever takes over makes the
// other let go first. Only then: letting go clears the table even for a context that the newcomer believes to
// be current. The first tells whether there was a context to let go.
bool ReleaseOsmesaContext();
void ReleaseEglContext();

}  // namespace sqslam
