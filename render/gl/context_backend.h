#pragma once

#include <memory>

#include "render/gl/offscreen_context.h"

// Separates contexts with and without OSMesa. A program links one of two sources: osmesa_context.cpp with the
// target sqslam_render, without_osmesa.cpp with sqslam_render_window (render/CMakeLists.txt).
namespace sqslam {

struct OffscreenContext::Impl {
  explicit Impl(RenderBackend made_by) : backend(made_by) {}
  virtual ~Impl() = default;
  virtual void MakeCurrent() = 0;
  const RenderBackend backend;
};

// Throws std::runtime_error if OSMesa is not available.
std::unique_ptr<OffscreenContext::Impl> MakeOsmesaContext();

// OSMesa and EGL are independent but share one dispatch table, so making a context current first releases the
// other library's. A release clears the table even if the other library still takes its own context for
// current. ReleaseOsmesaContext returns whether there was a context to release.
bool ReleaseOsmesaContext();
void ReleaseEglContext();

}  // namespace sqslam
