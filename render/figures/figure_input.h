#pragma once

#include <Eigen/Geometry>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "render/figures/figures.h"
#include "render/page/chart.h"
#include "slam/io/input_images.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"
#include "slam/system_options.h"

// Reads results for figures and places images on their pages. Reading throws InputError or UsageError
// that names the missing or wrong input.
namespace sqslam {

// Help texts that several figures share.
inline constexpr const char* kMapHelp = "Result folder of sqslam run, or its map.sqmap";
inline constexpr const char* kKeyframeHelp = "Keyframe whose image is shown";

// Returns a name for each result: the requested ones, or the last folder names.
std::vector<std::string> ResultNames(const FigureRequest& request);

// Margin of the image around an object's box, share of the box's longer side.
inline constexpr double kBoxMargin = 0.35;

// Parses "0.1,0.5,1"; `option` is named in errors.
std::vector<double> ParseNumberList(const std::string& option, const std::string& text);

// A recording of a run, its last map and its input images.
struct RecordedMap {
  std::unique_ptr<RecordingReader> reader;
  MapSnapshotPtr last;
  std::shared_ptr<InputImages> images;
};
RecordedMap OpenMap(const FigureRequest& request, const std::string& result);

// The same, but throws InputError if the map has no objects.
RecordedMap OpenObjectMap(const FigureRequest& request, const std::string& result);

// Returns the configuration of the run; the defaults if another version of the program recorded it.
SystemOptions ConfigOf(const RecordingReader& reader);

// Throws InputError that lists the objects if there is none with this id.
const SnapshotObject& ObjectById(const MapSnapshot& map, int id, const std::string& result);

// Returns the reliable objects, or all objects if none is reliable.
std::vector<const SnapshotObject*> ReliableObjects(const MapSnapshot& map);

// A frame in which an object was detected.
struct ObjectView {
  MapSnapshotPtr moment;  // the state of the map after that frame
  Rigid3d T_map_camera;   // in the finished map
  Box2d box;              // the detector's, distorted px
};

// Returns, by object id, the views in keyframes of the last map (whose final poses are known) with images
// that still exist. Without `all`, long runs are subsampled evenly.
std::map<int, std::vector<ObjectView>> ObjectViews(const RecordedMap& map, bool all);

// Returns the views of an object in the requested frame, or all of them if none is requested. Throws
// InputError that lists the frames if there is no such view.
std::vector<ObjectView> ViewsOfFrame(const std::map<int, std::vector<ObjectView>>& all_views, int id,
                                     const FigureRequest& request, const std::string& what);

// Returns the image of a view at the camera's size, with lens distortion. Throws InputError if it cannot be
// read.
cv::Mat ImageOf(const ObjectView& view, const RecordedMap& map);

// Returns the clockwise quarter turns that put the map's up direction on top; 0 if the camera looks down
// or gravity is not known.
int UprightTurns(const ObjectView& view, const MapSnapshot& map);

// Returns a three-quarter view from the keyframes' side that contains all solids and the points within
// `reach` half diagonals of the first solid.
ViewCamera EyeOn(const MapSnapshot& map, const std::vector<PosedSuperquadric>& solids,
                 const std::vector<Eigen::Vector3d>& points, double reach, double aspect);

// Draws objects from above, in their order, and over all of them their names: in those with room for it,
// beside the others. `room`: part of the page that they may cover. Returns the objects whose names are far
// from them (FigureNames::Draw).
std::vector<std::size_t> DrawFootprints(FigureSheet& sheet, const PlotArea& plot, const FigureRect& room,
                                        const std::vector<TrajectoryFigure::Footprint>& objects);

// Draws a placeholder for a missing image.
void DrawNoImage(FigureSheet& sheet, const FigureRect& area);

// A part of an image on a page.
class ImageCrop {
 public:
  // Cuts out `region` (pixels), extended to the panel's shape as far as the image reaches, turned by quarter
  // turns clockwise and fitted into the panel.
  ImageCrop(const cv::Mat& image, const Box2d& region, int quarter_turns, const FigureRect& panel);

  void Draw(FigurePage& page) const { page.Image(image_, area_); }
  const FigureRect& Area() const { return area_; }
  Eigen::Vector2d ToPage(const Eigen::Vector2d& pixel) const { return page_from_pixel_ * pixel; }
  bool Contains(const Eigen::Vector2d& pixel) const;
  // Draws the visible part of a line between pixels.
  void DrawLine(FigurePage& page, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                const FigureStroke& stroke) const;

 private:
  cv::Mat image_;  // cut out and turned
  FigureRect area_;
  Eigen::Affine2d page_from_pixel_;
};

}  // namespace sqslam
