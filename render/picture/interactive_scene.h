#pragma once

#include <memory>
#include <opencv2/core.hpp>

#include "render/camera/camera_path.h"
#include "render/camera/scene_framing.h"
#include "render/scene/style.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Returns true if both cameras see the same.
bool SameView(const ViewCamera& a, const ViewCamera& b);

// Draws the scene of pictures in programs with a window: a map as a texture of the OpenGL context that must
// be current whenever this is created, used or destroyed. Redraws only what has changed.
class InteractiveScene {
 public:
  enum class Detail {
    kDraft,  // one sample per pixel and no screen-space effects, while something moves
    kFine,   // as the style specifies
  };

  InteractiveScene();
  ~InteractiveScene();

  // Throws UsageError on values out of range; the previous style then stays.
  void SetStyle(const SceneStyle& style);

  // Takes the scale of frusta, the place of the grid and the light from this map.
  void SetFrame(const MapSnapshot& map);

  void Show(MapSnapshotPtr map);

  // Sets layers in the map frame to draw with the map.
  void SetLayers(const SceneLayers& layers);

  // Overrides the style's clip plane; cheap, unlike a new style.
  void SetClip(const SceneStyle::Clip& clip);

  // Draws no background, with colours premultiplied by alpha, for use over other content.
  void SetTransparent(bool transparent);

  // Returns the name of the texture (bottom row first), or 0 if `size` is empty or has a side over 8192
  // pixels.
  unsigned Draw(const ViewCamera& camera, cv::Size size, Detail detail);

  // Draws legend, axes and names as in pictures of that size: 8UC4, straight alpha, top row first.
  cv::Mat Texts(const ViewCamera& camera, cv::Size size) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
