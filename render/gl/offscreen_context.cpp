#include "render/gl/offscreen_context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/osmesa.h>
#include <fmt/format.h>

#include <array>
#include <stdexcept>

#include "slam/util/error.h"

namespace sqslam {

RenderBackend ParseRenderBackend(std::string_view name) {
  for (const RenderBackend backend : {RenderBackend::kAuto, RenderBackend::kOsmesa, RenderBackend::kEgl}) {
    if (name == RenderBackendName(backend)) {
      return backend;
    }
  }
  throw UsageError(fmt::format("unknown rendering back end '{}': expected auto, osmesa or egl", name));
}

std::string_view RenderBackendName(RenderBackend backend) {
  switch (backend) {
    case RenderBackend::kOsmesa:
      return "osmesa";
    case RenderBackend::kEgl:
      return "egl";
    case RenderBackend::kAuto:
      break;
  }
  return "auto";
}

struct OffscreenContext::Impl {
  virtual ~Impl() = default;
  virtual void MakeCurrent() = 0;
  virtual RenderBackend Backend() const = 0;
};

namespace {

// OSMesa and EGL do not know of each other but share one dispatch table, so whoever takes over makes the
// other let go first. Only then: letting go clears the table even for a context that the newcomer believes to
// be current.
void ReleaseOsmesa() {
  if (OSMesaGetCurrentContext() != nullptr) {
    OSMesaMakeCurrent(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0);
  }
}

void ReleaseEgl() {
  if (eglGetCurrentContext() != EGL_NO_CONTEXT) {
    eglMakeCurrent(eglGetCurrentDisplay(), EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
}

class OsmesaContext : public OffscreenContext::Impl {
 public:
  OsmesaContext() {
    static constexpr std::array<int, 15> kAttributes = {OSMESA_FORMAT,
                                                        OSMESA_RGBA,
                                                        OSMESA_DEPTH_BITS,
                                                        24,
                                                        OSMESA_STENCIL_BITS,
                                                        8,
                                                        OSMESA_PROFILE,
                                                        OSMESA_CORE_PROFILE,
                                                        OSMESA_CONTEXT_MAJOR_VERSION,
                                                        3,
                                                        OSMESA_CONTEXT_MINOR_VERSION,
                                                        3,
                                                        0,
                                                        0,
                                                        0};
    context_ = OSMesaCreateContextAttribs(kAttributes.data(), nullptr);
    if (context_ == nullptr) {
      throw std::runtime_error("OSMesa cannot make an OpenGL 3.3 core context");
    }
    MakeCurrent();
  }
  ~OsmesaContext() override { OSMesaDestroyContext(context_); }

  void MakeCurrent() override {
    ReleaseEgl();
    // OSMesa wants a buffer to call its own although nothing is ever drawn into it.
    if (OSMesaMakeCurrent(context_, buffer_.data(), GL_UNSIGNED_BYTE, kSide, kSide) != GL_TRUE) {
      throw std::runtime_error("OSMesa cannot make its context current");
    }
  }
  RenderBackend Backend() const override { return RenderBackend::kOsmesa; }

 private:
  static constexpr int kSide = 16;
  std::array<unsigned char, kSide * kSide * 4> buffer_{};
  OSMesaContext context_ = nullptr;
};

class EglContext : public OffscreenContext::Impl {
 public:
  EglContext() {
    const auto get_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(  // NOLINT: EGL's way
        eglGetProcAddress("eglGetPlatformDisplayEXT"));
    if (get_display != nullptr) {
      display_ = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    }
    if (display_ == EGL_NO_DISPLAY || eglInitialize(display_, nullptr, nullptr) != EGL_TRUE) {
      throw std::runtime_error("EGL has no surfaceless display");
    }
    eglBindAPI(EGL_OPENGL_API);
    static constexpr std::array<EGLint, 5> kConfig = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE,
                                                      0, EGL_NONE};
    static constexpr std::array<EGLint, 7> kContext = {EGL_CONTEXT_MAJOR_VERSION,
                                                       3,
                                                       EGL_CONTEXT_MINOR_VERSION,
                                                       3,
                                                       EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                                       EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                                       EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    eglChooseConfig(display_, kConfig.data(), &config, 1, &count);
    context_ = eglCreateContext(display_, count > 0 ? config : nullptr, EGL_NO_CONTEXT, kContext.data());
    if (context_ == EGL_NO_CONTEXT) {
      throw std::runtime_error("EGL cannot make an OpenGL 3.3 core context");
    }
    MakeCurrent();
  }
  ~EglContext() override {
    if (eglGetCurrentContext() == context_) {
      ReleaseEgl();
    }
    eglDestroyContext(display_, context_);  // the display is shared by the process: not terminated here
  }

  void MakeCurrent() override {
    if (OSMesaGetCurrentContext() != nullptr) {
      ReleaseOsmesa();
      ReleaseEgl();  // so that the call below sets the dispatch table anew
    }
    if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) != EGL_TRUE) {
      throw std::runtime_error("EGL cannot make its context current");
    }
  }
  RenderBackend Backend() const override { return RenderBackend::kEgl; }

 private:
  EGLDisplay display_ = EGL_NO_DISPLAY;
  ::EGLContext context_ = EGL_NO_CONTEXT;
};

std::unique_ptr<OffscreenContext::Impl> MakeContext(RenderBackend backend) {
  switch (backend) {
    case RenderBackend::kOsmesa:
      return std::make_unique<OsmesaContext>();
    case RenderBackend::kEgl:
      return std::make_unique<EglContext>();
    case RenderBackend::kAuto:
      break;
  }
  try {
    return std::make_unique<OsmesaContext>();
  } catch (const std::runtime_error& osmesa_error) {
    try {
      return std::make_unique<EglContext>();
    } catch (const std::runtime_error& egl_error) {
      throw std::runtime_error(
          fmt::format("no off-screen OpenGL: {}; {}", osmesa_error.what(), egl_error.what()));
    }
  }
}

}  // namespace

OffscreenContext::OffscreenContext(RenderBackend backend) : impl_(MakeContext(backend)) {}
OffscreenContext::~OffscreenContext() = default;
OffscreenContext::OffscreenContext(OffscreenContext&&) noexcept = default;
OffscreenContext& OffscreenContext::operator=(OffscreenContext&&) noexcept = default;

void OffscreenContext::MakeCurrent() { impl_->MakeCurrent(); }
RenderBackend OffscreenContext::Backend() const { return impl_->Backend(); }

std::string OffscreenContext::Description() const {
  impl_->MakeCurrent();
  const auto text = [](GLenum name) { return reinterpret_cast<const char*>(glGetString(name)); };  // NOLINT
  return fmt::format("{}, OpenGL {}, {}", RenderBackendName(Backend()), text(GL_VERSION), text(GL_RENDERER));
}

}  // namespace sqslam
