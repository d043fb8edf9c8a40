#pragma once

#include <memory>
#include <opencv2/core.hpp>

#include "render/camera/camera_path.h"
#include "render/camera/scene_framing.h"
#include "render/scene/style.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// True if both cameras see the same.
bool SameView(const ViewCamera& a, const ViewCamera& b);

// The scene of the pictures for programs with a window: a map drawn into a texture of the OpenGL context that
// is current where this is made, used and destroyed. Draws anew only what has changed.
class InteractiveScene {
 public:
  enum class Detail {
    kDraft,  // one sample a pixel and no effects on the finished picture: while something moves
    kFine,   // as the style says
  };

  InteractiveScene();
  ~InteractiveScene();
  InteractiveScene(InteractiveScene&&) noexcept;

  // Throws UsageError on values that make no sense; the style before then stays.
  void SetStyle(const SceneStyle& style);

  // Scale of frusta, place of the grid, light and colours of classes come from this map.
  void SetFrame(const MapSnapshot& map);

  // Sets the map to draw; null: nothing.
  void Show(MapSnapshotPtr map);

  // Draws these with the map, in its frame.
  void SetLayers(const SceneLayers& layers);

  // Cuts as this says, not as the style does; unlike a new style at no cost.
  void SetClip(const SceneStyle::Clip& clip);

  // Draws no background: colours are multiplied by their alpha then. For something to be laid beneath.
  void SetTransparent(bool transparent);

  const SceneFocus& Focus() const;
  const LabelColors& Colors() const;

  // The name of the texture (bottom row first), or 0 for a window without size. Sides up to 8192 pixels.
  unsigned Draw(const ViewCamera& camera, cv::Size size, Detail detail);

  // Legend, axes and names as pictures of that size have them: 8UC4, straight alpha, top row first.
  cv::Mat Texts(const ViewCamera& camera, cv::Size size) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
