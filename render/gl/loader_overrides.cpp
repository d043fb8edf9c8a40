// Debian's VTK 9.1 loads OpenGL through a libGLEW built for GLX, which fails without an X display. The two
// functions below override those of GLEW and libGL: while an off-screen context is current they serve it,
// otherwise they call the originals, so that the desktop viewer keeps working.
//
// The overrides work only in the program itself (the dynamic linker looks there first), not in a shared
// library. Therefore this file is an object library that sqslam_render passes on to the programs that link
// it, and both names are exported (render/CMakeLists.txt).

#include <EGL/egl.h>
#include <GL/osmesa.h>
#include <dlfcn.h>

namespace {

constexpr unsigned kGlewOk = 0;
constexpr unsigned kGlewNoDisplay = 4;

template <typename Function>
Function Original(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));  // NOLINT: what dlsym is for
}

bool OsmesaIsCurrent() { return OSMesaGetCurrentContext() != nullptr; }
bool EglIsCurrent() { return eglGetCurrentContext() != EGL_NO_CONTEXT; }

}  // namespace

extern "C" {

using GlFunction = void (*)();

unsigned glxewInit() {
  if (OsmesaIsCurrent() || EglIsCurrent()) {
    return kGlewOk;
  }
  const auto original = Original<unsigned (*)()>("glxewInit");
  return original != nullptr ? original() : kGlewNoDisplay;
}

GlFunction glXGetProcAddressARB(const unsigned char* name) {
  if (OsmesaIsCurrent()) {
    return OSMesaGetProcAddress(reinterpret_cast<const char*>(name));  // NOLINT: GLX's character type
  }
  if (EglIsCurrent()) {
    return eglGetProcAddress(reinterpret_cast<const char*>(name));  // NOLINT
  }
  const auto original = Original<GlFunction (*)(const unsigned char*)>("glXGetProcAddressARB");
  return original != nullptr ? original(name) : nullptr;
}

}  // extern "C"
