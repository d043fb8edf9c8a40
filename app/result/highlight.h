#pragma once

#include <filesystem>
#include <set>
#include <string>

#include "render/gl/offscreen_context.h"
#include "render/picture/picture.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

// Draws the chosen objects (indices in the map) as solids with names, all others as faint outlines. Throws
// UsageError on a style out of range, InputError if the file cannot be written.
inline void DrawHighlighted(const MapSnapshot& map, const std::set<int>& chosen, const SceneStyle& style,
                            RenderBackend backend, const std::filesystem::path& file) {
  MapSnapshot shown = map;
  for (std::size_t i = 0; i < shown.objects.size(); ++i) {
    const bool is_chosen = chosen.contains(static_cast<int>(i));
    shown.objects[i].fit.reliability = is_chosen ? 1.0 : 0.0;  // those of 0 are drawn as faint outlines
    if (!is_chosen) {
      shown.objects[i].name = " ";
    }
  }
  PictureOptions options;
  options.backend = backend;
  options.style = style;
  options.style.objects.look = ObjectLook::kSolid;
  options.style.objects.labels = true;
  options.style.text.legend = false;  // it would count the outlines as uncertain
  WritePicture(file, RenderPicture(shown, options));
}

}  // namespace sqslam::app
