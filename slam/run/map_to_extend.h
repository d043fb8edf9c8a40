#pragma once

#include <filesystem>

#include "slam/geometry/camera.h"
#include "slam/io/sequence.h"
#include "slam/snapshot/saved_map.h"
#include "slam/system_options.h"

namespace sqslam {

// A saved map with the options of the run that made it.
struct MapToExtend {
  std::filesystem::path recording;
  SavedMap map;
  SystemOptions options;
};

// Returns the options that a result was made with. Throws InputError.
SystemOptions OptionsOfRun(const std::filesystem::path& result);

// `result`: a result folder or its map.sqmap. Throws InputError if it has no usable map.
MapToExtend ReadKnownMap(const std::filesystem::path& result);

// Returns the map's camera in pixels of the images in the files, as camera.yaml beside the recording has it.
Camera CameraInFiles(const MapToExtend& map);

// Throws InputError that names `source` if its camera is not the map's: another size, or a calibration that
// differs by more than a run would refine it.
void CheckSameCamera(const std::filesystem::path& source, const Camera& camera, const MapToExtend& map);

// Opens a sequence to be located in the map, resized to its frames unless the request says otherwise. An
// uncalibrated camera is assumed to be the map's. Throws InputError as CheckSameCamera does.
Sequence OpenSequenceFor(const MapToExtend& map, const SequenceRequest& request);

// Lists the images of a map made from two sequences in RESULT/sequence (rgb.txt and camera.yaml), with the
// frame numbers and times of the map, so that a frame's image is found as in any other sequence. `camera`: of
// the map, in pixels of the images in the files. Returns that folder. If both are the same sequence with the
// same numbers, writes nothing and returns `first`; if one is a video or missing, returns an empty path:
// better no image than a wrong one.
std::filesystem::path WriteJoinedSequence(const std::filesystem::path& result,
                                          const std::filesystem::path& first,
                                          const std::filesystem::path& second, const AddedFrames& added,
                                          const Camera& camera);

// Writes boxes.txt of a map made from two sequences: the boxes of both results, those of the second at their
// times in the joined sequence. Writes nothing if neither has boxes. `result` may be `second`.
void WriteJoinedBoxes(const std::filesystem::path& result, const std::filesystem::path& first,
                      const std::filesystem::path& second, const AddedFrames& added);

}  // namespace sqslam
