#include "render/gl/offscreen_context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>
#include <fmt/format.h>

#include <array>
#include <stdexcept>
#include <string_view>

#include "render/gl/context_backend.h"

namespace sqslam {

namespace {

// Returns the display of the first device that is not a software renderer, or EGL_NO_DISPLAY. Drivers such as
// NVIDIA's do not support Mesa's surfaceless platform, on which a software renderer would be used instead.
EGLDisplay DisplayOfGpu(PFNEGLGETPLATFORMDISPLAYEXTPROC get_display) {
  const auto list =
      reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));  // NOLINT
  const auto extensions_of = reinterpret_cast<PFNEGLQUERYDEVICESTRINGEXTPROC>(
      eglGetProcAddress("eglQueryDeviceStringEXT"));  // NOLINT
  std::array<EGLDeviceEXT, 16> devices{};
  EGLint count = 0;
  if (list == nullptr || extensions_of == nullptr ||
      list(static_cast<EGLint>(devices.size()), devices.data(), &count) != EGL_TRUE) {
    return EGL_NO_DISPLAY;
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const char* extensions = extensions_of(devices[i], EGL_EXTENSIONS);
    if (extensions == nullptr ||
        std::string_view(extensions).find("EGL_MESA_device_software") != std::string_view::npos) {
      continue;
    }
    EGLDisplay display = get_display(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr);
    if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr) == EGL_TRUE) {
      return display;
    }
  }
  return EGL_NO_DISPLAY;
}

class EglContext : public OffscreenContext::Impl {
 public:
  EglContext() : Impl(RenderBackend::kEgl) {
    const auto get_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(  // NOLINT: EGL's way
        eglGetProcAddress("eglGetPlatformDisplayEXT"));
    if (get_display != nullptr) {
      display_ = DisplayOfGpu(get_display);
      if (display_ == EGL_NO_DISPLAY) {
        display_ = get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
      }
    }
    if (display_ == EGL_NO_DISPLAY || eglInitialize(display_, nullptr, nullptr) != EGL_TRUE) {
      throw std::runtime_error("EGL has neither a device nor a surfaceless display");
    }
    eglBindAPI(EGL_OPENGL_API);
    // clang-format off
    static constexpr EGLint kConfig[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0, EGL_NONE};
    static constexpr EGLint kContext[] = {
        EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 3,
        EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    // clang-format on
    EGLConfig config = nullptr;
    EGLint count = 0;
    eglChooseConfig(display_, kConfig, &config, 1, &count);
    context_ = eglCreateContext(display_, count > 0 ? config : nullptr, EGL_NO_CONTEXT, kContext);
    if (context_ == EGL_NO_CONTEXT) {
      throw std::runtime_error("EGL cannot make an OpenGL 3.3 core context");
    }
    MakeCurrent();
  }
  ~EglContext() override {
    if (eglGetCurrentContext() == context_) {
      ReleaseEglContext();
    }
    eglDestroyContext(display_, context_);  // not the display: the process shares it
  }

  void MakeCurrent() override {
    if (ReleaseOsmesaContext()) {
      ReleaseEglContext();  // so that the call below sets the dispatch table again
    }
    if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) != EGL_TRUE) {
      throw std::runtime_error("EGL cannot make its context current");
    }
  }

 private:
  EGLDisplay display_ = EGL_NO_DISPLAY;
  ::EGLContext context_ = EGL_NO_CONTEXT;
};

// The context that the program has made current on this thread, usually its window's.
struct CurrentContext : OffscreenContext::Impl {
  CurrentContext() : Impl(RenderBackend::kCurrent) {}
  void MakeCurrent() override {}
};

std::unique_ptr<OffscreenContext::Impl> MakeContext(RenderBackend backend) {
  switch (backend) {
    case RenderBackend::kOsmesa:
      return MakeOsmesaContext();
    case RenderBackend::kEgl:
      return std::make_unique<EglContext>();
    case RenderBackend::kCurrent:
      return std::make_unique<CurrentContext>();
    case RenderBackend::kAuto:
      break;
  }
  try {
    return MakeOsmesaContext();
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

void ReleaseEglContext() {
  if (eglGetCurrentContext() != EGL_NO_CONTEXT) {
    eglMakeCurrent(eglGetCurrentDisplay(), EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
}

OffscreenContext::OffscreenContext(RenderBackend backend) : impl_(MakeContext(backend)) {}
OffscreenContext::~OffscreenContext() = default;
OffscreenContext::OffscreenContext(OffscreenContext&&) noexcept = default;
OffscreenContext& OffscreenContext::operator=(OffscreenContext&&) noexcept = default;

void OffscreenContext::MakeCurrent() { impl_->MakeCurrent(); }
RenderBackend OffscreenContext::Backend() const { return impl_->backend; }

std::string OffscreenContext::Description() const {
  impl_->MakeCurrent();
  const auto text = [](GLenum name) { return reinterpret_cast<const char*>(glGetString(name)); };  // NOLINT
  return fmt::format("{}, OpenGL {}, {}", NameOf(Backend()), text(GL_VERSION), text(GL_RENDERER));
}

}  // namespace sqslam
