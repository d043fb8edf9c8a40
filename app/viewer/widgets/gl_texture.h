#pragma once

#include <imgui.h>

#include <opencv2/core.hpp>

namespace sqslam::viewer {

// The name of an OpenGL texture as ImGui takes it.
ImTextureID TextureId(unsigned name);

// An image in a texture of the OpenGL context that is current.
class GlTexture {
 public:
  GlTexture() = default;
  ~GlTexture();
  GlTexture(const GlTexture&) = delete;
  GlTexture& operator=(const GlTexture&) = delete;

  void Upload(const cv::Mat& image);  // 8UC3 or 8UC4, BGR; empty: none
  ImTextureID Id() const;             // null: none
  cv::Size Size() const { return size_; }

 private:
  unsigned name_ = 0;
  cv::Size size_;
};

// The pixels of the framebuffer that is current, of that size, or a part of them: 8UC3 BGR, top row first.
cv::Mat ReadFramebuffer(cv::Size size);
cv::Mat ReadFramebuffer(cv::Size size, const cv::Rect& part);

}  // namespace sqslam::viewer
