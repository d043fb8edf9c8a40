// For programs with a window. They must not link OSMesa, whose OpenGL would replace the display's.

#include <stdexcept>

#include "render/gl/context_backend.h"

namespace sqslam {

std::unique_ptr<OffscreenContext::Impl> MakeOsmesaContext() {
  throw std::runtime_error("this program has no OSMesa");
}

bool ReleaseOsmesaContext() { return false; }

}  // namespace sqslam
