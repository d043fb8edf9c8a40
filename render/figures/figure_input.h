#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/figures/figure.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"
#include "slam/system_options.h"

// Reads what figures show from results. All throw InputError or UsageError that says what is missing or
// wrong.
namespace sqslam {

// Help texts that several figures share.
inline constexpr const char* kMapOfARun = "Result folder of sqslam run, or its map.sqmap";
inline constexpr const char* kNameInLegend = "Name in the legend; repeated for each result, in their order";
inline constexpr const char* kKeyframeShown = "Keyframe whose image is shown";

// A name for each result: those asked for, or the last folder names.
std::vector<std::string> ResultNames(const FigureRequest& request);

// "0.1,0.5,1" to numbers; `option` is named in errors.
std::vector<double> ParseNumberList(const std::string& option, const std::string& text);

// A recording of a run with its last map.
struct RecordedMap {
  std::unique_ptr<RecordingReader> reader;
  MapSnapshotPtr last;
};
RecordedMap OpenMap(const std::string& result);

// The same for figures of objects: refuses a map without any.
RecordedMap OpenObjectMap(const std::string& result);

// The configuration of the run; the defaults where it is that of another version of the program.
SystemOptions ConfigOf(const RecordingReader& reader);

// Throws an InputError that lists the objects there are.
const SnapshotObject& ObjectById(const MapSnapshot& map, int id, const std::string& result);

// A frame in which an object was detected.
struct ObjectView {
  std::int64_t frame_index = 0;
  std::string image_path;
  Rigid3d T_map_camera;  // in the finished map
  Box2d box;             // the detector's, distorted px
};

// By object id and frame: the frames among the keyframes of the last map, whose poses the end of the run
// knows, with images that are still there. Of long runs an even share, or all.
std::map<int, std::vector<ObjectView>> ObjectViews(const RecordedMap& map, bool all);

// The views of the frame that is asked for, or all. Throws an InputError that lists the frames there are.
std::vector<ObjectView> ViewsOfFrame(const std::vector<ObjectView>& views, const FigureRequest& request,
                                     const std::string& what);

// The image of a view as the map's camera took it.
cv::Mat ImageOf(const ObjectView& view, const Camera& camera);

// Quarter turns clockwise after which up in the map is up in the image; 0 where the camera looks down or
// gravity is not known.
int UprightTurns(const ObjectView& view, const MapSnapshot& map);

}  // namespace sqslam
