#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "render/figures/figures.h"
#include "slam/io/input_images.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"
#include "slam/system_options.h"

// Reads results for figures, and puts images on their pages. Reading throws InputError or UsageError that
// says what is missing or wrong.
namespace sqslam {

// Help texts that several figures share.
inline constexpr const char* kMapOfARun = "Result folder of sqslam run, or its map.sqmap";
inline constexpr const char* kNameInLegend = "Name in the legend; repeated for each result, in their order";
inline constexpr const char* kKeyframeShown = "Keyframe whose image is shown";

// A name for each result: those asked for, or the last folder names.
std::vector<std::string> ResultNames(const FigureRequest& request);

// "0.1,0.5,1" to numbers; `option` is named in errors.
std::vector<double> ParseNumberList(const std::string& option, const std::string& text);

// A recording of a run with its last map and the images that it was made from.
struct RecordedMap {
  std::unique_ptr<RecordingReader> reader;
  MapSnapshotPtr last;
  std::shared_ptr<InputImages> images;
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
  MapSnapshotPtr moment;  // the state of the map after that frame
  Rigid3d T_map_camera;   // in the finished map
  Box2d box;              // the detector's, distorted px
};

// By object id and frame: the frames among the keyframes of the last map, whose poses the end of the run
// knows, with images that are still there. Of long runs an even share, or all.
std::map<int, std::vector<ObjectView>> ObjectViews(const RecordedMap& map, bool all);

// The views of the frame that is asked for, or all. Throws an InputError that lists the frames there are.
std::vector<ObjectView> ViewsOfFrame(const std::vector<ObjectView>& views, const FigureRequest& request,
                                     const std::string& what);

// The image of a view as the map's camera took it. Throws InputError where it cannot be read.
cv::Mat ImageOf(const ObjectView& view, const RecordedMap& map);

// Quarter turns clockwise after which up in the map is up in the image; 0 where the camera looks down or
// gravity is not known.
int UprightTurns(const ObjectView& view, const MapSnapshot& map);

// A three-quarter view from the keyframes' side that holds all solids, and those points that are no farther
// from the first than `reach` half diagonals of it.
ViewCamera EyeOn(const MapSnapshot& map, const std::vector<PosedSuperquadric>& solids,
                 const std::vector<Eigen::Vector3d>& points, double reach, double aspect);

// Fills the place of an image that is missing.
void DrawNoImage(FigurePage& page, const FigureRect& area, const FigureTheme& theme);

// A part of an image on a page, with the place on the page of what lies on the image.
class ImageCrop {
 public:
  // The part of the image around `region` (pixels), widened to the panel's shape as far as the image goes,
  // turned by quarter turns clockwise and fitted into the panel.
  ImageCrop(const cv::Mat& image, const Box2d& region, int quarter_turns, const FigureRect& panel);

  void Draw(FigurePage& page) const { page.Image(image_, area_); }
  const FigureRect& Area() const { return area_; }
  Eigen::Vector2d ToPage(const Eigen::Vector2d& pixel) const;
  bool Contains(const Eigen::Vector2d& pixel) const;
  // The part of a line between pixels that is shown.
  void DrawLine(FigurePage& page, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                const FigureStroke& stroke) const;

 private:
  cv::Mat image_;  // cut and turned
  cv::Rect cut_;   // of the image, before the turn
  int turns_ = 0;  // 0 to 3
  FigureRect area_;
};

}  // namespace sqslam
