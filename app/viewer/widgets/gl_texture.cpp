#include <GL/gl.h>
#include <GL/glext.h>

#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {

ImTextureID TextureId(unsigned name) {
  return reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(name));  // NOLINT: ImGui's convention
}

ImTextureID GlTexture::Id() const { return TextureId(name_); }

GlTexture::~GlTexture() {
  if (name_ != 0) {
    glDeleteTextures(1, &name_);
  }
}

void GlTexture::Upload(const cv::Mat& image) {
  if (image.empty()) {
    if (name_ != 0) {
      glDeleteTextures(1, &name_);
      name_ = 0;
    }
    return;
  }
  const cv::Mat pixels = image.isContinuous() ? image : image.clone();
  GLint bound = 0;
  glGetIntegerv(GL_TEXTURE_BINDING_2D, &bound);
  const bool fresh = name_ == 0 || size_ != image.size();
  if (name_ == 0) {
    glGenTextures(1, &name_);
  }
  size_ = image.size();
  glBindTexture(GL_TEXTURE_2D, name_);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  const GLenum format = image.channels() == 4 ? GL_BGRA : GL_BGR;
  if (fresh) {
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, size_.width, size_.height, 0, format, GL_UNSIGNED_BYTE,
                 pixels.data);
  } else {
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, size_.width, size_.height, format, GL_UNSIGNED_BYTE, pixels.data);
  }
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glBindTexture(GL_TEXTURE_2D, static_cast<GLuint>(bound));
}

cv::Mat ReadFramebuffer(cv::Size size) { return ReadFramebuffer(size, {cv::Point(), size}); }

cv::Mat ReadFramebuffer(cv::Size size, const cv::Rect& part) {
  cv::Mat image(part.size(), CV_8UC3);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(part.x, size.height - part.y - part.height, part.width, part.height, GL_BGR, GL_UNSIGNED_BYTE,
               image.data);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  cv::flip(image, image, 0);
  return image;
}

}  // namespace sqslam::viewer
