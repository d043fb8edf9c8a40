#pragma once

#include <gtest/gtest.h>

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>

#include <chrono>
#include <opencv2/core.hpp>
#include <thread>

#include "app/viewer/viewer.h"
#include "app/viewer/widgets/widgets.h"
#include "render/gl/offscreen_context.h"
#include "slam/snapshot/recording.h"
#include "tests/io/temporary_folder.h"
#include "tests/render/hand_made_map.h"

namespace sqslam::viewer {

// A recording of a map that grows object by object, without images. `sequence`: what it says was mapped.
inline std::filesystem::path WriteGrowingMap(const std::filesystem::path& folder,
                                             const std::string& sequence = "") {
  std::filesystem::create_directories(folder / "desk");
  const std::filesystem::path file = folder / "desk" / "map.sqmap";
  RecordingWriter writer(file, {sequence, "test", ""});
  const MapSnapshot whole = HandMadeMap();
  for (int i = 0; i < 4; ++i) {
    MapSnapshot map = whole;
    map.keyframes.resize(static_cast<std::size_t>(2 * i + 2));
    map.objects.resize(static_cast<std::size_t>(i));
    map.points.resize(static_cast<std::size_t>(100 * i + 100));
    map.T_map_camera = map.keyframes.back().T_map_camera;
    map.frame_index = map.keyframes.back().frame_index;
    map.timestamp = map.keyframes.back().timestamp;
    if (i > 0) {  // a box around the first object
      map.detections.push_back({{"book", 0.9, {60.0, 120.0, 80.0, 60.0}}, 0});
    }
    writer.Add(map);
  }
  writer.Close();
  return file;
}

// The viewer without a window: EGL, a framebuffer of its own, events by hand.
class UiStage {
 public:
  explicit UiStage(cv::Size size = {960, 600}) : context_(RenderBackend::kEgl), size_(size) {
    glGenFramebuffers(1, &buffer_);
    glGenTextures(1, &texture_);
    glBindTexture(GL_TEXTURE_2D, texture_);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, size.width, size.height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
    glBindTexture(GL_TEXTURE_2D, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, buffer_);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
    viewer = std::make_unique<Viewer>(size);
  }
  ~UiStage() {
    viewer.reset();
    glDeleteFramebuffers(1, &buffer_);
    glDeleteTextures(1, &texture_);
  }
  UiStage(const UiStage&) = delete;
  UiStage& operator=(const UiStage&) = delete;

  void Frames(int count = 1) {
    for (int i = 0; i < count; ++i) {
      glBindFramebuffer(GL_FRAMEBUFFER, buffer_);
      viewer->Frame(1.0 / 60.0);
    }
  }

  // Until all is read and drawn finely; fails after a while.
  void Settle() {
    Frames(3);
    for (int i = 0; i < 2000 && !viewer->Idle(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      Frames();
    }
    Frames(2);
    EXPECT_TRUE(viewer->Idle());
  }

  void Handle(const InputEvent& event) {
    viewer->Handle(event);
    Frames();
  }
  void MoveTo(double x, double y) {
    Handle({.kind = InputEvent::Kind::kMove, .x = x, .y = y});
    Frames();  // ImGui knows what is under the mouse one frame later
  }
  void Click(double x, double y) {
    MoveTo(x, y);
    Handle({.kind = InputEvent::Kind::kPress, .code = 0});
    Handle({.kind = InputEvent::Kind::kRelease, .code = 0});
    Frames();
  }
  void Drag(double x, double y, double to_x, double to_y) {
    MoveTo(x, y);
    Handle({.kind = InputEvent::Kind::kPress, .code = 0});
    for (int i = 1; i <= 4; ++i) {
      Handle(
          {.kind = InputEvent::Kind::kMove, .x = x + 0.25 * i * (to_x - x), .y = y + 0.25 * i * (to_y - y)});
    }
    Handle({.kind = InputEvent::Kind::kRelease, .code = 0});
    Frames();
  }
  void Key(int code) {
    Handle({.kind = InputEvent::Kind::kKeyDown, .code = code});
    Handle({.kind = InputEvent::Kind::kKeyUp, .code = code});
  }

  cv::Mat Picture() {
    Frames();
    glBindFramebuffer(GL_FRAMEBUFFER, buffer_);
    return ReadFramebuffer(size_);
  }

  const ViewerState& State() const { return viewer->State(); }

 private:
  OffscreenContext context_;
  cv::Size size_;
  unsigned buffer_ = 0;
  unsigned texture_ = 0;

 public:
  std::unique_ptr<Viewer> viewer;  // after its context
};

}  // namespace sqslam::viewer
