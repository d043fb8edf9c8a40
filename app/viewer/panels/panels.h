#pragma once

#include <imgui.h>

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
// one: a file in panels/, its Make function below, and a line in Viewer's constructor.
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

// Needs an OpenGL context, here and when it is destroyed; so does the image.
PanelPtr MakeScenePanel(const EditContext& context, SceneView& view, const Layers& layers,
                        const WindowState& window);
PanelPtr MakeImagePanel(const EditContext& context, const WindowState& window);
PanelPtr MakeObjectsPanel(const EditContext& context, WindowState& window);
PanelPtr MakeInspectorPanel(const EditContext& context, Playback& playback, const WindowState& window);
PanelPtr MakeViewPanel(const Document& document, SceneView& view, Layers& layers, Messages& messages);
PanelPtr MakeAnnotationPanel(const EditContext& context, Observed<SceneStyle>& style);
PanelPtr MakePicturePanel(const Document& document, SceneView& view, WindowState& window, Requests& requests);
PanelPtr MakeTimelinePanel(const Document& document, Playback& playback, const WindowState& window,
                           Requests& requests);
PanelPtr MakeHelpPanel(WindowState& window, const std::vector<Shortcut>& shortcuts);
PanelPtr MakeSettingsPanel(Preferences& preferences, SceneView& view, WindowState& window,
                           Messages& messages);
PanelPtr MakeUnsavedPanel(const EditContext& context, Requests& requests);  // asks what becomes of changes
PanelPtr MakeMessagesPanel(Messages& messages, const SceneView& view, const WindowState& window);

// The parts, pixels of the window; empty where they don't fit.
struct Layout {
  cv::Rect2d menu, scene, top, side, bottom;
  cv::Rect2d side_line, bottom_line, top_line;  // that the mouse takes hold of
};

// `scale`: pixels for one of the settings'. Parts that are not wanted leave their place to the others; small
// windows keep the scene.
Layout LayOut(cv::Size window, double menu_height, const LayoutSettings& settings, bool has_bottom,
              bool has_top, double scale);

// After one of the lines was moved by so many pixels; kept within what makes sense for the window.
LayoutSettings MoveSide(LayoutSettings settings, double pixels, cv::Size window, double scale);
LayoutSettings MoveBottom(LayoutSettings settings, double pixels, cv::Size window, double scale);
LayoutSettings MoveTop(LayoutSettings settings, double pixels, cv::Size window, double scale);

// Draws the whole window into ImGui's frame: the menu, the panels in their places, the lines between them.
void DrawWindow(ViewerState& state, const std::vector<PanelPtr>& panels, cv::Size size);

}  // namespace sqslam::viewer
