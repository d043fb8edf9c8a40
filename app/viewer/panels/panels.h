#pragma once

#include <imgui.h>

#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// The place of a panel in the window.
enum class Place {
  kScene,   // the large view; one panel
  kSide,    // a tab of the column on the right
  kTop,     // above the tabs of that column
  kBottom,  // across the window; one panel
  kOver,    // over all: dialogs and messages; draws windows of its own
};

// One part of the window. Holds the parts of the state that it shows or changes, which outlive it. To add
// one: a file in panels/, its Make function below, and its place among AllPanels() of the viewer.
class Panel {
 public:
  Panel(Place where, std::string name) : place(where), title(std::move(name)) {}
  virtual ~Panel() = default;
  Panel(const Panel&) = delete;
  Panel& operator=(const Panel&) = delete;

  virtual bool Wanted() const { return true; }

  // Called once a frame inside an ImGui window (kOver: outside of any).
  virtual void Draw() = 0;

  // True if what it shows still changes by itself, so that the window must be drawn again soon.
  virtual bool Busy() const { return false; }

  const Place place;
  const std::string title;  // of its tab
};

using PanelPtr = std::unique_ptr<Panel>;

// Each hands its panel the parts of the state that it works on. The scene and the image need an OpenGL
// context, here and when they are destroyed.
PanelPtr MakeScenePanel(ViewerState& s);
PanelPtr MakeImagePanel(ViewerState& s);
PanelPtr MakeObjectsPanel(ViewerState& s);
PanelPtr MakeInspectorPanel(ViewerState& s);
PanelPtr MakeViewPanel(ViewerState& s);
PanelPtr MakeAnnotationPanel(ViewerState& s);
PanelPtr MakePicturePanel(ViewerState& s);
PanelPtr MakeTimelinePanel(ViewerState& s);
PanelPtr MakeHelpPanel(ViewerState& s);
PanelPtr MakeOpenPanel(ViewerState& s);
PanelPtr MakeSettingsPanel(ViewerState& s);
PanelPtr MakeUnsavedPanel(ViewerState& s);  // asks what becomes of changes
PanelPtr MakeMessagesPanel(ViewerState& s);

// Marks over the scene and over the image: the selection, the input camera, measurements, and what editing
// draws there and does with the mouse.

// Draws all marks over the scene. `origin`: its top-left corner on the screen, pixels.
void DrawSceneMarks(const EditContext& context, const WindowState& window, ImVec2 origin);

// Takes the mouse where annotating needs it; true where the scene must leave it alone then. `hovered`: the
// mouse is over the scene; to be called while the scene's button is ImGui's last item.
bool AnnotateWithMouse(const EditContext& context, const WindowState& window, ImVec2 origin, bool hovered);

// Draws the edges of the solids over the image of the present frame. `at` leads from its pixels to the
// screen.
void DrawImageMarks(const EditContext& context, const WindowState& window,
                    const std::function<ImVec2(const Eigen::Vector2d&)>& at);

// The parts, pixels of the window; empty where they don't fit.
struct Layout {
  cv::Rect2d menu, scene, top, side, bottom;
  cv::Rect2d side_line, bottom_line, top_line;  // that the mouse takes hold of
};

// `scale`: pixels for one of the settings'. Parts that are not wanted leave their place to the others; small
// windows keep the scene.
Layout LayOut(cv::Size window, double menu_height, const LayoutSettings& settings, bool has_bottom,
              bool has_top, double scale);

// Draws the whole window into ImGui's frame: the menu, the panels in their places, the lines between them.
void DrawWindow(ViewerState& state, const std::vector<PanelPtr>& panels, cv::Size size);

}  // namespace sqslam::viewer
