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

// Position of a panel in the window.
enum class Place {
  kScene,   // the large view; one panel
  kSide,    // a tab of the column on the right
  kTop,     // above the tabs of that column
  kBottom,  // across the window; one panel
  kOver,    // on top: dialogs and messages, in windows of their own
};

// One part of the window. To add one: a file in panels/, its Make function below, and its place in
// AllPanels() of the viewer.
class Panel {
 public:
  // The state must outlive the panel.
  Panel(Place where, std::string name, ViewerState& s) : place(where), title(std::move(name)), state_(s) {}
  virtual ~Panel() = default;
  Panel(const Panel&) = delete;
  Panel& operator=(const Panel&) = delete;

  virtual bool Wanted() const { return true; }

  // Called once a frame inside an ImGui window (kOver: outside any).
  virtual void Draw() = 0;

  // Returns true if its content still changes by itself and must be drawn again soon.
  virtual bool Busy() const { return false; }

  const Place place;
  const std::string title;  // title of its tab

 protected:
  ViewerState& state_;
  const Document& document_ = state_.document;
  Playback& playback_ = state_.playback;
  Selection& selection_ = state_.selection;
  SceneView& view_ = state_.view;
  Layers& layers_ = state_.layers;
  Editing& editing_ = state_.editing;
  WindowState& window_ = state_.window;
  Messages& messages_ = state_.messages;
  std::vector<Request>& requests_ = state_.requests;
  const EditContext context_ = state_.Editor();
};

using PanelPtr = std::unique_ptr<Panel>;

// Each creates a panel. The scene and the image need an OpenGL context, also to be destroyed.
PanelPtr MakeScenePanel(ViewerState& s);
PanelPtr MakeImagePanel(ViewerState& s);
PanelPtr MakeObjectsPanel(ViewerState& s);
PanelPtr MakeInspectorPanel(ViewerState& s);
PanelPtr MakeViewPanel(ViewerState& s);
PanelPtr MakeAnnotationPanel(ViewerState& s);
PanelPtr MakePicturePanel(ViewerState& s);
PanelPtr MakeTimelinePanel(ViewerState& s);
PanelPtr MakeDialogs(ViewerState& s);

// Marks over the scene and the image: selection, input camera, measurements, solids and their mouse handling.

// Draws all marks over the scene. `origin`: its top-left corner on the screen, pixels.
void DrawSceneMarks(const EditContext& context, const WindowState& window, ImVec2 origin);

// Handles the mouse if annotating needs it; returns true if the scene must ignore it. `hovered`: the mouse is
// over the scene. Must be called while the scene's button is ImGui's last item.
bool AnnotateWithMouse(const EditContext& context, const WindowState& window, ImVec2 origin, bool hovered);

// Draws the edges of the solids over the image of the present frame. `at` maps image pixels to the screen.
void DrawImageMarks(const EditContext& context, const WindowState& window,
                    const std::function<ImVec2(const Eigen::Vector2d&)>& at);

// Areas of the parts, pixels of the window; empty if they don't fit.
struct Layout {
  cv::Rect2d scene, top, side, bottom;
  cv::Rect2d side_line, bottom_line, top_line;  // dividers, dragged with the mouse
};

// `scale`: window pixels per pixel of the settings. The space of hidden parts goes to the others; in small
// windows the scene keeps its share.
Layout LayOut(cv::Size window, double menu_height, const LayoutSettings& settings, bool has_bottom,
              bool has_top, double scale);

// Draws the whole window into ImGui's frame: the menu, the panels in their places, the dividers.
void DrawWindow(ViewerState& state, const std::vector<PanelPtr>& panels, cv::Size size);

}  // namespace sqslam::viewer
