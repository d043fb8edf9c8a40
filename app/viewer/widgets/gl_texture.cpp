#include <GL/gl.h>
#include <GL/glext.h>

#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {

ImTextureID TextureId(unsigned name) {
  return reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(name));  // NOLINT: ImGui's convention
}

ImTextureID GlTexture::Id() const { return TextureId(name_); }

GlTexture::~GlTexture() { glDeleteTextures(1, &name_); }

void GlTexture::Upload(const cv::Mat& image) {
  glDeleteTextures(1, &name_);
  name_ = 0;
  if (image.empty()) {
    return;
  }
  const cv::Mat pixels = image.isContinuous() ? image : image.clone();
  glGenTextures(1, &name_);
  glBindTexture(GL_TEXTURE_2D, name_);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, image.cols, image.rows, 0,
               image.channels() == 4 ? GL_BGRA : GL_BGR, GL_UNSIGNED_BYTE, pixels.data);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glBindTexture(GL_TEXTURE_2D, 0);
}

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
