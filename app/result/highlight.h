#pragma once

#include <filesystem>
#include <set>
#include <string>

#include "app/result/map_input.h"
#include "render/gl/offscreen_context.h"
#include "render/picture/picture.h"
#include "render/scene/object_look.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam::app {

// Draws the chosen objects (indices in the map) with names, all others as faint outlines. The chosen ones are
// solids, or glass in the dense cloud of the recording if it has one. Throws UsageError on a style out of
// range, InputError if a file cannot be read or written.
inline void DrawHighlighted(const MapSnapshot& map, const std::filesystem::path& recording,
                            const std::set<int>& chosen, const SceneStyle& style, RenderBackend backend,
                            const std::filesystem::path& file) {
  PictureOptions options;
  options.backend = backend;
  options.style = style;
  options.layers = ReadLayers({}, RecordingReader(recording), recording, style);
  options.style.objects.look =
      options.layers.dense_cloud || options.layers.dense_mesh ? ObjectLook::kGlass : ObjectLook::kSolid;
  options.style.objects.labels = true;
  options.style.text.legend = false;  // it would count the outlines as uncertain
  WritePicture(file, RenderPicture(Highlighted(map, chosen), options));
}

}  // namespace sqslam::app
