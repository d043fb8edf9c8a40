#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "render/gl/offscreen_context.h"
#include "render/page/page.h"
#include "render/picture/picture.h"
#include "render/scene/style.h"

namespace sqslam {

// Options of all figures. Each figure has a default width (of a column or a page) and a height that depends
// on its content; both can be overridden.
struct FigureOptions {
  std::optional<double> width_mm;
  std::optional<double> height_mm;
  // Width and height of the PNG; without dpi, the default width is divided into this many pixels.
  std::optional<std::array<int, 2>> pixels;
  std::optional<double> dpi;  // pixels per inch; default 300
  std::string title;          // above the figure; empty: none
  double font_size = 8.0;     // points
  bool transparent = false;   // no background
  RenderBackend backend = RenderBackend::kAuto;
  SceneStyle style;                                   // background and text colour, and how maps are drawn
  CameraOverrides camera;                             // for figures with maps
  std::function<void(int done, int total)> progress;  // of pictures; may be null

  void Tell(int done, int total) const {
    if (progress) {
      progress(done, total);
    }
  }
};

// Throws UsageError on sizes that are out of range or contradict each other.
void CheckFigureOptions(const FigureOptions& options);

inline constexpr double kColumnWidth = 252.0;  // points: one column of a two-column paper, 88.9 mm
inline constexpr double kTextWidth = 516.0;    // points: both columns, 182 mm

// Colours and sizes of lines and texts, derived from the options.
struct FigureTheme {
  Eigen::Vector3d background;
  Eigen::Vector3d ink;    // texts
  Eigen::Vector3d muted;  // axes and less important texts
  Eigen::Vector3d faint;  // grid lines
  double font = 8.0;      // points
  double small = 7.0;     // points: tick labels, legends
  double title = 9.5;     // points

  explicit FigureTheme(const FigureOptions& options);
  FigureStroke Axis() const { return {muted, 0.6, {}}; }
  FigureStroke Grid() const { return {faint, 0.5, {}}; }
};

// A page and the part left for the figure, inside the margin and below the title.
struct FigureSheet {
  FigurePage page;
  FigureRect area;
  FigureTheme theme;
};

// Makes a page; `own_width` (points) and `own_height` apply if the options give none. `own_height` is called
// with the width inside the margins. Throws UsageError if there is no room.
FigureSheet MakeSheet(const FigureOptions& options, double own_width, const std::string& description,
                      const std::function<double(double width, const FigureTheme& theme)>& own_height);

// Panels of equal size in rows and columns, optionally with an image above each. Points.
struct PanelGrid {
  int columns = 1;
  int rows = 1;
  double gap = 5.0;    // between panels, and below their images
  double left = 0.0;   // beside the first column
  double top = 0.0;    // above the first row
  double width = 0.0;  // of each panel
  double image = 0.0;  // height of the images; 0: none
  double height = 0.0;
  double texts = 0.0;       // below each panel
  double below = 0.0;       // below all panels
  bool images_grow = true;  // if the page is higher than needed

  // Makes columns that share the width.
  static PanelGrid Of(int columns, int rows, double width, double left = 0.0);

  double RowHeight() const { return (image > 0.0 ? image + gap : 0.0) + height + texts; }
  double Height() const { return top + rows * RowHeight() + (rows - 1) * gap + below; }
};

struct PanelSheet : FigureSheet {
  PanelGrid grid;

  FigureRect ImageAt(int row, int column) const;
  FigureRect PanelAt(int row, int column) const;
  FigureRect Below() const { return {area.x, area.Bottom() - grid.below, area.width, grid.below}; }

  // Draw names above the first row and, rotated, at the left of the first column.
  void NameColumn(int column, const std::string& name);
  void NameRow(int row, const std::string& name);
};

// Makes a page of panels, whose heights are changed to fill it. `lay_out` is called with the width inside the
// margins. Throws UsageError if there is no room.
PanelSheet MakePanelSheet(const FigureOptions& options, double own_width, const std::string& description,
                          const std::function<PanelGrid(double width, const FigureTheme& theme)>& lay_out);

// Returns options for pictures in the panels of a page, without texts.
PictureOptions PanelOptions(const FigureOptions& options, const PanelSheet& sheet);

// Places the picture unscaled, with its top-left corner on the pixel nearest to the area's.
void PlacePanel(FigurePage& page, const cv::Mat& picture, const FigureRect& area);

}  // namespace sqslam
