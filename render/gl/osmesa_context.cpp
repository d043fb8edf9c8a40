#include <GL/osmesa.h>

#include <array>
#include <stdexcept>

#include "render/gl/context_backend.h"

namespace sqslam {
namespace {

class OsmesaContext : public OffscreenContext::Impl {
 public:
  OsmesaContext() : Impl(RenderBackend::kOsmesa) {
    // clang-format off
    static constexpr int kAttributes[] = {
        OSMESA_FORMAT, OSMESA_RGBA, OSMESA_DEPTH_BITS, 24, OSMESA_STENCIL_BITS, 8,
        OSMESA_PROFILE, OSMESA_CORE_PROFILE,
        OSMESA_CONTEXT_MAJOR_VERSION, 3, OSMESA_CONTEXT_MINOR_VERSION, 3, 0};
    // clang-format on
    context_ = OSMesaCreateContextAttribs(kAttributes, nullptr);
    if (context_ == nullptr) {
      throw std::runtime_error("OSMesa cannot make an OpenGL 3.3 core context");
    }
    MakeCurrent();
  }
  ~OsmesaContext() override { OSMesaDestroyContext(context_); }

  void MakeCurrent() override {
    ReleaseEglContext();
    // OSMesa requires a buffer although nothing is ever drawn into it.
    if (OSMesaMakeCurrent(context_, buffer_.data(), GL_UNSIGNED_BYTE, kSide, kSide) != GL_TRUE) {
      throw std::runtime_error("OSMesa cannot make its context current");
    }
  }

 private:
  static constexpr int kSide = 16;
  std::array<unsigned char, kSide * kSide * 4> buffer_{};
  OSMesaContext context_ = nullptr;
};

}  // namespace

std::unique_ptr<OffscreenContext::Impl> MakeOsmesaContext() { return std::make_unique<OsmesaContext>(); }

bool ReleaseOsmesaContext() {
  if (OSMesaGetCurrentContext() == nullptr) {
    return false;
  }
  OSMesaMakeCurrent(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0);
  return true;
}

}  // namespace sqslam
